"""The exceptions of the package."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Mapping, Sequence

__all__ = ["ComputationError", "Fault", "SceneError"]


@dataclass(frozen=True)
class Fault:
    """One fault of a scene."""

    kind: str
    """"missing", "unknown", "type", "value", "conflict", "planned" or "syntax"."""
    field: str
    """The path of the field, as in ``body.mass`` or ``loads.force[1].direction``."""
    value: str | None
    """The given value, shortened to one line; None if the field was missing."""
    allowed: str
    """What is allowed. This text completes the sentence "must be ..."."""
    hint: str | None
    """What to do, if more can be said."""
    line: int | None
    """The line in the text, from 1. It is None for a dict, and for a value that was set in the call."""
    column: int | None
    """The column in that line, in characters, from 1."""


class SceneError(ValueError):
    """A scene, or an argument, that cannot be. The error reports every fault of the scene at once.

    ``faults`` lists the faults. ``faults`` is empty where each field is right by itself and the fields together make
    no problem, such as a start without an equilibrium.
    """

    faults: tuple[Fault, ...]

    def __init__(
        self, messages: Sequence[str], faults: Sequence[Mapping[str, Any]] = (), lines: bool = False
    ) -> None:
        head = {0: [], 1: []}.get(len(faults), [f"{len(faults)} faults in the scene"])
        said = messages if lines or not faults else [in_dicts(message) for message in messages]
        super().__init__("\n".join([*head, *said]))
        self.faults = tuple(_fault(one, lines) for one in faults)

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (str(self), self.faults)


def _fault(one: Mapping[str, Any], lines: bool) -> Fault:
    place = lines and one["line"] > 0
    kind, field, value, allowed, hint, line, column = (
        one[name] for name in ("kind", "field", "value", "allowed", "hint", "line", "column")
    )
    hint = hint if lines or hint is None else in_dicts(hint)
    return Fault(kind, field, value, allowed, hint, line if place else None, column if place else None)


def in_dicts(message: str) -> str:
    """Returns a message about TOML as one about dicts: ``mass = 1.0`` becomes ``"mass": 1.0``, [body] "body"."""

    def code(found: re.Match[str]) -> str:
        text = re.sub(r"\b([A-Za-z_]\w*) = ", r'"\1": ', found[0])
        return re.sub(r": (true|false)\b", lambda word: f": {word[1].title()}", text)

    message = re.sub(r"`[^`]*`", code, message.replace("must be a table with", "must be a dict with"))
    message = re.sub(r"\[\[([a-z_]+)\]\]", r'"\1": [{..}]', message)
    message = re.sub(r"\[([a-z_]+)\.([a-z_]+)\]", r'"\1": {"\2": ..}', message)
    return re.sub(r"\[([a-z_]+)\]", r'"\1"', message)


def _again(message: str, faults: tuple[Fault, ...]) -> SceneError:
    """Rebuilds the exception as another process sent it."""
    error = SceneError([message])
    error.faults = faults
    return error


class ComputationError(ArithmeticError):
    """Numbers that the mathematics or double precision cannot serve: no convergence, no equilibrium, digits lost."""
