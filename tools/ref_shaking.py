"""Motions next to the straight rod, averaged over their shaking: y and its rate, over kappa, in tests/suite/straight.rs.

In the limit of small distances the rod is a beam under the tension N: stiffness k(N) across, 1 - x = c(N) y^2 (docs/theory.md 2.3), so that
    U = y^2 phi(rho),   rho = (1 - x)/y^2,   phi = k/2 - N c,
and the mass, m = 1, shakes along the rod with the energy E = y^2 e and the action J = y^3 j(e). J stays (adiabatic invariance), and y
obeys y'' = -dE/dy at constant J. Nothing of the chart, of its steps or of any single turn is used. Half a minute.
"""

import mpmath as mp
import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

# Here c is infinite: tan b = b.
POLE = -20.190728556426629975
mp.mp.dps = 40
nodes, weights = np.polynomial.legendre.leggauss(60)


def beam(n):
    """k and c; with 40 digits next to n = 0, where the closed form loses them."""
    if abs(n) < 0.1:
        n = mp.mpf(n or 1e-12)
        b = mp.sqrt(n)
        t, s = mp.tanh(b) / b, 1 / mp.cosh(b) ** 2
        return tuple(float(mp.re(value)) for value in (n / (1 - t), (1 - 1.5 * t + 0.5 * s) / (2 * (1 - t) ** 2)))
    b = np.sqrt(abs(n))
    if n > 0:
        t, s = np.tanh(b) / b, 1 / np.cosh(min(b, 300)) ** 2
    else:
        t, s = np.tan(b) / b, 1 / np.cos(b) ** 2
    return n / (1 - t), (1 - 1.5 * t + 0.5 * s) / (2 * (1 - t) ** 2)


def energy(n, load):
    k, c = beam(n)
    return k / 2 - n * c + load * c


def pull(rho):
    most, gap = 1.0, 1.0
    while beam(most)[1] > rho:
        most *= 4
    while beam(POLE + gap)[1] < rho:
        gap /= 4
    return brentq(lambda n: beam(n)[1] - rho, POLE + gap, most, xtol=1e-13, rtol=1e-15)


def turning(e, load):
    """rho where the mass is thrown back inward, and outward."""
    excess = lambda n: energy(n, load) - e
    most, gap = load + 1, load - POLE
    while excess(most) < 0:
        most = load + 2 * (most - load)
    while excess(POLE + gap) < 0:
        gap *= 0.9
    outer = brentq(excess, load, most, xtol=1e-13, rtol=1e-15)
    inner = brentq(excess, POLE + gap, load, xtol=1e-14, rtol=1e-15)
    return beam(outer)[1], beam(inner)[1]


def action(e, load):
    """j and dj/de: the velocity and its inverse, over a turn."""
    a, b = turning(e, load)
    angle = np.pi / 2 * nodes
    rho = (a + b) / 2 + (b - a) / 2 * np.sin(angle)
    v = np.array([np.sqrt(max(2 * (e - energy(pull(r), load)), 1e-300)) for r in rho])
    d_rho = (b - a) / 2 * np.cos(angle) * np.pi / 2 * weights
    return 2 * np.sum(v * d_rho), 2 * np.sum(d_rho / v)


def motion(lam, load, end):
    """From rest at (lambda, kappa), under a load along the rod."""
    n = -lam * lam
    y, theta1, alpha = (1 - np.tan(lam) / lam) / n, (1 - 1 / np.cos(lam)) / n, 1 / n
    y *= 2 / (theta1 - alpha)
    least = energy(load, load)
    e = energy(n, load)
    invariant = y**3 * action(e, load)[0]

    def slope(_, state):
        nonlocal e
        y, v = state
        for _ in range(60):
            j, by_e = action(e, load)
            step = (invariant / y**3 - j) / by_e
            while e + step <= least:
                step /= 2
            e += step
            if abs(step) < 1e-13 * (e - least):
                break
        j, by_e = action(e, load)
        return [v, -y * (2 * e - 3 * j / by_e)]

    ended = solve_ivp(slope, (0, end), [y, 0], method="DOP853", rtol=1e-11, atol=1e-12)
    return ended.y[:, -1]


for lam, load in [(0.7, 0), (1.6, 0), (2, 0), (4, 0), (1, -3), (1, 5)]:
    print(lam, load, "%.9f %.9f" % tuple(motion(lam, load, 0.3)))
