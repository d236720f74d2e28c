#!/usr/bin/env python3
"""Derivatives of the discretised actions in PyTorch, tensors over slices, f64, one thread: eager, and
by torch.compile.

    scripts/peers/gradients_torch.py charts/gradients-values.csv [--quick]
"""
import torch
from torch.func import grad, jvp

from actions import ADAM_STEPS, QUICK, objective, report, scenes, values

torch.set_num_threads(1)
VERSION = torch.__version__.split("+")[0]


def eager(name, x, u, gradient, product, descended):
    f = objective(torch, name)
    at = torch.tensor(x, requires_grad=True)
    along = torch.tensor(u)

    def first():
        return torch.autograd.grad(f(at), at)[0]

    def second():
        g = torch.autograd.grad(f(at), at, create_graph=True)[0]
        return torch.autograd.grad((g * along).sum(), at)[0]

    def adam():
        path = torch.tensor(x, requires_grad=True)
        optimiser = torch.optim.Adam([path], scenes[name][3])
        for _ in range(ADAM_STEPS):
            optimiser.zero_grad()
            f(path).backward()
            optimiser.step()
        return path.detach()

    report(f"gradient {name}", "PyTorch eager", VERSION, first, gradient)
    report(f"product {name}", "PyTorch eager", VERSION, second, product)
    report(f"adam {name}", "PyTorch eager", VERSION, adam, descended)


def compiled(name, x, u, gradient, product):
    f = objective(torch, name)
    at, along = torch.tensor(x), torch.tensor(u)
    first = torch.compile(grad(f))
    second = torch.compile(lambda y, d: jvp(grad(f), (y,), (d,))[1])
    report(f"gradient {name}", "torch.compile", VERSION, lambda: first(at), gradient)
    report(f"product {name}", "torch.compile", VERSION, lambda: second(at, along), product)


for name, (x, u, gradient, product, descended) in values().items():
    eager(name, x, u, gradient, product, descended)
    if not QUICK:
        compiled(name, x, u, gradient, product)
