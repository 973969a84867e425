"""Stored optima and estimates of an independent implementation, from models written here."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import ROOT
from numpy.typing import NDArray

import holonom as hn

CASES = ROOT / "tests" / "reference" / "control"
Array = NDArray[np.float64]


def case(name: str) -> dict[str, Any]:
    """The case of this name."""
    text = next(CASES.glob(f"{name}_*.json")).read_text(encoding="utf-8")
    own: dict[str, Any] = json.loads(text)
    return own


def turn(vector: Array) -> Array:
    """The rotation of a rotation vector, shape (3, 3)."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turned: Array = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return turned


def placed(own: dict[str, Any]) -> list[tuple[Array, Array]]:
    """Position and directors of each body at the initial coordinates."""
    bodies, joints = own["bodies"], own["joints"]
    stated = [np.array(body["directors"]) for body in bodies]
    positions = [np.array(body["position"]) for body in bodies]
    found: list[tuple[Array, Array]] = list(zip(positions, stated, strict=True))
    initial = own["initial"]
    values = iter(initial.get("consistent_coordinates", initial["coordinates"]))
    for k, joint in enumerate(joints):
        if k in own["cut_joints"] or joint["type"] == "F":
            continue
        parent, child = joint["parent"], joint["child"]
        at, axes = (np.zeros(3), np.eye(3)) if parent < 0 else found[parent]
        start = np.eye(3) if parent < 0 else stated[parent]
        anchors = [np.array(joint[side]) for side in ("anchor_parent", "anchor_child")]
        axis, value = np.array(joint["axis"]), next(values)
        about = axis * value if joint["type"] == "R" else np.zeros(3)
        turned = axes @ turn(about) @ start.T @ stated[child]
        slid = axis * value if joint["type"] == "P" else np.zeros(3)
        found[child] = (at + axes @ (anchors[0] + slid) - turned @ anchors[1], turned)
    return found


KINDS = {"R": "revolute", "P": "prismatic"}


def mechanism(own: dict[str, Any]) -> dict[str, Any]:
    """Bodies and joints of a case at its start, as a model file has them."""
    names = [body["name"] for body in own["bodies"]]
    bodies = [
        {
            "name": body["name"],
            "mass": body["mass"],
            "inertia": body["principal_inertia"],
            "position": position.tolist(),
            "matrix": axes.tolist(),
        }
        for body, (position, axes) in zip(own["bodies"], placed(own), strict=True)
    ]
    at = placed(own)
    independent = own["initial"].get("independent")
    rates = own["initial"]["rates"]
    joints: list[dict[str, Any]] = []
    for k, joint in enumerate(own["joints"]):
        if joint["type"] == "F":
            continue
        ends = ["ground" if end < 0 else names[end] for end in (joint["parent"], joint["child"])]
        axes = np.eye(3) if joint["parent"] < 0 else at[joint["parent"]][1]
        made: dict[str, Any] = {
            "name": joint["name"],
            "type": KINDS[joint["type"]],
            "parent": ends[0],
            "child": ends[1],
            "axis": (axes @ np.array(joint["axis"])).tolist(),
            "anchor_parent": joint["anchor_parent"],
            "anchor_child": joint["anchor_child"],
        }
        if k in own["cut_joints"]:
            made["cut"] = True
        if independent is not None and k in independent:
            made["rate"] = rates[independent.index(k)]
        for damper in own.get("joint_dampers", []):
            if damper["joint"] == k:
                made["damper"] = {"damping": damper["damping"]}
        joints.append(made)
    steps = {"step": own["h"], "end": own["h"] * own["steps"], "project_start": True}
    head = {"name": own["name"], "gravity": own["gravity"]}
    return {"model": head, "simulation": steps, "body": bodies, "joint": joints}


def wanted(own: dict[str, Any]) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Sensors and conditions of a case."""
    joints, start = own["joints"], own["initial"]["coordinates"]
    sensors, conditions = [], []
    for k, joint in enumerate(joints):
        if joint["type"] in KINDS and k not in own["cut_joints"]:
            sensors.append({"name": f"s{k}", "type": "joint_coordinate", "of": joint["name"]})
    free = [end for end in own["terminal"]["coordinates"] if joints[end["joint"]]["type"] == "F"]
    for end in own["terminal"]["coordinates"]:
        if end not in free:
            k = end["joint"]
            begun = start[k] if k < len(start) else 0.0
            name = f"end of {k}"
            conditions.append({"name": name, "sensor": f"s{k}", "equals": end["value"] - begun})
    if free:
        # an attitude by the quaternion of its rotation vector
        vector = np.array([end["value"] for end in free])
        angle = float(np.linalg.norm(vector))
        parts = np.sin(0.5 * angle) * vector / angle
        body = own["bodies"][joints[free[0]["joint"]]["child"]]["name"]
        sensors.append({"name": "attitude", "type": "orientation", "of": body})
        for part, value in zip("xyz", parts.tolist(), strict=True):
            name, sensor = f"end of {part}", f"attitude.{part}"
            conditions.append({"name": name, "sensor": sensor, "equals": value})
    for bound in own.get("coordinate_bounds", []):
        k = bound["joint"]
        by = {"min": bound["min"] - start[k], "max": bound["max"] - start[k]}
        conditions.append({"name": f"path of {k}", "sensor": f"s{k}", "at": "path", **by})
    stop: dict[str, Any] = {"name": "stop", "type": "rest"}
    if own["terminal"]["rest"] != "all":
        stop["of"] = [joints[end["joint"]]["name"] for end in own["terminal"]["rest"]]
    return sensors, [*conditions, stop]


def searched(own: dict[str, Any]) -> hn.Model:
    """The model of a case of optimal control."""
    model = mechanism(own)
    model["sensor"], model["condition"] = wanted(own)
    bounds = {bound["control"]: bound for bound in own.get("control_bounds", [])}
    model["control"] = [
        {"name": f"c{k}", "joint": own["joints"][effort["joint"]]["name"]}
        | {side: bounds[k][side] for side in ("min", "max") if k in bounds}
        for k, effort in enumerate(own["efforts"])
    ]
    model["objective"] = [
        {"name": f"o{k}", "type": term["type"], "weight": term.get("weight", 1.0)}
        | ({"controls": [f"c{c}" for c in term["controls"]]} if "controls" in term else {})
        for k, term in enumerate(own["objective"])
    ]
    if "free_time" in own:
        model["simulation"]["end"] = own["free_time"]["guess"]
        model["simulation"]["step"] = own["free_time"]["guess"] / own["steps"]
        model["optimize"] = {"time": own["free_time"]}
    return hn.Model.from_dict(model)


@pytest.mark.parametrize("name", [f"oc0{k}" for k in range(1, 10)])
def test_optima_are_the_stored_ones(name: str) -> None:
    own = case(name)
    try:
        found = hn.optimize(searched(own))
    except hn.InvalidModel as error:
        assert "--features optimize" in str(error)
        pytest.skip("the package is built without its feature `optimize`")
    off = abs(found.cost - own["results"]["cost"])
    print(f"{name}: {found.cost!r}, off by {off:.1e}, allowed {own['tolerance']['cost']:.1e}")
    assert found.optimal
    assert off <= own["tolerance"]["cost"]
    controls = np.array(own["results"]["controls"])
    assert np.max(np.abs(found.controls - controls)) <= own["tolerance"]["controls"]


def fitted(own: dict[str, Any]) -> tuple[hn.Model, dict[str, Array]]:
    """The pendulum of a case of identification, and its data."""
    model = mechanism(own)
    (position, _), (measured,) = placed(own)[0], own["measurements"]
    along = position / np.linalg.norm(position)
    values = {parameter["name"]: parameter["start"] for parameter in own["parameters"]}
    model["parameters"] = values
    body, joint = model["body"][0], model["joint"][0]
    body["position"] = [f"= {x!r}*centre" for x in along.tolist()]
    if "inertia" in values:
        body["inertia"] = [body["inertia"][0], "= inertia", body["inertia"][2]]
    joint["anchor_child"] = ["= -centre", 0.0, 0.0]
    joint["damper"] = {"damping": "= damping"}
    model["sensor"] = [{"name": "angle", "type": "joint_coordinate", "of": joint["name"]}]
    model["measurement"] = [{"sensor": "angle", "sigma": measured["sigma"]}]
    model["identify"] = {"parameters": {name: {} for name in values}}
    start = own["initial"]["coordinates"][0]
    data = {
        "t": own["h"] * np.array(measured["steps"], dtype=np.float64),
        "angle": np.array(measured["values"]) - start,
    }
    return hn.Model.from_dict(model), data


def test_estimates_are_the_stored_ones() -> None:
    own = case("id01")
    found = hn.identify(*fitted(own))
    results, tolerance = own["results"], own["tolerance"]
    order = [("damping", "centre").index(name) for name in found.names]
    off = np.abs(found.estimates / np.array(results["estimate"])[order] - 1.0)
    errors = np.abs(found.standard_errors / np.array(results["standard_error"])[order] - 1.0)
    print(f"estimates off by {off}, standard errors by {errors}")
    assert found.converged and found.names == ["centre", "damping"]
    assert np.max(off) <= tolerance["estimate_relative"]
    assert np.max(errors) <= tolerance["standard_error_relative"]


def test_what_the_data_do_not_see_is_named() -> None:
    own = case("id04")
    found = hn.identify(*fitted(own))
    assert not found.converged
    (unseen,) = found["unseen"]
    parts = dict(unseen["parts"])
    # (I + m c²)/c and d/c decide the motion: δI/I = (I − m c²)/I δc/c, δd/d = δc/c
    at = dict(zip(found.names, found.estimates.tolist(), strict=True))
    inertia, centre = at["inertia"], at["centre"]
    wanted = (inertia - own["bodies"][0]["mass"] * centre**2) / inertia
    print(parts, wanted)
    assert abs(parts["damping"] / parts["centre"] - 1.0) < 1e-6
    assert abs(parts["inertia"] / parts["centre"] / wanted - 1.0) < 1e-4
