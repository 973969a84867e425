"""Many points: the same table wherever they run; what fails or dies is a row."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from contextlib import ExitStack
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from conftest import DOUBLE

import holonom as hn

PLAN = {"body.lower.mass": (0.5, 1.5), "body.upper.mass": (0.8, 1.2)}


def reach(result: hn.Result) -> float:
    """The lowest point of the centre of the lower body, m."""
    return float(result["lower"].position[:, 2].min())


def last(result: hn.Result) -> float:
    return float(result.sensors["angle"][-1])


OUTPUTS = {"reach": reach, "last": last}


def deadly(result: hn.Result) -> float:
    """Ends its process at one of the points."""
    if result.model.bodies["lower"]["mass"] > 1.9:
        os.kill(os.getpid(), signal.SIGKILL)
    return reach(result)


@pytest.fixture
def model() -> hn.Model:
    return hn.Model.from_toml(DOUBLE).replace({"simulation.end": 0.1})


def test_plans_are_those_of_the_program() -> None:
    grid = hn.plan({"a.b.c": [1.0, 2.0], "a.b.d": np.array([3.0, 4.0])})
    assert grid.points == (("1.0", "3.0"), ("1.0", "4.0"), ("2.0", "3.0"), ("2.0", "4.0"))
    first, second = (hn.plan(PLAN, sample="sobol", n=16, seed=seed) for seed in (7, 7))
    assert first == second and len(first) == 16
    assert first != hn.plan(PLAN, sample="sobol", n=16, seed=8)
    assert all(0.5 <= first.values(k)["body.lower.mass"] <= 1.5 for k in range(16))
    assert hn.plan(PLAN, sample="sobol", n=8, seed=7).points == first.points[:8]
    with pytest.raises(hn.HolonomError, match="how many"):
        hn.plan(PLAN, sample="latin")
    with pytest.raises(TypeError, match="none of grid"):
        hn.plan(PLAN, sample="halton", n=3)


def test_threads_processes_and_one_by_one_agree(model: hn.Model, tmp_path: Path) -> None:
    plan = hn.plan(PLAN, sample="sobol", n=24, seed=7)
    one = hn.sweep(model, plan, OUTPUTS, threads=1)
    assert [row["status"] for row in one] == ["done"] * 24
    by_hand = hn.simulate(model, set=plan.values(5))
    assert one[5]["reach"] == reach(by_hand) and len(set(one["reach"])) == 24
    assert hn.sweep(model, plan, OUTPUTS, threads=2) == one
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        assert hn.sweep(model, plan, OUTPUTS, executor=pool, out=tmp_path / "kept") == one
    runs = []

    def count(result: hn.Result) -> float:
        runs.append(1)
        return reach(result)

    again = hn.sweep(model, plan, {"reach": count, "last": last}, out=tmp_path / "kept")
    assert again == one and not runs  # no finished point is run again
    lines = (tmp_path / "kept" / "points.jsonl").read_text().splitlines()
    (tmp_path / "kept" / "points.jsonl").write_text("\n".join(lines[:20]) + "\n" + lines[20][:9])
    again = hn.sweep(model, plan, {"reach": count, "last": last}, out=tmp_path / "kept")
    assert again == one and len(runs) == 4
    with pytest.raises(hn.OutputExists):
        hn.sweep(model, hn.plan(PLAN, sample="sobol", n=25, seed=7), OUTPUTS, out=tmp_path / "kept")


def test_points_that_fail_are_rows(model: hn.Model) -> None:
    plan = hn.plan({"body.lower.mass": [1.0, -1.0], "simulation.step": [0.002, 0.05]})

    def picky(result: hn.Result) -> float:
        if result.model.settings["step"] > 0.01:
            raise LookupError("too coarse")
        return 1.0

    table = hn.sweep(model, plan, {"x": picky})
    assert [row["status"] for row in table] == ["done", "error", "invalid", "invalid"]
    assert table[1]["message"] == "x: LookupError: too coarse"
    assert "mass" in table[2]["message"] and len(table.failed) == 3
    assert table.csv().splitlines()[0] == "point,body.lower.mass,simulation.step,status,message,x"
    wild = model.replace({"simulation.end": 50.0, "joint.elbow.rate": 300.0})
    table = hn.sweep(wild, {"simulation.step": [0.5]}, {"x": picky})
    assert table[0]["status"] == "failed" and "the run failed in step" in table[0]["message"]


def test_progress_that_raises_ends_a_sweep(model: hn.Model) -> None:
    def stop(ended: int, of: int) -> None:
        raise KeyboardInterrupt

    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        hn.sweep(model.replace({"simulation.end": 200.0}), {"body.lower.mass": [1.0] * 200}, {}, progress=stop, threads=2)
    assert time.monotonic() - begin < 60.0


@pytest.mark.parametrize("on", ["threads", "processes"])
def test_what_stops_a_sweep_keeps_the_points_that_have_ended(
    on: str, model: hn.Model, tmp_path: Path
) -> None:
    plan, ends = hn.plan(PLAN, sample="sobol", n=12, seed=1), []

    def stop(ended: int, of: int) -> None:
        ends.append(ended)
        if ended == 5:
            raise LookupError("enough")

    with ExitStack() as stack:
        executor = None
        if on == "processes":
            executor = stack.enter_context(ProcessPoolExecutor(1, mp_context=get_context("spawn")))
        with pytest.raises(LookupError, match="enough") as stopped:
            hn.sweep(model, plan, OUTPUTS, executor=executor, batch=1, out=tmp_path / "kept", progress=stop, threads=1)
    found = stopped.value.table  # type: ignore[attr-defined]
    assert ends[-1] == 5 and 5 <= len(found) < 12
    assert "12 points have ended: sweep again with out=" in stopped.value.__notes__[0]
    lines = (tmp_path / "kept" / "points.jsonl").read_text().splitlines()
    assert len(lines) == len(found) == len({json.loads(line)["point"] for line in lines})
    runs: list[float] = []

    def count(result: hn.Result) -> float:
        runs.append(1.0)
        return reach(result)

    whole = hn.sweep(model, plan, {"reach": count, "last": last}, out=tmp_path / "kept")
    assert whole == hn.sweep(model, plan, OUTPUTS) and len(runs) == 12 - len(found)
    assert [whole[row["point"]] for row in found] == list(found)


def test_what_stops_a_rollout_keeps_what_has_ended(model: hn.Model) -> None:
    masses = [{"body.lower.mass": 0.5}, {"body.lower.mass": 0.7}, {"body.lower.mass": 0.9}]
    reaction = ["bearing"]  # belongs to the step from a node: no lanes
    states = [hn.Stepper(model.replace(own), observe=reaction).state for own in masses]
    with pytest.raises(hn.StateMismatch) as refused:
        hn.rollout(model, set=masses, states=[*states[:2], b"none"], observe=reaction, steps=40, threads=1)
    found = refused.value.rollout  # type: ignore[attr-defined]
    assert np.isfinite(found.q[:2]).all() and np.isnan(found.q[2]).all() and found.q.shape == (3, 41, 24)
    assert np.array_equal(found.q[1], hn.rollout(model.replace(masses[1]), steps=40).q[0])
    # in lanes all members go on together: the nodes up to there
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    ring = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
    try:
        with pytest.raises(KeyboardInterrupt) as stopped:
            ring.start()
            hn.rollout(model, set=masses, steps=10**9, every=10**7, threads=2)
    finally:
        ring.cancel()
        signal.signal(signal.SIGINT, before)
    found = stopped.value.rollout  # type: ignore[attr-defined]
    assert found.q.shape == (3, 101, 24) and np.isfinite(found.q[:, 0]).all() and np.isnan(found.q[:, -1]).all()
    with pytest.raises(hn.InvalidModel):  # before anything runs
        hn.rollout(model, set=[*masses, {"body.lower.mass": -1.0}], steps=40)


QUIET = """
import os, signal, sys, time
import distributed, holonom as hn
from test_sweep import deadly, reach
if __name__ == "__main__":
    model = hn.Model.from_toml(open(sys.argv[1]).read())
    cluster = distributed.LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None)
    with cluster, distributed.Client(cluster) as client:
        masses = {"body.lower.mass": [1.0, 2.0, 1.2, 0.8]}
        if sys.argv[2] == "killed":
            table = hn.sweep(model, masses, {"reach": deadly}, executor=client, batch=1)
            print([row["status"] for row in table])
        else:
            def stop(ended, of):
                raise KeyboardInterrupt
            try:
                long = model.replace({"simulation.end": 1e5, "simulation.every": 1000})
                keys = {"simulation.end": [0.1, 1e5, 1e5, 1e5, 1e5]}
                hn.sweep(long, keys, {"reach": reach}, executor=client, batch=1, progress=stop)
            except KeyboardInterrupt as stopped:
                print([row["status"] for row in stopped.table])
            begin = time.monotonic()
            while any(client.run(lambda dask_worker: dask_worker.state.executing_count).values()):
                assert time.monotonic() - begin < 20.0
                time.sleep(0.1)
            print("idle", time.monotonic() - begin)
"""


@pytest.mark.parametrize(("what", "said"), [("killed", "['done', 'lost', 'done', 'done']"), ("stopped", "['done']")])
def test_dask_says_nothing_of_what_became_a_row(what: str, said: str, double: str, tmp_path: Path) -> None:
    pytest.importorskip("distributed")
    (tmp_path / "double.toml").write_text(double)
    script = tmp_path / "quiet.py"
    script.write_text(QUIET)
    paths = os.pathsep.join([str(Path(__file__).parent), str(Path(hn.__file__).parents[1])])
    words = [sys.executable, str(script), str(tmp_path / "double.toml"), what]
    answer = subprocess.run(
        words, capture_output=True, text=True, cwd=tmp_path, env={**os.environ, "PYTHONPATH": paths}, timeout=240
    )
    print(answer.stdout, answer.stderr)
    assert answer.returncode == 0 and answer.stdout.startswith(said)
    # a worker that dies may tell of its own broken connection: no fault of a point, no line of the package
    assert "Compute Failed" not in answer.stderr and str(Path(hn.__file__).parent) not in answer.stderr


def test_dask_with_a_worker_killed_equals_one_process(model: hn.Model, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    dask = pytest.importorskip("dask")
    n = int(os.environ.get("HOLONOM_DASK_POINTS", "120"))
    plan = hn.plan(PLAN, sample="sobol", n=n, seed=3)
    one = hn.sweep(model, plan, OUTPUTS)
    begin = time.monotonic()
    killed: list[int] = []
    options = {"n_workers": 2, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with (
        dask.config.set({"distributed.comm.timeouts.connect": "20s"}),
        distributed.LocalCluster(local_directory=str(tmp_path), silence_logs=50, **options) as cluster,
        distributed.Client(cluster) as client,
    ):
        ready = time.monotonic()

        def kill(ended: int, of: int) -> None:
            if ended > of // 4 and not killed:
                pids = client.run(os.getpid)
                killed.append(next(iter(pids.values())))
                os.kill(killed[0], signal.SIGKILL)

        table = hn.sweep(model, plan, OUTPUTS, executor=client, progress=kill)
        done = time.monotonic()
    assert table == one and killed
    print(f"{n} points: {1e3 * (done - ready) / n:.2f} ms each, start {ready - begin:.1f} s")


def test_a_point_that_kills_its_worker_is_a_row(model: hn.Model, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    dask = pytest.importorskip("dask")
    plan = hn.plan({"body.lower.mass": [1.0, 2.0, 1.2]})
    options = {"n_workers": 1, "threads_per_worker": 1, "processes": True, "dashboard_address": None}
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 0}),
        distributed.LocalCluster(local_directory=str(tmp_path), silence_logs=50, **options) as cluster,
        distributed.Client(cluster) as client,
    ):
        table = hn.sweep(model, plan, {"reach": deadly}, executor=client, batch=1)
    assert [row["status"] for row in table] == ["done", "lost", "done"]
    assert "its process died" in table[1]["message"]


def test_members_that_fail_are_named(model: hn.Model) -> None:
    found = hn.rollout(
        model.replace({"simulation.step": 0.02}), inputs=["elbow"],
        controls=[[[0.0]] * 5, [[0.0], [0.0], [1e9], [0.0], [0.0]]], observe=["elbow"],
    )
    assert list(found.failures) == [1] and isinstance(found.failures[1], hn.RunFailed)
    assert np.isfinite(found.q[0]).all() and np.isnan(found.q[1, 3:]).all()
    assert np.array_equal(found.q[1, :3], found.q[0, :3]) and found.y.shape == (2, 6, 1)
    with pytest.raises(ValueError, match="members"):
        hn.rollout(model, inputs=["elbow"], controls=np.zeros((3, 4, 1)), set=[{}])
    states = []
    stepper = hn.Stepper(model)
    for _ in range(3):
        states.append(stepper.state)
        stepper.step(n=5)
    begun = hn.rollout(model, states=states, steps=5)
    assert np.array_equal(begun.q[0, -1], begun.q[1, 0])
    assert np.array_equal(begun.q[2, -1], stepper.q)
