"""The Lagrangians of `leastaction chart gradients`, for any array library with the functions of numpy:
each gives a function q, v [dof, n] -> L [n]. The objective is the mean over slices (and bodies) under
rule left+repeat.

Paths and what the derivatives are to be come from gradients-values.csv of that chart; peers print
rows job,peer,version,seconds,difference: the difference of a result from ours, relative to its
largest entry.
"""
import csv
import sys
import time

import numpy as np

SLICES, ADAM_STEPS = 100, 100
QUICK = "--quick" in sys.argv
GM = np.array(
    [132712440041.93938e9, 22031.86855e9, 324858.592e9, 398600.435436e9, 42828.375214e9]
)
G = 6.67430e-11


def of(xp, a):
    """An array of xp's own kind."""
    return (xp.tensor if hasattr(xp, "tensor") else xp.asarray)(a)


def squares_of(xp, bodies, dims):
    """A function that gives the squares of the distances of all pairs."""
    i, j = (of(xp, a) for a in np.triu_indices(bodies, 1))
    return lambda q: sum((q[dims * i + k] - q[dims * j + k]) ** 2 for k in range(dims))


def threebody(xp):
    squares = squares_of(xp, 3, 2)

    def L(q, v):
        r = xp.sqrt(squares(q) + 1e-6)
        return 0.5 * (v * v).sum(0) + 1.3e-4 * (1 / (r + 1e-6)).sum(0)

    return L


def dblpend(xp):
    def L(q, v):
        T = v[0] * v[0] + 0.5 * v[1] * v[1] + v[0] * v[1] * xp.cos(q[0] - q[1])
        return T + 2 * xp.cos(q[0]) + xp.cos(q[1])

    return L


def ephemeris(xp):
    i, j = np.triu_indices(5, 1)
    squares = squares_of(xp, 5, 3)
    mass = of(xp, np.repeat(GM, 3)[:, None] / G)
    pair = of(xp, (GM[i] * GM[j] / G)[:, None])
    return lambda q, v: 0.5 * (mass * v * v).sum(0) + (pair / xp.sqrt(squares(q))).sum(0)


def gas(xp):
    squares = squares_of(xp, 50, 2)

    def L(q, v):
        u = 0.04 * 0.04 / (squares(q) + 1e-6)
        u3 = u * u * u
        return 0.5 * (v * v).sum(0) - 1e-4 * (u3 * u3 - u3).sum(0)

    return L


# Lagrangian, dt, bodies that means are over, learning rate of the Adam job
scenes = {
    "threebody": (threebody, 0.5, 3, 5e-5),
    "dblpend": (dblpend, 0.06, 1, 2e-3),
    "ephemeris": (ephemeris, 86400.0, 5, 1e7),
    "gas": (gas, 0.2, 50, 8e-6),
}


def velocities(xp, x, dt):
    v = (x[:, 1:] - x[:, :-1]) / dt
    return xp.concatenate([v, v[:, -1:]], 1)


def objective(xp, name):
    make, dt, bodies, _ = scenes[name]
    L = make(xp)
    return lambda x: L(x, velocities(xp, x, dt)).sum() / (bodies * SLICES)


def values():
    """By scene: path x, vector u, gradient, product and end of Adam as ours are, [dof, slices]."""
    found = {}
    with open(sys.argv[1]) as lines:
        for row in csv.DictReader(line for line in lines if not line.startswith("#")):
            found.setdefault(row["scene"], []).append(
                [float(row[k]) for k in ("x", "u", "gradient", "product", "adam")]
            )
    return {name: np.array(rows).T.reshape(5, -1, SLICES) for name, rows in found.items()}


def median_seconds(run, longest):
    """Of the processor, the median over batches, for so many seconds; a batch is 20 ms or one call."""
    clock = time.process_time
    longest = 0.2 * longest if QUICK else longest
    run()
    began = clock()
    run()
    calls = max(1, int(0.02 / max(clock() - began, 1e-7)))
    times, started = [], clock()
    while not times or (clock() - started < longest and len(times) < 101):
        began = clock()
        for _ in range(calls):
            run()
        times.append((clock() - began) / calls)
    return sorted(times)[len(times) // 2]


def difference(ours, theirs):
    return np.abs(np.asarray(theirs) - ours).max() / np.abs(ours).max()


def report(job, peer, version, run, ours, get=np.asarray, calls=1):
    """Times run(), which does the job `calls` times, and compares get(run()) with ours (None: nothing)."""
    error = "" if ours is None else f"{difference(ours, get(run())):.2g}"
    print(f"{job},{peer},{version},{median_seconds(run, 0.5) / calls:.4g},{error}", flush=True)
