//! Where the centres of the sections of beams are, as the matrices have them.

use holonom_model::{Beam, Model};
use serde::{Deserialize, Serialize};

/// The centres of a section, along `d_1` and `d_2` from the line of the nodes, m.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SectionCenters {
    /// The beam.
    pub beam: String,
    /// Arc length of the place, m.
    pub at: f64,
    /// Where tension bends nothing.
    pub tension: [f64; 2],
    /// Where shear forces twist nothing.
    pub shear: [f64; 2],
    /// Of the mass.
    pub mass: [f64; 2],
}

/// At start, middle and end of all beams one of whose centres is off the line of the nodes.
pub(crate) fn of(model: &Model) -> Vec<SectionCenters> {
    model.beams.iter().flat_map(of_beam).collect()
}

fn of_beam(beam: &Beam) -> Vec<SectionCenters> {
    let Ok(meshes) = beam.meshes() else { return Vec::new() };
    let length: f64 = meshes.iter().flat_map(|mesh| &mesh.lengths).sum();
    let size = 1e-9 * length;
    let at = |at: f64| {
        let own = beam.section_at(at).ok()?.centers();
        let (tension, shear, mass) = (own.tension, own.shear, own.mass);
        Some(SectionCenters { beam: beam.name.clone(), at, tension, shear, mass })
    };
    let places: Vec<SectionCenters> =
        [0.0, 0.5, 1.0].into_iter().filter_map(|part| at(part * length)).collect();
    let off = |own: &SectionCenters| {
        [own.tension, own.shear, own.mass].iter().flatten().any(|x| x.abs() > size)
    };
    if places.iter().any(off) { places } else { Vec::new() }
}

/// What looks like a slip in sections.
pub(crate) fn remarks(model: &Model) -> Vec<String> {
    const CONDITION: f64 = 1e12;
    let mut found = Vec::new();
    for beam in &model.beams {
        let Ok(mean) = beam.mean_section() else { continue };
        let (name, condition) = (&beam.name, mean.condition());
        if condition > CONDITION {
            found.push(format!(
                "the stiffness of the section of beam `{name}` is nearly singular (condition {condition:.0e} with its \
                 diagonal scaled to 1): check its couplings"
            ));
        }
        if let Some(miss) = beam.section.misses_plane() {
            found.push(format!(
                "the mass of the section of beam `{name}` is that of no plane section: its inertia about d_3 misses the sum \
                 of the others by {:.0} %",
                100.0 * miss
            ));
        }
    }
    found
}
