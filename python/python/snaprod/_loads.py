"""Functions of time and of the motion as loads on bodies."""

from __future__ import annotations

from typing import Any, Callable, Mapping, Sequence, Tuple, Union

from numpy.typing import ArrayLike

from ._core import BodyState
from ._errors import SceneError

__all__ = ["BodyState", "Piecewise"]

LoadFunction = Callable[[float, BodyState], ArrayLike]
"""A load: a function of the time and of the state of its body, which returns a force or a couple."""

Loads = Mapping[str, Union[LoadFunction, Mapping[str, LoadFunction]]]
"""Functions by "force" and "couple" on the body or free end of one rod; of an assembly by the names of its bodies first."""

GivenLoad = Tuple[str, str, LoadFunction, list[float]]

_KINDS = ("force", "couple")


class Piecewise:
    """A load that is smooth between given times, at which it may jump.

    A step of the motion ends at each of the times, so that the order of the method holds.

    Parameters
    ----------
    f : callable
        The function of the time and of the state of the body.
    jumps : sequence of float
        The times, in growing order.

    Examples
    --------
    >>> kick = snaprod.Piecewise(lambda t, body: [0.0, 2.0 if t < 0.5 else 0.0], jumps=[0.5])
    >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0}
    >>> scene = {"rod": rod, "body": {"mass": 1.0}, "start": {"lambda": 2.0, "kappa": 0.6}, "run": {"duration": 1.0}}
    >>> run = snaprod.run(scene, loads={"force": kick})
    >>> work = run.at([0.5, 0.75, 1.0])["work"]
    >>> bool(work[0] != 0.0 and work[0] == work[1] == work[2])
    True
    """

    def __init__(self, f: LoadFunction, jumps: Sequence[float]) -> None:
        self.f, self.jumps = f, [float(t) for t in jumps]

    def __call__(self, t: float, body: BodyState) -> ArrayLike:
        return self.f(t, body)


def acting(loads: Loads | None) -> list[GivenLoad]:
    """Returns functions with their bodies, kinds and jumps.

    Raises SceneError for a name or a value that is none of a load.
    """
    found: list[GivenLoad] = []

    def add(body: str, kind: str, f: Any) -> None:
        name = f"loads[{kind!r}]" if not body else f"loads[{body!r}][{kind!r}]"
        if kind not in _KINDS:
            raise SceneError([f'{name}: must be "force" or "couple"; in an assembly {{"NAME": {{"force": f}}}} by the name of the body'])
        if not callable(f):
            raise SceneError([f"{name} = {f!r}: must be a function f(t, body) that returns an array"])
        found.append((body, kind, f, f.jumps if isinstance(f, Piecewise) else []))

    for name, one in (loads or {}).items():
        if isinstance(one, Mapping):
            for kind, f in one.items():
                add(str(name), str(kind), f)
        else:
            add("", str(name), one)
    return found
