#!/usr/bin/env python3
"""The problems of ADBench (docs/examples/adbench) in PyTorch, f64, one thread: CPU milliseconds of value
and derivative, the smaller of eager and torch.compile (eager alone for the LSTM, which it would unroll, and
for the hand, whose 22 bones it compiled for more than ten minutes), and how far both are from the stored
values.

    scripts/peers/adbench_torch.py docs/examples/adbench/reference.csv [PROBLEM ...]
"""
import math

from adbench_common import ba_numbers, ba_sum, compare, hand_numbers, hand_parents, hand_sum, least, numbers

import numpy as np
import torch

torch.set_num_threads(1)
torch.set_default_dtype(torch.float64)


def better(f):
    """f, or what torch.compile makes of it if that is faster."""
    try:
        compiled = torch.compile(f, dynamic=False)
        for _ in range(3):
            compiled()
        return compiled if least(compiled) < least(f) else f
    except Exception as error:
        print(f"eager alone: {type(error).__name__}", flush=True)
        return f


def tensors(at):
    return tuple(torch.tensor(np.array(v)) for v in at)


def of(value, slope, gathered):
    """Functions of no arguments, with numpy's results."""
    return lambda: value().detach().numpy(), slope, \
        lambda j, w: gathered([v.detach().numpy() for v in j], w)


def rotate(r, v):
    angle = torch.sqrt(torch.sum(r * r))
    w = r / angle
    c, s = torch.cos(angle), torch.sin(angle)
    return v * c + torch.linalg.cross(w.expand_as(v), v) * s + w * ((v @ w)[..., None] * (1 - c))


def flat(g, w):
    return np.concatenate([v.ravel() for v in g])


def gmm(d, k, n):
    points = torch.tensor(numbers((d, n), 1, 0, 1.5))
    at = tensors((numbers((k,), 2, 0, 1), numbers((d, k), 3, 0, 1),
                  numbers((d + d * (d - 1) // 2, k), 4, 0, 0.5)))
    row, col = (torch.tensor(v) for v in np.tril_indices(d, -1))
    nu = d + 1
    constant = -0.5 * nu * d * math.log(2) - 0.25 * d * (d - 1) * math.log(math.pi) \
        - sum(math.lgamma(0.5 * nu + 0.5 * (1 - j)) for j in range(1, d + 1))

    def f(alpha, mean, icf):
        q, l = icf[:d], icf[d:]
        scale = torch.exp(q)
        lower = torch.zeros((k, d, d)).index_put((torch.arange(k)[:, None], row, col), l.T) + torch.diag_embed(scale.T)
        z = lower @ (points - mean.T[:, :, None])
        terms = (alpha + q.sum(0))[:, None] - 0.5 * torch.sum(z * z, 1)
        prior = 0.5 * (torch.sum(scale * scale) + torch.sum(l * l))
        return torch.sum(torch.logsumexp(terms, 0)) - 0.5 * n * d * math.log(2 * math.pi) \
            - n * torch.logsumexp(alpha, 0) + prior - k * constant

    slope = torch.func.grad(f, (0, 1, 2))
    return of(better(lambda: f(*at)), better(lambda: slope(*at)), flat)


def ba(cameras, points, n):
    numpy_at, seen, camera, point = ba_numbers(cameras, points, n)
    camera_of, point_of, seen = torch.tensor(camera), torch.tensor(point), torch.tensor(np.array(seen))
    at = tensors(numpy_at)

    def one(c, p, w, s):
        v = rotate(c[:3], p - c[3:6])
        u = v[:2] / v[2]
        r = torch.sum(u * u)
        e = w * (u * (1 + c[9] * r + c[10] * r * r) * c[6] + c[7:9] - s)
        return torch.cat([e, 1 - w**2])

    all_of, slopes = torch.func.vmap(one), torch.func.vmap(torch.func.jacfwd(one, (0, 1, 2)))

    def args():
        return at[0].T[camera_of], at[1].T[point_of], at[2].T, seen.T

    return of(better(lambda: all_of(*args()).T), better(lambda: slopes(*args())),
              lambda j, w: ba_sum(numpy_at, camera, point, j, w))


def lstm(layers, b, steps):
    at = tensors((numbers((4 * b, 2 * layers), 21, 0, 0.5), numbers((b, 3), 22, 0, 0.5)))
    sequence, start = tensors((numbers((b, steps), 23, 0, 1).T, numbers((b, 2 * layers), 24, 0, 0.5)))

    def f(x):
        main, extra = x[0].T.reshape(2 * layers, 4, b), x[1].T
        gate_in, bias = main[0::2], main[1::2]
        state, total = list(start.T), 0
        for t in range(steps - 1):
            signal = sequence[t] * extra[0]
            for i in range(layers):
                inputs = torch.stack((signal, state[2 * i], signal, state[2 * i]))
                g = inputs * gate_in[i] + bias[i]
                s, candidate = torch.sigmoid(g[:3]), torch.tanh(g[3])
                state[2 * i + 1] = state[2 * i + 1] * s[0] + s[1] * candidate
                signal = state[2 * i] = s[2] * torch.tanh(state[2 * i + 1])
            y = signal * extra[1] + extra[2]
            total = total + torch.dot(sequence[t + 1], y - torch.log(2 + torch.sum(torch.exp(y))))
        return -total / ((steps - 1) * b)

    def slope():
        x = [v.clone().requires_grad_() for v in at]
        return torch.autograd.grad(f(x), x)

    return of(lambda: f(at), slope, flat)


def hand(n, triangles):
    numpy_at, measured, base, weights, relative, inverse, corners = hand_numbers(n, triangles)
    at, measured, corners = tensors(numpy_at), torch.tensor(measured.T.copy()), tensors(corners)
    skin = torch.tensor((weights[:, None, :] * base[None]).reshape(88, -1))
    relative, inverse = torch.tensor(relative), torch.tensor(inverse)
    parents = list(hand_parents())

    def about(a, x_axis):
        c, s, o, l = torch.cos(a), torch.sin(a), torch.zeros(()), torch.ones(())
        rows = [l, o, o, o, o, c, -s, o, o, s, c, o, o, o, o, l] if x_axis else \
            [c, o, s, o, o, l, o, o, -s, o, c, o, o, o, o, l]
        return torch.stack(rows).reshape(4, 4)

    def vertices(theta):
        absolute = []
        for bone, (parent, y, x) in enumerate(parents):
            m = relative[bone]
            m = m if y is None else m @ about(theta[y], False)
            m = m if x is None else m @ about(theta[x], True)
            absolute.append(m if parent is None else absolute[parent] @ m)
        matrices = (torch.stack(absolute) @ inverse)[:, :3].transpose(0, 1).reshape(3, 88)
        return rotate(theta[:3], (matrices @ skin).T) + theta[3:6]

    def seen(position, us):
        if not triangles:
            return measured - position[corners[0]]
        a, b, c = (position[k] for k in corners)
        u, v = us[0][:, None], us[1][:, None]
        return measured - u * a - v * b - (1 - u - v) * c

    us = at[1] if triangles else None

    def slope():
        by_theta = torch.func.jacfwd(lambda theta: seen(vertices(theta), us))(at[0])
        if not triangles:
            return (by_theta,)
        position = vertices(at[0])
        a, b, c = (position[k] for k in corners)
        return by_theta, torch.stack((c - a, c - b), -1)

    def gathered(j, w):
        parts = [v.transpose(1, 0, 2) for v in j]
        return hand_sum(w, n, parts[0], parts[1] if triangles else None)

    return of(lambda: seen(vertices(at[0]), us).T, slope, gathered)


compare({"gmm": gmm, "ba": ba, "lstm": lstm, "hand": hand})
