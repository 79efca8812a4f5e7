"""Heavy flexible rods at rest: tests/data/rod_heavy.json.

Boundary-value problems of theory 3.8 by multiple shooting (Dormand and Prince's method of order 8, Newton's method with
differences), along a path in the weight. In the plane, x to the right, z up, theta from x, the tension T = n.t:
    n = (H, V + w s),  theta' = M,  (x, z)' = (1 + c T)(cos theta, sin theta),  M' = -(x' n_z - z' n_x).
In space, with a free end and gravity along g: n = w (1 - s) g, m' = -r' x n, u = K^-1 R^T m + u0.
Length and bending stiffness are 1. Each case is solved on two meshes; `uncertainty` is the largest difference.
Run: python3 tools/ref_heavy_rods.py
"""

import json
import pathlib

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as dop853
from scipy.optimize import minimize

A, B, C = dop853.A[:12, :12], dop853.B, dop853.C[:12]


def flown(slope, s, h, y, steps):
    """States at s + h from those at s, by columns."""
    h = h / steps
    for _ in range(steps):
        k = []
        for row, c in zip(A, C):
            inner = y + h * sum((a * at for a, at in zip(row, k) if a), np.zeros_like(y))
            k.append(slope(s + c * h, inner))
        y = y + h * sum(b * at for b, at in zip(B, k))
        s = s + h
    return y


def shot(slope, ends, places, y, p, steps):
    """Newton's method for the states `y` at `places` (by columns) and the parameters `p`."""
    size, pieces = y.shape[0], len(places) - 1
    starts, lengths = places[:-1], np.diff(places)
    for _ in range(60):
        def residual(y, p):
            reached = flown(lambda s, y: slope(s, y, p), starts, lengths, y[:, :-1], steps)
            return np.concatenate([(reached - y[:, 1:]).T.ravel(), ends(y[:, 0], y[:, -1], p)])

        base = residual(y, p)
        jacobian = np.zeros((base.size, base.size))
        for i in range(size):
            d = 1e-6 * (1 + np.abs(y[i, :-1]))
            moved = y[:, :-1].copy()
            moved[i] += d
            less = y[:, :-1].copy()
            less[i] -= d
            fly = lambda y: flown(lambda s, y: slope(s, y, p), starts, lengths, y, steps)
            change = (fly(moved) - fly(less)) / (2 * d)
            for k in range(pieces):
                jacobian[size * k : size * (k + 1), size * k + i] += change[:, k]
                jacobian[size * k + i, size * (k + 1) + i] -= 1
        for j in [*range(size), *range(size * pieces, size * (pieces + 1))]:
            d = 1e-6
            a, b = y.copy(), y.copy()
            a[j % size, j // size] += d
            b[j % size, j // size] -= d
            change = (ends(a[:, 0], a[:, -1], p) - ends(b[:, 0], b[:, -1], p)) / (2 * d)
            jacobian[size * pieces :, j] = change
        for j in range(len(p)):
            d = 1e-6 * (1 + abs(p[j]))
            a, b = p.copy(), p.copy()
            a[j] += d
            b[j] -= d
            jacobian[:, size * (pieces + 1) + j] = (residual(y, a) - residual(y, b)) / (2 * d)
        step = -np.linalg.solve(jacobian, base)
        part = min(1.0, 0.5 / np.abs(step[: size * (pieces + 1)].reshape(-1, size)[:, :1]).max())
        y = y + part * step[: size * (pieces + 1)].reshape(-1, size).T
        p = p + part * step[size * (pieces + 1) :]
        if part == 1.0 and np.abs(step / (1 + np.abs(np.concatenate([y.T.ravel(), p])))).max() < 1e-12:
            return y, p
    return y, p


def fallen(weight, end, angles, count=160):
    """Angles of a chain of straight pieces at rest, and its force (H, V) at the base: a guess."""
    h = 1 / count

    def energy(theta):
        bent = np.diff(np.concatenate([[angles[0]], theta]))
        value = (bent[0] ** 2 + 0.5 * (bent[1:] ** 2).sum()) / h
        slope = np.zeros(count)
        slope[0] += 2 * bent[0] / h
        slope[1:] += bent[1:] / h
        slope[:-1] -= bent[1:] / h
        beyond = weight * (1 - (np.arange(count) + 0.5) * h) * h
        value += (beyond * np.sin(theta)).sum()
        slope += beyond * np.cos(theta)
        if end is not None:
            value += (theta[-1] - angles[1]) ** 2 / h
            slope[-1] += 2 * (theta[-1] - angles[1]) / h
            off = h * np.array([np.cos(theta).sum(), np.sin(theta).sum()]) - end
            stiff = 30 * (1 + weight)
            value += 0.5 * stiff * off @ off
            slope += stiff * h * (-off[0] * np.sin(theta) + off[1] * np.cos(theta))
        return value, slope

    s = np.linspace(0, 1, count)
    start = angles[0] - 0.3 * s if end is None else 2.4 * s - 1.2
    found = minimize(energy, start, jac=True, method="L-BFGS-B", options={"maxiter": 20000, "maxfun": 40000, "ftol": 1e-15, "gtol": 1e-9})
    if end is None:
        return found.x, np.array([])
    off = h * np.array([np.cos(found.x).sum(), np.sin(found.x).sum()]) - end
    return found.x, -30 * (1 + weight) * off - np.array([0.0, weight])


def planar(weight, compliance, end, angles, pieces, steps):
    """Sag between clamps at the angles, or a rod with a free end (`end` is None)."""
    def slope(s, y, p):
        horizontal, vertical = p if end is not None else (0.0, -weight)
        theta, couple, x, z = y[:4]
        vertical = vertical + weight * s
        tension = horizontal * np.cos(theta) + vertical * np.sin(theta)
        dx, dz = (1 + compliance * tension) * np.cos(theta), (1 + compliance * tension) * np.sin(theta)
        return np.array([couple, -(dx * vertical - dz * horizontal), dx, dz, 0.5 * couple**2 + 0.5 * compliance * tension**2, weight * z])

    def ends(a, b, p):
        start = [a[0] - angles[0], a[2], a[3], a[4], a[5]]
        return np.array(start + ([b[1]] if end is None else [b[0] - angles[1], b[2] - end[0], b[3] - end[1]]))

    theta, p = fallen(weight, end, angles)
    count = len(theta)
    # Finer towards the clamps, where the layers lie.
    x = np.linspace(-1, 1, pieces + 1)
    places = 0.5 + 0.5 * np.tanh(2.2 * x) / np.tanh(2.2)
    middle = (np.arange(count) + 0.5) / count
    at = np.interp(places, np.concatenate([[0], middle, [1]]), np.concatenate([[angles[0]], theta, [angles[1] if end is not None else theta[-1]]]))
    fine = np.linspace(0, 1, 2001)
    along = np.interp(fine, places, at)
    sums = [np.interp(places, fine, np.concatenate([[0], np.cumsum(0.5 * (f(along)[1:] + f(along)[:-1])) / 2000])) for f in (np.cos, np.sin)]
    y = np.array([at, np.gradient(at, places), sums[0], sums[1], 0 * at, 0 * at])
    y, p = shot(slope, ends, places, y, p, steps)
    force = list(p) if end is not None else [0.0, -weight]
    half = flown(lambda s, y: slope(s, y, p), places[pieces // 2 : pieces // 2 + 1], 0.5 - places[pieces // 2 : pieces // 2 + 1], y[:, pieces // 2 : pieces // 2 + 1], steps)[:, 0]
    return {
        "base_force": force,
        "base_couple": y[1, 0],
        "middle": [half[2], half[3]],
        "end": [y[2, -1], y[3, -1]],
        "energy": y[4, -1],
        "potential": y[5, -1],
    }


def turned(q, v):
    w, u = q[0], q[1:]
    return v + 2 * np.cross(u.T, np.cross(u.T, v.T) + w[..., None] * v.T).T


def helix(weight, gravity, rest, torsion, turn, pieces, steps):
    """A rod of rest strains `rest` that hangs from a clamp turned by the quaternion `turn`, its end free."""
    stiffness = np.array([1.0, 1.0, torsion])[:, None]
    gravity, rest, turn = np.array(gravity)[:, None], np.array(rest)[:, None], np.array(turn)

    def problem(w):
        def slope(s, y, p):
            q = y[3:7]
            back = np.concatenate([q[:1], -q[1:]])
            tangent = turned(q, np.array([[0.0], [0.0], [1.0]]) + np.zeros((3, y.shape[1])))
            bent = turned(back, y[7:10]) / stiffness
            u = bent + rest
            dq = 0.5 * np.concatenate([-(q[1:] * u).sum(axis=0)[None], q[0] * u + np.cross(q[1:].T, u.T).T])
            force = w * (1 - s) * gravity
            return np.concatenate([tangent, dq, -np.cross(tangent.T, force.T).T, 0.5 * (stiffness * bent**2).sum(axis=0)[None]])

        return slope

    def ends(a, b, p):
        return np.concatenate([a[0:3], a[3:7] - turn, b[7:10], [a[10]]])

    places = np.linspace(0, 1, pieces + 1)
    y = np.zeros((11, pieces + 1))
    y[3:7, 0] = turn
    for k in range(pieces):
        y[:, k + 1] = flown(lambda s, y: problem(0.0)(s, y, []), places[k : k + 1], places[k + 1] - places[k : k + 1], y[:, k : k + 1], steps)[:, 0]
    for w in np.linspace(0.0, weight, 13)[1:]:
        y, _ = shot(problem(w), ends, places, y, np.array([]), steps)
    return {"middle": list(y[0:3, pieces // 2]), "end": list(y[0:3, -1]), "base_couple": list(y[7:10, 0]), "energy": y[10, -1]}


def plain(value):
    return {k: [float(x) for x in v] if isinstance(v, list) else float(v) for k, v in value.items()}


def numbers(value):
    return np.array([x for v in value.values() for x in np.atleast_1d(v)], dtype=float)


def main():
    cases = []

    def add(data, solve):
        coarse, fine = solve(24, 12), solve(40, 10)
        off = np.abs(numbers(coarse) - numbers(fine)) / np.maximum(1, np.abs(numbers(fine)))
        cases.append({**data, **plain(fine), "uncertainty": float(f"{off.max():.1e}")})
        print(cases[-1], flush=True)

    for weight, compliance, end, angles in [
        (400.0, 0.0, [0.8, 0.0], [0.0, 0.0]),
        (1e4, 0.0, [0.6, 0.2], [0.0, 0.0]),
        (1e4, 1e-5, [0.6, 0.2], [0.0, 0.0]),
        (900.0, 0.0, [0.5, -0.3], [0.4, 1.0]),
        (50.0, 0.0, None, [np.pi / 2]),
        (500.0, 0.0, None, [np.pi / 2 - 0.15]),
        (500.0, 2e-4, None, [np.pi / 2]),
        (5000.0, 0.0, None, [np.pi / 2]),
    ]:
        data = {"weight": weight, "compliance": compliance, "held": end, "angles": angles}
        add(data, lambda pieces, steps: planar(weight, compliance, end, angles, pieces, steps))
    for weight, gravity in [(300.0, [0.0, 0.0, 1.0]), (300.0, [1.0, 0.0, 0.0])]:
        data = {"weight": weight, "gravity": gravity, "rest": [0.0, 15.0, 6.0], "torsion": 0.7, "turn": [0.8, 0.0, 0.6, 0.0]}
        add(data, lambda pieces, steps: helix(weight, gravity, data["rest"], 0.7, data["turn"], pieces, steps))
    target = pathlib.Path(__file__).parent.parent / "tests/data/rod_heavy.json"
    target.write_text(json.dumps({"cases": cases}, indent=1) + "\n")


if __name__ == "__main__":
    main()
