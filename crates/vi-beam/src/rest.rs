//! Elements that are not free of stress as they are drawn.
//!
//! ```text
//! z = (Γ, K) − (Γ_0, K_0)
//! shape:      Γ_0 = Γ(drawn) ℓ/ℓ_drawn,  K_0 = K(drawn)      or  Γ_0 = e_3,  K_0 = κ
//! prestress:  C η(drawn) = σ
//! ```
//! `ℓ` is the stress-free length of an element, `ℓ_drawn` that along the drawn centre line, `κ` the
//! curvature and twist of the stress-free beam, `σ` the stress resultants as drawn.
//!
//! Source: theory §6.2.

#![allow(non_snake_case)] // C

use crate::element::Element;
use crate::elements::Elements;
use crate::small::inverse;
use crate::strain::{ElementCoordinates, Strain};
use nalgebra::{Matrix6, Vector3, Vector6};
use std::ops::Range;
use vi_core::num_dual::Dual64;

/// What elements are in the configuration in which they are drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rest<T = f64> {
    /// Drawn away from the stress-free shape.
    Shape {
        /// Length along the drawn centre line over the stress-free length.
        stretch: T,
        /// `κ` in place of the drawn one: about `d_1`, about `d_2`, twist, 1/m.
        curvature: Option<Vector3<T>>,
    },
    /// With the stress resultants `(Q_1, Q_2, N, M_1, M_2, M_3)` at their middle, N and N·m.
    Prestressed(Vector6<T>),
}

impl Rest {
    /// `(Γ_0, K_0)` of an element drawn at `x`.
    fn reference(&self, elements: &Elements, element: &Element, x: &ElementCoordinates) -> Strain {
        let drawn = element.measures(x);
        match self {
            Self::Shape { curvature: Some(curvature), .. } => {
                Strain::new(0.0, 0.0, 1.0, curvature.x, curvature.y, curvature.z)
            }
            Self::Shape { stretch, curvature: None } => {
                Strain::from_fn(|i, _| if i < 3 { drawn[i] / stretch } else { drawn[i] })
            }
            Self::Prestressed(stress) => {
                let stiffness = elements.stiffness(element).cholesky();
                let strain = stiffness.map_or(Strain::zeros(), |own| own.solve(stress));
                stressed(element, x, &drawn, &strain)
            }
        }
    }
}

impl Rest<Dual64> {
    /// The derivative of `(Γ_0, K_0)`, from its value, the strains as drawn, `C` and the strains of
    /// an element that is free of stress with some reference.
    pub(crate) fn change(
        &self,
        [reference, drawn]: [&Vector6<Dual64>; 2],
        C: &Matrix6<Dual64>,
        strain: impl Fn(&Vector6<Dual64>) -> Vector6<Dual64>,
    ) -> Vector6<Dual64> {
        match self {
            Self::Shape { curvature: Some(curvature), .. } => {
                let (o, one) = (Dual64::from_re(0.0), Dual64::from_re(1.0));
                Vector6::new(o, o, one, curvature.x, curvature.y, curvature.z)
            }
            Self::Shape { stretch, curvature: None } => {
                Vector6::from_fn(|i, _| if i < 3 { drawn[i] / stretch } else { drawn[i] })
            }
            Self::Prestressed(stress) => {
                let compliance = inverse(C, |own| Some(own.cholesky()?.inverse()));
                let wanted = compliance.map_or_else(Vector6::zeros, |own| own * stress);
                let mut own = *reference;
                for _ in 0..ITERATIONS {
                    own += strain(&own) - wanted;
                }
                own
            }
        }
    }
}

/// More than a contraction needs.
const ITERATIONS: usize = 60;

/// The reference with which an element at `x` has the strain `strain`: a contraction, since the
/// corrections of order 4 are small.
fn stressed(element: &Element, x: &ElementCoordinates, drawn: &Strain, strain: &Strain) -> Strain {
    let (mut own, mut last) = (element.clone(), f64::INFINITY);
    own.reference = drawn - strain;
    for _ in 0..ITERATIONS {
        let missed = own.strain(x) - strain;
        let size = missed.amax();
        if size == 0.0 || size >= last {
            break;
        }
        own.reference += missed;
        last = size;
    }
    own.reference
}

impl Elements {
    /// Says where some elements, drawn in the configuration `q`, are free of stress. Premise: their
    /// strains are set.
    pub fn set_rest(&mut self, elements: Range<usize>, rest: &Rest, q: &[f64]) {
        for k in elements {
            let element = &self.list()[k];
            let reference = rest.reference(self, element, &element.coordinates(q));
            self.set_reference(k, reference);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::averaged::{AveragedStrains, MASS_SCALING};
    use crate::element::ElementKind;
    use crate::elements::tests::{near_frames, random_elements, with_strains};
    use nalgebra::DMatrix;
    use vi_core::interval::Interval;
    use vi_core::potential::{DiscretePotential, Potential};
    use vi_testkit::Sample;

    /// What is stated is there: stresses as drawn, the strain of a stretch, a curvature.
    #[test]
    fn elements_are_strained_as_stated() {
        let mut sample = Sample::new(31);
        let (elements, _) = random_elements(&mut sample);
        let q = near_frames(&mut sample);
        let stress = Strain::new(0.03, -0.02, 0.08, 0.01, -0.02, 0.015);
        for kind in [ElementKind::Helicoidal, ElementKind::SecondOrder] {
            let mut own = with_strains(elements.clone(), kind, &q);
            own.set_rest(0..2, &Rest::Prestressed(stress), &q);
            for element in own.list() {
                let found = own.stress(element, &element.strain(&element.coordinates(&q)));
                let off = (found - stress).amax();
                println!("{kind:?}: stress off by {off:.1e}");
                assert!(off < 1e-14, "{off:e}");
            }
            let curvature = Some(Vector3::new(0.3, -0.2, 0.1));
            own.set_rest(0..2, &Rest::Shape { stretch: 1.0, curvature }, &q);
            for element in own.list() {
                let right = Strain::new(0.0, 0.0, 1.0, 0.3, -0.2, 0.1);
                assert_eq!(element.reference, right);
            }
            own.set_rest(0..2, &Rest::Shape { stretch: 1.25, curvature: None }, &q);
            for element in own.list() {
                let drawn = element.measures(&element.coordinates(&q));
                let off = (element.reference[2] * 1.25 - drawn[2]).abs();
                assert!(off < 1e-15 && element.reference[4] == drawn[4], "{off:e}");
            }
        }
    }

    /// Ropes of which one is taut, one slack, in a configuration next to the drawn one.
    fn slack_and_taut(sample: &mut Sample) -> (Elements, Vec<f64>) {
        let (elements, _) = random_elements(sample);
        let q = near_frames(sample);
        let mut own = with_strains(elements, ElementKind::Rope, &q);
        for (k, stretch) in [1.3, 0.7].into_iter().enumerate() {
            own.set_rest(k..k + 1, &Rest::Shape { stretch, curvature: None }, &q);
        }
        (own, q)
    }

    #[test]
    fn derivatives_of_ropes_match_central_differences() {
        let mut sample = Sample::new(32);
        let (elements, q) = slack_and_taut(&mut sample);
        let [taut, slack] = [0, 1].map(|k| {
            let element = &elements.list()[k];
            elements.stress(element, &element.strain(&element.coordinates(&q)))[2]
        });
        println!("tension {taut:.3}, {slack:.3}");
        assert!(taut > 0.1 && slack == 0.0, "{taut}, {slack}");
        let off: Vec<f64> = q.iter().map(|q| q + 0.02 * sample.number()).collect();
        let potential = AveragedStrains::mass_scaled(elements.clone(), MASS_SCALING, vec![0.0; 2])
            .with_tension_mass(vec![0.7, 2.0]);
        let at = |q0: &[f64], q1: &[f64]| {
            let mut s = Interval::new(36);
            s.open(0.0, 0.1, q0);
            s.q1.copy_from_slice(q1);
            s.close_from_end();
            s
        };
        let moved = |q: &[f64], j: usize, by: f64| {
            let mut q = q.to_vec();
            q[j] += by;
            q
        };
        let gradient = |q: &[f64]| {
            let mut out = vec![0.0; 36];
            elements.add_gradient(q, 1.0, &mut out);
            out
        };
        let slot = |q0: &[f64], q1: &[f64]| {
            let mut out = vec![0.0; 36];
            potential.add_d1(&at(q0, q1), 1.0, &mut out);
            out
        };
        let value = |q0: &[f64], q1: &[f64]| {
            let s = at(q0, q1);
            potential.value(&s) - potential.added_kinetic_energy(&s)
        };
        let [mut hessian, mut mixed, mut same] = [(); 3].map(|()| DMatrix::zeros(36, 36));
        elements.add_hessian(&q, 1.0, &mut hessian);
        potential.add_d2_d1(&at(&q, &off), 1.0, &mut mixed);
        potential.add_d1_d1(&at(&q, &off), 1.0, &mut same);
        let (e, mut worst) = (1e-5, 0.0_f64);
        for j in 0..36 {
            let slope = |f: &dyn Fn(f64) -> f64| (f(e) - f(-e)) / (2.0 * e);
            let of = |f: &dyn Fn(f64) -> Vec<f64>| -> Vec<f64> {
                f(e).iter().zip(f(-e)).map(|(a, b)| (a - b) / (2.0 * e)).collect()
            };
            let energy = slope(&|by| elements.value(&moved(&q, j, by)));
            worst = worst.max((energy - gradient(&q)[j]).abs());
            let energy = slope(&|by| value(&moved(&q, j, by), &off));
            worst = worst.max((energy - slot(&q, &off)[j]).abs());
            let columns = [
                (of(&|by| gradient(&moved(&q, j, by))), &hessian),
                (of(&|by| slot(&q, &moved(&off, j, by))), &mixed),
                (of(&|by| slot(&moved(&q, j, by), &off)), &same),
            ];
            for (column, matrix) in columns {
                for i in 0..36 {
                    worst = worst.max((column[i] - matrix[(i, j)]).abs());
                }
            }
        }
        println!("derivatives off by {worst:.1e}");
        assert!(worst < 1e-7, "{worst:e}");
    }

    /// A rope whose nodes are closer than its length has no force along it.
    #[test]
    fn a_rope_does_not_push() {
        let mut sample = Sample::new(33);
        let (elements, q) = slack_and_taut(&mut sample);
        let slack = &elements.list()[1];
        let mut x = slack.coordinates(&q);
        for k in 12..15 {
            x[k] = x[k - 12] + 0.6 * (x[k] - x[k - 12]);
        }
        let strain = slack.strain(&x);
        assert!(strain[2] < 0.0 && elements.stress(slack, &strain)[2] == 0.0, "{strain}");
        for k in 12..15 {
            x[k] = x[k - 12] + 3.0 * (x[k] - x[k - 12]);
        }
        let strain = slack.strain(&x);
        assert!(strain[2] > 0.0 && elements.stress(slack, &strain)[2] > 0.0, "{strain}");
    }
}
