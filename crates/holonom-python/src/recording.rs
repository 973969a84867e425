//! The nodes of a run, as arrays.

use holonom::Beams;
use holonom::Reading;
use holonom::experiment::RunnableModel;
use holonom::output::columns::{RESIDUALS, TAIL, UNSTABLE, names};
use holonom::output::{momenta_columns, momenta_values};
use holonom::sample::{MomentaNames, Sample};
use numpy::ndarray::{Array2, Array3};
use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::no_word;

/// What is kept of a node beside its time; energies and momentum maps with energies, residuals or
/// momenta.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct KeptNode {
    q: bool,
    energy: bool,
    sensors: bool,
    beams: bool,
    residuals: bool,
    momenta: bool,
}

impl KeptNode {
    const WORDS: [&str; 6] = ["q", "energy", "sensors", "beams", "residuals", "momenta"];

    /// What is read for these parts.
    pub(crate) fn reading(self) -> Reading {
        let Self { sensors, energy, residuals, momenta, .. } = self;
        Reading { sensors, quantities: energy || residuals || momenta }
    }

    /// These parts; all of them where nothing is said.
    pub(crate) fn of(words: Option<Vec<String>>) -> PyResult<Self> {
        let all = || Self::WORDS.map(str::to_owned).into();
        let mut kept = Self::default();
        for word in words.unwrap_or_else(all) {
            match word.as_str() {
                "q" => kept.q = true,
                "energy" => kept.energy = true,
                "sensors" => kept.sensors = true,
                "beams" => kept.beams = true,
                "residuals" => kept.residuals = true,
                "momenta" => kept.momenta = true,
                other => return Err(no_word("record", other, &Self::WORDS)),
            }
        }
        Ok(kept)
    }
}

/// A table without its first columns, row after row.
#[derive(Debug, Default)]
struct RecordedTable {
    columns: Vec<String>,
    values: Vec<f64>,
}

impl RecordedTable {
    fn new(columns: Vec<String>) -> Self {
        Self { columns, values: Vec::new() }
    }

    /// Columns and values `(K, columns)`.
    fn into_python<'py>(
        self,
        py: Python<'py>,
        rows: usize,
    ) -> PyResult<(Vec<String>, Bound<'py, PyAny>)> {
        let Self { columns, values } = self;
        let array = Array2::from_shape_vec((rows, columns.len()), values).map_err(shape)?;
        Ok((columns, array.into_pyarray(py).into_any()))
    }
}

fn shape(error: impl ToString) -> PyErr {
    PyRuntimeError::new_err(error.to_string())
}

/// The sections of a beam over time.
#[derive(Debug, Default)]
struct BeamTable {
    name: String,
    elements: Vec<u64>,
    arc_lengths: Vec<f64>,
    values: Vec<f64>,
}

/// The nodes of a run so far.
#[derive(Debug)]
pub(crate) struct Recording {
    steps: Vec<u64>,
    times: Vec<f64>,
    q: Option<RecordedTable>,
    tail: Option<RecordedTable>,
    residuals: Option<RecordedTable>,
    energy: Option<RecordedTable>,
    sensors: Option<RecordedTable>,
    own_sensors: usize, // columns; others are those of what is observed
    momenta: Option<(MomentaNames, RecordedTable)>,
    beams: Option<Beams>,
    sections: Vec<BeamTable>,
}

impl Recording {
    /// `own_sensors`: columns of the sensors of the model, the first ones.
    pub(crate) fn new(experiment: &dyn RunnableModel, kept: KeptNode, own_sensors: usize) -> Self {
        let owned =
            |names: &[&str]| RecordedTable::new(names.iter().map(|n| (*n).to_owned()).collect());
        let members = experiment.members().iter();
        let coordinates = members.flat_map(|member| {
            member.kind.columns().iter().map(|column| format!("{}.{column}", member.name))
        });
        let mut residuals = owned(&names(&RESIDUALS));
        if experiment.statics().is_some() {
            residuals.columns.push(UNSTABLE.name.to_owned());
        }
        let energies = experiment.energy_columns().to_vec();
        let sensors = experiment.sensors().columns();
        let sensors: Vec<String> =
            sensors.iter().take(own_sensors).map(|column| column.name()).collect();
        let with =
            |columns: Vec<String>| (!columns.is_empty()).then(|| RecordedTable::new(columns));
        let beams = experiment.beams();
        let section = |name: &str| BeamTable { name: name.to_owned(), ..BeamTable::default() };
        let sections = beams.list.iter().map(|beam| section(&beam.name)).collect();
        let momenta = experiment.momenta_names().filter(|_| kept.momenta);
        Self {
            steps: Vec::new(),
            times: Vec::new(),
            q: kept.q.then(|| RecordedTable::new(coordinates.collect())),
            tail: kept.reading().quantities.then(|| owned(&names(&TAIL))),
            residuals: kept.residuals.then_some(residuals),
            energy: with(energies).filter(|_| kept.energy),
            sensors: with(sensors).filter(|_| kept.sensors),
            own_sensors,
            momenta: momenta.map(|names| {
                let columns = momenta_columns(&names);
                (names, RecordedTable::new(columns))
            }),
            beams: (kept.beams && !beams.list.is_empty()).then(|| beams.clone()),
            sections,
        }
    }

    /// Makes place for this many nodes; memory that there is not is asked for as they come.
    pub(crate) fn reserve(&mut self, nodes: usize) {
        let tables =
            [&mut self.q, &mut self.tail, &mut self.residuals, &mut self.energy, &mut self.sensors];
        let momenta = self.momenta.as_mut().map(|(_, table)| table);
        let mut reserved = self.times.try_reserve(nodes).and(self.steps.try_reserve(nodes));
        for table in tables.into_iter().flatten().chain(momenta) {
            reserved = reserved.and(table.values.try_reserve(nodes * table.columns.len()));
        }
        let _ = reserved; // a hint
    }

    /// Bytes of its arrays for one node.
    pub(crate) fn bytes_of_a_node(&self) -> u64 {
        let tables = [&self.q, &self.tail, &self.residuals, &self.energy, &self.sensors];
        let momenta = self.momenta.as_ref().map(|(_, table)| table);
        let columns = tables.into_iter().flatten().chain(momenta).map(|table| table.columns.len());
        let elements: usize = match &self.beams {
            Some(beams) => {
                let legs = beams.list.iter().flat_map(|beam| &beam.legs);
                legs.map(|leg| leg.elements.len()).sum()
            }
            None => 0,
        };
        8 * (2 + columns.sum::<usize>() + 12 * elements) as u64 // with step and time
    }

    /// Takes a node.
    pub(crate) fn record(&mut self, sample: &Sample) {
        let first = self.steps.is_empty();
        self.steps.push(sample.step);
        self.times.push(sample.t);
        let add = |table: &mut Option<RecordedTable>, values: &[f64]| {
            table.iter_mut().for_each(|table| table.values.extend_from_slice(values));
        };
        add(&mut self.q, &sample.q);
        add(&mut self.energy, &sample.energies);
        let own = self.own_sensors.min(sample.sensors.len());
        add(&mut self.sensors, &sample.sensors[..own]);
        if let Some(table) = &mut self.tail {
            table.values.extend([sample.energy, sample.hamiltonian]);
            table.values.extend(sample.momentum.angular.iter().chain(&sample.momentum.linear));
        }
        if let Some(table) = &mut self.residuals {
            let own = &sample.residuals;
            let levels = [own.position, own.velocity, own.momentum, sample.newton_iterations];
            let is_static = table.columns.len() > levels.len();
            let unstable = sample.unstable.map_or(f64::NAN, |count| count as f64);
            table.values.extend(levels.into_iter().chain(is_static.then_some(unstable)));
        }
        if let Some((names, table)) = &mut self.momenta {
            let none = holonom::Momenta::default();
            let found = sample.momenta.as_deref().unwrap_or(&none);
            let values = momenta_values(found, names).map(|value| value.unwrap_or(f64::NAN));
            table.values.extend(values);
        }
        if let Some(beams) = &self.beams {
            for (beam, table) in beams.list.iter().zip(&mut self.sections) {
                beams.for_each_state(beam, &sample.q, |state| {
                    if first {
                        table.elements.push(state.element as u64);
                        table.arc_lengths.push(state.arc_length);
                    }
                    let strains = [state.shear_extension, state.curvature];
                    let stresses = [state.force, state.moment];
                    table.values.extend(strains.iter().chain(&stresses).flatten());
                });
            }
        }
    }

    /// A dictionary of arrays; those of tables with the names of their columns.
    pub(crate) fn into_python(self, py: Python<'_>) -> PyResult<Bound<'_, PyDict>> {
        let Self { steps, times, q, tail, residuals, energy, sensors, momenta, .. } = self;
        let Self { beams, sections, .. } = self;
        let (rows, found) = (times.len(), PyDict::new(py));
        found.set_item("step", PyArray1::from_vec(py, steps))?;
        found.set_item("t", PyArray1::from_vec(py, times))?;
        let momenta = momenta.map(|(_, table)| table);
        let tables = [
            ("q", q),
            ("tail", tail),
            ("residuals", residuals),
            ("energy", energy),
            ("sensors", sensors),
            ("momenta", momenta),
        ];
        for (name, table) in tables {
            if let Some(table) = table {
                found.set_item(name, table.into_python(py, rows)?)?;
            }
        }
        if beams.is_some() {
            let places = PyDict::new(py);
            for BeamTable { name, elements, arc_lengths, values } in sections {
                let shape_of = (rows, elements.len(), 12);
                let values = Array3::from_shape_vec(shape_of, values).map_err(shape)?;
                let (elements, arc_lengths) =
                    (PyArray1::from_vec(py, elements), PyArray1::from_vec(py, arc_lengths));
                places.set_item(name, (elements, arc_lengths, values.into_pyarray(py)))?;
            }
            found.set_item("beams", places)?;
        }
        Ok(found)
    }
}
