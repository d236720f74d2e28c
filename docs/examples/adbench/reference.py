#!/usr/bin/env python3
"""Values and directional derivatives of the problems, by complex steps: reference.py [PROBLEM ...] >reference.csv

Written from the formulas of ADBench, one number at a time; shares no code with the programs in C."""
import sys
from cmath import cos, exp, log, sin, sqrt
from math import lgamma, pi

M = 2**64 - 1
STEP = 1e-30


def number(series, k):
    z = (series * 1000003 + k + 1) * 0x9E3779B97F4A7C15 & M
    z = (z ^ z >> 30) * 0xBF58476D1CE4E5B9 & M
    z = (z ^ z >> 27) * 0x94D049BB133111EB & M
    return ((z ^ z >> 31) >> 11) / 2**52 - 1


def numbers(n, series, offset, scale):
    return [offset + scale * number(series, k) for k in range(n)]


def log_sum_exp(x):
    top = max(v.real for v in x)
    return top + log(sum(exp(v - top) for v in x))


def rotate(r, v):
    angle = sqrt(sum(a * a for a in r))
    w = [a / angle for a in r]
    c, s, along = cos(angle), sin(angle), sum(a * b for a, b in zip(w, v))
    cross = [w[1] * v[2] - w[2] * v[1], w[2] * v[0] - w[0] * v[2], w[0] * v[1] - w[1] * v[0]]
    return [v[i] * c + cross[i] * s + w[i] * along * (1 - c) for i in range(3)]


def gmm(d, k, n):
    points = numbers(d * n, 1, 0, 1.5)
    start = numbers(k, 2, 0, 1) + numbers(d * k, 3, 0, 1) + numbers((d + d * (d - 1) // 2) * k, 4, 0, 0.5)

    def f(x):
        alpha, mean, icf = x[:k], x[k:k + d * k], x[k + d * k:]
        q = [[icf[i * k + c] for i in range(d)] for c in range(k)]
        l = [[icf[i * k + c] for i in range(d, d + d * (d - 1) // 2)] for c in range(k)]
        scale = [[exp(v) for v in row] for row in q]
        total = -n * d / 2 * log(2 * pi) - n * log_sum_exp(alpha)
        for p in range(n):
            terms = []
            for c in range(k):
                u = [points[i * n + p] - mean[i * k + c] for i in range(d)]
                square, e, row = 0, 0, l[c]
                for i in range(d):
                    z = scale[c][i] * u[i]
                    for j in range(i):
                        z += row[e] * u[j]
                        e += 1
                    square += z * z
                terms.append(alpha[c] + sum(q[c]) - square / 2)
            total += log_sum_exp(terms)
        nu = d + 1
        constant = nu * d * -0.5 * log(2) - d * (d - 1) / 4 * log(pi) \
            - sum(lgamma(nu / 2 + (1 - j) / 2) for j in range(1, d + 1))
        prior = sum(v * v for row in scale for v in row) / 2 + sum(v * v for row in l for v in row) / 2
        return [total + prior - k * constant]

    return start, f


def ba(cameras, points, n):
    offset = [0, 0, 0, 0, 0, -5, 1, 0, 0, 0, 0]
    scale = [.3, .3, .3, .3, .3, .3, .1, .1, .1, .05, .05]
    start = [offset[k // cameras] + scale[k // cameras] * number(11, k) for k in range(11 * cameras)]
    start += numbers(3 * points, 12, 0, 1) + numbers(n, 13, .5, .4)
    seen = numbers(2 * n, 14, 0, .3)

    def f(x):
        y = [0] * (3 * n)
        for k in range(n):
            c = [x[i * cameras + k % cameras] for i in range(11)]
            at = 11 * cameras
            p = [x[at + i * points + (k * 7 + k // cameras) % points] for i in range(3)]
            w = x[at + 3 * points + k]
            v = rotate(c[:3], [p[i] - c[3 + i] for i in range(3)])
            a, b = v[0] / v[2], v[1] / v[2]
            r = a * a + b * b
            distortion = 1 + c[9] * r + c[10] * r * r
            y[k] = w * (a * distortion * c[6] + c[7] - seen[k])
            y[n + k] = w * (b * distortion * c[6] + c[8] - seen[n + k])
            y[2 * n + k] = 1 - w * w
        return y

    return start, f


def lstm(layers, b, steps):
    start = numbers(8 * b * layers, 21, 0, .5) + numbers(3 * b, 22, 0, .5)
    sequence, state = numbers(b * steps, 23, 0, 1), numbers(2 * b * layers, 24, 0, .5)

    def sigmoid(v):
        return 1 / (1 + exp(-v))

    def tanh(v):
        e = exp(2 * v)
        return (e - 1) / (e + 1)

    def f(x):
        def main(i, row):
            return x[row * 2 * layers + i]

        def extra(i, row):
            return x[8 * b * layers + row * 3 + i]

        hidden = [[state[u * 2 * layers + 2 * i] for u in range(b)] for i in range(layers)]
        cell = [[state[u * 2 * layers + 2 * i + 1] for u in range(b)] for i in range(layers)]
        total = 0
        for t in range(steps - 1):
            signal = [sequence[u * steps + t] * extra(0, u) for u in range(b)]
            for i in range(layers):
                for u in range(b):
                    g = [(signal[u] if k in (0, 2) else hidden[i][u]) * main(2 * i, k * b + u)
                         + main(2 * i + 1, k * b + u) for k in range(4)]
                    cell[i][u] = cell[i][u] * sigmoid(g[0]) + sigmoid(g[1]) * tanh(g[3])
                    hidden[i][u] = signal[u] = sigmoid(g[2]) * tanh(cell[i][u])
            y = [signal[u] * extra(1, u) + extra(2, u) for u in range(b)]
            norm = log(2 + sum(exp(v) for v in y))
            total += sum(sequence[u * steps + t + 1] * (y[u] - norm) for u in range(b))
        return [-total / ((steps - 1) * b)]

    return start, f


def hand(n, triangles):
    bones, vertices = 22, 544
    start = numbers(26, 31, 0, .4) + (numbers(2 * n, 37, .3, .2) if triangles else [])
    measured, base = numbers(3 * n, 32, 0, 1), numbers(3 * vertices, 33, 0, 1)
    weights = numbers(bones * vertices, 34, .05, .05)
    relative, inverse = numbers(12 * bones, 35, 0, .7), numbers(12 * bones, 36, 0, .7)

    def product(a, b):
        return [[sum(a[i][k] * b[k][j] for k in range(len(b))) for j in range(len(b[0]))] for i in range(len(a))]

    def affine(of, bone):
        return [[of[i * 4 * bones + 4 * bone + j] for j in range(4)] for i in range(3)] + [[0, 0, 0, 1]]

    def f(x):
        angle, absolute, moved = 6, [], []
        for bone in range(bones):
            finger, place = divmod(bone - 2, 4)
            local = affine(relative, bone)
            if finger >= 0 and place < 3:
                c, s = cos(x[angle]), sin(x[angle])
                angle += 1
                local = product(local, [[c, 0, s, 0], [0, 1, 0, 0], [-s, 0, c, 0], [0, 0, 0, 1]])
            if finger >= 0 and place == 0:
                c, s = cos(x[angle]), sin(x[angle])
                angle += 1
                local = product(local, [[1, 0, 0, 0], [0, c, -s, 0], [0, s, c, 0], [0, 0, 0, 1]])
            if bone:
                local = product(absolute[1 if bone >= 2 and place == 0 else bone - 1], local)
            absolute.append(local)
            moved.append(product(local, affine(inverse, bone)))
        position = []
        for v in range(vertices):
            p, u = [0, 0, 0], [base[i * vertices + v] for i in range(3)] + [1]
            for bone in range(bones):
                for i in range(3):
                    p[i] += weights[bone * vertices + v] * sum(moved[bone][i][j] * u[j] for j in range(4))
            p = rotate(x[:3], p)
            position.append([p[i] + x[3 + i] for i in range(3)])
        y = [0] * (3 * n)
        for k in range(n):
            if triangles:
                a, b, c = (position[(k * 7 % 1084 * 5 + corner * 31) % vertices] for corner in range(3))
                u, v = x[26 + k], x[26 + n + k]
                seen = [u * a[i] + v * b[i] + (1 - u - v) * c[i] for i in range(3)]
            else:
                seen = position[k * 7 % vertices]
            for i in range(3):
                y[i * n + k] = measured[i * n + k] - seen[i]
        return y

    return start, f


def scalar(y):
    return y[0] if len(y) == 1 else sum(number(100, k) * v for k, v in enumerate(y))


for name, (start, f) in {"gmm d10 K25": gmm(10, 25, 1000), "gmm d20 K50": gmm(20, 50, 1000),
                         "gmm d10 K5 large": gmm(10, 5, 100000),
                         "ba 1": ba(49, 7776, 31843), "lstm l2 c1024": lstm(2, 14, 1024),
                         "lstm l2 c65536": lstm(2, 14, 65536),
                         "hand c100": hand(100, False), "hand c100000": hand(100000, False),
                         "hand us c100": hand(100, True), "hand us c10000": hand(10000, True)}.items():
    if sys.argv[1:] and name not in sys.argv[1:]:
        continue
    for i in range(3):
        y = scalar(f([v + 1j * STEP * number(101 + i, k) for k, v in enumerate(start)]))
        if i == 0:
            print(f"{name},value,{y.real!r}")
        print(f"{name},along {i},{y.imag / STEP!r}", flush=True)
