"""Stored gradients, optima and estimates of an independent implementation, from models written here."""

import copy
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


def opened(own: dict[str, Any], coordinates: Array) -> Array:
    """By how much the cut joints are open: places, and axes."""
    at = placed(own, coordinates)
    ground = (np.zeros(3), np.eye(3))
    open_by = []
    for k in own["cut_joints"]:
        joint = own["joints"][k]
        ends = [ground if end < 0 else at[end] for end in (joint["parent"], joint["child"])]
        sides = ("parent", "child")
        stated = [
            np.eye(3) if joint[side] < 0 else np.array(own["bodies"][joint[side]]["directors"])
            for side in sides
        ]
        axis = np.array(joint["axis"])
        axes = [axis, stated[1].T @ stated[0] @ axis]
        points = [
            position + directors @ np.array(joint[f"anchor_{side}"])
            for (position, directors), side in zip(ends, sides, strict=True)
        ]
        open_by += [points[1] - points[0], ends[1][1] @ axes[1] - ends[0][1] @ axes[0]]
    return np.concatenate(open_by)


def closed(own: dict[str, Any]) -> list[float]:
    """The coordinates of the tree at the start: the others follow from those that are given."""
    initial = own["initial"]
    if "independent" not in initial or "consistent_coordinates" in initial:
        values: list[float] = initial.get("consistent_coordinates", initial["coordinates"])
        return values
    tree = [k for k in range(len(own["joints"])) if k not in own["cut_joints"]]
    x = np.zeros(len(tree))
    given = [tree.index(k) for k in initial["independent"]]
    free = [k for k in range(len(tree)) if k not in given]
    x[given] = initial["coordinates"]
    for _ in range(60):
        left = opened(own, x)
        columns = []
        for k in free:
            step = np.zeros(len(tree))
            step[k] = 1e-6
            columns.append((opened(own, x + step) - opened(own, x - step)) / 2e-6)
        x[free] -= np.linalg.lstsq(np.array(columns).T, left, rcond=None)[0]
    assert np.max(np.abs(opened(own, x))) < 1e-14
    found: list[float] = x.tolist()
    return found


def placed(own: dict[str, Any], coordinates: Any = None) -> list[tuple[Array, Array]]:
    """Position and directors of each body at coordinates of the tree, by default the initial ones."""
    bodies, joints = own["bodies"], own["joints"]
    stated = [np.array(body["directors"]) for body in bodies]
    positions = [np.array(body["position"]) for body in bodies]
    found: list[tuple[Array, Array]] = list(zip(positions, stated, strict=True))
    values = iter(closed(own) if coordinates is None else coordinates)
    for k, joint in enumerate(joints):
        if k in own["cut_joints"] or joint["type"] == "F":
            continue
        parent, child = joint["parent"], joint["child"]
        at, axes = (np.zeros(3), np.eye(3)) if parent < 0 else found[parent]
        start = np.eye(3) if parent < 0 else stated[parent]
        anchors = [np.array(joint[side]) for side in ("anchor_parent", "anchor_child")]
        axis = np.array(joint["axis"])
        slid = axis * next(values) if joint["type"] in "PC" else np.zeros(3)
        about = axis * next(values) if joint["type"] in "RC" else np.zeros(3)
        turned = axes @ turn(about) @ start.T @ stated[child]
        found[child] = (at + axes @ (anchors[0] + slid) - turned @ anchors[1], turned)
    return found


KINDS = {"R": "revolute", "P": "prismatic", "C": "cylindrical"}


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
    replay = found["replay"]["deviation"]
    missed = max(end["violation"] for end in found["conditions"])
    print(f"{name}: its run off by {replay:.1e}, conditions by {missed:.1e}")
    assert found.optimal and replay <= 1e-8 and missed <= 1e-10
    assert off <= own["tolerance"]["cost"]
    controls = np.array(own["results"]["controls"])
    assert np.max(np.abs(found.controls - controls)) <= own["tolerance"]["controls"]


def freedoms(own: dict[str, Any]) -> list[tuple[int, int]]:
    """Joint and freedom of each coordinate of the tree."""
    kinds = {"R": 1, "P": 1, "C": 2}
    tree = [k for k in range(len(own["joints"])) if k not in own["cut_joints"]]
    return [(k, freedom) for k in tree for freedom in range(kinds[own["joints"][k]["type"]])]


def begun(own: dict[str, Any]) -> dict[tuple[int, int], float]:
    """What the coordinates of a case are less those of its model at the start: angles of a model
    count from where its bodies are drawn, displacements between anchors do not."""
    slides = {"P": (0,), "C": (0,)}
    return {
        (k, freedom): 0.0 if freedom in slides.get(own["joints"][k]["type"], ()) else value
        for (k, freedom), value in zip(freedoms(own), closed(own), strict=True)
    }


def parameters(own: dict[str, Any], model: dict[str, Any]) -> None:
    """Lets numbers of a model follow the parameters of a case."""
    model["parameters"] = {one["name"]: one["value"] for one in own["parameters"]}
    start = begun(own)
    for one in own["parameters"]:
        for change in one["sets"]:
            name, factor = one["name"], change.get("factor", 1)
            text = f"= {factor}*{name}" if factor != 1 else f"= {name}"
            match change["path"].split("."):
                case ["gravity", k]:
                    model["model"]["gravity"][int(k)] = text
                case ["bodies", body, "mass"]:
                    model["body"][int(body)]["mass"] = text
                case ["bodies", body, "principal_inertia", k]:
                    model["body"][int(body)]["inertia"][int(k)] = text
                case ["joints", joint, side, k]:
                    model["joint"][int(joint)][side][int(k)] = text
                case ["springs", spring, "stiffness"]:
                    model["spring"][int(spring)]["stiffness"] = text
                case ["springs", spring, "rest_length"]:
                    model["spring"][int(spring)]["natural_length"] = text
                case ["springs", spring, ("point_a" | "point_b") as end, k]:
                    key = "point_from" if end == "point_a" else "point_to"
                    model["spring"][int(spring)][key][int(k)] = text
                case ["joint_springs", spring, key]:
                    at = own["joint_springs"][int(spring)]
                    along = (at["joint"], at.get("freedom", 0))
                    shift = f" - {start[along]!r}" if key == "rest" else ""
                    part = model["joint"][along[0]]["spring"]
                    part = part[along[1]] if isinstance(part, list) else part
                    part[key] = text + shift
                case ["joint_dampers", damper, "damping"]:
                    at = own["joint_dampers"][int(damper)]
                    part = model["joint"][at["joint"]]["damper"]
                    part["damping"] = text
                case other:
                    raise AssertionError(other)


def forced(own: dict[str, Any]) -> dict[str, Any]:
    """The mechanism of a case with its springs and dampers."""
    model, start = mechanism(own), begun(own)
    rates = dict(zip(own["initial"].get("independent", []), own["initial"]["rates"], strict=False))
    if "independent" not in own["initial"]:
        of: dict[int, list[float]] = {}
        for (joint, _), rate in zip(freedoms(own), own["initial"]["rates"], strict=True):
            of.setdefault(joint, []).append(rate)
        rates = {joint: own if len(own) > 1 else own[0] for joint, own in of.items()}
    for joint, rate in rates.items():
        model["joint"][joint]["rate"] = rate
    for spring in own.get("joint_springs", []):
        along = (spring["joint"], spring.get("freedom", 0))
        made = {"stiffness": spring["stiffness"], "rest": spring["rest"] - start[along]}
        if model["joint"][along[0]]["type"] == "cylindrical":
            made["freedom"] = along[1]
        model["joint"][along[0]]["spring"] = made
    for damper in own.get("joint_dampers", []):
        made = {"damping": damper["damping"]}
        if model["joint"][damper["joint"]]["type"] == "cylindrical":
            made["freedom"] = damper.get("freedom", 0)
        model["joint"][damper["joint"]]["damper"] = made
    names = [body["name"] for body in own["bodies"]]
    model["spring"] = [
        {
            "name": f"spring{k}",
            "from": "ground" if spring["body_a"] < 0 else names[spring["body_a"]],
            "to": "ground" if spring["body_b"] < 0 else names[spring["body_b"]],
            "point_from": spring["point_a"],
            "point_to": spring["point_b"],
            "stiffness": spring["stiffness"],
            "natural_length": spring["rest_length"],
        }
        for k, spring in enumerate(own.get("springs") or [])
    ]
    model["control"] = [
        {
            "name": f"c{k}",
            "joint": own["joints"][effort["joint"]]["name"],
            "freedom": effort.get("freedom", 0),
        }
        for k, effort in enumerate(own.get("efforts") or [])
    ]
    return copy.deepcopy(model)  # its lists are those of the case


def term(own: dict[str, Any], k: int, model: dict[str, Any]) -> None:
    """Adds a term of the objective of a case, with its sensors."""
    one, start = own["objective"][k], begun(own)
    kind, weight = one["type"], one.get("weight", 1.0)
    place, _, what = kind.partition("_")
    if kind in ("effort", "time"):
        model["objective"].append({"name": f"o{k}", "type": kind, "weight": weight})
    elif what == "momentum":
        model["objective"].append({"name": f"o{k}", "type": "momentum", "weight": weight})
    elif what == "coordinate":
        along = (one["joint"], one.get("freedom", 0))
        name = own["joints"][along[0]]["name"]
        model["sensor"].append({"name": f"s{k}", "type": "joint_coordinate", "of": name})
        several = own["joints"][along[0]]["type"] == "C"
        made = {"name": f"o{k}", "type": "sensor", "weight": weight}
        made["sensor"] = f"s{k}.{along[1]}" if several else f"s{k}"
        made["target"] = one["target"] - start[along]
        made["at"] = "path" if place == "running" else "end"
        model["objective"].append(made)
    elif what == "point":
        body = own["bodies"][one["body"]]["name"]
        at = {"name": f"s{k}", "type": "position", "of": body, "point": one["point"]}
        model["sensor"].append(at)
        for axis, target in zip("xyz", one["target"], strict=True):
            made = {"name": f"o{k}{axis}", "type": "sensor", "sensor": f"s{k}.{axis}"}
            made["at"] = "path" if place == "running" else "end"
            model["objective"].append(made | {"target": target, "weight": weight})
    else:
        raise AssertionError(kind)


def differentiated(own: dict[str, Any]) -> hn.Gradient:
    """The objective of a case of a gradient as a function of all that it has derivatives by."""
    model = forced(own)
    parameters(own, model)
    model["sensor"], model["objective"] = [], []
    for k in range(len(own["objective"])):
        term(own, k, model)
    if "composition" in own:
        model["simulation"]["order"] = own["composition"]["order"]
    names = list(model["parameters"])
    return hn.Gradient(
        hn.Model.from_dict(model),
        parameters=names,
        controls=bool(model["control"]),
        initial=True,
        step=True,
    )


@pytest.mark.parametrize("name", [f"gr0{k}" for k in range(1, 6)])
def test_gradients_are_the_stored_ones(name: str) -> None:
    own = case(name)
    objective, results = differentiated(own), own["results"]
    x = objective.start.copy()
    count, steps = len(own["parameters"]), own["steps"]
    controls = np.array(own.get("controls") or [], dtype=np.float64).reshape(steps, -1)
    x[count : count + controls.size] = controls.T.reshape(-1)
    value, slope = objective(x)
    assert abs(value - results["value"]) <= own["tolerance"]["value"]
    parts = np.split(slope[count:-1], [controls.size])
    initial = np.split(parts[1], 2)
    groups = {
        "parameters": (slope[:count], results["parameters"]),
        "controls": (parts[0].reshape(-1, steps).T, results.get("controls") or []),
        "initial_coordinates": (initial[0], results["initial_coordinates"]),
        "initial_rates": (initial[1], results["initial_rates"]),
        "step": (slope[-1:], [results["step_lengths_sum"]]),
    }
    for group, (found, stored) in groups.items():
        wanted = np.array(stored, dtype=np.float64).reshape(found.shape)
        if wanted.size == 0:
            continue
        size = np.full(wanted.shape, max(float(np.max(np.abs(wanted))), 1e-300))
        if group == "parameters":
            size = np.maximum(np.abs(wanted), 1e-3 * size)
        off = float(np.max(np.abs(found - wanted) / size))
        print(f"{name}: {group} off by {off:.1e}, allowed {own['tolerance']['gradient']:.1e}")
        assert off <= own["tolerance"]["gradient"], group


def test_gradients_along_a_chaotic_motion_are_the_stored_ones() -> None:
    own = case("gr08")
    (last,) = own["objective"]
    model = forced(own)
    body = own["bodies"][last["body"]]["name"]
    sensor = {"name": "tip", "type": "position", "of": body, "point": last["point"]}
    model["sensor"] = [sensor]
    for row in own["results"]["growth"]:
        if abs(row["gradient"]) > 1e7:
            continue
        model["simulation"]["end"] = own["h"] * row["steps"]
        objective = hn.Gradient(hn.Model.from_dict(model), of=["tip.z"], initial=True)
        value, slope = objective(objective.start)
        off = abs(slope[0] / row["gradient"] - 1.0)
        allowed = 1e-12 + 1e-13 * abs(row["gradient"])
        print(f"{row['time']} s: {slope[0]!r}, off by {off:.1e}, allowed {allowed:.1e}")
        assert abs(value - row["height"]) <= 1e-12 + 100.0 * row["double_height_error"]
        assert off <= allowed


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


def test_estimates_of_a_linkage_are_the_stored_ones() -> None:
    own = case("id02")
    model, start = forced(own), begun(own)
    parameters(own, model)
    model["parameters"] = {one["name"]: one["start"] for one in own["parameters"]}
    # efforts that are known: constant in a step
    names = [joint["name"] for joint in own["joints"]]
    del model["control"]
    for k, effort in enumerate(own["efforts"]):
        values = [row[k] for row in own["controls"]]
        history = {"type": "steps", "values": values}
        model["joint"][effort["joint"]]["motor"] = {"effort": 1.0, "history": history}
    data: dict[str, Any] = {"t": None}
    model["sensor"], model["measurement"] = [], []
    for k, one in enumerate(own["measurements"]):
        sensor = {"name": f"s{k}", "type": "joint_coordinate", "of": names[one["joint"]]}
        model["sensor"].append(sensor)
        model["measurement"].append({"sensor": f"s{k}", "sigma": one["sigma"]})
        data["t"] = own["h"] * np.array(one["steps"], dtype=np.float64)
        data[f"s{k}"] = np.array(one["values"]) - start[one["joint"], 0]
    model["identify"] = {"parameters": {name: {} for name in model["parameters"]}}
    found = hn.identify(hn.Model.from_dict(model), data)
    results, tolerance = own["results"], own["tolerance"]
    order = [[one["name"] for one in own["parameters"]].index(name) for name in found.names]
    off = np.abs(found.estimates / np.array(results["estimate"])[order] - 1.0)
    errors = np.abs(found.standard_errors / np.array(results["standard_error"])[order] - 1.0)
    print(f"estimates off by {off}, standard errors by {errors}")
    assert found.converged
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
