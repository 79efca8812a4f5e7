"""Sweeps: on the cores of this machine, or on the workers of a Dask client."""

from __future__ import annotations

import os
import tempfile
from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from pathlib import Path
from typing import TYPE_CHECKING, Any, Iterable, Mapping, Sequence
from uuid import uuid4

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._results import SweepResult
from ._scene import SEEDS, Progress, SceneLike, Told, given, names, setting, whole
from ._table import Table

if TYPE_CHECKING:
    from distributed import Client

Values = ArrayLike | str
Plan = tuple[Any, ...]


def sweep(
    scene: SceneLike,
    vary: Mapping[str, Values],
    *,
    columns: str | Sequence[str] = (),
    random: int | None = None,
    seed: int = 0,
    out: str | os.PathLike[str] | None = None,
    client: Client | None = None,
    threads: int | None = None,
    progress: Progress = None,
    **set: Any,
) -> SweepResult:
    """Runs a scene with some of its fields varied.

    Parameters
    ----------
    scene : dict, str or path
        The scene, as in :func:`check`.
    vary : dict
        The values of each path: an array or a list, or text as ``snaprod sweep --vary`` takes it: "-2:2:40",
        "log:0.1:10:20", and for points at random "-2:2".
    columns : str or list of str
        Quantities of each point. A path leads into the summary of a run, or into its events, as in "end.x" and
        "events.-1.t".
    random, seed : int, optional
        The number of points at random instead of a grid, and their seed.
    out : path, optional
        The directory of the chunks, with the same files, to the byte, as ``snaprod sweep`` makes them there (all but
        its map). A sweep may end for any reason; the same call then goes on with what is missing. Without ``out``
        the sweep is made in a temporary directory.
    client : dask.distributed.Client, optional
        Its workers make the chunks and write into ``out``, which they must see under the same path. If a worker
        dies, another worker makes its chunk.
    threads : int, optional
        The number of threads; by default the number of cores.
    progress : bool or callable, optional
        As in :func:`run`.
    **set
        Fields to be set in the scene.

    Returns
    -------
    SweepResult
        A row for each point of the grid, or for each point at random.

    Examples
    --------
    >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0}
    >>> scene = {"rod": rod, "body": {"mass": 1.0}, "start": {"lambda": 6.3, "kappa": 0.6}, "run": {"duration": 0.1}}
    >>> swept = snaprod.sweep(scene, {"body.mass": [1.0, 2.0], "start.kappa": "0.5:0.6:3"}, columns=["end.x"])
    >>> dict(swept.to_xarray().sizes)
    {'body.mass': 2, 'start.kappa': 3}
    """
    text, overrides, *_ = given(scene, set)
    if not isinstance(vary, Mapping):
        raise TypeError(f"vary = {vary!r}: must be a dict from the paths of fields to their values")
    plan_of = [_varied(path, values) for path, values in vary.items()]
    start = whole("seed", seed, 0, SEEDS)
    points = None if random is None else (whole("random", random, 1), start)
    if threads is not None:
        threads = whole("threads", threads, 1, 1024)
    if client is not None and out is None:
        raise ValueError("out: a sweep on the workers of a client needs a directory that they all see")
    with tempfile.TemporaryDirectory(prefix="snaprod-") as temporary:
        directory = Path(temporary if out is None else out).absolute()
        plan: Plan = (text, overrides, plan_of, points, names("columns", columns), str(directory))
        made = _core.Sweep(*plan)
        missing = made.missing()
        with Told(progress, "snaprod sweep", made.points) as told:
            if client is None:
                _here(made, missing, threads, told)
            else:
                _there(made, plan, missing, client, told)
        heads, cells, csv = made.rows()
        if out is not None:
            aside = directory / f"sweep.csv.{os.getpid()}.part"
            aside.write_bytes(csv)
            aside.replace(directory / "sweep.csv")
    result = _result(made, heads, cells)
    result.directory = "" if out is None else str(directory)
    result.is_grid = points is None
    return result


def _varied(path: str, values: Values) -> str:
    if isinstance(values, str):
        return f"{path.replace('__', '.')}={values}"
    plain = values.tolist() if isinstance(values, np.ndarray) else values
    if isinstance(plain, Mapping) or not isinstance(plain, Iterable):
        raise TypeError(f"vary: {path} = {values!r}: give its values as an array, a list or text such as '-2:2:40'")
    path, text = setting(path, list(plain))
    return f"{path}={text}"


def _here(made: _core.Sweep, missing: list[int], threads: int | None, told: Told) -> None:
    """Makes the chunks on threads. The work itself does not hold the lock of the interpreter."""
    total = max(sum(made.points_of(k) for k in missing), 1)
    with ThreadPoolExecutor(threads or os.cpu_count()) as pool:
        waiting = {pool.submit(made.make, k) for k in missing}
        try:
            while waiting:
                done, waiting = wait(waiting, timeout=0.1, return_when=FIRST_COMPLETED)
                for one in done:
                    one.result()
                if told.call is not None:
                    told.call(made.done / total, made.done)
        except BaseException:
            made.stop()
            pool.shutdown(cancel_futures=True)
            raise


def _make(plan: Plan, chunk: int) -> int:
    """Makes a chunk on a worker, unless the chunk is there."""
    made = _core.Sweep(*plan)
    made.make(chunk)
    return made.points_of(chunk)


def _there(made: _core.Sweep, plan: Plan, missing: list[int], client: Client, told: Told) -> None:
    """Makes the chunks on the workers of a client."""
    from distributed import as_completed

    # Keys unique to this call: for keys of an interrupted call Dask would return the cancelled results.
    name = f"snaprod-{uuid4().hex}"
    keys = [f"{name}-{k:06}" for k in missing]
    futures = client.map(_make, [plan] * len(missing), missing, key=keys, pure=False)
    total, done = max(sum(made.points_of(k) for k in missing), 1), 0
    try:
        for future, points in as_completed(futures, with_results=True):
            if future.cancelled():
                raise RuntimeError(f"{future.key}: the chunk was cancelled; the same call goes on with what is missing")
            done += points
            if told.call is not None:
                told.call(done / total, done)
    except BaseException:
        client.cancel(futures)
        raise


def _result(made: _core.Sweep, heads: list[str], cells: list[list[str]]) -> SweepResult:
    columns: dict[str, NDArray[Any]] = {}
    for name, one in zip(heads, cells):
        # Varied fields come first; a quantity of the same name does not replace them.
        columns.setdefault(name, _column(one))
    varied, quantities = made.names
    outcomes, counts = np.unique(columns.get("outcome", np.empty(0, dtype=str)), return_counts=True)
    summary = {"points": made.points, "outcomes": {str(o): int(n) for o, n in zip(outcomes, counts)}}
    # An unknown quantity has its name as meaning.
    known = {"point": ["", "number of the point, from 0"], "why": ["", "why the scene has no run"]}
    told = {name: known.get(name) or made.described(name) or ["", ""] for name in columns}
    units, meanings = ({name: one[k] for name, one in told.items()} for k in (0, 1))
    result = SweepResult([Table("sweep", columns, units, meanings)], summary)
    result.varied, result.quantities = varied, quantities
    result.shape = tuple(made.shape)
    return result


def _column(cells: list[str]) -> NDArray[Any]:
    """Returns numbers if all cells that say something are numbers; whole ones if all are and none is missing."""
    if not any(cells):
        return np.asarray(cells, dtype=str)
    for kind, missing in ((int, None), (float, "nan")):
        try:
            return np.asarray([kind(cell or missing) for cell in cells])  # type: ignore[arg-type]
        except (TypeError, ValueError):
            continue
    return np.asarray(cells)
