"""Spatial Cosserat rods for reference data: two formulations, both in 80-bit extended precision.

Conventions: strain e = (u1,u2,u3,v1,v2,v3), resultant w = (m1,m2,m3,n1,n2,n3) along the directors; R = [d1 d2 d3],
R' = R [u]x, r' = R v; n constant, m(s) = m(0) - r(s) x n in the world frame; b = (m(0), n); clamp at the origin, R(0) = I.
Linear law w = K(s) (e - rest), K(s) = K0 (1 - taper s); components in "rigid" keep their rest value (the compliance is
the inverse of the free block, zero elsewhere).

Route A (class Taylor): director matrix (9 numbers) and position, adaptive Taylor series of order 28 in s.
Route B (function gbs): local balance M' = M x u + N x v, N' = N x u with an unnormalised quaternion and position,
Gragg-Bulirsch-Stoer extrapolation (order 20, fixed steps).
Tangents d(phi, r)(s)/d(m0, n), with dR = [dphi]x R, by complex step (1e-40 i) through either route.
"""
import numpy as np

LD, CLD = np.longdouble, np.clongdouble
H = LD('1e-40')
ORDER = 28


def inverse(A):
    """Inverse of a small matrix in extended precision: double inverse and Newton-Schulz steps."""
    A = np.asarray(A, LD)
    X = np.linalg.inv(A.astype(float)).astype(LD)
    I2 = 2 * np.eye(len(A), dtype=LD)
    for _ in range(3):
        X = X.dot(I2 - A.dot(X))
    return X


class Section:
    def __init__(self, stiffness, rigid=(), rest=(0, 0, 0, 0, 0, 1), taper=0.0):
        K = np.array(stiffness, float)
        if K.ndim == 1:
            K = np.diag(K)
        self.rigid = sorted(rigid)
        for i in self.rigid:
            K[i, :] = 0
            K[:, i] = 0
        self.free = [i for i in range(6) if i not in self.rigid]
        self.K, self.rest, self.taper = K, np.array(rest, float), float(taper)
        self.C = np.zeros((6, 6), LD)
        self.C[np.ix_(self.free, self.free)] = inverse(K[np.ix_(self.free, self.free)])
        self.C = (self.C + self.C.T) / 2

    def json(self):
        return {'stiffness': self.K.tolist(), 'rigid': self.rigid, 'rest': self.rest.tolist(), 'taper': self.taper}


def kirchhoff(b1, b2, c, **kw):
    """Unshearable and inextensible."""
    return Section([b1, b2, c, 1, 1, 1], rigid=(3, 4, 5), **kw)


def cross(a, b):
    return np.stack([a[..., 1] * b[..., 2] - a[..., 2] * b[..., 1],
                     a[..., 2] * b[..., 0] - a[..., 0] * b[..., 2],
                     a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]], axis=-1)


def hat(u):
    z = np.zeros_like(u[..., 0])
    return np.stack([np.stack([z, -u[..., 2], u[..., 1]], -1), np.stack([u[..., 2], z, -u[..., 0]], -1),
                     np.stack([-u[..., 1], u[..., 0], z], -1)], -2)


def taylor(sec, b, L, out=None):
    """Route A. b: (B,6) complex extended. Returns R (B,3,3), r, U at L, or lists at the points `out`."""
    b = np.atleast_2d(np.asarray(b, CLD))
    nb = len(b)
    m0, n = b[:, :3], b[:, 3:]
    L = LD(L)
    marks = [L] if out is None else [LD(x) for x in out]
    got = []
    R = np.zeros((ORDER + 1, nb, 3, 3), CLD)
    r = np.zeros((ORDER + 1, nb, 3), CLD)
    m = np.zeros((ORDER + 1, nb, 3), CLD)
    w = np.zeros((ORDER + 1, nb, 6), CLD)
    e = np.zeros((ORDER + 1, nb, 6), CLD)      # e - rest
    u = np.zeros((ORDER + 1, nb, 3, 3), CLD)   # [u]x
    v = np.zeros((ORDER + 1, nb, 3), CLD)
    U = np.zeros((ORDER + 1, nb), CLD)
    f = np.zeros(ORDER + 1, LD)
    R[0] = np.eye(3)
    s, taper, C = LD(0), LD(sec.taper), sec.C.astype(CLD)
    rest = sec.rest.astype(CLD)
    while marks and marks[0] <= 0:
        got.append((R[0].copy(), r[0].copy(), U[0].copy()))
        marks.pop(0)
    while marks:
        f[0] = 1 / (1 - taper * s)
        for k in range(1, ORDER + 1):
            f[k] = f[k - 1] * taper * f[0]
        for k in range(ORDER):
            m[k] = -cross(r[k], n) + (m0 if k == 0 else 0)
            rev = slice(k, None, -1)
            w[k, :, :3] = np.einsum('jbac,jba->bc', R[:k + 1], m[rev])
            w[k, :, 3:] = np.einsum('bac,ba->bc', R[k], n)
            if taper == 0:
                e[k] = np.einsum('ij,bj->bi', C, w[k])
            else:
                e[k] = np.einsum('ij,bj->bi', C, np.einsum('j,jbi->bi', f[:k + 1].astype(CLD), w[rev]))
            tot = e[k] + (rest if k == 0 else 0)
            u[k], v[k] = hat(tot[:, :3]), tot[:, 3:]
            r[k + 1] = np.einsum('jbac,jbc->ba', R[:k + 1], v[rev]) / LD(k + 1)
            R[k + 1] = np.einsum('jbac,jbcd->bad', R[:k + 1], u[rev]) / LD(k + 1)
            U[k + 1] = np.einsum('jbi,jbi->b', w[:k + 1], e[rev]) / LD(2 * (k + 1))
        size = max(np.abs(R[ORDER].real).max(), np.abs(r[ORDER].real).max() / max(1, float(L)), LD('1e-300'))
        size1 = max(np.abs(R[ORDER - 1].real).max(), np.abs(r[ORDER - 1].real).max() / max(1, float(L)), LD('1e-300'))
        h = min((LD('1e-22') / size) ** (LD(1) / ORDER), (LD('1e-22') / size1) ** (LD(1) / (ORDER - 1)))
        h = min(h * LD('0.8'), L - s)
        horner = lambda a, x: _horner(a, x)
        while marks and marks[0] <= s + h:
            x = marks.pop(0) - s
            got.append((horner(R, x), horner(r, x), horner(U, x)))
        R[0], r[0], U[0] = horner(R, h), horner(r, h), horner(U, h)
        s = s + h
    return got[0] if out is None else got


def _horner(a, x):
    y = a[ORDER].copy()
    for k in range(ORDER - 1, -1, -1):
        y = y * x + a[k]
    return y


def gbs(sec, b, L, steps=None):
    """Route B. Returns R (B,3,3), r (B,3), U (B), and the local resultants (B,6) at L."""
    b = np.atleast_2d(np.asarray(b, CLD))
    nb = len(b)
    C, rest, taper = sec.C.astype(CLD).T, sec.rest.astype(CLD), LD(sec.taper)
    y = np.zeros((nb, 14), CLD)   # M N q r U
    y[:, :6] = b
    y[:, 6] = 1

    def rhs(s, y):
        w = y[:, :6]
        de = w.dot(C) / (1 - taper * s)
        e = de + rest
        u, v = e[:, :3], e[:, 3:]
        d = np.empty_like(y)
        d[:, :3] = cross(w[:, :3], u) + cross(w[:, 3:], v)
        d[:, 3:6] = cross(w[:, 3:], u)
        q0, qv = y[:, 6:7], y[:, 7:10]
        d[:, 6] = -(qv * u).sum(-1) / 2
        d[:, 7:10] = (q0 * u + cross(qv, u)) / 2
        t = cross(qv, v)
        d[:, 10:13] = v + 2 * (q0 * t + cross(qv, t))   # |q| = 1 analytically
        d[:, 13] = (w * de).sum(-1) / 2
        return d
    if steps is None:
        R, r, _ = taylor(sec, b[:1], L)
        scale = float(np.abs(b.real).max()) * float(L) + 10 * float(np.abs(rest[:3]).max()) * float(L)
        soft = float(np.abs(sec.C[:3, :3]).max()) * float(L)
        steps = int(12 + 4 * np.sqrt(abs(float(np.abs(b[:, 3:].real).max()) * soft * float(L)))
                    + 2 * float(np.abs(b[:, :3].real).max()) * soft + 3 * float(np.abs(rest[:3]).max()) * float(L))
    L = LD(L)
    steps = int(1.4 * steps)
    Hs = L / steps
    ns = [2 * j for j in range(1, 11)]
    s = LD(0)
    for i in range(steps):
        T = []
        f0 = rhs(s, y)
        for j, nn in enumerate(ns):
            h = Hs / nn
            a, c = y, y + h * f0
            for k in range(1, nn):
                a, c = c, a + 2 * h * rhs(s + k * h, c)
            row = [(a + c + h * rhs(s + Hs, c)) / 2]
            for k in range(1, j + 1):
                q = (LD(nn) / ns[j - k]) ** 2 - 1
                row.append(row[k - 1] + (row[k - 1] - T[-1][k - 1]) / q)
            T.append(row)
        y = T[-1][-1]
        s = Hs * (i + 1)
    q0, qv = y[:, 6:7], y[:, 7:10]
    q0 = q0[..., None]
    R = np.eye(3) + 2 * (q0 * hat(qv) + hat(qv) @ hat(qv))
    return R, y[:, 10:13], y[:, 13], y[:, :6]


def steps6(b):
    b = np.asarray(b, CLD)
    return b[None, :] + 1j * H * np.eye(6).astype(CLD)


def tangent_of(R, r):
    """T (6,6): columns d(phi, r)/db_j, from complex-step batches."""
    Rr = R.real.mean(0)
    T = np.zeros((6, 6), LD)
    for j in range(6):
        D = (R[j].imag / H) @ Rr.T
        T[:3, j] = [(D[2, 1] - D[1, 2]) / 2, (D[0, 2] - D[2, 0]) / 2, (D[1, 0] - D[0, 1]) / 2]
        T[3:, j] = r[j].imag / H
    return T


def shoot(sec, b, L, route='A'):
    """Value and tangent: dict R, r, U, m (world couple at L), T (6x6)."""
    b = np.asarray(b, LD)
    res = taylor(sec, steps6(b), L) if route == 'A' else gbs(sec, steps6(b), L)
    R, r, U = res[:3]
    T = tangent_of(R, r)
    R, r, U = R[0].real, r[0].real, U[0].real
    if route == 'A':
        m = b[:3] - cross(r, b[3:])
    else:
        m = R @ res[3][0, :3].real
    return {'R': R, 'r': r, 'U': U, 'm': m, 'T': T}


def quaternion(R):
    """[w,x,y,z], w >= 0, of a rotation matrix in extended precision."""
    R = np.asarray(R, LD)
    t = [1 + R[0, 0] + R[1, 1] + R[2, 2], 1 + R[0, 0] - R[1, 1] - R[2, 2],
         1 - R[0, 0] + R[1, 1] - R[2, 2], 1 - R[0, 0] - R[1, 1] + R[2, 2]]
    i = int(np.argmax(t))
    a, b, c = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    p, q, s = R[1, 0] + R[0, 1], R[0, 2] + R[2, 0], R[2, 1] + R[1, 2]
    Q = np.array([[t[0], a, b, c], [a, t[1], p, q], [b, p, t[2], s], [c, q, s, t[3]]], LD)[i]
    Q = Q / np.sqrt((Q * Q).sum())
    return Q if Q[0] >= 0 else -Q


def fl(x):
    """Extended -> nearest doubles, as lists."""
    x = np.asarray(x)
    return x.astype(float).tolist()


def gap(a, b):
    """Largest difference relative to the size of the object."""
    a, b = np.asarray(a, LD), np.asarray(b, LD)
    return float(np.abs(a - b).max() / max(np.abs(a).max(), LD('1e-30')))
