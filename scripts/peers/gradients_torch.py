#!/usr/bin/env python3
"""Gradients of the discretised actions in PyTorch, eager, tensors over slices, f64, one thread.

    scripts/peers/gradients_torch.py > torch.csv
"""
import torch

from actions import report

torch.set_num_threads(1)


def gradient_of(f, x):
    t = torch.tensor(x, dtype=torch.float64, requires_grad=True)

    def run():
        return torch.autograd.grad(f(torch, t), t)[0]

    return run, lambda: run().numpy()


report(f"torch {torch.__version__.split('+')[0]} eager", gradient_of)
