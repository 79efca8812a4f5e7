"""Scenes of the repository, and figures without a screen."""

from pathlib import Path

import matplotlib
import pytest

matplotlib.use("Agg")


@pytest.fixture(scope="session")
def scenes() -> Path:
    return Path(__file__).parents[2] / "scenes"


@pytest.fixture
def snap() -> dict:
    """The reference snap."""
    return {
        "rod": {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0},
        "body": {"mass": 1.0},
        "start": {"lambda": 6.3, "kappa": 0.6, "velocity": [0.0, -0.5]},
        "run": {"duration": 1.0, "tolerance": 1e-11},
    }
