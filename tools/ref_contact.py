#!/usr/bin/env python3
"""Rods that touch spheres: equilibria made from the base wrench, for tests/data/contact.json.

Frame, centreline, couple and force are integrated as they stand (R' = R [u], r' = (1 + e) d3, m' = -r' x n, n' = -q),
by DOP853 to 1e-13. At a chosen place a chosen reaction acts across the rod, and the sphere is put where it pushes so.
Pose of the end, touches and base wrench then belong to an equilibrium of a rod with both ends clamped.

Needs numpy and scipy. Writes JSON to standard output.
"""

import json

import numpy as np
from scipy.integrate import solve_ivp


def skew(x):
    return np.array([[0, -x[2], x[1]], [x[2], 0, -x[0]], [-x[1], x[0], 0]])


def integrate(rod, state, s0, s1):
    """State (R, r, m, n) carried from s0 to s1."""
    stiff, rest, axial, q = rod["stiffness"], rod["rest"], rod["axial"], rod["weight"]

    def slope(_, y):
        frame = y[:9].reshape(3, 3)
        m, n = y[12:15], y[15:18]
        u = rest + (frame.T @ m) / stiff
        stretch = 1.0 + (0.0 if axial is None else frame[:, 2] @ n / axial)
        along = stretch * frame[:, 2]
        return np.concatenate([(frame @ skew(u)).ravel(), along, -np.cross(along, n), -np.array(q)])

    found = solve_ivp(slope, (s0, s1), state, method="DOP853", rtol=1e-13, atol=1e-14)
    return found.y[:, -1]


def quaternion(frame):
    """(w, x, y, z) of a rotation with w > 0."""
    w = 0.5 * np.sqrt(max(0.0, 1.0 + np.trace(frame)))
    v = [frame[2, 1] - frame[1, 2], frame[0, 2] - frame[2, 0], frame[1, 0] - frame[0, 1]]
    return [w] + [x / (4 * w) for x in v]


def case(name, stiffness, rest, axial, weight, base, touches, radius, offset):
    """touches: (s, R, angle of the normal about the tangent)."""
    rod = {"stiffness": np.array(stiffness), "rest": np.array(rest), "axial": axial, "weight": weight}
    state = np.concatenate([np.eye(3).ravel(), np.zeros(3), base])
    at, out = 0.0, []
    for s, reaction, angle in touches:
        state = integrate(rod, state, at, s)
        at = s
        frame = state[:9].reshape(3, 3)
        normal = np.cos(angle) * frame[:, 0] + np.sin(angle) * frame[:, 1]
        u = rest + (frame.T @ state[12:15]) / rod["stiffness"]
        stretch = 1.0 + (0.0 if axial is None else frame[:, 2] @ state[15:18] / axial)
        curvature = stretch * normal @ np.cross(frame @ u, frame[:, 2]) + stretch**2 / (radius + offset)
        out.append(
            {
                "s": s,
                "reaction": reaction,
                "normal": normal.tolist(),
                "centre": (state[9:12] - (radius + offset) * normal).tolist(),
                "relative_curvature": curvature,
            }
        )
        state = state.copy()
        state[15:18] -= reaction * normal
    state = integrate(rod, state, at, 1.0)
    frame = state[:9].reshape(3, 3)
    return {
        "name": name,
        "stiffness": stiffness,
        "rest": rest,
        "axial": axial,
        "weight": weight,
        "radius": radius,
        "offset": offset,
        "base": base,
        "touches": out,
        "end": {
            "position": state[9:12].tolist(),
            "quaternion": quaternion(frame),
            "couple": state[12:15].tolist(),
            "force": state[15:18].tolist(),
        },
    }


def main():
    cases = [
        case("one touch, no weight", [1.0, 1.5, 0.8], [0.0, 0.0, 0.0], None, [0.0, 0.0, 0.0],
             [0.8, -0.5, 0.3, 2.0, 1.0, -3.0], [(0.43, 2.5, 0.7)], 0.1, 0.02),
        case("two touches, weight, curved at rest, stretches", [1.0, 1.5, 0.8], [0.3, -0.2, 0.5], 400.0, [-3.0, 0.5, 1.0],
             [0.6, 1.1, -0.2, -1.0, 2.0, -2.0], [(0.31, 3.0, 2.0), (0.77, 4.0, -1.2)], 0.15, 0.01),
    ]
    print(json.dumps({"about": "made by tools/ref_contact.py; length 1, clamp at the origin along z", "cases": cases}, indent=1))


if __name__ == "__main__":
    main()
