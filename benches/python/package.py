"""Processor times of the Python package: what it adds to a step, a law, a run. Needs the package and NumPy.

    python benches/python/package.py [PEER]

``PEER``: the executable of ``cargo bench -p benches --bench python_peer``, for ratios to the same run in Rust.
"""

import os
import subprocess
import sys
import tempfile
import warnings
from time import perf_counter, process_time

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # threads that wait count as processor time

import numpy as np

import holonom as hn

warnings.simplefilter("ignore", hn.HolonomWarning)
STEPS = 20_000
C_LAW = "double law(double t, double x, double v, double *s) { s[0] = -3.0; s[1] = 0.0; return -3.0*x; }"
EIGHT = 8


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


def chain() -> str:
    """The text of a chain of eight links."""
    spec = hn.Spec("chain", gravity=[0, 0, -9.81], step=0.002, end=1.0)
    for k in range(EIGHT):
        spec.body(f"link{k}", mass=1.0, inertia=[0.01, 0.02, 0.02], position=[k + 0.5, 0, 0])
        spec.joint(f"pin{k}", "revolute", f"link{k - 1}" if k else "ground", f"link{k}", position=[k, 0, 0], axis=[0, 1, 0])
    return spec.to_toml()


def in_machine_code(folder: str):
    """The law of the file, by a C compiler."""
    import ctypes

    with open(f"{folder}/law.c", "w") as file:
        file.write(C_LAW)
    subprocess.run(["cc", "-shared", "-fPIC", "-O2", "-o", f"{folder}/law.so", f"{folder}/law.c"], check=True)
    law = ctypes.CDLL(f"{folder}/law.so").law
    law.restype, law.argtypes = ctypes.c_double, [ctypes.c_double] * 3 + [ctypes.POINTER(ctypes.c_double)]
    return hn.compiled(law)


def with_peer(model: hn.Model, peer: str, folder: str, rolled) -> None:
    """Ratios to Rust, one after the other in several rounds."""
    model.save(f"{folder}/double.toml")
    names, rounds = ("steps", "run", "members"), []
    count = 256 * 4000
    for _ in range(5):
        said = subprocess.check_output([peer, f"{folder}/double.toml"], text=True)
        theirs = dict(zip(names, map(float, said.split())))
        ours = least(lambda _: hn.simulate(model), repeats=5)
        begin = process_time()
        rolled(1)
        built = process_time()
        rolled(4000)
        members = 1e6 * ((process_time() - built) - (built - begin)) / (count - 256)
        rounds.append((theirs["run"], ours, theirs["members"], members, theirs["steps"]))
    run, ours, lanes, members, steps = (min(column) for column in zip(*rounds))
    print(f"in Rust: a step {steps:.2f} µs, simulate {ours:.2f} over a run {run:.2f} µs a step: {100 * (ours / run - 1):+.1f} %; "
          f"members {1 / lanes:.2f} M steps/s, rollout {1 / members:.2f}: {100 * lanes / members:.0f} %")


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
    with tempfile.TemporaryDirectory() as folder:
        compiled = least(whole(hn.Stepper(model, laws={"elbow": in_machine_code(folder)})))
    print(f"a law of machine code {compiled:.2f} µs a step, {100 * (compiled / stated - 1):+.0f} % over that of the file")
    bare = least(whole(hn.Stepper(model)))
    run = least(lambda _: hn.simulate(model), repeats=8)
    part = least(lambda _: hn.simulate(model, record=["q"]), repeats=8)
    print(f"simulate {run:.2f} µs a step, {run - bare:+.2f} over the steps ({bare:.2f}), record=[\"q\"] {part - bare:+.2f}")
    pairs = [[least(lambda _, kept=kept: hn.simulate(model, record=kept), repeats=3) for kept in (None, ["momenta"])] for _ in range(6)]
    ours, read = (min(column) for column in zip(*pairs))
    print(f"simulate over a run that reads all of each node and keeps its momentum maps alone {100 * (ours / read - 1):+.1f} %")
    members = [{"body.lower.mass": 0.4 + 0.001 * k} for k in range(256)]
    steps = 500

    def rolled(count: int, threads: int = 1) -> None:
        hn.rollout(model, set=members, steps=count, every=count, threads=threads)

    count = 256 * (steps - 1)
    begin = least(lambda _: rolled(1), count=1, repeats=4)
    lanes = least(lambda _: rolled(steps), count=1, repeats=4)
    print(f"rollout of 256 members {count / (lanes - begin):.2f} M member-steps/s on a core, {begin / 256:.0f} µs to build one")
    long = 40 * steps
    clocks = []
    for threads in (1, 2):
        times = []
        for _ in range(3):
            start = perf_counter()
            rolled(long, threads)
            times.append(perf_counter() - start)
        clocks.append(min(times))
    print(f"two threads {clocks[0] / clocks[1]:.2f} times one, by the clock, beside other processes")
    if len(sys.argv) > 1:
        with tempfile.TemporaryDirectory() as folder:
            with_peer(model, sys.argv[1], folder, rolled)
    text = chain()
    print(f"a model of 8 links from its text {least(repeated(lambda: hn.Model.from_toml(text)), 200) / 1e3:.3f} ms, "
          f"with its start {least(repeated(lambda: hn.Stepper(hn.Model.from_toml(text))), 200) / 1e3:.3f} ms")
    print(f"replace {least(repeated(lambda: model.replace({'body.lower.mass': 0.7})), 300) / 1e3:.3f} ms, "
          f"a stepper {least(repeated(lambda: hn.Stepper(model)), 300) / 1e3:.3f} ms, "
          f"a start of joints {least(repeated(lambda: stepper.reset({'elbow': 0.3})), 300) / 1e3:.3f} ms")
    words = "import numpy, time; t = time.process_time(); import holonom; print(time.process_time() - t)"
    imports = [float(subprocess.check_output([sys.executable, "-c", words])) for _ in range(8)]
    print(f"import after numpy {1e3 * min(imports):.1f} ms")


if __name__ == "__main__":
    main()
