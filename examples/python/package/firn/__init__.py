"""The material point method: simulations that are chosen while the program runs, with NumPy arrays.

    simulation = firn.Simulation({"domain": {"upper": [1, 1, 1], "cell_size": 0.02}, "materials": [{"name": "snow"}]})
    simulation.add("snow", firn.sample_sphere([0.5, 0.5, 0.5], 0.2, spacing=0.01), density=400)
    simulation.run(0.5, progress=True)
    positions = simulation.read("snow", "position")

Arrays have a row for each particle, in the order of ids. All quantities are in SI units.
"""

from __future__ import annotations

import json
import os
import sys
import time as _clock
from typing import Any, Callable, Mapping, Optional, Union, cast

import numpy as np

from . import _firn
from ._firn import (
    ConvergenceError,
    DeviceError,
    Error,
    IoError,
    MemoryError,
    MeshError,
    OverflowError,
    ParameterError,
    ParticleError,
    RunAndBack,
    Samples,
    SimulationCore,
    State,
    UsageError,
    fitted,
    read_obj,
    read_state,
    rotated,
    sample_box,
    sample_mesh,
    sample_sphere,
    write_state,
)

__all__ = [
    "ConvergenceError",
    "DeviceError",
    "Error",
    "IoError",
    "MemoryError",
    "MeshError",
    "OverflowError",
    "ParameterError",
    "ParticleError",
    "Samples",
    "Simulation",
    "State",
    "UsageError",
    "__version__",
    "fitted",
    "gradient",
    "read_obj",
    "read_state",
    "rotated",
    "sample_box",
    "sample_mesh",
    "sample_sphere",
    "write_state",
]

__version__: str = getattr(_firn, "__version__")

# In the words that a user imports them by: "firn.IoError: There is no ...".
for _class in [globals().get(name) for name in __all__]:
    if isinstance(_class, type):
        _class.__module__ = __name__

Choice = Union[str, Mapping[str, Any]]
SetName = Union[int, str]


def _text(value: Choice) -> str:
    if isinstance(value, str):
        return value
    return json.dumps(value, indent=1, ensure_ascii=False, default=lambda one: one.tolist())


class _Line:
    """A progress bar where tqdm is not installed: a line that is written anew about twice a second."""

    def __init__(self, total: float) -> None:
        self.total, self.done, self.next = total, 0.0, 0.0

    def update(self, more: float) -> None:
        self.done += more
        if _clock.monotonic() >= self.next or self.done >= self.total:
            self.next = _clock.monotonic() + 0.5
            print(f"\r{self.done:.6g} of {self.total:.6g} s", end="", file=sys.stderr, flush=True)

    def close(self) -> None:
        print(file=sys.stderr)


def _bar(total: float) -> Any:
    try:
        from tqdm.auto import tqdm  # type: ignore[import-untyped]
    except ImportError:
        return _Line(total)
    form = "{l_bar}{bar}| {n:.4g}/{total:.4g} s [{elapsed}<{remaining}]"
    return tqdm(total=total, bar_format=form)


class Simulation(SimulationCore):
    """A simulation of what `choice` says: a dict, or its JSON text.

    Members of the choice: domain {lower, upper, cell_size, periodic}; materials [{name, properties, parameters}];
    boundary [{shape, ...}]; precision ("float", "double"); transfer ("apic", "aflip"); gravity; fixed_time_step;
    threads. `domain.upper` has 2 or 3 numbers: the dimension. A mistake raises IoError or ParameterError, which say
    where it is: its line is that of the text, for a dict that of json.dumps(choice, indent=1).

    Sets of particles are named by their material, or by their number among the materials.
    Several threads may use a simulation: each call waits for the one before. Steps run without the interpreter's lock.
    """

    def __init__(self, choice: Choice) -> None:
        super().__init__(_text(choice))

    def copy(self) -> Simulation:
        """Returns a copy of the simulation, with its particles."""
        other = Simulation.__new__(Simulation)
        SimulationCore.__init__(other, self)
        return other

    @property
    def choice(self) -> dict[str, Any]:
        """What was chosen, with gravity and the boundary as they are now."""
        return json.loads(self._choice())

    def run(
        self,
        duration: float,
        callback: Optional[Callable[["Simulation"], Any]] = None,
        *,
        every: Optional[float] = None,
        progress: bool = False,
    ) -> None:
        """Takes steps until `duration` [s] has passed; Ctrl-C ends it between two steps.

        callback: called after each step or, with `every`, each time that so many seconds have passed and at the end; if
            it returns False, the run ends. With `every`, the last step before each call is shortened, as by advance().
        progress: whether to show a progress bar, by tqdm if it is installed.
        """
        if every is not None and not every > 0:
            raise ParameterError(f"The time between two calls is {every} s; it must be positive.")
        start = self.time
        end = start + duration
        if not duration >= 0 or end == float("inf"):
            raise ParameterError(f"The duration is {duration} s; it must be finite and not negative.")
        bar = _bar(duration) if progress else None
        calls = 0
        try:
            arrived = not duration > 0
            while not arrived:
                before = self.time
                calls += 1
                stop = end if every is None else min(end, start + calls * every)
                reached = self._step_towards(stop)
                while every is not None and not reached:
                    reached = self._step_towards(stop)
                if bar is not None:
                    bar.update(self.time - before)
                arrived = reached and stop == end
                if callback is not None and callback(self) is False:
                    return
        finally:
            if bar is not None:
                bar.close()

    def read(
        self, set: SetName, field: str, dtype: Any = None, *, out: Optional[np.ndarray] = None
    ) -> np.ndarray:
        """Copies a field of a set, "position" or one of fields(), in the order of ids.

        dtype: float32 or float64; by default that of the run's precision.
        out: an array in the order of C to copy to; it saves the time in which the system finds memory.
        Returns an array of n rows: n numbers, n vectors, or n matrices.
        """
        if out is not None:
            self._read_to(set, field, out)
            return out
        return cast(np.ndarray, self._read(set, field, None if dtype is None else np.dtype(dtype).name))

    def write(self, set: SetName, field: str, values: Any) -> None:
        """Sets a field of a set, in the order of ids. Nothing is changed if a number is not finite."""
        values = np.ascontiguousarray(values)
        self._write(set, field, values if values.dtype == np.float32 else values.astype(np.float64, copy=False))

    def boundary_part(self, part: int) -> dict[str, Any]:
        """Returns a part of the boundary, by its index in the choice, where it is now."""
        return json.loads(self._boundary_part(part))

    def set_boundary_part(self, part: int, **changes: Any) -> None:
        """Changes numbers of a part of the boundary: position, rotation, linear_velocity, friction, ..."""
        self._set_boundary_part(part, _text({**self.boundary_part(part), **changes}))

    def write_state(
        self, path: Union[str, "os.PathLike[str]"], set: SetName = 0, *, compression: int = 0
    ) -> None:
        """Writes the state of a set to an HDF5 file."""
        write_state(path, self.state(set), compression=compression)

    def restore(
        self, set: SetName, state: Union[State, str, "os.PathLike[str]"], *, how: str = "same_bits"
    ) -> None:
        """Restores a set from a state or from its file. how: "same_bits", "other_build" or "converted"."""
        super().restore(set, state if isinstance(state, State) else read_state(state), how=how)


Loss = Callable[[np.ndarray, np.ndarray], "tuple[Any, Any, Any]"]


def gradient(
    simulation: Simulation, duration: float, loss: Loss, *, memory: int = 1 << 30
) -> tuple[float, dict[str, Any]]:
    """Takes a run of `duration` [s], and goes back: returns the value of a loss at its end, and the derivatives of this
    value by everything that the run began with.

    loss(positions, velocities): a function that is called once, with arrays in the order of ids. It returns its value
        and its derivatives by the two arrays, as arrays of the same shapes; None stands for zeros.
    memory: for states of the run [bytes]. Where they have no room, steps are taken again.

    The derivatives are a dict: by "position", "velocity", "affine_velocity", "mass", "volume" and the fields of the
    material's state, of the shapes that read() returns; by "gravity"; by each parameter of the "material", as
    material() has them; and by each number of the parts of the "boundary", as boundary_part() has them.

    A copy runs, to the bits of run(): `simulation` stays as it was, ready for another start. The derivatives are those
    of the steps that were taken, whose sizes are held. There must be one material, in the precision "double", without
    sources and sinks. All steps go without the interpreter's lock; those after the loss do not look at Ctrl-C.
    """
    if memory < 0:
        raise ParameterError(f"The memory is {memory} bytes; it must not be negative.")
    end = simulation.copy()
    way_back = RunAndBack(end, memory)  # has a copy of its own
    end.run(duration)
    positions = end.read(0, "position")
    returned = loss(positions, end.read(0, "velocity"))
    if not isinstance(returned, tuple) or len(returned) != 3:
        raise ParameterError(
            f"The loss returned {_kind(returned)}; it must return its value, its derivatives by the positions, and "
            "those by the velocities or None."
        )
    value = float(returned[0])
    by_position = _derivatives(returned[1], "positions", positions.shape)
    by_velocity = _derivatives(returned[2], "velocities", positions.shape)
    by = way_back.back(duration, by_position, by_velocity)
    by["boundary"] = [json.loads(part) for part in by["boundary"]]
    return value, by


def _kind(of: Any) -> str:
    return f"{len(of)} values" if isinstance(of, tuple) else f"one {type(of).__name__}"


def _derivatives(of: Any, name: str, shape: tuple[int, ...]) -> np.ndarray:
    if of is None:
        return np.empty(0)
    array = np.ascontiguousarray(of, dtype=np.float64)
    if array.shape != shape:
        raise ParameterError(
            f"The loss returned derivatives by the {name} of the shape {array.shape}; the {name} have {shape}."
        )
    if not np.isfinite(array).all():
        raise ParameterError(f"The loss returned derivatives by the {name} that are not finite.")
    return array
