"""Bad input: an exception with the words of the program and a remedy, never a dead interpreter."""

import json
import pickle
import subprocess
import sys
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest
from conftest import ROOT, program

import holonom as hn
from holonom import _core

HOSTILE = sorted([*(ROOT / "tests" / "hostile").rglob("*.toml"), *(ROOT / "tests" / "corpus").rglob("*.toml")])


@pytest.mark.parametrize("error", [
    hn.HolonomError("a", "b"),
    hn.InvalidModel([hn.Problem("wrong", "body.a.mass", "write a mass", "m.toml", 3, 1)]),
    hn.RunFailed(3, 0.1, "no", "reduce the step"),
    hn.StateMismatch("a"),
    hn.UnknownName("a", "b"),
    hn.OutputExists("a", "b"),
    hn.OutputFailed("a", "b"),
    hn.MemoryLack("a"),
    hn.MissingPackage("a", "b"),
    hn.FunctionFailed("a", "b"),
    hn.AnalysisFailed("a"),
    hn.ImportFailed("a", ["b"]),
    hn.InternalError("a"),
], ids=lambda error: type(error).__name__)
def test_errors_travel(error: hn.HolonomError) -> None:
    again = pickle.loads(pickle.dumps(error))
    assert type(again) is type(error) and str(again) == str(error) and str(again)
    assert vars(again) == vars(error)


def test_problems_of_files_are_those_of_the_program(tmp_path: Path) -> None:
    """Of every hostile model and every text of the corpus that is no valid model."""
    seen = 0
    texts = [path.read_bytes() for path in HOSTILE]
    texts += [b"", b"[model]\nname = 1\n", b"x = ", b'[simulation]\nstep = -1.0\nend = "a"\n[model]\nname="n"\nfoo=1\n', b"\xff\xfe"]
    for text in texts:
        bad = tmp_path / "bad.toml"
        bad.write_bytes(text)
        try:
            hn.check(bad)
        except hn.InvalidModel as error:
            said = json.loads(program("check", str(bad), "--json").stdout)
            keys = ("message", "key", "help", "line", "column")
            ours = [{key: getattr(problem, key) for key in keys} for problem in error.problems]
            theirs = [{key: problem[key] for key in keys} for problem in said["problems"]]
            assert ours == theirs
            assert all(problem.message in str(error) for problem in error.problems)
            again = pickle.loads(pickle.dumps(error))
            assert again.problems == error.problems and str(again) == str(error)
            seen += 1
    print(f"{seen} of {len(texts)} texts are refused")
    assert seen >= 16


def test_runs_that_fail_say_what_the_program_says(tmp_path: Path) -> None:
    """Every hostile model that is valid, for 20 steps: the same end, the same words."""
    failed = 0
    for path in HOSTILE:
        try:
            model = hn.load(path)
            if model.settings["scheme"] != "static":
                model = model.replace({"simulation.end": 20 * model.settings["step"]})
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                result = hn.simulate(model, record=["energy", "residuals"], on_failure="return")
                again = hn.simulate(model, out=tmp_path / path.stem, on_failure="return")
        except hn.InvalidModel:
            continue
        assert result.failure == again.failure, path.name
        if result.failure is None:
            continue
        failed += 1
        with warnings.catch_warnings(), pytest.raises(hn.RunFailed) as error:
            warnings.simplefilter("ignore")
            hn.simulate(model, record=["energy", "residuals"])
        model.save(tmp_path / "own.toml")
        said = program("run", str(tmp_path / "own.toml"), "-o", str(tmp_path / "theirs"), "--force", "--json")
        theirs = json.loads((tmp_path / "theirs" / "summary.json").read_text())["failure"]
        assert said.returncode == 1 and theirs == result.failure, path.name
        assert str(pickle.loads(pickle.dumps(error.value))) == str(error.value)
        assert theirs["message"] in str(error.value) and theirs["remedy"] in str(error.value)
    print(f"{failed} runs fail")
    assert failed >= 1


def test_values_that_are_set_are_named(double: str) -> None:
    model = hn.Model.from_toml(double)
    with pytest.raises(hn.InvalidModel, match="set: body.upper.mass=-1.0") as error:
        model.replace({"body.upper.mass": -1.0})
    assert error.value.problems[0].line is None
    with pytest.raises(hn.InvalidModel, match="did you mean `body.upper`"):
        model.replace({"body.uper.mass": 1.0})
    with pytest.raises(hn.InvalidModel):
        model.replace({"body.upper.mass": np.nan})
    with pytest.raises(TypeError, match="no value of a model"):
        model.replace({"body.upper.mass": object()})
    for wrong in (3, None, ["a"]):
        with pytest.raises(TypeError, match="a model is"):
            hn.simulate(wrong)
    with pytest.raises(ValueError, match="on_failure"):
        hn.simulate(model, on_failure="ignore")


def test_a_run_that_fails_keeps_what_it_has(double: str, tmp_path: Path) -> None:
    model = hn.Model.from_toml(double)
    wild = {"simulation.step": 0.5, "simulation.end": 50.0, "joint.elbow.rate": 300.0}
    with pytest.raises(hn.RunFailed) as error:
        with pytest.warns(hn.HolonomWarning):
            hn.simulate(model, set=wild)
    failed = error.value
    assert failed.result is not None and len(failed.result) == failed.step + 1
    assert failed.remedy and np.isfinite(failed.result.q).all()
    with pytest.warns(hn.HolonomWarning):
        kept = hn.simulate(model, set=wild, on_failure="return")
    assert kept.failure is not None and kept.failure["step"] == failed.step
    assert pickle.loads(pickle.dumps(failed)).step == failed.step


def test_nothing_is_overwritten(double: str, tmp_path: Path) -> None:
    model = hn.Model.from_toml(double)
    hn.simulate(model, end=0.01, out=tmp_path / "run")
    with pytest.raises(hn.OutputExists):
        hn.simulate(model, end=0.01, out=tmp_path / "run")
    hn.simulate(model, end=0.01, out=tmp_path / "run", force=True)
    with pytest.raises(hn.HolonomError, match="holds no run"):
        hn.open(tmp_path / "nowhere")


def test_a_panic_is_an_exception() -> None:
    from holonom._errors import no_panic

    with pytest.raises(hn.InternalError, match="asked for by a test"):
        no_panic(hn._core._panic)()
    script = "import holonom\ntry: holonom._core._panic()\nexcept BaseException: print('alive')"
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert said.returncode == 0 and "alive" in said.stdout


class Panics:
    """A compiled part whose every function panics."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__"):
            raise AttributeError(name)
        _core._panic()


CALLS: dict[str, Callable[[hn.Model, str], object]] = {
    "simulate": lambda m, f: hn.simulate(m), "statics": lambda m, f: hn.statics(m), "open": lambda m, f: hn.open(f),
    "load": lambda m, f: hn.load(f), "Model.from_toml": lambda m, f: hn.Model.from_toml(""),
    "Model.from_dict": lambda m, f: hn.Model.from_dict({}), "Spec.compile": lambda m, f: hn.Spec("a").compile(),
    "check": lambda m, f: hn.check(m), "modes": lambda m, f: hn.modes(m), "campbell": lambda m, f: hn.campbell(m, [1.0]),
    "response": lambda m, f: hn.response(m, "load.x", (1.0, 2.0, 3)), "bench": lambda m, f: hn.bench(m),
    "verify": lambda m, f: hn.verify(m), "compare": lambda m, f: hn.compare(m), "schema": lambda m, f: hn.schema(),
    "import_robot": lambda m, f: hn.import_robot("<robot/>"), "plan": lambda m, f: hn.plan({"a.b": [1.0]}),
    "sweep": lambda m, f: hn.sweep(m, hn.Plan((), ((),), ()), {}, out=f), "rollout": lambda m, f: hn.rollout(m, steps=1),
    "Stepper": lambda m, f: hn.Stepper(m), "Ensemble": lambda m, f: hn.Ensemble(m, 2), "optimize": lambda m, f: hn.optimize(m),
    "Gradient": lambda m, f: hn.Gradient(m, initial=True), "identify": lambda m, f: hn.identify(m, {"t": [0.0]}),
    "view": lambda m, f: hn.view(f),
}


@pytest.mark.parametrize("name", CALLS)
def test_a_panic_of_a_function_is_an_internal_error(
    name: str, double: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model = hn.Model.from_toml(double)
    hn.simulate(model, end=0.01, out=tmp_path / "run")
    assert all(hasattr(hn, public) for public in hn.__all__)  # all modules are imported
    monkeypatch.chdir(tmp_path)
    for module in [own for key, own in sys.modules.items() if key.startswith("holonom.") and hasattr(own, "_core")]:
        monkeypatch.setattr(module, "_core", Panics())
    with pytest.raises(hn.InternalError, match="asked for by a test"):
        CALLS[name](model, str(tmp_path / "run"))


WORK = ("reset", "run", "step", "observe", "replace", "export_fmu", "sense", "export", "save")


def made_of(kind: type[Any], model: hn.Model) -> Any:
    if kind is hn.Model:
        return model
    if kind is hn.Result:
        return hn.simulate(model, end=0.01)
    return hn.Stepper(model) if kind is hn.Stepper else hn.Ensemble(model, 2)


@pytest.mark.parametrize("kind", [hn.Model, hn.Stepper, hn.Ensemble, hn.Result])
def test_a_panic_of_a_method_is_an_internal_error(kind: type[Any], double: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of every public method and property that asks the compiled part."""
    given: dict[str, tuple[Any, ...]] = {
        "run": ([[]],), "replace": ({},), "export_fmu": ("none.fmu",), "sense": ("position",), "export": ("npz",), "save": ("none",),
    }
    asked = []
    for name in [key for key in vars(kind) if not key.startswith("_")]:
        model = hn.Model.from_toml(double)
        own = made_of(kind, model)
        with monkeypatch.context() as patch:
            patch.setattr(f"{kind.__module__}._core", Panics())
            if kind is not hn.Result:
                own._core = Panics()
            if kind is hn.Stepper:
                own._step = own._observe = lambda *_: _core._panic()
            try:
                found = getattr(own, name)
                if callable(found):
                    found(*given.get(name, ()), **({"of": "lower"} if name == "sense" else {}))
            except hn.InternalError:
                asked.append(name)
            except hn.HolonomError:
                continue
            except TypeError:  # a class method, of a text
                continue
    print(asked)
    assert set(asked) >= {name for name in WORK if name in vars(kind)} and len(asked) >= 4


def test_what_panicked_is_used_no_more(double: str) -> None:
    model = hn.Model.from_toml(double)
    uses: list[Callable[[Any], object]] = [lambda own: own.step(), lambda own: own.observe(), lambda own: own.q]
    for own in (hn.Stepper(model), hn.Ensemble(model, 2)):
        with pytest.raises(BaseException, match="asked for by a test"):
            own._core._panic()
        for use in uses:
            with pytest.raises(hn.InternalError, match="panicked in an earlier call(?s:.)*make another one"):
                use(own)
    assert hn.Stepper(model).step() > 0.0


def test_a_build_that_aborts_is_not_imported() -> None:
    with pytest.raises(ImportError, match="profile `unwinding`"):
        _core._refuse(True)
    _core._refuse(False)


def test_a_package_that_is_missing_is_named(
    double: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    result = hn.simulate(hn.Model.from_toml(double), end=0.02)
    for name in ("pandas", "xarray", "matplotlib.pyplot", "gymnasium", "mujoco"):
        monkeypatch.setitem(sys.modules, name, None)  # importing it fails
    monkeypatch.delitem(sys.modules, "holonom.gym", raising=False)
    for package, call in [
        ("pandas", result.to_pandas),
        ("xarray", result.to_xarray),
        ("gymnasium", lambda: __import__("holonom.gym")),
        ("mujoco", lambda: __import__("holonom.peers.mujoco").peers.mujoco.run(hn.Model.from_toml(double))),
    ]:
        with pytest.raises(hn.MissingPackage, match=f"needs the package {package}") as error:
            call()
        assert f"pip install {package}" in str(error.value)
    # without matplotlib the program draws
    capfd.readouterr()
    drawing = result.plot("angle", "kinetic")
    assert capfd.readouterr() == ("", "")  # nothing is said of files that nobody sees
    assert isinstance(drawing, hn.Drawing) and drawing._repr_svg_() == drawing.svg
    assert "angle" in drawing.svg and "kinetic" in drawing.svg and drawing.svg.startswith("<svg")
    assert "bearing" in result.plot("bearing").svg and "total" in result.plot().svg
    drawing.save(tmp_path / "plot.svg")
    assert (tmp_path / "plot.svg").read_text(encoding="utf-8") == drawing.svg
    with pytest.raises(hn.UnknownName, match="did you mean"):
        result.plot("angel")


def test_nothing_large_is_imported() -> None:
    script = "import sys, holonom; print([m for m in ('pandas', 'xarray', 'dask', 'matplotlib', 'gymnasium') if m in sys.modules])"
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert said.stdout.strip() == "[]"


@pytest.mark.parametrize(("numpy", "words"), [
    ("None", "needs NumPy 1.26 or newer: pip install"),
    ("types.ModuleType('numpy')", "needs NumPy 1.26 or newer: pip install"),
    ("types.SimpleNamespace(__version__='1.24.4')", "not 1.24.4: pip install -U numpy"),
])
def test_numpy_is_asked_for_by_name(numpy: str, words: str) -> None:
    script = f"import sys, types; sys.modules['numpy'] = {numpy}; import holonom"
    said = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert said.returncode == 1 and words in said.stderr.splitlines()[-1]


def test_without_a_browser_the_file_is_named(
    double: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)  # tells that there is none
    result = hn.simulate(hn.Model.from_toml(double), end=0.02, out=tmp_path / "run")
    for what in (result, tmp_path / "run", hn.modes(hn.Model.from_toml(double), at="static", count=1)):
        hn.view(what)
        file = opened[-1].removeprefix("file://")
        assert file in capsys.readouterr().out and "<html" in Path(file).read_text(encoding="utf-8")
    with pytest.raises(TypeError, match="not int"):
        hn.view(3)


WRONG: dict[str, Callable[[Any], object]] = {
    "n: 0 or more": lambda m: hn.Ensemble(m, 2).step(n=-1),
    "n: a whole number": lambda m: hn.Ensemble(m, 2).step(n=cast(Any, 1.5)),
    "threads: 1 or more, not 0": lambda m: hn.Ensemble(m, 2, threads=0),
    "threads: 1 or more, not -1": lambda m: hn.rollout(m, steps=2, threads=-1),
    "threads: 1 or more, not -2": lambda m: hn.sweep(m, {"body.lower.mass": [1.0]}, {}, threads=-2),
    "there are 0 to 1, not 2": lambda m: hn.Ensemble(m, 2).reset([2]),
    "members: 0 or more, not -1": lambda m: hn.Ensemble(m, 2).reset([-1]),
    "1 mappings for 2 members": lambda m: hn.Ensemble(m, 2).reset(joints=[{"elbow": 1.0}]),
    r"out: shape \(2, 1\), not \(3,\)": lambda m: hn.Ensemble(m, 2, observe=["angle"]).observe(np.zeros(3)),
    r"out: shape \(1,\), not \(3,\)": lambda m: hn.Stepper(m, observe=["angle"]).observe(np.zeros(3)),
    r"out: an array of shape \(1,\)": lambda m: hn.Stepper(m, observe=["angle"]).observe(cast(Any, [0.0])),
    "steps: 0 or more, not -1": lambda m: hn.rollout(m, steps=-1),
    "every: 1 or more, not 0": lambda m: hn.rollout(m, steps=2, every=0),
    "of one member at least": lambda m: hn.rollout(m, set=[], steps=2),
    "`status` is the name of another": lambda m: hn.sweep(m, {"body.lower.mass": [1.0]}, {"status": len}),
    "the ends of a range": lambda m: hn.plan({"a.b.c": (0.0, np.nan)}, sample="sobol", n=2),
    "n: 1 or more, not 0": lambda m: hn.plan({"a.b.c": (0.0, 1.0)}, sample="sobol", n=0),
    "seed: 0 or more, not -3": lambda m: hn.plan({"a.b.c": (0.0, 1.0)}, sample="sobol", n=2, seed=-3),
    "count: 1 or more, not 0": lambda m: hn.modes(m, count=0),
    "count: 1 or more, not -2": lambda m: hn.campbell(m, [1.0], count=-2),
    "steps: 1 or more, not -3": lambda m: hn.bench(m, steps=-3),
    "band: 0 or more, not -1": lambda m: hn.response(m, "load.x", (1.0, 2.0, -1)),
    "accuracy: a number from": lambda m: hn.verify(m, accuracy=float("nan")),
    "did you mean `joint`": lambda m: hn.schema("jont"),
}


@pytest.mark.parametrize("words", WRONG)
def test_numbers_that_cannot_be_are_refused_by_name(words: str, double: str) -> None:
    model = hn.Model.from_toml(double)
    with pytest.raises((ValueError, TypeError, LookupError), match=words) as refused:
        WRONG[words](model)
    assert not isinstance(refused.value, hn.InternalError) and "panicked" not in str(refused.value)
