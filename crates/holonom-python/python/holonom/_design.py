"""Objectives as functions with exact gradients; numbers from measurements; optima."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._answer import Analysis, Answer, interruptible
from ._errors import HolonomWarning, guarded, no_panic
from ._model import Model, model_of
from ._program import Method, called

Array = NDArray[np.float64]


def _key(name: str) -> str:
    """The key of a parameter by its name, of a number of the file the key itself."""
    return name if "." in name else f"parameters.{name}"


@guarded()
class Gradient:
    """The objectives of a model as a function of numbers, with its exact gradient.

    ``value, slope = objective(x)``: one run and one sweep backward, whatever the number of
    derivatives. ``scipy.optimize.minimize(objective, objective.start, jac=True)`` takes it as it is.

    Parameters
    ----------
    model : as of :func:`simulate`, with an ``[[objective]]``.
    of : names of objectives, and numbers of sensors at the end, ``"tip.z"``; the sum of all
        objectives by default.
    parameters : names of numbers under ``[parameters]``, or keys of any numbers of the file,
        ``"body.arm.mass"``, that come first in ``x``, in this order and in their units; others need
        no derivative. ``True``: all parameters on which something depends.
    controls : whether the values of each ``[[control]]`` follow, N or N·m.
    initial : whether the coordinates (m, rad) of independent joints at the start follow, then their
        rates (m/s, rad/s), without those that follow from others by constraints on velocities.
    step : whether the length of all steps comes last, s, at a fixed number of them and fixed values
        of controls.

    Raises
    ------
    InvalidModel : a name is none of a parameter, with the nearest; the model has no such derivative,
        with the key.
    AnalysisFailed : the run does not reach its end.
    ValueError : there is nothing to differentiate by, or a name stands there twice.

    Examples
    --------
    >>> import holonom as hn
    >>> objective = hn.Gradient(MODEL, parameters=["length"])  # doctest: +SKIP
    >>> value, slope = objective(objective.start)  # doctest: +SKIP
    """

    names: list[str]
    """What the entries of ``x`` are."""
    start: Array
    """The values that the model states, zero for controls, shape ``(N,)``, in their units."""
    last: Answer | None
    """What the last call found."""

    def __init__(
        self,
        model: Any,
        *,
        of: Sequence[str] | None = None,
        parameters: Sequence[str] | bool = False,
        controls: bool = False,
        initial: bool = False,
        step: bool = False,
    ) -> None:
        self._model: Model = model_of(model)
        self._of = list(of) if of is not None else []
        core = self._model._core
        named = [] if isinstance(parameters, bool) else [str(name) for name in parameters]
        for name in named:
            if named.count(name) > 1:
                raise ValueError(f"parameters: `{name}` stands there more than once")
        known = dict(_core.numbers(core, named)) if named or parameters is True else {}
        self._parameters = list(known)
        self._steps = 0
        stated = _core.initial(core) if initial else []
        self._joints = [own[:2] for own in stated]
        self._rated = [own[:2] for own in stated if own[3] is not None]
        names, values = list(known), list(known.values())
        self._controls: list[tuple[str, int]] = []
        found: dict[str, Any] = {}
        if controls or step:
            place = self._place(self._of, [[]] if controls else [], [], [])
            found, _ = _core.gradient(core, place)
        if controls:
            self._controls = [(own["name"], len(own["derivatives"])) for own in found["controls"]]
            for name, count in self._controls:
                names += [f"{name}[{k}]" for k in range(count)]
                values += [0.0] * count
        if initial:
            names += [f"{joint}.coordinate.{k}" for joint, k in self._joints]
            names += [f"{joint}.rate.{k}" for joint, k in self._rated]
            values += [own[2] for own in stated]
            values += [own[3] for own in stated if own[3] is not None]
        if step:
            self._steps = int(found["steps"])
            names.append("step")
            values.append(float(found["step"]))
        if not names:
            raise ValueError(
                "by what? write parameters=[…], controls=True, initial=True or step=True"
            )
        self.names, self.start = names, np.array(values, dtype=np.float64)
        self.last = None

    def _place(
        self,
        of: list[str],
        controls: list[list[float]] | None,
        coordinates: list[tuple[str, int, float]],
        rates: list[tuple[str, int, float]],
    ) -> dict[str, Any]:
        return {
            "of": of,
            "parameters": self._parameters,
            "initial": bool(self._joints),
            "step": self._steps > 0,
            "controls": controls,
            "coordinates": coordinates,
            "rates": rates,
        }

    def __call__(self, x: Any) -> tuple[float, Array]:
        """The objective, and its derivatives by ``x``.

        Parameters
        ----------
        x : shape ``(N,)``, as :attr:`names` say, in their units.

        Returns
        -------
        float
            In the unit of the objective.
        array (N,)
            In that unit by the units of ``x``.

        Raises
        ------
        ValueError
            For another shape, and numbers that are not finite.
        """
        at = np.asarray(x, dtype=np.float64)
        if at.shape != self.start.shape:
            raise ValueError(f"x has the shape {at.shape}, not {self.start.shape}")
        if not np.all(np.isfinite(at)):
            raise ValueError("x: every entry has to be finite")
        parts = [float(value) for value in at]
        count = len(self._parameters)
        own, rest = parts[:count], parts[count:]
        model = self._model
        if own:
            given = zip(self._parameters, own, strict=True)
            model = model.replace({_key(name): value for name, value in given})
        if self._steps:
            h, rest = rest[-1], rest[:-1]
            model = model.replace({"simulation.step": h, "simulation.end": h * self._steps})
        controls: list[list[float]] | None = [] if self._controls else None
        for _, length in self._controls:
            assert controls is not None
            controls.append(rest[:length])
            rest = rest[length:]
        half = len(self._joints)
        coordinates = [(*joint, value) for joint, value in zip(self._joints, rest[:half], strict=True)]
        rates = [(*joint, value) for joint, value in zip(self._rated, rest[half:], strict=True)]
        place = self._place(self._of, controls, coordinates, rates)
        found, text = interruptible(lambda _: _core.gradient(model._core, place))
        self.last = Answer(found, text)
        slope = [one["derivative"] for one in found["parameters"]]
        for one in found["controls"]:
            slope += one["derivatives"]
        starts = {(one["name"], one["freedom"]): one for one in found["initial"]}
        slope += [starts[joint]["coordinate"] for joint in self._joints]
        slope += [starts[joint]["rate"] for joint in self._rated]
        if self._steps:
            slope.append(found["by_step"])
        _warn_of_tolerance(model)
        if found["meaningless_from"] is not None:
            t = found["meaningless_from"]
            words = f"from t = {t:.6g} s on derivatives say nothing of the mechanism; end the run earlier"
            warnings.warn(words, HolonomWarning, stacklevel=2)
        return float(found["value"]), np.array(slope, dtype=np.float64)

    def value(self, x: Any) -> float:
        """The objective alone.

        Parameters
        ----------
        x : shape ``(N,)``, as :attr:`names` say, in their units.

        Returns
        -------
        float
        """
        return self(x)[0]

    def gradient(self, x: Any) -> Array:
        """Its derivatives alone.

        Parameters
        ----------
        x : shape ``(N,)``, as :attr:`names` say, in their units.

        Returns
        -------
        array (N,)
            In the unit of the objective by those of ``x``.
        """
        return self(x)[1]


class Identified(Answer):
    """What :func:`identify` found: numbers with their standard errors."""

    model: Model
    """The model with the estimates of its parameters."""
    joints: dict[str, float]
    """Coordinates of joints at the start that were unknown, ``simulate(…, joints=found.joints)``."""
    rates: dict[str, float]
    """Their rates."""

    def __init__(
        self,
        found: dict[str, Any],
        text: str,
        model: Model,
        rows: list[tuple[int, float, float, float, float]],
    ) -> None:
        super().__init__(found, text)
        self._rows = rows
        self.joints, self.rates = {}, {}
        replaced = {}
        for own in found["parameters"]:
            joint, *kind = own["name"].split(".")
            if not kind or kind[0] not in ("coordinate", "rate"):
                replaced[_key(own["name"])] = own["value"]
                continue
            start = self.joints if kind[0] == "coordinate" else self.rates
            start[".".join([joint, *kind[1:]])] = own["value"]
        self.model = model.replace(replaced) if replaced else model

    @property
    def names(self) -> list[str]:
        """What was unknown, shape ``(P,)``."""
        return [own["name"] for own in self["parameters"]]

    @property
    def estimates(self) -> Array:
        """The estimates, shape ``(P,)``, in their units."""
        return np.array([own["value"] for own in self["parameters"]], dtype=np.float64)

    @property
    def standard_errors(self) -> Array:
        """Their standard errors, in their units, shape ``(P,)``; NaN at a bound, and where a
        combination is not seen."""
        found = [own["standard_error"] for own in self["parameters"]]
        return np.array([np.nan if one is None else one for one in found], dtype=np.float64)

    @property
    def covariance(self) -> Array:
        """Their covariance, in products of their units, shape ``(P, P)``; NaN where a combination is
        not seen."""
        return self._square("covariance")

    @property
    def correlation(self) -> Array:
        """Their correlations, 1, shape ``(P, P)``; NaN beside a number at a bound."""
        return self._square("correlation")

    def _square(self, key: str) -> Array:
        count = len(self["parameters"])
        if self[key] is None:
            return np.full((count, count), np.nan)
        rows = [[np.nan if one is None else one for one in row] for row in self[key]]
        return np.array(rows, dtype=np.float64).reshape(count, count)

    @property
    def residuals(self) -> dict[str, Array]:
        """By column: time (s), measured, computed, residual in standard deviations, shape
        ``(values, 4)``."""
        heads = [own["column"] for own in self["columns"]]
        return {
            head: np.array([row[1:] for row in self._rows if row[0] == k], dtype=np.float64)
            for k, head in enumerate(heads)
        }

    @property
    def converged(self) -> bool:
        """Whether the method has converged and every combination is seen."""
        return bool(self["outcome"] == "converged" and not self["unseen"])


@no_panic
def identify(
    model: Any,
    data: str | os.PathLike[str] | Mapping[str, Any],
    *,
    progress: Callable[[int, int], object] | None = None,
) -> Identified:
    """Unknown numbers of ``[identify]`` from measured values, by least squares.

    Parameters
    ----------
    model : as of :func:`simulate`, with ``[[measurement]]`` and ``[identify]``.
    data : a file of comma-separated values, or its columns: ``"t"`` in s, shape ``(K,)``, and each
        measurement, shape ``(K,)``; NaN where a value was not measured.
    progress : called with the number of runs.

    Returns
    -------
    Identified

    Raises
    ------
    InvalidModel : a number has no derivative, or nothing depends on it.
    AnalysisFailed : the data are none of the model, or the first run fails.
    """
    whole = model_of(model)
    if isinstance(data, Mapping):
        name, content = "data", _table(data)
    else:
        name, content = os.fspath(data), Path(data).read_text(encoding="utf-8")
    (found, text), rows = interruptible(
        lambda tell: _core.identify(whole._core, name, content, tell), progress
    )
    _warn_of_tolerance(whole)
    return Identified(found, text, whole, rows)


class Optimum(Analysis):
    """What :func:`optimize` found: a design, or controls and their motion.

    ``found["status"]`` is ``"optimal"``, or says how the search ended.
    """

    model: Model
    """The model of the optimum, with its controls as motors: ``simulate(found.model)`` is its motion."""
    controls: Array
    """The value of each control in each step, N or N·m, shape ``(steps, controls)``."""
    costates: Array
    """Multipliers of the balances at the nodes but the last, in the unit of the cost by that of a
    momentum, shape ``(steps, coordinates)``."""
    iterations: dict[str, Array]
    """By name what each iteration has: cost, infeasibility, …, each of shape ``(iterations,)``, in
    the units of the summary."""

    def __init__(
        self,
        found: dict[str, Any],
        text: str,
        beside: tuple[str, list[list[float]], list[list[float]], str, str],
    ) -> None:
        model, controls, costates, iterations, page = beside
        super().__init__(found, text, lambda: page)
        self.model = Model.from_toml(model)
        self.controls, self.costates = _rows(controls), _rows(costates)
        head, *lines = iterations.splitlines()
        cells = [[float(cell) if cell else np.nan for cell in line.split(",")] for line in lines]
        names = head.split(",")
        table = np.array(cells, dtype=np.float64).reshape(len(lines), len(names))
        self.iterations = {name: table[:, k] for k, name in enumerate(names)}

    @property
    def optimal(self) -> bool:
        """Whether it is an optimum: conditions met, derivatives zero, repeated by its run."""
        return bool(self["status"] == "optimal")

    @property
    def cost(self) -> float:
        """What is least."""
        return float(self["cost"])

    @property
    def parameters(self) -> dict[str, float]:
        """The parameters that were free, in their units."""
        return {own["name"]: own["value"] for own in self["parameters"]}

    @property
    def t(self) -> Array:
        """The middle of each step, s, shape ``(steps,)``: where the controls stand."""
        middles: Array = np.asarray(np.arange(len(self.controls)) + 0.5, dtype=np.float64)
        return middles * float(self["step"])


@no_panic
def optimize(
    model: Any,
    *,
    method: Method | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Optimum:
    """Parameters, or controls and the time, of least cost that meet the conditions.

    What is free stands under ``[optimize]`` and ``[[control]]``, what is wanted under
    ``[[objective]]`` and ``[[condition]]``. A search that finds no optimum returns its last point,
    and warns.

    Parameters
    ----------
    model : as of :func:`simulate`.
    method : what solves the nonlinear program of controls: a function from a :class:`Program` to a
        :class:`Proposal`, such as :func:`holonom.ipopt.solve`; by default the one that is compiled
        in, where there is one. Whether its point is an optimum is judged here, whatever it says.
    progress : called with the number of iterations.

    Returns
    -------
    Optimum

    Raises
    ------
    InvalidModel : something has no derivative, or nothing is free; controls without a ``method``,
        where the package is built without its feature ``optimize``.
    AnalysisFailed : there is no motion to begin with.
    TypeError, ValueError : the method returns no proposal, or one of another shape, or one whose
        numbers are not finite.

    Examples
    --------
    >>> import holonom as hn
    >>> found = hn.optimize("clock.toml")  # doctest: +SKIP
    >>> found.parameters, found.optimal  # doctest: +SKIP
    """
    whole = model_of(model)
    function = None if method is None else called(method)
    (found, text), beside = interruptible(
        lambda tell: _core.optimize(whole._core, function, tell), progress
    )
    _warn_of_tolerance(whole)
    optimum = Optimum(found, text, beside)
    if not optimum.optimal:
        missed = "; ".join([str(found["status"]).replace("_", " "), *found.get("missed", [])])
        warnings.warn(f"no optimum: {missed}", HolonomWarning, stacklevel=2)
    return optimum


def _warn_of_tolerance(model: Model) -> None:
    """Warns that derivatives are those of steps that are solved exactly, where steps are not."""
    words = _core.inexact(model._core)
    if words is not None:
        warnings.warn(words, HolonomWarning, stacklevel=4)


def _rows(rows: list[list[float]]) -> Array:
    """Rows of numbers as an array, shape ``(rows, numbers)``."""
    return np.array(rows, dtype=np.float64).reshape(len(rows), -1 if rows else 0)


def _table(data: Mapping[str, Any]) -> str:
    """The columns as the text of a file."""
    columns = {str(name): np.asarray(own, dtype=np.float64) for name, own in data.items()}
    if "t" not in columns:
        raise ValueError("data: the column `t` of times is missing")
    count = columns["t"].shape
    for name, own in columns.items():
        if own.ndim != 1 or own.shape != count:
            raise ValueError(f"data: `{name}` has the shape {own.shape}, `t` {count}")
        if np.any(np.isinf(own)):
            raise ValueError(f"data: `{name}` has a value that is infinite")
    rows = zip(*(own.tolist() for own in columns.values()), strict=True)
    lines = [",".join("" if value != value else repr(value) for value in row) for row in rows]
    return "\n".join([",".join(columns), *lines]) + "\n"
