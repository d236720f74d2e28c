#!/usr/bin/env python3
"""Adam, RAdam (arXiv 1908.03265) and Lion (arXiv 2302.06675) on a Hamiltonian network in PyTorch: 2-100-100-1, tanh, 1000
steps of the whole batch, cosine schedule, data as published, half of the trials to test. Mean test losses (x 1e3) of seeds.

    scripts/peers/optimisers.py COMMAND [--quick] > optimisers.csv
"""
import math
import subprocess
import sys
import tempfile

import numpy as np
import torch

torch.set_num_threads(1)
QUICK = "--quick" in sys.argv
STEPS = 100 if QUICK else 1000
SEEDS = range(1 if QUICK else 3)


class Lion(torch.optim.Optimizer):
    def __init__(self, parameters, lr, weight_decay=0.0):
        super().__init__(parameters, {"lr": lr, "weight_decay": weight_decay})

    @torch.no_grad()
    def step(self):
        for group in self.param_groups:
            for w in group["params"]:
                m = self.state[w].setdefault("m", torch.zeros_like(w))
                w -= group["lr"] * (torch.sign(0.9 * m + 0.1 * w.grad) + group["weight_decay"] * w)
                m.mul_(0.99).add_(w.grad, alpha=0.01)


def data(task):
    with tempfile.NamedTemporaryFile(suffix=".csv") as table:
        subprocess.run([sys.argv[1], "dataset", task, "--seed", "0", "--quiet", "--out", table.name], check=True)
        rows = np.genfromtxt(table.name, delimiter=",", names=True)
    x = torch.tensor(np.stack([rows["q"], rows["p"]], 1), dtype=torch.float32)
    rates = torch.tensor(np.stack([rows["dqdt"], rows["dpdt"]], 1), dtype=torch.float32)
    first = torch.tensor(rows["trial"] < (rows["trial"].max() + 1) / 2)
    return x[first], rates[first], x[~first], rates[~first]


def test_loss(task, make, seed):
    x, rates, x_test, rates_test = task
    torch.manual_seed(seed)
    net = torch.nn.Sequential(
        torch.nn.Linear(2, 100), torch.nn.Tanh(), torch.nn.Linear(100, 100), torch.nn.Tanh(), torch.nn.Linear(100, 1, bias=False)
    )

    def loss(x, rates):
        x = x.clone().requires_grad_()
        slope = torch.autograd.grad(net(x).sum(), x, create_graph=True)[0]
        return ((rates[:, 0] - slope[:, 1]) ** 2 + (rates[:, 1] + slope[:, 0]) ** 2).mean() / 2

    optimiser = make(net.parameters())
    rate = optimiser.param_groups[0]["lr"]
    for step in range(STEPS):
        optimiser.param_groups[0]["lr"] = rate * (1 + math.cos(math.pi * step / STEPS)) / 2
        optimiser.zero_grad()
        loss(x, rates).backward()
        optimiser.step()
    return float(loss(x_test, rates_test).detach())


OPTIMISERS = {
    "Adam": lambda w: torch.optim.Adam(w, 1e-3, weight_decay=1e-4),
    "RAdam": lambda w: torch.optim.RAdam(w, 1e-3, weight_decay=1e-4),
    "Lion at a third of the rate": lambda w: Lion(w, 1e-3 / 3, weight_decay=1e-4),
    "Lion at a tenth of the rate": lambda w: Lion(w, 1e-4, weight_decay=1e-4),
}
print("task,optimiser,test_loss_1e3,least,largest")
for name in "spring", "pendulum":
    task = data(name)
    for optimiser, make in OPTIMISERS.items():
        losses = [1e3 * test_loss(task, make, seed) for seed in SEEDS]
        print(f"{name},{optimiser},{sum(losses) / len(losses):.4g},{min(losses):.4g},{max(losses):.4g}", flush=True)
