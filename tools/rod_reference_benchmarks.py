"""Benchmarks B5, B6, B7, B9, B10, B11 for rod_reference_branch.py, every input stated, each by two routes."""
import numpy as np
import mpmath as mp
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from rod_reference_core import *
from rod_reference import solve_load, newton, end_residual

mp.mp.dps = 40
PI = 4 * np.arctan(LD(1))


def q(*a):
    """Product of decimals in extended precision."""
    out = LD(1)
    for x in a:
        out = out * LD(x)
    return out


def ld(x):
    return LD(mp.nstr(x, 25))


def loaded(stiff, L, F, ref, rest=(0, 0, 0)):
    """Dead tip force, no couple; scaled to length 1 and bending stiffness `ref`. stiff: six stiffnesses, None = rigid.
    Routes A and B, Newton from different starts. Returns the tip in the units of L and the difference."""
    k = [LD(1) if x is None else LD(x) / LD(ref) * (1 if i < 3 else LD(L) ** 2) for i, x in enumerate(stiff)]
    sec = Section([float(x) for x in k], rigid=[i for i, x in enumerate(stiff) if x is None])
    sec.C = np.diag([LD(0) if x is None else 1 / y for x, y in zip(stiff, k)])
    sec.rest = np.concatenate([np.asarray(rest, LD) * LD(L), np.array([0, 0, 1], LD)])
    load = {'follower': False, 'force': np.asarray(F, LD) * LD(L) ** 2 / LD(ref), 'couple': [0, 0, 0]}
    b = solve_load(sec, 1, load)
    b2 = newton(lambda x: end_residual(sec, 1, load, LD(1), x, 'B'), b + 1e-3 * np.arange(6))
    rA, rB = shoot(sec, b, 1)['r'] * LD(L), shoot(sec, b2, 1, 'B')['r'] * LD(L)
    return fl(rA), gap(rA, rB)


def b5():
    E, nu, w, h, L = '2.07e11', LD('0.3'), '0.1', '0.5', '2'
    G, ks = LD(E) / (2 * (1 + nu)), 10 * (1 + nu) / (12 + 11 * nu)
    EI, EA, GA, F = q(E, w, h, h, h) / 12, q(E, w, h), G * q(w, h) * ks, q('5e8', h, h, h)
    r, g = loaded([EI, EI, EI, GA, GA, EA], L, [F, 0, 0], EI)
    return {'inputs': {'L': 2, 'w': .1, 'h': .5, 'E': 2.07e11, 'nu': .3, 'ks': '10(1+nu)/(12+11nu)', 'F': float(F), 'EI': float(EI),
                       'EA': float(EA), 'GA': float(GA)}, 'outputs': {'ux': float(2 - LD(r[2])), 'uy': r[0]}, 'gap': g}


def b6():
    L, h, w, E, nu, J = '0.508', '12.3777e-3', '3.2024e-3', '71.7e9', LD('0.31'), '113.407e-12'
    G, A = LD(E) / (2 * (1 + nu)), q(h, w)
    strong, weak, GA, EA, GJ = q(E, w, h, h, h) / 12, q(E, h, w, w, w) / 12, G * A * 5 / 6, LD(E) * A, G * LD(J)
    out = []
    for P, beta in [('8.896', 45), ('8.896', 90), ('13.345', 45)]:
        c, s = (LD(0), LD(1)) if beta == 90 else (np.cos(PI / 4), np.sin(PI / 4))
        r, g = loaded([weak, strong, GJ, GA, GA, EA], L, [LD(P) * c, LD(P) * s, 0], weak)
        out.append({'P': float(P), 'beta_deg': beta, 'minus_uy': r[0], 'uz': r[1], 'ux': r[2] - .508, 'gap': g})
    return {'inputs': {'L': .508, 'h': 12.3777e-3, 'w': 3.2024e-3, 'E': 71.7e9, 'nu': .31, 'J': 113.407e-12, 'ks': 5 / 6, 'GJ': float(GJ),
                       'weak': float(weak), 'strong': float(strong), 'GA': float(GA), 'EA': float(EA),
                       'note': 'u1: weak, u2: strong; force P (cos beta, sin beta, 0), tip = (-u_y, u_z, L + u_x)'}, 'outputs': out}


def b7():
    L, EI, out = 25 * PI, LD('1e7') / 12, []
    x0 = [100 * np.sin(PI / 4), 100 * (1 - np.cos(PI / 4)), LD(0)]
    for tag, GJ, GA, EA in [('GJ = 8.3333e5', LD('833330'), LD('5e6'), LD('1e7')), ('GJ = 1e7/12', EI, LD('5e6'), LD('1e7')),
                            ('unshearable inextensible, GJ = 8.3333e5', LD('833330'), None, None), ('unshearable inextensible, GJ = 1e7/12', EI, None, None)]:
        for F in (300, 600):
            r, g = loaded([EI, EI, GJ, GA, GA, EA], L, [0, F, 0], EI, rest=(0, LD('0.01'), 0))
            tip = [r[2], r[0], r[1]]
            out.append({'law': tag, 'F': F, 'tip': tip, 'displacement': [float(a - b) for a, b in zip(tip, x0)], 'gap': g})
    return {'inputs': {'R': 100, 'angle_deg': 45, 'E': 1e7, 'side': 1, 'EI': float(EI), 'GA': 5e6, 'EA': 1e7,
                       'rest': 'u2 = 1/100 with d3 = x (start tangent), d1 = y (toward the centre), d2 = z; tip in (x, y, z), force along z'}, 'outputs': out}


def shallow(kind, P):
    """F(P) = 1/2 int f'^2 for f'''' + P f'' = 0, f(0) = 0, f'(0) = 1 and the far end of the given kind; mu = F^(-1/2)."""
    k = mp.sqrt(P)
    s, c = mp.sin(k), mp.cos(k)
    last = [0, 0, -k * k * c, -k * k * s] if kind == 'hinged' else [0, 1, -k * s, k * c]
    rhs = [0, 1, 0, -1 if kind == 'symmetric' else 0]
    A, B, C, D = mp.lu_solve(mp.matrix([[1, 0, 1, 0], [0, 1, 0, k], [1, 1, c, s], last]), mp.matrix(rhs))
    half = mp.mpf(1) / 2
    return (B * B + k * k * C * C * (half - mp.sin(2 * k) / (4 * k)) + k * k * D * D * (half + mp.sin(2 * k) / (4 * k))
            + 2 * B * (C * (c - 1) + D * s) - k * C * D * s * s) / 2


def shallow_chebyshev(kind, P, n=32):
    """Same F and dF/dP by collocation in double precision."""
    from numpy.polynomial import chebyshev as ch
    x = np.cos(np.pi * (np.arange(n - 4) + .5) / (n - 4))
    V = lambda t, d: np.stack([ch.chebval(t, ch.chebder(e, d)) * 2 ** d if d else ch.chebval(t, e) for e in np.eye(n)], -1)
    one = np.array([1.])
    M = np.vstack([V(x, 4) + P * V(x, 2), V(-one, 0), V(-one, 1), V(one, 0), V(one, 2 if kind == 'hinged' else 1)])
    f = np.linalg.solve(M, np.concatenate([np.zeros(n - 4), [0, 1, 0, -1. if kind == 'symmetric' else 0.]]))
    g = np.linalg.solve(M, np.concatenate([-V(x, 2) @ f, np.zeros(4)]))
    t, w = np.polynomial.legendre.leggauss(50)
    D1 = V(t, 1)
    return .25 * w @ (D1 @ f) ** 2, .5 * w @ ((D1 @ f) * (D1 @ g))


def b9():
    out = {}
    for kind, guess in [('clamped', 57.55), ('hinged', 36.21), ('symmetric', None)]:
        dF = lambda P: mp.diff(lambda x: shallow(kind, x), P)
        if guess is None:
            xs = [mp.mpf(x) for x in np.arange(60, 150, .5)]
            v = [dF(x) for x in xs]
            guess = next((xs[i] for i in range(1, len(xs)) if v[i - 1] < 0 < v[i] or v[i - 1] > 0 > v[i]), 82)
        P = mp.findroot(dF, (guess - mp.mpf('.1'), guess + mp.mpf('.1')), solver='secant', tol=1e-25)
        PB = brentq(lambda P: shallow_chebyshev(kind, P)[1], float(P) - .3, float(P) + .3, xtol=1e-13, rtol=1e-14)
        mu = 1 / mp.sqrt(shallow(kind, P))
        out[kind] = {'fold_mu': float(mu), 'fold_P': float(P), 'gap_P': abs(PB / float(P) - 1), 'gap_mu': abs(shallow_chebyshev(kind, PB)[0] ** -.5 / float(mu) - 1)}
    x = 2 * mp.findroot(lambda x: mp.tan(x) - x, 4.4934)
    # even part alone (the general system is singular there): f' = -sin(k (x - 1/2)) / sin(k/2)
    even = mp.quad(lambda t: mp.sin(x * (t - mp.mpf(1) / 2)) ** 2, [0, .5, 1]) / mp.sin(x / 2) ** 2 / 2
    out['symmetric_pitchfork'] = {'mu': float(1 / mp.sqrt(even)), 'P': float(x * x)}
    return {'inputs': "y'''' + P y'' = 0, y(0) = y(1) = 0, y'(0) = mu, 1/2 int y'^2 = 1; far end clamped flat, hinged, or (symmetric) y'(1) = -mu", 'outputs': out}


def plane_map(k0, n1, n3):
    """In-plane pose of the unshearable inextensible rod and its 3x3 tangent: rows (spin about y, x, z), columns (m_y, n_x, n_z)."""
    S = shoot(kirchhoff(1, 1, 1), np.array([0, k0, 0, n1, 0, n3], LD), 1)
    i = [1, 3, 5]
    return S, S['T'][np.ix_(i, i)]


def plane_ode(k0, n1, n3):
    """Second route: theta'' = -(cos theta n1 - sin theta n3), x' = sin theta, z' = cos theta with variations, DOP853."""
    def rhs(s, y):
        c, sn = np.cos(y[0]), np.sin(y[0])
        d = np.zeros(16)
        d[:4] = y[1], -(c * n1 - sn * n3), sn, c
        for j, (da, db) in enumerate([(0, 0), (1, 0), (0, 1)]):
            a = y[4 + 4 * j]
            d[4 + 4 * j:8 + 4 * j] = y[5 + 4 * j], (sn * n1 + c * n3) * a - c * da + sn * db, c * a, -sn * a
        return d
    y0 = np.zeros(16)
    y0[1], y0[5] = k0, 1
    return solve_ivp(rhs, (0, 1), y0, method='DOP853', rtol=2.3e-14, atol=1e-15).y[:, -1]


def det3(M):
    return (M[0] * cross(M[1], M[2])).sum()


def fold_system(kind, s, X, route):
    """X = (k0, n1, n3, a) in the clamp's frame, turned by a about y; end at distance 1-s along z of the fixed frame."""
    k0, n1, n3, a = X
    if route == 'A':
        S, T = plane_map(k0, n1, n3)
        R, r = S['R'], S['r']
        th, x, z, tip = np.arctan2(R[0, 2], R[2, 2]), r[0], r[2], k0 - (r[2] * n1 - r[0] * n3)
        dm = np.array([1, 0, 0], LD) - T[2] * n1 + T[1] * n3 - np.array([0, z, -x], LD)
        V = np.vstack([T[0] if kind == 'clamped' else dm, T[1], T[2]])
    else:
        y = plane_ode(k0, n1, n3)
        th, tip, x, z = y[:4]
        W = y[4:].reshape(3, 4).T
        V = np.vstack([W[0] if kind == 'clamped' else W[1], W[2], W[3]])
    one = 1 - s
    return np.array([x + one * np.sin(a), z - one * np.cos(a), th + a if kind == 'clamped' else tip, 100 * det3(V)])


def solve_fold(kind, s, X, route):
    kindof = LD if route == 'A' else float
    X, s = np.array([kindof(x) for x in X]), kindof(s)
    h, best = (1e-9 if route == 'A' else 1e-6), np.inf
    for _ in range(40):
        f = fold_system(kind, s, X, route)
        J = np.array([((fold_system(kind, s, X + h * e, route) - fold_system(kind, s, X - h * e, route)) / (2 * h)).astype(float) for e in np.eye(4)]).T
        step = np.linalg.solve(J, f.astype(float))
        size = np.abs(step).max()
        X = X - step * min(1, 5 / max(size, 1e-30))
        if size < 1e-15 or (size >= best and size < 1e-9):
            break
        best = size
    return X, float(size)


def b10():
    out = []
    for kind, mu, P in [('clamped', 1.78177604, 57.55314), ('hinged', 2.06505638, 36.2114)]:
        k = np.sqrt(P)
        last = [0, 0, -P * np.cos(k), -P * np.sin(k)] if kind == 'hinged' else [0, 1, -k * np.sin(k), k * np.cos(k)]
        B, C = np.linalg.solve(np.array([[1, 0, 1, 0], [0, 1, 0, k], [1, 1, np.cos(k), np.sin(k)], last]), [0, mu, 0, 0])[1:3]
        e = np.sqrt(.01)
        a, k0 = mu * e, -P * C * e
        starts = []
        for nx in (P * B * e, -P * B * e):             # the sign is settled by the residual
            n1, n3 = np.cos(a) * nx + np.sin(a) * P, np.sin(a) * nx - np.cos(a) * P
            starts += [[k0, n1, n3, a]]
        X = min(starts, key=lambda X: np.abs(fold_system(kind, .01, np.array(X), 'B')[:3]).max())
        for s in ['.01', '.02', '.035', '.06', '.1', '.15', '.2', '.25', '.3']:
            X, _ = solve_fold(kind, s, X, 'B')
            if s in ('.01', '.1', '.3'):
                XA, err = solve_fold(kind, s, X, 'A')
                out.append({'far_end': kind, 's': float(s), 'a': float(XA[3]), 'base_couple_y': float(XA[0]), 'n_x_n_z_clamp_frame': fl(XA[1:3]),
                            'gap': abs(float(XA[3]) - float(X[3]))})
                print(out[-1], err, flush=True)
    return {'inputs': 'unshearable inextensible, EI = L = 1; far end at distance 1-s, clamped flat or hinged; one clamp turned by a; fold of a', 'outputs': out}


def b11():
    out = []
    for ratio in ('1.5', '3'):
        lam = mp.sqrt(mp.mpf(ratio)) * mp.pi / 2
        psi0 = lambda k: 2 * mp.asin(-k * mp.ellipfun('cd', lam, m=k * k))
        ks = [mp.mpf(i) / 100 for i in range(1, 100)]
        v = [psi0(k) for k in ks]
        i = max(range(1, 98), key=lambda j: v[j])
        k = mp.findroot(lambda k: mp.diff(psi0, k), (ks[i - 1], ks[i + 1]), solver='anderson', tol=1e-25)

        def couple(x):
            """Route A: d m(1)/d m(0) at fixed n, on the 3-D rod."""
            x = mp.mpf(str(x))
            m = x * x
            p0 = 2 * mp.asin(x * mp.ellipfun('cd', lam, m=m))
            k0, al, l2 = ld(2 * lam * x * mp.sqrt(1 - m) * mp.ellipfun('sd', lam, m=m)), ld(-p0), ld(lam * lam)
            n1, n3 = -l2 * np.sin(al), -l2 * np.cos(al)
            T = plane_map(k0, n1, n3)[1]
            return 1 - T[2][0] * n1 + T[1][0] * n3
        a, b = LD(float(k)) - LD('1e-5'), LD(float(k)) + LD('2e-5')
        fa, fb = couple(a), couple(b)
        for _ in range(8):
            if fa == fb or abs(b - a) < 1e-18:
                break
            a, b, fa = b, b - fb * (b - a) / (fb - fa), fb
            fb = couple(b)
        out.append({'P_over_Pcr': float(ratio), 'phi_deg': float(mp.degrees(psi0(k))), 'tip_deg': float(mp.degrees(2 * mp.asin(k))), 'kap': float(k),
                    'gap': abs(float(k - mp.mpf(str(b))))})
    return {'inputs': 'dead load P at the free end, Pcr = pi^2/4; phi: clamp against the direction in which the load compresses; '
            'psi0 = -2 asin(kap cd(lam)) largest, tip angle 2 asin(kap)', 'outputs': out}
