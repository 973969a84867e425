//! The verifier, verified: integrators with one defect each, and the criterion that must find it.
//!
//! | file | defects |
//! |---|---|
//! | `output` | integrators that step rightly and report wrongly |
//! | `integrator` | variational integrators with one wrong part |
//! | `energy_momentum` | energy–momentum schemes with one wrong part |
//! | here | kernels that read a key of a neighbour |
//! | [`list`], [`table`] | all of them, on their systems; against all criteria |

mod energy_momentum;
mod integrator;
pub mod list;
mod output;
pub mod table;

pub use energy_momentum::EmDefect;
pub use integrator::IntegratorDefect;
pub use output::OutputDefect;

use super::closed_forms::curved_cantilever;
use super::exact::{self, Exact};
use holonom::Model;
use holonom::certificate::subject::ModelSubject;
use holonom::verification::certificate::{Certificate, Criterion, Finding, Verdict};
use holonom::verification::certify::{MeasurementPlan, certify};
use holonom::verification::convergence::Horizon;
use holonom::verification::subject::{
    Initial, NodeValues, RunningMotion, SchemeSetting, SteppingMethod, Subject,
};
use holonom::vi_constraints::SchemeKind;
use holonom::vi_emscheme::EmForm;
use output::Misreporting;

/// The systems that mutants are made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Base {
    /// A cone on its tip in steady precession; exact motion.
    Top,
    /// A planar pendulum in uniform rotation; exact motion.
    Pendulum,
    /// A free rigid body.
    FreeBody,
    /// A four-bar linkage with three redundant constraints.
    FourBar,
    /// Two bodies joined by a pair, on springs.
    Pair(usize),
    /// A soft curved cantilever.
    Beam,
    /// The pair of bodies on a quartic spring, for energy–momentum schemes.
    Quartic,
    /// Two links with a spring, a damper and a motor on each hinge.
    Arm,
}

/// What is wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Defect {
    /// Nothing.
    None,
    /// A report.
    Output(OutputDefect),
    /// A part of a variational integrator.
    Integrator(IntegratorDefect),
    /// A part of an energy–momentum scheme.
    EnergyMomentum(EmDefect),
    /// The chord in the place of the arc length of an element.
    Chord,
    /// The kernel of the method reads this in the place of that, as if it were wired to a
    /// neighbour; the other methods do not.
    Wiring(&'static str, &'static str),
}

/// An integrator with a defect, and where it must be found.
#[derive(Clone, Debug)]
pub struct Mutant {
    /// What is wrong, in words.
    pub name: &'static str,
    /// On which system.
    pub base: Base,
    /// What is wrong.
    pub defect: Defect,
    /// The method with its order.
    pub method: (SteppingMethod, u32),
    /// What must find it.
    pub criterion: Criterion,
    /// In which quantity.
    pub quantity: &'static str,
}

/// The pairs in the order of [`Base::Pair`].
pub(super) use super::cases::PAIRS;

impl Base {
    /// Its name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Top => "heavy_top",
            Self::Pendulum => "pendulum_free",
            Self::FreeBody => "free_body",
            Self::FourBar => "four_bar",
            Self::Pair(k) => PAIRS[k].0,
            Self::Beam => "soft_cantilever",
            Self::Quartic => "pair on a quartic spring",
            Self::Arm => "damped_arm",
        }
    }

    fn text(self) -> String {
        let pair = |k: usize| {
            let (_, pair, axes) = PAIRS[k];
            include_str!("../../../models/pair.toml").replace("PAIR", pair).replace("AXES\n", axes)
        };
        match self {
            Self::Top => include_str!("../../../../examples/models/heavy_top_steady.toml").into(),
            Self::Pendulum => include_str!("../../../../examples/models/pendulum_free.toml").into(),
            Self::FreeBody => include_str!("../../../../examples/models/free_body.toml").into(),
            Self::FourBar => include_str!("../../../models/four_bar.toml").into(),
            Self::Pair(k) => pair(k),
            Self::Quartic => pair(1),
            Self::Beam => include_str!("../../../models/soft_cantilever.toml").into(),
            Self::Arm => include_str!("../../../models/damped_arm.toml").into(),
        }
    }

    /// End of the convergence study (s), its coarsest and finest number of steps, the step of
    /// everything else (s), steps of the long run.
    fn numbers(self) -> (f64, u32, u32, f64, u64) {
        match self {
            Self::Top => (0.02, 16, 1024, 1e-4, 10_000),
            Self::Pendulum => (1.0, 8, 256, 0.02, 10_000),
            Self::FreeBody => (4.0, 8, 512, 0.05, 10_000),
            Self::FourBar => (0.4, 8, 256, 0.004, 8192),
            Self::Pair(_) | Self::Quartic | Self::Arm => (0.5, 8, 256, 0.01, 8192),
            Self::Beam => (0.5, 16, 256, 0.02, 2048),
        }
    }

    /// The system with another text in the place of one of its own.
    fn wired(self, from: &str, to: &str) -> Result<Box<dyn Subject>, String> {
        let text = self.text();
        if !text.contains(from) {
            return Err(format!("{}: no `{from}`", self.name()));
        }
        let model = Model::from_toml(&text.replacen(from, to, 1));
        let model = model.map_err(|e| format!("{}: {e}", self.name()))?;
        Ok(Box::new(ModelSubject::new(model)))
    }

    fn sound(self) -> Result<Box<dyn Subject>, String> {
        let model = self.model()?;
        let exact = match self {
            Self::Top => Some(exact::steady_top as exact::ExactMotion),
            Self::Pendulum => Some(exact::uniform_rotation as exact::ExactMotion),
            _ => None,
        };
        let subject = ModelSubject::new(model);
        Ok(match exact {
            Some(motion) => Box::new(Exact::new(subject, motion)?),
            None => Box::new(subject),
        })
    }

    fn model(self) -> Result<Model, String> {
        Model::from_toml(&self.text()).map_err(|e| format!("{}: {e}", self.name()))
    }

    fn plan(self, method: (SteppingMethod, u32), criteria: &[Criterion]) -> MeasurementPlan {
        let (end, coarsest, finest, step, long) = self.numbers();
        let (method, order) = method;
        let mut methods = vec![(method, vec![order])];
        if method == SteppingMethod::NODAL && criteria.contains(&Criterion::Agreement) {
            methods.push((SteppingMethod::Variational(SchemeKind::Dalembert), vec![]));
        }
        MeasurementPlan {
            methods,
            horizon: Horizon { end, coarsest, finest },
            step,
            long,
            short: 2048,
            meant: u64::MAX,
            own: None,
            few: 64,
            criteria: criteria.to_vec(),
        }
    }
}

/// A system whose integrator has a defect.
struct Broken {
    base: Base,
    defect: Defect,
    sound: Box<dyn Subject>,
    /// What the method reads, where that is another system.
    wired: Option<(SteppingMethod, Box<dyn Subject>)>,
    model: Model,
}

impl Subject for Broken {
    fn start_from(
        &self,
        setting: SchemeSetting,
        at: Option<Initial<'_>>,
    ) -> Result<Box<dyn RunningMotion>, String> {
        if let Some((_, wired)) = self.wired.as_ref().filter(|(own, _)| *own == setting.method) {
            return wired.start_from(setting, at);
        }
        let inner = |setting| match (self.base, setting) {
            (Base::Quartic, SchemeSetting { method: SteppingMethod::EnergyMomentum(_), .. }) => {
                energy_momentum::start(&self.model, None, setting, at)
            }
            _ => self.sound.start_from(setting, at),
        };
        match self.defect {
            Defect::Output(defect) => {
                let h = setting.step;
                Ok(Box::new(Misreporting { inner: inner(setting)?, defect, h, steps: 0 }))
            }
            Defect::Integrator(defect) => integrator::start(&self.model, defect, setting, at),
            Defect::EnergyMomentum(defect) => {
                energy_momentum::start(&self.model, Some(defect), setting, at)
            }
            Defect::None | Defect::Chord | Defect::Wiring(..) => inner(setting),
        }
    }

    fn exact(&self, t: f64) -> Option<NodeValues> {
        self.sound.exact(t)
    }
}

/// The certificate of a system with a defect, by some criteria.
///
/// # Errors
/// Why the system cannot be built, in words.
pub fn certificate(
    base: Base,
    defect: Defect,
    method: (SteppingMethod, u32),
    criteria: &[Criterion],
) -> Result<Certificate, String> {
    let wired = match defect {
        Defect::Wiring(from, to) => Some((method.0, base.wired(from, to)?)),
        _ => None,
    };
    let subject = Broken { base, defect, sound: base.sound()?, wired, model: base.model()? };
    let plan = base.plan(method, criteria);
    let mut certificate = certify(&subject, base.name(), &plan, &mut |_| {});
    if base == Base::Beam && criteria.contains(&Criterion::ClosedForm) {
        certificate.findings.push(closed_form(defect));
    }
    Ok(certificate)
}

fn closed_form(defect: Defect) -> Finding {
    curved_cantilever(&|mesh| {
        if defect == Defect::Chord {
            let chords = mesh.centers.windows(2).map(|ends| (ends[1] - ends[0]).norm());
            mesh.lengths = chords.collect();
        }
    })
}

impl Mutant {
    /// Whether its criterion finds it, in the quantity that it is about.
    ///
    /// # Errors
    /// As [`certificate`].
    pub fn is_found(&self) -> Result<bool, String> {
        let certificate = self.certificate(&[self.criterion])?;
        let found = self.names_it(&certificate);
        if !found {
            let (name, base) = (self.name, self.base.name());
            certificate.findings.iter().for_each(|f| println!("{name} on {base}: {f}"));
        }
        Ok(found)
    }

    /// Its certificate by some criteria.
    ///
    /// # Errors
    /// As [`certificate`].
    pub fn certificate(&self, criteria: &[Criterion]) -> Result<Certificate, String> {
        certificate(self.base, self.defect, self.method, criteria)
    }

    /// Whether a criterion fails.
    #[must_use]
    pub fn finds(&self, certificate: &Certificate, criterion: Criterion) -> bool {
        certificate.failures(criterion).next().is_some()
    }

    fn names_it(&self, certificate: &Certificate) -> bool {
        certificate.failures(self.criterion).any(|f| f.quantity == self.quantity)
    }
}

/// What a sound system passes: criterion and quantity of every finding.
///
/// # Errors
/// As [`certificate`], or the first failure.
pub fn passes(
    base: Base,
    method: (SteppingMethod, u32),
) -> Result<Vec<(Criterion, String)>, String> {
    let certificate = certificate(base, Defect::None, method, &Criterion::ALL)?;
    if let Some(failed) = certificate.findings.iter().find(|f| f.verdict == Verdict::Fail) {
        return Err(format!("{}: {failed}", base.name()));
    }
    let passed = certificate.findings.iter().filter(|f| f.verdict == Verdict::Pass);
    Ok(passed.map(|f| (f.criterion, f.quantity.clone())).collect())
}

/// A form of the energy–momentum scheme.
#[must_use]
pub(super) fn em(form: EmForm) -> (SteppingMethod, u32) {
    (SteppingMethod::EnergyMomentum(form), 2)
}
