"""Double-precision companions of refcore.py (numpy/scipy).

`Grid`: the pendulum chi = pi - psi, chi'' = sin chi, from rest at chi0 = 4 atan(exp(-p)), for many p > 0 at
once, tabulated at tau = lam = 0, h, 2h, ... by a Taylor series of order 16; gives r(1), its Jacobian
in (lam, p) and det. Negative p is the mirror image (y -> -y).
`morse`: inertia of the discretised second variation  int h'^2 - lam^2 cos(psi) h^2,  h(0) = 0, on the space
int h sin psi = int h cos psi = 0 (r(1) held, tip free to turn); eigenvalues relative to int h^2.
"""
import numpy as np
from numpy.polynomial import legendre as Lg
from scipy.linalg import eigh, qr


def taylor(st, h, order):
    """Coefficient lists (scaled by h^n) of chi, v, s = sin chi, c = cos chi, C, and p-derivatives d, w, Cd."""
    chi, v, s, c, C, d, w, Cd = ([z] for z in st)
    for n in range(order):
        cv = sum(c[i] * v[n - i] for i in range(n + 1))
        sv = sum(s[i] * v[n - i] for i in range(n + 1))
        cd = sum(c[i] * d[n - i] for i in range(n + 1))
        sd = sum(s[i] * d[n - i] for i in range(n + 1))
        q = h / (n + 1)
        chi.append(q * v[n])
        v.append(q * s[n])
        s.append(q * cv)
        c.append(-q * sv)
        C.append(-q * c[n])              # C = int cos psi = -int cos chi
        d.append(q * w[n])
        w.append(q * cd)
        Cd.append(q * sd)                # dC/dp = int sin chi d
    return chi, v, s, c, C, d, w, Cd


def start(p):
    p = np.asarray(p, float)
    chi = 4 * np.arctan(np.exp(-p))
    t = 2 * np.arctan(np.exp(-p))        # chi/2; sin chi exact for small chi
    z = np.zeros_like(p)
    return [chi, z, np.sin(chi), 1 - 2 * np.sin(t) ** 2, z, -2 / np.cosh(p), z, z]


class Grid:
    def __init__(self, p, lmax=14.0, h=0.05, order=16):
        self.p = np.asarray(p, float)
        n = int(round(lmax / h))
        self.lam = h * np.arange(n + 1)
        st = start(self.p)
        tab = [st]
        for _ in range(n):
            co = taylor(st, h, order)
            st = [sum(l[::-1]) for l in co]
            tab.append(st)
        chi, v, s, c, C, d, w, Cd = (np.array([t[i] for t in tab]) for i in range(8))
        lam = self.lam[:, None]
        with np.errstate(all='ignore'):
            self._fill(lam, chi, v, s, c, C, d, w, Cd)
        self.chi, self.v = chi, v

    def _fill(self, lam, chi, v, s, c, C, d, w, Cd):
        # psi = pi - chi: psi' = -v, S = int sin psi = v, dS = w; alpha = chi - pi
        ca, sa = -np.cos(chi), -np.sin(chi)
        X, Y = C / lam, v / lam
        self.x, self.y = ca * X - sa * Y, sa * X + ca * Y
        Xl, Yl = (-c - X) / lam, (s - Y) / lam
        self.xl = ca * Xl - sa * Yl - self.y * v
        self.yl = sa * Xl + ca * Yl + self.x * v
        self.xp = (ca * Cd - sa * w) / lam - self.y * d
        self.yp = (sa * Cd + ca * w) / lam + self.x * d
        self.det = self.xl * self.yp - self.xp * self.yl
        for a, val in (('x', 1), ('y', 0), ('xl', 0), ('yl', 0), ('xp', 0), ('yp', 0), ('det', 0)):
            getattr(self, a)[0] = val


def psi_at(lam, p, s):
    """psi(s) (p may have either sign) at the points s, by local Taylor polynomials."""
    sg = 1.0 if p > 0 else -1.0
    st = start(abs(p))
    n = max(1, int(np.ceil(lam / 0.25)))
    h = lam / n
    tau = lam * (1 - s)
    out = np.empty_like(s)
    idx = np.minimum((tau / h).astype(int), n - 1)
    for i in range(n):
        co = taylor(st, h, 24)
        m = idx == i
        out[m] = np.polyval(co[0][::-1], (tau[m] - i * h) / h)
        st = [sum(l[::-1]) for l in co]
    return sg * (np.pi - out)


def basis(kind, N, x):
    """Values and s-derivatives at s = (1+x)/2 of N functions vanishing at s = 0."""
    if kind == 'legendre':           # integrals of Legendre polynomials, derivatives orthonormal on (0,1)
        V = Lg.legvander(x, N + 1)
        k = np.arange(N)
        dh = V[:, :N] * np.sqrt(2 * k + 1)
        h = np.empty_like(dh)
        h[:, 0] = (1 + x) / 2
        h[:, 1:] = (V[:, 2:N + 1] - V[:, :N - 1]) / (2 * np.sqrt(2 * k[1:] + 1))
        return h, dh
    k = (np.arange(N) + 0.5) * np.pi
    s = (1 + x) / 2
    return np.sin(np.outer(s, k)) * np.sqrt(2), np.cos(np.outer(s, k)) * k * np.sqrt(2)


_cache = {}


def morse(lam, p, kind='legendre', N=200):
    """(index, smallest |eigenvalue|, the lowest eigenvalues)."""
    key = (kind, N)
    if key not in _cache:
        x, w = Lg.leggauss(2 * N + 40)
        _cache[key] = ((1 + x) / 2, w / 2, *basis(kind, N, x))
    s, w, h, dh = _cache[key]
    psi = psi_at(lam, p, s)
    K = (dh * w[:, None]).T @ dh
    A = K - lam ** 2 * (h * (w * np.cos(psi))[:, None]).T @ h
    M = (h * w[:, None]).T @ h
    B = h.T @ np.column_stack((w * np.sin(psi), w * np.cos(psi)))
    Z = qr(B)[0][:, 2:]
    # eigenvalues of M relative to A + shift M are well conditioned from above
    sh = lam ** 2 + 1.0
    mu = eigh(Z.T @ M @ Z, Z.T @ (A + sh * M) @ Z, eigvals_only=True)[::-1]
    nu = 1 / mu[:12] - sh
    return int((nu < 0).sum()), float(np.min(np.abs(nu))), nu
