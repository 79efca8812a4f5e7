"""Fits: from measurements to parameters."""

from __future__ import annotations

from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._results import FitResult
from ._scene import SEEDS, Progress, SceneLike, Told, given, names, numbers, text_of, whole
from ._table import Table

if TYPE_CHECKING:
    import pandas


def fit(
    scene: SceneLike,
    data: Mapping[str, ArrayLike] | pandas.DataFrame | str | PathLike[str],
    free: Mapping[str, str | Sequence[float]],
    *,
    by_row: str | Sequence[str] = (),
    noise: Mapping[str, float] | None = None,
    starts: int = 5,
    seed: int = 0,
    progress: Progress = None,
    **set: Any,
) -> FitResult:
    """Finds values of fields with which a scene comes nearest to measured data, in the sense of least squares.

    Parameters
    ----------
    scene : dict, str or path
        The scene, as in :func:`check`.
    data : mapping of columns, DataFrame or path
        Columns by name, or the path of a CSV file as ``snaprod fit`` reads it. NaN marks what was not measured. With
        a column ``t`` the other columns are columns of the trajectory of one motion. Without ``t`` every row is a
        scene of its own.
    free : dict
        The range of each path: (low, high), or text as ``snaprod fit --free`` takes it, "log:0.01:1".
    by_row : str or list of str
        Columns that are fields, set in the scene row by row. The others are quantities as a sweep has them
        ("end.x", "events.0.t"), or of small motions ("modes.angular_frequencies.0").
    noise : dict, optional
        The standard deviation of columns; noise that is not given is estimated from the residuals.
    starts, seed : int
        The number of searches. The first begins in the middle of the ranges, the others at random places.
    progress : bool or callable, optional
        As in :func:`run`.
    **set
        Fields to be set in the scene.

    Returns
    -------
    FitResult
        Values, standard errors, intervals of 95 % and correlations.

    Examples
    --------
    >>> omega = [1.73, 1.22, 1.01]
    >>> swing = {
    ...     "rod": {"model": "elastica", "length": 1.0, "bending_stiffness": 2.0},
    ...     "body": {"mass": 1.0}, "start": {"rest": "straight"}, "run": {"duration": 1.0},
    ... }
    >>> found = fit(swing, {"body.mass": [1.0, 2.0, 3.0], "modes.angular_frequencies.0": omega},
    ...             {"rod.bending_stiffness": (0.5, 4.0)}, by_row=["body.mass"])
    >>> round(found.values["rod.bending_stiffness"], 4)
    1.0002
    """
    if not isinstance(free, Mapping):
        raise TypeError(f"free = {free!r}: must be a dict from the paths of fields to their ranges")
    ranges = [f"{path.replace('__', '.')}={_range(path, span)}" for path, span in free.items()]
    if not isinstance(noise, (Mapping, type(None))):
        raise TypeError(f"noise = {noise!r}: must be a dict from the names of columns to standard deviations")
    known = [(str(name), _deviation(name, sigma)) for name, sigma in (noise or {}).items()]
    searches, first = whole("starts", starts, 1), whole("seed", seed, 0, SEEDS)
    measured = _measured(data)
    source = given(scene, set)
    with Told(progress, "snaprod fit") as told:
        raw = _core.fit(source, measured, ranges, names("by_row", by_row), known, searches, first, told.call)
    return FitResult([Table._of(one) for one in raw["tables"]], raw["summary"])


def _measured(data: Any) -> tuple[list[str], list[list[float]]]:
    """Returns the names of columns, and rows of numbers."""
    if isinstance(data, (str, PathLike)):
        path = fspath(data)
        return _core.data(path, text_of(path))
    if not hasattr(data, "items"):
        raise TypeError(f"data = {data!r}: must be a dict of columns, a DataFrame, or the path of a CSV file")
    # Pairs: a DataFrame may have two columns of one name, which the library refuses.
    columns = [(str(name), _numbers(name, values)) for name, values in data.items()]
    if not columns:
        raise ValueError("data: there is no column; give numbers by the names of what was measured, as in {'t': .., 'x': ..}")
    if len({array.size for _, array in columns}) > 1:
        sizes = ", ".join(f"{name} {array.size}" for name, array in columns)
        raise ValueError(f"data: all columns must have as many numbers; there are {sizes}")
    return [name for name, _ in columns], np.column_stack([array for _, array in columns]).tolist()


def _deviation(name: object, sigma: Any) -> float:
    try:
        return float(sigma)
    except (TypeError, ValueError):
        raise TypeError(f"noise: {name} = {sigma!r}: must be a standard deviation, a number > 0") from None


def _numbers(name: object, values: ArrayLike) -> NDArray[np.float64]:
    try:
        return numbers(values).ravel()
    except (TypeError, ValueError) as error:
        raise type(error)(f"data: {name}: must be numbers, NaN where nothing was measured; {error}") from None


def _range(path: str, span: str | Sequence[float]) -> str:
    if isinstance(span, str):
        return span
    try:
        low, high = span
    except (TypeError, ValueError):
        raise TypeError(f"free: {path} = {span!r}: must be (low, high), or text such as 'log:0.01:1'") from None
    return f"{float(low)!r}:{float(high)!r}"
