"""Accuracy of a cantilever under a transverse dead force F against the closed form; the table of docs/validation/rods.md.

Run from the repository with the program built: python tools/rod_pull.py
"""

import json
import subprocess
import tempfile

from mpmath import asin, ellipe, ellipf, exp, mp, mpf, pi, sin, sqrt

mp.dps = 40
LOADS = ["2", "5", "8", "10", "12", "15", "18", "20", "22", "23.5", "40", "100"]
SCENE = """[rod]
model = "cosserat"
length = 1.0
[rod.section]
bending = [1.0, 1.0]
torsion = 1.0
[end]
force = [{force}, 0.0, 0.0]
[solve]
tolerance = {tolerance}
path = "{path}"
"""


def exact(lam):
    """Position (across, along) of the end: Bisshopp & Drucker 1945, with m = (1 + sin theta(1))/2."""

    def modulus(t):
        end = pi / 2 - exp(t)
        return (1 + sin(end)) / 2, asin(sqrt(1 / (1 + sin(end)))), end

    def too_long(t):
        m, phi, _ = modulus(t)
        return ellipf(pi / 2, m) - ellipf(phi, m) > lam

    low, high = mpf(-60), mpf("0.45")
    for _ in range(200):
        middle = (low + high) / 2
        low, high = (middle, high) if too_long(middle) else (low, middle)
    m, phi, end = modulus(low)
    return 1 - 2 / lam * (ellipe(pi / 2, m) - ellipe(phi, m)), sqrt(2 * sin(end)) / lam


def error(lam, path, tolerance):
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as scene:
        scene.write(SCENE.format(force=float(lam) ** 2, tolerance=tolerance, path=path))
        scene.flush()
        command = ["target/release/snaprod", "equilibrium", scene.name, "--json"]
        done = subprocess.run(command, capture_output=True, text=True)
    if done.returncode:
        return "refused"
    x, _, z = json.loads(done.stdout)["position"]
    across, along = exact(mpf(lam))
    return f"{float(max(abs(x - across), abs(z - along))):.1e}"


print("| lam | closed form, tolerance 1e-10 | in space, 1e-10 | in space, 1e-13 |")
for lam in LOADS:
    ways = [("closed-form", "1e-10"), ("spatial", "1e-10"), ("spatial", "1e-13")]
    print("|", " | ".join([lam, *(error(lam, *way) for way in ways)]), "|")
