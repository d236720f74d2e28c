#!/usr/bin/env python3
"""CPU time of a training step of a Lagrangian network in JAX, jit, one thread, f32: 4-128-128-1 softplus,
256 states of two coordinates, Adam on the mean square of the rates."""
import os
import time

os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)

import jax
import jax.numpy as jnp

SAMPLES, WIDTH, STEPS, REPEATS = 256, 128, 20, 8
tree = jax.tree_util.tree_map


def lagrangian(weights, q, v):
    h = jnp.concatenate([q, v])
    for w, b in weights[:-1]:
        h = jax.nn.softplus(w @ h + b)
    return (weights[-1][0] @ h)[0] + 0.5 * jnp.sum(v * v)


def rates(weights, x):
    q, v = x[:2], x[2:]
    mass = jax.hessian(lagrangian, 2)(weights, q, v)
    along = jax.jacfwd(jax.grad(lagrangian, 2), 1)(weights, q, v) @ v
    force = jax.grad(lagrangian, 1)(weights, q, v) - along
    return jnp.concatenate([v, jnp.linalg.solve(mass, force)])


def loss(weights, x, y):
    return jnp.mean((jax.vmap(lambda at: rates(weights, at))(x) - y) ** 2)


@jax.jit
def step(weights, m, s, k, x, y):
    value, g = jax.value_and_grad(loss)(weights, x, y)
    m = tree(lambda a, b: 0.9 * a + 0.1 * b, m, g)
    s = tree(lambda a, b: 0.999 * a + 0.001 * b * b, s, g)
    weights = tree(
        lambda w, a, b: w
        - 1e-4 * a / (1 - 0.9**k) / (jnp.sqrt(b / (1 - 0.999**k)) + 1e-8),
        weights,
        m,
        s,
    )
    return weights, m, s, value


key = jax.random.split(jax.random.PRNGKey(0), 5)
weights = [
    (jax.random.normal(k, (o, i)) * (2 / (i + o)) ** 0.5, jnp.zeros(o))
    for k, i, o in zip(key, (4, WIDTH, WIDTH), (WIDTH, WIDTH, 1))
]
x, y = (jax.random.normal(k, (SAMPLES, 4)) for k in key[3:])
state = (weights, tree(jnp.zeros_like, weights), tree(jnp.zeros_like, weights))
best, done = float("inf"), 0
for repeat in range(REPEATS + 1):
    began = time.process_time()
    for _ in range(STEPS):
        done += 1
        *state, value = step(*state, float(done), x, y)
    value.block_until_ready()
    if repeat:  # the first compiles
        best = min(best, (time.process_time() - began) / STEPS)
print(f"{1e3 * best:.2f} ms a step")
