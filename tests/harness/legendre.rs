//! The discrete Legendre transforms of `vi_constraints::legendre`, evaluated at the first three
//! nodes of a reference trajectory: no step is taken here.

use super::case::{Deviation, Tolerance};
use nalgebra::DMatrix;
use vi_constraints::{Constraints, LegendreTransforms, Reparametrization};
use vi_core::{DiscreteLagrangian, Energies, Interval};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::tree_map::TreeMap;

/// What a reference says of a node.
pub struct Reference<'a> {
    pub q: &'a [f64],
    pub p: &'a [f64],
    pub force: &'a [f64],
    pub lambda: Option<f64>,
    pub e_d: f64,
    pub h_d: f64,
    pub h_dq: f64,
}

/// Deviations at the nodes 0 and 1 from the configurations 0, 1, 2; (47) and the bare `p(0)` at the
/// start.
pub fn deviation(
    system: &impl DiscreteLagrangian,
    mechanism: &Mechanism,
    h: f64,
    nodes: &[Reference<'_>; 3],
    tolerance: &Tolerance,
) -> Result<Deviation, String> {
    let [start, node, next] = nodes;
    let before = Interval::between(0.0, h, start.q, node.q);
    let after = Interval::between(h, h, node.q, next.q);
    let words = |e: vi_constraints::legendre::LegendreError| e.to_string();
    let mut of = LegendreTransforms::new(system, mechanism, before.start()).map_err(words)?;
    let mut found = Deviation::default();
    let lambda_0 = of.start_multiplier(start.p, &before).map_err(words)?;
    let lambda_1 = of.multiplier(&before, &after).map_err(words)?;
    for (reference, s, lambda) in [(start, &before, lambda_0), (node, &after, lambda_1)] {
        let at = s.start();
        let p = of.momentum_minus(s, &lambda).map_err(words)?;
        found.p(&p, reference.p, tolerance);
        let force = of.constraint_force(at, &lambda).map_err(words)?;
        found.force(&force, reference.force, tolerance);
        if let Some(expected) = reference.lambda {
            found.force(&lambda, &[expected], tolerance);
        }
        let total = |e: Energies| e.total();
        found.energy(of.discrete_energy(s).map(total).map_err(words)?, reference.e_d, tolerance);
        let hamiltonian = of.hamiltonian(at, &p).map_err(words)?;
        found.energy(hamiltonian.map_or(f64::NAN, total), reference.h_d, tolerance);
        let projected = of.projected_hamiltonian(at, &p).map(total).map_err(words)?;
        found.energy(projected, reference.h_dq, tolerance);
    }
    // at the node in the middle every transform has its two sides
    let lambda = of.multiplier(&before, &after).map_err(words)?;
    found.p(&of.momentum_plus(&before, &lambda).map_err(words)?, node.p, tolerance);
    let sides = (of.projected_momentum_minus(&after), of.projected_momentum_plus(&before));
    found.p(&sides.0.map_err(words)?, &sides.1.map_err(words)?, tolerance);
    if !mechanism.has_loops() {
        let map = TreeMap::new(mechanism);
        let mut null_space = DMatrix::zeros(mechanism.dim(), map.dof());
        map.null_space(node.q, &mut null_space);
        let minus = of.reduced_momentum_minus(&after, &null_space).map_err(words)?;
        let plus = of.reduced_momentum_plus(&before, &null_space).map_err(words)?;
        found.p(&minus, &plus, tolerance);
    }
    Ok(found)
}
