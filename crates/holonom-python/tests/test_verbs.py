"""The other verbs: the JSON and the words of the program."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT, program

import holonom as hn

PENDULUM = ROOT / "examples" / "models" / "simple_pendulum.toml"


def test_check_and_modes_are_those_of_the_program(double: str, tmp_path: Path) -> None:
    file = tmp_path / "double.toml"
    file.write_text(double)
    said = json.loads(program("check", str(file), "--json").stdout)
    said.pop("file")
    found = hn.check(file)
    assert found.to_dict() == said and found["assembly"]["dof"] == 2
    assert str(found) == program("check", str(file)).stderr
    still = {"body.upper.position": [0.0, 0.0, -0.5], "body.lower.position": [0.0, 0.0, -1.5]}
    still |= {"joint.elbow.position": [0.0, 0.0, -1.0]}
    hanging = hn.load(file).replace(still)
    modes = hn.modes(hanging, at="static", count=5)
    hanging.save(tmp_path / "hanging.toml")
    words = ("modes", str(tmp_path / "hanging.toml"), "--at", "static", "-n", "5")
    assert modes.to_dict() == json.loads(program(*words, "--json").stdout)
    assert str(modes) == program(*words).stdout
    # M ω² = K of two bodies with their centres half way, about the vertical
    m, g = np.array([1.0, 0.5]), 9.81
    mass = np.array([[0.02 + m[0] / 4 + m[1], m[1] / 2], [m[1] / 2, 0.02 + m[1] / 4]])
    stiffness = np.diag([m[0] * g / 2 + m[1] * g, m[1] * g / 2])
    omega = np.sqrt(np.linalg.eigvals(np.linalg.solve(mass, stiffness)))
    assert np.abs(np.sort(modes.frequencies) - np.sort(omega) / (2 * np.pi)).max() < 1e-6
    with pytest.raises(TypeError, match="none of start"):
        hn.modes(file, at="end")


def test_verify_and_compare(double: str) -> None:
    model = hn.Model.from_toml(double).replace({"simulation.end": 0.05})
    told: list[str] = []
    certificate = hn.verify(model, accuracy=1e-3, progress=told.append)
    assert certificate["model"] == "double" and isinstance(certificate["holds"], bool)
    assert told and "double" in str(certificate)

    def stop(words: str) -> None:
        raise LookupError(words)

    comparison = hn.compare(model, schemes=["nodal", "em-nodal"], steps=[0.005, 0.0025])
    assert "nodal" in str(comparison) and comparison.to_dict()
    with pytest.raises(hn.HolonomError):
        hn.compare(model, schemes=["leapfrog"])
    with pytest.raises(LookupError):
        hn.verify(model, progress=stop)


def test_a_robot_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    robot = tmp_path / "arm.urdf"
    inertial = '<inertial><mass value="2"/><origin xyz="0 0 0.5"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
    robot.write_text(
        f'<robot name="arm"><link name="base"/><link name="link">{inertial}</link>'
        '<joint name="hinge" type="revolute"><parent link="base"/><child link="link"/>'
        '<axis xyz="0 1 0"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>'
    )
    imported = hn.import_robot(robot, joints={"hinge": 0.3}, step=1e-3, end=0.05)
    text = robot.read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    again = hn.import_robot(text, joints={"hinge": 0.3}, step=1e-3, end=0.05)
    assert again.model == imported.model and again.remarks == imported.remarks
    assert sorted(tmp_path.iterdir()) == before
    assert imported.model.name == "arm" and list(imported.model.joints) == ["hinge"]
    assert any("limit" in remark for remark in imported.remarks), imported.remarks
    result = hn.simulate(imported.model)
    assert len(result) == 51
    assert np.abs(result["link"].position[0] - [0.5 * np.sin(0.3), 0.0, 0.5 * np.cos(0.3)]).max() < 1e-12
    robot.write_text("<robot")
    with pytest.raises(hn.ImportFailed):
        hn.import_robot(robot)


def test_schema_and_program() -> None:
    assert "axis" in hn.schema("joint")["properties"]
    assert hn.schema() == json.loads(program("schema").stdout)
    with pytest.raises(KeyError, match="there is no `joints`"):
        hn.schema("joints")
    assert program("--version").stdout.split()[1] == hn.__version__
    assert program("runn").returncode == 2


def test_the_program_starts_without_numpy_and_as_a_module(tmp_path: Path) -> None:
    script = "import sys; from holonom_program import main\ntry: main()\nfinally: print(*sys.modules)"
    said = subprocess.run([sys.executable, "-c", script, "--version"], capture_output=True, text=True)
    version, modules = said.stdout.splitlines()
    assert version == f"holonom {hn.__version__}" and not {"numpy", "holonom"} & set(modules.split())
    for words in (["--version"], ["schema", "joint"], ["check", "none.toml"], ["runn"]):
        module = subprocess.run([sys.executable, "-m", "holonom", *words], capture_output=True, text=True)
        own = program(*words)
        assert (module.stdout, module.stderr, module.returncode) == (own.stdout, own.stderr, own.returncode)
    (tmp_path / "holonom").mkdir()
    (tmp_path / "holonom" / "__init__.py").touch()
    script = f"import sys; sys.path.insert(0, {str(tmp_path)!r}); from holonom_program import main; main()"
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert said.returncode == 1 and "install it again" in said.stderr


ARM = """<mujoco><worldbody><geom type="plane" size="5 5 .1"/><body name="arm" pos="0 0 1">
<joint name="pin" type="hinge" axis="0 1 0" armature="0.2"/><geom name="rod" type="capsule" fromto="0 0 0 .5 0 0" size=".03"/>
</body></worldbody><actuator><position joint="pin" kp="30" kv="2"/></actuator></mujoco>"""


def test_each_option_of_an_import_does_its_own() -> None:
    plain = hn.import_robot(ARM).spec.compile().to_dict()
    for option, section in (("armature", "body"), ("actuators", "joint"), ("contacts", "contact")):
        value = option != "armature"
        other = hn.import_robot(ARM, **{option: value}).spec.compile().to_dict()  # type: ignore[arg-type]
        changed = {key for key in plain.keys() | other.keys() if plain.get(key) != other.get(key)}
        assert section in changed, (option, changed)
        of_others = {"body": {"contact"}, "joint": {"contact", "constraint"}, "contact": {"joint", "constraint"}}[section]
        assert not changed & of_others, (option, changed)
    assert hn.import_robot(ARM, actuators=True).spec.compile().to_dict()["joint"][0]["motor"]["proportional"] == 30.0
