#!/usr/bin/env python3
"""Writes tests/data/fold_curve.csv: points of the first fold curve of the planar elastica, kap > 0.

Recipe: at each p = atanh kap, det d(x, y)/d(lam, p) of the pendulum's first variation (refcore.py, 256 bits) is zero in lam, by the secant
method of ref_folds.py from the stored lam (or a neighbour's). The values of p are those of the file; the curve is vertical at p = 1.5095407, where lam is
good to a third of the digits only.
Second route, for every seventh row: the determinant of AMV (3.14)-(3.18) by differences in (k, beta) (ref_folds.paper_det).
Says how far the stored rows are off; with --check nothing is written.
Run: python3 tools/ref_fold_curve.py [--check]
"""
import os
os.environ.setdefault('REF_BITS', '256')
import sys
from refcore import *
from ref_folds import fold, paper_det

PATH = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'tests', 'data', 'fold_curve.csv')
HEAD = '''# First fold curve of the clamped planar elastica with a free end, kap = tanh p > 0: lam, end (x, y), direction alpha of the pull, energy U.
# Made by tools/ref_fold_curve.py, 256 bits; p is exact as printed, 20 digits of the rest.
p,kap,lam,x,y,alpha,U
'''


def main():
    old = [line.split(',') for line in open(PATH) if line[0] not in '#p']
    rows, worst = [], dict.fromkeys(('lam', 'x', 'y', 'alpha', 'U'), mpf(0))
    for i, row in enumerate(old):
        p = mpf(row[0])
        q = fold(p, row[2])
        for j, key in enumerate(worst):
            worst[key] = max(worst[key], abs(q[key] - mpf(row[2 + j])))
        if i % 7 == 0:
            print('p', row[0], 'lam', mp.nstr(q['lam'], 20), 'det by the second route', mp.nstr(paper_det(q), 3), flush=True)
        rows.append(','.join([row[0]] + [dec(v, 20) for v in (mp.tanh(p), *(q[key] for key in worst))]))
    print(len(rows), 'rows; the stored ones are off by', {key: mp.nstr(v, 2) for key, v in worst.items()})
    if '--check' not in sys.argv[1:]:
        open(PATH, 'w').write(HEAD + '\n'.join(rows) + '\n')


if __name__ == '__main__':
    main()
