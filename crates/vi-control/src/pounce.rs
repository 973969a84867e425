//! POUNCE, an interior point method in Rust (EPL-2.0), as a backend of [`NlpSolver`].
//!
//! The method is that of A. Wächter, L. T. Biegler, Math. Program. 106 (2006) 25–57: primal–dual
//! barrier steps, a filter, restoration of feasibility, shifts of the Hessian where its inertia is
//! not that of a minimum. One thread; files of options and environment variables are not read.

use crate::program::{
    AtPoint, Bounds, Iterate, MethodStart, MethodWatch, Multipliers, NlpSolver, Outcome,
    SharedProgram, Solved, SolverError, check_start,
};
use pounce_rs::pounce_algorithm::application::{
    default_backend_factory, feral_config_from_options,
};
use pounce_rs::pounce_restoration::resto_alg_builder::RestoAlgorithmBuilder;
use pounce_rs::pounce_restoration::resto_inner_solver::{
    InnerBackendFactoryFactory, make_default_restoration_factory_provider,
};
use pounce_rs::{
    ApplicationReturnStatus, BoundsInfo, IndexStyle, IpoptApplication, IpoptCq, IpoptData,
    IterStats, NlpInfo, Solution, SparsityRequest, StartingPoint, TNLP,
};
use std::cell::RefCell;
use std::rc::Rc;

/// A bound that the method takes for none.
const NONE: f64 = 2e19;

/// The method with its options.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pounce {
    /// Iterations at most.
    pub max_iterations: usize,
}

impl Default for Pounce {
    fn default() -> Self {
        Self { max_iterations: 300 }
    }
}

impl Pounce {
    fn application(&self, start: &MethodStart) -> Result<IpoptApplication, SolverError> {
        let (refused, warm) =
            (|name: &str| SolverError::Option(name.to_owned()), start.multipliers.is_some());
        let mut app = IpoptApplication::new();
        app.initialize_with_options_str("").map_err(|_| refused("(none)"))?;
        let numbers = [
            ("tol", 1e-10),
            ("constr_viol_tol", 1e-12),
            ("compl_inf_tol", 1e-11),
            ("dual_inf_tol", 1e-8),
            ("mu_min", 1e-13),
            ("bound_relax_factor", 0.0),
        ];
        let words = [("mu_strategy", "adaptive"), ("sb", "yes")];
        let max_iter = i32::try_from(self.max_iterations).unwrap_or(i32::MAX);
        let whole = [("print_level", 0), ("max_iter", max_iter)];
        // a start with multipliers near the optimum is moved off its bounds less
        let near = [
            ("warm_start_bound_push", 1e-9),
            ("warm_start_bound_frac", 1e-9),
            ("warm_start_slack_bound_push", 1e-9),
            ("warm_start_slack_bound_frac", 1e-9),
            ("warm_start_mult_bound_push", 1e-9),
            ("mu_init", 1e-8),
        ];
        let options = app.options_mut();
        for (name, value) in
            numbers.into_iter().chain(near.into_iter().filter(|_| warm && start.near))
        {
            options.set_numeric_value(name, value, true, true).map_err(|_| refused(name))?;
        }
        for (name, value) in
            words.into_iter().chain(warm.then_some(("warm_start_init_point", "yes")))
        {
            options.set_string_value(name, value, true, true).map_err(|_| refused(name))?;
        }
        for (name, value) in whole {
            options.set_integer_value(name, value, true, true).map_err(|_| refused(name))?;
        }
        let feral = feral_config_from_options(app.options());
        let backends = move || -> InnerBackendFactoryFactory {
            let feral = feral.clone();
            Box::new(move || default_backend_factory(feral.clone(), Default::default()))
        };
        let restoration = make_default_restoration_factory_provider(
            RestoAlgorithmBuilder::new(),
            app.algorithm_builder_from_options(),
            backends,
        );
        app.set_restoration_factory_provider(restoration);
        Ok(app)
    }
}

impl NlpSolver for Pounce {
    fn solve(
        &mut self,
        program: &SharedProgram,
        start: &MethodStart,
        watch: MethodWatch,
    ) -> Result<Solved, SolverError> {
        check_start(&*program.borrow(), start)?;
        let foreign = |name: &String| name.starts_with("POUNCE_") || name.starts_with("FERAL_");
        if let Some(name) = std::env::vars().map(|(name, _)| name).find(foreign) {
            return Err(SolverError::Environment(name));
        }
        let mut app = self.application(start)?;
        let adapter = Rc::new(RefCell::new(Adapter {
            bounds: program.borrow().bounds(),
            at: AtPoint::nowhere(program),
            start: start.clone(),
            watch,
            iterates: Vec::new(),
            found: (start.x.clone(), Multipliers::default()),
        }));
        let status = app.optimize_tnlp(Rc::clone(&adapter) as Rc<RefCell<dyn TNLP>>);
        let mut adapter = adapter.borrow_mut();
        let (x, mut multipliers) = std::mem::take(&mut adapter.found);
        let (n, m) = (x.len(), adapter.bounds.rows.len());
        multipliers.rows.resize(m, 0.0);
        multipliers.lower.resize(n, 0.0);
        multipliers.upper.resize(n, 0.0);
        let iterates = std::mem::take(&mut adapter.iterates);
        Ok(Solved { outcome: outcome(status), x, multipliers, iterates })
    }
}

fn outcome(status: ApplicationReturnStatus) -> Outcome {
    match status {
        ApplicationReturnStatus::SolveSucceeded => Outcome::Optimal,
        ApplicationReturnStatus::SolvedToAcceptableLevel
        | ApplicationReturnStatus::FeasiblePointFound => Outcome::Acceptable,
        ApplicationReturnStatus::InfeasibleProblemDetected => Outcome::Infeasible,
        ApplicationReturnStatus::UserRequestedStop => Outcome::Stopped,
        ApplicationReturnStatus::MaximumIterationsExceeded => Outcome::Exhausted,
        other => Outcome::Failed(other.upstream_name().into()),
    }
}

/// A program as the method reads it.
struct Adapter {
    at: AtPoint,
    bounds: Bounds,
    start: MethodStart,
    watch: MethodWatch,
    iterates: Vec<Iterate>,
    found: (Vec<f64>, Multipliers),
}

fn places(places: &[(usize, usize)], irow: &mut [i32], jcol: &mut [i32]) {
    for ((&(row, column), i), j) in places.iter().zip(irow).zip(jcol) {
        // programs of more than 2³¹ variables do not fit the memory
        (*i, *j) = (i32::try_from(row).unwrap_or(0), i32::try_from(column).unwrap_or(0));
    }
}

fn finite(values: &[f64]) -> bool {
    values.iter().all(|v| v.is_finite())
}

impl TNLP for Adapter {
    fn get_nlp_info(&mut self) -> Option<NlpInfo> {
        let program = self.at.program();
        let size = |n: usize| i32::try_from(n).ok();
        Some(NlpInfo {
            n: size(program.variables())?,
            m: size(program.rows())?,
            nnz_jac_g: size(program.jacobian_places().len())?,
            nnz_h_lag: size(program.hessian_places().len())?,
            index_style: IndexStyle::C,
        })
    }

    fn get_bounds_info(&mut self, b: BoundsInfo<'_>) -> bool {
        let known = |x: f64| x.clamp(-NONE, NONE);
        for (k, [low, high]) in self.bounds.variables.iter().enumerate() {
            (b.x_l[k], b.x_u[k]) = (known(*low), known(*high));
        }
        for (k, [low, high]) in self.bounds.rows.iter().enumerate() {
            (b.g_l[k], b.g_u[k]) = (known(*low), known(*high));
        }
        true
    }

    fn get_starting_point(&mut self, sp: StartingPoint<'_>) -> bool {
        sp.x.copy_from_slice(&self.start.x);
        if let Some(multipliers) = &self.start.multipliers {
            if sp.init_z {
                sp.z_l.copy_from_slice(&multipliers.lower);
                sp.z_u.copy_from_slice(&multipliers.upper);
            }
            if sp.init_lambda {
                sp.lambda.copy_from_slice(&multipliers.rows);
            }
        }
        true
    }

    fn eval_f(&mut self, x: &[f64], _new_x: bool) -> Option<f64> {
        let cost = self.at.moved(x).then(|| self.at.program().cost())?;
        cost.is_finite().then_some(cost)
    }

    fn eval_grad_f(&mut self, x: &[f64], _new_x: bool, grad_f: &mut [f64]) -> bool {
        if !self.at.moved(x) {
            return false;
        }
        self.at.program().cost_gradient(grad_f);
        finite(grad_f)
    }

    fn eval_g(&mut self, x: &[f64], _new_x: bool, g: &mut [f64]) -> bool {
        if !self.at.moved(x) {
            return false;
        }
        self.at.program().row_values(g);
        finite(g)
    }

    fn eval_jac_g(&mut self, x: Option<&[f64]>, _new_x: bool, mode: SparsityRequest<'_>) -> bool {
        match (mode, x) {
            (SparsityRequest::Structure { irow, jcol }, _) => {
                places(self.at.program().jacobian_places(), irow, jcol);
                true
            }
            (SparsityRequest::Values { values }, Some(x)) if self.at.moved(x) => {
                self.at.program().jacobian(values);
                finite(values)
            }
            _ => false,
        }
    }

    fn eval_h(
        &mut self,
        x: Option<&[f64]>,
        _new_x: bool,
        obj_factor: f64,
        lambda: Option<&[f64]>,
        _new_lambda: bool,
        mode: SparsityRequest<'_>,
    ) -> bool {
        match (mode, x, lambda) {
            (SparsityRequest::Structure { irow, jcol }, _, _) => {
                places(self.at.program().hessian_places(), irow, jcol);
                true
            }
            (SparsityRequest::Values { values }, Some(x), Some(lambda)) if self.at.moved(x) => {
                self.at.program().hessian(obj_factor, lambda, values);
                finite(values)
            }
            _ => false,
        }
    }

    fn intermediate_callback(&mut self, stats: IterStats, _: &IpoptData, _: &IpoptCq) -> bool {
        let iterate = Iterate {
            iteration: usize::try_from(stats.iter).unwrap_or(0),
            cost: stats.obj_value,
            infeasibility: stats.inf_pr,
            stationarity: stats.inf_du,
            barrier: stats.mu,
            step: stats.alpha_pr,
            shift: stats.regularization_size,
        };
        self.iterates.push(iterate);
        (self.watch)(&iterate)
    }

    fn finalize_solution(&mut self, sol: Solution<'_>, _: &IpoptData, _: &IpoptCq) {
        let multipliers = Multipliers {
            rows: sol.lambda.to_vec(),
            lower: sol.z_l.to_vec(),
            upper: sol.z_u.to_vec(),
        };
        self.found = (sol.x.to_vec(), multipliers);
    }
}
