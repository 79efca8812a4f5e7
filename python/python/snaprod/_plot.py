"""Figures of results in matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeGuard, cast

import matplotlib.colors
import matplotlib.figure
import matplotlib.pyplot
import numpy as np

from . import _results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray


WIDE = (10.0, 3.4)
"""The size of a figure of three planes, in inches."""


def alone(result: _results.Result) -> Axes:
    """Makes axes that no window shows."""
    return matplotlib.figure.Figure(figsize=WIDE if _in_space(result) else (6.0, 4.0)).add_subplot()


def _axes(ax: Axes | None) -> Axes:
    return matplotlib.pyplot.subplots()[1] if ax is None else ax


def _in_space(result: _results.Result) -> bool:
    """True for rods in space, which are seen along each axis."""
    moves = isinstance(result, (_results.Run, _results.Equilibrium)) and "waves" not in result.tables
    return moves and any(name == "z" or name.endswith(".z") for name in result.data)


def draw(result: _results.Result, ax: Axes | None) -> Axes:
    """Draws the figure that suits the kind of the result."""
    if isinstance(result, _results.Equilibrium):
        return _shape(result, ax)
    axes = _axes(ax)
    data = result.data
    match result:
        case _results.Elastica():
            axes.plot(data["x"], data["y"])
            return _plane(axes, "x", "y")
        case _results.Folds():
            for number in np.unique(data["number"]):
                own = data["number"] == number
                axes.plot(data["x"][own], data["y"][own], label=f"fold curve {number}")
            cusps = data["cusp"] == "cusp"
            axes.plot(data["x"][cusps], data["y"][cusps], "k.", label="cusp")
            axes.legend()
            return _plane(axes, "x", "y")
        case _results.Equilibria():
            drawn = axes.scatter(result.x, result.y, c=result.counts, s=12)
            axes.figure.colorbar(drawn, ax=axes, label="equilibria")
            return _plane(axes, "x", "y")
        case _results.Memory():
            names = [name for name in data if name.startswith("R")]
            for name in names:
                axes.semilogx(data["t"], data[name], label=name)
            axes.set(xlabel=data.label("t"), ylabel="relaxation function")
            axes.legend()
        case _results.Modes():
            if data.rows == 0:
                raise ValueError("there are no modes to draw")
            axes.stem(data["mode"], data["angular_frequency"])
            axes.set(xlabel="mode", ylabel=data.label("angular_frequency"))
    return axes


def _rods(data: Any) -> list[str]:
    """Returns the prefixes of the columns x of a shape."""
    return [name[:-1] for name in data if name == "x" or name.endswith(".x")]


def _plane(axes: Axes, x: str, y: str) -> Axes:
    axes.set(xlabel=x, ylabel=y)
    axes.set_aspect("equal", adjustable="datalim")
    return axes


def _planes(ax: Axes | None, unit: str) -> tuple[Axes, list[tuple[Axes, int, int]]]:
    """Makes three panels, space seen along its axes z, y and x.

    Each panel comes with the coordinates it shows, across and upwards.
    """
    axes = matplotlib.pyplot.figure(figsize=WIDE).add_subplot() if ax is None else ax
    axes.set_axis_off()
    panels = []
    for k, (i, j) in enumerate([(0, 1), (0, 2), (1, 2)]):
        panel = axes.inset_axes((0.375 * k, 0.0, 0.25, 1.0))
        x, y = (f"{'xyz'[at]} [{unit}]" if unit else "xyz"[at] for at in (i, j))
        panels.append((_plane(panel, x, y), i, j))
    return axes, panels


def _is_box(ax: Axes | None) -> TypeGuard[Any]:
    """True for axes of matplotlib's projection "3d"."""
    return ax is not None and ax.name == "3d"


def _box(ax: Any, unit: str) -> Axes:
    """Gives the axes of a box of space names and equal scales."""
    ax.set(**{f"{name}label": f"{name} [{unit}]" if unit else name for name in "xyz"})
    ax.set_aspect("equal")
    return cast("Axes", ax)


def _shape(result: _results.Equilibrium, ax: Axes | None) -> Axes:
    """Draws rods in space, each in a colour of its own."""
    data = result.data
    rods = data["rod"] if "rod" in data else np.zeros(data.rows)
    names = np.unique(rods)
    if _is_box(ax):
        for rod in names:
            ax.plot(*(data[name][rods == rod] for name in "xyz"), label=str(rod))
        return _box(ax, data.units["x"])
    axes, panels = _planes(ax, data.units["x"])
    for panel, i, j in panels:
        for rod in names:
            panel.plot(data["xyz"[i]][rods == rod], data["xyz"[j]][rods == rod], label=str(rod))
    if len(names) > 1:
        panels[0][0].legend()
    return axes


def run(result: _results.Run, ax: Axes | None, times: int) -> Axes:
    """Draws rods at some times, and the paths of their ends. A bar is drawn by its waves, a membrane by its height."""
    data = result.data
    if "height" in data:
        axes = _axes(ax)
        axes.plot(data["t"], data["height"])
        axes.set(xlabel=data.label("t"), ylabel=data.label("height"))
        return axes
    if "waves" in result.tables:
        axes = _axes(ax)
        waves = result.tables["waves"].to_xarray()
        (name,) = [name for name in waves if name in ("stress", "n")][:1] or list(waves)[:1]
        drawn = axes.pcolormesh(waves["X"], waves["t"], waves[name], shading="nearest")
        axes.figure.colorbar(drawn, ax=axes, label=str(name))
        axes.set(xlabel="X", ylabel=data.label("t"))
        return axes
    prefixes = _rods(data)
    if _is_box(ax):
        t = np.linspace(0.0, data["t"][-1], times)
        rods = result.shape(t, 61)
        for rod in rods.values() if isinstance(rods, dict) else [rods]:
            for shape, part in zip(rod, np.linspace(0.0, 1.0, times)):
                ax.plot(*shape.T, color=matplotlib.colormaps["viridis"](0.9 * part), lw=1.2)
        for prefix in prefixes:
            ax.plot(*(data.get(prefix + name, np.zeros(data.rows)) for name in "xyz"), color="0.5", lw=0.7)
        return _box(ax, data.units[f"{prefixes[0]}x"])
    if _in_space(result):
        axes, panels = _planes(ax, data.units[f"{prefixes[0]}x"])
    else:
        axes = _plane(_axes(ax), data.label("x"), data.label("y"))
        panels = [(axes, 0, 1)]
    t = np.linspace(0.0, data["t"][-1], times)
    rods = result.shape(t, 61)
    for panel, i, j in panels:
        for rod in rods.values() if isinstance(rods, dict) else [rods]:
            for shape, part in zip(rod, np.linspace(0.0, 1.0, times)):
                panel.plot(shape[:, i], shape[:, j], color=matplotlib.colormaps["viridis"](0.9 * part), lw=1.2)
        for prefix in prefixes:
            x, y = data[prefix + "xyz"[i]], data[prefix + "xyz"[j]]
            panel.plot(x, y, color="0.5", lw=0.7)
            panel.plot(x[-1], y[-1], "ko", ms=4)
    return axes


def energy(result: _results.Run, ax: Axes | None) -> Axes:
    """Draws the terms of the ledger that are not zero, and their total."""
    axes, data = _axes(ax), result.data
    for name in ("kinetic", "elastic", "potential", "gas", "dissipated", "work", "rod_kinetic"):
        if name in data and np.any(data[name] != 0.0):
            label = "kinetic of the rod" if name == "rod_kinetic" else name
            axes.plot(data["t"], data[name], label=label, ls="--" if name == "work" else "-")
    if "total" in data:
        axes.plot(data["t"], data["total"], "k--", label="total with losses and work")
    unit = data.units["kinetic"]
    axes.set(xlabel=data.label("t"), ylabel=f"energy [{unit}]" if unit else "energy")
    axes.legend()
    return axes


def branch(result: _results.Branch, ax: Axes | None, y: str | None) -> Axes:
    """Draws a column over the parameter."""
    axes, data = _axes(ax), result.data
    y = _measure(result) if y is None else y
    curves = data["branch"]
    for curve in np.unique(curves):
        own = np.flatnonzero(curves == curve)
        unstable = data["index"][own] > 0
        # The point at which stability changes belongs to both parts.
        edges = np.flatnonzero(np.diff(unstable.astype(int))) + 1
        for part in np.split(np.arange(own.size), edges):
            rows = own[part[0] : part[-1] + 2]
            style: dict[str, Any] = {"ls": "--" if unstable[part[0]] else "-", "color": f"C{int(curve) % 10}"}
            axes.plot(data["parameter"][rows], data[y][rows], **style)
    for row in np.flatnonzero(data["label"] != ""):
        at = (data["parameter"][row], data[y][row])
        axes.plot(*at, "k.", ms=5)
        axes.annotate(str(data["label"][row]), at, textcoords="offset points", xytext=(4, 4))
    unit = data.units["parameter"]
    axes.set(xlabel=f"{result.parameter} [{unit}]" if unit else result.parameter, ylabel=data.label(y))
    return axes


def _measure(result: _results.Branch) -> str:
    """Returns the column that shows most beside the parameter, as in the figure of the program.

    The column is the place that tells most branches apart, and of several the one that bends most away from the
    parameter. If the ends are held, every place is constant or the parameter itself; the column is then a base couple.
    """
    data = result.data
    p, own = data["parameter"], data["branch"] == 0

    def score(name: str) -> float:
        values = data[name]
        centred = p - p.mean()
        over = float(centred @ centred)
        bent = values - (float(centred @ values) / over if over > 0.0 else 0.0) * centred
        # The scene's own branch has more weight than other branches; a column that follows the parameter shows little.
        return float(np.ptp(bent[own]) + 0.5 * np.ptp(bent) + 1e-3 * np.ptp(values))

    places = [name for name in data if name.rpartition(".")[2] in ("x", "y", "z")]
    couples = [name for name in data if name.rpartition(".")[2] in ("base_mx", "base_my", "base_mz")]
    def best(names: list[str]) -> str:
        widest = max(float(np.ptp(data[name])) for name in names)
        # A place that hardly moves beside the others does not show the extent of a branch.
        moving = [name for name in names if np.ptp(data[name]) >= 0.5 * widest]
        return max(moving, key=lambda name: (_told_apart(result, name, 0.02 * widest), score(name)))

    shown = best(places)
    lengths = (float(np.linalg.norm(np.diff(rod, axis=0), axis=1).sum()) for _, _, rod in result.shapes)
    length = max(lengths, default=0.0)
    return shown if score(shown) > 2e-3 * length or not couples else best(couples)


def _told_apart(result: _results.Branch, name: str, least: float) -> int:
    """Returns the number of pairs of the first eight branches whose column differs by more than ``least`` somewhere."""
    data = result.data
    curves = [(data["parameter"][own], data[name][own]) for own in (data["branch"] == k for k in range(8)) if own.any()]

    def apart(one: tuple[Any, Any], other: tuple[Any, Any]) -> bool:
        for p, y in list(zip(*one))[:: -(-one[0].size // 64)]:
            a, b = other[0][:-1], other[0][1:]
            passes = (np.minimum(a, b) <= p) & (p <= np.maximum(a, b))
            with np.errstate(invalid="ignore", divide="ignore"):
                part = np.where(a == b, 0.0, (p - a) / (b - a))[passes]
            values = other[1][:-1][passes] + part * np.diff(other[1])[passes]
            if values.size and np.abs(values - y).min() > least:
                return True
        return False

    return sum(apart(curves[i], curves[j]) for i in range(len(curves)) for j in range(i))


def sweep(result: _results.SweepResult, ax: Axes | None, name: str | None) -> Axes:
    """Draws a column over one field or two."""
    axes, data = _axes(ax), result.data
    known = [q for q in result.quantities if np.issubdtype(data[q].dtype, np.number)]
    if not (known or name) or data.rows == 0:
        raise ValueError("no column of the sweep holds numbers; name a column of words")
    usual = [q for q in ("snaps", "end.x", "index") if q in known]
    name = name or (usual or known)[0]
    if len(result.varied) == 1:
        axes.plot(data[result.varied[0]], data[name], ".-" if name in known else ".")
        axes.set(xlabel=result.varied[0], ylabel=name)
        return axes
    one, two = result.varied[:2]
    classes, colours, style = _classes(data[name])
    if len(result.shape) == 2:
        x, y = (_numbers(result.grid(field)) for field in (one, two))
        drawn: Any = axes.pcolormesh(x, y, colours.reshape(result.shape), shading="nearest", **style)
    else:
        drawn = axes.scatter(data[one], data[two], c=colours, s=12, **style)
    bar = axes.figure.colorbar(drawn, ax=axes, label=name)
    if classes:
        bar.set_ticks(range(len(classes)), labels=classes)
    axes.set(xlabel=one, ylabel=two)
    return axes


def _classes(values: NDArray[Any]) -> tuple[list[str], NDArray[Any], dict[str, Any]]:
    """Returns the classes of a column, its values as colours, and the style of the colours.

    Words, and whole numbers of few values, are classes. Other numbers have none, and are colours themselves.
    """
    is_whole = np.issubdtype(values.dtype, np.integer) and np.unique(values).size <= 10
    if np.issubdtype(values.dtype, np.number) and not is_whole:
        return [], values, {}
    words, colours = np.unique(values, return_inverse=True)
    if is_whole:
        palette = matplotlib.colormaps["viridis"](np.linspace(0.0, 1.0, words.size))
    else:
        palette = matplotlib.colormaps["tab20" if words.size > 10 else "tab10"](np.arange(words.size) % 20)
    style = {
        "cmap": matplotlib.colors.ListedColormap(palette),
        "vmin": -0.5,
        "vmax": words.size - 0.5,
    }
    return [str(word) or "(none)" for word in words], colours, style


def _numbers(values: NDArray[Any]) -> NDArray[Any]:
    if not np.issubdtype(values.dtype, np.number):
        raise ValueError("a map is over fields that are numbers")
    return values


def fit(result: _results.FitResult, ax: Axes | None, name: str | None) -> Axes:
    """Draws the measured values of a column, and the model."""
    axes, data = _axes(ax), result.data
    names = [one["name"] for one in result.summary["columns"]]
    name = names[0] if name is None else name
    if name not in names:
        raise ValueError(f"name = {name!r}: the fit compares {', '.join(names)}")
    along = next(iter(data))
    axes.plot(data[along], data[f"{name}.data"], ".", label="measured")
    curve = result.tables.get("curve")
    if curve is None:
        axes.plot(data[along], data[f"{name}.model"], "x", label="model")
    else:
        axes.plot(curve[along], curve[name], "-", label="model")
    axes.set(xlabel=data.label(along), ylabel=data.label(f"{name}.data").replace(".data", ""))
    axes.legend()
    return axes
