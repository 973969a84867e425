//! `contacts.csv`: contacts of bodies at the nodes of `trajectory.csv`, where the model asks for
//! them.
//!
//! ```text
//! step,t,contact,a,b,feature,x,y,z,nx,ny,nz,gap,normal,tx,ty,tz,slip,state        m, N, m/s
//! ```
//! One row for each contact that transmits a force: the point, the normal from `a` to `b`, the gap,
//! the force on `b` along the normal and across it, in space, the slip of the step from the node.
//! The force is the impulse of the node over the mean of both adjacent steps.

use std::io::{self, Write};

use super::columns::CONTACT_COLUMNS;
use super::csv::HEAD;
use super::rows::{RowBlocks, RowField, quoted};
use crate::run::contacts::ContactSample;
use crate::sample::Sample;
use crate::system::contact_origin::ContactOrigin;

/// Writes `contacts.csv`, whole rows only.
#[derive(Debug)]
pub struct ContactWriter<W: Write> {
    rows: RowBlocks<W>,
    names: Vec<Option<([String; 3], u32)>>, // contact, a and b as fields, first feature
}

impl<W: Write> ContactWriter<W> {
    /// Writes the header; `origins`: the elements with impulses of the model.
    ///
    /// # Errors
    /// Errors of the file.
    pub fn new(sink: W, origins: &[ContactOrigin]) -> io::Result<Self> {
        let names = |origin: &ContactOrigin| {
            let Some(shapes) = origin.shapes() else { return Ok(None) };
            let [contact, a, b] = [&shapes.contact, &shapes.a, &shapes.b].map(|own| quoted(own));
            Ok(Some(([contact?, a?, b?], shapes.first)))
        };
        let names = origins.iter().map(names).collect::<io::Result<_>>()?;
        let mut writer = Self { rows: RowBlocks::new(sink), names };
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
            let Some((names, first)) = &self.names[contact.element as usize] else { continue };
            let ContactSample { feature, point, axes, gap, force, slip, state, .. } = contact;
            let [name, a, b] = [0, 1, 2].map(|k| RowField::Text(&names[k]));
            let head = [RowField::Number(sample.t), name, a, b];
            let feature = RowField::Index((first + feature) as usize);
            let place = point.iter().chain(&axes[0]).chain([gap, &force[0]]);
            let across = contact.across();
            let numbers = place.chain(&across).chain([slip]).map(|x| RowField::Number(*x));
            let fields = head.into_iter().chain([feature]).chain(numbers);
            self.rows.fields(sample.step, fields.chain([RowField::Text(state.name())]))?;
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
