"""Benchmarks B1 to B4 for rod_reference_branch.py: closed forms of the planar elastica (L = EI = 1) in 40 digits; the
second route integrates theta'' = n3 sin(theta) - n1 cos(theta) from the clamp by scipy's DOP853."""
import mpmath as mp
from rod_reference_benchmarks import plane_ode

mp.mp.dps = 40
K, E = (lambda k: mp.ellipk(k * k)), (lambda k: mp.ellipe(k * k))


def fl(*values):
    return [float(v) for v in values]


def end(k0, n1, n3):
    """theta, theta', x (across), z (along) at s = 1."""
    return plane_ode(float(k0), float(n1), float(n3))[:4]


def apart(a, b):
    return max(abs(float(x) - float(y)) for x, y in zip(a, b))


def b1():
    root = lambda guess: mp.findroot(lambda x: mp.sin(x) - x * mp.cos(x), guess)
    tans = [root(g) for g in (4.49, 7.72, 10.9)]
    sines = [2 * mp.pi, 2 * tans[0], 4 * mp.pi]
    return {'inputs': 'Euler loads P in growing order, L = EI = 1',
            'outputs': {'clamped_free': fl(*[(mp.pi * (2 * i + 1) / 2) ** 2 for i in range(3)]), 'pinned': fl(mp.pi ** 2),
                        'clamped_pinned': fl(*[x * x for x in tans]), 'clamped_clamped': fl(*[x * x for x in sines])}}


def b2():
    rows = []
    for degrees in (20, 60, 100, 140, 176):
        k = mp.sin(mp.radians(degrees) / 2)
        P, x, y = K(k) ** 2, 2 * E(k) / K(k) - 1, 2 * k / K(k)
        tip = end(2 * k * mp.sqrt(P), 0, -P)
        rows.append({'tip_deg': degrees, 'load': float(4 * P / mp.pi ** 2), 'x': float(x), 'y': float(y),
                     'gap': apart((mp.radians(degrees), 0, y, x), tip)})
    k = mp.findroot(lambda k: 2 * E(k) - K(k), (.9, .92), solver='anderson')
    ends = {'k': float(k), 'load': float(4 * K(k) ** 2 / mp.pi ** 2), 'gap': abs(float(end(2 * k * K(k), 0, -K(k) ** 2)[3]))}
    return {'inputs': 'clamped-free under a dead axial load; load: P/Pcr; pinned elastica whose ends meet: P/P_E', 'outputs': rows, 'ends_meet': ends}


def b3():
    rows = []
    for s in ('.01', '.1', '.3', '.75'):
        k = mp.findroot(lambda k: 2 - 2 * E(k) / K(k) - mp.mpf(s), (mp.sqrt(mp.mpf(s)) * .7, mp.sqrt(mp.mpf(s))), solver='anderson')
        P = 16 * K(k) ** 2
        tip = end(8 * K(k) * k, 0, -P)
        rows.append({'s': float(s), 'load': float(P), 'deflection': float(k / K(k)), 'gap': apart((0, 8 * K(k) * k, 0, 1 - mp.mpf(s)), tip)})
    return {'inputs': 'both ends clamped, end shortening s; P = 16 K^2, deflection of the middle k/K', 'outputs': rows}


def b4():
    rows = []
    for P, guess in ((mp.mpf('.2'), .1), (1, .46), (3, .99), (10, 1.43)):
        def parts(a):
            p = mp.sqrt((1 + mp.sin(a)) / 2)
            return p, mp.asin(1 / (p * mp.sqrt(2)))
        a = mp.findroot(lambda a: K(parts(a)[0]) - mp.ellipf(parts(a)[1], parts(a)[0] ** 2) - mp.sqrt(P), guess)
        p, f = parts(a)
        w, u = 1 - 2 * (E(p) - mp.ellipe(f, p * p)) / mp.sqrt(P), 1 - mp.sqrt(2 * mp.sin(a) / P)
        tip = end(mp.sqrt(2 * P * mp.sin(a)), P, 0)
        rows.append({'P': float(P), 'w': float(w), 'u': float(u), 'angle': float(a), 'gap': apart((a, 0, w, 1 - u), tip)})
    return {'inputs': 'cantilever under a transverse dead load at its end: deflection w, shortening u, angle of the end', 'outputs': rows}
