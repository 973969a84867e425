"""A tree of bodies in MuJoCo, from our own model. It needs the package ``mujoco``.

::

    peer = holonom.peers.mujoco.run(model, step=1e-3)
    peer.t, peer.joints["elbow"]              # (K,), (K,)

Rigid bodies, revolute, prismatic, spherical and fixed joints in a tree, gravity, springs, dampers
and constant motors of joints. What MuJoCo has no counterpart for is refused by name.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree

import numpy as np

from .._errors import AnalysisFailed, needed
from .._model import model_of
from .._stepper import Stepper

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

KINDS = {"revolute": "hinge", "prismatic": "slide", "spherical": "ball", "fixed": ""}


@dataclass(frozen=True)
class Peer:
    """A run of MuJoCo.

    Attributes
    ----------
    t : times, s, shape ``(K,)``.
    joints : coordinates of revolute and prismatic joints by their names, rad or m, shape ``(K,)``.
    text : the MJCF that was run.
    """

    t: Array
    joints: dict[str, Array]
    text: str


def mjcf(model: Any, *, step: float | None = None) -> str:
    """The model as MJCF: its bodies where they begin, joints by their places and axes.

    Parameters
    ----------
    model : as of :func:`holonom.simulate`.
    step : s; by default that of the model.

    Returns
    -------
    str

    Raises
    ------
    AnalysisFailed
        For what has no counterpart.
    """
    whole = model_of(model)
    sections = whole.to_dict()
    other = [name for name in sections if name not in ("model", "simulation", "body", "joint", "sensor")]
    other = [name for name in other if sections[name]]
    if other:
        raise AnalysisFailed(f"in MuJoCo there is no counterpart of [[{other[0]}]]")
    start = Stepper(whole)
    members = dict.fromkeys(column.rsplit(".", 1)[0] for column in start.columns)
    found = start.q.reshape(len(members), 12)  # position, then directors
    frames = {name: (own[:3], own[3:].reshape(3, 3).T) for name, own in zip(members, found, strict=True)}
    root = ElementTree.Element("mujoco")
    ElementTree.SubElement(root, "compiler", angle="radian", autolimits="true")
    gravity = _text(sections["model"].get("gravity") or [0.0, 0.0, 0.0])
    settings = {"timestep": repr(step or whole.settings["step"]), "gravity": gravity, "integrator": "RK4"}
    option = ElementTree.SubElement(root, "option", settings)
    ElementTree.SubElement(option, "flag", contact="disable")
    world = ElementTree.SubElement(root, "worldbody")
    actuators = ElementTree.SubElement(root, "actuator")
    places = {"ground": (world, np.zeros(3), np.eye(3))}
    bodies = {body["name"]: body for body in sections.get("body", [])}
    joints = list(sections.get("joint", []))
    while joints:
        ready = [j for j in joints if (j["parent"] in places) != (j["child"] in places)]
        if not ready:
            break
        for joint in ready:
            parent, child = joint["parent"], joint["child"]
            if parent in places and child in places:
                continue
            joints.remove(joint)
            turned = child in places
            if turned:
                parent, child = child, parent
            element = _body(places[parent], child, bodies, frames)
            places[child] = (element, *frames[child])
            _joint(element, joint, frames[child], turned, actuators)
    if joints:
        raise AnalysisFailed(f"the joint `{joints[0]['name']}` closes a loop: trees alone are compared")
    for name in bodies:
        if name not in places:
            element = _body(places["ground"], name, bodies, frames)
            ElementTree.SubElement(element, "freejoint")
            places[name] = (element, *frames[name])
    return ElementTree.tostring(root, encoding="unicode")


def run(model: Any, *, step: float | None = None) -> Peer:
    """Runs a tree in MuJoCo, from the start of the model to its end.

    Parameters
    ----------
    model : as of :func:`holonom.simulate`.
    step : of MuJoCo's Runge–Kutta method of order 4, s; by default that of the model.

    Returns
    -------
    Peer

    Raises
    ------
    AnalysisFailed
        For what has no counterpart.
    """
    mujoco = needed("mujoco", "peers")
    whole = model_of(model)
    text = mjcf(whole, step=step)
    peer = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(peer)
    measured = [j for j in whole.joints.values() if j["type"] in ("revolute", "prismatic")]
    for joint in whole.joints.values():
        rate = np.atleast_1d(np.asarray(joint.get("rate") or 0.0, dtype=np.float64))
        if rate.any():
            if joint["type"] not in ("revolute", "prismatic"):
                raise AnalysisFailed(f"the rate of `{joint['name']}` has no counterpart")
            data.qvel[peer.joint(joint["name"]).dofadr[0]] = rate[0]
    count = round(whole.settings["end"] / peer.opt.timestep)
    rows = np.empty((count + 1, len(measured)))
    for k in range(count + 1):
        rows[k] = [data.joint(joint["name"]).qpos[0] for joint in measured]
        if k < count:
            mujoco.mj_step(peer, data)
    times = np.arange(count + 1) * peer.opt.timestep
    return Peer(times, {joint["name"]: rows[:, k] for k, joint in enumerate(measured)}, text)


def _body(
    parent: tuple[ElementTree.Element, Array, Array],
    name: str,
    bodies: dict[str, Any],
    frames: dict[str, tuple[Array, Array]],
) -> ElementTree.Element:
    if name not in bodies:
        raise AnalysisFailed(f"`{name}` is no body")
    element, x, r = parent
    own_x, own_r = frames[name]
    place = {"name": name, "pos": _text(r.T @ (own_x - x)), "quat": _text(_quaternion(r.T @ own_r))}
    found = ElementTree.SubElement(element, "body", place)
    body = bodies[name]
    if any(np.any(body.get(key, 0.0)) for key in ("velocity", "angular_velocity")):
        raise AnalysisFailed(f"`{name}` has an initial velocity: state rates of joints")
    if body.get("inertia") is None or body.get("mass") is None:
        raise AnalysisFailed(f"`{name}` has its mass from a shape: state `mass` and `inertia`")
    moments = np.asarray(body["inertia"], dtype=np.float64)
    if moments.ndim == 2:  # directors are principal axes
        if any(body.get(key) is not None for key in ("euler", "matrix", "rotation_vector")):
            raise AnalysisFailed(f"state the orientation of `{name}` by `quaternion`")
        turned = own_r.T @ _rotation(body.get("quaternion", [1.0, 0.0, 0.0, 0.0]))
        moments = np.diag(turned @ moments @ turned.T)
    mass = {"pos": "0 0 0", "mass": repr(float(body["mass"])), "diaginertia": _text(moments)}
    ElementTree.SubElement(found, "inertial", mass)
    return found


def _joint(
    element: ElementTree.Element,
    joint: dict[str, Any],
    frame: tuple[Array, Array],
    turned: bool,
    actuators: ElementTree.Element,
) -> None:
    kind = joint["type"]
    if kind not in KINDS:
        raise AnalysisFailed(f"`{joint['name']}`: a {kind} joint has no counterpart")
    if not KINDS[kind]:
        return
    x, r = frame
    if joint.get("position") is None:
        raise AnalysisFailed(f"`{joint['name']}` is not placed by `position`")
    keys = {"name": joint["name"], "type": KINDS[kind]}
    keys["pos"] = _text(r.T @ (np.asarray(joint["position"], dtype=np.float64) - x))
    if kind != "spherical":
        axis = np.asarray(joint["axis"], dtype=np.float64)
        keys["axis"] = _text((-1.0 if turned else 1.0) * (r.T @ (axis / np.linalg.norm(axis))))
    spring, damper, motor = (joint.get(key) or {} for key in ("spring", "damper", "motor"))
    if spring:
        keys.update(stiffness=repr(float(spring["stiffness"])), springref=repr(float(spring.get("rest", 0.0))))
    if damper:
        keys["damping"] = repr(float(damper["damping"]))
    ElementTree.SubElement(element, "joint", keys)
    if motor:
        if motor.get("proportional") or motor.get("derivative") or motor.get("history"):
            raise AnalysisFailed(f"the motor of `{joint['name']}` has no counterpart")
        force = {"joint": joint["name"], "biastype": "affine", "biasprm": _text([float(motor["effort"]), 0.0, 0.0])}
        ElementTree.SubElement(actuators, "general", force)


def _rotation(quaternion: Any) -> Array:
    """The rotation matrix of a unit quaternion ``w, x, y, z``."""
    w, *rest = (float(part) for part in np.asarray(quaternion) / np.linalg.norm(quaternion))
    v = np.array(rest)
    cross = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
    found: Array = (w * w - v @ v) * np.eye(3) + 2.0 * np.outer(v, v) + 2.0 * w * cross
    return found


def _quaternion(r: Array) -> Array:
    """Unit quaternion ``w, x, y, z`` of a rotation, by the eigenvector of the largest eigenvalue."""
    k = np.array([
        [r[0, 0] + r[1, 1] + r[2, 2], r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]],
        [0.0, r[0, 0] - r[1, 1] - r[2, 2], r[0, 1] + r[1, 0], r[0, 2] + r[2, 0]],
        [0.0, 0.0, r[1, 1] - r[0, 0] - r[2, 2], r[1, 2] + r[2, 1]],
        [0.0, 0.0, 0.0, r[2, 2] - r[0, 0] - r[1, 1]],
    ])
    found: Array = np.linalg.eigh(k, UPLO="U")[1][:, -1]
    return found


def _text(numbers: Any) -> str:
    return " ".join(repr(float(number)) for number in numbers)
