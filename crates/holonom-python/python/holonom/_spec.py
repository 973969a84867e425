"""A model that is written in Python."""

from __future__ import annotations

import copy
from collections.abc import Iterator, Mapping
from os import PathLike, fspath
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import _core, _toml
from ._errors import no_panic
from ._model import Model
from ._parts import BeamPart, Part, Parts, plain, stated
from ._sections import Builder

if TYPE_CHECKING:
    from ._parts import Vector

PLURALS = {"body": "bodies", "bushing": "bushings"}


class Spec(Builder):
    """A description of a model that can be changed: the sections of a model file.

    Each section has a method whose keywords are the keys of the section, and a mapping of its parts
    by their names: ``spec.bodies``, ``spec.joints``, ``spec.beams``, … The methods return handles
    that stand wherever a name can, and whose attributes are the keys. Nothing is checked but by
    :meth:`compile`, by the program, with its words. Numbers keep all bits.

    Examples
    --------
    >>> spec = Spec("swing", gravity=[0, 0, -9.81], step=0.01, end=1.0)
    >>> arm = spec.body("arm", shape=rod(1.0, 0.02, density=7800), position=[0.5, 0, 0], along=[1, 0, 0])
    >>> hinge = spec.joint("hinge", "revolute", "ground", arm, position=[0, 0, 0], axis=[0, 1, 0])
    >>> hinge.rate = 2.0
    >>> spec.compile().steps
    100
    """

    folder: Path | None = None
    """Where included files, tables and meshes are looked for."""
    meshes: list[tuple[str, bytes]] = []  # noqa: RUF012  replaced, never changed
    """Meshes that are known, with their bytes."""

    def __getattr__(self, name: str) -> Parts:
        if not name.startswith("_") and name.endswith("s"):
            section = next((one for one, many in PLURALS.items() if many == name), name[:-1])
            if callable(getattr(Builder, section, None)):
                return Parts(self._parts.get(section, []), section)
        raise AttributeError(f"a Spec has no `{name}`")

    def __dir__(self) -> list[str]:
        sections = [name for name in vars(Builder) if not name.startswith("_")]
        return [*super().__dir__(), *(PLURALS.get(name, f"{name}s") for name in sections)]

    @classmethod
    def read(cls, path: str | PathLike[str]) -> Spec:
        """The description in a model file, as it is written there: parameters, expressions and
        files that it includes stay what they are.

        Parameters
        ----------
        path : the file.

        Returns
        -------
        Spec

        Raises
        ------
        InvalidModel
            Of a file that is no model file.
        """
        import tomllib

        from ._model import load

        place = Path(path)

        try:
            found = tomllib.loads(place.read_text(encoding="utf-8"))
        except (tomllib.TOMLDecodeError, UnicodeDecodeError, OSError):
            load(place)  # says why
            raise
        return cls.from_dict(found, place.parent)

    @classmethod
    def from_dict(cls, sections: Mapping[str, Any], folder: str | PathLike[str] | None = None) -> Spec:
        """The description of a dictionary of sections.

        Parameters
        ----------
        sections : such as those of ``Model.to_dict()``.
        folder : where included files and meshes are looked for.

        Returns
        -------
        Spec
        """
        spec = cls("")
        rest = copy.deepcopy(dict(sections))
        spec.model, spec.simulation = Part(rest.pop("model", {})), Part(rest.pop("simulation", {}))
        spec.parameters = rest.pop("parameters", {})
        for section, parts in rest.items():
            if isinstance(parts, Mapping):
                spec._set(section, parts)
                continue
            kind = BeamPart if section == "beam" else Part
            entries = [{"file": part} if isinstance(part, str) else part for part in parts]
            spec._parts[section] = [kind(entry) for entry in entries]
        spec.folder = None if folder is None else Path(folder)
        return spec

    def to_dict(self) -> dict[str, Any]:
        """The sections as a dictionary, as a model file has them.

        Returns
        -------
        dict
        """
        found: dict[str, Any] = {"model": self.model.to_dict(), "simulation": self.simulation.to_dict()}
        if self.parameters:
            found["parameters"] = plain(self.parameters)
        for section, parts in self._parts.items():
            if parts:
                found[section] = [part.to_dict() for part in parts]
            if section in self._alone and parts:
                found[section] = parts[0].to_dict()
        return found

    def to_toml(self) -> str:
        """The text of the model file.

        Returns
        -------
        str
        """
        return _toml.file(self.to_dict())

    def compile(self) -> Model:
        """The model.

        Returns
        -------
        Model

        Raises
        ------
        InvalidModel
            With every problem, its key, and what to write instead.
        """
        return self._compiled(self.to_toml())

    @no_panic
    def _compiled(self, text: str) -> Model:
        folder = None if self.folder is None else fspath(self.folder)
        return Model(_core.Model.parse(text, folder, [], self.meshes, []))

    def check(self) -> Any:
        """What ``holonom check`` finds: :func:`holonom.check`.

        Returns
        -------
        Answer
        """
        from ._verbs import check

        return check(self)

    def save(self, path: str | PathLike[str]) -> None:
        """Writes the model file; one that is no valid model is refused.

        Parameters
        ----------
        path : the file; files that the model names are looked for beside it.

        Raises
        ------
        InvalidModel
        """
        Path(path).parent.mkdir(parents=True, exist_ok=True)
        text = self.to_toml()
        self._compiled(text)
        Path(path).write_text(text, encoding="utf-8")

    def copy(self) -> Spec:
        """Another one with the same parts.

        Returns
        -------
        Spec
        """
        return copy.deepcopy(self)

    def remove(self, part: Part | str) -> None:
        """Removes a part; what names it still does.

        Parameters
        ----------
        part : the part or its name.

        Raises
        ------
        KeyError
            For a part that there is not.
        """
        for parts in self._parts.values():
            for k, own in enumerate(parts):
                if own is part or (isinstance(part, str) and str(own) == part):
                    del parts[k]
                    return
        raise KeyError(f"there is no `{part}`")

    def __iter__(self) -> Iterator[Part]:
        """All parts, section by section."""
        return (part for parts in self._parts.values() for part in parts)

    def __repr__(self) -> str:
        counts = (f"{len(parts)} {name}" for name, parts in self._parts.items() if parts)
        return f"<holonom.Spec {str(self.model)!r}: {', '.join(counts) or 'empty'}>"

    def __reduce__(self) -> tuple[Any, ...]:
        folder = None if self.folder is None else fspath(self.folder)
        return _rebuilt, (self.to_dict(), folder, self.meshes)

    def __deepcopy__(self, memo: dict[int, Any]) -> Spec:
        return _rebuilt(self.to_dict(), self.folder, self.meshes)


def _rebuilt(
    sections: dict[str, Any], folder: str | Path | None, meshes: list[tuple[str, bytes]]
) -> Spec:
    spec = Spec.from_dict(sections, folder)
    spec.meshes = meshes
    return spec


def box(x: float, y: float, z: float, *, density: float | None = None) -> dict[str, Any]:
    """A shape: a box.

    Parameters
    ----------
    x, y, z : its edges along the axes of the body, m.
    density : kg/m³.

    Returns
    -------
    dict
    """
    return _shape("box", [x, y, z], density)


def cylinder(radius: float, height: float, *, density: float | None = None) -> dict[str, Any]:
    """A shape: a cylinder about the third axis of the body.

    Parameters
    ----------
    radius, height : m.
    density : kg/m³.

    Returns
    -------
    dict
    """
    return _shape("cylinder", [radius, height], density)


def sphere(radius: float, *, density: float | None = None) -> dict[str, Any]:
    """A shape: a sphere.

    Parameters
    ----------
    radius : m.
    density : kg/m³.

    Returns
    -------
    dict
    """
    return _shape("sphere", [radius], density)


def rod(length: float, radius: float, *, density: float | None = None) -> dict[str, Any]:
    """A shape: a slender cylinder along the third axis of the body.

    Parameters
    ----------
    length, radius : m.
    density : kg/m³.

    Returns
    -------
    dict
    """
    return _shape("rod", [length, radius], density)


def rectangle(width: float, height: float) -> dict[str, Any]:
    """An outline of a section: a rectangle.

    Parameters
    ----------
    width, height : along ``d_1`` and along ``d_2``, m.

    Returns
    -------
    dict
    """
    return {"type": "rectangle", "dimensions": [width, height]}


def circle(radius: float) -> dict[str, Any]:
    """An outline of a section: a disc.

    Parameters
    ----------
    radius : m.

    Returns
    -------
    dict
    """
    return {"type": "circle", "dimensions": [radius]}


def tube(outer: float, inner: float) -> dict[str, Any]:
    """An outline of a section: a ring.

    Parameters
    ----------
    outer, inner : its radii, m.

    Returns
    -------
    dict
    """
    return {"type": "tube", "dimensions": [outer, inner]}


def section(
    shape: Mapping[str, Any],
    *,
    E: float,
    density: float,
    nu: float | None = None,
    G: float | None = None,
    **keys: Any,
) -> dict[str, Any]:
    """The section of a beam of an outline and a material.

    Parameters
    ----------
    shape : an outline: :func:`rectangle`, :func:`circle`, :func:`tube`.
    E, G : Young's modulus and shear modulus, Pa.
    nu : Poisson's ratio, 1, in the place of ``G``.
    density : kg/m³.
    keys : other keys of a section: ``damping``, ``shear_factors``, …

    Returns
    -------
    dict
    """
    material = stated({"E": E, "G": G, "nu": nu, "density": density})
    return {"shape": dict(shape), "material": material, **keys}


def _shape(kind: str, dimensions: Vector, density: float | None) -> dict[str, Any]:
    return stated({"type": kind, "dimensions": dimensions, "density": density})
