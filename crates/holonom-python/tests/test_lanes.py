"""Members of a rollout in lanes: the bits of their own steppers, whoever is beside them."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from conftest import DOUBLE, MODELS

import holonom as hn
from holonom import _core
from holonom._acting import Acts

TUMBLE = """
model = { name = "tumble", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.004, end = 0.4 }
body = [{ name = "stone", mass = 2.0, inertia = [1.0, 2.0, 3.0], angular_velocity = [0.3, 3.0, 0.2], velocity = [1.0, 0.0, 2.0] }]
sensor = [{ name = "turn", type = "angular_velocity", of = "stone" }, { name = "how", type = "orientation", of = "stone" }]
"""
ARM = """
model = { name = "arm", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.003, end = 0.3 }
body = [
    { name = "a", mass = 1.0, inertia = [0.02, 0.03, 0.04], position = [0.0, 0.0, -0.5] },
    { name = "b", mass = 0.7, inertia = [0.02, 0.01, 0.03], position = [0.3, 0.0, -1.0] },
    { name = "c", mass = 0.4, inertia = [0.01, 0.01, 0.02], position = [-0.3, 0.0, -1.0] },
]
joint = [
    { name = "ball", type = "spherical", parent = "ground", child = "a", position = [0.0, 0.0, 0.0] },
    { name = "turn", type = "revolute", parent = "a", child = "b", position = [0.0, 0.0, -1.0], axis = [0.0, 1.0, 0.0], spring = { stiffness = 3.0 }, damper = { damping = 0.1 } },
    { name = "slide", type = "prismatic", parent = "a", child = "c", position = [0.0, 0.0, -1.0], axis = [1.0, 0.0, 0.0], rate = 0.4, spring = { stiffness = 50.0 } },
]
sensor = [{ name = "rate", type = "joint_rate", of = "turn" }, { name = "gap", type = "distance", of = "b", to = "c" }]
"""


def alone(model: hn.Model, inputs: Sequence[str], observe: Sequence[str], rows: Any, every: int, state: Any) -> Any:
    """Nodes of a stepper: times, coordinates, what is observed."""
    stepper = hn.Stepper(model, inputs, observe)
    if state is not None:
        stepper.state = state
    t, q, y = [stepper.t], [stepper.q], [stepper.observe()]
    for n, row in enumerate(rows, 1):
        stepper.step(row)
        if n % every == 0 or n == len(rows):
            t.append(stepper.t)
            q.append(stepper.q)
            y.append(stepper.observe())
    return np.array(t), np.array(q), np.array(y)


CASES = {
    "double": (DOUBLE, ["shoulder", "elbow"], ["angle", "elbow.rate"], "body.lower.mass"),
    "tumble": (TUMBLE, ["stone.torque"], ["turn", "how"], "body.stone.mass"),
    "arm": (ARM, ["slide", "turn", "b.force"], ["rate", "gap", "slide"], "joint.turn.spring.stiffness"),
}


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("threads", [1, 3])
def test_members_have_the_bits_of_their_own_steppers(name: str, threads: int) -> None:
    text, inputs, observe, key = CASES[name]
    model, count, steps = hn.Model.from_toml(text), 13, 31
    random = np.random.default_rng(5)
    sets = [{key: float(value)} for value in random.uniform(0.5, 3.0, count)]
    models = [model.replace(own) for own in sets]
    width = len(hn.Stepper(model, inputs).held)
    controls = random.normal(0.0, 0.5, (count, steps, width))
    states = []
    for k, own in enumerate(models):
        stepper = hn.Stepper(own, inputs, observe)
        stepper.step(n=k % 4)
        states.append(stepper.state)
    for every, begin in ((1, None), (4, states)):
        found = hn.rollout(
            model, inputs=inputs, observe=observe, set=sets, controls=controls, states=begin, every=every, threads=threads
        )
        assert not found.failures
        for k, own in enumerate(models):
            t, q, y = alone(own, inputs, observe, controls[k], every, begin[k] if begin else None)
            assert np.array_equal(found.t[k], t) and np.array_equal(found.q[k], q), (k, every)
            assert np.array_equal(found.y[k], y), (k, every)
    # without inputs many steps are taken at once; the same inputs of all
    free = hn.rollout(model, observe=observe, set=sets, steps=steps, every=7, threads=threads)
    shared = hn.rollout(model, inputs=inputs, observe=observe, set=sets, controls=controls[0], threads=threads)
    for k in (0, 6, 12):
        t, q, y = alone(models[k], [], observe, [None] * steps, 7, None)
        assert np.array_equal(free.t[k], t) and np.array_equal(free.q[k], q) and np.array_equal(free.y[k], y)
        t, q, y = alone(models[k], inputs, observe, controls[0], 1, None)
        assert np.array_equal(shared.q[k], q) and np.array_equal(shared.y[k], y)


def test_composed_steps_have_lanes_too() -> None:
    model = hn.Model.from_toml(DOUBLE).replace({"simulation.order": 4})
    sets = [{"joint.elbow.rate": 0.3 * k} for k in range(9)]
    found = hn.rollout(model, set=sets, steps=20, observe=["angle"])
    assert lanes(model)
    for k in (0, 8):
        t, q, y = alone(model.replace(sets[k]), [], ["angle"], [None] * 20, 1, None)
        assert np.array_equal(found.q[k], q) and np.array_equal(found.y[k], y)


def lanes(model: hn.Model, observe: Sequence[str] = ()) -> bool:
    plan = {"states": None, "steps": 1, "every": 1, "threads": 1}
    return _core.rollout([model._core] * 9, Acts((), tuple(observe)).core(), None, plan) is not None


def test_where_lanes_apply() -> None:
    for text, _, observe, _ in CASES.values():
        assert lanes(hn.Model.from_toml(text), observe)
    double = hn.Model.from_toml(DOUBLE)
    assert not lanes(double, ["bearing"])  # belongs to the step from the node
    assert not lanes(double.replace({"simulation.scheme": "em-nodal"}))
    assert not lanes(double.replace({"simulation.solver": "dense"}))
    text = DOUBLE + '[[law]]\nname = "soft"\njoint = "elbow"\neffort = "-3*x"\n'
    assert not lanes(hn.Model.from_toml(text))
    # all shipped models, with and without lanes, are those of their steppers
    with_lanes = 0
    for path in MODELS:
        try:
            model = hn.load(path)
            if model.settings["scheme"] == "static" or model.steps < 3 or len(model.to_toml()) > 40_000:
                continue
            begun = hn.Stepper(model)
        except hn.HolonomError:
            continue
        found = hn.rollout(model, set=[{}] * 5, steps=3)
        begun.step(n=3)
        assert np.array_equal(found.q[4, -1], begun.q) and found.t[4, -1] == begun.t, path.name
        with_lanes += lanes(model)
    assert with_lanes >= 5
    print(f"{with_lanes} shipped models in lanes")


def test_a_member_that_fails_is_what_it_is_alone() -> None:
    model = hn.Model.from_toml(DOUBLE).replace({"simulation.step": 0.02})
    controls = np.zeros((9, 6, 1))
    controls[4, 2], controls[7, 0] = 1e9, -1e9
    found = hn.rollout(model, inputs=["elbow"], controls=controls, observe=["elbow"], every=2)
    assert sorted(found.failures) == [4, 7] and found.q.shape == (9, 4, 24)
    for k, last in ((4, 2), (7, 1)):
        assert isinstance(found.failures[k], hn.RunFailed)
        assert np.isfinite(found.q[k, :last]).all() and np.isnan(found.q[k, last:]).all()
        assert np.isnan(found.y[k, last:]).all() and np.isnan(found.t[k, last:]).all()
    still = [k for k in range(9) if k not in (4, 7)]
    assert np.isfinite(found.q[still]).all() and np.ptp(found.q[still], axis=0).max() == 0.0
    with pytest.raises(ValueError, match="columns"):
        hn.rollout(model, inputs=["elbow"], controls=np.zeros((9, 6, 2)))
    with pytest.raises(ValueError, match="finite"):
        hn.rollout(model, inputs=["elbow"], controls=np.full((9, 6, 1), np.nan))
    with pytest.raises(hn.StateMismatch):
        hn.rollout(model, states=[b"none"] * 9, steps=2)
