"""Reference numbers of MuJoCo for tests/model/imports.rs: mass matrix and joint accelerations of robots at random configurations.

    pip install mujoco numpy
    python reference.py                                          # the files of this folder again
    python reference.py ROBOT [--free] [--armature] [--forces] > FOLDER/NAME.json   # another robot; HOLONOM_IMPORTED=FOLDER for the test

Friction, limits, contact, fluids and equalities are off, armatures too but with --armature, actuators and tendons but with --forces, where
controls are 0; dampers and springs of hinges and slides are on.
"""

import json
import sys
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

HERE = Path(__file__).parent

GYMNASIUM = ("gymnasium", "1.4.0", "MIT")
DM_CONTROL = ("dm_control", "1.0.50", "Apache-2.0")
ROBOTS = ("example-robot-data", "6.0.0", "BSD-2-Clause")

SAFETY = ("safety-gymnasium", "1.0.0", "Apache-2.0")
OWN = ("of this repository", "", "MIT OR Apache-2.0")

# file, whether its base is free, and where it is from
FILES = (
    [(f"gymnasium/{n}.xml", False, GYMNASIUM) for n in ("ant", "half_cheetah", "hopper", "humanoid", "swimmer", "walker2d")]
    + [("gymnasium/inverted_double_pendulum.xml", False, GYMNASIUM)]
    + [(f"dm_control/{n}.xml", False, DM_CONTROL) for n in ("acrobot", "finger", "fish", "quadruped")]
    + [("safety-gymnasium/car.xml", False, SAFETY), ("forms.xml", False, OWN)]
    + [(f"example-robot-data/{n}.urdf", False, ROBOTS) for n in ("double_pendulum_continuous", "solo12")]
    + [(f"example-robot-data/{n}.urdf", True, ROBOTS) for n in ("solo12", "iris")]
    + [("example-robot-data/TwoDofs.urdf", False, ROBOTS[:2] + ("BSD-3-Clause",))]
    + [("example-robot-data/panda.urdf", base, ROBOTS[:2] + ("Apache-2.0",)) for base in (False, True)]
)

MODEL_FLAGS = [
    mujoco.mjtDisableBit.mjDSBL_CONSTRAINT,
    mujoco.mjtDisableBit.mjDSBL_ACTUATION,
]


def plain(model, forces):
    """Switches off what the import does not translate."""
    for flag in MODEL_FLAGS[: 1 if forces else 2]:
        model.opt.disableflags |= flag
    model.opt.density = model.opt.viscosity = 0
    model.opt.wind[:] = 0
    model.body_gravcomp[:] = 0
    for name in ("stiffness", "stiffnesspoly", "damping", "dampingpoly") if not forces else ():
        getattr(model, f"tendon_{name}")[:] = 0
    for name in ("jnt_actgravcomp", "tendon_armature"):
        if hasattr(model, name):
            getattr(model, name)[:] = 0
    for j in range(model.njnt):
        if model.jnt_type[j] == 0:  # springs and dampers of free joints are not translated
            model.jnt_stiffness[j] = 0
            a = model.jnt_dofadr[j]
            model.dof_damping[a : a + 6] = 0


def rates(model, data):
    """What each generalized velocity is: joint, kind, axis and point in space, or the frame of the body."""
    out = []
    for j in range(model.njnt):
        body = model.jnt_bodyid[j]
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_JOINT, j)
        of_body = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_BODY, body)
        kind = ["free", "ball", "slide", "hinge"][model.jnt_type[j]]
        out.append(
            {
                "joint": name,
                "body": of_body,
                "kind": kind,
                "axis": data.xaxis[j].tolist(),
                "anchor": data.xanchor[j].tolist(),
                "frame": data.xmat[body].reshape(3, 3).tolist(),
                "value": float(data.qpos[model.jnt_qposadr[j]]) if kind in ("slide", "hinge") else 0.0,
            }
        )
    return out


def reference(path, free, armature=False, forces=False, seed=1):
    """Mass matrix and accelerations at a random configuration, free bodies and balls at their initial pose."""
    if path.endswith(".urdf"):
        spec = mujoco.MjSpec.from_string(without_geometry(path))
    else:
        spec = mujoco.MjSpec.from_file(path)
    for joint in spec.joints:
        if not armature or joint.type in (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL):
            joint.armature = 0
    model = free_base(spec) if free else spec.compile()
    plain(model, forces)
    data = mujoco.MjData(model)
    random = np.random.default_rng(seed)
    for j in range(model.njnt):
        if model.jnt_type[j] in (2, 3):
            scale = 0.1 if model.jnt_type[j] == 2 else 0.7
            data.qpos[model.jnt_qposadr[j]] += scale * random.uniform(-1, 1)
    followers = follow(model, data)
    data.qvel[:] = random.uniform(-1, 1, model.nv)
    mujoco.mj_forward(model, data)
    mass = np.zeros((model.nv, model.nv))
    try:
        mujoco.mj_fullM(model, mass, data.qM)
    except (TypeError, AttributeError):
        mujoco.mj_fullM(model, data, mass)
    return {
        "mujoco": mujoco.__version__,
        "free_base": free,
        "armature": armature,
        "forces": forces,
        "gravity": model.opt.gravity.tolist(),
        "joints": [r | {"follows": j in followers} for j, r in enumerate(rates(model, data))],
        "velocity": data.qvel.tolist(),
        "mass": mass.tolist(),
        "acceleration": data.qacc.tolist(),
    }


def follow(model, data):
    """Sets joints that follow others by equalities; their numbers."""
    followers = {}
    for e in range(model.neq):
        if model.eq_type[e] == mujoco.mjtEq.mjEQ_JOINT and model.eq_active0[e]:
            followers[int(model.eq_obj1id[e])] = (int(model.eq_obj2id[e]), model.eq_data[e][:5])
    address = model.jnt_qposadr
    for _ in followers:
        for joint, (other, c) in followers.items():
            x = data.qpos[address[other]] - model.qpos0[address[other]] if other >= 0 else 0.0
            data.qpos[address[joint]] = model.qpos0[address[joint]] + np.polyval(c[::-1], x)
    return set(followers)


def without_geometry(path):
    """A URDF without visuals and collisions: their meshes are elsewhere, and links without mass would get a mass from them."""
    tree = ElementTree.parse(path)
    for link in tree.getroot().findall("link"):
        for part in link.findall("visual") + link.findall("collision"):
            link.remove(part)
    return ElementTree.tostring(tree.getroot(), encoding="unicode")


def free_base(spec):
    """The model with a free joint at its root link."""
    spec.compiler.fusestatic = False
    root = spec.worldbody.first_body()
    root.add_freejoint()
    return spec.compile()


def write_all():
    """The numbers of all files of this folder."""
    for file, free, origin in FILES:
        write(file, free, False, origin)
    for name in ("half_cheetah", "humanoid", "ant", "swimmer"):
        write(f"gymnasium/{name}.xml", False, True, GYMNASIUM)
    for name in ("fish", "quadruped"):
        write(f"dm_control/{name}.xml", False, False, DM_CONTROL, forces=True)
    write("forces.xml", False, False, OWN, forces=True)


def write(file, free, armature, origin, forces=False):
    """The numbers of a file of this folder."""
    package, version, licence = origin
    numbers = {"file": file, "package": package, "version": version, "licence": licence}
    numbers |= reference(str(HERE / file), free, armature, forces)
    marks = ("_free", free), ("_armature", armature), ("_forces", forces)
    name = Path(file).stem + "".join(mark for mark, holds in marks if holds and not file.startswith(mark[1:]))
    rows = ",\n".join(f" {json.dumps(key)}: {json.dumps(value)}" for key, value in numbers.items())
    (HERE / f"{name}.json").write_text("{\n" + rows + "\n}\n")


if __name__ == "__main__":
    arguments = [a for a in sys.argv[1:] if not a.startswith("--")]
    if arguments:
        file = str(Path(arguments[0]).resolve())
        print(json.dumps({"file": file} | reference(file, *(f"--{word}" in sys.argv for word in ("free", "armature", "forces")))))
    else:
        write_all()
