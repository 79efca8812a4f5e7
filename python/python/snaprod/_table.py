"""Tables: columns by name, with units and meanings."""

from __future__ import annotations

import html
from os import PathLike
from typing import TYPE_CHECKING, Any, Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from ._scene import same

if TYPE_CHECKING:
    import pandas
    import xarray

__all__ = ["Table"]


class Table(Mapping[str, NDArray[Any]]):
    """A table: a mapping from the names of its columns to arrays of one length, in the order of the CSV file.

    Missing numbers are NaN, and missing words are empty.
    """

    name: str
    """The name of the table: the name of its file without the ending."""
    units: dict[str, str]
    """The unit of each column; empty for numbers without one."""
    meanings: dict[str, str]
    """The meaning of each column."""

    def __init__(
        self,
        name: str,
        columns: Mapping[str, NDArray[Any]],
        units: Mapping[str, str] | None = None,
        meanings: Mapping[str, str] | None = None,
    ) -> None:
        self.name = name
        self._columns = dict(columns)
        self.units = dict(units or dict.fromkeys(self._columns, ""))
        self.meanings = dict(meanings or dict.fromkeys(self._columns, ""))

    @classmethod
    def _of(cls, raw: Mapping[str, Any]) -> Table:
        # Words come as a list, whose element type is unknown if empty; numbers come as arrays.
        columns = {
            name: np.asarray(values, dtype=str) if isinstance(values, list) else values for name, _, _, values in raw["columns"]
        }
        units = {name: unit for name, unit, _, _ in raw["columns"]}
        meanings = {name: meaning for name, _, meaning, _ in raw["columns"]}
        return cls(raw["name"], columns, units, meanings)

    def __getitem__(self, name: str) -> NDArray[Any]:
        try:
            return self._columns[name]
        except KeyError:
            # Columns of a sweep may be fields, whose paths can be written in several ways.
            for own in self._columns:
                if isinstance(name, str) and same(own) == same(name):
                    return self._columns[own]
            known = ", ".join(self._columns)
            raise KeyError(f"{name!r}: {self.name} has the columns {known}") from None

    def __iter__(self) -> Iterator[str]:
        return iter(self._columns)

    def __len__(self) -> int:
        return len(self._columns)

    @property
    def rows(self) -> int:
        """The number of rows."""
        return next((len(column) for column in self._columns.values()), 0)

    def label(self, name: str) -> str:
        """Returns the name of a column with its unit, for an axis."""
        unit = self.units.get(name, "")
        return f"{name} [{unit}]" if unit else name

    def to_pandas(self) -> pandas.DataFrame:
        """Returns a DataFrame. Units and meanings are in its ``attrs``."""
        import pandas

        frame = pandas.DataFrame(self._columns)
        frame.attrs.update(name=self.name, units=self.units, meanings=self.meanings)
        return frame

    def to_xarray(self) -> xarray.Dataset:
        """Returns a Dataset along the first column, or over t and s for a field along the rod.

        Units and meanings are in the attributes of each variable. A jump has two rows at one time; the second row
        stands at the next double, so that ``sel``, ``interp`` and ``differentiate`` work.
        """
        import xarray

        def one(name: str, dims: tuple[str, ...], values: NDArray[Any]) -> Any:
            return dims, values, {"units": self.units[name], "long_name": self.meanings[name]}

        names = list(self._columns)
        grid: list[str] = [name for name in ("t", "s", "X") if name in names[:2]]
        if len(grid) == 2:
            axes = {name: np.unique(self[name]) for name in grid}
            shape = tuple(len(axis) for axis in axes.values())
            if shape[0] * shape[1] == self.rows:
                rest = {n: one(n, tuple(grid), self[n].reshape(shape)) for n in names[2:]}
                coordinates = {n: one(n, (n,), axes[n]) for n in grid}
                return xarray.Dataset(rest, coordinates, {"name": self.name})
        along = names[0] if names and names[0] in ("t", "s") else "row"
        variables = {n: one(n, (along,), self[n]) for n in names if n != along}
        coordinates = {along: one(along, (along,), _apart(self[along]))} if along in names else {}
        return xarray.Dataset(variables, coordinates, {"name": self.name})

    def to_npz(self, path: str | PathLike[str]) -> None:
        """Writes the columns as a compressed ``.npz`` file, one array each."""
        np.savez_compressed(path, allow_pickle=False, **self._columns)

    def __repr__(self) -> str:
        names = ", ".join(self._columns)
        return f"<Table {self.name}: {self.rows} rows of {names}>"

    def _repr_html_(self) -> str:
        heads = "".join(
            f'<th title="{html.escape(self.meanings[n])}">{html.escape(self.label(n))}</th>' for n in self
        )
        count = self.rows
        shown = range(count) if count <= 10 else [*range(5), *range(count - 5, count)]
        lines = []
        for k, row in enumerate(shown):
            if count > 10 and k == 5:
                lines.append(f'<tr><td colspan="{len(self)}">&hellip;</td></tr>')
            cells = "".join(f"<td>{html.escape(_cell(self[n][row]))}</td>" for n in self)
            lines.append(f"<tr>{cells}</tr>")
        caption = f"<caption>{html.escape(self.name)}: {count} rows</caption>"
        return f"<table>{caption}<thead><tr>{heads}</tr></thead><tbody>{''.join(lines)}</tbody></table>"


def _apart(values: NDArray[Any]) -> NDArray[Any]:
    """Moves each value that does not exceed the one before to the next double above that one, if no value falls."""
    values = np.array(values, dtype=float)
    if np.any(np.diff(values) < 0.0):
        return values
    for k in np.flatnonzero(np.diff(values) == 0.0) + 1:
        values[k] = np.nextafter(values[k - 1], np.inf)
    return values


def plural(count: int, noun: str) -> str:
    """Returns a count with its noun: "1 event", "2 events"."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _cell(value: Any) -> str:
    return f"{value:.6g}" if isinstance(value, (float, np.floating)) else str(value)
