"""The environment of Gymnasium passes its checker; seeds give the same episodes."""

import warnings

import numpy as np
import pytest

import holonom as hn

pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env

from holonom.gym import Env


def environment(double: str) -> Env:
    return Env(
        hn.Model.from_toml(double),
        ["shoulder", "elbow"],
        ["shoulder", "shoulder.rate", "elbow"],
        low=-2.0,
        high=[2.0, 1.0],
        steps_per_action=5,
        reward=lambda x, u: -(x[0] ** 2) - 1e-3 * float(u @ u),
        start=lambda rng: {"joint.elbow.rate": rng.normal(0.0, 0.1)},
        terminated=lambda x: abs(x[0]) > 1.5,
        length=20,
    )


def test_the_checker_is_content(double: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        check_env(environment(double), skip_render_check=True)


def test_seeds_give_the_same_episodes(double: str) -> None:
    def episode(seed: int) -> list[np.ndarray]:
        env = environment(double)
        seen, _ = env.reset(seed=seed)
        found = [seen]
        env.action_space.seed(seed)
        for _ in range(20):
            seen, reward, over, cut, info = env.step(env.action_space.sample())
            found.append(seen)
        assert cut and info["t"] == pytest.approx(0.2) and reward < 0.0
        return found

    assert np.array_equal(episode(1), episode(1))
    assert not np.array_equal(episode(1), episode(2))
