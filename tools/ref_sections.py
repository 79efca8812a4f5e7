"""Rods whose shape varies or jumps, and rods that bend about one director alone: tests/data/sections.json.

Cantilevers under weight and a force: the planar equations integrated from the free end, whose angle is found so that
the clamp is met. Rods in space: shooting for the base couple, rotations as matrices. Vibrations: the determinant of a
straight rod with rotary inertia and a point mass at its end. DOP853 of scipy at 1e-13, split where the shape jumps.
"""

import json
from math import pi
from pathlib import Path

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq, fsolve

OUT = Path(__file__).resolve().parent.parent / "tests" / "data" / "sections.json"


def along(pieces, slope, start, back=False):
    """Integrates over the pieces (from, to, ..) in order, or backwards from the last."""
    y = np.array(start, float)
    for piece in reversed(pieces) if back else pieces:
        span = (piece[1], piece[0]) if back else (piece[0], piece[1])
        y = solve_ivp(lambda s, y: slope(s, y, piece), span, y, method="DOP853", rtol=1e-13, atol=1e-16).y[:, -1]
    return y


def diameter(s, piece):
    from_, to, first, last = piece
    return first + (last - first) * (s - from_) / (to - from_)


def cantilever(name, pieces, young, density, gravity, force):
    """In the plane of y and z, clamped along z; the angle of the tangent from z towards y."""
    g, f = np.array(gravity), np.array(force)

    def slope(s, y, piece):
        angle, couple, n = y[0], y[1], y[2:4]
        d = diameter(s, piece)
        area, moment = pi * d * d / 4, pi * d**4 / 64
        t = np.array([np.sin(angle), np.cos(angle)])
        bent = couple / (young * moment)
        # m' = -(r' x n) about the axis that turns z towards y.
        return [bent, -(t[1] * n[0] - t[0] * n[1]), *(-density * area * g), *t, density * area, 0.5 * couple * bent]

    def at_clamp(angle, part):
        nonlocal g, f
        g, f = np.array(gravity) * part, np.array(force) * part
        return along(pieces, slope, [angle, 0, *f, 0, 0, 0, 0], back=True)

    angle = 0.0
    for part in np.linspace(0.05, 1, 40):
        angle = fsolve(lambda a: at_clamp(a[0], part)[0], [angle], xtol=1e-14)[0]
    y = at_clamp(angle, 1)
    return {
        "name": name,
        "end": (-y[4:6]).tolist(),
        "angle": angle,
        "base_couple": y[1],
        "mass": -y[6],
        "energy": -y[7],
    }


def frequencies(name, pieces, young, density, mass, count):
    """Angular frequencies about the straight rod, with a point of this mass on its end."""

    def at_end(omega):
        def slope(s, y, piece):
            d = diameter(s, piece)
            area, moment = pi * d * d / 4, pi * d**4 / 64
            w, turn, couple, force = y
            rotary, inertia = density * moment, density * area
            return [turn, couple / (young * moment), -force - omega**2 * rotary * turn, -(omega**2) * inertia * w]

        columns = [along(pieces, slope, start) for start in ([0, 0, 1, 0], [0, 0, 0, 1])]
        rows = [[y[2], y[3] - mass * omega**2 * y[0]] for y in columns]
        return rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0]

    found, step, omega = [], 2.0, 1.0
    before = at_end(omega)
    while len(found) < count:
        after = at_end(omega + step)
        if before * after < 0:
            found.append(brentq(at_end, omega, omega + step, xtol=1e-13, rtol=1e-14))
        omega, before = omega + step, after
    return {"name": name, "omega": found}


def one_way(name, force, couple, stiffness):
    """A rod of length 1 clamped along the axes, with compliances 1/stiffness of u1, u2, u3; inextensible."""
    n, end = np.array(force, float), np.array(couple, float)
    give = np.array([0.0 if k is None else 1.0 / k for k in stiffness])

    def whole(base):
        def slope(s, y, _):
            turn, r = y[:9].reshape(3, 3), y[9:12]
            local = turn.T @ (base - np.cross(r, n))
            u = give * local
            hat = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
            return [*(turn @ hat).ravel(), *turn[:, 2], 0.5 * u @ local]

        return along([(0, 1)], slope, [*np.eye(3).ravel(), 0, 0, 0, 0])

    base = np.zeros(3)
    for part in np.linspace(0.1, 1, 10):
        n, end = np.array(force) * part, np.array(couple) * part
        base = fsolve(lambda b: b - np.cross(whole(b)[9:12], n) - end, base, xtol=1e-14)
    y = whole(base)
    return {
        "name": name,
        "force": force,
        "couple": couple,
        "end": y[9:12].tolist(),
        "tangent": y[[2, 5, 8]].tolist(),
        "base_couple": base.tolist(),
        "energy": y[12],
    }


TAPER = [(0, 0.4, 0.012, 0.005)]
STEPS = [(0, 0.1, 0.01, 0.01), (0.1, 0.2, 0.007, 0.007), (0.2, 0.3, 0.005, 0.005)]

if __name__ == "__main__":
    data = {
        "cantilevers": [
            cantilever("taper", TAPER, 2e6, 1100, [-9.81, 0], [-0.01, 0.02]),
            cantilever("steps", STEPS, 2e6, 1000, [0, -9.81], [-0.02, 0]),
        ],
        "frequencies": [
            frequencies("taper", TAPER, 2e6, 1100, 0.005, 3),
            frequencies("steps", STEPS, 2e6, 1000, 0.005, 3),
        ],
        "one_way": [
            one_way("force", [1.5, -1.0, 0.5], [0, 0, 0], [None, 1.0, 0.8]),
            one_way("couple", [0.5, -0.5, -0.5], [0.3, 0.8, 1.0], [None, 1.0, 0.8]),
            one_way("no twist", [1.5, -1.0, 0.5], [0, 0, 0], [1.3, 1.0, None]),
        ],
    }
    OUT.write_text(json.dumps(data, indent=1) + "\n")
    print(OUT.read_text())
