#!/usr/bin/env python3
"""Reference values of the elliptic kernel, by mpmath: writes tests/data/elliptic.csv.

    python3 tools/elliptic_reference.py > tests/data/elliptic.csv      (mpmath 1.3, 20 seconds)

Inputs are f64 numbers, taken as exact (shortest decimal that round-trips). The parameter m = 1 - kc^2
is formed with 2 log10(1/kc) digits more than 80, so that the functions
come from mpmath's own Legendre and theta implementations, not from the formulas of the Rust code.
Every value is computed twice, the second time with half as many digits again, and some points are
checked against quadrature and numerical differentiation.

Columns: function, region, the inputs a, b, c (unused ones 0), the value to 25 digits,
rest = value - f64(value), so that errors below half an ulp can be told, and for the Jacobi functions
slope = |u df/du|, so that errors can be measured by the conditioning in u (else 0).
"""
import math
import random

from mpmath import mp, mpf

PHI_POINTS, JACOBI_POINTS, OTHER_POINTS = 80, 60, 80
rng = random.Random(20)


def digits(kc):
    return 80 + int(2 * max(0.0, -math.log10(kc)))


def log_uniform(lo, hi):
    return 10.0 ** rng.uniform(lo, hi)


def parameter(kc):
    return 1 - mpf(kc) ** 2


# --- Legendre ----------------------------------------------------------------------------------


def legendre(phi, kc):
    """F, E, B, and dF/dkc, dE/dkc at fixed phi (DLMF 19.4.5-6 in k, then dk/dkc = -kc/k)."""
    phi, kc, m = mpf(phi), mpf(kc), parameter(kc)
    f, e = mp.ellipf(phi, m), mp.ellipe(phi, m)
    s, c = mp.sin(phi), mp.cos(phi)
    delta = mp.sqrt(c**2 + kc**2 * s**2)
    if m == 0:
        d = (phi - s * c) / 2
        return f, e, (phi + s * c) / 2, -d, d
    b = (e - kc**2 * f) / m
    f_k = (e - kc**2 * f) / (mp.sqrt(m) * kc**2) - mp.sqrt(m) * s * c / (kc**2 * delta)
    e_k = (e - f) / mp.sqrt(m)
    slope = -kc / mp.sqrt(m)
    return f, e, b, slope * f_k, slope * e_k


def complete(kc):
    kc, m = mpf(kc), parameter(kc)
    k, e = mp.ellipk(m), mp.ellipe(m)
    if m == 0:
        return k, e, mp.pi / 4, -mp.pi / 4, mp.pi / 4
    b = (e - kc**2 * k) / m
    return k, e, b, -b / kc, kc * (k - b)


HALF = math.pi / 2
PHI_REGIONS = {
    "generic": lambda: (rng.uniform(0.01, 1.57), rng.uniform(0.05, 1.0)),
    "kc near 1": lambda: (rng.uniform(0.01, 1.57), 1.0 - log_uniform(-16, -1)),
    "kc 1e-8..0.1": lambda: (rng.uniform(0.01, 1.57), log_uniform(-8, -1)),
    "kc 1e-150..1e-8": lambda: (rng.uniform(0.01, 1.57), log_uniform(-150, -8)),
    "corner, kc 1e-12..0.3": lambda: (HALF - log_uniform(-15, -1), log_uniform(-12, -0.5)),
    "corner, kc 1e-150..1e-12": lambda: (HALF - log_uniform(-15, -1), log_uniform(-150, -12)),
    "beyond pi/2 to 50": lambda: (rng.choice((-1, 1)) * rng.uniform(HALF, 50), log_uniform(-8, 0)),
    "beyond, kc 1e-150..1e-8": lambda: (rng.uniform(HALF, 50), log_uniform(-150, -8)),
    "beyond, corner": lambda: (
        math.pi * rng.randrange(1, 16) + HALF + rng.choice((-1, 1)) * log_uniform(-15, -1),
        log_uniform(-12, 0),
    ),
    "tiny phi": lambda: (log_uniform(-90, -2), log_uniform(-12, 0)),
    "phi 50..1e15": lambda: (log_uniform(1.7, 15), log_uniform(-8, 0)),
}
KC_REGIONS = {
    "generic": lambda: rng.uniform(0.05, 1.0),
    "kc near 1": lambda: 1.0 - log_uniform(-16, -1),
    "kc 1e-8..0.1": lambda: log_uniform(-8, -1),
    "kc 1e-150..1e-8": lambda: log_uniform(-150, -8),
    "kc 1e-307..1e-150": lambda: log_uniform(-307, -150),
}

# --- Jacobi ------------------------------------------------------------------------------------


def jacobi(u, kc):
    """sn, cn, dn, am, cd, sd (sn and cn from theta functions), each with |u df/du|."""
    u, kc, m = mpf(u), mpf(kc), parameter(kc)
    sn, cn = mp.ellipfun("sn", u, m=m), mp.ellipfun("cn", u, m=m)
    sn, cn = mp.re(sn), mp.re(cn)
    dn = mp.sqrt(cn**2 + kc**2 * sn**2)
    n = mp.nint(u / (2 * mp.ellipk(m)))
    sign = -1 if int(n) % 2 else 1
    am = n * mp.pi + mp.atan2(sign * sn, sign * cn)
    values = sn, cn, dn, am, cn / dn, sn / dn
    slopes = cn * dn, sn * dn, m * sn * cn, dn, kc**2 * sn / dn**2, cn / dn**2
    return values + tuple(abs(u * slope) for slope in slopes)


def signed(x):
    return rng.choice((-1, 1)) * x


def near_quarter():
    kc = log_uniform(-12, 0)
    odd = 2 * rng.randrange(0, 6) + 1
    return odd * float(mp.ellipk(parameter(kc))) * (1 + signed(log_uniform(-14, -2))), kc


U_REGIONS = {
    "abs u <= 2": lambda: (signed(rng.uniform(0, 2)), log_uniform(-3, 0)),
    "abs u <= 60": lambda: (signed(rng.uniform(2, 60)), log_uniform(-8, 0)),
    "abs u <= 1000": lambda: (signed(rng.uniform(60, 1000)), log_uniform(-8, 0)),
    "abs u <= 2, kc 1e-150..1e-8": lambda: (signed(rng.uniform(0, 2)), log_uniform(-150, -8)),
    "abs u <= 60, kc 1e-150..1e-8": lambda: (signed(rng.uniform(2, 60)), log_uniform(-150, -8)),
    "abs u <= 1000, kc 1e-150..1e-8": lambda: (signed(rng.uniform(60, 1000)), log_uniform(-150, -8)),
    "u near odd K": near_quarter,
    "tiny u": lambda: (signed(log_uniform(-300, -3)), log_uniform(-20, 0)),
    "kc near 1": lambda: (signed(rng.uniform(0, 60)), 1.0 - log_uniform(-16, -1)),
}

# --- Carlson -----------------------------------------------------------------------------------

CARLSON_REGIONS = {
    "generic": lambda: [rng.uniform(0.01, 10) for _ in range(3)],
    "wide 1e-8..1e8": lambda: [log_uniform(-8, 8) for _ in range(3)],
    "one zero": lambda: [0.0, log_uniform(-8, 8), log_uniform(-8, 8)],
    "nearly equal": lambda: [1 + signed(log_uniform(-16, -1)) for _ in range(3)],
    "extreme 1e-300..1e300": lambda: [log_uniform(-300, 300) for _ in range(3)],
    "subnormal": lambda: [log_uniform(-323, -308), log_uniform(-323, 308), log_uniform(-323, 308)],
}


# --- writing -----------------------------------------------------------------------------------


def self_test():
    mp.dps = 40
    for phi, kc in [(0.7, 0.3), (1.5, 0.01), (2.9, 0.6), (-4.0, 0.2)]:
        k2 = parameter(kc)
        delta = lambda t: mp.sqrt(1 - k2 * mp.sin(t) ** 2)
        pieces = mp.linspace(0, mpf(phi), 9)
        quad = [
            mp.quad(lambda t: 1 / delta(t), pieces),
            mp.quad(delta, pieces),
            mp.quad(lambda t: mp.cos(t) ** 2 / delta(t), pieces),
            mp.diff(lambda x: mp.ellipf(phi, 1 - x**2), mpf(kc)),
            mp.diff(lambda x: mp.ellipe(phi, 1 - x**2), mpf(kc)),
        ]
        for ours, theirs in zip(legendre(phi, kc), quad):
            assert abs(ours - theirs) < mpf(10) ** -15 * abs(theirs), (phi, kc, ours, theirs)
    for u, kc in [(1.3, 0.2), (-20.0, 0.01), (55.5, 0.7)]:
        assert abs(mp.ellipf(jacobi(u, kc)[3], parameter(kc)) - u) < mpf(10) ** -30


def twice(digits, function, *inputs):
    """function(*inputs) with that many digits, confirmed with half as many again."""
    mp.dps = digits + digits // 2
    check = function(*inputs)
    mp.dps = digits
    values = function(*inputs)
    for value, confirmed in zip(values, check):
        assert abs(value - confirmed) <= mpf(10) ** -32 * abs(value), (function, inputs)
    return values


def row(function, region, inputs, value, slope=0):
    a, b, c = (list(inputs) + [0.0, 0.0])[:3]
    nearest = float(value)
    if not (2.3e-308 < abs(nearest) < 1.7e308):
        return  # no normal number: the tests of extreme inputs look after these
    rest = value - mpf(nearest)
    text = mp.nstr(value, 25, min_fixed=1, max_fixed=0)
    assert float(text) == nearest
    slope = mp.nstr(slope, 4) if slope else 0
    print(f'{function},"{region}",{a!r},{b!r},{c!r},{text},{mp.nstr(rest, 3)},{slope}')


def main():
    self_test()
    print("function,region,a,b,c,value,rest,slope")
    for region, draw in KC_REGIONS.items():
        for _ in range(OTHER_POINTS):
            kc = draw()
            values = twice(digits(kc), complete, kc)
            for name, value in zip(("K", "E", "B", "K_kc", "E_kc"), values):
                row(name, region, [kc], value)
    for region, draw in PHI_REGIONS.items():
        for _ in range(PHI_POINTS):
            phi, kc = draw()
            # E - kc^2 F and E - F cancel phi^2 for tiny phi: carry the digits.
            more = 20 + int(2 * max(0.0, -math.log10(abs(phi))))
            values = twice(digits(kc) + more, legendre, phi, kc)
            for name, value in zip(("F(phi)", "E(phi)", "B(phi)", "F_kc", "E_kc"), values):
                row(name + "(phi)" * name.endswith("kc"), region, [phi, kc], value)
    for region, draw in U_REGIONS.items():
        for _ in range(JACOBI_POINTS):
            mp.dps = 45
            u, kc = draw()
            values = twice(digits(kc) + int(abs(u) / 2) + 20, jacobi, u, kc)
            for name, value, slope in zip(("sn", "cn", "dn", "am", "cd", "sd"), values, values[6:]):
                row(name, region, [u, kc], value, slope)
    for region, draw in CARLSON_REGIONS.items():
        for _ in range(OTHER_POINTS):
            point = draw()
            positive = [v for v in point if v > 0]
            more = int(math.log10(max(positive)) - math.log10(min(positive)))
            for name, function in ("RF", mp.elliprf), ("RD", mp.elliprd):
                value = twice(50 + more, lambda *xyz: [function(*map(mpf, xyz))], *point)[0]
                row(name, region, point, value)


main()
