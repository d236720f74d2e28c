#!/usr/bin/env python3
"""heyoka's Taylor integrator and REBOUND's IAS15 and Bulirsch-Stoer on the problems of `leastaction
chart integrators`, in the columns of its integrators.csv. Seconds are CPU time of all steps, in one
call from Python, the median of a few runs; heyoka's machine code, 5 to 20 ms, is made before. Ends
that no formula gives are those of heyoka's tightest run.

    scripts/peers/motions_taylor.py [--quick] > taylor.csv
"""
import math
import statistics
import sys
import time

import heyoka as hy
import numpy as np
import rebound

from motions import GM, error, problems

TIGHTEST = 2.3e-16
MASSES = {"figure8": (np.ones(3), 2), "ephemeris": (1e9 * GM, 3)}  # G m, dimensions


# ---- heyoka ----


def pendulum():
    a, v = hy.make_vars("a", "v")
    return [(a, v), (v, -hy.sin(a))]


def dblpend():
    a, b, p, q = hy.make_vars("a", "b", "p", "q")
    c, s = hy.cos(a - b), hy.sin(a - b)
    f, g = -s * q * q - 2.0 * hy.sin(a), s * p * p - hy.sin(b)
    det = 2.0 - c * c
    return [(a, p), (b, q), (p, (f - c * g) / det), (q, (2.0 * g - c * f) / det)]


def kepler():
    x, y, u, v = hy.make_vars("x", "y", "u", "v")
    w = (x**2.0 + y**2.0) ** -1.5
    return [(x, u), (y, v), (u, -x * w), (v, -y * w)]


def attraction(gm, dims):
    def equations():
        n = len(gm) * dims
        q, v = (hy.make_vars(*(f"{name}{k}" for k in range(n))) for name in "qv")
        force = [[] for _ in q]
        for i in range(len(gm)):
            for j in range(i):
                d = [q[j * dims + k] - q[i * dims + k] for k in range(dims)]
                w = hy.sum([e**2.0 for e in d]) ** -1.5
                for k in range(dims):
                    force[i * dims + k].append(gm[j] * (d[k] * w))
                    force[j * dims + k].append(-(gm[i] * (d[k] * w)))
        return [*zip(q, v), *((a, hy.sum(f)) for a, f in zip(v, force))]

    return equations


systems = {"pendulum": pendulum, "dblpend": dblpend, "kepler": kepler, "kepler99": kepler}
systems.update({name: attraction(*of) for name, of in MASSES.items()})


def by_heyoka(name, tol):
    _, start, end_time, _ = problems[name]
    start = [float(x) for x in start]
    ta = hy.taylor_adaptive(systems[name](), start, tol=tol)

    def run():
        ta.time = 0.0
        ta.state[:] = start
        steps = ta.propagate_until(float(end_time))[3]
        return ta.state.copy(), steps

    return run


# ---- REBOUND ----


def by_rebound(name, integrator, tol):
    _, y, end_time, _ = problems[name]
    gm, dims = MASSES.get(name, (None, 2))
    q, v = np.asarray(y, float).reshape(2, -1, dims)

    def run():
        s = rebound.Simulation()
        if gm is None:
            s.add(m=1.0)
        for k in range(len(q)):
            place, speed = ([*a[k], 0][:3] for a in (q, v))
            s.add(m=0.0 if gm is None else gm[k], **dict(zip(("x", "y", "z", "vx", "vy", "vz"), [*place, *speed])))
        s.N_active = 1 if gm is None else len(q)
        s.integrator = integrator
        if integrator == "ias15":
            s.integrator.epsilon = tol
            if name == "figure8":  # a body without acceleration: the default never leaves there
                s.integrator.adaptive_mode = "GLOBAL"
        else:
            s.integrator.eps_abs = s.integrator.eps_rel = tol
        s.integrate(end_time, exact_finish_time=1)
        moving = list(s.particles)[1 if gm is None else 0 :]
        return np.array([getattr(p, k + c) for k in ("", "v") for p in moving for c in "xyz"[:dims]]), s.steps_done

    return run


# ---- all ----


def measure(name, method, tol, run, end, rounds):
    times = []
    while len(times) < rounds:
        began, calls = time.process_time(), 0
        while calls == 0 or time.process_time() - began < 2e-3:  # what is short, several times
            y, steps = run()
            calls += 1
        times.append((time.process_time() - began) / calls)
    e = error(np.array(y, float), end)
    if e < 1:
        print(f"{name},{method},tol,{tol:.4g},{steps},,{statistics.median(times):.6g},{e:.6g}", flush=True)


def main():
    quick = "--quick" in sys.argv
    rounds, step = (1, 3) if quick else (5, 1)
    print("problem,method,knob,setting,steps,evaluations,seconds,error")
    for name, (_, _, end_time, exact) in problems.items():
        end = exact(end_time) if exact else np.array(by_heyoka(name, TIGHTEST)()[0])
        for k in range(3, 17, step):
            measure(name, "heyoka taylor", 10.0**-k, by_heyoka(name, 10.0**-k), end, rounds)
        if name in MASSES or name.startswith("kepler"):
            for k in range(3, 12, step):
                measure(name, "rebound ias15", 10.0**-k, by_rebound(name, "ias15", 10.0**-k), end, rounds)
            for k in range(3, 15, step):
                measure(name, "rebound bs", 10.0**-k, by_rebound(name, "bs", 10.0**-k), end, rounds)


if __name__ == "__main__":
    main()
