"""Many runs: each is a pure function of a text and values, so that they can be anywhere."""

from __future__ import annotations

import csv
import io
import os
import pickle
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from os import PathLike
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _core, _toml
from ._acting import Acts, names
from ._errors import HolonomError, InvalidModel, OutputExists, OutputFailed, RunFailed, needed, no_panic
from ._model import Model, model_of
from ._numbers import natural, threads_of
from ._result import Result, open_folder
from ._stepper import Stepper

if TYPE_CHECKING:
    from concurrent.futures import Future

Array = NDArray[np.float64]
Outputs = Mapping[str, Callable[[Result], Any]]
Row = dict[str, Any]
Point = tuple[int, Sequence[tuple[str, str]]]
"""Number, and values of keys as texts of TOML."""
Folders = Mapping[int, str]
"""Of points whose runs have files."""

SHOWN = 20
"""Rows of a table that a notebook shows."""
BATCH_SECONDS = 0.2
"""How long a task for another process lasts."""
PATIENCE_SECONDS = 5.0
"""How long a task of Dask is waited for before its client is asked whether it still has a scheduler."""
TRIES = 3
"""How often a task whose process died is tried."""


class Executor(Protocol):
    """What runs tasks: ``concurrent.futures``, a ``distributed.Client``, and the like."""

    def submit(self, function: Callable[..., Any], /, *args: Any) -> Any:
        """Begins a task; its result is that of ``.result()``."""


@dataclass(frozen=True)
class Plan:
    """Values of keys at the points of a sweep.

    Attributes
    ----------
    keys : the keys that vary.
    points : for each point the values of the keys, as texts of TOML.
    order : what :func:`plan` was asked for, by which a folder knows its sweep.
    """

    keys: tuple[str, ...]
    points: tuple[tuple[str, ...], ...]
    order: Any = field(default=None, repr=False, compare=False)

    def __len__(self) -> int:
        return len(self.points)

    def values(self, k: int) -> dict[str, Any]:
        """The values of a point, as numbers where they are.

        Parameters
        ----------
        k : the number of the point.

        Returns
        -------
        dict
            By the keys.
        """
        return {key: _number(text) for key, text in zip(self.keys, self.points[k], strict=True)}


@no_panic
def plan(
    keys: Mapping[str, Any], *, sample: str = "grid", n: int | None = None, seed: int = 0
) -> Plan:
    """The points of a sweep, those of ``holonom sweep`` with the same seed.

    Parameters
    ----------
    keys : for each key a list or an array of values, or with samples ``(least, largest)``.
    sample : ``"grid"``: every combination, the last key varies first; ``"random"``, ``"latin"`` or
        ``"sobol"``: ``n`` points.
    n : how many samples.
    seed : of the samples.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError
        For a range whose ends are not finite.

    Examples
    --------
    >>> plan({"body.arm.mass": [1.0, 2.0], "model.gravity.2": [-9.81, -1.62]}).points
    (('1.0', '-9.81'), ('1.0', '-1.62'), ('2.0', '-9.81'), ('2.0', '-1.62'))
    """
    varied: list[tuple[str, list[str] | tuple[float, float]]] = []
    for key, values in keys.items():
        if sample != "grid" and isinstance(values, tuple) and len(values) == 2:
            ends = (float(values[0]), float(values[1]))
            if not np.all(np.isfinite(ends)):
                raise ValueError(f"{key}: the ends of a range are finite, not {ends}")
            varied.append((key, ends))
        else:
            varied.append((key, [_toml.value(value) for value in values]))
    count = None if n is None else natural("n", n, 1)
    order = (varied, sample, count, natural("seed", seed, 0))
    points = _core.plan(order)
    return Plan(tuple(keys), tuple(tuple(point) for point in points), order)


class SweepTable(Sequence[Row]):
    """A row for each point: ``point``, the keys, ``status``, ``message``, the outputs.

    ``status`` is ``"done"``, ``"failed"`` (the run), ``"invalid"`` (the model), ``"error"`` (an
    output) or ``"lost"`` (its process died again and again).

    Attributes
    ----------
    columns : their names.
    rows : a dictionary for each point.
    """

    def __init__(self, columns: list[str], rows: list[Row]) -> None:
        self.columns, self.rows = columns, rows

    def __getitem__(self, k: Any) -> Any:
        if isinstance(k, str):
            return np.array([row.get(k, np.nan) for row in self.rows])
        return self.rows[k]

    def __len__(self) -> int:
        return len(self.rows)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, SweepTable) and pickle.dumps(self.csv()) == pickle.dumps(other.csv())

    __hash__ = None  # type: ignore[assignment]

    @property
    def failed(self) -> list[Row]:
        """The points that have no outputs."""
        return [row for row in self.rows if row["status"] != "done"]

    def csv(self) -> str:
        """The table as text; numbers read back as the same numbers.

        Returns
        -------
        str
        """
        text = io.StringIO()
        writer = csv.DictWriter(text, self.columns, lineterminator="\n")
        writer.writeheader()
        writer.writerows(self.rows)
        return text.getvalue()

    def to_dict(self) -> dict[str, list[Any]]:
        """Columns by their names, a value for each point; ``None`` where there is none.

        Returns
        -------
        dict
        """
        return {column: [row.get(column) for row in self.rows] for column in self.columns}

    def __str__(self) -> str:
        return f"{len(self.rows)} points, {len(self.failed)} failed"

    def __repr__(self) -> str:
        return f"<holonom.SweepTable {self}: {', '.join(self.columns)}>"

    def _repr_html_(self) -> str:
        from html import escape

        def line(cell: str, values: Sequence[Any]) -> str:
            return "<tr>" + "".join(f"<{cell}>{escape(str(own))}</{cell}>" for own in values) + "</tr>"

        shown = [line("td", [row.get(own, "") for own in self.columns]) for row in self.rows[:SHOWN]]
        return f"<table>{line('th', self.columns)}{''.join(shown)}</table><p>{escape(str(self))}</p>"

    def to_pandas(self) -> Any:
        """The table over ``point``.

        Returns
        -------
        pandas.DataFrame
        """
        pandas = needed("pandas", "notebook")
        return pandas.DataFrame(self.rows, columns=self.columns).set_index("point")


def run_point(
    model: Model,
    values: Sequence[tuple[str, str]],
    outputs: Outputs,
    progress: Callable[[int, int], object] | None = None,
    folder: str | None = None,
) -> Row:
    """Runs a model with values replaced.

    Parameters
    ----------
    model : a :class:`Model`.
    values : keys and texts of TOML.
    outputs : functions of the :class:`Result`, called where the run was.
    progress : called with steps taken and all steps; it may raise.
    folder : one that gets the files of the run, those of a point of ``holonom sweep``.

    Returns
    -------
    dict
        ``status``, ``message`` and the outputs.

    Raises
    ------
    OutputFailed, OutputExists
        Files cannot be written: the point is not to blame.
    """

    def go(whole: Model) -> Result:
        if folder is None:
            return Result(whole, _core.simulate(whole._core, None, progress, None))
        how = {"force": True, "checkpoint_every": None, "report": False}
        _core.simulate_into(whole._core, folder, how, progress, None)
        return open_folder(folder)

    return _row(model, values, outputs, go)


def _row(
    model: Model,
    values: Sequence[tuple[str, str]],
    outputs: Outputs,
    go: Callable[[Model], Result],
) -> Row:
    """The row of a point, of the result that ``go`` gives of its model."""
    try:
        whole = no_panic(lambda: Model(model._core.replace(list(values))))()
        result = no_panic(go)(whole)
    except InvalidModel as error:
        return {"status": "invalid", "message": str(error)}
    except (OutputFailed, OutputExists):
        raise
    except HolonomError as error:
        return {"status": "failed", "message": str(error)}
    if result.failure is not None:
        failure = result.failure
        words = RunFailed(*(failure[k] for k in ("step", "t", "message", "remedy")))
        return {"status": "failed", "message": str(words)}
    row: Row = {"status": "done", "message": ""}
    try:
        for name, output in outputs.items():
            row[name] = _plain(output(result))
    except Exception as error:
        return {"status": "error", "message": f"{name}: {type(error).__name__}: {error}"}
    return row


class _Stopped(BaseException):
    """Nobody waits for this run any more."""


def _run_points(
    model: Model, points: Sequence[Point], outputs: Outputs, folders: Folders
) -> list[tuple[int, Row, float]]:
    is_wanted = _wanted()

    def go_on(_step: int, _of: int) -> None:
        if not is_wanted():
            raise _Stopped

    found = []
    for number, values in points:
        begin = time.perf_counter()
        try:
            row = run_point(model, values, outputs, go_on, folders.get(number))
        except _Stopped:
            break
        found.append((number, row, time.perf_counter() - begin))
    return found


def _wanted() -> Callable[[], bool]:
    """Whether the task of this process is still wanted; a worker of Dask knows."""
    module = sys.modules.get("distributed.worker")
    try:
        worker = module.get_worker() if module else None
        key = worker.get_current_task() if worker else None
    except ValueError:  # not within a task
        worker = None
    if worker is None:
        return lambda: True

    def is_wanted() -> bool:
        task = worker.state.tasks.get(key)
        return task is not None and task.state != "cancelled"

    return is_wanted


@no_panic
def sweep(
    model: Any,
    plan: Plan | Mapping[str, Any],
    outputs: Outputs,
    *,
    executor: Executor | None = None,
    threads: int | None = None,
    out: str | PathLike[str] | None = None,
    batch: int | str = "auto",
    progress: Callable[[int, int], object] | None = None,
) -> SweepTable:
    """Runs a model at all points of a plan; the same table, bit for bit, wherever they run.

    Parameters
    ----------
    model : a :class:`Model`, the path of a file, or a dictionary of sections.
    plan : a :class:`Plan`, or keys with lists of values for a grid.
    outputs : names and functions of the :class:`Result` of a point: numbers travel, not runs.
    executor : anything with ``submit(function, *args)``: ``concurrent.futures``, a
        ``distributed.Client``; without one threads of this process.
    threads : how many; by default the processors that this process may use.
    out : the folder of ``holonom sweep``, which gets the files of each point: finished points are
        never run again, and either continues what the other began. Outputs of points that are
        there are computed from their files. Workers of an executor have to see the folder.
    batch : points of a task of the executor; ``"auto"``: such that it takes about 0.2 s.
    progress : called with the points that have ended and all points.

    Returns
    -------
    SweepTable
        A point that fails is a row, not an exception.

    Raises
    ------
    KeyboardInterrupt
        On Ctrl-C, and whatever ``progress`` raises: the runs are stopped; ``table`` of the exception
        has the points that have ended, and so has ``out``.
    ValueError
        For outputs with the name of another column.
    """
    own = model_of(model)
    points = plan if isinstance(plan, Plan) else globals()["plan"](plan)
    taken = {"point", "status", "message", *points.keys}.intersection(outputs)
    if taken:
        raise ValueError(f"outputs: `{min(taken)}` is the name of another column")
    work = [
        (k, list(zip(points.keys, values, strict=True))) for k, values in enumerate(points.points)
    ]
    store = None if out is None else _Store(out, own, points)
    rows: dict[int, Row] = {} if store is None else store.rows(own, work, outputs)

    def keep(number: int, row: Row, seconds: float) -> None:
        if number not in rows:
            rows[number] = row
            if store is not None:
                store.add(number, row, seconds)

    def ended(number: int, row: Row, seconds: float) -> None:
        keep(number, row, seconds)
        if progress is not None:
            progress(len(rows), len(work))

    def table() -> SweepTable:
        columns = ["point", *points.keys, "status", "message", *outputs]
        return SweepTable(columns, [{"point": k, **points.values(k), **rows[k]} for k in sorted(rows)])

    rest = [task for task in work if task[0] not in rows]
    folders = {} if store is None else {k: store.folder_of(k) for k, _ in rest}
    runs = _Runs(own, outputs, folders)
    try:
        if executor is None:
            _on_threads(runs, rest, threads, (ended, keep))
        else:
            _on_executor(runs, rest, (executor, batch), (ended, keep))
    except BaseException as stopped:
        if store is not None:
            with suppress(HolonomError):  # what stopped it is told
                store.end()
        stopped.table = table()  # type: ignore[attr-defined]
        kept = "give `out` a folder to keep them" if out is None else f"sweep again with out={out!r}"
        stopped.add_note(f"{len(rows)} of {len(work)} points have ended: {kept}")
        raise
    if store is not None:
        store.end()
    return table()


Ended = Callable[[int, Row, float], None]


@dataclass(frozen=True)
class _Runs:
    """What is run at each point."""

    model: Model
    outputs: Outputs
    folders: Folders

    def of(self, points: Sequence[Point]) -> tuple[Any, ...]:
        """What a task of these points is given."""
        own = {k: self.folders[k] for k, _ in points if k in self.folders}
        return self.model, points, self.outputs, own


def _on_threads(
    runs: _Runs,
    work: Sequence[Point],
    threads: int | None,
    told: tuple[Ended, Ended],
) -> None:
    from concurrent.futures import ThreadPoolExecutor, as_completed

    ended, keep = told
    stop = threading.Event()

    def go_on(_step: int, _of: int) -> None:
        if stop.is_set():
            raise _Stopped

    def go(point: Point) -> tuple[Row, float]:
        begin = time.perf_counter()
        number, values = point
        row = run_point(runs.model, values, runs.outputs, go_on, runs.folders.get(number))
        return row, time.perf_counter() - begin

    with ThreadPoolExecutor(threads_of(threads)) as pool:
        tasks = {pool.submit(go, point): point[0] for point in work}
        try:
            for task in as_completed(tasks):
                ended(tasks[task], *task.result())
        except BaseException:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
            for task, number in tasks.items():
                if not task.cancelled() and task.exception() is None:
                    keep(number, *task.result())
            raise


def _on_executor(
    runs: _Runs,
    work: Sequence[Point],
    where: tuple[Executor, int | str],
    told: tuple[Ended, Ended],
) -> None:
    executor, batch = where
    ended, keep = told
    engine = _Engine(executor, runs)
    if batch != "auto" and (not isinstance(batch, int) or batch < 1):
        raise ValueError(f'batch: a number from 1 on or "auto", not {batch!r}')
    rest = list(work)
    tasks: list[tuple[Sequence[Point], Any]] = []
    with _without_tracebacks() if engine.is_dask else nullcontext():
        try:
            size = batch if isinstance(batch, int) else 1
            if batch == "auto" and rest:
                first, rest = rest[:1], rest[1:]
                tasks.append((first, engine.submit(first)))
                seconds = _collect(*tasks[0], engine, ended)
                tasks.clear()
                size = max(1, min(int(BATCH_SECONDS / max(seconds, 1e-6)), -(-len(rest) // 8), 1000))
            parts = (rest[k : k + size] for k in range(0, len(rest), size))
            tasks.extend((part, engine.submit(part)) for part in parts)
            while tasks:
                _collect(*tasks[0], engine, ended)
                tasks.pop(0)
        except BaseException:
            for _, task in tasks:
                _leave(task, keep)
            raise


class _Engine:
    """An executor with what its tasks run."""

    def __init__(self, executor: Executor, runs: _Runs) -> None:
        if not callable(getattr(executor, "submit", None)):
            kind = type(executor).__name__
            raise TypeError(f"executor: anything with submit(function, *args), not {kind}")
        self.executor: Any = executor
        self.runs = runs
        self.is_dask = hasattr(executor, "scheduler_info")  # it runs the tasks of dead workers again
        self.options = {"retries": TRIES - 1, "pure": False} if self.is_dask else {}

    def submit(self, points: Sequence[Point]) -> Any:
        """Begins a task of these points."""
        try:
            return self.executor.submit(_run_points, *self.runs.of(points), **self.options)
        except Exception as error:
            raise self.dead(error) from error

    def result(self, task: Any) -> Any:
        """Waits for a task; one of a scheduler that is gone never ends."""
        while self.is_dask:
            try:
                return task.result(timeout=PATIENCE_SECONDS)
            except Exception as error:
                if self.executor.status in ("closing", "closed"):
                    raise self.dead(error) from error
                if task.done() or not isinstance(error, TimeoutError):
                    raise
        return task.result()

    def dead(self, error: BaseException) -> HolonomError:
        """The executor takes no tasks any more."""
        words = str(error) or type(error).__name__
        return HolonomError(
            f"the executor died: {words}",
            "give `out` a folder and sweep again with a new executor: finished points are kept",
        )


def _leave(task: Any, keep: Ended) -> None:
    """Keeps the points of a task that has ended; another one is wanted no more."""
    if not task.done():
        task.cancel()
        return
    try:
        for number, row, taken in task.result():
            keep(number, row, taken)
    except Exception:  # noqa: S110  its points are run again another time
        pass


@contextmanager
def _without_tracebacks() -> Iterator[None]:
    """Workers that die are rows or run again: Dask says in a line that they did."""
    import logging

    def shorten(record: logging.LogRecord) -> bool:
        record.exc_info = record.exc_text = None
        return "Traceback" not in record.getMessage()

    names = [name for name in logging.root.manager.loggerDict if name.startswith(("distributed", "tornado"))]
    handlers = {handler for name in names for handler in logging.getLogger(name).handlers}
    handlers.update(logging.root.handlers)
    for handler in handlers:
        handler.addFilter(shorten)
    try:
        yield
    finally:
        for handler in handlers:
            handler.removeFilter(shorten)


def _collect(
    points: Sequence[Point],
    task: Future[Any],
    engine: _Engine,
    ended: Ended,
) -> float:
    """Waits for a task; what dies with its process is tried again, point by point."""
    seconds, given = 0.0, set[int]()
    try:
        for number, found, taken in engine.result(task):
            seconds += taken
            ended(number, found, taken)
            given.add(number)
        missing = [point for point in points if point[0] not in given]
        return seconds + (_collect(missing, engine.submit(missing), engine, ended) if missing else 0.0)
    except Exception as error:
        if isinstance(error, pickle.PicklingError) or "pickle" in str(error):
            words = "define them with `def` at the top of a module"
            raise TypeError(f"outputs have to travel to another process: {error}: {words}") from error
        if not _process_died(error):
            raise
        lost = error
    for point in points:
        row, taken = _lost(lost), 0.0
        for _ in range(TRIES - (len(points) == 1)):
            try:
                ((_, row, taken),) = engine.result(engine.submit([point]))
                seconds += taken
                break
            except Exception as again:
                if not _process_died(again):
                    raise
                row = _lost(again)
                if type(again).__name__ == "KilledWorker":  # several processes died of it
                    break
        ended(point[0], row, taken)
    return seconds


def _lost(error: BaseException) -> Row:
    return {"status": "lost", "message": f"its process died: {type(error).__name__}: {error}"}


def _process_died(error: BaseException) -> bool:
    names = {kind.__name__ for kind in type(error).__mro__}
    return bool(names & {"KilledWorker", "BrokenExecutor", "CancelledError", "FutureCancelledError"})


class _Store:
    """The folder of a sweep, with the points that have ended."""

    def __init__(self, out: str | PathLike[str], model: Model, plan: Plan) -> None:
        if plan.order is None:
            raise ValueError("out: the points have to be those of holonom.plan")
        self.points = plan.points
        self._core = _core.SweepFolder(model._core, plan.order, os.path.abspath(out))

    def folder_of(self, number: int) -> str:
        """The folder of a point."""
        return str(self._core.of_point(number))

    def rows(self, model: Model, work: Sequence[Point], outputs: Outputs) -> dict[int, Row]:
        """The rows of the points that have ended, from their files."""
        found: dict[int, Row] = {}
        for number, status, message in self._core.ended():
            summary = os.path.join(self.folder_of(number), "summary.json")
            if status != "invalid" and not os.path.isfile(summary):
                continue  # its files are gone: it is run again

            def read(whole: Model, number: int = number, status: str = status) -> Result:
                if status == "invalid":
                    _core.check(whole._core)  # says what is wrong
                return open_folder(self.folder_of(number))

            try:
                found[number] = _row(model, work[number][1], outputs, read)
            except OutputFailed:
                found[number] = {"status": status, "message": message or ""}
        return found

    def add(self, number: int, row: Row, seconds: float) -> None:
        """Keeps a point; one that was lost is run again another time."""
        status, message = row["status"], row["message"] or None
        if status == "error":  # of an output: the run is there
            status, message = "done", None
        if status != "lost":
            self._core.add(number, list(self.points[number]), (status, message), seconds)

    def end(self) -> None:
        """Writes the tables of the program, and leaves the folder to others."""
        self._core.end()


@dataclass(frozen=True)
class Rollout:
    """Runs of ``M`` members side by side.

    Attributes
    ----------
    t : times, s, shape ``(M, K)``.
    q : coordinates: positions, m, directors, 1; shape ``(M, K, n)``; NaN after a member has failed.
    y : what is observed, in its units, shape ``(M, K, k)``; likewise.
    failures : exceptions by the numbers of the members that failed.
    """

    t: Array
    q: Array
    y: Array
    failures: dict[int, BaseException]


@no_panic
def rollout(
    model: Any,
    *,
    inputs: Sequence[str] = (),
    controls: ArrayLike | None = None,
    set: Sequence[Mapping[str, Any]] | None = None,
    states: Sequence[bytes] | None = None,
    observe: Sequence[str] = (),
    steps: int | None = None,
    every: int = 1,
    threads: int | None = None,
) -> Rollout:
    """Runs ``M`` members for the same number of steps, in lanes of wide registers where these apply
    (trees of rigid bodies) and on threads; who is beside whom and how many threads there are changes
    no bit.

    Parameters
    ----------
    model : as of :func:`simulate`.
    inputs : where inputs act, as of :class:`Stepper`.
    controls : inputs of each step, N or N·m, of set points m or rad, shape ``(M, N, m)``; or
        ``(N, m)`` for all members.
    set : values that each member replaces.
    states : a state of a :class:`Stepper` from which each member begins.
    observe : what is read, as of :class:`Stepper`.
    steps : number of steps; by default ``N``, or those of the model.
    every : steps from one recorded node to the next; the last node is always recorded.
    threads : how many; by default the processors that this process may use.

    Returns
    -------
    Rollout

    Raises
    ------
    InvalidModel, StateMismatch, UnknownName, ValueError
        Of a member that cannot be run, before any is.
    KeyboardInterrupt
        On Ctrl-C: the runs are stopped; ``rollout`` of the exception has the nodes, or the members,
        that there are, NaN of the others.
    """
    own = model_of(model)
    rows = None if controls is None else np.ascontiguousarray(controls, dtype=np.float64)
    counts = [len(given) for given in (set, states) if given is not None]
    if rows is not None and rows.ndim == 3:
        counts.append(len(rows))
    members = counts[0] if counts else 1
    if members == 0:
        raise ValueError("set, states or controls: of one member at least")
    if any(count != members for count in counts):
        raise ValueError(f"set, states and controls are of {counts} members")
    if rows is not None and rows.ndim not in (2, 3):
        raise ValueError(f"controls: shape (M, N, m) or (N, m), not {rows.shape}")
    every = natural("every", every, 1)
    given = rows.shape[-2] if rows is not None else None
    taken = given if given is not None else own.steps
    if steps is not None:
        taken = natural("steps", steps, 0)
    if given is not None and taken > given:
        raise ValueError(f"steps: {taken}, and controls have {given}")
    stop = threading.Event()

    def go_on(_step: int, _of: int) -> None:
        if stop.is_set():
            raise _Stopped

    def begun(k: int) -> Stepper:
        stepper = Stepper(each[k], inputs, observe)
        if states is not None:
            stepper.state = states[k]
        width = stepper._core.width
        if rows is not None and rows.shape[-1] != width:
            raise ValueError(f"controls: {width} columns, not {rows.shape[-1]}")
        return stepper

    def run(k: int, stepper: Stepper) -> Any:
        mine = None if rows is None else (rows[k] if rows.ndim == 3 else rows)
        return stepper._core.advance(mine, taken, every, go_on)

    count = threads_of(threads)
    each = [own] * members if set is None else [own.replace(values) for values in set]
    plan = {"states": states, "steps": taken, "every": every, "threads": count}
    acts = Acts(names(inputs), names(observe)).core()
    given_rows = None if rows is None else rows.reshape((-1, *rows.shape[-2:]))
    lanes = _core.rollout([own._core for own in each], acts, given_rows, plan)
    if lanes is None:
        steppers = [begun(k) for k in range(members)]  # a member that is refused: none is run
        return _on_steppers(run, steppers, len(range(0, taken, every)) + 1, count, stop)
    t, q, y, failed, stopped = lanes
    found = Rollout(t, q, y, {})
    if stopped is not None:
        stopped.rollout = found  # type: ignore[attr-defined]
        raise stopped
    for k in failed:  # its own stepper says why
        *arrays, failure = run(k, begun(k))
        for whole_array, own_array in zip((t, q, y), arrays, strict=True):
            whole_array[k] = np.nan
            whole_array[k, : len(own_array)] = own_array
        if failure is not None:
            found.failures[k] = failure
    return found


def _on_steppers(
    run: Callable[[int, Stepper], Any],
    steppers: Sequence[Stepper],
    nodes: int,
    threads: int,
    stop: threading.Event,
) -> Rollout:
    """Members that run alone, several at a time."""
    from concurrent.futures import ThreadPoolExecutor

    found: dict[int, Any] = {}

    def made() -> Rollout:
        def rows(part: int) -> Array:
            shapes = [member[part].shape[1:] for member in found.values()]
            full = np.full((len(steppers), nodes, *(shapes[0] if shapes else (0,) * (part > 0))), np.nan)
            for k, member in found.items():
                full[k, : len(member[part])] = member[part]
            return full

        failures = {k: member[3] for k, member in found.items() if member[3] is not None}
        return Rollout(rows(0), rows(1), rows(2), failures)

    with ThreadPoolExecutor(threads) as pool:
        tasks = [pool.submit(run, k, stepper) for k, stepper in enumerate(steppers)]
        try:
            found.update((k, task.result()) for k, task in enumerate(tasks))
        except BaseException as stopped:
            stop.set()
            pool.shutdown(wait=True, cancel_futures=True)
            done = [k for k, own in enumerate(tasks) if not own.cancelled() and own.exception() is None]
            found.update((k, tasks[k].result()) for k in done)
            stopped.rollout = made()  # type: ignore[attr-defined]
            raise
    return made()


def _number(text: str) -> Any:
    try:
        return float(text)
    except ValueError:
        return text


def _plain(value: Any) -> Any:
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray):
        return value.tolist()
    return value


