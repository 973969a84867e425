"""The other verbs of the program: their JSON as objects, their words as texts."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from os import PathLike, fspath
from pathlib import Path
from tempfile import NamedTemporaryFile
from typing import Any

from . import _core
from ._answer import Answer, interruptible
from ._errors import no_panic
from ._model import Model, model_of
from ._spec import Spec


@no_panic
def check(model: Any) -> Answer:
    """What ``holonom check`` finds: degrees of freedom, redundant joints by name, warnings.

    Parameters
    ----------
    model : as of :func:`simulate`.

    Returns
    -------
    Answer

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
def verify(
    model: Any, *, accuracy: float = 1e-6, progress: Callable[[str], object] | None = None
) -> Answer:
    """Measures what the schemes promise on this model: orders, invariants, errors.

    Parameters
    ----------
    model : as of :func:`simulate`.
    accuracy : for which steps are recommended, relative.
    progress : called with words as each part begins; it may raise.

    Returns
    -------
    Answer

    Raises
    ------
    InvalidModel, AnalysisFailed
    ValueError
        For an accuracy that cannot be.
    """
    if not 1e-14 <= accuracy < 1.0:
        raise ValueError(f"accuracy: a number from 1e-14 to 1, not {accuracy}")
    whole = model_of(model)._core
    return Answer(*interruptible(lambda tell: _core.verify(whole, accuracy, tell), progress))


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
    model : as of :func:`simulate`.
    schemes, steps (s), orders : what is compared; without them those of ``holonom compare``.
    end : s.
    progress : called with words as each part begins; it may raise.

    Returns
    -------
    Answer

    Raises
    ------
    InvalidModel, AnalysisFailed
    """
    whole = model_of(model)._core
    given = list(schemes), list(steps), list(orders)
    return Answer(*interruptible(lambda tell: _core.compare(whole, *given, end, tell), progress))


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
    source: str | PathLike[str],
    *,
    joints: Mapping[str, float] | None = None,
    free_base: bool = False,
    density: float | None = None,
    repair_inertia: bool = False,
    armature: bool = True,
    actuators: bool = False,
    contacts: bool = False,
    step: float | None = None,
    end: float = 1.0,
) -> Imported:
    """The model of a robot: URDF or MJCF.

    Parameters
    ----------
    source : the file, or its text; files that a text names are looked for in the current folder.
    joints : initial coordinates of joints, m or rad.
    free_base, density (kg/m³), repair_inertia, armature, actuators, contacts : as of ``holonom import``.
    step, end : s.

    Returns
    -------
    Imported

    Raises
    ------
    ImportFailed
    """
    given = list((joints or {}).items())
    options: dict[str, Any] = {"free_base": free_base, "density": density, "step": step, "end": end}
    options |= {"joints": given, "repair_inertia": repair_inertia}
    options |= {"flags": [armature, actuators, contacts]}
    if isinstance(source, str) and source.lstrip().startswith("<"):
        with NamedTemporaryFile("w", suffix=".xml", dir=".", encoding="utf-8") as file:
            file.write(source)
            file.flush()
            text, remarks = _core.import_robot(file.name, **options)
        folder = Path()
    else:
        text, remarks = _core.import_robot(fspath(source), **options)
        folder = Path(source).parent
    return Imported(Model.from_toml(text, folder), text, remarks)


def view(what: Any) -> None:
    """Shows a page: in a notebook in a frame, elsewhere in the browser.

    Parameters
    ----------
    what : a folder of a run, a :class:`Result`, or what :func:`modes` and the like found.

    Raises
    ------
    TypeError
        For what has no page.
    """
    if isinstance(what, (str, PathLike)):
        from ._result import open_folder

        what = open_folder(what)
    if not hasattr(what, "view"):
        raise TypeError(f"view: a folder, a result or an analysis, not {type(what).__name__}")
    what.view()


@no_panic
def schema(section: str | None = None) -> dict[str, Any]:
    """The JSON schema of model files.

    Parameters
    ----------
    section : one alone, ``"joint"``.

    Returns
    -------
    dict

    Raises
    ------
    UnknownName
    """
    from ._result import unknown

    whole = _core.schema()
    if section is None:
        return whole
    found = whole["properties"].get(section)
    if found is None:
        raise unknown(section, list(whole["properties"]))
    reference = found.get("items", found).get("$ref", "")
    definition: dict[str, Any] = whole["$defs"].get(reference.rsplit("/", 1)[-1], found)
    return definition
