#!/usr/bin/env python3
"""Writes tests/data/viscous_space.json: Kelvin-Voigt rods in space, a point mass on a free end and a welded rigid body.

Derivation.  R' = R [u]x, r' = R v; w(s): angular velocity.  Mixed derivatives of R commute: w' = R u_t, and r_t' = w x r' + R v_t.  Integrating by parts with
w(0) = r_t(0) = 0:  w(1) = int R u_t,  r_t(1) = int (R u_t) x (r(1) - r) + R v_t:  V = int Q^T e_t, where Q (m1, n1) = (R^T (m1 + (r(1) - r) x n1), R^T n1)
is the balance of moments and forces.  H e_t = Q w1 - K (e - e0), so  G w1 = V + int Q^T H^-1 K (e - e0),  G = int Q^T H^-1 Q,
a.G a = int |H^-1/2 Q a|^2: Q(s) is invertible for a rod that shears and stretches, so G is SPD; for the unshearable rod with m1 = 0,
Q n = R^T ((r(1) - r) x n) vanishes for all s only if r(1) - r keeps the direction n: the straight rod.
Energy: d/dt int (e - e0).K (e - e0) / 2 = int e_t.(Q w1 - H e_t) = V.w1 - int e_t.H e_t, and the body loses V.w1: (7.3).
Body: mu a_c = -n1 + mu g, d(J w)/dt = -m1 + c x n1, r_c = r(1) + c.

Discretisation: strains at N Gauss nodes; R by collocation, R(s_i) = 1 + sum C_ij R_j [u_j]x (linear, solved densely); DOP853.
Independent pose: strains interpolated to a fine grid, product of exponentials of the fourth-order Magnus step, Richardson.
The welded body is integrated as (rotation of the end, w, r_t(1)) apart from the strains: the gap of the two poses checks (5.3), (5.4)."""
import json
import os
import numpy as np
from scipy.integrate import solve_ivp

HERE = os.path.dirname(os.path.abspath(__file__))
OUT = os.path.join(HERE, '..', 'tests', 'data', 'viscous_space.json')
TIMES = [round(0.1 * k, 1) for k in range(1, 21)]
S_OUT = np.array([0, 0.25, 0.5, 0.75, 1])


def gauss(n):
    x, w = np.polynomial.legendre.leggauss(n)
    P = np.polynomial.legendre.legvander(x, n)
    I = np.column_stack([x + 1] + [(P[:, k + 1] - P[:, k - 1]) / (2 * k + 1) for k in range(1, n)]) / 2
    coef = np.array([(2 * k + 1) / 2 * w * P[:, k] for k in range(n)])
    return (x + 1) / 2, w / 2, I @ coef, lambda s: np.polynomial.legendre.legvander(2 * np.asarray(s) - 1, n - 1) @ coef


def hat(a):
    o = np.zeros(a.shape[:-1] + (3, 3))
    o[..., 0, 1], o[..., 0, 2], o[..., 1, 2] = -a[..., 2], a[..., 1], -a[..., 0]
    return o - np.swapaxes(o, -1, -2)


class Rod:
    def __init__(self, n, K, H, flexible):
        self.n, self.K, self.H, self.Hi, self.fl = n, K, H, np.linalg.inv(H), flexible       # flexible: all 6 strains; otherwise u only
        self.s, self.w, self.C, self.at = gauss(n)

    def shape(self, e):
        """R at the nodes, r at the nodes, R(1), r(1)."""
        n = self.n
        A = hat(e[:, :3])
        # R_i - sum_j C_ij R_j A_j = 1; rows of R: x_i = row, x_i - sum_j C_ij A_j^T x_j = e_k
        M = np.eye(3 * n) - np.einsum('ij,jba->iajb', self.C, A).reshape(3 * n, 3 * n)
        X = np.linalg.solve(M, np.tile(np.eye(3), (n, 1))).reshape(n, 3, 3)                   # X[i, :, k]: row k of R_i
        R = np.swapaxes(X, 1, 2)
        v = e[:, 3:] if self.fl else np.tile([0.0, 0.0, 1.0], (n, 1))
        d = np.einsum('iab,ib->ia', R, v)
        R1 = np.eye(3) + np.einsum('i,iab,ibc->ac', self.w, R, A)
        return R, self.C @ d, R1, self.w @ d

    def wrench(self, e, V):
        """Q, rate e_t, w1 (without m1 for the free end), G."""
        R, r, R1, r1 = self.shape(e)
        Rt = np.swapaxes(R, 1, 2)
        B = Rt @ hat(r1 - r)                       # n -> R^T ((r1 - r) x n)
        if self.fl:
            Q = np.zeros((self.n, 6, 6))
            Q[:, :3, :3], Q[:, :3, 3:], Q[:, 3:, 3:] = Rt, B, Rt
            e0 = np.array([0, 0, 0, 0, 0, 1.0])
        else:
            Q, e0 = B, np.zeros(3)
        f = (e - e0) @ self.K.T
        G = np.einsum('i,iba,bc,icd->ad', self.w, Q, self.Hi, Q)
        b = V + np.einsum('i,iba,bc,ic->a', self.w, Q, self.Hi, f)
        w1 = np.linalg.solve(G, b)
        et = (np.einsum('iab,b->ia', Q, w1) - f) @ self.Hi.T
        return et, w1, G, R1, r1

    def stored(self, e):
        d = e - (np.array([0, 0, 0, 0, 0, 1.0]) if self.fl else 0)
        return 0.5 * self.w @ np.einsum('ia,ab,ib->i', d, self.K, d)

    def dissipation(self, et):
        return self.w @ np.einsum('ia,ab,ib->i', et, self.H, et)

    def magnus(self, e, m):
        """Pose of the end on a grid of m steps from interpolated strains (commutator-free coordinates: se(3) exponentials, order 4)."""
        def tw(x):
            v = x[:, 3:] if self.fl else np.tile([0.0, 0.0, 1.0], (len(x), 1))
            o = np.zeros((len(x), 4, 4))
            o[:, :3, :3], o[:, :3, 3] = hat(x[:, :3]), v
            return o
        h = 1 / m
        g = np.sqrt(3) / 6
        mid = (np.arange(m) + 0.5) * h
        a, b = tw(self.at(mid - g * h) @ e), tw(self.at(mid + g * h) @ e)
        Om = h / 2 * (a + b) + np.sqrt(3) / 12 * h * h * (a @ b - b @ a)      # g' = g A: order of the factors reversed
        E = np.tile(np.eye(4), (m, 1, 1))
        T = E.copy()
        for k in range(1, 14):
            T = T @ Om / k
            E = E + T
        P = np.eye(4)
        for x in E:
            P = P @ x
        return P


def free_end(n, rtol):
    rod = Rod(n, np.diag([1, 1.3, 0.7]), np.diag([0.05, 0.08, 0.04]), False)
    s = rod.s
    e0 = np.column_stack([0.3 + 0.5 * s, 0.8 - 0.6 * s, 0.4 * s])
    load = np.array([0.5, 0, -1.0])
    v0 = np.array([0.2, -0.3, 0])

    def parts(y):
        return y[:3 * n].reshape(n, 3), y[3 * n:3 * n + 3]

    def rhs(t, y):
        e, v = parts(y)
        et, n1, G, R1, r1 = rod.wrench(e, v)
        return np.concatenate([et.ravel(), load - n1, v, [rod.dissipation(et), load @ v]])
    y0 = np.concatenate([e0.ravel(), v0, rod.shape(e0)[3], [0, 0]])
    sol = solve_ivp(rhs, (0, 2), y0, method='DOP853', rtol=rtol, atol=rtol / 10, t_eval=TIMES)
    start = 0.5 * v0 @ v0 + rod.stored(e0)
    rows = []
    for t, y in zip(sol.t, sol.y.T):
        e, v = parts(y)
        et, n1, G, R1, r1 = rod.wrench(e, v)
        q = y[3 * n + 3:]
        a, b = rod.magnus(e, 64), rod.magnus(e, 128)
        P = b + (b - a) / 15
        rows.append({'t': t, 'r': r1, 'v': v, 'n1': n1, 'rotation': R1, 'kinetic': 0.5 * v @ v, 'stored': rod.stored(e), 'dissipated': q[3], 'work': q[4], 'strain': rod.at(S_OUT) @ e,
                     'G_min': np.linalg.eigvalsh(G)[0], 'balance': 0.5 * v @ v + rod.stored(e) + q[3] - q[4] - start, 'pose_gap': np.abs(q[:3] - r1).max(),
                     'magnus_gap': max(np.abs(P[:3, 3] - r1).max(), np.abs(P[:3, :3] - R1).max()), 'orthogonal': np.abs(R1.T @ R1 - np.eye(3)).max(), 'G_symmetry': np.abs(G - G.T).max() / np.abs(G).max(), 'nfev': sol.nfev})
    return rows


def welded(n, rtol):
    K = np.diag([1, 1.3, 0.7, 60, 60, 100.0])
    rod = Rod(n, K, 0.05 * K, True)
    c_dir = np.array([0.1, 0.05, 0.2])
    J = np.array([[0.05, 0.01, 0], [0.01, 0.04, 0], [0, 0, 0.03]])
    g = np.array([0, -1.0, 0])
    e0 = np.tile([0, 0, 0, 0, 0, 1.0], (n, 1))
    V0 = np.array([0.3, -0.2, 0.4, 0.5, 0.2, -0.1])
    N = 6 * n

    def rhs(t, y):
        e, V = y[:N].reshape(n, 6), y[N:N + 6]
        om = V[:3]
        et, w1, G, R1, r1 = rod.wrench(e, V)
        D = y[N + 6:N + 15].reshape(3, 3)
        c, Jw = R1 @ c_dir, R1 @ J @ R1.T
        al = np.linalg.solve(Jw, -w1[:3] + np.cross(c, w1[3:]) - np.cross(om, Jw @ om))
        a = -w1[3:] + g - np.cross(al, c) - np.cross(om, np.cross(om, c))
        vc = V[3:] + np.cross(om, c)
        return np.concatenate([et.ravel(), al, a, (hat(om) @ D).ravel(), V[3:], [rod.dissipation(et), g @ vc]])

    def kinetic(V, R1):
        om, vc = V[:3], V[3:] + np.cross(V[:3], R1 @ c_dir)
        return 0.5 * vc @ vc + 0.5 * om @ (R1 @ J @ R1.T) @ om
    y0 = np.concatenate([e0.ravel(), V0, np.eye(3).ravel(), [0, 0, 1.0], [0, 0]])
    sol = solve_ivp(rhs, (0, 2), y0, method='DOP853', rtol=rtol, atol=rtol / 10, t_eval=TIMES)
    start = kinetic(V0, np.eye(3))
    rows = []
    for t, y in zip(sol.t, sol.y.T):
        e, V = y[:N].reshape(n, 6), y[N:N + 6]
        et, w1, G, R1, r1 = rod.wrench(e, V)
        q = y[N + 6:]
        a, b = rod.magnus(e, 64), rod.magnus(e, 128)
        P = b + (b - a) / 15
        T, U = kinetic(V, R1), rod.stored(e)
        rows.append({'t': t, 'r': r1, 'rotation': R1, 'v': V[3:], 'omega': V[:3], 'm1': w1[:3], 'n1': w1[3:], 'kinetic': T, 'stored': U, 'dissipated': q[12], 'work': q[13], 'strain': rod.at(S_OUT) @ e,
                     'G_min': np.linalg.eigvalsh(G)[0], 'balance': T + U + q[12] - q[13] - start, 'pose_gap': max(np.abs(q[9:12] - r1).max(), np.abs(q[:9].reshape(3, 3) - R1).max()),
                     'magnus_gap': max(np.abs(P[:3, 3] - r1).max(), np.abs(P[:3, :3] - R1).max()), 'orthogonal': np.abs(R1.T @ R1 - np.eye(3)).max(), 'G_symmetry': np.abs(G - G.T).max() / np.abs(G).max(), 'nfev': sol.nfev})
    return rows


def gap(a, b):
    skip = ('t', 'balance', 'pose_gap', 'magnus_gap', 'orthogonal', 'G_symmetry', 'nfev')
    return {k: max(float(np.max(np.abs(np.asarray(x[k]) - y[k]) / (1 + np.abs(x[k])))) for x, y in zip(a, b)) for k in a[0] if k not in skip}


def main():
    RUNS = {
        'free_end': (free_end, dict(bending=[1, 1.3], torsion=0.7, viscosity=[0.05, 0.08, 0.04], mass=1, dead=[0.5, 0, -1], velocity=[0.2, -0.3, 0], strain_polynomials=[[0.3, 0.5], [0.8, -0.6], [0, 0.4]])),
        'welded': (welded, dict(stiffness_diagonal=[1, 1.3, 0.7, 60, 60, 100], viscosity_over_stiffness=0.05, mass=1, centre=[0.1, 0.05, 0.2], inertia=[[0.05, 0.01, 0], [0.01, 0.04, 0], [0, 0, 0.03]], gravity=[0, -1, 0],
                                velocity=[0.5, 0.2, -0.1], omega=[0.3, -0.2, 0.4]))}
    doc = []
    for name, (f, meta) in RUNS.items():
        a = f(20, 1e-13)
        b, h = f(14, 1e-13), f(20, 3e-12)
        acc = {'nodes': 20, 'nodes_14': gap(a, b), 'rtol_3e-12': gap(a, h)}
        acc.update({k: max(abs(float(x[k])) for x in a) for k in ('balance', 'pose_gap', 'magnus_gap', 'orthogonal', 'G_symmetry')})
        print(name, a[0]['nfev'], json.dumps(acc, indent=1), a[-1]['r'], flush=True)
        rows = [{k: (v.tolist() if isinstance(v, np.ndarray) else float(v)) for k, v in x.items() if k not in ('balance', 'pose_gap', 'magnus_gap', 'orthogonal', 'G_symmetry', 'nfev')} for x in a]
        doc.append({'name': name, **meta, 'accuracy': acc, 'rows': rows})
    recipe = ("tools/ref_viscous_space.py. Rods of length 1, clamp at the origin, R(0) = 1 (d3 along +z), Kelvin-Voigt w = K (e - rest) + H e_t along the directors. "
              "free_end: unshearable, inextensible, K = diag(bending, torsion), H = diag(viscosity), point mass on an end free to turn, m(1) = 0; start strains u_k(s) = sum strain_polynomials[k][j] s^j, velocity; dead load. "
              "welded: K = diag, H = 0.05 K, rest (0,0,0,0,0,1), start unloaded; rigid body, centre r(1) + centre_k d_k(1), inertia about the centre in the end's directors, gravity at the centre, velocity of the end, omega in the world frame. "
              "rows: r, v of the end; rotation = [d1 d2 d3](1), rows of the matrix; omega world frame; m1, n1: what the body does to the end, world frame; kinetic of the body; stored = int (e - rest).K (e - rest)/2; "
              "dissipated = int int e_t.H e_t; work of the loads from t = 0; strain at s = 0, 0.25, 0.5, 0.75, 1; G_min smallest eigenvalue of G = int Q^T H^-1 Q (> 0). "
              "accuracy: gaps relative to 1 + |value| of 20 nodes against 14 and of rtol 1e-13 against 3e-12; balance |kinetic + stored + dissipated - work - start|; pose_gap: pose of the strains against the integrated velocities; "
              "magnus_gap: pose by collocation against products of exponentials; orthogonal |R^T R - 1|. Trust: 11 digits after the point, n1 and m1 10, strain at the ends 10.")
    with open(OUT, 'w') as fh:
        fh.write('{\n"recipe": %s,\n"runs": [\n' % json.dumps(recipe))
        for i, r in enumerate(doc):
            meta = {k: v for k, v in r.items() if k != 'rows'}
            fh.write('%s,\n"rows": [\n%s\n]}%s\n' % (json.dumps(meta)[:-1], ',\n'.join(json.dumps(x) for x in r['rows']), ',' if i + 1 < len(doc) else ''))
        fh.write(']}\n')


if __name__ == '__main__':
    main()
