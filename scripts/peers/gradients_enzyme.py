#!/usr/bin/env python3
"""Gradients of the discretised actions by Enzyme from plain C (actions.c), called in a loop in C: at 100 slices on the paths of
chart gradients, and along the long ones of its gradients-sizes.csv, where jax.grad says what they should be.

    scripts/peers/gradients_enzyme.py charts/gradients-values.csv [--quick]

The package is made for functions under jit, where a call costs 6 us. What is compiled here computes nothing: it returns
the address of the gradient.
"""
import ctypes
import importlib.metadata
import os
import pathlib
import statistics
import subprocess
import tempfile

os.environ.setdefault("JAX_PLATFORMS", "cpu")

import jax
import jax.numpy as jnp
import numpy as np
from enzyme_ad.jax import enzyme_call
from enzyme_ad.jax.primitives import LANG_CPP, cflags, resource_dir

from actions import QUICK, SLICES, difference, scenes, values, velocities

jax.config.update("jax_enable_x64", True)
for library in "libm.so.6", "libmvec.so.1":  # where its machine code finds sine and cosine
    ctypes.CDLL(library, mode=ctypes.RTLD_GLOBAL)

LOOP = """
#include <time.h>
static double now(void) { struct timespec t; clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t); return t.tv_sec + 1e-9 * t.tv_nsec; }
double loop(void (*f)(const double *, double *), const double *x, double *g, long calls) {
  double began = now();
  for (long k = 0; k < calls; k++) f(x, g);
  return (now() - began) / (double)calls;
}
"""


def loop_in_c(folder):
    pathlib.Path(folder, "loop.c").write_text(LOOP)
    subprocess.run(["gcc", "-O2", "-shared", "-fPIC", "loop.c", "-o", "loop.so"], cwd=folder, check=True)
    loop = ctypes.CDLL(f"{folder}/loop.so").loop
    loop.restype = ctypes.c_double
    return loop


def processor():
    """As gcc names the one at hand."""
    target = subprocess.run(["gcc", "-march=native", "-Q", "--help=target"], capture_output=True, text=True).stdout
    return next(line.split()[1] for line in target.splitlines() if line.strip().startswith("-march="))


FLAGS = ["-O3", "-target-cpu", processor(), "-mprefer-vector-width=512", "-ffp-contract=fast", "-vectorize-loops"]
FLAGS += ["-vectorize-slp", "-mreassociate", "-fveclib=libmvec", "-resource-dir", resource_dir(), *cflags()]


def caller():
    """The function by which jit would call what is compiled."""
    pointer, name = ctypes.pythonapi.PyCapsule_GetPointer, ctypes.pythonapi.PyCapsule_GetName
    pointer.restype, pointer.argtypes = ctypes.c_void_p, [ctypes.py_object, ctypes.c_char_p]
    name.restype, name.argtypes = ctypes.c_char_p, [ctypes.py_object]
    capsule = enzyme_call.get_callback()
    kind = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.POINTER(ctypes.c_void_p))
    return kind(pointer(capsule, name(capsule)))


def gradient(action, dof, n, scale):
    """The address of a function (x, g)."""
    source = f"#define N {n}\n#define SCALE {scale!r}\n{pathlib.Path(__file__).with_name('actions.c').read_text()}"
    source += f"""
        static void gradient(const double *x, double *g) {{
            for (long k = 0; k < {dof}l * N; k++) g[k] = 0;
            enzyme::__enzyme_autodiff<void>((void *){action}, enzyme_dup, x, g);
        }}
        static void address(enzyme::tensor<int64_t, 1>& out, const enzyme::tensor<double, 1>& in) {{
            out(0) = (int64_t)(void *)gradient;
        }}"""
    ends = [("int64_t", [1])], [("double", [1])]
    kernel, _ = enzyme_call.create_enzyme_kernel(
        source, "address", *ends, FLAGS, enzyme_call.ABI.Primal, LANG_CPP, False, "", "cpu"
    )
    out, unused, number = np.zeros(1, np.int64), np.zeros(1), np.array([kernel], np.int64)
    caller()(out.ctypes.data, (ctypes.c_void_p * 2)(number.ctypes.data, unused.ctypes.data))
    return int(out[0])


def report(loop, job, peer, action, x, ours, scale):
    x, g = np.ascontiguousarray(x), np.zeros_like(x)
    f = ctypes.c_void_p(gradient(action, *x.shape, scale))
    call = lambda n: loop(f, ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(g.ctypes.data), ctypes.c_long(n))
    calls = max(1, int(0.02 / max(call(3), 1e-9)))
    seconds = statistics.median(call(calls) for _ in range(5 if QUICK else 25))
    version = importlib.metadata.version("enzyme_ad")
    print(job, peer, version, f"{seconds:.4g}", f"{difference(ours, g):.2g}", sep=",", flush=True)


def long_path(name, dof, n):
    """sized_gradient_path of apps/bench/measure."""
    spacing, swing = {"threebody": (0.3, 0.05), "dblpend": (0, 2)}[name]
    c, i = np.arange(dof)[:, None], np.arange(n)
    cell = np.where(c % 2, c // 2 // 8, c // 2 % 8)
    return spacing * cell + swing * np.sin(0.37 * i + 1.3 * (c * c) + 0.2)


def both_ways(loop, job, name, n, *arguments):
    report(loop, job, "Enzyme", name, *arguments)
    if name == "dblpend" and n <= 10000:
        report(loop, job, "Enzyme (arranged)", "dblpend_arranged", *arguments)


with tempfile.TemporaryDirectory() as folder:
    loop = loop_in_c(folder)
    for name, (x, _, ours, _, _) in values().items():
        if name != "ephemeris":
            both_ways(loop, f"gradient {name}", name, SLICES, x, ours, 1 / (scenes[name][2] * SLICES))
    for name, dof in ("threebody", 6), ("dblpend", 2):
        make, dt, bodies, _ = scenes[name]
        for n in (10000,) if QUICK else (10000, 1000000):
            x, L = long_path(name, dof, n), make(jnp)
            right = jax.grad(lambda x: L(x, velocities(jnp, x, dt)).sum() / (bodies * n))(jnp.asarray(x))
            both_ways(loop, f"gradient {name} {n:.0e}".replace("e+0", "e"), name, n, x, np.asarray(right), 1 / (bodies * n))
