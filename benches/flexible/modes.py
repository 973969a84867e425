"""Frequencies of the parked blade, clamped at its root, in both programs.

    python benches/flexible/modes.py PROGRAM FOLDER      with numpy and exudyn

Prints the six lowest frequencies (Hz) of both by the number of elements, and how far each is from 48 elements of holonom.
"""
import csv, json, math, pathlib, subprocess, sys
import numpy as np
import exudyn as exu
from exudyn.utilities import *

program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
COUNT = 6
ROOT, TIP, WIDTH, THICKNESS, E, NU, RHO = 0.3, 5.0, 0.03, 0.25, 70e9, 0.3, 2700.0

MODEL = """
model = {{ name = "parked_blade" }}
simulation = {{ step = 0.001, end = 0.01 }}
[[beam]]
name = "blade"
points = [[{ROOT}, 0.0, 0.0], [{TIP}, 0.0, 0.0]]
elements = {elements}
normal = [0.0, 0.0, 1.0]
section = {{ shape = {{ type = "rectangle", dimensions = [{WIDTH}, {THICKNESS}] }}, material = {{ E = {E}, nu = {NU}, density = {RHO} }} }}
[[joint]]
name = "root"
type = "fixed"
parent = "ground"
child = "blade.start"
position = [{ROOT}, 0.0, 0.0]
"""


def ours(elements):
    out = folder / f"modes-{elements}"
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / f"modes-{elements}.toml"
    file.write_text(MODEL.format(elements=elements, **globals()))
    subprocess.run([program, "modes", file, "-n", str(COUNT), "-o", out, "--force"], check=True, capture_output=True)
    modes = json.load(open(out / "modes.json"))["modes"]
    return np.array([m["frequency"] for m in modes if m["kind"] == "vibration"][:COUNT])


def theirs(elements):
    """The same section numbers (rectangle: Cowper's shear, Saint-Venant's torsion)."""
    w, t, A = WIDTH, THICKNESS, WIDTH * THICKNESS
    G, k = E / (2 * (1 + NU)), 10 * (1 + NU) / (12 + 11 * NU)
    I1, I2, a, b = w * t**3 / 12, t * w**3 / 12, max(w, t), min(w, t)
    J = a * b**3 * (1 / 3 - 64 / math.pi**5 * b / a * sum(math.tanh(n * math.pi * a / (2 * b)) / n**5 for n in range(1, 60, 2)))
    SC = exu.SystemContainer()
    mbs = SC.AddSystem()
    e, d1 = np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    r0 = RotationMatrix2RotationVector(np.array([e, d1, np.cross(e, d1)]).T)
    line = [mbs.AddNode(NodeRigidBodyRotVecLG(referenceCoordinates=[ROOT + (TIP - ROOT) * k / elements, 0, 0, *r0]))
            for k in range(elements + 1)]
    section = exu.BeamSection()
    section.stiffnessMatrix = np.diag([E * A, k * G * A, k * G * A, G * J, E * I1, E * I2])
    section.inertia = RHO * np.diag([I1 + I2, I1, I2])
    section.massPerLength = RHO * A
    for k in range(elements):
        mbs.AddObject(ObjectBeamGeometricallyExact(nodeNumbers=line[k:k + 2], length=(TIP - ROOT) / elements, sectionData=section))
    mbs.Assemble()
    squared, _ = mbs.ComputeODE2Eigenvalues(constrainedCoordinates=list(range(6)), ignoreAlgebraicEquations=True)
    return np.sqrt(np.sort(np.abs(squared))[:COUNT]) / (2 * math.pi)


show = lambda name, f: print(f"{name:22}", " ".join(f"{x:10.5f}" for x in f), f"  off by {np.max(np.abs(f / limit - 1)):.1e}", flush=True)
limit = ours(48)
for n in (4, 6, 12, 24, 48):
    show(f"{n} holonom", ours(n))
for n in (12, 24, 48):
    show(f"{n} EXUDYN", theirs(n))
coarse, fine = theirs(24), theirs(48)
show("EXUDYN, extrapolated", np.sort(fine + (fine - coarse) / 3))  # errors of order 2
