#!/usr/bin/env python3
"""Writes tests/data/viscous_planar.json: planar Kelvin-Voigt runs, m = theta' + eta theta'_t; mathematics and integrator in ref_viscous_core.py.
Each run with three node counts and two tolerances; the middle node count (32 and 48) with tolerance 1e-16 is written."""
import json
import os
from concurrent.futures import ThreadPoolExecutor
from ref_viscous_core import *

OUT = os.path.join(HERE, '..', 'tests', 'data', 'viscous_planar.json')
TIMES = ['%g' % (k / 10) for k in range(1, 31)]
CASES = {
    'reference': dict(curvature=[1.5, -1.5], velocity=[0, -1], eta=0.1, dead=[0, 0], drag=0, amplitude=[0, 0], angular_frequency=0),
    'loaded': dict(curvature=[1.2, -0.5, 0.3], velocity=[0, 0], eta=0.05, dead=[-8, -2], drag=0.3, amplitude=[0.5, 1], angular_frequency=3),
}
NODES = {'reference': (24, 32, 48), 'loaded': (32, 48, 64)}
PRINTED = {'0.5': (0.9999744861, -0.0059209672, -0.0080141328, -1.0545155174, 7.96215e-5, 0.3188867771),
           '1': (0.8895903812, -0.4148237739, -0.2810004433, -0.4857632144, 0.2846133654, 0.4329230598),
           '3': (0.9100385606, 0.3763304412, -0.0901301852, 0.1757726349, 0.2299558860, 0.6255343792)}


def case(d):
    c = [LD(str(x)) for x in d['curvature']]
    return Case(lambda s: sum(a * s ** k for k, a in enumerate(c)), list(map(str, d['velocity'])), str(d['eta']), dead=list(map(str, d['dead'])),
                drag=str(d['drag']), amplitude=list(map(str, d['amplitude'])), omega=str(d['angular_frequency']))


def main():
    doc = {
        'recipe': "tools/ref_viscous_planar.py. Planar inextensible rod, length = EI = mu = 1, clamp at the origin along +x, m = theta' + eta theta'_t, point mass on an end free to turn. "
                  "Start: theta'(s, 0) = sum curvature[k] s^k, velocity. Force on the mass: dead - drag v + amplitude sin(angular_frequency t). "
                  "Rows: t; r, v of the mass; U = int theta'^2 / 2; dissipated = int int eta theta'_t^2; n1 = force of the mass on the rod's end (the rod acts on the mass with -n1); "
                  "strain = theta' at s = 0, 0.25, 0.5, 0.75, 1; drag_loss = int drag |v|^2; work = int (dead + forcing).v; G_min: smallest eigenvalue of int q q^T (> 0 unless the rod is straight). "
                  "Gauss nodes, long double, Gragg extrapolation of order 16. accuracy: largest gap, relative to 1 + |value|, against runs with other node counts and with tolerance 1e-14 (written: 1e-16); "
                  "balance: largest |kinetic + U + dissipated + drag_loss - work - start|; pose_gap: largest distance of int v dt from the pose of the strains. Trust: r, v, U, dissipated 14 digits after the point; strain 12; n1 11 (while the rod is nearly straight, G_min < 1e-5; 14 otherwise).",
        'runs': []}
    for name, d in CASES.items():
        c = case(d)
        lo, n, hi = NODES[name]
        with ThreadPoolExecutor(2) as ex:
            a, b, h, e = [f.result() for f in [ex.submit(c.run, *k, TIMES) for k in ((n, '1e-16'), (lo, '1e-16'), (n, '1e-14'), (hi, '1e-16'))]]
        acc = {'nodes': n, 'nodes_%d' % lo: gap(a, b), 'nodes_%d' % hi: gap(a, e), 'tolerance_1e-14': gap(a, h), 'balance': max(abs(float(x['balance'])) for x in a), 'pose_gap': max(float(x['pose_gap']) for x in a)}
        print(name, json.dumps(acc, indent=1))
        if name == 'reference':
            bad = max(float(np.max(np.abs(np.array([*x['r'], *x['v'], x['U'], x['dissipated']], dtype=float) - PRINTED['%g' % x['t']]))) for x in a if '%g' % x['t'] in PRINTED)
            print('gap to the printed numbers', bad)
            acc['gap_to_theory_section_5'] = bad
        rows = [{k: num(x[k]) for k in ('t', 'r', 'v', 'U', 'dissipated', 'n1', 'strain', 'drag_loss', 'work', 'G_min')} for x in a]
        doc['runs'].append({'name': name, **d, 'accuracy': acc, 'rows': rows})
    with open(OUT, 'w') as f:
        head = json.dumps(doc['recipe'])
        f.write('{\n"recipe": %s,\n"runs": [\n' % head)
        for i, r in enumerate(doc['runs']):
            meta = {k: v for k, v in r.items() if k != 'rows'}
            f.write('%s,\n"rows": [\n%s\n]}%s\n' % (json.dumps(meta)[:-1], ',\n'.join(json.dumps(x) for x in r['rows']), ',' if i + 1 < len(doc['runs']) else ''))
        f.write(']}\n')


if __name__ == '__main__':
    main()
