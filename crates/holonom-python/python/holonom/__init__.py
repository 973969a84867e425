"""Constrained mechanical systems in Python.

A model is a text: a file, a string or a dictionary. A run is a function of it and gives numpy
arrays. All units are SI, angles are in rad. ``import holonom as hn``.

==================================  ==============================================================
``load``, ``Model``                 a valid model; values replaced
``Spec``, ``rod``, ``section``      a model that is written in Python
``simulate``, ``Result``            a run, as arrays by the names of the columns of its files
``Stepper``                         one step after another, with inputs held over a step
``Law``, ``compiled``               functions that act within a step
``Ensemble``, ``rollout``           many members, stepped together
``sweep``, ``plan``                 many runs
``check``, ``statics``, ``modes``   what ``holonom check`` and so on find
``campbell``, ``response``          modes over the speed; amplitude and phase over a band
``Gradient``, ``identify``          objectives with exact gradients; numbers from measurements
``optimize``                        parameters or controls of least cost
``Program``, ``Proposal``           what a method for such optima sees, and returns
``verify``, ``compare``, ``bench``  properties, measured; schemes side by side; what a step costs
``import_robot``, ``schema``        a model of a robot description; the keys of model files
``view``                            the page of a folder, a result or an analysis
==================================  ==============================================================
"""

from typing import TYPE_CHECKING, Any

try:
    from numpy import __version__ as _numpy
except ImportError as _missing:
    raise ImportError("holonom needs NumPy 1.26 or newer: pip install numpy") from _missing
if tuple(int(part) for part in _numpy.split(".")[:2]) < (1, 26):
    raise ImportError(f"holonom needs NumPy 1.26 or newer, not {_numpy}: pip install -U numpy")

from ._core import BodyState, __version__
from ._errors import (
    AnalysisFailed,
    FunctionFailed,
    HolonomError,
    HolonomWarning,
    ImportFailed,
    InternalError,
    InvalidModel,
    MemoryLack,
    MissingPackage,
    OutputExists,
    OutputFailed,
    Problem,
    RunFailed,
    StateMismatch,
    UnknownName,
)
from ._model import Model, load
from ._result import Beam, Member, Momentum, Result, Table, open_folder as open
from ._simulate import simulate, statics
from ._stepper import Stepper

if TYPE_CHECKING:
    from ._analyses import Campbell, Modes, Response, bench, campbell, modes, response
    from ._answer import Analysis, Answer
    from ._acting import CompiledLaw, Law, compiled
    from ._design import Gradient, Identified, Optimum, identify, optimize
    from ._ensemble import Ensemble
    from ._page import Drawing
    from ._program import Program, Proposal
    from ._parts import BeamPart, Part, Parts
    from ._spec import Spec, box, circle, cylinder, rectangle, rod, section, sphere, tube
    from ._sweep import Plan, Rollout, SweepTable, plan, rollout, run_point, sweep
    from ._verbs import Imported, check, compare, import_robot, schema, verify, view

_LATER = {
    "_acting": ("CompiledLaw", "Law", "compiled"),
    "_analyses": ("Campbell", "Modes", "Response", "bench", "campbell", "modes", "response"),
    "_answer": ("Analysis", "Answer"),
    "_design": ("Gradient", "Identified", "Optimum", "identify", "optimize"),
    "_ensemble": ("Ensemble",),
    "_page": ("Drawing",),
    "_program": ("Program", "Proposal"),
    "_parts": ("BeamPart", "Part", "Parts"),
    "_spec": ("Spec", "box", "circle", "cylinder", "rectangle", "rod", "section", "sphere", "tube"),
    "_sweep": ("Plan", "Rollout", "SweepTable", "plan", "rollout", "run_point", "sweep"),
    "_verbs": ("Imported", "check", "compare", "import_robot", "schema", "verify", "view"),
}
"""Names by modules that are imported when they are asked for."""


def __getattr__(name: str) -> Any:
    from importlib import import_module

    for module, names in _LATER.items():
        if name in names:
            value = getattr(import_module(f".{module}", __name__), name)
            globals()[name] = value
            return value
    raise AttributeError(f"module `holonom` has no `{name}`")


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})


__all__ = [
    "Analysis",
    "AnalysisFailed",
    "Answer",
    "Beam",
    "BeamPart",
    "BodyState",
    "Campbell",
    "CompiledLaw",
    "Drawing",
    "Ensemble",
    "FunctionFailed",
    "Gradient",
    "HolonomError",
    "HolonomWarning",
    "Identified",
    "ImportFailed",
    "Imported",
    "InternalError",
    "InvalidModel",
    "Law",
    "Member",
    "MemoryLack",
    "MissingPackage",
    "Model",
    "Modes",
    "Momentum",
    "Optimum",
    "OutputExists",
    "OutputFailed",
    "Part",
    "Parts",
    "Plan",
    "Problem",
    "Program",
    "Proposal",
    "Response",
    "Result",
    "Rollout",
    "RunFailed",
    "Spec",
    "StateMismatch",
    "Stepper",
    "SweepTable",
    "Table",
    "UnknownName",
    "__version__",
    "bench",
    "box",
    "campbell",
    "check",
    "circle",
    "compare",
    "compiled",
    "cylinder",
    "identify",
    "import_robot",
    "load",
    "modes",
    "open",
    "optimize",
    "plan",
    "rectangle",
    "response",
    "rod",
    "rollout",
    "run_point",
    "schema",
    "section",
    "simulate",
    "sphere",
    "statics",
    "sweep",
    "tube",
    "verify",
    "view",
]
