//! What elements change by, against differences of elements with other numbers.

use super::*;
use crate::damping::StrainDamping;
use crate::elements::Elements;
use crate::elements::tests::near_frames;
use crate::frequency::slowness;
use nalgebra::{DVector, Vector3};
use vi_core::Number;
use vi_core::force::DiscreteForce;
use vi_core::potential::DiscretePotential;
use vi_multibody::design::StepTangent;
use vi_testkit::Sample;

const N: usize = 24;
/// A step that resolves the wave of a taut rope as long as all elements, and one that does not.
const STEPS: [f64; 2] = [0.3, 9.0];
/// By how much the element becomes longer.
const LONGER: f64 = 0.3;

/// As drawn at a value of the parameter.
fn at(drawn: Drawn<'_>, by: f64) -> Vec<f64> {
    drawn.q.iter().zip(drawn.change).map(|(q, change)| q + by * change).collect()
}

/// Numbers of a section and of what it is as drawn, which a parameter changes.
struct Numbers {
    stiffness: [Matrix6<f64>; 2],
    viscosity: [Matrix6<f64>; 2],
    mass: [Matrix4<f64>; 2],
    rest: Option<Rest<Dual64>>,
}

/// What is stated of an element as it is drawn.
#[derive(Clone, Copy, Debug)]
enum Stated {
    Free,
    Prestress,
    Stretch,
    Curvature,
}

impl Numbers {
    fn new(sample: &mut Sample, stated: Stated) -> Self {
        let mut definite = |size: f64| {
            let half = Matrix6::from_fn(|_, _| sample.number());
            size * (half * half.transpose() + Matrix6::identity())
        };
        let (stiffness, viscosity) = ([3.0, 1.0].map(&mut definite), [0.2, 0.1].map(&mut definite));
        let diagonal = |of: [f64; 4]| Matrix4::from_diagonal(&of.into());
        let mass = [diagonal([1.3, 0.2, 0.4, 0.1]), diagonal([0.3, 0.1, -0.05, 0.02])];
        let stress = Strain::new(0.3, -0.2, 2.0, 0.1, -0.2, 0.15);
        let by = Strain::new(0.1, 0.2, 0.7, -0.3, 0.2, 0.1);
        let rest = match stated {
            Stated::Free => None,
            Stated::Prestress => Some(Rest::Prestressed(stress.zip_map(&by, Dual64::new))),
            Stated::Stretch => {
                Some(Rest::Shape { stretch: Dual64::new(0.97, 0.2), curvature: None })
            }
            Stated::Curvature => {
                let curvature = Vector3::new(0.3, -0.2, 0.1).map(|own| Dual64::new(own, 0.5));
                Some(Rest::Shape { stretch: 1.0.into(), curvature: Some(curvature) })
            }
        };
        Self { stiffness, viscosity, mass, rest }
    }

    /// Where it is drawn, at a value of the parameter.
    fn rest(&self, by: f64) -> Option<Rest> {
        let at = |own: Dual64| own.re + by * own.eps;
        Some(match self.rest? {
            Rest::Prestressed(own) => Rest::Prestressed(own.map(at)),
            Rest::Shape { stretch, curvature } => {
                Rest::Shape { stretch: at(stretch), curvature: curvature.map(|own| own.map(at)) }
            }
        })
    }

    fn section<T: Number>(&self, of: impl Fn(f64, f64) -> T) -> Section<T> {
        let [C, V] = [&self.stiffness, &self.viscosity].map(|[a, b]| a.zip_map(b, &of));
        let section = Section::general(C, self.mass[0].zip_map(&self.mass[1], &of)).unwrap();
        section.with_viscosity(V).unwrap()
    }

    fn model(&self, kind: ElementKind, drawn: Drawn<'_>, by: f64) -> BeamElements {
        let mut elements = Elements::new();
        let section = elements.add_section(self.section(|value, slope| value + by * slope));
        let drawn = &at(drawn, by)[..];
        elements.add_stress_free([0, 1], 0.8 + by * LONGER, section, drawn).unwrap();
        elements.set_strains(0..1, kind, drawn).unwrap();
        if let Some(rest) = self.rest(by) {
            elements.set_rest(0..1, &rest, drawn);
        }
        BeamElements { elements, ..BeamElements::default() }
    }
}

/// The equations of a step without masses, the internal variables at its end and at its start.
fn equations(model: &BeamElements, rule: StrainRule, drawn: &[f64], s: &Interval) -> DVector<f64> {
    let averaged = model.averaged(rule, drawn);
    let damping = StrainDamping::new(&model.elements).unwrap();
    let damping = match rule {
        StrainRule::MassScaled | StrainRule::Dissipative => {
            damping.with_slowness(slowness(model, drawn))
        }
        _ => damping,
    };
    let dissipation = (rule == StrainRule::Dissipative).then(|| StrainDissipation::new(model));
    let (mut minus, mut plus) = (vec![0.0; N], vec![0.0; N]);
    averaged.add_d1(s, -s.h, &mut minus);
    averaged.add_d2(s, -s.h, &mut plus);
    damping.add_minus(s, &mut minus);
    damping.add_plus(s, &mut plus);
    let mut end = s.internal.clone();
    let (of_force, of_potential) = end.split_at_mut(s.internal.len() - averaged.variable_count());
    if let Some(dissipation) = dissipation {
        dissipation.add_minus(s, &mut minus);
        dissipation.add_plus(s, &mut plus);
        dissipation.advance(s, of_force);
    }
    averaged.advance(s, of_potential);
    let mut start = vec![0.0; s.internal.len()];
    averaged.begin(&s.q0, &mut start[s.internal.len() - averaged.variable_count()..]);
    DVector::from_vec([minus, plus, end, start].concat())
}

fn check(kind: ElementKind, rule: StrainRule, stated: Stated, h: f64) {
    let mut sample = Sample::new(61);
    let numbers = Numbers::new(&mut sample, stated);
    let drawn = near_frames(&mut sample)[..N].to_vec();
    let moves: Vec<f64> = (0..N).map(|_| 0.1 * sample.number()).collect();
    let mut near = || -> Vec<f64> { drawn.iter().map(|q| q + 0.05 * sample.number()).collect() };
    let mut s = Interval::between(0.0, h, &near(), &near());
    let by = Drawn { q: &drawn, change: &moves };
    let model = numbers.model(kind, by, 0.0);
    let averaged = model.averaged(rule, &drawn);
    let of_force = if rule == StrainRule::Dissipative { 18 } else { 0 };
    s.internal = (0..of_force).map(|_| 0.3 * sample.number()).collect();
    if averaged.variable_count() > 0 {
        s.internal.extend([0.7, 9.0, 8.0, 0.0]); // the tension of the step raises the bound
    }
    let section = numbers.section(Dual64::new);
    let change = ElementChange {
        element: 0,
        sections: vec![SectionPoint { place: 0.0.into(), weight: 1.0.into(), section }],
        rest: numbers.rest,
        bound: 0.0,
        length: LONGER,
    };
    let step = StepRule { strains: rule, quadrature: Quadrature::Midpoint, longest: h };
    let found = ElementsTangent::new(&model, step, by, &[change]).unwrap();
    let (mut minus, mut plus) = (vec![0.0; N], vec![0.0; N]);
    found.add(&s, Slot::First, &mut minus);
    found.add(&s, Slot::Second, &mut plus);
    let (mut end, mut start) = (vec![0.0; s.internal.len()], vec![0.0; s.internal.len()]);
    found.add_internal(&s, &mut end);
    found.add_begin(&s.q0, &mut start);
    let exact = DVector::from_vec([minus, plus, end, start].concat());
    let of = |e: f64| equations(&numbers.model(kind, by, e), rule, &at(by, e), &s);
    let central = |e: f64| (of(e) - of(-e)) / (2.0 * e);
    let wanted = (central(1e-4) * 4.0 - central(2e-4)) / 3.0;
    let off = (&exact - &wanted).amax() / wanted.amax();
    println!("{kind:?}, {rule:?}, {stated:?}, {h} s: off by {off:.1e} of {:.1e}", wanted.amax());
    assert!(off < 1e-9, "{kind:?}, {rule:?}: {off:e}");
    let of = |e: f64| [e, -e].map(|e| numbers.model(kind, by, e).elements.mass(0));
    let central = |e: f64| (of(e)[0] - of(e)[1]) / (2.0 * e);
    let M = (central(1e-3) * 4.0 - central(2e-3)) / 3.0;
    assert!((found.masses()[&0] - M).amax() < 1e-12);
}

#[test]
fn elements_change_as_those_with_other_numbers() {
    let kinds = [ElementKind::Helicoidal, ElementKind::SecondOrder, ElementKind::Rope];
    for kind in kinds.into_iter().chain([ElementKind::MeanDirectors]) {
        for rule in [StrainRule::MassScaled, StrainRule::Dissipative, StrainRule::Averaged] {
            for stated in [Stated::Free, Stated::Prestress, Stated::Stretch, Stated::Curvature] {
                STEPS.into_iter().for_each(|h| check(kind, rule, stated, h));
            }
        }
    }
}
