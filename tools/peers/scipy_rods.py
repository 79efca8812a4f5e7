"""Motion W of the planar elastica, and a rod in space under an end load, as one would compute them with scipy.

Called by `cargo bench --bench work_precision` with the ends to compare with, `W=x,y,0,vx,vy,0` and `rest=` the place and the three directors of the end; prints lines
KEY method tolerance error right-hand-sides milliseconds.

* W: the closed forms of docs/theory.md 2.2 by scipy.special.elliprf and elliprd, the chart (p, w) as state, solve_ivp with DOP853.
* rest: the equations of a Cosserat rod for place, quaternion and couple along it, the force being constant; the base couple by shooting (solve_ivp with DOP853 and root), and the whole
  by solve_bvp, from the unloaded rod.
"""

import sys
import time
from math import atan2, cos, cosh, floor, hypot, pi, sin, sqrt, tanh

import numpy as np
from scipy.integrate import solve_bvp, solve_ivp
from scipy.optimize import root
from scipy.special import elliprd, elliprf

LOAD = (-8.0, -2.0)
START = [1.0271856612491402, 2.5407679515596731, 0.0, 0.0]
STIFFNESS = np.array([1.0, 1.5, 0.7, 100.0, 120.0, 300.0])
FORCE, COUPLE = np.array([1.0, -2.0, 0.5]), np.array([0.3, 0.2, -0.8])


def point(p, w):
    kap, kc, s, c = tanh(p), 1 / cosh(p), sin(w), cos(w)
    kc2 = kc * kc
    d2 = kc2 + kap * kap * s * s
    d = sqrt(d2)
    n = floor(w / pi + 0.5)
    t = sin(w - n * pi)
    lam = t * elliprf(kc2 * c * c, d2, kc2)
    b = kc2 / 3 * t**3 * elliprd(kc2 * c * c, d2, kc2)
    if n > 0:
        lam += 2 * n * elliprf(0, 1, kc2)
        b += 2 * n * kc2 / 3 * elliprd(0, 1, kc2)
    e = kc2 * lam + kap * kap * b
    lp, lw, ep = kap * (b + c * s / d), 1 / d, -kc2 * kap * (lam - b)
    ap, aw = -2 * kc2 * c / d, 2 * kap * s / d
    x, y = 2 * e / lam - 1, 2 * kap * s / lam
    xp, xw = 2 * ep / lam - (x + 1) * lp / lam, 2 * d / lam - (x + 1) * lw / lam
    yp, yw = 2 * kc2 * s / lam - y * lp / lam, 2 * kap * c / lam - y * lw / lam
    alpha = -2 * atan2(kap * c, d)
    ca, sa = cos(alpha), sin(alpha)

    def turned(a, b):
        return ca * a - sa * b, sa * a + ca * b

    place = turned(x, y)
    return place, turned(xp - ap * y, yp + ap * x), turned(xw - aw * y, yw + aw * x), (lam * lam * ca, lam * lam * sa)


def slope(_, z):
    p, w, vx, vy = z
    _, (xp, yp), (xw, yw), (fx, fy) = point(p, w)
    det = xp * yw - xw * yp
    return (yw * vx - xw * vy) / det, (xp * vy - yp * vx) / det, fx + LOAD[0], fy + LOAD[1]


def motion(end):
    for digits in (4, 6, 8, 10, 12):
        tolerance = 10.0**-digits
        clock = time.perf_counter()
        found = solve_ivp(slope, (0.0, 20.0), START, method="DOP853", rtol=tolerance, atol=tolerance)
        ms = 1e3 * (time.perf_counter() - clock)
        p, w, vx, vy = found.y[:, -1]
        (x, y), *_ = point(p, w)
        error = max(hypot(x - end[0], y - end[1]), hypot(vx - end[3], vy - end[4]))
        print(f"W scipy,~DOP853 1e-{digits} {error:.3e} {found.nfev} {ms:.3f}", flush=True)


def directors(q):
    w, x, y, z = q
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    ) / (q @ q)


def along(_, y):
    """d/ds of place, quaternion and couple."""
    q, m = y[3:7], y[7:10]
    turn = directors(q)
    u = turn.T @ m / STIFFNESS[:3]
    v = turn.T @ FORCE / STIFFNESS[3:]
    v[2] += 1.0
    rate = turn @ v
    w, x, y, z = q
    q_rate = 0.5 * np.array(
        [
            -x * u[0] - y * u[1] - z * u[2],
            w * u[0] + y * u[2] - z * u[1],
            w * u[1] + z * u[0] - x * u[2],
            w * u[2] + x * u[1] - y * u[0],
        ]
    )
    return np.concatenate([rate, q_rate, -np.cross(rate, FORCE)])


def end_error(y, end):
    found = np.concatenate([y[:3], directors(y[3:7]).T.ravel()])
    return np.linalg.norm((found - end).reshape(-1, 3), axis=1).max()


def shooting(tolerance):
    work = 0

    def shot(m):
        nonlocal work
        start = np.concatenate([np.zeros(3), [1.0, 0.0, 0.0, 0.0], m])
        found = solve_ivp(along, (0.0, 1.0), start, method="DOP853", rtol=tolerance, atol=tolerance)
        work += found.nfev
        return found.y[:, -1]

    found = root(lambda m: shot(m)[7:] - COUPLE, np.zeros(3), tol=tolerance)
    return shot(found.x), work


def collocation(tolerance):
    work = 0

    def many(s, y):
        nonlocal work
        work += y.shape[1]
        return np.stack([along(s, column) for column in y.T], axis=1)

    def ends(a, b):
        return np.concatenate([a[:3], a[3:7] - [1.0, 0.0, 0.0, 0.0], b[7:10] - COUPLE])

    mesh = np.linspace(0.0, 1.0, 11)
    guess = np.zeros((10, mesh.size))
    guess[2], guess[3] = mesh, 1.0
    found = solve_bvp(many, ends, mesh, guess, tol=tolerance, max_nodes=100_000)
    if not found.success:
        raise RuntimeError(found.message)
    return found.y[:, -1], work


def rest(end):
    for name, solve, finest in (("shooting", shooting, 12), ("solve_bvp", collocation, 8)):
        for digits in range(4, finest + 1, 2):
            clock = time.perf_counter()
            y, work = solve(10.0**-digits)
            ms = 1e3 * (time.perf_counter() - clock)
            print(f"rest scipy,~{name} 1e-{digits} {end_error(y, end):.3e} {work} {ms:.3f}", flush=True)


for argument in sys.argv[1:]:
    key, numbers = argument.split("=")
    {"W": motion, "rest": rest}[key](np.array(numbers.split(","), dtype=float))
