"""An environment of Gymnasium over a :class:`holonom.Stepper`.

There is no contact: this is for mechanisms, not for walking. It needs the package ``gymnasium``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import gymnasium
import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._errors import RunFailed
from ._model import model_of
from ._stepper import Stepper

Array = NDArray[np.float64]


class Env(gymnasium.Env[Array, Array]):
    """A mechanism that learns.

    Parameters
    ----------
    model : a :class:`holonom.Model`, the path of a file, or a dictionary of sections.
    inputs, observe : as of :class:`holonom.Stepper`.
    low, high : bounds of the inputs, N or N·m, one number or shape ``(m,)``.
    steps_per_action : steps for which an action is held.
    reward : function of what is observed ``(k,)`` and the action ``(m,)``.
    start : values of the model that an episode begins with, from a random generator:
        ``lambda rng: {"joint.hinge.rate": rng.normal()}``.
    terminated : function of what is observed, whether the episode is over.
    length : actions until an episode is truncated.
    """

    def __init__(
        self,
        model: Any,
        inputs: Sequence[str],
        observe: Sequence[str],
        *,
        low: ArrayLike,
        high: ArrayLike,
        reward: Callable[[Array, Array], float],
        steps_per_action: int = 1,
        start: Callable[[np.random.Generator], Mapping[str, Any]] | None = None,
        terminated: Callable[[Array], bool] | None = None,
        length: int = 1000,
    ) -> None:
        self.model = model_of(model)
        self.stepper = Stepper(self.model, inputs, observe)
        self._of = list(inputs), list(observe)
        self._reward, self._start, self._terminated = reward, start, terminated
        self._steps, self._length, self._taken = steps_per_action, length, 0
        shape = (self.stepper._core.width,)
        bounds = [np.broadcast_to(np.asarray(b, dtype=np.float64), shape).copy() for b in (low, high)]
        self.action_space = gymnasium.spaces.Box(bounds[0], bounds[1], dtype=np.float64)
        size = self.stepper.observe().shape
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, size, dtype=np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Begins an episode; what is observed, and ``{"t": s}``."""
        super().reset(seed=seed)
        self._taken = 0
        values = self._start(self.np_random) if self._start is not None else {}
        if values:
            self.stepper = Stepper(self.model.replace(values), *self._of)
        else:
            self.stepper.reset()
        return self.stepper.observe(), {"t": self.stepper.t}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Holds an action; an episode whose steps fail is over, with the message in ``info``."""
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
