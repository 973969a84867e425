//! What an analysis of modes reports.

use crate::digits::rounded;
use crate::sample::{Member, MemberKind};
use nalgebra::{Complex, Vector3};
use serde::{Deserialize, Serialize};
use std::fmt::Write as _;
use vi_core::linear::norm_inf;
use vi_rigid::directors;

/// About which configuration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum About {
    /// The initial configuration, under the loads at `t = 0`.
    #[default]
    Start,
    /// The equilibrium under the loads at the end, as `scheme = "static"` finds it.
    Static,
    /// The steady rotation of the initial velocities, in the frame that rotates.
    Rotation,
    /// The steady motion of the initial velocities: all moves along and turns as a whole, while
    /// wheels and rotors spin; in the frame that moves.
    Motion,
}

/// What a mode is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum ModeKind {
    /// It grows: the configuration is unstable along it.
    Unstable,
    /// `ω = 0` to round-off: nothing resists.
    Zero,
    /// `ω > 0`.
    Vibration,
    /// It dies out without a vibration.
    Decay,
    /// The shape in which it buckles at a critical load.
    Buckling,
}

/// How a component moves in a mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MemberShape {
    /// Its name.
    pub name: String,
    /// Displacement of its centre (node, point).
    pub translation: [f64; 3],
    /// Rotation vector; zero for point masses.
    pub rotation: [f64; 3],
    /// Displacement a quarter of a period before, of modes with damping or gyroscopic forces: the
    /// motion is `(u cos ωt − u' sin ωt) e^{−δt}`.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub translation_before: [f64; 3],
    /// The same of the rotation vector.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub rotation_before: [f64; 3],
}

fn is_zero(x: &[f64; 3]) -> bool {
    x.iter().all(|x| *x == 0.0)
}

fn is_nothing(x: &f64) -> bool {
    *x == 0.0
}

/// A mode.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Mode {
    /// What it is.
    pub kind: ModeKind,
    /// `ω²`, rad²/s²; negative where the mode grows or decays without a vibration.
    pub omega_squared: f64,
    /// `ω`, rad/s, in the frame that rotates; 0 for those that do not vibrate.
    pub omega: f64,
    /// `ω/2π`, Hz.
    pub frequency: f64,
    /// Rate at which an unstable mode grows, 1/s; otherwise 0.
    pub growth: f64,
    /// `δ`, the rate at which the mode dies out as `e^{−δt}`, 1/s; otherwise 0.
    #[serde(default)]
    pub decay: f64,
    /// `ζ = δ/√(ω² + δ²)`.
    #[serde(default)]
    pub damping_ratio: f64,
    /// The critical load as a multiple of the loads at the end of the path; of buckling shapes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load_factor: Option<f64>,
    /// The shape, scaled so that the largest displacement is 1 m; where nothing is displaced, the
    /// largest rotation is 1 rad.
    pub shape: Vec<MemberShape>,
}

/// A steady rotation about an axis fixed in space.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct RotationReport {
    /// Angular velocity, rad/s.
    pub speed: f64,
    /// Unit vector along the axis.
    pub axis: [f64; 3],
    /// A point of the axis, m.
    pub point: [f64; 3],
}

/// A steady motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MotionReport {
    /// Velocity of the whole system, m/s; along the axis where it turns, too.
    pub velocity: [f64; 3],
    /// Bodies that spin about their axis of symmetry, with their rate beside the rotation of all,
    /// rad/s.
    pub spins: Vec<(String, f64)>,
}

/// The path whose loads become critical.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BucklingFacts {
    /// Time of the loads at the end of the path, s: where the load factor is 1.
    pub end: f64,
    /// The first critical load factor of reversed loads.
    pub reversed: Option<f64>,
}

/// Modes about a configuration.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Name of the model.
    pub model: String,
    /// About which configuration.
    pub about: About,
    /// The steady rotation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rotation: Option<RotationReport>,
    /// The steady motion; its rotation is `rotation`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub motion: Option<MotionReport>,
    /// Time of the loads there, s.
    pub t: f64,
    /// Degrees of freedom.
    pub dof: usize,
    /// Unstable modes.
    pub unstable: usize,
    /// Modes without stiffness.
    pub zero: usize,
    /// Hz below which modes of `zero` may vibrate without being told from those without stiffness,
    /// where that is not small beside the slowest vibration; otherwise 0.
    #[serde(default, skip_serializing_if = "is_nothing")]
    pub round_off: f64,
    /// Softest first: all unstable ones, all without stiffness, vibrations and decays as asked for.
    pub modes: Vec<Mode>,
    /// `max |Kx − ω²Mx|`, with damping and gyroscopic terms `max |(λ²M + λC + K)x|`, relative to
    /// the size of its terms: the largest of all modes, of the latter of those listed.
    pub residual: f64,
    /// `max |XᵀMX − I|` of all undamped modes.
    pub orthogonality: f64,
    /// Unstable modes by the inertia of the stiffness,
    /// [`Modes::negative`](vi_statics::Modes::negative); `None` with damping or gyroscopic terms
    /// and where only the lowest modes are computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unstable_by_inertia: Option<usize>,
    /// Of critical loads.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub buckling: Option<BucklingFacts>,
    /// Coordinates of the configuration, components one after the other.
    pub configuration: Vec<f64>,
    /// What is worth knowing.
    pub warnings: Vec<String>,
}

impl Mode {
    /// The member that moves most, and along which axis.
    #[must_use]
    pub fn moves_most(&self) -> String {
        let axis = |x: &[f64; 3]| {
            let size = |i: &usize| x[*i].abs();
            (0..3).max_by(|i, j| size(i).total_cmp(&size(j))).unwrap_or(0)
        };
        let largest = |of: fn(&MemberShape) -> &[f64; 3]| {
            let size = |m: &&MemberShape| Vector3::from(*of(m)).norm();
            let member = self.shape.iter().max_by(|a, b| size(a).total_cmp(&size(b)))?;
            (size(&member) > 1e-9).then(|| (member.name.clone(), axis(of(member))))
        };
        match (largest(|m| &m.translation), largest(|m| &m.rotation)) {
            (Some((name, i)), _) => format!("{name} along {}", ["x", "y", "z"][i]),
            (None, Some((name, i))) => format!("{name} about {}", ["x", "y", "z"][i]),
            (None, None) => String::new(),
        }
    }
}

impl ModeKind {
    fn name(self) -> &'static str {
        match self {
            Self::Unstable => "unstable",
            Self::Zero => "zero",
            Self::Vibration => "vibration",
            Self::Decay => "decay",
            Self::Buckling => "buckling",
        }
    }
}

impl Report {
    /// The steady motion in words.
    #[must_use]
    pub fn steady_motion(&self) -> String {
        let list = |x: [f64; 3]| x.map(|x| rounded(x, 6)).join(", ");
        let mut parts = Vec::new();
        if let Some(motion) = &self.motion {
            if norm_inf(&motion.velocity) > 0.0 {
                parts.push(format!("[{}] m/s", list(motion.velocity)));
            }
            if let Some(RotationReport { speed, axis, .. }) = &self.rotation {
                parts.push(format!("{} rad/s about [{}]", rounded(*speed, 6), list(*axis)));
            }
            // nodes of a beam stand one after the other
            let beam = |name: &str| name.rsplit_once('.').map(|(beam, _)| beam.to_owned());
            let alike = |a: &(String, f64), b: &(String, f64)| {
                beam(&a.0).is_some()
                    && beam(&a.0) == beam(&b.0)
                    && rounded(a.1, 6) == rounded(b.1, 6)
            };
            parts.extend(motion.spins.chunk_by(alike).map(|own| {
                let (name, rate) = &own[0];
                let last = &own[own.len() - 1].0;
                let names = if own.len() > 1 { format!("{name} to {last}") } else { name.clone() };
                format!("{names} {} rad/s", rounded(*rate, 6))
            }));
        }
        match parts.is_empty() {
            true => "rest".to_owned(),
            false => format!("the steady motion, {}, in its frame", parts.join(", ")),
        }
    }

    /// `modes.csv`: a row for each mode and member.
    #[must_use]
    pub fn csv(&self) -> String {
        if let Some(buckling) = &self.buckling {
            return self.buckling_csv(buckling);
        }
        let mut text = String::from(
            "mode,kind,omega_squared,frequency,member,ux,uy,uz,rx,ry,rz,decay,damping_ratio,\
             ux_before,uy_before,uz_before,rx_before,ry_before,rz_before\n",
        );
        let list = |parts: [&[f64; 3]; 2]| -> String {
            parts.into_iter().flatten().map(|x| format!(",{x}")).collect()
        };
        for (k, mode) in self.modes.iter().enumerate() {
            let (squared, frequency) = (mode.omega_squared, mode.frequency);
            for moved in &mode.shape {
                let now = list([&moved.translation, &moved.rotation]);
                let before = list([&moved.translation_before, &moved.rotation_before]);
                let (number, kind, name) = (k + 1, mode.kind.name(), &moved.name);
                let (decay, ratio) = (mode.decay, mode.damping_ratio);
                let _ = writeln!(
                    text,
                    "{number},{kind},{squared},{frequency},{name}{now},{decay},{ratio}{before}"
                );
            }
        }
        text
    }
}

impl Report {
    /// `buckling.csv`: a row for each critical load and member.
    fn buckling_csv(&self, path: &BucklingFacts) -> String {
        let mut text = String::from("mode,load_factor,time,member,ux,uy,uz,rx,ry,rz\n");
        for (k, mode) in self.modes.iter().enumerate() {
            let (number, factor) = (k + 1, mode.load_factor.unwrap_or(f64::NAN));
            let time = factor * path.end;
            for MemberShape { name, translation, rotation, .. } in &mode.shape {
                let numbers: String =
                    translation.iter().chain(rotation).map(|x| format!(",{x}")).collect();
                let _ = writeln!(text, "{number},{factor},{time},{name}{numbers}");
            }
        }
        text
    }
}

/// The velocity field `v` of a mode as displacements and rotations of components, scaled so that
/// the largest displacement is 1 m, or the largest rotation 1 rad, and real.
pub(super) fn shape(members: &[Member], q: &[f64], v: &[Complex<f64>]) -> Vec<MemberShape> {
    let largest = |part: fn(&MemberShape) -> [&[f64; 3]; 2], shape: &[MemberShape]| {
        let norm =
            |m: &MemberShape| part(m).into_iter().flatten().map(|x| x * x).sum::<f64>().sqrt();
        shape.iter().map(norm).fold(0.0, f64::max)
    };
    let fields = |v: &[Complex<f64>]| -> Vec<MemberShape> {
        let parts = [v.iter().map(|v| v.re).collect::<Vec<_>>(), v.iter().map(|v| v.im).collect()];
        let [now, before] = parts.map(|v| displacements(members, q, &v));
        let pairs = now.into_iter().zip(before).zip(members);
        pairs
            .map(|(([translation, rotation], before), member)| MemberShape {
                name: member.name.clone(),
                translation,
                rotation,
                translation_before: before[0],
                rotation_before: before[1],
            })
            .collect()
    };
    let first = fields(v);
    let translation = largest(|m| [&m.translation, &m.translation_before], &first);
    let rotation = largest(|m| [&m.rotation, &m.rotation_before], &first);
    let scale = if translation > 1e-9 * rotation { translation } else { rotation };
    let numbers = first.iter().flat_map(|m| {
        let own = m.translation.iter().chain(&m.rotation);
        let before = m.translation_before.iter().chain(&m.rotation_before);
        own.zip(before).map(|(re, im)| Complex::new(*re, *im))
    });
    let by_size = |a: &Complex<f64>, b: &Complex<f64>| a.norm_sqr().total_cmp(&b.norm_sqr());
    let phase = match numbers.max_by(by_size) {
        // the largest number is real and positive
        Some(x) if scale > 0.0 => x.conj().unscale(x.norm() * scale),
        _ => return first,
    };
    fields(&v.iter().map(|v| v * phase).collect::<Vec<_>>())
}

/// Translation and rotation vector of each component.
fn displacements(members: &[Member], q: &[f64], v: &[f64]) -> Vec<[[f64; 3]; 2]> {
    let mut at = 0;
    let mut list = Vec::with_capacity(members.len());
    for member in members {
        let size = member.kind.columns().len();
        let own = at..at + size;
        let mut translation = [0.0; 3];
        translation[..size.min(3)].copy_from_slice(&v[own.start..own.start + size.min(3)]);
        let rotation = match member.kind {
            MemberKind::Frame => directors::angular_velocity(&q[own.clone()], &v[own]).into(),
            _ => [0.0; 3],
        };
        list.push([translation, rotation]);
        at += size;
    }
    list
}
