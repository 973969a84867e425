"""Gradients of chains and of a four-bar linkage beside MuJoCo, MJX and Drake: error and CPU time.

    python peers.py PROGRAM FOLDER [PART ...]      with a Python that has numpy, scipy, mujoco, drake, mujoco-mjx and jax
    PART                                           pendulum, chain, fourbar; all of them where none is named

A chain of 1 or 8 boxes of 1 m and 1 kg on hinges about y and z in turn falls from rest for 1 s. J = z²/2 of the free end; the
gradient by constant efforts of all hinges, at zero. Reference: MuJoCo's RK4 at 0.3 ms, central differences of whole runs.
A linkage of boxes of 0.5, 1 and 0.8 m and 1 kg each on a base of 1 m falls from rest for 1 s. J = z²/2 of the middle of the
coupler; the gradient by constant efforts of both hinges of the base. Reference: DOP853 in the angle of the crank.

holonom    `holonom gradient`, one sweep backward: the whole process without that of a run of one step
mujoco     mjd_transitionFD (central, 1e-6) in each step, then the sweep backward with its matrices; the loop alone. With `whole`: central
           differences of whole runs, two for each effort
mjx        jax.grad of a scan over the steps, forward mode (jax.jacfwd) for the chain, whose reverse is not compiled in 15 min, and
           where the loop of the solver has no reverse; the compiled function alone, and the time of its compilation
drake      AutoDiffXd: all efforts forward at once, in Runge-Kutta steps of third order with error control; the simulator alone.
           The loop of the linkage is a bushing: a plant in continuous time takes no constraint

Error: the largest of an entry, relative to the largest entry. Time: CPU seconds, the least of five.
"""
import json, os, pathlib, resource, subprocess, sys, time
for v in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(v, "1")
os.environ.setdefault("XLA_FLAGS", "--xla_cpu_multi_thread_eigen=false intra_op_parallelism_threads=1")
import numpy as np

END, G, ROUNDS = 1.0, 9.81, 5
BOX = (1.0, 0.1, 0.1)
INERTIA = [(BOX[1] ** 2 + BOX[2] ** 2) / 12, (BOX[0] ** 2 + BOX[2] ** 2) / 12, (BOX[0] ** 2 + BOX[1] ** 2) / 12]
STEPS = (0.01, 0.005, 0.0025, 0.00125, 0.000625)


def axis(i):
    return (0.0, 1.0, 0.0) if i % 2 == 0 else (0.0, 0.0, 1.0)


def least(of):
    """Value and least CPU time of some rounds."""
    found = []
    for _ in range(ROUNDS):
        start = time.process_time()
        value = of()
        found.append((time.process_time() - start, value))
    return found[0][1], min(spent for spent, _ in found)


# --- holonom --------------------------------------------------------------------------------------------------------------------

def model(n, h, end):
    text = f'[model]\nname = "chain"\ngravity = [0.0, 0.0, -{G}]\n[simulation]\nstep = {h}\nend = {end}\n'
    for i in range(n):
        before = f'"b{i - 1}"' if i else '"ground"'
        text += f'[[body]]\nname = "b{i}"\nmass = 1.0\nshape = {{ type = "box", dimensions = {list(BOX)} }}\nposition = [{i + 0.5}, 0.0, 0.0]\n'
        text += f'[[joint]]\nname = "j{i}"\ntype = "revolute"\nparent = {before}\nchild = "b{i}"\nposition = [{float(i)}, 0.0, 0.0]\naxis = {list(axis(i))}\n'
        text += f'[[control]]\nname = "w{i}"\njoint = "j{i}"\nhold = {round(END / h)}\n'
    text += f'[[sensor]]\nname = "end"\ntype = "position"\nof = "b{n - 1}"\npoint = [0.5, 0.0, 0.0]\n'
    return text + '[[objective]]\nname = "height"\ntype = "sensor"\nsensor = "end.z"\nat = "end"\n'


def holonom(text, h):
    def run(end):
        file = FOLDER / "model.toml"
        file.write_text(text(h, end))
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([PROGRAM, "gradient", str(file), "--by", "controls", "--json"], capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        return spent, [own["derivatives"][0] for own in json.loads(done.stdout)["controls"]]

    whole = [run(END) for _ in range(ROUNDS)]
    rest = [run(h) for _ in range(ROUNDS)]
    return np.array(whole[0][1]), max(min(whole)[0] - min(rest)[0], 1e-5)


# --- MuJoCo ---------------------------------------------------------------------------------------------------------------------

def mujoco_model(n, h, integrator):
    import mujoco
    text = f'<mujoco><option timestep="{h}" gravity="0 0 -{G}" integrator="{integrator}"><flag contact="disable"/></option><worldbody>'
    for i in range(n):
        text += f'<body pos="{1 if i else 0} 0 0"><joint name="j{i}" type="hinge" axis="{" ".join(map(str, axis(i)))}"/>'
        text += f'<inertial pos="0.5 0 0" mass="1" diaginertia="{" ".join(map(str, INERTIA))}"/>'
    text += '<site name="end" pos="1 0 0"/>' + "</body>" * n + "</worldbody><actuator>"
    text += "".join(f'<motor joint="j{i}"/>' for i in range(n)) + "</actuator></mujoco>"
    return mujoco.MjModel.from_xml_string(text)


def mujoco(own, site, n, h, whole):
    import mujoco as mj
    data, steps = mj.MjData(own), round(END / h)

    def cost(w):
        mj.mj_resetData(own, data)
        data.ctrl[:] = w
        for _ in range(steps):
            mj.mj_step(own, data)
        mj.mj_kinematics(own, data)
        return 0.5 * data.site_xpos[site, 2] ** 2

    def differences():
        e = 1e-5
        return np.array([(cost(e * unit) - cost(-e * unit)) / (2 * e) for unit in np.eye(n)])

    def sweep():
        mj.mj_resetData(own, data)
        size = 2 * own.nv
        a, b = np.zeros((steps, size, size)), np.zeros((steps, size, n))
        for k in range(steps):
            mj.mjd_transitionFD(own, data, 1e-6, True, a[k], b[k], None, None)
            mj.mj_step(own, data)
        mj.mj_kinematics(own, data)
        mj.mj_comPos(own, data)
        slope = np.zeros((3, own.nv))
        mj.mj_jacSite(own, data, slope, None, site)
        costate = np.concatenate([data.site_xpos[site, 2] * slope[2], np.zeros(own.nv)])
        gradient = np.zeros(n)
        for k in reversed(range(steps)):
            gradient += b[k].T @ costate
            costate = a[k].T @ costate
        return gradient

    return least(differences if whole else sweep)


# --- Drake ----------------------------------------------------------------------------------------------------------------------

def drake(n, accuracy):
    from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, InitializeAutoDiff
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import FixedOffsetFrame, RevoluteJoint, RotationalInertia, SpatialInertia, UnitInertia
    from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator_
    from pydrake.math import RigidTransform
    plant, before = MultibodyPlant(0.0), None
    center = np.array([0.5, 0.0, 0.0])
    about = RotationalInertia(*INERTIA).ShiftFromCenterOfMass(1.0, center)
    unit = UnitInertia(*about.get_moments(), *about.get_products())  # of 1 kg
    for i in range(n):
        body = plant.AddRigidBody(f"b{i}", SpatialInertia(1.0, center, unit))
        parent = before.body_frame() if before is not None else plant.world_frame()
        at = RigidTransform([1.0 if i else 0.0, 0.0, 0.0])
        frame = plant.AddFrame(FixedOffsetFrame(f"f{i}", parent, at))
        joint = plant.AddJoint(RevoluteJoint(f"j{i}", frame, body.body_frame(), axis(i)))
        plant.AddJointActuator(f"w{i}", joint)
        before = body
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -G])
    plant.Finalize()
    exact = plant.ToAutoDiffXd()

    def run():
        context = exact.CreateDefaultContext()
        exact.get_actuation_input_port().FixValue(context, InitializeAutoDiff(np.zeros(n)).flatten())
        simulator = Simulator_[AutoDiffXd](exact, context)
        ResetIntegratorFromFlags(simulator, "runge_kutta3", 0.05)
        simulator.get_mutable_integrator().set_target_accuracy(accuracy)
        simulator.Initialize()
        simulator.AdvanceTo(END)
        pose = exact.EvalBodyPoseInWorld(context, exact.GetBodyByName(f"b{n - 1}"))
        z = (pose.rotation().matrix() @ np.array([1.0, 0.0, 0.0]) + pose.translation())[2]
        return ExtractGradient(np.array([0.5 * z * z])).flatten()

    return least(run)


# --- the linkage ----------------------------------------------------------------------------------------------------------------

LENGTHS, BASE, START = (0.5, 1.0, 0.8), 1.0, 1.0  # crank, coupler, rocker; angle of the crank above the base, rad


def bar_inertia(length):
    return [(BOX[1] ** 2 + BOX[2] ** 2) / 12, (length ** 2 + BOX[2] ** 2) / 12, (length ** 2 + BOX[1] ** 2) / 12]


def closed(theta):
    """Ends B, C of the coupler in the plane, and the angles of coupler and rocker."""
    a, b, c = LENGTHS
    B = a * np.array([np.cos(theta), np.sin(theta)])
    to = np.array([BASE, 0.0]) - B
    r = np.hypot(*to)
    along = (b * b - c * c + r * r) / (2 * r)
    C = B + along * to / r + np.sqrt(b * b - along * along) * np.array([-to[1], to[0]]) / r
    return B, C, np.arctan2(C[1] - B[1], C[0] - B[0]), np.arctan2(C[1], C[0] - BASE)


def linkage_reference():
    from scipy.integrate import solve_ivp
    masses, moments = np.ones(3), np.array([bar_inertia(length)[1] for length in LENGTHS])
    a, b, c = LENGTHS

    def unit(x):
        return np.array([np.cos(x), np.sin(x)])

    def normal(x):
        return np.array([-np.sin(x), np.cos(x)])

    def slope(y, w):
        theta, rate = y
        _, _, phi, psi = closed(theta)
        loop = np.column_stack([b * normal(phi), -c * normal(psi)])
        d1 = np.linalg.solve(loop, -a * normal(theta))
        d2 = np.linalg.solve(loop, a * unit(theta) + b * unit(phi) * d1[0] ** 2 - c * unit(psi) * d1[1] ** 2)
        first, second = np.array([1.0, *d1]), np.array([0.0, *d2])
        c1 = [a / 2 * normal(theta), a * normal(theta) + b / 2 * normal(phi) * d1[0], c / 2 * normal(psi) * d1[1]]
        c2 = [-a / 2 * unit(theta), -a * unit(theta) + b / 2 * (normal(phi) * d2[0] - unit(phi) * d1[0] ** 2),
              c / 2 * (normal(psi) * d2[1] - unit(psi) * d1[1] ** 2)]
        mass = sum(m * v @ v for m, v in zip(masses, c1)) + moments @ first ** 2
        bend = sum(m * v @ u for m, v, u in zip(masses, c1, c2)) + moments @ (first * second)
        force = w[0] + w[1] * d1[1] - G * sum(m * v[1] for m, v in zip(masses, c1))
        return [rate, (force - bend * rate ** 2) / mass]

    def cost(w):
        found = solve_ivp(lambda _, y: slope(y, w), (0, END), [START, 0.0], method="DOP853", rtol=1e-13, atol=1e-14)
        B, C, _, _ = closed(found.y[0, -1])
        return 0.5 * (0.5 * (B + C)[1]) ** 2

    e = 1e-4
    return np.array([(cost(e * unit) - cost(-e * unit)) / (2 * e) for unit in np.eye(2)])


def linkage_model(h, end):
    B, C, phi, psi = closed(START)
    ends = [((0.0, 0.0), B), (B, C), ((BASE, 0.0), C)]
    text = f'[model]\nname = "linkage"\ngravity = [0.0, 0.0, -{G}]\n[simulation]\nstep = {h}\nend = {end}\n'
    for name, (p, q), angle, length in zip(("crank", "coupler", "rocker"), ends, (START, phi, psi), LENGTHS):
        x, z = 0.5 * (np.array(p) + np.array(q))
        text += f'[[body]]\nname = "{name}"\nmass = 1.0\nshape = {{ type = "box", dimensions = {[length, *BOX[1:]]} }}\n'
        text += f'position = [{float(x)!r}, 0.0, {float(z)!r}]\nrotation_vector = [0.0, {-float(angle)!r}, 0.0]\n'
    joints = [("A", "ground", "crank", (0.0, 0.0)), ("B", "crank", "coupler", B), ("D", "ground", "rocker", (BASE, 0.0)), ("C", "coupler", "rocker", C)]
    for name, parent, child, (x, z) in joints:
        text += f'[[joint]]\nname = "{name}"\ntype = "revolute"\nparent = "{parent}"\nchild = "{child}"\n'
        text += f'position = [{float(x)!r}, 0.0, {float(z)!r}]\naxis = [0.0, -1.0, 0.0]\n'
    for name in "AD":
        text += f'[[control]]\nname = "w{name}"\njoint = "{name}"\nhold = {round(END / h)}\n'
    text += '[[sensor]]\nname = "middle"\ntype = "position"\nof = "coupler"\n'
    return text + '[[objective]]\nname = "height"\ntype = "sensor"\nsensor = "middle.z"\nat = "end"\n'


def linkage_mujoco(h, integrator):
    import mujoco
    _, _, phi, psi = closed(START)

    def body(name, at, angle, length, inner=""):
        inertia = " ".join(map(str, bar_inertia(length)))
        half = f"{0.5 * length} 0 0"
        return (f'<body name="{name}" pos="{at}" axisangle="0 -1 0 {angle}"><joint name="{name}" type="hinge" axis="0 -1 0"/>'
                f'<inertial pos="{half}" mass="1" diaginertia="{inertia}"/><site name="{name}" pos="{half}"/>{inner}</body>')

    coupler = body("coupler", f"{LENGTHS[0]} 0 0", phi - START, LENGTHS[1])
    text = f'<mujoco><compiler angle="radian"/><option timestep="{h}" gravity="0 0 -{G}" integrator="{integrator}" tolerance="0"><flag contact="disable"/></option><worldbody>'
    text += body("crank", "0 0 0", START, LENGTHS[0], coupler) + body("rocker", f"{BASE} 0 0", psi, LENGTHS[2]) + "</worldbody>"
    text += f'<equality><connect body1="coupler" body2="rocker" anchor="{LENGTHS[1]} 0 0" solref="{2 * h} 1" solimp="0.9999 0.9999 0.001"/></equality>'
    text += '<actuator><motor joint="crank"/><motor joint="rocker"/></actuator></mujoco>'
    return mujoco.MjModel.from_xml_string(text)


def linkage_drake(accuracy, stiffness):
    from pydrake.autodiffutils import AutoDiffXd, ExtractGradient, InitializeAutoDiff
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.multibody.plant import MultibodyPlant
    from pydrake.multibody.tree import FixedOffsetFrame, LinearBushingRollPitchYaw, RevoluteJoint, RotationalInertia, SpatialInertia, UnitInertia
    from pydrake.systems.analysis import ResetIntegratorFromFlags, Simulator_
    plant = MultibodyPlant(0.0)
    _, _, phi, psi = closed(START)
    up = np.array([0.0, -1.0, 0.0])

    def bar(name, length, parent, at):
        center = np.array([0.5 * length, 0.0, 0.0])
        about = RotationalInertia(*bar_inertia(length)).ShiftFromCenterOfMass(1.0, center)
        body = plant.AddRigidBody(name, SpatialInertia(1.0, center, UnitInertia(*about.get_moments(), *about.get_products())))
        frame = plant.AddFrame(FixedOffsetFrame(f"at_{name}", parent, RigidTransform(at)))
        return body, plant.AddJoint(RevoluteJoint(name, frame, body.body_frame(), up))

    world = plant.world_frame()
    crank, first = bar("crank", LENGTHS[0], world, [0.0, 0.0, 0.0])
    coupler, middle = bar("coupler", LENGTHS[1], crank.body_frame(), [LENGTHS[0], 0.0, 0.0])
    rocker, last = bar("rocker", LENGTHS[2], world, [BASE, 0.0, 0.0])
    turned = RotationMatrix.MakeXRotation(0.5 * np.pi)  # the hinge is the yaw of the bushing, which has no singular angle
    tips = [plant.AddFrame(FixedOffsetFrame(f"tip_{body.name()}", body.body_frame(), RigidTransform(turned, [length, 0.0, 0.0])))
            for body, length in ((coupler, LENGTHS[1]), (rocker, LENGTHS[2]))]
    damping = 2e-3 * stiffness
    plant.AddForceElement(LinearBushingRollPitchYaw(*tips, np.zeros(3), np.zeros(3), np.full(3, stiffness), np.full(3, damping)))
    for joint in (first, last):
        plant.AddJointActuator(joint.name(), joint)
    plant.mutable_gravity_field().set_gravity_vector([0.0, 0.0, -G])
    plant.Finalize()
    exact = plant.ToAutoDiffXd()

    def run():
        context = exact.CreateDefaultContext()
        for name, angle in (("crank", START), ("coupler", phi - START), ("rocker", psi)):
            exact.GetJointByName(name).set_angle(context, AutoDiffXd(angle))
        exact.get_actuation_input_port().FixValue(context, InitializeAutoDiff(np.zeros(2)).flatten())
        simulator = Simulator_[AutoDiffXd](exact, context)
        ResetIntegratorFromFlags(simulator, "runge_kutta3", 0.05)
        simulator.get_mutable_integrator().set_target_accuracy(accuracy)
        simulator.Initialize()
        simulator.AdvanceTo(END)
        pose = exact.EvalBodyPoseInWorld(context, exact.GetBodyByName("coupler"))
        z = (pose.rotation().matrix() @ np.array([0.5 * LENGTHS[1], 0.0, 0.0]) + pose.translation())[2]
        return ExtractGradient(np.array([0.5 * z * z])).flatten()

    return least(run)


# --- MJX ------------------------------------------------------------------------------------------------------------------------

def mjx(own, site, n, h, reverse):
    """The gradient, CPU seconds, and seconds of the compilation."""
    import jax
    import jax.numpy as jnp
    from mujoco import mjx
    jax.config.update("jax_enable_x64", True)
    model = mjx.put_model(own)
    begin = mjx.make_data(model)

    def cost(w):
        data, _ = jax.lax.scan(lambda data, _: (mjx.step(model, data), None), begin.replace(ctrl=w), None, length=round(END / h))
        return 0.5 * mjx.kinematics(model, data).site_xpos[site, 2] ** 2

    start = time.perf_counter()
    slope = jax.jit((jax.grad if reverse else jax.jacfwd)(cost)).lower(jnp.zeros(n)).compile()
    compiled = time.perf_counter() - start
    gradient, spent = least(lambda: np.asarray(slope(jnp.zeros(n))))
    return gradient, spent, compiled


def rows(exact):
    def row(what, found):
        gradient, spent, *compiled = found
        error = np.abs(gradient - exact).max() / np.abs(exact).max()
        after = f", compiled in {compiled[0]:.0f} s" if compiled else ""
        print(f"  {what:34} error {error:.1e}  CPU {1e3 * spent:9.2f} ms{after}", flush=True)
    return row


def linkage():
    exact = linkage_reference()
    print(f"four-bar linkage: derivatives {exact}", flush=True)
    row = rows(exact)
    for h in STEPS:
        row(f"holonom, h = {h}", holonom(linkage_model, h))
    for integrator in ("implicitfast", "RK4"):
        for h in STEPS:
            own = linkage_mujoco(h, integrator)
            site = own.site("coupler").id
            if integrator != "RK4":
                row(f"mujoco {integrator}, h = {h}", mujoco(own, site, 2, h, False))
            row(f"mujoco {integrator}, whole, h = {h}", mujoco(own, site, 2, h, True))
    for accuracy, stiffness in ((1e-3, 1e4), (1e-5, 1e5), (1e-6, 1e6)):
        row(f"drake, {accuracy:.0e}, bushing {stiffness:.0e} N/m", linkage_drake(accuracy, stiffness))
    for h in STEPS[:3]:
        own = linkage_mujoco(h, "Euler")
        row(f"mjx Euler, h = {h}", mjx(own, own.site("coupler").id, 2, h, False))


def chain(n):
    exact, _ = mujoco(mujoco_model(n, 0.0003125, "RK4"), 0, n, 0.0003125, True)
    print(f"chain of {n}: {n} derivatives, the largest {np.abs(exact).max():.9g}", flush=True)
    row = rows(exact)
    for h in STEPS:
        row(f"holonom, h = {h}", holonom(lambda h, end: model(n, h, end), h))
    for integrator in ("implicitfast", "RK4"):
        for h in STEPS:
            own = mujoco_model(n, h, integrator)
            if integrator != "RK4":  # mjd_transitionFD refuses it
                row(f"mujoco {integrator}, h = {h}", mujoco(own, 0, n, h, False))
            row(f"mujoco {integrator}, whole, h = {h}", mujoco(own, 0, n, h, True))
    for accuracy in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
        row(f"drake, accuracy {accuracy:.0e}", drake(n, accuracy))
    for integrator, steps in (("Euler", STEPS[:3] if n == 1 else STEPS[:1]), ("RK4", STEPS[:3] if n == 1 else ())):
        for h in steps:
            row(f"mjx {integrator}, h = {h}", mjx(mujoco_model(n, h, integrator), 0, n, h, n == 1))


PARTS = {"pendulum": lambda: chain(1), "chain": lambda: chain(8), "fourbar": linkage}

if __name__ == "__main__":
    PROGRAM, FOLDER = sys.argv[1], pathlib.Path(sys.argv[2])
    FOLDER.mkdir(parents=True, exist_ok=True)
    for part in sys.argv[3:] or PARTS:
        PARTS[part]()
