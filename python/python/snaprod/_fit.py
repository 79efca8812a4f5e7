"""Fits: from measurements to parameters."""

from __future__ import annotations

import csv
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike

from . import _core
from ._results import FitResult
from ._scene import Progress, SceneLike, Told, given
from ._table import Table

if TYPE_CHECKING:
    import pandas


def fit(
    scene: SceneLike,
    data: Mapping[str, ArrayLike] | pandas.DataFrame | str | PathLike[str],
    free: Mapping[str, str | tuple[float, float]],
    *,
    by_row: Sequence[str] = (),
    noise: Mapping[str, float] | None = None,
    starts: int = 5,
    seed: int = 0,
    progress: Progress = None,
    **set: Any,
) -> FitResult:
    """Finds the values of fields for which a scene comes nearest to measured data, in the sense of least squares.

    ``data``: columns by name, a DataFrame, or the path of a CSV file; NaN where nothing was measured. With a column ``t`` the others are
    columns of the trajectory of one motion. Without, every row is a scene of its own: columns named in ``by_row`` are fields that are set in it,
    the others quantities as a sweep has them ("end.x", "events.0.t"), or of small motions ("modes.angular_frequencies.0").
    ``free``: for each path its range, (low, high) or text as ``snaprod fit --free`` takes it, "log:0.01:1". ``noise``: standard deviations of
    columns; what is not given is estimated from what is left. ``starts`` searches begin in the middle of the ranges and at random places.

    >>> omega = [1.73, 1.22, 1.01]
    >>> swing = {
    ...     "rod": {"model": "elastica", "length": 1.0, "bending_stiffness": 2.0},
    ...     "body": {"mass": 1.0}, "start": {"rest": "straight"}, "run": {"duration": 1.0},
    ... }
    >>> found = fit(swing, {"body.mass": [1.0, 2.0, 3.0], "modes.angular_frequencies.0": omega},
    ...             {"rod.bending_stiffness": (0.5, 4.0)}, by_row=["body.mass"])
    >>> round(found.values["rod.bending_stiffness"], 3)
    0.999
    """
    columns = _read(data) if isinstance(data, (str, PathLike)) else {str(name): values for name, values in data.items()}
    names = list(columns)
    arrays = [np.asarray(columns[name], dtype=float).ravel() for name in names]
    if len({array.size for array in arrays}) > 1:
        sizes = ", ".join(f"{name} {array.size}" for name, array in zip(names, arrays))
        raise ValueError(f"data: all columns must have as many numbers; there are {sizes}")
    rows = np.column_stack(arrays).tolist() if arrays else []
    ranges = [f"{path}={_range(span)}" for path, span in free.items()]
    known = [(str(name), float(sigma)) for name, sigma in (noise or {}).items()]
    if starts < 1:
        raise ValueError(f"starts = {starts}: must be at least 1")
    source = given(scene, set)
    with Told(progress, "snaprod fit") as told:
        raw = _core.fit(source, (names, rows), ranges, list(by_row), known, int(starts), int(seed), told.call)
    return FitResult([Table._of(one) for one in raw["tables"]], raw["summary"])


def _range(span: str | tuple[float, float]) -> str:
    if isinstance(span, str):
        return span
    low, high = span
    return f"{float(low)!r}:{float(high)!r}"


def _read(path: str | PathLike[str]) -> dict[str, list[float]]:
    """The columns of a CSV file with a line of names; empty cells are NaN, lines that begin with # are passed over."""
    with open(fspath(path), newline="", encoding="utf-8-sig") as file:
        lines = (line for line in file if line.strip() and not line.lstrip().startswith("#"))
        rows = list(csv.reader(lines))
    if not rows:
        raise ValueError(f"{path}: the data are empty: a line of names comes first, as in t,x,y")
    names, cells = [name.strip() for name in rows[0]], rows[1:]
    for at, row in enumerate(cells, start=1):
        if len(row) != len(names):
            raise ValueError(f"{path}: row {at} has {len(row)} cells, the line of names {len(names)}")
    return {name: [float(row[i]) if row[i].strip() else float("nan") for row in cells] for i, name in enumerate(names)}
