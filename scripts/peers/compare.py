#!/usr/bin/env python3
"""Runs the peers that are installed, puts them beside our charts in FOLDER/peers.csv, and prints
both sides. Needs integrators.csv, gradients.csv and hnn-steps.csv of `leastaction chart` in FOLDER.

    scripts/peers/compare.py [FOLDER] [--quick]
"""
import csv
import importlib.util
import io
import math
import pathlib
import subprocess
import sys

HERE = pathlib.Path(__file__).parent
ACCURACIES = 1e-3, 1e-6, 1e-9


def read(text):
    return list(csv.DictReader(line for line in io.StringIO(text) if not line.startswith("#")))


def run(script, modules, *arguments):
    missing = [m for m in modules if importlib.util.find_spec(m) is None]
    if missing:
        print(f"{script}: skipped, {' and '.join(missing)} not installed", file=sys.stderr)
        return []
    command = [sys.executable, str(HERE / script), *arguments]
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    if done.returncode != 0:
        print(f"{script}: failed with status {done.returncode}", file=sys.stderr)
        return []
    return read(done.stdout)


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
    return min(((s, m) for m, s in times.items() if s is not None), default=(None, "none"))


def cell(seconds, method, width):
    return f"{'-' if seconds is None else f'{seconds:.2e} s':>11} {method:<{width}}"


def print_motions(ours, theirs):
    print(f"\n{'problem':<10} {'error':>6}  {'leastaction':<24} {'SciPy':<24} {'ratio':>8}")
    for problem in dict.fromkeys(row["problem"] for row in ours):
        for accuracy in ACCURACIES:
            a, b = (
                fastest([r for r in rows if r["problem"] == problem], accuracy)
                for rows in (ours, theirs)
            )
            ratio = f"{b[0] / a[0]:8.1f}" if a[0] and b[0] else f"{'-':>8}"
            print(f"{problem:<10} {accuracy:6.0e} {cell(*a, 13)} {cell(b[0], b[1], 13)} {ratio}")


def print_gradients(ours, theirs):
    methods = list(dict.fromkeys(row["method"] for row in theirs))
    print(f"\n{'gradient':<10} {'by hand':>12} {'tape':>12}", *(f"{m:>22}" for m in methods))
    for row in ours:
        tape = 1e-9 * float(row["tape_gradient_ns"])
        line = f"{row['scene']:<10} {1e-3 * float(row['hand_gradient_ns']):9.2f} us {1e6 * tape:9.2f} us"
        for m in methods:
            for r in theirs:
                if (r["scene"], r["method"]) == (row["scene"], m):
                    s = float(r["seconds"])
                    line += f" {1e6 * s:9.1f} us = {s / tape:5.1f} x"
        print(line)


def one_thread(steps):
    """Seconds of a step of the published width by (model, precision)."""
    return {
        (r["model"], r["precision"]): 1e-3 * float(r["step_ms"])
        for r in steps
        if (r["threads"], r["width"]) == ("1", "200")
    }


def print_training(ours, theirs):
    methods = list(dict.fromkeys(r["method"] for r in theirs))
    print(f"\n{'training step':<14} {'leastaction':>12}", *(f"{m:>22}" for m in methods))
    for (model, precision), seconds in one_thread(ours).items():
        line = f"{model + ' ' + precision:<14} {1e3 * seconds:9.2f} ms"
        for m in methods:
            for r in theirs:
                if (r["model"], r["precision"], r["method"]) == (model, precision, m):
                    s = float(r["seconds"])
                    line += f" {1e3 * s:9.2f} ms = {s / seconds:5.2f} x"
        print(line)


def as_training(ours, theirs):
    rows = [(*key, "leastaction", s) for key, s in one_thread(ours).items()]
    rows += [(r["model"], r["precision"], r["method"], float(r["seconds"])) for r in theirs]
    return [
        {"problem": f"training {m} {p}", "method": name, "evaluations": 1, "seconds": f"{s:.6g}"}
        for m, p, name, s in rows
    ]


def as_motions(gradients, peers):
    """Gradients as rows of the same columns: seconds of one evaluation."""
    rows = [
        (f"gradient {r['scene']}", f"leastaction {side}", 1e-9 * float(r[f"{side}_gradient_ns"]))
        for r in gradients
        for side in ("tape", "hand")
    ] + [(f"gradient {r['scene']}", r["method"], float(r["seconds"])) for r in peers]
    return [
        {"problem": p, "method": m, "evaluations": 1, "seconds": f"{s:.6g}"} for p, m, s in rows
    ]


def print_packets(ours, theirs):
    """The fastest of either side at an error, where both know the problem."""
    print(f"\n{'packet':<10} {'error':>6}  {'leastaction':<30} {'NumPy':<24} {'ratio':>8}")
    for problem in dict.fromkeys(row["problem"] for row in theirs):
        for accuracy in 1e-2, 1e-3, 1e-4:
            a, b = (
                fastest([r for r in rows if r["problem"] == problem], accuracy)
                for rows in (ours, theirs)
            )
            ratio = f"{b[0] / a[0]:8.1f}" if a[0] and b[0] else f"{'-':>8}"
            print(f"{problem:<10} {accuracy:6.0e} {cell(*a, 19)} {cell(*b, 13)} {ratio}")


def main():
    arguments = [a for a in sys.argv[1:] if not a.startswith("--")]
    quick = ["--quick"] if "--quick" in sys.argv else []
    folder = pathlib.Path(arguments[0] if arguments else "charts")
    try:
        ours = read((folder / "integrators.csv").read_text())
        gradients = read((folder / "gradients.csv").read_text())
        steps = read((folder / "hnn-steps.csv").read_text())
    except OSError as e:
        sys.exit(f"{e.filename}: {e.strerror}; run `make charts` first")
    motions = run("scipy_ivp.py", ["numpy", "scipy"], *quick)
    others = run("gradients_torch.py", ["numpy", "torch"]) + run(
        "gradients_jax.py", ["numpy", "jax"]
    )
    training = run("training_torch.py", ["numpy", "torch"]) + run(
        "training_jax.py", ["numpy", "jax"]
    )
    with open(folder / "peers.csv", "w", newline="") as out:
        table = csv.DictWriter(out, ours[0].keys(), restval="")
        table.writeheader()
        table.writerows(ours + motions + as_motions(gradients, others))
        table.writerows(as_training(steps, training))
    if motions:
        print_motions(ours, motions)
    if others:
        print_gradients(gradients, others)
    if training:
        print_training(steps, training)
    packets = folder / "quantum.csv"
    if packets.exists() and (others := run("quantum_numpy.py", ["numpy"], *quick)):
        print_packets(read(packets.read_text()), others)


if __name__ == "__main__":
    main()
