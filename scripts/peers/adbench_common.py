"""What the peers of `make adbench` share: the numbers of the problems, the stored values, the table."""
import os
import sys
import time

for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(name, "1")

import numpy as np

SHAPES = {
    "gmm d10 K25": ("gmm", 10, 25, 1000), "gmm d20 K50": ("gmm", 20, 50, 1000),
    "ba 1": ("ba", 49, 7776, 31843), "lstm l2 c1024": ("lstm", 2, 14, 1024),
    "hand c100": ("hand", 100, False), "hand c100000": ("hand", 100000, False),
    "hand us c100": ("hand", 100, True), "hand us c10000": ("hand", 10000, True),
}


def number(series, k):
    z = (np.uint64(series * 1000003 + 1) + np.asarray(k, np.uint64)) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ z >> np.uint64(30)) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ z >> np.uint64(27)) * np.uint64(0x94D049BB133111EB)
    return ((z ^ z >> np.uint64(31)) >> np.uint64(11)) / 2.0**52 - 1


def numbers(shape, series, offset, scale):
    return offset + scale * number(series, np.arange(np.prod(shape))).reshape(shape)


def ba_numbers(cameras, points, n):
    """Cameras, points, weights; where they are seen; camera and point of each observation."""
    offset = np.array([0, 0, 0, 0, 0, -5, 1, 0, 0, 0, 0.0])[:, None]
    scale = np.array([0.3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.1, 0.1, 0.1, 0.05, 0.05])[:, None]
    k = np.arange(n)
    at = offset + scale * numbers((11, cameras), 11, 0, 1), numbers((3, points), 12, 0, 1), \
        numbers((1, n), 13, 0.5, 0.4)
    return at, numbers((2, n), 14, 0, 0.3), k % cameras, (k * 7 + k // cameras) % points


def ba_sum(at, camera, point, blocks, w):
    """w^T J from the blocks of each observation: n x 3 x 11, 3, 1."""
    g, w = [np.zeros_like(v) for v in at], w.reshape(3, -1).T
    np.add.at(g[0].T, camera, np.einsum("no,noi->ni", w, blocks[0]))
    np.add.at(g[1].T, point, np.einsum("no,noi->ni", w, blocks[1]))
    g[2][0] = np.einsum("no,noi->n", w, blocks[2])
    return np.concatenate([v.ravel() for v in g])


def hand_numbers(n, triangles):
    """Parameters; measured points, base (homogeneous), weights, bones' matrices; corners of each point."""
    bones, vertices = 22, 544
    at = (numbers((26,), 31, 0, 0.4),) + ((numbers((2, n), 37, 0.3, 0.2),) if triangles else ())
    base = np.concatenate([numbers((3, vertices), 33, 0, 1), np.ones((1, vertices))])
    weights = numbers((bones, vertices), 34, 0.05, 0.05)

    def affine(series):
        m = numbers((3, 4 * bones), series, 0, 0.7).reshape(3, bones, 4).transpose(1, 0, 2)
        return np.concatenate([m, np.broadcast_to([[[0, 0, 0, 1.0]]], (bones, 1, 4))], 1)

    k = np.arange(n)
    corners = [(k * 7 % 1084 * 5 + c * 31) % vertices for c in range(3)] if triangles else [k * 7 % vertices]
    return at, numbers((3, n), 32, 0, 1), base, weights, affine(35), affine(36), corners


def hand_parents():
    """Of each bone: parent, angle about y, angle about x (None: does not turn)."""
    angle = 6
    for bone in range(22):
        finger, place = divmod(bone - 2, 4)
        turns = finger >= 0 and place < 3
        both = finger >= 0 and place == 0
        yield (None if bone == 0 else 1 if both else bone - 1), angle if turns else None, \
            angle + 1 if both else None
        angle += turns + both


def hand_sum(w, n, by_theta, by_us):
    """w^T J from the derivatives by theta (3 x n x 26) and by each point's own two (3 x n x 2)."""
    w = w.reshape(3, n)
    g = np.einsum("ij,ijk->k", w, by_theta)
    return g if by_us is None else np.concatenate([g, np.einsum("ij,ijk->kj", w, by_us).ravel()])


def least(run):
    """Least CPU milliseconds of a run, in batches of a few."""
    times, began = [], time.time()
    while len(times) < 3 or (len(times) < 25 and time.time() - began < 2):
        before = time.process_time()
        for _ in range(3):
            run()
        times.append(1e3 / 3 * (time.process_time() - before))
    return min(times)


def compare(problems):
    """problems: by name (value, derivative, gathered); gathered(derivative(), w) is w^T J as one row."""
    stored = {}
    for line in open(sys.argv[1]):
        name, what, number_of = line.strip().split(",")
        stored[name, what] = float(number_of)
    print(f"{'problem':<16} {'value ms':>10} {'deriv. ms':>10} {'ratio':>8}   error")
    for name, (kind, *size) in SHAPES.items():
        if sys.argv[2:] and name not in sys.argv[2:]:
            continue
        value, derivative, gathered = problems[kind](*size)
        y = np.ravel(value())
        w = number(100, np.arange(y.size)) if y.size > 1 else np.ones(1)
        g = gathered(derivative(), w)
        error = abs(np.dot(w, y) - stored[name, "value"]) / max(abs(stored[name, "value"]), 1e-3)
        for i in range(3):
            want = stored[name, f"along {i}"]
            error = max(error, abs(np.dot(g, number(101 + i, np.arange(g.size))) - want) / max(abs(want), 1e-3))
        a, b = least(value), least(derivative)
        print(f"{name:<16} {a:10.3f} {b:10.3f} {b / a:8.1f}   {error:.1e}", flush=True)
