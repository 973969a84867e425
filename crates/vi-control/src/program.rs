//! Nonlinear programs, and the methods that solve them.
//!
//! ```text
//! minimise f(x)   over  x_L ≤ x ≤ x_U,   g_L ≤ g(x) ≤ g_U
//! 𝓛(x, λ) = f + λᵀ g,     ∇f + Jᵀλ − z_L + z_U = 0,     z_L, z_U ≥ 0          at an optimum
//! ```
//! `λ_i > 0` where the upper bound of row `i` is active, `λ_i < 0` where the lower one is. A bound
//! that is infinite is none. A program is evaluated, a method only proposes: whether a point is an
//! optimum is judged by [`crate::kkt`].

use std::borrow::Cow;
use std::cell::{Ref, RefCell};
use std::rc::Rc;

/// A nonlinear program with exact first and second derivatives in sparse form.
///
/// Places of entries never change. An entry may be listed several times: its values add up.
pub trait Program {
    /// Number of variables.
    fn variables(&self) -> usize;
    /// Number of rows of `g`.
    fn rows(&self) -> usize;
    /// Bounds of variables and rows.
    fn bounds(&self) -> Bounds;
    /// Places `(row, column)` of the Jacobian `J = ∂g/∂x`.
    fn jacobian_places(&self) -> &[(usize, usize)];
    /// Places `(row, column)` of `∇²𝓛`, its lower triangle: `row ≥ column`.
    fn hessian_places(&self) -> &[(usize, usize)];
    /// Moves to a point; the other functions are then those at it.
    ///
    /// # Errors
    /// [`Undefined`] where the functions do not exist.
    fn move_to(&mut self, x: &[f64]) -> Result<(), Undefined>;
    /// `f(x)`.
    fn cost(&self) -> f64;
    /// `out ← ∇f(x)`, shape of the variables.
    fn cost_gradient(&self, out: &mut [f64]);
    /// `out ← g(x)`, shape of the rows.
    fn row_values(&self, out: &mut [f64]);
    /// `out ←` the entries of `J(x)`, shape of [`Program::jacobian_places`].
    fn jacobian(&self, out: &mut [f64]);
    /// `out ←` the entries of `factor ∇²f + Σ λ_i ∇²g_i`, shape of [`Program::hessian_places`].
    fn hessian(&self, factor: f64, lambda: &[f64], out: &mut [f64]);
    /// What row `i` states, in words.
    fn row_name(&self, row: usize) -> String {
        format!("row {row}")
    }
}

/// A program and a method share it.
pub type SharedProgram = Rc<RefCell<dyn Program>>;

/// A shared program that remembers where it is, and is moved where that changes alone.
pub struct AtPoint {
    program: SharedProgram,
    at: Vec<f64>, // empty: nowhere
}

impl std::fmt::Debug for AtPoint {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("AtPoint").field("at", &self.at).finish_non_exhaustive()
    }
}

impl AtPoint {
    /// That is nowhere yet.
    #[must_use]
    pub fn nowhere(program: &SharedProgram) -> Self {
        Self { program: Rc::clone(program), at: Vec::new() }
    }

    /// The program there.
    #[must_use]
    pub fn program(&self) -> Ref<'_, dyn Program + 'static> {
        self.program.borrow()
    }

    /// Whether the program has functions at `x`; moves it there.
    pub fn moved(&mut self, x: &[f64]) -> bool {
        let same = |(a, b): (&f64, &f64)| a.to_bits() == b.to_bits();
        if self.at.len() == x.len() && self.at.iter().zip(x).all(same) {
            return true;
        }
        let moved = self.program.borrow_mut().move_to(x).is_ok();
        self.at.clear();
        if moved {
            self.at.extend_from_slice(x);
        }
        moved
    }
}

/// The functions of a program do not exist at a point.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the functions of the program do not exist there")]
pub struct Undefined;

/// Bounds of variables and rows; infinite where there are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bounds {
    /// `(x_L, x_U)` of each variable.
    pub variables: Vec<[f64; 2]>,
    /// `(g_L, g_U)` of each row.
    pub rows: Vec<[f64; 2]>,
}

/// Multipliers of rows and of bounds of variables.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Multipliers {
    /// `λ`, shape of the rows.
    pub rows: Vec<f64>,
    /// `z_L ≥ 0`, shape of the variables.
    pub lower: Vec<f64>,
    /// `z_U ≥ 0`, shape of the variables.
    pub upper: Vec<f64>,
}

/// Where a method starts: a guess, with multipliers where they are known.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct MethodStart {
    /// Shape of the variables.
    pub x: Vec<f64>,
    /// Those of a point nearby.
    pub multipliers: Option<Multipliers>,
    /// Whether it is near an optimum: it is moved off its bounds less.
    pub near: bool,
}

/// An iteration of a method.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Iterate {
    /// Its number, from 0 on.
    pub iteration: usize,
    /// `f`.
    pub cost: f64,
    /// Largest violation of rows.
    pub infeasibility: f64,
    /// Largest entry of `∇𝓛`.
    pub stationarity: f64,
    /// Barrier parameter.
    pub barrier: f64,
    /// Part of the step that was taken, in `[0, 1]`.
    pub step: f64,
    /// Multiple of the identity added to `∇²𝓛`; 0 where it is positive definite on the rows.
    pub shift: f64,
}

/// How a method ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// It says that its point is an optimum.
    Optimal,
    /// It says so within looser tolerances.
    Acceptable,
    /// It found a point that no direction brings nearer to the rows.
    Infeasible,
    /// It was told to stop.
    Stopped,
    /// It made as many iterations as it may.
    Exhausted,
    /// It found no further step, in its own words.
    Failed(Cow<'static, str>),
}

/// Where a method ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Solved {
    /// How.
    pub outcome: Outcome,
    /// The last point.
    pub x: Vec<f64>,
    /// Its multipliers.
    pub multipliers: Multipliers,
    /// All iterations.
    pub iterates: Vec<Iterate>,
}

/// Sees each iteration; false stops the method.
pub type MethodWatch = Box<dyn FnMut(&Iterate) -> bool>;

/// Wrong inputs of a method.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum SolverError {
    /// The guess has another shape than the program.
    #[error("the guess has {found} variables, the program {wanted}")]
    Shape {
        /// Of the guess.
        found: usize,
        /// Of the program.
        wanted: usize,
    },
    /// A number of the guess is not finite.
    #[error("variable {0} of the guess is not finite")]
    NotFinite(usize),
    /// An environment variable would change the method.
    #[error("the environment variable `{0}` would change the method: unset it")]
    Environment(String),
    /// An option was refused.
    #[error("the method refuses its option `{0}`")]
    Option(String),
}

/// A method for nonlinear programs.
pub trait NlpSolver {
    /// Solves a program from a start.
    ///
    /// # Errors
    /// [`SolverError`]: wrong inputs. How it ends is an [`Outcome`].
    fn solve(
        &mut self,
        program: &SharedProgram,
        start: &MethodStart,
        watch: MethodWatch,
    ) -> Result<Solved, SolverError>;
}

/// Whether a start fits a program.
///
/// # Errors
/// [`SolverError::Shape`], [`SolverError::NotFinite`].
pub fn check_start(program: &dyn Program, start: &MethodStart) -> Result<(), SolverError> {
    let (found, wanted) = (start.x.len(), program.variables());
    if found != wanted {
        return Err(SolverError::Shape { found, wanted });
    }
    match start.x.iter().position(|x| !x.is_finite()) {
        Some(at) => Err(SolverError::NotFinite(at)),
        None => Ok(()),
    }
}
