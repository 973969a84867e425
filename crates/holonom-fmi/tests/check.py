"""Units in FMPy: valid, equal to the program bit for bit, states, messages."""

import csv
import sys
from pathlib import Path

import numpy as np
from fmpy import extract, read_model_description, simulate_fmu
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave
from fmpy.validation import validate_fmu

folder = Path(sys.argv[1])


def table(name: str) -> dict[str, np.ndarray]:
    with open(folder / name / "sensors.csv", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    return {column: np.array([float(row[k]) for row in rows[1:]]) for k, column in enumerate(rows[0])}


def same(a: np.ndarray, b: np.ndarray) -> bool:
    return a.shape == b.shape and bool(np.all(a.view(np.int64) == b.view(np.int64)))


for version in ("2", "3"):
    unit = str(folder / f"arms{version}.fmu")
    problems = validate_fmu(unit)
    assert not problems, problems
    description = read_model_description(unit)
    variables = {own.name: own for own in description.modelVariables}
    assert description.fmiVersion == f"{version}.0"
    assert variables["elbow.effort"].unit == "N·m" and variables["elbow.effort"].causality == "input"
    assert variables["parameters.mass"].start == "1.5" and variables["elbow.effort"].start == "0.0"
    assert variables["'end point'.x"].unit == "m"
    outputs = [own.name for own in description.modelVariables if own.causality == "output"]

    # equal to the program, with the parameters of the file and with others
    expected = table("run")
    step, end = float(description.defaultExperiment.stepSize), 1.0
    whole = simulate_fmu(unit, stop_time=end, output_interval=step, output=outputs)
    assert len(whole) == 1001 and same(whole["time"], expected["t"])
    columns = {"'end point'.x": "end point.x", "angle": "angle", "bearing.fz": "bearing.fz", "elbow_rate": "elbow_rate"}
    for name, column in columns.items():
        assert same(whole[name], expected[column]), name
    assert np.abs(whole["residual.position"]).max() < 1e-12
    third = simulate_fmu(unit, stop_time=end, output_interval=4 * step, output=outputs)
    assert same(third["angle"], np.ascontiguousarray(expected["angle"][::4]))
    other = simulate_fmu(unit, stop_time=end, output_interval=step, start_values={"parameters.mass": 2.5})
    assert same(other["angle"], table("heavy")["angle"]) and not same(other["angle"], expected["angle"])

    # states and messages
    said: list[str] = []
    place = extract(unit)
    kind = FMU2Slave if version == "2" else FMU3Slave
    slave = kind(guid=description.guid, unzipDirectory=place, modelIdentifier="holonom", instanceName="arms")
    reference = {name: own.valueReference for name, own in variables.items()}
    if version == "2":
        from fmpy.fmi2 import (fmi2CallbackAllocateMemoryTYPE, fmi2CallbackFreeMemoryTYPE, fmi2CallbackFunctions,
                               fmi2CallbackLoggerTYPE)

        def hear(_: object, name: bytes, status: int, category: bytes, message: bytes) -> None:
            said.append(f"{status} {category.decode()} {message.decode()}")

        callbacks = fmi2CallbackFunctions()
        callbacks.logger = fmi2CallbackLoggerTYPE(hear)
        slave.instantiate(callbacks=callbacks)
        slave.setupExperiment(startTime=0.0)
        slave.enterInitializationMode()
        get = lambda name: slave.getReal([reference[name]])[0]
        set_ = lambda name, value: slave.setReal([reference[name]], [value])
        save, load = slave.getFMUState, slave.setFMUState
    else:
        slave.instantiate(logMessage=lambda _, status, category, message: said.append(f"{status} {category.decode()} {message.decode()}"))
        slave.enterInitializationMode(startTime=0.0)
        get = lambda name: slave.getFloat64([reference[name]])[0]
        set_ = lambda name, value: slave.setFloat64([reference[name]], [value])
        save, load = slave.getFMUState, slave.setFMUState
    slave.exitInitializationMode()
    step_ = lambda t: slave.doStep(currentCommunicationPoint=t, communicationStepSize=step)
    for n in range(5):
        step_(n * step)
    set_("elbow.effort", 3.0)
    state = save()
    step_(5 * step)
    ahead = get("angle")
    load(state)
    step_(5 * step)
    assert get("angle") == ahead
    data = slave.serializeFMUState(state) if version == "3" else slave.serializeFMUstate(state)
    back = slave.deserializeFMUState(data) if version == "3" else slave.deSerializeFMUstate(data)
    load(back)
    assert get("elbow.effort") == 3.0
    try:
        set_("elbow.effort", float("nan"))
    except Exception:
        pass
    else:
        raise AssertionError("NaN was taken")
    assert any("`elbow.effort`: NaN is not finite" in words for words in said), said
    slave.terminate()
    slave.freeInstance()
    print(f"FMI {version}.0: {len(description.modelVariables)} variables, {len(whole)} nodes with equal bits; {said[-1]}")

# a force on a body that is zero changes round-off alone; one that is not pushes
pushed = str(folder / "pushed3.fmu")
assert not validate_fmu(pushed)
still = simulate_fmu(pushed, stop_time=end, output_interval=step)
assert np.abs(still["angle"] - table("run")["angle"]).max() < 1e-13
up = simulate_fmu(pushed, stop_time=end, output_interval=step, start_values={"lower.force.z": 1.0})
assert up["'end point'.z"][200] > still["'end point'.z"][200] + 1e-3
