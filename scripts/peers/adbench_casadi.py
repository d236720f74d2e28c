#!/usr/bin/env python3
"""The problems of ADBench (docs/examples/adbench) in CasADi, one thread: CPU milliseconds of value and
derivative, and how far both are from the stored values. What is made of scalars (bundle adjustment, the
LSTM) is C code that CasADi writes and gcc -O3 compiles; matrices are CasADi's own.

    scripts/peers/adbench_casadi.py docs/examples/adbench/reference.csv [PROBLEM ...]
"""
import math
import os
import subprocess
import tempfile

from adbench_common import ba_numbers, ba_sum, compare, hand_numbers, hand_parents, hand_sum, numbers

import casadi as ca
import numpy as np


def runner(f, *args):
    """A function that runs f on these arguments, and its results as vectors of nonzeros, by column."""
    args = [np.asfortranarray(a, dtype=float).ravel(order="F") for a in args]
    results = [np.zeros(f.nnz_out(k)) for k in range(f.n_out())]
    buffer, run = f.buffer()
    for k, a in enumerate(args):
        buffer.set_arg(k, memoryview(a))
    for k, r in enumerate(results):
        buffer.set_res(k, memoryview(r))

    def call():
        run()
        return results

    call.keep = buffer, args
    return call


def compiled(f):
    """f from the C code that CasADi writes."""
    folder = tempfile.mkdtemp()
    here = os.getcwd()
    os.chdir(folder)
    try:
        f.generate(f.name() + ".c")
        subprocess.run(["gcc", "-O3", "-march=native", "-shared", "-fPIC", f.name() + ".c", "-o", "f.so"], check=True)
        return ca.external(f.name(), os.path.join(folder, "f.so"))
    finally:
        os.chdir(here)


def rotate(r, v):
    angle = ca.sqrt(ca.dot(r, r))
    w = r / angle
    c, s = ca.cos(angle), ca.sin(angle)
    return v * c + ca.cross(w, v) * s + w * (ca.dot(w, v) * (1 - c))


def gmm(d, k, n):
    points = ca.DM(numbers((d, n), 1, 0, 1.5))
    at = numbers((k,), 2, 0, 1), numbers((d, k), 3, 0, 1), numbers((d + d * (d - 1) // 2, k), 4, 0, 0.5)
    alpha, mean, icf = ca.MX.sym("a", k), ca.MX.sym("m", d, k), ca.MX.sym("i", *at[2].shape)
    order = [j if i == j else d + i * (i - 1) // 2 + j for j in range(d) for i in range(j, d)]
    lower, terms, scale = ca.Sparsity.lower(d), [], ca.exp(icf[:d, :])
    for c in range(k):
        q = ca.MX(lower, ca.vertcat(scale[:, c], icf[d:, c])[order])
        z = ca.mtimes(q, points - ca.repmat(mean[:, c], 1, n))
        terms.append(alpha[c] + ca.sum1(icf[:d, c]) - 0.5 * ca.sum1(z * z))
    top = terms[0]
    for t in terms[1:]:
        top = ca.fmax(top, t)
    each = top + ca.log(sum(ca.exp(t - top) for t in terms))
    nu = d + 1
    constant = -0.5 * nu * d * math.log(2) - 0.25 * d * (d - 1) * math.log(math.pi) \
        - sum(math.lgamma(0.5 * nu + 0.5 * (1 - j)) for j in range(1, d + 1))
    prior = 0.5 * (ca.sumsqr(scale) + ca.sumsqr(icf[d:, :]))
    y = ca.sum2(each) - 0.5 * n * d * math.log(2 * math.pi) - n * ca.logsumexp(alpha) + prior - k * constant
    x = [alpha, mean, icf]
    slopes = [ca.densify(ca.gradient(y, v)) for v in x]
    value = runner(ca.Function("f", x, [y]), *at)
    slope = runner(ca.Function("g", x, slopes), *at)
    return lambda: value()[0], slope, lambda g, w: np.concatenate(
        [v.reshape(np.shape(a), order="F").ravel() for v, a in zip(g, at)])


def ba(cameras, points, n):
    at, seen, camera, point = ba_numbers(cameras, points, n)
    c, p, w, s = ca.SX.sym("c", 11), ca.SX.sym("p", 3), ca.SX.sym("w"), ca.SX.sym("s", 2)
    v = rotate(c[:3], p - c[3:6])
    u = v[:2] / v[2]
    r = ca.dot(u, u)
    y = ca.vertcat(w * (u * (1 + c[9] * r + c[10] * r * r) * c[6] + c[7:9] - s), 1 - w * w)
    j = ca.jacobian(y, ca.vertcat(c, p, w))
    row, col = j.sparsity().get_triplet()
    x = [c, p, w, s]
    whole = [ca.MX.sym(name, *v.shape) for name, v in zip("cpw", at)]
    each = whole[0][:, camera.tolist()], whole[1][:, point.tolist()], whole[2], ca.DM(seen)

    def all_of(name, what):
        return runner(compiled(ca.Function(name, whole, [ca.Function("one", x, [what]).map(n)(*each)])), *at)

    value, slope = all_of("f", y), all_of("j", ca.vertcat(*j.nonzeros()))

    def gathered(g, weights):
        blocks = np.zeros((n, 3, 15))
        blocks[:, row, col] = g[0].reshape(n, -1)
        return ba_sum(at, camera, point, np.split(blocks, [11, 14], 2), weights)

    return lambda: value()[0].reshape(n, 3).T, slope, gathered


def lstm(layers, b, steps):
    at = numbers((4 * b, 2 * layers), 21, 0, 0.5), numbers((b, 3), 22, 0, 0.5)
    sequence, start = numbers((b, steps), 23, 0, 1), numbers((b, 2 * layers), 24, 0, 0.5)
    main, extra = ca.SX.sym("m", *at[0].shape), ca.SX.sym("e", *at[1].shape)
    state, pair = ca.SX.sym("s", 2 * layers * b + 1), ca.SX.sym("p", 2 * b)

    def sigmoid(v):
        return 1 / (1 + ca.exp(-v))

    signal, after = pair[:b] * extra[:, 0], []
    for i in range(layers):
        hidden, cell = (state[(2 * i + j) * b:(2 * i + j + 1) * b] for j in range(2))
        g = [(hidden if k % 2 else signal) * main[k * b:(k + 1) * b, 2 * i] + main[k * b:(k + 1) * b, 2 * i + 1]
             for k in range(4)]
        cell = cell * sigmoid(g[0]) + sigmoid(g[1]) * ca.tanh(g[3])
        signal = sigmoid(g[2]) * ca.tanh(cell)
        after += [signal, cell]
    y = signal * extra[:, 1] + extra[:, 2]
    each = ca.dot(pair[b:], y - ca.log(2 + ca.sum1(ca.exp(y))))
    step = ca.Function("step", [state, pair, main, extra], [ca.vertcat(*after, state[-1] + each)])
    x = [ca.MX.sym("m", *at[0].shape), ca.MX.sym("e", *at[1].shape)]
    pairs = ca.DM(np.concatenate([sequence[:, :-1], sequence[:, 1:]]))
    loop = step.mapaccum("loop", steps - 1)
    begin = ca.DM(np.append(start.ravel(order="F"), 0))
    total = loop(begin, pairs, *[ca.repmat(v, 1, steps - 1) for v in x])[-1, -1] / -((steps - 1) * b)
    value = runner(compiled(ca.Function("f", x, [total])), *at)
    slope = runner(compiled(ca.Function("g", x, [ca.gradient(total, v) for v in x])), *at)
    return lambda: value()[0], slope, lambda g, w: np.concatenate(
        [v.reshape(np.shape(a), order="F").ravel() for v, a in zip(g, at)])


def hand(n, triangles):
    at, measured, base, weights, relative, inverse, corners = hand_numbers(n, triangles)

    def about(a, x_axis):
        c, s = ca.cos(a), ca.sin(a)
        rows = [[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]] if x_axis else \
            [[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]]
        return ca.vertcat(*[ca.horzcat(*row) for row in rows])

    theta, absolute, moved = ca.SX.sym("t", 26), [], []
    for bone, (parent, y, x) in enumerate(hand_parents()):
        m = ca.SX(relative[bone])
        m = m if y is None else ca.mtimes(m, about(theta[y], False))
        m = m if x is None else ca.mtimes(m, about(theta[x], True))
        absolute.append(m if parent is None else ca.mtimes(absolute[parent], m))
        moved.append(ca.mtimes(absolute[bone], inverse[bone])[:3, :])
    r = ca.horzcat(*[rotate(theta[:3], ca.SX(e)) for e in np.eye(3)])
    whole = ca.densify(ca.mtimes(r, ca.horzcat(*moved)))  # 3 x 88: turned before the vertices are summed
    skin = ca.DM((weights[:, None, :] * base[None]).reshape(88, -1))
    bones = ca.Function("bones", [theta], [whole, ca.densify(ca.jacobian(ca.vec(whole), theta))])
    x = [ca.MX.sym("t", 26)] + ([ca.MX.sym("u", 2, n)] if triangles else [])
    matrices, by = bones(x[0])

    def seen(vertices):
        if not triangles:
            return vertices[:, corners[0].tolist()]
        w = ca.vertcat(x[1], 1 - x[1][0, :] - x[1][1, :])
        return sum(vertices[:, k.tolist()] * ca.repmat(w[i, :], 3, 1) for i, k in enumerate(corners))

    position = ca.mtimes(matrices, skin)
    y = measured - seen(position + ca.repmat(x[0][3:6], 1, 544))
    along = [-ca.vec(seen(ca.mtimes(ca.reshape(by[:, k], 3, 88), skin) +
                          (ca.repmat(ca.DM(np.eye(3)[k - 3]), 1, 544) if 3 <= k < 6 else 0))) for k in range(26)]
    by_us = [-ca.vec(position[:, corners[k].tolist()] - position[:, corners[2].tolist()]) for k in range(2 * triangles)]
    value = runner(ca.Function("f", x, [y]), *at)
    slope = runner(ca.Function("g", x, [ca.horzcat(*along)] + ([ca.horzcat(*by_us)] if triangles else [])), *at)

    def gathered(g, w):
        parts = [v.reshape(-1, n, 3).transpose(2, 1, 0) for v in g]
        return hand_sum(w, n, parts[0], parts[1] if triangles else None)

    return lambda: value()[0].reshape(n, 3).T, slope, gathered


compare({"gmm": gmm, "ba": ba, "lstm": lstm, "hand": hand})
