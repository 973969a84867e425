"""Values of Python as TOML text. Floats keep all bits."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

_BARE = frozenset("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-")


def value(given: Any) -> str:
    """A number, a truth, a text, or lists, arrays and dictionaries of them, as TOML."""
    if isinstance(given, np.ndarray):
        given = given.tolist()
    elif isinstance(given, np.generic):
        given = given.item()
    if isinstance(given, bool):
        return "true" if given else "false"
    if isinstance(given, int):
        return str(given)
    if isinstance(given, float):
        return _float(given)
    if isinstance(given, str):
        return _text(given)
    if isinstance(given, Mapping):
        pairs = (f"{_key(key)} = {value(item)}" for key, item in given.items())
        return "{ " + ", ".join(pairs) + " }"
    if isinstance(given, Sequence):
        return "[" + ", ".join(value(item) for item in given) + "]"
    raise TypeError(f"a {type(given).__name__} is no value of a model: {given!r}")


def document(given: Mapping[str, Any]) -> str:
    """The sections of a model, each on a line of its own."""
    if not isinstance(given, Mapping):
        raise TypeError(f"a model is a dictionary of sections, not a {type(given).__name__}")
    return "".join(f"{_key(key)} = {value(item)}\n" for key, item in given.items())


def file(sections: Mapping[str, Any]) -> str:
    """A model file: tables for sections, a line for each key."""
    parts = []
    for name, section in sections.items():
        if isinstance(section, Mapping):
            parts.append(_table(f"[{_key(name)}]", section))
        elif section and all(isinstance(part, Mapping) for part in section):
            parts += [_table(f"[[{_key(name)}]]", part) for part in section]
        else:
            parts.insert(0, f"{_key(name)} = {value(section)}\n")
    return "\n".join(parts)


def _table(head: str, keys: Mapping[str, Any]) -> str:
    return head + "\n" + "".join(f"{_key(key)} = {value(item)}\n" for key, item in keys.items())


def pairs(given: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Keys with the text of their values."""
    return [(key, value(item)) for key, item in given.items()]


def _float(given: float) -> str:
    if math.isfinite(given):
        return repr(given)
    return "nan" if math.isnan(given) else "inf" if given > 0 else "-inf"


def _key(key: Any) -> str:
    if not isinstance(key, str):
        raise TypeError(f"a key is a text, not {key!r}")
    return key if key and _BARE.issuperset(key) else _text(key)


def _text(given: str) -> str:
    from json import dumps

    return dumps(given, ensure_ascii=False).replace("\x7f", "\\u007f")
