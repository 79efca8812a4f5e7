"""snaprod: reduced-order dynamics of light rods that carry heavy rigid bodies.

A scene is a dict, TOML text, or the path of a TOML file. The fields of a scene are those of ``docs/scene.md``. Every
result has its numbers as NumPy arrays.

>>> import snaprod
>>> found = snaprod.elastica(lam=6.3, kappa=0.6)
>>> found.stable
True
>>> snaprod.equilibria([0.3, 0.5], 0.2, lambda_max=10.0).stable
array([3, 3])
"""

from __future__ import annotations

from typing import Any, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._core import __version__
from ._errors import ComputationError, Fault, SceneError
from ._fit import fit
from ._results import (
    Branch,
    Elastica,
    Equilibria,
    Equilibrium,
    FitResult,
    Folds,
    Memory,
    Modes,
    Result,
    Run,
    SweepResult,
)
from ._scene import Progress, SceneLike, Told, given, numbers, whole
from ._sweep import sweep
from ._table import Table

__all__ = [
    "Branch",
    "ComputationError",
    "Elastica",
    "Equilibria",
    "Equilibrium",
    "Fault",
    "FitResult",
    "Folds",
    "Memory",
    "Modes",
    "Result",
    "Run",
    "SceneError",
    "SweepResult",
    "Table",
    "__version__",
    "branch",
    "check",
    "elastica",
    "equilibria",
    "equilibrium",
    "fit",
    "folds",
    "memory",
    "modes",
    "run",
    "sweep",
]


def check(scene: SceneLike, **set: Any) -> dict[str, Any]:
    """Reads a scene and sets it up. Returns the scene with its defaults, as a dict that can be run again.

    Every function takes fields to be set in the scene as keywords, ``body__mass=2.0``. Any path can be set with
    ``**{"start.velocity.1": -0.5}``. All faults of a scene come in one :class:`SceneError`.
    """
    found: dict[str, Any] = _core.check(given(scene, set))
    return dict(found["scene"])


def run(scene: SceneLike, *, strain: str = "some", progress: Progress = None, **set: Any) -> Run:
    """Runs a scene of motion to its end. The scene is one rod, an assembly or a bar.

    ``strain`` says at how many samples the strains along a rod with friction are kept: "none", "some" (about 400) or
    "all". A run that falls short of what was asked is no error: ``reason`` says why. Ctrl-C raises KeyboardInterrupt.
    """
    if strain not in ("none", "some", "all"):
        raise ValueError(f'strain = {strain!r}: must be "none", "some" or "all"')
    source = given(scene, set)
    with Told(progress, "snaprod run") as told:
        return Run(_core.run(source, strain, told.call), source)


def equilibrium(scene: SceneLike, **set: Any) -> Equilibrium:
    """Solves a scene of statics, or finds the equilibrium of an assembly.

    The assembly need not be at rest in its scene.
    """
    raw = _core.equilibrium(given(scene, set))
    return Equilibrium([Table._of(one) for one in raw["tables"]], raw["summary"])


def branch(scene: SceneLike, *, progress: Progress = None, **set: Any) -> Branch:
    """Follows the branch of a scene with ``continue``, and locates its special points."""
    source = given(scene, set)
    with Told(progress, "snaprod branch") as told:
        return Branch(_core.branch(source, told.call))


def modes(scene: SceneLike, **set: Any) -> Modes:
    """Computes natural frequencies and mode shapes of a scene about its equilibrium."""
    raw = _core.modes(given(scene, set))
    return Modes([Table._of(one) for one in raw["tables"]], raw["summary"])


def memory(
    scene: SceneLike, *, start: float | None = None, stop: float | None = None, points: int = 201, **set: Any
) -> Memory:
    """Computes spring, dashpot and memory of the end of a viscoelastic rod.

    The times are ``points`` times in equal ratios, from ``start`` to ``stop``. Without ``start`` and ``stop`` the
    times fit the rod.
    """
    raw = _core.memory(given(scene, set), (start, stop), whole("points", points, 2, 100_000))
    return Memory([Table._of(one) for one in raw["tables"]], raw["summary"])


def elastica(
    *,
    lam: float | None = None,
    kappa: float | None = None,
    p: float | None = None,
    mode: int | None = None,
    sign: str | None = None,
    k: float | None = None,
    beta: float | None = None,
    s: ArrayLike = 101,
) -> Elastica:
    """Computes one equilibrium of the planar elastica, length 1 and bending stiffness 1.

    The equilibrium is given by lambda = sqrt(|force|) with kappa or p, kappa = tanh p. It may also be given by the
    sheet S_mode^sign with k and beta. ``s`` holds arclengths of the sections in [0, 1], or the number of evenly spaced
    sections. Labels are attributes: ``.x``, ``.y``, ``.energy``, ``.index``.
    """
    at = numbers(s)
    sections = np.linspace(0.0, 1.0, whole("s", float(at), 1)) if at.ndim == 0 else at.ravel()
    labels = (mode, sign, k, beta)
    if lam is not None and (kappa is None) != (p is None) and labels == (None,) * 4:
        raw = _core.elastica(sections.tolist(), lam, kappa, p, None)
    elif (
        mode is not None and sign in ("+", "-") and k is not None and beta is not None and (lam, kappa, p) == (None,) * 3
    ):
        raw = _core.elastica(sections.tolist(), 0.0, None, None, (whole("mode", mode, 0, 2**32 - 1), sign == "+", k, beta))
    else:
        raise ValueError('give lam with kappa or p, or mode, sign ("+" or "-"), k and beta')
    return Elastica([Table._of(one) for one in raw["tables"]], raw["summary"])


def equilibria(x: ArrayLike, y: ArrayLike, lambda_max: float = 14.0, *, progress: Progress = None) -> Equilibria:
    """Finds all equilibria of the elastica with its end at (x, y) and lambda < ``lambda_max``, at most 60.

    Arrays x and y are broadcast, and every point is searched. Points that the rod does not reach have no equilibria.
    The point (1, 0) has none either: the rod is straight there under any pull along itself. A coordinate that is not
    finite raises ValueError.
    """
    xs, ys = np.broadcast_arrays(numbers(x), numbers(y))
    flat = (np.ascontiguousarray(xs).ravel(), np.ascontiguousarray(ys).ravel())
    # Checked before any computation, whose results an error would discard.
    if (odd := np.flatnonzero(~np.isfinite(flat).all(axis=0))).size:
        raise SceneError([f"x, y = {flat[0][odd[0]]}, {flat[1][odd[0]]} at the flat index {odd[0]}: every position must be finite"])
    with Told(progress, "snaprod equilibria") as told:
        counts, raw = _core.equilibria(*flat, float(lambda_max), told.call)
    return Equilibria(counts, raw, xs.copy(), ys.copy(), float(lambda_max))


def folds(count: int = 1) -> Folds:
    """Computes the first ``count`` fold curves of the elastica from p = -8 to 8, at most 20.

    The half p < 0 is the mirror image of the other half.
    """
    count = whole("count", count, 1, 20)
    return Folds([Table._of(_core.folds(count))], {"count": count})
