"""One training step of `leastaction chart hnn` in other tools: 750 samples, 2-200-200-out, tanh, no
bias on the last layer; the mean square of field less rate, its gradient, a step of Adam at 1e-3 with
weight decay 1e-4, as published.

Weights and samples are given by a formula, so that every tool begins where ours does; its losses are
in hnn-losses.csv of that chart.
"""
import csv
import sys

import numpy as np

from actions import difference, median_seconds

BATCH, WIDTH = 750, 200
OUTPUTS = {"hnn": 1, "baseline": 2}
PRECISIONS = {"f32": np.float32, "f64": np.float64}


def numbers(first, *shape):
    """Numbers first, first + 1, ... of a sequence in [-1, 1]."""
    k = np.arange(first, first + np.prod(shape), dtype=np.float64)
    return np.sin(0.7 * (k * k)).reshape(shape)


def samples(precision):
    """States and rates of q^2 + p^2, [BATCH x 2]."""
    x = numbers(0, 2, BATCH).T
    rates = 2 * x[:, ::-1] * [1, -1]
    return x.astype(PRECISIONS[precision]), rates.astype(PRECISIONS[precision])


def parameters(model, precision):
    """w1, b1, w2, b2, w3: weights [outputs x inputs]."""
    shapes = (WIDTH, 2), (WIDTH,), (WIDTH, WIDTH), (WIDTH,), (OUTPUTS[model], WIDTH)
    first = 0
    for shape in shapes:
        scale = np.sqrt(2 / shape[1]) if len(shape) == 2 else 0.1
        yield (numbers(first, *shape) * scale).astype(PRECISIONS[precision])
        first += np.prod(shape)


def our_losses():
    """By model and precision, before the first steps."""
    found = {}
    with open(sys.argv[1]) as lines:
        for row in csv.DictReader(line for line in lines if not line.startswith("#")):
            found.setdefault((row["model"], row["precision"]), []).append(float(row["loss"]))
    return found


def report(peer, version, step_of):
    """step_of(model, precision) gives a function that takes a step and returns the loss before it."""
    for (model, precision), ours in our_losses().items():
        step = step_of(model, precision)
        error = difference(np.array(ours), [float(step()) for _ in ours])
        seconds = median_seconds(step, 2)
        print(f"training {model} {precision},{peer},{version},{seconds:.4g},{error:.2g}", flush=True)
