"""Steps by hand: inputs that are held, observations, states, threads."""

import copy
import pickle
import threading
from pathlib import Path

import numpy as np
import pytest

import holonom as hn

MOTOR = '\n[joint.motor]\neffort = 1.25\n'


def with_motor(text: str) -> str:
    """The model with a constant motor of the file on the elbow."""
    at = text.index("[[sensor]]")
    return text[:at] + MOTOR + text[at:]


def test_a_constant_input_is_a_motor_of_the_file(double: str) -> None:
    result = hn.simulate(hn.Model.from_toml(with_motor(double)))
    stepper = hn.Stepper(hn.Model.from_toml(double), inputs=["elbow"])
    stepper.step([1.25], n=0)
    for row in result.q:
        assert np.array_equal(stepper.q, row)
        stepper.step()
    free = hn.simulate(hn.Model.from_toml(double))
    assert np.abs(free.q - result.q).max() > 1e-2  # it does something


def balance(text: str, step: float) -> float:
    model = hn.Model.from_toml(text).replace({"simulation.step": step})
    stepper = hn.Stepper(model, inputs=["shoulder", "lower.force", "upper.torque"])
    worst = 0.0
    while stepper.t < 0.4 - step / 2:
        t = stepper.t + step / 2
        stepper.step([np.sin(9 * t), np.cos(5 * t), 0.3, -t, 0.0, 0.8 * np.sin(7 * t), 0.0])
        energy = stepper.energy
        worst = max(worst, abs(energy["balance"]))
    assert {"work.shoulder.input", "work.lower.force", "work.upper.torque"} <= set(energy)
    assert all(abs(energy[f"work.{name}"]) > 1e-3 for name in ("shoulder.input", "lower.force", "upper.torque"))
    return worst


def test_the_energy_balance_with_inputs_closes_to_second_order(double: str) -> None:
    coarse, fine = balance(double, 0.004), balance(double, 0.002)
    order = np.log2(coarse / fine)
    print(f"balance {coarse:.2e} and {fine:.2e} J: order {order:.2f}")
    assert 1.8 < order < 2.2


def test_a_force_accelerates_the_centre_and_a_torque_turns() -> None:
    """A free body: x = F t² / 2m exactly at nodes up to the first step, θ = M t² / 2I."""
    body = {"name": "stone", "mass": 2.0, "inertia": [0.5, 0.5, 0.5]}
    for scheme in ("nodal", "constrained", "em-nodal"):
        model = hn.Model.from_dict({
            "model": {"name": "free"},
            "body": [body],
            "simulation": {"step": 0.001, "end": 1.0, "scheme": scheme},
        })
        stepper = hn.Stepper(model, inputs=["stone.force", "stone.torque"])
        stepper.step([4.0, 0.0, 0.0, 0.0, 0.0, 0.25], n=1000)
        q = stepper.q
        assert abs(q[0] - 1.0) < 1e-6, scheme  # 4 t² / (2·2)
        assert abs(np.arctan2(q[4], q[3]) - 0.25) < 1e-6, scheme  # 0.25 t² / (2·0.5)


def test_particles_take_forces() -> None:
    stepper = hn.Stepper({
        "model": {"name": "flat", "dimension": 2},
        "particle": [{"name": "bob", "mass": 0.5, "position": [0.0, 0.0]}],
        "simulation": {"step": 0.01, "end": 1.0},
    }, inputs=["bob.force"])
    stepper.step([0.0, 1.0, 0.0], n=100)
    assert np.abs(stepper.q - [0.0, 1.0]).max() < 1e-12


@pytest.mark.parametrize("travel", [copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))])
def test_a_state_goes_on_bit_for_bit(double: str, travel) -> None:  # type: ignore[no-untyped-def]
    model = hn.Model.from_toml(double)
    stepper = hn.Stepper(model, inputs=["elbow"], observe=["angle", "elbow.rate"])
    stepper.step([0.7], n=30)
    other = travel(stepper)
    state = stepper.state
    stepper.step(n=40)
    other.step(n=40)
    assert np.array_equal(stepper.q, other.q) and np.array_equal(stepper.observe(), other.observe())
    there = stepper.q
    stepper.step([-3.0], n=5)
    stepper.state = state
    assert stepper.n == 30
    stepper.step(n=40)
    assert np.array_equal(stepper.q, there)
    stepper.reset()
    assert stepper.n == 0 and stepper.t == 0.0
    stepper.step([0.7], n=70)
    assert np.array_equal(stepper.q, there)


def test_observations_are_the_sensors_and_change_nothing(double: str) -> None:
    model = hn.Model.from_toml(double)
    result = hn.simulate(model)
    names = ["angle", "bearing.fx", "bearing", "shoulder", "elbow.rate"]
    stepper = hn.Stepper(model, observe=names)
    rates = []
    for k in range(101):
        seen = stepper.observe()
        assert seen[0] == result.sensors["angle"][k]
        assert seen[1] == seen[2]
        assert np.abs(seen[2:8] - result.sensors["bearing"][k][:6]).max() < 1e-8
        rates.append(seen[-1])
        assert np.array_equal(stepper.q, result.q[k])
        stepper.step()
    slope = (result.sensors["angle"][2:101] - result.sensors["angle"][:99]) / 0.004
    assert np.abs(np.array(rates)[1:100] - slope).max() < 1e-3
    out = np.empty_like(seen)
    assert stepper.observe(out) is out


def test_bad_input_is_refused_and_changes_nothing(double: str) -> None:
    model = hn.Model.from_toml(double)
    stepper = hn.Stepper(model, inputs=["elbow", "lower.force"])
    with pytest.raises(ValueError, match=r"inputs: shape \(4,\), not \(2,\)"):
        stepper.step([1.0, 2.0])
    with pytest.raises(ValueError, match="not finite"):
        stepper.step([np.nan, 0.0, 0.0, 0.0])
    with pytest.raises(ValueError, match=r"shape \(m,\)"):
        stepper.step(np.zeros((2, 2)))
    with pytest.raises(ValueError, match="controls: shape"):
        stepper.run(np.zeros((3, 2)))
    with pytest.raises(ValueError, match="cannot be taken"):
        stepper.step(n=-1)
    assert stepper.n == 0
    for name, words in [
        ("elbo", "did you mean `elbow`"),
        ("lowr.force", "did you mean `lower`"),
        ("elbow.1", "no coordinate 1"),
        ("ground.force", "there is no body"),
    ]:
        with pytest.raises(hn.InvalidModel, match=words):
            hn.Stepper(model, inputs=[name])
    with pytest.raises(hn.UnknownName, match="neither a sensor"):
        hn.Stepper(model, observe=["wrist"])
    with pytest.raises(hn.StateMismatch):
        stepper.state = b"nothing"
    with pytest.raises(hn.StateMismatch):
        stepper.state = hn.Stepper(model).state
    other = hn.Stepper({
        "model": {"name": "flat", "dimension": 2},
        "particle": [{"name": "bob", "mass": 0.5, "position": [0.0, 0.0]}],
        "simulation": {"step": 0.01, "end": 1.0},
    })
    with pytest.raises(hn.StateMismatch):
        hn.Stepper(model).state = other.state
    static = model.replace({"simulation.scheme": "static"})
    with pytest.raises(hn.InvalidModel, match="static"):
        hn.Stepper(static)


def test_a_failed_step_leaves_the_state(double: str) -> None:
    model = hn.Model.from_toml(double).replace({"simulation.step": 0.02})
    stepper = hn.Stepper(model, inputs=["elbow"])
    before = stepper.q
    with pytest.raises(hn.RunFailed) as failed:
        stepper.step([1e9])
    assert failed.value.step == 0 and np.array_equal(stepper.q, before) and stepper.n == 0
    stepper.step([0.0])
    assert stepper.n == 1


def test_two_threads_and_one_stepper(double: str) -> None:
    model = hn.Model.from_toml(double)
    whole = hn.Stepper(model)
    whole.step(n=4000)
    steppers = [hn.Stepper(model), hn.Stepper(model)]
    threads = [threading.Thread(target=s.step, kwargs={"n": 4000}) for s in steppers]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(s.q, whole.q) for s in steppers)
    busy, refused = steppers[0], 0
    thread = threading.Thread(target=busy.step, kwargs={"n": 200_000})
    thread.start()
    while thread.is_alive():
        try:
            busy.step()
        except RuntimeError as error:
            assert "another call" in str(error)
            refused += 1
            break
    thread.join()
    assert refused == 1


def test_a_busy_run_leaves_the_interpreter_free(double: str) -> None:
    """While a run takes its steps another thread counts."""
    counted, done = [0], threading.Event()

    def count() -> None:
        while not done.is_set():
            counted[0] += 1

    thread = threading.Thread(target=count)
    thread.start()
    hn.simulate(hn.Model.from_toml(double), end=20.0, every=100)
    during = counted[0]
    done.set()
    thread.join()
    assert during > 1000


def test_an_observation_goes_into_an_array_that_is_given(double: str) -> None:
    names = ["angle", "shoulder.rate", "elbow.rate", "bearing.fx"]
    for observe in (names[:3], names):  # of the motion alone; of the step as well
        stepper = hn.Stepper(hn.Model.from_toml(double), observe=observe)
        stepper.step(n=7)
        found = stepper.observe()
        whole = np.full((2, len(observe)), np.nan)
        plain = np.zeros(len(observe))
        assert stepper.observe(plain) is plain and np.array_equal(plain, found)
        stepper.observe(whole[1])
        assert np.array_equal(whole[1], found) and np.isnan(whole[0]).all()
        apart, single = np.zeros(2 * len(observe))[::2], np.zeros(len(observe), dtype=np.float32)
        stepper.observe(apart)
        stepper.observe(single)  # type: ignore[arg-type]
        assert np.array_equal(apart, found) and np.array_equal(single, found.astype(np.float32))
        with pytest.raises(ValueError):
            stepper.observe(np.zeros(len(observe) + 1))
        fixed = np.zeros(len(observe))
        fixed.flags.writeable = False
        with pytest.raises(ValueError):
            stepper.observe(fixed)
        assert np.array_equal(stepper.v[:3], stepper.v[:3]) and np.array_equal(stepper.observe(), found)


def test_what_is_observed_is_what_a_run_records(double: str) -> None:
    """Sensors of the motion alone are read on a way of their own: the same bits."""
    kinds = [("rate", "joint_rate", "elbow"), ("turn", "angular_velocity", "lower"), ("speed", "velocity", "lower")]
    text = double + "".join(f'\n[[sensor]]\nname = "{n}"\ntype = "{k}"\nof = "{o}"\n' for n, k, o in kinds)
    for scheme in ("nodal", "em-nodal"):
        for order in (2, 4) if scheme == "nodal" else (2,):
            model = hn.Model.from_toml(text).replace({"simulation.scheme": scheme, "simulation.order": order})
            names = ["angle", *(name for name, _, _ in kinds)]
            stepper, run = hn.Stepper(model, observe=names), hn.simulate(model)
            columns = [run.sensors.columns.index(c) for c in run.sensors.columns if c.partition(".")[0] in names]
            for n in range(len(run) - 1):
                assert np.array_equal(stepper.observe(), run.sensors.values[n, columns]), (scheme, order, n)
                stepper.step()


def test_steps_in_one_call_are_a_result(double: str, tmp_path: Path) -> None:
    model = hn.Model.from_toml(double)
    stepper = hn.Stepper(model, inputs=["elbow"], observe=["angle", "elbow.rate", "bearing"])
    stepper.step([0.3], n=5)
    alone = hn.Stepper(model, inputs=["elbow"], observe=["angle", "elbow.rate", "bearing"])
    alone.state = stepper.state
    controls = np.sin(np.arange(22.0))[:, None]
    run = stepper.run(controls, every=4)
    assert run.step.tolist() == [5, 9, 13, 17, 21, 25, 27] and run.t[-1] == stepper.t
    for n, (q, seen) in enumerate(zip(run.q, run.sensors.values, strict=True)):
        assert np.array_equal(alone.q, q) and np.array_equal(alone.observe(), seen)
        [alone.step(row) for row in controls[4 * n : 4 * n + 4]]
    assert run.columns["sensors"][:3] == ["angle", "elbow.rate", "bearing.fx"]
    assert run.units["sensors"]["elbow.rate"] == "rad/s" and run.units["sensors"]["bearing.mx"] == "N·m"
    assert run.units["q"]["lower.x"] == "m" and run.columns["q"] == stepper.columns
    assert run["lower"].position.shape == (7, 3) and run.sensors["bearing"].shape[0] == 7
    assert run.summary["status"] == "done" and str(run) == f"double: 22 steps to t = {stepper.t:g} s"
    assert np.abs(run.sense("joint_coordinate", of="elbow") - run.sensors["angle"]).max() < 1e-12
    for refused in (lambda: run.save(tmp_path / "run"), run.page):
        with pytest.raises(hn.HolonomError, match="no run from the start"):
            refused()
    # a step that fails raises with what there is
    coarse = hn.Stepper(model.replace({"simulation.step": 0.02}), inputs=["elbow"])
    with pytest.raises(hn.RunFailed) as failed:
        coarse.run([[0.0], [0.0], [0.0], [1e9], [0.0]], every=2)
    result = failed.value.result
    assert result is not None and result.step.tolist() == [0, 2] and coarse.n == 3
    assert result.failure is not None and result.failure["step"] == 3 and result.summary["steps"] == 3
    again = pickle.loads(pickle.dumps(failed.value))
    assert np.array_equal(again.result.q, result.q) and str(again) == str(failed.value)
