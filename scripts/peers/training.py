"""One training step of `leastaction chart hnn` in other tools: 750 samples, 2-200-200-out, tanh, no
bias on the last layer; the mean square of field less rate, its gradient, a step of Adam at 1e-3 with
weight decay 1e-4, as published.
"""
import numpy as np

from actions import median_seconds

BATCH, WIDTH = 750, 200
MODELS = "hnn", "baseline"
PRECISIONS = {"f32": np.float32, "f64": np.float64}


def samples(precision):
    """States and rates of q^2 + p^2, [BATCH x 2]."""
    x = np.random.default_rng(1).uniform(-1, 1, (BATCH, 2))
    rates = 2 * x[:, ::-1] * [1, -1]
    return x.astype(PRECISIONS[precision]), rates.astype(PRECISIONS[precision])


def report(peer, version, step_of):
    """step_of(model, precision) gives a function that takes a step and returns the loss before it."""
    for model in MODELS:
        for precision in PRECISIONS:
            step = step_of(model, precision)
            first = float(step())
            seconds = median_seconds(step, longest=2)
            assert float(step()) < first  # it does learn
            print(f"training {model} {precision},{peer},{version},{seconds:.4g},", flush=True)
