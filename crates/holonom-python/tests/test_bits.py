"""The same bits as the program, whichever way a model is run; a folder read back is the arrays."""

import copy
import pickle
import time
import warnings
from pathlib import Path

import numpy as np
import pytest
from conftest import DOUBLE, MODELS, program

import holonom as hn
from holonom import _core

STEPS = 12
MOVING = [path for path in MODELS if 'scheme = "static"' not in path.read_text()]


def equal(a: hn.Result, b: hn.Result) -> None:
    assert np.array_equal(a.t, b.t) and np.array_equal(a.step, b.step)
    assert set(a.tables) == set(b.tables)
    for name, table in a.tables.items():
        other = b.tables[name]
        if name == "q":  # a file may leave columns out
            values = np.stack([table[column] for column in other.columns], axis=1) if other.columns else other.values
        else:
            assert table.columns == other.columns, name
            values = table.values
        assert np.array_equal(values, other.values, equal_nan=True), name
    assert set(a.beams) == set(b.beams)
    for name, beam in a.beams.items():
        assert np.array_equal(beam.values, b.beams[name].values), name
        assert np.array_equal(beam.s, b.beams[name].s) and np.array_equal(beam.element, b.beams[name].element)


@pytest.mark.parametrize("path", MODELS, ids=lambda path: path.stem)
def test_arrays_files_and_steps_are_equal(path: Path, tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        model = hn.load(path)
        static = model.settings["scheme"] == "static"
        end = model.settings["end"] if static else STEPS * model.settings["step"]
        model = model.replace({"simulation.end": end, "simulation.every": 1})
        result = hn.simulate(model)
        written = hn.simulate(model, out=tmp_path / "run")
        stepped = [] if static else [f"simulation.end={end!r}"]
        words = ["run", str(path), "-o", str(tmp_path / "program"), "-q"]
        for value in [*stepped, "simulation.every=1"]:
            words += ["--set", value]
        assert _core.main(["holonom", *words], "") == 0
    equal(result, written)
    resumed = interrupted(model, tmp_path / "resumed")
    assert (resumed is None) == static
    if resumed is not None:
        equal(result, resumed)
    for file in (tmp_path / "run").glob("*.csv"):
        assert file.read_bytes() == (tmp_path / "program" / file.name).read_bytes(), file.name
    assert pickle.loads(pickle.dumps(model)) == model
    if static:
        return
    stepper = hn.Stepper(model)
    for row in result.q:
        assert np.array_equal(stepper.q, row)
        if stepper.n == len(result) // 2:  # a state that travels goes on bit for bit
            stepper = pickle.loads(pickle.dumps(stepper))
        if stepper.n < len(result) - 1:
            stepper.step()
    steps = len(result) - 1
    run = hn.Stepper(model).run(np.empty((steps, 0)))
    assert np.array_equal(run.q, result.q) and np.array_equal(run.t, result.t)
    ensemble = hn.Ensemble(model, 2, threads=2)
    ensemble.step(n=steps)
    assert np.array_equal(ensemble.q, [result.q[-1]] * 2)
    for threads in (1, 2):
        found = hn.rollout(model, set=[{}, {}], steps=steps, threads=threads)
        assert np.array_equal(found.q, [result.q] * 2) and not found.failures


def interrupted(model: hn.Model, folder: Path) -> hn.Result | None:
    """A run with files that was stopped after its first steps and went on; ``None`` where it cannot."""

    def stop(step: int, _of: int) -> None:
        if step > 0:
            raise KeyboardInterrupt
        time.sleep(0.06)  # so that it is called again after the next step

    with pytest.raises(KeyboardInterrupt) as stopped, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        hn.simulate(model, out=folder, progress=stop)
    (words,) = stopped.value.__notes__
    if "equilibria have no checkpoints" in words:
        return None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return hn.simulate(None, resume=folder)


def law(t: float, x: float, v: float) -> tuple[float, float, float]:
    """A law that a state does not hold."""
    return -0.05 * x - 0.02 * v, -0.05, -0.02


def push(t: float, body: hn.BodyState) -> np.ndarray:
    """A force that a state does not hold."""
    return -1e-4 * body.velocity


@pytest.mark.parametrize("path", MOVING, ids=lambda path: path.stem)
def test_a_state_with_inputs_and_laws_travels(path: Path) -> None:
    """Pickled, copied, set: on every model that moves, with a law and an input of a joint and a force
    of a body, or a function and an input of what it has in their place."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        stepper = acted(hn.load(path))
        held = 1e-3 * np.arange(1.0, 1.0 + len(stepper.held))
        stepper.step(held, n=4)
        kept, others = stepper.state, [copy.deepcopy(stepper), pickle.loads(pickle.dumps(stepper))]
        stepper.step(n=4)
        there = stepper.q
        for other in others:
            assert np.array_equal(other.held, held)
            other.step(n=4)
            assert np.array_equal(other.q, there)
        stepper.step(-held, n=2)
        stepper.state = kept
        assert stepper.n == 4 and np.array_equal(stepper.held, held)
        stepper.step(n=4)
        assert np.array_equal(stepper.q, there)


def acted(model: hn.Model) -> hn.Stepper:
    """With an input and a law on the first joint that takes them, and a force on the first body, node
    or point mass."""
    members = [*model.bodies, *(f"{beam}.end" for beam in model.beams), *model.particles]
    bodies = [f"{name}.force" for name in members[:1]]
    for joint in model.joints:
        try:
            return hn.Stepper(model, [joint, *bodies], laws={joint: law})
        except hn.HolonomError:
            continue
    for member in members:
        try:
            return hn.Stepper(model, [f"{member}.force"], forces={member: push})
        except hn.HolonomError:
            continue
    raise AssertionError("nothing acts on it from outside")


def test_the_program_and_an_interrupted_run_give_the_same_files(tmp_path: Path) -> None:
    file = tmp_path / "double.toml"
    file.write_text(DOUBLE)
    said = program("run", str(file), "-o", str(tmp_path / "program"), "-q")
    assert said.returncode == 0, said.stderr
    result = hn.simulate(file, out=tmp_path / "package")

    def stop(step: int, of: int) -> None:
        if step > 0:
            raise KeyboardInterrupt

    big = {"simulation.step": 8e-6}
    with pytest.raises(KeyboardInterrupt) as stopped:
        hn.simulate(file, set=big, out=tmp_path / "stopped", progress=stop)
    assert "resume" in stopped.value.__notes__[0]
    rest = hn.simulate(None, resume=tmp_path / "stopped")
    whole = hn.simulate(file, set=big)
    equal(whole, rest)
    for name in ("trajectory", "residuals", "energy", "sensors"):
        own = (tmp_path / "package" / f"{name}.csv").read_bytes()
        assert own == (tmp_path / "program" / f"{name}.csv").read_bytes(), name
    equal(result, hn.open(tmp_path / "program"))


def test_members_of_a_rollout_do_not_depend_on_threads(double: str) -> None:
    model = hn.Model.from_toml(double)
    controls = np.random.default_rng(1).normal(size=(5, 60, 2))
    runs = [
        hn.rollout(model, inputs=["shoulder", "elbow"], controls=controls, threads=n, every=7)
        for n in (1, 2)
    ]
    assert np.array_equal(runs[0].q, runs[1].q) and runs[0].q.shape[:2] == (5, 10)
    stepper = hn.Stepper(model, ["shoulder", "elbow"])
    for row in controls[3]:
        stepper.step(row)
    assert np.array_equal(stepper.q, runs[0].q[3, -1])
