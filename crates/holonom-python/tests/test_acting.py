"""Laws, forces, paths, controllers and starts of joints from outside a model."""

import ctypes
import pickle
import shutil
import subprocess
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import holonom as hn

LAW = '\n[[law]]\nname = "own"\njoint = "elbow"\neffort = "-3*x - 0.4*v*abs(v) + sin(5*t)"\n'


def effort(t: float, x: float, v: float) -> float:
    return -3.0 * x - 0.4 * v * abs(v) + float(np.sin(5.0 * t))


def with_slopes(t: float, x: float, v: float) -> tuple[float, float, float]:
    return effort(t, x, v), -3.0, -0.8 * abs(v)


@pytest.mark.parametrize("law", [effort, with_slopes], ids=["differences", "slopes"])
@pytest.mark.parametrize("scheme", ["nodal", "constrained", "em-nodal"])
def test_a_law_of_python_is_that_of_the_file(law, scheme: str, double: str) -> None:  # type: ignore[no-untyped-def]
    model = hn.Model.from_toml(double).replace({"simulation.scheme": scheme})
    stated = hn.Model.from_toml(double + LAW).replace({"simulation.scheme": scheme})
    ours, theirs = hn.simulate(model, laws={"elbow": law}), hn.simulate(stated)
    apart = np.abs(ours.q - theirs.q).max()
    print(f"{scheme}: apart by {apart:.1e} m")
    assert apart < 1e-11
    assert np.abs(ours.energy["work.elbow.law"] - theirs.energy["work.own"]).max() < 1e-11
    assert np.abs(ours.q - hn.simulate(model).q).max() > 1e-2  # it does something


def test_calls_are_counted_and_arguments_remembered(double: str) -> None:
    calls = [0]

    def law(t: float, x: float, v: float) -> tuple[float, float, float]:
        calls[0] += 1
        return with_slopes(t, x, v)

    result = hn.simulate(hn.Model.from_toml(double), laws={"elbow": law})
    iterations = result.residuals["newton_iterations"][1:].mean()
    per_step = calls[0] / (len(result) - 1)
    print(f"{per_step:.2f} calls and {iterations:.2f} iterations a step")
    assert per_step < iterations + 2.1  # each iterate with its slopes once, the work once


def test_wrong_slopes_converge_or_fail_by_name(double: str) -> None:
    model = hn.Model.from_toml(double)
    right = hn.simulate(model, laws={"elbow": with_slopes})
    wrong = hn.simulate(model, laws={"elbow": lambda t, x, v: (effort(t, x, v), 0.0, 0.0)})
    assert np.abs(right.q - wrong.q).max() < 1e-9
    stiff = hn.simulate(model, laws={"elbow": lambda t, x, v: -1e5 * x})  # by differences
    assert np.abs(stiff.sensors["angle"]).max() < 1e-2
    with pytest.raises(hn.RunFailed):
        hn.simulate(model, laws={"elbow": lambda t, x, v: (-1e7 * x, 1e7, 0.0)})


class Wrong(Exception):
    """Of a law."""


def raising(t: float, x: float, v: float) -> float:
    if t > 0.1:
        raise Wrong("here")
    return effort(t, x, v)


@pytest.mark.parametrize("form", ["nan", "raise", "none", "pair", "text"])
def test_a_law_that_fails_is_named_and_leaves_the_state(form: str, double: str) -> None:
    model, wild = hn.Model.from_toml(double), [False]
    after: list[float] = []

    def law(t: float, x: float, v: float):  # type: ignore[no-untyped-def]
        if not wild[0]:
            return effort(t, x, v)
        after.append(t)
        if form == "raise":
            raise Wrong("here")
        return {"nan": float("nan"), "none": None, "pair": (1.0, 2.0), "text": "1"}[form]

    stepper = hn.Stepper(model, inputs=["shoulder"], observe=["angle"], laws={"elbow": law})
    stepper.step([0.5], n=10)
    state, seen = stepper.state, stepper.observe()
    wild[0] = True
    expected = {"nan": hn.FunctionFailed, "raise": Wrong}.get(form, TypeError)
    with pytest.raises(expected) as error:
        stepper.step([0.7], n=5)
    text = str(error.value) + "".join(getattr(error.value, "__notes__", []))
    assert "law of joint `elbow`" in text and "t = " in text and "x = " in text
    assert len(after) == 1  # it is not called again
    assert stepper.state == state and np.array_equal(stepper.observe(), seen)
    wild[0] = False
    stepper.step([0.5], n=10)
    other = hn.Stepper(model, inputs=["shoulder"], laws={"elbow": effort})
    other.step([0.5], n=20)
    assert np.array_equal(other.q, stepper.q)  # as if nothing had happened


def test_a_run_whose_law_raises_keeps_what_it_has(double: str, tmp_path: Path) -> None:
    model = hn.Model.from_toml(double)
    with pytest.raises(Wrong, match="here") as error:
        hn.simulate(model, laws={"elbow": raising})
    assert "law of joint `elbow`" in error.value.__notes__[0]
    kept = hn.simulate(model, laws={"elbow": raising}, on_failure="return")
    assert kept.failure is not None and "here" in kept.failure["message"]
    assert 45 <= len(kept) <= 52 and np.isfinite(kept.q).all()
    with pytest.raises(Wrong):
        hn.simulate(model, laws={"elbow": raising}, out=tmp_path / "run")
    assert len(hn.open(tmp_path / "run")) >= 45
    with pytest.raises(hn.FunctionFailed, match="law of joint `elbow` gave"):
        hn.Stepper(model, laws={"elbow": lambda t, x, v: np.inf}).step()


def test_a_law_cannot_use_its_own_stepper(double: str) -> None:
    model = hn.Model.from_toml(double)
    uses: list[Callable[[hn.Stepper], object]] = [
        lambda s: s.step(),
        lambda s: s.observe(),
        lambda s: s.state,
        lambda s: s.reset(joints={"elbow": 1.0}),
    ]
    for use in uses:
        used: list[hn.Stepper] = []

        def law(t: float, x: float, v: float) -> float:
            if used:
                use(used[0])
            return 0.0

        stepper = hn.Stepper(model, observe=["angle"], laws={"elbow": law})
        used.append(stepper)
        with pytest.raises(RuntimeError, match="at work in another call") as error:
            stepper.step()
        assert "law of joint `elbow`" in error.value.__notes__[0]
        used.clear()
        assert stepper.n == 0 and stepper.step() == pytest.approx(0.002)


def test_laws_of_two_threads_do_not_meet(double: str) -> None:
    model, found = hn.Model.from_toml(double), {}

    def go(k: int) -> None:
        found[k] = hn.simulate(model, laws={"elbow": effort}).q

    threads = [threading.Thread(target=go, args=(k,)) for k in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert np.array_equal(found[0], found[1]) and np.array_equal(found[0], found[2])


def test_what_conserves_may_be_composed(double: str) -> None:
    model = hn.Model.from_toml(double).replace({"simulation.order": 4})
    with pytest.raises(hn.InvalidModel, match="dissipat"):
        hn.simulate(model, laws={"elbow": lambda t, x, v: (-3.0 * x, -3.0, 0.0)})
    law = hn.Law(lambda t, x, v: (-3.0 * x, -3.0, 0.0), conservative=True)
    spring = hn.Model.from_toml(double + '\n[[law]]\nname = "own"\njoint = "elbow"\neffort = "-3*x"\n')
    theirs = hn.simulate(spring.replace({"simulation.order": 4}))
    assert np.abs(hn.simulate(model, laws={"elbow": law}).q - theirs.q).max() < 1e-11


DOUBLE = ctypes.c_double
SLOPES = ctypes.POINTER(DOUBLE)
C_TEXT = """
double law(double t, double x, double v, double *s) { s[0] = -3.0; double w = v < 0 ? -v : v; s[1] = -0.8*w; return -3.0*x - 0.4*v*w; }
double wrong(double t, double x, double v, double *s) { s[0] = s[1] = 0.0; return t > 0.1 ? 0.0/0.0*x : 0.0; }
"""


@pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")
def test_machine_code_of_c(double: str, tmp_path: Path) -> None:
    (tmp_path / "law.c").write_text(C_TEXT)
    subprocess.run(["cc", "-shared", "-fPIC", "-O1", "-o", "law.so", "law.c"], cwd=tmp_path, check=True)
    library = ctypes.CDLL(str(tmp_path / "law.so"))
    with pytest.raises(TypeError, match="double law"):
        hn.compiled(library.law)  # its types are not stated
    for function in (library.law, library.wrong):
        function.restype, function.argtypes = DOUBLE, [DOUBLE, DOUBLE, DOUBLE, SLOPES]
    model = hn.Model.from_toml(double)
    law = hn.compiled(library.law)
    ours = hn.simulate(model, laws={"elbow": law})
    theirs = hn.simulate(model, laws={"elbow": lambda t, x, v: (-3.0 * x - 0.4 * v * abs(v), -3.0, -0.8 * abs(v))})
    assert np.array_equal(ours.q, theirs.q)
    with pytest.raises(hn.FunctionFailed, match=r"law of joint `elbow` gave .* at t = 0.1"):
        hn.simulate(model, laws={"elbow": hn.compiled(library.wrong)})


def test_machine_code_of_ctypes_and_numba(double: str) -> None:
    model = hn.Model.from_toml(double)

    def spring(t, x, v, slopes):  # type: ignore[no-untyped-def]
        slopes[0], slopes[1] = -4.0, 0.0
        return -4.0 * x

    own = hn.compiled(ctypes.CFUNCTYPE(DOUBLE, DOUBLE, DOUBLE, DOUBLE, SLOPES)(spring))
    ours = hn.simulate(model, laws={"elbow": own})
    theirs = hn.simulate(model, laws={"elbow": lambda t, x, v: (-4.0 * x, -4.0, 0.0)})
    assert np.array_equal(ours.q, theirs.q)
    for wrong in (spring, 7, ctypes.CFUNCTYPE(DOUBLE, DOUBLE)(lambda x: x)):
        with pytest.raises(TypeError, match="double law"):
            hn.compiled(wrong)
    numba = pytest.importorskip("numba")
    kind = numba.types.double(*[numba.types.double] * 3, numba.types.CPointer(numba.types.double))
    jitted = hn.compiled(numba.cfunc(kind)(spring))
    assert np.array_equal(hn.simulate(model, laws={"elbow": jitted}).q, ours.q)
    with pytest.raises(TypeError, match="double law"):
        hn.compiled(numba.cfunc(numba.types.double(numba.types.double))(lambda x: x))


def wind(t: float, body: hn.BodyState) -> Any:
    """Drag in a wind that swells, force and torque."""
    drag = 0.8 * (np.array([4.0 * np.sin(3.0 * t), 0.0, 1.0]) - body.velocity)
    return np.r_[drag, -0.02 * body.angular_velocity]


WIND = """
[[law]]
name = "wind"
on = "lower"
force = ["0.8*(4*sin(3*t) - vx)", "-0.8*vy", "0.8*(1 - vz)"]
torque = ["-0.02*wx", "-0.02*wy", "-0.02*wz"]
"""


def test_a_force_of_a_body_is_of_second_order(double: str) -> None:
    free, stated = hn.Model.from_toml(double), hn.Model.from_toml(double + WIND)
    exact = hn.simulate(stated, step=1e-4).q[-1]
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        errors.append(np.abs(hn.simulate(free, step=step, forces={"lower": wind}).q[-1] - exact).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    print(f"errors {errors}, orders {orders.round(2)}")
    assert (orders > 1.85).all() and errors[-1] < 1e-4
    result = hn.simulate(free, forces={"lower": wind})
    assert abs(result.energy["work.lower.force"][-1]) > 1e-2
    assert np.abs(result.energy["balance"]).max() < 1e-3


def test_forces_of_nodes_and_point_masses() -> None:
    spec = hn.Spec("whip", step=1e-3, end=0.05)
    section = hn.section(hn.rectangle(0.02, 0.005), E=2.1e11, nu=0.3, density=7850)
    rod = spec.beam("rod", 4, points=[[0, 0, 0], [1, 0, 0]], normal=[0, 0, 1], start="clamped", section=section)
    ours = hn.simulate(spec, forces={rod.end: lambda t, body: [0, 0, -5.0]})
    spec.load("tip", body=rod.end, force=[0, 0, -5.0])
    assert np.abs(ours.q - hn.simulate(spec).q).max() < 1e-12
    stone = {
        "model": {"name": "flat", "dimension": 2},
        "particle": [{"name": "bob", "mass": 0.5, "position": [0.0, 1.0], "velocity": [2.0, 0.0]}],
        "simulation": {"step": 0.01, "end": 1.0},
    }
    seen = []

    def push(t: float, body: hn.BodyState) -> list[float]:
        seen.append((t, body.position, body.velocity))
        return [0.0, 1.0, 0.0]

    result = hn.simulate(stone, forces={"bob": push})
    assert np.abs(result.q[-1] - [2.0, 2.0]).max() < 1e-12
    t, position, velocity = seen[-1]
    assert t == pytest.approx(0.995) and position.shape == (3,) and velocity[1] == pytest.approx(2 * t)
    for wrong, words in [
        (lambda t, body: [1.0], r"shape \(3,\)"),
        (lambda t, body: np.zeros(6), r"shape \(3,\)"),
        (lambda t, body: body.directors, "no directors"),
    ]:
        with pytest.raises((ValueError, AttributeError), match=words) as error:
            hn.simulate(stone, forces={"bob": wrong})
        assert "force on `bob`" in error.value.__notes__[0]
    with pytest.raises(hn.FunctionFailed, match="force on `bob` gave"):
        hn.simulate(stone, forces={"bob": lambda t, body: [np.nan, 0, 0]})


def test_a_control_within_a_run_is_a_loop_of_steps(double: str) -> None:
    model = hn.Model.from_toml(double)
    names = ["shoulder", "shoulder.rate"]

    def control(t: float, y: np.ndarray) -> list[float]:
        return [-20.0 * y[0] - 4.0 * y[1] + t]

    options = {"inputs": ["elbow"], "observe": names, "control": control, "control_every": 3}
    result = hn.simulate(model, **options)  # type: ignore[arg-type]
    stepper = hn.Stepper(model, inputs=["elbow"], observe=names)
    u = [0.0]
    for row in result.q:
        assert np.array_equal(stepper.q, row)
        if stepper.n % 3 == 0:
            u = control(stepper.t, stepper.observe())
        stepper.step(u)
    assert result.sensors.columns == hn.simulate(model).sensors.columns
    whole = hn.simulate(model, inputs=["elbow"], control=lambda t, y: [y[0]])
    assert np.abs(whole.q - hn.simulate(model).q).max() > 1e-4  # by default the sensors of the model
    for wrong, kind in [
        (lambda t, y: [1.0, 2.0], ValueError),
        (lambda t, y: [np.nan], hn.FunctionFailed),
        (lambda t, y: None, TypeError),
        (lambda t, y: 1 / 0, ZeroDivisionError),
    ]:
        with pytest.raises(kind) as error:
            hn.simulate(model, inputs=["elbow"], control=wrong)  # type: ignore[arg-type]
        text = str(error.value) + "".join(getattr(error.value, "__notes__", []))
        assert "the control" in text


def test_a_controlled_run_goes_on_bit_for_bit(double: str, tmp_path: Path) -> None:
    model = hn.Model.from_toml(double)
    options = {"inputs": ["elbow"], "control": lambda t, y: [-5.0 * y[0]], "control_every": 7, "forces": {"lower": wind}}
    whole = hn.simulate(model, **options)  # type: ignore[arg-type]

    def stop(step: int, of: int) -> None:
        if step > 0:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        hn.simulate(model, step=4e-5, out=tmp_path / "run", progress=stop, **options)  # type: ignore[arg-type]
    assert hn.open(tmp_path / "run").summary["status"] == "interrupted"
    rest = hn.simulate(None, resume=tmp_path / "run", **options)  # type: ignore[arg-type]
    again = hn.simulate(model, step=4e-5, **options)  # type: ignore[arg-type]
    assert np.array_equal(rest.q, again.q) and len(whole) == 201


def test_inputs_of_a_run_are_rows(double: str) -> None:
    model = hn.Model.from_toml(double)
    rows = np.sin(np.arange(200) / 9.0)
    result = hn.simulate(model, inputs={"elbow": rows, "lower.force": [0.0, 0.0, 0.3]})
    controls = np.column_stack([rows, np.zeros((200, 2)), np.full(200, 0.3)])
    run = hn.Stepper(model, inputs=["elbow", "lower.force"]).run(controls)
    assert np.array_equal(run.q, result.q)
    for wrong in ({"elbow": rows[:-1]}, {"elbow": np.zeros((200, 2))}, {"lower.force": 1.0}, {"lower.force": rows}):
        with pytest.raises(ValueError, match="inputs: .* has shape"):
            hn.simulate(model, inputs=wrong)
    with pytest.raises(ValueError, match="not finite"):
        hn.simulate(model, inputs={"elbow": np.nan})
    with pytest.raises(TypeError, match="a `control`"):
        hn.simulate(model, inputs=["elbow"])


def test_controls_are_inputs(double: str) -> None:
    """A control of the model file is an input by its name: along a joint, or a load times the value."""
    wrench = 'force = [0.0, 0.2, 1.5]\ntorque = [0.1, 0.0, 0.3]\npoint = [0.1, 0.0, 0.0]\nframe = "body"\n'
    joint = '[[control]]\nname = "servo"\njoint = "elbow"\n'
    jet = '[[control]]\nname = "jet"\nbody = "lower"\n' + wrench
    controlled = hn.Model.from_toml(double + joint + jet)
    rows = np.cos(np.arange(200) / 11.0)
    result = hn.simulate(controlled, inputs={"servo": rows, "jet": rows})
    history = f'history = {{ type = "steps", values = {rows.tolist()} }}\n'
    load = hn.Model.from_toml(double + '[[load]]\nname = "jet"\nbody = "lower"\n' + wrench + history)
    same = hn.simulate(load, inputs={"elbow": rows})
    assert np.abs(result.q - same.q).max() < 1e-12
    assert np.abs(result.energy["work.jet.control"] - same.energy["work.jet"]).max() < 1e-12


def test_set_points_are_the_path_of_a_motor(double: str) -> None:
    at = double.index("[[sensor]]")

    def with_motor(offset: float) -> hn.Model:
        motor = f"[joint.motor]\nproportional = 40.0\nderivative = 3.0\npath = {{ offset = {offset} }}\n"
        return hn.Model.from_toml(double[:at] + motor + double[at:] + '[[sensor]]\nname="u"\ntype="effort"\nof="elbow"\n')

    stepper = hn.Stepper(with_motor(0.1), inputs=["elbow.motor.path"], observe=["u"])
    assert stepper.held.tolist() == [0.1]  # until it is set, what the path begins with
    efforts = []
    result = hn.simulate(with_motor(0.1))
    for row in result.q:
        assert np.array_equal(stepper.q, row)
        efforts.append(stepper.observe())
        stepper.step()
    stepper.reset()
    other = hn.simulate(with_motor(0.7))
    for row, u in zip(other.q, other.sensors["u"]):
        assert np.array_equal(stepper.q, row)
        stepper.step([0.7], n=0)
        assert np.array_equal(stepper.observe(), np.atleast_1d(u))
        stepper.step()
    assert np.abs(other.q - result.q).max() > 1e-2
    with pytest.raises(hn.InvalidModel, match="has no motor that follows a path"):
        hn.Stepper(with_motor(0.1), inputs=["shoulder.motor.path"])
    with pytest.raises(hn.InvalidModel, match="did you mean `elbow`"):
        hn.Stepper(with_motor(0.1), inputs=["elbo.motor.path"])


def test_motions_of_python_are_paths(double: str) -> None:
    motion = '\n[[constraint]]\nname = "swing"\ntype = "motion"\njoint = "shoulder"\npath = { amplitude = 0.2, frequency = 0.5 }\n'
    at = double.index("[[joint]]")
    text = double[:at] + double[at:].replace('axis = [0.0, 1.0, 0.0]', f'axis = [0.0, 1.0, 0.0]\nrate = {0.2 * np.pi}', 1)
    model = hn.Model.from_toml(text + motion)

    def path(t: float) -> tuple[float, float, float]:
        w = np.pi
        return 0.2 * np.sin(w * t), 0.2 * w * np.cos(w * t), -0.2 * w * w * np.sin(w * t)

    apart = np.abs(hn.simulate(model, motions={"swing": path}).q - hn.simulate(model).q).max()
    assert apart < 1e-12
    other = hn.simulate(model, motions={"swing": lambda t: (0.2 * np.pi * t, 0.2 * np.pi, 0.0)})
    assert np.abs(other.q - hn.simulate(model).q).max() > 1e-3

    def wrong(t: float) -> tuple[float, float, float]:
        if 0.1 < t < 0.2:
            raise Wrong("lost")
        return path(t)

    with pytest.raises(Wrong) as error:
        hn.simulate(model, motions={"swing": wrong})
    assert "motion of `swing`" in error.value.__notes__[0]
    with pytest.raises(hn.InvalidModel, match="did you mean `swing`"):
        hn.simulate(model, motions={"swig": path})


def test_joints_begin_where_they_are_put(double: str) -> None:
    model = hn.Model.from_toml(double)
    stepper = hn.Stepper(model, observe=["shoulder", "elbow", "shoulder.rate", "elbow.rate"])
    stepper.reset(joints={"elbow": 0.3, "shoulder": -1.2}, rates={"elbow": 2.0})
    assert np.abs(stepper.observe() - [-1.2, 0.3, 0.0, 2.0]).max() < 1e-12
    upper, lower = stepper.q[:3], stepper.q[12:15]

    def place(angle: float) -> Any:
        return np.array([np.cos(angle), 0.0, -np.sin(angle)])

    assert np.abs(upper - 0.5 * place(-1.2)).max() < 1e-12
    assert np.abs(lower - place(-1.2) - 0.5 * place(-0.9)).max() < 1e-12
    stepper.step(n=50)
    there = stepper.q
    result = hn.simulate(model, joints={"elbow": 0.3, "shoulder": -1.2}, rates={"elbow": 2.0})
    assert np.array_equal(result.q[50], there)
    stepper.reset()
    assert np.array_equal(stepper.q, hn.simulate(model).q[0])
    assert pickle.loads(pickle.dumps(stepper)).q[0] == stepper.q[0]
    for joints, words in [({"elbo": 1.0}, "did you mean `elbow`"), ({"elbow.1": 1.0}, "no coordinate 1"), ({"elbow": np.nan}, "not finite")]:
        with pytest.raises(hn.InvalidModel, match=words):
            stepper.reset(joints=joints)
    with pytest.raises(ValueError, match="has shape"):
        stepper.reset(joints={"elbow": np.zeros((1, 1))})
    assert np.array_equal(stepper.q, hn.simulate(model).q[0])


def test_loops_are_closed_or_it_is_said_why() -> None:
    spec = hn.Spec("four_bar", gravity=[0, 0, -9.81], step=1e-3, end=0.05)
    corners = np.array([[0, 0, 0], [0, 0, 1], [2, 0, 1.5], [2, 0, 0]])
    bars: list[hn.Part | str] = ["ground"]
    for k, (a, b) in enumerate(zip(corners, corners[1:])):
        shape = hn.rod(float(np.linalg.norm(b - a)), 0.02, density=7800)
        bars.append(spec.body(f"bar{k}", position=(a + b) / 2, shape=shape, along=b - a))
    bars.append("ground")
    for k, at in enumerate(corners):
        spec.joint(f"pin{k}", "revolute", bars[k], bars[k + 1], position=at, axis=[0, 1, 0])
    observe = [f"pin{k}" for k in range(4)] + [f"pin{k}.rate" for k in range(4)]
    stepper = hn.Stepper(spec, observe=observe)
    for k in range(4):  # any joint of the loop, the cut one included
        for angle in (0.4, -0.4):
            stepper.reset(joints={f"pin{k}": angle}, rates={f"pin{k}": 1.5})
            seen = stepper.observe()
            assert abs(seen[k] - angle) < 1e-9 and abs(seen[4 + k] - 1.5) < 1e-9, (k, angle)
            stepper.step(n=20)
            assert stepper.energy["balance"] < 1.0
    with pytest.raises(hn.InvalidModel, match="cannot be brought"):
        stepper.reset(joints={"pin0": 0.3, "pin3": -1.0})
    with pytest.raises(hn.InvalidModel, match="no initial velocities"):
        stepper.reset(rates={"pin0": 1.0, "pin3": -1.0})
    with pytest.raises(hn.InvalidModel, match="cannot be brought"):
        stepper.reset(joints={"pin3": 2.9})  # out of reach


def test_functions_have_to_be_functions(double: str) -> None:
    model = hn.Model.from_toml(double)
    for options, words in [
        ({"laws": {"elbow": 3.0}}, "law of joint `elbow` has to be a function"),
        ({"forces": {"lower": [0, 0, 1]}}, "force on `lower` has to be a function"),
        ({"motions": {"swing": "x"}}, "motion of `swing` has to be a function"),
    ]:
        with pytest.raises(TypeError, match=words):
            hn.simulate(model, **options)  # type: ignore[arg-type]
        with pytest.raises(TypeError, match=words):
            hn.Stepper(model, **options)  # type: ignore[arg-type]
    for options, words in [
        ({"laws": {"elbo": effort}}, "did you mean `elbow`"),
        ({"laws": {"elbow.3": effort}}, "no coordinate 3"),
        ({"forces": {"lowr": wind}}, "did you mean `lower`"),
    ]:
        with pytest.raises(hn.InvalidModel, match=words):
            hn.Stepper(model, **options)  # type: ignore[arg-type]
    with pytest.raises(hn.InvalidModel, match="static"):
        hn.simulate(model, scheme="static", laws={"elbow": effort})


def test_a_stepper_with_functions_travels(double: str) -> None:
    stepper = hn.Stepper(hn.Model.from_toml(double), ["shoulder"], laws={"elbow": effort}, forces={"lower": wind})
    stepper.step([0.3], n=30)
    other = pickle.loads(pickle.dumps(stepper))
    stepper.step(n=30)
    other.step(n=30)
    assert np.array_equal(stepper.q, other.q)
