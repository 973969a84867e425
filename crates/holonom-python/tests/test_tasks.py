"""What users of such packages do, each in the few lines that it should take."""

import warnings
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import ROOT

import holonom as hn


@pytest.fixture(autouse=True)
def quiet() -> None:
    warnings.simplefilter("ignore", hn.HolonomWarning)


def test_run_a_file_plot_look(double: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("crane.toml").write_text(double)
    result = hn.simulate("crane.toml", end=0.2)
    assert "double" in str(result) and result.summary["status"] == "done"
    nodes = len(result)
    assert result.t.shape == (nodes,) and result["upper"].position.shape == (nodes, 3)
    assert np.shares_memory(result["upper"].position, result.q)  # views
    assert result.sensors["bearing"].shape == (nodes, 7) and "bearing.fx" in result.sensors.columns
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    result.view()
    assert opened and Path(opened[0].removeprefix("file://")).read_text().startswith("<!")
    pytest.importorskip("matplotlib").use("Agg")
    assert result.plot("angle").get_xlabel() == "t [s]"


def test_build_a_mechanism_with_a_loop(tmp_path: Path) -> None:
    spec = hn.Spec("four_bar", gravity=[0, 0, -9.81], step=1e-3, end=0.1, project_start=True)
    corners = np.array([[0, 0, 0], [0, 0, 1], [2, 0, 1], [2, 0, 0]])
    for k, (a, b) in enumerate(zip(corners, corners[1:])):
        shape = hn.rod(float(np.linalg.norm(b - a)), 0.02, density=7800)
        spec.body(f"bar{k}", position=(a + b) / 2, shape=shape, along=b - a)
    links = ["ground", "bar0", "bar1", "bar2", "ground"]
    for k, at in enumerate(corners):
        spec.joint(f"pin{k}", "revolute", links[k], links[k + 1], position=at, axis=[0, 1, 0])
    spec.joints["pin0"].rate = 1.0
    assert spec.check()["assembly"]["dof"] == 1 and "degrees of freedom" in str(spec.check())
    spec.save(tmp_path / "four_bar.toml")
    moved = hn.simulate(tmp_path / "four_bar.toml")
    assert np.abs(moved["bar0"].position[-1] - moved["bar0"].position[0]).max() > 1e-2


def test_take_a_robot() -> None:
    robots = sorted((ROOT / "tests" / "imported").glob("*panda*.xml")) + sorted((ROOT / "tests").rglob("panda*.urdf"))
    if not robots:
        pytest.skip("no robot at hand")
    robot = hn.import_robot(robots[0], step=2e-3, end=0.02)
    assert all(isinstance(remark, str) for remark in robot.remarks)
    model = robot.spec.compile()
    assert model == robot.model
    name = next(name for name, joint in model.joints.items() if joint["type"] == "revolute")
    result = hn.simulate(model.replace({f"joint.{name}.motor.effort": 5.0}))
    assert result.energy[f"work.{name}.motor"].shape == result.t.shape
    pytest.importorskip("xarray")
    assert result.to_xarray().sizes["component"] == 3


def test_a_control_loop(double: str) -> None:
    model = hn.Model.from_toml(double)
    names = ["shoulder", "shoulder.rate", "elbow", "elbow.rate"]
    robot = hn.Stepper(model, inputs=["shoulder", "elbow"], observe=names)
    robot.reset(joints={"elbow": 0.3})
    for _ in range(2000):
        x = robot.observe()
        robot.step([-200 * x[0] - 40 * x[1], -80 * x[2] - 10 * x[3]])
    assert np.abs(robot.observe()[[1, 3]]).max() < 1e-3  # at rest
    keep = robot.state
    robot.step(n=10)
    there = robot.q
    robot.state = keep
    robot.step(n=10)
    assert np.array_equal(robot.q, there)


def test_an_environment_for_learning(double: str) -> None:
    pytest.importorskip("gymnasium")
    from holonom.gym import Env

    env = Env(
        hn.Model.from_toml(double), inputs=["shoulder"], observe=["shoulder", "shoulder.rate"], low=-2, high=2, steps_per_action=10,
        reward=lambda x, u: -(x[0] - np.pi) ** 2 - 1e-3 * float(u @ u), start=lambda rng: {"shoulder": rng.normal(0, 0.1)},
    )
    observation, _ = env.reset(seed=1)
    assert observation[0] != 0.0 and observation[1] == pytest.approx(0.0)
    observation, reward, terminated, truncated, _ = env.step(env.action_space.sample())
    assert observation.shape == (2,) and reward < 0.0 and not terminated and not truncated


def test_a_force_of_ones_own(double: str) -> None:
    spec = hn.Model.from_toml(double).spec()
    spec.law("stop", joint="elbow", effort="-1e2*max(x - 0.2, 0)")

    def drag(t: float, x: float, v: float) -> tuple[float, float, float]:
        return -0.3 * v * abs(v), 0.0, -0.6 * abs(v)

    def wind(t: float, body: hn.BodyState) -> Any:
        return np.r_[1.2 * (np.array([8 * np.sin(t), 0, 0]) - body.velocity), 0, 0, 0]

    braked = hn.simulate(spec, laws={"elbow": drag})
    assert braked.energy["work.elbow.law"][-1] < 0.0
    blown = hn.simulate(spec, forces={"lower": wind})
    assert np.abs(blown.q - hn.simulate(spec).q).max() > 1e-3


def test_a_beam_in_equilibrium_then_in_motion() -> None:
    spec = hn.Spec("whip", gravity=[0, 0, -9.81], step=1e-3, end=0.02)
    rod = spec.beam(
        "rod", points=[[0, 0, 0], [1, 0, 0]], elements=8, normal=[0, 0, 1], start="clamped",
        section=hn.section(hn.rectangle(0.02, 0.005), E=2.1e11, nu=0.3, density=7850),
    )
    spec.load("tip", body=rod.end, force=[0, 0, -0.5])
    hung = hn.statics(spec, step=0.01)
    assert hung["rod.8"].position[-1, 2] < -1e-4
    moved = hn.simulate(spec, start="relaxed")
    assert moved.beams["rod"].moment.shape == (21, 8, 3)
    assert np.abs(moved["rod.8"].position - moved["rod.8"].position[0]).max() < 1e-9  # it stays there


def test_frequencies_and_shapes() -> None:
    spec = hn.Spec("whip", gravity=[0, 0, -9.81], step=1e-3, end=0.02)
    section = hn.section(hn.rectangle(0.02, 0.005), E=2.1e11, nu=0.3, density=7850)
    spec.beam("rod", 8, points=[[0, 0, 0], [1, 0, 0]], normal=[0, 0, 1], start="clamped", section=section)
    modes = hn.modes(spec, at="static", count=4)
    assert modes.frequencies.shape == modes.damping.shape == (4,)
    assert modes.shapes.shape == (4, len(modes.members), 6)
    # Euler–Bernoulli: (β l)² /2π √(EI/ρA) / l², β l = 1.8751; height 5 mm across the weaker axis
    stiff = 2.1e11 * np.array([0.005**3 * 0.02, 0.02**3 * 0.005]) / 12
    exact = 1.875104**2 / (2 * np.pi) * np.sqrt(stiff / (7850 * 1e-4))
    assert np.abs(modes.frequencies[0] / exact.min() - 1) < 2e-2
    tip = modes.shapes[0][modes.members.index("rod.8")]
    assert np.abs(tip[:3]).max() == pytest.approx(1.0)


def test_fit_and_optimize(double: str) -> None:
    model = hn.Model.from_toml(double)
    true = {"body.lower.mass": 0.8, "joint.elbow.damper.damping": 0.05}
    data = hn.simulate(model, set=true).sensors["angle"]

    def residual(p: np.ndarray) -> np.ndarray:
        values = {"body.lower.mass": p[0], "joint.elbow.damper.damping": p[1]}
        return hn.simulate(model, set=values, record=["sensors"]).sensors["angle"] - data

    p = np.array([0.5, 0.02])
    for _ in range(8):  # Gauss–Newton with differences; or scipy.optimize.least_squares
        r = residual(p)
        slopes = np.stack([(residual(p + step) - r) / 1e-6 for step in 1e-6 * np.eye(2)], axis=1)
        p -= np.linalg.lstsq(slopes, r, rcond=None)[0]
    assert np.abs(p - [0.8, 0.05]).max() < 1e-6


def reach(result: hn.Result) -> float:
    return float(result["lower"].position[:, 0].max())


def test_many_runs_on_any_engine(double: str, tmp_path: Path) -> None:
    model = hn.Model.from_toml(double.replace("[0.0, 0.0, -9.81]", '[0.0, 0.0, "= -g"]') + "\n[parameters]\ng = 9.81\n")
    model = model.replace({"simulation.end": 0.02})
    plan = hn.plan({"body.lower.mass": (0.5, 1.5), "parameters.g": (9.0, 10.0)}, sample="sobol", n=32, seed=7)
    table = hn.sweep(model, plan, outputs={"reach": reach})
    with ProcessPoolExecutor(2) as pool:
        other = hn.sweep(model, plan, outputs={"reach": reach}, executor=pool, out=tmp_path / "sweep")
    assert table == other and len(table) == 32 and not table.failed
    frame = pytest.importorskip("pandas") and table.to_pandas()
    assert list(frame.columns[:2]) == ["body.lower.mass", "parameters.g"]
