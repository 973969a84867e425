"""Environments of Gymnasium over :class:`holonom.Stepper` and :class:`holonom.Ensemble`.

There is no contact: this is for mechanisms, not for walking. It needs the package ``gymnasium``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from ._errors import RunFailed, needed

needed("gymnasium", "gym")

import gymnasium
import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv as _VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import ArrayLike, NDArray

from ._acting import names
from ._ensemble import Ensemble
from ._model import Model, model_of
from ._parts import Name
from ._stepper import Stepper

Array = NDArray[np.float64]
Start = Callable[[np.random.Generator], Mapping[Any, Any]]


class Env(gymnasium.Env[Array, Array]):
    """A mechanism that learns.

    Parameters
    ----------
    model : a :class:`holonom.Model`, a :class:`holonom.Spec`, the path of a file, or a dictionary.
    inputs, observe : as of :class:`holonom.Stepper`.
    low, high : bounds of the inputs, N or N·m, one number or shape ``(m,)``.
    steps_per_action : steps for which an action is held.
    reward : function of what is observed, in its units, ``(k,)``, and the action ``(m,)``.
    start : what an episode begins with, from a random generator: coordinates and rates of joints,
        ``lambda rng: {"hinge": rng.normal(), "hinge.rate": 1.0}``, closed loops are closed; and
        values of the model, ``{"body.arm.mass": rng.uniform(1, 2)}``.
    terminated : function of what is observed, in its units, ``(k,)``: whether the episode is over.
    length : actions until an episode is truncated.

    Attributes
    ----------
    stepper : what takes the steps.
    action_space, observation_space : shapes ``(m,)`` and ``(k,)``.
    """

    def __init__(
        self,
        model: Any,
        inputs: Sequence[Name],
        observe: Sequence[Name],
        *,
        low: ArrayLike,
        high: ArrayLike,
        reward: Callable[[Array, Array], float],
        steps_per_action: int = 1,
        start: Start | None = None,
        terminated: Callable[[Array], bool] | None = None,
        length: int = 1000,
    ) -> None:
        self.model = model_of(model)
        self.stepper = Stepper(self.model, inputs, observe)
        self._is_of_model = True  # whether the stepper is of `model`
        self._of = list(names(inputs)), list(names(observe))
        self._reward, self._start, self._terminated = reward, start, terminated
        self._steps, self._length, self._taken = steps_per_action, length, 0
        self._joints = set(self.model.joints)
        self.action_space = _actions(self.stepper._core.width, low, high)
        self.observation_space = _observations(self.stepper.observe().size)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begins an episode.

        Parameters
        ----------
        seed : of the random generator.
        options : ignored.

        Returns
        -------
        array (k,)
            What is observed, in its units.
        dict
            ``"t"``, s.
        """
        super().reset(seed=seed)
        self._taken = 0
        joints, rates, values = _begun(self._joints, self._start, self.np_random)
        if values or not self._is_of_model:
            self.stepper = Stepper(self.model.replace(values), *self._of)
            self._is_of_model = not values
        self.stepper.reset(joints, rates)
        return self.stepper.observe(), {"t": self.stepper.t}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Holds an action; an episode whose steps fail is over.

        Parameters
        ----------
        action : the inputs, N or N·m, shape ``(m,)``.

        Returns
        -------
        array (k,)
            What is observed, in its units.
        float
            The reward.
        bool
            Whether the episode is terminated.
        bool
            Whether it is truncated.
        dict
            ``"t"``, s; ``"failure"``, the message where steps fail.
        """
        info: dict[str, Any] = {}
        failed = False
        try:
            self.stepper.step(action, self._steps)
        except RunFailed as failure:
            failed, info["failure"] = True, str(failure)
        self._taken += 1
        info["t"] = self.stepper.t
        seen = self.stepper.observe()
        over = failed or (self._terminated is not None and bool(self._terminated(seen)))
        reward = float(self._reward(seen, np.asarray(action)))
        return seen, reward, over, self._taken >= self._length, info


class VectorEnv(_VectorEnv[Array, Array, NDArray[Any]]):
    """Many environments beside one another: those of :class:`Env` with the seeds ``seed + k``.

    Their steps are taken in one call on threads. An environment whose episode is over is reset by
    the next step, which ignores its action (``AutoresetMode.NEXT_STEP``).

    Parameters
    ----------
    model, inputs, observe, low, high, reward, steps_per_action, start, terminated, length : as of
        :class:`Env`; ``start`` gives coordinates and rates of joints alone.
    num_envs : how many.
    threads : how many; by default the processors that this process may use.

    Attributes
    ----------
    ensemble : what takes the steps.
    action_space, observation_space : shapes ``(M, m)`` and ``(M, k)``.
    single_action_space, single_observation_space : those of one.
    """

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}  # noqa: RUF012  as Gymnasium has it

    def __init__(
        self,
        model: Any,
        num_envs: int,
        inputs: Sequence[Name],
        observe: Sequence[Name],
        *,
        low: ArrayLike,
        high: ArrayLike,
        reward: Callable[[Array, Array], float],
        steps_per_action: int = 1,
        start: Start | None = None,
        terminated: Callable[[Array], bool] | None = None,
        length: int = 1000,
        threads: int | None = None,
    ) -> None:
        self.num_envs = num_envs
        self.model: Model = model_of(model)
        self.ensemble = Ensemble(
            self.model, num_envs, inputs=inputs, observe=observe, threads=threads
        )
        self._reward, self._start, self._terminated = reward, start, terminated
        self._steps, self._length = steps_per_action, length
        self._joints = set(self.model.joints)
        self._generators = [np.random.default_rng() for _ in range(num_envs)]
        self._taken = np.zeros(num_envs, dtype=np.int64)
        self._over = np.zeros(num_envs, dtype=np.bool_)
        self.single_action_space = _actions(self.ensemble._core.width, low, high)
        self.single_observation_space = _observations(self.ensemble.observe().shape[1])
        self.action_space = batch_space(self.single_action_space, num_envs)
        self.observation_space = batch_space(self.single_observation_space, num_envs)

    def reset(
        self, *, seed: int | Sequence[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begins all episodes.

        Parameters
        ----------
        seed : of the random generators: a number, from which those of the environments follow, or one
            for each.
        options : ignored.

        Returns
        -------
        array (M, k)
            What is observed, in its units.
        dict
            ``"t"``, s, shape ``(M,)``.
        """
        seeds = [seed + k for k in range(self.num_envs)] if isinstance(seed, int) else seed
        for k, own in enumerate(seeds or []):
            if own is not None:
                self._generators[k] = gymnasium.utils.seeding.np_random(own)[0]
        self._begin(range(self.num_envs))
        return self.ensemble.observe(), {"t": self.ensemble.t}

    def _begin(self, members: Any) -> None:
        for k in members:
            joints, rates, values = _begun(self._joints, self._start, self._generators[k])
            if values:
                raise ValueError(f"start: {', '.join(values)}: coordinates and rates of joints alone")
            self.ensemble.reset([k], joints, rates)
            self._taken[k], self._over[k] = 0, False

    def step(
        self, actions: Array
    ) -> tuple[Array, Array, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Holds an action of each environment.

        Parameters
        ----------
        actions : the inputs, N or N·m, shape ``(M, m)``.

        Returns
        -------
        array (M, k)
            What is observed, in its units.
        array (M,)
            The rewards.
        array (M,)
            Whether episodes are terminated.
        array (M,)
            Whether they are truncated.
        dict
            ``"t"``, s, shape ``(M,)``; ``"failure"``, messages by the numbers of environments.
        """
        ended = np.flatnonzero(self._over)
        self.ensemble.step(actions, self._steps)
        self._taken += 1
        self._begin([int(k) for k in ended])
        seen, failures = self.ensemble.observe(), self.ensemble.failures
        begun = np.zeros(self.num_envs, dtype=np.bool_)
        begun[ended] = True
        over = np.array([
            not begun[k]
            and (k in failures or (self._terminated is not None and bool(self._terminated(x))))
            for k, x in enumerate(seen)
        ])
        rewards = np.array([
            0.0 if begun[k] else float(self._reward(x, u)) for k, (x, u) in enumerate(zip(seen, actions))
        ])
        cut = (self._taken >= self._length) & ~begun
        self._over = over | cut
        info: dict[str, Any] = {"t": self.ensemble.t}
        if failures:
            info["failure"] = {k: str(failure) for k, failure in failures.items()}
        return seen, rewards, over, cut, info


def _actions(width: int, low: ArrayLike, high: ArrayLike) -> gymnasium.Space[Any]:
    bounds = [np.broadcast_to(np.asarray(b, dtype=np.float64), (width,)).copy() for b in (low, high)]
    return gymnasium.spaces.Box(bounds[0], bounds[1], dtype=np.float64)


def _observations(size: int) -> gymnasium.Space[Any]:
    return gymnasium.spaces.Box(-np.inf, np.inf, (size,), dtype=np.float64)


def _begun(
    joints: set[str], start: Start | None, rng: np.random.Generator
) -> tuple[dict[str, Any], dict[str, Any], dict[str, Any]]:
    """Coordinates and rates of joints, and values of the model, that an episode begins with."""
    places: dict[str, Any] = {}
    rates: dict[str, Any] = {}
    values: dict[str, Any] = {}
    for key, value in (start(rng) if start is not None else {}).items():
        name = str(key)
        if name in joints:
            places[name] = value
        elif name.endswith(".rate") and name.removesuffix(".rate") in joints:
            rates[name.removesuffix(".rate")] = value
        else:
            values[name] = value
    return places, rates, values
