"""The problems of `leastaction chart integrators` in plain Python: start, field, and the end.

Fields take and return lists or arrays y = (q, v) and use what is fastest in Python at that size:
scalars for one body, arrays for many.
"""
import math

import numpy as np


def pendulum(t, y):
    return [y[1], -math.sin(y[0])]


def kepler(t, y):
    x, z, vx, vz = y
    r2 = x * x + z * z
    w = -1 / (r2 * math.sqrt(r2))
    return [vx, vz, w * x, w * z]


def double_pendulum(t, y):
    """Unit masses, lengths and gravity: 2 a" + c b" + s b'^2 + 2 sin a = 0, b" + c a" - s a'^2 + sin b = 0."""
    a, b, va, vb = y
    c, s = math.cos(a - b), math.sin(a - b)
    f = -s * vb * vb - 2 * math.sin(a)
    g = s * va * va - math.sin(b)
    det = 2 - c * c
    return [va, vb, (f - c * g) / det, (2 * g - c * f) / det]


def attraction(gm, dims):
    n = len(gm)

    def field(t, y):
        q = np.asarray(y[: n * dims]).reshape(n, dims)
        d = q[None, :, :] - q[:, None, :]
        r2 = (d * d).sum(-1)
        np.fill_diagonal(r2, 1)
        w = gm[None, :] / (r2 * np.sqrt(r2))
        np.fill_diagonal(w, 0)
        return np.concatenate([y[n * dims :], (w[:, :, None] * d).sum(1).ravel()])

    return field


def kepler_end(e, t):
    M = math.fmod(t, 2 * math.pi)
    E = math.pi
    for _ in range(100):
        E -= (E - e * math.sin(E) - M) / (1 - e * math.cos(E))
    b, rate = math.sqrt(1 - e * e), 1 / (1 - e * math.cos(E))
    return np.array(
        [math.cos(E) - e, b * math.sin(E), -rate * math.sin(E), rate * b * math.cos(E)]
    )


def pendulum_end(k, t):
    from scipy.special import ellipj

    sn, cn, _, _ = ellipj(t, k * k)
    return np.array([2 * math.asin(k * sn), 2 * k * cn])


def kepler_start(e):
    return [1 - e, 0, 0, math.sqrt((1 + e) / (1 - e))]


FIGURE8 = (0.97000436, -0.2430874784197)
FIGURE8_V = (-0.9324073307192, -0.8647315139076)
figure8_start = (
    [*FIGURE8, -FIGURE8[0], -FIGURE8[1], 0, 0]
    + [-v / 2 for v in FIGURE8_V] * 2
    + list(FIGURE8_V)
)

# Sun, Mercury, Venus, Earth, Mars on 2022-Jul-14 00:00 TDB (JPL Horizons): GM in km^3/s^2, km, km/s.
GM = np.array([132712440041.93938, 22031.86855, 324858.592, 398600.435436, 42828.375214])
PLANETS = np.array(
    [
        [-1.351726041276557e06, 2.462102851293260e05, 2.951105537484762e04],
        [-6.819347861505019e06, 4.618319242507705e07, 4.284976522918230e06],
        [7.375717913448443e07, 7.798530196298192e07, -3.237239463507764e06],
        [5.379184128556358e07, -1.414690829485953e08, 3.669156366088986e04],
        [2.028839135507045e08, -3.410802740813480e07, -5.700325453727802e06],
    ]
)
PLANETS_V = np.array(
    [
        [-2.034205734889688e-03, -1.573882610814763e-02, 1.659179881591697e-04],
        [-5.814575461097006e01, -4.002790320353201e00, 5.007669558963743e00],
        [-2.529542521514409e01, 2.416944455572963e01, 1.791672237777401e00],
        [2.726224652787181e01, 1.066834351473718e01, 1.866902838409956e-05],
        [4.943041693545463e00, 2.595133113812033e01, 4.230859822894484e-01],
    ]
)

# name: (field, start, time, end or None where a tight run has to do)
problems = {
    "pendulum": (pendulum, [0, 1.8], 100, lambda t: pendulum_end(0.9, t)),
    "dblpend": (double_pendulum, [3 * math.pi / 7, 3 * math.pi / 4, 0, 0], 12, None),
    "kepler": (kepler, kepler_start(0.6), 20 * math.pi + 1, lambda t: kepler_end(0.6, t)),
    "kepler99": (kepler, kepler_start(0.99), 2 * math.pi + 1, lambda t: kepler_end(0.99, t)),
    "figure8": (attraction(np.ones(3), 2), figure8_start, 20, None),
    "ephemeris": (
        attraction(1e9 * GM, 3),
        1e3 * np.concatenate([PLANETS.ravel(), PLANETS_V.ravel()]),
        365 * 86400.0,
        None,
    ),
}


def typical_sizes(field, y):
    """What absolute tolerances refer to: one size for positions, one for velocities."""
    y = np.asarray(y, float)
    half = len(y) // 2
    x, v = np.abs(y[:half]).max(), np.abs(y[half:]).max()
    a = np.abs(field(0, y)[half:]).max()
    if x == 0:
        x = v * v / a if a else 1
    return np.repeat([x, max(v, math.sqrt(x * a))], half)


def error(y, end):
    """Of positions or velocities, whichever is larger, relative to their norm."""
    half = len(end) // 2
    y = np.asarray(y)
    return max(
        np.linalg.norm(y[:half] - end[:half]) / np.linalg.norm(end[:half]),
        np.linalg.norm(y[half:] - end[half:]) / np.linalg.norm(end[half:]),
    )
