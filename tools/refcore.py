"""High-precision planar elastica, independent of the library (shared by the reference scripts).

Recipe.  Measure arclength backwards from the free end, tau = lam (1 - s), and let
psi(tau) = theta - alpha.  The rod equation theta'' + lam^2 sin(theta - alpha) = 0 with
theta'(1) = 0 is the pendulum started from rest,

    psi'' = -sin psi,   psi(0) = psi1 = 2 asin(kap),   psi'(0) = 0,       0 <= tau <= lam,

and theta(s=0) = 0 gives alpha = -psi(lam).  With C = int_0^lam cos psi, S = int_0^lam sin psi
(= -psi'(lam)),

    x + i y = exp(i alpha) (C + i S) / lam,   theta' = -lam psi'(tau),
    U = lam/2 int psi'^2 = lam (C - lam cos psi1).

psi, psi', sin psi, cos psi, C and their derivatives with respect to psi1 are advanced by a
Taylor series in fixed-point integer arithmetic (BITS bits after the point).  The series
is stopped when its terms vanish in that arithmetic.  No elliptic function is used.
The second route is `paper`, formulas (3.14)-(3.18) with mpmath's ellipf/ellipk/ellipe.
"""
from operator import mul
import os
import mpmath as mp
from mpmath import mpf

try:
    from gmpy2 import mpz
except ImportError:          # plain integers are only slower
    mpz = int

BITS = int(os.environ.get('REF_BITS', 400))   # absolute accuracy about 2^-(BITS-10)
mp.mp.prec = BITS


def to_fix(x):
    return mpz(int(mp.nint(mp.ldexp(mpf(x), BITS))))


def to_mp(i):
    return mp.ldexp(mpf(int(i)), -BITS)


def _step(st, h):
    """One Taylor step; st = [psi, v, s, c, C, d, w, Cd] fixed point, h fixed point.
    d, w, Cd are the psi1-derivatives of psi, v, C."""
    psi, v, s, c, C, d, w, Cd = ([z] for z in st)
    lim = 8 + ((abs(d[0]) + abs(w[0])) >> (BITS - 8))      # roundoff of the growing variation
    n = 0
    while True:
        m = n + 1
        sh = BITS

        def q(z):            # h z / m
            return (h * z >> sh) // m

        vr = v[::-1]
        cv = sum(map(mul, c, vr)) >> sh
        sv = sum(map(mul, s, vr)) >> sh
        dr = d[::-1]
        cd = sum(map(mul, c, dr)) >> sh
        sd = sum(map(mul, s, dr)) >> sh
        new = (q(v[n]), q(-s[n]), q(cv), q(-sv), q(c[n]), q(w[n]), q(-cd), q(-sd))
        for lst, z in zip((psi, v, s, c, C, d, w, Cd), new):
            lst.append(z)
        n = m
        if n > 8 and all(abs(l[-1]) < 4 and abs(l[-2]) < 4 for l in (psi, v, s, c, C)) \
           and all(abs(l[-1]) < lim for l in (d, w, Cd)):
            break
    return [sum(l) for l in (psi, v, s, c, C, d, w, Cd)]


HMAX = mpf(3) / 4


class Orbit:
    """The pendulum from rest at psi1 (kap = tanh p), tabulated at increasing tau."""

    def __init__(self, p=None, psi1=None):
        if p is not None:
            p = mpf(p)
            # psi1 = 2 asin(tanh p), through the complement so that p large is exact
            psi1 = mp.sign(p) * (mp.pi - 4 * mp.atan(mp.exp(-abs(p)))) if abs(p) > 1 \
                else 4 * mp.atan(mp.tanh(p / 2))
        self.psi1 = mpf(psi1)
        self.tau = mpf(0)
        self.st = [to_fix(z) for z in (self.psi1, 0, mp.sin(self.psi1), mp.cos(self.psi1), 0, 1, 0, 0)]
        self.turns = 0       # zeros of psi' in (0, tau)

    def to(self, tau):
        tau = mpf(tau)
        dt = tau - self.tau
        assert dt >= 0
        n = int(mp.ceil(dt / HMAX))
        if n:
            h = to_fix(dt / n)
            for _ in range(n):
                v0 = self.st[1]
                self.st = _step(self.st, h)
                if v0 != 0 and (v0 > 0) != (self.st[1] > 0):
                    self.turns += 1
        self.tau = tau
        psi, v, s, c, C, d, w, Cd = map(to_mp, self.st)
        return dict(psi=psi, v=v, s=s, c=c, C=C, S=-v, d=d, w=w, Cd=Cd, Sd=-w, turns=self.turns)


def rot(al, a, b):
    c, s = mp.cos(al), mp.sin(al)
    return c * a - s * b, s * a + c * b


def point(lam, p=None, psi1=None):
    """Everything about the equilibrium (lam, p), and the Jacobian of (x, y) in (lam, psi1)."""
    lam = mpf(lam)
    o = Orbit(p, psi1)
    e = o.to(lam)
    al = -e['psi']
    X, Y = e['C'] / lam, e['S'] / lam
    x, y = rot(al, X, Y)
    # d/dlam: alpha' = -v, X' = (cos psi - X)/lam, Y' = (sin psi - Y)/lam
    xl, yl = rot(al, (e['c'] - X) / lam, (e['s'] - Y) / lam)
    xl, yl = xl + y * e['v'], yl - x * e['v']
    xa, ya = rot(al, e['Cd'] / lam, e['Sd'] / lam)
    xa, ya = xa + y * e['d'], ya - x * e['d']
    psi1 = o.psi1
    k = mp.sin(psi1 / 2)
    kp = mp.cos(psi1 / 2)
    return dict(lam=lam, psi1=psi1, kap=k, kapc=kp, p=mp.asinh(k / kp), alpha=al, theta1=al + psi1,
                x=x, y=y, U=lam * (e['C'] - lam * mp.cos(psi1)), force=lam ** 2, mode=e['turns'],
                sign=-int(mp.sign(e['v'])), J=(xl, xa, yl, ya), det=xl * ya - xa * yl,
                da=(-e['v'], -e['d']))


def one_minus_x(q):
    return 1 - q['x']        # BITS is far above the cancellation


def shape(lam, p, ss):
    lam = mpf(lam)
    o = Orbit(p)
    rows = [(s, o.to(lam * (1 - mpf(s)))) for s in sorted(ss, key=lambda s: -mpf(s))]
    e = o.to(lam)
    al = -e['psi']
    out = []
    for s, r in reversed(rows):
        x, y = rot(al, (e['C'] - r['C']) / lam, (e['S'] - r['S']) / lam)
        out.append(dict(s=s, theta=r['psi'] + al, dtheta=-lam * r['v'], x=x, y=y))
    return out


def paper(k, beta, j, sg):
    """AMV (3.14)-(3.18): lam, alpha, theta1, x, y, U from (k, beta) on sheet S_j^sg.
    Uses only k^2 and 1-k^2 through mpmath's elliptic integrals at working precision."""
    k, beta = mpf(k), mpf(beta)
    m = k * k
    K, E, F, Eb = mp.ellipk(m), mp.ellipe(m), mp.ellipf(beta, m), mp.ellipe(beta, m)
    lam = (2 * j + 1) * K + sg * F
    e = (2 * j + 1) * E + sg * Eb
    al = 2 * mp.asin(k * mp.sin(beta))
    th1 = al + sg * (-1) ** j * 2 * mp.asin(k)
    a = -1 + 2 * e / lam
    b = sg * 2 * k * mp.cos(beta) / lam
    x, y = rot(al, a, b)
    # U = lam/2 int psi'^2 dtau and psi'^2/2 = cos psi - cos psi1 ; cos psi1 = 1 - 2 k^2
    U = lam * (lam * a - lam * (1 - 2 * m))
    return dict(lam=lam, alpha=al, theta1=th1, x=x, y=y, U=U)


def paper_beta(q):
    """beta of a computed equilibrium (for the second route): alpha = 2 asin(k sin beta)."""
    k = abs(q['kap'])
    s = mp.sin(q['alpha'] / 2) / k
    s = max(min(s, mpf(1)), mpf(-1))
    return k, mp.asin(s)


def newton_xy(lam, psi1, X, Y, steps=12):
    """Equilibrium with r(1) = (X, Y): Newton in (lam, psi1) from a good guess."""
    lam, psi1 = mpf(lam), mpf(psi1)
    X, Y = mpf(X), mpf(Y)
    for _ in range(steps):
        q = point(lam, psi1=psi1)
        f, g = q['x'] - X, q['y'] - Y
        a, b, c, d = q['J']
        D = a * d - b * c
        dl, dp = (d * f - b * g) / D, (a * g - c * f) / D
        lam -= dl
        psi1 -= dp
        if abs(dl) + abs(dp) < mpf(10) ** -(BITS // 8):
            return point(lam, psi1=psi1)
    raise ArithmeticError('newton_xy did not converge')


def dec(x, n=25):
    return mp.nstr(mpf(x), n, min_fixed=-5, max_fixed=9, strip_zeros=False)
