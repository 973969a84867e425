//! `contacts.csv`: contacts of bodies at the nodes of `trajectory.csv`, where the model asks for
//! them.
//!
//! ```text
//! step,t,contact,a,b,feature,x,y,z,nx,ny,nz,gap,normal,tx,ty,tz,slip,state,unique        m, N, m/s
//! ```
//! One row for each contact that transmits a force: the point, the normal from `a` to `b`, the gap,
//! the force on `b` along the normal and across it, in space, the slip of the step from the node.
//! The force is the impulse of the node over the mean of both adjacent steps; `unique` says which
//! part of it follows from the motion.

use std::io::{self, Write};

use serde::Deserialize;
use vi_constraints::nonsmooth::Unique;

use super::columns::CONTACT_COLUMNS;
use super::csv::HEAD;
use super::rows::{RowBlocks, RowField, quoted};
use crate::run::contacts::{ContactPhase, ContactSample};
use crate::sample::Sample;
use crate::system::contact_origin::{ContactOrigin, FeatureSides, TouchingShapes};

/// A row of `contacts.csv`.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[allow(missing_docs)] // the columns of the file
pub struct ContactRow {
    pub step: u64,
    pub t: f64,
    pub contact: String,
    pub a: String,
    pub b: String,
    pub feature: u32,
    pub x: f64,
    pub y: f64,
    pub z: f64,
    pub nx: f64,
    pub ny: f64,
    pub nz: f64,
    pub gap: f64,
    pub normal: f64,
    pub tx: f64,
    pub ty: f64,
    pub tz: f64,
    pub slip: f64,
    pub state: ContactPhase,
    #[serde(default)]
    pub unique: Option<Unique>,
}

impl ContactRow {
    /// Where it is, m.
    #[must_use]
    pub fn point(&self) -> [f64; 3] {
        [self.x, self.y, self.z]
    }

    /// The force on `b` in space, N.
    #[must_use]
    pub fn force(&self) -> [f64; 3] {
        let Self { normal, nx, ny, nz, tx, ty, tz, .. } = self;
        [normal * nx + tx, normal * ny + ty, normal * nz + tz]
    }
}

/// Reads `contacts.csv`.
///
/// # Errors
/// Those of the file, and `InvalidData` for rows of another shape.
pub(super) fn read(file: impl io::Read) -> io::Result<Vec<ContactRow>> {
    let mut rows = csv::Reader::from_reader(file);
    rows.deserialize().map(|row| row.map_err(io::Error::from)).collect()
}

/// Writes `contacts.csv`, whole rows only.
#[derive(Debug)]
pub struct ContactWriter<W: Write> {
    rows: RowBlocks<W>,
    shapes: Vec<Option<TouchingShapes>>, // of each element
}

impl<W: Write> ContactWriter<W> {
    /// Writes the header; `origins`: the elements with impulses of the model.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn new(sink: W, origins: &[ContactOrigin]) -> io::Result<Self> {
        let shapes = origins.iter().map(|origin| origin.shapes().cloned()).collect();
        let mut writer = Self { rows: RowBlocks::new(sink), shapes };
        let own = CONTACT_COLUMNS.iter().map(|column| column.name);
        writer.rows.push(|row| row.write_record(HEAD.into_iter().chain(own)))?;
        writer.rows.flush()?; // a run that fails at once leaves a file with a header
        Ok(writer)
    }

    /// Writes one node.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn record(&mut self, sample: &Sample) -> io::Result<()> {
        for contact in &sample.contacts {
            let Some(shapes) = &self.shapes[contact.element as usize] else { continue };
            let ContactSample { feature, point, axes, gap, force, slip, state, unique, .. } =
                contact;
            let FeatureSides { a, b, number, .. } = shapes.sides(*feature);
            let [name, a, b] = [&shapes.contact, a, b].map(quoted);
            let [name, a, b] = [name?, a?, b?];
            let [name, a, b] = [&name, &a, &b].map(|own| RowField::Text(own));
            let head = [RowField::Number(sample.t), name, a, b];
            let feature = RowField::Index(number as usize);
            let place = point.iter().chain(&axes[0]).chain([gap, &force[0]]);
            let across = contact.across();
            let numbers = place.chain(&across).chain([slip]).map(|x| RowField::Number(*x));
            let fields = head.into_iter().chain([feature]).chain(numbers);
            let unique = unique.map_or("", Unique::name);
            let names = [state.name(), unique].map(RowField::Text);
            self.rows.fields(sample.step, fields.chain(names))?;
        }
        Ok(())
    }

    /// Hands all rows to the file.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn flush(&mut self) -> io::Result<()> {
        self.rows.flush()
    }
}
