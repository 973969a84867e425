//! The nodal scheme on closed loops: the sweeps of the spanning tree, loops on top.
//!
//! ```text
//! b = P_treeᵀ [p̄_n + D_1 L_d + f_d^-],   −h A_α                 by the sweeps of the tree
//! r = (b − Uᵀλ, g/h),   [A  −Uᵀ; J'  0] [δ; μ] = (b − Uᵀλ, g)   as on all closed loops
//! ```
//! The sweeps are those of [`crate::solver::tree_step`], and twists and wrenches refer to their reference points; letters
//! and loops are those of [`super`]. The balance is handed on with the momenta of these sweeps, along the null space of
//! `J_n`.
//!
//! [`super::LoopNodal`] solves loops that start in a singular configuration, and potentials that couple bodies.

use super::loop_rank::LoopRank;
use super::loop_sweeps::LoopSweeps;
use super::path::Maps;
use super::sweep::Resolution;
use crate::mechanism::Mechanism;
use crate::solver::tree_step::TreeStep;
use vi_constraints::scheme::{Condition, Scheme, StepError, SubStep};
use vi_constraints::unknowns::Increments;
use vi_core::SeparableSystem;
use vi_core::interval::Interval;
use vi_core::newton::{Block, Fault, Newton};
use vi_core::predictor::Degree;
use vi_core::state::State;

crate::opaque_debug!(LoopStep);

/// The nodal scheme on a mechanism with closed loops.
pub struct LoopStep {
    tree: TreeStep,
    sweeps: LoopSweeps,
    increments: Increments,
    resolution: Resolution,
    fresh: bool, // rows not chosen yet in this step
}

impl LoopStep {
    /// For a mechanism whose potentials couple no two bodies and that does not start in a singular configuration; `None`
    /// where it does not apply.
    #[must_use]
    pub fn new(mechanism: &Mechanism, system: &SeparableSystem, rank: &LoopRank) -> Option<Self> {
        let mut tree = TreeStep::new(mechanism, system)?;
        let sweeps = LoopSweeps::new(mechanism, rank, tree.system().0)?;
        let (resolution, fresh) = (Resolution::full(), true);
        let increments = Increments::new(sweeps.loops.blocks.clone());
        Some(Self { tree, sweeps, increments, resolution, fresh })
    }
}

impl Scheme<SeparableSystem, Mechanism> for LoopStep {
    fn blocks(&self) -> &[Block] {
        self.increments.blocks()
    }

    fn begin(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        step: SubStep,
        state: &mut State,
    ) {
        self.increments.open(mechanism, &state.q);
        self.tree.begin(system, mechanism, step, state);
        self.sweeps.begin(self.tree.at_links(), &state.q, &state.memory);
        self.fresh = true;
    }

    fn residual(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        u: &[f64],
        r: &mut [f64],
    ) -> Result<(), Fault> {
        self.tree.residual(system, mechanism, u, r)?;
        self.tree.close_interval();
        if self.fresh {
            let Self { tree, sweeps, .. } = self;
            let maps = Maps::Sweeps(tree.at_links());
            self.resolution = sweeps.loops.choose_rows(maps, &tree.interval().q1, u);
            self.fresh = false;
        }
        let s = self.tree.interval();
        self.increments.reach(mechanism, &s.q1);
        for cluster in &mut self.sweeps.loops.clusters {
            cluster.close(s.end());
            cluster.project(s.h, r);
        }
        Ok(())
    }

    fn correction(
        &mut self,
        system: &SeparableSystem,
        _: &Mechanism,
        u: &[f64],
        du: &mut [f64],
    ) -> Result<(), Fault> {
        let h = self.tree.interval().h;
        let clusters = &mut self.sweeps.loops.clusters;
        clusters.iter_mut().try_for_each(|cluster| cluster.split(h, du))?;
        self.tree.assemble(system);
        du.iter_mut().for_each(|x| *x *= -h); // −h A δ − Uᵀμ = −h (b − Uᵀλ)
        self.sweeps.solve(self.tree.system(), u, du)?;
        if du.iter().all(|x| x.is_finite()) { Ok(()) } else { Err(Fault::SingularTangent) }
    }

    fn noise(&self) -> f64 {
        self.resolution.noise()
    }

    /// Bodies are rotated, not solved for.
    fn keeps_orientation(&self) -> bool {
        true
    }

    fn degree(&self) -> Degree {
        Degree::Fitting
    }

    fn closing_size(&self) -> f64 {
        self.resolution.closing_size()
    }

    fn end(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        newton: &Newton,
        state: &mut State,
    ) -> Result<(), StepError> {
        self.sweeps.loops.remember(&mut state.memory);
        self.tree.end(system, mechanism, newton, state)?;
        let balance = &mut state.compensation.balance;
        let clusters = &self.sweeps.loops.clusters;
        clusters.iter().for_each(|cluster| cluster.project_balance(balance));
        Ok(())
    }

    fn interval(&self) -> &Interval {
        self.tree.interval()
    }

    fn interval_mut(&mut self) -> &mut Interval {
        self.tree.interval_mut()
    }

    /// From the inverse, column by column; the rows of the loop constraints count among those of the matrix.
    fn condition(
        &mut self,
        system: &SeparableSystem,
        mechanism: &Mechanism,
        u: &[f64],
    ) -> Option<Condition> {
        let solve = |column: &mut [f64]| self.correction(system, mechanism, u, column);
        Condition::of_inverse(u.len(), solve)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::BuiltMechanism;
    use crate::builder::{BodyId, Inertia, MechanismBuilder};
    use crate::pair::PairKind;
    use crate::pair::joint::FrameId;
    use crate::run::{Solver, integrator};
    use vi_constraints::{InitialValues, Options, SchemeKind};
    use vi_core::Quadrature;
    use vi_core::linear::norm_inf;

    const BAR: [f64; 3] = [0.1, 0.02, 0.1];

    /// A hinge about z.
    fn hinge(builder: &mut MechanismBuilder, parent: FrameId, child: BodyId, [x, y]: [f64; 2]) {
        let hinge = builder.joint("hinge", PairKind::Revolute, parent, child);
        hinge.at([x, y, 0.0]).axis([0.0, 0.0, 1.0]);
    }

    /// Four-bar windows side by side: all loops are one cluster on the ground. A bar over all of them lets the first loop
    /// meet the last.
    fn windows(count: usize, has_bar_over_all: bool) -> BuiltMechanism {
        let mut builder = MechanismBuilder::new().gravity([0.0, -9.81, 0.0]);
        let mut bar = |x: f64, y: f64, [v, w]: [f64; 2]| {
            let bar = builder.body("bar", Inertia::principal(1.0, BAR)).at([x, y, 0.0]);
            bar.velocity([v, 0.0, 0.0]).angular_velocity([0.0, 0.0, w]).id()
        };
        let cranks: Vec<BodyId> = (0..=count).map(|i| bar(i as f64, 0.5, [0.5, -1.0])).collect();
        let couplers: Vec<BodyId> =
            (0..count).map(|i| bar(i as f64 + 0.5, 1.0, [1.0, 0.0])).collect();
        let over_all = has_bar_over_all.then(|| bar(0.5 * count as f64, 1.0, [1.0, 0.0]));
        let mut hinge = |parent, child, x, y| hinge(&mut builder, parent, child, [x, y]);
        for (i, crank) in cranks.iter().enumerate() {
            hinge(FrameId::Ground, *crank, i as f64, 0.0);
        }
        for (i, coupler) in couplers.iter().enumerate() {
            hinge(cranks[i].into(), *coupler, i as f64, 1.0);
            hinge((*coupler).into(), cranks[i + 1], (i + 1) as f64, 1.0);
        }
        if let Some(over_all) = over_all {
            hinge(cranks[0].into(), over_all, 0.0, 1.0);
            hinge(over_all.into(), cranks[count], count as f64, 1.0);
        }
        builder.build().unwrap()
    }

    /// Pairs of crossing bars, joined at their middle and at their ends, on one foot: each loop moves all that follow.
    fn scissors(count: usize) -> BuiltMechanism {
        let mut builder = MechanismBuilder::new().gravity([0.0, -9.81, 0.0]);
        let mut bar =
            |x: f64| builder.body("bar", Inertia::principal(1.0, BAR)).at([x, 0.0, 0.0]).id();
        let pairs: Vec<[BodyId; 2]> =
            (0..count).map(|i| [0, 1].map(|_| bar(i as f64 + 0.5))).collect();
        let mut hinge = |parent, child, x, y| hinge(&mut builder, parent, child, [x, y]);
        hinge(FrameId::Ground, pairs[0][0], 0.0, -0.5);
        for (i, [up, down]) in pairs.iter().enumerate() {
            hinge((*up).into(), *down, i as f64 + 0.5, 0.0);
            if let Some([next_up, next_down]) = pairs.get(i + 1) {
                hinge((*up).into(), *next_down, i as f64 + 1.0, 0.5);
                hinge((*down).into(), *next_up, i as f64 + 1.0, -0.5);
            }
        }
        builder.build().unwrap()
    }

    /// An arm that turns about the vertical; on it a slider-crank, on whose rod a parallelogram hangs, and one on the ground:
    /// clusters on two links and on the ground.
    fn clusters_on_bodies() -> BuiltMechanism {
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
        let y = [0.0, 1.0, 0.0];
        let mut body =
            |name: &str, at: [f64; 3]| builder.body(name, Inertia::principal(1.0, BAR)).at(at).id();
        let [arm, crank, rod, slider] = [
            ("arm", [0.5, 0.0, 0.0]),
            ("crank", [1.1, 0.0, 0.15]),
            ("rod", [1.6, 0.0, 0.15]),
            ("slider", [2.0, 0.0, 0.0]),
        ]
        .map(|(name, at)| body(name, at));
        let mut hanging = |x: f64, z: f64| {
            [(-0.1, -0.2), (0.1, -0.2), (0.0, -0.4)]
                .map(|(dx, dz)| body("bar", [x + dx, 0.0, z + dz]))
        };
        let (on_rod, on_ground) = (hanging(1.6, 0.15), hanging(0.0, -1.0));
        let turn = PairKind::Revolute;
        let mut joint = |kind, parent: FrameId, child, at: [f64; 3], axis| {
            builder.joint("joint", kind, parent, child).at(at).axis(axis);
        };
        joint(turn, FrameId::Ground, arm, [0.0; 3], [0.0, 0.0, 1.0]);
        joint(turn, arm.into(), crank, [1.0, 0.0, 0.0], y);
        joint(turn, crank.into(), rod, [1.2, 0.0, 0.3], y);
        joint(turn, rod.into(), slider, [2.0, 0.0, 0.0], y);
        joint(PairKind::Prismatic, arm.into(), slider, [2.0, 0.0, 0.0], [1.0, 0.0, 0.0]);
        let parallelograms =
            [(FrameId::from(rod), on_rod, 1.6, 0.15), (FrameId::Ground, on_ground, 0.0, -1.0)];
        for (carrier, [left, right, below], x, z) in parallelograms {
            joint(turn, carrier, left, [x - 0.1, 0.0, z], y);
            joint(turn, carrier, right, [x + 0.1, 0.0, z], y);
            joint(turn, left.into(), below, [x - 0.1, 0.0, z - 0.4], y);
            joint(turn, right.into(), below, [x + 0.1, 0.0, z - 0.4], y);
        }
        builder.build().unwrap()
    }

    /// A free body that carries a parallelogram, and one that hangs on it by a ball joint with a slider-crank: loops on links of six and
    /// three degrees of freedom.
    fn floating_clusters() -> BuiltMechanism {
        let mut builder = MechanismBuilder::new().gravity([0.0, 0.0, -9.81]);
        let mut body = |name: &str, at: [f64; 3]| {
            let body = builder.body(name, Inertia::principal(1.0, BAR)).at(at);
            body.velocity([0.3, 0.2, 0.1]).id()
        };
        let [base, hanging] =
            [("base", [0.0; 3]), ("hanging", [0.0, 0.0, -1.0])].map(|(name, at)| body(name, at));
        let [left, right, below] =
            [[-0.1, 0.0, 0.2], [0.1, 0.0, 0.2], [0.0, 0.0, 0.4]].map(|at| body("bar", at));
        let [crank, rod, slider] =
            [[0.1, 0.0, -0.85], [0.6, 0.0, -0.85], [1.0, 0.0, -1.0]].map(|at| body("part", at));
        let (turn, y) = (PairKind::Revolute, [0.0, 1.0, 0.0]);
        let mut joint = |kind, parent: BodyId, child, at: [f64; 3], axis| {
            builder.joint("joint", kind, FrameId::from(parent), child).at(at).axis(axis);
        };
        joint(PairKind::Spherical, base, hanging, [0.0, 0.0, -0.5], y);
        joint(turn, base, left, [-0.1, 0.0, 0.0], y);
        joint(turn, base, right, [0.1, 0.0, 0.0], y);
        joint(turn, left, below, [-0.1, 0.0, 0.4], y);
        joint(turn, right, below, [0.1, 0.0, 0.4], y);
        joint(turn, hanging, crank, [0.0, 0.0, -1.0], y);
        joint(turn, crank, rod, [0.2, 0.0, -0.7], y);
        joint(turn, rod, slider, [1.0, 0.0, -1.0], y);
        joint(PairKind::Prismatic, hanging, slider, [1.0, 0.0, -1.0], [1.0, 0.0, 0.0]);
        builder.build().unwrap()
    }

    /// Three bodies in a loop of four joints of these kinds, on the ground or on a free body.
    fn loop_of(kinds: [PairKind; 4], is_free: bool) -> BuiltMechanism {
        let mut builder = MechanismBuilder::new().gravity([0.3, 0.2, -9.81]);
        let points = [[0.0, 0.0, 0.0], [0.1, 0.4, 0.7], [1.1, 0.1, 0.9], [1.0, -0.2, 0.1]];
        let axes = [[0.0, 0.8, 0.6], [0.6, 0.0, 0.8], [0.8, -0.6, 0.0], [0.36, 0.48, 0.8]];
        let mut body = |name: &str, at: [f64; 3]| {
            builder.body(name, Inertia::principal(1.0, [0.2, 0.1, 0.3])).at(at).id()
        };
        let carrier =
            if is_free { body("carrier", [0.5, 0.5, -0.2]).into() } else { FrameId::Ground };
        let [a, b, c] =
            [[0.0, 0.2, 0.4], [0.6, 0.3, 0.9], [1.1, 0.0, 0.5]].map(|at| body("link", at));
        let ends = [(carrier, a), (a.into(), b), (b.into(), c), (carrier, c)];
        for (k, (parent, child)) in ends.into_iter().enumerate() {
            builder.joint("joint", kinds[k], parent, child).at(points[k]).axis(axes[k]);
        }
        builder.build().unwrap()
    }

    /// By how much the states of some steps differ from those by dense matrices.
    fn off_dense(built: &BuiltMechanism) -> f64 {
        let (q, v) = (built.mechanism.initial_configuration(), built.mechanism.initial_velocity());
        let run = |solver| {
            let system = built.system(Quadrature::Midpoint);
            let (options, at) =
                (Options::new(SchemeKind::Nodal, 0.005), InitialValues::new(0.0, &q, &v));
            let mut run = integrator(built.mechanism.clone(), system, options, solver, at).unwrap();
            (0..20).for_each(|_| _ = run.step().unwrap());
            [&run.state().q[..], &run.state().p].concat()
        };
        let (sweeps, dense) = (run(Solver::Auto), run(Solver::Dense));
        let off: Vec<f64> = sweeps.iter().zip(&dense).map(|(a, b)| a - b).collect();
        norm_inf(&off) / norm_inf(&dense)
    }

    /// Rank and apex of the clusters that the sweeps of this file solve.
    fn clusters(built: &BuiltMechanism) -> Vec<(usize, Option<usize>)> {
        let system = built.system(Quadrature::Midpoint);
        let q = built.mechanism.initial_configuration();
        let rank = LoopRank::find(&built.mechanism, 0.0, &q);
        let step = LoopStep::new(&built.mechanism, &system, &rank).expect("it applies");
        step.sweeps.loops.clusters.iter().map(|cluster| (cluster.rank(), cluster.apex())).collect()
    }

    #[test]
    fn steps_are_those_of_dense_matrices_by_small_band_and_sparse_complements() {
        for (count, has_bar_over_all, rank) in
            [(1, false, 2), (3, false, 6), (20, false, 40), (70, false, 140), (70, true, 141)]
        {
            let built = windows(count, has_bar_over_all);
            assert_eq!(clusters(&built), [(rank, None)]);
            let off = off_dense(&built);
            println!("{count} windows: states off by {off:.1e}");
            assert!(off < 1e-11, "{count} windows: off by {off:e}");
        }
    }

    #[test]
    fn steps_are_those_of_dense_matrices_by_full_complements() {
        for (count, rank) in [(5, 8), (70, 138)] {
            let built = scissors(count);
            assert_eq!(clusters(&built), [(rank, Some(0))]);
            let off = off_dense(&built);
            println!("{count} pairs of bars: states off by {off:.1e}");
            assert!(off < 1e-11, "{count} pairs of bars: off by {off:e}");
        }
    }

    #[test]
    fn steps_are_those_of_dense_matrices_with_loops_on_bodies() {
        let built = clusters_on_bodies();
        let found = clusters(&built);
        assert_eq!(found.iter().filter(|cluster| cluster.1.is_some()).count(), 2, "{found:?}");
        let off = off_dense(&built);
        println!("states off by {off:.1e}, clusters {found:?}");
        assert!(off < 1e-11, "off by {off:e}");
    }

    #[test]
    fn steps_are_those_of_dense_matrices_with_loops_on_free_bodies() {
        let built = floating_clusters();
        let found = clusters(&built);
        assert!(found.len() == 2 && found.iter().all(|cluster| cluster.1.is_some()), "{found:?}");
        let off = off_dense(&built);
        println!("states off by {off:.1e}, clusters {found:?}");
        assert!(off < 1e-11, "off by {off:e}");
    }

    #[test]
    fn steps_are_those_of_dense_matrices_through_all_joints() {
        use PairKind::{Cylindrical, Planar, Prismatic, Revolute, Screw, Spherical, Universal};
        let screw = Screw(crate::pair::screw::Pitch::new(0.05));
        for kinds in [
            [Revolute, Universal, Spherical, Revolute],
            [Revolute, Spherical, Spherical, Revolute],
            [Spherical, Spherical, Universal, Universal],
            [Cylindrical, Universal, Spherical, Revolute],
            [Planar, Universal, Cylindrical, Revolute],
            [screw, Universal, Spherical, Prismatic],
            [Universal, screw, Spherical, Revolute],
        ] {
            for is_free in [false, true] {
                let built = loop_of(kinds, is_free);
                let found = clusters(&built);
                let off = off_dense(&built);
                println!("{kinds:?}: states off by {off:.1e}, clusters {found:?}");
                assert!(off < 1e-11, "{kinds:?}: off by {off:e}");
            }
        }
    }
}
