#!/usr/bin/env python3
"""Writes tests/data/layer.json: viscous landings from fold points of the planar elastica.

Recipe: fold point by ref_folds.fold (256 bits). Layer: u = theta' on 80 Gauss-Legendre nodes,
theta = int_0^s u and r by the spectral integration matrix; u_T = q . n - u with q(s) = J (r(1) - r(s)) and n from r_T(1) = 0;
start u = u_fold + eps h', eps = +-1e-3, h the null vector of the second variation (theta moves by eps h; max |h| = 1), and moved along q back to r(1) = fold point.
One sign returns to the fold, the other leaves it; DOP853 (rtol 1e-11) to T = T_end, then
lam, kap are read off (u at the clamp and tip) and polished by Newton to r(1) = fold point in 256 bits. Repeated with 56 nodes and eps = 3e-4.
The landing must have Morse index 0. Reported drift: |r(1) - r_fold| at the end of the layer.
"""
import os
os.environ.setdefault('REF_BITS', '256')
import json
import numpy as np
from numpy.polynomial import legendre as Lg
from scipy.integrate import solve_ivp
from scipy.linalg import eigh, qr
from refcore import *
from refgrid import morse, psi_at, basis
from ref_folds import fold

OUT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'tests', 'data', 'layer.json')


class Layer:
    def __init__(self, N):
        x, w = Lg.leggauss(N)
        self.s, self.w, self.N = (1 + x) / 2, w / 2, N
        V = Lg.legvander(x, N)
        self.V, self.x = V, x
        k = np.arange(N)
        # antiderivative from -1 of P_k at the nodes
        A = np.empty((N, N))
        A[:, 0] = x + 1
        A[:, 1:] = (V[:, 2:N + 1] - V[:, :N - 1]) / (2 * k[1:] + 1)
        proj = (V[:, :N] * w[:, None] * (2 * k + 1) / 2).T       # nodal values -> Legendre coefficients
        self.I = A @ proj / 2                                     # int_0^s
        self.proj = proj

    def q(self, u):
        th = self.I @ u
        c, s = np.cos(th), np.sin(th)
        return np.stack((-(self.w @ s - self.I @ s), self.w @ c - self.I @ c))

    def rhs(self, T, u):
        q = self.q(u)
        n = np.linalg.solve((q * self.w) @ q.T, (q * self.w) @ u)
        return q.T @ n - u

    def end(self, u):
        th = self.I @ u
        return self.w @ np.cos(th), self.w @ np.sin(th)

    def energy(self, u):
        return 0.5 * self.w @ u ** 2


def null_vector(lam, p, L, N=60):
    """h' at the nodes of L for the null vector h of the second variation."""
    x, w = Lg.leggauss(200)
    s, w = (1 + x) / 2, w / 2
    h, dh = basis('legendre', N, x)
    psi = psi_at(lam, p, s)
    A = (dh * w[:, None]).T @ dh - lam ** 2 * (h * (w * np.cos(psi))[:, None]).T @ h
    B = h.T @ np.column_stack((w * np.sin(psi), w * np.cos(psi)))
    Z = qr(B)[0][:, 2:]
    ev, vec = eigh(Z.T @ A @ Z)
    i = np.argmin(np.abs(ev))
    a = Z @ vec[:, i]
    a /= np.abs(h @ a).max()
    return basis('legendre', N, L.x)[1] @ a, ev[i]


def run(f, N, eps):
    L = Layer(N)
    lam, p = float(f['lam']), float(f['p'])
    # theta' = -lam psi_tau, from the energy integral's own route: differentiate theta = psi + alpha spectrally in high precision data
    u0 = np.array([float(z['dtheta']) for z in shape(f['lam'], f['p'], [mpf(float(t)) for t in L.s])])
    dh, ev = null_vector(lam, p, L)
    out = []
    for sg in (1, -1):
        u, T, U = u0 + sg * eps * dh, 0.0, None
        for _ in range(4):                       # put the end back on the fold point (the shift is O(eps^2))
            q = L.q(u)
            u = u + q.T @ np.linalg.solve((q * L.w) @ q.T, np.subtract((float(f['x']), float(f['y'])), L.end(u)))
        r0 = float(f['x']), float(f['y'])
        while T < 40000:
            s = solve_ivp(L.rhs, (0, 50), u, method='DOP853', rtol=1e-11, atol=1e-12)
            u, T = s.y[:, -1], T + 50
            rate = np.abs(L.rhs(0, u)).max()
            back = np.abs(u - u0).max()
            if rate < 1e-10 or (rate < 1e-6 and back < 0.3 * eps * np.abs(dh).max()):
                break
        out.append((sg, back, rate, T, u, np.hypot(*np.subtract(L.end(u), r0)), L))
    gone = [o for o in out if o[1] > 0.3]
    assert len(gone) == 1, [(o[0], o[1], o[2], o[3]) for o in out]
    return gone[0], dh, ev


def landing(f, o):
    sg, back, rate, T, u, drift, L = o
    th = L.I @ u
    # u^2/2 = lam^2 (cos psi - cos psi1), theta'' = -lam^2 sin psi: fit the force from  u^2/2 = Fx cos + Fy sin + const
    A = np.column_stack((np.cos(th), np.sin(th), np.ones_like(th)))
    (fx, fy, _), *_ = np.linalg.lstsq(A, u ** 2 / 2, rcond=None)
    lam, al = np.hypot(fx, fy) ** 0.5, np.arctan2(fy, fx)
    th1 = L.w @ u
    psi1 = (th1 - al + np.pi) % (2 * np.pi) - np.pi
    q = newton_xy(lam, psi1, f['x'], f['y'])
    return q, (lam, psi1)


def main():
    cases = [('reference case of the snap run', None), ('late branch', ('0.906', 7.1)), ('late branch, lam near 6.5', ('0.90707724618', 6.502)),
             ('small kap', ('0.2', 6.08)), ('loop branch', ('0.97', 5.95))]
    rows = []
    for name, c in cases:
        if c is None:
            p = mpf(REFP)
            f = fold(p, 6.5562)
        else:
            f = fold(mp.atanh(mpf(c[0])), c[1])
        o, dh, ev = run(f, 80, 1e-3)
        o2, _, _ = run(f, 56, 3e-4)
        q, g = landing(f, o)
        q2, g2 = landing(f, o2)
        same = abs(q['lam'] - q2['lam']) + abs(q['p'] - q2['p'])
        m = morse(float(q['lam']), float(q['p']), N=100)
        w = lambda z: dict(lam=dec(z['lam']), kap=dec(z['kap']), p=dec(z['p']), alpha=dec(z['alpha']), theta1=dec(z['theta1']), U=dec(z['U']), mode=z['mode'], sign=z['sign'])
        print(name, 'fold lam', mp.nstr(f['lam'], 13), 'kap', mp.nstr(f['kap'], 13), 'r', mp.nstr(f['x'], 11), mp.nstr(f['y'], 11), '-> lam', mp.nstr(q['lam'], 13), 'p', mp.nstr(q['p'], 13),
              'released', mp.nstr(f['U'] - q['U'], 14), '\n   T', o[3], o2[3], 'null eigenvalue %.1e' % ev, 'drift %.1e %.1e' % (o[5], o2[5]), 'unpolished error %.1e %.1e' %
              (abs(g[0] - float(q['lam'])), abs(g2[0] - float(q2['lam']))), 'same landing', mp.nstr(same, 2), 'index', m[0], 'min|nu| %.3g' % m[1], flush=True)
        d = w(f)
        d.update(x=dec(f['x']), y=dec(f['y']))
        rows.append(dict(name=name, fold=d, landing=w(q), released=dec(f['U'] - q['U']), landing_index=m[0], landing_min_abs_eigenvalue='%.6g' % m[1]))
    head = dict(about='Viscous landing (body held at r(1) = (x, y)) from points of the first fold curve; the layer leaves the fold in one direction only',
                accuracy='25 digits (Newton-polished fold and landing); which equilibrium is reached was decided by two layer runs (80 and 56 nodes, eps 1e-3 and 3e-4)',
                note='kap of the fold is exact where it is short; elsewhere the fold is named by its p', method='tools/ref_layer.py')
    json.dump(dict(header=head, rows=rows), open(OUT, 'w'), indent=0)


REFP = '0.639250507'
if __name__ == '__main__':
    main()
