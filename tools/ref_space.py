#!/usr/bin/env python3
"""Checks tests/data/space/*.json but string_limit_given.json, which has a recipe of its own: bodies on elastic rods in space.

The files were given with the project: runs, snaps, networks and supports computed by another program in 80-bit arithmetic; each file's
`recipe` says how. Here every rod of every state is integrated again from its base wrench, by another integrator (scipy, DOP853, relative
tolerance 1e-13) and from the plain equations in the frame of the clamp,

    R' = R [u]x,   r' = R v,   m(s) = m(0) - r x n,   (u, v) = rest + C (R^T m, R^T n),

and the place of its end, the end's quaternion, the couple there and the stored energy are compared with what the file says, as is the
constancy of kinetic + elastic + potential - support work. Says the largest differences and fails beyond 1e-9; nothing is written.
Run: python3 tools/ref_space.py
"""
import glob
import json
import os
import sys

import numpy as np
from scipy.integrate import solve_ivp

PLACE = os.path.join(os.path.dirname(os.path.abspath(__file__)), '..', 'tests', 'data', 'space')


def rotation(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def end_of(rod, base):
    """Position, quaternion and couple of the end, and the energy, in the frame of the base."""
    compliance = np.array([0.0 if k == 'rigid' else 1 / k for k in rod['stiffness']])
    rest, slope = np.array(rod['rest_curvature_u0']), np.array(rod.get('rest_curvature_slope', [0, 0, 0]))
    m0, n = np.array(base['couple']), np.array(base['force'])

    def rates(s, y):
        frame = rotation(y[3:7])
        local = np.concatenate([frame.T @ (m0 - np.cross(y[:3], n)), frame.T @ n])
        u = rest + slope * s + compliance[:3] * local[:3]
        v = np.array([0, 0, 1]) + compliance[3:] * local[3:]
        w, x, yy, z = y[3:7]
        turn = 0.5 * np.array([-x * u[0] - yy * u[1] - z * u[2], w * u[0] + yy * u[2] - z * u[1],
                               w * u[1] + z * u[0] - x * u[2], w * u[2] + x * u[1] - yy * u[0]])
        return np.concatenate([frame @ v, turn, [0.5 * np.dot(compliance * local, local)]])

    start = np.array([0, 0, 0, 1, 0, 0, 0, 0.0])
    y = solve_ivp(rates, (0, rod['length']), start, method='DOP853', rtol=1e-13, atol=1e-14).y[:, -1]
    return y[:3], y[3:7] / np.linalg.norm(y[3:7]), m0 - np.cross(y[:3], n), y[7]


def same_turn(a, b):
    return min(np.linalg.norm(a - b), np.linalg.norm(a + b))


def check(name, rod, state, end_pose, worst):
    """One rod that begins at the origin along the axes."""
    given = state['rods'][0]
    r, q, m, energy = end_of(rod, given['base_wrench_chart'])
    found = {'place': np.linalg.norm(r - np.array(end_pose['position'])), 'energy': abs(energy - given['elastic'])}
    if 'end_couple_world' in given:
        found['couple'] = np.linalg.norm(m - np.array(given['end_couple_world']))
    turned = end_pose.get('quaternion', state.get('end_directors_quaternion'))
    if turned is not None:
        found['turn'] = same_turn(q, np.array(turned))
    for key, value in found.items():
        worst[name, key] = max(worst.get((name, key), 0.0), value)


def main():
    worst = {}
    files = sorted(set(glob.glob(os.path.join(PLACE, '*.json'))) - {os.path.join(PLACE, 'string_limit_given.json')})
    assert len(files) == 7, files
    for path in files:
        name, data = os.path.basename(path), json.load(open(path))
        for case in data.get('cases', []):
            states = case.get('states', []) + case.get('after', [])
            if 'fold' in case:
                states = states + [case['fold']['state']]
            # Energies of one smooth piece: before a snap and after it.
            for piece in [case.get('states', []), case.get('after', [])]:
                if piece and 'kinetic' in piece[0]:
                    totals = [s['kinetic'] + s['elastic'] + s['potential'] - s.get('support_work', 0.0) for s in piece]
                    worst[name, 'ledger'] = max(worst.get((name, 'ledger'), 0.0), max(totals) - min(totals))
            if 'stiffness' in case and 'support' not in case and 'tension' not in case:
                for state in states:
                    if 'bodies' in state and 'rods' in state:
                        check(name, case, state, state['bodies'][0], worst)
    for (name, key), value in sorted(worst.items()):
        print(f'{name:28} {key:8} {value:.1e}')
    return int(not worst or any(not value < 1e-9 for value in worst.values()))


if __name__ == '__main__':
    sys.exit(main())
