"""Training steps of `leastaction chart hnn` in other tools: the networks of its hnn-losses.csv,
2-width-width-out, tanh, no bias on the last layer; the mean square of field less rate, its gradient, a step of Adam at 1e-3 with
weight decay 1e-4, as published.

Weights and samples are given by a formula, so that every tool begins where ours does.
"""
import collections
import csv
import sys

import numpy as np

from actions import difference, median_seconds

Network = collections.namedtuple("Network", "model precision width batch")
OUTPUTS = {"hnn": 1, "baseline": 2}
PRECISIONS = {"f32": np.float32, "f64": np.float64}


def numbers(first, *shape):
    """Numbers first, first + 1, ... of a sequence in [-1, 1]."""
    k = np.arange(first, first + np.prod(shape), dtype=np.float64)
    return np.sin(0.7 * (k * k)).reshape(shape)


def samples(network):
    """States and rates of q^2 + p^2, [batch x 2]."""
    x = numbers(0, 2, network.batch).T
    rates = 2 * x[:, ::-1] * [1, -1]
    return x.astype(PRECISIONS[network.precision]), rates.astype(PRECISIONS[network.precision])


def parameters(network):
    """w1, b1, w2, b2, w3: weights [outputs x inputs]."""
    width = network.width
    shapes = (width, 2), (width,), (width, width), (width,), (OUTPUTS[network.model], width)
    first = 0
    for shape in shapes:
        scale = np.sqrt(2 / shape[1]) if len(shape) == 2 else 0.1
        yield (numbers(first, *shape) * scale).astype(PRECISIONS[network.precision])
        first += np.prod(shape)


def our_losses():
    """By network, before the first steps."""
    found = {}
    with open(sys.argv[1]) as lines:
        for row in csv.DictReader(line for line in lines if not line.startswith("#")):
            network = Network(row["model"], row["precision"], int(row["width"]), int(row["batch"]))
            found.setdefault(network, []).append(float(row["loss"]))
    return found


def job(network):
    """Its name in peers.csv; the width is said where it is not the published one."""
    name = f"training {network.model} {network.precision}"
    return name if network.width == 200 else f"{name} {network.width}"


def report(peer, version, step_of):
    """step_of(network) gives a function that takes a step and returns the loss before it."""
    for network, ours in our_losses().items():
        step = step_of(network)
        error = difference(np.array(ours), [float(step()) for _ in ours])
        seconds = median_seconds(step, 2)
        print(f"{job(network)},{peer},{version},{seconds:.4g},{error:.2g}", flush=True)
