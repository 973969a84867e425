"""Modes, critical loads, Campbell diagrams, harmonic responses, costs of steps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._answer import Analysis, Answer, interruptible
from ._errors import no_panic
from ._model import model_of
from ._numbers import natural

Array = NDArray[np.float64]


class Modes(Analysis):
    """Modes about a configuration: vibrations, decays, what is unstable; or critical loads."""

    def _of(self, key: str) -> Array:
        return np.array([mode[key] for mode in self["modes"]], dtype=np.float64)

    @property
    def frequencies(self) -> Array:
        """Hz, shape ``(modes,)``; zero of what does not vibrate."""
        return self._of("frequency")

    @property
    def members(self) -> list[str]:
        """Names of the members that :attr:`shapes` list."""
        first = self["modes"][:1]
        return [own["name"] for mode in first for own in mode["shape"]]

    @property
    def shapes(self) -> Array:
        """How members move, shape ``(modes, members, 6)``: displacement and rotation in space; the
        largest displacement is 1 m, without displacements the largest rotation 1 rad."""
        rows = [[own["translation"] + own["rotation"] for own in mode["shape"]] for mode in self["modes"]]
        return np.array(rows, dtype=np.float64).reshape(len(rows), -1, 6)

    @property
    def damping(self) -> Array:
        """Damping ratios, 1, shape ``(modes,)``."""
        return self._of("damping_ratio")

    @property
    def load_factors(self) -> Array:
        """Critical load factors, 1, shape ``(modes,)``; NaN of what is no buckling."""
        found = [mode.get("load_factor") for mode in self["modes"]]
        return np.array([np.nan if factor is None else factor for factor in found])


@no_panic
def modes(model: Any, *, at: str = "start", count: int = 10, buckling: bool = False) -> Modes:
    """Small vibrations about the start, an equilibrium (``"static"``), a steady rotation or motion.

    Parameters
    ----------
    model : as of :func:`simulate`.
    at : ``"start"``, ``"static"``, ``"rotation"`` or ``"motion"``.
    count : how many, beside what is unstable.
    buckling : critical load factors and shapes instead: the loads at the end are factor 1.

    Returns
    -------
    Modes

    Raises
    ------
    InvalidModel, AnalysisFailed
    """
    own, count = model_of(model)._core, natural("count", count, 1)
    found = interruptible(lambda _: _core.modes(own, at, count, buckling))
    return Modes(*found, lambda: _core.modes_page(own, at, count, buckling))


class Campbell(Analysis):
    """Modes over the speed of a rotation."""

    @property
    def speeds(self) -> Array:
        """rad/s, shape ``(K,)``."""
        return np.array([at["speed"] for at in self["speeds"]])

    @property
    def frequencies(self) -> Array:
        """Hz in the rotating frame, shape ``(K, modes)``; NaN where a mode was not found again."""
        rows = [at["vibrations"] for at in self["speeds"]]
        found = [[np.nan if mode is None else mode["frequency"] for mode in row] for row in rows]
        return np.array(found, dtype=np.float64)


@no_panic
def campbell(model: Any, speeds: Sequence[float] | Array, *, count: int = 10) -> Campbell:
    """The softest vibrations at the first speed, followed over all: the Campbell diagram.

    Parameters
    ----------
    model : as of :func:`simulate`; its initial velocities state the axis.
    speeds : of the rotation, rad/s, shape ``(K,)``.
    count : how many modes.

    Returns
    -------
    Campbell

    Raises
    ------
    InvalidModel, AnalysisFailed
    ValueError
        For speeds that are none.
    """
    own, asked = model_of(model)._core, [float(speed) for speed in speeds]
    count = natural("count", count, 1)
    if not asked or not np.all(np.isfinite(asked)):
        raise ValueError("speeds: one finite number at least")
    found = interruptible(lambda _: _core.campbell(own, asked, count))
    return Campbell(*found, lambda: _core.campbell_page(own, asked, count))


class Response(Analysis):
    """Amplitude and phase of sensors over the frequency."""

    @property
    def frequencies(self) -> Array:
        """Hz, shape ``(K,)``: those asked for, resonances and the flanks of their peaks."""
        return np.array(self["frequencies"], dtype=np.float64)

    def _column(self, name: str) -> dict[str, Any]:
        from ._result import unknown

        for column in self["columns"]:
            if column["name"] == name:
                found: dict[str, Any] = column
                return found
        raise unknown(name, [column["name"] for column in self["columns"]])

    def amplitude(self, name: str) -> Array:
        """The amplitude of a column of the sensors.

        Parameters
        ----------
        name : of the column.

        Returns
        -------
        array (K,)
            In the unit of the column.
        """
        return np.array(self._column(name)["amplitude"], dtype=np.float64)

    def phase(self, name: str) -> Array:
        """The phase of a column of the sensors against a cosine of the input.

        Parameters
        ----------
        name : of the column.

        Returns
        -------
        array (K,)
            From −π to π, rad.
        """
        return np.deg2rad(np.array(self._column(name)["phase"], dtype=np.float64))

    def transfer(self, name: str) -> NDArray[np.complex128]:
        """Amplitude and phase of a column of the sensors as complex numbers.

        Parameters
        ----------
        name : of the column.

        Returns
        -------
        array (K,)
            In the unit of the column.
        """
        found: NDArray[np.complex128] = self.amplitude(name) * np.exp(1j * self.phase(name))
        return found


@no_panic
def response(
    model: Any,
    inputs: str | Sequence[str],
    band: tuple[float, float, int],
    *,
    at: str = "start",
    rayleigh: tuple[float, float] = (0.0, 0.0),
    damping_ratios: Sequence[float] = (),
) -> Response:
    """The steady response of the sensors to a harmonic excitation, over a band of frequencies.

    Parameters
    ----------
    model : as of :func:`simulate`.
    inputs : ``"load.NAME"``, ``"base.x=AMPLITUDE"`` (m), ``"unbalance.BODY.z=U"`` (kg·m).
    band : lowest and highest frequency, Hz, and how many.
    at : ``"start"``, ``"static"`` or ``"rotation"``.
    rayleigh : α (1/s) and β (s) of damping αM + βK beside that of the model.
    damping_ratios : of the vibrations, slowest first; the last is that of all further ones.

    Returns
    -------
    Response

    Raises
    ------
    InvalidModel, AnalysisFailed
    """
    own = model_of(model)._core
    asked = {
        "inputs": [inputs] if isinstance(inputs, str) else list(inputs),
        "band": (float(band[0]), float(band[1]), natural("band", band[2], 0)),
        "at": at,
        "rayleigh": (float(rayleigh[0]), float(rayleigh[1])),
        "ratios": [float(ratio) for ratio in damping_ratios],
    }
    found = interruptible(lambda _: _core.response(own, asked))
    return Response(*found, lambda: _core.response_page(own, asked))


@no_panic
def bench(model: Any, *, schemes: Sequence[str] = (), steps: int = 200) -> Answer:
    """What a step costs: times of a step, an iteration, its parts, and of recording, in s.

    Parameters
    ----------
    model : as of :func:`simulate`.
    schemes : to measure; without them that of the model.
    steps : in each round.

    Returns
    -------
    Answer

    Raises
    ------
    InvalidModel, AnalysisFailed
    """
    own, steps = model_of(model)._core, natural("steps", steps, 1)
    return Answer(*interruptible(lambda _: _core.bench(own, list(schemes), steps)))
