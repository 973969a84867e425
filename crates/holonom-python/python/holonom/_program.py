"""The nonlinear program of an optimum, for methods that are written or called in Python."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Places = NDArray[np.int64]


@dataclass
class Proposal:
    """The point that a method proposes, with its multipliers.

    At an optimum ``∇f + Jᵀ rows − lower + upper = 0`` with ``lower, upper ≥ 0``; an entry of
    ``rows`` is positive where the upper bound of its row is active, negative where the lower one is.

    Attributes
    ----------
    x : shape ``(n,)``, in the units of the program's variables.
    rows : multipliers of the rows, units of the cost by those of a row, shape ``(m,)``.
    lower, upper : multipliers of the bounds of variables, in such units, shape ``(n,)``, or one number.
    outcome : ``"optimal"``, ``"acceptable"``, ``"infeasible"``, ``"stopped"``, ``"exhausted"`` (no
        more iterations are allowed), or how the method failed, in its own words.
    """

    x: ArrayLike
    rows: ArrayLike
    lower: ArrayLike | float = 0.0
    upper: ArrayLike | float = 0.0
    outcome: str = "optimal"


class Program:
    """A nonlinear program with exact derivatives, as a method sees it while it solves it.

    ::

        minimise f(x)   over   x_L ≤ x ≤ x_U,   g_L ≤ g(x) ≤ g_U

    Sparse matrices have places that never change; an entry that is listed several times is the sum
    of its values. Functions are NaN where the motion does not exist.

    Attributes
    ----------
    start : the guess: coordinates of the motion, values of controls, the time, in their units, shape
        ``(n,)``.
    multipliers : those of an earlier point nearby, a :class:`Proposal` at the guess, or ``None``.
    near : whether the guess is near an optimum.
    variable_bounds : in their units, shape ``(n, 2)``, infinite where there are none.
    row_bounds : in the units of the rows, shape ``(m, 2)``, equal where a row is an equation.
    jacobian_places : row and column of the entries of ``J = ∂g/∂x``, shape ``(k, 2)``.
    hessian_places : those of the Hessian of the Lagrangian, its lower triangle, shape ``(l, 2)``.
    """

    def __init__(self, core: Any) -> None:
        self._core = core
        start, multipliers, self.near = core.start()
        self.start: Array = np.array(start, dtype=np.float64)
        self.multipliers: Proposal | None = None
        if multipliers is not None:
            rows, lower, upper = (np.array(own, dtype=np.float64) for own in multipliers)
            self.multipliers = Proposal(self.start.copy(), rows, lower, upper)
        self.variable_bounds: Array
        self.row_bounds: Array
        self.variable_bounds, self.row_bounds = core.bounds()
        self.jacobian_places: Places = core.jacobian_places()
        self.hessian_places: Places = core.hessian_places()

    def _asked(self) -> Any:
        if self._core is None:
            raise RuntimeError("the search has ended: a program lives as long as the call of its method")
        return self._core

    def cost(self, x: ArrayLike) -> float:
        """``f(x)``.

        Parameters
        ----------
        x : in the units of the variables, shape ``(n,)``.

        Returns
        -------
        float
        """
        return float(self._asked().cost(_vector(x)))

    def cost_gradient(self, x: ArrayLike) -> Array:
        """``∇f(x)``.

        Parameters
        ----------
        x : in the units of the variables, shape ``(n,)``.

        Returns
        -------
        array (n,)
            In the unit of the cost by the units of the variables.
        """
        found: Array = self._asked().cost_gradient(_vector(x))
        return found

    def rows(self, x: ArrayLike) -> Array:
        """``g(x)``.

        Parameters
        ----------
        x : in the units of the variables, shape ``(n,)``.

        Returns
        -------
        array (m,)
            In the units of the rows.
        """
        found: Array = self._asked().row_values(_vector(x))
        return found

    def jacobian(self, x: ArrayLike) -> Array:
        """The entries of ``J(x)`` at :attr:`jacobian_places`.

        Parameters
        ----------
        x : in the units of the variables, shape ``(n,)``.

        Returns
        -------
        array (k,)
            In the units of rows by those of variables.
        """
        found: Array = self._asked().jacobian(_vector(x))
        return found

    def hessian(self, x: ArrayLike, rows: ArrayLike, factor: float = 1.0) -> Array:
        """The entries of ``factor ∇²f(x) + Σ rows_i ∇²g_i(x)`` at :attr:`hessian_places`.

        Parameters
        ----------
        x : in the units of the variables, shape ``(n,)``.
        rows : multipliers of the rows, in the units of a :class:`Proposal`, shape ``(m,)``.
        factor : of the cost.

        Returns
        -------
        array (l,)
            In the unit of the cost by the units of two variables.
        """
        found: Array = self._asked().hessian(_vector(x), float(factor), _vector(rows))
        return found

    def row_name(self, row: int) -> str:
        """What a row states, in words.

        Parameters
        ----------
        row : from 0 on.

        Returns
        -------
        str
        """
        return str(self._asked().row_name(row))

    def tell(
        self,
        iteration: int,
        cost: float,
        *,
        infeasibility: float = np.nan,
        stationarity: float = np.nan,
        barrier: float = np.nan,
        step: float = np.nan,
        shift: float = np.nan,
    ) -> bool:
        """Tells of an iteration, which becomes a row of ``found.iterations``; one that was told before
        is told anew.

        Parameters
        ----------
        iteration : from 0 on.
        cost : ``f``.
        infeasibility, stationarity : the largest violation of a row, and entry of the gradient of the
            Lagrangian.
        barrier, step : the parameter of a barrier, the part of the step that was taken.
        shift : multiple of the identity that was added to the Hessian. Where it is 0 in the last
            iteration, the Hessian is taken to be positive definite on the rows: no motion nearby is
            as good.

        Returns
        -------
        bool
            Whether to go on: false after Ctrl-C.
        """
        numbers = [cost, infeasibility, stationarity, barrier, step, shift]
        return bool(self._asked().tell(int(iteration), [float(own) for own in numbers]))


Method = Callable[[Program], Proposal]
"""What solves programs."""


def called(method: Method) -> Callable[[Any], tuple[list[float], list[float], list[float], list[float], str]]:
    """The method as the compiled part calls it."""

    def call(core: Any) -> tuple[list[float], list[float], list[float], list[float], str]:
        program = Program(core)
        del core  # it stays in this thread, a traceback does not
        try:
            found = method(program)
        finally:
            program._core = None
        if not isinstance(found, Proposal):
            raise TypeError(f"a method returns a holonom.Proposal, not {type(found).__name__}")
        sides = (np.broadcast_to(own, program.start.shape) for own in (found.lower, found.upper))
        x, rows, lower, upper = (_vector(own).tolist() for own in (found.x, found.rows, *sides))
        return x, rows, lower, upper, str(found.outcome)

    return call


def _vector(values: ArrayLike | Sequence[float]) -> Array:
    """Numbers as an array of one dimension."""
    found = np.ascontiguousarray(values, dtype=np.float64)
    if found.ndim != 1:
        raise ValueError(f"a vector has one dimension, not the shape {found.shape}")
    return found
