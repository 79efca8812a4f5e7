"""A straight elastic rod let go: the states at t = 1 in tests/suite/straight.rs, on standard output.

The state is (y, 1 - x) and its rate. The force of the rod is found from the position by Newton's method on
    theta'' = N sin theta - F cos theta,   theta(0) = 0,   theta'(1) = 0
at 24 Gauss nodes; DOP853 of scipy integrates m = 1. It starts a little after t = 0 from the first terms of
    y = v t + a t^2/2 - ..,   1 - x = c(N) y^2   (docs/theory.md 2.3),
at two times: how far the results differ is how far they are to be trusted. Two minutes.
"""

import numpy as np
from numpy.polynomial import legendre
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

NODES = 24
x, weights = legendre.leggauss(NODES)
weights = weights / 2
modes = np.linalg.inv(legendre.legvander(x, NODES - 1))
integrals = [legendre.legval(x, legendre.legint(row, lbnd=-1) / 2) for row in np.eye(NODES)]
integrate = np.array(integrals).T @ modes
# theta from theta''.
twice = integrate @ (integrate - weights)


def bent(pull, across):
    """theta at the nodes under the pull N and the cross force F."""
    theta = np.zeros(NODES)
    for _ in range(20):
        sin, cos = np.sin(theta), np.cos(theta)
        step = theta - twice @ (pull * sin - across * cos)
        step = np.linalg.solve(np.eye(NODES) - twice * (pull * cos + across * sin), step)
        theta = theta - step
        if abs(step).max() < 1e-16 * abs(theta).max():
            break
    return theta


def shortening(pull):
    """(c, F/y) of the almost straight rod."""
    theta = bent(pull, 1e-5)
    y = weights @ np.sin(theta)
    return weights @ (2 * np.sin(theta / 2) ** 2) / y**2, 1e-5 / y


def motion(load, pull):
    """The right-hand side; N, F and theta of the last position are where Newton's method begins."""
    last = {"pull": pull}

    def force(y, z):
        if "theta" not in last:
            theta = bent(pull, 1e-6)
            scale = y / (weights @ np.sin(theta))
            last.update(theta=theta * scale, across=1e-6 * scale)
        theta, n, f = last["theta"].copy(), last["pull"], last["across"]
        for _ in range(30):
            sin, cos = np.sin(theta), np.cos(theta)
            matrix, right = np.zeros((NODES + 2, NODES + 2)), np.zeros(NODES + 2)
            matrix[:NODES, :NODES] = np.eye(NODES) - twice * (n * cos + f * sin)
            matrix[:NODES, NODES], matrix[:NODES, NODES + 1] = twice @ cos, -twice @ sin
            right[:NODES] = twice @ (n * sin - f * cos) - theta
            matrix[NODES, :NODES], right[NODES] = weights * cos, y - weights @ sin
            matrix[NODES + 1, :NODES] = weights * sin / z
            right[NODES + 1] = 1 - weights @ (2 * np.sin(theta / 2) ** 2) / z
            step = np.linalg.solve(matrix, right)
            theta, f, n = theta + step[:NODES], f + step[NODES], n + step[NODES + 1]
            if abs(step[:NODES]).max() < 1e-15 * abs(theta).max() and abs(step[-1]) < 1e-12 * (1 + abs(n)):
                break
        last.update(theta=theta, pull=n, across=f)
        return n, f

    def slope(_, state):
        y, z, vy, vz = state
        n, f = force(y, z)
        return [vy, vz, load[1] - f, n - load[0]]

    return slope


def end(load, v, t):
    """(x, y, vx, vy) at the time 1, begun at t."""
    if v == 0:
        (c, k), a, h = shortening(load[0]), load[1], 1e-3
        soft = (shortening(load[0] + h)[0] - shortening(load[0] - h)[0]) / (2 * h)
        y, vy = a * t**2 / 2 * (1 - k * t**2 / 12), a * t * (1 - k * t**2 / 6)
        more = 3 * c * (a * t) ** 2
        pull = load[0] + more
        z = (c + soft * more) * y * y
        vz = 2 * c * y * vy + soft * (2 * more / t * y * y + 2 * more * y * vy)
    else:
        pull = brentq(lambda n: n - load[0] - 2 * shortening(n)[0] * v * v, load[0], load[0] + 1.3 * v * v)
        c, k = shortening(pull)
        y, vy = v * t * (1 - k * t**2 / 6), v * (1 - k * t**2 / 2)
        z, vz = c * y * y, 2 * c * y * vy
    run = solve_ivp(
        motion(load, pull),
        (t, 1.0),
        [y, z, vy, vz],
        method="DOP853",
        first_step=t / 500,
        rtol=1e-11,
        atol=[1e-14, 1e-14, 1e-13, 1e-13],
    )
    y, z, vy, vz = run.y[:, -1]
    return 1 - z, y, -vz, vy


if __name__ == "__main__":
    for load, v, times in [
        ((0.0, -1.0595), 0.0, (0.03, 0.02)),
        ((4.0, 2.0), 0.0, (0.03, 0.02)),
        ((0.0, 0.0), 1.0, (1e-3, 5e-4)),
        ((-1.0, 0.0), 0.8, (1e-3, 5e-4)),
    ]:
        for t in times:
            print(load, v, t, *(f"{value:.13f}" for value in end(load, v, t)))
