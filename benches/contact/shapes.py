"""Contact between bodies beside MuJoCo, Drake (SAP) and Rapier: error and CPU time.

    python shapes.py PROGRAM RAPIER FOLDER      with a Python that has numpy, mujoco and drake

RAPIER is the program of the folder `rapier` (`cargo build --release` there). Error against the analytic value. CPU time of a simulated
second: of holonom the whole process without that of a run of one step, of the others the loop of steps alone; least of three.
slope    a block lies on a slope of 0.4 rad, friction 0.5: how far it has crept after 10 s, m
ball     a ball slides at 3 m/s without spin, friction 0.2, and rolls from 0.437 s on: path in 2 s, m
bounce   a ball falls 1 m, restitution 0.8: height at 2 s, after three impacts, m; SAP has no restitution, MuJoCo has a stiff
         spring there, about eight steps long, with the damping of that restitution
stack    ten boxes of 0.1 m and 1 kg, the uppermost of 100 kg, friction 0.5: largest displacement of a box within 5 s, m
stop     a rod of 0.8 m falls from 1 rad against the stop of its hinge, e = 0.7: angle at 2 s, rad; MuJoCo as in `stops.py`
"""
import math, os, pathlib, resource, subprocess, sys, time
for v in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(v, "1")
import numpy as np
import stops

ROUNDS = 3
STEPS = (0.008, 0.004, 0.002, 0.001)
G = 9.81
ENDS = {"slope": 10.0, "ball": 2.0, "bounce": 2.0, "stack": 5.0, "stop": 2.0}
TILT = 0.4


def exact_bounce(t, e=0.8, height=1.0):
    fall = math.sqrt(2 * height / G)
    v, start = e * G * fall, fall
    while t >= start + 2 * v / G:
        start += 2 * v / G
        v *= e
    return v * (t - start) - 0.5 * G * (t - start) ** 2


ROLL = 2 * 3.0 / (7 * 0.2 * G)
EXACT = {"slope": 0.0, "ball": 3.0 * ROLL - 0.1 * G * ROLL**2 + 15 / 7 * (2.0 - ROLL), "bounce": exact_bounce(2.0), "stack": 0.0, "stop": stops.EXACT["stop"]}
GRAVITY = {"slope": (G * math.sin(TILT), 0.0, -G * math.cos(TILT))}

# shape, half sizes or radius, mass, position, velocity
BLOCK = [("box", (0.1, 0.1, 0.05), 1.0, (0, 0, 0.05), (0, 0, 0))]
BALL = [("sphere", 0.1, 1.0, (0, 0, 0.1), (3, 0, 0))]
BOUNCE = [("sphere", 0.1, 1.0, (0, 0, 1.1), (0, 0, 0))]
STACK = [("box", (0.05, 0.05, 0.05), 100.0 if i == 9 else 1.0, (0, 0, 0.05 + 0.1 * i), (0, 0, 0)) for i in range(10)]
BODIES = {"slope": BLOCK, "ball": BALL, "bounce": BOUNCE, "stack": STACK}
FRICTION = {"slope": 0.5, "ball": 0.2, "bounce": 0.0, "stack": 0.5}


def judged(problem, positions):
    """From the positions of the bodies at all times that were recorded, the last one the end."""
    last = positions[-1]
    if problem == "slope":
        return last[0][0]
    if problem == "ball":
        return last[0][0]
    if problem == "bounce":
        return last[0][2] - 0.1
    start = np.array([body[3] for body in STACK], dtype=float)
    return max(float(np.linalg.norm(np.array(at) - start, axis=1).max()) for at in positions)


# --- holonom --------------------------------------------------------------------------------------------------------------------

def text(problem, h):
    gravity = list(GRAVITY.get(problem, (0.0, 0.0, -G)))
    out = f'[model]\nname = "{problem}"\ngravity = {gravity}\n[simulation]\nstep = {h}\nend = {ENDS[problem]}\n'
    for i, (kind, size, mass, at, v) in enumerate(BODIES[problem]):
        shape = (f'{{ type = "box", dimensions = {[2 * s for s in size]} }}' if kind == "box" else f'{{ type = "sphere", dimensions = [{size}] }}')
        out += (f'[[body]]\nname = "b{i}"\nmass = {mass}\nshape = {shape}\nposition = {list(map(float, at))}\nvelocity = {list(map(float, v))}\n')
    names = [f'b{i}' for i in range(len(BODIES[problem]))]
    rest = 0.8 if problem == "bounce" else 0.0
    out += ('[[contact]]\nname = "floor"\na = { plane = { position = [0.0, 0.0, 0.0], normal = [0.0, 0.0, 1.0] } }\n'
            f'b = {names[:1] if problem == "stack" else names}\nfriction = {FRICTION[problem]}\nrestitution = {rest}\n'.replace("'", '"'))
    for below, above in zip(names, names[1:]):
        out += f'[[contact]]\nname = "{below}_{above}"\na = ["{below}"]\nb = ["{above}"]\nfriction = 0.5\n'
    return out


def holonom(problem, h):
    if problem == "stop":
        stops.PROGRAM, stops.FOLDER = PROGRAM, FOLDER
        return stops.holonom(problem, h)
    file, place = FOLDER / f"{problem}.toml", FOLDER / "out"
    file.write_text(text(problem, h))

    def run(end, every):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        words = [PROGRAM, "run", str(file), "-o", str(place), "--force", "--set", f"simulation.end={end}", "--set", f"simulation.every={every}"]
        done = subprocess.run(words, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    count = round(ENDS[problem] / h)
    spent = max(-run(h, 1) + run(ENDS[problem], count), 1e-6)
    rows = [row.split(",") for row in (place / "trajectory.csv").read_text().splitlines()]
    head = {name: i for i, name in enumerate(rows[0])}
    columns = [[head[f"b{i}.{c}"] for c in "xyz"] for i in range(len(BODIES[problem]))]
    positions = [[[float(row[c]) for c in body] for body in columns] for row in rows[1:]]
    return judged(problem, positions), spent


# --- MuJoCo ---------------------------------------------------------------------------------------------------------------------

def mujoco(problem, h):
    import mujoco
    if problem == "stop":
        return stops.mujoco(problem, h)
    g = GRAVITY.get(problem, (0, 0, -G))
    solref = f' solref="{2 * h} 1" solimp="0.99 0.999 1e-4"'  # as stiff as the step allows
    if problem == "bounce":
        k = 1 / (2.5 * h) ** 2
        z = -math.log(0.8) / math.hypot(math.pi, math.log(0.8))
        solref = f' solref="{-k} {-2 * z * math.sqrt(k)}" solimp="0.99 0.99 1e-3"'
    mu = FRICTION[problem]
    geom = lambda kind, size: f'type="{kind}" size="{size if kind == "sphere" else " ".join(map(str, size))}" friction="{mu} 0 0"{solref}'
    world = f'<geom type="plane" size="50 50 1" friction="{mu} 0 0" condim="{1 if mu == 0 else 3}"{solref}/>'
    for i, (kind, size, mass, at, v) in enumerate(BODIES[problem]):
        world += f'<body pos="{at[0]} {at[1]} {at[2]}"><freejoint/><geom {geom(kind, size)} mass="{mass}" condim="{1 if mu == 0 else 3}"/></body>'
    option = f'<option timestep="{h}" gravity="{g[0]} {g[1]} {g[2]}" cone="elliptic" integrator="implicitfast" impratio="10"/>'
    model = mujoco.MjModel.from_xml_string(f'<mujoco>{option}<worldbody>{world}</worldbody></mujoco>')
    data = mujoco.MjData(model)
    for i, body in enumerate(BODIES[problem]):
        data.qvel[6 * i:6 * i + 3] = body[4]
    positions, spent = [], 0.0
    count = round(ENDS[problem] / h)
    every = max(1, count // 50) if problem == "stack" else count
    for k in range(count // every):
        begin = time.process_time()
        for _ in range(every):
            mujoco.mj_step(model, data)
        spent += time.process_time() - begin
        positions.append([data.qpos[7 * i:7 * i + 3].copy() for i in range(len(BODIES[problem]))])
    return judged(problem, positions), spent


# --- Drake ----------------------------------------------------------------------------------------------------------------------

# Hydroelastic contact resists rolling: a ball rolls on a point there
POINT = {"ball": True}
MODULUS = 1e8  # Pa


def drake(problem, h):
    from pydrake.all import (AddMultibodyPlantSceneGraph, Box, CoulombFriction, DiagramBuilder, HalfSpace, ProximityProperties, RigidTransform, Simulator,
                             SpatialInertia, SpatialVelocity, Sphere, UnitInertia, AddContactMaterial, RevoluteJoint, DiscreteContactApproximation,
                             AddRigidHydroelasticProperties, AddCompliantHydroelasticProperties, ContactModel)
    if problem == "bounce":
        return None
    builder = DiagramBuilder()
    plant, scene = AddMultibodyPlantSceneGraph(builder, time_step=h)
    plant.set_discrete_contact_approximation(DiscreteContactApproximation.kSap)
    plant.set_contact_model(ContactModel.kPoint if POINT.get(problem) else ContactModel.kHydroelasticWithFallback)
    plant.mutable_gravity_field().set_gravity_vector(GRAVITY.get(problem, (0, 0, -G)))
    bodies = []
    if problem == "stop":
        J = 0.64 / 12
        inertia = SpatialInertia(1.0, [0, 0, -0.4], UnitInertia(J + 0.16, J + 0.16, 1e-4))
        rod = plant.AddRigidBody("rod", inertia)
        hinge = plant.AddJoint(RevoluteJoint("hinge", plant.world_frame(), rod.body_frame(), [0, -1, 0], 0.0, 9.0, 0.0))
    else:
        mu = CoulombFriction(FRICTION[problem], FRICTION[problem])
        # a plane and bodies of steel-like stiffness; the relaxation time of SAP is its default
        ground = ProximityProperties()
        AddContactMaterial(dissipation=None, point_stiffness=None, friction=mu, properties=ground)
        AddRigidHydroelasticProperties(ground)
        plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "ground", ground)
        for i, (kind, size, mass, at, v) in enumerate(BODIES[problem]):
            unit = UnitInertia.SolidSphere(size) if kind == "sphere" else UnitInertia.SolidBox(*(2 * s for s in size))
            body = plant.AddRigidBody(f"b{i}", SpatialInertia(mass, [0, 0, 0], unit))
            shape = Sphere(size) if kind == "sphere" else Box(*(2 * s for s in size))
            own = ProximityProperties()
            AddContactMaterial(dissipation=None, point_stiffness=None, friction=mu, properties=own)
            AddCompliantHydroelasticProperties(0.05, MODULUS, own)
            plant.RegisterCollisionGeometry(body, RigidTransform(), shape, f"c{i}", own)
            bodies.append(body)
    plant.Finalize()
    diagram = builder.Build()
    simulator = Simulator(diagram)
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    if problem == "stop":
        hinge.set_angle(context, 1.0)
    for body, (_, _, _, at, v) in zip(bodies, BODIES.get(problem, [])):
        plant.SetFreeBodyPose(context, body, RigidTransform(np.array(at, dtype=float)))
        plant.SetFreeBodySpatialVelocity(context, body, SpatialVelocity([0, 0, 0], np.array(v, dtype=float)))
    simulator.Initialize()
    end, spent, positions = ENDS[problem], 0.0, []
    parts = 50 if problem == "stack" else 1
    for k in range(parts):
        begin = time.process_time()
        simulator.AdvanceTo(end * (k + 1) / parts)
        spent += time.process_time() - begin
        positions.append([plant.EvalBodyPoseInWorld(context, body).translation() for body in bodies])
    return (hinge.get_angle(context) if problem == "stop" else judged(problem, positions)), spent


# --- Rapier ---------------------------------------------------------------------------------------------------------------------

def rapier(problem, h):
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    value, spent = map(float, subprocess.run([RAPIER, problem, str(h)], capture_output=True, text=True, check=True).stdout.split())
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return value, min(spent, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


if __name__ == "__main__":
    PROGRAM, RAPIER, FOLDER = sys.argv[1], sys.argv[2], pathlib.Path(sys.argv[3])
    FOLDER.mkdir(parents=True, exist_ok=True)
    chosen = sys.argv[4:] or list(ENDS)
    for problem in chosen:
        print(f"\n## {problem}: {EXACT[problem]:.10g}\n")
        print("| program |" + "".join(f" {1e3 * h:g} ms |" for h in STEPS) + "\n|---|" + "---|" * len(STEPS))
        for name, run in (("holonom", holonom), ("MuJoCo", mujoco), ("Drake", drake), ("Rapier", rapier)):
            cells = []
            for h in STEPS:
                found = [run(problem, h) for _ in range(ROUNDS)]
                if found[0] is None:
                    cells.append("–")
                    continue
                least = min(spent for _, spent in found) / ENDS[problem]
                cells.append(f"{abs(found[0][0] - EXACT[problem]):.1e}, {1e3 * least:.2g} ms")
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
