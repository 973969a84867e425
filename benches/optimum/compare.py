"""Optimal control side by side: holonom, and collocation by CasADi with IPOPT.

    python benches/optimum/compare.py PROGRAM FOLDER        with casadi and numpy; PROGRAM has the feature `optimize`

Three problems, from rest to rest: the shipped pendulum and cart-pole, and the shipped arm of six joints with fixed time, no bounds,
and effort as the cost, that of the wrist with the weight 30. Each row has the number of steps, the error of the cost relative to that
of a fine Gauss collocation (40 steps of six stages, a control for each stage), iterations, seconds of CPU. Inverse dynamics are written
here (`torques`): equations of motion are met as tau = ID(q, v, a).

Methods of CasADi: `trapezoidal` (controls linear between nodes), `hermite` (Hermite and Simpson, controls by parabolas), `gauss` (three
stages of Gauss, controls constant in a step, as those of holonom). All begin with the straight line that holonom begins with. IPOPT:
exact Hessian, tol 1e-10, MUMPS, functions not compiled; CPU is that of the solver alone. CPU and iterations of holonom are those of all:
reading, three numbers of steps, judgement, replay, files, page.
"""

import json
import pathlib
import resource
import subprocess
import sys
import time

import casadi as ca
import numpy as np

MODELS = pathlib.Path(__file__).parent / "../../examples/models"
G = 9.81


class Problem:
    """A chain of joints from rest to rest; axes 0, 1, 2, a row for each joint."""

    def __init__(self, name, joints, driven, start, end, time, steps, weights):
        self.name, self.joints, self.driven = name, joints, driven
        self.start, self.end, self.time, self.steps = start, end, time, steps
        self.weights = weights  # of half the square of each control


def rod(mass, length, side):
    long, across = mass / 12 * (length**2 + side**2), mass / 12 * 2 * side**2
    return [long, long, across]


# kind, axis, place in the frame of the joint before, mass, centre of mass, principal inertia, damping
PENDULUM = Problem("pendulum", [("R", 1, [0, 0, 0], 1.0, [0, 0, -0.5], rod(1.0, 1.0, 0.05), 0.0)], [0], [0.0], [np.pi], 2.0, [20, 40, 80, 160], [1.0])
CART = Problem(
    "cart-pole",
    [("P", 0, [0, 0, 0], 0.9, [0, 0, 0], [1.0] * 3, 0.0), ("R", 1, [0, 0, 0], 0.4, [0, 0, -0.375], [0.4 * 0.75**2 / 12] * 3, 0.0)],
    [0], [0.0, 0.0], [1.0, -np.pi], 2.0, [25, 50, 100, 200], [2.0],
)
ARM = Problem(
    "arm of six joints",
    [
        ("R", 2, [0, 0, 0], 3.7, [0, 0, 0.06], [0.011, 0.011, 0.008], 2.0),
        ("R", 1, [0, 0, 0.09], 8.4, [0.21, 0.06, 0], [0.016, 0.14, 0.14], 2.0),
        ("R", 1, [0.425, 0, 0], 2.3, [0.195, 0.03, 0], [0.005, 0.033, 0.033], 1.0),
        ("R", 1, [0.392, 0, 0], 1.2, [0, 0.08, 0], [0.0025, 0.002, 0.0025], 0.2),
        ("R", 2, [0, 0.11, 0], 1.2, [0, 0, -0.06], [0.0025, 0.0025, 0.002], 0.2),
        ("R", 1, [0, 0, -0.09], 1.0, [0, 0.04, 0], [0.0015, 0.001, 0.0015], 0.2),
    ],
    [0, 1, 2, 3, 4, 5], [0.0, -0.8, 1.2, 0.3, 0.4, 0.0], [2.0, -1.2, 0.8, -0.2, 0.0, 0.5], 0.8, [20, 40, 80, 160], [1.0] * 3 + [30.0] * 3,
)
PROBLEMS = [PENDULUM, CART, ARM]


def text(problem):
    """The model file of a problem."""
    name = {"pendulum": "optimum_pendulum", "cart-pole": "optimum_cart_pole", "arm of six joints": "optimum_arm"}[problem.name]
    lines = (MODELS / f"{name}.toml").read_text().splitlines()
    if problem is ARM:
        blocks, own = [[]], []
        for line in lines:
            if line.startswith("["):
                blocks.append([])
            blocks[-1].append(line)
        for block in blocks:
            if "[[objective]]" in block or "[optimize]" in block:
                continue
            own += [line for line in block if not line.startswith(("min = ", "max = "))]
        effort = '[[objective]]\nname = "{}"\ntype = "effort"\ncontrols = {}\nweight = {}'
        names = [f"torque{k}" for k in range(1, 7)]
        lines = own + [effort.format("arm", names[:3], 1.0), effort.format("wrist", names[3:], 30.0)]
    return "\n".join(lines) + "\n"


def holonom(problem, program, folder):
    folder.mkdir(parents=True, exist_ok=True)
    file = folder / "model.toml"
    file.write_text(text(problem))
    for steps in problem.steps:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        out = folder / f"{steps}"
        words = ["optimize", file, "-o", out, "--force", "--json", "--no-progress", "--set", f"simulation.step={problem.time / steps!r}"]
        done = subprocess.run([program, *words], capture_output=True, text=True, check=False)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        if done.returncode:
            yield "holonom", steps, None, None, cpu
            continue
        found = json.loads(done.stdout)
        yield "holonom", steps, found["cost"], found["iterations"], cpu


def torques(problem, q, v, a):
    """Efforts along the joints by the recursion of Newton and Euler in the frames of the bodies."""
    axis = [ca.DM([1, 0, 0]), ca.DM([0, 1, 0]), ca.DM([0, 0, 1])]

    def turn(k, angle):
        c, s = ca.cos(angle), ca.sin(angle)
        rows = {0: [[1, 0, 0], [0, c, -s], [0, s, c]], 1: [[c, 0, s], [0, 1, 0], [-s, 0, c]], 2: [[c, -s, 0], [s, c, 0], [0, 0, 1]]}[k]
        return ca.vertcat(*(ca.horzcat(*row) for row in rows))

    zero = ca.DM.zeros(3)
    omega, alpha, rise = zero, zero, ca.DM([0, 0, G])
    links = []
    for i, (kind, k, place, mass, centre, inertia, _) in enumerate(problem.joints):
        e = axis[k]
        place, centre, inertia = ca.DM(place), ca.DM(centre), ca.diag(ca.DM(inertia))
        slides = kind == "P"
        r = ca.DM.eye(3) if slides else turn(k, q[i])
        p = place + e * q[i] if slides else place
        rise = r.T @ (rise + ca.cross(alpha, p) + ca.cross(omega, ca.cross(omega, p)))
        omega, alpha = r.T @ omega, r.T @ alpha
        if slides:
            rise = rise + e * a[i] + 2 * ca.cross(omega, e * v[i])
        else:
            alpha = alpha + e * a[i] + ca.cross(omega, e * v[i])
            omega = omega + e * v[i]
        force = mass * (rise + ca.cross(alpha, centre) + ca.cross(omega, ca.cross(omega, centre)))
        moment = inertia @ alpha + ca.cross(omega, inertia @ omega) + ca.cross(centre, force)
        links.append((r, p, force, moment, e, slides))
    out = [None] * len(links)
    f, n = zero, zero
    for i in reversed(range(len(links))):
        r, p, force, moment, e, slides = links[i]
        f, n = force + f, moment + n
        out[i] = ca.dot(e, f if slides else n) + problem.joints[i][6] * v[i]
        f = r @ f
        n = r @ n + ca.cross(p, f)
    return ca.vertcat(*out)


def gauss(stages):
    """Nodes, weights and the matrix of Gauss collocation on the unit interval."""
    nodes, weights = np.polynomial.legendre.leggauss(stages)
    nodes, weights = 0.5 * (nodes + 1), 0.5 * weights
    powers = np.vander(nodes, increasing=True)
    integrals = np.array([[c ** (k + 1) / (k + 1) for k in range(stages)] for c in nodes])
    return nodes, weights, integrals @ np.linalg.inv(powers)


def collocation(problem, method, steps, stages=3, constant=True):
    """The program of a method: unknowns with their guess, equations, cost."""
    d, k = len(problem.joints), len(problem.driven)
    h = problem.time / steps
    x, guess, rows, cost = [], [], [], 0
    names = iter(range(10**9))

    def unknown(size, value):
        own = ca.SX.sym(f"x{next(names)}", size)
        x.append(own)
        guess.extend(value)
        return own

    at = [ca.SX.sym(name, d) for name in "qva"]
    inverse = ca.Function("inverse", at, [torques(problem, *at)])
    spread = np.zeros((d, k))
    spread[problem.driven, range(k)] = 1.0
    start, end = np.array(problem.start), np.array(problem.end)
    line = lambda s: list(start + s * (end - start))
    zeros = [0.0] * d

    def moves(q, v, a, u):
        rows.append(inverse(q, v, a) - ca.DM(spread) @ u)

    def effort(u):
        return 0.5 * ca.dot(ca.DM(problem.weights), u * u)

    q, v = ca.DM(start), ca.DM(zeros)
    if method != "gauss":
        a, u = unknown(d, zeros), unknown(k, [0.0] * k)
        moves(q, v, a, u)
    for n in range(steps):
        last = n + 1 == steps
        q1, v1 = (ca.DM(end), ca.DM(zeros)) if last else (unknown(d, line((n + 1) / steps)), unknown(d, zeros))
        if method == "gauss":
            c, b, matrix = gauss(stages)
            acts = [unknown(k, [0.0] * k)] * stages if constant else [unknown(k, [0.0] * k) for _ in c]
            slopes = [unknown(d, zeros) for _ in c]
            rates = [v + h * sum(float(w) * s for w, s in zip(row, slopes)) for row in matrix]
            for i, row in enumerate(matrix):
                moves(q + h * sum(float(w) * s for w, s in zip(row, rates)), rates[i], slopes[i], acts[i])
                cost += h * float(b[i]) * effort(acts[i])
            rows.append(q + h * sum(float(w) * s for w, s in zip(b, rates)) - q1)
            rows.append(v + h * sum(float(w) * s for w, s in zip(b, slopes)) - v1)
        else:
            a1, u1 = unknown(d, zeros), unknown(k, [0.0] * k)
            moves(q1, v1, a1, u1)
            if method == "trapezoidal":
                rows.append(q + 0.5 * h * (v + v1) - q1)
                rows.append(v + 0.5 * h * (a + a1) - v1)
                cost += 0.5 * h * (effort(u) + effort(u1))
            else:
                am, um = unknown(d, zeros), unknown(k, [0.0] * k)
                qm = 0.5 * (q + q1) + h / 8 * (v - v1)
                vm = 0.5 * (v + v1) + h / 8 * (a - a1)
                moves(qm, vm, am, um)
                rows.append(q + h / 6 * (v + 4 * vm + v1) - q1)
                rows.append(v + h / 6 * (a + 4 * am + a1) - v1)
                cost += h / 6 * (effort(u) + 4 * effort(um) + effort(u1))
            a, u = a1, u1
        q, v = q1, v1
    return ca.vertcat(*x), guess, ca.vertcat(*rows), cost


def solved(problem, method, steps, **more):
    x, guess, rows, cost = collocation(problem, method, steps, **more)
    options = {"ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-10, "max_iter": 1000}, "print_time": False}
    solver = ca.nlpsol("solver", "ipopt", {"x": x, "g": rows, "f": cost}, options)
    begin = time.process_time()
    found = solver(x0=guess, lbg=0, ubg=0)
    cpu = time.process_time() - begin
    stats = solver.stats()
    return float(found["f"]) if stats["success"] else None, stats["iter_count"], cpu


def table(limit, rows):
    for method, steps, cost, iterations, cpu in rows:
        error = "no optimum" if cost is None else f"{(cost - limit) / limit:+.2e}"
        print(f"  {method:12} {steps:5} {error:>12} {iterations!s:>6} {cpu:9.3f}", flush=True)


def main():
    program, folder = sys.argv[1], pathlib.Path(sys.argv[2])
    for problem in PROBLEMS:
        limit, _, _ = solved(problem, "gauss", 40, stages=6, constant=False)
        print(f"\n{problem.name}: cost {limit!r}")
        table(limit, holonom(problem, program, folder / problem.name.replace(" ", "_")))
        for method in ["trapezoidal", "hermite", "gauss"]:
            table(limit, ((method, steps, *solved(problem, method, steps)) for steps in problem.steps))


if __name__ == "__main__":
    main()
