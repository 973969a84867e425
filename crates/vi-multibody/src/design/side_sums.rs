//! Derivatives by the geometry of the joints of a tree, summed over a run for all parameters at
//! once.
//!
//! ```text
//! δ = D_n δϱ,  ψ = D_n δψ       a side that shifts and turns, in the directors D of its frame
//! dJ/dϱ_i = Σ_n x_n·d_i(q_n) + y_n·d_i(q_{n+1})                                         [2.40]
//! ```
//! and the same by `δψ`; `x`, `y`: the vectors of `crate::sweep::moved_joints`. What a step costs
//! does not depend on the number of parameters.

use super::mass_sums::SumFactors;
use super::{JointTangent, MechanismTangent, SideTangent};
use crate::mechanism::Mechanism;
use crate::output::joint_wrenches::links_of_joints;
use crate::pair::joint::{FrameId, Side};
use crate::sweep::moved_joints::NUMBERS;
use nalgebra::{Matrix3, Vector3};
use std::collections::BTreeMap;
use vi_constraints::design::Costates;
use vi_core::Interval;
use vi_rigid::directors::FRAME;

/// How far changed axes may be from turned ones, of their change.
const RIGID: f64 = 1e-12;

/// A number of a side: the first one of its vector among those of all links, and a component in the
/// directors of its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct SideDatum {
    vector: usize,
    frame: Option<usize>, // None: the ground
    component: usize,
}

/// The sums that parameters need.
#[derive(Debug)]
pub(super) struct SideSums {
    data: Vec<SideDatum>,
    first: usize, // of the sums
}

/// Of which links joints are, and how.
struct JointSides<'a> {
    mechanism: &'a Mechanism,
    links: Vec<Option<usize>>,
}

impl JointSides<'_> {
    /// Visits what changes of the joints of the tree; `None` where one does not change as rigid
    /// sides do.
    fn for_each_change(
        &self,
        tangent: &MechanismTangent,
        mut visit: impl FnMut(SideDatum, f64),
    ) -> Option<()> {
        for (&k, change) in &tangent.joints {
            let Some(link) = self.links[k] else { continue };
            self.changes_of(k, link, change, &mut visit)?;
        }
        Some(())
    }

    fn changes_of(
        &self,
        k: usize,
        link: usize,
        change: &JointTangent,
        visit: &mut impl FnMut(SideDatum, f64),
    ) -> Option<()> {
        let joint = &self.mechanism.description().joints[k];
        if joint.kind.is_free() {
            return Some(()); // it has no rows
        }
        if joint.kind.pitch().is_some() {
            return None; // its thread reads an angle
        }
        let far = self.mechanism.tree().links()[link].joint.child.frame;
        for (side, change) in [(&joint.parent, &change.parent), (&joint.child, &change.child)] {
            let first = NUMBERS * link + if side.frame == far { NUMBERS / 2 } else { 0 };
            let frame = match side.frame {
                FrameId::Frame(k) => Some(k),
                FrameId::Ground => None,
            };
            for (kind, by) in [change.anchor, turn(side, change)?].into_iter().enumerate() {
                for (component, &by) in by.iter().enumerate().filter(|(_, by)| **by != 0.0) {
                    visit(SideDatum { vector: first + 3 * kind, frame, component }, by);
                }
            }
        }
        Some(())
    }
}

fn vector3(of: &[f64], first: usize) -> Vector3<f64> {
    Vector3::from_column_slice(&of[first..first + 3])
}

/// `ψ` of axes that turn, in the directors of the frame; `None` where they change otherwise.
fn turn(side: &Side, change: &SideTangent) -> Option<Vector3<f64>> {
    let rates = change.axes * side.axes.transpose(); // ψ̂
    let psi = Vector3::new(rates[(2, 1)], rates[(0, 2)], rates[(1, 0)]);
    let off: Matrix3<f64> = rates + rates.transpose();
    (off.amax() <= RIGID * rates.amax()).then_some(psi)
}

impl SideSums {
    /// Of parameters with these tangents, with their factors; `None` where the joints of one do not
    /// change as rigid sides do. Sums are numbered from `first`.
    pub(super) fn of(
        mechanism: &Mechanism,
        tangents: &[MechanismTangent],
        first: usize,
    ) -> Option<(Self, Vec<SumFactors>)> {
        let sides = JointSides { mechanism, links: links_of_joints(mechanism) };
        let mut known = BTreeMap::new();
        for tangent in tangents {
            sides.for_each_change(tangent, |datum, _| {
                known.insert(datum, 0);
            })?;
        }
        let numbered = known.values_mut().zip(first..);
        numbered.for_each(|(number, next)| *number = next);
        let mut all = Vec::with_capacity(tangents.len());
        for tangent in tangents {
            let mut factors = SumFactors::new();
            sides.for_each_change(tangent, |datum, by| factors.push((known[&datum], by)))?;
            all.push(factors);
        }
        Some((Self { data: known.into_keys().collect(), first }, all))
    }

    /// How many there are.
    pub(super) fn len(&self) -> usize {
        self.data.len()
    }

    /// Adds those of a step.
    pub(super) fn add(&self, s: &Interval, costates: Costates<'_>, sums: &mut [f64]) {
        let [start, end] = costates.moved;
        let own = sums[self.first..].iter_mut().zip(&self.data);
        for (sum, &SideDatum { vector, frame, component }) in own {
            let [x, y] = [start, end].map(|of| vector3(of, vector));
            *sum += match frame {
                None => x[component] + y[component],
                Some(k) => {
                    let at = FRAME * k + 3 * (component + 1);
                    x.dot(&vector3(&s.q0, at)) + y.dot(&vector3(&s.q1, at))
                }
            };
        }
    }
}
