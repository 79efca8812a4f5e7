"""The mass of a taut planar rod to first order: `tests/data/taut_mass.csv`.

The rod is the pendulum of modulus kap = tanh p at the distances u <= lam from its end (docs/theory.md 2.2). Its functions are Fourier series in the
complementary nome, whose terms are far apart on a taut rod: with a = pi/(2K'), v_n = a (u - (2n - 1) K), all n,

    D = a sum sech v_n,   kap s = -a sum (-1)^n sech v_n,   kap c = a sum (-1)^n tanh v_n,   int D^2 du = (1 - E'/K') u + a sum tanh v_n

Derivatives along (p, lam) and in time are central differences of order 8, in 80 digits; integrals along the rod are Gauss sums in variables that are
drawn to its bend. Nothing here knows that the rod is taut. With the axes along and across the pull, for an end that moves with v = (0.7, -0.3) in
them, a row has p, lam, 4 atan(T) (the direction of the pull), A11, A12, A22 of the mass A and the force b1, b2 without weight (2.9). A column
`error` says how far a coarser sum is off, relative to the terms. Three minutes.
"""

import sys

from mpmath import agm, atan, cosh, ellipe, ellipk, exp, log, matrix, mp, mpf, pi, sech, sinh, sqrt, tanh

mp.dps = 80
STENCIL = [mpf(4) / 5, mpf(-1) / 5, mpf(4) / 105, mpf(-1) / 280]
CURVE = [mpf(-205) / 72, mpf(8) / 5, mpf(-1) / 5, mpf(8) / 315, mpf(-1) / 560]
STEP = mpf(10) ** -7
TERMS = range(-8, 10)


def gauss(count):
    """Nodes and weights on [0, 1]."""
    rule = []
    for k in range(count):
        x = mp.cos(pi * (k + mpf(3) / 4) / (count + mpf(1) / 2))
        for _ in range(8):
            p0, p1 = mpf(1), x
            for n in range(2, count + 1):
                p0, p1 = p1, ((2 * n - 1) * x * p1 - (n - 1) * p0) / n
            slope = count * (x * p1 - p0) / (x * x - 1)
            x -= p1 / slope
        rule.append(((1 + x) / 2, 1 / ((1 - x * x) * slope * slope)))
    return rule


class Rod:
    """The shape at one (p, lam)."""

    def __init__(self, p, lam):
        self.lam = lam
        kc = sech(p)
        self.k = tanh(p)
        self.a = pi / (2 * ellipk(kc * kc))
        self.quarter = pi / (2 * agm(1, kc))
        self.linear = 1 - ellipe(kc * kc) / ellipk(kc * kc)
        self.start = self.tanhs(mpf(0))
        self.clamp = self.swing(lam)
        d, across = self.hyperbolic(lam)
        # sin(psi/2) = kap c, cos(psi/2) = D; alpha = -psi at the clamp.
        self.cos, self.sin = d * d - across * across, -2 * d * across

    def terms(self, u):
        for n in TERMS:
            yield (-1) ** n, self.a * (u - (2 * n - 1) * self.quarter)

    def tanhs(self, u):
        return self.a * sum(tanh(v) for _, v in self.terms(u))

    def hyperbolic(self, u):
        """(D, |kap| c)."""
        d = self.a * sum(sech(v) for _, v in self.terms(u))
        terms = [sign * tanh(v) for sign, v in self.terms(u)]
        # Far terms are +-1: the mean of two partial sums.
        return d, self.a * (sum(terms) - (terms[0] + terms[-1]) / 2)

    def swing(self, u):
        """Z(u), the place seen from the end."""
        s = -self.a * sum(sign * sech(v) for sign, v in self.terms(u))
        return 2 * (self.linear * u + self.tanhs(u) - self.start) - u, 2 * s

    def place(self, part):
        """The section with this part of the rod beyond it."""
        here = self.swing(self.lam * part)
        x, y = (self.clamp[0] - here[0]) / self.lam, (self.clamp[1] - here[1]) / self.lam
        return matrix([self.cos * x - self.sin * y, self.sin * x + self.cos * y])


def stencil(p, lam, along):
    """Rods at 4 steps to either side."""
    return [Rod(p + k * STEP * along[0], lam + k * STEP * along[1]) for k in range(-4, 5)]


def first(rods, part):
    odd = [rods[4 + k].place(part) - rods[4 - k].place(part) for k in range(1, 5)]
    return sum((c * o for c, o in zip(STENCIL[1:], odd[1:])), STENCIL[0] * odd[0]) / STEP


def second(rods, part):
    even = [rods[4 + k].place(part) + rods[4 - k].place(part) for k in range(1, 5)]
    return sum((c * e for c, e in zip(CURVE[1:], even)), CURVE[0] * rods[4].place(part)) / STEP**2


def drawn_to_bend(p, lam, rule):
    """Nodes by the part of the rod beyond them, on both sides of the middle of the bend, and their weights."""
    middle = max(lam - p - log(2), mpf(0)) / lam
    for length, side in [(1 - middle, 1), (middle, -1)]:
        narrow = mp.asinh(lam * length)
        for x, weight in rule if length else []:
            part = 1 - middle - side * length * sinh(narrow * x) / sinh(narrow)
            yield part, weight * length * narrow * cosh(narrow * x) / sinh(narrow)


def felt(p, lam, rule):
    """[A11, A12, A22, b1, b2] and the direction of the pull."""
    here = Rod(p, lam)
    by = [stencil(p, lam, (1, 0)), stencil(p, lam, (0, 1))]
    end = [first(rods, mpf(0)) for rods in by]
    dr = matrix([[end[0][0], end[1][0]], [end[0][1], end[1][1]]])
    inverse = dr**-1
    # The pull is against the force lam^2 (cos alpha, sin alpha).
    turn = matrix([[-here.cos, here.sin], [-here.sin, -here.cos]])
    rate = inverse * (turn * matrix([mpf("0.7"), mpf("-0.3")]))
    speed = mp.norm(rate)
    moving = stencil(p, lam, rate / speed)
    drawn = second(moving, mpf(0)) * speed**2
    sums = [mpf(0)] * 5
    for part, weight in drawn_to_bend(p, lam, rule):
        fields = [first(rods, part) for rods in by]
        field = matrix([[fields[0][0], fields[1][0]], [fields[0][1], fields[1][1]]]) * inverse
        late = second(moving, part) * speed**2 - field * drawn
        along = turn.T * field * turn
        late = turn.T * late
        for k, (i, j) in enumerate([(0, 0), (0, 1), (1, 1)]):
            sums[k] += weight * (along[0, i] * along[0, j] + along[1, i] * along[1, j])
        for i in range(2):
            sums[3 + i] -= weight * (along[0, i] * late[0] + along[1, i] * late[1])
    return sums


def main():
    rules = [gauss(60), gauss(80)]
    print("p,lam,direction,a11,a12,a22,b1,b2,error")
    for lam, most in [(20.5, 1.2), (24, 7), (30, 15), (100, 15), (300, 15), (1000, 15)]:
        for t in [mpf("0.001"), mpf("0.05"), mpf("0.4"), mpf("1.2"), mpf(7), mpf(15)]:
            if t > most:
                break
            p = float(lam - log(2 * t))
            rough, fine = [felt(mpf(p), mpf(lam), rule) for rule in rules]
            error = max(abs(a / b - 1) for a, b in zip(rough, fine))
            direction = 4 * atan(exp(lam - mpf(p)) / 2)
            numbers = [mp.nstr(x, 17) for x in [direction, *fine]]
            print(",".join([repr(p), repr(lam), *numbers, mp.nstr(error, 2)]))
            sys.stdout.flush()


main()
