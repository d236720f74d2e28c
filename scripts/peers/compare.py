#!/usr/bin/env python3
"""Runs the peers that are installed beside our charts in FOLDER, writes FOLDER/peers.csv and its
picture, and prints both sides. Needs the CSV files of `leastaction chart` gradients, integrators, paths,
hnn, quantum and tape in FOLDER.

    scripts/peers/compare.py COMMAND [FOLDER] [--quick]

A row of peers.csv: job, peer, version, CPU seconds (one thread), ratio to ours, largest
relative difference of the result from ours where there is one to compare, what the time contains
(`CONTAINS`; else the job alone), and a note where we are behind. Ours are rows, too; those of ratio 1 are what others are divided by.
"""
import csv
import importlib.util
import io
import math
import pathlib
import shutil
import subprocess
import sys
import tempfile
import time

from draw import draw, draw_drift

HERE = pathlib.Path(__file__).parent
ACCURACIES = 1e-3, 1e-6, 1e-9
PACKET_ACCURACIES = 1e-2, 1e-3, 1e-4
COLUMNS = "job", "peer", "version", "seconds", "ratio", "difference", "contains", "note"
US, INTERPRETED, BY_HAND = "leastaction", "leastaction, interpreted", "C by hand"
ADAM_STEPS = 100
WIDTHS = {"200": "", "1000": " 1000"}  # of trainings, as in their names
CONTAINS = {  # what a time contains, by the beginning of a peer's name; compiling is in none
    "Enzyme": "the job, called in a loop in C",
    "JAX jit; loop": "the job, in a loop of one jit",
    "JAX": "the job and its dispatch from Python",
    "CasADi as C; loop": "the job, called in a loop in C",
    "CasADi": "the job and a call from Python",
    "PyTorch": "the job and its dispatch from Python",
    "SciPy": "steps and fields in Python",
    "heyoka": "all steps, one call from Python",
    "REBOUND": "all steps and the set-up, from Python",
    "COLNEW": "the solution, fields and slopes in C++",
    "NumPy": "array operations, called from Python",
}


def read(text):
    return list(csv.DictReader(line for line in io.StringIO(text) if not line.startswith("#")))


# ---- running peers ----


def run(name, command, **where):
    """Rows that it prints; none where it fails, which is said."""
    began = time.monotonic()
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **where)
    if done.returncode != 0:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        print(f"{name}: failed: {last}", file=sys.stderr)
    print(f"{name}: {time.monotonic() - began:.0f} s", file=sys.stderr)
    return done.stdout


def python(script, modules, *arguments):
    missing = [m for m in modules if importlib.util.find_spec(m) is None]
    if missing:
        print(f"{script}: skipped, {' and '.join(missing)} not installed", file=sys.stderr)
        return ""
    return run(script, [sys.executable, "-B", str(HERE / script), *arguments])


def compiled(script, package, *arguments):
    """Compiled where its package is; long tapes go to files where it runs."""
    compiler = shutil.which("c++") or shutil.which("g++")
    ask = ["pkg-config", "--modversion", package]
    version = subprocess.run(ask, capture_output=True, text=True) if shutil.which("pkg-config") else None
    if not compiler or version is None or version.returncode != 0:
        print(f"{script}: skipped, no C++ compiler or {package}", file=sys.stderr)
        return ""
    flags = subprocess.run(["pkg-config", "--cflags", "--libs", package], capture_output=True, text=True)
    return build(script, compiler, [f'-DPEER_VERSION="{version.stdout.strip()}"'], flags.stdout.split(), *arguments)


def build(script, compiler, defines, libraries, *arguments):
    with tempfile.TemporaryDirectory() as folder:
        program = f"{folder}/peer"
        words = [compiler, "-O2", "-DNDEBUG", "-march=native", "-std=c++17", *defines]
        built = subprocess.run([*words, str(HERE / script), *libraries, "-o", program])
        return run(script, [program, *arguments], cwd=folder) if built.returncode == 0 else ""


def colnew(script):
    """With COLNEW as it is part of Scilab, whose libraries need each other."""
    compiler, scilab = shutil.which("c++") or shutil.which("g++"), shutil.which("scilab-cli-bin")
    if not compiler or not scilab:
        print(f"{script}: skipped, no C++ compiler or scilab-cli", file=sys.stderr)
        return ""
    needs = subprocess.run(["ldd", scilab], capture_output=True, text=True).stdout.split()
    libraries = [word for word in needs if word.startswith("/") and "/libsci" in word]
    paths = {f"-Wl,-rpath,{pathlib.Path(word).parent}" for word in libraries}
    return build(script, compiler, [], ["-Wl,--no-as-needed,--allow-shlib-undefined", *paths, *libraries])


def peers(folder, quick):
    """job, peer, version, seconds, difference of every peer."""
    values, losses = (str(folder.resolve() / name) for name in ("gradients-values.csv", "hnn-losses.csv"))
    text = (
        python("gradients_torch.py", ["numpy", "torch"], values, *quick)
        + python("gradients_jax.py", ["numpy", "jax"], values, *quick)
        + python("gradients_enzyme.py", ["numpy", "jax", "enzyme_ad"], values, *quick)
        + python("gradients_casadi.py", ["numpy", "casadi"], values, *quick)
        + compiled("gradients_adolc.cpp", "adolc", values)
        + python("training_torch.py", ["numpy", "torch"], losses, *quick)
        + python("training_jax.py", ["numpy", "jax"], losses, *quick)
    )
    return [tuple(line.split(",")) for line in text.splitlines() if line.count(",") == 4]


# ---- seconds to an error: motions and packets ----


def at(rows, accuracy):
    """Seconds to err by `accuracy`, between two runs that enclose it; None: not reached."""
    last = None
    for row in rows:
        e, s = float(row["error"]), float(row["seconds"])
        if e <= accuracy:
            if last is None or e == 0:
                return s
            share = math.log(last[0] / accuracy) / math.log(last[0] / e)
            return last[1] * (s / last[1]) ** share
        last = e, s
    return None


def fastest(rows, accuracy):
    methods = dict.fromkeys(row["method"] for row in rows)
    times = {m: at([r for r in rows if r["method"] == m], accuracy) for m in methods}
    return min(((s, m) for m, s in times.items() if s is not None), default=(None, None))


def to_errors(kind, accuracies, ours, peers):
    """The fastest of every side at some errors, where it and ours get there; peers: name -> rows, version."""
    for problem in dict.fromkeys(row["problem"] for rows, _ in peers.values() for row in rows):
        for accuracy in accuracies:
            job = f"{kind} {problem} to {accuracy:.0e}".replace("e-0", "e-")
            seconds, _ = fastest([r for r in ours if r["problem"] == problem], accuracy)
            found = {
                peer: (*fastest([r for r in rows if r["problem"] == problem], accuracy), version)
                for peer, (rows, version) in peers.items()
            }
            if seconds and any(s for s, _, _ in found.values()):
                yield job, US, "", seconds, ""
            for peer, (s, method, version) in found.items():
                if seconds and s:
                    yield job, f"{peer} ({method.removeprefix(peer.lower() + ' ')})", version, s, ""


def version_of(module):
    return getattr(__import__(module), "__version__", "").split("+")[0]


def motions(folder, quick):
    theirs = read(python("scipy_ivp.py", ["numpy", "scipy"], *quick))
    theirs += read(python("motions_taylor.py", ["numpy", "scipy", "heyoka", "rebound"], *quick))
    ours = read((folder / "integrators.csv").read_text())
    peers = {}
    for peer in "SciPy", "heyoka", "REBOUND":
        rows = [r for r in theirs if r["method"].split()[0] == peer.lower()]
        peers[peer] = rows, rows and version_of(peer.lower())
    return list(to_errors("motion", ACCURACIES, ours, peers))


def boundaries(folder, quick):
    ours = read((folder / "boundaries.csv").read_text())
    scipy = read(python("boundaries_scipy.py", ["numpy", "scipy"], *quick))
    casadi = read(python("boundaries_casadi.py", ["numpy", "scipy", "casadi"], *quick))
    peers = {
        "SciPy": (scipy, scipy and version_of("scipy")),
        "CasADi": (casadi, casadi and version_of("casadi")),
        "COLNEW": (read(colnew("boundaries_colnew.cpp")), "Scilab"),
    }
    return list(to_errors("path", ACCURACIES, ours, peers))


def packets(folder, quick):
    theirs = read(python("quantum_numpy.py", ["numpy"], *quick))
    ours = read((folder / "quantum.csv").read_text())
    peers = {"NumPy": (theirs, theirs and version_of("numpy"))}
    return list(to_errors("packet", PACKET_ACCURACIES, ours, peers))


def scalars(folder, quick):
    """Recordings of scalars: record and first gradient, and the gradient again, per operation."""
    most = ["1e5"] if quick else []
    text = compiled("tape_adolc.cpp", "adolc", *most) + compiled("tape_cppad.cpp", "cppad", *most)
    theirs = (line.split(",") for line in text.splitlines() if line.count(",") == 6)
    ours = ([*list(r.values())[:2], US, "", *list(r.values())[2:5]] for r in read((folder / "tape.csv").read_text()))
    for program, n, peer, version, record, first, again in (*ours, *theirs):
        job = f"scalars {program} 1e{round(math.log10(float(n)))}"
        yield f"{job} once", peer, version, 1e-9 * (float(record) + float(first)), ""
        yield f"{job} again", peer, version, 1e-9 * float(again), ""


def pixels(command, quick):
    for row in read(python("pixels_torch.py", ["torch"], command, *quick)):
        yield f"training {row['model']} f32", US, "", 1e-3 * float(row["ours_ms"]), ""
        seconds = 1e-3 * float(row["torch_ms"])
        yield f"training {row['model']} f32", "PyTorch eager", version_of("torch"), seconds, ""


# ---- ours ----


def our_derivatives(row):
    """Of a row of gradients.csv; the compiled tape first, which others are divided by."""
    scene = row["scene"]
    for job, key in ("gradient", "gradient"), ("product", "product"):
        for peer, side in (US, "native"), (INTERPRETED, "tape"), (BY_HAND, "hand"):
            yield f"{job} {scene}", peer, "", 1e-9 * float(row[f"{side}_{key}_ns"]), ""
    steps = ADAM_STEPS * 1e-9 * float(row["native_adam_step_ns"])
    yield f"adam {scene}", US, "", steps, ""
    yield f"hessian {scene}", US, "", 1e-9 * float(row["hessian_blocks_ns"]), ""


def our_long_gradients(rows):
    for row in rows:
        n = float(row["slices"])
        job = f"gradient {row['scene']} {n:.0e}".replace("e+0", "e")
        for peer, side in (US, "native"), (INTERPRETED, "tape"):
            yield job, peer, "", 1e-9 * n * float(row[f"{side}_ns"]), ""


def our_training(rows):
    for row in rows:
        if row["threads"] == "1" and row["width"] in WIDTHS:
            job = f"training {row['model']} {row['precision']}{WIDTHS[row['width']]}"
            yield job, US, "", 1e-3 * float(row["step_ms"]), ""


# ---- the table ----


def note(ratio, peer):
    """By how much ours is behind, where it is."""
    if ratio >= 1 or peer in (US, BY_HAND, INTERPRETED):
        return ""
    return f"behind: ours takes {1 / ratio:.2f} times as long"


def table(rows):
    """Rows by job, in the order of jobs, ours first, with ratio and note."""
    rows = [(job, peer, version, float(s), difference) for job, peer, version, s, difference in rows]
    kinds = "gradient", "product", "hessian", "adam", "training", "motion", "path", "packet", "scalars"
    ours = {job: s for job, peer, _, s, _ in rows if peer == US}
    rows = [r for r in rows if r[0] in ours]
    jobs = list(dict.fromkeys(r[0] for r in rows))
    order = {job: (kinds.index(job.split()[0]), jobs.index(job)) for job in jobs}
    for job, peer, version, s, difference in sorted(rows, key=lambda r: order[r[0]]):
        ratio = s / ours[job]
        contains = next((text for name, text in CONTAINS.items() if peer.startswith(name)), "the job alone")
        values = job, peer, version, f"{s:.4g}", f"{ratio:.3g}", difference, contains, note(ratio, peer)
        yield dict(zip(COLUMNS, values))


def write(rows, folder):
    origin = [
        line
        for line in (folder / "gradients.csv").read_text().splitlines()
        if line.startswith("#")
    ]
    with open(folder / "peers.csv", "w", newline="") as out:
        print(*origin, sep="\n", file=out)
        print(f"# one thread; Python {sys.version.split()[0]}; ratio: times as long as ours", file=out)
        lines = csv.DictWriter(out, COLUMNS, lineterminator="\n")
        lines.writeheader()
        lines.writerows(rows)
    return "; ".join(line.split(": ", 1)[1] for line in origin[:3])


def show(rows):
    for row in rows:
        line = f"{row['job']:<28} {row['peer']:<26} {row['version']:<8} {float(row['seconds']):10.3g} s"
        line += f" {float(row['ratio']):10.3g} x  {row['difference']:>8}  {row['contains']:<38} {row['note']}"
        print(line.rstrip())
    behind = sum(bool(row["note"]) for row in rows)
    print(f"\n{len(rows)} rows, ahead or level in all but {behind}; ratio: times as long as ours")


def drifts(command, folder, quick):
    """Energies over many orbits, in a file and a picture of their own."""
    text = python("drift.py", ["numpy", "heyoka", "rebound"], command, *quick)
    if text:
        (folder / "drift-peers.csv").write_text(text)
        draw_drift(read(text), folder / "drift-peers")
        print("\n" + text.replace(",", "\t"))


def main():
    arguments = [a for a in sys.argv[1:] if not a.startswith("--")]
    quick = ["--quick"] if "--quick" in sys.argv else []
    command = str(pathlib.Path(arguments[0]).resolve())
    folder = pathlib.Path(arguments[1] if len(arguments) > 1 else "charts")
    version = subprocess.run([command, "--version"], stdout=subprocess.PIPE, text=True).stdout.split()
    try:
        rows = [r for row in read((folder / "gradients.csv").read_text()) for r in our_derivatives(row)]
        rows += our_long_gradients(read((folder / "gradients-sizes.csv").read_text()))
        rows += our_training(read((folder / "hnn-steps.csv").read_text()))
        rows += peers(folder, quick) + motions(folder, quick)
        rows += boundaries(folder, quick) + packets(folder, quick)
        rows += scalars(folder, quick)
    except OSError as e:
        sys.exit(f"{e.filename}: {e.strerror}; run `make charts` first")
    rows += pixels(command, quick)
    rows = [(j, p, version[-1] if p in (US, INTERPRETED) and version else v, s, d) for j, p, v, s, d in rows]
    rows = list(table(rows))
    draw(rows, folder / "peers", write(rows, folder))
    show(rows)
    drifts(command, folder, quick)


if __name__ == "__main__":
    main()
