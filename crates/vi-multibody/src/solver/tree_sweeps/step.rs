//! A step by the sweeps: opened, solved, closed.
#![allow(non_snake_case)] // K

use super::TreeSweeps;
use super::link::Start;
use super::weights::{Weights, control_point};
use crate::geometry::lane_vectors::Vector;
use vi_constraints::galerkin::Sweeps;
use vi_constraints::galerkin::control_points::ControlPoints;
use vi_constraints::scheme::SubStep;
use vi_core::lanes::{Lanes, Register};
use vi_core::mechanical_system::MechanicalSystem;
use vi_core::newton::{Block, Fault};
use vi_core::state::State;

impl<T: Register> Sweeps for TreeSweeps<T> {
    fn dof(&self) -> usize {
        self.u.len()
    }

    fn blocks(&self) -> &[Block] {
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
            self.weights = Weights::new(self.lanes, points.constants(), &self.links, step.h);
        }
        for (k, link) in self.links.iter().enumerate() {
            self.starts[k] = Start::of(link, &self.starts[link.parent], &state.q);
        }
        self.constant = system.has_constant_force();
        if self.constant {
            self.force.fill(0.0);
            system.add_potential_gradient(state.configuration(), -1.0, &mut self.force);
            self.lanes.run(
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
        let lanes = self.lanes;
        if anew {
            lanes.run(
                #[inline(always)]
                || self.factorize(),
            )?;
        }
        lanes.run(
            #[inline(always)]
            || self.balance(),
        );
        for (i, r) in r.chunks_exact_mut(self.r.len()).enumerate() {
            for (r, lanes) in r.iter_mut().zip(&self.r) {
                *r = lanes.at(i);
            }
        }
        Ok(())
    }

    fn settle(
        &mut self,
        system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        u: &[f64],
    ) -> Result<(), Fault> {
        self.read(u)?;
        let lanes = self.lanes;
        lanes.run(
            #[inline(always)]
            || self.place(),
        );
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
        let (lanes, s) = (self.lanes, self.stages);
        lanes.run(
            #[inline(always)]
            || self.correct(),
        );
        let d = self.nu.len();
        for place in 0..s {
            let j = control_point(place, s);
            for (du, nu) in du[(j - 1) * d..j * d].iter_mut().zip(&self.nu) {
                *du = nu.at(place);
            }
        }
        Ok(())
    }

    fn close(
        &mut self,
        _system: &impl MechanicalSystem,
        points: &mut ControlPoints,
        p: &mut [f64],
    ) {
        let Self { links, weights, poses, force, constant, tree, .. } = self;
        for (k, link) in links.iter().enumerate() {
            let pose = &poses[k];
            for (v, delta) in [&pose.x, &pose.d[0], &pose.d[1], &pose.d[2]].into_iter().enumerate()
            {
                for i in 0..3 {
                    let (at, delta) = (12 * link.frame + 3 * v + i, delta.0[i]);
                    let mixed: f64 =
                        weights.last.iter().enumerate().map(|(l, K)| K * delta.at(l)).sum();
                    let force = |k: usize| if *constant { force[at] } else { points.force(k)[at] };
                    let impulse: f64 = weights
                        .of_last
                        .iter()
                        .enumerate()
                        .map(|(k, weight)| weight * force(k))
                        .sum();
                    p[at] = impulse + weights.masses[k][v] * mixed; // [2.29]
                }
            }
            let at = |x: &Vector<T::Lanes>| [x.0[0].at(0), x.0[1].at(0), x.0[2].at(0)];
            let d = [at(&pose.d[0]), at(&pose.d[1]), at(&pose.d[2])];
            tree.move_link(k, &at(&pose.x), &d, points.step_mut());
        }
        points.step_mut().close();
    }

    fn write_increments(&self, points: &mut ControlPoints) {
        for place in 0..self.stages {
            let out = points.increments_mut(control_point(place, self.stages));
            for (link, pose) in self.links.iter().zip(&self.poses) {
                let out = &mut out[12 * link.frame..12 * link.frame + 12];
                for (v, delta) in [&pose.x, &pose.d[0], &pose.d[1], &pose.d[2]].iter().enumerate() {
                    for i in 0..3 {
                        out[3 * v + i] = delta.0[i].at(place);
                    }
                }
            }
        }
    }

    fn compose(&self, first: &[f64], u: &mut [f64]) {
        self.tree.compose(first, u);
    }

    fn clean(&mut self, _t: f64, q: &mut [f64]) {
        self.tree.clean(q);
    }
}
