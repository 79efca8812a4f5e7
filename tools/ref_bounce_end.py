"""The end of a bounce with friction: when a mass on an elastica, on a floor, slides back and when it sticks.

The script begins at late impacts of tests/data/contact/bounce_given.json. The flights that are left have the mean force
of the floor; their impulse is that force times their duration, less the momentum at their start. The slide that follows
is integrated by DOP853 of scipy over the place of the mass, with the rod found from its end by Newton's method on
elliptic integrals. The times do not depend on the impact at which the script begins, by 1e-12.
"""

import json
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.special import ellipeinc, ellipkinc

LOAD, FLOOR, RESTITUTION, FRICTION = np.array([-6.0, -3.0]), -0.3, 0.5, 0.15


def end(q):
    """Place of the end of the rod, and the force of the rod on the mass, at the chart point (p, w)."""
    k, w = np.tanh(q[0]), q[1]
    m, c = k * k, np.pi / 2 - w
    f = ellipkinc(np.pi / 2, m) - ellipkinc(c, m)
    e = ellipeinc(np.pi / 2, m) - ellipeinc(c, m)
    alpha = -2 * np.arcsin(k * np.cos(w))
    turn = np.array([[np.cos(alpha), -np.sin(alpha)], [np.sin(alpha), np.cos(alpha)]])
    return turn @ np.array([2 * e - f, 2 * k * np.sin(w)]) / f, f * f * turn[:, 0]


class Rod:
    def __init__(self, q):
        self.q = np.array(q)

    def force(self, x):
        """The force on the mass at the place x on the floor, with the load."""
        for _ in range(30):
            steps = 1e-6 * np.eye(2)
            jacobian = np.column_stack([(end(self.q + d)[0] - end(self.q - d)[0]) / 2e-6 for d in steps])
            step = np.linalg.solve(jacobian, [x, FLOOR] - end(self.q)[0])
            self.q = self.q + step
            if np.abs(step).max() < 1e-14:
                break
        return end(self.q)[1] + LOAD


def after(impact):
    """Times of the reversal and of sticking."""
    rod = Rod([-0.15, 2.5])
    t, x, (v, up) = impact["t"], impact["x"], impact["v_after"]
    left = -2 * up / (rod.force(x)[1] * (1 - RESTITUTION))
    sense, span = np.sign(v), left
    v, times, stop = v + sense * FRICTION * up, [], None
    while True:

        def rate(_, z, sense=sense):
            f = rod.force(z[0])
            return [z[1], f[0] + sense * FRICTION * f[1]]

        z = solve_ivp(rate, (t, t + span), [x, v], method="DOP853", rtol=1e-13, atol=1e-15, events=stop, max_step=0.01)
        t, (x, v) = z.t[-1], z.y[:, -1]
        if stop is not None:
            times.append(t)
            f = rod.force(x)
            if abs(f[0]) <= -FRICTION * f[1]:
                return times
            sense, v = np.sign(f[0]), 0.0

        def stop(_, z):
            return z[1]

        stop.terminal, stop.direction, span = True, -sense, 1.0


if __name__ == "__main__":
    data = Path(__file__).parent.parent / "tests/data/contact/bounce_given.json"
    case = next(case for case in json.loads(data.read_text()) if case["friction"] == FRICTION)
    for k in (-10, -8, -6):
        print(*after(case["impacts"][k]))
