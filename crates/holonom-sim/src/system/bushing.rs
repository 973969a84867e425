//! `[[bushing]]` of a model as forces of the mechanism.

use super::law_fault::LawFault;
use super::names::Names;
use super::signal::network::{Network, NumberSource};
use super::signal::{Needed, Terms, refusal};
use holonom_model::{
    Bushing, BushingRotation, Coefficients, Formula, Model, ModelError, Quantities, Quantity, SIX,
};
use std::sync::Arc;
use vi_multibody::builder::{ForceElements, MechanismBuilder, Read};
use vi_multibody::bushing::LinearSix;
use vi_multibody::six_coordinates::{LARGEST_ANGLE, Matrix6, Rotation, SixCoordinates, Vector6};

/// An entry of a matrix that is no number: row, column, expression.
type StatedEntry<'a> = (usize, usize, &'a Formula);

/// `τ = preload − K ξ − C ξ̇` with entries that are expressions, or six expressions.
struct StatedBushing<'a> {
    bushing: &'a Bushing,
    constant: LinearSix,
    stiffness: Vec<StatedEntry<'a>>,
    damping: Vec<StatedEntry<'a>>,
}

impl<'a> StatedBushing<'a> {
    fn new(bushing: &'a Bushing, quantities: &Quantities<'_>) -> Result<Self, ModelError> {
        let mut constant = LinearSix {
            preload: Vector6::from(bushing.preload.unwrap_or_default()),
            ..LinearSix::default()
        };
        let split = |own: &'a Option<Coefficients>, constant: &mut Matrix6| {
            let mut entries = Vec::new();
            for (row, column, formula) in own.iter().flat_map(Coefficients::entries) {
                let program = quantities.compile(formula, &SIX, &mut Vec::new());
                let program = program.map_err(|error| refusal(&key(bushing), error))?;
                match program.constant() {
                    Some(value) => constant[(row, column)] = value,
                    None => entries.push((row, column, formula)),
                }
            }
            Ok::<_, ModelError>(entries)
        };
        let stiffness = split(&bushing.stiffness, &mut constant.stiffness)?;
        let damping = split(&bushing.damping, &mut constant.damping)?;
        Ok(Self { bushing, constant, stiffness, damping })
    }

    /// Whether its coefficients are constant.
    fn is_linear(&self) -> bool {
        self.stiffness.is_empty() && self.damping.is_empty() && self.bushing.force.is_none()
    }

    /// Whether its damping is constant and does no work, and nothing else reads a rate for certain.
    fn is_gyroscopic(&self, quantities: &Quantities<'_>) -> bool {
        let force = self.bushing.force.iter().flatten();
        let mut others = self.stiffness.iter().map(|(.., formula)| *formula).chain(force);
        let reads_rate = |formula: &Formula| {
            let mut reads = Vec::new();
            let program = quantities.compile(formula, &SIX, &mut reads);
            let own = program.is_ok_and(|own| (7..SIX.len()).any(|input| own.reads(input)));
            own || reads.iter().any(|read| read.is_rate() || matches!(read, Quantity::Signal(_)))
        };
        self.damping.is_empty()
            && self.constant.damping == -self.constant.damping.transpose()
            && !others.any(reads_rate)
    }

    /// The six efforts.
    fn efforts(
        &self,
        terms: &mut Terms<'_>,
        bushing: usize,
    ) -> Result<[Option<NumberSource>; 6], ModelError> {
        let (owner, key) = (format!("bushing `{}`", self.bushing.name), key(self.bushing));
        let mut own = vec![("t", NumberSource::Input(0))];
        for (part, name) in SIX.into_iter().skip(1).enumerate() {
            own.push((name, terms.input(Read::Six { bushing, part }, name.to_owned())));
        }
        let mut efforts = [None; 6];
        if let Some(force) = &self.bushing.force {
            for (effort, formula) in efforts.iter_mut().zip(force) {
                *effort = Some(terms.formula(&owner, &key, formula, &own)?);
            }
            efforts[0] = self.within_range(terms, efforts[0], &own);
            return Ok(efforts);
        }
        for (row, effort) in efforts.iter_mut().enumerate() {
            let (mut text, mut from) = (format!("{:?}", self.constant.preload[row]), own.clone());
            let parts = [
                ("x", &self.constant.stiffness, &self.stiffness),
                ("v", &self.constant.damping, &self.damping),
            ];
            let names: Vec<String> = (0..12).map(|k| format!("c{k}")).collect();
            for (of, (letter, constant, entries)) in parts.into_iter().enumerate() {
                for column in 0..6 {
                    let value = constant[(row, column)];
                    if value != 0.0 {
                        text += &format!(" - ({value:?})*{letter}{}", column + 1);
                    }
                    let entry = entries.iter().find(|own| (own.0, own.1) == (row, column));
                    let Some((.., formula)) = entry else { continue };
                    let factor = terms.formula(&owner, &key, formula, &own)?;
                    let name = &names[6 * of + column];
                    text += &format!(" - {name}*{letter}{}", column + 1);
                    from.push((name, factor));
                }
            }
            *effort = Some(terms.part(&owner, &text, &from));
        }
        efforts[0] = self.within_range(terms, efforts[0], &own);
        Ok(efforts)
    }

    /// The same, but not a number where the coordinates are out of range, whatever is read.
    fn within_range(
        &self,
        terms: &mut Terms<'_>,
        effort: Option<NumberSource>,
        own: &[(&'static str, NumberSource)],
    ) -> Option<NumberSource> {
        let (_, x1) = own[1];
        let owner = format!("bushing `{}`", self.bushing.name);
        effort.map(|effort| terms.part(&owner, "f + 0*x1", &[("f", effort), ("x1", x1)]))
    }
}

fn key(bushing: &Bushing) -> String {
    format!("bushing.{}", bushing.name)
}

/// Adds the bushings of a model; what knows why an expression of them has no value.
pub(super) fn add_bushings<'a>(
    builder: &mut MechanismBuilder,
    names: &Names<'a>,
    quantities: &Quantities<'_>,
    terms: &mut Terms<'a>,
) -> Result<Vec<Arc<Network>>, ModelError> {
    let mut laws = Vec::new();
    for (k, bushing) in names.model.bushings.iter().enumerate() {
        let own = StatedBushing::new(bushing, quantities)?;
        let law = match own.is_linear() {
            true => None,
            false => {
                let efforts = own.efforts(terms, k)?;
                Some(terms.needed(&efforts, own.is_gyroscopic(quantities)))
            }
        };
        let (from, to) = (names.frame(&bushing.from), names.frame(&bushing.to));
        let rotation = match bushing.rotation {
            BushingRotation::Vector => Rotation::Vector,
            BushingRotation::Tilt => Rotation::Tilt,
        };
        let entry = builder.bushing(from, to).named(&bushing.name).at(bushing.position);
        let entry = entry.attitude(bushing.axes()).rotation(rotation);
        match law {
            None => {
                let LinearSix { preload, stiffness, damping } = own.constant;
                let _ = entry.stiffness(stiffness).damping(damping).preload(preload);
            }
            Some(Needed { network, reads, states }) => {
                laws.push(network.clone());
                let _ = entry.law(reads, states, network);
            }
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
    let quantities = Quantities::new(model);
    let mut warnings = Vec::new();
    for bushing in &model.bushings {
        let Ok(own) = StatedBushing::new(bushing, &quantities) else { continue };
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
