#!/usr/bin/env python3
"""How the energy error of Kepler orbits grows, at the tightest tolerances: ours, heyoka's Taylor method
and REBOUND's IAS15. Root mean square over eccentricities of |E / E0 - 1| after so many orbits, E from
the last coordinates by one formula in long double; `exponent` is the slope of its logarithm over all
lengths, 0.5 for a random walk of rounding, 1 for a drift; `distance` is the same mean of the distance
from the place by Kepler's equation; CPU seconds of the longest run (ours: of the
whole process).

    scripts/peers/drift.py COMMAND [--quick] > drift.csv
"""
import math
import resource
import subprocess
import sys
import tempfile
import time

import heyoka as hy
import numpy as np
import rebound

ECCENTRICITIES = 0.52, 0.55, 0.58, 0.6, 0.61, 0.63, 0.65, 0.68


def start(e):
    return [1 - e, 0.0, 0.0, math.sqrt((1 + e) / (1 - e))]


def energy(y):
    x, y, u, v = map(np.longdouble, y)
    return (u * u + v * v) / 2 - 1 / np.hypot(x, y)


def place(y, until):
    """From pericentre y on, by Kepler's equation in long double."""
    x, _, _, v = map(np.longdouble, y)
    a = 1 / (2 / x - v * v)
    e, turn = 1 - x / a, 8 * np.arctan(np.longdouble(1))
    M = np.longdouble(until) / (a * np.sqrt(a))
    M -= turn * np.rint(M / turn)
    E = M / (1 - e)
    for _ in range(50):
        E -= (E - e * np.sin(E) - M) / (1 - e * np.cos(E))
    return a * (np.cos(E) - e), a * np.sqrt(1 - e * e) * np.sin(E)


def root_mean_square(values):
    return math.sqrt(sum(x * x for x in values) / len(values))


def by_leastaction(command):
    def run(e, until):
        with tempfile.NamedTemporaryFile(suffix=".csv") as table:
            words = ["kepler", "--integrator", "taylor", "--tol", "1e-16", "--no-reference", "--samples", "1"]
            words += ["--set", f"e={e}", "--time", repr(until), "--quiet", "--csv", table.name]
            before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
            subprocess.run([command, "simulate", *words], check=True)
            seconds = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before
            rows = [line.split(",") for line in open(table.name).read().split()]
            columns = [rows[0].index(name) for name in ("x", "y", "v_x", "v_y")]
            first, last = ([float(row[k]) for k in columns] for row in (rows[1], rows[-1]))
            return first, last, seconds

    return run


def by_heyoka():
    x, y, u, v = hy.make_vars("x", "y", "u", "v")
    w = (x**2.0 + y**2.0) ** -1.5
    ta = hy.taylor_adaptive([(x, u), (y, v), (u, -x * w), (v, -y * w)], start(0.5), tol=2.3e-16)

    def run(e, until):
        ta.time = 0.0
        ta.state[:] = start(e)
        began = time.process_time()
        ta.propagate_until(until)
        return start(e), list(ta.state), time.process_time() - began

    return run


def by_ias15(e, until):
    s = rebound.Simulation()
    s.add(m=1.0)
    x, y, u, v = start(e)
    s.add(m=0.0, x=x, y=y, vx=u, vy=v)
    s.integrator = "ias15"
    began = time.process_time()
    s.integrate(until, exact_finish_time=1)
    p = s.particles[1]
    return start(e), [p.x, p.y, p.vx, p.vy], time.process_time() - began


def main():
    lengths = [10, 100, 1000] if "--quick" in sys.argv else [10, 100, 1000, 10000]
    print("method,orbits,error,exponent,seconds,distance")
    methods = {"leastaction taylor": by_leastaction(sys.argv[1]), "heyoka taylor": by_heyoka(), "rebound ias15": by_ias15}
    for name, run in methods.items():
        errors, distances, seconds = [], [], 0.0
        for orbits in lengths:
            ends = [run(e, 2 * math.pi * orbits) for e in ECCENTRICITIES]
            errors.append(root_mean_square([float(energy(last) / energy(first) - 1) for first, last, _ in ends]))
            away = [np.array(last[:2]) - place(first, 2 * math.pi * orbits) for first, last, _ in ends]
            distances.append(root_mean_square([float(np.hypot(*d)) for d in away]))
            seconds = sum(end[2] for end in ends) / len(ends)
        exponent = np.polyfit(np.log(lengths), np.log(errors), 1)[0]
        for orbits, error, distance in zip(lengths, errors, distances):
            print(f"{name},{orbits},{error:.3g},{exponent:.2f},{seconds:.4g},{distance:.3g}", flush=True)


if __name__ == "__main__":
    main()
