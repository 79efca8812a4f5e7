"""Rods with tendons by the loads of Rucker and Webster (2011): writes tests/data/tendons.json.

Independent of the program, which minimises a stored energy: here a tendon puts a force T t' per length and a couple on
the rod, and a force and a couple at its anchor, the rod's end. The curvature at the clamp is found by shooting. Rods
are inextensible and unshearable, clamped at the origin along z, the directors along the axes.
"""
import json
import math
import pathlib

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

L, B, C = 0.242, 0.0042223005264247, 0.0032169908772759
STIFFNESS = np.diag([B, B, C])
E3 = np.array([0.0, 0.0, 1.0])


def hat(u):
    return np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])


def linear(start, stop):
    start, stop = np.array(start + [0.0]), np.array(stop + [0.0])
    return lambda s: (start + (stop - start) * s / L, (stop - start) / L, np.zeros(3))


def helix(distance, phase, turns):
    w = 2 * math.pi * turns / L

    def at(s):
        c, q = math.cos(phase + w * s), math.sin(phase + w * s)
        first = distance * np.array([c, q, 0.0])
        return first, distance * w * np.array([-q, c, 0.0]), -w * w * first

    return at


def path(route, s, u):
    x, x1, x2 = route(s)
    return x, x1, x2, E3 + np.cross(u, x) + x1


def slope(s, y, tendons):
    R, n, u = y[3:12].reshape(3, 3), y[12:15], y[15:18]
    stiffness, couple = STIFFNESS.copy(), np.cross(u, STIFFNESS @ u) + np.cross(E3, R.T @ n)
    force = np.zeros(3)
    parts = []
    for route, tension in tendons:
        x, x1, x2, p = path(route, s, u)
        size = np.linalg.norm(p)
        # t' along the directors is M (p'' without u'), and M u' x x beside it.
        M = -tension * hat(p) @ hat(p) / size**3
        rest = np.cross(u, p) + np.cross(u, x1) + x2
        # The couple x cross f of the force f = M (rest - x cross u').
        stiffness += -hat(x) @ M @ hat(x)
        couple += np.cross(x, M @ rest)
        parts.append((M, rest, x))
    u1 = -np.linalg.solve(stiffness, couple)
    for M, rest, x in parts:
        force += M @ (rest - np.cross(x, u1))
    return np.concatenate([R @ E3, (R @ hat(u)).ravel(), -R @ force, u1])


def solve(tendons, tip):
    def run(u0, dense=False):
        n0 = np.array(tip, float)
        for route, tension in tendons:
            p = path(route, 0.0, u0)[3]
            n0 = n0 - tension * p / np.linalg.norm(p)
        start = np.concatenate([np.zeros(3), np.eye(3).ravel(), n0, u0])
        return solve_ivp(slope, (0, L), start, "DOP853", args=(tendons,), rtol=1e-12, atol=1e-13)

    def off(u0):
        end = run(u0).y[:, -1]
        left = STIFFNESS @ end[15:18]
        for route, tension in tendons:
            x, _, _, p = path(route, L, end[15:18])
            left = left + np.cross(x, tension * p / np.linalg.norm(p))
        return left / B * L

    u0 = np.zeros(3)
    for part in np.linspace(0.1, 1.0, 10):
        full, tendons, whole, tip = tendons, [(r, part * T) for r, T in tendons], tip, part * np.array(tip)
        u0 = fsolve(off, u0, xtol=1e-13)
        tendons, tip = full, whole
    run = run(u0)
    end = run.y[:, -1]
    return {"end": end[:3].tolist(), "directors": end[3:12].tolist(), "rod_couple": (STIFFNESS @ u0).tolist()}


CASES = {
    "parallel": ("[0.008, 0.0]", linear([0.008, 0.0], [0.008, 0.0]), 5.0, [0.02, 0.03, -0.02]),
    "convergent": (
        "{ linear = [[0.008, 0.0], [0.001, 0.003]] }", linear([0.008, 0.0], [0.001, 0.003]), 6.0, [0.0, 0.05, 0.05]),
    "helical": (
        "{ helix = { distance = 0.008, phase = 0.5, turns = 1.0 } }", helix(0.008, 0.5, 1.0), 5.0, [0.05, 0.0, -0.02]),
}

if __name__ == "__main__":
    rows = []
    for name, (offset, route, tension, tip) in CASES.items():
        rows.append({"name": name, "offset": offset, "tension": tension, "tip": tip, **solve([(route, tension)], tip)})
    out = pathlib.Path(__file__).parent.parent / "tests" / "data" / "tendons.json"
    out.write_text(json.dumps(rows, indent=1) + "\n")
