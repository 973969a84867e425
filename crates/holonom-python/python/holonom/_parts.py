"""What the sections of a model are made of: handles of parts, values of keys."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias, Union

import numpy as np

from ._errors import UnknownName

Number: TypeAlias = Union[float, int, str, "np.generic"]
"""A number, or an expression of parameters."""
Integer: TypeAlias = Union[int, "np.integer[Any]"]
if TYPE_CHECKING:
    from numpy.typing import NDArray

    Vector: TypeAlias = Union[Sequence[Number], NDArray[Any]]
    Matrix: TypeAlias = Union[Sequence[Sequence[Number]], NDArray[Any], Sequence[NDArray[Any]]]
Name: TypeAlias = Union[str, "Part"]
"""The name of a part, or its handle."""


class Part:
    """A part of a model: its attributes are the keys of its section.

    It stands wherever the name of the part can. A key that is set to ``None`` is removed. Names of
    keys that are words of Python have a ``_`` behind them: ``from_``.
    """

    __slots__ = ("_keys",)

    def __init__(self, keys: dict[str, Any]) -> None:
        object.__setattr__(self, "_keys", keys)

    def to_dict(self) -> dict[str, Any]:
        """The keys that are stated, with their values.

        Returns
        -------
        dict
        """
        return plain(self._keys)  # type: ignore[no-any-return]

    def __getattr__(self, key: str) -> Any:
        if key.startswith("__"):
            raise AttributeError(key)
        return self._keys.get(key.removesuffix("_"))

    def __setattr__(self, key: str, value: Any) -> None:
        self[key.removesuffix("_")] = value

    def __getitem__(self, key: Any) -> Any:
        return self._keys[key]

    def __setitem__(self, key: str, value: Any) -> None:
        if value is None:
            self._keys.pop(key, None)
        else:
            self._keys[key] = value

    def __str__(self) -> str:
        return str(self._keys.get("name", self._keys.get("file", "")))

    def __format__(self, form: str) -> str:
        return format(str(self), form)

    def __repr__(self) -> str:
        return f"<holonom.{type(self).__name__} {str(self)!r}>"

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._keys,)


class BeamPart(Part):
    """A beam: ``beam.start``, ``beam.end`` and ``beam[7]`` are the names of its nodes."""

    __slots__ = ()

    @property
    def start(self) -> str:
        """The name of its first node; what is set is how the ground holds it."""
        return f"{self}.start"

    @start.setter
    def start(self, value: str | None) -> None:
        self["start"] = value

    @property
    def end(self) -> str:
        """The name of its last node; what is set is how the ground holds it."""
        return f"{self}.end"

    @end.setter
    def end(self, value: str | None) -> None:
        self["end"] = value

    def __getitem__(self, key: Any) -> Any:
        return f"{self}.{key}" if isinstance(key, int) else super().__getitem__(key)


class Parts(Mapping[str, Part]):
    """The parts of a section by their names."""

    def __init__(self, parts: list[Part], what: str) -> None:
        self._parts, self._what = parts, what

    def __getitem__(self, name: str) -> Part:
        for part in self._parts:
            if str(part) == str(name):
                return part
        import difflib

        names = list(self)
        near = difflib.get_close_matches(str(name), names, 1)
        remedy = f"did you mean `{near[0]}`?" if near else f"there are: {', '.join(names) or 'none'}"
        raise UnknownName(f"there is no {self._what} named `{name}`", remedy)

    def __iter__(self) -> Iterator[str]:
        return iter([str(part) for part in self._parts])

    def __len__(self) -> int:
        return len(self._parts)

    def __repr__(self) -> str:
        return f"<holonom.Parts {', '.join(self)}>"


class Sections:
    """The sections of a model that is being written."""

    model: Part
    """Keys of the header ``[model]``."""
    simulation: Part
    """Keys of ``[simulation]``."""
    parameters: dict[str, Number]
    """Numbers that expressions name."""

    def _begin(self, model: Mapping[str, Any], simulation: Mapping[str, Any]) -> None:
        self.model, self.simulation, self.parameters = Part(stated(model)), Part(stated(simulation)), {}
        self._parts: dict[str, list[Part]] = {}
        self._alone: set[str] = set()

    def _add(self, section: str, given: Mapping[str, Any]) -> Part:
        part = Part(stated(given))
        self._parts.setdefault(section, []).append(part)
        return part

    def _set(self, section: str, given: Mapping[str, Any]) -> Part:
        part = Part(stated(given))
        self._parts[section] = [part]
        self._alone.add(section)
        return part

    def _add_beam(self, section: str, given: Mapping[str, Any]) -> BeamPart:
        part = BeamPart(stated(given))
        self._parts.setdefault(section, []).append(part)
        return part

    @staticmethod
    def _align(given: dict[str, Any], along: Vector | None) -> None:
        if along is not None:
            if given.get("quaternion") is not None:
                raise ValueError("along: the orientation is stated by `quaternion`, too: leave one out")
            given["quaternion"] = turned(along)


def stated(given: Mapping[str, Any]) -> dict[str, Any]:
    """The keys that have a value."""
    return {key: value for key, value in given.items() if value is not None}


def plain(value: Any) -> Any:
    """A value with names in the place of handles."""
    if isinstance(value, Part):
        return str(value)
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray) and value.dtype != object:
        return value
    if isinstance(value, (list, tuple, np.ndarray)):
        return [plain(item) for item in value]
    return value


def turned(along: Vector) -> list[float]:
    """The unit quaternion ``w, x, y, z`` of the shortest rotation of the third axis to a direction."""
    direction = np.asarray(along, dtype=np.float64)
    length = float(np.linalg.norm(direction)) if direction.shape == (3,) else 0.0
    if not (length > 0.0 and math.isfinite(length)):
        raise ValueError(f"along: a direction of 3 numbers that are not all zero, not {along!r}")
    x, y, z = (float(part) / length for part in direction)
    if z < -1.0 + 1e-12:
        return [0.0, 1.0, 0.0, 0.0]
    w = math.sqrt(0.5 * (1.0 + z))
    return [w, -0.5 * y / w, 0.5 * x / w, 0.0]
