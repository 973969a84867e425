"""Gradients against differences of calls, minimizers, and numbers from measurements."""

from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT
from numpy.typing import NDArray

import holonom as hn

ARM = """
model = { name = "arm", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.4 }

[parameters]
length = 0.8
stiffness = 4.0
idle = 1.0

[[body]]
name = "upper"
position = ["= length/2", 0.0, 0.0]
shape = { type = "box", dimensions = ["= length", 0.04, 0.04], density = 780.0 }

[[body]]
name = "lower"
position = ["= 1.5*length", 0.0, 0.0]
shape = { type = "box", dimensions = ["= length", 0.03, 0.03], density = 780.0 }

[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "upper"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]
rate = -3.0
spring = { stiffness = "= stiffness", rest = 0.2 }

[[joint]]
name = "elbow"
type = "revolute"
parent = "upper"
child = "lower"
position = ["= length", 0.0, 0.0]
axis = [0.0, 1.0, 0.0]

[[control]]
name = "drive"
joint = "elbow"
hold = 20

[[sensor]]
name = "tip"
type = "position"
of = "lower"
point = [0.4, 0.0, 0.0]

[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "shoulder"

[[objective]]
name = "height"
type = "sensor"
sensor = "tip.z"
target = 0.5

[[objective]]
name = "cheap"
type = "effort"
weight = 0.01

[[measurement]]
sensor = "angle"
sigma = 0.01

[[measurement]]
sensor = "tip.x"
column = "far"
sigma = 0.01

[identify]
parameters = { stiffness = { start = 5.0 }, length = { start = 0.85, min = 0.5 } }
initial = ["shoulder"]
"""


def differences(objective: hn.Gradient, x: NDArray[np.float64]) -> NDArray[np.float64]:
    slope = np.zeros_like(x)
    for k in range(len(x)):
        e = np.zeros_like(x)
        e[k] = 1e-4
        long, short = (
            (objective.value(x + f * e) - objective.value(x - f * e)) / (2e-4 * f)
            for f in (2.0, 1.0)
        )
        slope[k] = (4.0 * short - long) / 3.0
    return slope


def test_gradients_are_those_of_the_values() -> None:
    model = hn.Model.from_toml(ARM)
    objective = hn.Gradient(model, parameters=True, controls=True, initial=True)
    assert objective.names == [
        "length",
        "stiffness",
        "drive[0]",
        "drive[1]",
        "shoulder.coordinate.0",
        "elbow.coordinate.0",
        "shoulder.rate.0",
        "elbow.rate.0",
    ]
    assert np.array_equal(objective.start, [0.8, 4.0, 0.0, 0.0, 0.0, 0.0, -3.0, 0.0])
    x = objective.start + [0.05, -0.3, 0.7, -0.4, 0.2, -0.1, 0.5, 0.3]
    value, slope = objective(x)
    assert slope.shape == (8,) and slope.dtype == np.float64 and isinstance(value, float)
    wanted = differences(objective, x)
    assert np.all(np.abs(wanted) > 1e-6)
    np.testing.assert_allclose(slope, wanted, rtol=1e-8, atol=1e-9)
    assert objective.last is not None and "height" in str(objective.last)
    np.testing.assert_array_equal(objective.gradient(x), slope)
    # a run with the same numbers ends where the objective says
    part = hn.Gradient(model, of=["height"], parameters=["length"])
    run = hn.simulate(model)
    height = run.sensors["tip"][-1, 2]
    assert abs(part.value(part.start) - 0.5 * (height - 0.5) ** 2) < 1e-12


def test_named_parameters_come_in_their_order_and_others_need_no_derivative() -> None:
    every = hn.Gradient(ARM_MODEL, parameters=True, controls=True)
    x = every.start + [0.05, -0.3, 0.7, -0.4]
    value, slope = every(x)
    turned = hn.Gradient(ARM_MODEL, parameters=["stiffness", "length"], controls=True)
    assert turned.names == ["stiffness", "length", "drive[0]", "drive[1]"]
    place = [1, 0, 2, 3]
    again, by = turned(x[place])
    assert again == value and np.array_equal(by, slope[place])
    at = every.start.copy()
    at[1] -= 0.3
    one = hn.Gradient(ARM_MODEL, parameters=["stiffness"])
    assert one(at[1:2])[1].shape == (1,) and one(at[1:2])[1][0] == every(at)[1][1]
    # a law reads one, by which there is a derivative
    law = ARM + '\n[[law]]\nname = "stop"\njoint = "elbow"\neffort = "-idle*x - 2*idle^2*x^3"\n'
    objective = hn.Gradient(hn.Model.from_toml(law), parameters=["idle"])
    x = np.array([1.3])
    np.testing.assert_allclose(objective.gradient(x), differences(objective, x), rtol=1e-8, atol=1e-9)
    assert objective.gradient(x)[0] != 0.0
    # steps of a law, the step of the run: by neither there is a derivative
    law = ARM + '\n[[law]]\nname = "stop"\njoint = "elbow"\neffort = "-floor(3*idle*x)"\n'
    short = ARM.replace("idle = 1.0", "idle = 1.0\nfinest = 0.01").replace("step = 0.01", 'step = "= finest"')
    for text, there in ((law, "idle"), (short, "finest")):
        with pytest.raises(hn.InvalidModel, match=f"derivative by `{there}`"):
            hn.Gradient(hn.Model.from_toml(text), parameters=[there])([1.0])
        objective = hn.Gradient(hn.Model.from_toml(text), parameters=["stiffness"])
        x = np.array([3.7])
        np.testing.assert_allclose(objective.gradient(x), differences(objective, x), rtol=1e-8, atol=1e-9)


def test_minimizers_take_it() -> None:
    optimize = pytest.importorskip("scipy.optimize")
    objective = hn.Gradient(ARM_MODEL, parameters=["stiffness"], controls=True)
    found = optimize.minimize(objective, objective.start, jac=True, method="L-BFGS-B")
    assert found.fun < 0.2 * objective.value(objective.start)
    assert np.max(np.abs(found.jac)) < 1e-3
    assert found.nfev < 60


def test_what_has_no_gradient_is_named() -> None:
    for name, words in {"width": "no number under", "lenght": "did you mean `length`", "idle": "nothing depends"}.items():
        with pytest.raises(hn.InvalidModel, match=words) as refused:
            hn.Gradient(ARM_MODEL, parameters=["stiffness", name])
        assert f"`{name}`" in str(refused.value)
    with pytest.raises(ValueError, match="more than once"):
        hn.Gradient(ARM_MODEL, parameters=["length", "length"])
    with pytest.raises(ValueError, match="by what"):
        hn.Gradient(ARM_MODEL)
    objective = hn.Gradient(ARM_MODEL, controls=True)
    with pytest.raises(ValueError, match="shape"):
        objective([1.0])
    with pytest.raises(ValueError, match="finite"):
        objective([1.0, np.nan])
    plain = ARM_MODEL.to_dict()
    plain.pop("objective")
    with pytest.raises(hn.InvalidModel, match="gradient of nothing"):
        hn.Gradient(hn.Model.from_dict(plain), controls=True)


def measured(noise: float) -> dict[str, NDArray[np.float64]]:
    run = hn.simulate(ARM_MODEL, joints={"shoulder": 0.2}, rates={"shoulder": -2.0})
    random = np.random.default_rng(3)
    far = run.sensors["tip"][:, 0] + noise * random.standard_normal(len(run.t))
    angle = run.sensors["angle"] + noise * random.standard_normal(len(run.t))
    far[::2] = np.nan
    return {"t": run.t, "angle": angle, "far": far}


def test_numbers_are_found_again(tmp_path: Path) -> None:
    found = hn.identify(ARM_MODEL, measured(0.0))
    assert found.names == ["length", "stiffness", "shoulder.coordinate", "shoulder.rate"]
    assert found.converged
    np.testing.assert_allclose(found.estimates, [0.8, 4.0, 0.2, -2.0], rtol=1e-6)
    assert found.joints.keys() == {"shoulder"} and found.rates.keys() == {"shoulder"}
    again = hn.simulate(found.model, joints=found.joints, rates=found.rates)
    np.testing.assert_allclose(again.sensors["angle"], measured(0.0)["angle"], atol=1e-7)
    noisy = hn.identify(ARM_MODEL, measured(0.01))
    off = (noisy.estimates - [0.8, 4.0, 0.2, -2.0]) / noisy.standard_errors
    assert np.max(np.abs(off)) < 4.0
    covariance = noisy.covariance
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), noisy.standard_errors)
    assert covariance.shape == (4, 4) and np.allclose(np.diag(noisy.correlation), 1.0)
    rows = noisy.residuals
    assert rows["angle"].shape == (41, 4) and rows["far"].shape == (20, 4)
    computed, value, residual = rows["far"][:, 2], rows["far"][:, 1], rows["far"][:, 3]
    np.testing.assert_allclose((computed - value) / 0.01, residual, atol=1e-9)
    # the same from a file
    data = measured(0.01)
    file = tmp_path / "data.csv"
    lines = ["t,angle,far"]
    for row in zip(*(own.tolist() for own in data.values()), strict=True):
        lines.append(",".join("" if value != value else repr(value) for value in row))
    file.write_text("\n".join(lines), encoding="utf-8")
    assert np.array_equal(hn.identify(ARM_MODEL, file).estimates, noisy.estimates)
    runs: list[int] = []
    hn.identify(ARM_MODEL, file, progress=lambda run, _: runs.append(run))
    assert runs == sorted(runs)


def test_what_is_no_data_is_refused() -> None:
    data = measured(0.0)
    with pytest.raises(ValueError, match="column `t`"):
        hn.identify(ARM_MODEL, {"angle": data["angle"]})
    with pytest.raises(ValueError, match="shape"):
        hn.identify(ARM_MODEL, {"t": data["t"], "angle": data["angle"][1:]})
    with pytest.raises(hn.AnalysisFailed, match="no column `far`"):
        hn.identify(ARM_MODEL, {"t": data["t"], "angle": data["angle"]})
    with pytest.raises(hn.AnalysisFailed, match="beyond the end"):
        hn.identify(ARM_MODEL, {**data, "t": 2.0 * data["t"]})
    plain = ARM_MODEL.to_dict()
    plain.pop("identify")
    with pytest.raises(hn.InvalidModel, match="estimate of nothing"):
        hn.identify(hn.Model.from_dict(plain), data)


def test_the_shipped_pendulum() -> None:
    place = ROOT / "examples" / "models"
    found = hn.identify(place / "friction_pendulum.toml", place / "friction_pendulum.csv")
    off = (found.estimates - [0.27, 0.031, 0.35, -0.4]) / found.standard_errors
    assert np.max(np.abs(off)) < 3.0


CLOCK = """
model = { name = "clock", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 1.0 }
parameters = { length = 0.7 }

[[body]]
name = "bob"
mass = 1.0
inertia = [1e-3, 1e-3, 1e-3]
position = ["= length", 0.0, 0.0]

[[joint]]
name = "hinge"
type = "revolute"
parent = "ground"
child = "bob"
position = [0.0, 0.0, 0.0]
axis = [0.0, 1.0, 0.0]

[[sensor]]
name = "place"
type = "position"
of = "bob"

[[sensor]]
name = "angle"
type = "joint_coordinate"
of = "hinge"
"""
DESIGN = """
condition = [{ name = "down", sensor = "place.x", at = 0.5, equals = 0.0 }]
optimize = { parameters = { length = { min = 0.2, max = 2.0 } } }
"""
CONTROL = """
control = [{ name = "torque", joint = "hinge" }]
objective = [{ name = "cheap", type = "effort" }]
condition = [{ name = "up", sensor = "angle", equals = -1.0 }, { name = "stop", type = "rest" }]
"""


def head(more: str) -> hn.Model:
    return hn.Model.from_toml(more + CLOCK)


def test_a_design_is_an_ordinary_model() -> None:
    seen: list[int] = []
    found = hn.optimize(head(DESIGN), progress=lambda iteration, _: seen.append(iteration))
    assert found.optimal and found.parameters.keys() == {"length"}
    length = found.parameters["length"]
    assert found.model.to_dict()["body"][0]["position"][0] == length != 0.7
    run = hn.simulate(found.model)
    node = int(np.argmin(np.abs(run.t - 0.5)))
    assert abs(run.sensors["place"][node, 0]) < 1e-9
    # the point mass of a pendulum of this length passes its lowest point after a quarter of K(1/√2)
    quarter = 1.8540746773013719 * np.sqrt((length + 1e-3 / length) / 9.81)
    assert abs(quarter - 0.5) < 1e-3
    assert found.controls.shape == (0, 0) and found.t.shape == (0,)
    assert found.iterations["length"][-1] == length and found.iterations["iteration"][0] == 0
    assert "parameter" in str(found) and "length" in found.page()
    with pytest.warns(hn.HolonomWarning, match="infeasible"):
        missed = hn.optimize(head(DESIGN.replace("equals = 0.0", "equals = 5.0")))
    assert not missed.optimal and missed["status"] == "infeasible"
    with pytest.raises(hn.InvalidModel, match="no number under"):
        hn.optimize(head(DESIGN.replace("length = {", "width = {")))


def test_controls_need_their_method() -> None:
    try:
        found = hn.optimize(head(CONTROL))
    except hn.InvalidModel as error:
        assert "--features optimize" in str(error) and error.problems[0].key == "control"
        return
    assert found.optimal and found.controls.shape == (100, 1) and found.costates.shape == (100, 1)
    assert abs(0.5 * 0.01 * np.sum(found.controls**2) - found.cost) < 1e-12
    run = hn.simulate(found.model)
    assert abs(run.sensors["angle"][-1] + 1.0) < 1e-8
    assert found.t[0] == 0.005 and "Controls" in found.page()


ARM_MODEL = hn.Model.from_toml(ARM)


def test_numbers_of_beams_are_named_by_their_keys() -> None:
    text = """
model = { name = "mast", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.01, end = 0.2 }

[[beam]]
name = "mast"
points = [[0.0, 0.0, 0.0], [0.9, 0.0, 0.2]]
normal = [0.0, 1.0, 0.0]
elements = 3
section.shape = { type = "rectangle", dimensions = [0.02, 0.03] }
section.material = { density = 2700.0, E = 7e9, nu = 0.3 }

[[joint]]
name = "clamp"
type = "fixed"
parent = "ground"
child = "mast.start"
position = [0.0, 0.0, 0.0]

[[sensor]]
name = "tip"
type = "position"
of = "mast.end"

[[objective]]
name = "low"
type = "value"
sensor = "tip.z"
"""
    keys = ["beam.mast.points.1.2", "beam.mast.section.shape.dimensions.1"]
    objective = hn.Gradient(hn.Model.from_toml(text), parameters=keys)
    assert objective.names == keys and np.array_equal(objective.start, [0.2, 0.03])
    x = objective.start * [1.1, 0.9]
    value, slope = objective(x)
    wanted = differences(objective, x)
    print(value, slope, wanted)
    assert np.all(np.abs(wanted) > 1e-6)
    np.testing.assert_allclose(slope, wanted, rtol=1e-6)
