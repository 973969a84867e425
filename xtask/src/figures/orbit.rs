//! Every node of a run at order 2, with its multipliers, momenta and energies.

use holonom::vi_constraints::node::Node;
use holonom::vi_core::MechanicalSystem;
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
    pub(super) node: Node,
}

/// The nodes `0 … steps − 1` of a model.
pub(super) fn orbit(model: &Model, steps: usize) -> Result<Vec<Point>> {
    let mut simulation = Simulation::new(model).map_err(|e| e.to_string())?;
    let run = simulation.integrator();
    let mut points = Vec::new();
    for _ in 0..steps {
        run.step().map_err(|e| e.to_string())?;
        let node = run.node_before().map_err(|e| e.to_string())?.clone();
        let mut minus_d1 = vec![0.0; node.p.len()];
        run.system().d1(run.interval(), &mut minus_d1);
        minus_d1.iter_mut().for_each(|x| *x = -*x);
        let before = run.before();
        points.push(Point {
            t: before.t,
            q: before.q.clone(),
            d2: before.p.clone(),
            minus_d1,
            node,
        });
    }
    Ok(points)
}
