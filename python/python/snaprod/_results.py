"""What the functions of the package return: tables, a summary, and ways to other formats and to figures."""

from __future__ import annotations

import html
import io
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Iterator, KeysView, Mapping, Sequence, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._errors import ComputationError, SceneError
from ._figures import Drawing, figure, made
from ._scene import Given, numbers, same, whole
from ._simulation import State
from ._table import Table, plural

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "Branch",
    "Elastica",
    "Equilibria",
    "Equilibrium",
    "FitResult",
    "Folds",
    "Memory",
    "Modes",
    "Result",
    "Run",
    "SweepResult",
]

Array = NDArray[np.float64]


class Result:
    """A result: tables of columns, and a summary in plain Python values.

    Columns of the first table are items and, where the name is free, attributes: ``run["x"]`` is ``run.x``.
    Iteration gives their names.
    """

    tables: dict[str, Table]
    """All tables by their names."""
    summary: dict[str, Any]
    """Numbers and words, as summary.json of the program has them."""

    def __init__(self, tables: Sequence[Table], summary: Mapping[str, Any]) -> None:
        self.tables = {table.name: table for table in tables}
        self.summary = dict(summary)
        self._first = tables[0]

    @property
    def data(self) -> Table:
        """The first table: a mapping from names of columns to arrays."""
        return self._first

    @property
    def units(self) -> dict[str, str]:
        """The unit of each column of ``data``."""
        return self.data.units

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.data[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.data)

    def __len__(self) -> int:
        return len(self.data)

    def __contains__(self, name: object) -> bool:
        return name in self.data

    def keys(self) -> KeysView[str]:
        """Returns the names of the columns of ``data``."""
        return self.data.keys()

    def __getattr__(self, name: str) -> Any:
        # Reads the dict of the object: while an object is unpickled its tables do not exist yet.
        data = self.__dict__.get("_first", {})
        if name in data:
            return data[name]
        raise AttributeError(f"{name!r}: a {type(self).__name__} has no such attribute or column")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name for name in self.data if name.isidentifier())]

    def to_pandas(self) -> pandas.DataFrame:
        """Returns ``data`` as a DataFrame."""
        return self.data.to_pandas()

    def to_xarray(self) -> xarray.Dataset:
        """Returns ``data`` as a Dataset with units and meanings."""
        return self.data.to_xarray()

    def to_npz(self, path: str | PathLike[str]) -> None:
        """Writes all tables as one ``.npz`` file.

        Columns of the first table have their own names, columns of the others ``table.column``.
        """
        arrays = dict(self.data)
        for table in self.tables.values():
            if table is not self.data:
                arrays.update({f"{table.name}.{name}": values for name, values in table.items()})
        np.savez_compressed(path, allow_pickle=False, **arrays)

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the result into ``ax``, or into a figure of its own."""
        from . import _plot

        return _plot.draw(self, ax)

    _command: ClassVar[str] = ""
    _usual: ClassVar[tuple[str, ...]] = ()
    _given: Given | None = None

    def _scene(self) -> Given:
        """Returns the scene, for results that the program can make again."""
        if not self._command or self._given is None:
            raise TypeError(f"{type(self).__name__}: the program makes no figures and files of this result; plot() draws it")
        return self._given

    def figure(self, name: str | None = None, *, width: str | None = None, font: str | None = None) -> Drawing:
        """Returns a figure of the program, such as ``run.figure("energies")``.

        The program computes the result once more, in a process of its own.

        Parameters
        ----------
        name : str, optional
            The name of the figure, as of the file that the program writes; without it the figure that tells most.
        width, font : str, optional
            The width in print and the size of letters: ``width="85mm", font="8pt"``.

        Raises
        ------
        ValueError
            No figure of this name: the message has the names.
        TypeError
            A result that is no run, equilibrium, branch or modes.

        Examples
        --------
        >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0}
        >>> strip = {"rod": rod, "body": {"mass": 3.0}, "start": {"rest": "straight"}, "run": {"duration": 1.0}}
        >>> snaprod.modes(strip).figure(width="85mm").name
        'modes'
        """
        options = [word for key, value in (("--width", width), ("--font", font)) if value for word in (key, value)]
        return figure(self._scene(), self._command, name, self._usual, options)

    def _headline(self) -> str:
        return f"{self.data.rows} rows of {', '.join(self.data)}"

    def __repr__(self) -> str:
        return f"<{type(self).__name__}: {self._headline()}>"

    def _repr_svg_(self) -> str | None:
        """Returns the figure of ``plot`` for notebooks; None without matplotlib, or with nothing to draw."""
        try:
            from . import _plot
        except ImportError:
            return None
        axes = _plot.alone(self)
        try:
            self.plot(axes)
        except ValueError:
            return None
        text = io.StringIO()
        cast("Figure", axes.figure).savefig(text, format="svg", bbox_inches="tight", metadata={"Date": None, "Creator": None})
        drawn = text.getvalue()
        return drawn[drawn.index("<svg") :]

    def _repr_html_(self) -> str:
        head = f"<p><b>{type(self).__name__}</b>: {html.escape(self._headline())}</p>"
        return head + (self._repr_svg_() or "") + self.data._repr_html_()


def _kept(text: bytes, path: str | PathLike[str] | None) -> bytes:
    """Writes a file, if a path is given, and returns what it holds."""
    if path is not None:
        Path(path).write_bytes(text)
    return text


class Run(Result):
    """A motion. ``data`` is its trajectory.

    Under ``landing = "all"`` ``tables`` also has the trajectories of the branches. A rod with strains of its own also
    has the table ``strain``, a bar the table ``waves``, and a scene with obstacles the table ``contacts``. A flow and a
    disc in motion have the table ``fields``.
    """

    _command = "run"
    _usual = ("snapshots", "shapes", "waves", "height")

    events: list[dict[str, Any]]
    """Snaps, passages, folds and contacts, in the order of time."""
    outcome: str
    """How the motion ended: "end_of_time", "stuck", "step_limit", ..."""
    reason: str | None
    """Why the motion fell short of what was asked; None if it did not."""
    warning: str | None
    """A warning about an unstable start, or about unresolved strains."""

    def __init__(self, raw: Mapping[str, Any], given: Any, begun: State | None = None) -> None:
        super().__init__([Table._of(one) for one in raw["tables"]], raw["summary"])
        self.events, self.reason, self.warning = raw["events"], raw["reason"], raw["warning"]
        self.outcome = self.summary["outcome"]
        self._given, self._begun = given, begun
        self._state, self._unsaved = raw["state"], raw["unsaved"]

    @property
    def state(self) -> State:
        """The last state, from which ``snaprod.run(scene, state=...)`` or a simulation goes on.

        Raises
        ------
        ComputationError
            A state that cannot be saved, such as one among obstacles: the message says why.
        """
        if self._state is None:
            raise ComputationError(self._unsaved)
        return State(self._state)

    def _scene(self) -> Given:
        return cast("Given", self._followed())

    def to_html(self, path: str | PathLike[str] | None = None) -> str:
        """Returns the page that plays the motion, and writes it if a path is given. The motion is followed once more."""
        page = made(self._scene(), "run", ["--html"]).get("run.html")
        if page is None:
            raise ComputationError("the program made no page")
        return _kept(page, path).decode()

    def to_vtk(self, path: str | PathLike[str]) -> None:
        """Writes the motion for ParaView and VTK, one file ``.vtkhdf`` with all times of ``run.samples``."""
        _kept(made(self._scene(), "run", ["--vtk", "--no-figures"])["run.vtkhdf"], path)

    def to_gltf(self, path: str | PathLike[str]) -> None:
        """Writes the motion as an animation for Blender and browsers, one file ``.glb``."""
        _kept(made(self._scene(), "run", ["--gltf", "--no-figures"])["run.glb"], path)

    def film(self, path: str | PathLike[str] | None = None) -> Drawing | None:
        """Returns a film of the motion that notebooks show, or writes it as ``.svg``, ``.gif`` or ``.mp4``.

        A film ``.mp4`` needs the program ffmpeg.
        """
        end = "svg" if path is None else Path(path).suffix[1:]
        made_film = made(self._scene(), "run", ["--no-figures"], end)[f"film.{end}"]
        if path is None:
            return Drawing("film", made_film.decode())
        _kept(made_film, path)
        return None

    def _followed(self) -> Any:
        """Returns the scene, if the motion can be followed once more from its start."""
        if self._begun is not None:
            raise SceneError(["the run went on from a saved state; follow it by a simulation: snaprod.Simulation(scene), reset(state)"])
        return self._given

    def at(self, t: ArrayLike) -> Table:
        """Returns all columns of the trajectory at the times ``t``.

        Times are exact. The motion is followed once more, as far as the last of the times, with the steps of the run;
        states inside of steps come from the polynomials of the steps. Ask for all times at once. ``t`` may be in any
        order; an array of several dimensions is taken row by row.

        Raises
        ------
        SceneError
            A time before the start, or after the end of the run; a bar.

        Examples
        --------
        >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0}
        >>> start = {"lambda": 6.3, "kappa": 0.6, "velocity": [0.0, -0.5]}
        >>> run = snaprod.run({"rod": rod, "body": {"mass": 1.0}, "start": start, "run": {"duration": 1.0}})
        >>> run.at([0.02, 0.03])["index"].tolist()
        [0, 0]
        """
        return Table._of(_core.samples(self._followed(), np.atleast_1d(numbers(t)).ravel()))

    def shape(self, t: ArrayLike, n: int = 101) -> Array | dict[str, Array]:
        """Returns the rod at the times ``t``: positions of ``n`` sections, at least 2.

        The array has the shape (times, sections, 3). An assembly gives a dict of such arrays, by the names of its rods.

        Times are exact, not interpolated between samples. The motion is followed once more, as far as the last of the
        times. Ask for all times at once.

        A light elastic rod has ``n`` sections. In space these are evenly spaced. In the plane these are the sections
        of the elastica in closed form, closer where it bends. A rod with strains of its own has the Gauss nodes at
        which it is known, ``n`` on every element, and its two ends. NaN stands where there is no shape to tell.
        """
        n = whole("n", n, 2)
        times = np.atleast_1d(numbers(t))
        names, counts, places = _core.shapes(self._followed(), times.ravel(), n)
        most = [max(of) for of in zip(*counts)] or [n] * len(names)
        rods = {name: np.full((times.size, many, 3), np.nan) for name, many in zip(names, most)}
        points, at = places.reshape(-1, 3), 0
        for i, of in enumerate(counts):
            for name, many in zip(names, of):
                rods[name][i, :many] = points[at : at + many]
                at += many
        shaped = {name: rod.reshape(np.shape(t) + rod.shape[1:]) for name, rod in rods.items()}
        return shaped[""] if names == [""] else shaped

    def plot(self, ax: Axes | None = None, times: int = 9) -> Axes:
        """Draws the rod at so many times with the path of its end. A bar is drawn by its waves, a membrane by its height.

        Rods in space are seen along each axis, in three panels. The panels are the ``child_axes`` of what is returned.
        """
        from . import _plot

        return _plot.run(self, ax, times)

    @property
    def derivatives(self) -> dict[str, Any]:
        """Derivatives by the fields ``by``: for each field ``end`` and, in the order of the snaps, ``events``."""
        return cast("dict[str, Any]", self.summary.get("derivatives", {}))

    def plot_energy(self, ax: Axes | None = None) -> Axes:
        """Draws the energy ledger over time."""
        from . import _plot

        return _plot.energy(self, ax)

    def _headline(self) -> str:
        ended = "" if self.reason is None else f" ({self.reason})"
        last = self.data["t"][-1] if self.data.rows else float("nan")
        time = f"{last:g} {self.units['t']}".strip()
        return f"{self.outcome}{ended}, {plural(self.data.rows, 'sample')} to t = {time}, {plural(len(self.events), 'event')}"


class Equilibrium(Result):
    """An equilibrium of a scene of statics. ``data`` is its shape."""

    _command = "equilibrium"
    _usual = ("equilibrium", "shape")

    def __init__(self, tables: Sequence[Table], summary: Mapping[str, Any], given: Given) -> None:
        super().__init__(tables, summary)
        self._given = given
        self._responses: dict[str, Any] | None = None

    @property
    def derivatives(self) -> dict[str, Any]:
        """Derivatives of the numbers of ``summary`` by the fields ``by``: a dict of its layout for each field.

        None stands for a field by which the equilibrium has no derivative; ``summary["no_derivatives"]`` says why.
        Estimated errors are in ``summary["derivative_errors"]``.
        """
        return cast("dict[str, Any]", self.summary.get("derivatives", {}))

    @property
    def responses(self) -> dict[str, Any]:
        """Stiffness and compliance of the end, of stations and of bodies. They are computed when first asked for."""
        if self._responses is None:
            self._responses = _core.equilibrium(self._given, [], True)["summary"]["responses"]
        return self._responses

    @property
    def stiffness(self) -> Array:
        """The stiffness of the end of one rod, 6 x 6, with its clamp held.

        Its columns are rotations about and displacements along the axes of the world, its rows couples and forces.
        ComputationError where there is none, as at a fold.
        """
        return self._response("stiffness")

    @property
    def compliance(self) -> Array:
        """The compliance of the end of one rod, 6 x 6, with its clamp held: the inverse of :attr:`stiffness`."""
        return self._response("compliance")

    def _response(self, name: str) -> Array:
        end = self.responses.get("end")
        if end is None:
            raise SceneError([f"{name}: an assembly has no single end; see responses['bodies']"])
        if end[name] is None:
            raise ComputationError(f"{name}: {end['reason']}")
        return np.array(end[name])

    @property
    def index(self) -> int:
        """The Morse index: 0 is stable."""
        return int(self.summary["index"])

    def plot(self, ax: Axes | None = None) -> Axes:
        """Draws the rods as seen along each axis, in three panels.

        The panels are the ``child_axes`` of what is returned.
        """
        from . import _plot

        return _plot.draw(self, ax)

    def _headline(self) -> str:
        return f"Morse index {self.index}, energy {self.summary['energy']:.9g}"


class Branch(Result):
    """Branches of equilibria. ``data`` has a row for each point and special point."""

    _command = "branch"
    _usual = ("branch",)

    special_points: list[dict[str, Any]]
    """Folds, branch points, Hopf points and changes of stability, located, with bounds of their errors."""
    shapes: list[tuple[float, bool, Array]]
    """Rods at a few points: the parameter, whether it is unstable, positions (sections, 3)."""

    def __init__(self, raw: Mapping[str, Any]) -> None:
        super().__init__([Table._of(one) for one in raw["tables"]], raw["summary"])
        self.special_points = self.summary["special_points"]
        self.shapes = raw["shapes"]

    @property
    def parameter(self) -> str:
        """The path of the field that varies."""
        return str(self.summary["parameter"])

    def special(self, label: str, near: float | None = None) -> dict[str, Any]:
        """Returns a special point by its label, or by its kind and the value of the parameter that it is nearest to.

        ``special("LP1")`` is the first fold, ``special("LP", near=0.4)`` the fold nearest to 0.4. The keys are those
        of special_points.json: ``parameter``, ``state``, ``precision`` and others.
        """
        if near is None:
            found = [at for at in self.special_points if at["label"] == label]
        else:
            of_kind = (at for at in self.special_points if at["label"].startswith(label))
            found = sorted(of_kind, key=lambda at: abs(at["parameter"] - near))
        if not found:
            labels = ", ".join(at["label"] for at in self.special_points)
            raise KeyError(f"{label}: the branch has {labels or 'no special points'}")
        return found[0]

    @property
    def lost(self) -> list[str]:
        """Branches that exist and were not followed. Each entry says where the branch begins, and why it was lost."""
        return list(self.summary["lost"])

    def to_html(self, path: str | PathLike[str] | None = None) -> str:
        """Returns the page of the branch, and writes it if a path is given. The branch is followed once more."""
        return _kept(made(self._scene(), "branch", ["--html"])["branch.html"], path).decode()

    def plot(self, ax: Axes | None = None, y: str | None = None) -> Axes:
        """Draws a column over the parameter, unstable parts dashed, special points by name.

        Without ``y`` the column is the place that shows most beside the parameter. If all places are held it is a base
        couple.
        """
        from . import _plot

        return _plot.branch(self, ax, y)

    def _headline(self) -> str:
        found = ", ".join(f"{at['label']} at {at['parameter']:.9g}" for at in self.special_points)
        lost = "".join(f"lost: {why}; " for why in self.lost)
        return f"{lost}{self.data.rows} points in {self.parameter}; {found or 'no special points'}"


class Modes(Result):
    """Natural frequencies and mode shapes. ``data`` has a row for each."""

    _command = "modes"
    _usual = ("modes",)

    def _headline(self) -> str:
        return f"{self.data.rows} rows of {', '.join(self.data)}"


class Memory(Result):
    """Small motions of the end of a viscoelastic rod. ``data`` has relaxation, kernel and creep over time."""


class Elastica(Result):
    """An equilibrium of the planar elastica, length 1 and bending stiffness 1. ``data`` has its sections."""

    def __getattr__(self, name: str) -> Any:
        summary = self.__dict__.get("summary", {})
        return summary[name] if name in summary else super().__getattr__(name)

    def _headline(self) -> str:
        s = self.summary
        stable = "stable" if s["stable"] else "unstable"
        return f"S_{s['mode']}^{s['sign']}, lambda {s['lam']:.9g}, end at ({s['x']:.9g}, {s['y']:.9g}), {stable}"


class Equilibria(Result):
    """All equilibria of the elastica with the end at given points.

    ``data`` has a row for each, in the order of the points.
    """

    counts: NDArray[np.int64]
    """The number of equilibria, in the shape of the points."""
    stable: NDArray[np.int64]
    """The number of stable equilibria. Beyond ``lambda_max`` there may be more."""
    point: NDArray[np.int64]
    """The flat index of the point of each row."""
    x: Array
    """The points, in their shape."""
    y: Array
    """The points, in their shape."""

    def __init__(self, counts: Sequence[int], raw: Mapping[str, Any], x: Array, y: Array, lambda_max: float) -> None:
        table = Table._of(raw)
        self.x, self.y = x, y
        self.point = np.repeat(np.arange(x.size), counts)
        stable = self.point[table["index"] == 0]
        self.counts = np.asarray(counts, dtype=np.int64).reshape(x.shape)
        self.stable = np.bincount(stable, minlength=x.size).reshape(x.shape)
        columns = {"point": self.point, "x": x.ravel()[self.point], "y": y.ravel()[self.point], **table}
        said = {"point": "flat index of the point", "x": "position of the end along the clamp's tangent", "y": "position of the end across it"}
        whole = Table(table.name, columns, {**dict.fromkeys(said, ""), **table.units}, {**said, **table.meanings})
        super().__init__([whole], {"points": int(x.size), "equilibria": int(table.rows), "lambda_max": lambda_max})

    def lowest(self, name: str = "elastic") -> Array:
        """Returns a column of the stable equilibrium of lowest energy at each point, in the shape of the points.

        Only equilibria below ``lambda_max`` count. The value is NaN at points without one, and at (1, 0), where the
        rod is straight.
        """
        if not np.issubdtype(np.asarray(self.data[name]).dtype, np.number):
            raise ValueError(f"name = {name!r}: must be a column of numbers; equilibria are labelled in data")
        found = np.full(self.x.size, np.nan)
        rows = np.flatnonzero(self.data["index"] == 0)
        rows = rows[np.argsort(-self.data["elastic"][rows], kind="stable")]
        found[self.point[rows]] = self.data[name][rows]
        return found.reshape(self.x.shape)

    def _headline(self) -> str:
        at = plural(self.x.size, "point")
        return f"{self.data.rows} {'equilibrium' if self.data.rows == 1 else 'equilibria'} at {at}, {int(self.stable.sum())} of them stable"


class Folds(Result):
    """The fold curves of the elastica. ``data`` has a row for each point."""


class OfFields(dict[str, Any]):
    """A mapping from fields to values.

    A field is found by its path as it was given, or in any other way of writing it.
    """

    def __missing__(self, name: str) -> Any:
        for path, value in self.items():
            if isinstance(name, str) and same(path) == same(name):
                return value
        raise KeyError(f"{name!r}: the fit has the fields {', '.join(self)}")


class FitResult(Result):
    """A fit. ``data`` has measured values, model and residuals, row by row.

    ``tables["curve"]`` has the model at closely spaced times.
    """

    @property
    def values(self) -> dict[str, float]:
        """The best value of each field."""
        return OfFields({one["path"]: one["value"] for one in self.summary["parameters"]})

    @property
    def standard_errors(self) -> dict[str, float | None]:
        """The standard error of each value; None where the data do not tell the value."""
        return OfFields({one["path"]: one["standard_error"] for one in self.summary["parameters"]})

    @property
    def intervals(self) -> dict[str, tuple[float, float] | None]:
        """The interval that holds each true value with a probability of 95 %, where model and noise are as assumed."""
        return OfFields({one["path"]: one["interval"] and tuple(one["interval"]) for one in self.summary["parameters"]})

    @property
    def correlations(self) -> Array:
        """Correlations of the errors, in the order of the fields."""
        return np.asarray(self.summary["correlations"])

    @property
    def remarks(self) -> list[str]:
        """Remarks on the fit, for example on a value at an end of its range."""
        return list(self.summary["remarks"])

    def plot(self, ax: Axes | None = None, name: str | None = None) -> Axes:
        """Draws measured values and model of one column. Without ``name`` this is the first column."""
        from . import _plot

        return _plot.fit(self, ax, name)

    def _headline(self) -> str:
        said = []
        for path, value in self.values.items():
            error = self.standard_errors[path]
            said.append(f"{path} = {value:.6g}" + (f" ± {error:.1g}" if error is not None else ""))
        return ", ".join(said)


class SweepResult(Result):
    """A sweep. ``data`` has a row for each point. Columns of numbers are numbers, all others text."""

    directory: str
    """The directory of the files of the sweep."""
    varied: list[str]
    """The fields that vary."""
    quantities: list[str]
    """The quantities that are given for each point."""
    shape: tuple[int, ...]
    """For a grid the number of values of each field; for points at random their number."""
    is_grid: bool = True
    """True for a grid, False for points at random."""

    def grid(self, name: str) -> NDArray[Any]:
        """Returns a column in the shape of the grid, with an axis for each field that varies."""
        return self.data[name].reshape(self.shape)

    def to_xarray(self) -> xarray.Dataset:
        """Returns a Dataset over the fields that vary, with their values as coordinates; words stay words.

        The dimensions have the names of the fields. Points at random have the one dimension ``point``.
        """
        import xarray

        def one(name: str, dims: tuple[str, ...], values: NDArray[Any]) -> Any:
            return dims, values, {"units": self.units[name], "long_name": self.data.meanings[name]}

        if not self.is_grid:
            coordinates = {n: one(n, ("point",), self[n]) for n in ("point", *self.varied)}
            variables = {n: one(n, ("point",), self[n]) for n in self if n not in coordinates}
            return xarray.Dataset(variables, coordinates, {"name": self.data.name})
        dims = tuple(self.varied)
        axes = {}
        for k, name in enumerate(dims):
            first = tuple(slice(None) if i == k else 0 for i in range(len(dims)))
            axes[name] = one(name, (name,), self.grid(name)[first])
        variables = {n: one(n, dims, self.grid(n)) for n in self if n not in axes}
        return xarray.Dataset(variables, axes, {"name": self.data.name})

    def plot(self, ax: Axes | str | None = None, name: str | None = None) -> Axes:
        """Draws a column: a line over one field, a map over two. Words are drawn as classes of their own.

        ``ax`` may be the name of the column, too: ``swept.plot("outcome")``.
        """
        from . import _plot

        if isinstance(ax, str):
            ax, name = None, ax
        return _plot.sweep(self, ax, name)

    def _headline(self) -> str:
        counts = self.summary.get("outcomes", {})
        said = ", ".join(f"{count} {outcome}" for outcome, count in counts.items())
        return f"{plural(self.data.rows, 'point')} over {', '.join(self.varied)}" + (f": {said}" if said else "")
