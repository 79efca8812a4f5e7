#!/usr/bin/env python3
"""Writes tests/data/rod_branch.json: bifurcation facts and benchmarks of spatial rods.

Routes. A: complex-step tangents of the extended-precision Taylor solution of the full 3-D rod (rod_reference_core.py).
B: closed forms (mpmath) or the linearised out-of-plane equations about the planar elastica, integrated by scipy DOP853
(1e-13) with the planar shape from Jacobi functions in mpmath or from its own ODE. Each entry stores the difference.
"""
import json
import os
import numpy as np
import mpmath as mp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from rod_reference_core import *

mp.mp.dps = 40
OUT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'tests', 'data', 'rod_branch.json')


def secant(f, a, b, tol=1e-16, its=40):
    """Root by the secant method, arguments in extended precision."""
    a, b = LD(a), LD(b)
    fa, fb = f(a), f(b)
    for _ in range(its):
        if fb == fa:
            break
        a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
        if abs(b - a) < tol * max(1, abs(b)):
            break
        fb = f(b)
    return b


def scan(f, a, b, n):
    """First sign change of f on [a, b]."""
    x = np.linspace(a, b, n + 1)
    last = f(x[0])
    for i in range(1, n + 1):
        now = f(x[i])
        if now * last < 0:
            return x[i - 1], x[i]
        last = now
    raise ArithmeticError('no sign change')


def det(M):
    """Determinant in extended precision."""
    M = [[LD(x) for x in row] for row in M]
    n, d = len(M), LD(1)
    for i in range(n):
        p = max(range(i, n), key=lambda k: abs(M[k][i]))
        if p != i:
            M[i], M[p], d = M[p], M[i], -d
        if M[i][i] == 0:
            return LD(0)
        d *= M[i][i]
        for k in range(i + 1, n):
            q = M[k][i] / M[i][i]
            for j in range(i, n):
                M[k][j] -= q * M[i][j]
    return d


# ---- (a) twisted straight rod ------------------------------------------------------------------------------------------

def greenhill(T, c=.7):
    """y = 1, s, exp(i k1 s), exp(i k2 s) with k^2 - M k + T = 0, y = y' = 0 at both ends."""
    def f(M):
        d = mp.sqrt(mp.mpf(M) ** 2 / 4 - T)
        k1, k2 = M / 2 + d, M / 2 - d
        e1, e2 = mp.expj(k1), mp.expj(k2)
        A = mp.matrix([[1, 0, 1, 1], [0, 1, 1j * k1, 1j * k2], [1, 1, e1, e2], [0, 1, 1j * k1 * e1, 1j * k2 * e2]])
        return mp.im(mp.det(A) * mp.expj(-M / 2) / d)
    if T == 0:
        M = 2 * mp.findroot(lambda x: mp.tan(x) - x, 4.4934)
    else:
        g = lambda M: f(mp.mpf(M))
        lo = max(0, 2 * np.sqrt(max(T, 0))) + .5
        xs = np.arange(lo, 20, .05)
        v = [g(x) for x in xs]
        i = next(i for i in range(1, len(xs)) if v[i] * v[i - 1] < 0)
        M = mp.findroot(g, (xs[i - 1], xs[i]), solver='anderson', tol=1e-60)
    # route A: smallest singular value of the lateral block (4x4 of 6x6) of the 3-D tangent; double root, so minimise |block det|
    sec = kirchhoff(1, 1, c)

    def lateral(M):
        A = shoot(sec, [0, 0, M, 0, 0, T], 1)['T']
        i = [0, 1, 3, 4]
        B = A[np.ix_(i, i)]
        P = B[0::2][:, 0::2] + 1j * B[1::2][:, 0::2]          # rotation symmetric: 2x2 complex
        z = P[0, 0] * P[1, 1] - P[0, 1] * P[1, 0]
        return (z * np.exp(CLD(-1j) * (np.angle(complex(z0)))).astype(CLD)).real
    # phase fixed at a nearby M: the phase of det is smooth, so its real part changes sign at the root
    B0 = shoot(sec, [0, 0, float(M) - .01, 0, 0, T], 1)['T'][np.ix_([0, 1, 3, 4], [0, 1, 3, 4])]
    P0 = B0[0::2][:, 0::2] + 1j * B0[1::2][:, 0::2]
    z0 = P0[0, 0] * P0[1, 1] - P0[0, 1] * P0[1, 0]
    MA = secant(lateral, float(M) - 3e-3, float(M) + 2e-3)
    return M, abs(float(M - mp.mpf(str(MA))))


# ---- linearised out-of-plane equations --------------------------------------------------------------------------------

def out_of_plane(theta0, dtheta0, lam2, gam, b2, c, L=1.0):
    """Planar rod, theta'' = -lam2 sin(theta - gam), n = -lam2 (cos gam, sin gam) in the plane, theta(0) = theta0 = 0.
    phi = a t + b nu (spin), z lateral, mu = couple in the plane (t, nu axes in the fixed frame: x, y).
    Returns the 5x3 matrix of (mu_x, mu_y, phi_x, phi_y, z)(L) with respect to (mu_x, mu_y, n_z)(0)."""
    nx, ny = -lam2 * np.cos(gam), -lam2 * np.sin(gam)

    def rhs(s, y):
        th, k = y[0], y[1]
        t, nu = np.array([np.cos(th), np.sin(th)]), np.array([-np.sin(th), np.cos(th)])
        d = np.empty_like(y)
        d[0], d[1] = k, -lam2 * np.sin(th - gam)
        for j in range(3):
            mu, phi = y[2 + 5 * j:4 + 5 * j], y[4 + 5 * j:6 + 5 * j]
            pt, pn = phi @ t, phi @ nu
            ht, hn = (mu @ t - k * pn) / c, (mu @ nu + k * pt) / b2
            dz = -pn
            d[2 + 5 * j:4 + 5 * j] = -dz * np.array([-ny, nx]) + (1. if j == 2 else 0.) * nu
            d[4 + 5 * j:6 + 5 * j] = ht * t + hn * nu
            d[6 + 5 * j] = dz
        return d
    y0 = np.zeros(17)
    y0[0], y0[1] = theta0, dtheta0
    y0[2], y0[8] = 1, 1
    y = solve_ivp(rhs, (0, L), y0, method='DOP853', rtol=2.3e-14, atol=1e-15).y[:, -1]
    return y[2:].reshape(3, 5).T, y[:2]


# ---- (b) planar elastica with ball joint -------------------------------------------------------------------------------

def planar_ball(lam, kap):
    lam, kap = mp.mpf(str(lam)), mp.mpf(str(kap))
    m, kc = kap ** 2, mp.sqrt(1 - kap ** 2)
    cd, sd = mp.ellipfun('cd', lam, m=m), mp.ellipfun('sd', lam, m=m)
    return -2 * mp.asin(kap * cd), 2 * lam * kap * kc * sd       # alpha, theta'(0)


def ld(x):
    return LD(mp.nstr(x, 25))


def ball_tangent(lam, kap, b2, c):
    """Route A: plane z-x (x lateral coordinate of the planar rod is world x, y of theory 2.2 = world x, its x = world z).
    Bending about d2 (stiffness 1) in the plane, about d1 (b2) out of it. Returns dets of d r/d n on m(1) = 0: out, in plane."""
    al, k0 = planar_ball(lam, kap)
    lam = LD(lam)
    a = ld(al)
    b = np.array([0, ld(k0), 0, -lam ** 2 * np.sin(a), 0, -lam ** 2 * np.cos(a)], LD)
    S = shoot(kirchhoff(b2, 1, c), b, 1)
    n, r, T = b[3:], S['r'], S['T']
    J = np.zeros((3, 6), LD)                                      # d m(1)/db
    J[:, :3] = np.eye(3)
    J[:, 3:] = -hat(r)
    J += hat(n) @ T[3:]
    out = np.vstack([J[[0, 2]][:, [0, 2, 4]], T[4][[0, 2, 4]]])   # m_x, m_z, r_y against m_x, m_z, n_y
    inn = np.vstack([J[1][[1, 3, 5]], T[3][[1, 3, 5]], T[5][[1, 3, 5]]])
    return det(out), det(inn), S


def ball(kap):
    fin = lambda l: ball_tangent(l, kap, 1, 1)[1]
    fold = secant(fin, *scan(fin, 4., 9., 50))
    # second route for the fold: finite determinants of the planar map in (lam, kap) by mpmath differentiation
    def planar(l, k):
        al = -2 * mp.asin(k * mp.ellipfun('cd', l, m=k ** 2))
        # theta(s) = alpha + 2 asin(k cd(lam (1-s)))
        th = lambda s: al + 2 * mp.asin(k * mp.ellipfun('cd', l * (1 - s), m=k * k))
        return mp.quad(lambda s: mp.cos(th(s)), mp.linspace(0, 1, 5)), mp.quad(lambda s: mp.sin(th(s)), mp.linspace(0, 1, 5))

    def jac(l):
        mp.mp.dps = 30
        h = mp.mpf('1e-8')
        k = mp.mpf(str(kap))
        D = lambda f: [(8 * (f(h)[i] - f(-h)[i]) - (f(2 * h)[i] - f(-2 * h)[i])) / (12 * h) for i in (0, 1)]
        xl, yl = D(lambda e: planar(l + e, k))
        xk, yk = D(lambda e: planar(l, k + e))
        mp.mp.dps = 40
        return xl * yk - xk * yl
    f2 = mp.findroot(jac, (mp.mpf(float(fold)) - mp.mpf('1e-4'), mp.mpf(float(fold)) + mp.mpf('1e-4')), solver='secant', tol=1e-25, maxsteps=6, verify=False)
    rows = []
    for b2, c in [(1, 1), (.5, .7), (2, .5), (.3, .3)]:
        fo = lambda l: ball_tangent(l, kap, b2, c)[0]
        lam = secant(fo, *scan(fo, .3, 14., 137))

        lB = brentq(lambda l: _lin_ball(l, kap, b2, c), float(lam) - 1e-3, float(lam) + 1e-3, xtol=1e-14, rtol=1e-14)
        S = ball_tangent(lam, kap, b2, c)[2]
        rows.append({'out_of_plane': b2, 'torsion': c, 'lam': float(lam), 'lam_second_route': lB, 'position': fl(S['r']), 'energy': float(S['U'])})
        print('ball', b2, c, repr(float(lam)), lB - float(lam), flush=True)
    return {'inputs': {'kap': kap, 'in_plane': 1.0}, 'in_plane_fold_lam': float(fold), 'in_plane_fold_gap': abs(float(f2 - mp.mpf(str(fold)))), 'rows': rows,
            'convention': 'planar family of the elastica: alpha = -2 asin(kap cd(lam)), theta\'(0) = 2 lam kap kap\' sd(lam), force lam^2. Embedded with the rod along z, planar y along x: '
            'base couple (0, theta\'(0), 0), n = -lam^2 (sin alpha, 0, cos alpha); bending = [out_of_plane, 1], position held, zero end couple'}


def _lin_ball(l, kap, b2, c):
    al, k0 = planar_ball(float(l), kap)
    M, _ = out_of_plane(0, float(k0), l * l, float(al), b2, c)
    return np.linalg.det(M[[0, 1, 4]])


# ---- (c) clamped-clamped -----------------------------------------------------------------------------------------------

def clamped_tangent(k, b2, c, half=False):
    """theta = 2 asin(k sn(4 K s)): theta'(0) = 8 K k, thrust 16 K^2 along z. Dets: whole out-of-plane 3x3, and by parity from the half rod."""
    k = mp.mpf(str(k))
    K = mp.ellipk(k ** 2)
    b = np.array([0, ld(8 * k * K), 0, 0, 0, -ld(16 * K * K)], LD)
    sec = kirchhoff(b2, 1, c)
    T = shoot(sec, b, 1)['T']
    whole = det(T[[0, 2, 4]][:, [0, 2, 4]])
    H_ = shoot(sec, b, LD('0.5'))
    Th, n, r = H_['T'], b[3:], H_['r']
    J = np.zeros((3, 6), LD)                                       # d m(1/2)/db
    J[:, :3] = np.eye(3)
    J[:, 3:] = -hat(r)
    J += hat(n) @ Th[3:]
    cols = [0, 2, 4]
    # shape is even in s - 1/2 (theta odd). Lateral y even: phi_x (=-y') odd, phi_z (twist) even -> phi_x = 0, dn_y = 0, dm_z = 0 at 1/2
    # lateral y odd: y = 0, phi_z = 0, dm_x = 0 at 1/2
    e3 = np.array([0, 0, 1], LD)
    even = det(np.vstack([Th[0][cols], J[2][cols], e3]))
    odd = det(np.vstack([Th[4][cols], Th[2][cols], J[0][cols]]))
    return whole, even, odd, H_


def shortening(k):
    k = mp.mpf(str(k))
    return 2 - 2 * mp.ellipe(k ** 2) / mp.ellipk(k ** 2)


def clamped():
    rows = []
    for b2, c in [(1, .7), (1.5, .6), (1.5, .25), (.6, .7), (3, .6)]:
        fw, fe, fo = (lambda k, i=i: clamped_tangent(k, b2, c)[i] for i in range(3))
        size = abs(clamped_tangent(.5, b2, c)[1])
        res = {'out_of_plane': b2, 'torsion': c}
        found = {}
        for tag, f in (('even', fe), ('odd', fo)):
            try:
                if tag == 'even' and b2 == 1:
                    raise ArithmeticError
                found[tag] = secant(f, *scan(f, .02, .985, 80))
            except ArithmeticError:
                found[tag] = None
        good = {t: k for t, k in found.items() if k is not None}
        print('clamped', b2, c, {t: (float(k), float(shortening(k))) for t, k in good.items()}, 'even det at .5: %.2e' % size)
        if not good:
            continue
        tag = min(good, key=lambda t: good[t])
        k = good[tag]

        def lin(x):
            x = mp.mpf(str(x))
            K = mp.ellipk(x * x)
            M, _ = out_of_plane(0, float(8 * x * K), float(16 * K * K), 0, b2, c)
            Mh, _ = out_of_plane(0, float(8 * x * K), float(16 * K * K), 0, b2, c, .5)
            # in the plane's axes: t-axis x, normal y; half rod, theta(1/2) = 0
            return {'even': np.linalg.det(np.vstack([Mh[3], Mh[0], [0, 0, 1.]])), 'odd': np.linalg.det(np.vstack([Mh[4], Mh[2], Mh[1]]))}[tag]
        kB = brentq(lin, float(k) - 1e-4, float(k) + 1e-4, xtol=1e-15, rtol=1e-14)
        res.update({'k': float(k), 'k_second_route': kB, 'end_shortening': float(shortening(k)), 'thrust': float(16 * mp.ellipk(mp.mpf(str(k)) ** 2) ** 2),
                    'lateral_mode': tag, 'other_parity_k': [float(v) for t, v in good.items() if t != tag],
                    'whole_det_over_scale': float(clamped_tangent(k, b2, c)[0])})
        from rod_reference_index import second_variation
        for name, x in (('index_below', .99 * k), ('index_above', 1.01 * k)):
            K = mp.ellipk(mp.mpf(float(x)) ** 2)
            ev = second_variation(kirchhoff(b2, 1, c), [0, float(8 * x * K), 0, 0, 0, float(-16 * K * K)], 1., 'pose', 24, 96)
            res[name] = int((ev < -1e-4).sum())
            res[name + '_eigenvalues'] = [float('%.3g' % v) for v in ev[:3]]
        rows.append(res)
        print('  ', tag, repr(res['k']), kB - res['k'], res['end_shortening'], res['thrust'], flush=True)
    return {'convention': 'theta = 2 asin(k sn(4 K s)), rod along z, buckled in z-x, bending = [out_of_plane, 1], unshearable inextensible, both poses held; base couple (0, 8 K k, 0), '
            'n = (0, 0, -16 K^2), end_shortening 2 - 2 E/K. lateral_mode: parity of the lateral displacement about the middle. With equal bending the even problem is singular for every k '
            '(turning the plane of buckling about the line of the clamps is free); the row gives the odd one, and the index does not count the zero eigenvalue of that turning.', 'rows': rows}


if __name__ == '__main__':
    import sys
    import rod_reference_benchmarks as bench
    import rod_reference_elastica as plane
    only = sys.argv[1:]
    parts = {'greenhill': lambda: {'inputs': {'bending': 1, 'torsion': .7, 'note': 'the critical couple does not depend on torsion'},
                                   'rows': [dict(zip(('tension', 'critical_couple', 'gap'), (T, float(M), g))) for T in (-20, 0, 20) for M, g in [greenhill(T)]]},
             'ball_elastica': lambda: ball(.5), 'clamped_elastica': clamped,
             'B1': plane.b1, 'B2': plane.b2, 'B3': plane.b3, 'B4': plane.b4,
             'B5': bench.b5, 'B6': bench.b6, 'B7': bench.b7, 'B9': bench.b9, 'B10': bench.b10, 'B11': bench.b11}
    data = {'recipe': 'Bifurcation facts and benchmarks, each by two routes (see tools/rod_reference_branch.py, rod_reference_benchmarks.py, rod_reference_elastica.py): complex-step tangents of an 80-bit '
            'Taylor solution of the 3-D rod, and closed forms or linearised equations; gap: their difference. Conventions as in rod_ivp.json.'}
    if only and os.path.exists(OUT):
        data = json.load(open(OUT))
    for name, f in parts.items():
        if only and name not in only:
            continue
        print('==', name, flush=True)
        data[name] = f()
        print(json.dumps(data[name]), flush=True)
        with open(OUT, 'w') as o:
            o.write('{\n' + ',\n'.join(json.dumps(a) + ': ' + json.dumps(b) for a, b in data.items()) + '\n}\n')
