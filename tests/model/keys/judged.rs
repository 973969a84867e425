//! A run of a document as the judgements see it, and their deviations.

use holonom::model::ModelText;
use holonom::nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};
use holonom::run::prepare;
use holonom::sensor::SensorColumn;
use holonom::{Member, MemberKind, Model, RunOutcome, Sample};
use std::path::PathBuf;

/// What a document gives: its model and all nodes of its run.
pub(crate) struct Run {
    pub(crate) document: toml::Table,
    pub(crate) model: Model,
    pub(crate) nodes: Vec<Sample>,
    members: Vec<Member>,
    sensors: Vec<String>,
    energies: Vec<String>,
    pub(crate) facts: Facts,
}

/// What is known of a run beside its nodes.
pub(crate) struct Facts {
    pub(crate) dof: usize,
    pub(crate) divided_steps: u64,
    /// Names of the rates of the spanning tree, where momenta are recorded.
    pub(crate) rates: Option<Vec<String>>,
    /// Names of the rows of the constraints, likewise.
    pub(crate) constraints: Option<Vec<String>>,
    /// What is recorded of the members.
    pub(crate) columns: Vec<String>,
}

impl Run {
    /// Reads and runs a document with the files beside it; `Err` where it is refused or the run
    /// fails.
    pub(crate) fn of(
        case: &str,
        document: &toml::Table,
        files: &[(&'static str, String)],
    ) -> Result<Self, String> {
        let text = document.to_string();
        let model = if files.is_empty() {
            Model::from_toml(&text)
        } else {
            let folder = folder(case);
            for (name, text) in files {
                std::fs::write(folder.join(name), text).unwrap();
            }
            let file = folder.join("model.toml");
            std::fs::write(&file, &text).unwrap();
            ModelText::read(&file).model(&[])
        };
        let model = model.map_err(|error| error.to_string())?;
        let mut run = prepare(&model).map_err(|error| error.to_string())?;
        let mut nodes = Vec::new();
        let mut observe = |sample: &Sample| {
            nodes.push(sample.clone());
            Ok(())
        };
        match run.run(&mut observe, &mut |_, _| {}).unwrap() {
            RunOutcome::Done => {}
            RunOutcome::Failed(failure) => return Err(failure.message),
        }
        let sensors = run.sensors().columns().iter().map(SensorColumn::name).collect();
        let facts = Facts {
            dof: run.assembly().counts.dof,
            divided_steps: run.divided_steps().map_or(0, |divided| divided.count),
            rates: run.momenta_names().map(|names| names.rates),
            constraints: run.momenta_names().map(|names| names.constraints),
            columns: run.columns().iter().map(|column| format!("{column:?}")).collect(),
        };
        let (members, energies) = (run.members().to_vec(), run.energy_columns().to_vec());
        drop(run);
        Ok(Self { document: document.clone(), model, nodes, members, sensors, energies, facts })
    }

    pub(crate) fn steps(&self) -> usize {
        self.nodes.len()
    }

    pub(crate) fn last(&self) -> usize {
        self.nodes.len() - 1
    }

    pub(crate) fn t(&self, node: usize) -> f64 {
        self.nodes[node].t
    }

    /// A column of `sensors.csv`, which may have no such column: then nothing is a number.
    pub(crate) fn column(&self, name: &str) -> Vec<f64> {
        let k = self.sensors.iter().position(|own| own == name);
        self.nodes.iter().map(|node| k.map_or(f64::NAN, |k| node.sensors[k])).collect()
    }

    /// All columns of a sensor.
    pub(crate) fn columns_of(&self, sensor: &str) -> Vec<Vec<f64>> {
        let own = |name: &&String| name.split('.').next() == Some(sensor);
        self.sensors.iter().filter(own).map(|name| self.column(name)).collect()
    }

    pub(crate) fn sensor(&self, name: &str, node: usize) -> f64 {
        self.column(name)[node]
    }

    /// `NAME.x`, `NAME.y`, `NAME.z`.
    pub(crate) fn vector(&self, name: &str, node: usize) -> Vector3<f64> {
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.sensor(&format!("{name}.{axis}"), node));
        Vector3::new(x, y, z)
    }

    /// A column of `energy.csv`.
    pub(crate) fn energy(&self, name: &str) -> Vec<f64> {
        let k = self.energies.iter().position(|own| own == name);
        self.nodes.iter().map(|node| k.map_or(f64::NAN, |k| node.energies[k])).collect()
    }

    /// Coordinates of a member; nothing where it does not exist.
    pub(crate) fn coordinates(&self, name: &str, node: usize) -> &[f64] {
        let Some(k) = self.members.iter().position(|member| member.name == name) else {
            return &[];
        };
        let count = |member: &Member| member.kind.columns().len();
        let first: usize = self.members[..k].iter().map(count).sum();
        &self.nodes[node].q[first..first + count(&self.members[k])]
    }

    /// Where a member is.
    pub(crate) fn place(&self, name: &str, node: usize) -> Vector3<f64> {
        let own = self.coordinates(name, node);
        Vector3::from_fn(|i, _| {
            own.get(i).copied().unwrap_or(if i == 2 && own.len() == 2 { 0.0 } else { f64::NAN })
        })
    }

    /// Directors of a node of a beam, or principal axes of a body, as columns.
    pub(crate) fn directors(&self, name: &str, node: usize) -> Matrix3<f64> {
        let own = self.coordinates(name, node);
        Matrix3::from_fn(|i, j| own.get(3 + 3 * j + i).copied().unwrap_or(f64::NAN))
    }

    /// The rotation that an orientation sensor shows.
    pub(crate) fn rotation(&self, sensor: &str, node: usize) -> Matrix3<f64> {
        let [w, x, y, z] =
            ["w", "x", "y", "z"].map(|c| self.sensor(&format!("{sensor}.{c}"), node));
        UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z))
            .to_rotation_matrix()
            .into_inner()
    }

    pub(crate) fn members(&self) -> usize {
        self.members.len()
    }

    pub(crate) fn linear_momentum(&self, node: usize) -> Vector3<f64> {
        self.nodes[node].momentum.linear.into()
    }

    pub(crate) fn angular_momentum(&self, node: usize) -> Vector3<f64> {
        self.nodes[node].momentum.angular.into()
    }

    /// How many members have directors.
    pub(crate) fn frames(&self) -> usize {
        self.members.iter().filter(|member| member.kind == MemberKind::Frame).count()
    }
}

fn folder(case: &str) -> PathBuf {
    let name: String = case.chars().map(|c| if c.is_alphanumeric() { c } else { '_' }).collect();
    let path = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("keys").join(name);
    std::fs::create_dir_all(&path).unwrap();
    path
}

/// Deviations in tolerances.
#[derive(Default)]
pub(crate) struct Checks(Vec<(String, f64)>);

impl Checks {
    /// A number.
    pub(crate) fn near(&mut self, what: &str, found: f64, expected: f64, tolerance: f64) {
        self.all(what, &[found], &[expected], tolerance);
    }

    /// Numbers, all with the same tolerance.
    pub(crate) fn all(&mut self, what: &str, found: &[f64], expected: &[f64], tolerance: f64) {
        let off = |(a, b): (&f64, &f64)| (a - b).abs() / tolerance;
        let worst = found.iter().zip(expected).map(off);
        let worst = worst.fold(0.0, |a: f64, b| if a >= b { a } else { b }); // NaN if one is NaN
        let known = found.len() == expected.len() && !found.is_empty() && !worst.is_nan();
        self.0.push((what.to_owned(), if known { worst } else { f64::INFINITY }));
    }

    pub(crate) fn vector(
        &mut self,
        what: &str,
        found: Vector3<f64>,
        expected: Vector3<f64>,
        tolerance: f64,
    ) {
        self.all(what, found.as_slice(), expected.as_slice(), tolerance);
    }

    pub(crate) fn matrix(
        &mut self,
        what: &str,
        found: Matrix3<f64>,
        expected: Matrix3<f64>,
        tolerance: f64,
    ) {
        self.all(what, found.as_slice(), expected.as_slice(), tolerance);
    }

    pub(crate) fn holds(&mut self, what: &str, holds: bool) {
        self.0.push((what.to_owned(), if holds { 0.0 } else { f64::INFINITY }));
    }

    /// The largest deviation.
    pub(crate) fn worst(self) -> (String, f64) {
        let larger = |a: (String, f64), b: (String, f64)| if b.1 > a.1 { b } else { a };
        self.0.into_iter().fold(("nothing".into(), 0.0), larger)
    }
}
