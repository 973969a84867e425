"""Docstrings of all public names, in the sections of numpydoc.

A function names its parameters, what it returns, and what it raises by itself; a class how it is
made, or its attributes. Arrays of numbers have a shape and a unit, ``1`` of numbers without one.
"""

import ast
import importlib
import inspect
import re
import textwrap
from collections.abc import Callable, Iterator
from typing import Any

import holonom as hn

NOT_CALLED = {"Analysis", "Beam", "Drawing", "Member", "Parts", "Program"}
"""Classes that are made by the package, beside those that functions and properties return."""
MODULES = ["holonom", "holonom.gym", "holonom.ipopt", "holonom.peers.mujoco"]
HEAD = re.compile(r"^(\w+)\n-+$", re.MULTILINE)
ENTRY = re.compile(r"^(?P<names>[*\w]+(?: \([^)]*\))?(?:, [*\w]+(?: \([^)]*\))?)*)(?: :|$)", re.MULTILINE)
NUMBERS = re.compile(r"\bArray(?:Like)?\b|np\.float64|np\.complex128|\bVector\b|\bMatrix\b")
SHAPE = re.compile(r"\((?:\w+,|\w+(?:, \w+)+)\)|\bone\b.*\beach\b", re.DOTALL)
UNIT = re.compile(r"(?<![\w·/'’])(?:1|m|s|kg|rad|N|J|Hz|Pa|min)(?:[·/]\w+)*[²³]?(?!\w)|\b[Uu]nits?\b")


def sections(text: str) -> dict[str, str]:
    """The parts of a docstring by their heads; what stands before them by ``""``."""
    parts = HEAD.split(text)
    return {"": parts[0], **dict(zip(parts[1::2], parts[2::2], strict=True))}


def entries(section: str) -> dict[str, str]:
    """The text of each name of a section."""
    found: dict[str, str] = {}
    names: list[str] = []
    for line in section.strip("\n").splitlines():
        entry = ENTRY.match(line)
        if entry:
            names = re.findall(r"[*\w]+", re.sub(r" \([^)]*\)", "", entry["names"]))
        for name in names:
            found[name.lstrip("*")] = f"{found.get(name.lstrip('*'), '')}\n{line}"
    return found


def tree_of(function: Any) -> ast.AST:
    return ast.parse(textwrap.dedent(inspect.getsource(inspect.unwrap(function))))


def raised(function: Any) -> set[str]:
    """The exceptions that a function makes and raises itself."""
    calls = (node.exc for node in ast.walk(tree_of(function)) if isinstance(node, ast.Raise))
    names = {call.func.id for call in calls if isinstance(call, ast.Call) and isinstance(call.func, ast.Name)}
    return {name for name in names if name[0].isupper()}


def measured(what: str, annotation: str, words: str) -> Iterator[str]:
    """What is missing of an array of numbers."""
    if NUMBERS.search(annotation) and "as of :" not in " ".join(words.split()):
        if not SHAPE.search(words):
            yield f"{what} has no shape"
        if not UNIT.search(re.sub(r"``[^`]*``", "", words)):
            yield f"{what} has no unit"


def of_signature(function: Any, doc: dict[str, str]) -> Iterator[str]:
    """What is missing of parameters and exceptions."""
    signature = inspect.signature(inspect.unwrap(function))
    own = {name: p for name, p in signature.parameters.items() if name not in ("self", "cls")}
    stated = entries(doc.get("Parameters", ""))
    if set(stated) != set(own):
        yield f"parameters: {sorted(own)}, stated: {sorted(stated)}"
    for name, parameter in own.items():
        yield from measured(name, str(parameter.annotation), stated.get(name, ""))
    missing = raised(function) - set(re.findall(r"\w+", doc.get("Raises", "")))
    if missing:
        yield f"raises {sorted(missing)}"


def of_function(function: Any) -> Iterator[str]:
    """What is missing of the docstring of a function or a method."""
    doc = sections(inspect.getdoc(function) or "")
    yield from of_signature(function, doc)
    given = str(inspect.signature(inspect.unwrap(function)).return_annotation)
    if given == "None":
        return
    if not doc.get("Returns", "").strip():
        yield f"returns {given}"
    yield from measured("what it returns", given, doc.get("Returns", ""))


def attributes(kind: type) -> dict[str, str]:
    """Public attributes of a class with their annotations: of its fields, and those that
    ``__init__`` sets."""
    found = {name: str(own) for name, own in inspect.get_annotations(kind).items()}
    init: Any = vars(kind).get("__init__")
    if inspect.isfunction(init) and not hasattr(kind, "__dataclass_fields__"):
        for node in ast.walk(tree_of(init)):
            targets = node.targets if isinstance(node, ast.Assign) else []
            if isinstance(node, ast.AnnAssign):
                targets = [node.target]
            flat = [one for target in targets for one in (target.elts if isinstance(target, ast.Tuple) else [target])]
            for target in flat:
                if isinstance(target, ast.Attribute) and isinstance(target.value, ast.Name):
                    own = ast.unparse(node.annotation) if isinstance(node, ast.AnnAssign) else ""
                    found.setdefault(target.attr, own)
    return {name: own for name, own in found.items() if not name.startswith("_")}


def below(kind: type) -> dict[str, str]:
    """The texts below the fields of a class."""
    try:
        (body,) = (node.body for node in ast.walk(tree_of(kind)) if isinstance(node, ast.ClassDef) and node.name == kind.__name__)
    except OSError:
        return {}
    found = {}
    for field, words in zip(body, body[1:], strict=False):
        if isinstance(field, ast.AnnAssign) and isinstance(words, ast.Expr) and isinstance(field.target, ast.Name):
            found[field.target.id] = str(ast.literal_eval(words.value))
    return found


def of_class(kind: type, given: set[str]) -> Iterator[str]:
    """What is missing of the docstring of a class. ``given``: classes that functions return."""
    doc = sections(inspect.getdoc(kind) or "")
    is_record = hasattr(kind, "__dataclass_fields__")
    init = vars(kind).get("__init__")
    if inspect.isfunction(init) and not is_record and not issubclass(kind, BaseException) and kind.__name__ not in given | NOT_CALLED:
        yield from of_signature(init, doc)
    stated = entries(doc.get("Attributes", "")) | below(kind) | entries(doc.get("Parameters", ""))
    for name, annotation in attributes(kind).items():
        if isinstance(inspect.getattr_static(kind, name, None), property):
            continue
        if name not in stated:
            yield f"the attribute {name}"
        yield from measured(name, annotation, stated.get(name, ""))


def public() -> Iterator[tuple[str, Any]]:
    """All public functions and classes of the package."""
    for place in MODULES:
        try:
            module = importlib.import_module(place)
        except hn.MissingPackage:
            continue
        names = hn.__all__ if module is hn else [
            name for name, own in vars(module).items() if not name.startswith("_") and getattr(own, "__module__", "") == place
        ]
        for name in names:
            if not name.startswith("__"):
                yield f"{place}.{name}", getattr(module, name)


def members(kind: type) -> Iterator[tuple[str, Any]]:
    """Public methods and properties that a class has of this package."""
    for base in kind.__mro__:
        if base.__module__.startswith("holonom"):
            yield from ((key, own) for key, own in vars(base).items() if not key.startswith("_"))


def of_member(member: Any) -> Iterator[str]:
    if isinstance(member, (classmethod, staticmethod)):
        member = member.__func__
    if isinstance(member, property) or inspect.isgetsetdescriptor(member):
        words = inspect.getdoc(member) or ""
        if not words:
            yield "nothing"
        read = getattr(member, "fget", None)
        given = str(inspect.signature(inspect.unwrap(read)).return_annotation) if read else "Array"
        yield from measured("it", given, words)
    elif inspect.isfunction(member):
        yield from of_function(member)


def test_every_public_name_states_what_it_takes_and_gives() -> None:
    named = list(public())
    made = [own for _, own in named if inspect.isfunction(own)]
    made += [m for _, own in named if inspect.isclass(own) for _, m in members(own)]
    given: set[str] = set()
    for own in made:
        own = own.fget if isinstance(own, property) else getattr(own, "__func__", own)
        if inspect.isfunction(own):
            given |= set(re.findall(r"\w+", str(inspect.signature(inspect.unwrap(own)).return_annotation)))
    missing: dict[str, list[str]] = {}

    def note(name: str, found: Callable[..., Iterator[str]], *of: Any) -> None:
        lacks = [] if inspect.getdoc(of[0]) or not callable(of[0]) else ["nothing"]
        lacks += list(found(*of))
        if lacks:
            missing[name] = lacks

    for name, own in named:
        if inspect.isclass(own):
            note(name, of_class, own, given)
            for key, member in members(own):
                note(f"{name}.{key}", of_member, member)
        else:
            note(name, of_function, own)
    words = "\n".join(f"{name}: {'; '.join(lacks)}" for name, lacks in missing.items())
    assert not missing, f"{len(missing)} docstrings:\n{words}"


def test_what_is_missing_is_found() -> None:
    def whole(x: "Array", n: int) -> "Array":  # type: ignore[name-defined]  # noqa: F821
        """What it is.

        Parameters
        ----------
        x : m, shape ``(K, 3)``.
        n : how many.

        Returns
        -------
        array (K,)
            N.

        Raises
        ------
        ValueError
        """
        raise ValueError("no")

    text = whole.__doc__ or ""
    assert not list(of_function(whole))
    defects = {
        "        n : how many.\n": ("", "parameters: ['n', 'x'], stated: ['x']"),
        "m, shape": ("shape", "x has no unit"),
        ", shape ``(K, 3)``": ("", "x has no shape"),
        "            N.\n": ("", "what it returns has no unit"),
        "array (K,)": ("array", "what it returns has no shape"),
        "        ValueError\n": ("", "raises ['ValueError']"),
    }
    for old, (new, words) in defects.items():
        whole.__doc__ = text.replace(old, new)
        assert list(of_function(whole)) == [words]
