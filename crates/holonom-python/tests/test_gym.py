"""The environment of Gymnasium passes its checker; seeds give the same episodes."""

import warnings

import numpy as np
import pytest

import holonom as hn

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env

from holonom.gym import Env, VectorEnv


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


def vector(double: str, count: int, threads: int) -> VectorEnv:
    return VectorEnv(
        hn.Model.from_toml(double),
        count,
        ["shoulder", "elbow"],
        ["shoulder", "shoulder.rate", "elbow"],
        low=-2.0,
        high=[2.0, 1.0],
        steps_per_action=5,
        reward=lambda x, u: -(x[0] ** 2) - 1e-3 * float(u @ u),
        start=lambda rng: {"elbow": rng.normal(0.0, 0.3), "elbow.rate": rng.normal(0.0, 0.1)},
        terminated=lambda x: abs(x[0]) > 0.15,
        length=20,
        threads=threads,
    )


def test_environments_side_by_side_are_those_alone(double: str) -> None:
    envs = [vector(double, 3, threads) for threads in (1, 2)]
    alone = []
    for k in range(3):
        one = environment(double)
        one._start = envs[0]._start
        one._terminated = envs[0]._terminated
        alone.append(one)
    seen = [env.reset(seed=7)[0] for env in envs]
    own = np.array([one.reset(seed=7 + k)[0] for k, one in enumerate(alone)])
    assert np.array_equal(seen[0], own) and np.array_equal(seen[0], seen[1])
    assert len(np.unique(seen[0][:, 2])) == 3  # seeds differ
    rng, over, ended = np.random.default_rng(3), np.zeros(3, dtype=bool), 0
    for _ in range(45):
        u = rng.uniform(-1.0, 1.0, (3, 2))
        found = [env.step(u) for env in envs]
        for k, one in enumerate(alone):
            if over[k]:
                x, reward, over[k], cut = one.reset()[0], 0.0, False, False
            else:
                x, reward, terminated, cut, _ = one.step(u[k])
                over[k] = terminated or cut
                ended += int(over[k])
                assert found[0][2][k] == terminated and found[0][3][k] == cut
            assert np.array_equal(found[0][0][k], x) and found[0][1][k] == reward
        assert np.array_equal(found[0][0], found[1][0])
    assert ended >= 3  # episodes have ended, and begun again


def test_vectors_have_the_spaces_of_gymnasium(double: str) -> None:
    env = vector(double, 4, 2)
    seen, info = env.reset(seed=1)
    assert env.observation_space.contains(seen) and info["t"].shape == (4,)
    seen, reward, over, cut, _ = env.step(env.action_space.sample())
    assert seen.shape == (4, 3) and reward.shape == over.shape == cut.shape == (4,)
    with pytest.raises(ValueError, match="inputs: shape"):
        env.step(np.zeros((3, 2)))
    wrapped = gymnasium.wrappers.vector.RecordEpisodeStatistics(env)
    wrapped.reset(seed=2)
    for _ in range(30):
        *_, info = wrapped.step(env.action_space.sample())
    assert env.metadata["autoreset_mode"] is gymnasium.vector.AutoresetMode.NEXT_STEP


def test_a_failed_episode_is_over_for_its_member_alone(double: str) -> None:
    env = vector(double, 2, 1)
    env.reset(seed=1)
    _, _, over, _, info = env.step(np.array([[1e9, 0.0], [0.1, 0.0]]))
    assert over.tolist() == [True, False] and "run failed" in info["failure"][0]
    seen, reward, over, _, info = env.step(np.zeros((2, 2)))
    assert "failure" not in info and reward[0] == 0.0 and np.isfinite(seen).all()


def test_episodes_begin_where_joints_are_put(double: str) -> None:
    env = environment(double)
    env._start = lambda rng: {"shoulder": 0.7, "elbow.rate": 1.5, "body.lower.mass": 3.0}
    seen, _ = env.reset(seed=1)
    assert np.abs(seen - [0.7, 0.0, 0.0]).max() < 1e-12
    assert env.stepper.model.bodies["lower"]["mass"] == 3.0
    env._start = lambda rng: {"shoulder": -0.2}
    seen, _ = env.reset(seed=1)
    assert abs(seen[0] + 0.2) < 1e-12 and env.stepper.model.bodies["lower"]["mass"] == 0.5
    env._start = lambda rng: {"wrist": 1.0}
    with pytest.raises(hn.InvalidModel):
        env.reset()
