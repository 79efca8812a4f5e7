#!/usr/bin/env python3
"""Writes tests/data/folds.csv: fold curves 1-3 (kap > 0), their kap -> 0 limits and their cusps.

Recipe: det d(x,y)/d(lam,psi1) from the first variation of the pendulum (refcore.py, 256 bits); a scan in lam
(double precision) brackets the zeros at given kap, the secant method finishes to 1e-40.
Limits kap -> 0: y ~ e f(lam), 1-x ~ e^2 g(lam)/4 for psi1 = e,
    f = sin(lam)/lam - cos(lam),   g = 2 + cos(2 lam) - 3 sin(2 lam)/(2 lam)   [1-x = (e^2/4) (g)],
and det = 0 becomes f g' = 2 f' g; roots to 30 digits.
Cusps: det = 0 and (grad det . null vector) = 0, gradients by central differences (1e-25) in 256 bits, Newton.
Vertical points: det = det_lam = 0 (then det_lam,lam = 0 too: eigenvalues fall with lam at fixed kap, at rate h'(0)^2).
Second route: the same determinant from AMV (3.14)-(3.18) by differences in (k, beta); and the second variation
(refgrid.morse) whose smallest eigenvalue must vanish.
"""
import os
os.environ.setdefault('REF_BITS', '256')
import sys
import numpy as np
from refcore import *
from refgrid import Grid, morse

OUT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'tests', 'data', 'folds.csv')
KAPS = ['0.05', '0.15', '0.3', '0.45', '0.6', '0.7', '0.8', '0.87', '0.9', '0.93', '0.96', '0.99']


def fold(p, lam0):
    a, b = mpf(lam0), mpf(lam0) + mpf(10) ** -7
    fa, fb = point(a, p)['det'], point(b, p)['det']
    for _ in range(30):
        a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
        if abs(b - a) < mpf(10) ** -40:
            return point(b, p)
        fb = point(b, p)['det']
    raise ArithmeticError('fold')


def limits():
    f = lambda l: mp.sin(l) / l - mp.cos(l)
    g = lambda l: (2 + mp.cos(2 * l) - 3 * mp.sin(2 * l) / (2 * l))
    fp = lambda l: mp.cos(l) / l - mp.sin(l) / l ** 2 + mp.sin(l)
    gp = lambda l: -2 * mp.sin(2 * l) - 3 * mp.cos(2 * l) / l + 3 * mp.sin(2 * l) / (2 * l ** 2)
    e = mpf(10) ** -20                                  # check f and g against the full problem
    q = point(mpf(4), psi1=e)
    print('limit check', mp.nstr(q['y'] / e - f(mpf(4)), 3), mp.nstr((1 - q['x']) / e ** 2 * 4 - g(mpf(4)), 3))
    return [mp.findroot(lambda l: f(l) * gp(l) - 2 * fp(l) * g(l), mpf(x)) for x in (6.0176, 9.2584, 12.444)]


def detG(lam, psi):
    q = point(lam, psi1=psi)
    a, b, c, d = q['J']
    n = (b, -a) if abs(a) + abs(b) > abs(c) + abs(d) else (d, -c)
    s = mp.hypot(*n)
    n = (n[0] / s, n[1] / s)
    h = mpf(10) ** -25
    g = (point(lam + h * n[0], psi1=psi + h * n[1])['det'] - point(lam - h * n[0], psi1=psi - h * n[1])['det']) / (2 * h)
    return q['det'], g


def cusp(lam, p):
    lam, psi = mpf(lam), 2 * mp.asin(mp.tanh(mpf(p)))
    h = mpf(10) ** -15
    for _ in range(25):
        F = detG(lam, psi)
        A, B = detG(lam + h, psi), detG(lam, psi + h)
        a, c = (A[0] - F[0]) / h, (A[1] - F[1]) / h
        b, d = (B[0] - F[0]) / h, (B[1] - F[1]) / h
        D = a * d - b * c
        dl, dp = (d * F[0] - b * F[1]) / D, (a * F[1] - c * F[0]) / D
        m = max(abs(dl), abs(dp) * 10, mpf(10) ** -60)
        t = min(mpf(1), mpf('0.1') / m)
        lam -= t * dl
        psi -= t * dp
        if m < mpf(10) ** -24:
            return point(lam, psi1=psi)
    raise ArithmeticError('cusp')


def inflection(lam, p):
    """Where the fold curve is vertical in the (kap, lam) plane: det = det_lam = 0; there also det_lam,lam = 0, so
    Newton is applied to (det, det_lam,lam), which is regular."""
    lam, psi, h = mpf(lam), 2 * mp.asin(mp.tanh(mpf(p))), mpf(10) ** -14
    D = lambda l, s: point(l, psi1=s)['det']

    def F(l, s):
        a, b, c = D(l - h, s), D(l, s), D(l + h, s)
        return b, (a - 2 * b + c) / h ** 2, (c - a) / (2 * h)
    k = mpf(10) ** -10
    for _ in range(25):
        f = F(lam, psi)
        A, B = F(lam + k, psi), F(lam, psi + k)
        J = mp.matrix([[(A[0] - f[0]) / k, (B[0] - f[0]) / k], [(A[1] - f[1]) / k, (B[1] - f[1]) / k]])
        d = mp.lu_solve(J, mp.matrix([f[0], f[1]]))
        t = min(mpf(1), mpf('0.1') / (abs(d[0]) + mpf(10) ** -60))
        lam -= t * d[0]
        psi -= t * d[1]
        if abs(d[0]) + abs(d[1]) < mpf(10) ** -23:
            return point(lam, psi1=psi), F(lam, psi)
    raise ArithmeticError('inflection')


def paper_det(q):
    k, b = paper_beta(q)
    h = mpf(10) ** -20
    f = lambda k, b: paper(k, b, q['mode'], q['sign'])
    A, B, C, D = f(k + h, b), f(k - h, b), f(k, b + h), f(k, b - h)
    xk, yk, xb, yb = [(u[z] - v[z]) / (2 * h) for u, v in ((A, B), (C, D)) for z in ('x', 'y')]
    return xk * yb - xb * yk, xk * yb


def row(kind, n, q):
    return ','.join([kind, str(n)] + [dec(q[z], 25) for z in ('kap', 'p', 'lam', 'x', 'y', 'alpha', 'theta1', 'U')] + [str(q['mode']), str(q['sign'])])


def main():
    out = []
    for n, l in enumerate(limits(), 1):
        print('limit', n, dec(l, 30))
        out.append('limit,%d,0,0,%s,1,0,0,0,0,,' % (n, dec(l, 27)))
    pk = [float(mp.atanh(mpf(k))) for k in KAPS]
    pd = np.unique(np.concatenate((np.linspace(0.05, 1.4, 200), np.linspace(1.4, 1.8, 1200), np.linspace(1.8, 4, 150))))
    G, H = Grid(pk, 27.0, 0.025, 12), Grid(pd, 27.0, 0.025, 12)

    def zeros(g, i):
        d = g.det[20:, i]
        z = np.nonzero(np.sign(d[1:]) != np.sign(d[:-1]))[0]
        return [g.lam[20 + j] + 0.025 * d[j] / (d[j] - d[j + 1]) for j in z]
    worst = mpf(0)
    for n in (1, 2, 3):
        for i, kap in enumerate(KAPS):
            z = zeros(G, i)
            if len(z) < n:
                print('no fold', n, 'below 27 at kap', kap)
                continue
            q = fold(mp.atanh(mpf(kap)), z[n - 1])
            pdet, ref = paper_det(q)
            worst = max(worst, abs(pdet / ref))
            e = morse(float(q['lam']), float(q['p']), N=60)
            print('fold', n, kap, mp.nstr(q['lam'], 12), 'rel det (second route)', mp.nstr(pdet / ref, 3), 'index', e[0], 'min|nu|', '%.1e' % e[1],
                  'mode', q['mode'], flush=True)
            out.append(row('fold', n, q))
    Z = [zeros(H, i) for i in range(len(pd))]
    for n in (1, 2, 3):
        pts, sig, last = [], [], None                  # sign of (tangent x null vector) flips at a cusp
        for i, p in enumerate(pd):
            z = Z[i]
            if len(z) < n:
                break
            j = int(round(z[n - 1] / 0.025))
            nv = np.array((H.xp[j, i], -H.xl[j, i])) if abs(H.xp[j, i]) > abs(H.yp[j, i]) else np.array((H.yp[j, i], -H.yl[j, i]))
            if last is not None:
                nv *= np.sign(nv @ last) or 1
                t = np.array((z[n - 1] - pts[-1][0], p - pts[-1][1]))
                sig.append(np.sign(t[0] * nv[1] - t[1] * nv[0]))
            last = nv
            pts.append((z[n - 1], p))
        cand = [i for i in range(len(sig) - 1) if sig[i] != sig[i + 1]]
        i = max(range(len(pts) - 1), key=lambda i: abs(pts[i + 1][0] - pts[i][0]))
        q, f = inflection((pts[i][0] + pts[i + 1][0]) / 2, (pts[i][1] + pts[i + 1][1]) / 2)
        print('vertical', n, 'lam', mp.nstr(q['lam'], 20), 'kap', mp.nstr(q['kap'], 20), 'p', mp.nstr(q['p'], 20), 'r', mp.nstr(q['x'], 14), mp.nstr(q['y'], 14), 'det', mp.nstr(f[0], 3), 'det_ll', mp.nstr(f[1], 3),
              'det_l', mp.nstr(f[2], 3), flush=True)
        out.append(row('vertical', n, q))
        seen = []
        for i in cand:
            try:
                q = cusp(*pts[i + 1])
            except (ArithmeticError, ZeroDivisionError) as e:
                print('  cusp candidate failed', n, pts[i + 1], e)
                continue
            if any(abs(q['lam'] - s['lam']) < 1e-9 for s in seen):
                continue
            seen.append(q)
            pdet, ref = paper_det(q)
            print('cusp', n, 'guess', pts[i + 1], 'lam', mp.nstr(q['lam'], 16), 'kap', mp.nstr(q['kap'], 16), 'r', mp.nstr(q['x'], 14), mp.nstr(q['y'], 14),
                  'det', mp.nstr(pdet / ref, 3), flush=True)
            out.append(row('cusp', n, q))
    print('worst relative determinant, second route', mp.nstr(worst, 3))
    with open(OUT, 'w') as f:
        f.write('# Folds of (lam, kap) -> r(1) of the clamped elastica with a moment-free end; kap > 0 half (kap < 0 is the mirror image y -> -y).\n'
                '# kind: limit = the kap -> 0 end of the curve (27 digits; x=1, rest 0), fold = point at the given exact kap, cusp = cusp of the image curve,\n# vertical = the point where lam as a function of kap on the fold curve has infinite slope (kap - kap0 ~ -(lam - lam0)^3).\n'
                '# limits solve f g\' = 2 f\' g, f = sin(lam)/lam - cos(lam), g = 2 + cos(2 lam) - 3 sin(2 lam)/(2 lam).\n'
                '# 25 digits printed; fold and cusp lam good to more than 20 (second route: determinant of AMV (3.17) by differences).\n'
                '# method: tools/ref_folds.py, 256-bit Taylor series of the pendulum and its variation.\n'
                'kind,number,kap,p,lam,x,y,alpha,theta1,U,mode,sign\n' + '\n'.join(out) + '\n')


if __name__ == '__main__':
    main()
