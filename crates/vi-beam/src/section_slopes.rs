//! How strains and section forces change with coordinates, accelerations and numbers of elements.
//!
//! ```text
//! (Γ, K, N, M)(q, q̈; θ),   with dq, dq̈ and θ grown together: x + ε dx, by dual numbers
//! F = ℓ Σ σ_i ∇ε_i,   Ḟ = ℓ Σ σ̇_i ∇ε_i + ℓ Σ σ_i ∇²ε_i ẋ,   σ̇ = C ε̇ + C_θ ε,   ε̇ = ∇ε·ẋ + ε_θ
//! R = R̄ exp(s K̂),   (exp)˙ = (T(s K) s K̇)^ exp(s K̂)
//! ```
//! The formulas of the section itself are those of [`crate::section_force`].
#![allow(non_snake_case)] // C, G, K

use crate::design::{Changed, ElementsTangent, stress};
use crate::element::{Element, StrainLaw};
use crate::helicoidal::{self, split};
use crate::model::BeamElements;
use crate::section_force::{ActingOnElement, BeamLoad, LineLoads, SectionPlace, Within, mean};
use crate::strain::{ElementCoordinates, Strain};
use nalgebra::{Matrix6, Vector3, Vector6};
use vi_core::num_dual::Dual64;
use vi_rigid::load::{LoadKind, Wrench};
use vi_rigid::rotation;

/// In which direction a section is changed.
#[derive(Clone, Copy, Debug)]
pub struct SectionChange<'a> {
    /// `dq` of all frames, shape `n`.
    pub position: &'a [f64],
    /// `dq̈`, shape `n`; empty where accelerations are not read.
    pub acceleration: &'a [f64],
    /// Numbers of elements that change.
    pub elements: Option<&'a ElementsTangent>,
    /// `dγ`, m/s².
    pub gravity: Vector3<f64>,
    /// Loads that come to the others.
    pub loads: &'a [BeamLoad],
    /// The place and the loads there, in their order, where they move.
    pub moved: Option<MovedPlace<'a>>,
}

/// A place of a section that moves, with the loads next to it.
#[derive(Clone, Copy, Debug)]
pub struct MovedPlace<'a> {
    /// The place.
    pub place: &'a SectionPlace<Dual64>,
    /// The loads.
    pub loads: &'a [BeamLoad<Dual64>],
}

/// `x + ε ẋ`.
fn with<const N: usize>(x: &[f64; N], rate: &[f64; N]) -> [Dual64; N] {
    std::array::from_fn(|i| Dual64::new(x[i], rate[i]))
}

impl SectionPlace {
    /// `(Γ, K)` and `(N, M)` there with their derivatives along a change.
    #[must_use]
    pub fn change(
        &self,
        model: &BeamElements,
        q: &[f64],
        loads: &LineLoads<'_>,
        change: &SectionChange<'_>,
    ) -> [Vector6<Dual64>; 2] {
        let zero = Vector6::from_element(Dual64::from_re(0.0));
        let (parts, off) = self.parts();
        let mut parts: Vec<_> =
            parts.map(|(element, weight)| (element, Dual64::from_re(weight))).collect();
        let mut off = off.map(Dual64::from_re);
        if let Some(moved) = &change.moved {
            let (own, s) = moved.place.parts();
            (parts, off) = (own.collect(), s);
        }
        let place = off.map(|s| (s, loads));
        parts.into_iter().fold([zero; 2], |[strains, stresses], (index, weight)| {
            let [strain, stress] = station(model, index, q, place, change);
            [strains + strain * weight, stresses + stress * weight]
        })
    }

    /// The coordinates of all frames that it depends on.
    pub fn coordinates(&self, model: &BeamElements) -> Vec<usize> {
        let of = |(index, _): (usize, f64)| model.elements.list()[index].nodes;
        let mut nodes: Vec<usize> = self.parts().0.flat_map(of).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes.into_iter().flat_map(|node| 12 * node..12 * node + 12).collect()
    }
}

fn station(
    model: &BeamElements,
    index: usize,
    q: &[f64],
    place: Option<(Dual64, &LineLoads<'_>)>,
    change: &SectionChange<'_>,
) -> [Vector6<Dual64>; 2] {
    let element = &model.elements.list()[index];
    let own = change.elements.and_then(|all| all.changed(index));
    let (x, rate) = (element.coordinates(q), element.coordinates(change.position));
    let at = element.at(x);
    let strain: Strain = at.strain();
    let mut by = at.rate(&rate);
    if let Some(own) = own {
        by += own.strain(q).map(|own| own.eps);
    }
    let strain = strain.zip_map(&by, Dual64::new);
    let given = || model.elements.stiffness(element).map(Dual64::from_re);
    let stress = stress(element, &own.map_or_else(given, |own| own.stiffness), &strain);
    let length = own.map_or(Dual64::from_re(element.length), |own| own.length);
    let StrainLaw::Helicoidal(law) = &element.law else { return [strain, stress] };
    let n = stress * length;
    let [value, slope]: [Strain; 2] = [n.map(|n| n.re), n.map(|n| n.eps)];
    let mut forces: ElementCoordinates = match own {
        None => at.force(&slope),
        Some(own) => own.force_change(&x, &n),
    };
    forces += at.tangent(&Matrix6::zeros(), &value) * rate;
    let forces = at.force(&value).zip_map(&forces, Dual64::new);
    let moving = x.zip_map(&rate, Dual64::new);
    let forms = helicoidal::forms(&moving, length);
    let given = || law.map(Dual64::from_re);
    let law = own.and_then(|own| own.law.clone()).unwrap_or_else(given);
    let (G, K) = split(&law.helix(&forms));
    let s = place.map_or(Dual64::from_re(0.0), |(s, _)| s);
    let angle = K * s;
    let [at_s, of_s]: [Vector3<f64>; 2] = [angle.map(|own| own.re), angle.map(|own| own.eps)];
    let turn = rotation::exp(&at_s);
    let spin = rotation::tangent(&at_s) * of_s;
    let node = |all: &ElementCoordinates, k: usize| -> [f64; 12] {
        std::array::from_fn(|i| all[12 * k + i])
    };
    let within = Within {
        ends: [0, 1].map(|k| with(&node(&x, k), &node(&rate, k))),
        forces,
        forms,
        helix: [G, K],
        turn: turn.zip_map(&(spin.cross_matrix() * turn), Dual64::new),
    };
    let acting = place.map(|(_, loads)| acting(model, element, own, q, loads, change));
    let (_, _, stress) = within.at(s, length, acting.as_ref());
    let compliance = match own {
        None => model.elements.section(element).compliance_matrix().map(Dual64::from_re),
        Some(own) => own.compliance,
    };
    let mut found = compliance * stress;
    if element.is_slack(&strain.map(|own| own.re)) {
        found[2] = strain[2]; // there is no force along it
    }
    [found, stress]
}

/// What acts along an element, as it changes.
fn acting(
    model: &BeamElements,
    element: &Element,
    changed: Option<&Changed>,
    q: &[f64],
    loads: &LineLoads<'_>,
    change: &SectionChange<'_>,
) -> ActingOnElement<Dual64> {
    let (frame, turned) = (mean(element, q), mean(element, change.position));
    let still = change.acceleration.is_empty();
    let mut faster = if still { [0.0; 12] } else { mean(element, change.acceleration) };
    (0..3).for_each(|i| faster[i] -= change.gravity[i]);
    let none = Wrench { force: Vector3::zeros(), torque: Vector3::zeros() };
    let both = |place: Option<Dual64>, now: Wrench, moved: Wrench| {
        let both = [(now.force, moved.force), (now.torque, moved.torque)];
        (place, both.map(|(now, moved)| now.zip_map(&moved, Dual64::new)))
    };
    let own = |(k, BeamLoad { place, load }): (usize, &BeamLoad)| {
        let place = match &change.moved {
            Some(moved) => moved.loads.get(k).and_then(|own| own.place),
            None => place.map(Dual64::from_re),
        };
        let moved = match load.kind() {
            LoadKind::Follower => load.wrench(loads.t, &turned), // linear in the directors
            LoadKind::Dead => none,
        };
        both(place, load.wrench(loads.t, &frame), moved)
    };
    let comes = |own: &BeamLoad| {
        both(own.place.map(Dual64::from_re), none, own.load.wrench(loads.t, &frame))
    };
    let section = model.elements.section(element);
    ActingOnElement {
        length: changed.map_or(Dual64::from_re(element.length), |own| own.length),
        bends: element.bends_within(),
        mass: changed.map_or_else(|| section.mass_matrix().map(Dual64::from_re), |own| own.mass),
        frame: with(&frame, &turned),
        motion: with(&loads.motion(element), &faster),
        loads: loads
            .loads
            .iter()
            .enumerate()
            .map(own)
            .chain(change.loads.iter().map(comes))
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementKind;
    use crate::elements::tests::{near_frames, random_elements, with_strains};
    use crate::model::Beam;
    use vi_rigid::load::Load;
    use vi_rigid::time_history::TimeHistory;
    use vi_testkit::Sample;

    /// Along random changes of coordinates and accelerations, against differences of order 4.
    #[test]
    fn sections_change_as_their_differences() {
        let mut sample = Sample::new(41);
        let mut worst = 0.0_f64;
        for kind in [
            ElementKind::MeanDirectors,
            ElementKind::Helicoidal,
            ElementKind::SecondOrder,
            ElementKind::Rope,
        ] {
            let (elements, _) = random_elements(&mut sample);
            let rest = near_frames(&mut sample);
            let elements = with_strains(elements, kind, &rest);
            let model = BeamElements { elements, ..BeamElements::default() };
            let beam = Beam { nodes: 0..3, elements: 0..2 };
            let q: Vec<f64> = rest.iter().map(|q| q + 0.05 * sample.number()).collect();
            let mut numbers = || (0..36).map(|_| sample.number()).collect::<Vec<f64>>();
            let [a, dq, da] = [numbers(), numbers(), numbers()];
            let load = |kind, place| {
                let (force, torque) = (Vector3::new(0.3, -0.2, 0.5), Vector3::new(0.1, 0.4, 0.2));
                let load = Load::new(0, kind, force, torque, TimeHistory::default()).unwrap();
                BeamLoad { place, load }
            };
            let loads = [load(LoadKind::Dead, Some(0.1)), load(LoadKind::Follower, None)];
            let gravity = Vector3::new(0.1, 0.2, -9.8);
            for place in [SectionPlace::of_element(&beam, 0), SectionPlace::at(&model, &beam, 0.3)]
            {
                let read = |e: f64| {
                    let moved = |x: &[f64], by: &[f64]| -> Vec<f64> {
                        x.iter().zip(by).map(|(x, by)| x + e * by).collect()
                    };
                    let (q, a) = (moved(&q, &dq), moved(&a, &da));
                    let loads = LineLoads { t: 0.0, acceleration: &a, gravity, loads: &loads };
                    place.read(&model, &q, &loads, |own| -> [f64; 12] {
                        let parts = [own.shear_extension, own.curvature, own.force, own.moment];
                        std::array::from_fn(|i| parts[i / 3][i % 3])
                    })
                };
                let acting = LineLoads { t: 0.0, acceleration: &a, gravity, loads: &loads };
                let change = SectionChange {
                    position: &dq,
                    acceleration: &da,
                    elements: None,
                    gravity: Vector3::zeros(),
                    loads: &[],
                    moved: None,
                };
                let found = place.change(&model, &q, &acting, &change);
                let e = 1e-3;
                let at = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| read(k * e));
                for i in 0..12 {
                    let own = found[i / 6][i % 6];
                    let slope = (8.0 * (at[3][i] - at[1][i]) - (at[4][i] - at[0][i])) / (12.0 * e);
                    let scale = slope.abs().max(at[2][i].abs()).max(1.0);
                    assert!((own.re - at[2][i]).abs() < 1e-13 * scale, "{kind:?} {i}: {own}");
                    worst = worst.max((own.eps - slope).abs() / scale);
                }
            }
        }
        println!("off by {worst:.1e}");
        assert!(worst < 1e-8, "{worst:e}");
    }
}
