"""Shared by the recipes of the viscoelastic references (ref_viscous_planar.py, _prony.py, _limit.py): Gauss nodes and the matrix of
indefinite integrals in long double, the call of ref_viscous_planar.c, rows of output.

Derivation (planar, inextensible; EI = 1): r(1) = int (cos theta, sin theta), theta(s) = int_0^s u.  Differentiating and changing the order of
integration, r_t(1) = int q u_t ds with q(s) = J(r(1) - r(s)).  Balance of moments with m(1) = 0: m(s) = (r(1) - r(s)) x n = q.n.
m = u + eta u_t + sum E_k (u - z_k) gives eta u_t = q.n - u - sum E_k (u - z_k), hence G n = eta v + int q (u + sum E_k (u - z_k)), G = int q q^T.
x.G x = int (q.x)^2 >= 0, and = 0 only if r(1) - r(s) is parallel to x for all s: G is SPD unless the rod is straight (rank one then).
Energy: d/dt int (u^2 + sum E_k (u - z_k)^2) / 2 = int (m - eta u_t) u_t - sum E_k (u - z_k) z_k'
 = n.v - int eta u_t^2 - sum E_k int (u - z_k)^2 / tau_k,  and  d/dt mu |v|^2 / 2 = -n.v + loads.v;  their sum is the balance (7.3).
"""
import ctypes
import functools
import os
import subprocess
import tempfile
import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
LD = np.longdouble
ld = lambda x: np.array(x, dtype=LD)
S_OUT = ld([0, 0.25, 0.5, 0.75, 1])


def legendre(n, x):
    """P_0 .. P_n at x, one row each."""
    P = [np.ones_like(x), x]
    for k in range(1, n):
        P.append(((2 * k + 1) * x * P[k] - k * P[k - 1]) / LD(k + 1))
    return np.array(P)


@functools.lru_cache(None)
def gauss(n):
    """Nodes, weights on (0, 1), C with (C f)_i = int_0^{s_i} f, and the matrix of interpolation to S_OUT."""
    x = ld(np.polynomial.legendre.leggauss(n)[0])
    for _ in range(3):
        P = legendre(n, x)
        x = x - P[n] * (x * x - 1) / (n * (x * P[n] - P[n - 1]))
    P = legendre(n, x)
    d = n * (x * P[n] - P[n - 1]) / (x * x - 1)
    w = 2 / ((1 - x * x) * d * d)
    I = np.array([x + 1] + [(P[k + 1] - P[k - 1]) / LD(2 * k + 1) for k in range(1, n)])
    coef = np.array([(2 * k + 1) * w * P[k] / 2 for k in range(n)])          # coefficient of P_k from values
    return (x + 1) / 2, w / 2, (I.T @ coef) / 2, interp(n, coef, S_OUT)


def interp(n, coef, s):
    return legendre(n - 1, 2 * s - 1).T @ coef


@functools.lru_cache(None)
def library():
    tmp = tempfile.mkdtemp()
    so = os.path.join(tmp, 'planar.so')
    subprocess.check_call(['gcc', '-O3', '-march=native', '-shared', '-fPIC', '-o', so, os.path.join(HERE, 'ref_viscous_planar.c'), '-lm'])
    lib = ctypes.CDLL(so)
    lib.run.argtypes = [ctypes.c_int, ctypes.c_int] + [ctypes.c_void_p] * 3 + [ctypes.c_longdouble, ctypes.c_void_p, ctypes.c_int] + [ctypes.c_void_p] * 2 + [ctypes.c_longdouble]
    return lib


class Case:
    """strain: function of s (long double array).  z(0) = strain unless given.  par: eta, E, tau, mu, gravity, dead, drag, amplitude, omega."""

    def __init__(self, strain, velocity, eta, E=(), tau=(), mu=1, gravity=(0, 0), dead=(0, 0), drag=0, amplitude=(0, 0), omega=0, z=None):
        self.strain, self.v, self.K, self.mu, self.E, self.eta = strain, velocity, len(E), mu, E, eta
        pad = lambda a: list(map(LD, a)) + [LD(0)] * (2 - len(a))
        self.par = ld([LD(eta)] + pad(E) + pad(tau) + [LD(x) for x in (mu, *gravity, *dead, drag, *amplitude, omega)])
        self.z = z

    def run(self, n, tol, times, hmax=0.05):
        s, w, C, L = gauss(n)
        K = self.K
        u = ld(self.strain(s))
        th = C @ u
        r = [w @ np.cos(th), w @ np.sin(th)]
        zs = [u] * K if self.z is None else [ld(z(s)) for z in self.z]
        y = np.concatenate([u] + zs + [ld([LD(x) for x in self.v]), ld(r), ld([0, 0, 0])])
        t = ld([LD(x) for x in times])
        out = np.zeros((len(t), 17 + (K + 1) * n), dtype=LD)
        C = np.ascontiguousarray(C)
        w = np.ascontiguousarray(w)
        rc = library().run(n, K, w.ctypes.data, C.ctypes.data, self.par.ctypes.data, LD(tol), y.ctypes.data, len(t), t.ctypes.data, out.ctypes.data, LD(hmax))
        assert rc == 0
        U0 = w @ (u * u) / 2 + sum(LD(self.E[k]) * (w @ (u - zs[k]) ** 2) / 2 for k in range(K))
        T0 = LD(self.mu) * sum(LD(x) ** 2 for x in self.v) / 2
        rows = []
        for o in out:
            f = o[17:].reshape(K + 1, n)
            U = w @ (f[0] * f[0]) / 2
            B = sum(LD(self.E[k]) * (w @ (f[0] - f[k + 1]) ** 2) / 2 for k in range(K)) if K else LD(0)
            T = LD(self.mu) * (o[3] ** 2 + o[4] ** 2) / 2
            g = np.sqrt((o[11] - o[13]) ** 2 / 4 + o[12] ** 2)
            rows.append(dict(t=o[0], r=o[1:3], v=o[3:5], n1=o[5:7], U=U, branches=B, dissipated=o[7], drag_loss=o[8], work=o[9], rate=o[10],
                             G_min=(o[11] * o[13] - o[12] ** 2) / ((o[11] + o[13]) / 2 + g), balance=T + U + B + o[7] + o[8] - o[9] - T0 - U0,
                             pose_gap=np.hypot(o[1] - o[14], o[2] - o[15]), steps=int(o[16]),
                             strain=L @ f[0], z=[L @ x for x in f[1:]]))
        return rows


def gap(a, b, keys=('r', 'v', 'U', 'dissipated', 'n1', 'strain')):
    """Largest difference of two lists of rows by key, relative to 1 + |value|."""
    return {k: max(float(np.max(np.abs(np.asarray(x[k]) - np.asarray(y[k])) / (1 + np.abs(np.asarray(x[k]))))) for x, y in zip(a, b)) for k in keys}


def num(x, digits=16):
    """A JSON number with that many significant digits."""
    if isinstance(x, np.ndarray) or isinstance(x, (list, tuple)):
        return [num(y, digits) for y in x]
    return float(np.format_float_scientific(LD(x), precision=digits, trim='-'))
