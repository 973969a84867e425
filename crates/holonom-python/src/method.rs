//! Methods for nonlinear programs that are functions of Python, and the program that they see.

use holonom::vi_control::program::{
    AtPoint, Bounds, Iterate, MethodStart, MethodWatch, Multipliers, NlpSolver, Outcome,
    SharedProgram, Solved, SolverError, check_start,
};
use holonom::vi_core::interruption;
use numpy::ndarray::Array2;
use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::exceptions::{PyKeyboardInterrupt, PyValueError};
use pyo3::prelude::*;
use std::cell::{Cell, RefCell};
use std::rc::Rc;

/// A point that a method proposes: `x`, multipliers of rows, of lower and upper bounds of
/// variables, how it ended.
type Proposed = (Vec<f64>, Vec<f64>, Vec<f64>, Vec<f64>, String);

/// A nonlinear program with a start, as a method of Python sees it while it solves it.
#[pyclass(unsendable, frozen, module = "holonom._core")]
pub(crate) struct Program {
    at: RefCell<AtPoint>,
    bounds: Bounds,
    start: MethodStart,
    watch: Rc<RefCell<MethodWatch>>,
    iterates: Rc<RefCell<Vec<Iterate>>>,
}

impl Program {
    /// What a function of the program gives at `x`; NaN where the motion does not exist.
    fn values<'py>(
        &self,
        py: Python<'py>,
        x: &PyReadonlyArray1<'py, f64>,
        count: usize,
        function: impl FnOnce(&dyn holonom::vi_control::Program, &mut [f64]),
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let mut found = vec![f64::NAN; count];
        if self.moved(x.as_slice()?)? {
            function(&*self.at.borrow().program(), &mut found);
        }
        Ok(PyArray1::from_vec(py, found))
    }

    /// Whether the program has functions at `x`; moves it there.
    ///
    /// # Errors
    /// Another shape; `KeyboardInterrupt` where the search is no longer wanted.
    fn moved(&self, x: &[f64]) -> PyResult<bool> {
        if interruption::is_raised() {
            return Err(PyKeyboardInterrupt::new_err(()));
        }
        let wanted = self.bounds.variables.len();
        if x.len() != wanted {
            let words = format!("x: {} entries, not {wanted}", x.len());
            return Err(PyValueError::new_err(words));
        }
        Ok(x.iter().all(|x| x.is_finite()) && self.at.borrow_mut().moved(x))
    }
}

/// Pairs as rows of an array, shape `(N, 2)`.
fn rows<'py, T: numpy::Element + Copy>(
    py: Python<'py>,
    pairs: &[[T; 2]],
) -> Bound<'py, PyArray2<T>> {
    let rows = Array2::from_shape_fn((pairs.len(), 2), |(row, side)| pairs[row][side]);
    PyArray2::from_owned_array(py, rows)
}

fn places<'py>(py: Python<'py>, places: &[(usize, usize)]) -> Bound<'py, PyArray2<i64>> {
    let pairs: Vec<_> = places.iter().map(|own| [own.0 as i64, own.1 as i64]).collect();
    rows(py, &pairs)
}

#[pymethods]
impl Program {
    /// The guess, its multipliers of rows, lower and upper bounds where they are known, and whether
    /// it is near an optimum.
    fn start(&self) -> (Vec<f64>, Option<[Vec<f64>; 3]>, bool) {
        let MethodStart { x, multipliers, near } = self.start.clone();
        (x, multipliers.map(|own| [own.rows, own.lower, own.upper]), near)
    }

    fn bounds<'py>(&self, py: Python<'py>) -> [Bound<'py, PyArray2<f64>>; 2] {
        [&self.bounds.variables, &self.bounds.rows].map(|pairs| rows(py, pairs))
    }

    fn jacobian_places<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<i64>> {
        places(py, self.at.borrow().program().jacobian_places())
    }

    fn hessian_places<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<i64>> {
        places(py, self.at.borrow().program().hessian_places())
    }

    fn row_name(&self, row: usize) -> PyResult<String> {
        if row >= self.bounds.rows.len() {
            let words = format!("row {row}: there are {}", self.bounds.rows.len());
            return Err(PyValueError::new_err(words));
        }
        Ok(self.at.borrow().program().row_name(row))
    }

    fn cost(&self, x: PyReadonlyArray1<'_, f64>) -> PyResult<f64> {
        Ok(if self.moved(x.as_slice()?)? { self.at.borrow().program().cost() } else { f64::NAN })
    }

    fn cost_gradient<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.values(py, &x, self.bounds.variables.len(), |own, out| own.cost_gradient(out))
    }

    fn row_values<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        self.values(py, &x, self.bounds.rows.len(), |own, out| own.row_values(out))
    }

    fn jacobian<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let count = self.at.borrow().program().jacobian_places().len();
        self.values(py, &x, count, |own, out| own.jacobian(out))
    }

    fn hessian<'py>(
        &self,
        py: Python<'py>,
        x: PyReadonlyArray1<'py, f64>,
        factor: f64,
        multipliers: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let (lambda, wanted) = (multipliers.as_slice()?, self.bounds.rows.len());
        if lambda.len() != wanted {
            let words = format!("multipliers: {} entries, not {wanted}", lambda.len());
            return Err(PyValueError::new_err(words));
        }
        let count = self.at.borrow().program().hessian_places().len();
        self.values(py, &x, count, |own, out| own.hessian(factor, lambda, out))
    }

    /// An iteration: its number; cost, infeasibility, stationarity, barrier, step, shift. Whether
    /// to go on. One that was told before is told anew.
    fn tell(&self, iteration: usize, numbers: [f64; 6]) -> bool {
        let [cost, infeasibility, stationarity, barrier, step, shift] = numbers;
        let iterate =
            Iterate { iteration, cost, infeasibility, stationarity, barrier, step, shift };
        let mut iterates = self.iterates.borrow_mut();
        if let Some(known) = iterates.iter_mut().find(|own| own.iteration == iteration) {
            *known = iterate;
            return true;
        }
        iterates.push(iterate);
        drop(iterates);
        (self.watch.borrow_mut())(&iterate) && !interruption::is_raised()
    }
}

/// A function of Python, from a program to the point that it proposes.
pub(crate) struct PythonMethod<'a> {
    /// The function.
    pub(crate) function: &'a Py<PyAny>,
    /// What it raised.
    pub(crate) raised: Option<PyErr>,
}

impl PythonMethod<'_> {
    fn call(&self, program: Program) -> PyResult<Proposed> {
        let (variables, rows) = (program.bounds.variables.len(), program.bounds.rows.len());
        let found = Python::attach(|py| self.function.call1(py, (program,))?.extract(py));
        let (x, row, lower, upper, outcome): Proposed = found?;
        let shapes = [
            ("x", x.len(), variables),
            ("rows", row.len(), rows),
            ("lower", lower.len(), variables),
            ("upper", upper.len(), variables),
        ];
        if let Some((name, found, wanted)) = shapes.into_iter().find(|own| own.1 != own.2) {
            let words = format!("the method proposes `{name}` with {found} entries, not {wanted}");
            return Err(PyValueError::new_err(words));
        }
        let numbers = [("x", &x), ("rows", &row), ("lower", &lower), ("upper", &upper)];
        for (name, values) in numbers {
            if let Some(place) = values.iter().position(|value| !value.is_finite()) {
                let words = format!("the method proposes {} for `{name}[{place}]`", values[place]);
                return Err(PyValueError::new_err(words));
            }
        }
        Ok((x, row, lower, upper, outcome))
    }
}

impl NlpSolver for PythonMethod<'_> {
    fn solve(
        &mut self,
        program: &SharedProgram,
        start: &MethodStart,
        watch: MethodWatch,
    ) -> Result<Solved, SolverError> {
        check_start(&*program.borrow(), start)?;
        let iterates = Rc::new(RefCell::new(Vec::new()));
        let stopped = Rc::new(Cell::new(false));
        let watch: MethodWatch = {
            let (stopped, mut watch) = (stopped.clone(), watch);
            Box::new(move |at| {
                let goes_on = watch(at);
                stopped.set(stopped.get() || !goes_on);
                goes_on
            })
        };
        let seen = Program {
            at: RefCell::new(AtPoint::nowhere(program)),
            bounds: program.borrow().bounds(),
            start: start.clone(),
            watch: Rc::new(RefCell::new(watch)),
            iterates: iterates.clone(),
        };
        let proposed = match self.raised {
            None => self.call(seen),
            Some(_) => return Ok(stopped_at(start, program, Vec::new())),
        };
        match proposed {
            Ok((x, rows, lower, upper, outcome)) => {
                let outcome = if stopped.get() { Outcome::Stopped } else { named(outcome) };
                let multipliers = Multipliers { rows, lower, upper };
                Ok(Solved { outcome, x, multipliers, iterates: iterates.take() })
            }
            Err(error) => {
                self.raised = Some(error);
                Ok(stopped_at(start, program, iterates.take()))
            }
        }
    }
}

/// The start as the point where a method was stopped.
fn stopped_at(start: &MethodStart, program: &SharedProgram, iterates: Vec<Iterate>) -> Solved {
    let Bounds { variables, rows } = program.borrow().bounds();
    let none = |count: usize| vec![0.0; count];
    let (n, m) = (variables.len(), rows.len());
    let multipliers = Multipliers { rows: none(m), lower: none(n), upper: none(n) };
    Solved { outcome: Outcome::Stopped, x: start.x.clone(), multipliers, iterates }
}

fn named(outcome: String) -> Outcome {
    match outcome.as_str() {
        "optimal" => Outcome::Optimal,
        "acceptable" => Outcome::Acceptable,
        "infeasible" => Outcome::Infeasible,
        "stopped" => Outcome::Stopped,
        "exhausted" => Outcome::Exhausted,
        _ => Outcome::Failed(outcome.into()),
    }
}
