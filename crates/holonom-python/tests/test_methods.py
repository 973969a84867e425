"""Optima by methods of Python: IPOPT of CasADi, a method written here, and methods that fail."""

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from test_reference_control import case, searched

import holonom as hn

Array = NDArray[np.float64]


def filled(shape: tuple[int, int], places: Any, entries: Array) -> Array:
    """A matrix whose entries add up."""
    matrix = np.zeros(shape)
    np.add.at(matrix, (places[:, 0], places[:, 1]), entries)
    return matrix


def hessian(program: hn.Program, x: Array, rows: Array, factor: float = 1.0) -> Array:
    """The Hessian of the Lagrangian, whole."""
    n = len(x)
    lower = filled((n, n), program.hessian_places, program.hessian(x, rows, factor))
    return lower + np.tril(lower, -1).T


def newton(program: hn.Program) -> hn.Proposal:
    """Newton's method for the conditions of an optimum without inequalities."""
    x, (n, m) = program.start.copy(), (len(program.start), len(program.row_bounds))
    wanted = program.row_bounds[:, 0]
    # bounds of steps are not active here
    equal = np.flatnonzero(program.row_bounds[:, 0] == program.row_bounds[:, 1])
    rows = np.zeros(m)
    for iteration in range(50):
        left = (program.rows(x) - wanted)[equal]
        jacobian = filled((m, n), program.jacobian_places, program.jacobian(x))[equal]
        slope = program.cost_gradient(x) + jacobian.T @ rows[equal]
        program.tell(iteration, program.cost(x), infeasibility=float(np.max(np.abs(left))))
        if np.max(np.abs(left)) < 1e-13 and np.max(np.abs(slope)) < 1e-10:
            return hn.Proposal(x, rows)
        matrix = np.block([
            [hessian(program, x, rows), jacobian.T],
            [jacobian, np.zeros((len(equal), len(equal)))],
        ])
        step = np.linalg.solve(matrix, -np.concatenate([slope, left]))
        x += step[:n]
        rows[equal] += step[n:]
    return hn.Proposal(x, rows, outcome="exhausted")


@pytest.mark.parametrize("name", [f"oc0{k}" for k in range(1, 10)])
def test_optima_by_ipopt_are_the_stored_ones(name: str) -> None:
    pytest.importorskip("casadi")
    import holonom.ipopt

    own = case(name)
    found = hn.optimize(searched(own), method=holonom.ipopt.solve)
    off = abs(found.cost - own["results"]["cost"])
    controls = np.max(np.abs(found.controls - np.array(own["results"]["controls"])))
    replay = found["replay"]["deviation"]
    print(f"{name}: cost off by {off:.1e}, controls by {controls:.1e}, run by {replay:.1e}")
    assert found.optimal and replay <= 1e-8
    assert off <= own["tolerance"]["cost"]
    assert controls <= own["tolerance"]["controls"]
    count = len(found.iterations["cost"])
    assert count > 1 and np.all(np.isfinite(found.iterations["stationarity"]))


def test_a_method_of_twenty_lines_finds_the_stored_optimum() -> None:
    own = case("oc08")
    found = hn.optimize(searched(own), method=newton)
    off = abs(found.cost - own["results"]["cost"])
    print(f"off by {off:.1e}, {len(found.iterations['cost'])} iterations")
    assert found.optimal and off <= own["tolerance"]["cost"]
    # it says nothing of the second order
    assert "stationary" in found.text, found.text
    again = hn.optimize(searched(own), method=newton)
    assert again.cost == found.cost and np.array_equal(again.controls, found.controls)


@pytest.mark.parametrize("name", ["oc01", "oc05", "oc06", "oc07"])
def test_derivatives_of_a_program_are_those_of_its_functions(name: str) -> None:
    worst = {"gradient": 0.0, "jacobian": 0.0, "hessian": 0.0}

    def compare(program: hn.Program) -> hn.Proposal:
        random = np.random.default_rng(7)
        n, m = len(program.start), len(program.row_bounds)
        x = program.start + 1e-2 * random.standard_normal(n)
        rows = random.standard_normal(m)
        direction = random.standard_normal(n)
        step = 1e-5

        def slope(at: Array) -> Array:
            jacobian = filled((m, n), program.jacobian_places, program.jacobian(at))
            return 0.7 * program.cost_gradient(at) + jacobian.T @ rows

        def along(function: Any) -> Any:
            one, two = ((function(x + k * step * direction) - function(x - k * step * direction))
                        / (2.0 * k * step) for k in (1.0, 2.0))
            return (4.0 * one - two) / 3.0

        pairs = {
            "gradient": (program.cost_gradient(x) @ direction, along(program.cost)),
            "jacobian": (
                filled((m, n), program.jacobian_places, program.jacobian(x)) @ direction,
                along(program.rows),
            ),
            "hessian": (hessian(program, x, rows, 0.7) @ direction, along(slope)),
        }
        for what, (exact, differences) in pairs.items():
            size = 1.0 + np.max(np.abs(exact))
            worst[what] = max(worst[what], float(np.max(np.abs(exact - differences)) / size))
        assert program.row_name(0)
        return hn.Proposal(program.start, np.zeros(m), outcome="stopped")

    with pytest.warns(hn.HolonomWarning, match="no optimum: stopped"):
        hn.optimize(searched(case(name)), method=compare)
    print(name, worst)
    assert max(worst.values()) < 1e-8


def test_a_guess_that_is_called_an_optimum_is_none() -> None:
    def guess(program: hn.Program) -> hn.Proposal:
        return hn.Proposal(program.start, np.zeros(len(program.row_bounds)))

    with pytest.warns(hn.HolonomWarning, match="no optimum"):
        found = hn.optimize(searched(case("oc01")), method=guess)
    assert not found.optimal and found["status"] == "not_optimal", found["status"]


@pytest.mark.parametrize("word", ["infeasible", "exhausted", "out of ideas"])
def test_how_a_method_ends_is_said(word: str) -> None:
    def ends(program: hn.Program) -> hn.Proposal:
        return hn.Proposal(program.start, np.zeros(len(program.row_bounds)), outcome=word)

    said = {"infeasible": "infeasible", "exhausted": "max_iterations"}.get(word, word)
    with pytest.warns(hn.HolonomWarning, match=f"no optimum: .*{said}"):
        found = hn.optimize(searched(case("oc01")), method=ends)
    assert not found.optimal


def test_what_a_method_raises_or_returns_wrongly_is_raised() -> None:
    model = searched(case("oc01"))
    seen: list[hn.Program] = []

    def fails(program: hn.Program) -> hn.Proposal:
        seen.append(program)
        raise LookupError("no solver today")

    with pytest.raises(LookupError, match="no solver today"):
        hn.optimize(model, method=fails)
    assert len(seen) == 1  # no second search
    with pytest.raises(RuntimeError, match="the search has ended"):
        seen[0].cost(seen[0].start)

    def shaped(x: Any, rows: Any) -> Any:
        return lambda program: hn.Proposal(x(program), rows(program))

    def zeros(program: hn.Program) -> Array:
        return np.zeros(len(program.row_bounds))

    with pytest.raises(ValueError, match=r"`x` with 3 entries, not \d+"):
        hn.optimize(model, method=shaped(lambda _: np.zeros(3), zeros))
    with pytest.raises(ValueError, match=r"`rows` with 1 entries, not \d+"):
        hn.optimize(model, method=shaped(lambda program: program.start, lambda _: [0.0]))
    with pytest.raises(ValueError, match=r"nan for `x\[0\]`|NaN for `x\[0\]`"):
        hn.optimize(model, method=shaped(lambda program: program.start * np.nan, zeros))
    with pytest.raises(TypeError, match=r"a method returns a holonom.Proposal, not tuple"):
        hn.optimize(model, method=lambda program: (program.start, zeros(program)))  # type: ignore[arg-type,return-value]

    def short(program: hn.Program) -> hn.Proposal:
        program.cost(program.start[:-1])
        raise AssertionError

    with pytest.raises(ValueError, match=r"x: \d+ entries, not \d+"):
        hn.optimize(model, method=short)
    # numbers at which there is no motion give none
    def nowhere(program: hn.Program) -> hn.Proposal:
        x = np.full_like(program.start, np.nan)
        assert np.isnan(program.cost(x)) and np.all(np.isnan(program.jacobian(x)))
        return newton(program)

    assert hn.optimize(searched(case("oc08")), method=nowhere).optimal


def test_a_search_by_a_method_of_python_is_interrupted() -> None:
    told: list[int] = []

    def stop(iteration: int, _: int) -> None:
        told.append(iteration)
        raise KeyboardInterrupt

    def endless(program: hn.Program) -> hn.Proposal:
        iteration = 0
        while program.tell(iteration, program.cost(program.start)):
            iteration += 1
        return hn.Proposal(program.start, np.zeros(len(program.row_bounds)))

    with pytest.raises(KeyboardInterrupt):
        hn.optimize(searched(case("oc01")), method=endless, progress=stop)
    assert told
