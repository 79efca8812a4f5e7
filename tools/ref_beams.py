"""Frequencies of straight Timoshenko beams of length and mass 1: zeros of the determinant of the transfer matrix.

    python3 tools/ref_beams.py        (mpmath; writes tests/data/beams.json)

Deflection w, turn p, couple M and shear force V of a vibration of frequency f are, with bending stiffness EI, shear
stiffness GA (none: unshearable) and rotary inertia J per length,

    w' = p + V/GA,   p' = M/EI,   M' = -V - f^2 J p,   V' = -f^2 w.

The matrix exponential over the length takes one end to the other. A clamp holds w and p, a free end has M = V = 0.
"""

import json
from pathlib import Path

from mpmath import det, expm, findroot, inf, matrix, mp, mpf

mp.dps = 40
CASES = [("cantilever", inf, 0), ("free", inf, 0), ("cantilever", 400, mpf("2e-3")), ("free", 400, mpf("2e-3"))]


def defect(kind, shear, rotary, f):
    slope = matrix([[0, 1, 0, 1 / mpf(shear)], [0, 0, 1, 0], [0, -(f**2) * rotary, 0, -1], [-(f**2), 0, 0, 0]])
    across = expm(slope)
    first = 2 if kind == "cantilever" else 0
    return det(across[2:4, first : first + 2])


def frequencies(kind, shear, rotary, count=4):
    found, f, step = [], mpf("0.5"), mpf("0.5")
    before = defect(kind, shear, rotary, f)
    while len(found) < count:
        after = defect(kind, shear, rotary, f + step)
        if before * after < 0:
            root = findroot(lambda x: defect(kind, shear, rotary, x), (f, f + step), solver="anderson")
            found.append(float(root))
        f, before = f + step, after
    return found


rows = [
    {
        "ends": kind,
        "shear": None if shear == inf else float(shear),
        "rotary": float(rotary),
        "frequencies": frequencies(kind, shear, rotary),
    }
    for kind, shear, rotary in CASES
]
path = Path(__file__).parent.parent / "tests" / "data" / "beams.json"
path.write_text(json.dumps(rows, indent=1) + "\n")
