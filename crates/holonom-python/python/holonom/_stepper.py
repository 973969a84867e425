"""One step after another."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core
from ._acting import Acts, coordinates, names
from ._errors import RunFailed, as_error, guarded
from ._model import model_of
from ._numbers import natural
from ._result import Result

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from ._acting import Forces, Laws, Motions
    from ._parts import Name

    Array = NDArray[np.float64]


@guarded("step", "observe")
class Stepper:
    """A simulation that is stepped by hand, with inputs that are held over a step.

    Steps are those of ``holonom run``, bit for bit. There is no end time. One call at a time: a
    second one, from another thread or from a function that acts, raises ``RuntimeError``. A step
    that fails leaves the state as it was.

    Parameters
    ----------
    model : a :class:`Model`, a :class:`Spec`, the path of a file, or a dictionary of sections.
    inputs : where inputs act: ``"joint"`` or ``"joint.0"`` (N or N·m), ``"body.force"`` (3 columns,
        N, at the centre of mass, in space), ``"body.torque"`` (3 columns, N·m),
        ``"joint.motor.path"``: what the motor of a joint follows in the place of its path (m, rad).
    observe : what :meth:`observe` reads: sensors, their columns, ``"joint"``, ``"joint.rate"``.
    laws, forces, motions : as of :func:`simulate`.

    Attributes
    ----------
    observed : the names of what is observed.

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

    def __init__(
        self,
        model: Any,
        inputs: Sequence[Name] = (),
        observe: Sequence[Name] = (),
        *,
        laws: Laws | None = None,
        forces: Forces | None = None,
        motions: Motions | None = None,
    ) -> None:
        self.model = model_of(model)
        self.inputs, self.observed = list(names(inputs)), list(names(observe))
        self._acts = Acts(tuple(self.inputs), tuple(self.observed), laws, forces, motions)
        self._core = self._begun()
        self._step, self._observe = self._core.step, self._core.observe

    def _begun(self) -> _core.Stepper:
        return _core.Stepper(self.model._core, self._acts.core())

    def step(self, u: ArrayLike | None = None, n: int = 1) -> float:
        """Takes ``n`` steps.

        Parameters
        ----------
        u : inputs, N or N·m, of set points m or rad, shape ``(m,)`` in the order of ``inputs``;
            without them those of before.
        n : how many steps.

        Returns
        -------
        float
            The time, s.

        Raises
        ------
        RunFailed, ValueError
        FunctionFailed
            When a function that acts gives no finite numbers. What it raises itself is raised.
        """
        try:
            return self._step(u, n)
        except BaseException as error:
            raise as_error(error) from error.__cause__

    def observe(self, out: Array | None = None) -> Array:
        """What is observed at the present node, before the step from it.

        Parameters
        ----------
        out : an array that gets the numbers in their units, and is returned, shape ``(k,)``.

        Returns
        -------
        array (k,)
            In the units of what is observed; rates by s.
        """
        try:
            return self._observe(out)
        except BaseException as error:
            raise as_error(error) from error.__cause__

    def run(self, controls: ArrayLike, every: int = 1) -> Result:
        """Takes a step for each row of ``controls``, without Python in the loop.

        Parameters
        ----------
        controls : inputs of each step, N or N·m, of set points m or rad, shape ``(N, m)``.
        every : steps from one recorded node to the next; the last node is always recorded.

        Returns
        -------
        Result
            With ``t`` (s), shape ``(K,)``, ``q``, shape ``(K, n)``, and as ``sensors`` what is
            observed, shape ``(K, k)``. It has no energies and no files.

        Raises
        ------
        RunFailed
            With the ``result`` up to there; the stepper stays there.
        ValueError
            For another shape, and numbers that are not finite.
        """
        rows = np.ascontiguousarray(controls, dtype=np.float64)
        if rows.ndim != 2 or rows.shape[1] != self._core.width:
            raise ValueError(f"controls: shape (N, {self._core.width}), not {rows.shape}")
        every = natural("every", every, 1)
        first = self.n
        t, q, seen, failure = self._core.advance(rows, len(rows), every, None)
        taken = self.n - first
        nodes = np.arange(first, first + len(t) * every, every)
        nodes = np.minimum(nodes, first + len(rows)).astype(np.uint64)
        summary: dict[str, Any] = {"model": self.model.name, "steps": taken, "status": "done"}
        if isinstance(failure, RunFailed):
            summary["status"] = "failed"
            summary["failure"] = {"step": failure.step, "t": failure.t}
            summary["failure"] |= {"message": failure.reason, "remedy": failure.remedy}
        names, units = self._core.observed()
        found = {"step": nodes, "t": t, "q": (self.columns, q), "summary": summary}
        found["text"] = f"{self.model.name}: {taken} steps to t = {self.t:g} s"
        if names:
            found["sensors"] = (names, seen, units)
        result = Result(self.model, found)
        result._stepped = True
        if isinstance(failure, RunFailed):
            failure.result = result
        if failure is not None:
            raise failure
        return result

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
        """Coordinates of the present node: positions, m, directors, 1; shape ``(n,)``; a copy."""
        return self._core.q()

    @property
    def v(self) -> Array:
        """Velocities of the coordinates at the present node, m/s and 1/s, shape ``(n,)``; a copy."""
        return self._core.v()

    @property
    def columns(self) -> list[str]:
        """Names of the coordinates."""
        return self._core.columns()

    @property
    def held(self) -> Array:
        """What the inputs hold, N or N·m, of set points m or rad, shape ``(m,)``."""
        return np.array(self._core.held())

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

    def reset(
        self,
        joints: Mapping[Any, Any] | None = None,
        rates: Mapping[Any, Any] | None = None,
        *,
        state: bytes | None = None,
    ) -> None:
        """Back to the start, to a state, or to a start with other coordinates of joints.

        Parameters
        ----------
        joints : by joints, coordinates to begin with, m or rad: a number, or one for each
            coordinate. Other joints begin as in the model; closed loops are closed. An angle counts
            modulo a revolution.
        rates : likewise rates, m/s or rad/s.
        state : of :attr:`state`.

        Raises
        ------
        InvalidModel
            Where no configuration or no velocities are of this kind.
        StateMismatch
        TypeError
            For a state beside coordinates and rates.
        """
        if state is not None:
            if joints or rates:
                raise TypeError("reset: a state, or coordinates and rates of joints")
            self._core.restore(state)
        else:
            self._core.reset(coordinates("joints", joints), coordinates("rates", rates))

    def __reduce__(self) -> tuple[Any, ...]:
        acts = self._acts
        functions = (acts.laws, acts.forces, acts.motions)
        return _rebuilt, (self.model, self.inputs, self.observed, functions, self.state)

    def __deepcopy__(self, memo: dict[int, Any]) -> Stepper:
        made, given = self.__reduce__()
        copied: Stepper = made(*given)
        return copied


def _rebuilt(
    model: Any, inputs: list[str], observe: list[str], functions: tuple[Any, Any, Any], state: bytes
) -> Stepper:
    laws, forces, motions = functions
    stepper = Stepper(model, inputs, observe, laws=laws, forces=forces, motions=motions)
    stepper.state = state
    return stepper
