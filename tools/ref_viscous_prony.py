#!/usr/bin/env python3
"""Writes tests/data/viscous_prony.json: planar Kelvin-Voigt rod with two Maxwell branches, released after a long hold (delayed snap).
Mathematics and integrator in ref_viscous_core.py.  Static thresholds by shooting from the free end with the variational equation (DOP853, 1e-13)."""
import json
import os
from concurrent.futures import ThreadPoolExecutor
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve, minimize_scalar
from ref_viscous_core import *
from ref_viscous_elastica import strain

OUT = os.path.join(HERE, '..', 'tests', 'data', 'viscous_prony.json')
LAM, KAP, ETA, E, TAU, P = '2', '-0.8024065', '0.02', ('0.5', '0.8'), ('0.3', '3'), '4'
FS = ['2', '2.25', '2.5', '3', '3.5']
MAIN = '2.5'
START = strain(LAM, KAP)
KEYS = ('r', 'v', 'U', 'branches', 'dissipated', 'n1', 'strain')


def case(f, branches=True):
    return Case(START, ('0', '0'), ETA, E=E if branches else (), tau=TAU if branches else (), dead=('-' + P, f))


def threshold(frozen):
    """Transverse load f at which the equilibrium buckled down ends; frozen: branches held at the strains of the start."""
    kap, Es = float(KAP), sum(map(float, E)) if frozen else 0.0
    P0 = float(P)

    def residual(x):
        f, tip = x
        def rhs(s, y):          # backwards from the tip: th, th', d/dtip of both, start: th0, th0'
            th, k, a, b, th0, k0 = y
            m = -(f * np.cos(th) + P0 * np.sin(th))
            dm = -(-f * np.sin(th) + P0 * np.cos(th))
            k0s = -4 * np.sin(th0)
            return [-k, -(m + Es * k0s) / (1 + Es), -b, -dm * a / (1 + Es), -k0, -k0s]
        y = solve_ivp(rhs, (0, 1), [tip, 0, 1, 0, 2 * np.arcsin(kap), 0], method='DOP853', rtol=1e-13, atol=1e-14).y[:, -1]
        assert abs(y[4]) < 1e-6          # the start is clamped
        return [y[0], y[2]]
    best = None
    for f0 in (1.5, 2, 2.5, 3, 4, 5, 6):
        for t0 in (-1.8, -1.5, -1.2, -0.9):
            x, _, ok, _ = fsolve(residual, [f0, t0], xtol=1e-13, full_output=True)
            if ok == 1 and x[0] > 0 and -2.2 < x[1] < 0 and max(map(abs, residual(x))) < 1e-11 and (best is None or x[0] < best[0]):
                best = x
    return best


def peak(c, n, tol, end):
    """Time and size of the largest rate of dissipation, and the time of y = 0 (first)."""
    coarse = [0.05 * k for k in range(1, int(end / 0.05) + 1)]
    o = c.run(n, '1e-9', coarse, hmax=0.5)
    k = int(np.argmax([x['rate'] for x in o]))
    j = next(i for i, x in enumerate(o) if x['r'][1] > 0)
    grid = lambda mid: [mid + 0.005 * i for i in range(-10, 11)]
    ts = sorted(set(grid(coarse[k]) + grid(coarse[j])))
    o = c.run(n, tol, ts, hmax=0.5)
    val = {float(x['t']): x for x in o}

    def poly(mid, g):
        t = np.array(grid(mid)) - mid
        return np.polynomial.Chebyshev.fit(t, [float(g(val[float(LD(mid + x))])) if float(LD(mid + x)) in val else float(g(min(o, key=lambda r: abs(float(r['t']) - mid - x)))) for x in t], 14)
    p = poly(coarse[k], lambda r: r['rate'])
    dp = p.deriv()
    x = [z.real for z in dp.roots() if abs(z.imag) < 1e-9 and abs(z.real) <= 0.05 and dp.deriv()(z.real) < 0]
    x = max(x, key=p)
    q = poly(coarse[j], lambda r: r['r'][1])
    z = [z.real for z in q.roots() if abs(z.imag) < 1e-9 and abs(z.real) <= 0.0501]
    z = min(z)
    return coarse[k] + x, float(p(x)), coarse[j] + z


def main():
    fc, ff = threshold(False), threshold(True)
    print('thresholds', fc, ff, flush=True)
    end = lambda f: {'2': 40, '2.25': 20, '2.5': 16}.get(f, 10)
    with ThreadPoolExecutor(2) as ex:
        hi = [ex.submit(peak, case(f), 32, '1e-15', end(f)) for f in FS]
        lo = [ex.submit(peak, case(f), 24, '1e-13', end(f)) for f in FS]
        pure = [ex.submit(peak, case(f, False), 24, '1e-14', 12) for f in FS]
        ts = ['%g' % (0.5 * k) for k in range(1, 41)]
        a, b, h = [ex.submit(case(MAIN).run, n, tol, ts, 0.5) for n, tol in ((32, '1e-16'), (48, '1e-15'), (32, '1e-14'))]
        a, b, h = a.result(), b.result(), h.result()
        hi, lo, pure = [[x.result() for x in l] for l in (hi, lo, pure)]
    acc = {'nodes': 32, 'nodes_48': gap(a, b, KEYS), 'tolerance_1e-14': gap(a, h, KEYS), 'balance': max(abs(float(x['balance'])) for x in a), 'pose_gap': max(float(x['pose_gap']) for x in a)}
    print(json.dumps(acc, indent=1))
    delays = []
    for f, x, y, p in zip(FS, hi, lo, pure):
        delays.append({'f': float(f), 't_peak': x[0], 'rate_peak': x[1], 't_crossing': x[2], 'gap': [abs(i - j) for i, j in zip(x, y)], 't_peak_without_branches': p[0], 't_crossing_without_branches': p[2]})
        print(delays[-1])
    rows = [{k: num(x[k]) for k in ('t', 'r', 'v', 'U', 'branches', 'dissipated', 'n1', 'strain', 'z', 'work', 'rate', 'G_min')} for x in a]
    recipe = ("tools/ref_viscous_prony.py. Planar inextensible rod, length = EI = mu = 1, clamp at the origin along +x, point mass on an end free to turn, "
              "m = theta' + eta theta'_t + sum E_k (theta' - z_k), z_k' = (theta' - z_k)/tau_k. Held for a long time at the equilibrium lambda = 2, kappa = -0.8024065 (alpha = 0: dead load (-4, 0), buckled down): "
              "start theta' of that equilibrium (theta' = 2 lam kap kap' sd(lam (1-s))), z_k = theta', v = 0. From t = 0 the dead load on the mass is (-4, f). "
              "threshold: f at which the equilibrium buckled down ends, relaxed branches (z = theta') and frozen branches (z = start); between the two the snap is delayed (pseudo-bistability). tip: theta(1) there. "
              "delays: t_peak, time of the largest rate of dissipation rate_peak = int eta theta'_t^2 + sum E_k (theta' - z_k)^2/tau_k; t_crossing: first time of y = 0; gap: 32 nodes, tolerance 1e-15 against 24 nodes, 1e-13; "
              "without_branches: the same rod with E = 0. rows: run f = 2.5; U = int theta'^2/2, branches = sum E_k int (theta' - z_k)^2/2, n1 force of the mass on the end, strain and z (one list for each branch) at s = 0, 0.25, 0.5, 0.75, 1; "
              "work of the dead load from t = 0. accuracy: gaps relative to 1 + |value| to other node count and tolerance; balance: |kinetic + U + branches + dissipated - work - start|. "
              "Trust: rows 12 digits after the point, t_peak 8, t_crossing 9, thresholds 10.")
    with open(OUT, 'w') as fh:
        doc = {'recipe': recipe, 'lambda': float(LAM), 'kappa': float(KAP), 'eta': float(ETA), 'E': [float(x) for x in E], 'tau': [float(x) for x in TAU], 'dead_x': -float(P), 'f_of_rows': float(MAIN),
               'threshold': {'relaxed': fc[0], 'relaxed_tip': fc[1], 'frozen': ff[0], 'frozen_tip': ff[1]}, 'accuracy': acc}
        fh.write('{\n' + ',\n'.join('%s: %s' % (json.dumps(k), json.dumps(v)) for k, v in doc.items()))
        fh.write(',\n"delays": [\n%s\n],\n"rows": [\n%s\n]}\n' % (',\n'.join(map(json.dumps, delays)), ',\n'.join(map(json.dumps, rows))))


if __name__ == '__main__':
    main()
