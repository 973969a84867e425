"""What a result holds: shapes, names, values that follow from one another."""

import pickle
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT, program

import holonom as hn


def test_names_shapes_and_views(double: str) -> None:
    result = hn.simulate(hn.Model.from_toml(double))
    assert len(result) == 201 and result.t[-1] == 0.4
    assert result.members == ["upper", "lower"]
    upper = result["upper"]
    assert upper.position.shape == (201, 3) and np.shares_memory(upper.position, result.q)
    directors = upper.directors
    assert directors.shape == (201, 3, 3) and np.shares_memory(directors, result.q)
    gram = directors @ directors.swapaxes(1, 2)
    assert np.abs(gram - np.eye(3)).max() < 1e-13
    assert np.array_equal(directors[:, 0], upper.rotation[:, :, 0])
    q = upper.quaternion  # about -y by the angle of the shoulder
    turned = 1 - 2 * (q[:, 2] ** 2 + q[:, 3] ** 2)
    assert np.abs(turned - upper.rotation[:, 0, 0]).max() < 1e-13
    crossed = 2 * (q[:, 1] * q[:, 3] + q[:, 0] * q[:, 2])
    assert np.abs(crossed - upper.rotation[:, 0, 2]).max() < 1e-13
    assert result.sensors["angle"].shape == (201,)
    assert result.sensors["bearing"].shape[1] >= 6
    assert result.sensors.columns[0] == "angle" and "bearing.fx" in result.sensors.columns
    parts = result.energy["kinetic"] + result.energy["gravity"]
    assert np.abs(parts - result.energy["total"]).max() < 1e-12
    assert np.abs(result.energy["balance"]).max() < 1e-3
    weight = np.array([0.0, 0.0, -1.5 * 9.81])
    held = np.linalg.norm(np.diff(result.momentum.linear, axis=0) / 0.002 - weight, axis=1)
    bearing = np.linalg.norm(result.sensors["bearing"][:, :3], axis=1)
    assert np.abs(held - 0.5 * (bearing[1:] + bearing[:-1]))[1:-1].max() < 1e-3 * bearing.max()
    assert result.residuals["position"].max() < 1e-13
    assert set(result.columns) == set(result.units) == {"q", "tail", "residuals", "energy", "sensors"}
    assert result.columns["energy"] == result.energy.columns and result.units["energy"]["kinetic"] == "J"
    assert result.units["sensors"]["angle"] == "rad" and result.units["q"]["upper.d1x"] == ""
    assert result.table("trajectory").columns[:3] == ["step", "t", "upper.x"]
    with pytest.raises(hn.UnknownName, match="did you mean `upper`"):
        result["uper"]
    assert str(result).startswith("double: 2 degrees of freedom")


def test_quaternions_are_the_rotations_and_continuous() -> None:
    """A body that tumbles about all axes: ``R = I + 2 w [v] + 2 [v]²``."""
    body = {"name": "stone", "mass": 1.0, "inertia": [1.0, 2.0, 3.0], "angular_velocity": [0.3, 3.0, 0.2]}
    settings = {"step": 0.01, "end": 30.0}
    result = hn.simulate(hn.Model.from_dict({"model": {"name": "tumble"}, "body": [body], "simulation": settings}))
    q, rotation = result["stone"].quaternion, result["stone"].rotation
    skew = np.zeros((len(q), 3, 3))
    for i in range(3):
        skew[:, (i + 2) % 3, (i + 1) % 3] = q[:, 1 + i]
        skew[:, (i + 1) % 3, (i + 2) % 3] = -q[:, 1 + i]
    found = np.eye(3) + 2 * q[:, :1, None] * skew + 2 * skew @ skew
    assert np.abs(found - rotation).max() < 1e-12
    assert np.linalg.norm(np.diff(q, axis=0), axis=1).max() < 0.05  # no jump of the sign
    largest = np.argmax(np.abs(q), axis=1)
    assert set(largest) == {0, 1, 2, 3}  # all cases of the formula


def test_parts_of_a_record(double: str) -> None:
    result = hn.simulate(hn.Model.from_toml(double), record=["q"], end=0.02, every=5)
    assert set(result.tables) == {"q"}
    assert result.q.shape == (3, 24) and result.step.tolist() == [0, 5, 10]
    with pytest.raises(hn.UnknownName, match="record"):
        result.energy
    with pytest.raises(hn.UnknownName, match="momentum maps"):
        result.momentum
    # what is read does not change the motion; what is not read is not said
    model = hn.Model.from_toml(double)
    whole = hn.simulate(model)
    part = hn.simulate(model, record=["q"])
    seen = hn.simulate(model, record=["q", "sensors"])
    energy = hn.simulate(model, record=["q", "energy"])
    for own in (part, seen, energy):
        assert np.array_equal(own.q, whole.q) and np.array_equal(own.t, whole.t)
        assert np.array_equal(own.step, whole.step)
        assert own.summary["newton_iterations"] == whole.summary["newton_iterations"]
    assert np.array_equal(seen.sensors["bearing"], whole.sensors["bearing"]) and set(seen.tables) == {"q", "sensors"}
    assert np.array_equal(energy.energy["balance"], whole.energy["balance"])
    assert energy.summary["energy"] == whole.summary["energy"] and set(energy.tables) == {"q", "energy", "tail"}
    unread = part.summary
    assert unread["energy"]["max_abs_error"] is None and unread["energy"]["final"] is None
    assert unread["constraint_residual"]["position"]["max"] is None and "NaN" not in str(part)
    assert "energy" not in str(part) and "energy" in str(whole) and "per step" in str(part)
    assert part.table("trajectory").columns == whole.table("trajectory").columns[:-8]
    held = hn.simulate(model, record=["q"], inputs={"elbow": 0.3})
    assert np.array_equal(held.q, hn.simulate(model, inputs={"elbow": 0.3}).q)
    with pytest.raises(TypeError, match="everything"):
        hn.simulate(hn.Model.from_toml(double), record=["everything"])


def test_a_beam_in_equilibrium() -> None:
    result = hn.statics(ROOT / "examples" / "models" / "princeton.toml")
    (name, beam), *_ = result.beams.items()
    assert beam.values.shape == (len(result), len(beam.s), 12)
    assert np.array_equal(beam.moment, beam.values[:, :, 9:]) and beam.force.shape[2] == 3
    assert np.abs(beam.moment[-1]).max() > 0 and np.all(np.diff(beam.s) > 0), name
    assert "unstable" in result.residuals.columns


def test_tables_for_others(double: str, tmp_path: Path) -> None:
    result = hn.simulate(hn.Model.from_toml(double), end=0.02)
    result.to_npz(tmp_path / "run.npz")
    with np.load(tmp_path / "run.npz") as stored:
        assert np.array_equal(stored["q"], result.q) and stored["q_columns"][0] == "upper.x"
    pandas = pytest.importorskip("pandas")
    frame = result.to_pandas("energy")
    assert isinstance(frame, pandas.DataFrame) and np.array_equal(frame["total"], result.energy["total"])
    pytest.importorskip("xarray")
    data = result.to_xarray()
    assert data["upper.position"].dims == ("t", "component") and data["upper.position"].units == "m"
    assert np.array_equal(data["sensors.angle"], result.sensors["angle"])


def test_a_saved_folder_is_that_of_the_program(double: str, tmp_path: Path) -> None:
    (tmp_path / "double.toml").write_text(double)
    result = hn.simulate(tmp_path / "double.toml")
    result.save(tmp_path / "ours")
    assert program("run", str(tmp_path / "double.toml"), "-o", str(tmp_path / "theirs"), "-q").returncode == 0
    for name in ("trajectory", "residuals", "energy", "sensors"):
        ours, theirs = ((tmp_path / run / f"{name}.csv").read_bytes() for run in ("ours", "theirs"))
        assert ours == theirs, name
    read = hn.open(tmp_path / "ours")
    assert np.array_equal(read.q, result.q)
    read.save(tmp_path / "again")
    assert np.array_equal(hn.open(tmp_path / "again").q, result.q)
    for source in (result, read):
        with pytest.raises(hn.OutputExists):
            source.save(tmp_path / "ours" if source is result else tmp_path / "again")
        source.save(tmp_path / "again", force=True)
    (tmp_path / "other").mkdir()
    (tmp_path / "other" / "mine").write_text("x")
    with pytest.raises(hn.OutputExists):
        read.save(tmp_path / "other", force=True)
    assert (tmp_path / "other" / "mine").exists()


def test_exports_are_those_of_the_program(double: str, tmp_path: Path) -> None:
    result = hn.simulate(hn.Model.from_toml(double), end=0.05)
    assert Path(result.export("gltf", tmp_path / "run.glb", frames=5)).read_bytes()[:4] == b"glTF"
    with np.load(result.export("npz", tmp_path / "run.npz")) as stored:
        assert len(stored.files) > 3
    result.save(tmp_path / "run")
    assert program("export", str(tmp_path / "run"), "--format", "npz", "-o", str(tmp_path / "own.npz")).returncode == 0
    assert (tmp_path / "own.npz").read_bytes() == (tmp_path / "run.npz").read_bytes()
    with pytest.raises(TypeError, match="format: `obj` is none of npz"):
        result.export("obj", tmp_path / "run.obj")


def test_runs_with_functions_have_pages_and_files(double: str, tmp_path: Path) -> None:
    result = hn.simulate(hn.Model.from_toml(double), end=0.05, laws={"elbow": lambda t, x, v: -2.0 * x})
    result.save(tmp_path / "run")
    assert np.array_equal(hn.open(tmp_path / "run").q, result.q)
    away = pickle.loads(pickle.dumps(result))
    with pytest.raises(hn.HolonomError, match="did not travel"):
        away.page()


def test_the_page_stands_alone(double: str) -> None:
    page = hn.simulate(hn.Model.from_toml(double), end=0.02).page()
    assert page.startswith("<!") and "double" in page and "</html>" in page


def test_a_sensor_afterwards(double: str) -> None:
    text = double + """
[[signal]]
name = "held"
rate = "t"

[[sensor]]
name = "tip"
type = "position"
of = "lower"
point = [0.5, 0.0, 0.0]
"""
    turned = {"body.upper.angular_velocity": [0.0, 12.0, 0.0], "body.upper.velocity": [0.0, 0.0, -6.0]}
    turned |= {"body.lower.angular_velocity": [0.0, 12.0, 0.0], "body.lower.velocity": [0.0, 0.0, -18.0]}
    result = hn.simulate(hn.Model.from_toml(text).replace(turned), end=2.0)
    tip = result.sense("position", of="lower", point=[0.5, 0.0, 0.0])
    assert tip.shape == (len(result), 3) and np.array_equal(tip, result.sensors["tip"])
    angle = result.sense("joint_coordinate", of="elbow")
    assert np.array_equal(angle, result.sensors["angle"])
    along = result["upper"].directors[:, 0]
    turns, wanted = result.sense("joint_coordinate", of="shoulder"), np.unwrap(np.arctan2(-along[:, 2], along[:, 0]))
    print(np.abs(turns - wanted).max(), turns.max())
    assert np.abs(turns - wanted).max() < 1e-12 and turns.max() > 2 * np.pi
    seen = result.sense("position", of="lower", seen_from="upper")
    arm, r = result["lower"].position - result["upper"].position, result["upper"].rotation
    assert np.abs(seen - np.einsum("kji,kj->ki", r, arm)).max() < 1e-13
    assert np.abs(np.linalg.norm(result.sense("orientation", of="lower"), axis=1) - 1).max() < 1e-14
    with pytest.raises(hn.AnalysisFailed, match="before the run"):
        result.sense("velocity", of="lower")
    with pytest.raises(hn.InvalidModel, match="lowr"):
        result.sense("position", of="lowr")


def test_arrays_that_are_too_large_are_refused(double: str) -> None:
    model = hn.Model.from_toml(double)
    whole = hn.simulate(model, end=0.02)
    node = 16 + sum(8 * len(table.columns) for table in whole.tables.values())
    nodes = (2 << 30) // node
    with pytest.raises(hn.MemoryLack, match=r"2\.0 GiB, more than 2 GiB") as refused:
        hn.simulate(model, end=0.002 * nodes)
    assert all(f"`{word}`" in str(refused.value) for word in ("every", "record", "out"))
    asked: list[int] = []

    def stop(step: int, of: int) -> None:
        asked.append(of)
        raise LookupError

    smaller: list[dict[str, object]] = [{"every": 2}, {"record": ["q"]}]
    for options in smaller:
        with pytest.raises(LookupError):  # begun, and stopped
            hn.simulate(model, end=0.002 * nodes, progress=stop, **options)  # type: ignore[arg-type]
    assert asked == [nodes, nodes]
    beam = hn.load(ROOT / "examples" / "models" / "princeton.toml")
    assert "GiB" not in str(hn.simulate(beam))
