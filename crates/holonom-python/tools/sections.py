"""Writes ``python/holonom/_sections.py``, the methods of ``Spec``, from the schema of model files.

``HOLONOM_GUIDE=write`` with the tests of the package renews the file.
"""

from __future__ import annotations

import textwrap
from typing import Any

HEAD = '''"""The sections of a model as methods. Written from the schema of model files: do not edit."""

# ruff: noqa

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Literal

from ._parts import BeamPart, Part, Sections

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from ._parts import Integer, Matrix, Name, Number, Vector

__all__ = ["Builder"]


class Builder(Sections):
    """A method for each section of a model file; its keywords are the keys of the section."""
'''

LIST_SECTIONS = "body particle beam joint constraint bar spring bushing load law signal table event sensor frame include"
FIRST = ["name", "type", "parent", "child", "from", "to", "of", "mass", "position", "stiffness"]
"""Required keys that stand without their names, in this order."""
NAMES = {"parent", "child", "from", "to", "of", "on", "body", "beam", "joint", "relative_to", "seen_from"}
WORDS = {"from", "global", "import", "class", "def", "in", "is", "lambda", "pass"}
UNITS = {
    **dict.fromkeys(["along", "axis", "axis2", "elements", "freedoms", "matrix", "normal", "quaternion"], "1"),
    "limits": "m or rad",
    "bushing.force": "N and N·m",
    "table.axes": "of what takes and gives them",
    "table.points": "of what takes and gives them",
    "table.values": "of what takes them",
}
"""Units of arrays whose descriptions state none, by keys, or by sections and keys."""
WIDTH = 100


class Schema:
    """What the types of the schema are called here."""

    def __init__(self, whole: dict[str, Any]) -> None:
        self.whole, self.definitions = whole, whole["$defs"]

    def resolved(self, schema: dict[str, Any]) -> dict[str, Any]:
        """The definition that a reference names."""
        if "$ref" in schema:
            found: dict[str, Any] = self.definitions[schema["$ref"].rsplit("/", 1)[-1]]
            return found
        return schema

    def keys(self, section: str) -> tuple[str, dict[str, Any], list[str]]:
        """Description, keys and those that are required of a section."""
        found = self.whole["properties"][section]
        schema = self.resolved(found.get("items", found))
        description = schema.get("description", found.get("description", ""))
        for part in map(self.resolved, schema.get("anyOf", [])):
            schema = part if "properties" in part else schema
        kinds = schema.get("oneOf")
        if not kinds:
            return description, schema["properties"], schema.get("required", [])
        keys: dict[str, Any] = {}
        types = []
        for kind in kinds:
            types.append(kind["properties"]["type"]["const"])
            for key, value in kind["properties"].items():
                stated = [] if key not in keys else keys[key].setdefault("of", [])
                keys.setdefault(key, {**value, "of": stated})
                keys[key]["of"].append(types[-1])
                if keys[key].get("description", "") != value.get("description", ""):
                    keys[key]["more"] = [*keys[key].get("more", []), value.get("description", "")]
        keys["type"] = {"oneOf": [{"const": name} for name in types], "description": "Its kind."}
        for key, value in keys.items():
            own = value.pop("of", types)
            more = dict.fromkeys([value.get("description", ""), *value.pop("more", [])])
            words = " / ".join(more)
            value["description"] = words if len(own) == len(types) else f"{words} Of {', '.join(own)}."
        required = set.intersection(*(set(kind["required"]) for kind in kinds))
        return description, keys, [key for key in FIRST if key in required]

    def annotation(self, key: str, schema: dict[str, Any]) -> str:
        """The type in Python."""
        schema = self.resolved(schema)
        if "const" in schema:
            return f'Literal["{schema["const"]}"]'
        if "oneOf" in schema and all("const" in part for part in schema["oneOf"]):
            return f"Literal[{', '.join(quoted(part['const']) for part in schema['oneOf'])}]"
        if "enum" in schema:
            return f"Literal[{', '.join(quoted(word) for word in schema['enum'])}]"
        parts = schema.get("anyOf", schema.get("oneOf"))
        if parts:
            found = dict.fromkeys(self.annotation(key, part) for part in parts)
            return " | ".join(found)
        kind = schema.get("type")
        if isinstance(kind, list):
            return "Number"
        if kind == "array":
            item = self.resolved(schema.get("items", {}))
            if item.get("type") in ("number", "integer") or isinstance(item.get("type"), list):
                return "Vector"
            if item.get("type") == "array":
                return "Matrix"
            inner = "Name" if item.get("type") == "string" else self.annotation(key, item)
            return f"Sequence[{inner}]"
        if kind == "object":
            return "Mapping[str, Any]"
        if kind == "string":
            return "Name" if key in NAMES else "str"
        return {"number": "Number", "integer": "Integer", "boolean": "bool"}.get(str(kind), "Any")

    def shape(self, schema: dict[str, Any]) -> str:
        """The type as docstrings state it."""
        schema = self.resolved(schema)
        if "oneOf" in schema and all("const" in part for part in schema["oneOf"]):
            return "str"
        parts = schema.get("anyOf", schema.get("oneOf"))
        if parts:
            return " or ".join(dict.fromkeys(self.shape(part) for part in parts))
        kind = schema.get("type")
        if kind == "array":
            sizes, inner = [], schema
            while inner.get("type") == "array":
                sizes.append(str(inner["minItems"]) if inner.get("minItems") else "n")
                inner = self.resolved(inner.get("items", {}))
            if inner.get("type") in ("string", "object"):
                return f"list of {self.shape(inner)}"
            return f"array ({', '.join(sizes)}{',' if len(sizes) == 1 else ''})"
        if isinstance(kind, list):
            return "float or str"
        names = {"number": "float", "integer": "int", "boolean": "bool", "string": "str", "object": "dict"}
        return names.get(str(kind), "str")

    def inner(self, schema: dict[str, Any]) -> list[str]:
        """The keys of a dictionary."""
        parts = [self.resolved(part) for part in schema.get("anyOf", [schema])]
        found = (key for part in parts for key in part.get("properties", {}))
        return list(dict.fromkeys(found))

    def method(self, section: str) -> str:
        """The method of a section."""
        description, keys, required = self.keys(section)
        first = [key for key in FIRST if key in required]
        first += [key for key in required if key not in first]
        if section == "include":
            first = ["file"]
        rest = [key for key in sorted(keys) if key not in first]
        handle = "BeamPart" if section == "beam" else "Part"
        extra = ["along"] if section == "body" else []
        lines = [f"    def {section}(", "        self,"]
        lines += [f"        {named(key)}: {self.annotation(key, keys[key])}," for key in first]
        lines += ["        *,"] if rest else []
        lines += [f"        {named(key)}: {optional(self.annotation(key, keys[key]))} = None," for key in rest]
        lines += [f"        {key}: Vector | None = None," for key in extra]
        lines += [f"    ) -> {handle}:"]
        text = "\n".join(lines) + "\n" + self.docstring(section, description, (first, rest, extra), keys)
        pairs = [f"            {quoted(key)}: {named(key)}," for key in [*first, *rest]]
        given = "\n".join(["        given: dict[str, Any] = {", *pairs, "        }"])
        turn = "        self._align(given, along)\n" if extra else ""
        alone = "items" not in self.whole["properties"][section]
        add = "_add_beam" if section == "beam" else "_set" if alone else "_add"
        return f"{text}{given}\n{turn}        return self.{add}({quoted(section)}, given)\n"

    def docstring(
        self, section: str, description: str, names: tuple[list[str], list[str], list[str]], keys: dict[str, Any]
    ) -> str:
        """Its parameters with shapes and units, and the handle; ``section`` of the header: ``""``."""
        first, rest, extra = names
        lines = wrapped(plain(description), 8, '"""')
        lines += ["", "        Parameters", "        ----------"]
        for key in [*first, *rest]:
            schema = keys[key]
            also = "" if key in first else ", optional"
            lines.append(f"        {named(key)} : {self.shape(schema)}{also}")
            unit = UNITS.get(f"{section}.{key}", UNITS.get(key)) if "array" in self.shape(schema) else None
            lines += wrapped(plain(schema.get("description", "")) + (f" Unit: {unit}." if unit else ""), 12)
            words = [part["const"] for part in self.resolved(schema).get("oneOf", []) if "const" in part]
            inner = self.inner(schema)
            if inner:
                lines += wrapped("Keys: " + ", ".join(f"``{word}``" for word in inner) + ".", 12)
            if words:
                lines += wrapped("One of " + ", ".join(f'``"{word}"``' for word in words) + ".", 12)
        if extra:
            lines.append("        along : array (3,), optional")
            words = "The third axis of the body, the axis of its shape, points along it in space; any length."
            lines += wrapped(f"{words} Unit: {UNITS['along']}.", 12)
        if section:
            handle = "BeamPart" if section == "beam" else "Part"
            lines += ["", "        Returns", "        -------", f"        {handle}"]
            lines += ["            Its handle, which stands wherever its name can."]
        return "\n".join([*lines, '        """']) + "\n"

    def beginning(self) -> str:
        """The first method: the keys of ``[model]`` and ``[simulation]``."""
        (words, model, _), (_, simulation, _) = self.keys("model"), self.keys("simulation")
        first, rest = ["name"], [key for key in model if key != "name"] + list(simulation)
        keys = {**model, **simulation}
        lines = ["    def __init__(", "        self,", "        name: str,", "        *,"]
        lines += [f"        {named(key)}: {optional(self.annotation(key, keys[key]))} = None," for key in rest]
        lines += ["    ) -> None:"]
        doc = self.docstring("", "The header `[model]` and the settings `[simulation]`.", (first, rest, []), keys)
        pairs = [f"            {quoted(key)}: {named(key)}," for key in model]
        header = "\n".join(["        model: dict[str, Any] = {", *pairs, "        }"])
        pairs = [f"            {quoted(key)}: {named(key)}," for key in simulation]
        settings = "\n".join(["        simulation: dict[str, Any] = {", *pairs, "        }"])
        return "\n".join(lines) + f"\n{doc}{header}\n{settings}\n        self._begin(model, simulation)\n"


def quoted(word: str) -> str:
    return f'"{word}"'


def named(key: str) -> str:
    """The key as a name of Python."""
    return f"{key}_" if key in WORDS else key


def optional(annotation: str) -> str:
    return f"{annotation} | None"


def plain(words: str) -> str:
    """Marks of code as in reStructuredText."""
    return " ".join(words.replace("\\", "\\\\").replace("`", "``").split())


def wrapped(words: str, indent: int, start: str = "") -> list[str]:
    space = " " * indent
    return textwrap.wrap(
        start + words, WIDTH, initial_indent=space, subsequent_indent=space,
        break_long_words=False, break_on_hyphens=False,
    )


def written(schema: dict[str, Any]) -> str:
    """The text of the file."""
    known = Schema(schema)
    sections = [*LIST_SECTIONS.split()]
    missing = set(schema["properties"]) - {*sections, "model", "simulation", "parameters"}
    sections += sorted(missing)
    return HEAD + "\n" + "\n".join([known.beginning(), *(known.method(section) for section in sections)])
