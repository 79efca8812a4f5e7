"""Writes the notebooks from the cells below, without outputs: `python make.py`. CI executes them."""

import json
from pathlib import Path

FIRST_SNAP = [
    """# The first snap and its ledger

A mass hangs on the end of an elastic rod that is clamped at the origin. It is thrown downwards, and pushes its rod over a fold: the
equilibrium that the rod was in ceases to exist, and the rod falls to another one.""",
    '''import numpy as np
import snaprod

scene = {
    "rod": {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0},
    "body": {"mass": 1.0},
    "start": {"lambda": 6.3, "kappa": 0.6, "velocity": [0.0, -0.5]},
    "run": {"duration": 3.0, "tolerance": 1e-10},
}
run = snaprod.run(scene)
run''',
    """The snap is located by a root of a smooth function, so its time is good to the tolerance of the run, not to a sample.""",
    '''snap = run.events[0]
print(f"t = {snap['t']:.12f}, released {snap['released']:.9f}")
assert abs(snap["t"] - 0.025570197858) < 1e-10''',
    """The rod just before and just after, at exact times: the place of the mass is the same, the rod is another one.""",
    '''before, after = run.shape([snap["t"] - 1e-9, snap["t"] + 1e-9], n=101)
axes = snaprod.elastica(lam=6.3, kappa=0.6).plot()
axes.lines[0].set_label("start")
axes.plot(*before[:, :2].T, label="before")
axes.plot(*after[:, :2].T, label="after")
axes.legend()
assert np.hypot(*(before[-1] - after[-1])[:2]) < 1e-6''',
    """What the rod releases is dissipated; the ledger *kinetic + elastic + potential + dissipated - work* is computed, never imposed, so that its
closing is a measurement.""",
    '''run.plot_energy()
assert np.ptp(run["total"]) < 1e-7''',
    """Results are arrays with units and meanings, and go on to pandas and xarray.""",
    '''run.to_xarray()[["x", "y", "lam"]]''',
    """Why it had to snap: at the place of the snap the equilibrium that the rod was in meets an unstable one on the fold curve.""",
    '''axes = snaprod.folds(1).plot()
axes.plot(run["x"], run["y"], lw=0.8)
axes.plot(*before[-1, :2], "r*", ms=10)
found = snaprod.equilibria(run["x"][::40], run["y"][::40], lambda_max=12.0)
found.stable''',
]

BRANCH = [
    """# A branch with its folds

A straight rod in space, clamped at one end, is pressed at its free end by a dead force along itself that grows: Morse index and special points of every
equilibrium. Unstable parts are dashed.""",
    '''import numpy as np
import snaprod

column = {
    "rod": {"model": "cosserat", "length": 1.0, "section": {"bending": [1.5, 1.0], "torsion": 0.8}},
    "end": {"force": [0.0, 0.0, -1.0]},
    "continue": {"parameter": "end.load", "from": 0.0, "to": 4.0, "switch": True},
}
branch = snaprod.branch(column)
branch''',
    """The first branch point is Euler's load pi^2/4 of the weaker direction; the bound of its error is printed with it.""",
    '''euler = branch.special_points[0]
print(euler["label"], euler["parameter"], "+-", euler["precision"])
assert abs(euler["parameter"] - np.pi**2 / 4) < 1e-8''',
    """A planar elastica whose end is pushed back: stable in its plane up to a fold, in space only up to a bifurcation that comes long
before.""",
    '''lateral = snaprod.branch("../../scenes/lateral.toml")
axes = lateral.plot()
for at in lateral.special_points:
    print(at["label"], at["kind"], at["parameter"])''',
    '''parameter, unstable, rod = lateral.shapes[-1]
print(f"{lateral.parameter} = {parameter:.4f}, unstable: {unstable}")
rod[[0, -1]]''',
]

SWEEP = [
    """# A sweep

One scene with two of its fields varied: how hard the mass is thrown, and how heavy it is. Rows are made in chunks on all cores; whatever ends
the sweep, the same call goes on with what is missing.""",
    '''import tempfile

import numpy as np
import snaprod

scene = {
    "rod": {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0},
    "body": {"mass": 1.0},
    "start": {"lambda": 6.3, "kappa": 0.6, "velocity": [0.0, -0.5]},
    "run": {"duration": 1.0, "tolerance": 1e-9},
}
vary = {"start.velocity.1": np.linspace(-2.0, 2.0, 12), "body.mass": "log:0.2:5:12"}
directory = tempfile.mkdtemp()
swept = snaprod.sweep(scene, vary, columns=["outcome", "end.x", "snaps", "events.0.t", "energy_error.relative"], out=directory)
swept''',
    '''axes = swept.plot(name="snaps")
axes.set_yscale("log")''',
    """The rows are those of runs, and a second call runs nothing.""",
    '''again = snaprod.sweep(scene, vary, columns=swept.quantities, out=directory)
assert np.array_equal(again["snaps"], swept["snaps"])
assert swept["energy_error.relative"].max() < 1e-6
table = swept.to_pandas()
table.groupby("snaps")["events.0.t"].describe()''',
]

FIT = [
    """# From measurement to parameters

A strip with a mass at its end is bent, let go and filmed. Which bending stiffness and which damping has it? The film is made here, with errors of 0.3 mm along
x and 0.5 mm along y, and some pictures of which x could not be read.""",
    '''import numpy as np
import snaprod

strip = {
    "rod": {"model": "elastica", "length": 0.2, "bending_stiffness": 0.05, "damping": 5e-4},
    "body": {"mass": 0.1},
    "start": {"lambda": 3.0, "p": 0.5},
    "run": {"duration": 1.0, "samples": 51},
}
truth = snaprod.run(strip)
chance = np.random.default_rng(7)
film = {
    "t": truth["t"],
    "x": truth["x"] + 3e-4 * chance.standard_normal(51),
    "y": truth["y"] + 5e-4 * chance.standard_normal(51),
}
film["x"][chance.random(51) < 0.1] = np.nan''',
    """What is searched has a range; damping is searched by its logarithm. Nothing is known of the noise, so every column is weighted by what is left of it.""",
    '''free = {"rod.bending_stiffness": (0.02, 0.1), "rod.damping": "log:1e-4:1e-2"}
found = snaprod.fit(strip, film, free, starts=2)
found''',
    """Values with their standard errors, and the noise that was estimated.""",
    '''for path, value in found.values.items():
    low, high = found.intervals[path]
    print(f"{path} = {value:.6g}, 95 % between {low:.6g} and {high:.6g}")
for column in found.summary["columns"]:
    print(f"noise of {column['name']}: {column['noise']:.2e}")
assert abs(found.values["rod.bending_stiffness"] / 0.05 - 1) < 2e-3
assert abs(found.values["rod.damping"] / 5e-4 - 1) < 1e-2''',
    """What is left should be noise: no trend, no period.""",
    '''import matplotlib.pyplot as plt

figure, (above, below) = plt.subplots(2, sharex=True)
found.plot(above, name="y")
below.axhline(0.0, color="grey", lw=0.8)
below.plot(found["t"], found["y.left"], ".")
below.set(xlabel="t (s)", ylabel="data - model (m)")''',
    """The same by the natural frequency with several masses: every row is a scene of its own. Frequencies alone tell stiffness over mass; free both,
and the fit says that it cannot tell them apart.""",
    '''swing = strip | {"start": {"rest": "straight"}}
masses = np.array([0.05, 0.1, 0.2])
omega = np.sqrt(3 * 0.05 / (masses * 0.2**3)) * (1 + 1e-3 * chance.standard_normal(3))
rows = {"body.mass": masses, "modes.angular_frequencies.0": omega}
alone = snaprod.fit(swing, rows, {"rod.bending_stiffness": (0.02, 0.1)}, by_row=["body.mass"], starts=1, rod__damping=0.0)
both = snaprod.fit(
    swing, {"modes.angular_frequencies.0": omega[:2]}, {"rod.bending_stiffness": (0.02, 0.1), "body.mass": (0.05, 0.2)}, starts=1, rod__damping=0.0
)
print(alone)
print(both.remarks[0])
assert abs(alone.values["rod.bending_stiffness"] / 0.05 - 1) < 1e-2''',
]

KERNEL = {"display_name": "Python 3", "language": "python", "name": "python3"}

STEPPING = [
    """# Stepping and control

A motion that is stepped: its state can be looked at, saved, steered. Here an upright strip carries a mass that buckles it, and leans to one side.""",
    '''import matplotlib.pyplot as plt
import numpy as np
import snaprod

euler = np.pi**2 / 4
strip = {
    "rod": {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0},
    "clamp": {"angle": np.pi / 2},
    "body": {"mass": 1.0},
    "loads": {"dead": [0.0, -1.5 * euler], "drag": 1.0},
    "start": {"lambda": np.sqrt(1.5 * euler), "kappa": 0.7},
    "run": {"duration": 100.0, "tolerance": 1e-9},
}
sim = snaprod.Simulation(strip, push=True)
calm = sim.follow(20.0, 401)
print(f"x = {sim.x:.6f}, speed {np.hypot(sim.vx, sim.vy):.1e}")
leaning = sim.state
leaning''',
    """The state is a small object with all from which the motion goes on. A steered force stays until it is changed. How hard must the mass be pushed
to come over to the other side? A bisection, each try from the same state.""",
    '''def comes_over(force):
    sim.reset(leaning)
    side = np.sign(sim.x)
    sim.push([-side * force, 0.0])
    sim.advance(22.0)
    sim.push([0.0, 0.0])
    sim.advance(40.0)
    return sim.x * side < 0.0

low, high = 0.0, 8.0
for _ in range(20):
    middle = 0.5 * (low + high)
    low, high = (low, middle) if comes_over(middle) else (middle, high)
print(f"a push for 2 units of time must be {high:.4f}")
assert comes_over(high) and not comes_over(low)''',
    """A controller is a function of the simulation. This one pushes to the other side, and brakes there.""",
    '''sim.reset(leaning)
other = -np.sign(sim.x)

def control(now):
    return [4.0 * other, 0.0] if now.x * other < 0.0 else [-1.5 * now.vx, -1.5 * now.vy]

steered = sim.follow(30.0, 401, control=control)
figure, axes = plt.subplots()
axes.plot(calm["t"], calm["x"], label="let go")
axes.plot(steered["t"], steered["x"], label="steered")
axes.set(xlabel="t", ylabel="x")
axes.legend()
assert np.sign(steered["x"][0]) == -np.sign(steered["x"][-1])''',
    """The work of the controller is in the ledger, so that the total stays.""",
    '''total = steered["total"]
print(f"work {steered['work'][-1] - steered['work'][0]:.4f}, the total changes by {np.ptp(total):.1e}")
assert np.ptp(total) < 1e-6''',
    """Loads and friction may change, too. What cannot change is refused by name.""",
    '''sim.set(loads__drag=0.1, loads__dead=[0.0, -1.2 * euler])
freer = sim.follow(60.0, 801)
try:
    sim.set(rod__length=2.0)
except snaprod.SceneError as error:
    print(error)
axes = plt.figure().gca()
axes.plot(freer["x"], freer["y"])
axes.set(xlabel="x", ylabel="y", aspect="equal")''',
]

DESIGN = [
    """# A strip that snaps at a given load

A strip of spring steel is clamped at its foot. Its top slides on a vertical line, and is pressed down by a load that grows. A small couple
at the top bends the strip, so that it comes to a fold and snaps. Which length and thickness make it snap at 5 N?""",
    '''import numpy as np
import snaprod

strip = {
    "units": "si",
    "rod": {
        "model": "cosserat",
        "length": 0.3,
        "material": {"E": 2e11, "nu": 0.3},
        "section": {"rectangle": {"width": 0.02, "thickness": 0.0005}},
    },
    "end": {"force": [0.0, 0.0, -1.0], "couple": [0.002, 0.0, 0.0], "position": [0.0, 0.0, "free"]},
    "continue": {"parameter": "end.load", "from": 0.0, "to": 60.0, "back": True},
}
branch = snaprod.branch(strip)
branch.special("LP1")["parameter"]''',
    """The load of the fold has derivatives by fields of the scene, which the implicit function theorem gives with the branch itself.""",
    '''fields = ["rod.length", "rod.section.rectangle.thickness"]

def fold(length, thickness):
    at = snaprod.branch(strip, by=fields, **dict(zip(fields, [length, thickness]))).special("LP1")
    return at["parameter"], np.array([at["derivatives"][field] for field in fields])

load, slopes = fold(0.3, 0.0005)
print(f"{load:.6f} N; by length {slopes[0]:.6g} N/m, by thickness {slopes[1]:.6g} N/m")''',
    """Differences of two branches confirm them, to the digits that differences have.""",
    '''step = 1e-4
beside = [fold(0.3 * (1 + side * step), 0.0005)[0] for side in (-1, 1)]
difference = (beside[1] - beside[0]) / (2 * 0.3 * step)
assert abs(difference / slopes[0] - 1) < 1e-6''',
    """Newton's method along the gradient, in the logarithms of length and thickness: each step is the least change of shape that the linear
model wants. It finds the strip in a few branches.""",
    '''wanted, shape = 5.0, np.log([0.3, 0.0005])
for step in range(8):
    load, slopes = fold(*np.exp(shape))
    print(f"{step}: {1e3 * np.exp(shape)} mm snap at {load:.9f} N")
    if abs(load - wanted) < 1e-8:
        break
    by_logarithm = slopes * np.exp(shape) / load
    shape += by_logarithm * np.log(wanted / load) / (by_logarithm @ by_logarithm)
assert abs(load - wanted) < 1e-8''',
    """The gradient tells the tolerances of manufacture, too: the load changes by so many percent for one percent of each number.""",
    '''dict(zip(fields, slopes * np.exp(shape) / load))''',
]

SPACE = [
    """# In space, in SI units

A steel wire, 1.5 mm thick, hangs from a clamp and carries a ball of 100 g. Lengths are in metres, forces in newtons, times in seconds.""",
    '''import matplotlib.pyplot as plt
import numpy as np
import snaprod

wire = {
    "units": "si",
    "rod": {"model": "cosserat", "length": 0.4, "material": "steel", "section": {"circle": {"diameter": 1.5e-3}}},
    "clamp": {"position": [0.0, 0.0, 0.5], "quaternion": [0.0, 1.0, 0.0, 0.0]},
    "body": {"mass": 0.1, "joint": "ball"},
    "loads": {"gravity": [0.0, 0.0, -9.81]},
    "start": {"rest": "straight"},
    "run": {"duration": 8.0, "tolerance": 1e-9, "samples": 1201},
}''',
    """First the frequency of small swings. The ball pulls the wire straight, so that the wire is stiffer than a cantilever without pull.""",
    '''small = snaprod.modes(wire)
omega = small.summary["angular_frequencies"][0]
EI = 210e9 * np.pi * 1.5e-3**4 / 64
cantilever = np.sqrt(3 * EI / (0.1 * 0.4**3))
print(f"{omega / (2 * np.pi):.4f} Hz; a cantilever without pull {cantilever / (2 * np.pi):.4f} Hz")
assert omega > cantilever''',
    """Now the ball is held out to the side by 1.2 N, and thrown across. The wire goes round on an ellipse that turns: it is stiffer far out than near
the vertical.""",
    '''thrown = wire | {"start": {"equilibrium": {"force": [1.2, 0.0, -0.981]}, "velocity": [0.0, 0.7, 0.0]}}
run = snaprod.run(thrown)
axes = plt.figure().gca()
axes.plot(run["x"], run["y"], lw=0.8)
axes.set(xlabel="x (m)", ylabel="y (m)", aspect="equal")
run''',
    """The ledger closes: nothing is lost, as the wire has no friction here.""",
    '''print(f"the total of {run['total'][0]:.4f} J changes by {np.ptp(run['total']):.1e} J")
assert np.ptp(run["total"]) < 1e-7''',
    """The wire at three times of the first swing, as its centreline.""",
    '''axes = plt.figure().add_subplot(projection="3d")
for t, rod in zip([0.0, 0.1, 0.2], run.shape([0.0, 0.1, 0.2], n=61)):
    axes.plot(*rod[:, :3].T, label=f"t = {t} s")
axes.set(xlabel="x (m)", ylabel="y (m)", zlabel="z (m)", box_aspect=(1, 1, 1))
axes.legend()''',
    """Friction inside the steel is small and known as a time: the ball comes to rest, and the ledger tells where its energy went.""",
    '''damped = snaprod.run(thrown, rod__damping={"proportional": 2e-3}, run__tolerance=1e-7)
damped.plot_energy()
assert damped["dissipated"][-1] > 0.0''',
]


def write(name: str, cells: list[str]) -> None:
    """Text where a cell begins as prose, code where not."""
    made = []
    for i, source in enumerate(cells):
        code = not source[0].isupper() and source[0] != "#"
        cell = {"cell_type": "code" if code else "markdown", "id": f"cell-{i}", "metadata": {}}
        cell["source"] = source.splitlines(keepends=True)
        made.append(cell | ({"execution_count": None, "outputs": []} if code else {}))
    notebook = {"cells": made, "metadata": {"kernelspec": KERNEL}, "nbformat": 4, "nbformat_minor": 5}
    path = Path(__file__).with_name(name)
    path.write_text(json.dumps(notebook, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write("first_snap.ipynb", FIRST_SNAP)
    write("branch.ipynb", BRANCH)
    write("sweep.ipynb", SWEEP)
    write("fit.ipynb", FIT)
    write("stepping.ipynb", STEPPING)
    write("design.ipynb", DESIGN)
    write("space.ipynb", SPACE)
