"""Figures of results in matplotlib."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import matplotlib.figure
import matplotlib.pyplot
import numpy as np

from . import _results

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray


def alone() -> Axes:
    """Axes that no window shows."""
    return matplotlib.figure.Figure(figsize=(6.0, 4.0)).add_subplot()


def _axes(ax: Axes | None) -> Axes:
    return matplotlib.pyplot.subplots()[1] if ax is None else ax


def draw(result: _results.Result, ax: Axes | None) -> Axes:
    """What suits the kind of the result."""
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
        case _results.Equilibrium():
            rods = data["rod"] if "rod" in data else np.zeros(data.rows)
            for rod in np.unique(rods):
                axes.plot(data["x"][rods == rod], data["z"][rods == rod], label=str(rod))
            return _plane(axes, data.label("x"), data.label("z"))
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
    """The prefixes of the columns x of a shape."""
    return [name[:-1] for name in data if name == "x" or name.endswith(".x")]


def _plane(axes: Axes, x: str, y: str) -> Axes:
    axes.set(xlabel=x, ylabel=y)
    axes.set_aspect("equal", adjustable="datalim")
    return axes


def run(result: _results.Run, ax: Axes | None, times: int) -> Axes:
    """The rod in the plane at some times, and the path of its end."""
    axes, data = _axes(ax), result.data
    if "waves" in result.tables:
        waves = result.tables["waves"].to_xarray()
        (name,) = [name for name in waves if name in ("stress", "n")][:1] or list(waves)[:1]
        drawn = axes.pcolormesh(waves["X"], waves["t"], waves[name], shading="nearest")
        axes.figure.colorbar(drawn, ax=axes, label=str(name))
        axes.set(xlabel="X", ylabel=data.label("t"))
        return axes
    prefixes = _rods(data)
    flat = f"{prefixes[0]}z" not in data
    across = "y" if flat else "z"
    t = np.linspace(0.0, data["t"][-1], times)
    rods = result.shape(t, 61)
    for rod in rods.values() if isinstance(rods, dict) else [rods]:
        for shape, part in zip(rod, np.linspace(0.0, 1.0, times)):
            axes.plot(shape[:, 0], shape[:, 1 if flat else 2], color=matplotlib.colormaps["viridis"](0.9 * part), lw=1.2)
    for prefix in prefixes:
        axes.plot(data[f"{prefix}x"], data[f"{prefix}{across}"], color="0.5", lw=0.7)
        axes.plot(data[f"{prefix}x"][-1], data[f"{prefix}{across}"][-1], "ko", ms=4)
    return _plane(axes, data.label(f"{prefixes[0]}x"), data.label(f"{prefixes[0]}{across}"))


def energy(result: _results.Run, ax: Axes | None) -> Axes:
    """The terms of the ledger that are not zero, and its total."""
    axes, data = _axes(ax), result.data
    terms = ("kinetic", "elastic", "potential", "dissipated", "work", "strain", "lost")
    for name in terms:
        if name in data and np.any(data[name] != 0.0):
            axes.plot(data["t"], data[name], label=name)
    if "total" in data:
        axes.plot(data["t"], data["total"], "k--", label="total")
    unit = data.units.get("kinetic", "")
    axes.set(xlabel=data.label("t"), ylabel=f"energy [{unit}]" if unit else "energy")
    axes.legend()
    return axes


def branch(result: _results.Branch, ax: Axes | None, y: str | None) -> Axes:
    """A column over the parameter."""
    axes, data = _axes(ax), result.data
    names = list(data)
    x = names[names.index("parameter")] if "parameter" in names else names[1]
    places = [name for name in names if name in ("x", "y", "z") or name.endswith((".x", ".y", ".z"))]
    y = y or max(places or names[2:3], key=lambda name: float(np.ptp(data[name])))
    curves = data["branch"] if "branch" in data else np.zeros(data.rows)
    for curve in np.unique(curves):
        own = np.flatnonzero(curves == curve)
        unstable = data["index"][own] > 0
        # The point at which stability changes belongs to both parts.
        edges = np.flatnonzero(np.diff(unstable.astype(int))) + 1
        for part in np.split(np.arange(own.size), edges):
            rows = own[part[0] : part[-1] + 2]
            style: dict[str, Any] = {"ls": "--" if unstable[part[0]] else "-", "color": f"C{int(curve) % 10}"}
            axes.plot(data[x][rows], data[y][rows], **style)
    if "label" in data:
        for row in np.flatnonzero(data["label"] != ""):
            at = (data[x][row], data[y][row])
            axes.plot(*at, "k.", ms=5)
            axes.annotate(str(data["label"][row]), at, textcoords="offset points", xytext=(4, 4))
    axes.set(xlabel=result.parameter, ylabel=data.label(y))
    return axes


def sweep(result: _results.SweepResult, ax: Axes | None, name: str | None) -> Axes:
    """A column over one field or two."""
    axes, data = _axes(ax), result.data
    known = [q for q in result.quantities if np.issubdtype(data[q].dtype, np.number)]
    if not known or data.rows == 0:
        raise ValueError("no column of the sweep holds numbers")
    usual = [q for q in ("snaps", "end.x", "index") if q in known]
    name = name or (usual or known)[0]
    if len(result.varied) == 1:
        axes.plot(data[result.varied[0]], data[name], ".-")
        axes.set(xlabel=result.varied[0], ylabel=name)
        return axes
    one, two = result.varied[:2]
    if len(result.shape) == 2:
        x, y = (_numbers(result.grid(field)) for field in (one, two))
        drawn: Any = axes.pcolormesh(x, y, result.grid(name), shading="nearest")
    else:
        drawn = axes.scatter(data[one], data[two], c=data[name], s=12)
    axes.figure.colorbar(drawn, ax=axes, label=name)
    axes.set(xlabel=one, ylabel=two)
    return axes


def _numbers(values: NDArray[Any]) -> NDArray[Any]:
    if not np.issubdtype(values.dtype, np.number):
        raise ValueError("a map is over fields that are numbers")
    return values


def fit(result: _results.FitResult, ax: Axes | None, name: str | None) -> Axes:
    """What was measured of a column, and the model."""
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
