"""Optima of controls by IPOPT, the one that CasADi brings along. It needs the package ``casadi``.

::

    found = holonom.optimize(model, method=holonom.ipopt.solve)

The method is that of A. Wächter, L. T. Biegler, Math. Program. 106 (2006) 25–57, with the tolerances
of the program's own one, and with exact second derivatives.
"""

from __future__ import annotations

from typing import Any

from ._errors import needed

needed("casadi", "ipopt")

import casadi
import numpy as np
from numpy.typing import NDArray

from ._program import Program, Proposal

Array = NDArray[np.float64]

TIGHT = {
    "tol": 1e-10,
    "constr_viol_tol": 1e-12,
    "compl_inf_tol": 1e-11,
    "dual_inf_tol": 1e-8,
    "mu_min": 1e-13,
    "bound_relax_factor": 0.0,
    "mu_strategy": "adaptive",
    "max_iter": 300,
    "print_level": 0,
    "sb": "yes",
}
"""Options of IPOPT."""

NEAR = {
    "warm_start_bound_push": 1e-9,
    "warm_start_bound_frac": 1e-9,
    "warm_start_slack_bound_push": 1e-9,
    "warm_start_slack_bound_frac": 1e-9,
    "warm_start_mult_bound_push": 1e-9,
    "mu_init": 1e-8,
}
"""Those of a start with multipliers near an optimum: it is moved off its bounds less."""

OUTCOMES = {
    "Solve_Succeeded": "optimal",
    "Solved_To_Acceptable_Level": "acceptable",
    "Feasible_Point_Found": "acceptable",
    "Infeasible_Problem_Detected": "infeasible",
    "User_Requested_Stop": "stopped",
    "Maximum_Iterations_Exceeded": "exhausted",
}
"""How a solve ended, by the words of IPOPT."""


class _Function(casadi.Callback):
    """A function of the program, by the names and the sparsity of its arguments and results."""

    def __init__(self, name: str, takes: dict[str, Any], gives: dict[str, Any], value: Any) -> None:
        casadi.Callback.__init__(self)
        self._takes, self._gives, self._value = takes, gives, value
        self.construct(name, {})

    def get_n_in(self) -> int:
        return len(self._takes)

    def get_n_out(self) -> int:
        return len(self._gives)

    def get_name_in(self, place: int) -> str:
        return list(self._takes)[place]

    def get_name_out(self, place: int) -> str:
        return list(self._gives)[place]

    def get_sparsity_in(self, place: int) -> Any:
        return list(self._takes.values())[place]

    def get_sparsity_out(self, place: int) -> Any:
        return list(self._gives.values())[place]

    def eval(self, arguments: Any) -> Any:
        return self._value(*(np.array(own, dtype=np.float64).ravel() for own in arguments))


class _Matrix:
    """A sparse matrix whose entries add up: its places by columns."""

    def __init__(self, shape: tuple[int, int], places: NDArray[np.int64]) -> None:
        key = places[:, 1] * shape[0] + places[:, 0]
        known, self._at = np.unique(key, return_inverse=True)
        columns, rows = np.divmod(known, shape[0]) if shape[0] else (known, known)
        self._count = len(known)
        starts = np.searchsorted(columns, np.arange(shape[1] + 1))
        self.sparsity = casadi.Sparsity(*shape, starts.tolist(), rows.tolist())

    def filled(self, entries: Array) -> Any:
        """The matrix with these entries."""
        values = np.bincount(self._at, weights=entries, minlength=self._count)
        return casadi.DM(self.sparsity, values)


def solve(program: Program, **options: Any) -> Proposal:
    """Solves a program.

    Parameters
    ----------
    program : what :func:`holonom.optimize` hands over.
    options : of IPOPT, in the place of those of :data:`TIGHT`:
        ``method=functools.partial(holonom.ipopt.solve, max_iter=1000)``.

    Returns
    -------
    Proposal
    """
    n, m = len(program.start), len(program.row_bounds)
    dense = casadi.Sparsity.dense
    point, none, one = dense(n), casadi.Sparsity(0, 0), dense(1)
    jacobian = _Matrix((m, n), program.jacobian_places)
    hessian = _Matrix((n, n), program.hessian_places[:, ::-1])  # the upper triangle
    taken = {"x": point, "p": none}
    value = {"f": one, "g": dense(m)}

    def seen(x: Array, *_: Array) -> list[Any]:
        return [program.cost(x), program.rows(x)]

    def sloped(x: Array, *_: Array) -> list[Any]:
        return [program.cost(x), program.cost_gradient(x)]

    def rows_sloped(x: Array, *_: Array) -> list[Any]:
        return [program.rows(x), jacobian.filled(program.jacobian(x))]

    def curved(x: Array, _: Array, factor: Array, rows: Array) -> list[Any]:
        return [hessian.filled(program.hessian(x, rows, float(factor[0])))]

    count, row_of = 0, program.jacobian_places[:, 0]

    def told(x: Array, f: Array, g: Array, of_bounds: Array, of_rows: Array, _: Array) -> list[Any]:
        nonlocal count
        slope = program.cost_gradient(x) + of_bounds
        np.add.at(slope, program.jacobian_places[:, 1], program.jacobian(x) * of_rows[row_of])
        missed = np.maximum(program.row_bounds[:, 0] - g, g - program.row_bounds[:, 1])
        goes_on = program.tell(
            count,
            float(f[0]),
            infeasibility=float(np.max(missed, initial=0.0)),
            stationarity=float(np.max(np.abs(slope))),
        )
        count += 1
        return [0 if goes_on else 1]

    outputs = {"x": point, "f": one, "g": dense(m), "lam_x": point, "lam_g": dense(m), "lam_p": none}
    known = program.multipliers
    words = {**TIGHT, **(NEAR if known is not None and program.near else {}), **options}
    if known is not None:
        words["warm_start_init_point"] = "yes"
    functions = {
        "grad_f": _Function("grad_f", taken, {"f": one, "grad_f_x": point}, sloped),
        "jac_g": _Function("jac_g", taken, {"g": dense(m), "jac_g_x": jacobian.sparsity}, rows_sloped),
        "hess_lag": _Function(
            "hess_lag",
            {**taken, "lam_f": one, "lam_g": dense(m)},
            {"hess_gamma_x_x": hessian.sparsity},
            curved,
        ),
        "iteration_callback": _Function("told", outputs, {"stop": one}, told),
    }
    own: dict[str, Any] = {
        "ipopt": words,
        "print_time": False,
        "error_on_fail": False,
        "show_eval_warnings": False,
        "no_nlp_grad": True,
    }
    nlp = _Function("nlp", taken, value, seen)
    solver = casadi.nlpsol("optimum", "ipopt", nlp, {**own, **functions})
    (low, high), (least, most) = program.variable_bounds.T, program.row_bounds.T
    begun: dict[str, Any] = {}
    if known is not None:
        begun = {"lam_g0": known.rows, "lam_x0": np.subtract(known.upper, known.lower)}
    found = solver(x0=program.start, lbx=low, ubx=high, lbg=least, ubg=most, **begun)
    stats = solver.stats()
    _tell_whole(program, stats.get("iterations", {}))
    of_bounds = np.array(found["lam_x"]).ravel()
    return Proposal(
        x=np.array(found["x"]).ravel(),
        rows=np.array(found["lam_g"]).ravel(),
        lower=np.maximum(-of_bounds, 0.0),
        upper=np.maximum(of_bounds, 0.0),
        outcome=OUTCOMES.get(stats["return_status"], stats["return_status"]),
    )


def _tell_whole(program: Program, iterations: dict[str, list[float]]) -> None:
    """Tells of all iterations with what IPOPT counts."""
    heads = ("obj", "inf_pr", "inf_du", "mu", "alpha_pr", "regularization_size")
    if any(head not in iterations for head in heads):
        return
    for number, row in enumerate(zip(*(iterations[head] for head in heads), strict=True)):
        cost, infeasibility, stationarity, barrier, step, shift = row
        program.tell(
            number,
            cost,
            infeasibility=infeasibility,
            stationarity=stationarity,
            barrier=barrier,
            step=step,
            shift=shift,
        )
