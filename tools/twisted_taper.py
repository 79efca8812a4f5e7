"""Angles at which a tapered rod, twisted between two clamps, leaves the straight line: tests/suite/studies.rs.

    python3 tools/twisted_taper.py     # needs mpmath; two minutes

The straight rod bears the couple M = C a along its axis e, and no force. Its neighbours have the turn phi and the
deflection r of a section, the couple m(s) = m(0) - s e x n and a force n across the axis. With the directors
d_1 = (cos a s, sin a s) and d_2 = (-sin a s, cos a s) of the twisted rod

    phi' = sum_i d_i (d_i . (m + M e x phi))/B_i(s),   r' = phi x e,   phi = r = 0 at both ends.

The angle is a root of the determinant of (phi, r) at the end by (m(0), n).
"""
from mpmath import cos, det, findroot, matrix, mp, mpf, nstr, odefun, sin

mp.dps = 25
TORSION = mpf("0.75")


def bending(s):
    """Stiffnesses about d_1 and d_2 at s."""
    return mpf("1.01") - mpf("0.02") * s, mpf("1.011") - mpf("0.02") * s


def slope(angle, s, state):
    """Slopes of (phi_1, phi_2, r_1, r_2) and of the constants (m(0), n) across the axis."""
    phi1, phi2, _, _, m1, m2, n1, n2 = state
    couple = TORSION * angle
    x, y = m1 + s * n2 - couple * phi2, m2 - s * n1 + couple * phi1
    c, d = cos(angle * s), sin(angle * s)
    first, second = bending(s)
    u1, u2 = (c * x + d * y) / first, (c * y - d * x) / second
    return [c * u1 - d * u2, d * u1 + c * u2, phi2, -phi1, 0, 0, 0, 0]


def determinant(angle):
    columns = []
    for k in range(4):
        start = [mpf(0)] * 8
        start[4 + k] = mpf(1)
        end = odefun(lambda s, state: slope(angle, s, state), 0, start, tol=mpf("1e-20"))
        columns.append(end(1)[:4])
    return det(matrix(columns))


for guess in ("11.98736", "11.98862"):
    near = mpf(guess)
    root = findroot(determinant, (near, near + mpf("1e-5")), tol=1e-30, verify=False, maxsteps=8)
    print(nstr(root, 18))
