#!/usr/bin/env python3
"""SciPy's solve_ivp on the problems of `leastaction chart integrators`, in the columns of its
integrators.csv. Seconds are CPU time, the median of a few runs.

    scripts/peers/scipy_ivp.py [--quick] > scipy.csv
"""
import statistics
import sys
import time
import warnings

from scipy.integrate import solve_ivp

from motions import error, problems, typical_sizes

LEAST = 2.3e-14  # of rtol: solve_ivp raises what is smaller
LONGEST = 0.5  # seconds of a run; a method is refined no further ...
LONG = 0.1  # ... and timed once, where the spread is small


def solve(problem, method, tol, scale):
    field, start, end_time, _ = problem
    began = time.process_time()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        s = solve_ivp(field, (0, end_time), start, method=method, rtol=tol, atol=tol * scale)
    return s, time.process_time() - began


def main():
    quick = "--quick" in sys.argv
    factor, rounds = (10**-1.5, 1) if quick else (10**-0.5, 3)
    print("problem,method,knob,setting,steps,evaluations,seconds,error")
    for name, problem in problems.items():
        scale = typical_sizes(problem[0], problem[1])
        exact = problem[3]
        end = exact(problem[2]) if exact else solve(problem, "DOP853", LEAST, scale)[0].y[:, -1]
        for method in "RK45", "DOP853", "Radau":
            tol = 1e-2
            while tol >= LEAST:
                s, seconds = solve(problem, method, tol, scale)
                more = rounds - 1 if seconds < LONG else 0
                runs = [seconds] + [solve(problem, method, tol, scale)[1] for _ in range(more)]
                e = error(s.y[:, -1], end) if s.success else float("inf")
                if e < 1:
                    print(
                        f"{name},scipy {method},tol,{tol:.4g},{len(s.t) - 1},{s.nfev},"
                        f"{statistics.median(runs):.6g},{e:.6g}",
                        flush=True,
                    )
                if seconds > (0.1 if quick else LONGEST):
                    break
                tol *= factor


if __name__ == "__main__":
    main()
