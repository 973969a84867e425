"""A stop and dry friction of joints beside MuJoCo: error and CPU time.

    python stops.py PROGRAM FOLDER      with a Python that has numpy and mujoco

Error against the event-driven value. CPU time of a simulated second: of holonom the whole process without that of a run of one step,
of MuJoCo the loop of steps alone; least of three.
stop       a rod of 0.8 m falls from 1 rad against a stop, e = 0.7: angle from the stop at 2 s, rad; MuJoCo has a stiff spring there,
           about eight steps long, with the damping of that restitution
four_bar   dry friction in three pins of a four-bar linkage: angle of the crank at 1 s, rad
"""
import math, os, pathlib, resource, subprocess, sys, time
for v in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ.setdefault(v, "1")
import numpy as np

ROUNDS = 3
STEPS = (0.008, 0.004, 0.002, 0.001)
G = 9.81
ENDS = {"stop": 2.0, "four_bar": 1.0}
LENGTHS = {"crank": 0.5, "coupler": 1.0, "rocker": 0.8}


def exact_stop():
    """Angle from the lower position: hits located on a fine Runge-Kutta solution."""
    rate = lambda y: np.array([y[1], -1.5 * G / 0.8 * math.sin(y[0])])
    y, t, h = np.array([1.0, 0.0]), 0.0, 1e-4

    def step(y, h):
        a = rate(y); b = rate(y + h / 2 * a); c = rate(y + h / 2 * b); d = rate(y + h * c)
        return y + h / 6 * (a + 2 * b + 2 * c + d)

    while t < 2.0 - 1e-12:
        own = min(h, 2.0 - t)
        new = step(y, own)
        if new[0] < 0.0:
            low, high = 0.0, own
            for _ in range(60):
                low, high = ((low + high) / 2, high) if step(y, (low + high) / 2)[0] > 0 else (low, (low + high) / 2)
            new, own = step(y, high), high
            new = np.array([0.0, -0.7 * new[1]])
        y, t = new, t + own
    return y[0]


EXACT = {"stop": exact_stop(), "four_bar": 6.70628651455384}


def four_bar():
    """Middles and angles of the bars, at the start of the reference: angles from x, about −y; and their rates."""
    crank = math.atan2(0.8912073600614354, 0.4535961214255773)
    coupler = math.atan2(0.33644999751948174, 0.9417013322540968)
    rocker = math.atan2(0.9775670969377491, 0.2106242412086067)
    a = 0.5 * np.array([math.cos(crank), 0, math.sin(crank)])
    b = a + np.array([math.cos(coupler), 0, math.sin(coupler)])
    return {"crank": (a / 2, crank, 6.0, 1.0), "coupler": ((a + b) / 2, coupler, -0.9028147993631082, 1.6),
            "rocker": (np.array([1.0, 0, 0]) + 0.4 * np.array([math.cos(rocker), 0, math.sin(rocker)]), rocker, 3.0303163468294647, 1.2)}, a, b


# --- holonom --------------------------------------------------------------------------------------------------------------------

def text(problem, h):
    head = f'[model]\nname = "{problem}"\ngravity = [0.0, 0.0, -{G}]\n[simulation]\nstep = {h}\nend = {ENDS[problem]}\n'
    sensor = lambda of, kind="position": f'[[sensor]]\nname = "y"\ntype = "{kind}"\nof = "{of}"\n'
    if problem == "stop":
        at = [0.4 * math.sin(1.0), 0.0, -0.4 * math.cos(1.0)]
        return head + (
            f'[[body]]\nname = "rod"\nmass = 1.0\ninertia = [1e-4, {0.64 / 12}, {0.64 / 12}]\nposition = {at}\n'
            f'rotation_vector = [0.0, {math.pi / 2 - 1}, 0.0]\n'
            '[[joint]]\nname = "hinge"\ntype = "revolute"\nparent = "ground"\nchild = "rod"\nposition = [0.0, 0.0, 0.0]\naxis = [0.0, -1.0, 0.0]\n'
            'limits = { lower = -1.0, restitution = 0.7 }\n') + sensor("hinge", "joint_coordinate")
    bars, a, b = four_bar()
    out = head
    for name, (at, angle, rate, mass) in bars.items():
        turn = np.array([0.0, -rate, 0.0])
        pivot = {"crank": np.zeros(3), "coupler": a, "rocker": np.array([1.0, 0, 0])}[name]
        v = np.cross(turn, at - pivot) + (np.cross([0.0, -6.0, 0.0], a) if name == "coupler" else 0)
        J = mass * LENGTHS[name] ** 2 / 12
        out += (f'[[body]]\nname = "{name}"\nmass = {mass}\ninertia = [1e-3, {J}, {J}]\nposition = {list(map(float, at))}\nvelocity = {list(map(float, v))}\n'
                f'angular_velocity = {list(map(float, turn))}\nrotation_vector = [0.0, {-angle}, 0.0]\n')
    for name, parent, child, at, torque in [("bearing", "ground", "crank", np.zeros(3), 0.4), ("crank_pin", "crank", "coupler", a, 0.3),
                                            ("rocker_pin", "coupler", "rocker", b, 0.2), ("rocker_bearing", "ground", "rocker", np.array([1.0, 0, 0]), 0)]:
        out += (f'[[joint]]\nname = "{name}"\ntype = "revolute"\nparent = "{parent}"\nchild = "{child}"\nposition = {list(map(float, at))}\naxis = [0.0, -1.0, 0.0]\n'
                + (f'friction = {{ torque = {torque} }}\n' if torque else ""))
    return out + sensor("bearing", "joint_coordinate")


def holonom(problem, h):
    file, place = FOLDER / f"{problem}.toml", FOLDER / "out"
    file.write_text(text(problem, h))

    def run(end):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        words = [PROGRAM, "run", str(file), "-o", str(place), "--force", "--set", f"simulation.end={end}", "--set", f"simulation.every={round(ENDS[problem] / h)}"]
        done = subprocess.run(words, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError(done.stderr)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    spent = max(run(ENDS[problem]) - run(h), 1e-6)
    run(ENDS[problem])
    rows = [row.split(",") for row in (place / "sensors.csv").read_text().splitlines()]
    last = dict(zip(rows[0], map(float, rows[-1])))
    value = last["y"] + (1.0 if problem == "stop" else 0.0)
    return value, spent


# --- MuJoCo ---------------------------------------------------------------------------------------------------------------------

def mujoco(problem, h):
    import mujoco
    option = f'<option timestep="{h}" gravity="0 0 -{G}" cone="elliptic" integrator="implicitfast"/>'
    more = ""
    if problem == "stop":
        k = 1 / (2.5 * h) ** 2
        z = -math.log(0.7) / math.hypot(math.pi, math.log(0.7))
        world = (f'<body name="y"><joint type="hinge" axis="0 -1 0" limited="true" range="0 9" ref="0" solreflimit="{-k} {-2 * z * math.sqrt(k)}" solimplimit="0.99 0.99 1e-3"/>'
                 f'<inertial pos="0 0 -0.4" mass="1" diaginertia="{0.64 / 12} {0.64 / 12} 1e-4"/></body>')
    else:
        bars, a, b = four_bar()
        J = {n: bars[n][3] * LENGTHS[n] ** 2 / 12 for n in bars}
        body = lambda n, off, loss, inner: (
            f'<body name="{n}" pos="{off}"><joint name="{n}" type="hinge" axis="0 -1 0" frictionloss="{loss}"/>'
            f'<inertial pos="{LENGTHS[n] / 2} 0 0" mass="{bars[n][3]}" diaginertia="1e-3 {J[n]} {J[n]}"/>{inner}</body>')
        world = body("crank", "0 0 0", 0.4, body("coupler", "0.5 0 0", 0.3, body("rocker", "1 0 0", 0.2, '<site name="end" pos="0.8 0 0"/>')))
        world += '<site name="bearing" pos="1 0 0"/>'
        more = '<equality><connect site1="end" site2="bearing" solref="' + f"{2 * h}" + ' 1"/></equality>'
        # the rocker hangs on the coupler, from its pin to its bearing
    model = mujoco.MjModel.from_xml_string(f'<mujoco><compiler angle="radian"/>{option}<worldbody>{world}</worldbody>{more}</mujoco>')
    data = mujoco.MjData(model)
    if problem == "stop":
        data.qpos[0] = 1.0
    if problem == "four_bar":
        bars, a, b = four_bar()
        turned = bars["rocker"][1] + math.pi
        data.qpos[:] = [bars["crank"][1], bars["coupler"][1] - bars["crank"][1], turned - bars["coupler"][1]]
        data.qvel[:] = [bars["crank"][2], bars["coupler"][2] - bars["crank"][2], bars["rocker"][2] - bars["coupler"][2]]
    mujoco.mj_forward(model, data)
    start = data.qpos[0]
    begin = time.process_time()
    for _ in range(round(ENDS[problem] / h)):
        mujoco.mj_step(model, data)
    spent = time.process_time() - begin
    return data.qpos[0] - (start if problem == "four_bar" else 0.0), spent


if __name__ == "__main__":
    PROGRAM, FOLDER = sys.argv[1], pathlib.Path(sys.argv[2])
    FOLDER.mkdir(parents=True, exist_ok=True)
    for problem in ENDS:
        print(f"\n## {problem}: {EXACT[problem]:.10g}\n")
        print("| program |" + "".join(f" {1e3 * h:g} ms |" for h in STEPS) + "\n|---|" + "---|" * len(STEPS))
        for name, run in (("holonom", holonom), ("MuJoCo", mujoco)):
            cells = []
            for h in STEPS:
                found = [run(problem, h) for _ in range(ROUNDS)]
                least = min(spent for _, spent in found) / ENDS[problem]
                cells.append(f"{abs(found[0][0] - EXACT[problem]):.1e}, {1e3 * least:.2g} ms")
            print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
