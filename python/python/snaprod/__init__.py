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

import logging
from typing import Any, Callable, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._core import __version__
from ._errors import ComputationError, Fault, SceneError
from ._figures import Drawing
from ._fit import fit
from ._mjcf import from_mjcf
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
from ._loads import BodyState, Loads, Piecewise
from ._scene import Progress, SceneLike, Told, fields, given, numbers, whole
from ._simulation import Simulation, State
from ._sweep import sweep
from ._table import Table, plural
from ._types import Scene

__all__ = [
    "BodyState",
    "Branch",
    "ComputationError",
    "Drawing",
    "Elastica",
    "Equilibria",
    "Equilibrium",
    "Fault",
    "FitResult",
    "Folds",
    "Memory",
    "Modes",
    "Piecewise",
    "Result",
    "Run",
    "Scene",
    "SceneError",
    "Simulation",
    "State",
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
    "from_mjcf",
    "memory",
    "modes",
    "run",
    "sweep",
]

_log = logging.getLogger("snaprod")


def __dir__() -> list[str]:
    return sorted(__all__)


def check(scene: SceneLike, **set: Any) -> dict[str, Any]:
    """Reads a scene and sets it up.

    Parameters
    ----------
    scene : dict, str or path
        The scene: a dict, TOML text, or the path of a TOML file.
    **set
        Fields to be set in the scene, ``body__mass=2.0``. Any path can be set with
        ``**{"start.velocity.1": -0.5}``. Every function takes such keywords.

    Returns
    -------
    dict
        The scene with its defaults, which can be run again.

    Raises
    ------
    SceneError
        All faults of the scene, in one exception.

    Examples
    --------
    >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0}
    >>> scene = {"rod": rod, "body": {"mass": 1.0}, "start": {"lambda": 6.3, "kappa": 0.6}, "run": {"duration": 1.0}}
    >>> snaprod.check(scene, body__mass=2.0)["body"]["mass"]
    2.0
    """
    found: dict[str, Any] = _core.check(given(scene, set))
    return dict(found["scene"])


def run(
    scene: SceneLike,
    *,
    strain: str = "some",
    progress: Progress = None,
    state: State | None = None,
    loads: Loads | None = None,
    on_sample: Callable[[dict[str, Any]], object] | None = None,
    on_event: Callable[[dict[str, Any]], object] | None = None,
    by: Sequence[str] = (),
    **set: Any,
) -> Run:
    """Runs a scene of motion to its end.

    Parameters
    ----------
    scene : dict, str or path
        One rod, an assembly, a bar, a flow or a membrane, as in :func:`check`.
    strain : {"some", "none", "all"}
        Samples at which the strains along a rod with friction are kept; "some" is about 400.
    progress : bool or callable, optional
        True shows a bar of tqdm. A function is called with the fraction done and the time reached.
    state : State, optional
        The state from which the run goes on, ``run.state`` of another run of the scene, or ``state`` of a simulation.
        Loads may have changed since. The scene says when to end: ``run__duration``.
    loads : dict, optional
        Functions as loads, ``{"force": f}`` or ``{"couple": f}`` on the body of one rod, ``{"tip": {"force": f}}`` on
        a body of an assembly. ``f(t, body)`` returns two components in the plane, or three. ``body`` is the
        :class:`BodyState`. The method calls ``f`` inside its steps, at times in no order: ``f`` must depend on its
        arguments alone and be smooth, or a :class:`Piecewise`. Its work is in the column ``work``.
    on_sample : callable, optional
        Called with every sample, a dict by the names of the columns.
    on_event : callable, optional
        Called with every event, a dict as in ``run.events``, bounces included. A bar, a flow or a membrane
        tells its events at the end.
    by : sequence of str, optional
        Fields of the scene by which the motion is differentiated, of a planar elastic rod without friction. The table
        ``run.tables["derivatives"]`` has those of the samples, ``run.derivatives`` those of the end and of the snaps.
    **set
        Fields to be set in the scene.

    Returns
    -------
    Run
        The trajectory, the events and the summary. A run that falls short of what was asked is no error:
        ``reason`` says why.

    Raises
    ------
    SceneError
        Faults of the scene, or a start that is no equilibrium.
    Exception
        Any exception of a function, and KeyboardInterrupt after Ctrl-C. The attribute ``run`` of the exception is the
        run so far.

    Examples
    --------
    >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0}
    >>> start = {"lambda": 6.3, "kappa": 0.6, "velocity": [0.0, -0.5]}
    >>> run = snaprod.run({"rod": rod, "body": {"mass": 1.0}, "start": start, "run": {"duration": 1.0}})
    >>> run.outcome, len(run.events), float(run.t[-1])
    ('end_of_time', 1, 1.0)
    >>> braked = snaprod.run(
    ...     {"rod": rod, "body": {"mass": 1.0}, "start": start, "run": {"duration": 1.0}},
    ...     loads={"force": lambda t, body: -5.0 * body.velocity},
    ... )
    >>> bool(braked.work[-1] < -1.0 and abs(braked.total - braked.total[0]).max() < 1e-8)
    True
    """
    if strain not in ("none", "some", "all"):
        raise ValueError(f'strain = {strain!r}: must be "none", "some" or "all"')
    source = given(scene, set, loads)
    with Told(progress, "snaprod run") as told:
        text = None if state is None else state.to_json()
        if by and state is not None:
            raise SceneError(["by: derivatives are those of a run from its start: leave out state"])
        raw = _core.run(source, strain, told.call, text, (on_sample, on_event), fields(by))
    found = Run(raw, source, state)
    if raw["raised"] is not None:
        raw["raised"].run = found
        raise raw["raised"]
    events = plural(len(found.events), "event")
    _log.info("run: %s at t = %g, %s", found.outcome, found["t"][-1], events)
    for note in (found.reason, found.warning):
        if note:
            _log.info("run: %s", note)
    return found


def equilibrium(scene: SceneLike, *, by: Sequence[str] = (), **set: Any) -> Equilibrium:
    """Solves a scene of statics, or finds the equilibrium of an assembly.

    Parameters
    ----------
    scene : dict, str or path
        A scene with ``end``, or an assembly, which need not be at rest in its scene.
    by : sequence of str, optional
        Fields of the scene by which all numbers of the equilibrium are differentiated, as ``"rod.length"``.
    **set
        Fields to be set in the scene.

    Returns
    -------
    Equilibrium
        The shape, the wrenches at both ends, the energy and the index.

    Examples
    --------
    >>> rod = {"model": "cosserat", "length": 1.0, "section": {"bending": [1.0, 1.0], "torsion": 1.0}}
    >>> found = snaprod.equilibrium({"rod": rod, "end": {"couple": [0.0, 1.0, 0.0]}})
    >>> found.index, round(found.summary["energy"], 12)  # half of couple^2 L/B
    (0, 0.5)
    >>> found = snaprod.equilibrium({"rod": rod, "end": {"couple": [0.0, 1.0, 0.0]}}, by=["rod.length"])
    >>> round(found.derivatives["rod.length"]["energy"], 9)  # half of couple^2/B
    0.5
    """
    source = given(scene, set)
    raw = _core.equilibrium(source, fields(by), False)
    return Equilibrium([Table._of(one) for one in raw["tables"]], raw["summary"], source)


def branch(scene: SceneLike, *, by: Sequence[str] = (), progress: Progress = None, **set: Any) -> Branch:
    """Follows the branch of a scene with ``continue``, and locates its special points.

    Parameters
    ----------
    scene : dict, str or path
        A scene of statics with ``continue``: the parameter and its range.
    by : sequence of str, optional
        Fields of the scene by which the parameter is differentiated at folds and branch points. Each special point then
        has ``derivatives``.
    progress : bool or callable, optional
        As in :func:`run`; the function is called with the parameter reached.
    **set
        Fields to be set in the scene.

    Returns
    -------
    Branch
        The points of all branches, the special points with bounds of their errors, and some shapes.

    Examples
    --------
    >>> rod = {"model": "cosserat", "length": 1.0, "section": {"bending": [2.0, 1.0], "torsion": 1.0}}
    >>> path = {"parameter": "end.load", "from": 0.0, "to": 3.0}
    >>> column = snaprod.branch({"rod": rod, "end": {"force": [0.0, 0.0, -1.0]}, "continue": path})
    >>> round(column.special("BP1")["parameter"], 9)  # Euler: pi^2 B/(4 L^2)
    2.4674011
    >>> scene = {"rod": rod, "end": {"force": [0.0, 0.0, -1.0]}, "continue": path}
    >>> by_length = snaprod.branch(scene, by=["rod.length"]).special("BP1")["derivatives"]["rod.length"]
    >>> round(by_length, 7)  # -pi^2 B/(2 L^3)
    -4.9348022
    """
    source = given(scene, set)
    with Told(progress, "snaprod branch") as told:
        found = Branch(_core.branch(source, fields(by), told.call))
    found._given = source
    return found


def modes(scene: SceneLike, *, by: Sequence[str] = (), **set: Any) -> Modes:
    """Computes natural frequencies and mode shapes of a scene about its equilibrium.

    Parameters
    ----------
    scene : dict, str or path
        A scene of motion, or an assembly.
    by : sequence of str, optional
        Fields of the scene by which the angular frequencies are differentiated, for rods in space without mass. The
        result has ``summary["derivatives"][field]["angular_frequencies"]``.
    **set
        Fields to be set in the scene.

    Returns
    -------
    Modes
        A row for each mode, with its angular frequency and its shape.

    Examples
    --------
    >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0}
    >>> strip = {"rod": rod, "body": {"mass": 3.0}, "start": {"rest": "straight"}, "run": {"duration": 1.0}}
    >>> float(round(snaprod.modes(strip).angular_frequency[0], 12))  # sqrt(3 B/(m L^3))
    1.0
    """
    source = given(scene, set)
    raw = _core.modes(source, fields(by))
    found = Modes([Table._of(one) for one in raw["tables"]], raw["summary"])
    found._given = source
    return found


def memory(
    scene: SceneLike, *, start: float | None = None, stop: float | None = None, points: int = 201, **set: Any
) -> Memory:
    """Computes spring, dashpot and memory of the end of a viscoelastic rod.

    Parameters
    ----------
    scene : dict, str or path
        A scene of one rod with damping or relaxation.
    start, stop : float, optional
        The first and the last time; without them the times fit the rod.
    points : int
        The number of times, in equal ratios, from 2 to 100000.
    **set
        Fields to be set in the scene.

    Returns
    -------
    Memory
        Relaxation, kernel and creep over time.

    Examples
    --------
    >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0, "damping": {"proportional": 0.1}}
    >>> strip = {"rod": rod, "body": {"mass": 1.0}, "start": {"rest": "straight"}, "run": {"duration": 1.0}}
    >>> float(round(snaprod.memory(strip, start=1e-3, stop=1e3, points=7).J_yy[-1], 9))  # creep to L^3/(3 B)
    0.333333333
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

    Parameters
    ----------
    lam, kappa, p : float
        lambda = sqrt(abs(force)), with kappa or p, where kappa = tanh p.
    mode, sign, k, beta : int, {"+", "-"}, float, float
        Instead of ``lam``: the sheet S_mode^sign, and the point on it.
    s : array_like or int
        Arclengths of the sections in [0, 1], or the number of evenly spaced sections.

    Returns
    -------
    Elastica
        The sections; labels are attributes: ``.x``, ``.y``, ``.energy``, ``.index``.

    Examples
    --------
    >>> snaprod.elastica(lam=6.3, kappa=0.6).index
    0
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
    """Finds all equilibria of the elastica with its end at (x, y).

    Parameters
    ----------
    x, y : array_like
        The points, which are broadcast. A point that the rod does not reach has no equilibria. The point (1, 0) has
        none either: the rod is straight there under any pull along itself.
    lambda_max : float
        Only equilibria with lambda = sqrt(abs(force)) below this are found; at most 60.
    progress : bool or callable, optional
        As in :func:`run`.

    Returns
    -------
    Equilibria
        A row for each equilibrium, and counts in the shape of the points.

    Raises
    ------
    SceneError
        A coordinate that is not finite.

    Examples
    --------
    >>> snaprod.equilibria([0.3, 0.5], 0.2, lambda_max=10.0).stable
    array([3, 3])
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
    """Computes the first fold curves of the elastica, from p = -8 to 8.

    Parameters
    ----------
    count : int
        The number of curves, at most 20. The half p < 0 of each is the mirror image of the other half.

    Returns
    -------
    Folds
        A row for each point, cusps marked.

    Examples
    --------
    >>> sorted(set(snaprod.folds(2).number.tolist()))
    [1, 2]
    """
    count = whole("count", count, 1, 20)
    return Folds([Table._of(_core.folds(count))], {"count": count})
