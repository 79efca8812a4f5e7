"""Rods under lists of loads, for tests/data/load_list.json: python3 tools/ref_load_list.py > tests/data/load_list.json

A second derivation, apart from the program: director components of couple and force are integrated from the clamp,

    m' = -u x m - v x n - l,   n' = -u x n - f,   R' = R hat(u),   r' = R v,   u = K^-1 m,   v = e3,

all in directors, with f and l turned into the directors where they are dead. A load at a station is a jump of m and n
there. Shooting on (m(0), n(0)), Newton with differences; every rod starts from the unloaded one, the loads grow.
"""

import json

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import root

K = np.array([1.0, 1.5, 0.8])
E3 = np.array([0.0, 0.0, 1.0])


def rotation(q):
    w, x, y, z = q / np.linalg.norm(q)
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def local(load, R, part, what):
    """Force or couple of a load along the directors."""
    x = part * np.array(load.get(what, [0.0, 0.0, 0.0]))
    return x if load.get("follows") else R.T @ x


def shoot(base, loads, part):
    """State at the end: q, r, m, n (m and n along the directors, before the loads on the end), energy."""
    cuts = {0.0, 1.0}
    for load in loads:
        cuts.update([load["s"]] if "s" in load else [load["from"], load["to"]] if "from" in load else [])
    cuts = sorted(cuts)
    y = np.concatenate([[1.0, 0, 0, 0], np.zeros(3), base, [0.0]])
    for a, b in zip(cuts, cuts[1:]):
        R = rotation(y[:4])
        for load in loads:
            if load.get("s") == a:
                y[7:10] -= local(load, R, part, "couple")
                y[10:13] -= local(load, R, part, "force")
        here = [load for load in loads if "from" in load and load["from"] <= a and load["to"] >= b]

        def slope(s, y):
            q, m, n = y[:4], y[7:10], y[10:13]
            R, u = rotation(q), y[7:10] / K
            l = sum((local(load, R, part, "couple") for load in here), np.zeros(3))
            f = sum((local(load, R, part, "force") for load in here), np.zeros(3))
            w, v = q[0], q[1:]
            dq = 0.5 * np.concatenate([[-v @ u], w * u + np.cross(v, u)])
            dm = -np.cross(u, m) - np.cross(E3, n) - l
            dn = -np.cross(u, n) - f
            return np.concatenate([dq, R[:, 2], dm, dn, [0.5 * m @ u]])

        y = solve_ivp(slope, (a, b), y, method="DOP853", rtol=3e-14, atol=1e-15).y[:, -1]
    return y


def missed(base, loads, part):
    y = shoot(base, loads, part)
    R = rotation(y[:4])
    m, n = y[7:10].copy(), y[10:13].copy()
    for load in loads:
        if load.get("on") == "end":
            m -= local(load, R, part, "couple")
            n -= local(load, R, part, "force")
    return np.concatenate([m, n])


def solve(loads):
    base = np.zeros(6)
    for part in np.linspace(0.1, 1.0, 10):
        found = root(missed, base, args=(loads, part), tol=1e-13, options={"eps": 1e-7, "xtol": 1e-14})
        base = found.x
    # Newton's last steps with central differences.
    for _ in range(3):
        h = 1e-5
        columns = [(missed(base + h * e, loads, 1.0) - missed(base - h * e, loads, 1.0)) / (2 * h) for e in np.eye(6)]
        base = base - np.linalg.solve(np.array(columns).T, missed(base, loads, 1.0))
    left = np.abs(missed(base, loads, 1.0)).max()
    assert left < 1e-11, left
    y = shoot(base, loads, 1.0)
    q = y[:4] / np.linalg.norm(y[:4])
    return {
        "end": list(y[4:7]),
        "quaternion": list(q if q[0] >= 0 else -q),
        "base_couple": list(base[:3]),
        "base_force": list(base[3:]),
        "energy": y[13],
        "residual": left,
    }


CASES = {
    "dead force at a station": [{"s": 0.6, "force": [1.0, -2.0, 0.5]}],
    "dead couple at a station": [{"s": 0.35, "couple": [0.7, -0.4, 0.9]}],
    "follower force at a station": [{"s": 0.6, "force": [1.2, -1.0, 0.8], "follows": True}],
    "follower couple at a station, dead force on the end": [
        {"s": 0.45, "couple": [0.5, 0.6, -0.7], "follows": True},
        {"on": "end", "force": [0.3, 0.4, -0.6]},
    ],
    "along a part": [
        {"from": 0.2, "to": 0.7, "force": [0.5, 0.8, -1.5]},
        {"from": 0.5, "to": 1.0, "couple": [0.4, -0.3, 0.6]},
    ],
    "following along a part": [
        {"from": 0.1, "to": 0.8, "force": [1.5, 0.8, 0.4], "follows": True},
        {"from": 0.0, "to": 0.55, "couple": [0.4, -0.9, 0.6], "follows": True},
    ],
    "all at once, mixed on the end": [
        {"on": "end", "force": [0.4, -0.5, 0.3], "couple": [0.1, 0.2, -0.3]},
        {"on": "end", "force": [0.2, 0.6, -0.4], "couple": [-0.3, 0.1, 0.2], "follows": True},
        {"s": 0.25, "force": [-0.7, 0.2, 0.4], "couple": [0.2, 0.3, 0.1]},
        {"s": 0.25, "force": [0.5, -0.3, 0.6], "follows": True},
        {"from": 0.3, "to": 0.9, "force": [0.3, 0.2, -0.8]},
    ],
}

if __name__ == "__main__":
    cases = [{"name": name, "loads": loads, **solve(loads)} for name, loads in CASES.items()]
    print(json.dumps(cases, indent=1))
