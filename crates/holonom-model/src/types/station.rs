//! `stations` of a beam: sections and twist at places along it.
//!
//! ```text
//! every number that two neighbouring stations state is linear between them;
//! a place that is repeated is a jump
//! ```

use crate::text::problem::{Problem, fault};
use crate::types::section::Section;
use nalgebra::Matrix3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use toml::Value;
use vi_beam::mesh::BeamMesh;
use vi_beam::section::Section as Numbers;
use vi_beam::varying::{SectionPoint, quadrature};
use vi_core::Number;

/// A station may miss the end of the beam by this part of its length.
const MISSED: f64 = 1e-6;

/// `stations` of a beam.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "stations is a list of tables { at, section, twist }, or the name of a file"
)]
pub enum Stations {
    /// From the start of the beam to its end.
    Rows(Vec<Station>),
    /// A table with commas (`.csv`) whose heading names `at`, `twist` and keys of a section; or the
    /// blade file of BeamDyn, or its primary file, whose twist is then taken, too; or an st file of
    /// HAWC2, `NAME#SET$SUBSET`, the first ones by default. Relative to the folder of the model
    /// file.
    File(String),
}

/// A place along a beam.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Station {
    /// Arc length from the start of the stress-free beam, m; the same twice where the section
    /// jumps.
    pub at: f64,
    /// What it states of the section in the place of the `section` of the beam.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub section: Option<Section>,
    /// Angle about `d_3` by which `d_1` and `d_2` are turned from where `normal` has them, rad.
    #[serde(default)]
    pub twist: f64,
}

impl Station {
    /// Whether it states the key of a section, and not the `section` of the beam.
    pub(crate) fn states(&self, key: &str) -> bool {
        let first = key.split('.').next().unwrap_or_default();
        let own = self.section.as_ref().and_then(|own| Value::try_from(own).ok());
        own.is_some_and(|own| own.get(first).is_some())
    }
}

/// The number at a key path of a section between two stations, the first of which is given with the
/// part of the way to the next one, from its value at a constant part of the way.
pub(crate) type NumbersAlong<'a, T> = &'a dyn Fn((usize, f64), &str, f64) -> T;

/// Sections along a beam.
pub(crate) struct SectionsAlong<T = f64> {
    places: Vec<T>,
    twists: Vec<T>,
    sections: Vec<Value>,
}

/// The number at a key path below a value, if it is one.
fn number_at(value: &Value, path: &str) -> Option<f64> {
    let step = |value: &'_ Value, part: &str| -> Option<Value> {
        match value {
            Value::Table(table) => table.get(part).cloned(),
            Value::Array(list) => list.get(part.parse::<usize>().ok()?).cloned(),
            _ => None,
        }
    };
    path.split('.').try_fold(value.clone(), |value, part| step(&value, part))?.as_float()
}

impl<T: Number> SectionsAlong<T> {
    /// Of stations that rise from 0 to the length of the beam, and the section where they state
    /// none; `number`: of those at key paths below that of the beam.
    pub(crate) fn new(
        rows: &[Station],
        number: &dyn Fn(&str, f64) -> T,
        base: &Section,
        length: f64,
    ) -> Result<Self, Problem> {
        let key = |k: usize| format!("stations[{k}]");
        let help =
            "stations rise from 0 to the length of the beam; repeat one where the section jumps";
        let [Some(first), Some(last)] = [rows.first(), rows.last()] else {
            return Err(fault("stations", "there are no stations", help));
        };
        for (k, at, end) in [(0, first.at, 0.0), (rows.len() - 1, last.at, length)] {
            let missed = (at - end).abs();
            if missed.is_nan() || missed > MISSED * length {
                let message = format!("the stations end at {at} m, the beam at {end} m");
                return Err(fault(&format!("{}.at", key(k)), message, help));
            }
        }
        let (mut places, mut sections) = (Vec::new(), Vec::new());
        for (k, row) in rows.iter().enumerate() {
            if k > 0 && row.at < rows[k - 1].at {
                let message = format!("{} m comes after {} m", row.at, rows[k - 1].at);
                return Err(fault(&format!("{}.at", key(k)), message, help));
            }
            if k > 1 && row.at <= rows[k - 2].at {
                let message = format!("the place {} m is stated three times", row.at);
                return Err(fault(&format!("{}.at", key(k)), message, help));
            }
            let section = row.section.as_ref().map_or_else(|| base.clone(), |own| own.over(base));
            let below = format!("{}.section", key(k));
            section.numbers().map_err(|problem| problem.below(&below))?;
            places.push(number(&format!("stations.{k}.at"), row.at));
            sections.push(Value::try_from(&section).expect("a section is TOML"));
        }
        let twist = |(k, row): (usize, &Station)| number(&format!("stations.{k}.twist"), row.twist);
        let twists = rows.iter().enumerate().map(twist).collect();
        let along = Self { places, twists, sections };
        for k in 1..rows.len() {
            let jump = rows[k].at <= rows[k - 1].at;
            if jump && rows[k].twist - rows[k - 1].twist != 0.0 {
                let message = "the beam is not twisted by a jump";
                return Err(fault(
                    &format!("{}.twist", key(k)),
                    message,
                    "write the same twist on both sides",
                ));
            }
            if !jump && between(&along.sections[k - 1], &along.sections[k], 0.5).is_none() {
                let message = "the stations before and after state different keys or shapes";
                let help =
                    "state the same keys at both, or repeat a station where the section jumps";
                return Err(fault(&format!("{}.section", key(k)), message, help));
            }
        }
        Ok(along)
    }

    /// The last station at or before `s` that is not the last of all, and the part of the way to
    /// the next one.
    fn interval(&self, s: T) -> (usize, T) {
        let last = self.places.len().saturating_sub(2);
        let before = self.places.partition_point(|at| re(*at) <= re(s));
        let k = before.saturating_sub(1).min(last);
        let Some(next) = self.places.get(k + 1) else { return (k, T::of(0.0)) };
        let length = *next - self.places[k];
        if re(length) <= 0.0 {
            return (k, T::of(0.0));
        }
        let way = (s - self.places[k]) / length;
        (k, if (0.0..=1.0).contains(&re(way)) { way } else { T::of(re(way).clamp(0.0, 1.0)) })
    }

    /// The section at an arc length.
    pub(crate) fn section(&self, s: T) -> Result<Numbers<T>, Problem> {
        self.section_by(s, &|_, _, value| T::of(value))
    }

    /// The same from its numbers, by the station before and the part of the way to the next one,
    /// and by their key paths below that of a section.
    fn section_by(&self, s: T, number: NumbersAlong<'_, T>) -> Result<Numbers<T>, Problem> {
        let (k, way) = self.interval(s);
        let (a, b) = (&self.sections[k], &self.sections[(k + 1).min(self.sections.len() - 1)]);
        let t = re(way);
        let value = between(a, b, t).unwrap_or_else(|| a.clone());
        let section: Section = value.try_into().expect("between sections are sections");
        let moves = way - T::of(t);
        let numbers = section.numbers_by(&|key, value| {
            let own = number((k, t), key, value);
            match (number_at(a, key), number_at(b, key)) {
                (Some(a), Some(b)) if !moves.vanishes() => own + T::of(b - a) * moves,
                _ => own,
            }
        });
        numbers.map_err(|problem| problem.below(&format!("stations[{k}].section")))
    }

    /// The angle of the directors at an arc length, rad.
    fn twist(&self, s: T) -> T {
        let (k, t) = self.interval(s);
        let (a, b) = (self.twists[k], self.twists[(k + 1).min(self.twists.len() - 1)]);
        a + t * (b - a)
    }

    /// Sections of an element from one arc length to another: three Gauss points between stations.
    pub(crate) fn points(
        &self,
        [from, to]: [T; 2],
        number: NumbersAlong<'_, T>,
    ) -> Result<Vec<SectionPoint<T>>, Problem> {
        let slack = MISSED * re(to - from);
        let inside = |at: &&T| re(**at) > re(from) + slack && re(**at) < re(to) - slack;
        let inner = self.places.iter().filter(inside);
        let mut cuts: Vec<T> = std::iter::once(from).chain(inner.copied()).collect();
        cuts.dedup_by(|own, before| re(*own) <= re(*before));
        cuts.push(to);
        let (start, length, half) = (from, to - from, T::of(0.5));
        let mut points = Vec::new();
        for ends in cuts.windows(2) {
            let [from, to] = [ends[0], ends[1]].map(|s| (s - start) / length - half);
            for [place, weight] in quadrature(from, to) {
                let section = self.section_by(start + (place + half) * length, number)?;
                points.push(SectionPoint { place, weight, section });
            }
        }
        Ok(points)
    }

    /// Turns the triads of a mesh that begins at an arc length.
    pub(crate) fn turn(&self, mesh: &mut BeamMesh<T>, start: T) {
        if self.twists.iter().all(|twist| twist.vanishes()) {
            return;
        }
        let mut s = start;
        let lengths = mesh.lengths.iter().copied().chain([T::of(0.0)]);
        for (triad, length) in mesh.triads.iter_mut().zip(lengths) {
            let [sin, cos] = self.twist(s).sine_cosine();
            let [d1, d2, d3] = [0, 1, 2].map(|i| triad.column(i).into_owned());
            *triad = Matrix3::from_columns(&[d1 * cos + d2 * sin, d2 * cos - d1 * sin, d3]);
            s += length;
        }
    }

    /// Whether an end of an element passes a station at which there is a kink: an end of the beam,
    /// a jump of the section, any of a twist.
    pub(crate) fn passes(&self, s: T) -> bool {
        let last = self.places.len() - 1;
        let twisted = self.twists.iter().any(|twist| re(*twist) != 0.0);
        let own = |(k, at): (usize, &T)| {
            let jump =
                |i: usize| i > 0 && i <= last && re(self.places[i]) <= re(self.places[i - 1]);
            let jumps = jump(k) || jump(k + 1);
            let (near, moves) = (re(*at - s).abs() <= MISSED, *at - s - T::of(re(*at - s)));
            near && !moves.vanishes() && (k == 0 || k == last || jumps || twisted)
        };
        self.places.iter().enumerate().any(own)
    }
}

/// The value of a number.
pub(crate) fn re<T: Number>(x: T) -> f64 {
    Number::real(x)
}

/// Numbers in proportion to `t` between those of two values that are otherwise the same; `None`
/// where they are not.
fn between(a: &Value, b: &Value, t: f64) -> Option<Value> {
    match (a, b) {
        (Value::Float(a), Value::Float(b)) => Some(Value::Float(a + t * (b - a))),
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            let entries = a.iter().zip(b).map(|(a, b)| between(a, b, t));
            entries.collect::<Option<Vec<_>>>().map(Value::Array)
        }
        (Value::Table(a), Value::Table(b)) if a.len() == b.len() => {
            let entries = a.iter().map(|(key, a)| Some((key.clone(), between(a, b.get(key)?, t)?)));
            entries.collect::<Option<toml::Table>>().map(Value::Table)
        }
        (a, b) => (a == b).then(|| a.clone()),
    }
}
