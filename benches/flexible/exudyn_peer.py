"""The flexible systems of examples/models in EXUDYN: generalized-alpha, the same beams.

    python exudyn_peer.py '{"system": "rotor", "run": "FOLDER", "h": 1e-4, "end": 1.0, "sample": 0.01}'

Geometry, section numbers and the initial configuration come from the folder of a run by holonom: its model.toml and
the first row of its trajectory.csv. Prints one line of JSON: sampled positions of the observed node, CPU seconds.
"""
import json, math, os, sys, time, tomllib
for v in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(v, "1")
sys.exudynFast = True  # the build without range checks
import numpy as np
import exudyn as exu
from exudyn.utilities import *

job = json.loads(sys.argv[1])
folder, end, h, sample = job["run"], job["end"], job["h"], job["sample"]
model = tomllib.load(open(f"{folder}/model.toml", "rb"))
with open(f"{folder}/trajectory.csv") as f:
    names = f.readline().strip().split(",")
    row = dict(zip(names, map(float, f.readline().split(","))))
beams = {b["name"]: b for b in model["beam"]}
gravity = model["model"].get("gravity", [0.0, 0.0, 0.0])
vector = lambda name, key="": np.array([row[f"{name}.{key}{c}"] for c in "xyz"])


def section(beam):
    """The ten numbers of a section; those of a rectangle as holonom has them."""
    s = beam["section"]
    if "EA" in s:
        return dict(s)
    (w, t), m = s["shape"]["dimensions"], s["material"]
    E, nu, rho = m["E"], m["nu"], m["density"]
    G, A = E / (2 * (1 + nu)), w * t
    k = 10 * (1 + nu) / (12 + 11 * nu)  # Cowper
    I1, I2 = w * t**3 / 12, t * w**3 / 12  # about d_1 (thickness along d_2), about d_2
    a, b = max(w, t), min(w, t)
    J = a * b**3 * (1 / 3 - 64 / math.pi**5 * b / a * sum(
        math.tanh(n * math.pi * a / (2 * b)) / n**5 for n in range(1, 60, 2)))
    return dict(EA=E * A, GA1=k * G * A, GA2=k * G * A, EI1=E * I1, EI2=E * I2, GJ=G * J,
                rhoA=rho * A, rhoI1=rho * I1, rhoI2=rho * I2, rhoJ=rho * (I1 + I2))


def spline(times, values, rates):
    """The cubic spline of a path, clamped at both ends and continued at its rate."""
    n, x, y = len(times), np.array(times), np.array(values)
    A, b = np.zeros((n, n)), np.zeros(n)
    A[0, 0], b[0], A[-1, -1], b[-1] = 1, rates[0], 1, rates[1]
    for i in range(1, n - 1):
        l, r = x[i] - x[i - 1], x[i + 1] - x[i]
        A[i, i - 1:i + 2] = 1 / l, 2 / l + 2 / r, 1 / r
        b[i] = 3 * ((y[i] - y[i - 1]) / l**2 + (y[i + 1] - y[i]) / r**2)
    d = np.linalg.solve(A, b)

    def value(t):
        if t >= x[-1]:
            return y[-1] + rates[1] * (t - x[-1])
        i = max(0, int(np.searchsorted(x, t, side="right")) - 1)
        l = x[i + 1] - x[i]
        s = (t - x[i]) / l
        return (y[i] * (1 + 2 * s) * (1 - s)**2 + y[i + 1] * s * s * (3 - 2 * s)
                + l * (d[i] * s * (1 - s)**2 + d[i + 1] * s * s * (s - 1)))
    return value


def path(p):
    moves = p.get("moves", [])
    table = spline(**p["table"]) if p.get("table") else (lambda t: 0.0)

    def value(t):
        angle = p.get("offset", 0.0) + p.get("rate", 0.0) * t + table(t)
        for m in moves:
            s = min(1.0, max(0.0, (t - m["start"]) / (m["end"] - m["start"])))
            angle += m["by"] * s**3 * (10 - 15 * s + 6 * s * s)
        return float(angle)
    return value


def factor(history):
    a, b, c = history["start"], history["peak"], history["end"]
    return lambda t: max(0.0, min((t - a) / (b - a), (c - t) / (c - b)))


SC = exu.SystemContainer()
mbs = SC.AddSystem()
ground = mbs.AddObject(ObjectGround())
fixed = mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=mbs.AddNode(NodePointGround()), coordinate=0))
nodes = {}


def prescribe(node, coordinate, value=None):
    m = [fixed, mbs.AddMarker(MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))]
    if value is None:
        mbs.AddObject(CoordinateConstraint(markerNumbers=m))
    else:
        mbs.AddObject(CoordinateConstraint(markerNumbers=m, offsetUserFunction=lambda mbs, t, i, offset: value(t)))


def weight(item):
    if any(gravity):
        marker = mbs.AddMarker(MarkerBodyMass(bodyNumber=item))
        mbs.AddLoad(LoadMassProportional(markerNumber=marker, loadVector=gravity))


def planar_beam(name):
    """Nodes with the rotation from the reference as their angle; returns them."""
    beam, s = beams[name], section(beams[name])
    a, b = (np.array(p) for p in beam["points"])
    n, e = beam["elements"], (b - a) / np.linalg.norm(b - a)
    line = []
    for k in range(n + 1):
        x0, x, d3 = a + (b - a) * k / n, vector(f"{name}.{k}"), vector(f"{name}.{k}", "d3")
        angle = math.atan2(e[0] * d3[1] - e[1] * d3[0], e @ d3)
        line.append(mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[x0[0], x0[1], 0.0],
                                                initialCoordinates=[*(x - x0)[:2], angle])))
    for k in range(n):  # d_1 is normal to the plane: bending about d_1, shear along d_2
        weight(mbs.AddObject(ObjectBeamGeometricallyExact2D(
            nodeNumbers=line[k:k + 2], length=np.linalg.norm(b - a) / n, massPerLength=s["rhoA"],
            crossSectionInertia=s["rhoI1"], bendingStiffness=s["EI1"], axialStiffness=s["EA"],
            shearStiffness=s["GA2"], includeReferenceRotations=False)))
    nodes[name] = line
    return line


def spatial_beam(name, spin):
    """Nodes with Euler parameters, or rotation vectors; frames (d_3, d_1, d_2); velocities of a rotation about z."""
    beam, s = beams[name], section(beams[name])
    a, b = (np.array(p) for p in beam["points"])
    n, e, d1 = beam["elements"], (b - a) / np.linalg.norm(b - a), np.array(beam["normal"])
    R0 = np.array([e, d1, np.cross(e, d1)]).T
    line, w = [], np.array([0.0, 0.0, spin])
    for k in range(n + 1):
        x0, x = a + (b - a) * k / n, vector(f"{name}.{k}")
        R = np.array([vector(f"{name}.{k}", d) for d in ("d3", "d1", "d2")]).T
        v = np.cross(w, x)
        if job.get("nodes") == "lie":
            r0 = RotationMatrix2RotationVector(R0)
            dr = RotationMatrix2RotationVector(R0.T @ R)
            line.append(mbs.AddNode(NodeRigidBodyRotVecLG(
                referenceCoordinates=[*x0, *r0], initialCoordinates=[*(x - x0), *dr],
                initialVelocities=[*v, *(R.T @ w)])))
        else:
            p0, p = np.array(RotationMatrix2EulerParameters(R0)), np.array(RotationMatrix2EulerParameters(R))
            p = p if p @ p0 > 0 else -p
            rate = AngularVelocity2EulerParameters_t(w, p)
            line.append(mbs.AddNode(NodeRigidBodyEP(
                referenceCoordinates=[*x0, *p0], initialCoordinates=[*(x - x0), *(p - p0)],
                initialVelocities=[*v, *rate])))
    data = exu.BeamSection()
    data.stiffnessMatrix = np.diag([s["EA"], s["GA1"], s["GA2"], s["GJ"], s["EI1"], s["EI2"]])
    data.inertia = np.diag([s.get("rhoJ", s["rhoI1"] + s["rhoI2"]), s["rhoI1"], s["rhoI2"]])
    data.massPerLength = s["rhoA"]
    for k in range(n):
        weight(mbs.AddObject(ObjectBeamGeometricallyExact(
            nodeNumbers=line[k:k + 2], length=float(np.linalg.norm(b - a)) / n, sectionData=data)))
    nodes[name] = line
    return line, R0


def rotor():
    drive = path(model["constraint"][0]["path"])
    line, R0 = spatial_beam("blade1", model["joint"][0]["rate"])
    hub = mbs.AddNode(NodeRigidBody2D(referenceCoordinates=[0.0] * 3,
                                      initialVelocities=[0.0, 0.0, model["joint"][0]["rate"]]))
    disc = mbs.AddObject(ObjectRigidBody2D(nodeNumber=hub, mass=150.0, inertia=7.0))
    prescribe(hub, 0), prescribe(hub, 1), prescribe(hub, 2, drive)
    root = beams["blade1"]["points"][0]
    mbs.AddObject(GenericJoint(rotationMarker0=R0, markerNumbers=[
        mbs.AddMarker(MarkerBodyRigid(bodyNumber=disc, localPosition=root)),
        mbs.AddMarker(MarkerNodeRigid(nodeNumber=line[0]))]))
    for load in model.get("load", []):
        f, at = np.array(load["force"]), factor(load["history"])
        marker = mbs.AddMarker(MarkerNodePosition(nodeNumber=line[-1]))
        mbs.AddLoad(LoadForceVector(markerNumber=marker, loadVector=list(f),
                                    loadVectorUserFunction=lambda mbs, t, v: list(f * at(t))))
    return line[-1]


def satellite():
    hub = model["body"][0]
    spin, m, a = hub["angular_velocity"][2], hub["mass"], hub["shape"]["dimensions"][0]
    body = mbs.CreateRigidBody(inertia=RigidBodyInertia(mass=m, inertiaTensor=np.eye(3) * m * a * a / 6),
                               initialAngularVelocity=[0.0, 0.0, spin], nodeType=exu.NodeType.RotationEulerParameters)
    for name in beams:
        line, R0 = spatial_beam(name, spin)
        mbs.AddObject(GenericJoint(rotationMarker0=R0, markerNumbers=[
            mbs.AddMarker(MarkerBodyRigid(bodyNumber=body, localPosition=beams[name]["points"][0])),
            mbs.AddMarker(MarkerNodeRigid(nodeNumber=line[0]))]))
    load = model["load"][0]
    torque, at = np.array(load["torque"]), factor(load["history"])
    marker = mbs.AddMarker(MarkerBodyRigid(bodyNumber=body))
    mbs.AddLoad(LoadTorqueVector(markerNumber=marker, loadVector=list(torque), bodyFixed=load["frame"] == "body",
                                 loadVectorUserFunction=lambda mbs, t, v: list(torque * at(t))))
    return nodes["north"][-1]


def crank_end(line, radius, phase, drive):
    """Prescribed displacement of the first node of a beam on a crank about the origin."""
    x0, y0 = radius * math.cos(phase), radius * math.sin(phase)
    prescribe(line[0], 0, lambda t: radius * math.cos(phase + drive(t)) - x0)
    prescribe(line[0], 1, lambda t: radius * math.sin(phase + drive(t)) - y0)


def flexible_slider_crank():
    line = planar_beam("rod")
    crank_end(line, 0.15, 0.0, path(model["constraint"][0]["path"]))
    prescribe(line[-1], 1)
    mass = next(b["mass"] for b in model["body"] if b["name"] == "slider")
    mbs.AddObject(ObjectMassPoint2D(nodeNumber=line[-1], mass=mass))
    return line[len(line) // 2]


def four_bar_steel():
    line = planar_beam("coupler")
    crank_end(line, 0.3, math.pi / 2, path(model["constraint"][0]["path"]))
    rocker = planar_beam("rocker")
    prescribe(rocker[0], 0), prescribe(rocker[0], 1)
    mbs.AddObject(RevoluteJoint2D(markerNumbers=[mbs.AddMarker(MarkerNodePosition(nodeNumber=n))
                                                 for n in (line[-1], rocker[-1])]))
    return line[len(line) // 2]


tip = globals()[job["system"]]()
sensor = mbs.AddSensor(SensorNode(nodeNumber=tip, storeInternal=True, outputVariableType=exu.OutputVariableType.Position))
mbs.Assemble()
settings = exu.SimulationSettings()
settings.solutionSettings.writeSolutionToFile = False
settings.solution.sensors.writePeriod = sample
ti = settings.timeIntegration
ti.numberOfSteps, ti.endTime, ti.verboseMode = round(end / h), end, 0
ti.newton.useModifiedNewton = job.get("modified_newton", True)
ti.generalizedAlpha.spectralRadius = job.get("rho", 0.9)
ti.generalizedAlpha.computeInitialAccelerations = True
ti.adaptiveStep = job.get("adaptive", False)
if job.get("newton_tolerance"):
    ti.newton.relativeTolerance = job["newton_tolerance"]
    ti.newton.absoluteTolerance = job["newton_tolerance"] * 1e-2
settings.linearSolver.solverType = exu.LinearSolverType.EigenSparse
cpu = []
ok = True
for _ in range(job.get("repeat", 1)):
    begin = time.process_time()
    try:
        ok = mbs.SolveDynamic(settings, solverType=exu.DynamicSolverType.GeneralizedAlpha, showHints=False)
    except Exception:
        ok = False
    cpu.append(time.process_time() - begin)
data = np.array(mbs.GetSensorStoredData(sensor))
print("\nRESULT " + json.dumps({"ok": bool(ok), "cpu": cpu, "steps": round(end / h),
                              "t": data[:, 0].tolist(), "x": data[:, 1:4].tolist()}))
