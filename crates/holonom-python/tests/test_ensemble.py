"""Members that are stepped together are steppers alone, bit for bit."""

import numpy as np
import pytest

import holonom as hn

NAMES = {"inputs": ["shoulder", "lower.force"], "observe": ["angle", "elbow.rate"]}


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_members_are_steppers(threads: int, double: str) -> None:
    model = hn.Model.from_toml(double)
    masses = [{"body.lower.mass": 0.5 + 0.1 * k} for k in range(7)]
    ensemble = hn.Ensemble(model, set=masses, threads=threads, **NAMES)  # type: ignore[arg-type]
    steppers = [hn.Stepper(model.replace(own), **NAMES) for own in masses]  # type: ignore[arg-type]
    rng = np.random.default_rng(2)
    for n in (1, 0, 400, 3):
        u = rng.normal(size=(7, 4))
        times = ensemble.step(u, n)
        alone = [stepper.step(row, n) for stepper, row in zip(steppers, u)]
        assert times.tolist() == alone == ensemble.t.tolist()
    ensemble.step(n=5)
    [stepper.step(n=5) for stepper in steppers]
    assert np.array_equal(ensemble.q, [stepper.q for stepper in steppers])
    assert np.array_equal(ensemble.observe(), [stepper.observe() for stepper in steppers])
    assert ensemble.states == [stepper.state for stepper in steppers] and not ensemble.failures
    states = ensemble.states
    ensemble.reset([2, 4], joints=[{"elbow": 0.1}, {"elbow": 0.4}], rates={"shoulder": 1.0})
    assert np.abs(ensemble.observe()[[2, 4], 0] - [0.1, 0.4]).max() < 1e-12
    assert np.array_equal(ensemble.q[3], steppers[3].q)
    ensemble.states = states
    assert np.array_equal(ensemble.q, [stepper.q for stepper in steppers])


def test_who_fails_stays(double: str) -> None:
    model = hn.Model.from_toml(double).replace({"simulation.step": 0.02})
    ensemble = hn.Ensemble(model, 3, inputs=["elbow"])
    before = ensemble.q
    ensemble.step([[0.0], [1e9], [0.1]], 2)
    assert list(ensemble.failures) == [1] and "step 0" in str(ensemble.failures[1])
    assert np.array_equal(ensemble.q[1], before[1]) and ensemble.t.tolist() == [0.04, 0.0, 0.04]
    ensemble.step([0.0])
    assert ensemble.t.tolist() == [0.06, 0.0, 0.06]
    ensemble.reset([1])
    ensemble.step([0.0])
    assert not ensemble.failures and ensemble.t.tolist() == [0.08, 0.02, 0.08]


def test_wrong_shapes_are_refused(double: str) -> None:
    model = hn.Model.from_toml(double)
    ensemble = hn.Ensemble(model, 2, inputs=["elbow"])
    for wrong in (np.zeros((3, 1)), np.zeros((2, 2)), [0.0, 0.0, 0.0]):
        with pytest.raises(ValueError, match=r"inputs: shape \(2, 1\)"):
            ensemble.step(wrong)
    with pytest.raises(ValueError, match="not finite"):
        ensemble.step([np.nan])
    with pytest.raises(ValueError, match="members"):
        hn.Ensemble(model, 3, set=[{}])
    with pytest.raises(ValueError, match="members"):
        hn.Ensemble(model)
    with pytest.raises(ValueError, match="states"):
        ensemble.states = ensemble.states[:1]
    with pytest.raises(hn.StateMismatch):
        ensemble.states = [b"x", b"y"]
    with pytest.raises(hn.InvalidModel, match="did you mean `elbow`"):
        ensemble.reset(joints={"elbo": 1.0})
