"""An isotropic wire between coaxial clamps: tests/data/rod_wire.json.

The first planar mode is closed: P = 16 K^2, z = 2 E/K - 1, clamp couple 8 k K (length and bending stiffness 1, k the
modulus). Out of the plane the map from the base wrench (dm1, dm3, dn2) to the end (phi1, phi3, rho2) is differentiated by
complex steps through the equations in space, R' = R hat(u), u = C R^T m, m = m(0) - r x n (Dormand and Prince's method of
order 8, fixed steps). The wire turns about the clamps for nothing, which is dm1 at the base and phi1 at the end; the
determinant of what is left changes its sign at the branch point out of the plane. `uncertainty` is the change by half the
steps. Run: python3 tools/ref_wire.py
"""

import json
import pathlib

import numpy as np
from scipy.integrate._ivp import dop853_coefficients as dop853
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

A, B = dop853.A[:12, :12], dop853.B


def end(m0, n, torsion, steps):
    compliance = np.array([1.0, 1.0, 1.0 / torsion])

    def slope(y):
        r, frame = y[:3], y[3:].reshape(3, 3)
        u = compliance * (frame.T @ (m0 - np.cross(r, n)))
        hat = np.array([[0, -u[2], u[1]], [u[2], 0, -u[0]], [-u[1], u[0], 0]])
        return np.concatenate([frame[:, 2], (frame @ hat).ravel()])

    y, h = np.concatenate([np.zeros(3), np.eye(3).ravel()]).astype(complex), 1.0 / steps
    for _ in range(steps):
        k = []
        for row in A:
            k.append(slope(y + h * sum((a * at for a, at in zip(row, k) if a), np.zeros_like(y))))
        y = y + h * sum(b * at for b, at in zip(B, k))
    return y[:3], y[3:].reshape(3, 3)


def determinant(k, torsion, steps):
    """Of phi3 and rho2 by dm3 and dn2, with the closed plane as the state."""
    whole = ellipk(k * k)
    columns = []
    for dm, dn in [([0, 0, 1], [0, 0, 0]), ([0, 0, 0], [0, 1, 0])]:
        m = np.array([0, 8 * k * whole, 0]) + 1e-30j * np.array(dm)
        n = np.array([0, 0, -16 * whole**2]) + 1e-30j * np.array(dn)
        r, frame = end(m, n, torsion, steps)
        turn = (frame.imag @ frame.real.T) / 1e-30
        columns.append([turn[1, 0], r.imag[1] / 1e-30])
    (a, b), (c, d) = columns
    return a * d - b * c


def case(torsion):
    def place(steps):
        at = np.linspace(0.3, 0.95, 14)
        signs = [determinant(k, torsion, 30) for k in at]
        changes = [i for i in range(len(at) - 1) if signs[i] * signs[i + 1] < 0]
        assert len(changes) == 1, (torsion, changes)
        k = brentq(determinant, at[changes[0]], at[changes[0] + 1], (torsion, steps), xtol=1e-14)
        return 2 * ellipe(k * k) / ellipk(k * k) - 1

    z = place(80)
    return {"torsion": torsion, "z": z, "uncertainty": abs(z - place(40))}


if __name__ == "__main__":
    cases = [case(torsion) for torsion in [0.5, 2 / 3, 0.8, 1.0, 1.2, 1.5]]
    target = pathlib.Path(__file__).parent.parent / "tests/data/rod_wire.json"
    target.write_text(json.dumps({"recipe": "tools/ref_wire.py", "cases": cases}, indent=1) + "\n")
    for each in cases:
        print(each)
