"""Exceptions. All are ``HolonomError``, have the words of the program and can be pickled."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import wraps
from types import FunctionType
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

if TYPE_CHECKING:
    from ._result import Result

P = ParamSpec("P")
T = TypeVar("T")


class HolonomWarning(UserWarning):
    """What is worth knowing of a model or a run."""


class HolonomError(Exception):
    """Any failure of this package.

    Attributes
    ----------
    message : what failed.
    remedy : what to do instead, where that is known.
    """

    def __init__(self, message: str, remedy: str = "") -> None:
        super().__init__(message, remedy)
        self.message = message
        self.remedy = remedy

    def __str__(self) -> str:
        return f"{self.message}\n  help: {self.remedy}" if self.remedy else self.message


@dataclass(frozen=True)
class Problem:
    """One thing that is wrong with a model.

    Attributes
    ----------
    message : what is wrong.
    key : where, by names: ``body.top.mass``; empty for the model as a whole.
    help : what to write instead.
    file, line, column : where it stands in a text; ``None`` of values that were set.
    set : the value that was set, ``KEY=VALUE``.
    """

    message: str
    key: str = ""
    help: str | None = None
    file: str | None = None
    line: int | None = None
    column: int | None = None
    set: str | None = None

    def __str__(self) -> str:
        place = ":".join(str(part) for part in (self.file, self.line, self.column) if part)
        head = ": ".join(part for part in (place, self.key, self.message) if part)
        head += f" (set: {self.set})" if self.set else ""
        return f"{head}\n  help: {self.help}" if self.help else head


class InvalidModel(HolonomError, ValueError):
    """A text that is no valid model.

    Attributes
    ----------
    problems : all that is wrong.
    """

    def __init__(self, problems: Sequence[dict[str, Any] | Problem]) -> None:
        found = [p if isinstance(p, Problem) else Problem(**p) for p in problems]
        super().__init__("\n".join(str(problem) for problem in found))
        self.problems = found

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.problems,)


class RunFailed(HolonomError, RuntimeError):
    """A run that did not reach its end.

    Attributes
    ----------
    step, t : the step, and its time in s.
    message, remedy : what failed where, and what helps.
    reason : why.
    result : what was recorded up to there, where there is any.
    """

    def __init__(
        self, step: int, t: float, message: str, remedy: str, result: Result | None = None
    ) -> None:
        super().__init__(f"the run failed in step {step}, at t = {t:g} s: {message}", remedy)
        self.step, self.t, self.reason, self.result = step, t, message, result

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.step, self.t, self.reason, self.remedy, self.result)


class StateMismatch(HolonomError, ValueError):
    """A state of another model, or no state."""


class UnknownName(HolonomError, KeyError):
    """A name that is none of the model or of a result."""

    __str__ = HolonomError.__str__


class OutputExists(HolonomError, FileExistsError):
    """Files stand where others would be written."""

    __str__ = HolonomError.__str__


class OutputFailed(HolonomError, OSError):
    """A file cannot be read or written."""

    __str__ = HolonomError.__str__


class MemoryLack(HolonomError, MemoryError):
    """More memory is needed than there is."""

    def __new__(cls, *args: object) -> MemoryLack:
        """As other exceptions are made: that of ``MemoryError`` refuses its heirs, for instance where
        tblib, which Dask brings, reads a pickle."""
        return Exception.__new__(cls, *args)


class FunctionFailed(HolonomError, ValueError):
    """A function that acts on a run gave what is no finite number; with its name and arguments."""


class AnalysisFailed(HolonomError, ValueError):
    """There is no such analysis of this model."""


class ImportFailed(HolonomError, ValueError):
    """A robot description that cannot be translated.

    Attributes
    ----------
    first : what failed.
    problems : the reasons.
    """

    def __init__(self, message: str, problems: Sequence[str] = ()) -> None:
        super().__init__("\n".join([message, *problems]))
        self.first, self.problems = message, list(problems)

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self.first, self.problems)


class MissingPackage(HolonomError, ImportError):
    """A package that this function needs is not installed."""

    __str__ = HolonomError.__str__


def needed(package: str, extra: str) -> Any:
    """The module of an optional package.

    Raises
    ------
    MissingPackage
        With the command that installs it.
    """
    from importlib import import_module

    try:
        return import_module(package)
    except ImportError as error:
        name = package.partition(".")[0]
        remedy = f"pip install {name}, or holonom with the extra [{extra}]"
        raise MissingPackage(f"this needs the package {name}: {error}", remedy) from error


class InternalError(HolonomError):
    """A panic: a defect of this package."""


def as_error(error: BaseException) -> BaseException:
    """A panic of Rust as an :class:`InternalError`; another exception as it is."""
    if type(error).__name__ != "PanicException":
        return error
    remedy = "this is a defect of holonom: please report it with the model"
    return InternalError(f"internal error: {error}", remedy)


def no_panic(function: Callable[P, T]) -> Callable[P, T]:
    """The function with a panic of Rust as an :class:`InternalError`."""

    @wraps(function)
    def safe(*args: P.args, **kwargs: P.kwargs) -> T:
        try:
            return function(*args, **kwargs)
        except BaseException as error:
            if type(error).__name__ != "PanicException":
                raise
            raise as_error(error) from None

    return safe


def guarded(*but: str) -> Callable[[type[T]], type[T]]:
    """A class whose methods and properties raise a panic of Rust as an :class:`InternalError`.

    ``but`` names those that do so by themselves, since they are called once a step.
    """

    def of(kind: type[T]) -> type[T]:
        for name, member in list(vars(kind).items()):
            if name in but:
                continue
            if isinstance(member, property):
                read, write = (own and no_panic(own) for own in (member.fget, member.fset))
                setattr(kind, name, property(read, write, None, member.__doc__))
            elif isinstance(member, classmethod):
                setattr(kind, name, classmethod(no_panic(member.__func__)))
            elif isinstance(member, FunctionType):
                setattr(kind, name, no_panic(member))
        return kind

    return of
