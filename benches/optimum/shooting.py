"""Optimal control by Crocoddyl, on the problems of `compare.py`.

    python benches/optimum/shooting.py        with casadi, numpy and crocoddyl

Differential dynamic programming (FDDP) has no conditions at the end: they are a penalty ½ w |x − x_end|², w = 1e8. Controls are constant
in a step, as those of holonom; steps by the symplectic Euler rule and by Runge and Kutta's of order 4. A search begins with the straight
line of `compare.py` and with a motion without efforts; what converged at less cost counts. Each row has the steps, the error of the cost
relative to the fine Gauss collocation of `compare.py`, iterations, seconds of CPU of the solver, how far the end is missed, and the part
of the time that calls into Python take: damping, and the drive of the cart alone, are written here.
"""

import time

import crocoddyl
import numpy as np
import pinocchio as pin
from compare import G, PROBLEMS, solved

WEIGHT = 1e8


def mechanism(problem):
    """The chain of a problem."""
    model = pin.Model()
    model.gravity.linear = np.array([0.0, 0.0, -G])
    parent = 0
    for i, (kind, axis, place, mass, centre, inertia, _) in enumerate(problem.joints):
        e = np.eye(3)[axis]
        joint = pin.JointModelRevoluteUnaligned(e) if kind == "R" else pin.JointModelPrismaticUnaligned(e)
        parent = model.addJoint(parent, joint, pin.SE3(np.eye(3), np.array(place, float)), f"joint{i}")
        own = pin.Inertia(mass, np.array(centre, float), np.diag(np.array(inertia, float)))
        model.appendBodyToJoint(parent, own, pin.SE3.Identity())
    return model


class Acting(crocoddyl.ActuationModelAbstract):
    """Efforts of the driven joints, and damping."""

    def __init__(self, state, problem):
        super().__init__(state, len(problem.driven))
        self.driven = problem.driven
        self.damping = np.array([own[6] for own in problem.joints])
        self.spent = 0.0

    def calc(self, data, x, u):
        begin = time.process_time()
        tau = -self.damping * x[self.state.nq :]
        tau[self.driven] += u
        data.tau = tau
        self.spent += time.process_time() - begin

    def calcDiff(self, data, x, u):
        begin = time.process_time()
        nv = self.state.nv
        slope = np.zeros((nv, 2 * nv))
        slope[range(nv), range(nv, 2 * nv)] = -self.damping
        spread = np.zeros((nv, self.nu))
        spread[self.driven, range(self.nu)] = 1.0
        data.dtau_dx, data.dtau_du = slope, spread
        self.spent += time.process_time() - begin


def shot(problem, steps, integrator):
    """The searches that converged: cost, iterations, seconds, how far the end is missed, share of Python."""
    model = mechanism(problem)
    state = crocoddyl.StateMultibody(model)
    d, h = model.nv, problem.time / steps
    acting = Acting(state, problem)
    effort = crocoddyl.CostModelResidual(
        state, crocoddyl.ActivationModelWeightedQuad(np.array(problem.weights)), crocoddyl.ResidualModelControl(state, acting.nu)
    )
    goal = np.concatenate([problem.end, np.zeros(d)])
    arrival = crocoddyl.CostModelResidual(state, crocoddyl.ResidualModelState(state, goal, acting.nu))
    running, final = crocoddyl.CostModelSum(state, acting.nu), crocoddyl.CostModelSum(state, acting.nu)
    running.addCost("effort", effort, 1.0)
    final.addCost("arrival", arrival, WEIGHT)
    own = [crocoddyl.DifferentialActionModelFreeFwdDynamics(state, acting, costs) for costs in (running, final)]
    for dynamics in own:
        dynamics.armature = np.zeros(d)  # without it gravity is left out, with pinocchio 4.1.0
    if integrator == "euler":
        step, end = crocoddyl.IntegratedActionModelEuler(own[0], h), crocoddyl.IntegratedActionModelEuler(own[1], 0.0)
    else:
        order = crocoddyl.RKType.four
        step, end = (crocoddyl.IntegratedActionModelRK(model, order, dt) for model, dt in zip(own, (h, 0.0)))
    start = np.concatenate([problem.start, np.zeros(d)])
    shooting = crocoddyl.ShootingProblem(start, [step] * steps, end)
    still = [np.zeros(acting.nu)] * steps
    line = [start + (goal - start) * k / steps for k in range(steps + 1)]
    for states, feasible in [(line, False), (shooting.rollout(still), True)]:
        solver = crocoddyl.SolverFDDP(shooting)
        solver.th_stop, acting.spent, begin = 1e-11, 0.0, time.process_time()
        converged = np.isfinite(states).all() and solver.solve(states, still, 1000, feasible)
        spent = time.process_time() - begin
        missed = np.abs(solver.xs[-1] - goal).max()
        if converged and missed < 1e-4:
            cost = sum(0.5 * h * np.dot(problem.weights, u * u) for u in solver.us)
            yield cost, solver.iter + 1, spent, missed, acting.spent / spent


def main():
    for problem in PROBLEMS:
        limit, _, _ = solved(problem, "gauss", 40, stages=6, constant=False)
        print(f"\n{problem.name}: cost {limit!r}")
        for integrator in ["euler", "rk4"]:
            for steps in problem.steps:
                found = min(shot(problem, steps, integrator), default=None)
                if found is None:
                    print(f"  {integrator:6} {steps:5} no optimum", flush=True)
                    continue
                cost, count, spent, missed, python = found
                error = (cost - limit) / limit
                print(f"  {integrator:6} {steps:5} {error:+.2e} {count:6} {spent:9.3f} {missed:.1e} {python:5.0%}", flush=True)


main()
