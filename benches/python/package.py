"""Processor times of the Python package: what it adds to a step, a law, a run. Needs the package and NumPy.

    python benches/python/package.py
"""

import os
import subprocess
import sys
import warnings
from time import process_time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads that wait count as processor time

import numpy as np

import holonom as hn

warnings.simplefilter("ignore", hn.HolonomWarning)
STEPS = 20_000


def pendulum(law: bool = False) -> hn.Model:
    """Two links on revolute joints."""
    spec = hn.Spec("double", gravity=[0, 0, -9.81], step=0.002, end=0.002 * STEPS)
    for name, x, mass in (("upper", 0.5, 1.0), ("lower", 1.5, 0.5)):
        spec.body(name, mass=mass, inertia=[0.01, 0.02, 0.02], position=[x, 0, 0])
    spec.joint("shoulder", "revolute", "ground", "upper", position=[0, 0, 0], axis=[0, 1, 0])
    spec.joint("elbow", "revolute", "upper", "lower", position=[1, 0, 0], axis=[0, 1, 0])
    if law:
        spec.law("own", joint="elbow", effort="-3*x")
    return spec.compile()


def least(call, count: int = STEPS, repeats: int = 15) -> float:
    """The least time of one of `count`, µs."""
    best = float("inf")
    for _ in range(repeats):
        begin = process_time()
        call(count)
        best = min(best, (process_time() - begin) / count)
    return 1e6 * best


def whole(stepper: hn.Stepper, *inputs):
    """All steps in one call."""

    def go(count: int) -> None:
        stepper.reset()
        stepper.step(*inputs, n=count)

    return go


def single(stepper: hn.Stepper, *inputs):
    """A call for each step."""

    def go(count: int) -> None:
        stepper.reset()
        step = stepper.step
        for _ in range(count):
            step(*inputs)

    return go


def repeated(call):
    """A call again and again."""

    def go(count: int) -> None:
        for _ in range(count):
            call()

    return go


def main() -> None:
    """Prints a line for each."""
    model = pendulum()
    names = ["shoulder", "shoulder.rate", "elbow", "elbow.rate"]
    stepper = hn.Stepper(model, ["shoulder", "elbow"], names)
    alone, each = least(whole(stepper)), least(single(stepper))
    print(f"a step in one call {alone:.2f} µs, by step() {each - alone:+.2f}")
    u = np.array([0.1, 0.2])
    held = least(whole(stepper, u))
    print(f"with an array of 2 inputs {least(single(stepper, u)) - held:+.2f}, a list {least(single(stepper, [0.1, 0.2])) - held:+.2f}")
    out = np.zeros(4)
    print(f"observe of 4 numbers {least(repeated(stepper.observe)):.2f} µs, into an array {least(repeated(lambda: stepper.observe(out))):.2f}")
    stated = least(whole(hn.Stepper(pendulum(law=True))))
    python = least(whole(hn.Stepper(model, laws={"elbow": lambda t, x, v: (-3.0 * x, -3.0, 0.0)})))
    print(f"a law of the file {stated:.2f} µs a step, of Python {python - stated:+.2f}")
    bare = least(whole(hn.Stepper(model)))
    run = least(lambda _: hn.simulate(model), repeats=8)
    part = least(lambda _: hn.simulate(model, record=["q"]), repeats=8)
    print(f"simulate {run:.2f} µs a step, {run - bare:+.2f} over the steps ({bare:.2f}), record=[\"q\"] {part - bare:+.2f}")
    members = [{"body.lower.mass": 0.4 + 0.001 * k} for k in range(256)]
    steps = 500

    def rolled(_: int) -> None:
        hn.rollout(model, set=members, steps=steps, every=steps, threads=1)

    def built(_: int) -> None:
        hn.rollout(model, set=members, steps=1, every=1, threads=1)

    count = 256 * steps
    begin = least(built, count=1, repeats=4)
    lanes = least(rolled, count=1, repeats=4)
    print(f"rollout of 256 members {count / (lanes - begin):.2f} M member-steps/s on a core, {begin / 256:.0f} µs to build one")
    print(f"replace {least(repeated(lambda: model.replace({'body.lower.mass': 0.7})), 300) / 1e3:.3f} ms, "
          f"a stepper {least(repeated(lambda: hn.Stepper(model)), 300) / 1e3:.3f} ms, "
          f"a start of joints {least(repeated(lambda: stepper.reset({'elbow': 0.3})), 300) / 1e3:.3f} ms")
    words = "import numpy, time; t = time.process_time(); import holonom; print(time.process_time() - t)"
    imports = [float(subprocess.check_output([sys.executable, "-c", words])) for _ in range(8)]
    print(f"import after numpy {1e3 * min(imports):.1f} ms")


if __name__ == "__main__":
    main()
