//! Generic rank of closed loops, and singular initial configurations.
//!
//! The rank of the loop constraints' Jacobian `J` is that of almost all configurations of a branch.
//! An initial configuration may sit where it is lower (a flat four-bar), so it is compared with
//! closed configurations nearby:
//! ```text
//! q* :  F_d(u, q_0) with a small random u, then    u ← −J⁺ g_c     until g = 0 (least-norm Newton)
//! rank = max over q_0 and a few q*
//! ```
//! Some of them a short time later, after prescribed motions; those next to the initial
//! configuration along its velocity belong to the times `t ± ε`.
//! In a singular configuration the null space of `J` has extra columns, and which of them belong to
//! the motion is not a matter of position. With a velocity along a branch it is the limit of the
//! generic null space on that branch, taken from both sides:
//! ```text
//! q_± = closed configurations next to F_d(±ε ν, q_0),     Z_0 = wide wideᵀ (Z_+ + Z_- Z_-ᵀ Z_+), orthonormalized
//! ```
//! Where no closed configuration is found nearby the rank of the motion is unknown, and the start
//! is refused: constraints that depend on others might not follow from them.
//! At rest, or with a velocity that no branch has, the motion is not determined: refused.

use super::nearly::{self, Nearly};
use super::random::RandomNumbers;
use crate::mechanism::{Mechanism, NearlyRedundant};
use crate::pair::{Twist, TwistTransfer, VelocityMap};
use crate::solver::closed_loop::cluster::Cluster;
use crate::solver::closed_loop::loops::Loops;
use nalgebra::{DMatrix, DVector, Vector3};
use std::ops::Range;
use vi_constraints::Constraints;
use vi_constraints::InitialValues;
use vi_constraints::integrator::{SetupError, SingularStart};
use vi_constraints::nearby::{Nearby, followers};
use vi_constraints::null_space::NullSpaceQr;
use vi_constraints::saddle_point::IndependentRows;
use vi_core::Configuration;
use vi_rigid::directors;

/// Size of each random motion, rad and longest lever arms, and the time in which prescribed motions
/// move on, s. The last two are for loops that no other trial could close.
const TRIALS: [(f64, f64); 5] = [(1e-3, 1e-3), (1e-3, 0.0), (1e-3, 1e-3), (1e-5, 0.0), (1e-7, 0.0)];
/// Size of the motion along the velocity.
const ALONG: f64 = 1e-6;
/// Relative difference up to which a velocity belongs to a branch.
const OFF_BRANCH: f64 = 1e-3;

/// What is known of the loops initially.
#[derive(Clone, Debug)]
pub struct LoopRank {
    /// Rank of `J` initially.
    pub at_start: usize,
    /// The largest rank met: that of the motion.
    pub generic: usize,
    /// Independent rows where the largest rank was met, for each cluster of loops, as numbered
    /// there.
    pivots: Vec<Vec<usize>>,
    /// The same among the rows of `g_c`.
    rows: Vec<usize>,
    /// The same initially.
    rows_at_start: Vec<usize>,
    /// A cut joint whose own rank is lower initially.
    joint: String,
    /// Whether a closed configuration was found next to the initial one, where its rank could be
    /// larger.
    compared: bool,
    /// Constraints that nearly follow from the others.
    nearly: Option<NearlyRedundant>,
}

/// How the motion leaves a singular initial configuration.
#[derive(Clone, Debug)]
pub struct Departure {
    /// `Z_0`: the null space of the branch, `d_tree × (d_tree − generic)`.
    pub null_space: DMatrix<f64>,
    /// Joint rates `ν` of the tree.
    pub rates: Vec<f64>,
}

impl LoopRank {
    /// Looks initially `q` and at closed configurations near it.
    #[must_use]
    pub fn find(mechanism: &Mechanism, t: f64, q: &[f64]) -> Self {
        let mut loops = Loops::new(mechanism);
        let d = loops.dof();
        // an overconstrained loop that is not closed has rows in excess
        let q0 = loops.close(mechanism, t, q, &vec![0.0; d]).unwrap_or_else(|| q.to_vec());
        let mut ranks = loops.ranks(&q0);
        let at_start = ranks.iter().sum();
        let mut pivots = loops.pivots();
        let rows_at_start = loops.numbers(&pivots);
        let full: Vec<usize> = loops.clusters.iter().map(Cluster::full_rank).collect();
        let mut joint = String::new();
        let mut random = RandomNumbers::FIRST;
        let mut compared = ranks == full;
        let enough = if d > 300 { 1 } else { TRIALS.len() - 2 };
        for (trial, (motion, later)) in TRIALS.into_iter().enumerate() {
            if ranks == full || trial >= enough && compared {
                break;
            }
            let t = t + later;
            let weights = loops.weights().iter();
            let u: Vec<f64> = weights.map(|s| motion * s * random.next()).collect();
            let Some(near) = loops.close(mechanism, t, &q0, &u) else { continue };
            compared = true;
            let found = loops.ranks(&near);
            let there = loops.pivots();
            for (k, more) in there.into_iter().enumerate() {
                if found[k] > ranks[k] {
                    (ranks[k], pivots[k]) = (found[k], more);
                }
            }
            if joint.is_empty() && ranks.iter().sum::<usize>() > at_start {
                joint = degenerate_joint(mechanism, &mut loops, &q0, &near);
            }
        }
        let (generic, rows) = (ranks.iter().sum(), loops.numbers(&pivots));
        let nearly = None;
        let found =
            Self { at_start, generic, pivots, rows, rows_at_start, joint, compared, nearly };
        found.taking_nearly_redundant(mechanism, t, q)
    }

    /// The same, with constraints as redundant that nearly are ([`nearly`]).
    fn taking_nearly_redundant(mut self, mechanism: &Mechanism, t: f64, q: &[f64]) -> Self {
        let Some(found) = nearly::find(mechanism, t, q, self.compared) else { return self };
        let loops = Loops::new(mechanism);
        let mut at_start = Vec::new();
        for (k, cluster) in found.clusters.into_iter().enumerate() {
            let own = |rows: &[usize]| -> Vec<usize> {
                rows.iter().map(|&i| loops.clusters[k].paths.rows[i].number).collect()
            };
            match cluster {
                Some(Nearly { rows, rows_at_start }) => {
                    at_start.extend(own(&rows_at_start));
                    self.pivots[k] = rows;
                }
                None => {
                    let numbers = own(&(0..loops.clusters[k].paths.rows.len()).collect::<Vec<_>>());
                    at_start.extend(self.rows_at_start.iter().filter(|i| numbers.contains(i)));
                }
            }
        }
        self.rows = loops.numbers(&self.pivots);
        (self.at_start, self.generic) = (at_start.len(), self.rows.len());
        (self.rows_at_start, self.compared) = (at_start, true);
        self.nearly = Some(NearlyRedundant { loop_rank: self.generic, ..found.constraints });
        self
    }

    /// The constraints that nearly follow from the others, if some do.
    #[must_use]
    pub fn nearly_redundant(&self) -> Option<&NearlyRedundant> {
        self.nearly.as_ref()
    }

    /// Refuses loops with constraints that depend on others at `at` if no closed configuration was
    /// found nearby and they do not follow from the others there: nothing says then that they are
    /// satisfied along the motion.
    ///
    /// # Errors
    /// [`SetupError::RankUnknown`].
    pub fn known(&self, mechanism: &Mechanism, at: Configuration<'_>) -> Result<(), SetupError> {
        if self.compared {
            return Ok(());
        }
        let rows = self.rows(mechanism);
        let row = match followers(mechanism, &rows, at) {
            Nearby::Follow => return Ok(()),
            Nearby::Singular { row } => Some(row),
            Nearby::Unknown => rows.redundant().next(),
        };
        let joint = row.map(|row| mechanism.constraint_name(row).to_owned());
        Err(SetupError::RankUnknown { joint })
    }

    /// The loops, with the generic rank of each cluster.
    pub(crate) fn loops(&self, mechanism: &Mechanism) -> Loops {
        let mut loops = Loops::new(mechanism);
        let clusters = loops.clusters.iter_mut().zip(&self.pivots);
        clusters.for_each(|(cluster, pivots)| cluster.set_rank(pivots));
        if let Some(nearly) = &self.nearly {
            let own = loops.clusters.iter_mut().zip(&nearly.ranks);
            own.filter(|(_, rank)| rank.is_some()).for_each(|(cluster, _)| cluster.keep_rows());
        }
        loops.keep_initial();
        loops
    }

    /// Whether the initial configuration has a lower rank than the motion.
    #[must_use]
    pub fn is_singular(&self) -> bool {
        self.at_start < self.generic
    }

    /// Independent constraints of the motion: all but those of the cut joints, and `generic` of
    /// these.
    #[must_use]
    pub fn rows(&self, mechanism: &Mechanism) -> IndependentRows {
        choose(mechanism, &self.rows)
    }

    /// Independent constraints initially.
    #[must_use]
    pub fn rows_at_start(&self, mechanism: &Mechanism) -> IndependentRows {
        choose(mechanism, &self.rows_at_start)
    }

    /// The refusal of this singular initial configuration.
    #[must_use]
    pub fn refusal(&self, reason: SingularStart) -> SetupError {
        SetupError::SingularStart { joint: self.joint.clone(), reason }
    }

    /// How the motion leaves a singular initial configuration `(t, q, v)`.
    ///
    /// # Errors
    /// [`SetupError::SingularStart`] at rest, or when the velocity belongs to no branch.
    pub fn departure(
        &self,
        mechanism: &Mechanism,
        InitialValues { t, q, v, .. }: InitialValues<'_>,
    ) -> Result<Departure, SetupError> {
        let rates = tree_rates(mechanism, q, v);
        let mut loops = Loops::new(mechanism);
        let scale = loops.weights().to_vec();
        let size = rates.iter().zip(&scale).map(|(r, s)| (r / s).abs()).fold(0.0, f64::max);
        if size <= 1e-12 {
            return Err(self.refusal(SingularStart::AtRest));
        }
        let e = ALONG / size;
        let d = rates.len();
        let mut side = |e: f64| {
            let u: Vec<f64> = rates.iter().map(|r| e * r).collect();
            let near = loops.close(mechanism, t + e, q, &u);
            let near = near.ok_or_else(|| self.refusal(SingularStart::OffBranch))?;
            if loops.ranks(&near).iter().sum::<usize>() < self.generic {
                return Err(self.refusal(SingularStart::AtRest)); // the loop itself does not move
            }
            Ok((null_space(&loops.basis()), near))
        };
        let ((ahead, q_ahead), (behind, q_behind)) = (side(e)?, side(-e)?);
        let moved: Vec<f64> =
            q_ahead.iter().zip(&q_behind).map(|(a, b)| (a - b) / (2.0 * e)).collect();
        let reached = tree_rates(mechanism, q, &moved);
        let off = |((a, b), s): ((&f64, &f64), &f64)| ((a - b) / s).abs();
        let off = reached.iter().zip(&rates).zip(&scale).map(off).fold(0.0, f64::max);
        if off > OFF_BRANCH * size {
            return Err(self.refusal(SingularStart::OffBranch));
        }
        loops.ranks(q);
        let wide = null_space(&loops.basis());
        let both = &ahead + &behind * (behind.transpose() * &ahead);
        let projected = &wide * (wide.transpose() * both);
        let null_space = if projected.is_empty() { projected } else { projected.qr().q() };
        debug_assert_eq!(null_space.shape(), (d, d - self.generic));
        Ok(Departure { null_space, rates })
    }
}

/// The rows of `g_c` among all constraints: those of the cut joints, then the scalar constraints.
fn loop_rows(mechanism: &Mechanism) -> Vec<usize> {
    groups(mechanism).into_iter().flatten().collect()
}

fn groups(mechanism: &Mechanism) -> Vec<Range<usize>> {
    let joints = mechanism.cut_joints().iter().map(|&k| mechanism.joint_rows(k));
    let scalars = (0..mechanism.description().scalars.len()).map(|k| mechanism.scalar_rows(k));
    joints.chain(scalars).collect()
}

fn choose(mechanism: &Mechanism, pivots: &[usize]) -> IndependentRows {
    let (m, loop_rows) = (mechanism.len(), loop_rows(mechanism));
    let mut enforced = vec![true; m];
    loop_rows.iter().for_each(|&row| enforced[row] = false);
    pivots.iter().for_each(|&k| enforced[loop_rows[k]] = true);
    let rows: Vec<usize> = (0..m).filter(|&row| enforced[row]).collect();
    IndependentRows::choose(m, &rows)
}

/// The first cut joint or scalar constraint whose own rows have a lower rank at `q0` than at
/// `near`.
fn degenerate_joint(mechanism: &Mechanism, loops: &mut Loops, q0: &[f64], near: &[f64]) -> String {
    let groups = groups(mechanism);
    let mut ranks = |q: &[f64]| -> Vec<usize> {
        loops.ranks(q);
        let mut first = 0;
        let rank = |group: &Range<usize>| {
            let own = first..first + group.len();
            first = own.end;
            loops.rank_of(own, q)
        };
        groups.iter().map(rank).collect()
    };
    let (at_start, nearby) = (ranks(q0), ranks(near));
    let lower = at_start.iter().zip(&nearby).position(|(a, b)| a < b);
    mechanism.constraint_name(groups[lower.unwrap_or(0)].start).to_owned()
}

/// Orthonormal basis of the null space of independent rows.
fn null_space(rows: &DMatrix<f64>) -> DMatrix<f64> {
    let (rank, d) = rows.shape();
    let mut qr = NullSpaceQr::new(d, rank);
    qr.factorize(rows);
    let mut out = DMatrix::zeros(d, d - rank);
    qr.null_space(rank, &mut out);
    out
}

/// Joint rates of the tree from the coordinates' rates `v`.
fn tree_rates(mechanism: &Mechanism, q: &[f64], v: &[f64]) -> Vec<f64> {
    let tree = mechanism.tree();
    let mut maps = vec![VelocityMap::new(TwistTransfer::None, &[]); tree.links().len()];
    tree.velocity_maps(q, &mut maps);
    let twist = |frame: usize| {
        let own = 12 * frame..12 * frame + 12;
        let spin: Vector3<f64> = (0..3)
            .map(|i| {
                let rate = directors::director(&v[own.clone()], i);
                directors::director(&q[own.clone()], i).cross(&rate)
            })
            .sum();
        Twist::new(directors::center(&v[own]), 0.5 * spin)
    };
    let mut rates = vec![0.0; tree.dof()];
    for (link, map) in tree.links().iter().zip(&maps) {
        let parent = link.parent.map_or(Twist::zero(), |p| twist(tree.links()[p].frame));
        let (own, transmitted) = (twist(link.frame), map.transfer.apply(&parent));
        let rest = Twist::new(own.linear - transmitted.linear, own.angular - transmitted.angular);
        let f = map.dof;
        if f == 0 {
            continue; // a weld has no rate
        }
        let s = map.columns();
        let gram = DMatrix::from_fn(f, f, |i, j| s[i].dot(&s[j]));
        let right = DVector::from_fn(f, |i, _| s[i].dot(&rest));
        if let Some(x) = gram.lu().solve(&right) {
            rates[link.offset..link.offset + f].copy_from_slice(x.as_slice());
        }
    }
    rates
}
