"""The other verbs of the program: their JSON as objects, their words as texts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from . import _core
from ._errors import no_panic
from ._model import Model, model_of
from ._spec import Spec


T = TypeVar("T")


class Answer(Mapping[str, Any]):
    """What a verb found: the JSON that the program prints, and its words.

    ``answer["dof"]`` is a value, ``answer.to_dict()`` all of them, ``str(answer)`` the text.
    """

    def __init__(self, found: dict[str, Any], text: str) -> None:
        self._found, self.text = found, text

    def to_dict(self) -> dict[str, Any]:
        """The object of ``--json``."""
        return self._found

    def __getitem__(self, key: str) -> Any:
        return self._found[key]

    def __iter__(self) -> Any:
        return iter(self._found)

    def __len__(self) -> int:
        return len(self._found)

    def __str__(self) -> str:
        return self.text

    def _repr_html_(self) -> str:
        from html import escape

        return f"<pre>{escape(self.text)}</pre>"


class Modes(Answer):
    """Modes about a configuration: vibrations, decays, what is unstable."""

    def _of(self, key: str) -> NDArray[np.float64]:
        return np.array([mode[key] for mode in self["modes"]], dtype=np.float64)

    @property
    def frequencies(self) -> NDArray[np.float64]:
        """Hz, shape ``(modes,)``; zero of what does not vibrate."""
        return self._of("frequency")

    @property
    def members(self) -> list[str]:
        """Names of the members that :attr:`shapes` list."""
        first = self["modes"][:1]
        return [own["name"] for mode in first for own in mode["shape"]]

    @property
    def shapes(self) -> NDArray[np.float64]:
        """How members move, shape ``(modes, members, 6)``: displacement and rotation in space; the
        largest displacement is 1 m, without displacements the largest rotation 1 rad."""
        rows = [[own["translation"] + own["rotation"] for own in mode["shape"]] for mode in self["modes"]]
        return np.array(rows, dtype=np.float64).reshape(len(rows), -1, 6)

    @property
    def damping(self) -> NDArray[np.float64]:
        """Damping ratios, shape ``(modes,)``."""
        return self._of("damping_ratio")


@no_panic
def check(model: Any) -> Answer:
    """What ``holonom check`` finds: degrees of freedom, redundant joints by name, warnings.

    Raises
    ------
    InvalidModel

    Examples
    --------
    >>> found = check({
    ...     "model": {"name": "free"},
    ...     "body": [{"name": "stone", "mass": 1.0, "inertia": [1.0, 1.0, 1.0]}],
    ...     "simulation": {"step": 0.1, "end": 1.0},
    ... })
    >>> found["assembly"]["dof"]
    6
    """
    return Answer(*_core.check(model_of(model)._core))


@no_panic
def modes(model: Any, *, at: str = "start", count: int = 10) -> Modes:
    """Small vibrations about the start, an equilibrium (``"static"``), a steady rotation or motion.

    Parameters
    ----------
    model : as of :func:`simulate`.
    at : ``"start"``, ``"static"``, ``"rotation"`` or ``"motion"``.
    count : how many, beside what is unstable.

    Raises
    ------
    InvalidModel, AnalysisFailed
    """
    whole = model_of(model)._core
    return Modes(*_interruptible(lambda: _core.modes(whole, at, count)))


@no_panic
def verify(
    model: Any, *, accuracy: float = 1e-6, progress: Callable[[str], object] | None = None
) -> Answer:
    """Measures what the schemes promise on this model: orders, invariants, errors.

    Parameters
    ----------
    accuracy : for which steps are recommended, relative.
    progress : called with words as each part begins; it may raise.
    """
    whole = model_of(model)._core
    return Answer(*_interruptible(lambda: _core.verify(whole, accuracy, progress)))


@no_panic
def compare(
    model: Any,
    *,
    schemes: Sequence[str] = (),
    steps: Sequence[float] = (),
    orders: Sequence[int] = (),
    end: float | None = None,
    progress: Callable[[str], object] | None = None,
) -> Answer:
    """Schemes side by side: errors, invariants, effort.

    Parameters
    ----------
    schemes, steps (s), orders : what is compared; without them those of ``holonom compare``.
    end : s.
    progress : called with words as each part begins; it may raise.
    """
    whole = model_of(model)._core
    given = list(schemes), list(steps), list(orders)
    return Answer(*_interruptible(lambda: _core.compare(whole, *given, end, progress)))


def _interruptible(call: Callable[[], T]) -> T:
    """What a call without a place to stop gives; Ctrl-C is heard, and leaves it to end unheard."""
    import threading

    if threading.current_thread() is not threading.main_thread():
        return call()
    found: list[T] = []
    raised: list[BaseException] = []

    def go() -> None:
        try:
            found.append(call())
        except BaseException as error:
            raised.append(error)

    thread = threading.Thread(target=go, daemon=True)
    thread.start()
    while thread.is_alive():
        thread.join(0.05)
    if raised:
        raise raised[0]
    return found[0]


@dataclass(frozen=True)
class Imported:
    """A model of a robot description.

    Attributes
    ----------
    model : the model.
    spec : its description, which can be changed.
    text : its model file, with comments.
    remarks : what has no counterpart, with the line of the file.
    """

    model: Model
    text: str
    remarks: list[str] = field(default_factory=list)

    @property
    def spec(self) -> Spec:
        """A description of the model, which can be changed; another one each time."""
        found: Spec = self.model.spec()
        return found


@no_panic
def import_robot(
    path: str | PathLike[str],
    *,
    joints: Mapping[str, float] | None = None,
    free_base: bool = False,
    density: float | None = None,
    repair_inertia: bool = False,
    step: float | None = None,
    end: float = 1.0,
) -> Imported:
    """The model of a robot: URDF or MJCF.

    Parameters
    ----------
    path : the file.
    joints : initial coordinates of joints, m or rad.
    free_base, density (kg/m³), repair_inertia : as of ``holonom import``.
    step, end : s.

    Raises
    ------
    ImportFailed
    """
    given = list((joints or {}).items())
    options: dict[str, Any] = {"free_base": free_base, "density": density, "step": step, "end": end}
    text, remarks = _core.import_robot(
        fspath(path), joints=given, repair_inertia=repair_inertia, **options
    )
    return Imported(Model.from_toml(text, Path(path).parent), text, remarks)


def schema(section: str | None = None) -> dict[str, Any]:
    """The JSON schema of model files, or of one section: ``schema("joint")``."""
    whole = _core.schema()
    if section is None:
        return whole
    found = whole["properties"].get(section)
    if found is None:
        raise KeyError(f"there is no section `{section}`: {', '.join(whole['properties'])}")
    reference = found.get("items", found).get("$ref", "")
    definition: dict[str, Any] = whole["$defs"].get(reference.rsplit("/", 1)[-1], found)
    return definition
