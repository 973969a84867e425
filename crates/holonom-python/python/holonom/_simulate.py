"""Runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from os import PathLike, fspath
from typing import Any

from . import _core
from ._errors import no_panic
from ._model import model_of
from ._result import Result, open_folder, told

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
) -> Result:
    """Runs a model from its start to its end.

    Parameters
    ----------
    model : a :class:`Model`, the path of a file, or a dictionary of sections.
    end, step, scheme, order, every, start : keys of ``[simulation]`` that are replaced; times in s.
    set : other values that are replaced: ``{"body.arm.mass": 2.5}``.
    record : which of ``"q"``, ``"energy"``, ``"sensors"``, ``"beams"``, ``"residuals"``,
        ``"momenta"`` are kept; all by default.
    out : a folder that gets the files of ``holonom run``; ``force`` replaces those there.
    checkpoint_every : steps between two checkpoints in ``out``.
    resume : a folder whose interrupted run goes on; the model is that of the folder.
    progress : called with steps taken and all steps about every 50 ms; ``True``: a bar of tqdm, or
        a line.
    on_failure : ``"raise"``, or ``"return"`` a result with ``failure`` up to there.

    Returns
    -------
    Result
        Arrays over the recorded nodes.

    Raises
    ------
    InvalidModel, RunFailed, OutputExists
    KeyboardInterrupt
        On Ctrl-C; a run with files has left a checkpoint.

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
    try:
        if resume is not None:
            _core.resume(fspath(resume), checkpoint_every, tell)
            return told(open_folder(resume), on_failure)
        keys = {"end": end, "step": step, "scheme": scheme, "order": order, "every": every}
        keys["start"] = start
        values = {f"simulation.{key}": value for key, value in keys.items() if value is not None}
        whole = model_of(model, {**values, **(set or {})})
        if out is None:
            kept = None if record is None else list(record)
            return told(Result(whole, _core.simulate(whole._core, kept, tell)), on_failure)
        try:
            _core.simulate_into(whole._core, fspath(out), force, checkpoint_every, tell)
        except KeyboardInterrupt as stopped:
            stopped.add_note(f"continue with holonom.simulate(None, resume={fspath(out)!r})")
            raise
        return told(open_folder(out), on_failure)
    finally:
        close()


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
