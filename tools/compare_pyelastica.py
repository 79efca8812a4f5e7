"""Cost of a rod with all of its mass beside PyElastica, at equal error (docs/validation/mass.md).

A straight rod of mass 0.01 with a point mass 1 at its end is held straight and let go under the dead load (0, -2) on the mass; length and bending stiffness
are 1. Errors are those of the end's place at t = 0.5 against snaprod on 8 nodes at a tolerance of 1e-6. PyElastica's rod can be sheared and stretched: its
section is so thin that this moves the end by less than 1e-4. It has no internal friction, so that neither has any here; the last line is what
snaprod needs for the same motion with friction on 24 nodes, for which explicit steps of PyElastica's rod would have to be a thousand times shorter.

    cargo build --release
    pip install pyelastica
    python tools/compare_pyelastica.py target/release/snaprod
"""

import json
import resource
import subprocess
import sys
import tempfile
import time
from importlib.metadata import version

import elastica as ea
import numpy as np

MASS, LOAD, DURATION, RADIUS = 0.01, -2.0, 0.5, 0.02

SCENE = f"""
[rod]
model = "elastica"
length = 1.0
bending_stiffness = 1.0
mass = {MASS}
inertia = "full"
[body]
mass = 1.0
[start]
rest = "straight"
[loads]
dead = [0.0, {LOAD}]
[run]
duration = {DURATION}
"""


def snaprod(program, tolerance, nodes, friction=0.0):
    with tempfile.NamedTemporaryFile("w", suffix=".toml") as scene, tempfile.TemporaryDirectory() as out:
        scene.write(SCENE)
        scene.flush()
        arguments = ["run", scene.name, "--json", "--no-figures", "--out", out + "/run"]
        arguments += ["--set", f"run.tolerance={tolerance}", "--set", f"rod.nodes={nodes}"]
        if friction:
            arguments += ["--set", f"rod.damping.proportional={friction}"]
        before = children()
        text = subprocess.run([program, *arguments], stdout=subprocess.PIPE, text=True, check=True).stdout
        end = json.loads(text)["end"]
        return np.array([end["x"], end["y"]]), children() - before


def children():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing):
    pass


def pyelastica(elements, duration=DURATION):
    simulator = Simulator()
    area = np.pi * RADIUS**2
    rod = ea.CosseratRod.straight_rod(
        elements,
        np.zeros(3),
        np.array([1.0, 0.0, 0.0]),
        np.array([0.0, 0.0, 1.0]),
        1.0,
        RADIUS,
        MASS / area,
        youngs_modulus=4.0 / (np.pi * RADIUS**4),
        shear_modulus=2.0 / (np.pi * RADIUS**4),
    )
    rod.mass[-1] += 1.0
    simulator.append(rod)
    simulator.constrain(rod).using(
        ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,)
    )
    load = np.array([0.0, LOAD, 0.0])
    simulator.add_forcing_to(rod).using(ea.EndpointForces, np.zeros(3), load, ramp_up_time=1e-9)
    simulator.finalize()
    # Half of what is stable: of the wave of stretching through an element, and of the rotation of an element against its shear.
    wave = np.sqrt(4.0 / RADIUS**2 / MASS)
    rotation = np.sqrt(8.0 / MASS) / RADIUS**2
    steps = int(np.ceil(duration / min(0.5 / elements / wave, 1.0 / rotation)))
    clock = time.process_time()
    stepper, t, dt = ea.PositionVerlet(), np.float64(0.0), np.float64(duration / steps)
    for _ in range(steps):
        t = stepper.step(simulator, t, dt)
    return rod.position_collection[:2, -1].copy(), time.process_time() - clock, steps


def main():
    program = sys.argv[1] if len(sys.argv) > 1 else "target/release/snaprod"
    pyelastica(10, 1e-3)  # compiles
    exact, _ = snaprod(program, 1e-6, 8)
    print(f"PyElastica {version('pyelastica')}, numba {version('numba')}, numpy {np.__version__}; end at {exact}")
    for tolerance, nodes in [(1e-2, 4), (1e-3, 4), (1e-3, 5), (1e-3, 6), (1e-5, 8)]:
        place, seconds = snaprod(program, tolerance, nodes)
        error = np.linalg.norm(place - exact)
        print(f"snaprod    {nodes:3} nodes, tolerance {tolerance:.0e}: error {error:.1e}, {seconds / DURATION:.2f} s per unit of time")
    for elements in [10, 20, 40, 80, 160]:
        place, seconds, steps = pyelastica(elements)
        error = np.linalg.norm(place - exact)
        print(f"PyElastica {elements:3} elements, {steps} steps: error {error:.1e}, {seconds / DURATION:.2f} s per unit of time")
    for tolerance in [1e-6, 1e-8]:
        _, seconds = snaprod(program, tolerance, 24, friction=0.01)
        print(f"snaprod with friction 0.01, 24 nodes, tolerance {tolerance:.0e}: {seconds / DURATION:.2f} s per unit of time")


if __name__ == "__main__":
    main()
