"""Reference of a mass on a planar elastica whose rod touches a wall and leaves it: tests/data/contact/rod_touch.json.

Equilibria at a given place of the end are solved by shooting from the clamp with scipy's DOP853, the wall as a jump
of the force at an unknown place, Jacobians by complex step. The motion is integrated with these forces, and the
events are roots of the gap and of the reaction. Units EI = L = m = 1; the wall is y <= H.
"""
import json, sys
import numpy as np
from scipy.integrate import solve_ivp, DOP853
from scipy.optimize import brentq

H = 0.1
START, SPEED, END = (0.975, 0.0), (-0.8, 0.05), 0.05
TOL = dict(method="DOP853", rtol=1e-13, atol=1e-14)


def piece(y0, n, length):
    def slope(s, y):
        x, z, th, k = y
        return np.array([np.cos(th), np.sin(th), k, n[0] * np.sin(th) - n[1] * np.cos(th)])
    if length == 0:
        return y0
    # The arclength is scaled, so that a complex length is allowed.
    found = solve_ivp(lambda s, y: slope(s, y) * length, (0.0, 1.0), y0.astype(complex), **TOL)
    return found.y[:, -1]


def residual(u, pose, touches):
    y = np.array([0, 0, 0, u[0]], dtype=complex)
    n = [u[1], u[2]]
    if not touches:
        y = piece(y, n, 1.0)
        return np.array([y[3], y[0] - pose[0], y[1] - pose[1]])
    y = piece(y, n, u[4])
    gap, slope = H - y[1], np.sin(y[2])
    y = piece(y, [n[0], n[1] + u[3]], 1.0 - u[4])  # the wall pushes along -y: n falls by R (0, -1)
    return np.array([y[3], y[0] - pose[0], y[1] - pose[1], gap, slope])


def solve(u, pose, touches):
    for _ in range(12):
        value = residual(u.astype(complex), pose, touches)
        jac = np.empty((len(u), len(u)))
        for j in range(len(u)):
            moved = u.astype(complex)
            moved[j] += 1e-30j
            jac[:, j] = residual(moved, pose, touches).imag / 1e-30
        step = np.linalg.solve(jac, value.real)
        u = u - step
        if np.max(np.abs(step)) < 1e-9 * (1 + np.max(np.abs(u))):
            return u
    raise RuntimeError("no convergence")


def force(u, touches):
    return np.array([-u[1], -u[2] - (u[3] if touches else 0.0)])


def crest(u):
    """Place of the highest section of the free rod between its ends, and its height."""
    def slope(s, y):
        return [np.cos(y[2]), np.sin(y[2]), y[3], u[1] * np.sin(y[2]) - u[2] * np.cos(y[2])]
    found = solve_ivp(slope, (0, 1), [0, 0, 0, u[0]], dense_output=True, **TOL)
    s = np.linspace(0.05, 0.95, 91)
    k = int(np.argmax(found.sol(s)[1]))
    s = brentq(lambda s: np.sin(found.sol(s)[2]), s[k] - 0.01, s[k] + 0.01, xtol=1e-15)
    return s, found.sol(s)[1]


class Sheet:
    def __init__(self, u, touches):
        self.u, self.touches = u, touches

    def slope(self, t, y):
        self.u = solve(self.u, y[:2], self.touches)
        return np.concatenate([y[2:], force(self.u, self.touches)])


def follow(sheet, t, y, event, end, rtol):
    """Integrates to the first sign change of event, from positive to negative, or to the end."""
    solver = DOP853(sheet.slope, t, y, end, rtol=rtol, atol=rtol, first_step=1e-4, max_step=2e-3)
    before = event(sheet, y)
    while solver.status == "running":
        solver.step()
        after = event(sheet, solver.y)
        if before > 0 and after <= 0:
            dense = solver.dense_output()
            t = brentq(lambda t: event(sheet, dense(t)), solver.t_old, solver.t, xtol=1e-16, rtol=1e-15)
            # The step is taken again to the event: the event has the accuracy of the integration.
            start = dense(solver.t_old)
            last = DOP853(sheet.slope, solver.t_old, start, t, rtol=rtol, atol=rtol)
            while last.status == "running":
                last.step()
            return t, last.y, True
        before = after if abs(after) > 1e-11 else max(after, 1e-30)
    return solver.t, solver.y, False


def gap(sheet, y):
    sheet.u = solve(sheet.u, y[:2], False)
    return H - crest(sheet.u)[1]


def reaction(sheet, y):
    sheet.u = solve(sheet.u, y[:2], True)
    return sheet.u[3]


def run(rtol):
    given = json.load(open(sys.argv[1]))["touch"]
    fx, fy = given["force_on_mass"]
    pose = np.array([given["X"], 0.0])
    u = np.array([pose[0] * -fy, -fx, -fy])
    u = solve(u, pose, False)
    for x in np.linspace(pose[0], START[0], 6)[1:]:
        u = solve(u, [x, START[1]], False)
    start = u.copy()
    y, t, told = np.array([*START, *SPEED]), 0.0, []
    t, y, _ = follow(Sheet(u, False), t, y, gap, END, rtol)
    u = solve(u, y[:2], False)
    s, _ = crest(u)
    told.append(dict(kind="touch", t=t, s=s, state=list(y), force=list(force(u, False))))
    u = solve(np.array([*u, 0.0, s]), y[:2], True)
    sheet = Sheet(u, True)
    # The largest reaction, on the way.
    t, y, _ = follow(sheet, t, y, lambda q, y: reaction(q, y) + 1e-13, END, rtol)
    u = solve(sheet.u, y[:2], True)
    told.append(dict(kind="release", t=t, s=u[4], state=list(y), force=list(force(u, True))))
    u = solve(u[:3], y[:2], False)
    sheet = Sheet(u, False)
    t, y, _ = follow(sheet, t, y, lambda q, y: 1.0, END, rtol)
    return dict(start=dict(pose=list(START), velocity=list(SPEED), base=list(start)), events=told,
                end=dict(t=t, state=list(y)))


def spread(a, b):
    flat = lambda r: np.array([r["end"]["state"], *[e["state"] for e in r["events"]]])
    times = max(abs(x["t"] - y["t"]) for x, y in zip(a["events"], b["events"]))
    return dict(times=times, states=float(np.max(np.abs(flat(a) - flat(b)))))


fine, coarse = run(1e-12), run(1e-11)
fine.update(wall=H, spread=spread(fine, coarse), recipe="tools/ref_rod_touch.py tip_wall_given.json")
json.dump(fine, open(sys.argv[2], "w"), indent=1)
print(json.dumps(fine, indent=1))
