#!/usr/bin/env python3
"""One training step of the pixel models (arXiv 1906.01563, task 5) in PyTorch and here: batch 200,
f32, one thread, Adam included; runs of either side in turn, medians.

    scripts/peers/pixels_torch.py COMMAND [--quick]

Needs torch. Frames are those of `COMMAND dataset pixels`, noise of their size in PyTorch, whose step
takes as long whatever they show. Ours leaves out what the encoder weighs of pixels that are dark in
all of them, about half, which changes no result.
"""
import importlib.util
import json
import pathlib
import statistics
import subprocess
import sys
import tempfile
import time

if importlib.util.find_spec("torch") is None:
    print("pixels_torch.py: skipped, torch not installed", file=sys.stderr)
    sys.exit(0)

import torch
from torch import nn

PIXELS, WIDTH, BATCH = 2 * 28 * 28, 200, 200

torch.set_num_threads(1)


class Coder(nn.Module):
    def __init__(self, inputs, outputs):
        super().__init__()
        self.first, self.last = nn.Linear(inputs, WIDTH), nn.Linear(WIDTH, outputs)
        self.middle = nn.ModuleList(nn.Linear(WIDTH, WIDTH) for _ in range(2))
        for layer in (self.first, *self.middle, self.last):
            nn.init.orthogonal_(layer.weight)

    def forward(self, x):
        h = torch.relu(self.first(x))
        for layer in self.middle:
            h = h + torch.relu(layer(h))
        return self.last(h)


class Model(nn.Module):
    def __init__(self, hamiltonian):
        super().__init__()
        self.hamiltonian = hamiltonian
        self.encode, self.decode = Coder(PIXELS, 2), Coder(2, PIXELS)
        self.net = nn.Sequential(
            nn.Linear(2, WIDTH),
            nn.Tanh(),
            nn.Linear(WIDTH, WIDTH),
            nn.Tanh(),
            nn.Linear(WIDTH, 1 if hamiltonian else 2, bias=False),
        )

    def field(self, z):
        out = self.net(z)
        if not self.hamiltonian:
            return out
        q, p = torch.autograd.grad(out.sum(), z, create_graph=True)[0].split(1, 1)
        return torch.cat([p, -q], 1)

    def loss(self, x, x_next):
        z, z_next = self.encode(x), self.encode(x_next)
        step = z_next - z
        seen = ((x - self.decode(z)) ** 2).mean()
        canonical = ((z[:, 1] - step[:, 0]) ** 2).mean()
        return seen + canonical + 0.1 * ((step - self.field(z)) ** 2).mean()


def torch_run(hamiltonian):
    model = Model(hamiltonian)
    optimiser = torch.optim.Adam(model.parameters(), 1e-3, weight_decay=1e-5)
    frames = torch.rand(2000, PIXELS)

    def run(steps):
        began = time.perf_counter()
        for _ in range(steps):
            chosen = torch.randint(1999, (BATCH,))
            model.loss(frames[chosen], frames[chosen + 1]).backward()
            optimiser.step()
            optimiser.zero_grad()
        return 1e3 * (time.perf_counter() - began) / steps

    run(5)
    return run


def our_run(command, folder, model):
    def run(steps):
        words = [command, "train", f"{folder}/frames.h5", "--model", model, "--steps", str(steps)]
        words += ["--every", "1000000", "--checkpoint", "1000", "--test-fraction", "0", "--json"]
        words += ["--out", f"{folder}/model.h5", "--quiet"]
        out = subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True).stdout
        return json.loads(out.splitlines()[-1])["ms_per_step"]

    return run


def main():
    command = str(pathlib.Path(sys.argv[1]).resolve())
    rounds, steps = (3, 8) if "--quick" in sys.argv else (7, 40)
    with tempfile.TemporaryDirectory() as folder:
        words = [command, "dataset", "pixels", "--trials", "30", "--out", f"{folder}/frames.h5"]
        subprocess.run(words, check=True, stdout=subprocess.DEVNULL)
        print("model,ours_ms,torch_ms,ratio")
        for model in ("pixel-baseline", "pixel-hnn"):
            ours, theirs = our_run(command, folder, model), torch_run(model == "pixel-hnn")
            pairs = [(ours(steps), theirs(steps)) for _ in range(rounds)]
            ratio = statistics.median(b / a for a, b in pairs)
            a, b = (statistics.median(side) for side in zip(*pairs))
            print(f"{model},{a:.2f},{b:.2f},{ratio:.2f}", flush=True)


if __name__ == "__main__":
    main()
