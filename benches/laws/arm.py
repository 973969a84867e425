"""A controlled arm beside MuJoCo and EXUDYN: error, CPU time, lines.

    python arm.py PROGRAM FOLDER          with a Python that has numpy, mujoco and exudyn

An arm of 0.8 m is lifted by a PID controller with limits, back calculation and a filtered derivative through an actuator with a lag
(examples/models/pid_arm.toml with the numbers of ARM). Error: angle at t = 1 s against the solution of the same equations in the
angle with the limits located, rad. CPU time of a simulated second, s: of holonom the whole process without that of a run of one step,
of the others the loop of steps alone; least of three.
MuJoCo holds the states of the controller in the callback, a step late, or as activations with the Runge-Kutta integrator; EXUDYN as
an equation of first order beside the body.
"""
import inspect, math, os, pathlib, subprocess, sys, time
for v in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(v, "1")
sys.exudynFast = True
import numpy as np

EXACT = 0.6127727319600051
ROUNDS = 3
ARM = """
model = { name = "arm", gravity = [0.0, 0.0, -9.81] }
simulation = { step = 0.005, end = 1.0 }

[[body]]
name = "arm"
mass = 2.0
inertia = [0.02, 0.15, 0.15]
position = [0.4, 0.0, 0.0]

[[joint]]
name = "shoulder"
type = "revolute"
parent = "ground"
child = "arm"
position = [0.0, 0.0, 0.0]
axis = [0.0, -1.0, 0.0]

[[signal]]
name = "demand"
pid = { of = "0.8*smooth(t, 0.05, 0.35) - shoulder", proportional = 60.0, integral = 80.0, derivative = 9.0, filter = 0.01, limits = [-14.0, 14.0], tracking = 0.2 }

[[signal]]
name = "torque"
filter = { of = "demand", time_constant = 0.02 }

[[law]]
name = "motor"
joint = "shoulder"
effort = "torque - 0.05*v"
"""
MJCF = """<mujoco><option timestep="{h}" integrator="{scheme}" gravity="0 0 -9.81"/><compiler angle="radian"/>
<worldbody><body><joint name="shoulder" type="hinge" axis="0 -1 0" damping="0.05"/>
<inertial pos="0.4 0 0" mass="2" diaginertia="0.02 0.15 0.15"/></body></worldbody>
<actuator>{actuators}</actuator></mujoco>"""


def smooth(t, a, b):
    u = min(max((t - a) / (b - a), 0.0), 1.0)
    return u**3 * (10 - 15 * u + 6 * u * u)


def pid(t, x, i, d, torque):
    """Rates of the integral, the filter and the actuator."""
    e = 0.8 * smooth(t, 0.05, 0.35) - x
    u = 60.0 * e + 80.0 * i + 9.0 * (e - d) / 0.01
    held = min(max(u, -14.0), 14.0)
    return e + (held - u) / (80.0 * 0.2), (e - d) / 0.01, (held - torque) / 0.02


def mujoco_callback(h):
    import mujoco
    model = mujoco.MjModel.from_xml_string(MJCF.format(h=h, scheme="implicitfast", actuators='<motor joint="shoulder"/>'))
    data, own = mujoco.MjData(model), [0.0, 0.0, 0.0]

    def control(model, data):
        rates = pid(data.time, data.qpos[0], *own)
        data.ctrl[0] = own[2]
        for k, rate in enumerate(rates):
            own[k] += h * rate

    mujoco.set_mjcb_control(control)
    begin = time.process_time()
    for _ in range(round(1.0 / h)):
        mujoco.mj_step(model, data)
    spent = time.process_time() - begin
    mujoco.set_mjcb_control(None)
    return data.qpos[0], spent


def mujoco_activations(h):
    import mujoco
    one = '<general joint="shoulder" dyntype="user" gainprm="{}"/>'
    model = mujoco.MjModel.from_xml_string(MJCF.format(h=h, scheme="RK4", actuators=one.format(0) + one.format(0) + one.format(1)))
    data = mujoco.MjData(model)
    mujoco.set_mjcb_act_dyn(lambda model, data, k: pid(data.time, data.qpos[0], *data.act)[k])
    begin = time.process_time()
    for _ in range(round(1.0 / h)):
        mujoco.mj_step(model, data)
    spent = time.process_time() - begin
    mujoco.set_mjcb_act_dyn(None)
    return data.qpos[0], spent


def exudyn(h):
    import exudyn as exu
    from exudyn import utilities as u
    system = exu.SystemContainer()
    mbs = system.AddSystem()
    ground = mbs.CreateGround()
    arm = mbs.CreateRigidBody(inertia=u.RigidBodyInertia(mass=2.0, inertiaTensor=np.diag([0.02, 0.15, 0.15])),
                              referencePosition=[0.4, 0, 0], gravity=[0, 0, -9.81])
    mbs.CreateRevoluteJoint(itemNumbers=[ground, arm], position=[0, 0, 0], axis=[0, -1, 0], useGlobalFrame=True, show=False)
    states = mbs.AddNode(u.NodeGenericODE1(referenceCoordinates=[0.0] * 3, initialCoordinates=[0.0] * 3, numberOfODE1Coordinates=3))
    place = mbs.AddSensor(u.SensorBody(bodyNumber=arm, outputVariableType=exu.OutputVariableType.Position, storeInternal=True, writeToFile=False))
    spin = mbs.AddSensor(u.SensorBody(bodyNumber=arm, outputVariableType=exu.OutputVariableType.AngularVelocity, storeInternal=True, writeToFile=False))

    def angle(mbs):
        x = mbs.GetSensorValues(place)
        return math.atan2(x[2], x[0])

    def rates(mbs, t, item, q):
        return list(pid(t, angle(mbs), *q))

    def torque(mbs, t, load):
        found = mbs.GetNodeOutput(states, exu.OutputVariableType.Coordinates)[2] + 0.05 * mbs.GetSensorValues(spin)[1]
        return [0.0, -found, 0.0]

    mbs.AddObject(u.ObjectGenericODE1(nodeNumbers=[states], rhsUserFunction=rates))
    marker = mbs.AddMarker(u.MarkerBodyRigid(bodyNumber=arm))
    mbs.AddLoad(u.LoadTorqueVector(markerNumber=marker, loadVector=[0, 0, 0], loadVectorUserFunction=torque))
    mbs.Assemble()
    own = exu.SimulationSettings()
    own.timeIntegration.numberOfSteps, own.timeIntegration.endTime = round(1.0 / h), 1.0
    own.timeIntegration.verboseMode, own.solution.file.write = 0, False
    own.solution.sensors.writePeriod = h
    begin = time.process_time()
    mbs.SolveDynamic(own)
    return angle(mbs), time.process_time() - begin


class Holonom:
    def __init__(self, program, folder):
        self.program, self.folder = program, pathlib.Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        (self.folder / "arm.toml").write_text(ARM)

    def __call__(self, h, end=1.0):
        command = [self.program, "run", "arm.toml", "-o", "out", "--force", "-q", "--set", f"simulation.step={h}", "--end", repr(end)]
        child = subprocess.Popen(command, cwd=self.folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        used = os.wait4(child.pid, 0)[2]
        rows = (self.folder / "out/trajectory.csv").read_text().splitlines()
        last = dict(zip(rows[0].split(","), map(float, rows[-1].split(","))))
        return math.atan2(last["arm.z"], last["arm.x"]), used.ru_utime + used.ru_stime

    def without_start(self, h):
        angle, spent = self(h)
        return angle, max(spent - self(h, h)[1], 0.0)


def lines(*texts):
    return sum(1 for text in texts for line in text.splitlines() if line.strip())


def main():
    own = Holonom(os.path.abspath(sys.argv[1]), sys.argv[2])
    controller = inspect.getsource(pid) + inspect.getsource(smooth)
    rows = [
        ("holonom", own.without_start, lines(ARM)),
        ("MuJoCo, callback", mujoco_callback, lines(MJCF, controller, inspect.getsource(mujoco_callback))),
        ("MuJoCo, activations, RK4", mujoco_activations, lines(MJCF, controller, inspect.getsource(mujoco_activations))),
        ("EXUDYN", exudyn, lines(controller, inspect.getsource(exudyn))),
    ]
    print("| program | lines | h, s | error, rad | CPU, ms |\n|---|---|---|---|---|")
    for name, run, count in rows:
        for h in (0.01, 0.005, 0.0025, 0.00125, 0.000625):
            found = [run(h) for _ in range(ROUNDS)]
            spent = min(f[1] for f in found)
            print(f"| {name} | {count} | {h} | {abs(found[0][0] - EXACT):.1e} | {1e3 * spent:.2f} |", flush=True)


if __name__ == "__main__":
    main()
