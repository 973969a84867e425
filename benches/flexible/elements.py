"""Error of beams against the number of elements, and CPU time, beside EXUDYN in the same run.

    python elements.py PROGRAM FOLDER [PROBLEM ...]     with a Python that has numpy and exudyn

Statics: distance of the end from the exact beam, relative to its displacement; CPU time of all load steps. Motions: the largest
distance of the observed ends at the sampled times from a fine solution (elements and step of FINE), relative to the largest
displacement; then the cheapest run below each error. CPU time: of holonom the whole process without that of a run of one step, of EXUDYN its solver alone; least of three.
"""
import math, os, pathlib, subprocess, sys, time, tomllib
for v in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(v, "1")
sys.exudynFast = True  # the build without range checks
import numpy as np

HERE = pathlib.Path(__file__).parent
MODELS = HERE / "../../examples/models"
KINDS = ("helicoidal", "second_order", "mean_directors")
ROUNDS = 3
# elements per leg; observed nodes by the number of elements; changes of the model
STATIC = {
    "roll_up": dict(beam="beam", exact=(0.0, 0.0, 0.0), counts=(4, 8, 16, 32), length=10.0, steps=20,
                    more=["load.moment.torque=[0.0, 0.0, 314.1592653589793]"]),
    "bend_45": dict(beam="bend", exact=(15.68480053, 47.15043857, 53.47485879), counts=(2, 4, 8, 16, 32), length=25 * math.pi, steps=10),
    "princeton": dict(beam="strip", exact=(0.508 - 0.01441182, -0.00897920, 0.10911312), counts=(2, 4, 8, 16, 32), length=0.508, steps=10),
    # by shooting with the equations of the plane beam: 1e-7 cm
    "lee_frame": dict(beam="frame", exact=(32.0282222, 94.1073662, 0.0), counts=(5, 10, 20, 40), length=120.0, steps=10, node=lambda n: n + 1 + n // 5),
}
MOTION = {
    "flying_beam": dict(beam="beam", legs=1, counts=(5, 10, 20, 40), steps=(0.05, 0.02, 0.01, 0.005), end=5.0, sample=0.1, peers=("EXUDYN planar", "EXUDYN"),
                        nodes=lambda n: (0, n), sets=lambda n: []),
    "elbow_cantilever": dict(beam="frame", legs=2, counts=(2, 4, 8, 16, 32), steps=(0.1, 0.05, 0.025, 0.0125), end=6.0, sample=0.2, peers=("EXUDYN",),
                             nodes=lambda n: (n, 2 * n + 1), sets=lambda n: [f"load.shake.body=frame.{n}", f"sensor.elbow.of=frame.{n}"]),
    "elastic_ring": dict(beam="ring", legs=1, counts=(8, 16, 32, 64), steps=(0.02, 0.01, 0.005, 0.0025), end=4.0, sample=0.1, peers=("EXUDYN",),
                         nodes=lambda n: (0, n // 2), sets=lambda n: [f"spring.cord.to=ring.{n // 2}"]),
}
FINE = "second_order", 160, 0.00125
TARGETS = (3e-2, 1e-2, 3e-3, 1e-3)


def file(name):
    own = HERE / f"{name}.toml"
    return own if own.exists() else MODELS / f"{name}.toml"


def spent(args):
    child = subprocess.Popen([str(a) for a in args], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    return status == 0, used.ru_utime + used.ru_stime


def least(f):
    return min(f() for _ in range(ROUNDS))


class Holonom:
    def __init__(self, program, folder):
        self.program, self.folder, self.model = program, pathlib.Path(folder), None
        self.folder.mkdir(parents=True, exist_ok=True)

    def run(self, name, sets, end=None, rounds=ROUNDS):
        """Rows of the trajectory by their columns, and seconds; `None` where it does not reach the end."""
        out = self.folder / name
        command = [self.program, "run", file(name), "-o", out, "--force", "-q"]
        command += [a for own in sets for a in ("--set", own)]
        last = ["--end", repr(end)] if end else []
        ok, first = spent([*command, *last])
        if not ok:
            return None
        cpu = min([first] + [spent([*command, *last])[1] for _ in range(rounds - 1)])
        with open(out / "trajectory.csv") as f:
            names = f.readline().strip().split(",")
            rows = np.loadtxt(f, delimiter=",", ndmin=2)
        if rounds > 1:
            step = tomllib.load(open(out / "model.toml", "rb"))["simulation"]["step"]
            cpu -= least(lambda: spent([*command, "--end", repr(step)])[1])
        return {n: rows[:, k] for k, n in enumerate(names)}, cpu


def places(columns, beam, nodes):
    return np.stack([columns[f"{beam}.{k}.{c}"] for k in nodes for c in "xyz"], 1)


def section(name):
    """EA, GA_1, GA_2, EI_1, EI_2, GJ of a model."""
    s = tomllib.load(open(file(name), "rb"))["beam"][0]["section"]
    if "EA" in s:
        return [s[k] for k in ("EA", "GA1", "GA2", "EI1", "EI2", "GJ")]
    (w, t), m = s["shape"]["dimensions"], s["material"]
    E, G = m["E"], m["E"] / (2 * (1 + m["nu"]))
    k = s["shear_factors"]
    return [E * w * t, k[0] * G * w * t, k[1] * G * w * t, E * w * t**3 / 12, E * t * w**3 / 12, G * s["torsion_constant"]]


class Peer:
    """The problems in EXUDYN."""

    def __init__(self):
        import exudyn
        from exudyn import utilities
        self.exu, self.u, self.sc = exudyn, utilities, exudyn.SystemContainer()

    def spatial(self, points, triads, numbers, inertia, line, length, turn=0.0):
        """Nodes with Euler parameters, frames (d_3, d_1, d_2), that turn about z."""
        u, mbs = self.u, self.mbs
        own = []
        for x, R in zip(points, triads):
            p = np.array(u.RotationMatrix2EulerParameters(R))
            v = np.cross([0.0, 0.0, turn], x)
            rate = u.AngularVelocity2EulerParameters_t([0.0, 0.0, turn], p)
            own.append(mbs.AddNode(u.NodeRigidBodyEP(referenceCoordinates=[*x, *p], initialVelocities=[*v, *rate])))
        ea, ga1, ga2, ei1, ei2, gj = numbers
        data = self.exu.BeamSection()
        data.stiffnessMatrix = np.diag([ea, ga1, ga2, gj, ei1, ei2])
        data.inertia, data.massPerLength = np.diag(inertia), line
        for a, b in zip(own, own[1:]):
            mbs.AddObject(u.ObjectBeamGeometricallyExact(nodeNumbers=[a, b], length=length, sectionData=data))
        return own

    def clamp(self, node, R):
        u, mbs = self.u, self.mbs
        ground = mbs.AddObject(u.ObjectGround())
        mbs.AddObject(u.GenericJoint(rotationMarker0=R, markerNumbers=[
            mbs.AddMarker(u.MarkerBodyRigid(bodyNumber=ground)), mbs.AddMarker(u.MarkerNodeRigid(nodeNumber=node))]))

    def settings(self):
        s = self.exu.SimulationSettings()
        s.solutionSettings.writeSolutionToFile = False
        s.linearSolver.solverType = self.exu.LinearSolverType.EigenSparse
        return s

    def solve(self, f):
        before = time.process_time()
        try:
            ok = f()
        except Exception:
            ok = False
        return bool(ok), time.process_time() - before

    def static(self, name, n):
        u, problem = self.u, STATIC[name]
        best = None
        for _ in range(ROUNDS):
            self.sc.Reset()
            self.mbs = mbs = self.sc.AddSystem()
            s = np.linspace(0.0, problem["length"], n + 1)
            d1 = np.array([0.0, 0.0, 1.0])
            if name == "bend_45":  # about (100, 0, 0), begins along y
                a = s / 100
                points = [np.array([100 - 100 * math.cos(a), 100 * math.sin(a), 0.0]) for a in a]
                axes = [np.array([math.sin(a), math.cos(a), 0.0]) for a in a]
            else:
                points, axes = [np.array([s, 0.0, 0.0]) for s in s], [np.array([1.0, 0.0, 0.0])] * (n + 1)
            triads = [np.array([e, d1, np.cross(e, d1)]).T for e in axes]
            if name == "lee_frame":
                own = [self.lee_frame(n)]
            else:
                own = self.spatial(points, triads, section(name), [2.0, 1.0, 1.0], 1.0, problem["length"] / n)
                self.clamp(own[0], triads[0])
            if name == "lee_frame":
                mbs.AddLoad(u.LoadForceVector(markerNumber=mbs.AddMarker(u.MarkerNodePosition(nodeNumber=own[-1])), loadVector=[0, -1.5, 0]))
            elif name == "roll_up":
                mbs.AddLoad(u.LoadTorqueVector(markerNumber=mbs.AddMarker(u.MarkerNodeRigid(nodeNumber=own[-1])), loadVector=[0, 0, 100 * math.pi]))
            else:
                force = [0, 0, 600] if name == "bend_45" else [0.0, -6.290421925435527, 6.290421925435527]
                mbs.AddLoad(u.LoadForceVector(markerNumber=mbs.AddMarker(u.MarkerNodePosition(nodeNumber=own[-1])), loadVector=force))
            mbs.Assemble()
            settings = self.settings()
            settings.staticSolver.numberOfLoadSteps, settings.staticSolver.verboseMode = problem["steps"], 0
            settings.staticSolver.newton.relativeTolerance = 1e-8
            settings.staticSolver.newton.numericalDifferentiation.relativeEpsilon = 1e-7
            ok, cpu = self.solve(lambda: mbs.SolveStatic(settings, showHints=False))
            if not ok:
                return None
            best = min(best or cpu, cpu)
        return np.array(mbs.GetNodeOutput(own[-1], self.exu.OutputVariableType.Position)), best

    def flying_beam(self, n, planar):
        u, mbs = self.u, self.mbs
        a, b, s = np.array([6.0, 0.0]), np.array([0.0, 8.0]), section("flying_beam")
        if not planar:
            e, z = np.array([*(b - a), 0.0]) / 10, np.eye(3)[2]
            R = np.array([e, z, np.cross(e, z)]).T
            own = self.spatial([[*(a + (b - a) * k / n), 0.0] for k in range(n + 1)], [R] * (n + 1), s, [20.0, 10.0, 10.0], 1.0, 10 / n)
            return self.push(own)
        own = [mbs.AddNode(u.NodeRigidBody2D(referenceCoordinates=[*(a + (b - a) * k / n), math.atan2(8.0, -6.0)])) for k in range(n + 1)]
        for k in range(n):
            mbs.AddObject(u.ObjectBeamGeometricallyExact2D(
                nodeNumbers=own[k:k + 2], length=10.0 / n, massPerLength=1.0, crossSectionInertia=10.0, bendingStiffness=s[3],
                axialStiffness=s[0], shearStiffness=s[2], includeReferenceRotations=True))
        return self.push(own)

    def push(self, own):
        u, mbs = self.u, self.mbs
        # a step takes the mean of the loads at its ends: with half the load at the end of the pulse its impulse is right
        pushes = lambda t: 0.5 if abs(t - 2.5) < 1e-9 else float(t < 2.5)
        m = mbs.AddMarker(u.MarkerNodeRigid(nodeNumber=own[0]))
        mbs.AddLoad(u.LoadForceVector(markerNumber=m, loadVector=[8, 0, 0], loadVectorUserFunction=lambda mbs, t, v: [8 * pushes(t), 0, 0]))
        mbs.AddLoad(u.LoadTorqueVector(markerNumber=m, loadVector=[0, 0, -80], loadVectorUserFunction=lambda mbs, t, v: [0, 0, -80 * pushes(t)]))
        return own[0], own[-1]

    def elbow_cantilever(self, n, planar):
        u, mbs = self.u, self.mbs
        e, z, y = np.eye(3)[0], np.eye(3)[2], np.eye(3)[1]
        first, second = np.array([e, z, np.cross(e, z)]).T, np.array([y, z, np.cross(y, z)]).T
        s = section("elbow_cantilever")
        one = self.spatial([10 * e * k / n for k in range(n + 1)], [first] * (n + 1), s, [20.0, 10.0, 10.0], 1.0, 10 / n)
        two = self.spatial([10 * e + 10 * y * k / n for k in range(n + 1)], [second] * (n + 1), s, [20.0, 10.0, 10.0], 1.0, 10 / n)
        self.clamp(one[0], first)
        mbs.AddObject(u.GenericJoint(rotationMarker0=first.T, rotationMarker1=second.T, markerNumbers=[
            mbs.AddMarker(u.MarkerNodeRigid(nodeNumber=k)) for k in (one[-1], two[0])]))
        shake = lambda t: 50.0 * max(0.0, min(t, 2.0 - t))
        mbs.AddLoad(u.LoadForceVector(markerNumber=mbs.AddMarker(u.MarkerNodePosition(nodeNumber=one[-1])), loadVector=[0, 0, 1],
                                      loadVectorUserFunction=lambda mbs, t, v: [0, 0, shake(t)]))
        return one[-1], two[-1]

    def hinge(self, a, b, R=None, S=None, free=False):
        """Node `a` on node `b`, or on the ground: welded, or free to turn about z."""
        u, mbs = self.u, self.mbs
        marker = lambda k: mbs.AddMarker(u.MarkerNodeRigid(nodeNumber=k))
        other = mbs.AddMarker(u.MarkerBodyRigid(bodyNumber=mbs.AddObject(u.ObjectGround(referencePosition=b)))) if isinstance(b, list) else marker(b)
        mbs.AddObject(u.GenericJoint(rotationMarker0=np.eye(3) if S is None else S, rotationMarker1=R, markerNumbers=[other, marker(a)],
                                     constrainedAxes=[1, 1, 1, 1, 1, 0 if free else 1]))

    def lee_frame(self, n):
        e, z, y = np.eye(3)[0], np.eye(3)[2], np.eye(3)[1]
        up, along = np.array([y, z, np.cross(y, z)]).T, np.array([e, z, np.cross(e, z)]).T
        s, length = section("lee_frame"), 120 / n
        one = self.spatial([y * length * k for k in range(n + 1)], [up] * (n + 1), s, [2.0, 1.0, 1.0], 1.0, length)
        two = self.spatial([120 * y + e * length * k for k in range(n + 1)], [along] * (n + 1), s, [2.0, 1.0, 1.0], 1.0, length)
        self.hinge(one[0], [0, 0, 0], R=up.T, free=True)
        self.hinge(two[-1], [120, 120, 0], R=along.T, free=True)
        self.hinge(two[0], one[-1], R=along.T, S=up.T)
        return two[n // 5]

    def elastic_ring(self, n, planar):
        u, mbs, s = self.u, self.mbs, section("elastic_ring")
        z, angles = np.eye(3)[2], 2 * math.pi * np.arange(n + 1) / n
        points = [np.array([math.cos(a), math.sin(a), 0.0]) for a in angles]
        axes = [np.array([-math.sin(a), math.cos(a), 0.0]) for a in angles]
        triads = [np.array([e, z, np.cross(e, z)]).T for e in axes]
        own = self.spatial(points, triads, s, [0.02, 0.01, 0.01], 0.5, 2 * math.pi / n, turn=2.0)
        self.hinge(own[-1], own[0], R=triads[-1].T, S=triads[0].T)
        ends = [mbs.AddMarker(u.MarkerNodePosition(nodeNumber=own[k])) for k in (0, n // 2)]
        mbs.AddObject(u.ObjectConnectorSpringDamper(markerNumbers=ends, stiffness=4.0, referenceLength=3.0))
        return own[0], own[n // 2]

    def motion(self, name, n, h, planar):
        u, problem, best = self.u, MOTION[name], None
        for _ in range(ROUNDS):
            self.sc.Reset()
            self.mbs = mbs = self.sc.AddSystem()
            sensors = [mbs.AddSensor(u.SensorNode(nodeNumber=k, storeInternal=True, outputVariableType=self.exu.OutputVariableType.Position))
                       for k in getattr(self, name)(n, planar)]
            mbs.Assemble()
            settings = self.settings()
            settings.solution.sensors.writePeriod = problem["sample"]
            ti = settings.timeIntegration
            ti.numberOfSteps, ti.endTime, ti.verboseMode = round(problem["end"] / h), problem["end"], 0
            ti.newton.useModifiedNewton, ti.adaptiveStep = True, False
            ti.generalizedAlpha.spectralRadius = 1.0
            ti.newton.relativeTolerance, ti.newton.absoluteTolerance = 1e-6, 1e-8
            ok, cpu = self.solve(lambda: mbs.SolveDynamic(settings, solverType=self.exu.DynamicSolverType.GeneralizedAlpha, showHints=False))
            if not ok:
                return None
            best = min(best or cpu, cpu)
        data = [np.array(mbs.GetSensorStoredData(s)) for s in sensors]
        return data[0][:, 0], np.concatenate([d[:, 1:4] for d in data], 1), best


def statics(holonom, peer, name):
    problem = STATIC[name]
    print(f"\n{name}: error of the end, CPU seconds of {problem['steps']} load steps")
    for n in problem["counts"]:
        row = []
        for kind in KINDS:
            sets = [f"beam.{problem['beam']}.elements={n}", f"beam.{problem['beam']}.element=\"{kind}\"",
                    f"simulation.step={1 / problem['steps']!r}", *problem.get("more", [])]
            if name == "lee_frame":
                sets.append(f"load.weight.body=frame.{problem['node'](n)}")
            got = holonom.run(name, sets)
            if got:
                x = places(got[0], problem["beam"], [problem.get("node", lambda n: n)(n)])
                row.append((kind, x[-1], got[1], np.linalg.norm(x[-1] - x[0])))
            else:
                row.append((kind, None, None, None))
        got = peer.static(name, n)
        row.append(("EXUDYN", *(got or (None, None)), None))
        scale = next((r[3] for r in row if r[3]), 1.0)
        text = [f"{k} " + ("no equilibrium" if x is None else f"{np.linalg.norm(x - problem['exact']) / scale:.1e} {cpu:.3f} s") for k, x, cpu, _ in row]
        print(f"{n:3d} elements: " + "; ".join(text), flush=True)


def motions(holonom, peer, name):
    problem = MOTION[name]
    beam = problem["beam"]

    def mine(kind, n, h, rounds=ROUNDS, more=()):
        sets = [f"beam.{beam}.elements={n}", f"beam.{beam}.element=\"{kind}\"", f"simulation.step={h!r}",
                f"simulation.every={round(problem['sample'] / h)}", *problem["sets"](n), *more]
        got = holonom.run(name, sets, problem["end"], rounds)
        return got and (got[0]["t"], places(got[0], beam, problem["nodes"](n)), got[1])

    kind, count, step = FINE
    fine = mine(kind, count, step, rounds=1, more=["simulation.strain=\"averaged\""])
    scale = np.abs(fine[1] - fine[1][0]).max()

    def error(got):
        t, x = got[0], got[1]
        at = np.stack([np.interp(fine[0], t, x[:, k]) for k in range(x.shape[1])], 1)
        return np.linalg.norm((at - fine[1]).reshape(len(at), -1, 3), axis=2).max() / scale

    print(f"\n{name}, {problem['end']:g} s: largest error of {scale:.3g} m against elements and step, CPU seconds")
    runs = {}
    for h in problem["steps"]:
        for n in problem["counts"]:
            text = []
            for kind in (*KINDS, *problem["peers"]):
                got = peer.motion(name, n, h, "planar" in kind) if "EXUDYN" in kind else mine(kind, n, h)
                if got:
                    runs.setdefault(kind, []).append((error(got), got[2], n, h))
                    text.append(f"{kind} {error(got):.1e} {got[2]:.3f} s")
                else:
                    text.append(f"{kind} ends early")
            print(f"h = {h:g} s, {n:2d} elements: " + "; ".join(text), flush=True)
    for target in TARGETS:
        text = []
        for kind, own in runs.items():
            own = [r for r in own if r[0] <= target]
            cheapest = min(own, key=lambda r: r[1]) if own else None
            text.append(f"{kind} " + (f"{cheapest[1]:.3f} s ({cheapest[2]}, {cheapest[3]:g} s)" if cheapest else "none"))
        print(f"cheapest below {target:g}: " + "; ".join(text), flush=True)


def main():
    holonom, peer = Holonom(sys.argv[1], sys.argv[2]), Peer()
    for name in sys.argv[3:] or [*STATIC, *MOTION]:
        (statics if name in STATIC else motions)(holonom, peer, name)


main()
