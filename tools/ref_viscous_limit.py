#!/usr/bin/env python3
"""Writes tests/data/viscous_limit.json: planar Kelvin-Voigt rods of small viscosity against the elastic run of snap_run.json,
and through the three snaps of scenes/three_snaps.toml.  Mathematics and integrator in ref_viscous_core.py."""
import json
import os
from concurrent.futures import ThreadPoolExecutor
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from ref_viscous_core import *
from ref_viscous_elastica import strain

DATA = os.path.join(HERE, '..', 'tests', 'data')
ETAS = ['1e-2', '3e-3', '1e-3', '3e-4', '1e-4']
TIMES = ['0.02', '0.1', '0.3']
START = strain('6.3', '0.6')
KEYS = ('r', 'v', 'U', 'dissipated', 'n1')
THREE = dict(lam='1.923538', kap='0.7583543', dead=('-3.7', '0'), drag='8', amplitude=('0', '55.7'))
THREE_TIMES = ['3', '5.3', '5.6', '6', '7', '9.5', '9.75', '10.25', '11.5', '13.7', '13.9', '14.4', '15']
THREE_ETAS = ['1e-2', '3e-3', '1e-3', '3e-4']


def snap(eta):
    c = Case(START, ('0', '-0.5'), eta)
    a = c.run(48, '1e-15', TIMES)
    b = c.run(32, '1e-15', TIMES)
    h = c.run(48, '1e-13', TIMES)
    acc = {'nodes_32': gap(a, b, KEYS), 'tolerance_1e-13': gap(a, h, KEYS), 'balance': max(abs(float(r['balance'])) for r in a), 'pose_gap': max(float(r['pose_gap']) for r in a)}
    print(eta, json.dumps(acc), flush=True)
    return a, acc


def three(eta):
    c = Case(strain(THREE['lam'], THREE['kap']), ('0', '0'), eta, dead=THREE['dead'], drag=THREE['drag'], amplitude=THREE['amplitude'], omega=2 * np.arccos(LD(-1)) * LD('0.119'))
    a = c.run(40, '1e-12', THREE_TIMES)
    b = c.run(32, '1e-11', THREE_TIMES)
    acc = {'gap': gap(a, b, KEYS), 'balance': max(abs(float(r['balance'])) for r in a)}
    print('three', eta, json.dumps(acc), flush=True)
    return a, acc


def orders(err):
    e = list(map(float, ETAS))
    return [float(np.log(err[i] / err[i + 1]) / np.log(e[i] / e[i + 1])) for i in range(len(err) - 1)]


def write(doc):
    def rows(x):
        return '[\n' + ',\n'.join(json.dumps(r) for r in x) + '\n]'
    with open(os.path.join(DATA, 'viscous_limit.json'), 'w') as f:
        f.write('{\n' + ',\n'.join('%s: %s' % (json.dumps(k), rows(v) if isinstance(v, list) and v and isinstance(v[0], dict) else json.dumps(v)) for k, v in doc.items()) + '\n}\n')


def main():
    ref = json.load(open(os.path.join(DATA, 'snap_run.json')))
    elastic = {float(r['t']): r for r in ref['rows']}
    table = small_table(ref)
    with ThreadPoolExecutor(2) as ex:
        runs = list(ex.map(snap, ETAS[::-1]))[::-1]
    rows = []
    for eta, (a, acc) in zip(ETAS, runs):
        delay = table['delay'][SMALL.index(eta)]
        rows.append({'eta': float(eta), 't_peak': table['t_fold'] + delay, 'delay': delay, 'samples': [{k: num(x[k]) for k in ('t', 'r', 'v', 'U', 'dissipated', 'n1', 'G_min')} for x in a], 'accuracy': acc})
    obs = {}
    at = lambda i: np.array([np.array([*a[i]['r'], *a[i]['v']], dtype=float) for a, _ in runs])
    for i, t in enumerate(TIMES):
        key = float(t)
        if key in elastic:
            x = np.array([float(elastic[key][k]) for k in ('x', 'y', 'vx', 'vy')])
        else:
            x = np.array(table['elastic_0.02'])
        err = np.abs(at(i) - x)
        obs['t=' + t] = {'elastic': x.tolist(), 'error_r': np.hypot(err[:, 0], err[:, 1]).tolist(), 'order_r': orders(np.hypot(err[:, 0], err[:, 1])),
                         'error_v': np.hypot(err[:, 2], err[:, 3]).tolist(), 'order_v': orders(np.hypot(err[:, 2], err[:, 3]))}
    obs['dissipated_minus_released'] = [float(a[1]['dissipated']) - float(ref['released']) for a, _ in runs]
    print(json.dumps(obs, indent=1))
    doc = {'recipe': "tools/ref_viscous_limit.py. Planar inextensible rod, length = EI = mu = 1, m = theta' + eta theta'_t. rows: start equilibrium lambda = 6.3, kappa = 0.6 "
           "(theta' = 2 lam kap kap' sd(lam (1-s))), v = (0, -0.5), no load: the start of snap_run.json. t_peak: time of the largest rate of dissipation; delay = t_peak - time of the fold of the elastic run. "
           "samples: r, v, U = int theta'^2/2, dissipated, n1 force of the mass on the end, G_min smallest eigenvalue of int q q^T. accuracy: gaps relative to 1 + |value| of 48 against 32 nodes, tolerance 1e-15 against 1e-13. "
           "observed: errors against the elastic run (t = 0.02: integrated in the chart of the amplitude here; later: snap_run.json), orders between neighbours in eta. "
           "three_snaps: the viscous runs of scenes/three_snaps.toml (lambda = 1.923538, kappa = 0.7583543, dead load (-3.7, 0), drag 8, force 55.7 sin(2 pi 0.119 t) along y). "
           "Trust: samples 12 digits after the point (n1 relative to its size), t_peak 10, small_eta 8 relative digits, three_snaps 8.",
           'observed': obs, 'small_eta': table, 'rows': rows}
    write(doc)
    with ThreadPoolExecutor(2) as ex:
        th = list(ex.map(three, THREE_ETAS[::-1]))[::-1]
    doc['three_snaps'] = [{'eta': float(eta), 'accuracy': acc, 'samples': [{k: num(x[k], 13) for k in ('t', 'r', 'v', 'U', 'dissipated')} for x in a]} for eta, (a, acc) in zip(THREE_ETAS, th)]
    write(doc)


def chart(p, w, n=60):
    """lam, alpha, pose and its Jacobian in the chart of the amplitude, integrals by Gauss quadrature."""
    x, g = np.polynomial.legendre.leggauss(n)
    k, kp = np.tanh(p), 1 / np.cosh(p)
    t = (x + 1) * w / 2
    D = np.sqrt(kp ** 2 + k ** 2 * np.sin(t) ** 2)
    q = g * w / 2
    lam, B, dE = q @ (1 / D), q @ (np.sin(t) ** 2 / D), q @ D
    s, c = np.sin(w), np.cos(w)
    Dw = np.hypot(kp, k * s)
    al = -2 * np.arctan2(k * c, Dw)
    X, Y = 2 * dE / lam - 1, 2 * k * s / lam
    lam_p, lam_w, dE_p, dE_w = k * B + k * c * s / Dw, 1 / Dw, -kp ** 2 * k * (lam - B), Dw
    al_p, al_w = -2 * kp ** 2 * c / Dw, 2 * k * s / Dw
    d = []
    for l, e, a, ky in ((lam_p, dE_p, al_p, kp ** 2 * s), (lam_w, dE_w, al_w, k * c)):
        Xd, Yd = 2 * e / lam - 2 * dE * l / lam ** 2, 2 * ky / lam - Y * l / lam
        d.append(np.array([Xd * np.cos(al) - Y * a * np.cos(al) - (Yd + X * a) * np.sin(al), Xd * np.sin(al) - Y * a * np.sin(al) + (Yd + X * a) * np.cos(al)]))
    return lam, al, np.array([X * np.cos(al) - Y * np.sin(al), X * np.sin(al) + Y * np.cos(al)]), np.array(d).T


def sheet(t_end=0.02, n=60):
    """r, v of the elastic run: state (p, w, v), DOP853 at 1e-13."""
    def rhs(t, z):
        lam, al, _, J = chart(z[0], z[1], n)
        return [*np.linalg.solve(J, z[2:]), lam ** 2 * np.cos(al), lam ** 2 * np.sin(al)]
    p0 = np.arctanh(0.6)
    w0 = brentq(lambda w: chart(p0, w, n)[0] - 6.3, 3, 9, xtol=1e-15)
    z = solve_ivp(rhs, (0, t_end), [p0, w0, 0, -0.5], method='DOP853', rtol=1e-13, atol=1e-14).y[:, -1]
    return [*chart(z[0], z[1], n)[2], *z[2:]]


def coefficient(ref):
    """Leading coefficient c of the delay c eta^(2/3).  Along the null direction q0 + xi t0 of the chart (Dr t0 = 0) the strains change by xi h,
    and eta M xi' = -(a.v (t - t_fold) + b xi^2 / 2), M = int h^2, a = -D(force on the mass) t0, b = -a.D^2 r[t0, t0]
    (the equilibria near the fold are the zeros of the right side).  Riccati: blow-up at Omega (2 M^2 / (a.v b))^(1/3) eta^(2/3), Omega = 2.338107 the first zero of Ai(-x)."""
    f = ref['fold']
    p = float(f['p'])
    w = brentq(lambda w: chart(p, w)[0] - float(f['lam']), 3, 9, xtol=1e-15)
    J = chart(p, w)[3]
    t0 = np.linalg.svd(J)[2][1]
    h = 1e-3
    at = lambda x: chart(p + x * t0[0], w + x * t0[1])
    force = lambda c: c[0] ** 2 * np.array([np.cos(c[1]), np.sin(c[1])])
    d1 = lambda g: (8 * (g(h) - g(-h)) - (g(2 * h) - g(-2 * h))) / (12 * h)
    d2 = lambda g: (16 * (g(h) + g(-h)) - (g(2 * h) + g(-2 * h)) - 30 * g(0)) / (12 * h * h)
    a = -d1(lambda x: force(at(x)))
    b = -a @ d2(lambda x: at(x)[2])
    s, g = gauss(32)[:2]
    u = lambda x: strain(repr(float(at(x)[0])), repr(float(np.tanh(p + x * t0[0]))))(s).astype(float)
    M = float(g.astype(float) @ d1(u) ** 2)
    av = a @ np.array([float(f['vx']), float(f['vy'])])
    print('coefficient: det', np.linalg.det(J), 'a.v b', av * b)
    return 2.3381074104597674 * (2 * M * M / (av * b)) ** (1 / 3)


SMALL = ['1e-2', '3e-3', '1e-3', '3e-4', '1e-4', '3e-5', '1e-5', '3e-6']


def small(eta):
    """Errors at t = 0.01, 0.02 against the elastic run, and the time of the largest rate of dissipation."""
    c = Case(START, ('0', '-0.5'), eta)
    a = c.run(32, '1e-14', ['0.01', '0.02'])
    e = float(eta)
    guess = 0.02557 + 2.25 * e ** (2 / 3) * (0.5 if e > 5e-3 else 1)
    n = 120
    lo, hi = 0.0257, 0.0257 + 1.6 * (guess - 0.0257)
    rows = c.run(24, '1e-9', [lo + (hi - lo) * k / n for k in range(n + 1)])
    for _ in range(2):
        k = int(np.argmax([x['rate'] for x in rows]))
        mid, step = float(rows[k]['t']), float(rows[1]['t'] - rows[0]['t'])
        rows = c.run(32, '1e-13', [mid + 2 * step * (i / 12) for i in range(-12, 13)])
    x = np.array([float(r['t']) for r in rows])
    d = np.polynomial.Chebyshev.fit(x - mid, [float(r['rate']) for r in rows], 12)
    z = [y.real for y in d.deriv().roots() if abs(y.imag) < 1e-12 and abs(y.real) <= 2 * step]
    t = mid + max(z, key=d)
    err = []
    for r, el in zip(a, (sheet(0.01), sheet(0.02))):
        q = np.array([*r['r'], *r['v']], dtype=float) - el
        err += [float(np.hypot(q[0], q[1])), float(np.hypot(q[2], q[3]))]
    print('small', eta, err, t, flush=True)
    return err, t


def small_table(ref):
    e = np.array(list(map(float, SMALL)))
    with ThreadPoolExecutor(2) as ex:
        res = list(ex.map(small, SMALL[::-1]))[::-1]
    tf, c = float(ref['fold']['t']), coefficient(ref)
    val = np.array([[*err, t - tf] for err, t in res])
    o = np.log(val[:-1] / val[1:]) / np.log(e[:-1] / e[1:])[:, None]
    names = ['error_r_0.01', 'error_v_0.01', 'error_r_0.02', 'error_v_0.02', 'delay']
    A = np.column_stack([e ** (2 / 3), e, e * np.log(e), e ** (4 / 3)])[3:]
    fit = np.linalg.lstsq(A / A[:, :1], val[3:, 4] / A[:, 0], rcond=None)[0]
    out = {'about': 'errors of r and v on the sheet at t = 0.01 and 0.02 against the elastic run integrated in the chart; delay = t_peak - t_fold. Expected orders: 1 on the sheet, 2/3 for the delay. '
                    'delay_coefficient: c of delay ~ c eta^(2/3) from the normal form of the fold; delay_coefficient_fitted: from c eta^(2/3) + eta (b + d log eta) + f eta^(4/3) through the five smallest eta',
           'elastic_0.01': sheet(0.01), 'elastic_0.02': sheet(0.02), 't_fold': tf, 'delay_coefficient': c, 'delay_coefficient_fitted': float(fit[0]), 'eta': e.tolist()}
    out.update({k: val[:, i].tolist() for i, k in enumerate(names)})
    out['orders'] = {k: o[:, i].tolist() for i, k in enumerate(names)}
    out['delay_over_eta_2_3'] = (val[:, 4] / e ** (2 / 3)).tolist()
    print(json.dumps(out, indent=1))
    return out


if __name__ == '__main__':
    print('chart, two quadratures', np.max(np.abs(np.array(sheet()) - sheet(n=40))), flush=True)
    main()
