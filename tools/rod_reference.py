#!/usr/bin/env python3
"""Writes tests/data/rod_ivp.json, rod_loads.json, rod_held.json (spatial Cosserat rods).

Two routes, see rod_reference_core.py: Taylor series of the director matrix, and the local balance laws with a
quaternion by extrapolation, both in 80-bit precision; every row keeps the largest relative difference ("gap").
Loads are raised from zero in small steps; the last Newton iteration uses residuals in extended precision.
Needs numpy (with an 80-bit long double), scipy, mpmath. Order: rod_reference.py, rod_reference_index.py, rod_reference_branch.py.
"""
import json
import os
import numpy as np
from rod_reference_core import *

OUT = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'tests', 'data')
CONVENTIONS = ('Clamp at the origin, R(0) = I; strain e = (u1,u2,u3,v1,v2,v3), resultant w = (m,n) along the directors; '
               'w = (1 - taper s) K (e - rest); rigid: 0-based strain components that keep their rest value (their rows of K are written 0). '
               'World frame: n constant, m(s) = m(0) - r(s) x n, base = (m(0), n). R = [d1 d2 d3] by rows; quaternion [w,x,y,z], w >= 0. ')
SAMPLE = Section([1, 1.5, .7, 100, 120, 300])


def spd(rng, rest=(0, 0, 0, 0, 0, 1), **kw):
    """A coupled 6x6 law of short decimals."""
    d = np.sqrt(np.array([1, 1.6, .8, 60, 90, 200]))
    A = rng.uniform(-1, 1, (6, 6)) * .35
    S = (A @ A.T + np.eye(6)) * d[:, None] * d[None, :]
    S = np.round((S + S.T) / 2, 3)
    assert np.linalg.eigvalsh(S)[0] > 0
    return Section(S, rest=rest, **kw)


def sections():
    rng = np.random.default_rng(20261)
    rest = (.8, -.5, 1.7, 0, 0, 1)
    return {
        'sample': SAMPLE,
        'equal bending': Section([1, 1, .77, 80, 80, 150]),
        'curved rest': Section([1, 1.5, .7, 100, 120, 300], rest=rest),
        'coupled': spd(rng),
        'coupled, curved rest': spd(rng, rest=(-1.2, .4, 2.5, 0, 0, 1)),
        'rigid shear and axial': kirchhoff(1, 1.5, .7),
        'rigid shear and axial, curved rest': kirchhoff(1, .6, .9, rest=(2., 0, 3., 0, 0, 1)),
        'rigid shear': Section([1, 2, .7, 1, 1, 250], rigid=(3, 4)),
        'rigid axial': Section([1, 1.3, .6, 90, 70, 1], rigid=(5,)),
        'coupled, rigid shear': spd(rng, rigid=(3, 4)),
        'tapered': Section([1, 1.5, .7, 100, 120, 300], taper=.5),
        'tapered, coupled': spd(rng, taper=.3),
        'tapered, rigid': kirchhoff(1.2, 1, .7, rest=(.5, 0, 1, 0, 0, 1), taper=.6),
    }


def dump(name, recipe, rows):
    with open(os.path.join(OUT, name), 'w') as f:
        f.write('{\n"recipe": ' + json.dumps(recipe) + ',\n"rows": [\n')
        f.write(',\n'.join(json.dumps(r) for r in rows) + '\n]\n}\n')
    print(name, len(rows), 'rows')


def scipy_gap(sec, b, L, A):
    """Third route in plain double precision: scipy DOP853 on the director matrix."""
    from scipy.integrate import solve_ivp
    C, b = sec.C.astype(float), np.asarray(b, float)

    def rhs(s, y):
        R, r = y[:9].reshape(3, 3), y[9:]
        w = np.concatenate([R.T @ (b[:3] - np.cross(r, b[3:])), R.T @ b[3:]])
        e = C @ w / (1 - sec.taper * s) + sec.rest
        return np.concatenate([(R @ hat(e[:3])).ravel(), R @ e[3:]])
    y = solve_ivp(rhs, (0, float(L)), np.concatenate([np.eye(3).ravel(), np.zeros(3)]), method='DOP853', rtol=1e-13, atol=1e-14).y[:, -1]
    return max(gap(A['R'], y[:9].reshape(3, 3)), gap(A['r'], y[9:]))


def ivp():
    S = sections()
    cases = [('sample', [.5, -.3, .2, 1, -2, .5], 1), ('sample', [3, -2, 4, 12, 9, -15], 1), ('sample', [0, 0, 0, 0, 0, 0], 1),
             ('sample', [5, 4, -3, -40, 25, 38], 1), ('equal bending', [2, 1, 5, -3, 6, -20], 1), ('equal bending', [0, 0, 4, 0, 0, 10], 1),
             ('equal bending', [1.5, -4, 2, 18, 0, -8], 1.7), ('curved rest', [0, 0, 0, 0, 0, 0], 1), ('curved rest', [-2, 3, 1, 7, -15, 11], 1),
             ('coupled', [1, 2, -3, 5, -4, 12], 1), ('coupled', [-4, 1, 2, 20, 30, -45], 1), ('coupled, curved rest', [2, -1, .5, -9, 14, 6], 1),
             ('coupled, curved rest', [1, 1, 1, -.5, .25, 2], 2.5), ('rigid shear and axial', [3, -2, .5, 13, -4, 12], 1),
             ('rigid shear and axial', [1, 5, -2, -35, 20, 45], 1), ('rigid shear and axial, curved rest', [2, 0, -4, 9, 16, -7], 1),
             ('rigid shear', [-3, 2, 1, 8, 8, -18], 1), ('rigid axial', [4, -3, 2, -11, 13, 9], 1), ('coupled, rigid shear', [1, -3, 2, 10, -12, -9], 1),
             ('tapered', [2, 1, -1, 6, -9, 14], 1), ('tapered, coupled', [-1, 3, 2, -12, 8, 10], 1), ('tapered, rigid', [3, 2, -2, 10, 15, -12], 1)]
    rows, worst = [], 0
    for name, b, L in cases:
        sec = S[name]
        A, B = shoot(sec, b, L), shoot(sec, b, L, 'B')
        g = max(gap(A[k] if np.abs(A[k]).max() > 1e-12 else 0, B[k] if np.abs(A[k]).max() > 1e-12 else 0) for k in A)
        g3 = scipy_gap(sec, b, L, A)
        assert g < 1e-14 and g3 < 3e-11, (name, g, g3)
        worst = max(worst, g)
        rows.append({'name': name, 'section': sec.json(), 'length': L, 'base_couple': b[:3], 'base_force': b[3:],
                     'position': fl(A['r']), 'rotation': fl(A['R']), 'tip_couple': fl(A['m']), 'energy': float(A['U']),
                     'tangent': fl(A['T']), 'gap': g})
    dump('rod_ivp.json', CONVENTIONS + 'Initial-value problem from the base wrench. tangent: 6x6, d(phi, r)(L)/d(m(0), n), dR = [dphi]x R, rows phi then r. '
         'Routes: Taylor series of the director matrix and extrapolation on the local balance laws with a quaternion, both 80-bit; tangents by complex step; '
         'gap: largest relative difference; scipy DOP853 (1e-13) as a third. Worst gap %.1e. tools/rod_reference.py' % worst, rows)


def end_residual(sec, L, load, t, b, route='A'):
    """load: dict(force, couple, follower). Unknown b (6). Residual (6) and Jacobian, for dead or follower loads times t."""
    A = shoot(sec, b, L, route)
    b = np.asarray(b, LD)
    F, Cc = t * np.asarray(load['force'], LD), t * np.asarray(load['couple'], LD)
    if load['follower']:
        F, Cc = A['R'] @ F, A['R'] @ Cc
    n = b[3:]
    res = np.concatenate([b[:3] - cross(A['r'], n) - Cc, n - F])
    J = np.zeros((6, 6), LD)
    J[:3, :3] = np.eye(3)
    J[3:, 3:] = np.eye(3)
    J[:3, 3:] -= hat(A['r'])
    J[:3] += hat(n) @ A['T'][3:]
    if load['follower']:
        J[:3] += hat(Cc) @ A['T'][:3]
        J[3:] += hat(F) @ A['T'][:3]
    return res, J, A


def newton(fun, b, tol=1e-17, its=12):
    last = np.inf
    for _ in range(its):
        res, J, A = fun(b)
        size = float(np.abs(res).max())
        if not np.isfinite(size) or size > 1e6:
            return None
        d = np.linalg.solve(J.astype(float), res.astype(float))
        b = b - d
        step = np.abs(d).max() / max(1, float(np.abs(b).max()))
        if step < tol:
            return b
        last = step
    return b if step < 1e-13 else None


def solve_load(sec, L, load):
    t, dt, b, db = 0.0, .1, np.zeros(6, LD), None
    while t < 1:
        dt = min(dt, 1 - t)
        guess = b if db is None else b + db * dt
        new = newton(lambda x: end_residual(sec, L, load, LD(t + dt), x), guess, its=6)
        big = max(1., float(np.abs(b).max()))
        if new is None or np.abs(new - guess).max() > .25 * big:
            dt /= 2
            assert dt > 1e-4
            continue
        db = (new - b) / dt
        b, t = new, t + dt
        dt *= 1.3
    return newton(lambda x: end_residual(sec, L, load, LD(1), x), b)


def loads():
    S = sections()
    D = lambda F, C: {'follower': False, 'force': F, 'couple': C}
    W = lambda F, C: {'follower': True, 'force': F, 'couple': C}
    cases = [('sample', D([1., -2., .5], [.3, .2, -.8]), 1), ('sample', D([0, 3, -1.], [0, 0, 0]), 1), ('sample', D([6, -9, -4], [1, -1, 2]), 1),
             ('sample', D([0, 0, 0], [2, -1.5, 1]), 1), ('equal bending', D([0, 4., 0], [0, 0, 3]), 1), ('curved rest', D([2, 1, -3], [.5, 0, -.5]), 1),
             ('coupled', D([3, -2, -5], [.4, -.6, .2]), 1), ('rigid shear and axial', D([1, -2, .5], [.3, .2, -.8]), 1),
             ('rigid shear and axial', D([15, 20, -10], [0, 0, 0]), 1), ('tapered', D([1, 2, 3], [-.5, .5, 1]), 1), ('sample', D([.8, 1.1, -.7], [0, .3, .1]), 2),
             ('sample', W([1, -2, .5], [.3, .2, -.8]), 1), ('equal bending', W([6, 0, -3], [0, 0, 1]), 1), ('curved rest', W([-2, 3, -4], [.5, .2, .3]), 1),
             ('coupled, curved rest', W([2, 2, -1], [-.3, 1, .5]), 1), ('rigid shear and axial', W([4, 2, -3], [0, .5, 1]), 1)]
    rows, worst = [], 0
    for name, load, L in cases:
        sec = S[name]
        b = solve_load(sec, L, load)
        A = shoot(sec, b, L)
        rng = np.random.default_rng(5)
        b2 = newton(lambda x: end_residual(sec, L, load, LD(1), x, 'B'), b + 1e-3 * rng.standard_normal(6))
        B = shoot(sec, b2, L, 'B')
        g = max(gap(b, b2), gap(A['R'], B['R']), gap(A['r'], B['r']), gap(A['U'], B['U']))
        assert g < 1e-13, (name, g)
        worst = max(worst, g)
        rows.append({'name': name, 'section': sec.json(), 'length': L, 'end': load, 'position': fl(A['r']), 'quaternion': fl(quaternion(A['R'])),
                     'base_force': fl(b[3:]), 'base_couple': fl(b[:3]), 'tip_force': fl(b[3:]), 'tip_couple': fl(b[:3] - cross(A['r'], b[3:])),
                     'energy': float(A['U']), 'gap': g})
        print(name, load, g)
    dump('rod_loads.json', CONVENTIONS + 'End loads: force n(L) and couple m(L), world frame, or director frame at the end (follower). '
         'The solution is the one reached from zero by raising the load proportionally. base_*, tip_* in the world frame. '
         'Newton by two routes (as in rod_ivp.json) from different starts; worst gap %.1e. tools/rod_reference.py' % worst, rows)


def held():
    S = sections()
    pose = [('sample', [.5, -.3, .2, 1, -2, .5], 1), ('sample', [2, -1.5, 1, 6, 4, -9], 1), ('equal bending', [1, 2, 3, -4, 5, -12], 1),
            ('curved rest', [-1, 2, 1, 4, -6, 3], 1), ('coupled', [1, .5, -2, 3, -4, 8], 1), ('coupled, curved rest', [1, -1, .5, -3, 5, 2], 1),
            ('rigid shear and axial', [3, -2, .5, 8, -4, 6], 1), ('rigid shear and axial', [2, 4, -2, -15, 10, 20], 1),
            ('rigid shear', [-1, 2, 1, 3, 5, -6], 1), ('tapered, coupled', [-1, 2, 1, -5, 3, 4], 1), ('sample', [.4, .7, -.2, .3, -.5, 1], 2)]
    ball = [('sample', [1, -2, .5], 1), ('sample', [6, 4, -9], 1), ('coupled', [4, -3, 2], 1), ('rigid shear and axial', [-7, 5, -6], 1),
            ('curved rest', [2, 3, -4], 1), ('tapered', [3, -3, 1], 1)]
    rows, worst = [], 0

    def add(name, kind, b, L):
        sec = S[name]
        A, B = shoot(sec, b, L), shoot(sec, b, L, 'B')
        g = max(gap(A[k], B[k]) for k in ('R', 'r', 'U', 'T'))
        assert g < 1e-14, (name, g)
        b = np.asarray(b, LD)
        m = b[:3] - cross(A['r'], b[3:])
        if kind == 'ball':
            assert np.abs(m).max() < 1e-15 * np.abs(b).max()
            m = 0 * m
            J = end_residual(sec, L, {'force': [0] * 3, 'couple': [0] * 3, 'follower': False}, LD(0), b)[1][:3].astype(float)
            Z = np.linalg.svd(J)[2][3:].T
            cond = np.linalg.cond(A['T'].astype(float)[3:] @ Z)
        else:
            cond = np.linalg.cond(A['T'].astype(float))
        row = {'name': name, 'kind': kind, 'section': sec.json(), 'length': L, 'position': fl(A['r'])}
        if kind == 'pose':
            row['quaternion'] = fl(quaternion(A['R']))
        row.update({'base_couple': fl(b[:3]), 'base_force': fl(b[3:]), 'tip_couple': fl(m), 'energy': float(A['U']),
                    'condition': float('%.3g' % cond), 'gap': g})
        if kind == 'ball':
            row['quaternion_of_solution'] = fl(quaternion(A['R']))
        rows.append(row)
        print(name, kind, g, cond)
        return g
    for name, b, L in pose:
        worst = max(worst, add(name, 'pose', b, L))
    for name, n, L in ball:
        b = solve_load(S[name], L, {'follower': False, 'force': n, 'couple': [0, 0, 0]})
        b[3:] = n
        worst = max(worst, add(name, 'ball', b, L))
    dump('rod_held.json', CONVENTIONS + 'Held ends: pose (position and quaternion given) and ball joint (position given, couple m(L) = 0). The wrench was chosen first, '
         'so the stored equilibrium is one of possibly several. condition: of d(phi, r)/db (pose) or of d r / d n along m(L) = 0 (ball). '
         'Two routes as in rod_ivp.json, worst gap %.1e. tools/rod_reference.py' % worst, rows)


if __name__ == '__main__':
    import sys
    for part in sys.argv[1:] or ['ivp', 'loads', 'held']:
        {'ivp': ivp, 'loads': loads, 'held': held}[part]()
