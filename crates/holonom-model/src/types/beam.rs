//! `[[beam]]`: geometrically exact beams, their centre line and their nodes.
//!
//! Nodes are numbered along the beam from 0. A polyline has one leg between two points; a corner
//! has two nodes at the same place, the last of one leg and the first of the next, held rigidly
//! together.

use nalgebra::{Vector3, Vector6};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vi_beam::mesh::{BeamMesh, CurveError, FrameRule};
use vi_beam::section::Section as Numbers;
use vi_beam::varying::SectionPoint;
use vi_beam::{ElementKind, Rest};
use vi_core::Number;
use vi_core::num_dual::Dual64;
use vi_multibody::joint::complete_axis;

use super::section::Section;
use super::settings::{Settings, Strain};
use super::station::{NumbersAlong, SectionsAlong, Station, Stations, re};
use crate::text::problem::{Problem, fault};

/// Intervals between nodes that a beam may have at most.
pub const MAX_INTERVALS: usize = 100_000;

/// How an end of a beam is held by the ground.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum End {
    /// Not at all; joints may hold it.
    #[default]
    Free,
    /// Neither moves nor rotates.
    Clamped,
    /// Does not move, rotates freely.
    Pinned,
}

/// Rotation of the section about the centre line.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Twist {
    /// `d_1` lies in the plane of the tangent and `normal` at every node.
    #[default]
    Normal,
    /// The same at the first node; from there on without turning about the tangent.
    Minimal,
}

/// Distribution of the mass of an element to its nodes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BeamMass {
    /// That of the interpolation; neighbouring nodes are coupled.
    #[default]
    Consistent,
    /// Half at each end; two-node elements only.
    Lumped,
}

/// What the elements of a beam measure of their nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BeamElement {
    /// Helicoidal strains, of order 4 with two nodes: stable in any tension, exact in constant
    /// strain, bent by up to 150°.
    Helicoidal,
    /// Quadratic forms of mean directors, of order 2, LMO08 section 6.2: unstable in a tension
    /// beyond `4 EI/ℓ²` of an element, bent by up to 90°.
    MeanDirectors,
    /// For ropes, however small their bending stiffness: an element whose nodes are closer than its
    /// stress-free length carries no force along it.
    Rope,
    /// Helicoidal strains without the bending within an element, of order 2: for large moments of
    /// inertia of the section.
    SecondOrder,
}

impl From<BeamElement> for ElementKind {
    fn from(element: BeamElement) -> Self {
        match element {
            BeamElement::Helicoidal => Self::Helicoidal,
            BeamElement::MeanDirectors => Self::MeanDirectors,
            BeamElement::Rope => Self::Rope,
            BeamElement::SecondOrder => Self::SecondOrder,
        }
    }
}

/// One number of elements, or one for each leg.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "elements is a whole number, or a list of them, one for each leg")]
pub enum Count {
    /// For every leg.
    Each(usize),
    /// One for each leg.
    Legs(Vec<usize>),
}

/// One direction, or one for each leg.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "normal is a direction `[x, y, z]`, or a list of them, one for each leg"
)]
pub enum Normal {
    /// For every leg.
    One([f64; 3]),
    /// One for each leg.
    Legs(Vec<[f64; 3]>),
}

/// A smooth centre line.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub enum Curve {
    /// Part of a circle.
    Arc {
        /// Where it begins, m.
        from: [f64; 3],
        /// A point of its axis, m.
        center: [f64; 3],
        /// Direction of its axis; right-handed.
        axis: [f64; 3],
        /// Angle, rad.
        angle: f64,
    },
    /// A screw line about an axis.
    Helix {
        /// Where it begins, m.
        from: [f64; 3],
        /// A point of its axis, m.
        center: [f64; 3],
        /// Direction of its axis; right-handed.
        axis: [f64; 3],
        /// Angle, rad; may be many revolutions.
        angle: f64,
        /// Rise along the axis per revolution, m.
        pitch: f64,
    },
    /// A smooth curve through points: cubics between them, nodes at equal parts of the sum of
    /// chords.
    Spline {
        /// The points, m.
        points: Vec<[f64; 3]>,
    },
}

/// `[[beam]]`: a geometrically exact beam, free of stress in the initial configuration unless
/// `length`, `curvature` or `prestress` say otherwise. Its nodes are named `NAME.start`, `NAME.end`
/// and `NAME.0`, `NAME.1`, … wherever a body may be named.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Beam {
    /// Its name, unique in the model.
    pub name: String,
    /// The corners of its centre line, m: straight legs between them, rigid at the corners.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<[f64; 3]>,
    /// Its centre line when it is curved; instead of `points`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curve: Option<Curve>,
    /// Elements of each leg, or a list with one number for each leg.
    pub elements: Count,
    /// What its elements measure: `helicoidal`, or `mean_directors` with `strain = "midpoint"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub element: Option<BeamElement>,
    /// Elements for each one that `elements` counts, 1, 2 or 3: for files that asked for elements
    /// with three or four nodes, of which there are none. All have two nodes.
    #[serde(default = "one")]
    pub order: usize,
    /// Direction of `d_1`, the first axis of the section, as far as it lies across the centre line;
    /// `d_3` is along it, `d_2 = d_3 × d_1`. A list has one for each leg. Needed unless the section
    /// is the same in all directions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub normal: Option<Normal>,
    /// Rotation of the section about a curved centre line.
    #[serde(default)]
    pub twist: Twist,
    /// Stiffness and inertia of its section; with `stations`, what they do not state.
    #[serde(default)]
    pub section: Section,
    /// Sections and twist at places along it, or a file of them; numbers are linear between.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stations: Option<Stations>,
    /// Its stress-free length, m, in the place of that of the centre line: a longer beam is slack
    /// or bent between its supports, a shorter one is stretched.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub length: Option<f64>,
    /// Curvature of the stress-free beam about `d_1` and `d_2` and its twist, 1/m, in the place of
    /// those of the centre line.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub curvature: Option<[f64; 3]>,
    /// Tension that it has as drawn, N; negative: a compression.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub prestress: Option<f64>,
    /// Radius of the spheres with which its nodes touch planes and bodies in a `[[contact]]`, m;
    /// that of a section of shape `circle` or `tube` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius: Option<f64>,
    /// Distribution of its mass.
    #[serde(default)]
    pub mass: BeamMass,
    /// Largest tension to be expected, N: the bound of the tension mass of helicoidal elements,
    /// then constant; by default it follows the tension.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tension: Option<f64>,
    /// How the ground holds its start.
    #[serde(default)]
    pub start: End,
    /// How the ground holds its end.
    #[serde(default)]
    pub end: End,
    /// The frame of its points, directions and velocities: a body, a node of a beam, a joint or a
    /// `[[frame]]`; the inertial frame by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub relative_to: Option<String>,
    /// Initial velocity of its first point, m/s; the whole beam moves as if it were rigid.
    #[serde(default)]
    pub velocity: [f64; 3],
    /// Initial angular velocity of the whole beam, spatial components, rad/s.
    #[serde(default)]
    pub angular_velocity: [f64; 3],
}

fn one() -> usize {
    1
}

/// Length of a centre line, m.
fn drawn_length<T: Number>(meshes: &[BeamMesh<T>]) -> T {
    let lengths = meshes.iter().flat_map(|mesh| &mesh.lengths);
    lengths.fold(T::of(0.0), |sum, own| sum + *own)
}

/// The numbers at key paths below that of a beam, from their values.
pub(crate) type NumbersOf<'a, T> = &'a dyn Fn(&str, f64) -> T;

/// Three numbers below a key path.
fn vector<T: Number>(number: NumbersOf<'_, T>, key: &str, x: &[f64; 3]) -> Vector3<T> {
    Vector3::from_fn(|i, _| number(&format!("{key}.{i}"), x[i]))
}

/// Whether two points are the same.
fn are_same(points: &[[f64; 3]]) -> bool {
    points.windows(2).any(|pair| Vector3::from(pair[0]) == Vector3::from(pair[1]))
}

impl Beam {
    /// Number of legs.
    #[must_use]
    pub fn legs(&self) -> usize {
        if self.curve.is_some() { 1 } else { self.points.len().saturating_sub(1) }
    }

    /// Elements of a leg; 0 when they are not stated.
    #[must_use]
    pub fn elements_of(&self, leg: usize) -> usize {
        let counted = match &self.elements {
            Count::Each(count) => *count,
            Count::Legs(counts) => counts.get(leg).copied().unwrap_or_default(),
        };
        counted.saturating_mul(self.order)
    }

    /// What its elements measure, as stated or by default.
    #[must_use]
    pub fn element_kind(&self, settings: &Settings) -> ElementKind {
        let mean = settings.strain == Strain::Midpoint;
        let default = if mean { ElementKind::MeanDirectors } else { ElementKind::Helicoidal };
        self.element.map_or(default, ElementKind::from)
    }

    /// What it is as drawn; `None` where it is free of stress.
    ///
    /// # Errors
    /// [`Problem`] with its key below that of the beam.
    pub fn rest(&self) -> Result<Option<Rest>, Problem> {
        self.rest_by(&|_, value| value)
    }

    /// The same of its numbers.
    ///
    /// # Errors
    /// [`Problem`] with its key below that of the beam.
    pub fn rest_by<T: Number>(&self, number: NumbersOf<'_, T>) -> Result<Option<Rest<T>>, Problem> {
        if let Some(tension) = self.prestress {
            let mut stress = Vector6::from_element(T::of(0.0));
            stress[2] = number("prestress", tension);
            return Ok(Some(Rest::Prestressed(stress)));
        }
        let stretch = match self.length {
            Some(length) => drawn_length(&self.drawn_meshes(number)?) / number("length", length),
            None => T::of(1.0),
        };
        let curvature = self.curvature.map(|own| vector(number, "curvature", &own));
        let stated = self.length.is_some() || curvature.is_some();
        Ok(stated.then_some(Rest::Shape { stretch, curvature }))
    }

    /// Elements of the whole beam.
    #[must_use]
    pub fn element_count(&self) -> usize {
        (0..self.legs()).fold(0, |sum, leg| sum.saturating_add(self.elements_of(leg)))
    }

    /// Nodes of a leg.
    #[must_use]
    pub fn nodes_of(&self, leg: usize) -> usize {
        self.elements_of(leg).saturating_add(1)
    }

    /// Nodes of the whole beam.
    #[must_use]
    pub fn node_count(&self) -> usize {
        (0..self.legs()).fold(0, |sum, leg| sum.saturating_add(self.nodes_of(leg)))
    }

    /// The node called `place`: `start`, `end`, or a number.
    #[must_use]
    pub fn node(&self, place: &str) -> Option<usize> {
        let count = self.node_count();
        match place {
            _ if count == 0 => None,
            "start" => Some(0),
            "end" => Some(count - 1),
            "0" => Some(0),
            number if number.starts_with(['0', '+']) => None,
            number => number.parse().ok().filter(|k| *k < count),
        }
    }

    fn rule<T: Number>(
        &self,
        leg: usize,
        tangent: Vector3<T>,
        number: NumbersOf<'_, T>,
    ) -> FrameRule<T> {
        let stated = match &self.normal {
            Some(Normal::One(normal)) => Some(vector(number, "normal", normal)),
            Some(Normal::Legs(normals)) => {
                let own = normals.get(leg);
                own.map(|normal| vector(number, &format!("normal.{leg}"), normal))
            }
            None => None,
        };
        match (stated, self.twist) {
            (Some(normal), Twist::Normal) => FrameRule::Normal(normal),
            (Some(normal), Twist::Minimal) => FrameRule::RotationMinimizing(normal),
            (None, _) => {
                let across = complete_axis(&tangent.normalize()).column(0).into();
                FrameRule::RotationMinimizing(across)
            }
        }
    }

    /// Nodes of each leg: centres, triads, lengths.
    ///
    /// # Errors
    /// [`Problem`] with its key below that of the beam.
    pub fn meshes(&self) -> Result<Vec<BeamMesh>, Problem> {
        self.meshes_by(&|_, value| value)
    }

    /// The same of its numbers.
    ///
    /// # Errors
    /// [`Problem`] with its key below that of the beam.
    pub fn meshes_by<T: Number>(
        &self,
        number: NumbersOf<'_, T>,
    ) -> Result<Vec<BeamMesh<T>>, Problem> {
        let mut meshes = self.plain_meshes_by(number)?;
        if let Some(along) = self.along(&meshes, number)? {
            let mut start = T::of(0.0);
            for mesh in &mut meshes {
                along.turn(mesh, start);
                start += mesh.length();
            }
        }
        Ok(meshes)
    }

    /// Its stations, if it has any, on these meshes.
    fn along<T: Number>(
        &self,
        meshes: &[BeamMesh<T>],
        number: NumbersOf<'_, T>,
    ) -> Result<Option<SectionsAlong<T>>, Problem> {
        let Some(Stations::Rows(rows)) = &self.stations else { return Ok(None) };
        let length = re(drawn_length(meshes));
        SectionsAlong::new(rows, number, &self.section, length).map(Some)
    }

    /// Sections along each element, where it has stations.
    ///
    /// # Errors
    /// [`Problem`] with its key below that of the beam.
    pub fn sections_along(
        &self,
        meshes: &[BeamMesh],
    ) -> Result<Option<Vec<Vec<SectionPoint>>>, Problem> {
        self.points_along(meshes, &|_, value| value, &|_, _, value| value)
    }

    fn points_along<T: Number>(
        &self,
        meshes: &[BeamMesh<T>],
        number: NumbersOf<'_, T>,
        of_section: NumbersAlong<'_, T>,
    ) -> Result<Option<Vec<Vec<SectionPoint<T>>>>, Problem> {
        let Some(along) = self.along(meshes, number)? else { return Ok(None) };
        let mut start = T::of(0.0);
        let element = |length: &T| {
            let from = start;
            start += *length;
            along.points([from, start], of_section)
        };
        let lengths = meshes.iter().flat_map(|mesh| &mesh.lengths);
        lengths.map(element).collect::<Result<_, _>>().map(Some)
    }

    /// The sections of each of its elements with their derivatives; `number`: of those at key paths
    /// below that of the beam.
    ///
    /// # Errors
    /// [`Problem`] with its key below that of the beam.
    pub fn section_tangents(
        &self,
        number: NumbersOf<'_, Dual64>,
    ) -> Result<Vec<Vec<SectionPoint<Dual64>>>, Problem> {
        let meshes = self.plain_meshes_by(number)?;
        let slope = |key: &str| number(key, 0.0).eps;
        let stated = |station: usize, key: &str| -> Option<&Station> {
            let Some(Stations::Rows(rows)) = &self.stations else { return None };
            rows.get(station).filter(|own| own.states(key))
        };
        let at = |station: usize, key: &str| match stated(station, key) {
            Some(_) => slope(&format!("stations.{station}.section.{key}")),
            None => slope(&format!("section.{key}")),
        };
        let last = match &self.stations {
            Some(Stations::Rows(rows)) => rows.len().saturating_sub(1),
            _ => 0,
        };
        let along = |(k, t): (usize, f64), key: &str, value: f64| {
            let (from, to) = (at(k, key), at((k + 1).min(last), key));
            Dual64::new(value, from + t * (to - from))
        };
        if let Some(all) = self.points_along(&meshes, number, &along)? {
            return Ok(all);
        }
        let one = |key: &str, value: f64| Dual64::new(value, slope(&format!("section.{key}")));
        let section = self.section.numbers_by(&one);
        let section = section.map_err(|problem| problem.below("section"))?;
        let (place, weight) = (Dual64::of(0.0), Dual64::of(1.0));
        let point = SectionPoint { place, weight, section };
        Ok(vec![vec![point]; meshes.iter().map(|mesh| mesh.lengths.len()).sum()])
    }

    /// Whether an end of an element passes a station at which there is a kink.
    ///
    /// # Errors
    /// [`Problem`] with its key below that of the beam.
    pub fn passes_station(&self, number: NumbersOf<'_, Dual64>) -> Result<bool, Problem> {
        let meshes = self.plain_meshes_by(number)?;
        let Some(along) = self.along(&meshes, number)? else { return Ok(false) };
        let mut at = Dual64::of(0.0);
        let mut lengths = meshes.iter().flat_map(|mesh| &mesh.lengths);
        let next = |length: &Dual64| {
            at += *length;
            along.passes(at)
        };
        Ok(along.passes(Dual64::of(0.0)) || lengths.any(next))
    }

    /// Its section at an arc length, m.
    ///
    /// # Errors
    /// [`Problem`] with its key below that of the beam.
    pub fn section_at(&self, s: f64) -> Result<Numbers, Problem> {
        match self.along(&self.plain_meshes()?, &|_, value| value)? {
            Some(along) => along.section(s),
            None => self.section.numbers().map_err(|problem| problem.below("section")),
        }
    }

    /// What its section is, or the mean of its sections.
    ///
    /// # Errors
    /// [`Problem`] with its key below that of the beam.
    pub fn mean_section(&self) -> Result<Numbers, Problem> {
        let meshes = self.plain_meshes()?;
        let Some(sections) = self.sections_along(&meshes)? else {
            return self.section.numbers().map_err(|problem| problem.below("section"));
        };
        let lengths: Vec<f64> = meshes.iter().flat_map(|mesh| &mesh.lengths).copied().collect();
        let total: f64 = lengths.iter().sum();
        let parts = sections.iter().zip(&lengths).flat_map(|(points, length)| {
            points.iter().map(move |point| (point.weight * length / total, point.section))
        });
        Ok(Numbers::mean(&parts.collect::<Vec<_>>()))
    }

    /// The node next to an arc length, m.
    #[must_use]
    pub fn nearest_node(&self, s: f64) -> usize {
        let (mut at, mut places) = (0.0, Vec::new());
        for mesh in &self.plain_meshes().unwrap_or_default() {
            places.push(at);
            places.extend(mesh.lengths.iter().map(|length| {
                at += length;
                at
            }));
        }
        let away = |k: &usize| (places[*k] - s).abs();
        (0..places.len()).min_by(|a, b| away(a).total_cmp(&away(b))).unwrap_or_default()
    }

    /// Whether a section along it does not shear.
    pub(crate) fn lacks_shear(&self) -> bool {
        let Ok(meshes) = self.plain_meshes() else { return false };
        match self.sections_along(&meshes) {
            Ok(Some(all)) => all.iter().flatten().any(|own| own.section.is_rigid_in_shear()),
            _ => self.section.numbers().is_ok_and(|own| own.is_rigid_in_shear()),
        }
    }

    /// Whether a strain is damped.
    #[must_use]
    pub fn is_damped(&self) -> bool {
        let rows = match &self.stations {
            Some(Stations::Rows(rows)) => rows.as_slice(),
            _ => &[],
        };
        let own = rows.iter().filter_map(|row| row.section.as_ref());
        self.section.is_damped() || own.into_iter().any(Section::is_damped)
    }

    /// The same before its stations twist it.
    pub(crate) fn plain_meshes(&self) -> Result<Vec<BeamMesh>, Problem> {
        self.plain_meshes_by(&|_, value| value)
    }

    fn plain_meshes_by<T: Number>(
        &self,
        number: NumbersOf<'_, T>,
    ) -> Result<Vec<BeamMesh<T>>, Problem> {
        let mut meshes = self.drawn_meshes(number)?;
        if let Some(length) = self.length {
            let ratio = number("length", length) / drawn_length(&meshes);
            let lengths = meshes.iter_mut().flat_map(|mesh| &mut mesh.lengths);
            lengths.for_each(|own| *own *= ratio);
        }
        Ok(meshes)
    }

    /// The same with the lengths along the centre line.
    fn drawn_meshes<T: Number>(
        &self,
        number: NumbersOf<'_, T>,
    ) -> Result<Vec<BeamMesh<T>>, Problem> {
        self.counts()?;
        let intervals = |leg: usize| self.elements_of(leg);
        let explain = |key: &'static str| {
            move |error: CurveError| match error {
                CurveError::NormalAlongTangent { node } => {
                    let message = format!("the normal is along the centre line at node {node}");
                    let help = "write a direction across the beam; `normal` may be a list, one for \
                                each leg";
                    fault("normal", message, help)
                }
                error => fault(key, error.to_string(), "give every part of the beam a length"),
            }
        };
        let Some(curve) = &self.curve else {
            let leg = |(leg, ends): (usize, &[[f64; 3]])| {
                if are_same(ends) {
                    let message = format!("points {leg} and {} are the same", leg + 1);
                    return Err(fault("points", message, "remove one of them"));
                }
                let point = |k: usize, x| vector(number, &format!("points.{k}"), x);
                let (from, to) = (point(leg, &ends[0]), point(leg + 1, &ends[1]));
                let rule = self.rule(leg, to - from, number);
                BeamMesh::straight(from, to, intervals(leg), rule).map_err(explain("points"))
            };
            return self.points.windows(2).enumerate().map(leg).collect();
        };
        let along = |key: &str, x| vector(number, &format!("curve.{key}"), x);
        let mesh = match curve {
            Curve::Arc { from, center, axis, angle } => {
                let numbers = [number("curve.angle", *angle), T::of(0.0)];
                let stated = [(from, "from"), (center, "center"), (axis, "axis")];
                self.screw_line(stated.map(|(x, key)| along(key, x)), numbers, number)?
            }
            Curve::Helix { from, center, axis, angle, pitch } => {
                let numbers = [number("curve.angle", *angle), number("curve.pitch", *pitch)];
                let stated = [(from, "from"), (center, "center"), (axis, "axis")];
                self.screw_line(stated.map(|(x, key)| along(key, x)), numbers, number)?
            }
            Curve::Spline { points } => {
                if let Some(k) = points.windows(2).position(are_same) {
                    let message = format!("points {k} and {} are the same", k + 1);
                    return Err(fault("curve.points", message, "remove one of them"));
                }
                let points = points.iter().enumerate();
                let points: Vec<_> =
                    points.map(|(k, x)| along(&format!("points.{k}"), x)).collect();
                let rule = self.rule(0, points[1] - points[0], number);
                BeamMesh::spline(&points, intervals(0), rule).map_err(explain("curve"))?
            }
        };
        Ok(vec![mesh])
    }

    fn screw_line<T: Number>(
        &self,
        [from, center, axis]: [Vector3<T>; 3],
        [angle, pitch]: [T; 2],
        number: NumbersOf<'_, T>,
    ) -> Result<BeamMesh<T>, Problem> {
        if axis.map(Number::real).amax() < 1e-100 {
            let message = "the axis has zero length".to_owned();
            return Err(fault("curve.axis", message, "write a direction, such as [0, 0, 1]"));
        }
        if re(angle) == 0.0 {
            let message = "the angle is 0: the curve has no length".to_owned();
            return Err(fault("curve.angle", message, "write an angle in rad, or use `points`"));
        }
        let axis = axis.normalize();
        let foot = center + axis * axis.dot(&(from - center));
        let radius = from - foot;
        let real = |x: Vector3<T>| x.map(Number::real);
        if real(radius).norm() <= 1e-12 * real(from - center).norm() {
            let message = "the curve begins on its axis: it has no radius".to_owned();
            return Err(fault("curve.from", message, "move `from` or `center`"));
        }
        let rise = axis * (pitch / T::of(std::f64::consts::TAU));
        let tangent = (axis.cross(&radius) + rise) * T::of(re(angle).signum());
        let (intervals, rule) = (self.elements_of(0), self.rule(0, tangent, number));
        let mesh = BeamMesh::helix(foot, radius, axis, angle, pitch, intervals, rule);
        mesh.map_err(|error| {
            fault("normal", error.to_string(), "write a direction across the beam")
        })
    }

    /// What the numbers of points, elements and normals must be.
    fn counts(&self) -> Result<(), Problem> {
        let few = |key, count: usize| {
            let message = format!("{count} point(s) make no beam");
            Err(fault(key, message, "write at least two points"))
        };
        match (&self.curve, self.points.len()) {
            (None, 0) => {
                let help = "add `points = [[…], […]]`, or a `curve`";
                return Err(fault("name", "the beam has no centre line", help));
            }
            (None, 1) => return few("points", 1),
            (Some(_), 1..) => {
                let message = "the centre line is stated twice: `points` and `curve`".to_owned();
                return Err(fault("points", message, "keep one of them"));
            }
            (Some(Curve::Spline { points }), 0) if points.len() < 2 => {
                return few("curve.points", points.len());
            }
            _ => {}
        }
        if !(1..=3).contains(&self.order) {
            let message = format!("{} elements in the place of one", self.order);
            return Err(fault("order", message, "remove it, and state `elements`"));
        }
        let legs = self.legs();
        let lists = [
            ("elements", if let Count::Legs(list) = &self.elements { list.len() } else { legs }),
            ("normal", if let Some(Normal::Legs(list)) = &self.normal { list.len() } else { legs }),
        ];
        for (key, count) in lists {
            if count != legs {
                let message = format!("{count} value(s) for {legs} leg(s)");
                return Err(fault(key, message, "write one for each leg, or a single one for all"));
            }
        }
        if (0..legs).any(|leg| self.elements_of(leg) == 0) {
            let message = "a beam needs at least one element in each leg".to_owned();
            return Err(fault("elements", message, "write a number such as 16"));
        }
        let all = self.element_count();
        if all > MAX_INTERVALS {
            let message = format!("{all} intervals between nodes are more than {MAX_INTERVALS}");
            return Err(fault("elements", message, "choose fewer elements"));
        }
        Ok(())
    }
}
