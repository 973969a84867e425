//! Laws of joints by functions: of Python, or of machine code.
//!
//! The last argument of a function of Python is remembered: residual and slopes ask for the same
//! values.

use crate::errors::raise;
use crate::fault::PythonFault;
use holonom::vi_multibody::joint_force::{EffortSlopes, JointLaw};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::sync::{Arc, Mutex, PoisonError};

/// The last argument with what was found there.
#[derive(Clone, Copy, Debug)]
struct LastCall {
    at: [f64; 3],
    effort: f64,
    slopes: Option<[f64; 2]>,
}

/// A memory of one argument.
#[derive(Debug, Default)]
struct ArgumentMemory(Mutex<Option<LastCall>>);

impl ArgumentMemory {
    fn get(&self, at: [f64; 3]) -> Option<LastCall> {
        let last = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
        last.filter(|last| last.at.map(f64::to_bits) == at.map(f64::to_bits))
    }

    fn keep(&self, last: LastCall) -> LastCall {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = Some(last);
        last
    }
}

/// What a law gave in the place of an effort.
fn refused(found: &Bound<'_, PyAny>) -> PyErr {
    let words = format!("an effort, or an effort with its slopes by x and by v, not {found}");
    PyTypeError::new_err(words)
}

/// Arguments in words.
fn words([t, x, v]: [f64; 3]) -> String {
    format!("t = {t}, x = {x}, v = {v}")
}

/// `τ(t, θ, θ̇)`, or with both slopes, by a function of Python. Slopes that it does not give are
/// differences by two more calls.
pub(crate) struct PythonLaw {
    label: String,
    function: Py<PyAny>,
    conservative: bool,
    fault: Arc<PythonFault>,
    last: ArgumentMemory,
}

impl PythonLaw {
    pub(crate) fn new(
        label: String,
        function: Py<PyAny>,
        conservative: bool,
        fault: Arc<PythonFault>,
    ) -> Self {
        Self { label, function, conservative, fault, last: ArgumentMemory::default() }
    }

    /// The effort, and the slopes where the function gives them.
    fn call(&self, at: [f64; 3]) -> LastCall {
        if let Some(last) = self.last.get(at) {
            return last;
        }
        let mut slopes = None;
        let [effort] = self.fault.guard(
            &self.label,
            || words(at),
            |py| {
                let found = self.function.call1(py, (at[0], at[1], at[2]))?;
                let found = found.bind(py);
                if !found.is_instance_of::<PyTuple>() {
                    return found
                        .extract::<f64>()
                        .map(|effort| [effort])
                        .map_err(|_| refused(found));
                }
                let given = found.extract::<(f64, f64, f64)>();
                let (effort, by_coordinate, by_rate) = given.map_err(|_| refused(found))?;
                slopes = Some([by_coordinate, by_rate]);
                let bad = [by_coordinate, by_rate].into_iter().find(|slope| !slope.is_finite());
                Ok([bad.unwrap_or(effort)])
            },
        );
        let found = LastCall { at, effort, slopes };
        if self.fault.is_set() { found } else { self.last.keep(found) }
    }

    fn with_slopes(&self, at: [f64; 3]) -> (f64, [f64; 2]) {
        let LastCall { effort, slopes, .. } = self.call(at);
        if let Some(slopes) = slopes {
            return (effort, slopes);
        }
        let [t, x, v] = at;
        let apart = |value: f64| {
            let step = f64::EPSILON.sqrt() * value.abs().max(1.0);
            value + step
        };
        let (x1, v1) = (apart(x), apart(v));
        let by_coordinate = (self.call([t, x1, v]).effort - effort) / (x1 - x);
        let by_rate = (self.call([t, x, v1]).effort - effort) / (v1 - v);
        let slopes = [by_coordinate, by_rate];
        if !self.fault.is_set() {
            self.last.keep(LastCall { at, effort, slopes: Some(slopes) });
        }
        (effort, slopes)
    }
}

impl JointLaw for PythonLaw {
    fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64 {
        self.call([t, coordinate, rate]).effort
    }
    fn slopes(&self, t: f64, coordinate: f64, rate: f64) -> EffortSlopes {
        self.effort_and_slopes(t, coordinate, rate).1
    }
    fn effort_and_slopes(&self, t: f64, coordinate: f64, rate: f64) -> (f64, EffortSlopes) {
        let (effort, [by_coordinate, by_rate]) = self.with_slopes([t, coordinate, rate]);
        (effort, EffortSlopes { by_coordinate, by_rate })
    }
    fn is_dissipative(&self) -> bool {
        !self.conservative
    }
}

/// `double law(double t, double x, double v, double *slopes)`, which writes `∂τ/∂θ` and `∂τ/∂θ̇`.
pub(crate) struct CompiledLaw {
    label: String,
    address: usize,
    _owner: Py<PyAny>, // of the machine code
    conservative: bool,
    fault: Arc<PythonFault>,
}

impl CompiledLaw {
    pub(crate) fn new(
        label: String,
        address: usize,
        owner: Py<PyAny>,
        conservative: bool,
        fault: Arc<PythonFault>,
    ) -> Self {
        Self { label, address, _owner: owner, conservative, fault }
    }

    fn call(&self, at: [f64; 3]) -> (f64, [f64; 2]) {
        if self.fault.is_set() {
            return (f64::NAN, [f64::NAN; 2]);
        }
        let mut slopes = [0.0; 2];
        let effort = machine_code(self.address, at, &mut slopes);
        if !(effort.is_finite() && slopes.iter().all(|slope| slope.is_finite())) {
            let found =
                format!("{} gave {effort} with slopes {slopes:?} at {}", self.label, words(at));
            let remedy = "let it be finite for all arguments, those of Newton's iterates included";
            let error = Python::attach(|py| raise(py, "FunctionFailed", (found, remedy)));
            self.fault.set(error);
            return (f64::NAN, [f64::NAN; 2]);
        }
        (effort, slopes)
    }
}

/// Calls the function at an address that Python has checked to be one of this kind.
#[allow(unsafe_code)] // the address of a function of another language
fn machine_code(address: usize, [t, x, v]: [f64; 3], slopes: &mut [f64; 2]) -> f64 {
    type Law = extern "C" fn(f64, f64, f64, *mut f64) -> f64;
    // SAFETY: `holonom.compiled` takes functions of this signature alone, whose owner is kept.
    let law = unsafe { std::mem::transmute::<*const (), Law>(address as *const ()) };
    law(t, x, v, slopes.as_mut_ptr())
}

impl JointLaw for CompiledLaw {
    fn effort(&self, t: f64, coordinate: f64, rate: f64) -> f64 {
        self.call([t, coordinate, rate]).0
    }
    fn slopes(&self, t: f64, coordinate: f64, rate: f64) -> EffortSlopes {
        self.effort_and_slopes(t, coordinate, rate).1
    }
    fn effort_and_slopes(&self, t: f64, coordinate: f64, rate: f64) -> (f64, EffortSlopes) {
        let (effort, [by_coordinate, by_rate]) = self.call([t, coordinate, rate]);
        (effort, EffortSlopes { by_coordinate, by_rate })
    }
    fn is_dissipative(&self) -> bool {
        !self.conservative
    }
}
