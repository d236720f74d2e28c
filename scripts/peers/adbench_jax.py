#!/usr/bin/env python3
"""The problems of ADBench (docs/examples/adbench) in JAX, jit, f64, one thread: CPU milliseconds of value
and derivative, and how far both are from the stored values.

    scripts/peers/adbench_jax.py docs/examples/adbench/reference.csv [PROBLEM ...]
"""
import os

os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)

from adbench_common import ba_numbers, ba_sum, compare, hand_numbers, hand_parents, hand_sum, numbers

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import gammaln, logsumexp

jax.config.update("jax_enable_x64", True)


def rotate(r, v):
    angle = jnp.sqrt(jnp.sum(r * r))
    w = r / angle
    c, s = jnp.cos(angle), jnp.sin(angle)
    return v * c + jnp.cross(w, v) * s + w * (jnp.dot(w, v) * (1 - c))


def compiled(at, f, slope, gathered):
    x, value, slope = tuple(jnp.asarray(v) for v in at), jax.jit(f), jax.jit(slope)
    return lambda: jax.block_until_ready(value(x)), lambda: jax.block_until_ready(slope(x)), \
        lambda j, w: gathered(jax.tree.map(np.asarray, j), w)


def flat(g, w):
    return np.concatenate([np.ravel(v) for v in g])


def gmm(d, k, n):
    points = numbers((d, n), 1, 0, 1.5)
    at = numbers((k,), 2, 0, 1), numbers((d, k), 3, 0, 1), numbers((d + d * (d - 1) // 2, k), 4, 0, 0.5)
    row, col = np.tril_indices(d, -1)

    def f(x):
        alpha, mean, icf = x
        q, l = icf[:d], icf[d:]
        scale = jnp.exp(q)
        lower = jnp.zeros((k, d, d)).at[:, row, col].set(l.T)
        u = points[None] - mean.T[:, :, None]
        z = scale.T[:, :, None] * u + jnp.einsum("kij,kjn->kin", lower, u)
        terms = (alpha + q.sum(0))[:, None] - 0.5 * jnp.sum(z * z, 1)
        nu = d + 1
        constant = -0.5 * nu * d * np.log(2) - 0.25 * d * (d - 1) * np.log(np.pi) \
            - sum(gammaln(0.5 * nu + 0.5 * (1 - j)) for j in range(1, d + 1))
        prior = 0.5 * (jnp.sum(scale * scale) + jnp.sum(l * l))
        total = -0.5 * n * d * np.log(2 * np.pi) - n * logsumexp(alpha) + jnp.sum(logsumexp(terms, 0))
        return total + prior - k * constant

    return compiled(at, f, jax.grad(f), flat)


def ba(cameras, points, n):
    at, seen, camera, point = ba_numbers(cameras, points, n)

    def one(c, p, w, s):
        v = rotate(c[:3], p - c[3:6])
        u = v[:2] / v[2]
        r = jnp.sum(u * u)
        e = w * (u * (1 + c[9] * r + c[10] * r * r) * c[6] + c[7:9] - s)
        return jnp.concatenate([e, 1 - w**2])

    def all_of(what):
        return lambda x: jax.vmap(what)(x[0].T[camera], x[1].T[point], x[2].T, seen.T)

    value = all_of(one)
    return compiled(at, lambda x: value(x).T, all_of(jax.jacfwd(one, (0, 1, 2))),
                    lambda j, w: ba_sum(at, camera, point, j, w))


def lstm(layers, b, steps):
    at = numbers((4 * b, 2 * layers), 21, 0, 0.5), numbers((b, 3), 22, 0, 0.5)
    sequence, start = numbers((b, steps), 23, 0, 1).T, numbers((b, 2 * layers), 24, 0, 0.5)

    def f(x):
        main, extra = x[0].T.reshape(2 * layers, 4, b), x[1].T

        def step(state, pair):
            signal, after = pair[0] * extra[0], []
            for i in range(layers):
                hidden, cell = state[2 * i], state[2 * i + 1]
                g = [(hidden if k % 2 else signal) * main[2 * i, k] + main[2 * i + 1, k] for k in range(4)]
                cell = cell * jax.nn.sigmoid(g[0]) + jax.nn.sigmoid(g[1]) * jnp.tanh(g[3])
                signal = jax.nn.sigmoid(g[2]) * jnp.tanh(cell)
                after += [signal, cell]
            y = signal * extra[1] + extra[2]
            return tuple(after), jnp.dot(pair[1], y - jnp.log(2 + jnp.sum(jnp.exp(y))))

        _, each = jax.lax.scan(step, tuple(start.T), (sequence[:-1], sequence[1:]))
        return -jnp.sum(each) / ((steps - 1) * b)

    return compiled(at, f, jax.grad(f), flat)


def hand(n, triangles):
    at, measured, base, weights, relative, inverse, corners = hand_numbers(n, triangles)

    def about(a, x_axis):
        c, s, o, l = jnp.cos(a), jnp.sin(a), 0.0, 1.0
        return jnp.array([[l, o, o, o], [o, c, -s, o], [o, s, c, o], [o, o, o, l]] if x_axis
                         else [[c, o, s, o], [o, l, o, o], [-s, o, c, o], [o, o, o, l]])

    def vertices(theta):
        absolute, position = [], 0
        for bone, (parent, y, x) in enumerate(hand_parents()):
            m = relative[bone]
            m = m if y is None else m @ about(theta[y], False)
            m = m if x is None else m @ about(theta[x], True)
            absolute.append(m if parent is None else absolute[parent] @ m)
            position = position + weights[bone] * ((absolute[bone] @ inverse[bone])[:3] @ base)
        return jax.vmap(rotate, (None, 1), 1)(theta[:3], position) + theta[3:6, None]

    def seen(position, x):
        if not triangles:
            return measured - position[:, corners[0]]
        u, v = x[1]
        a, b, c = (position[:, k] for k in corners)
        return measured - u * a - v * b - (1 - u - v) * c

    # Two programs: in one, XLA computes the vertex anew for each element that is gathered, 10 times as slow.
    first = jax.jit(lambda theta: (vertices(theta), jax.vmap(
        lambda e: jax.jvp(vertices, (theta,), (e,))[1])(jnp.eye(26))))

    @jax.jit
    def second(position, directions, x):
        by_theta = jax.vmap(lambda d: jax.jvp(lambda q: seen(q, x), (position,), (d,))[1])(directions)
        by_us = [jax.jvp(lambda us: seen(position, (x[0], us)), (x[1],), (jnp.zeros_like(x[1]).at[k].set(1),))[1]
                 for k in range(2 * triangles)]
        return by_theta, by_us

    x = tuple(jnp.asarray(v) for v in at)
    place = jax.jit(vertices)
    value = jax.jit(lambda position, x: seen(position, x))

    def gathered(j, w):
        by_theta, by_us = jax.tree.map(np.asarray, j)
        return hand_sum(w, n, by_theta.transpose(1, 2, 0), np.stack(by_us, -1) if triangles else None)

    return lambda: jax.block_until_ready(value(place(x[0]), x)), \
        lambda: jax.block_until_ready(second(*first(x[0]), x)), gathered


compare({"gmm": gmm, "ba": ba, "lstm": lstm, "hand": hand})
