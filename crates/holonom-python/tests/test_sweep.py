"""Many points: the same table wherever they run; what fails or dies is a row."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import ExitStack
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest
from conftest import DOUBLE, program

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
    before = runs(tmp_path / "kept")
    assert len(before) == 24
    assert hn.sweep(model, plan, OUTPUTS, out=tmp_path / "kept") == one
    assert runs(tmp_path / "kept") == before  # no finished point is run again
    manifest = tmp_path / "kept" / "manifest.jsonl"
    lines = manifest.read_text().splitlines()
    manifest.write_text("\n".join(lines[:20]) + "\n" + lines[20][:9])
    assert hn.sweep(model, plan, OUTPUTS, out=tmp_path / "kept") == one
    assert again(before, runs(tmp_path / "kept")) == 4
    with pytest.raises(hn.OutputExists, match="another sweep"):
        hn.sweep(model, hn.plan(PLAN, sample="sobol", n=25, seed=7), OUTPUTS, out=tmp_path / "kept")
    with pytest.raises(ValueError, match=r"holonom\.plan"):
        hn.sweep(model, hn.Plan(plan.keys, plan.points), OUTPUTS, out=tmp_path / "other")


def runs(folder: Path) -> dict[str, int]:
    """When each point was run."""
    return {file.parent.name: file.stat().st_mtime_ns for file in folder.glob("[0-9]*/summary.json")}


def again(before: dict[str, int], after: dict[str, int]) -> int:
    """How many points were run since."""
    return sum(after[name] != before.get(name) for name in after)


@pytest.mark.parametrize("first", ["program", "package"])
def test_the_folder_is_that_of_the_program(first: str, tmp_path: Path) -> None:
    """Either continues what the other began: equal tables, equal files, no point twice."""
    text = DOUBLE.replace("end = 0.4", "end = 0.1")
    (tmp_path / "double.toml").write_text(text)
    model = hn.load(tmp_path / "double.toml").replace({"body.upper.mass": 1.25})
    keys = {"body.lower.mass": [0.5, -1.0, 0.75, 1e-3], "simulation.step": [0.002, 0.05]}
    vary = [f"--vary={key}={','.join(str(value) for value in values)}" for key, values in keys.items()]
    words = ("sweep", "double.toml", "--set", "body.upper.mass=1.25", *vary, "-q", "--no-progress", "-o")
    table = hn.sweep(model, keys, OUTPUTS)
    assert {row["status"] for row in table} == {"done", "invalid"}
    theirs, folder = tmp_path / "theirs", tmp_path / "kept"
    assert program(*words, "theirs", cwd=tmp_path).returncode == 1  # some points are invalid
    if first == "program":
        assert program(*words, "kept", cwd=tmp_path).returncode == 1
        assert hn.sweep(model, keys, OUTPUTS, out=folder) == table
    else:
        assert hn.sweep(model, keys, OUTPUTS, out=folder) == table
    before = runs(folder)
    assert len(before) == 6
    for mine in sorted(theirs.glob("[0-9]*/*")):
        if mine.suffix == ".csv":
            assert (folder / mine.relative_to(theirs)).read_bytes() == mine.read_bytes(), mine
    assert (folder / "sweep.json").read_bytes() == (theirs / "sweep.json").read_bytes()
    assert (folder / "sweep.csv").read_bytes() == (theirs / "sweep.csv").read_bytes()
    # two points are lost, the other goes on
    lines = (folder / "manifest.jsonl").read_text().splitlines(keepends=True)
    kept = [line for line in lines if '"point":4,' not in line and '"point":5,' not in line]
    (folder / "manifest.jsonl").write_text("".join(kept))
    if first == "program":
        assert hn.sweep(model, keys, OUTPUTS, out=folder) == table
    else:
        assert program(*words, "kept", cwd=tmp_path).returncode == 1
    assert again(before, runs(folder)) == 2
    assert (folder / "sweep.csv").read_bytes() == (theirs / "sweep.csv").read_bytes()
    assert hn.sweep(model, keys, {"last": last}, out=folder)["last"].tolist()[0] == table[0]["last"]
    # the files of a point are gone: it is run again
    (folder / "00000" / "summary.json").unlink()
    assert hn.sweep(model, keys, OUTPUTS, out=folder) == table


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
    assert str(table) == "4 points, 3 failed" and table.to_dict()["x"] == [1.0, None, None, None]
    html = table._repr_html_()
    assert html.count("<tr>") == 5 and "<td>x: LookupError: too coarse</td>" in html
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
    # those that others of the pool have ended meanwhile are kept, too
    assert ends[-1] == 5 and 5 <= len(found) <= 12
    assert "12 points have ended: sweep again with out=" in stopped.value.__notes__[0]
    lines = (tmp_path / "kept" / "manifest.jsonl").read_text().splitlines()
    assert len(lines) == len(found) == len({json.loads(line)["point"] for line in lines})
    ended = {f"{json.loads(line)['point']:05}" for line in lines}
    before = {name: time for name, time in runs(tmp_path / "kept").items() if name in ended}
    whole = hn.sweep(model, plan, OUTPUTS, out=tmp_path / "kept")
    assert whole == hn.sweep(model, plan, OUTPUTS)
    assert again(before, runs(tmp_path / "kept")) == 12 - len(found)
    assert [whole[row["point"]] for row in found] == list(found)


def test_what_stops_a_rollout_keeps_what_has_ended(model: hn.Model) -> None:
    masses = [{"body.lower.mass": 0.5}, {"body.lower.mass": 0.7}, {"body.lower.mass": 0.9}]
    reaction = ["bearing"]  # belongs to the step from a node: no lanes
    # alone each member ends for itself; in lanes all go on together, to the nodes up to there
    for observe, steps in ((reaction, [40, 40, 10**9]), ([], [10**9] * 3)):
        before = signal.signal(signal.SIGINT, signal.default_int_handler)
        ring = threading.Timer(0.3, os.kill, (os.getpid(), signal.SIGINT))
        try:
            with pytest.raises(KeyboardInterrupt) as stopped:
                ring.start()
                hn.rollout(model, set=masses, observe=observe, steps=max(steps), every=10**7, threads=2)
        finally:
            ring.cancel()
            signal.signal(signal.SIGINT, before)
        found = stopped.value.rollout  # type: ignore[attr-defined]
        assert found.q.shape[0] == 3 and np.isnan(found.q[:, -1:]).all()
        if not observe:
            assert found.q.shape == (3, 101, 24) and np.isfinite(found.q[:, 0]).all()


@pytest.mark.parametrize("observe", [["bearing"], []], ids=["alone", "lanes"])
def test_a_member_that_cannot_be_run_is_refused_before_any_runs(observe: list[str], model: hn.Model) -> None:
    """A call is valid or an exception; the steps would take hours."""
    masses = [{"body.lower.mass": 0.5}, {"body.lower.mass": 0.7}]
    states = [hn.Stepper(model.replace(own), observe=observe).state for own in masses]
    long = {"observe": observe, "steps": 10**10, "every": 10**9, "threads": 1}
    with pytest.raises(hn.InvalidModel, match="mass"):
        hn.rollout(model, set=[*masses, {"body.lower.mass": -1.0}], **long)  # type: ignore[arg-type]
    with pytest.raises(hn.StateMismatch):
        hn.rollout(model, set=masses, states=[states[0], b"none"], **long)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="columns"):
        hn.rollout(model, set=masses, controls=np.zeros((3, 5)), observe=observe)


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


def ended_now(result: hn.Result) -> float:
    """Ends its process."""
    os.kill(os.getpid(), signal.SIGKILL)
    return 0.0


@pytest.mark.parametrize("how", ["within", "before", "shut"])
def test_a_pool_that_dies_is_an_exception(how: str, model: hn.Model, tmp_path: Path) -> None:
    plan = hn.plan(PLAN, sample="sobol", n=6, seed=3)
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        if how == "before":
            with pytest.raises(BrokenProcessPool):
                pool.submit(os._exit, 1).result()
        if how == "shut":
            pool.shutdown()
        outputs = {"x": ended_now} if how == "within" else OUTPUTS
        with pytest.raises(hn.HolonomError, match=r"the executor died: (?s:.)*sweep again with a new executor"):
            hn.sweep(model, plan, outputs, executor=pool, out=tmp_path / "kept")
    assert hn.sweep(model, plan, OUTPUTS, out=tmp_path / "kept") == hn.sweep(model, plan, OUTPUTS)


def test_what_cannot_travel_and_what_is_no_executor_is_named(model: hn.Model) -> None:
    keys = {"body.lower.mass": [1.0, 1.2]}
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        with pytest.raises(TypeError, match="outputs have to travel (?s:.)*at the top of a module"):
            hn.sweep(model, keys, {"x": lambda result: 1.0}, executor=pool)
    with pytest.raises(TypeError, match=r"executor: anything with submit\(function, \*args\), not int"):
        hn.sweep(model, keys, OUTPUTS, executor=3)  # type: ignore[arg-type]


@pytest.mark.parametrize("what", ["scheduler", "client"])
def test_dask_without_its_scheduler_is_an_exception(what: str, model: hn.Model, tmp_path: Path) -> None:
    """Tasks of a scheduler that was killed never end: they are not waited for."""
    distributed = pytest.importorskip("distributed")
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", "--port", "0", "--no-dashboard"]
    command += ["--scheduler-file", str(tmp_path / "scheduler.json")]
    others: list[subprocess.Popen[bytes]] = []
    paths = os.pathsep.join([str(Path(__file__).parent), str(Path(hn.__file__).parents[1])])

    def begin(*words: str) -> None:
        quiet, environment = subprocess.DEVNULL, {**os.environ, "PYTHONPATH": paths}
        others.append(subprocess.Popen(words, cwd=tmp_path, stdout=quiet, stderr=quiet, env=environment))

    try:
        begin(*command)
        worker = (sys.executable, "-m", "distributed.cli.dask_worker", "--scheduler-file", str(tmp_path / "scheduler.json"))
        begin(*worker, "--nworkers", "1", "--nthreads", "1", "--no-dashboard")
        while not (tmp_path / "scheduler.json").exists():
            assert others[0].poll() is None
            time.sleep(0.1)
        # how long it is tried to reach a scheduler again
        with distributed.Client(scheduler_file=str(tmp_path / "scheduler.json"), timeout=8) as client:
            client.wait_for_workers(1, timeout=60)

            def stop(ended: int, of: int) -> None:
                if ended == 3:
                    others[0].kill() if what == "scheduler" else client.close()

            plan = hn.plan(PLAN, sample="sobol", n=40, seed=3)
            with pytest.raises(hn.HolonomError, match="the executor died") as died:
                hn.sweep(model, plan, {"x": slow}, executor=client, batch=1, progress=stop)
        assert len(died.value.table) >= 3  # type: ignore[attr-defined]
    finally:
        for other in others:
            other.kill()
            other.wait()


def slow(result: hn.Result) -> float:
    time.sleep(0.05)
    return reach(result)


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
