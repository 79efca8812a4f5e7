#!/usr/bin/env python3
"""Writes tests/data/motion_W.json, motion_B.json, motion_H.json: motions of a mass mu = 1 on the planar elastica without snaps, from rest
on the equilibrium of lowest energy at a given place, every 0.1 to t = 20. W: dead load (-8, -2), smooth. B, H: free, with taut bounces.

Recipe: ref_motion.c (gcc with libquadmath, compiled into a temporary directory), chart (p, w) in closed form, quadruple precision,
extrapolation of order 16. Checks: a second run with a tolerance a thousand times larger; the energy at every row; place, energy and
direction of the pull at every row from the Taylor series of the pendulum (refcore.py, 128 bits), in which no elliptic integral occurs;
the files as they were. With --check nothing is written.
Run: python3 tools/ref_motion.py [--check]        (mpmath; 5 minutes on one core)
"""
import os
os.environ.setdefault('REF_BITS', '128')
import json
import subprocess
import sys
import tempfile
from refcore import *

HERE = os.path.dirname(os.path.abspath(__file__))
OUT = os.path.join(HERE, '..', 'tests', 'data', 'motion_%s.json')
# place, (p, w) next to the start, dead load, tolerance of a step
MOTIONS = dict(W=('-0.2 0.5', '1.027 2.541', '-8 -2', 1e-22),
               B=('0.8 0.4', '0.3216 3.6416', '0 0', 1e-22),
               H=('0.6 0.3', '0.6216 3.9900', '0 0', 1e-19))


def run(exe, place, start, load, tol):
    a = [exe, '%g' % tol] + (place + ' ' + start + ' ' + load).split() + ['20', '0.1']
    lines = subprocess.run(a, capture_output=True, text=True, check=True).stdout.splitlines()
    return lines[0].split(), [line.split() for line in lines[1:]]


def motion(exe, name):
    place, near, load, tol = MOTIONS[name]
    start, fine = run(exe, place, near, load, tol)
    _, rough = run(exe, place, near, load, tol * 1000)
    gap = lambda a, b: max(abs(mpf(u) - mpf(v)) for u, v in zip(a[1:5], b[1:5]))
    two_runs = max(gap(a, b) for a, b in zip(fine, rough))
    force = [mpf(u) for u in load.split()]
    drift, series, first = mpf(0), mpf(0), None
    for row in fine:
        t, x, y, vx, vy, U, alpha, lam, p, w = map(mpf, row[:10])
        q = point(lam, p)
        series = max([series] + [abs(a - b) for a, b in ((x, q['x']), (y, q['y']), (mp.expj(alpha), mp.expj(q['alpha'])), (U, q['U']))])
        energy = U + (vx * vx + vy * vy) / 2 - force[0] * x - force[1] * y
        first = energy if first is None else first
        drift = max(drift, abs(energy - first))
    steps, lam, w, turns, evaluations = fine[-1][10:]
    old = json.load(open(OUT % name), parse_float=str, parse_int=str)['rows']
    stored = max(gap(a, b) for a, b in zip(fine, old))
    show = lambda z: mp.nstr(z, 2)
    print('%s: %s steps, %s times thrown back inwards, lam to %.4f (force %.1f), w to %.4f; two runs %s, energy %s, Taylor series %s, the stored rows %s'
          % (name, steps, turns, float(lam), float(lam) ** 2, float(w), show(two_runs), show(drift), show(series), show(stored)), flush=True)
    number = lambda text: mp.nstr(mpf(text), 22, min_fixed=-30, max_fixed=30)
    rows = ['[' + ','.join([mp.nstr(mpf(r[0]), 4)] + [number(u) for u in r[1:5]]) + ']' for r in fine]
    head = dict(motion=name, about='mu = 1, at rest at t = 0 on the equilibrium of lowest energy at (%s), dead load (%s); rows t, x, y, vx, vy' % tuple(s.replace(' ', ', ') for s in (place, load)),
                accuracy='difference of two runs (tolerances %g and %g a step) %s, energy %s' % (tol, 1000 * tol, show(two_runs), show(drift)),
                method='tools/ref_motion.py, tools/ref_motion.c', p=start[0], w=start[1], turns=int(turns), largest_force_at_a_step=round(float(lam) ** 2, 1))
    return json.dumps(head)[:-1] + ', "rows":[\n' + ',\n'.join(rows) + '\n]}\n'


def main():
    with tempfile.TemporaryDirectory() as tmp:
        exe = os.path.join(tmp, 'motion')
        subprocess.run(['gcc', '-O2', '-o', exe, os.path.join(HERE, 'ref_motion.c'), '-lquadmath', '-lm'], check=True)
        for name in MOTIONS:
            text = motion(exe, name)
            if '--check' not in sys.argv[1:]:
                open(OUT % name, 'w').write(text)


if __name__ == '__main__':
    main()
