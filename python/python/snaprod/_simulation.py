"""A motion that is stepped: look at its state, steer it, save it, go back."""

from __future__ import annotations

import json
from typing import Any, Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._errors import SceneError
from ._loads import Loads
from ._scene import Given, SceneLike, given, names, numbers, setting, whole
from ._table import Table

__all__ = ["Simulation", "State"]

Array = NDArray[np.float64]


class State:
    """Everything from which a motion goes on. A state pickles, compares and belongs to the scenes of one model.

    ``parts`` has the numbers in the units of the rod, where its length, its bending stiffness and the mass are 1.
    """

    t: float
    """The time, in the units of the scene."""
    method: str
    """The method whose state it is: "start" before the first step, "replay" where the motion saves no state."""
    parts: dict[str, Array]
    """Arrays by their names: chart and velocity, strains at the nodes, memory, bodies, energies."""

    def __init__(self, text: str) -> None:
        self._text = text
        raw = json.loads(text)
        self.t, self.method = raw["t"], raw["method"]
        self.parts = {name: np.array(values, dtype=float) for name, values in raw["parts"].items()}

    def to_json(self) -> str:
        """Returns the state as JSON, from which ``State`` makes it again."""
        return self._text

    def __eq__(self, other: object) -> bool:
        return isinstance(other, State) and self._text == other._text

    def __hash__(self) -> int:
        return hash(self._text)

    def __reduce__(self) -> tuple[Any, ...]:
        return State, (self._text,)

    def __repr__(self) -> str:
        sizes = ", ".join(f"{name} {values.size}" for name, values in self.parts.items())
        return f"<State of {self.method} at t = {self.t:g}: {sizes or 'the start of the scene'}>"


class Simulation:
    """A motion that is stepped.

    Columns of the present state are items and attributes, by their names in ``trajectory.csv``: ``sim["x"]`` is
    ``sim.x``.

    Parameters
    ----------
    scene : dict, str or path
        A scene of motion of rods and bodies, as in :func:`run`. A bar is refused.
    push : bool, str or sequence of str
        The bodies on which :meth:`push` acts: names of bodies of an assembly, or True for the body of one rod.
    loads : dict, optional
        Functions as loads, as in :func:`run`. An exception of a function ends the motion and is raised; ``reset(state)``
        goes back.
    **set
        Fields to be set in the scene.

    Notes
    -----
    A simulation takes the steps of :func:`run`, whatever the times at which it is asked. Pieces that are chained by
    ``advance`` equal one run to rounding, in every model. With ``push`` a step ends at each time of ``advance``, and
    pieces equal one run to the tolerance. So do pieces that are chained by ``state`` and ``reset``. Among obstacles a
    state is the time with the pushes up to it, and ``reset`` follows the motion once more.

    A simulation belongs to the thread that made it.

    Examples
    --------
    >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0}
    >>> start = {"lambda": 6.3, "kappa": 0.6, "velocity": [0.0, -0.5]}
    >>> sim = snaprod.Simulation({"rod": rod, "body": {"mass": 1.0}, "start": start, "run": {"duration": 1.0}})
    >>> sim.advance(0.02)
    >>> before = sim.state
    >>> sim.advance(0.03)
    >>> [event["kind"] for event in sim.events]
    ['snap']
    >>> sim.reset(before)
    >>> sim.t, sim.events
    (0.02, [])
    """

    def __init__(
        self, scene: SceneLike, *, push: bool | str | Sequence[str] = (), loads: Loads | None = None, **set: Any
    ) -> None:
        bodies = [""] if push is True else [] if push is False else names("push", push)
        self._begin(given(scene, set, loads), bodies)

    def _begin(self, source: Given, bodies: list[str]) -> None:
        self._source, self._bodies = source, bodies
        self._changes: dict[str, str] = {}
        self._motion = _core.Simulation(source, bodies)
        self._describe()

    def _describe(self) -> None:
        columns = self._motion.columns()["columns"]
        self._places = {name: i for i, (name, *_) in enumerate(columns)}
        self.units: dict[str, str] = {name: unit for name, unit, *_ in columns}
        self._row: list[Any] | None = None
        self._rows: list[list[Any]] = []

    @property
    def t(self) -> float:
        """The time now."""
        return self._motion.t

    @property
    def duration(self) -> float:
        """The end of time, ``run.duration`` of the scene."""
        return self._motion.duration

    @property
    def ended(self) -> str | None:
        """Why the motion ended before its time; None while it goes on."""
        return self._motion.ended

    @property
    def events(self) -> list[dict[str, Any]]:
        """Snaps, passages, bounces and contacts so far, in the order of time, as ``run.events`` has them."""
        return self._motion.events()

    def advance(self, t: float) -> None:
        """Advances to the time ``t`` exactly.

        What happens at ``t`` itself, such as a snap, belongs to the next advance.

        Raises
        ------
        SceneError
            A time before now, or after ``duration``; a motion that ends before ``t``. The simulation is then at its
            end, and ``ended`` says why.
        KeyboardInterrupt
            After Ctrl-C. The simulation is at the end of a step, and can go on.
        """
        self._row = None
        self._motion.advance(t)

    def step(self) -> bool:
        """Takes one step of the method, or goes to the end of the step under way. Returns False at the end of time."""
        self._row = None
        return self._motion.step()

    def row(self) -> dict[str, Any]:
        """Returns the present state: all columns by their names. A number that does not exist is NaN."""
        values = self._values()
        return {name: self._number(values[i]) for name, i in self._places.items()}

    def _values(self) -> list[Any]:
        if self._row is None:
            self._row = self._motion.row()
        return self._row

    @staticmethod
    def _number(value: Any) -> Any:
        return np.nan if value is None else value

    def __getitem__(self, name: str) -> Any:
        try:
            return self._number(self._values()[self._places[name]])
        except KeyError:
            raise KeyError(f"{name!r}: the columns are {', '.join(self._places)}") from None

    def __getattr__(self, name: str) -> Any:
        if name in self.__dict__.get("_places", {}):
            return self[name]
        raise AttributeError(f"{name!r}: a Simulation has no such attribute or column")

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name for name in self._places if name.isidentifier())]

    def __iter__(self) -> Iterator[str]:
        return iter(self._places)

    def keys(self) -> list[str]:
        """Returns the names of the columns."""
        return list(self._places)

    def shape(self, n: int = 101) -> Array | dict[str, Array]:
        """Returns the rod now: positions of sections, as :meth:`Run.shape` gives them, without the axis of times.

        An assembly gives a dict of arrays, by the names of its rods.
        """
        rods = self._motion.shapes(whole("n", n, 2))
        return rods[""] if list(rods) == [""] else rods

    def push(self, force: ArrayLike, body: str | None = None) -> None:
        """Steers the force on a body: from now on ``force``, along the axes of the world.

        The work of the force is in the column ``work``. The force is 0 at the start.

        Parameters
        ----------
        force : array_like
            Two components in the plane, or three.
        body : str, optional
            The body; without it the first one of ``push`` at the start.

        Raises
        ------
        SceneError
            A body that was not named at the start, or a force that is not finite.

        Examples
        --------
        >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0}
        >>> scene = {"rod": rod, "body": {"mass": 1.0}, "start": {"lambda": 2.0, "kappa": 0.6}, "run": {"duration": 9.0}}
        >>> sim = snaprod.Simulation(scene, push=True)
        >>> for k in range(5):
        ...     sim.push([0.0, -5.0 * sim.vy])  # a controller that brakes
        ...     sim.advance(0.1 * (k + 1))
        >>> sim.work < 0.0
        True
        """
        if not self._bodies:
            raise SceneError(["no body is to be pushed: name them at the start, Simulation(scene, push=True)"])
        if body is not None and body not in self._bodies:
            raise SceneError([f"body = {body!r}: must be one of those of push at the start: {', '.join(self._bodies)}"])
        along = force if isinstance(force, (tuple, list)) else numbers(force).ravel().tolist()
        if len(along) not in (2, 3):
            raise SceneError([f"force has {len(along)} components: must be 2 in the plane, or 3"])
        x, y, z = (float(component) for component in [*along, 0.0][:3])
        self._row = None
        self._motion.push(0 if body is None else self._bodies.index(body), (x, y, z))

    def follow(
        self,
        until: float,
        samples: int = 101,
        *,
        control: Callable[[Simulation], ArrayLike | Mapping[str, ArrayLike] | None] | None = None,
        on_sample: Callable[[Simulation], object] | None = None,
        on_event: Callable[[dict[str, Any]], object] | None = None,
    ) -> Table:
        """Follows the motion to the time ``until`` by samples at even times, and returns their table.

        Parameters
        ----------
        until : float
            The last time.
        samples : int
            The number of samples, the present included, at least 2.
        control : callable, optional
            A controller. It is called with the simulation at every sample but the last, and returns the force on the
            body up to the next sample, or a dict of forces by the names of bodies; None leaves the forces.
        on_sample : callable, optional
            Called with the simulation at every sample.
        on_event : callable, optional
            Called with every event, at the first sample after it.

        Returns
        -------
        Table
            The columns of the trajectory, a row for each sample.

        Raises
        ------
        Exception
            Any exception of a function. The simulation stays at its sample, and ``recorded`` has the samples so far.

        Examples
        --------
        >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0}
        >>> scene = {"rod": rod, "body": {"mass": 1.0}, "start": {"lambda": 2.0, "kappa": 0.6}, "run": {"duration": 9.0}}
        >>> sim = snaprod.Simulation(scene, push=True)
        >>> braked = sim.follow(2.0, 201, control=lambda now: [-2.0 * now.vx, -2.0 * now.vy])
        >>> braked.rows, bool(braked["kinetic"][-1] < 0.1 * braked["kinetic"].max())
        (201, True)
        """
        times = np.linspace(self.t, until, whole("samples", samples, 2))
        rows: list[list[Any]] = []
        self._rows = rows
        told = len(self.events)
        for k, t in enumerate(times.tolist()):
            if k > 0:
                self.advance(t)
            rows.append(self._values())
            if on_event is not None:
                events = self.events
                for event in events[told:]:
                    on_event(event)
                told = len(events)
            if on_sample is not None:
                on_sample(self)
            if control is not None and k + 1 < times.size:
                forces = control(self)
                if isinstance(forces, Mapping):
                    for body, force in forces.items():
                        self.push(force, body)
                elif forces is not None:
                    self.push(forces)
        return self.recorded

    @property
    def recorded(self) -> Table:
        """The samples of the last ``follow``, also of one that an exception has ended."""
        columns = {}
        for name, i in self._places.items():
            values = [row[i] for row in self._rows]
            words = any(isinstance(value, str) for value in values)
            gap: Any = "" if words else np.nan
            columns[name] = np.array([gap if value is None else value for value in values])
        return Table("trajectory", columns, self.units)

    def set(self, **set: Any) -> None:
        """Changes fields of the scene from now on: loads, friction, tensions, ``run__duration``.

        The change of energy is booked as work. The scene is read once more, and the method starts anew at the present
        state: some milliseconds. A force that changes often is steered by :meth:`push` in microseconds.

        Raises
        ------
        SceneError
            A field that cannot change while a motion goes on: the message lists those that can. A state that cannot be
            saved. The simulation is then unchanged.

        Examples
        --------
        >>> rod = {"model": "elastica", "length": 1.0, "bending_stiffness": 1.0}
        >>> scene = {"rod": rod, "body": {"mass": 1.0}, "start": {"lambda": 2.0, "kappa": 0.6}, "run": {"duration": 9.0}}
        >>> sim = snaprod.Simulation(scene)
        >>> sim.advance(0.5)
        >>> total = sim.total
        >>> sim.set(loads__gravity=[0.0, -1.0])
        >>> abs(sim.total - total) < 1e-12
        True
        """
        fields = dict(setting(*one) for one in set.items())
        changes = {**self._changes, **fields}
        self._motion.change(_changed(self._source, changes))
        self._changes, self._row = changes, None

    @property
    def state(self) -> State:
        """Everything from which the motion goes on; :meth:`reset` takes it."""
        return State(self._motion.state())

    def reset(self, state: State | None = None) -> None:
        """Goes back to the start of the scene, or to a state of this or of another simulation of the scene.

        Raises
        ------
        SceneError
            The state of another model.
        """
        self._row = None
        if state is None:
            self._motion.reset()
            self._changes = {}
        else:
            self._motion.restore(state.to_json())

    def copy(self) -> Simulation:
        """Returns a simulation of its own in the same state. A replayed state follows the motion once more."""
        other = object.__new__(Simulation)
        other._source, other._bodies, other._changes = self._source, self._bodies, dict(self._changes)
        other._motion = self._motion.copy()
        other._describe()
        return other

    __copy__ = copy

    def __deepcopy__(self, memo: Mapping[int, Any]) -> Simulation:
        return self.copy()

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (self._source, self._bodies, self._changes, self.state)

    def __repr__(self) -> str:
        count = len(self.events)
        return f"<Simulation: t = {self.t:g} of {self.duration:g}, {count} event{'' if count == 1 else 's'}>"


def _changed(source: Given, changes: dict[str, str]) -> Given:
    """Returns a scene with changed fields, without the functions: these stay with the motion."""
    text, overrides, name, _ = source
    return text, [*overrides, *(f"{path}={value}" for path, value in changes.items())], name, []


def _again(source: Given, bodies: list[str], changes: dict[str, str], state: State) -> Simulation:
    """Returns the simulation that was pickled, without its events."""
    made = object.__new__(Simulation)
    made._begin(source, bodies)
    if changes:
        made._motion.change(_changed(source, changes))
        made._changes = changes
    made.reset(state)
    return made
