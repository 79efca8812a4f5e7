"""Slider crank of rigid uniform bars: reference of tests/suite/moving_joints.rs.

The crank (length 1, mass 1) turns about the y axis at the origin. It carries a knee (mass 1/10, inertia 1/100). From
the knee a bar (length 2, mass 2) leads to a slider without mass on the x axis. Gravity is 9.81 along -z. With the
angle a of the crank from z towards x the motion has one freedom: M(a) a'^2/2 + V(a) = V(0.5).

    python3 tools/ref_slider_crank.py
"""

import numpy as np
from scipy.integrate import solve_ivp

WEIGHT = 9.81 * (0.5 + 0.1 + 1.0)


def inertia(a):
    """M(a) and its derivative."""
    s, c = np.sin(a), np.cos(a)
    root = np.sqrt(4 - c * c)
    # The middle of the bar is (s + root/2, c/2); the bar turns at s/root.
    x = c + s * c / (2 * root)
    x_a = -s + (c * c - s * s) / (2 * root) - (s * c) ** 2 / (2 * root**3)
    turn = s / root
    turn_a = c / root - s * s * c / root**3
    whole = 1 / 3 + 0.1 + 0.01 + 2 * (x * x + s * s / 4) + 2 / 3 * turn**2
    return whole, 4 * x * x_a + s * c + 4 / 3 * turn * turn_a


def slope(_, y):
    whole, by_angle = inertia(y[0])
    return [y[1], (WEIGHT * np.sin(y[0]) - 0.5 * by_angle * y[1] ** 2) / whole]


if __name__ == "__main__":
    motion = solve_ivp(slope, [0, 2], [0.5, 0], rtol=1e-12, atol=1e-13, method="DOP853", dense_output=True)
    for t in (0.5, 1.0, 1.5, 2.0):
        a, rate = motion.sol(t)
        drift = 0.5 * inertia(a)[0] * rate**2 + WEIGHT * (np.cos(a) - np.cos(0.5))
        print(f"{t} knee ({np.sin(a):.9f}, {np.cos(a):.9f}), energy drift {drift:.1e}")
