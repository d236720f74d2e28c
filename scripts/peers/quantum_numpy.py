#!/usr/bin/env python3
"""The packets of `leastaction chart quantum` in NumPy: the kernel as a dense matrix, and the split
operator by its Fourier transforms. Free packet and coherent state, against their closed forms.

    scripts/peers/quantum_numpy.py [--quick]       CSV on standard output
"""
import sys
import time

import numpy as np

# name, box, time, packet (x, sigma, p), omega
PROBLEMS = [
    ("free", (-13, 13), 1.5, (-2, 0.7, 2), 0.0),
    ("harmonic", (-7, 7), 3, (1.5, 0.5**0.5, 0), 1.0),
]
DENSE, SPARSE, SECONDS = 2048, 65536, 2.0


def packet(x, x0, sigma, p):
    return (2 * np.pi * sigma**2) ** -0.25 * np.exp(-((x - x0) ** 2) / (4 * sigma**2) + 1j * p * (x - x0))


def exact(x, t, x0, sigma, p, omega):
    """Heller's Gaussian for m = hbar = 1, before the first half period."""
    c, s = (np.cos(omega * t), np.sin(omega * t) / omega) if omega else (1.0, t)
    rate = 1 / (2 * sigma**2)
    z, slope = c + 1j * rate * s, -(omega**2) * s + 1j * rate * c
    xc, v = x0 * c + p * s, -(omega**2) * x0 * s + p * c
    action = 0.5 * (xc * v - x0 * p)
    root = np.exp(-0.5j * np.angle(z)) / np.sqrt(abs(z))
    height = (2 * np.pi * sigma**2) ** -0.25 * np.exp(1j * action) * root
    return height * np.exp(1j * (0.5 * slope / z * (x - xc) ** 2 + v * (x - xc)))


def grid(low, high, n):
    dx = (high - low) / n
    return low + (np.arange(n) + 0.5) * dx, dx


def kernel(x, dx, dt, V):
    S = (x[:, None] - x) ** 2 / (2 * dt) - 0.5 * dt * (V[:, None] + V)
    K = np.sqrt(1 / (2j * np.pi * dt)) * dx * np.exp(1j * S)
    return lambda psi: K @ psi


def split(x, dx, dt, V):
    kick = np.exp(-0.5j * dt * V)
    drift = np.exp(-0.5j * dt * (2 * np.pi * np.fft.fftfreq(len(x), dx)) ** 2)
    return lambda psi: kick * np.fft.ifft(drift * np.fft.fft(kick * psi))


def main():
    seconds = 0.2 if "--quick" in sys.argv else SECONDS
    print("problem,method,points,steps,seconds,error")
    for name, box, t, start, omega in PROBLEMS:
        for method, build, most in ("kernel", kernel, DENSE), ("split fft", split, SPARSE):
            steps = 4
            while True:
                dt = t / steps
                # the coarsest grid on which phases of neighbouring paths differ by less than pi;
                # the split operator has no such limit, and a grid that resolves the packet will do
                n = int((box[1] - box[0]) ** 2 / (np.pi * dt)) + 2 if build is kernel else 512
                if n > most:
                    break
                x, dx = grid(*box, n)
                psi = packet(x, *start).astype(complex)
                begin = time.process_time()
                step = build(x, dx, dt, 0.5 * omega**2 * x**2)
                for _ in range(steps):
                    psi = step(psi)
                took = time.process_time() - begin
                error = np.sqrt(np.sum(abs(psi - exact(x, t, *start, omega)) ** 2) * dx)
                print(f"{name},{method},{n},{steps},{took:.6g},{error:.6g}", flush=True)
                if took > seconds or steps >= 1 << 14:
                    break
                steps *= 2


if __name__ == "__main__":
    main()
