"""Impacts with Coulomb friction at one contact in space, by integration over the normal impulse.

    python3 tools/ref_impact.py        (numpy, scipy; writes tests/data/contact/impacts.json)

With u = (u_n, t) the slip velocity and B the inverse mass at the contact, du/dp = B (1, -mu t/|t|) while the surfaces
slip. Here t = r (cos a, sin a), and r, a, u_n, the work W of the normal impulse are integrated over p:

    r' = d . f,   a' = d_across . f/r,   u_n' = B_nn - mu b . d,   W' = u_n,   f = b - mu B_t d.

Slip ends at r = 0, which the last 1e-9 of r reach along a straight line. Surfaces then stick if |B_t^-1 b| <= mu, else
they slip on along the direction d with f parallel to d and growing, found here as a root in the angle. Compression ends
at u_n = 0; the whole ends by the law: Newton u_n = -e u_n(0), Poisson p = (1 + e) p_c, Stronge W = (1 - e^2) W_c.
"""

import json
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

SHORT = 1e-9


def path(b, mu, slip):
    """Pieces (p0, p1, state of p) of the path; state = (u_n, t1, t2, W, J1, J2)."""
    bn, bt = b[1:, 0], b[1:, 1:]
    state, p = np.array([*slip, 0.0, 0.0, 0.0]), 0.0
    r = np.hypot(state[1], state[2])
    if r > 0:

        def rate(_, y):
            d, across = np.array([np.cos(y[1]), np.sin(y[1])]), np.array([-np.sin(y[1]), np.cos(y[1])])
            f = bn - mu * bt @ d
            return [d @ f, across @ f / y[0], b[0, 0] - mu * bn @ d, y[2], -mu * d[0], -mu * d[1]]

        def stopped(_, y):
            return y[0] - SHORT * r

        stopped.terminal = True
        start = [r, np.arctan2(state[2], state[1]), state[0], 0.0, 0.0, 0.0]
        run = solve_ivp(rate, [0, 20], start, "DOP853", rtol=3e-14, atol=1e-16, events=stopped, dense_output=True, max_step=0.1)

        def curved(x, run=run):
            y = run.sol(x)
            return np.array([y[2], y[0] * np.cos(y[1]), y[0] * np.sin(y[1]), y[3], y[4], y[5]])

        yield 0.0, run.t[-1], curved
        y = run.y[:, -1]
        slope = rate(0, y)
        left = y[0] / -slope[0]
        p = run.t[-1] + left
        state = curved(run.t[-1]) + left * np.array([slope[2], 0.0, 0.0, *slope[3:]])
        state[1:3] = 0.0
    holding = -np.linalg.solve(bt, bn)
    if np.hypot(*holding) <= mu:
        friction = holding
    else:

        def turning(a):
            return np.array([-np.sin(a), np.cos(a)]) @ (bn - mu * bt @ np.array([np.cos(a), np.sin(a)]))

        angles = np.linspace(0, 2 * np.pi, 721)
        roots = [brentq(turning, x, y) for x, y in zip(angles, angles[1:]) if turning(x) * turning(y) < 0]
        ways = [np.array([np.cos(a), np.sin(a)]) for a in roots]
        (way,) = [d for d in ways if d @ (bn - mu * bt @ d) > 0]
        friction = -mu * way
    change = b @ np.array([1.0, *friction])

    def straight(x, p=p, state=state):
        q = x - p
        return np.array([*(state[:3] + change * q), state[3] + state[0] * q + change[0] * q * q / 2, *(state[4:] + friction * q)])

    yield p, 20.0, straight


def impact(b, mu, e, slip, law):
    pieces = list(path(b, mu, slip))

    def find(value):
        for low, high, state in pieces:
            if value(high, state(high)) >= 0:
                return brentq(lambda x: value(x, state(x)), low, high, xtol=1e-15, rtol=1e-14), state
        raise ValueError("no end")

    p, at = find(lambda _, y: y[0])
    if law == "newton":
        p, at = find(lambda _, y: y[0] + e * slip[0])
    elif law == "poisson":
        total = (1 + e) * p
        p, at = find(lambda x, _: x - total)
    elif e > 0:
        work = (1 - e * e) * at(p)[3]
        p, at = find(lambda _, y: y[3] - work if y[0] > 0 else -1.0)
    y = at(p)
    return {"impulse": [p, *y[4:]], "slip": list(y[:3]), "normal_work": y[3]}


def main():
    rng = np.random.default_rng(5)
    wanted = {("curved", True): 1, ("curved", False): 2, ("stopped", True): 3, ("stopped", False): 2}
    cases = []
    while any(wanted.values()):
        a = rng.uniform(-1, 1, (3, 3))
        b = a @ a.T + 0.3 * np.eye(3)
        mu, e = rng.uniform(0.1, 0.9), rng.uniform(0.1, 1)
        slip = [-rng.uniform(0.3, 1.5), *rng.uniform(-0.4, 0.4, 2)]
        if b[0, 0] <= mu * np.hypot(b[1, 0], b[2, 0]):
            continue
        sticks = bool(np.hypot(*np.linalg.solve(b[1:, 1:], b[1:, 0])) <= mu)
        if not wanted["stopped", sticks] and not wanted["curved", sticks]:
            continue
        results = {law: impact(b, mu, e, slip, law) for law in ("newton", "poisson", "stronge")}
        stops = next(path(b, mu, slip))[1]
        ends = "curved" if max(r["impulse"][0] for r in results.values()) < stops else "stopped"
        if not wanted[ends, sticks]:
            continue
        wanted[ends, sticks] -= 1
        cases.append({"inverse_mass": b.tolist(), "mu": mu, "e": e, "slip": slip, "ends": ends, "sticks": sticks, "results": results})
    target = Path(__file__).resolve().parent.parent / "tests/data/contact/impacts.json"
    target.write_text(json.dumps({"about": "made by tools/ref_impact.py", "space": cases}) + "\n")


main()
