"""Many steppers, a step of all in one call."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._acting import Acts, coordinates, names
from ._errors import RunFailed, guarded
from ._model import model_of
from ._numbers import natural, threads_of

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ._parts import Name

    Array = NDArray[np.float64]


@guarded()
class Ensemble:
    """``M`` members of a model that are stepped together on threads of this process.

    Each takes the steps of a :class:`Stepper`, bit for bit, whoever is beside it and however many
    threads there are. A member that fails stays where it failed until it is reset; the others go
    on.

    Parameters
    ----------
    model : a :class:`Model`, a :class:`Spec`, the path of a file, or a dictionary of sections.
    members : how many; by default as many as ``set`` has.
    inputs, observe : as of :class:`Stepper`.
    set : values that each member replaces, one mapping for each.
    threads : how many; by default the processors that this process may use.

    Attributes
    ----------
    observed : the names of what is observed.

    Raises
    ------
    InvalidModel, UnknownName
    ValueError
        For no members, or another number of values.

    Examples
    --------
    >>> ensemble = Ensemble({
    ...     "model": {"name": "cart", "gravity": [0.0, 0.0, 0.0]},
    ...     "body": [{"name": "cart", "mass": 2.0, "inertia": [1.0, 1.0, 1.0]}],
    ...     "simulation": {"step": 0.01, "end": 1.0},
    ... }, 2, inputs=["cart.force"])
    >>> ensemble.step([[4.0, 0.0, 0.0], [0.0, 8.0, 0.0]], n=100).shape
    (2,)
    >>> ensemble.q[:, :2].round(6).tolist()
    [[1.0, 0.0], [0.0, 2.0]]
    """

    def __init__(
        self,
        model: Any,
        members: int | None = None,
        *,
        inputs: Sequence[Name] = (),
        observe: Sequence[Name] = (),
        set: Sequence[Mapping[str, Any]] | None = None,
        threads: int | None = None,
    ) -> None:
        self.model = model_of(model)
        count = members if members is not None else len(set or [])
        if count < 1 or set is not None and len(set) != count:
            raise ValueError(f"members: {count}, and set is of {len(set or [])}")
        self.inputs, self.observed = list(names(inputs)), list(names(observe))
        self.threads = threads_of(threads)
        acts = Acts(tuple(self.inputs), tuple(self.observed))
        each = [self.model] * count if set is None else [self.model.replace(own) for own in set]
        self._core = _core.Ensemble([own._core for own in each], acts.core())
        self._count = count

    def __len__(self) -> int:
        return self._count

    def step(self, u: ArrayLike | None = None, n: int = 1) -> Array:
        """Takes ``n`` steps of all members that have not failed.

        Parameters
        ----------
        u : inputs, N or N·m, of set points m or rad, shape ``(M, m)``, or ``(m,)`` for all; without
            them those of before.
        n : how many steps.

        Returns
        -------
        array (M,)
            The times, s.

        Raises
        ------
        ValueError
            For another shape, and numbers that are not finite.
        """
        n = natural("n", n, 0)
        shape = (self._count, self._core.width)
        rows = None
        if u is not None:
            rows = np.ascontiguousarray(u, dtype=np.float64)
            if rows.shape == shape[1:]:
                rows = np.ascontiguousarray(np.broadcast_to(rows, shape))
            if rows.shape != shape:
                raise ValueError(f"inputs: shape {shape}, not {rows.shape}")
        return self._core.step(rows, n, self.threads)

    def observe(self, out: Array | None = None) -> Array:
        """What is observed at the present nodes.

        Parameters
        ----------
        out : an array that gets the numbers in their units, and is returned, shape ``(M, k)``.

        Returns
        -------
        array (M, k)
            In the units of what is observed; rates by s.

        Raises
        ------
        ValueError
            For an array of another shape.
        """
        found = self._core.observe()
        if out is None:
            return found
        if out.shape != found.shape:
            raise ValueError(f"out: shape {found.shape}, not {out.shape}")
        out[...] = found
        return out

    @property
    def q(self) -> Array:
        """Coordinates of the present nodes: positions, m, directors, 1; shape ``(M, n)``; a copy."""
        return self._core.q()

    @property
    def t(self) -> Array:
        """Times, s, shape ``(M,)``."""
        return np.array([t for _, t in self._core.places()])

    @property
    def failures(self) -> dict[int, RunFailed]:
        """Why members failed, by their numbers."""
        return dict(self._core.failures())

    def reset(
        self,
        members: Iterable[int] | None = None,
        joints: Mapping[Any, Any] | Sequence[Mapping[Any, Any]] | None = None,
        rates: Mapping[Any, Any] | Sequence[Mapping[Any, Any]] | None = None,
    ) -> None:
        """Members go back to their start, as :meth:`Stepper.reset`.

        Parameters
        ----------
        members : numbers of members; all by default.
        joints, rates : coordinates and rates of joints: one mapping, or one for each of the members.

        Raises
        ------
        IndexError
            For a member that there is not.
        ValueError
            For another number of mappings.
        """
        which = range(self._count) if members is None else [natural("members", k, 0) for k in members]
        for k in which:
            if k >= self._count:
                raise IndexError(f"members: there are 0 to {self._count - 1}, not {k}")
        for given in (joints, rates):
            if isinstance(given, Sequence) and len(given) != len(which):
                raise ValueError(f"joints, rates: {len(given)} mappings for {len(which)} members")
        for place, k in enumerate(which):
            own = [given[place] if isinstance(given, Sequence) else given for given in (joints, rates)]
            self._core.reset(k, coordinates("joints", own[0]), coordinates("rates", own[1]))

    @property
    def states(self) -> list[bytes]:
        """States of the members, those of a :class:`Stepper` with equal inputs and observations."""
        return [self._core.state(k) for k in range(self._count)]

    @states.setter
    def states(self, states: Sequence[bytes]) -> None:
        if len(states) != self._count:
            raise ValueError(f"{len(states)} states for {self._count} members")
        for k, state in enumerate(states):
            self._core.restore(k, state)
