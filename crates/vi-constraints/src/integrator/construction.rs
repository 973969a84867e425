//! What an integrator is made from: `g` alone, `g` with `P` and `F_d`, or any scheme.

use super::Integrator;
use super::checks::{check_composition, check_galerkin, check_shapes};
use super::origin::Origin;
use crate::agreement::contradiction;
use crate::closure::ClosureWatch;
use crate::constrained::Constrained;
use crate::constraints::Constraints;
use crate::costate_sweep::CostateChoice;
use crate::dalembert::{Dalembert, MapSource, QrSource};
use crate::discretization::Discretization;
use crate::galerkin::{DenseControlPoints, GalerkinConstrained, GalerkinNodal, Pointwise};
use crate::initialization::{ConsistentStart, InitialValues, StartReport, start};
use crate::nodal_operators::by_operators;
use crate::nonsmooth::Nonsmooth;
use crate::reparametrization::{DenseNodal, Reparametrization};
use crate::saddle_point::IndependentRows;
use crate::scheme::{Scheme, SchemeKind, StepSolver};
use crate::setup::{Options, SetupError, check_dense};
use crate::tangent_space::TangentSpace;
use std::sync::Arc;
use vi_core::discrete_lagrangian::DiscreteLagrangian;

impl<S: DiscreteLagrangian + 'static, C: Constraints + 'static> Integrator<S, C> {
    /// All four schemes from `g` alone: `P` of scheme 2 from a pivoted QR of `Gᵀ`, `P` and `F_d` of
    /// schemes 3 and 4 from the [`TangentSpace`].
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn new(
        system: S,
        constraints: C,
        options: Options,
        at: InitialValues<'_>,
    ) -> Result<Self, SetupError> {
        let constraints = Arc::new(constraints);
        let (n, m) = (constraints.dim(), constraints.len());
        check_shapes(&system, &*constraints, at)?;
        let rows = IndependentRows::find_generic(&*constraints, at.t, at.q)?;
        let scheme: Box<dyn Scheme<S, C>> = match (options.scheme, options.method.stages()) {
            (SchemeKind::Constrained, Some(stages)) => {
                Box::new(GalerkinConstrained::new(n, m, rows.clone(), stages))
            }
            (_, Some(_)) => {
                return Err(SetupError::no_galerkin("constraints without a null space"));
            }
            (SchemeKind::Constrained, None) => Box::new(Constrained::new(n, m, rows.clone())),
            (SchemeKind::Dalembert, None) => {
                check_dense(n, "this scheme", "write the scheme `constrained`")?;
                let source = QrSource::new(n, m, rows.len());
                Box::new(Dalembert::new(n, m, rows.clone(), source))
            }
            (kind @ (SchemeKind::Nodal | SchemeKind::Reduced), None) => {
                check_dense(n, "this scheme", "write the scheme `constrained`")?;
                let operators = TangentSpace::new(constraints.clone(), &rows);
                by_operators(kind, n, operators, None)
            }
        };
        Self::with_scheme(system, constraints, scheme, rows, options, at)?.consistent()
    }

    /// All four schemes, with the user's `P` and `F_d`.
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn with_reparametrization<R: Reparametrization + 'static>(
        system: S,
        constraints: C,
        map: R,
        options: Options,
        at: InitialValues<'_>,
    ) -> Result<Self, SetupError> {
        let (n, m, d) = (constraints.dim(), constraints.len(), map.dof());
        check_shapes(&system, &constraints, at)?;
        let rows = IndependentRows::find(&constraints, at.t, at.q);
        if d != n - rows.len() {
            let what = "the increment u of the reparametrization";
            return Err(SetupError::Shape { what, found: d, expected: n - rows.len() });
        }
        let scheme: Box<dyn Scheme<S, C>> = match (options.scheme, options.method.stages()) {
            (SchemeKind::Constrained, Some(stages)) => {
                Box::new(GalerkinConstrained::new(n, m, rows.clone(), stages))
            }
            (SchemeKind::Nodal, Some(stages)) => {
                let operators = DenseControlPoints::new(n, stages.count(), map);
                let sweeps = Pointwise::new(n, stages.count(), operators);
                Box::new(GalerkinNodal::new(n, stages, sweeps))
            }
            (SchemeKind::Dalembert | SchemeKind::Reduced, Some(_)) => {
                return Err(SetupError::no_galerkin("in this form"));
            }
            (SchemeKind::Constrained, None) => Box::new(Constrained::new(n, m, rows.clone())),
            (SchemeKind::Dalembert, None) => {
                Box::new(Dalembert::new(n, m, rows.clone(), MapSource(map)))
            }
            (kind @ (SchemeKind::Nodal | SchemeKind::Reduced), None) => {
                by_operators(kind, n, DenseNodal::new(n, map), None)
            }
        };
        Self::with_scheme(system, constraints, scheme, rows, options, at)?.consistent()
    }
}

impl<S: Discretization<C>, C: Constraints> Integrator<S, C> {
    /// Any scheme of any family, with an independent set of constraints that the caller knows.
    ///
    /// # Errors
    /// [`SetupError`].
    pub fn with_scheme<K>(
        system: S,
        constraints: impl Into<Arc<C>>,
        scheme: Box<dyn Scheme<S, C>>,
        rows: IndependentRows,
        options: Options<K>,
        at: InitialValues<'_>,
    ) -> Result<Self, SetupError> {
        let constraints: Arc<C> = constraints.into();
        if !(options.step.is_finite() && options.step != 0.0) {
            return Err(SetupError::Step(options.step));
        }
        let gammas = system.sub_steps(options.method.composition());
        check_composition(&system, &gammas)?;
        if options.method.stages().is_some() {
            check_galerkin(&system)?;
        }
        check_shapes(&system, &*constraints, at)?;
        let ConsistentStart { mut state, v: initial_velocity, report } =
            start(&system, &*constraints, &rows, at)?;
        system.begin(&mut state, &initial_velocity);
        state.angles = constraints.principal_angles(&state.q);
        if at.angles.len() == state.angles.len() {
            state.angles.copy_from_slice(at.angles);
            constraints.unwrap_angles(&state.q, &mut state.angles);
        }
        let observer = system.observer(constraints.len(), &rows);
        let watch =
            ClosureWatch::new(&*constraints, state.configuration(), options.newton.tolerance);
        Ok(Self {
            system,
            constraints,
            solver: StepSolver::new(&*scheme, options.newton),
            scheme,
            observer,
            start_observer: None,
            rows,
            gammas,
            method: options.method,
            step: options.step,
            origin: Origin { t: at.t, step: 0 },
            before: state.clone(),
            trial: Box::default(),
            state,
            start: report,
            initial_velocity,
            watch,
            nonsmooth: None,
            costates: None,
        })
    }

    /// Refuses a start at which dependent constraints contradict each other. Premise: the start is
    /// not singular.
    ///
    /// # Errors
    /// [`SetupError::Contradiction`].
    pub fn consistent(self) -> Result<Self, SetupError> {
        let (at, v) = (self.state.configuration(), &self.initial_velocity);
        match contradiction(&*self.constraints, &self.rows, at.moving(v)) {
            Some(found) => Err(found.into()),
            None => Ok(self),
        }
    }

    /// The start is a singular configuration in which only `rows` are independent; `report` is of
    /// the projection that was made with them.
    #[must_use]
    pub fn starting_singular(mut self, rows: &IndependentRows, report: StartReport) -> Self {
        self.start_observer = Some(self.system.observer(self.constraints.len(), rows));
        self.start = report;
        self
    }

    /// With what pulls costates back over steps by the structure of the mechanism.
    #[must_use]
    pub fn with_costates(mut self, choice: CostateChoice<S, C>) -> Self {
        self.costates = Some(choice);
        self
    }

    /// With contacts, joint stops and dry friction.
    ///
    /// # Errors
    /// [`SetupError::Contacts`] of schemes above order 2 and of negative steps,
    /// [`SetupError::Overlap`].
    pub fn with_contacts(mut self, mut contacts: Nonsmooth) -> Result<Self, SetupError> {
        const OVERLAP: f64 = 1e-9; // parts of the size of a gap
        if self.reads_states() {
            return Err(SetupError::Contacts { what: "methods of another order than 2" });
        }
        if self.step < 0.0 {
            return Err(SetupError::Contacts { what: "steps backwards in time" });
        }
        if let Some((relative, gap, element)) = contacts.smallest_gap(&self.state)
            && (relative.is_nan() || relative < -OVERLAP)
        {
            return Err(SetupError::Overlap { element: element.to_owned(), depth: -gap });
        }
        self.nonsmooth = Some(Box::new(contacts));
        Ok(self)
    }

    /// With other coefficients `γ` of the sub-steps than those of a [`vi_core::Composition`].
    ///
    /// # Errors
    /// [`SetupError::DissipativeComposition`].
    pub fn with_coefficients(mut self, gammas: Vec<f64>) -> Result<Self, SetupError> {
        check_composition(&self.system, &gammas)?;
        self.gammas = gammas;
        Ok(self)
    }
}
