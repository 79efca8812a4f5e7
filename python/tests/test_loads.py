"""Functions of Python as loads: against fields of the scene, with their work, exceptions and jumps."""

import pickle

import numpy as np
import pytest

import snaprod


def drag(t, body):
    """A drag of coefficient 3."""
    return -3.0 * body.velocity


def test_a_function_is_the_load_of_the_scene_in_the_plane_and_in_space(scenes, snap):
    """Catches a function that is not felt, sees a wrong body, or whose work the ledger lacks."""
    given = snaprod.run(snap, loads__drag=3.0, run__duration=0.06)
    felt = snaprod.run(snap, loads={"force": drag}, run__duration=0.06)
    for name in ("x", "y", "vx", "vy"):
        np.testing.assert_allclose(felt[name], given[name], atol=1e-9)
    np.testing.assert_allclose(felt["work"] - felt["dissipated"], -given["dissipated"], atol=1e-8)
    assert [event["kind"] for event in felt.events] == [event["kind"] for event in given.events] == ["snap"]
    np.testing.assert_allclose(felt.at([0.03])["x"], given.at([0.03])["x"], atol=1e-9)
    assert np.isfinite(felt.shape(0.03, 5)).all()
    assert "BodyState" in dir(snaprod) and "loads" not in felt.summary["scene"].get("loads", {})
    path = scenes / "whirl.toml"
    seen = []

    def couple(t, body):
        seen.append((body["wx"], body.qw, repr(body)))
        assert body.angular_velocity[0] == body.wx and body.keys()[0] == "t"
        return [-0.4 * body.wx, -0.4 * body.wy, -0.4 * body.wz]

    given = snaprod.run(path, run__duration=0.05, loads__rotational_drag=0.4)
    felt = snaprod.run(path, run__duration=0.05, loads={"couple": couple})
    np.testing.assert_allclose(felt["qx"], given["qx"], atol=1e-7)
    assert felt.work[-1] < 0.0 and seen[0][2].startswith("<BodyState: t = 0, x = ")
    path = scenes / "platform.toml"
    lift = snaprod.run(path, run__duration=0.05, loads={"platform": {"force": lambda t, body: (0.0, 0.0, 2.0)}})
    bare = snaprod.run(path, run__duration=0.05)
    assert lift["platform.z"][-1] > bare["platform.z"][-1] and lift.work[-1] > 0.0


def test_an_exception_ends_the_run_with_what_was_computed(snap):
    """Catches an exception that is lost, or takes the computed part with it."""

    def fails(t, body):
        if t > 0.5:
            raise ZeroDivisionError("half way")
        return [0.0, 0.1]

    with pytest.raises(ZeroDivisionError, match="half way") as caught:
        snaprod.run(snap, loads={"force": fails})
    run = caught.value.run
    assert 0.45 < run.t[-1] <= 0.5 and run.reason and run.data.rows > 100
    sim = snaprod.Simulation(snap, loads={"force": fails})
    sim.advance(0.3)
    before = sim.state
    with pytest.raises(ZeroDivisionError):
        sim.advance(0.8)
    assert 0.3 < sim.t <= 0.5
    sim.reset(before)
    sim.advance(0.4)
    assert sim.t == 0.4
    for wrong, error in (
        (lambda t, body: "up", TypeError),
        (lambda t, body: [0.0, 0.0, 1.0], ValueError),
        (lambda t, body: [0.0, np.nan], ValueError),
        (lambda t, body: body.height, AttributeError),
    ):
        with pytest.raises(error):
            snaprod.run(snap, loads={"force": wrong})


def test_jumps_end_steps_and_simulations_keep_functions(snap):
    """Catches a jump inside a step, and a state, a copy or a change that loses the function."""
    table = [[0.0123, 0.0], [0.0123 + 1e-11, 2.0], [0.0456, 2.0], [0.0456 + 1e-11, 0.0]]
    given = snaprod.run(snap, run__duration=0.06, loads__force=[{"direction": [0.0, 1.0], "table": table}])
    kick = snaprod.Piecewise(lambda t, body: [0.0, 2.0 if 0.0123 <= t < 0.0456 else 0.0], jumps=[0.0123, 0.0456])
    felt = snaprod.run(snap, run__duration=0.06, loads={"force": kick})
    np.testing.assert_allclose(felt["y"], given["y"], atol=1e-9)
    np.testing.assert_allclose(felt["work"], given["work"], atol=1e-9)
    sim = snaprod.Simulation(snap, loads={"force": drag}, push=True)
    sim.advance(0.01)
    others = [pickle.loads(pickle.dumps(sim)), sim.copy()]
    sim.set(loads__gravity=[0.0, -1e-12])
    for one in (sim, *others):
        one.push([0.0, 1.0])
        one.advance(0.04)
    for one in others:
        assert abs(one.y - sim.y) < 1e-8 and abs(one.work - sim.work) < 1e-6


def test_what_cannot_act_is_refused_by_name(snap, scenes):
    """Catches a load that is left out in silence."""
    for loads, words in (
        ({"torque": drag}, 'must be "force" or "couple"'),
        ({"force": 1.0}, "must be a function"),
        ({"couple": drag}, "bears no couple"),
        ({"tip": {"force": drag}}, "none of the bodies"),
        ({"force": snaprod.Piecewise(drag, jumps=[2.0, 1.0])}, r"\[2.0, 1.0\]"),
    ):
        with pytest.raises(snaprod.SceneError, match=words):
            snaprod.run(snap, loads=loads)
    with pytest.raises(snaprod.SceneError, match="derivatives of a run: functions as loads"):
        snaprod.run(snap, loads={"force": drag}, by=["body.mass"])
    with pytest.raises(snaprod.SceneError, match="the program knows no functions"):
        snaprod.run(snap, loads={"force": drag}, run__duration=0.01).figure()
    with pytest.raises(snaprod.SceneError, match="no body on which"):
        snaprod.run(scenes / "pulse_small.toml", loads={"force": drag})


def test_bars_call_functions_of_samples_and_events(scenes):
    """Catches a bar that calls nothing, or columns under wrong names."""
    samples, events = [], []
    run = snaprod.run(scenes / "pulse_small.toml", on_sample=samples.append, on_event=events.append)
    assert [sample["x"] for sample in samples] == run.x.tolist()
    assert events == run.events and events
