#!/usr/bin/env python3
"""A training step in PyTorch, eager, one thread: the published code, autograd.grad with create_graph.

    scripts/peers/training_torch.py > torch.csv
"""
import torch

from training import WIDTH, report, samples

torch.set_num_threads(1)
SYMPLECTIC = torch.tensor([[0.0, 1.0], [-1.0, 0.0]])


def network(outputs):
    layers = [
        torch.nn.Linear(2, WIDTH),
        torch.nn.Tanh(),
        torch.nn.Linear(WIDTH, WIDTH),
        torch.nn.Tanh(),
        torch.nn.Linear(WIDTH, outputs, bias=False),
    ]
    for layer in layers[::2]:
        torch.nn.init.orthogonal_(layer.weight)
    return torch.nn.Sequential(*layers)


def step_of(model, precision):
    torch.manual_seed(0)
    dtype = {"f32": torch.float32, "f64": torch.float64}[precision]
    x, rates = (torch.tensor(a) for a in samples(precision))
    x.requires_grad_(model == "hnn")
    J = SYMPLECTIC.to(dtype)
    net = network(1 if model == "hnn" else 2).to(dtype)
    optimiser = torch.optim.Adam(net.parameters(), 1e-3, weight_decay=1e-4)

    def field():
        if model == "baseline":
            return net(x)
        return torch.autograd.grad(net(x).sum(), x, create_graph=True)[0] @ J.t()

    def step():
        loss = (rates - field()).pow(2).mean()
        loss.backward()
        optimiser.step()
        optimiser.zero_grad()
        return loss.detach()

    return step


report(f"torch {torch.__version__.split('+')[0]} eager", step_of)
