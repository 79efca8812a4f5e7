#!/usr/bin/env python3
"""Writes tests/data/snap_run.json: mu = 1, start lam = 6.3, kap = 0.6, v = (0, -0.5); free motion, snap, landing, motion to t = 3.

Recipe: r'' = lam^2 (cos alpha, sin alpha) in the coordinates (lam, p = atanh kap); r and its Jacobian J from the
Taylor series of the pendulum (refcore.py, 128 bits).  Up to the fold: desingularised time, q' = sgn(det) adj(J) v, v' = |det| f, t' = |det|;
the fold is det = 0, found by the secant method on the length of the last step.  Landing: viscous layer (ref_layer.py), Newton.
Integrator: Gragg's modified midpoint rule, extrapolated with n = 2, 4, ..., 16 (order 16), step from the difference of the last two columns.
Afterwards plain time, q' = J^-1 v, the same integrator in quadruple precision (ref_snap_run.c, gcc with libquadmath, compiled here into a
temporary directory; its pendulum is measured from the top, so that taut rods keep relative accuracy).
Checks: the whole run with per-step tolerances 1e-15/1e-21 (before the fold 1e-15/1e-20); energy; the Python integrator with 128-bit Taylor
pendulum from the landing to t = 0.3.
"""
import os
os.environ.setdefault('REF_BITS', '128')
import json
import subprocess
import tempfile
from refcore import *

OUT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'tests', 'data', 'snap_run.json')
NS = [2 * i for i in range(1, 9)]
TIMES = ['0.1', '0.2', '0.3', '0.5', '0.75', '1', '1.25', '1.5', '1.75', '2', '2.25', '2.5', '2.75', '3']


def pend(lam, p):
    q = point(lam, p)
    f = 2 / mp.cosh(p)
    a, b, c, d = q['J']
    return q, (a, b * f, c, d * f)


def rhs(z):
    lam, p, u, v = z
    q, (a, b, c, d) = pend(lam, p)
    D = a * d - b * c
    return [(d * u - b * v) / D, (a * v - c * u) / D, lam * lam * mp.cos(q['alpha']), lam * lam * mp.sin(q['alpha'])]


def rhs_desing(sg):
    def f(z):
        lam, p, u, v, t = z
        q, (a, b, c, d) = pend(lam, p)
        D = sg * (a * d - b * c)
        return [sg * (d * u - b * v), sg * (a * v - c * u), D * lam * lam * mp.cos(q['alpha']), D * lam * lam * mp.sin(q['alpha']), D]
    return f


def gbs(f, z, H, f0=None):
    """One step; returns the new state and an error estimate."""
    f0 = f0 or f(z)
    T = []
    for i, n in enumerate(NS):
        h = H / n
        a, b = z, [x + h * k for x, k in zip(z, f0)]
        for _ in range(n - 1):
            k = f(b)
            a, b = b, [x + 2 * h * y for x, y in zip(a, k)]
        row = [b]
        for j in range(1, i + 1):
            c = mpf(NS[i] ** 2) / NS[i - j] ** 2 - 1
            row.append([x + (x - y) / c for x, y in zip(row[j - 1], T[-1][j - 1])])
        T.append(row)
    z1, z2 = T[-1][-1], T[-1][-2]
    return z1, max(abs(x - y) / (1 + abs(x)) for x, y in zip(z1, z2))


def safe(f, z, H, f0):
    try:
        return gbs(f, z, H, f0)
    except (ArithmeticError, AssertionError, ValueError):
        return None, mpf(1)


def energy(z):
    q = point(z[0], z[1])
    return q['U'] + (z[2] ** 2 + z[3] ** 2) / 2


def to_fold(tol):
    z = [mpf('6.3'), mp.atanh(mpf('0.6')), mpf(0), mpf('-0.5'), mpf(0)]
    E0 = energy(z)
    det = lambda z: point(z[0], z[1])['det']
    sg = int(mp.sign(det(z)))
    f, H = rhs_desing(sg), mpf('0.02')
    while True:
        f0 = f(z)
        y, e = safe(f, z, H, f0)
        if e > tol:
            H *= max(mpf('0.2'), mpf('0.9') * (tol / e) ** (mpf(1) / 15))
            continue
        if sg * det(y) < 0:
            break
        z = y
        H *= min(mpf(2), mpf('0.9') * (tol / (e + tol * mpf(10) ** -6)) ** (mpf(1) / 15))
    a, fa, b, fb = mpf(0), det(z), H, det(y)
    for _ in range(30):
        c = b - fb * (b - a) / (fb - fa)
        y, _ = gbs(f, z, c, f0)
        a, fa, b, fb = b, fb, c, det(y)
        if abs(b - a) < mpf(10) ** -27 * abs(b) or fb == fa:
            break
    return y, E0


def free(z, tol, times, log=None):
    t, H, out, nst, lmax, flips, E0 = mpf(times[0]), mpf('0.001'), [], 0, z[0], 0, energy(z)
    dsg = mp.sign(point(z[0], z[1])['det'])
    bounces, prev = 0, None
    for goal in times[1:]:
        goal = mpf(goal)
        while t < goal:
            h = min(H, goal - t)
            f0 = rhs(z)
            y, e = safe(rhs, z, h, f0)
            if e > tol:
                H = h * max(mpf('0.1'), mpf('0.9') * (tol / e) ** (mpf(1) / 15))
                continue
            z, t, nst = y, t + h, nst + 1
            if h == H or e > tol / 10 ** 6:
                H = h * min(mpf(2), max(mpf('0.3'), mpf('0.9') * (tol / (e + tol * mpf(10) ** -6)) ** (mpf(1) / 15)))
            lmax = max(lmax, z[0])
            if mp.sign(point(z[0], z[1])['det']) != dsg:
                raise ArithmeticError('second fold')
            if prev is not None and prev > 0 >= f0[0]:
                bounces += 1
            prev = f0[0]
        q = point(z[0], z[1])
        E = q['U'] + (z[2] ** 2 + z[3] ** 2) / 2
        out.append((goal, z, q, E - E0))
        print('  t', mp.nstr(goal, 4), 'r', mp.nstr(q['x'], 15), mp.nstr(q['y'], 15), 'v', mp.nstr(z[2], 13), mp.nstr(z[3], 13), 'lam', mp.nstr(z[0], 10), 'dE', mp.nstr(E - E0, 3),
              'steps', nst, 'largest lam at a step', mp.nstr(lmax, 6), 'maxima of lam', bounces, flush=True)
    return out


def free_c(z, t0, tol, exe):
    a = [exe, '%g' % tol, mp.nstr(t0, 36)] + [mp.nstr(u, 36) for u in z] + TIMES
    r = subprocess.run(a, capture_output=True, text=True)
    rows = [l.split() for l in r.stdout.splitlines()]
    for w in rows:
        print('  t', float(w[0]), 'r', w[5][:20], w[6][:20], 'v', w[3][:18], w[4][:18], 'lam', w[1][:12], 'steps, largest lam, bounces, evaluations', w[9:])
    print(r.stderr, 'exit', r.returncode, flush=True)
    return [[mpf(u) for u in w[:9]] for w in rows], r.stderr.strip()


def run(tol, ctol, exe):
    z, E0 = to_fold(tol)
    q = point(z[0], z[1])
    print('fold t', mp.nstr(z[4], 24), 'lam', mp.nstr(z[0], 20), 'p', mp.nstr(z[1], 20), 'r', mp.nstr(q['x'], 15), mp.nstr(q['y'], 15), 'dE', mp.nstr(energy(z) - E0, 3), flush=True)
    import ref_layer
    o, _, _ = ref_layer.run(q, 64, 1e-3)
    land, _ = ref_layer.landing(q, o)
    print('landing lam', mp.nstr(land['lam'], 20), 'p', mp.nstr(land['p'], 20), 'released', mp.nstr(q['U'] - land['U'], 20), flush=True)
    zz = [land['lam'], land['p'], z[2], z[3]]
    out, err = free_c(zz, z[4], ctol, exe)
    return z, q, E0, land, out, zz


def main():
    tmp = tempfile.mkdtemp()
    exe = os.path.join(tmp, 'snap')
    src = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'ref_snap_run.c')
    subprocess.run(['gcc', '-O3', '-o', exe, src, '-lquadmath', '-lm'], check=True)
    A = run(mpf(10) ** -15, 1e-15, exe)
    z, q, E0, land, out, zz = run(mpf(10) ** -20, 1e-21, exe)
    E1 = energy(zz)
    print('Python integrator, 128-bit Taylor pendulum:')
    py = free(zz, mpf(10) ** -16, [z[4], '0.1', '0.2', '0.3'])
    dpy = max(max(abs(w['x'] - c[5]), abs(w['y'] - c[6]), abs(s[2] - c[3]), abs(s[3] - c[4])) for (_, s, w, _), c in zip(py, out))
    print('difference to t = 0.3', mp.nstr(dpy, 3))
    rows = []
    for c, d in zip(out, A[4]):
        err = max(abs(u - v) for u, v in zip(c[3:7], d[3:7]))
        rows.append(dict(t=mp.nstr(c[0], 4), x=dec(c[5], 22), y=dec(c[6], 22), vx=dec(c[3], 22), vy=dec(c[4], 22), lam=dec(c[1], 22), p=dec(c[2], 22), alpha=dec(c[8], 22), U=dec(c[7], 22),
                         energy_drift=mp.nstr(c[7] + (c[3] ** 2 + c[4] ** 2) / 2 - E1, 2), difference_of_two_runs=mp.nstr(err, 2)))
        print(rows[-1]['t'], rows[-1]['difference_of_two_runs'], rows[-1]['energy_drift'])
    lab = lambda w: dict(lam=dec(w['lam'], 22), kap=dec(w['kap'], 22), p=dec(w['p'], 22), alpha=dec(w['alpha'], 22), U=dec(w['U'], 22), mode=w['mode'], sign=w['sign'])
    head = dict(about='mu = 1, start lam = 6.3, kap = 0.6, v = (0, -0.5) (exact); no gravity; snap at the first fold, viscous landing, no further fold in the rows',
                accuracy='22 digits printed. difference_of_two_runs (tolerance 1e-15 against 1e-21) bounds the error of a row generously. Fold time of the two runs differs by %s' % mp.nstr(abs(A[0][4] - z[4]), 2),
                method='tools/ref_snap_run.py, tools/ref_snap_run.c')
    fo = lab(q)
    fo.update(t=dec(z[4], 22), x=dec(q['x'], 22), y=dec(q['y'], 22), vx=dec(z[2], 22), vy=dec(z[3], 22))
    json.dump(dict(header=head, start_energy=dec(E0, 22), fold=fo, landing=lab(land), released=dec(q['U'] - land['U'], 22), rows=rows), open(OUT, 'w'), indent=0)


if __name__ == '__main__':
    main()
