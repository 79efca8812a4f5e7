"""Motion of a point mass at the end of a light planar rod under loads that turn with the rod.

Shooting from the clamp with complex steps, independent of the program. The rod has length 1 and stiffness 1, the mass
is 1. Writes the numbers of tests/suite/turning_motion.rs to the standard output.

    theta' = m,  m' = -(cos theta n_y - sin theta n_x),  n' = -R(theta) p,  r' = (cos theta, sin theta),

p is the load per length along tangent and normal. At a station, and at the end, n falls by R(theta) F. The base wrench
(m(0), n(0)) makes m(1) = 0 and r(1) the place of the mass, on which the force -n(1) acts behind the load at the end.
"""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.integrate._ivp import dop853_coefficients as dop

STEPS = 5
ALONG = (0.2, 0.7, np.array([0.4, 1.1]))
STATION = (0.5, np.array([-0.3, 0.6]))
END = np.array([-1.5, 0.2])
GRAVITY = np.array([-0.3, 1.6])
PLACE, VELOCITY = np.array([0.75, 0.6]), np.array([-0.4, 0.1])


def turned(theta, p):
    return np.array([np.cos(theta) * p[0] - np.sin(theta) * p[1], np.sin(theta) * p[0] + np.cos(theta) * p[1]])


def slope(y, p):
    theta, m, nx, ny = y[0], y[1], y[2], y[3]
    f = turned(theta, p)
    return np.array([m, -(np.cos(theta) * ny - np.sin(theta) * nx), -f[0], -f[1], np.cos(theta), np.sin(theta)])


def stretch(y, p, length):
    h = length / STEPS
    for _ in range(STEPS):
        k = []
        for i in range(dop.N_STAGES):
            at = y + h * sum((a * kj for a, kj in zip(dop.A[i, :i], k)), np.zeros_like(y))
            k.append(slope(at, p))
        y = y + h * sum(b * kj for b, kj in zip(dop.B, k))
    return y


def end(base):
    """State at s = 1 behind the load at the end, for columns of base wrenches."""
    zero = np.zeros_like(base[0])
    y = np.array([zero, base[0], base[1], base[2], zero, zero])
    at = 0.0
    for to in [ALONG[0], STATION[0], ALONG[1], 1.0]:
        p = ALONG[2] if ALONG[0] <= at < ALONG[1] else np.zeros(2)
        y = stretch(y, p, to - at)
        if to == STATION[0]:
            y[2:4] -= turned(y[0], STATION[1])
        at = to
    y[2:4] -= turned(y[0], END)
    return y


def held(base, place):
    """Base wrench with the end at the place, from a nearby one."""
    for _ in range(30):
        step = 1e-30
        columns = base[:, None] + 1j * step * np.eye(3)
        y = end(columns)
        gap = np.array([y[1, 0].real, y[4, 0].real - place[0], y[5, 0].real - place[1]])
        jacobian = np.array([y[1].imag, y[4].imag, y[5].imag]) / step
        change = np.linalg.solve(jacobian, gap)
        base = base - change
        if np.abs(change).max() < 3e-8:  # the next change is of the order of its square
            return base
    raise RuntimeError("no equilibrium")


def main():
    # The place lies next to the end of a rod with this base wrench.
    base = held(np.array([2.11, -2.0, 2.0]), PLACE)
    memory = {"base": base}

    def rate(_, y):
        memory["base"] = held(memory["base"], y[:2])
        n = end(memory["base"][:, None] + 0j)[2:4, 0].real
        return np.concatenate([y[2:], GRAVITY - n])

    times = [0.4, 0.8, 1.2]
    found = solve_ivp(rate, (0, 1.2), np.concatenate([PLACE, VELOCITY]), method="DOP853", rtol=1e-11, atol=1e-12,
                      t_eval=times)
    print("base", memory and held(base, PLACE).tolist())
    for t, y in zip(times, found.y.T):
        print(t, *(f"{x:.12f}" for x in y))


main()
