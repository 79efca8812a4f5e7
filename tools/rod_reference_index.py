#!/usr/bin/env python3
"""Writes tests/data/rod_index.json: Morse indices of rod equilibria from a discretised second variation.

Perturb the strains, e -> e + eps h. With phi' = R h_u (world spin), rho' = phi x r' + R h_v the second variation is
    H(h,h) = int h.K h - m.(phi x phi') - 2 n.(phi x rho') + n.(phi x (phi x r')) ds
for the ends: pose (phi(L) = rho(L) = 0), ball (rho(L) = 0, m(L) = 0), free (m(L) = 0, dead n). (The terms with the second
derivatives of phi and rho at s = L cancel by parts.) h: Legendre polynomials of degree < deg in every component that is not rigid,
conditions at L by projection on their null space, integrals by Gauss points. Eigenvalues are relative to int h.K h:
they accumulate at 1, and for an Euler rod they are 1 - P/P_cr.
Checks: two degrees; finite differences of the energy of the exactly perturbed rod (check_formula); for pose, the zeros of
det d(phi,r)(s)/db in (0, L); the known counts of Euler and Greenhill rods.
"""
import sys
import numpy as np
from numpy.polynomial import legendre
from rod_reference_core import *
from rod_reference import sections, spd, solve_load, dump, CONVENTIONS, end_residual, newton

NODES = 72


def grid(L, n=NODES):
    """Gauss points, weights, and the cumulative integration matrix on [0, L]; last row: the whole interval."""
    x, w = legendre.leggauss(n)
    V = legendre.legvander(x, n)
    c = (2 * np.arange(n) + 1) / 2
    coef = (V[:, :n] * w[:, None] * c).T                     # f(nodes) -> Legendre coefficients
    xe = np.append(x, 1.0)
    P = legendre.legvander(xe, n)
    A = np.zeros((n + 1, n))
    A[:, 0] = xe + 1
    for k in range(1, n):
        A[:, k] = (P[:, k + 1] - P[:, k - 1]) / (2 * k + 1)
    return (x + 1) * L / 2, w * L / 2, (A @ coef) * L / 2, V


def fields(sec, b, L, s):
    b = np.asarray(b, LD)
    out = taylor(sec, b[None, :].astype(CLD), L, out=s)
    R = np.array([o[0][0].real for o in out]).astype(float)
    r = np.array([o[1][0].real for o in out]).astype(float)
    bf = b.astype(float)
    m = bf[:3] - np.cross(r, bf[3:])
    w = np.concatenate([np.einsum('qac,qa->qc', R, m), np.einsum('qac,a->qc', R, bf[3:])], 1)
    e = sec.rest + (w @ sec.C.astype(float)) / (1 - sec.taper * s)[:, None]
    return R, r, m, e


def second_variation(sec, b, L, end, deg, nodes=NODES, vectors=False):
    s, w, S, V = grid(L, nodes)
    R, r, m, e = fields(sec, b, L, s)
    n = np.asarray(b, float)[3:]
    dr = np.einsum('qac,qc->qa', R, e[:, 3:])
    nf, q = len(sec.free), len(s)
    h = np.zeros((q, 6, nf, deg))
    norm = np.sqrt((2 * np.arange(deg) + 1) / L)
    for j, i in enumerate(sec.free):
        h[:, i, j, :] = V[:, :deg] * norm
    h = h.reshape(q, 6, -1)
    dphi = np.einsum('qac,qcx->qax', R, h[:, :3])
    phi_all = np.einsum('pq,qax->pax', S, dphi)
    phi, phiL = phi_all[:-1], phi_all[-1]
    drho = np.cross(phi, dr[:, :, None], axis=1) + np.einsum('qac,qcx->qax', R, h[:, 3:])
    rhoL = np.einsum('q,qax->ax', w, drho)
    stiff = (1 - sec.taper * s) * w
    A = np.einsum('q,qax,ab,qby->xy', stiff, h, sec.K, h, optimize=True)
    # n.(phi x (phi x r')) = (n.phi)(phi.r') - (n.r')|phi|^2
    nphi, tphi = np.einsum('a,qax->qx', n, phi), np.einsum('qa,qax->qx', dr, phi)
    B = -np.einsum('q,qax,qay->xy', w, np.cross(m[:, :, None], phi, axis=1), dphi, optimize=True) \
        - 2 * np.einsum('q,qax,qay->xy', w, np.cross(n[None, :, None], phi, axis=1), drho, optimize=True) \
        + np.einsum('q,qx,qy->xy', w, nphi, tphi) - np.einsum('q,qax,qay->xy', w * (dr @ n), phi, phi, optimize=True)
    Hm = A + (B + B.T) / 2
    cons = {'pose': np.vstack([phiL, rhoL]), 'ball': rhoL, 'free': np.zeros((0, h.shape[2]))}[end]
    Lc = np.linalg.cholesky(A)
    Hn = np.linalg.solve(Lc, np.linalg.solve(Lc, Hm).T)
    if len(cons):
        cn = np.linalg.solve(Lc, cons.T).T
        sv, vt = np.linalg.svd(cn)[1:]
        rank = (sv > 1e-9 * sv[0]).sum()
        Z = vt[rank:].T
        Hn = Z.T @ Hn @ Z
    return np.linalg.eigvalsh((Hn + Hn.T) / 2)


def check_formula(sec, b, L, seed=0):
    """Second difference of W - wrench.pose along e + eps h, against the formula (h with zero first-order pose change)."""
    rng = np.random.default_rng(seed)
    s, w, S, V = grid(L)
    R, r, m, e = fields(sec, b, L, s)
    deg = 5
    n = np.asarray(b, float)[3:]
    dr = np.einsum('qac,qc->qa', R, e[:, 3:])
    basis = np.zeros((len(s), 6, 6 * deg))
    for i in sec.free:
        basis[:, i, i * deg:(i + 1) * deg] = V[:, :deg]
    dphi = np.einsum('qac,qcx->qax', R, basis[:, :3])
    pa = np.einsum('pq,qax->pax', S, dphi)
    drho = np.cross(pa[:-1], dr[:, :, None], axis=1) + np.einsum('qac,qcx->qax', R, basis[:, 3:])
    con = np.vstack([pa[-1], np.einsum('q,qax->ax', w, drho)])
    c = np.linalg.svd(con)[2][6:].T @ rng.standard_normal(6 * deg - 6)
    for i in sec.rigid:
        c[i * deg:(i + 1) * deg] = 0
    c /= np.abs(c).max()
    h, phi, dp, dq = basis @ c, pa[:-1] @ c, dphi @ c, drho @ c
    stiff = (1 - sec.taper * s) * w
    form = np.einsum('q,qa,ab,qb->', stiff, h, sec.K, h) - w @ ((m * np.cross(phi, dp)).sum(1) + 2 * np.cross(phi, dq) @ n
                                                               - np.cross(phi, np.cross(phi, dr)) @ n)
    # exact perturbed rods: strains as polynomials (Legendre fit of e), Gauss-collocation of order 6 over substeps
    ce = legendre.legfit(2 * s / L - 1, e, 40)
    ch = np.zeros((41, 6))
    for i in range(6):
        ch[:deg, i] = c[i * deg:(i + 1) * deg]
    N = 4000
    hs = L / N
    gx = np.array([.5 - np.sqrt(3) / 6, .5 + np.sqrt(3) / 6])
    pts = (np.arange(N)[:, None] + gx).ravel() * hs
    E0, H0 = legendre.legval(2 * pts / L - 1, ce).T, legendre.legval(2 * pts / L - 1, ch).T

    def pose(eps):
        e = (E0 + eps * H0).reshape(N, 2, 6)
        X = np.zeros((N, 2, 4, 4))
        X[..., :3, :3], X[..., :3, 3] = hat(e[..., :3]), e[..., 3:]
        Om = (X[:, 0] + X[:, 1]) * hs / 2 + (X[:, 0] @ X[:, 1] - X[:, 1] @ X[:, 0]) * (np.sqrt(3) / 12 * hs * hs)   # Magnus, order 4
        T = np.broadcast_to(np.eye(4), Om.shape).copy()
        P = T.copy()
        for k in range(1, 9):
            P = P @ Om / k
            T = T + P
        g = np.eye(4)
        for t in T:
            g = g @ t
        return g
    d, g0 = .02, pose(0)
    mL = np.asarray(b, float)[:3] - np.cross(g0[:3, 3], n)

    def lag(eps):
        g = pose(eps)
        D = g[:3, :3] @ g0[:3, :3].T
        a = np.array([D[2, 1] - D[1, 2], D[0, 2] - D[2, 0], D[1, 0] - D[0, 1]]) / 2
        sn = np.linalg.norm(a)
        a = a * (np.arcsin(sn) / sn if sn > 0 else 1)
        dW = np.einsum('q,qa,ab,qb->', stiff, e - sec.rest, sec.K, h) * eps + .5 * eps ** 2 * np.einsum('q,qa,ab,qb->', stiff, h, sec.K, h)
        wl = np.concatenate([np.einsum('qac,qa->qc', R, m), np.einsum('qac,a->qc', R, n)], 1)
        if sec.rigid:
            dW = w @ (wl * h).sum(1) * eps + .5 * eps ** 2 * np.einsum('q,qa,ab,qb->', stiff, h, sec.K, h)
        return dW - mL @ a - n @ (g[:3, 3] - g0[:3, 3])
    D2 = lambda d: (lag(d) + lag(-d)) / d ** 2
    D4 = (4 * D2(d / 2) - D2(d)) / 3
    return form, D4


def conjugate_points(sec, b, L, n=1500):
    """Zeros of det T(s) in (0, L) (pose), by sign changes; the smallest singular values are watched for double ones."""
    s = np.linspace(0, L, n + 1)[1:]
    out = taylor(sec, steps6(np.asarray(b, LD)), L, out=s)
    dets, low = [], []
    for x, (R, r, U) in zip(s, out):
        T = tangent_of(R, r).astype(float)
        T[3:] /= x
        dets.append(np.linalg.slogdet(T)[0])
        sv = np.linalg.svd(T)[1]
        low.append(sv[-1] / sv[0])
    k0 = 20 if not sec.rigid else 40
    dets, low = np.array(dets[k0:]), np.array(low[k0:])
    if np.median(low) < 1e-14:                 # straight and inextensible: singular for every s
        return None, low[-1]
    return int((dets[1:] != dets[:-1]).sum()), float(low[-1])


def main():
    S = sections()
    iso = lambda c=.7, **kw: kirchhoff(1, 1, c, **kw)
    pi2 = np.pi ** 2
    cases = []   # name, section, b, L, end
    for P, _ in [(30, 0), (60, 1), (90, 2), (120, 3), (180, 4)]:
        cases.append(('straight compressed, clamped', kirchhoff(1, 2.5, .7), [0, 0, 0, 0, 0, -P], 'pose'))
    cases += [('straight compressed, equal bending', iso(), [0, 0, 0, 0, 0, -60], 'pose'),
              ('straight compressed, equal bending, shearable', S['equal bending'], [0, 0, 0, 0, 0, -30], 'pose'),
              ('straight compressed, ball', kirchhoff(1, 1.5, .7), [0, 0, 0, 0, 0, -25], 'ball'),
              ('straight compressed, ball', kirchhoff(1, 1.5, .7), [0, 0, 0, 0, 0, -75], 'ball'),
              ('straight compressed, ball, equal bending', iso(), [0, 0, 0, 0, 0, -25], 'ball'),
              ('straight compressed, free', kirchhoff(1, 1.5, .7), [0, 0, 0, 0, 0, -3], 'free'),
              ('straight compressed, free', kirchhoff(1, 1.5, .7), [0, 0, 0, 0, 0, -30], 'free'),
              ('straight in tension', S['sample'], [0, 0, 0, 0, 0, 30], 'pose'),
              ('twisted straight below Greenhill', iso(), [0, 0, 8, 0, 0, 0], 'pose'),
              ('twisted straight beyond Greenhill', iso(), [0, 0, 10, 0, 0, 0], 'pose'),
              ('twisted straight beyond Greenhill, tension', iso(), [0, 0, 14, 0, 0, 20], 'pose'),
              ('twisted straight, unequal bending', S['sample'], [0, 0, 14, 0, 0, -5], 'pose')]
    import mpmath as mp
    for k, b1, c, end, tag in [(.3, 1.6, .7, 'pose', 'stiff out of plane'), (.5, .6, .7, 'pose', 'soft out of plane'), (.8, 1.5, .25, 'pose', 'soft torsion'),
                               (.85, 1.5, .6, 'pose', 'strongly buckled'), (.5, .6, .7, 'ball', 'soft out of plane'), (.85, 1.3, .3, 'ball', 'soft torsion'),
                               (.6, 1.5, .7, 'ball', 'stiff out of plane')]:
        K = float(mp.ellipk(mp.mpf(str(k)) ** 2))
        if end == 'pose':   # theta = 2 asin(k sn(4K s)): theta(0) = 0, theta'(0) = 2 k 4K, thrust 16 K^2 along z
            lam = 4 * K
            b = [0, 2 * k * lam, 0, 0, 0, -lam ** 2]
        else:               # psi = theta - alpha; chart (lam, kap) of the planar theory, theta'(1) = 0, here lam chosen on the first sheet
            lam, kap = 4.2, k
            cd = mp.ellipfun('cd', lam, m=kap ** 2)
            sd = mp.ellipfun('sd', lam, m=kap ** 2)
            al = -2 * float(mp.asin(kap * cd))
            b = [0, float(2 * lam * kap * mp.sqrt(1 - mp.mpf(kap) ** 2) * sd), 0, -lam ** 2 * np.sin(al), 0, -lam ** 2 * np.cos(al)]
        cases.append(('planar buckled, ' + tag, kirchhoff(b1, 1, c), b, end))
    cases += [('helix', iso(), [4.5, 0, 3, 0, 0, 0], 'pose'), ('helix', S['sample'], [0, 9, 2, 0, 0, 0], 'pose'),
              ('intrinsic helix, loaded', S['rigid shear and axial, curved rest'], [3, 1, 2, 5, -6, -12], 'pose'),
              ('spatial', S['sample'], [3, -2, 4, 12, 9, -15], 'pose'), ('spatial', S['sample'], [5, 4, -3, -40, 25, 38], 'pose'),
              ('spatial', S['sample'], [2, 3, 6, 10, -20, -50], 'pose'), ('spatial', S['coupled'], [-4, 1, 2, 20, 30, -45], 'pose'),
              ('spatial', S['rigid shear and axial'], [1, 5, -2, -35, 20, -45], 'pose'), ('spatial', S['rigid shear'], [-3, 6, 1, 25, 18, -38], 'pose'),
              ('spatial', S['tapered, coupled'], [-1, 3, 2, -12, 8, -20], 'pose')]
    # ball and free: equilibria with no end couple, found backwards: load raised from zero along a follower path that keeps m(L) = 0
    for name, n, end in [('sample', [6, 4, -9], 'ball'), ('sample', [6, 4, -9], 'free'), ('coupled', [14, -9, 22], 'ball'), ('coupled', [14, -9, 22], 'free'),
                         ('curved rest', [2, 3, -14], 'ball'), ('rigid shear and axial', [-7, 5, -26], 'ball'), ('tapered', [3, -3, 1], 'free')]:
        b = solve_load(S[name], 1, {'follower': False, 'force': n, 'couple': [0, 0, 0]})
        b[3:] = n
        cases.append((name + ', dead load from zero', S[name], b, end))
    # unstable ones with zero end couple: start integration at the free end (reversal), i.e. Newton from random base couples
    rng = np.random.default_rng(8)
    for name, n in [('sample', [4, -3, -30]), ('rigid shear and axial', [10, -12, -40]), ('rigid shear and axial', [-20, 15, 30]), ('coupled', [5, 9, -35])]:
        sec, load = S[name], {'follower': False, 'force': n, 'couple': [0, 0, 0]}
        found = []
        for _ in range(60):
            try:
                b = newton(lambda x: end_residual(sec, 1, load, LD(1), x), np.concatenate([rng.uniform(-12, 12, 3), n]).astype(LD), its=14)
            except np.linalg.LinAlgError:
                b = None
            if b is None or np.abs(b).max() > 60 or any(np.abs(b - x).max() < 1e-6 for x in found):
                continue
            found.append(b)
            if len(found) == 2:
                break
        for b in found:
            b[3:] = n
            cases += [(name + ', other equilibrium under a dead load', sec, b, end) for end in ('ball', 'free')]
    rows = []
    print('formula', [check_formula(*a, 1.0) for a in [(S['sample'], [3, -2, 4, 12, 9, -15]), (S['rigid shear and axial'], [1, 5, -2, -35, 20, -45]),
                                                         (S['tapered, coupled'], [-1, 3, 2, -12, 8, -20])]])
    for name, sec, b, end in cases:
        ev, ev2 = second_variation(sec, b, 1., end, 16), second_variation(sec, b, 1., end, 24, 96)
        i1, i2 = int((ev < 0).sum()), int((ev2 < 0).sum())
        near = ev2[np.argmin(np.abs(ev2))]
        bb = np.asarray(b, LD)
        m = fl(shoot(sec, bb, 1.)['m'])
        row = {'name': name, 'section': sec.json(), 'length': 1.0, 'end': end, 'base_couple': fl(bb[:3]), 'base_force': fl(bb[3:]), 'index': i2,
               'nearest_eigenvalue': float('%.6g' % near), 'lowest': [float('%.6g' % x) for x in ev2[:5]]}
        if end != 'pose':
            row['tip_couple_size'] = float('%.1e' % np.abs(m).max())
            if np.abs(m).max() > 1e-9:
                print('  NOT zero couple', m)
        cp, low = conjugate_points(sec, b, 1.) if end == 'pose' else (None, None)
        if end == 'pose':
            row['conjugate_points_by_sign'] = cp
        print('%-50s %s %d %d near %.4f %.1e  conj %s' % (name, end, i1, i2, near, np.abs(ev[:5] - ev2[:5]).max(), cp), flush=True)
        if i1 != i2 or abs(near) < 5e-3:
            print('   SKIPPED')
            continue
        rows.append(row)
    dump('rod_index.json', CONVENTIONS + 'Morse index of W (minus the potential of the load) with the far end held: pose (position and rotation), ball (position; zero couple), '
         'free (dead force, zero couple); the clamp is fixed. Inertia of the second variation discretised by Legendre polynomials in the strains (degree < 16 and < 24 agree), '
         'eigenvalues relative to int h.K h, so that they accumulate at 1; nearest_eigenvalue: the one nearest zero; lowest: the five lowest. '
         'conjugate_points_by_sign (pose): sign changes of det d(phi,r)(s)/db in (0, L) on 1500 points; double points (equal bending, straight) show no change of sign; null: straight inextensible rods, where the determinant vanishes for every s. '
         'tools/rod_reference_index.py', rows)


if __name__ == '__main__':
    main()
