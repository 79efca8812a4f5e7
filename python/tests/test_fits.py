"""Fits: columns, ranges and what cannot be told reach the library and come back."""

import json
import os
import subprocess

import numpy as np
import pytest

import snaprod

SWING = {
    "rod": {"model": "elastica", "length": 1.0, "bending_stiffness": 2.0},
    "body": {"mass": 1.0},
    "start": {"rest": "straight"},
    "run": {"duration": 1.0},
}
OMEGA = "modes.angular_frequencies.0"


def test_a_fit_by_rows_is_the_regression(tmp_path):
    """Catches rows or columns that are mixed up: omega^2 = 3 EI/m, and a file gives what a dict gives."""
    masses = np.array([0.5, 1.0, 2.0, 4.0])
    omega = np.sqrt(3.0 * 1.3 / masses) + [0.01, -0.02, 0.005, 0.01]
    g = np.sqrt(3.0 / masses)
    root = g @ omega / (g @ g)
    found = snaprod.fit(
        SWING, {"body.mass": masses, OMEGA: omega}, {"rod.bending_stiffness": (0.5, 4.0)}, by_row=["body.mass"], starts=1
    )
    path = "rod.bending_stiffness"
    assert found.values[path] == pytest.approx(root**2, rel=1e-7)
    error = np.sqrt(((omega - root * g) ** 2).sum() / 3 / (g @ g))
    assert found.standard_errors[path] == pytest.approx(2 * root * error, rel=1e-5)
    low, high = found.intervals[path]
    assert low < found.values[path] < high
    np.testing.assert_allclose(found[f"{OMEGA}.left"], omega - root * g, atol=1e-7)
    file = tmp_path / "data.csv"
    lines = [f"{m!r},{w!r}" for m, w in zip(masses.tolist(), omega.tolist())]
    file.write_text("# measured\nbody.mass," + OMEGA + "\n" + "\n".join(lines) + "\n")
    again = snaprod.fit(SWING, file, {"rod__bending_stiffness": "0.5:4"}, by_row="body.mass", starts=1)
    assert again.values == found.values
    # By the given path, or any equivalent spelling.
    assert again.values["rod__bending_stiffness"] == again.values[path] and again.intervals["rod__bending_stiffness"]
    with pytest.raises(KeyError, match="the fit has the fields rod.bending_stiffness"):
        again.values["rod.length"]
    assert len(found.plot().lines) == 2


def test_a_motion_is_fitted_and_drawn(snap):
    """Catches times that are not those of the data, and a curve that is another motion."""
    snap["run"] = {"duration": 0.4, "samples": 9, "tolerance": 1e-10}
    snap["start"] = {"lambda": 3.0, "p": 0.5}
    run = snaprod.run(snap, rod__bending_stiffness=1.4)
    data = run.to_pandas()[["t", "y", "vx"]]
    data.loc[3, "y"] = np.nan
    found = snaprod.fit(snap, data, {"rod.bending_stiffness": (1.0, 3.0)}, starts=1)
    assert found.values["rod.bending_stiffness"] == pytest.approx(1.4, rel=1e-7)
    curve = found.tables["curve"]
    at = np.searchsorted(curve["t"], run["t"])
    np.testing.assert_allclose(curve["y"][at], run["y"], atol=1e-8)
    assert len(found.plot(name="vx").lines) == 2
    with pytest.raises(ValueError, match="compares y, vx"):
        found.plot(name="x")


def test_what_is_wrong_is_said(tmp_path):
    """Catches a message without the name of what is meant, and files that are read otherwise than by the program."""
    data = {"t": [0.0, 0.1], "x": [1.0, 0.9]}
    file = tmp_path / "film.csv"
    for text, message in {
        "t,x,x\n0,1,1\n": "the data have two columns x",
        "t,x\n0,1_000\n": "line 2 of the data, x = 1_000: not a number",
        "t,x\n0,inf\n": "line 2 of the data, x = inf: not a number",
        "# film\nt,x\n\n0\n": "line 4 of the data has 1 cells, the line of names 2",
        "0,1\n": "the data begin with numbers",
    }.items():
        file.write_text(text)
        with pytest.raises(snaprod.SceneError, match=f"film.csv: {message}"):
            snaprod.fit(SWING, file, {"body.mass": (1, 2)})
    with pytest.raises(TypeError, match="data = None: must be"):
        snaprod.fit(SWING, None, {"body.mass": (1, 2)})
    with pytest.raises(TypeError, match="free: body.mass = 1: must be"):
        snaprod.fit(SWING, data, {"body.mass": 1})
    with pytest.raises(ValueError, match="seed = -1"):
        snaprod.fit(SWING, data, {"body.mass": (1, 2)}, seed=-1)
    with pytest.raises(ValueError, match="as many numbers"):
        snaprod.fit(SWING, {"t": [0.0], "x": [1.0, 2.0]}, {"body.mass": (1, 2)})
    with pytest.raises(snaprod.SceneError, match="FROM is not below TO"):
        snaprod.fit(SWING, data, {"body.mass": (2, 1)})
    with pytest.raises(ValueError, match="data: there is no column"):
        snaprod.fit(SWING, {}, {"body.mass": (1, 2)})
    with pytest.raises(TypeError, match="noise = 0.1: must be a dict"):
        snaprod.fit(SWING, data, {"body.mass": (1, 2)}, noise=0.1)
    with pytest.raises(TypeError, match="noise: x = 'a': must be"):
        snaprod.fit(SWING, data, {"body.mass": (1, 2)}, noise={"x": "a"})
    with pytest.raises(snaprod.SceneError, match="run.samples is a whole number, which a search"):
        snaprod.fit(SWING, data, {"run.samples": (2, 9)})
    with pytest.raises(ValueError, match="starts = 0"):
        snaprod.fit(SWING, data, {"body.mass": (1, 2)}, starts=0)
    both = snaprod.fit(
        SWING, {OMEGA: [1.7, 1.8, 1.75]}, {"body.mass": (0.5, 2), "rod.bending_stiffness": (0.5, 2)}, starts=1
    )
    assert both.standard_errors == {"body.mass": None, "rod.bending_stiffness": None} and both.remarks


def test_what_is_masked_was_not_measured():
    """Catches masked numbers that are taken as measured, here 1e6, and infinite ones that leave the middle of the range as the best."""
    masses = np.array([0.5, 1.0, 2.0, 4.0])
    omega = np.sqrt(3.0 * 1.3 / masses)
    free = {"rod.bending_stiffness": (0.5, 4.0)}
    masked = np.ma.masked_greater(np.append(omega, 1e6), 1e5)
    found = snaprod.fit(SWING, {"body.mass": [*masses, 1.0], OMEGA: masked}, free, by_row="body.mass", starts=1)
    assert found.values["rod.bending_stiffness"] == pytest.approx(1.3, rel=1e-7)
    assert found.summary["columns"][0]["points"] == 4
    with pytest.raises(snaprod.SceneError, match="row 2 of the data, .* = inf: must be finite"):
        snaprod.fit(SWING, {"body.mass": masses[:2], OMEGA: [1.7, np.inf]}, free, by_row="body.mass")
    with pytest.raises(snaprod.SceneError, match="every position must be finite"):
        snaprod.equilibria(np.ma.array([0.3, 0.5], mask=[False, True]), 0.2)


def test_searches_are_those_of_the_program(snap, tmp_path):
    """Catches searches on threads that are lost, made twice or told in the order in which they end: the record is the program's."""
    program = os.environ.get("SNAPROD_PROGRAM")
    if not program:
        pytest.skip("SNAPROD_PROGRAM does not name the program")
    scene, film = tmp_path / "bent.toml", tmp_path / "film.csv"
    rod = 'model = "elastica", length = 1.0, bending_stiffness = 1.0'
    scene.write_text(f"rod = {{ {rod} }}\nbody.mass = 1.0\nstart = {{ lambda = 3.0, p = 0.5 }}\nrun.duration = 1.0\n")
    film.write_text("t,x,y\n0.1,0.53,0.6\n0.2,0.6,0.55\n0.3,0.7,0.5\n0.4,0.8,0.4\n")
    asked = ["--free", "rod.bending_stiffness=0.01:1000", "--starts", "7", "--seed", "3", "--json", "--no-figures"]
    ran = subprocess.run(
        [program, "fit", str(scene), str(film), *asked, "--out", str(tmp_path / "out")], check=True, capture_output=True
    )
    told = []
    found = snaprod.fit(
        scene, film, {"rod.bending_stiffness": (0.01, 1000)}, starts=7, seed=3, progress=lambda part, done: told.append(done)
    )
    assert found.summary == json.loads(ran.stdout) and told[-1] == 7.0
