"""The discretised actions of `leastaction chart gradients`, for any array library with the functions
of numpy: mean of T - V over slices (and bodies), rule left+repeat, x [dof, 100 slices].
"""
import math

import numpy as np

SLICES = 100


def pairs(bodies):
    return np.triu_indices(bodies, 1)


def velocities(xp, x, dt):
    v = (x[:, 1:] - x[:, :-1]) / dt
    return xp.concatenate([v, v[:, -1:]], 1)


def squares(x, bodies):
    i, j = pairs(bodies)
    dx, dy = x[2 * i] - x[2 * j], x[2 * i + 1] - x[2 * j + 1]
    return dx * dx + dy * dy + 1e-6


def threebody(xp, x):
    v = velocities(xp, x, 0.5)
    r = xp.sqrt(squares(x, 3))
    return (0.5 * (v * v).sum() + 1.3e-4 * (1 / (r + 1e-6)).sum()) / (3 * SLICES)


def dblpend(xp, x):
    v = velocities(xp, x, 0.06)
    a, b, va, vb = x[0], x[1], v[0], v[1]
    T = va * va + 0.5 * vb * vb + va * vb * xp.cos(a - b)
    return (T + 2 * xp.cos(a) + xp.cos(b)).sum() / SLICES


def gas(xp, x):
    v = velocities(xp, x, 0.2)
    u = 0.04 * 0.04 / squares(x, 50)
    u3 = u * u * u
    return (0.5 * (v * v).sum() - 1e-4 * (u3 * u3 - u3).sum()) / (50 * SLICES)


def path(dof, spacing, swing):
    """Bodies around the points of a lattice, angles around zero: the path of the chart."""
    i = np.arange(SLICES)
    return np.array(
        [
            spacing * (c // 2 // 8 if c % 2 else c // 2 % 8)
            + swing * np.sin(0.37 * i + 1.3 * c * c + 0.2)
            for c in range(dof)
        ]
    )


scenes = {
    "threebody": (threebody, path(6, 0.3, 0.05)),
    "dblpend": (dblpend, path(2, 0, 2)),
    "gas": (gas, path(100, 0.06, 0.008)),
}


def disagreement(f, x, g):
    """Of a gradient from the difference along a fixed irregular direction, relative."""
    d = np.sin(1.7 * np.arange(x.size) ** 1.1 + 0.3).reshape(x.shape)
    h = 1e-6 * float(np.abs(x).max())
    slope = (f(np, x + h * d) - f(np, x - h * d)) / (2 * h)
    return abs(float((g * d).sum()) / float(slope) - 1)


def median_seconds(run, clock, longest=0.5):
    """Median over batches; a batch is 20 ms or one call."""
    run()
    began = clock()
    run()
    calls = max(1, int(0.02 / max(clock() - began, 1e-7)))
    times, started = [], clock()
    while len(times) < 5 or (clock() - started < longest and len(times) < 101):
        began = clock()
        for _ in range(calls):
            run()
        times.append((clock() - began) / calls)
    return sorted(times)[len(times) // 2]


def report(method, gradient_of):
    """gradient_of(f, x) gives a function that computes, and one that gives, the gradient."""
    import time

    print("scene,method,seconds,disagreement")
    for name, (f, x) in scenes.items():
        run, get = gradient_of(f, x)
        seconds = median_seconds(run, time.perf_counter)
        print(f"{name},{method},{seconds:.4g},{disagreement(f, x, get()):.2g}", flush=True)


assert math.isclose(float(dblpend(np, np.zeros((2, SLICES)))), 3)
