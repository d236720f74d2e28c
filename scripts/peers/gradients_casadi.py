#!/usr/bin/env python3
"""Derivatives of the discretised actions in CasADi: the Lagrangian of a slice in scalars (SX), mapped
over slices, differentiated as a whole; by its virtual machine, and as C where that compiles in time.

    scripts/peers/gradients_casadi.py charts/gradients-values.csv [--quick]
"""
import ctypes
import pathlib
import statistics
import subprocess
import tempfile

import casadi as ca
import numpy as np

from actions import G, GM, QUICK, SLICES, difference, report, scenes, values

MOST = 15  # coordinates of a scene whose C is compiled


def pair_sum(q, bodies, dims, law):
    """Sum of law(square of the distance, i, j) over pairs."""
    total = 0
    for i in range(bodies):
        for j in range(i + 1, bodies):
            d2 = sum((q[dims * i + k] - q[dims * j + k]) ** 2 for k in range(dims))
            total += law(d2, i, j)
    return total


def threebody(q, v):
    V = pair_sum(q, 3, 2, lambda d2, i, j: -1.3e-4 / (ca.sqrt(d2 + 1e-6) + 1e-6))
    return 0.5 * ca.dot(v, v) - V


def dblpend(q, v):
    T = v[0] * v[0] + 0.5 * v[1] * v[1] + v[0] * v[1] * ca.cos(q[0] - q[1])
    return T + 2 * ca.cos(q[0]) + ca.cos(q[1])


def ephemeris(q, v):
    V = pair_sum(q, 5, 3, lambda d2, i, j: -GM[i] * GM[j] / G / ca.sqrt(d2))
    return 0.5 * ca.dot(np.repeat(GM, 3) / G * v, v) - V


def lennard_jones(d2, i, j):
    u3 = (0.04 * 0.04 / (d2 + 1e-6)) ** 3
    return 1e-4 * (u3 * u3 - u3)


def gas(q, v):
    return 0.5 * ca.dot(v, v) - pair_sum(q, 50, 2, lennard_jones)


def functions(name, options):
    _, dt, bodies, _ = scenes[name]
    dof = {"threebody": 6, "dblpend": 2, "ephemeris": 15, "gas": 100}[name]
    q, v = ca.SX.sym("q", dof), ca.SX.sym("v", dof)
    L = ca.Function("L", [q, v], [globals()[name](q, v)]).map(SLICES)
    x, u = ca.MX.sym("x", dof, SLICES), ca.MX.sym("u", dof, SLICES)
    rates = (x[:, 1:] - x[:, :-1]) / dt
    S = ca.sum2(L(x, ca.horzcat(rates, rates[:, -1]))) / (bodies * SLICES)
    g = ca.jtimes(S, x, ca.MX(1), True)
    product = ca.jtimes(g, x, u)
    return ca.Function("g", [x], [g], options), ca.Function("h", [x, u], [product], options)


def measure(name, peer, options, x, u, gradient, product):
    g, h = functions(name, options)
    for job, f, arguments, ours in ("gradient", g, (x,), gradient), ("product", h, (x, u), product):
        buffer, evaluate = f.buffer()  # matrices by columns
        given = [np.ascontiguousarray(a.T) for a in arguments]
        out = np.zeros_like(given[0])
        for k, a in enumerate(given):
            buffer.set_arg(k, memoryview(a))
        buffer.set_res(0, memoryview(out))
        version = ca.CasadiMeta.version()
        report(f"{job} {name}", peer, version, evaluate, ours, lambda _: out.T)


LOOP = """
#include <time.h>
static double now(void) { struct timespec t; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); return t.tv_sec + 1e-9 * t.tv_nsec; }
/* seconds of a call; arguments and results as CasADi's functions have them */
double loop(const double *x, const double *u, double *y, long calls) {
  const double *arg[SZ_ARG] = {x, u}; double *res[SZ_RES] = {y}; static casadi_int iw[SZ_IW + 1]; static double w[SZ_W + 1];
  double began = now();
  for (long k = 0; k < calls; k++) F(arg, res, iw, w, 0);
  return (now() - began) / (double)calls;
}
"""


def from_c(name, x, u, gradient, product):
    """The C that CasADi writes, called in a loop in C."""
    address = lambda a: ctypes.c_void_p(a.ctypes.data)
    for job, f, ours in zip(("gradient", "product"), functions(name, {}), (gradient, product)):
        with tempfile.TemporaryDirectory() as folder:
            sizes = "".join(f"#define SZ_{k} {getattr(f, 'sz_' + k.lower())()}\n" for k in ("ARG", "RES", "IW", "W"))
            c = ca.CodeGenerator("f.c")
            c.add(f)
            text = c.dump() + f"#define F {f.name()}\n" + sizes + LOOP
            pathlib.Path(folder, "f.c").write_text(text)
            words = ["gcc", "-O3", "-march=native", "-w", "-shared", "-fPIC", "f.c", "-o", "f.so", "-lm"]
            subprocess.run(words, cwd=folder, check=True)
            loop = ctypes.CDLL(f"{folder}/f.so").loop
        loop.restype = ctypes.c_double
        given, out = [np.ascontiguousarray(a.T) for a in (x, u)], np.zeros_like(x.T, order="C")
        call = lambda n: loop(*(address(a) for a in (*given, out)), ctypes.c_long(n))
        calls = max(1, int(0.02 / max(call(3), 1e-9)))
        seconds = statistics.median(call(calls) for _ in range(5 if QUICK else 25))
        row = f"{job} {name}", "CasADi as C; loop in C", ca.CasadiMeta.version()
        print(*row, f"{seconds:.4g}", f"{difference(ours, out.T):.2g}", sep=",", flush=True)


compiled = {
    "jit": True,
    "compiler": "shell",
    "jit_options": {"flags": "-O3 -march=native", "verbose": False},
}
for name, (x, u, gradient, product, _) in values().items():
    measure(name, "CasADi", {}, x, u, gradient, product)
    if len(x) <= MOST and not QUICK:
        measure(name, "CasADi as C", compiled, x, u, gradient, product)
        from_c(name, x, u, gradient, product)
