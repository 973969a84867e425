//! `[[bushing]]` of a model as forces of the mechanism.

use super::law_fault::{LastFault, LawFault};
use super::names::Names;
use super::signal::refusal;
use holonom_model::expression::{Program, Undefined};
use holonom_model::{
    Bushing, BushingRotation, Coefficients, Curves, Formula, Model, ModelError, SIX,
};
use std::sync::Arc;
use vi_multibody::builder::{ForceElements, MechanismBuilder};
use vi_multibody::bushing::{LinearSix, SixInputs, SixLaw, SixSlopes};
use vi_multibody::six_coordinates::{LARGEST_ANGLE, Matrix6, Rotation, SixCoordinates, Vector6};

/// Inputs of its expressions: `t`, `x1` to `x6`, `v1` to `v6`.
const INPUTS: usize = SIX.len();

/// An entry of a matrix that is no number.
#[derive(Debug)]
struct Entry {
    row: usize,
    column: usize,
    program: Program,
}

/// `τ = preload − K ξ − C ξ̇` with entries that are expressions, or six expressions.
#[derive(Debug)]
pub(crate) struct BushingLaw {
    name: String,
    constant: LinearSix,
    stiffness: Vec<Entry>,
    damping: Vec<Entry>,
    force: Vec<Program>,
    dissipative: bool,
    fault: LastFault,
}

impl BushingLaw {
    fn new(bushing: &Bushing, curves: &Curves<'_>) -> Result<Self, ModelError> {
        let mut constant = LinearSix {
            preload: Vector6::from(bushing.preload.unwrap_or_default()),
            ..LinearSix::default()
        };
        let compile = |formula: &Formula| {
            let program = curves.compile(formula, &SIX);
            program.map_err(|error| refusal(&format!("bushing.{}", bushing.name), error))
        };
        let split = |own: &Option<Coefficients>, constant: &mut Matrix6| {
            let mut entries = Vec::new();
            for (row, column, formula) in own.iter().flat_map(Coefficients::entries) {
                let program = compile(formula)?;
                match program.constant() {
                    Some(value) => constant[(row, column)] = value,
                    None => entries.push(Entry { row, column, program }),
                }
            }
            Ok::<_, ModelError>(entries)
        };
        let stiffness = split(&bushing.stiffness, &mut constant.stiffness)?;
        let damping = split(&bushing.damping, &mut constant.damping)?;
        let force = bushing.force.iter().flatten().map(compile).collect::<Result<Vec<_>, _>>()?;
        let reads = |program: &Program| (7..INPUTS).any(|input| program.reads(input));
        let dissipative = constant.is_dissipative()
            || !damping.is_empty()
            || stiffness.iter().any(|entry| reads(&entry.program))
            || force.iter().any(reads);
        let (name, fault) = (bushing.name.clone(), LastFault::default());
        Ok(Self { name, constant, stiffness, damping, force, dissipative, fault })
    }

    /// Whether its coefficients are constant.
    fn is_linear(&self) -> bool {
        self.stiffness.is_empty() && self.damping.is_empty() && self.force.is_empty()
    }

    fn inputs(at: &SixInputs<'_>) -> [f64; INPUTS] {
        let mut y = [at.t; INPUTS];
        y[1..7].copy_from_slice(at.x.as_slice());
        y[7..].copy_from_slice(at.v.as_slice());
        y
    }

    fn programs(&self) -> impl Iterator<Item = &Program> {
        let entries = self.stiffness.iter().chain(&self.damping).map(|entry| &entry.program);
        entries.chain(&self.force)
    }

    fn label(&self) -> String {
        format!("bushing `{}`", self.name)
    }

    #[cold]
    fn note(&self, y: &[f64], program: &Program, undefined: &Undefined) -> f64 {
        self.fault.note(&self.label(), (program, undefined), &SIX, (y, y[0]))
    }

    fn value(&self, program: &Program, y: &[f64; INPUTS]) -> f64 {
        program.value(y).unwrap_or_else(|undefined| self.note(y, program, &undefined))
    }

    pub(super) fn fault(&self) -> Option<LawFault> {
        self.fault.get()
    }

    /// What jumps in it.
    pub(super) fn jumps(&self) -> (String, Vec<&'static str>) {
        (self.label(), self.programs().flat_map(Program::jumps).collect())
    }
}

/// Not a number where an expression has no value: the step is then refused.
impl SixLaw for BushingLaw {
    fn efforts(&self, at: &SixInputs<'_>) -> Vector6 {
        let y = Self::inputs(at);
        let mut efforts = self.constant.efforts(at);
        for (entries, factors) in [(&self.stiffness, &at.x), (&self.damping, &at.v)] {
            for Entry { row, column, program } in entries {
                efforts[*row] -= self.value(program, &y) * factors[*column];
            }
        }
        for (i, program) in self.force.iter().enumerate() {
            efforts[i] += self.value(program, &y);
        }
        efforts
    }

    fn slopes(&self, at: &SixInputs<'_>, by_far: &mut [Vector6]) -> SixSlopes {
        let y = Self::inputs(at);
        let mut all = self.constant.slopes(at, by_far);
        let mut slopes = [0.0; INPUTS];
        let gradient = |program: &Program, slopes: &mut [f64; INPUTS]| {
            program.gradient(&y, slopes).unwrap_or_else(|undefined| {
                slopes.fill(f64::NAN);
                self.note(&y, program, &undefined)
            })
        };
        let add = |row: usize, scale: f64, slopes: &[f64; INPUTS], all: &mut SixSlopes| {
            for k in 0..6 {
                all.by_coordinates[(row, k)] += scale * slopes[1 + k];
                all.by_rates[(row, k)] += scale * slopes[7 + k];
            }
        };
        for (rates, entries) in [(false, &self.stiffness), (true, &self.damping)] {
            for Entry { row, column, program } in entries {
                let value = gradient(program, &mut slopes);
                let factor = if rates { at.v[*column] } else { at.x[*column] };
                all.efforts[*row] -= value * factor;
                let by = if rates { &mut all.by_rates } else { &mut all.by_coordinates };
                by[(*row, *column)] -= value;
                add(*row, -factor, &slopes, &mut all);
            }
        }
        for (i, program) in self.force.iter().enumerate() {
            all.efforts[i] += gradient(program, &mut slopes);
            add(i, 1.0, &slopes, &mut all);
        }
        all
    }

    fn is_dissipative(&self) -> bool {
        self.dissipative
    }
}

/// Adds the bushings of a model; what knows why an expression of them has no value.
pub(super) fn add_bushings(
    builder: &mut MechanismBuilder,
    model: &Model,
    names: &Names<'_>,
) -> Result<Vec<Arc<BushingLaw>>, ModelError> {
    let curves = Curves::new(model);
    let mut laws = Vec::new();
    for bushing in &model.bushings {
        let own = BushingLaw::new(bushing, &curves)?;
        let (from, to) = (names.frame(&bushing.from), names.frame(&bushing.to));
        let rotation = match bushing.rotation {
            BushingRotation::Vector => Rotation::Vector,
            BushingRotation::Tilt => Rotation::Tilt,
        };
        let entry = builder.bushing(from, to).named(&bushing.name).at(bushing.position);
        let entry = entry.attitude(bushing.axes()).rotation(rotation);
        if own.is_linear() {
            let LinearSix { preload, stiffness, damping } = own.constant;
            let _ = entry.stiffness(stiffness).damping(damping).preload(preload);
        } else {
            let own = Arc::new(own);
            laws.push(own.clone());
            let _ = entry.law(Vec::new(), own);
        }
    }
    Ok(laws)
}

/// How far the frames of a bushing may turn.
#[derive(Clone, Debug)]
pub(crate) struct Range {
    name: String,
    coordinates: SixCoordinates,
}

impl Range {
    /// Those of all bushings of a model.
    pub(super) fn of(model: &Model, forces: &ForceElements) -> Vec<Arc<Self>> {
        let range = |bushing: &Bushing| {
            let coordinates = forces.bushing_coordinates(&bushing.name)?.clone();
            Some(Arc::new(Self { name: bushing.name.clone(), coordinates }))
        };
        model.bushings.iter().filter_map(range).collect()
    }

    pub(super) fn fault(&self) -> Option<LawFault> {
        let message = || {
            let name = &self.name;
            format!("bushing `{name}`: its frames are turned by more than {LARGEST_ANGLE} rad")
        };
        self.coordinates.beyond().map(|t| LawFault { t, message: message() })
    }
}

/// What is worth knowing of the matrices of bushings.
pub(crate) fn warnings(model: &Model) -> Vec<String> {
    let curves = Curves::new(model);
    let mut warnings = Vec::new();
    for bushing in &model.bushings {
        let Ok(own) = BushingLaw::new(bushing, &curves) else { continue };
        let parts = [
            (
                "stiffness",
                &own.constant.stiffness,
                own.stiffness.is_empty(),
                "it pushes away from where it is",
            ),
            ("damping", &own.constant.damping, own.damping.is_empty(), "it puts energy in"),
        ];
        for (key, matrix, constant, what) in parts {
            let symmetric = 0.5 * (matrix + matrix.transpose());
            let least = symmetric.symmetric_eigenvalues().min();
            if constant && least < -1e-12 * matrix.amax() {
                warnings.push(format!(
                    "bushing `{}`: the symmetric part of its {key} has the negative eigenvalue {least:.4e}: {what}",
                    bushing.name
                ));
            }
        }
    }
    warnings
}
