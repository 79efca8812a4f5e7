"""The compiled module: studies of the library."""

from os import PathLike
from typing import Any, Callable

from numpy import float64
from numpy.typing import NDArray

__version__: str

_Given = tuple[str, list[str], str | None]
_Call = Callable[[float, float], object] | None

def toml(field: str, value: object) -> str: ...
def path(path: str) -> str: ...
def check(given: _Given) -> dict[str, Any]: ...
def run(given: _Given, strain: str, progress: _Call) -> dict[str, Any]: ...
def shapes(
    given: _Given, times: NDArray[float64], points: int
) -> tuple[list[str], list[list[int]], NDArray[float64]]: ...
def equilibrium(given: _Given) -> dict[str, Any]: ...
def branch(given: _Given, progress: _Call) -> dict[str, Any]: ...
def modes(given: _Given) -> dict[str, Any]: ...
def memory(given: _Given, span: tuple[float | None, float | None], points: int) -> dict[str, Any]: ...
def elastica(
    at: list[float],
    lam: float,
    kappa: float | None,
    p: float | None,
    sheet: tuple[int, bool, float, float] | None,
) -> dict[str, Any]: ...
def equilibria(
    x: NDArray[float64], y: NDArray[float64], lambda_max: float, progress: _Call
) -> tuple[list[int], dict[str, Any]]: ...
def folds(count: int) -> dict[str, Any]: ...
def data(name: str, text: str) -> tuple[list[str], list[list[float]]]: ...
def fit(
    given: _Given,
    data: tuple[list[str], list[list[float]]],
    free: list[str],
    set_by_row: list[str],
    noise: list[tuple[str, float]],
    starts: int,
    seed: int,
    progress: _Call,
) -> dict[str, Any]: ...

class Sweep:
    points: int
    identity: str
    done: int
    names: tuple[list[str], list[str]]
    shape: list[int]
    def __init__(
        self,
        scene: str,
        set: list[str],
        vary: list[str],
        random: tuple[int, int] | None,
        columns: list[str],
        path: str | PathLike[str],
    ) -> None: ...
    def points_of(self, chunk: int) -> int: ...
    def missing(self) -> list[int]: ...
    def make(self, chunk: int) -> bool: ...
    def stop(self) -> None: ...
    def rows(self) -> tuple[list[str], list[list[str]], bytes]: ...
