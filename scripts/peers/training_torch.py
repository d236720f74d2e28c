#!/usr/bin/env python3
"""A training step in PyTorch, one thread: eager, the published code, autograd.grad with create_graph;
and loss and gradient by torch.compile.

    scripts/peers/training_torch.py charts/hnn-losses.csv [--quick]
"""
import torch
from torch.func import functional_call, grad

from actions import QUICK
from training import OUTPUTS, parameters, report, samples

torch.set_num_threads(1)
SYMPLECTIC = torch.tensor([[0.0, 1.0], [-1.0, 0.0]])


def layers(width, outputs):
    return torch.nn.Sequential(
        torch.nn.Linear(2, width),
        torch.nn.Tanh(),
        torch.nn.Linear(width, width),
        torch.nn.Tanh(),
        torch.nn.Linear(width, outputs, bias=False),
    )


def start(network):
    dtype = {"f32": torch.float32, "f64": torch.float64}[network.precision]
    net = layers(network.width, OUTPUTS[network.model]).to(dtype)
    with torch.no_grad():
        for mine, value in zip(net.parameters(), parameters(network)):
            mine.copy_(torch.tensor(value))
    optimiser = torch.optim.Adam(net.parameters(), 1e-3, weight_decay=1e-4)
    x, rates = (torch.tensor(a) for a in samples(network))
    return net, optimiser, x, rates, SYMPLECTIC.to(dtype)


def eager(network):
    net, optimiser, x, rates, J = start(network)
    x.requires_grad_(network.model == "hnn")

    def field():
        if network.model == "baseline":
            return net(x)
        return torch.autograd.grad(net(x).sum(), x, create_graph=True)[0] @ J.t()

    def step():
        loss = (rates - field()).pow(2).mean()
        loss.backward()
        optimiser.step()
        optimiser.zero_grad()
        return loss.detach()

    return step


def compiled(network):
    net, optimiser, x, rates, J = start(network)
    weights = dict(net.named_parameters())

    def loss(weights):
        def output(at):
            return functional_call(net, weights, at)

        out = output(x) if network.model == "baseline" else grad(lambda at: output(at).sum())(x) @ J.t()
        return (rates - out).pow(2).mean()

    slopes = torch.compile(torch.func.grad_and_value(loss))

    def step():
        g, value = slopes({name: w.detach() for name, w in weights.items()})
        for name, w in weights.items():
            w.grad = g[name]
        optimiser.step()
        return value

    return step


VERSION = torch.__version__.split("+")[0]
report("PyTorch eager", VERSION, eager)
if not QUICK:
    report("torch.compile", VERSION, compiled)
