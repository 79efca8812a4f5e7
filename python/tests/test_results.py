"""Results against numbers that are known otherwise: closed forms, references of README, balances, difference quotients."""

import copy
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

import snaprod


def test_the_reference_snap_and_its_ledger(snap, tmp_path):
    """Catches a run that is another scene's, columns under wrong names, and units or words that are lost."""
    run = snaprod.run(snap)
    assert (run.outcome, run.reason, len(run.events)) == ("end_of_time", None, 1)
    # README's numbers, from references with 30 digits.
    assert abs(run.events[0]["t"] - 0.025570197858) < 1e-10
    assert abs(run.events[0]["released"] - 10.263064640) < 1e-7
    data = run.data
    total = data["kinetic"] + data["elastic"] + data["potential"] + data["dissipated"] - data["work"]
    np.testing.assert_allclose(total, data["total"], rtol=1e-14)
    assert np.ptp(total) < 1e-8
    np.testing.assert_allclose(data["kinetic"], 0.5 * (data["vx"] ** 2 + data["vy"] ** 2), rtol=1e-13)
    # theory 1: the force on the mass is lambda^2.
    np.testing.assert_allclose(np.hypot(data["fx"], data["fy"]), data["lam"] ** 2, rtol=1e-12)
    assert set(data["sign"]) <= {"+", "-"} and data["index"].dtype == np.int64 and not data["index"].any()

    frame, dataset = run.to_pandas(), run.to_xarray()
    assert list(frame) == list(dataset.reset_coords()) or set(frame) == {*dataset, "t"}
    np.testing.assert_array_equal(frame["x"], data["x"])
    assert dataset["x"].dims == ("t",) and dataset["x"].attrs["long_name"].startswith("position")
    run.to_npz(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as stored:
        np.testing.assert_array_equal(stored["lam"], data["lam"])
        np.testing.assert_array_equal(stored["sign"], data["sign"])


def test_time_is_unique_in_xarray(snap, tmp_path):
    """Catches the two rows of a snap at one time, which end ``sel``, ``interp`` and ``differentiate`` in an error."""
    xarray = pytest.importorskip("xarray")
    # The packages of xarray's interp, and of HDF5.
    pytest.importorskip("scipy")
    pytest.importorskip("h5netcdf")
    pytest.importorskip("h5py")
    run = snaprod.run(snap)
    assert (np.diff(run.t) == 0.0).sum() == 1
    dataset = run.to_xarray()
    assert (np.diff(dataset.t) > 0.0).all() and abs(dataset.t.values - run.t).max() < 1e-15
    assert float(dataset.lam.sel(t=0.5, method="nearest")) == run.lam[np.abs(run.t - 0.5).argmin()]
    # The velocity is the rate of the position, away from the snap.
    rate = dataset.x.differentiate("t").interp(t=[0.6, 0.8])
    np.testing.assert_allclose(rate, dataset.vx.interp(t=[0.6, 0.8]), rtol=2e-2)
    # As netCDF 3, and as HDF5.
    for engine in ("scipy", "h5netcdf"):
        dataset.to_netcdf(tmp_path / engine, engine=engine)
        with xarray.open_dataset(tmp_path / engine, engine=engine) as stored:
            np.testing.assert_array_equal(stored.x, dataset.x)
            assert stored.sign.astype(str).values.tolist() == dataset.sign.values.tolist()
            assert stored.x.attrs["long_name"] == dataset.x.attrs["long_name"]


def test_columns_are_attributes(snap):
    """Catches a column that hides a member of the result, and a result that cannot be copied or iterated."""
    run = snaprod.run(snap)
    assert run.x is run["x"] and list(run) == list(run.data) == list(run.keys()) and "vx" in run and len(run) == len(run.data)
    assert "x" in dir(run) and isinstance(run.events, list)
    with pytest.raises(AttributeError, match="'nothing': a Run has no such attribute or column"):
        run.nothing
    twin = pickle.loads(pickle.dumps(run))
    np.testing.assert_array_equal(copy.deepcopy(twin).lam, run.lam)
    assert set(dir(snaprod)) == set(snaprod.__all__)
    assert " samples to t = 1, 1 event" in repr(run)
    assert " at 1 point, " in repr(snaprod.equilibria(0.3, 0.2, 14.0))


def test_shapes_are_elasticas_that_end_at_the_mass(snap):
    """Catches shapes of other times, orders of times that are mixed up, and curves that are no elastica."""
    run = snaprod.run(snap)
    rows = [300, 5, 399, 0]
    t = run["t"][rows]
    shape = run.shape(t, 401)
    assert shape.shape == (4, 401, 3)
    tips = np.stack([run["x"][rows], run["y"][rows]], axis=-1)
    np.testing.assert_allclose(shape[:, -1, :2], tips, atol=1e-13)
    assert abs(shape[:, 0]).max() < 1e-14 and not shape[..., 2].any()
    # An inextensible rod of length 1, whose couple theta' is that of the force about the section.
    step = np.diff(shape[..., :2], axis=1)
    length = np.hypot(step[..., 0], step[..., 1])
    np.testing.assert_allclose(length.sum(axis=1), 1.0, atol=2e-4)
    theta = np.unwrap(np.arctan2(step[..., 1], step[..., 0]), axis=1)
    bending = np.diff(theta, axis=1) / (0.5 * (length[:, 1:] + length[:, :-1]))
    arm = tips[:, None] - shape[:, 1:-1, :2]
    couple = arm[..., 1] * run["fx"][rows][:, None] - arm[..., 0] * run["fy"][rows][:, None]
    assert abs(bending - couple).max() < 2e-3 * abs(couple).max()
    # Times between samples, in arrays of any shape.
    between = run.shape([[0.0123, 0.4567]], 11)
    assert between.shape == (1, 2, 11, 3)
    assert run.shape([], 11).shape == (0, 11, 3)
    with pytest.raises(snaprod.SceneError, match="ended at t = 1"):
        run.shape(1.5)
    with pytest.raises(ValueError, match="n = 1: must be an integer >= 2"):
        run.shape(0.1, 1)


def test_equilibria_broadcast_and_hold_the_end():
    """Catches points that are mixed up, and counts that are not those of the degree (2 minus the winding of the fold curve)."""
    x, y = np.array([0.3, 0.7, -0.2]), np.array([[0.2], [0.45]])
    found = snaprod.equilibria(x, y, 10.0)
    assert found.counts.shape == found.stable.shape == (2, 3)
    assert found.counts.sum() == found.data.rows
    alone = snaprod.equilibria(0.7, 0.45, 10.0)
    np.testing.assert_array_equal(found["lam"][found.point == 4], alone["lam"])
    for row in range(found.data.rows):
        one = snaprod.elastica(lam=found["lam"][row], p=found["p"][row], s=[1.0])
        assert abs(one.x - found["x"][row]) < 1e-10 and abs(one.y - found["y"][row]) < 1e-10
        assert one.index == found["index"][row]
    lowest = found.lowest()
    assert lowest[1, 1] == alone["elastic"][alone["index"] == 0].min()
    # Beyond its reach the rod has no equilibrium, and NaN is refused.
    assert snaprod.equilibria([0.7, 0.9, 0.7], [0.45, 0.45, 0.9], 10.0).counts.tolist() == [found.counts[1, 1], 0, 0]
    with pytest.raises(ValueError, match="x, y = 0.3, nan at the flat index 1: every position must be finite"):
        snaprod.equilibria(0.3, [0.2, np.nan])
    with pytest.raises(ValueError, match="name = 'sign': must be a column of numbers"):
        found.lowest("sign")
    # A mirror image has the same energies.
    np.testing.assert_allclose(snaprod.equilibria(x, -y, 10.0).lowest(), lowest, rtol=1e-11)


def test_statics_modes_and_memory():
    """Catches studies that are asked for the wrong scene: Euler's load, 3 EI/L^3, the dashpot of docs/tutorial.md."""
    column = {
        "rod": {"model": "cosserat", "length": 1.0, "section": {"bending": [1.5, 1.0], "torsion": 0.8}},
        "end": {"force": [0.0, 0.0, -1.0]},
        "continue": {"parameter": "end.load", "from": 0.0, "to": 3.0},
    }
    branch = snaprod.branch(column)
    assert branch.lost == []
    euler = branch.special("BP1")
    assert euler == branch.special_points[0] == branch.special("BP", near=2.0)
    assert euler["state"]["energy"] == 0.0
    with pytest.raises(KeyError, match="LP1: the branch has BP1"):
        branch.special("LP1")
    assert abs(euler["parameter"] - np.pi**2 / 4) < 1e-8
    assert branch.data["index"][0] == 0 and branch.data["index"][-1] > 0

    pushed = snaprod.equilibrium({**column, "end": {"force": [0.1, 0.0, 0.0]}, "continue": None})
    # F L^3/(3 EI) for a small force along d1, about d2.
    assert abs(pushed["x"][-1] / (0.1 / 3) - 1) < 3e-3 and pushed.index == 0

    strip = {
        "rod": {"model": "elastica", "length": 2.0, "bending_stiffness": 5.0},
        "body": {"mass": 0.5},
        "start": {"rest": "straight"},
        "run": {"duration": 1.0},
    }
    modes = snaprod.modes(strip)
    assert abs(modes["angular_frequency"][0] ** 2 - 3 * 5 / (0.5 * 8)) < 1e-12
    damped = {**strip, "rod": {**strip["rod"], "damping": {"proportional": 0.1}}}
    memory = snaprod.memory(damped, points=11)
    # A rod of one time has n = 3 EI/L^3 (y + 0.1 y'), and its creep function tends to the compliance.
    assert abs(memory["J_yy"][-1] * 3 * 5 / 8 - 1) < 1e-2


def test_a_path_may_have_an_equals_sign(tmp_path, scenes: Path):
    """Catches the path of a file that is read as the text of a scene."""
    path = tmp_path / "mass=2" / "scene.toml"
    path.parent.mkdir()
    path.write_bytes((scenes / "snap.toml").read_bytes())
    assert snaprod.check(str(path)) == snaprod.check(scenes / "snap.toml")


def test_faults_come_together_with_their_fields(snap):
    """Catches faults that stop at the first, lines of a text that nobody wrote, and a scene that is not the one of the file."""
    broken = {**snap, "body": {"mass": -1.0}, "rod": {**snap["rod"], "lenght": 2.0}}
    broken["start"] = {"lambda": np.float64(6.3), "kappa": 0.0}
    with pytest.raises(snaprod.SceneError) as raised:
        snaprod.run(broken)
    faults = {fault.field: fault for fault in raised.value.faults}
    assert set(faults) == {"body.mass", "rod.lenght", "start.kappa"}
    assert faults["body.mass"].value == "-1.0" and faults["body.mass"].allowed == "a finite number > 0"
    assert all(fault.line is None for fault in faults.values())
    assert "body.mass = -1.0: must be a finite number > 0" in str(raised.value)
    with pytest.raises(snaprod.SceneError) as raised:
        snaprod.check("[rod]\nmodel = 'elastica'\nlength = -1.0\nbending_stiffness = 1.0")
    assert next(f for f in raised.value.faults if f.field == "rod.length").line == 3
    with pytest.raises(snaprod.SceneError, match="body.mass = -2.0: must be") as raised:
        snaprod.run(snap, body__mass=-2.0)
    with pytest.raises(TypeError, match="body.mass: .* is no value of a scene"):
        snaprod.check(snap, body__mass=object())
    # A self-containing value is refused by name before the stack overflows.
    endless, table, deep = [], {}, 1.0
    endless.append(endless)
    table["mass"] = table
    for _ in range(8000):
        deep = [deep]
    for value in (endless, table, deep):
        with pytest.raises(snaprod.SceneError, match="body.mass: must be .* nested at most 80 deep") as raised:
            snaprod.run(snap, body__mass=value)
        assert [fault.field for fault in raised.value.faults] == ["body.mass"]
    with pytest.raises(snaprod.SceneError, match="body: must be .* nested at most 80 deep"):
        snaprod.run({**snap, "body": table})
    with pytest.raises(OSError):
        snaprod.check("nowhere.toml")
    with pytest.raises(ValueError, match="lam with kappa or p"):
        snaprod.elastica(lam=6.3)
    # A dict has no line numbers; one slip is one fault; a path cannot set further fields.
    with pytest.raises(snaprod.SceneError, match="start.p = 0.5: must be left out where start.kappa is given;") as caught:
        snaprod.run({**snap, "start": {**snap["start"], "p": 0.5}})
    assert caught.value.faults[0].allowed == "left out where start.kappa is given"
    with pytest.raises(snaprod.SceneError) as caught:
        snaprod.run(snap, rod__bend=1.5)
    assert [(fault.field, fault.kind) for fault in caught.value.faults] == [("rod.bend", "unknown")]
    for path in ("", "body.mass=3;x"):
        with pytest.raises(snaprod.SceneError, match=f'"{path}": must be the path of a field'):
            snaprod.run(snap, **{path: 1})
    # A number longer than a double becomes the nearest double.
    long = {"rod.length": np.longdouble(1), "start.velocity": np.array([0.0, -0.5], np.longdouble)}
    np.testing.assert_array_equal(snaprod.run(snap, **long)["x"], snaprod.run(snap)["x"])
    with pytest.raises(TypeError, match="body.mass: .* is no value of a scene"):
        snaprod.run(snap, body__mass=np.clongdouble(2))
    # The result of check is the scene.
    whole = snaprod.check(snap, **{"start.velocity.1": -0.25})
    assert whole["start"]["velocity"] == [0.0, -0.25] and whole == snaprod.check(whole)


def test_arguments_are_named_and_words_stay_words(snap, scenes):
    """Catches integers that are cut off or overflow without a name, and a column whose type depends on whether it has rows."""
    oscillation = scenes / "oscillation.toml"
    run = snaprod.run(snap, run__duration=0.01)
    calls = {
        "points": lambda n: snaprod.memory(oscillation, points=n),
        "random": lambda n: snaprod.sweep(snap, {"body.mass": "1:2"}, random=n),
        "seed": lambda n: snaprod.sweep(snap, {"body.mass": "1:2"}, random=1, seed=n),
        "threads": lambda n: snaprod.sweep(snap, {"body.mass": "1:2:2"}, threads=n),
        "starts": lambda n: snaprod.fit(snap, {"t": [0.0]}, {"body.mass": (1, 2)}, starts=n),
        "mode": lambda n: snaprod.elastica(mode=n, sign="+", k=0.5, beta=0.1),
        "s": lambda n: snaprod.elastica(lam=6.3, kappa=0.6, s=n),
        "count": lambda n: snaprod.folds(n),
        "n": lambda n: run.shape(0.0, n),
    }
    for name in ("seed", "count"):
        with pytest.raises(ValueError, match=rf"\b{name} = {2**64}: must be an integer from"):
            calls[name](2**64)
    for name, call in calls.items():
        with pytest.raises(ValueError, match=rf"\b{name} = -1: must be an integer"):
            call(-1)
        with pytest.raises(TypeError, match=rf"\b{name} = 2.7: must be an integer"):
            call(2.7)
    assert run.shape(0.0, 1e1).shape == (10, 3)
    table = snaprod.Table._of({"name": "none", "columns": [("t", "s", "time", np.empty(0)), ("label", "", "name", [])]})
    assert table["t"].dtype == np.float64 and table["label"].dtype.kind == "U"


def test_threads_run_side_by_side_and_ctrl_c_is_heard(snap):
    """Catches a run that holds the interpreter's lock, and one that cannot be interrupted."""
    ticks, running = [], True

    def tick():
        while running:
            ticks.append(time.perf_counter())
            time.sleep(0.002)

    def interrupt(fraction, at):
        if at > 20.0:
            raise ZeroDivisionError

    thread = threading.Thread(target=tick)
    thread.start()
    with pytest.raises(ZeroDivisionError):
        snaprod.run(snap, run__duration=1e6, progress=interrupt)
    inside = len(ticks)
    # Background processes inherit the ignored signal.
    signal.signal(signal.SIGINT, signal.default_int_handler)
    timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        snaprod.run(snap, run__duration=1e6)
    # An elastica has no steps at which to check for signals.
    before = len(ticks)
    timer = threading.Timer(0.1, os.kill, (os.getpid(), signal.SIGINT))
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        snaprod.elastica(lam=6.0, kappa=0.5, s=1_000_000)
    assert len(ticks) > before + 5
    running = False
    thread.join()
    # The other Python thread ran during the work in Rust.
    assert inside > 5 and len(ticks) > inside
    told = []
    snaprod.run(snap, progress=lambda fraction, at: told.append(fraction))
    assert told[-1] == 1.0


def test_ctrl_c_before_the_first_array_is_heard(snap):
    """Catches a panic where the first array of a process is made while Ctrl-C is pending: NumPy's functions could not be looked up then."""
    program = """
import _thread, signal, threading, time, snaprod
signal.signal(signal.SIGINT, signal.default_int_handler)
threading.Timer(0.005, _thread.interrupt_main).start()
try:
    snaprod.run({scene}, run__duration=2.0)
    time.sleep(1.0)
except KeyboardInterrupt:
    print("heard")
"""
    ran = subprocess.run([sys.executable, "-c", program.replace("{scene}", repr(snap))], capture_output=True, text=True)
    assert ran.stdout == "heard\n", ran.stderr


def test_membranes_move_as_in_the_program(scenes: Path):
    """Catches tables, events and summaries of membranes that are lost on the way to Python, and figures without them."""
    balloon = snaprod.run(scenes / "balloon_step.toml", loads__pressure=3.0, run__duration=11.0)
    # Amplitude and period of the sphere with C2/C1 = 0.0625 under the step 3, from a reference with 30 digits.
    assert balloon.outcome == "end_of_time"
    assert abs(balloon.summary["max_height"]["value"] - 13.673371578) < 1e-8
    assert abs(balloon.summary["oscillation"]["period"] - 5.17757813505) < 1e-8
    assert {event["kind"] for event in balloon.events} == {"fold"}
    data = balloon.data
    total = data["kinetic"] + data["elastic"] + data["gas"] + data["dissipated"] - data["work"]
    np.testing.assert_allclose(total, data["error"], atol=1e-12 * data["work"].max())
    # The work of a constant pressure is that on the volume.
    np.testing.assert_allclose(data["work"], 3.0 * (data["volume"] - data["volume"][0]), rtol=1e-9, atol=1e-9)
    disc = snaprod.run(scenes / "disc_in_motion.toml", membrane__elements=10, run__duration=4e-3, run__samples=5)
    fields = disc.tables["fields"]
    poles = fields["z"][fields["s"] == 0.0]
    np.testing.assert_array_equal(poles, disc["height"])
    assert disc.plot().get_ylabel() == "height" and len(balloon.plot_energy().lines) == 3
    piston = {
        "membrane": {"shape": "sphere", "radius": 1.0, "thickness": 1.0, "law": {"mooney": [1.0, 0.0625]}},
        "gas": {"contents": 854.513, "volume": 251.327, "outside": 0.5},
        "body": {"mass": 3.0, "area": 1.0},
        "start": {"stretch": 1.4, "velocity": 4.0},
        "run": {"duration": 1.0},
    }
    assert [event["kind"] for event in snaprod.run(piston).events] == ["snap"]
    with pytest.raises(snaprod.SceneError, match="membrane.density"):
        snaprod.run({key: value for key, value in piston.items() if key not in ("body", "start")})


def test_every_result_is_drawn(snap, scenes: Path):
    """Catches a figure without its curves, and one that a notebook does not show."""
    run = snaprod.run(snap)
    axes = run.plot(times=5)
    assert len(axes.lines) == 7
    assert len(run.plot_energy().lines) == 4
    # With the rod's own kinetic energy the terms that are drawn add up to the total.
    heavy = snaprod.run(scenes / "heavy_cantilever.toml", run__duration=0.1)
    drawn = {line.get_label(): line.get_ydata() for line in heavy.plot_energy().lines}
    total = drawn.pop("total with losses and work") + drawn.pop("work", 0.0)
    assert "kinetic of the rod" in drawn
    np.testing.assert_allclose(sum(drawn.values()), total, atol=1e-12 * np.abs(drawn["elastic"]).max())
    # Rods in space are seen along z, y and x.
    arch = snaprod.equilibrium(scenes / "arch.toml", units="si")
    for axes, x, y in zip(arch.plot().child_axes, "xxy", "yzz", strict=True):
        assert (axes.get_xlabel(), axes.get_ylabel(), axes.get_aspect()) == (f"{x} [m]", f"{y} [m]", 1.0)
        rods = [line.get_xydata() for line in axes.lines]
        np.testing.assert_array_equal(np.concatenate(rods), np.stack([arch[x], arch[y]], axis=-1))
    # The column drawn over the parameter is neither held nor the parameter itself: the same as in the program.
    measures = {"lateral": "base_my", "heavy_column": "x"}
    for name, column in measures.items():
        assert snaprod.branch(scenes / f"{name}.toml").plot().get_ylabel().startswith(column)
    results = [
        run,
        snaprod.elastica(lam=6.3, kappa=0.6),
        snaprod.equilibria([0.3, 0.5], 0.2, 8.0),
        snaprod.folds(1),
        snaprod.branch(scenes / "lateral.toml"),
        snaprod.equilibrium(scenes / "arch.toml"),
        snaprod.modes(scenes / "oscillation.toml"),
        snaprod.memory(scenes / "viscous.toml"),
        snaprod.run(scenes / "platform.toml", run__duration=0.2),
        snaprod.run(scenes / "sine.toml", rod__cells=60),
    ]
    for result in results:
        drawn = result._repr_svg_()
        assert drawn.startswith("<svg") and drawn.rstrip().endswith("</svg>"), result
        page = result._repr_html_()
        assert "<table>" in page and "<svg" in page
        assert result.to_pandas().shape[0] == result.data.rows
        assert result.to_xarray()
