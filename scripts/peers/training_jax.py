#!/usr/bin/env python3
"""A training step in JAX, jit, one thread.

    scripts/peers/training_jax.py charts/hnn-losses.csv [--quick]
"""
import os

os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)

import jax
import jax.numpy as jnp

from training import PRECISIONS, parameters, report, samples

jax.config.update("jax_enable_x64", True)


def output(weights, x):
    w1, b1, w2, b2, w3 = weights
    return jnp.tanh(jnp.tanh(x @ w1.T + b1) @ w2.T + b2) @ w3.T


def field(weights, x):
    g = jax.grad(lambda at: output(weights, at).sum())(x)
    return jnp.stack([g[:, 1], -g[:, 0]], 1)


def adam(t, x, g, m, v):
    g = g + 1e-4 * x
    m, v = 0.9 * m + 0.1 * g, 0.999 * v + 0.001 * g * g
    root = jnp.sqrt(v / (1 - 0.999**t)) + 1e-8
    return x - 1e-3 * m / (1 - 0.9**t) / root, m, v


def step_of(network):
    x, rates = samples(network)
    rate = field if network.model == "hnn" else output

    @jax.jit
    def next_state(t, *state):
        loss, g = jax.value_and_grad(lambda at: ((rates - rate(at, x)) ** 2).mean())(state[0])
        moved = [adam(t, x, g, m, v) for g, x, m, v in zip(g, *state)]
        return loss, *map(list, zip(*moved))

    weights = [jnp.asarray(a) for a in parameters(network)]
    zeros = [jnp.zeros_like(a) for a in weights]
    state = [weights, zeros, zeros]
    count = PRECISIONS[network.precision](0)

    def step():
        nonlocal state, count
        count += 1
        loss, *state = next_state(count, *state)
        return loss.block_until_ready()

    return step


report("JAX jit", jax.__version__, step_of)
