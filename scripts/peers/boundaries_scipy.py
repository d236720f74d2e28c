#!/usr/bin/env python3
"""SciPy's solve_bvp on the boundary problems of `leastaction chart paths`, from straight lines, in the columns of its
boundaries.csv that compare.py needs. Seconds are CPU time, the median of a few runs; errors are against
solve_ivp's DOP853 at its tightest.

    scripts/peers/boundaries_scipy.py [--quick] > boundaries.csv
"""
import statistics
import sys
import time

import numpy as np
from scipy.integrate import solve_bvp, solve_ivp

from motions import figure8_start, kepler_start

POINTS = 5  # of the line; the mesh is solve_bvp's
MOST = 5000  # points of the mesh
ANOTHER = 0.1  # an error that is another path


def pendulum(t, y):
    return np.vstack([y[1], -np.sin(y[0]) / 180])


def dblpend(t, y):
    a, b, va, vb = y
    c, s = np.cos(a - b), np.sin(a - b)
    f, g = -s * vb * vb - 2 * np.sin(a), s * va * va - np.sin(b)
    return np.vstack([va, vb, (f - c * g) / (2 - c * c), (2 * g - c * f) / (2 - c * c)])


def kepler(t, y):
    w = -((y[0] ** 2 + y[1] ** 2) ** -1.5)
    return np.vstack([y[2], y[3], w * y[0], w * y[1]])


def bodies(m, G=1, softening=0, offset=0):
    """-G m m' / (sqrt(r^2 + softening) + offset)"""

    def field(t, y):
        q, a = y[:6].reshape(3, 2, -1), np.zeros_like(y[6:]).reshape(3, 2, -1)
        for i in range(3):
            for j in range(i):
                d = q[j] - q[i]
                r = np.sqrt((d * d).sum(0) + softening)
                pull = G * d / (r * (r + offset) ** 2)
                a[i] += m[j] * pull
                a[j] -= m[i] * pull
        return np.vstack([y[6:], a.reshape(6, -1)])

    return field


problems = {
    "pendulum": (pendulum, [np.pi / 2, 0], 40),
    "dblpend": (dblpend, [3 * np.pi / 7, 3 * np.pi / 4, 0, 0], 2),
    "kepler": (kepler, kepler_start(0.6), 2.5),
    "threebody": (
        bodies([1, 1, 1], 0.00013, 1e-6, 1e-6),
        [0.4, 0.3, 0.4, 0.7, 0.7, 0.5, 0.017, -0.006, -0.012, -0.012, 0.002, 0.017],
        20,
    ),
    "figure8": (bodies([1, 1, 1]), figure8_start, 1),
    "pythagorean": (bodies([3, 4, 5]), [1, 3, -2, -1, 1, -1] + [0] * 6, 1.5),
}


def main():
    quick = "--quick" in sys.argv
    print("problem,method,tol,seconds,error")
    for name, (field, start, end) in problems.items():
        start = np.array(start, float)
        n = len(start) // 2

        def motion(times):
            flat = lambda t, y: field(t, y[:, None])[:, 0]
            return solve_ivp(flat, (0, end), start, "DOP853", times, rtol=2.3e-14, atol=1e-15).y[:n]

        first, last = motion([0, end]).T
        line_t = np.linspace(0, end, POINTS)
        slope = (last - first) / end
        line = np.vstack([first[:, None] + np.outer(slope, line_t), np.repeat(slope[:, None], POINTS, 1)])
        ends = lambda ya, yb: np.concatenate([ya[:n] - first, yb[:n] - last])
        tol = 1e-2
        while tol > 2e-12:
            runs = []
            for _ in range(1 if quick else 3):
                began = time.process_time()
                s = solve_bvp(field, ends, line_t, line, tol=tol, max_nodes=MOST)
                runs.append(time.process_time() - began)
            true = motion(s.x)
            e = np.linalg.norm(s.y[:n] - true) / np.linalg.norm(true)
            if not s.success or e > ANOTHER:
                break
            print(f"{name},scipy solve_bvp,{tol:.0e},{statistics.median(runs):.4g},{e:.4g}", flush=True)
            tol /= 1000 if quick else 10


if __name__ == "__main__":
    main()
