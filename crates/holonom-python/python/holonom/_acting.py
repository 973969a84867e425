"""What acts on a run from outside its model: inputs, laws, forces of bodies, paths, a controller."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from . import _core

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ._parts import Name

    Laws = Mapping[Any, "Law | Callable[[float, float, float], Any]"]
    Forces = Mapping[Any, Callable[[float, Any], ArrayLike]]
    Motions = Mapping[Any, Callable[[float], tuple[float, float, float]]]
    Start = Mapping[Any, Any]
    Control = Callable[[float, Any], ArrayLike]

SIGNATURE = "double law(double t, double x, double v, double *slopes)"


@dataclass(frozen=True)
class Law:
    """A force or torque along a joint coordinate by a function.

    Attributes
    ----------
    function : ``f(t, x, v)`` with the time, s, the coordinate, m or rad, and its rate; gives the
        effort, N or N·m, on the child of the joint, or a tuple of it with its derivatives by ``x``
        and by ``v``. It has to be a function of its arguments alone: Newton's method calls it for
        trial values, and not at all for those that it remembers. Without derivatives they are
        differences, by two more calls.
    conservative : whether it conserves energy. Others are taken for damping, and refused by
        compositions of an order above 2.
    """

    function: Any
    conservative: bool = False


@dataclass(frozen=True)
class CompiledLaw(Law):
    """A law by machine code, see :func:`compiled`.

    Attributes
    ----------
    address : of the function.
    """

    address: int = 0


def compiled(function: Any, *, conservative: bool = False) -> CompiledLaw:
    """A law of machine code: ``double law(double t, double x, double v, double *slopes)``.

    It writes the derivatives of the effort by ``x`` and ``v`` to ``slopes[0]`` and ``slopes[1]``.
    The interpreter is released while it runs.

    Parameters
    ----------
    function : a ``cfunc`` of numba with the signature
        ``float64(float64, float64, float64, CPointer(float64))``, or a function of ctypes with
        ``restype`` and ``argtypes``.
    conservative : as of :class:`Law`.

    Returns
    -------
    CompiledLaw

    Raises
    ------
    TypeError
        For a function of another signature.

    Examples
    --------
    >>> import ctypes
    >>> double, slopes = ctypes.c_double, ctypes.POINTER(ctypes.c_double)
    >>> @ctypes.CFUNCTYPE(double, double, double, double, slopes)
    ... def spring(t, x, v, slopes):
    ...     slopes[0], slopes[1] = -4.0, 0.0
    ...     return -4.0 * x
    >>> law = compiled(spring, conservative=True)
    """
    import ctypes

    kind_of_ctypes: Any = ctypes._CFuncPtr  # type: ignore[attr-defined]
    if isinstance(function, kind_of_ctypes):
        double = ctypes.c_double
        arguments = list(function.argtypes or getattr(type(function), "_argtypes_", ()))
        result = function.restype
        slopes = arguments[3:]
        pointer = len(slopes) == 1 and slopes[0] in (ctypes.POINTER(double), ctypes.c_void_p)
        if result is not double or arguments[:3] != [double] * 3 or not pointer:
            raise TypeError(f"the function has to be `{SIGNATURE}`: set its restype and argtypes")
        address = ctypes.cast(function, ctypes.c_void_p).value
    else:
        address = getattr(function, "address", None)
        signature = str(getattr(function, "_sig", ""))
        wanted = "(float64, float64, float64, float64*) -> float64"
        if not isinstance(address, int) or signature and signature != wanted:
            kind = signature or type(function).__name__
            raise TypeError(f"a cfunc of numba or a function of ctypes is wanted, `{SIGNATURE}`, not {kind}")
    if not address:
        raise TypeError("the address of the function is zero")
    return CompiledLaw(function, conservative, address)


@dataclass(frozen=True)
class Acts:
    """All that acts on a run, as it was given."""

    inputs: tuple[str, ...] = ()
    observe: tuple[str, ...] = ()
    laws: Laws | None = None
    forces: Forces | None = None
    motions: Motions | None = None
    joints: Start | None = None
    rates: Start | None = None
    rows: Any = None
    control: Control | None = None
    control_every: int = 1

    def core(self) -> _core.Acting:
        """The same for the compiled part.

        Raises
        ------
        TypeError, ValueError
        """
        if self.control_every < 1:
            raise ValueError(f"control_every: 1 or more, not {self.control_every}")
        control = None if self.control is None else (_callable("control", self.control), self.control_every)
        return _core.Acting(
            inputs=list(self.inputs),
            observe=list(self.observe),
            laws=[_law(str(name), law) for name, law in (self.laws or {}).items()],
            forces=[(str(n), _callable(f"the force on `{n}`", f)) for n, f in (self.forces or {}).items()],
            motions=[(str(n), _callable(f"the motion of `{n}`", f)) for n, f in (self.motions or {}).items()],
            joints=coordinates("joints", self.joints),
            rates=coordinates("rates", self.rates),
            rows=self.rows,
            control=control,
        )

    @property
    def is_empty(self) -> bool:
        """Whether nothing acts."""
        return self == Acts()


def names(given: Sequence[Name] | Name) -> tuple[str, ...]:
    """Names of inputs or observations; one alone is a list of one."""
    return (given,) if isinstance(given, str) else tuple(str(name) for name in given)  # type: ignore[union-attr]


def coordinates(what: str, given: Start | None) -> list[tuple[str, int, float]]:
    """Joints with which of their coordinates and its value."""
    found = []
    for name, values in (given or {}).items():
        numbers = np.atleast_1d(np.asarray(values, dtype=np.float64))
        if numbers.ndim != 1:
            raise ValueError(f"{what}: {name} has shape {numbers.shape}, not a number or (k,)")
        found += [(str(name), k, float(value)) for k, value in enumerate(numbers)]
    return found


def held(inputs: Mapping[Any, ArrayLike], steps: int) -> tuple[tuple[str, ...], list[float]]:
    """Names and values of inputs for each step of a run, row after row.

    A value is constant (a number, or ``(3,)`` of a force or a torque), or has a row for each step.
    """
    columns: list[Any] = []
    for name, given in inputs.items():
        values = np.asarray(given, dtype=np.float64)
        width = 3 if str(name).endswith((".force", ".torque")) else 1
        if values.shape in ((), (1,)) and width == 1 or values.shape == (width,) != (steps,):
            values = np.broadcast_to(values.reshape(1, width), (steps, width))
        elif values.shape == (steps,) and width == 1:
            values = values.reshape(steps, 1)
        if values.shape != (steps, width):
            rows = f"({steps},)" if width == 1 else f"({steps}, 3)"
            single = "()" if width == 1 else "(3,)"
            raise ValueError(f"inputs: {name} has shape {values.shape}, not {single} or {rows}, a row for each step")
        if not np.isfinite(values).all():
            raise ValueError(f"inputs: {name} has a number that is not finite")
        columns.append(values)
    rows_of = np.hstack(columns) if columns else np.empty((steps, 0))
    return tuple(str(name) for name in inputs), rows_of.ravel().tolist()


def _callable(what: str, function: Any) -> Any:
    if not callable(function):
        raise TypeError(f"{what} has to be a function, not a {type(function).__name__}")
    return function


def _law(name: str, law: Any) -> tuple[str, Any, int, bool]:
    if isinstance(law, CompiledLaw):
        return name, law.function, law.address, law.conservative
    if not isinstance(law, Law):
        law = Law(law)
    return name, _callable(f"the law of joint `{name}`", law.function), 0, law.conservative
