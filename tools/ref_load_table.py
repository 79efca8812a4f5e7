"""Planar rods from their base wrench under a load that is a table along s: reference values of tests/suite/light_weight_scenes.rs.

theta' = m/B, (x, y)' = (cos theta, sin theta), n' = -f, m' = n_x sin theta - n_y cos theta, integrated by DOP853 of scipy at a relative
tolerance of 1e-13, split at the kink of the table. Prints x, y, theta, m(1), energy and -int f.r ds.
"""

import numpy as np
from scipy.integrate import solve_ivp

TABLE = [(0.0, (0.0, -1.0)), (0.4, (2.0, -3.0)), (1.0, (-1.0, 0.5))]
BASE = (-0.7, 0.9, -1.4)  # m(0), n(0)


def load(s, piece):
    (a, fa), (b, fb) = TABLE[piece], TABLE[piece + 1]
    part = (s - a) / (b - a)
    return np.array(fa) * (1.0 - part) + np.array(fb) * part


def slope(s, z, piece):
    theta, x, y, nx, ny, m = z[:6]
    fx, fy = load(s, piece)
    c, d = np.cos(theta), np.sin(theta)
    return [m, c, d, -fx, -fy, nx * d - ny * c, 0.5 * m * m, -(fx * x + fy * y)]


z = np.array([0.0, 0.0, 0.0, BASE[1], BASE[2], BASE[0], 0.0, 0.0])
for piece in range(2):
    span = (TABLE[piece][0], TABLE[piece + 1][0])
    found = solve_ivp(slope, span, z, args=(piece,), method="DOP853", rtol=1e-13, atol=1e-15)
    z = found.y[:, -1]
theta, x, y, nx, ny, m, energy, potential = z
for name, value in [("x", x), ("y", y), ("theta", theta), ("m", m), ("nx", nx), ("ny", ny), ("energy", energy), ("potential", potential)]:
    print(f"{name} {value:.15f}")
