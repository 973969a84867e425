"""Runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from os import PathLike, fspath
from os.path import join
from typing import TYPE_CHECKING, Any

from . import _core
from ._acting import Acts, held, names
from ._errors import no_panic
from ._model import load, model_of
from ._result import Result, open_folder, told

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ._acting import Control, Forces, Laws, Motions
    from ._parts import Name

Progress = Callable[[int, int], object] | bool | None


@no_panic
def simulate(
    model: Any,
    *,
    end: float | None = None,
    step: float | None = None,
    scheme: str | None = None,
    order: int | None = None,
    every: int | None = None,
    start: str | None = None,
    set: Mapping[str, Any] | None = None,
    record: Sequence[str] | None = None,
    out: str | PathLike[str] | None = None,
    force: bool = False,
    checkpoint_every: int | None = None,
    resume: str | PathLike[str] | None = None,
    progress: Progress = None,
    on_failure: str = "raise",
    inputs: Mapping[Any, ArrayLike] | Sequence[Name] = (),
    observe: Sequence[Name] = (),
    control: Control | None = None,
    control_every: int = 1,
    laws: Laws | None = None,
    forces: Forces | None = None,
    motions: Motions | None = None,
    joints: Mapping[Any, Any] | None = None,
    rates: Mapping[Any, Any] | None = None,
) -> Result:
    """Runs a model from its start to its end.

    Parameters
    ----------
    model : a :class:`Model`, the path of a file, or a dictionary of sections.
    end, step, scheme, order, every, start : keys of ``[simulation]`` that are replaced; times in s.
    set : other values that are replaced: ``{"body.arm.mass": 2.5}``.
    record : which of ``"q"``, ``"energy"``, ``"sensors"``, ``"beams"``, ``"residuals"``,
        ``"momenta"`` are kept; all by default. Without energies, residuals and momenta these are not
        computed: the summary has ``None`` for them, and there are no warnings of them.
    out : a folder that gets the files of ``holonom run``.
    force : whether files there are replaced.
    checkpoint_every : steps between two checkpoints in ``out``.
    resume : a folder whose interrupted run goes on; the model is that of the folder.
    progress : called with steps taken and all steps at the start, about every 50 ms and at the end;
        ``True``: a bar of tqdm, or a line.
    on_failure : ``"raise"``, or ``"return"`` a result with ``failure`` up to there.
    inputs : what is held over each step, by the names of :class:`Stepper`, N or N·m, of set points m
        or rad: constant, or a row for each step, shape ``(N,)``, of forces and torques ``(N, 3)``;
        with ``control`` the names alone.
    observe : what ``control`` is told, as of :class:`Stepper`; by default all numbers of the sensors
        of the model.
    control, control_every : ``control(t, y)`` gives the inputs, shape ``(m,)``, at every so many
        nodes, which are then held; ``y`` is what is observed there.
    laws : by joints, ``"joint"`` or ``"joint.0"``: :class:`Law`, :func:`compiled`, or a function
        ``f(t, x, v)`` that gives the effort (N, N·m), or it with its slopes by ``x`` and ``v``.
    forces : by bodies, nodes of beams and point masses: ``f(t, body)`` gives the force (N) and the
        torque (N·m) in space at the centre of mass, shape ``(6,)`` or ``(3,)``; ``body`` is a
        :class:`BodyState`. It is called once a step at the predicted midpoint: of order 2.
    motions : by constraints of type ``motion``: ``f(t)`` gives value, rate and acceleration in the
        place of the path of the model.
    joints, rates : by joints, what they begin with in the place of the start of the model: a number
        (m, rad; m/s, rad/s) or one for each coordinate. Loops are closed.

    Returns
    -------
    Result
        Arrays over the recorded nodes.

    Raises
    ------
    InvalidModel, RunFailed, OutputExists
    ValueError
        For inputs of another shape, and words that are none.
    FunctionFailed
        When a function that acts gives no finite numbers. What it raises itself is raised.
    KeyboardInterrupt
        On Ctrl-C; a run with files has left a checkpoint, but for equilibria.

    Examples
    --------
    >>> result = simulate({
    ...     "model": {"name": "fall", "dimension": 2, "gravity": [0.0, -9.81]},
    ...     "particle": [{"name": "stone", "mass": 1.0, "position": [0.0, 0.0]}],
    ...     "simulation": {"step": 0.1, "end": 1.0},
    ... })
    >>> result.t.shape, result["stone"].position.shape
    ((11,), (11, 2))
    >>> round(float(result["stone"].position[-1, 1]), 3)
    -4.905
    """
    if on_failure not in ("raise", "return"):
        raise ValueError(f'on_failure: "raise" or "return", not {on_failure!r}')
    tell, close = _teller(progress)
    acts = Acts((), names(observe), laws, forces, motions, joints, rates, None, control, control_every)
    try:
        if resume is not None:
            acting = _acting(acts, inputs, load(join(resume, "model.toml")).steps)
            _core.resume(fspath(resume), checkpoint_every, tell, acting)
            return told(open_folder(resume), on_failure)
        keys = {"end": end, "step": step, "scheme": scheme, "order": order, "every": every}
        keys["start"] = start
        values = {f"simulation.{key}": value for key, value in keys.items() if value is not None}
        whole = model_of(model, {**values, **(set or {})})
        acting = _acting(acts, inputs, whole.steps)
        if out is None:
            kept = None if record is None else list(record)
            found = _core.simulate(whole._core, kept, tell, acting)
            result = Result(whole, found)
            result.acting, result._acted = acting, acting is not None
            return told(result, on_failure, found.get("raised"))
        try:
            how = {"force": force, "checkpoint_every": checkpoint_every, "report": True}
            _core.simulate_into(whole._core, fspath(out), how, tell, acting)
        except KeyboardInterrupt as stopped:
            words = f"continue with holonom.simulate(None, resume={fspath(out)!r})"
            if whole.settings["scheme"] == "static":
                words = "equilibria have no checkpoints: run it again with force=True"
            stopped.add_note(words)
            raise
        return told(open_folder(out), on_failure)
    finally:
        close()


def _acting(acts: Acts, inputs: Any, steps: int) -> _core.Acting | None:
    if isinstance(inputs, Mapping):
        if acts.control is not None:
            raise TypeError("inputs: with `control`, their names alone")
        given, rows = held(inputs, steps)
        acts = replace(acts, inputs=given, rows=rows) if given else acts
    else:
        acts = replace(acts, inputs=names(inputs))
        if acts.inputs and acts.control is None:
            raise TypeError("inputs: values of each, or names and a `control` that decides")
    return None if acts.is_empty else acts.core()


def statics(model: Any, **options: Any) -> Result:
    """Equilibria of a model along the time of its loads.

    Parameters
    ----------
    model : as of :func:`simulate`.
    options : those of :func:`simulate`, but ``scheme``.

    Returns
    -------
    Result
        With ``t`` the time of the loads, and ``residuals["unstable"]``.
    """
    return simulate(model, scheme="static", **options)


def _teller(progress: Progress) -> tuple[Callable[[int, int], object] | None, Callable[[], object]]:
    """What is called, and what ends it."""
    if progress is None or progress is False:
        return None, lambda: None
    if progress is not True:
        return progress, lambda: None
    try:
        from tqdm.auto import tqdm  # type: ignore[import-not-found,import-untyped,unused-ignore]
    except ImportError:
        return lambda step, of: print(f"\rstep {step} of {of}", end="", flush=True), print
    bar = tqdm(total=1, unit="step")

    def tell(step: int, of: int) -> None:
        bar.total, bar.n = of, step
        bar.refresh()

    return tell, bar.close
