"""Random Lagrangians of 1 to 3 coordinates, with masses that vary, magnetic terms, time and kinks: the motion and its
events by `simulate --tol`, and stationary paths from a line by `path --tol`, beside SciPy's DOP853 at 3e-14 with the
derivatives of JAX. Exit status 1 if an error is larger than --tol where the command says it is not, or if events or
conjugate points are missing. Usage: random_lagrangians.py COMMAND [FIRST LAST]
"""

import json
import random
import subprocess
import sys
import tempfile
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
from scipy.integrate import solve_ivp

jax.config.update("jax_enable_x64", True)

# C and Python of a term: {a}, {b} are its operands
TERMS = [
    ("ad_add({a}, {b})", "({a} + {b})"),
    ("ad_sub({a}, {b})", "({a} - {b})"),
    ("ad_mul({a}, {b})", "({a} * {b})"),
    ("ad_sin({a})", "jnp.sin({a})"),
    ("ad_cos({a})", "jnp.cos({a})"),
    ("ad_tanh({a})", "jnp.tanh({a})"),
    ("ad_square({a})", "jnp.square({a})"),
    ("ad_exp(ad_sin({a}))", "jnp.exp(jnp.sin({a}))"),
    ("ad_sqrt(ad_add(1.0, ad_square({a})))", "jnp.sqrt(1.0 + {a} ** 2)"),
    ("ad_log(ad_add(1.5, ad_square({a})))", "jnp.log(1.5 + {a} ** 2)"),
    ("ad_div({a}, ad_add(1.2, ad_square({b})))", "({a} / (1.2 + {b} ** 2))"),
    ("ad_atan2({a}, ad_add(3.0, ad_cos({b})))", "jnp.arctan2({a}, 3.0 + jnp.cos({b}))"),
    ("ad_hypot({a}, ad_add(2.0, ad_sin({b})))", "jnp.hypot({a}, 2.0 + jnp.sin({b}))"),
    ("ad_pow(ad_add(1.1, ad_square({a})), N(0.7))", "((1.1 + {a} ** 2) ** 0.7)"),
]
KINKS = [
    ("ad_abs({a})", "jnp.abs({a})"),
    ("ad_max({a}, {b})", "jnp.maximum({a}, {b})"),
]
SCENE = """#include <physics/physics.h>
#define N(x) ad_add(x, ad_mul(0.0, ad_row(q, 0)))
static ad_var lagrangian(ad_var q, ad_var v, ad_var t, const void *params)
{
    (void)params, (void)t;
    return %s;
}
static enum ad_status start(const void *params, uint64_t seed, double *q, double *v, struct ad_error *error)
{
    (void)params, (void)seed, (void)error;
    %s
    return AD_OK;
}
static const char *const names[] = {%s};
const struct phys_scene leastaction_scene = {
    .version = PHYS_SCENE_VERSION, .size = sizeof(struct phys_scene), .name = "random", .what = "random",
    .dof = %d, .dims = %d, .coordinates = names, .unit = "m", .time_unit = "s", .energy_unit = "J",
    .lagrangian = lagrangian, .slices = 100, .dt = 0.1, .start = start};
"""


def term(rng, leaves, kinks, depth):
    """C and Python of a random expression."""
    if depth == 0 or rng.random() < 0.15:
        if rng.random() < 0.3:
            number = str(round(rng.uniform(0.2, 1.5), 3))
            return f"N({number})", number
        return rng.choice(leaves)
    form = rng.choice(TERMS + KINKS if kinks else TERMS)
    a, b = (term(rng, leaves, kinks, depth - 1) for _ in range(2))
    return tuple(form[k].format(a=a[k], b=b[k]) for k in range(2))


def added(terms):
    c = terms[0]
    for x in terms[1:]:
        c = f"ad_add({c}, {x})"
    return c


class Lagrangian:
    """L = sum of m_i(q) (v_i + 0.3 v_(i-1))^2 / 2 + v_0 A(q, t) - V(q, t) - 0.3 q^2."""

    def __init__(self, seed):
        rng = random.Random(seed)
        self.n = n = rng.choice([1, 1, 2, 3])
        self.kinks = rng.random() < 0.25
        place = [(f"ad_row(q, {i})", f"q[{i}]") for i in range(n)]
        field = [*place, ("t", "t")] if rng.random() < 0.4 else place
        kinetic, python = [], []
        for i in range(n):
            m = term(rng, place, self.kinks, 2)
            v = f"ad_row(v, {i})" if i == 0 else f"ad_add(ad_row(v, {i}), ad_mul(0.3, ad_row(v, {i - 1})))"
            kinetic.append(f"ad_mul(ad_add(0.8, ad_square({m[0]})), ad_square({v}))")
            python.append(f"(0.8 + {m[1]} ** 2) * (v[{i}]{f' + 0.3 * v[{i - 1}]' if i else ''}) ** 2")
        A, V = term(rng, field, self.kinks, 2), term(rng, field, self.kinks, 4)
        well = added([f"ad_mul(0.3, ad_square({x[0]}))" for x in place])
        self.c = (
            f"ad_sub(ad_sub(ad_add(ad_mul(0.5, {added(kinetic)}), ad_mul(ad_row(v, 0), {A[0]})), {V[0]}),\n        {well})"
        )
        self.python = f"0.5 * ({' + '.join(python)}) + v[0] * {A[1]} - {V[1]} - 0.3 * jnp.sum(q ** 2)"
        self.q = [round(rng.uniform(-1, 1), 3) for _ in range(n)]
        self.v = [round(rng.uniform(-1.5, 1.5), 3) for _ in range(n)]
        L = eval("lambda q, v, t: " + self.python, {"jnp": jnp})

        def rates(t, y):
            q, v = y[:n], y[n:]
            momentum = jax.grad(L, 1)
            _, drift = jax.jvp(lambda q, t: momentum(q, v, t), (q, t), (v, 1.0))
            return jnp.concatenate([v, jnp.linalg.solve(jax.hessian(L, 1)(q, v, t), jax.grad(L)(q, v, t) - drift)])

        def variations(t, y):
            return jnp.concatenate(
                [rates(t, y[: 2 * n]), (jax.jacfwd(rates, 1)(t, y[: 2 * n]) @ y[2 * n :].reshape(2 * n, n)).ravel()]
            )

        self.rates, self.variations = jax.jit(rates), jax.jit(variations)

    def motion(self, y, time, at, rates=None):
        rates = rates or self.rates
        step = 0.05 if self.kinks else np.inf
        return solve_ivp(
            lambda t, y: np.asarray(rates(t, y)),
            (0, time),
            np.array(y, float),
            "DOP853",
            at,
            rtol=3e-14,
            atol=1e-14,
            max_step=step,
        ).y

    def write(self, folder):
        start = " ".join(f"q[{i}] = {q}, v[{i}] = {v};" for i, (q, v) in enumerate(zip(self.q, self.v)))
        names = ", ".join(f'"x{i}"' for i in range(self.n))
        (folder / "scene.c").write_text(SCENE % (self.c, start, names, self.n, self.n))


def run(command, folder, *options):
    """Exit status, report and table."""
    table = folder / "out.csv"
    table.unlink(missing_ok=True)
    done = subprocess.run(
        [command, *options, "--json", "--quiet", "--csv", table.name], cwd=folder, capture_output=True, text=True
    )
    if done.returncode > 1:
        sys.exit(f"{' '.join(options)}: {done.stderr}")
    line = done.stdout.strip().split("\n")[-1]
    return done.returncode, json.loads(line) if line else None, table


def rows_of(table, n):
    d = np.genfromtxt(table, delimiter=",", names=True)
    return d["t"], np.array([d[f"x{i}"] for i in range(n)])


def check_motion(command, folder, L, tol=1e-8, time=10):
    status, report, table = run(
        command, folder, "simulate", "./scene.so", "--tol", f"{tol}", "--time", f"{time}", "--event", "x0=0"
    )
    if report is None or status:
        return "not reached"
    t, q = rows_of(table, L.n)
    t = np.minimum(t, time)
    wrong = []
    error = np.abs(L.motion(L.q + L.v, time, t)[: L.n] - q).max()
    if error > tol:
        wrong.append(f"error {error:.2g}, reported {report['error']:.2g}")
    x = L.motion(L.q + L.v, time, np.linspace(0, time, 200001))[0]
    crossings = int((x[1:] * x[:-1] < 0).sum())
    if crossings != len(report.get("events", [])):
        wrong.append(f"{len(report.get('events', []))} events of {crossings}")
    return "; ".join(wrong) and "WRONG: " + "; ".join(wrong)


def check_path(command, folder, L, rng, tol=1e-6):
    n = L.n
    time = round(rng.uniform(0.5, 6), 2)
    ends = [[round(rng.uniform(-1, 1), 2) for _ in range(n)] for _ in range(2)]
    said = [",".join(f"x{i}={x}" for i, x in enumerate(end)) for end in ends]
    how = ["path", "./scene.so", "--tol", f"{tol}", "--time", f"{time}", "--start", said[0], "--end", said[1]]
    status, report, table = run(command, folder, *how)
    if report is None or status:
        return "not found: " + " ".join(how[4:])
    t, q = rows_of(table, n)
    t = np.minimum(t - t[0], time)
    # shooting to the first slice, then further and further along the path, so that it stays this path
    v = (q[:, 1] - q[:, 0]) / t[1]
    identity = np.vstack([np.zeros((n, n)), np.eye(n)]).ravel()
    for k in range(1, len(t)):
        target = ends[1] if k == len(t) - 1 else q[:, k]
        for _ in range(20):
            y = L.motion(np.concatenate([ends[0], v, identity]), t[k], [t[k]], L.variations)[:, 0]
            miss = y[:n] - target
            if np.abs(miss).max() < 1e-11:
                break
            v = v - np.linalg.solve(y[2 * n :].reshape(2 * n, n)[:n], miss)
    if np.abs(miss).max() > 1e-9:
        return "not shot"
    at = np.linspace(0, time, 4001)
    y = L.motion(np.concatenate([ends[0], v, identity]), time, at, L.variations)
    fields = y[2 * n :].reshape(2 * n, n, -1)[:n].transpose(2, 0, 1)[5:]
    conjugate = int((np.diff(np.sign(np.linalg.det(fields))) != 0).sum())
    wrong = []
    exact = L.motion(np.concatenate([ends[0], v]), time, t)[:n]
    error = np.abs(exact - q).max()
    if error > tol:
        wrong.append(f"error {error:.2g}, estimate {report['error_estimate']:.2g}")
    if report.get("morse_index") not in (None, conjugate):
        wrong.append(f"index {report['morse_index']}, {conjugate} conjugate points")
    return "; ".join(wrong) and "WRONG: " + "; ".join(wrong) + " " + " ".join(how[4:])


def main():
    command = str(Path(sys.argv[1]).resolve())
    first, last = (int(x) for x in sys.argv[2:4]) if len(sys.argv) > 3 else (0, 20)
    said = {}
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for seed in range(first, last):
            L = Lagrangian(seed)
            L.write(folder)
            subprocess.run([command, "build", "scene.c", "--quiet"], cwd=folder, check=True)
            found = {"motion": [check_motion(command, folder, L)]}
            if not L.kinks:
                found["path"] = [check_path(command, folder, L, random.Random(1000 * (k + 1) + seed)) for k in range(4)]
            for job, results in found.items():
                for k, result in enumerate(results):
                    kind = (job, result.split(":")[0] or "right")
                    said[kind] = said.get(kind, 0) + 1
                    if result:
                        print(f"seed {seed}, {job} {k}, {L.n} coordinates: {result}", flush=True)
    for (job, kind), count in sorted(said.items()):
        print(f"{job}: {count} {kind}")
    sys.exit(any(kind == "WRONG" for _, kind in said))


if __name__ == "__main__":
    main()
