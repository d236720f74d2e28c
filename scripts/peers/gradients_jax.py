#!/usr/bin/env python3
"""Gradients of the discretised actions in JAX, jit, f64, one thread.

    scripts/peers/gradients_jax.py > jax.csv
"""
import os

os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)

import jax
import jax.numpy as jnp
import numpy as np

from actions import report

jax.config.update("jax_enable_x64", True)


def gradient_of(f, x):
    at = jnp.asarray(x)
    g = jax.jit(jax.grad(lambda y: f(jnp, y)))

    def run():
        return g(at).block_until_ready()

    return run, lambda: np.asarray(run())


report(f"jax {jax.__version__} jit", gradient_of)
