//! Members that run side by side in lanes, from their start to their end in one call.
//!
//! A member has the bits of a [`crate::stepper::Stepper`] of its own, whoever is beside it and
//! however many threads there are. One that fails stays where it failed; why, its own stepper says.

use crate::acting::{Acted, Acting, check_finite, hold};
use crate::model::Model;
use crate::stepper::restore;
use crate::watch::Watch;
use holonom::{Input, JointStart, Members};
use numpy::ndarray::{Array2, Array3};
use numpy::{IntoPyArray, PyArray2, PyArray3, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::{PyBaseException, PyRuntimeError};
use pyo3::prelude::*;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Members of the widest lanes: those of a thread are a multiple of it.
const LANES: usize = 8;
/// Steps of all members between the first two questions whether to go on.
const PORTION: usize = 4096;
/// The time between later ones: members enter their lanes and leave them once in between.
const PAUSE: Duration = Duration::from_millis(40);

/// What a rollout is asked for.
#[derive(FromPyObject)]
#[pyo3(from_item_all)]
pub(crate) struct RolloutPlan {
    states: Option<Vec<Vec<u8>>>,
    steps: usize,
    every: usize,
    threads: usize,
}

impl RolloutPlan {
    /// Whether a node is recorded.
    fn records(&self, n: usize) -> bool {
        n.is_multiple_of(self.every.max(1)) || n == self.steps
    }

    /// How many are.
    fn nodes(&self) -> usize {
        self.steps.div_ceil(self.every.max(1)) + 1
    }
}

/// Times, coordinates, what is observed; members that failed; what stopped all of them.
type Rolled<'py> = (
    Bound<'py, PyArray2<f64>>,
    Bound<'py, PyArray3<f64>>,
    Bound<'py, PyArray3<f64>>,
    Vec<usize>,
    Option<Py<PyBaseException>>,
);

/// Inputs of the steps, row after row.
#[derive(Clone, Copy)]
struct RolloutInputs<'a> {
    values: &'a [f64],
    apart: usize, // numbers from one member to the next; 0: the same of all
    width: usize,
}

impl<'a> RolloutInputs<'a> {
    /// Those of a member for step `n`.
    fn of(&self, member: usize, n: usize) -> &'a [f64] {
        &self.values[member * self.apart + n * self.width..][..self.width]
    }
}

/// Members that one thread moves.
struct ThreadShare<'a> {
    members: Members,
    inputs: Vec<Vec<Input>>, // of each, those that are named
    observed: &'a [usize],   // columns of sensors
    first: usize,            // of all members
}

/// Where nodes of the members of a share are written, member after member.
struct MemberTables<'a> {
    t: &'a mut [f64],
    q: &'a mut [f64],
    y: &'a mut [f64],
}

impl ThreadShare<'_> {
    /// Steps and nodes to the end, or until it is not to `go_on`; members that failed.
    fn run(
        &mut self,
        plan: &RolloutPlan,
        rows: Option<RolloutInputs<'_>>,
        tables: &mut MemberTables<'_>,
        go_on: &mut dyn FnMut(usize) -> bool,
    ) -> Vec<usize> {
        let count = self.inputs.len();
        let mut is_lost = vec![false; count];
        let mut portion = (PORTION / count.max(1)).max(1);
        let (mut n, mut node, mut values) = (0, 0, Vec::new());
        loop {
            if plan.records(n) {
                for k in (0..count).filter(|k| !is_lost[*k]) {
                    let row = k * plan.nodes() + node;
                    let (t, q) = self.members.place(k);
                    tables.t[row] = t;
                    tables.q[row * q.len()..][..q.len()].copy_from_slice(q);
                }
                let width = self.observed.len();
                for k in (0..count).filter(|_| width > 0) {
                    if !is_lost[k] {
                        is_lost[k] = self.members.sense(k, &mut values).is_err();
                    }
                    if !is_lost[k] {
                        let row = &mut tables.y[(k * plan.nodes() + node) * width..][..width];
                        row.iter_mut().zip(self.observed).for_each(|(y, own)| *y = values[*own]);
                    }
                }
                node += 1;
            }
            if n == plan.steps || !go_on(n) {
                break;
            }
            let to_node = plan.every.max(1) - n % plan.every.max(1);
            let mut ahead = to_node.min(plan.steps - n).min(portion);
            if let Some(rows) = rows {
                ahead = 1;
                for (k, inputs) in self.inputs.iter().enumerate() {
                    hold(inputs, rows.of(self.first + k, n));
                }
            }
            let begin = Instant::now();
            self.members.step(ahead as u64);
            if ahead == portion && begin.elapsed() < PAUSE / 2 {
                portion *= 2;
            }
            n += ahead;
            self.members.failed().for_each(|k| is_lost[k] = true);
        }
        (0..count).filter(|k| is_lost[*k]).map(|k| self.first + k).collect()
    }
}

/// Runs members for the same number of steps in lanes, with a row of inputs for each step, of all
/// members or of each; `None` where lanes do not apply.
#[pyfunction]
pub(crate) fn rollout<'py>(
    py: Python<'py>,
    models: Vec<Py<Model>>,
    acting: &Acting,
    controls: Option<PyReadonlyArray3<'py, f64>>,
    plan: RolloutPlan,
) -> PyResult<Option<Rolled<'py>>> {
    let rows = match &controls {
        None => None,
        Some(controls) => {
            let values = controls.as_slice()?;
            check_finite("controls", values)?;
            let [of, steps, width] = [0, 1, 2].map(|axis| controls.shape()[axis]);
            Some(RolloutInputs { values, apart: if of == 1 { 0 } else { steps * width }, width })
        }
    };
    let (mut simulations, mut inputs, mut columns) = (Vec::new(), Vec::new(), Vec::new());
    for (k, model) in models.iter().enumerate() {
        let acted = acting.stepper(py, model.get(), JointStart::default())?;
        let Acted { mut simulation, inputs: own, observed, width, .. } = acted;
        if simulation.lanes().is_none() || rows.is_some_and(|rows| rows.width != width) {
            return Ok(None); // its stepper says what is wrong
        }
        if let Some(state) = plan.states.as_ref().map(|states| &states[k]) {
            restore(py, &mut simulation, state)?;
        }
        simulations.push(simulation);
        inputs.push(own);
        columns = observed;
    }
    let count = simulations.len();
    let n = simulations.first().map_or(0, |own| own.configuration().len());
    let size = count.div_ceil(plan.threads.max(1)).next_multiple_of(LANES);
    let mut shares = Vec::new();
    while !simulations.is_empty() {
        let rest = simulations.split_off(size.min(simulations.len()));
        let other_inputs = inputs.split_off(simulations.len());
        let (first, own) = (shares.len() * size, std::mem::replace(&mut inputs, other_inputs));
        let Ok(members) = Members::new(std::mem::replace(&mut simulations, rest)) else {
            return Ok(None);
        };
        shares.push(ThreadShare { members, inputs: own, observed: &columns, first });
    }
    let (nodes, width) = (plan.nodes(), columns.len());
    let [mut t, mut q, mut y] = [1, n, width].map(|own| vec![f64::NAN; count * nodes * own]);
    let (mut watch, stopped) = (Watch::new(None), AtomicBool::new(false));
    let failed = py.detach(|| {
        let mut tables = Vec::new();
        let (mut t, mut q, mut y) = (&mut t[..], &mut q[..], &mut y[..]);
        for share in &shares {
            let own = share.inputs.len() * nodes;
            let (own_t, own_q, own_y);
            (own_t, t) = t.split_at_mut(own);
            (own_q, q) = q.split_at_mut(own * n);
            (own_y, y) = y.split_at_mut(own * width);
            tables.push(MemberTables { t: own_t, q: own_q, y: own_y });
        }
        thread::scope(|scope| {
            let mut work = shares.iter_mut().zip(tables);
            let first = work.next();
            let (plan, stopped) = (&plan, &stopped);
            let others: Vec<_> = work
                .map(|(share, mut tables)| {
                    scope.spawn(move || {
                        let mut go_on = |_| !stopped.load(Ordering::Relaxed);
                        share.run(plan, rows, &mut tables, &mut go_on)
                    })
                })
                .collect();
            let mut failed = Vec::new();
            if let Some((share, mut tables)) = first {
                let mut go_on = |n: usize| {
                    let goes = watch.proceed(n as u64, plan.steps as u64);
                    stopped.fetch_or(!goes, Ordering::Relaxed);
                    goes
                };
                failed = share.run(plan, rows, &mut tables, &mut go_on);
            }
            failed.extend(others.into_iter().flat_map(|own| own.join().unwrap_or_default()));
            failed
        })
    });
    let stopped = watch.stopped().err().map(|error| error.into_value(py));
    let shape = |error: numpy::ndarray::ShapeError| PyRuntimeError::new_err(error.to_string());
    let table = |values: Vec<f64>, columns: usize| {
        let array = Array3::from_shape_vec((count, nodes, columns), values).map_err(shape)?;
        Ok::<_, PyErr>(array.into_pyarray(py))
    };
    let times = Array2::from_shape_vec((count, nodes), t).map_err(shape)?;
    Ok(Some((times.into_pyarray(py), table(q, n)?, table(y, width)?, failed, stopped)))
}
