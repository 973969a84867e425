"""A tree in MuJoCo has the motion of ours, to the errors of both steps."""

import numpy as np
import pytest

import holonom as hn
from holonom.peers import mujoco as peer

TREE = """
model = { name = "tree", gravity = [0.3, 0.0, -9.81] }
simulation = { step = 0.0005, end = 0.5 }
[[body]]
name = "base"
mass = 2.0
inertia = [[0.05, 0.001, 0.0], [0.001, 0.06, 0.002], [0.0, 0.002, 0.07]]
position = [0.2, 0.0, 0.1]
quaternion = [0.9, 0.1, 0.3, 0.3]
[[body]]
name = "arm"
mass = 1.0
inertia = [0.01, 0.02, 0.02]
position = [0.6, 0.1, 0.0]
[[body]]
name = "slider"
mass = 0.3
inertia = [0.001, 0.002, 0.003]
position = [0.9, 0.0, 0.0]
[[joint]]
name = "turn"
type = "revolute"
parent = "ground"
child = "base"
position = [0.0, 0.0, 0.0]
axis = [0.2, 0.1, 1.0]
rate = 1.0
damper = { damping = 0.1 }
[[joint]]
name = "hinge"
type = "revolute"
parent = "base"
child = "arm"
position = [0.4, 0.0, 0.0]
axis = [0.0, 1.0, 0.3]
motor = { effort = 0.7 }
[[joint]]
name = "slide"
type = "prismatic"
parent = "arm"
child = "slider"
position = [0.9, 0.0, 0.0]
axis = [1.0, 0.0, 0.0]
spring = { stiffness = 30.0 }
"""
SENSORS = "".join(f'[[sensor]]\nname = "x_{n}"\ntype = "joint_coordinate"\nof = "{n}"\n' for n in ("turn", "hinge", "slide"))


def test_a_tree_moves_as_in_mujoco() -> None:
    pytest.importorskip("mujoco")
    model = hn.Model.from_toml(TREE + SENSORS)
    theirs = peer.run(model)
    errors = []
    for step in (5e-4, 2.5e-4):
        ours = hn.simulate(model, step=step, every=round(5e-4 / step))
        apart = [np.abs(ours.sensors[f"x_{name}"] - theirs.joints[name]).max() for name in theirs.joints]
        errors.append(max(apart))
    print(f"apart by {errors}")
    assert errors[0] < 1e-4 and errors[0] / errors[1] > 3.0  # ours is of order 2, theirs of 4


def test_the_text_has_every_body_and_joint() -> None:
    text = peer.mjcf(hn.Model.from_toml(TREE))
    for name in ("base", "arm", "slider", "turn", "hinge", "slide"):
        assert f'name="{name}"' in text
    back = hn.Model.from_toml(TREE)
    assert text.count("<body ") == len(back.bodies) and "diaginertia" in text


@pytest.mark.parametrize("more, words", [
    ('[[spring]]\nname = "s"\nfrom = "base"\nto = "slider"\nstiffness = 1.0\n', r"\[\[spring\]\]"),
    ('[[joint]]\nname = "back"\ntype = "spherical"\nparent = "slider"\nchild = "ground"\nposition = [0.9, 0.0, 0.0]\n', "closes a loop"),
    ('[[body]]\nname = "b"\nmass = 1.0\ninertia = [1.0, 1.0, 1.0]\nvelocity = [1.0, 0.0, 0.0]\n', "initial velocity"),
])
def test_what_has_no_counterpart_is_refused(more: str, words: str) -> None:
    text = TREE if "back" not in more else TREE.replace("rate = 1.0\n", "")
    with pytest.raises(hn.AnalysisFailed, match=words):
        peer.mjcf(hn.Model.from_toml(text + more))
