#!/usr/bin/env python3
"""Writes tests/data/inversion.json: all equilibria with lam < 14 for given end positions.

Recipe: r(1) and its Jacobian are tabulated on a grid of the tip unknowns, p in (0, 24] (logarithmic below 0.02,
step 0.004 to 3, step 0.02 beyond) x lam in (0, 14] (step 0.025), for the target and its mirror image (p < 0). Every
cell over whose corners both residuals change sign, after widening their range by half its width on each side, starts
a damped Newton iteration (about ten starts per root); the limits are deduplicated and polished to 256 bits (refcore.py).
Completeness: (1) the search is repeated on a grid 1.5 times finer in both directions and shifted;
(2) the signed count sum sign det d(x,y)/d(lam,p) must equal the winding number of the curve p -> r(lam = 14, p),
-30 <= p <= 30 (252000 points), about the target (the other sides of the rectangle map to (1,0)). Both must hold.
Second route of each root: AMV (3.17) with mpmath's elliptic integrals. A target on a fold holds a double root, taken from the fold
solver and marked; it counts 0 in the signed sum.
"""
import os
os.environ.setdefault('REF_BITS', '256')
import json
import numpy as np
from refcore import *
from refgrid import Grid, morse, taylor, start

OUT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'tests', 'data', 'inversion.json')
TARGETS = [('0.3', '0.4'), ('-0.5', '0.3'), ('0.7', '-0.2'), ('-0.2', '-0.75'), ('-0.9', '-0.3'), ('-0.6', '-0.3'), ('0.5', '0'), ('-0.3', '0'), ('0.9', '0'),
           ('0.9995', '0.01'), ('0.999999', '0.001'), ('0.9878', '0.1493'), ('0.01', '0.005'), ('0', '0'), 'fold',
           ('0.05', '-0.2'), ('0.1', '-0.14')]
FOLD = ('0.5460011156337996', '6.51502533103911')     # a row of the first fold curve; kap taken as exact
LMAX = 14.0


def at(lam, p):
    """x, y and Jacobian in (lam, p > 0), elementwise."""
    n = 110
    st = start(p)
    g = Grid.__new__(Grid)
    for _ in range(n):
        co = taylor(st, lam / n, 14)
        st = [sum(l[::-1]) for l in co]
    chi, v, s, c, C, d, w, Cd = (np.array([z, z]) for z in st)
    Grid._fill(g, np.array([lam, lam]), chi, v, s, c, C, d, w, Cd)
    return g.x[1], g.y[1], g.xl[1], g.xp[1], g.yl[1], g.yp[1]


def cells(g, X, Y):
    def rng(f):
        q = np.stack((f[:-1, :-1], f[1:, :-1], f[:-1, 1:], f[1:, 1:]))
        lo, hi = q.min(0), q.max(0)
        m = 0.5 * (hi - lo) + 1e-14
        return (lo - m <= 0) & (hi + m >= 0)
    a, b = np.nonzero(rng(g.x - X) & rng(g.y - Y))
    return (g.lam[a] + g.lam[a + 1]) / 2, (g.p[b] + g.p[b + 1]) / 2


def search(g, X, Y):
    lam, p = cells(g, X, Y)
    if len(lam) > 6000:
        print('   many cells', len(lam))
    if not len(lam):
        return []
    for it in range(14):
        x, y, a, b, c, d = at(lam, p)
        f, h = x - X, y - Y
        D = a * d - b * c
        with np.errstate(all='ignore'):
            dl, dp = (d * f - b * h) / D, (a * h - c * f) / D
            t = np.minimum(1, np.minimum(0.3 / np.abs(dl), 0.3 * np.minimum(p, 1) / np.abs(dp)))
        t = np.where(np.isfinite(t), t, 0)
        dl, dp = np.nan_to_num(dl) * t, np.nan_to_num(dp) * t
        lam, p = np.clip(lam - dl, 1e-3, 16), np.clip(p - dp, 1e-7, 40)
    x, y, *_ = at(lam, p)
    ok = (np.hypot(x - X, y - Y) < 1e-11) & (np.abs(dl) < 1e-5) & (np.abs(dp) < 1e-5) & (lam < LMAX)
    roots = []
    for l, q in zip(lam[ok], p[ok]):
        if not any(abs(l - m) < 1e-4 and abs(q - r) < 1e-4 * min(1, r) for m, r in roots):
            roots.append((l, q))
    return roots


def winding(g, X, Y):
    x = np.concatenate((g[0][::-1], g[0]))
    y = np.concatenate((-g[1][::-1], g[1]))
    z = np.append(x + 1j * y, x[0] + 1j * y[0]) - (X + 1j * Y)
    a = np.angle(z[1:] / z[:-1])
    assert np.abs(a).max() < 1.5, np.abs(a).max()
    return int(round(a.sum() / (2 * np.pi)))


def main():
    P = lambda k: np.unique(np.concatenate((np.geomspace(1e-5, 0.02, 60 * k // 2), np.linspace(0.02, 3, 745 * k // 2), np.linspace(3, 24, 1050 * k // 2))))
    g1 = Grid(P(2), LMAX, 0.025, 12)
    g2 = Grid(P(3) * 1.0007, LMAX, 1 / 60, 11)
    pc = np.concatenate((np.geomspace(1e-8, 0.05, 6000), np.linspace(0.0501, 30, 120000)))
    curve = at(np.full(len(pc), LMAX), pc)[:2]
    res, worst = [], mpf(0)
    for T in TARGETS:
        special = None
        if T == 'fold':
            from ref_folds import fold
            special = fold(mp.atanh(mpf(FOLD[0])), FOLD[1])
            X, Y = special['x'], special['y']
            T = (dec(X, 40), dec(Y, 40))
        else:
            X, Y = mpf(T[0]), mpf(T[1])
        allr, counts, signed = [], [], 0
        for sg in (1, -1):
            r1, r2 = (search(g, float(X), sg * float(Y)) for g in (g1, g2))
            if special is not None and sg == 1:
                far = lambda r: [z for z in r if abs(z[0] - float(special['lam'])) > 2e-2 or abs(z[1] - float(special['p'])) > 2e-2]
                r1, r2 = far(r1), far(r2)
            counts.append((len(r1), len(r2)))
            allr += [(l, sg * p) for l, p in r2]
        rows = []
        for l, p in sorted(allr):
            q = newton_xy(l, 2 * mp.asin(mp.tanh(mpf(p))), X, Y)
            assert abs(q['lam'] - l) < 1e-5 and q['lam'] < LMAX
            signed += int(mp.sign(q['det']))
            rows.append((q, False))
        if special is not None:
            rows.append((special, True))
        rows.sort(key=lambda z: z[0]['U'])
        W = winding(curve, float(X), float(Y))
        out = []
        for q, dbl in rows:
            k, b = paper_beta(q)
            r = paper(k, b, q['mode'], q['sign'])
            e = max(abs(r['x'] - X), abs(r['y'] - Y), abs(r['lam'] - q['lam']))
            worst = max(worst, e)
            m, ev, _ = morse(float(q['lam']), float(q['p']), N=100)
            o = dict(lam=dec(q['lam']), kap=dec(q['kap']), p=dec(q['p']), alpha=dec(q['alpha']), theta1=dec(q['theta1']), U=dec(q['U']), mode=q['mode'], sign=q['sign'],
                     index=m, min_abs_eigenvalue='%.6g' % ev)
            if abs(q['da'][0]) < mpf(10) ** -20:        # theta'(0) = 0: between two sheets
                o['on_seam'] = True
                o['mode'] = o['sign'] = None
            if dbl:
                o['double_root'] = True
                o['index'] = 'fold 0|1'
            out.append(o)
        good = all(a == b for a, b in counts) and signed == W
        near = [mp.nstr(q['lam'], 8) for q, _ in rows if q['lam'] > 13.9]
        print(T, 'roots', len(rows), 'counts (coarse, fine)', counts, 'signed', signed, 'winding', W, 'OK' if good else '*** FAIL', 'stable', sum(o['index'] == 0 for o in out),
              'near 14:', near, flush=True)
        res.append(dict(x=T[0], y=T[1], count=len(rows), signed_count=signed, winding_number_at_lam_14=W, complete=good, equilibria=out))
    print('worst second-route difference', mp.nstr(worst, 3))
    head = dict(about='All equilibria with lam < 14 and r(1) = (x, y) (exact decimals), ordered by U',
                accuracy='25 significant digits; second route AMV (3.17): %s' % mp.nstr(worst, 2),
                completeness='two shifted grids (about 1.9e3 x 560 and 2.8e3 x 840 cells in p > 0, and the mirror image) give the same roots, and the sum of the signs of '
                'det d(x,y)/d(lam,p) over the roots equals the winding number of p -> r(lam=14, p) about the target',
                index='Morse index, tools/ref_index.py; a root on a fold is marked double_root; on_seam: theta\'(0) = 0, so mode and sign are undefined',
                method='tools/ref_inversion.py')
    json.dump(dict(header=head, targets=res), open(OUT, 'w'), indent=0)


main()
