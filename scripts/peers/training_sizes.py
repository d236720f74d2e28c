#!/usr/bin/env python3
"""Milliseconds of CPU time of a training step of a Hamiltonian network by width, batch and precision:
ours in turn with JAX `jit`, PyTorch eager and `torch.compile`, one thread each, medians of three.

    scripts/peers/training_sizes.py COMMAND [--precision f32] [--cells 200x1000,600x1000]

Networks are 2-width-width-1, tanh, with Adam and weight decay. Ours is the CPU time of a long run of
`train` less that of a short one. Needs jax and torch. OPENBLAS_CORETYPE is left out of the
environment: it would give us other kernels than those of this processor, and leave JAX its own.
"""
import argparse
import os
import pathlib
import resource
import statistics
import subprocess
import tempfile
import time

os.environ.update(JAX_PLATFORMS="cpu", OMP_NUM_THREADS="1")
os.environ["XLA_FLAGS"] = "--xla_cpu_multi_thread_eigen=false"
os.environ.pop("OPENBLAS_CORETYPE", None)
os.sched_setaffinity(0, list(os.sched_getaffinity(0))[-1:])

import jax
import jax.numpy as jnp
import numpy as np
import torch
from torch.func import functional_call, grad

jax.config.update("jax_enable_x64", True)
torch.set_num_threads(1)
CELLS = [(w, b) for w in (64, 200, 600, 2000) for b in (100, 1000, 10000, 100000) if w * w * b <= 4e9]


def samples(batch, precision):
    x = np.random.default_rng(0).normal(size=(batch, 2))
    return [a.astype(precision) for a in (x, 2 * x[:, ::-1] * [1, -1])]


def jax_step(width, batch, precision):
    x, rates = samples(batch, precision)
    shapes = (width, 2), (width,), (width, width), (width,), (1, width)
    draw = np.random.default_rng(1).normal
    weights = [jnp.asarray((draw(size=s) / s[-1] ** 0.5).astype(precision)) for s in shapes]

    def output(w, at):
        return jnp.tanh(jnp.tanh(at @ w[0].T + w[1]) @ w[2].T + w[3]) @ w[4].T

    def loss(w):
        g = jax.grad(lambda at: output(w, at).sum())(x)
        return ((rates - jnp.stack([g[:, 1], -g[:, 0]], 1)) ** 2).mean()

    def adam(t, w, g, m, v):
        g = g + 1e-4 * w
        m, v = 0.9 * m + 0.1 * g, 0.999 * v + 0.001 * g * g
        return w - 1e-3 * m / (1 - 0.9**t) / (jnp.sqrt(v / (1 - 0.999**t)) + 1e-8), m, v

    @jax.jit
    def advance(t, *state):
        value, g = jax.value_and_grad(loss)(state[0])
        moved = [adam(t, w, g, m, v) for g, w, m, v in zip(g, *state)]
        return value, *map(list, zip(*moved))

    zeros = [jnp.zeros_like(w) for w in weights]
    state, count = [weights, zeros, zeros], precision(0)

    def step():
        nonlocal state, count
        count += 1
        value, *state = advance(count, *state)
        value.block_until_ready()

    return step


def torch_step(compiled):
    def step_of(width, batch, precision):
        x, rates = (torch.tensor(a) for a in samples(batch, precision))
        net = torch.nn.Sequential(
            torch.nn.Linear(2, width),
            torch.nn.Tanh(),
            torch.nn.Linear(width, width),
            torch.nn.Tanh(),
            torch.nn.Linear(width, 1, bias=False),
        ).to(x.dtype)
        turn = torch.tensor([[0.0, 1.0], [-1.0, 0.0]], dtype=x.dtype)
        optimiser = torch.optim.Adam(net.parameters(), 1e-3, weight_decay=1e-4, fused=compiled)
        weights = dict(net.named_parameters())
        x.requires_grad_(not compiled)

        def loss(w):
            g = grad(lambda at: functional_call(net, w, at).sum())(x)
            return (rates - g @ turn.t()).pow(2).mean()

        slopes = torch.compile(torch.func.grad_and_value(loss))

        def step():
            optimiser.zero_grad()
            if compiled:
                g, _ = slopes({name: w.detach() for name, w in weights.items()})
                for name, w in weights.items():
                    w.grad = g[name]
            else:
                g = torch.autograd.grad(net(x).sum(), x, create_graph=True)[0]
                (rates - g @ turn.t()).pow(2).mean().backward()
            optimiser.step()

        return step

    return step_of


def ours(command, folder, width, batch, precision, steps):
    data = f"{folder}/{batch}.h5"
    if not pathlib.Path(data).exists():
        sampling = ["--trials", str(batch // 50), "--points", "50", "--quiet", "--out", data]
        subprocess.run([command, "dataset", "spring", *sampling], check=True)

    def seconds(n):
        words = f"train {data} --hidden {width} --precision {precision} --steps {n} --start xavier"
        words += f" --every 1000000 --checkpoint 100000 --quiet --out {folder}/model.h5"
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([command, *words.split()], check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    short = max(2, steps // 10)
    return (seconds(short + steps) - seconds(short)) / steps


def theirs(step, steps):
    began = time.process_time()
    for _ in range(steps):
        step()
    return (time.process_time() - began) / steps


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("command")
    parser.add_argument("--precision", choices=("f32", "f64"))
    parser.add_argument("--cells", help="WIDTHxBATCH,...")
    given = parser.parse_args()
    command = str(pathlib.Path(given.command).resolve())
    cells = given.cells and [tuple(map(int, c.split("x"))) for c in given.cells.split(",")]
    peers = {"jax": jax_step, "torch": torch_step(False), "compiled": torch_step(True)}
    print("precision,width,batch,ours_ms," + ",".join(f"{p}_ratio" for p in peers))
    with tempfile.TemporaryDirectory() as folder:
        for name in [given.precision] if given.precision else ["f32", "f64"]:
            precision = {"f32": np.float32, "f64": np.float64}[name]
            for width, batch in cells or CELLS:
                flops = 12 * width * width * batch * (1 if name == "f32" else 2)
                steps = max(2, min(3000, int(0.7 / (flops / 1e11 + 5e-5))))
                step = {p: of(width, batch, precision) for p, of in peers.items()}
                for s in step.values():
                    s(), s()
                ms, ratios = [], {p: [] for p in peers}
                for _ in range(3):
                    mine = ours(command, folder, width, batch, name, steps)
                    ms.append(1e3 * mine)
                    for p in peers:
                        ratios[p].append(theirs(step[p], steps) / mine)
                line = [f"{statistics.median(r):.2f}" for r in ratios.values()]
                print(f"{name},{width},{batch},{statistics.median(ms):.3g}", *line, sep=",", flush=True)


if __name__ == "__main__":
    main()
