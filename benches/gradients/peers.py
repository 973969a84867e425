"""Gradients of a chain beside MuJoCo and Drake: error and CPU time.

    python peers.py PROGRAM FOLDER      with a Python that has numpy, mujoco and drake

A chain of 1 or 8 boxes of 1 m and 1 kg on hinges about y and z in turn falls from rest for 1 s. J = z²/2 of the free end; the
gradient by constant efforts of all hinges, at zero. Reference: MuJoCo's RK4 at 0.3 ms, central differences of whole runs.

holonom    `holonom gradient`, one sweep backward: the whole process without that of a run of one step
mujoco     mjd_transitionFD (central, 1e-6) in each step, then the sweep backward with its matrices; the loop alone. With `whole`: central
           differences of whole runs, two for each effort
drake      AutoDiffXd: all efforts forward at once, in Runge-Kutta steps of third order with error control; the simulator alone

Error: the largest of an entry, relative to the largest entry. Time: CPU seconds, the least of five.
"""
import json, os, pathlib, resource, subprocess, sys, time
for v in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(v, "1")
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


def holonom(n, h):
    def run(end):
        file = FOLDER / "chain.toml"
        file.write_text(model(n, h, end))
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


def mujoco(n, h, integrator, whole):
    import mujoco as mj
    own = mujoco_model(n, h, integrator)
    data, steps = mj.MjData(own), round(END / h)

    def cost(w):
        mj.mj_resetData(own, data)
        data.ctrl[:] = w
        for _ in range(steps):
            mj.mj_step(own, data)
        mj.mj_kinematics(own, data)
        return 0.5 * data.site_xpos[0, 2] ** 2

    def differences():
        e = 1e-5
        return np.array([(cost(e * unit) - cost(-e * unit)) / (2 * e) for unit in np.eye(n)])

    def sweep():
        mj.mj_resetData(own, data)
        a, b = np.zeros((steps, 2 * n, 2 * n)), np.zeros((steps, 2 * n, n))
        for k in range(steps):
            mj.mjd_transitionFD(own, data, 1e-6, True, a[k], b[k], None, None)
            mj.mj_step(own, data)
        mj.mj_kinematics(own, data)
        mj.mj_comPos(own, data)
        slope = np.zeros((3, n))
        mj.mj_jacSite(own, data, slope, None, 0)
        costate = np.concatenate([data.site_xpos[0, 2] * slope[2], np.zeros(n)])
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


def main():
    for n in (1, 8):
        exact, _ = mujoco(n, 0.0003125, "RK4", True)
        print(f"chain of {n}: {n} derivatives, the largest {np.abs(exact).max():.9g}", flush=True)

        def row(what, found):
            gradient, spent = found
            error = np.abs(gradient - exact).max() / np.abs(exact).max()
            print(f"  {what:34} error {error:.1e}  CPU {1e3 * spent:9.2f} ms", flush=True)

        for h in STEPS:
            row(f"holonom, h = {h}", holonom(n, h))
        for integrator in ("implicitfast", "RK4"):
            for h in STEPS:
                if integrator != "RK4":  # mjd_transitionFD refuses it
                    row(f"mujoco {integrator}, h = {h}", mujoco(n, h, integrator, False))
                row(f"mujoco {integrator}, whole, h = {h}", mujoco(n, h, integrator, True))
        for accuracy in (1e-2, 1e-3, 1e-4, 1e-5, 1e-6):
            row(f"drake, accuracy {accuracy:.0e}", drake(n, accuracy))


if __name__ == "__main__":
    PROGRAM, FOLDER = sys.argv[1], pathlib.Path(sys.argv[2])
    FOLDER.mkdir(parents=True, exist_ok=True)
    main()
