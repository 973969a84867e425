//! Strains, section forces and the centre line along a beam.
//!
//! ```text
//! (N_1, N_2, N_3) = (GA_1Γ_1, GA_2Γ_2, EAΓ_3)       shear forces, normal force
//! (M_1, M_2, M_3) = (EI_1K_1, EI_2K_2, GJK_3)       bending moments, twisting moment
//! n = N_I d̄_I,   m = M_I d̄_I                        spatial
//! ```
//! One value for each element, at its middle, where it is of second order. Those of a helicoidal
//! element are in equilibrium with the forces `F` and torques `T` that it exchanges with its nodes
//! `a` and `b` and with what acts along it ([`LineLoads`]), `s` from its middle, all spatial:
//! ```text
//! n' = −f              n(s) = F_b − s f,                               F_b = −F_a
//! m' = −φ'×n − c       m(s) = ½ (T_b − T_a) − (φ − φ̄)×F_b + ½ (s² − ℓ²/12) φ'×f − s c
//! ```
//! and a force `P` and a torque `Q` at `ξ ℓ` from the middle add
//! ```text
//! n += w P             w = ½ − ξ, and 1 less beyond the place
//! m += w Q + (b − (½ − ξ)(s + ½ℓ) + (s − ξℓ)_+) φ'×P,                  b = ½ (¼ − ξ²) ℓ
//! ```
//! Strains are those of the section under them. At a clamp they are its reaction; exact for a
//! straight beam under a constant load. Loads that are lumped at the nodes have `ℓ²/4` in place of
//! `ℓ²/12` and no `b`. The centre line of an element is its chord; for pictures, [`center_line`]
//! draws a cubic through the nodes with the mean slope of both neighbours.

#![allow(non_snake_case)] // R, G, K, M

use crate::element::{Element, ElementKind, StrainLaw};
use crate::helicoidal::{FORMS, Helicoidal, forms, join, split};
use crate::model::{Beam, BeamElements};
pub use crate::section_state::SectionState;
use crate::section_state::StationState;
use crate::small::{re, times};
use crate::strain::SIZE;
use nalgebra::{Matrix3, Matrix4, SVector, Vector3, Vector6};
use vi_core::Number;
use vi_core::num_dual::Dual64;
use vi_rigid::directors::{self, center};
use vi_rigid::load::{Load, Wrench};
use vi_rigid::rotation;

/// The states along a beam in the configuration `q`.
#[must_use]
pub fn section_states(model: &BeamElements, beam: &Beam, q: &[f64]) -> Vec<SectionState> {
    let mut states = Vec::with_capacity(beam.elements.len());
    for_each_state(model, beam, q, |state| states.push(state));
    states
}

/// The same, one after the other.
pub fn for_each_state(
    model: &BeamElements,
    beam: &Beam,
    q: &[f64],
    mut visit: impl FnMut(SectionState),
) {
    let mut start = 0.0;
    for (k, index) in beam.elements.clone().enumerate() {
        visit(station(model, index, q, None).state(k, start));
        start += model.elements.list()[index].length;
    }
}

/// What acts along a beam: weight, inertia, loads.
///
/// ```text
/// f = −Σ_j m_0j u_j + …,   c = −Σ_i d̄_i × Σ_j m_ij u_j + …,   u = (φ̈ − γ, d̈_1, d̈_2, d̈_3)
/// ```
/// with the mass `m` of the section per length; dots are the loads.
#[derive(Clone, Copy, Debug)]
pub struct LineLoads<'a> {
    /// Time of the histories, s.
    pub t: f64,
    /// `q̈` of all frames; empty at rest.
    pub acceleration: &'a [f64],
    /// `γ`, m/s².
    pub gravity: Vector3<f64>,
    /// Loads; their frames are not read.
    pub loads: &'a [BeamLoad],
}

/// A load of an element that is read.
#[derive(Clone, Debug, PartialEq)]
pub struct BeamLoad<T = f64> {
    /// Where it acts, from the middle of the element, m; `None`: along all of it, by its length.
    pub place: Option<T>,
    /// N and N·m, or N/m and N·m/m.
    pub load: Load,
}

/// The mean of both nodes of an element among numbers of all frames.
pub(crate) fn mean(element: &Element, all: &[f64]) -> [f64; 12] {
    let [a, b] = element.starts();
    std::array::from_fn(|i| 0.5 * (all[a + i] + all[b + i]))
}

impl LineLoads<'_> {
    /// `u` of an element.
    pub(crate) fn motion(&self, element: &Element) -> [f64; 12] {
        let still = self.acceleration.is_empty();
        let mut u = if still { [0.0; 12] } else { mean(element, self.acceleration) };
        (0..3).for_each(|i| u[i] -= self.gravity[i]);
        u
    }
}

/// What acts along an element, at its frame.
pub(crate) struct ActingOnElement<T: Number> {
    /// `ℓ`, m.
    pub(crate) length: T,
    /// Whether `φ` is interpolated with `d_3`.
    pub(crate) bends: bool,
    /// `m` of the section.
    pub(crate) mass: Matrix4<T>,
    /// `(φ, d_1, d_2, d_3)` half-way between the nodes.
    pub(crate) frame: [T; 12],
    /// `u`.
    pub(crate) motion: [T; 12],
    /// Loads: place, force, torque, spatial.
    pub(crate) loads: Vec<(Option<T>, [Vector3<T>; 2])>,
}

/// Vector `i` of four.
fn vector<T: Number>(all: &[T; 12], i: usize) -> Vector3<T> {
    Vector3::new(all[3 * i], all[3 * i + 1], all[3 * i + 2])
}

impl<T: Number> ActingOnElement<T> {
    /// What it adds to `n` and `m`, spatial, at the distance `s` from the middle of an element
    /// with the slope `φ'`, m.
    fn at(&self, s: T, slope: &Vector3<T>) -> [Vector3<T>; 2] {
        let (length, bends) = (self.length, self.bends);
        let inertia = |i: usize| -> Vector3<T> {
            let part = |j: usize| vector(&self.motion, j) * self.mass[(i, j)];
            (0..4).map(part).fold(Vector3::zeros(), |sum, own| sum + own)
        };
        let spin = |i: usize| vector(&self.frame, i + 1).cross(&inertia(i + 1));
        let spins = (0..3).map(spin).fold(Vector3::zeros(), |sum, own| sum + own);
        let (mut f, mut c) = (-inertia(0), -spins);
        let (mut n, mut m) = (Vector3::zeros(), Vector3::zeros());
        let [zero, one, half, quarter] = [0.0, 1.0, 0.5, 0.25].map(T::of);
        for (place, [force, torque]) in &self.loads {
            let Some(place) = place else {
                (f, c) = (f + force, c + torque);
                continue;
            };
            let (xi, beyond) = (*place / length, re(s) > re(*place));
            let bend = if bends { half * (quarter - xi * xi) * length } else { zero };
            let weight = half - xi - if beyond { one } else { zero };
            let past = if beyond { s - *place } else { zero };
            let lever = bend - (half - xi) * (s + half * length) + past;
            n += force * weight;
            m += torque * weight + slope.cross(force) * lever;
        }
        let held = if bends { 1.0 / 12.0 } else { 0.25 };
        n -= f * s;
        let bent = half * (s * s - T::of(held) * length * length);
        m += slope.cross(&f) * bent - c * s;
        [n, m]
    }
}

/// A helicoidal element in equilibrium.
pub(crate) struct Within<T: Number> {
    /// `φ, d_I` of both nodes.
    pub(crate) ends: [[T; 12]; 2],
    /// `ℓ Σ σ_i ∇ε_i`.
    pub(crate) forces: SVector<T, SIZE>,
    /// `y`, of the triad half-way between the nodes.
    pub(crate) forms: SVector<T, FORMS>,
    /// `(G, K)`.
    pub(crate) helix: [Vector3<T>; 2],
    /// `exp(s K̂)`.
    pub(crate) turn: Matrix3<T>,
}

impl<T: Number> Within<T> {
    /// `φ − φ̄`, the triad, `N` and `M` at the distance `s` from the middle.
    pub(crate) fn at(
        &self,
        s: T,
        length: T,
        acting: Option<&ActingOnElement<T>>,
    ) -> (Vector3<T>, Matrix3<T>, Vector6<T>) {
        let Self { ends, forces, forms, helix: [G, K], turn } = self;
        let part = |k: usize| -> Vector3<T> { forces.fixed_rows::<3>(k).into() };
        let torque = |node: usize| -> Vector3<T> {
            let own = |i: usize| vector(&ends[node], i + 1).cross(&part(12 * node + 3 + 3 * i));
            (0..3).map(own).fold(Vector3::zeros(), |sum, own| sum + own)
        };
        let triad = |end: &[T; 12]| Matrix3::from_columns(&[1, 2, 3].map(|i| vector(end, i)));
        let mean = times(0.5, &(triad(&ends[0]) + triad(&ends[1])));
        let middle = Helicoidal::middle(&mean, forms);
        let R = middle * turn;
        let slope = (vector(&ends[1], 0) - vector(&ends[0], 0)) / length;
        let bent = middle * K.cross(G);
        let arc = slope * s + bent * (T::of(0.5) * (s * s - T::of(0.25) * length * length));
        let [f, c] = acting.map_or_else(|| [Vector3::zeros(); 2], |own| own.at(s, &slope));
        let n = part(12) + f;
        let m = times(0.5, &(torque(1) - torque(0))) - arc.cross(&part(12)) + c;
        (arc, R, join(&R.tr_mul(&n), &R.tr_mul(&m)))
    }
}

/// The section of an element at its middle; of a helicoidal one also at a distance from it,
/// m, under what acts along it.
fn station(
    model: &BeamElements,
    index: usize,
    q: &[f64],
    place: Option<(f64, &LineLoads<'_>)>,
) -> StationState {
    let element = &model.elements.list()[index];
    let x = element.coordinates(q);
    let at = element.at(x);
    let strain = at.strain();
    let stress = model.elements.stress(element, &strain);
    let ends = element.nodes.map(|node| &q[12 * node..12 * node + 12]);
    let point = 0.5 * (center(ends[0]) + center(ends[1]));
    let length = element.length;
    let StrainLaw::Helicoidal(_) = &element.law else {
        let mean = 0.5 * (directors::triad(ends[0]) + directors::triad(ends[1]));
        let (along, directors) = (0.5 * length, std::array::from_fn(|i| mean.column(i).into()));
        return StationState { along, length, point, directors, strain, stress };
    };
    let s = place.map_or(0.0, |(s, _)| s);
    let (G, K) = split(&element.measures(&x));
    let own = Within {
        ends: ends.map(|end| std::array::from_fn(|i| end[i])),
        forces: at.force(&(length * stress)),
        forms: forms(&x, length),
        helix: [G, K],
        turn: rotation::exp(&(s * K)),
    };
    let acting = place.map(|(_, loads)| {
        let frame = mean(element, q);
        let load = |BeamLoad { place, load }: &BeamLoad| {
            let Wrench { force, torque } = load.wrench(loads.t, &frame);
            (*place, [force, torque])
        };
        ActingOnElement {
            length,
            bends: element.bends_within(),
            mass: model.elements.section(element).mass_matrix(),
            motion: loads.motion(element),
            loads: loads.loads.iter().map(load).collect(),
            frame,
        }
    });
    let (arc, R, stress) = own.at(s, length, acting.as_ref());
    let mut own = model.elements.section(element).compliance_matrix() * stress;
    if element.is_slack(&strain) {
        own[2] = strain[2]; // there is no force along it
    }
    let strain = own;
    let directors = std::array::from_fn(|i| R.column(i).into());
    StationState { along: 0.5 * length + s, length, point: point + arc, directors, strain, stress }
}

/// A place within a helicoidal element.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Off<T = f64> {
    middle: T, // of the element, from the start of the beam, m
    s: T,      // of the place, from the middle, m
    length: T, // of the element, m
}

/// A place of a beam where strains and section forces are read: weights of the sections next to it.
#[derive(Clone, Debug, PartialEq)]
pub struct SectionPlace<T = f64> {
    part: Beam,
    weights: Vec<T>, // of the sections of the part
    off: Option<Off<T>>,
}

impl SectionPlace {
    /// At the reference arc length `along` from the start of the beam, m. Within a helicoidal
    /// element by what acts along it; between elements of mean directors linear through their
    /// middles, where a load on a node smears over its two elements. Of order 2 in the length of
    /// elements where section forces are smooth.
    ///
    /// # Panics
    /// When the beam has no elements.
    #[must_use]
    pub fn at(model: &BeamElements, beam: &Beam, along: f64) -> Self {
        Self::at_with(model, beam, along, |element| model.elements.list()[element].length)
    }

    /// Whether what acts along the beam enters.
    #[must_use]
    pub fn is_within_element(&self) -> bool {
        self.off.is_some()
    }
}

impl<T: Number> SectionPlace<T> {
    /// The middle of an element, counted along the beam from 0.
    #[must_use]
    pub fn of_element(beam: &Beam, element: usize) -> Self {
        let weights = vec![T::of(1.0)];
        Self { part: part(beam, element..element + 1), weights, off: None }
    }

    /// As [`SectionPlace::at`], with the lengths of all elements, m.
    ///
    /// # Panics
    /// When the beam has no elements.
    #[must_use]
    pub fn at_with(
        model: &BeamElements,
        beam: &Beam,
        along: T,
        length: impl Fn(usize) -> T,
    ) -> Self {
        let own = model.of(beam);
        let (element, _) = model.first_element(beam, |end| re(along) <= end);
        let length = |k: usize| length(beam.elements.start + k);
        let start_of = |k: usize| (0..k).map(length).fold(T::of(0.0), |sum, own| sum + own);
        let half = T::of(0.5);
        let start = start_of(element);
        let middle = start + half * length(element);
        if own[element].law.kind() != ElementKind::MeanDirectors {
            let off = Some(Off { middle, s: along - middle, length: length(element) });
            return Self { off, ..Self::of_element(beam, element) };
        }
        let first = if re(along) >= re(middle) { element } else { element.saturating_sub(1) };
        let first = first.min(own.len().saturating_sub(2));
        if first + 1 >= own.len() {
            return Self::of_element(beam, first);
        }
        let start = if first < element { start - length(first) } else { start };
        let between = half * (length(first) + length(first + 1));
        let second = (along - start - half * length(first)) / between;
        let weights = vec![T::of(1.0) - second, second];
        Self { part: part(beam, first..first + 2), weights, off: None }
    }

    /// A load at the arc length `along` from the start of the beam, m, or along all of it; `None`
    /// where it does not enter.
    #[must_use]
    pub fn load(&self, along: Option<T>, load: Load) -> Option<BeamLoad<T>> {
        let Off { middle, length, .. } = self.off?;
        let place = along.map(|along| along - middle);
        let inside = place.is_none_or(|place| re(place).abs() <= 0.5 * re(length));
        inside.then_some(BeamLoad { place, load })
    }

    /// The elements that count, with their weights, and the distance from the middle of the one
    /// element within which it is.
    pub(crate) fn parts(&self) -> (impl Iterator<Item = (usize, T)>, Option<T>) {
        let weights = self.weights.iter().copied();
        (self.part.elements.clone().zip(weights), self.off.as_ref().map(|off| off.s))
    }
}

impl SectionPlace<Dual64> {
    /// Whether it, or a load, moves past what its quantities have a jump or a kink at: a node, the
    /// place of a load, the middle of an element of mean directors.
    #[must_use]
    pub fn passes(&self, loads: &[BeamLoad<Dual64>]) -> bool {
        let Some(Off { s, length, .. }) = self.off else {
            let own = self.weights.iter();
            return own.into_iter().any(|own| own.re.abs() < AT_NODE && own.eps.abs() > AT_NODE);
        };
        let apart = |a: Dual64, b: Dual64| {
            let by = (a - b) / length;
            by.re.abs() < AT_NODE && by.eps.abs() > AT_NODE
        };
        let half = length * 0.5;
        let at_load = |own: &BeamLoad<Dual64>| {
            own.place.is_some_and(|at| [s, half, -half].iter().any(|own| apart(at, *own)))
        };
        apart(s, half) || apart(s, -half) || loads.iter().any(at_load)
    }
}

/// How near a place counts as at it, in parts of an element.
const AT_NODE: f64 = 1e-9;

impl SectionPlace {
    /// A quantity of a section there, in the configuration `q`.
    #[must_use]
    pub fn read<const N: usize>(
        &self,
        model: &BeamElements,
        q: &[f64],
        loads: &LineLoads<'_>,
        quantity: impl Fn(&SectionState) -> [f64; N],
    ) -> [f64; N] {
        if let Some(Off { s, .. }) = self.off {
            let own = station(model, self.part.elements.start, q, Some((s, loads)));
            return quantity(&own.state(0, 0.0));
        }
        let (mut sum, mut weights) = ([0.0; N], self.weights.iter());
        for_each_state(model, &self.part, q, |state| {
            let weight = weights.next().copied().unwrap_or_default();
            sum.iter_mut().zip(quantity(&state)).for_each(|(sum, value)| *sum += weight * value);
        });
        sum
    }
}

/// Some elements of a beam, counted from 0.
fn part(beam: &Beam, elements: std::ops::Range<usize>) -> Beam {
    let from = |first: usize| first + elements.start..first + elements.end;
    let nodes = from(beam.nodes.start);
    Beam { nodes: nodes.start..nodes.end + 1, elements: from(beam.elements.start) }
}

/// Points of the interpolated centre line, `per_interval` between two nodes and the last node.
#[must_use]
pub fn center_line(
    model: &BeamElements,
    beam: &Beam,
    q: &[f64],
    per_interval: usize,
) -> Vec<Vector3<f64>> {
    let lengths: Vec<f64> = model.of(beam).iter().map(|element| element.length).collect();
    let nodes: Vec<_> = beam.nodes.clone().map(|k| center(&q[12 * k..12 * k + 12])).collect();
    cubic_line(&nodes, &lengths, per_interval)
}

/// Points of a cubic through `nodes` that are `lengths` apart, `per_interval` in each interval and
/// the last node.
#[must_use]
pub fn cubic_line(
    nodes: &[Vector3<f64>],
    lengths: &[f64],
    per_interval: usize,
) -> Vec<Vector3<f64>> {
    let chords: Vec<_> =
        nodes.windows(2).zip(lengths).map(|(pair, length)| (pair[1] - pair[0]) / *length).collect();
    let slope = |k: usize| {
        let (before, after) = (k.checked_sub(1).map(|i| chords[i]), chords.get(k).copied());
        match (before, after) {
            (Some(x), Some(y)) => 0.5 * (x + y),
            (Some(x), None) if k >= 2 => 1.5 * x - 0.5 * chords[k - 2],
            (None, Some(y)) if chords.len() >= 2 => 1.5 * y - 0.5 * chords[1],
            (x, y) => x.or(y).unwrap_or_else(Vector3::zeros),
        }
    };
    let mut points = Vec::with_capacity(lengths.len() * per_interval + 1);
    for (k, length) in lengths.iter().enumerate() {
        let (a, b) = (nodes[k], nodes[k + 1]);
        let (da, db) = (*length * slope(k), *length * slope(k + 1));
        for i in 0..per_interval {
            let t = i as f64 / per_interval as f64;
            let (s, t2) = (1.0 - t, t * t);
            points.push(
                s * s * (1.0 + 2.0 * t) * a + t2 * (3.0 - 2.0 * t) * b + s * s * t * da
                    - t2 * s * db,
            );
        }
    }
    points.extend(nodes.last());
    points
}
