"""One step after another."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core
from ._errors import no_panic
from ._model import model_of

Array = NDArray[np.float64]


class Stepper:
    """A simulation that is stepped by hand, with inputs that are held over a step.

    Steps are those of ``holonom run``, bit for bit. There is no end time. One call at a time: a
    second one from another thread raises ``RuntimeError``. A step that fails leaves the state as it
    was.

    Parameters
    ----------
    model : a :class:`Model`, the path of a file, or a dictionary of sections.
    inputs : where inputs act: ``"joint"`` or ``"joint.0"`` (N or N·m), ``"body.force"`` (3 columns,
        N, at the centre of mass, in space), ``"body.torque"`` (3 columns, N·m).
    observe : what :meth:`observe` reads: sensors, their columns, ``"joint"``, ``"joint.rate"``.

    Examples
    --------
    >>> stepper = Stepper({
    ...     "model": {"name": "cart", "gravity": [0.0, 0.0, 0.0]},
    ...     "body": [{"name": "cart", "mass": 2.0, "inertia": [1.0, 1.0, 1.0]}],
    ...     "simulation": {"step": 0.01, "end": 1.0},
    ... }, inputs=["cart.force"])
    >>> stepper.step([4.0, 0.0, 0.0], n=100)
    1.0
    >>> round(float(stepper.q[0]), 6)
    1.0
    """

    def __init__(self, model: Any, inputs: Sequence[str] = (), observe: Sequence[str] = ()) -> None:
        self.model = model_of(model)
        self.inputs, self.observed = list(inputs), list(observe)
        self._core = self._begun()

    @no_panic
    def _begun(self) -> _core.Stepper:
        return _core.Stepper(self.model._core, self.inputs, self.observed)

    @no_panic
    def step(self, u: ArrayLike | None = None, n: int = 1) -> float:
        """Takes ``n`` steps.

        Parameters
        ----------
        u : inputs, shape ``(m,)`` in the order of ``inputs``; without them those of before.
        n : how many steps.

        Returns
        -------
        float
            The time, s.

        Raises
        ------
        RunFailed, ValueError
        """
        if n < 0:
            raise ValueError(f"n: {n} steps cannot be taken")
        return self._core.step(None if u is None else _vector(u), n)

    @no_panic
    def observe(self, out: Array | None = None) -> Array:
        """What is observed at the present node, before the step from it, shape ``(k,)``."""
        found = self._core.observe()
        if out is None:
            return found
        out[...] = found
        return out

    @no_panic
    def run(self, controls: ArrayLike, every: int = 1) -> tuple[Array, Array, Array]:
        """Takes a step for each row of ``controls``, shape ``(N, m)``.

        Returns
        -------
        t : times of every ``every``-th node and the last one, s, shape ``(K,)``.
        q : coordinates, shape ``(K, n)``.
        y : what is observed, shape ``(K, k)``.
        """
        rows = np.ascontiguousarray(controls, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != self._core.width:
            raise ValueError(f"controls: shape (N, {self._core.width}), not {rows.shape}")
        if every < 1:
            raise ValueError(f"every: 1 or more, not {every}")
        t, q, seen, failure = self._core.advance(rows, len(rows), every, None)
        if failure is not None:
            raise failure
        return t, q, seen

    @property
    def n(self) -> int:
        """Steps taken."""
        return self._core.place()[0]

    @property
    def t(self) -> float:
        """Time, s."""
        return self._core.place()[1]

    @property
    def q(self) -> Array:
        """Coordinates of the present node, shape ``(n,)``; a copy."""
        return self._core.q()

    @property
    def columns(self) -> list[str]:
        """Names of the coordinates."""
        return self._core.columns()

    @property
    def energy(self) -> dict[str, float]:
        """Parts of the energy and work done at the present node, J."""
        names, values = self._core.energy()
        return dict(zip(names, values, strict=True))

    @property
    def state(self) -> bytes:
        """All that later steps depend on, with the inputs held; it can be stored."""
        return self._core.state()

    @state.setter
    def state(self, state: bytes) -> None:
        self._core.restore(state)

    @no_panic
    def reset(self, state: bytes | None = None) -> None:
        """Back to the start, or to a state."""
        if state is None:
            self._core.reset()
        else:
            self._core.restore(state)

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, (self.model, self.inputs, self.observed, self.state)


def _rebuilt(model: Any, inputs: list[str], observe: list[str], state: bytes) -> Stepper:
    stepper = Stepper(model, inputs, observe)
    stepper.state = state
    return stepper


def _vector(u: ArrayLike) -> Array:
    found = np.ascontiguousarray(u, dtype=np.float64)
    if found.ndim == 0:
        found = found.reshape(1)
    if found.ndim != 1:
        raise ValueError(f"inputs: shape (m,), not {found.shape}")
    return found
