"""Derivatives by fields, stiffness and compliance."""

import numpy as np
import pytest
import snaprod

ROD = {"model": "cosserat", "length": 1.0, "section": {"bending": [1.0, 1.0], "torsion": 1.0}}
CIRCLE = {"rod": ROD, "end": {"couple": [0.0, 1.0, 0.0]}}
SNAP = {
    "rod": {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0},
    "body": {"mass": 1.0},
    "start": {"lambda": 6.3, "kappa": 0.6, "velocity": [0.0, -0.5]},
    "run": {"duration": 0.5, "tolerance": 1e-12, "samples": 11},
}


def test_an_equilibrium_has_derivatives_stiffness_and_compliance():
    """Catches a field that is lost on the way, and matrices of another equilibrium."""
    found = snaprod.equilibrium(CIRCLE, by=["rod.length", "end__couple__1"])
    assert found.derivatives["rod.length"]["energy"] == pytest.approx(0.5, abs=1e-9)
    assert found.derivatives["end.couple.1"]["energy"] == pytest.approx(1.0, abs=1e-9)
    assert np.allclose(found.stiffness @ found.compliance, np.eye(6), atol=1e-9)
    assert "derivatives" not in snaprod.equilibrium(CIRCLE).summary


def test_what_has_no_derivative_is_said():
    """Catches NaN or None without a reason."""
    with pytest.raises(snaprod.SceneError, match="rod.width"):
        snaprod.equilibrium(CIRCLE, by=["rod.width"])
    straight = snaprod.equilibrium({"rod": ROD, "end": {"force": [0.0, 0.0, 0.0]}})
    with pytest.raises(snaprod.ComputationError, match="stiffness"):
        straight.stiffness
    assert straight.compliance[3, 3] == pytest.approx(1.0 / 3.0)
    with pytest.raises(TypeError, match="sequence"):
        snaprod.equilibrium(CIRCLE, by="rod.length")


def test_a_run_has_derivatives_through_its_snap():
    """Catches a derivative by another field, or of another event."""
    run = snaprod.run(SNAP, by=["body.mass"])
    step = 1e-3
    late, early = (snaprod.run(SNAP, body__mass=1.0 + side * step).events[0]["t"] for side in (1, -1))
    assert run.derivatives["body.mass"]["events"][0]["t"] == pytest.approx((late - early) / (2 * step), rel=1e-4)
    table = run.tables["derivatives"]
    assert table["x by body.mass"][-1] == run.derivatives["body.mass"]["end"]["x"]
    assert len(table["t"]) == 11
