"""Models: valid, immutable, picklable."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from os import PathLike, fspath
from typing import TYPE_CHECKING, Any

from . import _core, _toml
from ._errors import OutputExists, OutputFailed, guarded, no_panic

if TYPE_CHECKING:
    from ._answer import Answer

ModelLike = "Model | Spec | str | PathLike[str] | Mapping[str, Any]"
"""What stands for a model: one, a description, the path of a file, or a dictionary of sections."""


@guarded()
class Model:
    """A valid model.

    It does not change: :meth:`replace` gives another one. It can be pickled and shared among
    threads.
    """

    __slots__ = ("_core",)

    def __init__(self, core: _core.Model) -> None:
        self._core = core

    @classmethod
    def from_toml(cls, text: str, folder: str | PathLike[str] | None = None) -> Model:
        """The model of a text.

        Parameters
        ----------
        text : a model file.
        folder : where included files and meshes are looked for.

        Returns
        -------
        Model

        Raises
        ------
        InvalidModel

        Examples
        --------
        >>> model = Model.from_toml('''
        ... model = { name = "pendulum", dimension = 2, gravity = [0.0, -9.81] }
        ... particle = [{ name = "bob", mass = 1.0, position = [1.0, 0.0] }]
        ... bar = [{ name = "rod", from = "ground", to = "bob" }]
        ... simulation = { step = 0.01, end = 1.0 }
        ... ''')
        >>> model.name, model.steps
        ('pendulum', 100)
        """
        place = None if folder is None else fspath(folder)
        return cls(_core.Model.parse(text, place, [], [], []))

    @classmethod
    def from_dict(cls, sections: Mapping[str, Any], folder: str | PathLike[str] | None = None) -> Model:
        """The model of a dictionary of sections.

        Parameters
        ----------
        sections : as a model file has them; arrays are lists.
        folder : where included files and meshes are looked for.

        Returns
        -------
        Model
        """
        return cls.from_toml(_toml.document(sections), folder)

    def replace(self, values: Mapping[str, Any]) -> Model:
        """This model with values replaced: ``{"body.arm.mass": 2.5}``.

        Parameters
        ----------
        values : numbers, texts, lists and arrays by the keys of ``holonom run --set``.

        Returns
        -------
        Model

        Raises
        ------
        InvalidModel
        """
        return Model(self._core.replace(_toml.pairs(values)))

    def to_toml(self) -> str:
        """The text of this model, everything resolved.

        Returns
        -------
        str
        """
        return self._core.to_toml()

    def spec(self) -> Any:
        """This model as a description that can be changed, everything resolved.

        Returns
        -------
        Spec
        """
        import tomllib

        from ._spec import Spec

        spec = Spec.from_dict(tomllib.loads(self.to_toml()))
        spec.meshes = self._core.parts()[3]
        return spec

    def to_dict(self) -> dict[str, Any]:
        """The same as a dictionary of sections.

        Returns
        -------
        dict
        """
        found: dict[str, Any] = self._core.to_dict()
        return found

    def save(self, path: str | PathLike[str]) -> None:
        """Writes :meth:`to_toml` to a file.

        Parameters
        ----------
        path : the file.
        """
        from pathlib import Path

        Path(path).write_text(self.to_toml(), encoding="utf-8")

    def export_fmu(
        self,
        path: str | PathLike[str],
        *,
        fmi: int = 3,
        inputs: Sequence[str] = (),
        parameters: Sequence[str] = (),
        libraries: Sequence[str | PathLike[str]] = (),
        force: bool = False,
    ) -> Answer:
        """Writes a functional mock-up unit of this model, as ``holonom export-fmu``: a file that
        Simulink, Dymola, FMPy and other tools load as a block.

        Parameters
        ----------
        path : the file, ``crane.fmu``.
        fmi : the version of the standard, 3 or 2.
        inputs : more inputs than the joints with a motor and the signals that are numbers: joints,
            ``"joint.setpoint"``, bodies, signals.
        parameters : keys of numbers, ``"body.hook.mass"``, beside those of ``[parameters]``.
        libraries : of other platforms; by default that of the package.
        force : whether a file there is replaced.

        Returns
        -------
        Answer
            ``"inputs"``, ``"outputs"``, ``"parameters"`` with their units and starts, ``"platforms"``.

        Raises
        ------
        InvalidModel
            Of a model without motion, and of an input or a parameter that is none, with the nearest.
        OutputExists, OutputFailed
        """
        import os
        from pathlib import Path

        from ._answer import Answer

        to = Path(path)
        if to.exists() and not force:
            raise OutputExists(f"{to} exists", "choose another file, or force=True")
        order = {
            "version": fmi,
            "inputs": [str(name) for name in inputs],
            "parameters": [str(key) for key in parameters],
            "libraries": [fspath(file) for file in libraries],
            "package": str(Path(__file__).parent),
        }
        content, (found, words) = _core.export_fmu(self._core, str(to), order)
        part = to.with_name(f".{to.name}.{os.getpid()}")
        try:
            part.write_bytes(content)
            part.replace(to)
        except OSError as error:
            part.unlink(missing_ok=True)
            raise OutputFailed(f"{to}: {error.strerror}") from error
        return Answer(found, words)

    @property
    def name(self) -> str:
        """Its name."""
        return self._core.name

    @property
    def steps(self) -> int:
        """Number of steps to the end of its run."""
        return self._core.steps

    @property
    def settings(self) -> dict[str, Any]:
        """The section ``[simulation]``, resolved; a copy."""
        return dict(self.to_dict()["simulation"])

    def _named(self, section: str) -> dict[str, dict[str, Any]]:
        return {entry["name"]: entry for entry in self.to_dict().get(section, [])}

    @property
    def bodies(self) -> dict[str, dict[str, Any]]:
        """Bodies by their names, resolved; copies."""
        return self._named("body")

    @property
    def beams(self) -> dict[str, dict[str, Any]]:
        """Beams by their names; copies."""
        return self._named("beam")

    @property
    def particles(self) -> dict[str, dict[str, Any]]:
        """Point masses by their names; copies."""
        return self._named("particle")

    @property
    def joints(self) -> dict[str, dict[str, Any]]:
        """Joints by their names; copies."""
        return self._named("joint")

    @property
    def sensors(self) -> dict[str, dict[str, Any]]:
        """Sensors by their names; copies."""
        return self._named("sensor")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Model) and self._core.equals(other._core)

    def __hash__(self) -> int:
        return hash(self.to_toml())

    def __repr__(self) -> str:
        return f"<holonom.Model {self.name!r}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return _rebuilt, self._core.parts()


def _rebuilt(
    text: str,
    folder: str | None,
    values: list[tuple[str, str]],
    meshes: list[tuple[str, bytes]],
    texts: list[tuple[str, str]],
) -> Model:
    return Model(_core.Model.parse(text, folder, values, meshes, texts))


@no_panic
def load(path: str | PathLike[str], values: Mapping[str, Any] | None = None) -> Model:
    """Reads a model file with all that it includes.

    Parameters
    ----------
    path : the file.
    values : values that are replaced, as by :meth:`Model.replace`.

    Returns
    -------
    Model

    Raises
    ------
    InvalidModel
        With the file, the line and what to write instead.
    """
    return Model(_core.Model.read(fspath(path), _toml.pairs(values or {})))


def model_of(given: Any, values: Mapping[str, Any] | None = None) -> Model:
    """The model that is meant, with values replaced."""
    if isinstance(given, Model):
        return given.replace(values) if values else given
    if hasattr(given, "compile"):  # a Spec, which builds on this module
        compiled: Model = given.compile()
        return compiled.replace(values) if values else compiled
    if isinstance(given, Mapping):
        model = Model.from_dict(given)
        return model.replace(values) if values else model
    if isinstance(given, (str, PathLike)):
        return load(given, values)
    kind = type(given).__name__
    raise TypeError(f"a model is a Model, a Spec, the path of a file or a dictionary, not a {kind}")
