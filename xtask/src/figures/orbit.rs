//! Every node of a run at order 2, with its multipliers, momenta and energies from its
//! configurations.

use holonom::vi_constraints::LegendreTransforms;
use holonom::vi_constraints::legendre::LegendreError;
use holonom::vi_core::{Energies, legendre};
use holonom::{Model, Simulation};

use super::Result;

/// A node and the step that starts there.
pub(super) struct Point {
    pub(super) t: f64,
    pub(super) q: Vec<f64>,
    /// `D_2 L_d(q_{n-1}, q_n)`; at the start `p(0)`.
    pub(super) d2: Vec<f64>,
    /// `−D_1 L_d(q_n, q_{n+1})`.
    pub(super) minus_d1: Vec<f64>,
    /// `λ_n` (36), at the start (47).
    pub(super) lambda: Vec<f64>,
    /// `Gᵀ λ_n`.
    pub(super) force: Vec<f64>,
    /// `p_n` (34).
    pub(super) p: Vec<f64>,
    /// `ᵠp_n` (39).
    pub(super) p_projected: Vec<f64>,
    /// `E_d(q_n, q_{n+1})` (52).
    pub(super) discrete_energy: Energies,
    /// `H_d(q_n, p_n)` (53).
    pub(super) hamiltonian: Energies,
    /// Residuals of the constraints of positions, velocities (45), momenta (46).
    pub(super) residuals: [f64; 3],
}

/// The nodes `0 … steps − 1` of a model with a regular mass matrix.
pub(super) fn orbit(model: &Model, steps: usize) -> Result<Vec<Point>> {
    let mut simulation = Simulation::new(model).map_err(|e| e.to_string())?;
    let run = simulation.integrator();
    let start = run.state().p.clone();
    let (mut intervals, mut residuals) = (Vec::new(), Vec::new());
    for _ in 0..steps {
        run.step().map_err(|e| e.to_string())?;
        let node = run.node_before().map_err(|e| e.to_string())?;
        residuals.push([node.position_residual, node.velocity_residual, node.momentum_residual]);
        intervals.push(run.interval().clone());
    }
    let of = LegendreTransforms::with_rows(run.system(), run.constraints(), run.rows());
    let mut of = of.map_err(|e| e.to_string())?;
    let mut points = Vec::new();
    for (n, after) in intervals.iter().enumerate() {
        let before = n.checked_sub(1).map(|n| &intervals[n]);
        let mut d2 = start.clone();
        if let Some(before) = before {
            legendre::p_plus(run.system(), before, &mut d2);
        }
        let mut minus_d1 = vec![0.0; d2.len()];
        legendre::p_minus(run.system(), after, &mut minus_d1);
        let point = || -> std::result::Result<Point, LegendreError> {
            let lambda = match before {
                Some(before) => of.multiplier(before, after)?,
                None => of.start_multiplier(&start, after)?,
            };
            let p = of.momentum_minus(after, &lambda)?;
            Ok(Point {
                t: after.t,
                q: after.q0.clone(),
                force: of.constraint_force(after.start(), &lambda)?,
                p_projected: of.projected_momentum_minus(after)?,
                discrete_energy: of.discrete_energy(after)?,
                hamiltonian: of.hamiltonian(after.start(), &p)?.unwrap_or_default(),
                residuals: residuals[n],
                d2,
                minus_d1,
                lambda,
                p,
            })
        };
        points.push(point().map_err(|e| e.to_string())?);
    }
    Ok(points)
}
