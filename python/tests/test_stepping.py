"""Simulations against runs, states through pickle, controllers with their work in the ledger."""

import copy
import importlib.util
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest

import snaprod


def test_pieces_are_one_run(snap):
    """Catches a piece that changes the steps, a column under a wrong name, an event that is lost."""
    run = snaprod.run(snap)
    sim = snaprod.Simulation(snap)
    times = np.linspace(0.0, 1.0, 9)
    whole = run.at(times)
    for k, t in enumerate(times):
        sim.advance(t)
        for name in ("x", "vy", "lam", "total"):
            assert abs(sim[name] - whole[name][k]) < 1e-14 * (1.0 + abs(sim[name])), name
        assert sim.sign == whole["sign"][k] and sim.row()["t"] == sim.t == t
    snaps = [event for event in sim.events if event["kind"] == "snap"]
    bounces = [event for event in sim.events if event["kind"] == "bounce"]
    assert [event["t"] for event in snaps] == [event["t"] for event in run.events]
    assert len(bounces) == run.summary["bounces"]["count"] == len(sim.events) - 1
    assert list(sim) == list(run) and "lam" in dir(sim) and repr(sim) == "<Simulation: t = 1 of 1, 3 events>"
    np.testing.assert_allclose(sim.shape(51)[-1, :2], [sim.x, sim.y], atol=1e-12)
    with pytest.raises(snaprod.SceneError, match="the time is 1"):
        sim.advance(0.5)
    with pytest.raises(KeyError, match="columns are t, x"):
        sim["height"]


def test_steps_of_the_method_lead_to_the_end(snap):
    """Catches a step that stands still, or a simulation that does not end."""
    sim = snaprod.Simulation(snap, run__duration=0.1)
    times = [sim.t]
    while sim.step():
        times.append(sim.t)
    assert (np.diff(times) > 0.0).all() and times[-1] == 0.1 and len(sim.events) == 1


def test_states_pickle_and_join(scenes):
    """Catches a part that a state lacks, in the plane and in space, elastic, with friction and with mass."""
    for name, t, far in (("snap", 0.05, 1e-8), ("viscous", 0.3, 1e-8), ("platform", 0.1, 1e-6), ("heavy_snap", 0.004, 1e-5)):
        path = scenes / f"{name}.toml"
        sim = snaprod.Simulation(path)
        start = sim.state
        assert start.t == 0.0 and start.method == "start"
        sim.advance(0.4 * t)
        state = pickle.loads(pickle.dumps(sim.state))
        assert state == sim.state and state != start and state.t == sim.t and hash(state) == hash(sim.state)
        assert all(isinstance(part, np.ndarray) for part in state.parts.values()), repr(state)
        others = [copy.copy(sim), copy.deepcopy(sim), pickle.loads(pickle.dumps(sim)), snaprod.Simulation(path)]
        others[-1].reset(state)
        sim.advance(t)
        column = "platform.x" if name == "platform" else "x"
        for other in others:
            other.advance(t)
            assert abs(other[column] - sim[column]) < far and abs(other["total"] - sim["total"]) < far
        sim.reset()
        assert (sim.t, sim.events) == (0.0, [])


def test_a_run_goes_on_from_the_end_of_another(snap):
    """Catches a run that begins anew, samples before its start, and energies that jump where runs join."""
    whole = snaprod.run(snap, run__duration=0.2)
    first = snaprod.run(snap, run__duration=0.1)
    second = snaprod.run(snap, run__duration=0.2, state=pickle.loads(pickle.dumps(first.state)))
    assert second.t[0] >= 0.1 and second.t[-1] == 0.2
    for name in ("x", "vy", "total", "dissipated"):
        assert abs(second[name][-1] - whole[name][-1]) < 1e-8
    with pytest.raises(snaprod.SceneError, match="saved state"):
        second.at(0.15)


def test_a_controller_does_work(snap):
    """Catches a force of a wrong size, or work that is not booked: the total stays, and the work is force times way."""
    scene = {**snap, "start": {"lambda": 2.0, "kappa": 0.6}}
    sim = snaprod.Simulation(scene, push=True)
    total, worked = sim.total, 0.0
    for k in range(40):
        force, y = -3.0 * sim.vy, sim.y
        sim.push([0.0, force])
        sim.advance((k + 1) / 40)
        worked += force * (sim.y - y)
    assert abs(sim.total - total) < 1e-8 and abs(sim.work - worked) < 1e-9 and sim.work < -1e-3
    with pytest.raises(snaprod.SceneError, match="third component"):
        sim.push([0.0, 0.0, 1.0])
    with pytest.raises(snaprod.SceneError, match="name them at the start"):
        snaprod.Simulation(snap).push([1.0, 0.0])


def test_callbacks_see_samples_and_events(snap):
    """Catches a sample that is skipped, an event that is told twice, and samples that an exception loses."""
    run = snaprod.run(snap)
    sim, seen, told = snaprod.Simulation(snap), [], []
    table = sim.follow(0.1, 11, on_sample=lambda now: seen.append(now.t), on_event=told.append)
    assert seen == table["t"].tolist() and table.rows == 11 and table["sign"].dtype.kind == "U"
    np.testing.assert_allclose(table["x"], run.at(table["t"])["x"], rtol=1e-13)
    assert [event["t"] for event in told] == [event["t"] for event in run.events]

    samples, heard = [], []
    again = snaprod.run(snap, on_sample=samples.append, on_event=heard.append)
    assert [sample["x"] for sample in samples] == again.x.tolist() and samples[0].keys() == set(again)
    assert [event for event in heard if event["kind"] == "snap"][0]["t"] == again.events[0]["t"]

    def stops(event):
        raise StopIteration(event["kind"])

    with pytest.raises(StopIteration, match="snap") as stopped:
        snaprod.run(snap, on_event=stops)
    part = stopped.value.run
    assert part.outcome == "interrupted" and 0.02 < part.t[-1] < 0.2 and len(part.events) == 1

    def failing(now):
        if now.t > 0.55:
            raise OverflowError("the controller")
        return [0.0, 1.0]

    sim = snaprod.Simulation(snap, push=True)
    with pytest.raises(OverflowError, match="the controller"):
        sim.follow(1.0, 11, control=failing)
    assert sim.recorded.rows == 7 and abs(sim.t - 0.6) < 1e-12


def test_loads_change_and_other_fields_do_not(snap):
    """Catches a change that is lost or books no work, and a change of what cannot change."""
    sim = snaprod.Simulation(snap)
    sim.advance(0.01)
    total, work = sim.total, sim.work
    sim.set(loads__gravity=[0.0, -2.0], **{"loads.drag": 0.1})
    # The potential of gravity at the place of the mass is booked as work.
    assert abs(sim.total - total) < 1e-12 and abs(sim.work - work - 2.0 * sim.y) < 1e-12
    with pytest.raises(snaprod.SceneError, match="rod.length cannot change"):
        sim.set(rod__length=2.0)
    sim.advance(0.02)
    assert abs(sim.total - total) < 1e-8
    again = pickle.loads(pickle.dumps(sim))
    assert again.potential == pytest.approx(sim.potential, abs=1e-12)


def test_states_among_obstacles_follow_the_motion_once_more(scenes):
    """Catches a replay that forgets a push, and a change of loads that would be wrong."""
    sim = snaprod.Simulation(scenes / "rocking_block.toml", push="block")
    sim.advance(0.2)
    sim.push([0.1, 0.0, 0.0])
    sim.advance(0.3)
    state = pickle.loads(pickle.dumps(sim.state))
    assert state.method == "replay"
    other = sim.copy()
    third = snaprod.Simulation(scenes / "rocking_block.toml", push="block")
    third.reset(state)
    for one in (sim, other, third):
        one.advance(0.6)
    assert sim.row() == other.row() == third.row() and sim.events == other.events == third.events
    with pytest.raises(snaprod.SceneError, match="cannot be saved"):
        sim.set(loads__gravity=[0.0, 0.0, -1.0])
    with pytest.raises(snaprod.ComputationError, match="cannot be saved"):
        snaprod.run(scenes / "rocking_block.toml", run__duration=0.1).state


def test_the_environment_switches():
    """Catches an environment that its agent cannot switch, or whose episodes differ."""
    gymnasium = pytest.importorskip("gymnasium")
    path = Path(__file__).parents[1] / "examples" / "switch_env.py"
    spec = importlib.util.spec_from_file_location("switch_env", path)
    module = importlib.util.module_from_spec(spec)
    sys.modules["switch_env"] = module
    spec.loader.exec_module(module)
    env = module.SwitchEnv()
    ends = []
    for _ in range(2):
        seen, _ = env.reset(seed=1)
        side = seen[4]
        for _ in range(env.horizon):
            seen, _, there, late, _ = env.step(np.array([side if seen[0] * side < 0.05 else -0.4 * seen[2]]))
            if there or late:
                break
        assert there and seen[0] * side > 0.3
        ends.append(seen)
    np.testing.assert_array_equal(ends[0], ends[1])
    assert isinstance(env, gymnasium.Env)
