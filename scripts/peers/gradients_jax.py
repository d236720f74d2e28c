#!/usr/bin/env python3
"""Derivatives of the discretised actions in JAX, jit, f64, one thread; all of a descent by Adam in
one jit; all blocks of the Hessian.

    scripts/peers/gradients_jax.py charts/gradients-values.csv [--quick]
"""
import os

os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)

import jax
import jax.numpy as jnp

from actions import ADAM_STEPS, objective, report, scenes, values, velocities

jax.config.update("jax_enable_x64", True)
REPEATED = 1000


def descent(g, rate):
    def step(k, state):
        x, m, v = state
        slope = g(x)
        m, v = 0.9 * m + 0.1 * slope, 0.999 * v + 0.001 * slope * slope
        first, second = m / (1 - 0.9 ** (k + 1.0)), v / (1 - 0.999 ** (k + 1.0))
        return x - rate * first / (jnp.sqrt(second) + 1e-8), m, v

    def run(x):
        zero = jnp.zeros_like(x)
        return jax.lax.fori_loop(0, ADAM_STEPS, step, (x, zero, zero))[0]

    return jax.jit(run)


def repeated(g):
    """Gradients one after the other in one jit, each of a path that the one before has moved by nothing
    one can see: the call and its dispatch from Python are shared by them all."""

    def run(x):
        return jax.lax.fori_loop(0, REPEATED, lambda k, s: (x + 1e-300 * s[1], g(s[0])), (x, 0 * x))[1]

    return jax.jit(run)


def blocks(name):
    """Second derivatives of L by (q, v) of each slice."""
    make, dt, _, _ = scenes[name]
    L = make(jnp)

    def of_slice(q, v):
        return L(q[:, None], v[:, None])[0]

    all_blocks = jax.vmap(jax.hessian(of_slice, (0, 1)), (1, 1))
    return jax.jit(lambda x: all_blocks(x, velocities(jnp, x, dt)))


for name, (x, u, gradient, product, descended) in values().items():
    at, along = jnp.asarray(x), jnp.asarray(u)
    g = jax.grad(objective(jnp, name))
    jobs = {
        "gradient": (jax.jit(g), (at,), gradient),
        "product": (jax.jit(lambda y, d: jax.jvp(g, (y,), (d,))[1]), (at, along), product),
        "adam": (descent(g, scenes[name][3]), (at,), descended),
        "hessian": (blocks(name), (at,), None),
    }
    for job, (run, arguments, ours) in jobs.items():
        report(
            f"{job} {name}",
            "JAX jit",
            jax.__version__,
            lambda: jax.block_until_ready(run(*arguments)),
            ours,
        )
    loop = repeated(g)
    report(
        f"gradient {name}",
        "JAX jit; loop in jit",
        jax.__version__,
        lambda: jax.block_until_ready(loop(at)),
        gradient,
        calls=REPEATED,
    )
