#!/usr/bin/env python3
"""The problems of ADBench (docs/examples/adbench) in JAX, jit, f64, one thread: CPU milliseconds of value
and derivative, and how far both are from the stored values.

    scripts/peers/adbench_jax.py docs/examples/adbench/reference.csv
"""
import os
import sys
import time

os.environ.setdefault("JAX_PLATFORMS", "cpu")
os.environ.setdefault(
    "XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1"
)

import jax
import jax.numpy as jnp
import numpy as np
from jax.scipy.special import gammaln, logsumexp

jax.config.update("jax_enable_x64", True)


def number(series, k):
    z = (np.uint64(series * 1000003 + 1) + np.asarray(k, np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ z >> np.uint64(30)) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ z >> np.uint64(27)) * np.uint64(0x94D049BB133111EB)
    return ((z ^ z >> np.uint64(31)) >> np.uint64(11)) / 2.0**52 - 1


def numbers(shape, series, offset, scale):
    return offset + scale * number(series, np.arange(np.prod(shape))).reshape(shape)


def rotate(r, v):
    angle = jnp.sqrt(jnp.sum(r * r))
    w = r / angle
    c, s = jnp.cos(angle), jnp.sin(angle)
    return v * c + jnp.cross(w, v) * s + w * (jnp.dot(w, v) * (1 - c))


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

    return at, f, jax.grad(f), lambda x, j, w: np.concatenate([np.ravel(v) for v in j])


def ba(cameras, points, n):
    offset = np.array([0, 0, 0, 0, 0, -5, 1, 0, 0, 0, 0.0])[:, None]
    scale = np.array([0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.1, 0.1, 0.1, 0.05, 0.05])[:, None]
    at = offset + scale * numbers((11, cameras), 11, 0, 1), numbers((3, points), 12, 0, 1), \
        numbers((1, n), 13, 0.5, 0.4)
    seen, k = numbers((2, n), 14, 0, 0.3), np.arange(n)
    camera, point = k % cameras, (k * 7 + k // cameras) % points

    def one(c, p, w, s):
        v = rotate(c[:3], p - c[3:6])
        u = v[:2] / v[2]
        r = jnp.sum(u * u)
        e = w * (u * (1 + c[9] * r + c[10] * r * r) * c[6] + c[7:9] - s)
        return jnp.concatenate([e, 1 - w[None] ** 2])

    def all_of(what):
        return lambda x: jax.vmap(what)(x[0].T[camera], x[1].T[point], x[2][0], seen.T)

    def gathered(x, j, w):
        g = [np.zeros((11, cameras)), np.zeros((3, points)), np.zeros((1, n))]
        w = w.reshape(3, n).T
        np.add.at(g[0].T, camera, np.einsum("no,noi->ni", w, j[0]))
        np.add.at(g[1].T, point, np.einsum("no,noi->ni", w, j[1]))
        g[2][0] = np.einsum("no,no->n", w, j[2])
        return np.concatenate([v.ravel() for v in g])

    value = all_of(one)
    return at, lambda x: value(x).T, all_of(jax.jacfwd(one, (0, 1, 2))), gathered


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

    return at, f, jax.grad(f), lambda x, j, w: np.concatenate([np.ravel(v) for v in j])


def hand(fingers, bones, n):
    at = (numbers((6 + fingers * (bones + 1),), 31, 0, 0.4),)
    measured, base = numbers((3, n), 32, 0, 1), numbers((3, n), 33, 0, 1)
    weights, offsets = numbers((fingers * bones, n), 34, 0.05, 0.05), numbers((3, fingers * bones), 35, 0, 0.5)

    def about(angle, first):
        c, s = jnp.cos(angle), jnp.sin(angle)
        return jnp.array([[1, 0, 0], [0, c, -s], [0, s, c]] if first else [[c, -s, 0], [s, c, 0], [0, 0, 1]])

    def f(x):
        theta, angle, position = x[0], 6, 0
        for finger in range(fingers):
            turn, place, rest = jnp.eye(3), jnp.zeros(3), jnp.zeros(3)
            for bone in range(bones):
                step = offsets[:, finger * bones + bone]
                rest, place = rest + step, place + turn @ step
                turn, angle = turn @ about(theta[angle], True), angle + 1
                if bone == 0:
                    turn, angle = turn @ about(theta[angle], False), angle + 1
                moved = turn @ (base - rest[:, None]) + place[:, None]
                position = position + weights[finger * bones + bone] * moved
        turned = jax.vmap(rotate, (None, 1), 1)(theta[:3], position)
        return measured - turned - theta[3:6, None]

    return at, f, jax.jacfwd(f), lambda x, j, w: np.einsum("ij,ijk->k", w.reshape(3, n), j[0])


def least(run, x):
    times = []
    for _ in range(7):
        began = time.process_time()
        for _ in range(5):
            jax.block_until_ready(run(x))
        times.append(200 * (time.process_time() - began))
    return min(times)


stored = {}
for line in open(sys.argv[1]):
    name, what, value = line.strip().split(",")
    stored[name, what] = float(value)
print(f"{'problem':<14} {'value ms':>10} {'deriv. ms':>10} {'ratio':>8}   error")
for name, (at, f, derivative, gathered) in {
    "gmm d10 K25": gmm(10, 25, 1000), "gmm d20 K50": gmm(20, 50, 1000), "ba 1": ba(49, 7776, 31843),
    "lstm l2 c1024": lstm(2, 14, 1024), "hand 5 x 3": hand(5, 3, 500),
}.items():
    x, value, slope = tuple(jnp.asarray(v) for v in at), jax.jit(f), jax.jit(derivative)
    y = np.ravel(value(x))
    w = number(100, np.arange(y.size)) if y.size > 1 else np.ones(1)
    g = gathered(x, jax.tree.map(np.asarray, slope(x)), w)
    error = abs(np.dot(w, y) - stored[name, "value"]) / max(abs(stored[name, "value"]), 1e-3)
    for i in range(3):
        want = stored[name, f"along {i}"]
        error = max(error, abs(np.dot(g, number(101 + i, np.arange(g.size))) - want) / max(abs(want), 1e-3))
    a, b = least(value, x), least(slope, x)
    print(f"{name:<14} {a:10.3f} {b:10.3f} {b / a:8.1f}   {error:.1e}", flush=True)
