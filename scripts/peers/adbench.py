#!/usr/bin/env python3
"""The problems of ADBench on the tape, in the peers that are installed, and beside each other: how long a
derivative takes with us over how long it takes there. Ends as the program does.

    scripts/peers/adbench.py build/adbench docs/examples/adbench/reference.csv
"""
import importlib.util
import os
import subprocess
import sys

PEERS = {"jax": "JAX", "casadi": "CasADi", "torch": "PyTorch"}
program, reference = sys.argv[1:]
folder = os.path.dirname(os.path.abspath(__file__))


def run(command, columns):
    """Prints what it prints; by problem, these columns (a name fills the first 16 characters)."""
    done = subprocess.run(command, stdout=subprocess.PIPE, text=True)
    print(done.stdout, flush=True)
    rows = {}
    for line in done.stdout.splitlines()[1:]:
        fields = line[16:].split()
        rows[line[:16].strip()] = [float(fields[k]) if k < len(fields) - 1 else None for k in columns]
    return done.returncode, rows


print("on the tape:", flush=True)
status, ours = run([program, reference], (4, 9))
theirs = {"C by hand": {name: row[1] for name, row in ours.items() if row[1]}}
for package, peer in PEERS.items():
    if not importlib.util.find_spec(package):
        print(f"{peer}: skipped, {package} not installed\n")
        continue
    print(f"in {peer}:", flush=True)
    failed, rows = run([sys.executable, "-B", os.path.join(folder, f"adbench_{package}.py"), reference], (1,))
    theirs[peer] = {name: row[0] for name, row in rows.items()}
    if failed:
        print(f"{peer}: failed\n")
print("ours / theirs, time of a derivative:")
print(f"{'problem':<16}" + "".join(f"{peer:>12}" for peer in theirs))
for name, row in ours.items():
    same = "lstm l2 c1024" if name == "lstm loop" else name
    print(f"{name:<16}" + "".join(
        f"{row[0] / times[same]:12.2f}" if same in times else f"{'-':>12}" for times in theirs.values()))
sys.exit(status)
