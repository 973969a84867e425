//! Velocities of bodies and point masses, as far as the files of a run hold them.
//!
//! ```text
//! sensors.csv    sensors of velocity at the centre and of angular velocity: their numbers
//! momenta.csv    φ̇ = p_φ/m,   ω = J⁻¹ Σ d_I × p_I,   p: p_projected, where there is none p
//! ```

use holonom_model::{Model, Sensor, SensorKind};
use holonom_sim::output::columns::{MOMENTUM, OutputColumn, POSITION_NAMES, PROJECTED};
use holonom_sim::output::{RowTable, RunFolder};
use holonom_sim::sample::{Member, MemberKind};
use nalgebra::{Matrix3, Vector3};

use crate::ExportError;
use crate::rows::{StepRows, number};
use crate::tube::MemberPose;

/// What a member does, in space; `None`: not known.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Rate {
    /// Of the centre, m/s.
    pub(super) velocity: Option<[f64; 3]>,
    /// rad/s.
    pub(super) angular_velocity: Option<[f64; 3]>,
    /// kg·m/s.
    pub(super) momentum: Option<[f64; 3]>,
}

/// First columns of the numbers of a member.
#[derive(Clone, Copy, Debug, Default)]
struct RateColumns {
    velocity: Option<usize>,         // in sensors.csv
    angular_velocity: Option<usize>, // in sensors.csv
    momenta: [Option<usize>; 2],     // in momenta.csv: p_projected, p
}

/// A body or a point mass.
struct Mover {
    fixed: bool,
    kind: MemberKind,
    columns: RateColumns,
    mass: f64,
    /// Inverse of the inertia along the directors; `None` where it is singular.
    inverse_inertia: Option<Matrix3<f64>>,
}

/// The files with the members that they tell of.
pub(super) struct MemberRates {
    sensors: Option<StepRows>,
    momenta: Option<StepRows>,
    movers: Vec<Mover>,
}

impl MemberRates {
    /// Of the given members, bodies and point masses with their first poses.
    pub(super) fn open(
        folder: &RunFolder,
        model: &Model,
        members: &[(&Member, MemberPose)],
    ) -> Result<Self, ExportError> {
        let sensors = StepRows::open(folder, RowTable::Sensors)?;
        let momenta = StepRows::open(folder, RowTable::Momenta)?;
        let [x, ..] = POSITION_NAMES;
        let mover = |(member, pose): &(&Member, MemberPose)| {
            let name = &member.name;
            let of = |kind: SensorKind| {
                let central = |s: &&Sensor| s.point.is_none_or(|at| at.iter().all(|x| *x == 0.0));
                let mut own = model.sensors.iter().filter(|s| s.kind == kind && s.of == *name);
                let sensor = own.find(central)?;
                sensors.as_ref()?.column(&format!("{}.{x}", sensor.name))
            };
            let momentum = |group: OutputColumn| {
                let first = format!("{}.{name}.{x}", group.name);
                momenta.as_ref()?.column(&first)
            };
            let columns = RateColumns {
                velocity: of(SensorKind::Velocity),
                angular_velocity: of(SensorKind::AngularVelocity),
                momenta: [PROJECTED, MOMENTUM].map(momentum),
            };
            let body = model.body(name);
            let inertia = body.map(|body| {
                let own = pose.directors.tr_mul(&body.rotation()); // to the directors
                own * body.inertia_tensor() * own.transpose()
            });
            let particle = model.particle(name).map(|particle| particle.mass);
            Mover {
                fixed: body.is_some_and(|body| body.fixed),
                kind: member.kind,
                columns,
                mass: body.map(holonom_model::Body::mass).or(particle).unwrap_or_default(),
                inverse_inertia: inertia.and_then(|inertia| inertia.try_inverse()),
            }
        };
        let movers = members.iter().map(mover).collect();
        Ok(Self { sensors, momenta, movers })
    }

    /// At a step, where the members are at `poses`.
    pub(super) fn at(&mut self, step: u64, poses: &[MemberPose]) -> Result<Vec<Rate>, ExportError> {
        let row = |file: &mut Option<StepRows>| -> Result<_, ExportError> {
            let Some(file) = file else { return Ok(None) };
            Ok(file.at(step)?.into_iter().next())
        };
        let (sensors, momenta) = (row(&mut self.sensors)?, row(&mut self.momenta)?);
        let rate = |(mover, pose): (&Mover, &MemberPose)| {
            mover.rate(sensors.as_ref(), momenta.as_ref(), pose)
        };
        Ok(self.movers.iter().zip(poses).map(rate).collect())
    }
}

impl Mover {
    fn rate(
        &self,
        sensors: Option<&csv::StringRecord>,
        momenta: Option<&csv::StringRecord>,
        pose: &MemberPose,
    ) -> Rate {
        let axes = self.kind.columns().len().min(3);
        let triple = |row: Option<&csv::StringRecord>, first: usize| {
            let mut found = [0.0; 3]; // the third is 0 in the plane
            for (k, value) in found.iter_mut().enumerate().take(axes) {
                *value = number(row?, first + k)?;
            }
            Some(found)
        };
        let sensor = |first: Option<usize>| triple(sensors, first?);
        let still = self.fixed.then_some([0.0; 3]);
        let mut own = self.columns.momenta.iter().flatten().copied();
        let first = own.find(|first| triple(momenta, *first).is_some());
        let momentum = first.and_then(|first| triple(momenta, first));
        let of_momentum = || {
            let velocity = momentum?.map(|p| p / self.mass);
            velocity.iter().all(|v| v.is_finite()).then_some(velocity)
        };
        let of_momenta = || {
            let mut angular = Vector3::zeros();
            for k in 0..3 {
                let p = Vector3::from(triple(momenta, first? + 3 * (k + 1))?);
                angular += pose.directors.column(k).cross(&p);
            }
            let along = self.inverse_inertia? * pose.directors.tr_mul(&angular);
            let omega: [f64; 3] = (pose.directors * along).into();
            omega.iter().all(|w| w.is_finite()).then_some(omega)
        };
        let frame = self.kind == MemberKind::Frame;
        Rate {
            velocity: sensor(self.columns.velocity).or(still).or_else(of_momentum),
            angular_velocity: match frame {
                true => sensor(self.columns.angular_velocity).or(still).or_else(of_momenta),
                false => None,
            },
            momentum,
        }
    }
}
