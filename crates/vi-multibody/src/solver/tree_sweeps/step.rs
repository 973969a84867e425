//! A step by the sweeps: opened, solved, closed.

use super::TreeSweeps;
use super::weights::{SchemeWeights, control_point};
use crate::geometry::one_tree::three;
use vi_constraints::galerkin::Sweeps;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_constraints::scheme::SubStep;
use vi_core::lanes::{Lanes, Register};
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::newton::{Fault, UnknownBlock};
use vi_core::state::State;

impl<T: Register> Sweeps for TreeSweeps<T> {
    fn dof(&self) -> usize {
        self.u.len()
    }

    fn blocks(&self) -> &[UnknownBlock] {
        &self.blocks
    }

    fn open(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        step: SubStep,
        state: &State,
    ) {
        points.open_ends(step, state);
        if self.weights.h.to_bits() != step.h.to_bits() {
            self.weights =
                SchemeWeights::new(self.space.0, points.constants(), &self.links, step.h);
        }
        let lanes = self.space.0;
        lanes.run(
            #[inline(always)]
            || self.open_at(state),
        );
        self.constant = system.has_constant_force();
        if self.constant {
            self.force.fill(0.0);
            system.add_potential_gradient(state.configuration(), -1.0, &mut self.force);
            lanes.run(
                #[inline(always)]
                || self.add_impulses(points),
            );
        }
    }

    fn residual(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        u: &[f64],
        r: &mut [f64],
        anew: bool,
    ) -> Result<(), Fault> {
        self.settle(system, points, u)?;
        if anew {
            self.space.0.run(
                #[inline(always)]
                || self.move_factors(),
            );
        }
        self.write_balances(r);
        Ok(())
    }

    fn settle(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        u: &[f64],
    ) -> Result<(), Fault> {
        self.read(u);
        let lanes = self.space.0;
        let is_in_chart = lanes.run(
            #[inline(always)]
            || self.advance(),
        );
        if !is_in_chart {
            self.refuse(u)?;
        }
        if !self.constant {
            self.write_increments(points);
            points.evaluate(system);
            lanes.run(
                #[inline(always)]
                || self.add_impulses(points),
            );
        }
        Ok(())
    }

    fn correction(
        &mut self,
        _points: &ControlPoints,
        _u: &[f64],
        du: &mut [f64],
    ) -> Result<(), Fault> {
        self.space.0.run(
            #[inline(always)]
            || self.correct(),
        )?;
        self.write_corrections(du);
        Ok(())
    }

    fn close(
        &mut self,
        _system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        p: &mut [f64],
    ) {
        self.write_momenta(points, p);
        let Self { links, dq, tree, .. } = self;
        for (k, link) in links.iter().enumerate() {
            let at = |v: usize| three!(i => dq[link.frame + 3 * v + i].at(0));
            tree.move_link(k, &at(0), &three!(i => at(i + 1)), points.step_mut());
        }
        points.step_mut().close();
    }

    fn write_increments(&self, points: &mut ControlPoints) {
        for place in 0..self.stages {
            let out = points.increments_mut(control_point(place, self.stages));
            out.iter_mut().zip(&self.dq).for_each(|(out, dq)| *out = dq.at(place));
        }
    }

    fn compose(&self, first: &[f64], u: &mut [f64]) {
        self.tree.compose(first, u);
    }

    fn clean(&mut self, _t: f64, q: &mut [f64]) {
        self.tree.clean(q);
    }
}
