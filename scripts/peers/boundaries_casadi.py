#!/usr/bin/env python3
"""CasADi on the boundary problems of `leastaction chart paths`, from straight lines: collocation at Gauss points of equal
elements, 3, 5 or 7 in each, by Newton's method (`rootfinder`, csparse) and by IPOPT (MUMPS, exact Hessians), in the columns
that compare.py needs. Seconds are CPU time of the solution alone, the median of a few runs, whose number of elements is
known beforehand; errors are against solve_ivp's DOP853 at its tightest.

    scripts/peers/boundaries_casadi.py [--quick] > boundaries.csv
"""
import statistics
import sys
import time

import casadi as ca
import numpy as np
from scipy.integrate import solve_ivp

from boundaries_scipy import ANOTHER, problems

LEAST = 2e-11  # an error below which more elements gain nothing


def acceleration(name, q, v):
    if name == "pendulum":
        return [-ca.sin(q[0]) / 180]
    if name == "dblpend":
        c, s = ca.cos(q[0] - q[1]), ca.sin(q[0] - q[1])
        f, g = -s * v[1] ** 2 - 2 * ca.sin(q[0]), s * v[0] ** 2 - ca.sin(q[1])
        return [(f - c * g) / (2 - c * c), (2 * g - c * f) / (2 - c * c)]
    if name == "kepler":
        w = -((q[0] ** 2 + q[1] ** 2) ** -1.5)
        return [w * q[0], w * q[1]]
    m, G, softening = [1, 1, 1], 1, 0
    if name == "threebody":
        G, softening = 0.00013, 1e-6
    if name == "pythagorean":
        m = [3, 4, 5]
    a = [0] * 6
    for i in range(3):
        for j in range(i):
            x, y = q[2 * i] - q[2 * j], q[2 * i + 1] - q[2 * j + 1]
            r = ca.sqrt(x * x + y * y + softening)
            w = G / (r * (r + softening) ** 2)
            for k, d in ((0, x), (1, y)):
                a[2 * j + k] += m[i] * w * d
                a[2 * i + k] -= m[j] * w * d
    return a


def equations(name, n, first, last, end, elements, points):
    """Unknowns, equations, a straight line, and where the states at the ends of elements are."""
    tau = [0, *ca.collocation_points(points, "legendre")]
    C, D, _ = ca.collocation_coeff(tau[1:])
    q, v = ca.SX.sym("q", n), ca.SX.sym("v", n)
    field = ca.Function("f", [q, v], [ca.vertcat(v, *acceleration(name, ca.vertsplit(q), ca.vertsplit(v)))])
    h, slope = end / elements, (last - first) / end
    x, g, guess = [], [], []

    def unknown(t):
        x.append(ca.SX.sym(f"x{len(x)}", 2 * n))
        guess.append(np.concatenate([first + t * slope, slope]))
        return x[-1]

    now = unknown(0)
    g.append(now[:n] - first)
    for e in range(elements):
        Z = ca.horzcat(now, *[unknown((e + s) * h) for s in tau[1:]])
        rates = ca.horzcat(*[field(Z[:n, k], Z[n:, k]) for k in range(1, points + 1)])
        g.append(ca.vec(Z @ C - h * rates))
        now = unknown((e + 1) * h)
        g.append(Z @ D - now)
    g.append(now[:n] - last)
    return ca.vertcat(*x), ca.vertcat(*g), np.concatenate(guess), slice(0, None, points + 1)


def newton(x, g):
    options = {"linear_solver": "csparse", "abstol": 1e-13, "error_on_fail": False}
    solver = ca.rootfinder("newton", "newton", {"x": x, "g": g}, options)
    return lambda guess: (solver(x0=guess)["x"], solver.stats()["success"])


def ipopt(x, g):
    options = {"print_level": 0, "sb": "yes", "tol": 1e-12, "max_iter": 200}
    solver = ca.nlpsol("ipopt", "ipopt", {"x": x, "g": g, "f": ca.SX(0)}, {"print_time": False, "ipopt": options})
    return lambda guess: (solver(x0=guess, lbg=0, ubg=0)["x"], solver.stats()["success"])


def main():
    quick = "--quick" in sys.argv
    print("problem,method,elements,seconds,error")
    for name, (field, start, end) in problems.items():
        start = np.array(start, float)
        n = len(start) // 2

        def motion(times):
            flat = lambda t, y: field(t, y[:, None])[:, 0]
            return solve_ivp(flat, (0, end), start, "DOP853", times, rtol=2.3e-14, atol=1e-15).y[:n]

        first, last = motion([0, end]).T
        for points in (5,) if quick else (3, 5, 7):
            for make in newton, ipopt:
                for elements in (2, 4, 8, 16, 32, 64):
                    x, g, guess, ends = equations(name, n, first, last, end, elements, points)
                    true = motion(np.linspace(0, end, elements + 1))
                    solve = make(x, g)
                    runs = []
                    for _ in range(1 if quick else 5):
                        began = time.process_time()
                        found, success = solve(guess)
                        runs.append(time.process_time() - began)
                    e = np.linalg.norm(np.array(found).reshape(-1, 2 * n)[ends, :n].T - true) / np.linalg.norm(true)
                    if success and e < ANOTHER:
                        seconds = statistics.median(runs)
                        print(f"{name},casadi {make.__name__} {points} points,{elements},{seconds:.4g},{e:.4g}", flush=True)
                    if e < LEAST:
                        break


if __name__ == "__main__":
    main()
