"""Sweeps: the same files whoever makes them."""

import os
import signal
from pathlib import Path

import numpy as np
import pytest

import snaprod
from snaprod import _sweep

VARY = {"start.velocity.1": np.linspace(-1.0, 1.0, 16), "body.mass": "log:0.5:2:8"}
COLUMNS = ["outcome", "end.x", "snaps", "events.-1.t"]


def files(directory: Path) -> dict[str, bytes]:
    found = (path for path in directory.rglob("*") if path.is_file())
    return {str(path.relative_to(directory)): path.read_bytes() for path in found}


def test_a_sweep_is_its_runs(snap, tmp_path):
    """Catches rows of other points, and a directory that is made again or that holds another sweep."""
    vary = {"start.velocity.1": [-0.5, 0.25], "body.mass": [1.0, 2.0, 0.5]}
    swept = snaprod.sweep(snap, vary, columns=COLUMNS, out=tmp_path / "one")
    assert list(swept.data)[1] == "start.velocity.1" and swept["start.velocity[1]"] is swept["start.velocity.1"]
    assert swept.shape == (2, 3) and swept.grid("end.x").shape == (2, 3)
    for row in range(6):
        fields = {name: swept[name][row] for name in ("start.velocity.1", "body.mass")}
        run = snaprod.run(snap, **fields)
        assert swept["end.x"][row] == run.summary["end"]["x"]
        assert swept["snaps"][row] == run.summary["snaps"]
    before = (tmp_path / "one/chunks/000003.csv").stat().st_mtime_ns
    again = snaprod.sweep(snap, vary, columns=COLUMNS, out=tmp_path / "one")
    assert (tmp_path / "one/chunks/000003.csv").stat().st_mtime_ns == before
    np.testing.assert_array_equal(again["end.x"], swept["end.x"])
    # Other values between the same ends make another sweep.
    vary["body.mass"][1] = 1.5
    with pytest.raises(snaprod.SceneError, match="holds another sweep"):
        snaprod.sweep(snap, vary, columns=COLUMNS, out=tmp_path / "one")
    assert swept.plot(name="end.x").collections
    # A map of words has a colour and a name for each word.
    words = swept.plot(name="outcome")
    (bar,) = (axes for axes in words.figure.axes if axes is not words)
    assert [tick.get_text() for tick in bar.get_yticklabels()] == sorted(set(swept["outcome"]))
    random = snaprod.sweep(snap, {"body.mass": "0.5:2"}, random=4, seed=7, columns="end.x")
    assert random.quantities == ["end.x"]
    assert random.shape == (4,) and len(set(random["body.mass"])) == 4
    grid = swept.to_xarray()
    assert dict(grid.sizes) == {"start.velocity.1": 2, "body.mass": 3}
    at = grid.sel({"start.velocity.1": 0.25, "body.mass": 0.5})
    assert float(at["end.x"]) == swept["end.x"][5] and str(at["outcome"].item()) == swept["outcome"][5]
    assert grid["body.mass"].attrs["long_name"] == swept.data.meanings["body.mass"]
    assert dict(random.to_xarray().sizes) == {"point": 4}


def test_what_is_varied_is_kept(snap):
    """Catches a quantity that takes the place of the field of its name, and values without the name of their field."""
    made = type("Made", (), {"names": (["a"], ["a", "b"]), "points": 2, "shape": [2], "described": lambda name: None})
    result = _sweep._result(made, ["a", "a", "b"], [["1", "2"], ["", "x"], ["", ""]])
    assert result["a"].tolist() == [1, 2] and result["b"].tolist() == ["", ""]
    swept = snaprod.sweep({**snap, "units": "si"}, {"body.mass": [1.0, 2.0]}, columns=["end.x", "events.-1.t", "snaps"])
    of = {"body.mass": "kg", "end.x": "m", "events.-1.t": "s", "snaps": "", "point": "", "why": ""}
    assert swept.units == of and swept.data.meanings["end.x"].startswith("position of the end, along x")
    with pytest.raises(TypeError, match="columns = None: must be a name or a list"):
        snaprod.sweep(snap, {"body.mass": [1.0]}, columns=None)
    with pytest.raises(TypeError, match="vary: body.mass = 1.0: give its values"):
        snaprod.sweep(snap, {"body.mass": 1.0})
    with pytest.raises(TypeError, match="vary = None: must be a dict"):
        snaprod.sweep(snap, None)


def test_the_program_and_python_make_the_same_files(snap, tmp_path):
    """Catches a second way to write a sweep: every file of Python is the program's, to the byte."""
    program = os.environ.get("SNAPROD_PROGRAM")
    if not program:
        pytest.skip("SNAPROD_PROGRAM does not name the program")
    import subprocess

    text = (Path(__file__).parents[2] / "scenes/snap.toml").read_text()
    scene = tmp_path / "snap.toml"
    scene.write_text(text)
    arguments = ["--vary", "start.velocity.1=-1:1:5", "--vary", "body.mass=[1.0, 2.0]", "--column", "end.x"]
    subprocess.run([program, "sweep", str(scene), *arguments, "--out", str(tmp_path / "theirs"), "--quiet"], check=True)
    vary = {"start.velocity.1": "-1:1:5", "body.mass": [1.0, 2.0]}
    snaprod.sweep(scene, vary, columns=["end.x"], out=tmp_path / "ours")
    theirs = files(tmp_path / "theirs")
    ours = files(tmp_path / "ours")
    assert len(ours) == 12 and ours.items() <= theirs.items()


def test_dask_makes_the_same_files_though_a_worker_dies(snap, tmp_path):
    """Catches chunks that are lost with a worker, made twice over, or other than those of one process."""
    distributed = pytest.importorskip("distributed")
    alone = tmp_path / "alone"
    snaprod.sweep(snap, VARY, columns=COLUMNS, out=alone, run__duration=2.0)
    together = tmp_path / "together"
    killed = []

    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None
    ) as cluster, distributed.Client(cluster) as client:

        def kill(fraction, done):
            if not killed and fraction > 0.4:
                pid = next(iter(client.run(os.getpid).values()))
                os.kill(pid, signal.SIGKILL)
                killed.append((pid, done))

        swept = snaprod.sweep(
            snap, VARY, columns=COLUMNS, out=together, client=client, progress=kill, run__duration=2.0
        )
        assert killed and killed[0][1] < swept.data.rows
        # The sweep is complete: nothing is run again.
        made = {path.name: path.stat().st_mtime_ns for path in (together / "chunks").iterdir()}
        again = snaprod.sweep(snap, VARY, columns=COLUMNS, out=together, client=client, run__duration=2.0)
        assert made == {path.name: path.stat().st_mtime_ns for path in (together / "chunks").iterdir()}
    np.testing.assert_array_equal(again["end.x"], swept["end.x"])
    assert swept.data.rows == 128
    assert files(together) == files(alone)


def test_dask_goes_on_after_an_interrupt(snap, tmp_path):
    """Catches chunks under the keys of an interrupted call, whose cancelled results the next one got, and one that waits for chunks that another cancels."""
    distributed = pytest.importorskip("distributed")

    def interrupt(fraction, done):
        raise KeyboardInterrupt

    def cancel(fraction, done):
        client.cancel([distributed.Future(key, client) for key in list(client.futures)])

    with distributed.LocalCluster(
        n_workers=1, threads_per_worker=1, processes=False, dashboard_address=None
    ) as cluster, distributed.Client(cluster) as client:
        given = {"columns": "end.x", "out": tmp_path / "swept", "client": client, "run__duration": 3.0}
        stops = {interrupt: (KeyboardInterrupt, None), cancel: (RuntimeError, "was cancelled; the same call goes on")}
        for stopped, (expected, message) in stops.items():
            with pytest.raises(expected, match=message):
                snaprod.sweep(snap, VARY, progress=stopped, **given)
        assert snaprod.sweep(snap, VARY, **given).data.rows == 128
