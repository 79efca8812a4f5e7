#!/usr/bin/env python3
"""Writes tests/data/equilibria.json: single equilibria of the planar elastica.

Recipe: pendulum from rest at the free end, 400-bit Taylor series (refcore.py); an
equilibrium is named by (lam, kap), (lam, alpha) or (lam, gamma), gamma being the direction of
pull, alpha = gamma - sign(kap) pi; the last two are solved for p = atanh kap by the secant method.
Second route: AMV (3.14)-(3.18) with mpmath's ellipf, ellipe at 400 bits, from k = |kap|
and beta = asin(sin(alpha/2)/k); relative differences of lam, x, 1-x, y, U are printed.
Third route (lam < 15): scipy DOP853 from the free end in double precision.
Run: python3 tools/ref_equilibria.py
"""
import json
import os
import numpy as np
from scipy.integrate import solve_ivp
from refcore import *

OUT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'tests', 'data', 'equilibria.json')
ND = 25


def solve_p(lam, alpha, p0):
    """p with -psi(lam; p) = alpha."""
    f = lambda p: point(lam, p)['alpha'] - alpha
    tol = mpf(10) ** -108 * mp.exp(lam)            # roundoff grows like exp(lam) from the tip
    a, b = mpf(p0), mpf(p0) * (1 + mpf(10) ** -4)
    fa, fb = f(a), f(b)
    for _ in range(40):
        a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
        fb = f(b)
        if abs(fb) < tol:
            break
    else:
        raise ArithmeticError('solve_p')
    return b


def cases():
    for lam, kap in [('0.8', '0.35'), ('0.8', '-0.9'), ('2', '0.1'), ('2', '-0.7'), ('3', '0.6'), ('3', '-0.95'),
                     ('4.5', '0.2'), ('4.5', '-0.5'), ('4.5', '0.85'), ('5.5', '0.4'), ('5.5', '-0.9'),
                     ('6.3', '0.6'), ('6.3', '-0.1'), ('6.3', '0.97'), ('7.1', '-0.35'), ('8', '0.75'),
                     ('8', '-0.3'), ('8', '0.99'), ('9.5', '0.5'), ('9.5', '-0.15'), ('9.5', '0.92'),
                     ('11.2', '0.3'), ('11.2', '-0.65'), ('11.2', '0.8'), ('12.1', '-0.5'), ('13', '0.25'),
                     ('13', '-0.7'), ('13', '0.96'), ('1.5707963267948966', '0.5'), ('3.25', '-0.05')]:
        yield 'generic', lam, ('kap', kap)
    for kap in ('1e-3', '-1e-6', '1e-9'):
        for lam in ('1.3', '4', '7.5'):
            yield 'near-straight', lam, ('kap', kap)
    for lam in ('0.3', '0.05', '0.01'):
        for al in ('1', '-2.5'):
            yield 'small lam', lam, ('alpha', al)
    for lam, g in [('25', '0.8'), ('25', '-2.2'), ('25', '0.001'), ('60', '-0.8'), ('60', '2.5'), ('60', '0.001'),
                   ('60', '-1e-6'), ('150', '0.3'), ('18', '3.0')]:
        yield 'taut', lam, ('gamma', g)
    for kap, lams in [('0.999', ('6', '10', '14')), ('-0.999', ('8', '20')), ('0.99999999', ('9', '12', '25')),
                      ('-0.99999999', ('10.5', '35'))]:
        for lam in lams:
            yield 'loop', lam, ('kap', kap)


def rel(a, b):
    return abs(a - b) / abs(b) if b else abs(a)


def main():
    rows, worst, worst3 = [], mpf(0), 0.0
    for kind, lam, (what, val) in cases():
        L, v = mpf(lam), mpf(val)
        if what == 'kap':
            p = mp.atanh(v)
        elif what == 'alpha':
            p = solve_p(L, v, -2 * mp.atanh(mp.tan(v / 4)) * (1 + L * L / 9))
        else:
            sg = 1 if v > 0 else -1                # alpha = gamma - sign(kap) pi lies in (-pi, pi)
            p = solve_p(L, v - sg * mp.pi, sg * (L - mp.log(2 * mp.tan(abs(v) / 4))))
        q = point(L, p)
        k, beta = paper_beta(q)
        r = paper(k, beta, q['mode'], q['sign'])
        d = max(rel(r['lam'], L), rel(1 - r['x'], 1 - q['x']), rel(r['x'], q['x']), rel(r['y'], q['y']), rel(r['U'], q['U']),
                rel(r['theta1'], q['theta1']))
        if mp.isfinite(d):                         # (k, beta) of a very taut rod are beyond 400 bits
            worst = max(worst, d)
        else:
            t, l = mp.tan(abs(v) / 4), L           # taut limit, exact up to exp(-2 lam) (theory 2.3)
            print('  taut formula, U:', mp.nstr(rel(4 * l * mp.sin(v / 4) ** 2, q['U']), 3), 'exp(-2 lam)', mp.nstr(mp.exp(-2 * l), 3))
        sh = shape(L, p, ('0.25', '0.5', '0.75'))
        if L < 15:
            l = float(L)
            s = solve_ivp(lambda t, z: [z[1], -l * l * np.sin(z[0]), np.cos(z[0]), np.sin(z[0])], (0, 1),
                          [float(q['psi1']), 0, 0, 0], method='DOP853', rtol=1e-13, atol=1e-15)
            z = s.y[:, -1]
            w = (z[2] + 1j * z[3]) * np.exp(-1j * z[0])
            e = max(abs(w.real - float(q['x'])), abs(w.imag - float(q['y'])))
            worst3 = max(worst3, e)
        row = dict(kind=kind, given='lam, ' + what, lam=dec(L, ND), kap=dec(q['kap'], ND), p=dec(q['p'], ND), kapc=dec(q['kapc'], ND),
                   alpha=dec(q['alpha'], ND), theta1=dec(q['theta1'], ND), x=dec(q['x'], ND), y=dec(q['y'], ND),
                   one_minus_x=dec(1 - q['x'], ND), U=dec(q['U'], ND), force=dec(q['force'], ND), mode=q['mode'], sign=q['sign'],
                   shape=[dict(s=t['s'], theta=dec(t['theta'], ND), dtheta=dec(t['dtheta'], ND), x=dec(t['x'], ND), y=dec(t['y'], ND)) for t in sh])
        if what == 'gamma':
            row['gamma'] = val
        rows.append(row)
        print(kind, lam, what, val, 'mode', q['mode'], 'sign', q['sign'], 'p', mp.nstr(q['p'], 8), 'two-route', mp.nstr(d, 3))
    print('cases', len(rows), 'worst relative difference of the two routes', mp.nstr(worst, 3), 'worst |r - r_double|', worst3)
    head = dict(about='Equilibria of the planar elastica, clamped at the origin along +x, length 1, EI = 1, free to turn at s = 1; '
                'theta is the angle from +x, dtheta = theta\'(s), U = 1/2 int theta\'^2, force = lam^2.',
                labels='kap = sin((theta1 - alpha)/2), p = atanh kap, kapc = sqrt(1 - kap^2) = sech p, mode = zeros of theta\' inside (0,1), sign of theta\'(0); '
                'gamma = alpha + sign(kap) pi. The exact decimal inputs are lam and the field named in "given"; '
                'where kap rounds to 1 use p or kapc.',
                accuracy='every entry is rounded to 25 significant digits (relative); two routes agree to %s' % mp.nstr(worst, 2),
                method='tools/ref_equilibria.py: 400-bit Taylor series of the pendulum from the free end, checked by AMV (3.14)-(3.18)')
    with open(OUT, 'w') as f:
        json.dump(dict(header=head, rows=rows), f, indent=0)


main()
