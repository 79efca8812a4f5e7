"""Scenes as users give them: a dict, TOML text, or a path."""

from __future__ import annotations

import operator
from os import PathLike, fspath
from os.path import exists
from pathlib import Path
from typing import Any, Callable, Iterable, Mapping, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._errors import SceneError
from ._loads import GivenLoad, Loads, acting

SceneLike = Union[Mapping[str, Any], str, "PathLike[str]"]
"""A scene: a dict as the TOML would be read, TOML text, or the path of a TOML file."""

Given = Tuple[str, list[str], Union[str, None], list[GivenLoad]]
"""The text of a scene, the fields to be set in it, its name, and functions as loads."""

Progress = Union[bool, Callable[[float, float], object], None]
"""True for a bar (tqdm, if it is installed), or a function of the fraction done and the time or parameter reached."""


def given(scene: SceneLike, fields: Mapping[str, Any], loads: Loads | None = None) -> Given:
    """Returns the text of a scene, the fields to be set in it, its name, and functions as loads.

    The name of a dict, which has no lines, is None.
    """
    overrides = [f"{path}={value}" for path, value in (setting(*one) for one in fields.items())]
    functions = acting(loads)
    if isinstance(scene, Mapping):
        lines = (
            f"{_core.toml('scene', name)} = {_core.toml(str(name), value)}" for name, value in scene.items() if value is not None
        )
        return "\n".join(lines) + "\n", overrides, None, functions
    # One line with = may be a path or TOML text: a directory may be called mass=2.
    if isinstance(scene, str) and ("\n" in scene or "=" in scene and not exists(scene)):
        return scene, overrides, "", functions
    path = fspath(scene)
    return text_of(path), overrides, path, functions


def text_of(path: str) -> str:
    """Returns the text of a file, with the ends of its lines as they are.

    Raises OSError, and SceneError if it is not UTF-8.
    """
    try:
        return Path(path).read_bytes().decode("utf-8")
    except UnicodeDecodeError as error:
        raise SceneError([f"{path}: the text is not UTF-8 from byte {error.start} on"]) from None


def setting(path: str, value: Any) -> tuple[str, str]:
    """Returns the path of a field as the reader takes it, and its value as TOML. Two underscores stand for a dot."""
    path = _core.path(path.replace("__", "."))
    return path, _core.toml(path, value)


def fields(paths: Sequence[str]) -> list[str]:
    """Returns the paths of fields as the reader takes them. Two underscores stand for a dot."""
    if isinstance(paths, str):
        raise TypeError(f"by: give a sequence of paths, as [{paths!r}]")
    return [_core.path(path.replace("__", ".")) for path in paths]


def same(path: str) -> str:
    """Returns one form of a path for all ways of writing it.

    ``velocity[1]``, ``velocity.1``, ``velocity.y`` and, with two underscores for a dot, ``velocity__1`` name one
    field.
    """
    dotted = path.replace("__", ".").replace("[", ".").replace("]", "")
    steps = ({"x": "0", "y": "1", "z": "2"}.get(step, step) for step in dotted.split("."))
    return ".".join(steps)


def numbers(values: ArrayLike) -> NDArray[np.float64]:
    """Returns an array of numbers. Masked entries become NaN, not the number behind the mask."""
    return np.ma.filled(np.ma.asarray(values, dtype=float), np.nan)


def whole(name: str, value: Any, low: int, high: int = 2**63 - 1) -> int:
    """Returns an argument that is an integer, or a number that is one, as 1e4.

    Raises TypeError and ValueError that name it.
    """
    bounded = f"an integer from {low} to {high}"
    allowed = f"an integer >= {low}" if high >= 2**63 - 1 else bounded
    try:
        number = int(value) if isinstance(value, float) and value.is_integer() else operator.index(value)
    except TypeError:
        raise TypeError(f"{name} = {value!r}: must be {allowed}") from None
    if not low <= number <= high:
        raise ValueError(f"{name} = {number}: must be {bounded if number > high else allowed}")
    return number


def names(argument: str, of: str | Sequence[str]) -> list[str]:
    """Returns a list of names.

    A string is one name, not the sequence of its letters. Raises TypeError that names the argument.
    """
    if isinstance(of, str):
        return [of]
    found = list(of) if isinstance(of, Iterable) else [None]
    if not all(isinstance(name, str) for name in found):
        raise TypeError(f"{argument} = {of!r}: must be a name or a list of names")
    return found


SEEDS = 2**64 - 1
"""The largest seed."""


class Told:
    """A context that reports the progress of one piece of work."""

    def __init__(self, progress: Progress, what: str, total: float = 1.0) -> None:
        self.call: Callable[[float, float], object] | None = None
        self._bar: Any = None
        self._total = total
        if callable(progress):
            self.call = progress
        elif progress:
            try:
                from tqdm.auto import tqdm
            except ImportError:
                return
            self._bar = tqdm(total=total, desc=what, bar_format="{desc} {percentage:3.0f} %|{bar}| {elapsed}<{remaining}")
            self.call = self._show

    def _show(self, fraction: float, at: float) -> None:
        self._bar.n = min(fraction, 1.0) * self._total
        self._bar.refresh()

    def __enter__(self) -> Told:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()
