#!/usr/bin/env python3
"""Losses on rollouts by symplectic steps, and their gradients, in JAX: the numbers of tests/hnn/steps/test_stepping.c. f64; the
midpoint rule by a hundred rounds of its equation, which contract."""
import jax, jax.numpy as jnp, numpy as np
jax.config.update("jax_enable_x64", True)

n, width, samples, steps = 2, 3, 2, 2
def perceptron(w, x, inputs):
    a = w[: width * inputs].reshape(width, inputs); w = w[width * inputs :]
    return w[width:] @ jnp.tanh(a @ x + w[:width])
def H_whole(w, x): return perceptron(w, x, 2 * n)
def H_separable(w, x):
    half = width * n + 2 * width
    return perceptron(w[:half], x[n:], n) + perceptron(w[half:], x[:n], n)
def field(H, w, x):
    g = jax.grad(H, 1)(w, x)
    return jnp.concatenate([g[n:], -g[:n]])
def leapfrog(H, w, x, dt):
    kick = lambda x: x + jnp.concatenate([jnp.zeros(n), dt / 2 * field(H, w, x)[n:]])
    x = kick(x)
    return kick(x + jnp.concatenate([dt * field(H, w, x)[:n], jnp.zeros(n)]))
def midpoint(H, w, x, dt):
    m = jax.lax.fori_loop(0, 100, lambda _, m: x + dt / 2 * field(H, w, m), x)
    return 2 * m - x
def loss(step, H, w):
    total = 0
    for k in range(samples):
        x = jnp.array([0.9 * np.sin(1 + 2.3 * r + 1.7 * k) for r in range(2 * n)])
        for j in range(steps):
            x = step(H, w, x, 0.3 + 0.1 * j + 0.05 * k)
            goal = jnp.array([0.8 * np.cos(2 + 1.9 * r + 1.1 * k + 0.7 * j) for r in range(2 * n)])
            total += jnp.mean((x - goal) ** 2)
    return total / (samples * steps)
for name, step, H, size in (("leapfrog", leapfrog, H_separable, 2 * (width * n + 2 * width)),
                            ("midpoint", midpoint, H_whole, width * 2 * n + 2 * width)):
    w = jnp.array([0.7 * np.sin(1 + 1.3 * k) for k in range(size)])
    value, g = jax.jit(jax.value_and_grad(lambda w: loss(step, H, w)))(w)
    print(f"{name}: {float(value):.16g}, {float(g[1]):.16g}, {float(g[-2]):.16g}, {float(jnp.linalg.norm(g)):.16g}")
