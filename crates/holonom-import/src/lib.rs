//! Model files from robot descriptions: URDF and MJCF.
//!
//! ```text
//! robot.urdf ─► Element ─► Robot ─► Tree ─► Draft ─► text with comments ─► Model (read back, checked)
//!  (XML)        places     links    bodies   sections
//! ```
//! Both formats become the same `Robot`: links with joints. What has no counterpart in a model file
//! is listed as a [`Remark`]; nothing is dropped silently. The initial configuration is the one
//! that the description draws, with all joints at zero, unless [`ImportOptions::values`] says
//! otherwise.
//!
//! | type | is |
//! |---|---|
//! | [`Imported`], [`Remark`] | a translated robot: text, model, what it lacks |
//! | [`ImportOptions`] | initial values, free base, closed loops and what else is asked for |

#![forbid(unsafe_code)]
#![deny(missing_docs)]

mod contact;
mod drafter;
mod element;
mod gauge;
mod loops;
mod mass;
mod massless;
mod mesh;
mod mjcf;
mod model;
mod names;
mod numbers;
mod picture;
mod remark;
mod repair;
mod robot;
mod self_contact;
mod solid;
mod source;
mod surface;
mod tendon;
mod text;
mod tree;
mod tree_body;
mod urdf;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use holonom_model::{Model, ModelError, Problem};

use element::XmlElement;
use mesh::MeshCache;
use remark::Remarks;
pub use remark::{Mention, Remark};
pub use robot::LoopJointKind;
use robot::Robot;
use source::{ImportSources, Refusal};
use tree::BodyTree;

/// How the base of a URDF robot is held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Base {
    /// The root link is a part of the ground.
    #[default]
    Fixed,
    /// The root link moves freely.
    Free,
}

/// The initial value of a joint.
#[derive(Clone, Debug, PartialEq)]
pub struct JointValue {
    /// Name of the joint in the description.
    pub joint: String,
    /// Its coordinate, m or rad.
    pub value: f64,
}

/// Two links, or other places that the description names, that a loop holds together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Close {
    /// A link, body or site; and another one.
    pub ends: [String; 2],
    /// What closes the loop; its axis is the third axis of the first end.
    pub kind: LoopJointKind,
}

/// What the description leaves open.
#[derive(Clone, Debug, PartialEq)]
pub struct ImportOptions {
    /// How the root link of a URDF robot is held.
    pub base: Base,
    /// Initial values of hinges and slides; others stay as the description draws them.
    pub values: Vec<JointValue>,
    /// Density of URDF links that state no inertia, kg/m³: their visual geometry as a homogeneous
    /// solid.
    pub density: Option<f64>,
    /// Whether moments of inertia that no body has, or that are zero, are replaced by possible
    /// ones.
    pub repair_inertia: bool,
    /// Loops that the description does not close.
    pub close: Vec<Close>,
    /// Whether armatures of joints become rotors that are geared to them.
    pub armature: bool,
    /// Whether servos of MJCF become motors of their joints, and laws of their tendons.
    pub actuators: bool,
    /// Whether bodies touch planes of the ground: those of MJCF, and one under a URDF robot.
    pub contacts: bool,
    /// Time step, s; by default that of the description, or 1 ms.
    pub step: Option<f64>,
    /// End time, s.
    pub end: f64,
    /// The folder of the model file, which names meshes relative to it; the current directory by
    /// default.
    pub folder: Option<PathBuf>,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self {
            base: Base::default(),
            values: Vec::new(),
            density: None,
            repair_inertia: false,
            close: Vec::new(),
            armature: true,
            actuators: false,
            contacts: false,
            step: None,
            end: 1.0,
            folder: None,
        }
    }
}

impl ImportOptions {
    fn folder(&self) -> &Path {
        let stated = self.folder.as_deref().filter(|folder| !folder.as_os_str().is_empty());
        stated.unwrap_or_else(|| Path::new("."))
    }
}

/// A translated description.
#[derive(Clone, Debug)]
pub struct Imported {
    /// The commented text of the model file.
    pub text: String,
    /// The model, read from the text.
    pub model: Model,
    /// What the model lacks, or has in another form.
    pub remarks: Vec<Remark>,
}

/// Why a description is not translated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImportError {
    /// A file cannot be read.
    #[error("{}: {source}", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        source: ModelError,
    },
    /// The description is invalid, or has no translation.
    #[error("{}: {}", path.display(), problems.first().map_or_else(String::new, ToString::to_string))]
    Invalid {
        /// The file.
        path: PathBuf,
        /// Its text.
        text: String,
        /// What is wrong, with places in the text.
        problems: Vec<Problem>,
    },
    /// The translation is no valid model.
    #[error("the translation is no valid model: {source}")]
    Refused {
        /// Its text.
        text: String,
        /// What is wrong with it.
        source: ModelError,
    },
}

/// Translates a file: URDF if its root element is `<robot>`, MJCF if it is `<mujoco>`.
///
/// # Errors
/// [`ImportError`].
pub fn import(path: &Path, options: &ImportOptions) -> Result<Imported, ImportError> {
    let mut sources = ImportSources::default();
    sources.read(path)?;
    translate(sources, options)
}

/// The same from a text; `path` is for messages and for files that the description names.
///
/// # Errors
/// [`ImportError`].
pub fn import_text(
    text: &str,
    path: &Path,
    options: &ImportOptions,
) -> Result<Imported, ImportError> {
    let mut sources = ImportSources::default();
    sources.add(path, text.to_owned());
    translate(sources, options)
}

fn translate(mut sources: ImportSources, options: &ImportOptions) -> Result<Imported, ImportError> {
    let path = sources.files[0].path.clone();
    let mut remarks = Remarks::default();
    let root = XmlElement::parse(0, &sources.files[0].text, &mut remarks)
        .map_err(|f| sources.error(&[f]))?;
    let root = mjcf::include::resolve(root, &mut sources, &mut remarks)?;
    let mut robot = read(&root, &path, options, &mut remarks).map_err(|f| sources.error(&[f]))?;
    robot.close(&options.close, &sources.files[0]).map_err(|f| sources.error(&[f]))?;
    place(&mut robot, options).map_err(|f| sources.error(&[f]))?;
    let tree = BodyTree::new(&robot, options.repair_inertia, &mut remarks)
        .map_err(|f| sources.error(&[f]))?;
    let draft =
        model::draft(&robot, &tree, options, &mut remarks).map_err(|f| sources.error(&f))?;
    let remarks = remarks.located(&sources);
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let text = text::text(&draft, &format!("{name} ({})", robot.format), &remarks);
    match Model::from_toml_in(&text, &[], holonom_model::Meshes::in_folder(options.folder())) {
        Ok(model) => Ok(Imported { text, model, remarks }),
        Err(source) => Err(ImportError::Refused { text, source }),
    }
}

fn read(
    root: &XmlElement,
    path: &Path,
    options: &ImportOptions,
    remarks: &mut Remarks,
) -> source::Result<Robot> {
    let mut meshes = MeshCache::beside(path, options.folder());
    match root.name.as_str() {
        "robot" => urdf::robot(root, options, &mut meshes, remarks),
        "mujoco" => mjcf::robot(root, options, &mut meshes, remarks),
        other => {
            let message = format!("<{}> is neither <robot> nor <mujoco>", other.escape_debug());
            Err(Refusal::at(&root.place, message, "import reads URDF and MJCF files"))
        }
    }
}

/// Sets the initial values of the joints; joints that follow others follow.
fn place(robot: &mut Robot, options: &ImportOptions) -> source::Result<()> {
    for JointValue { joint, value } in &options.values {
        let follows = robot.gears.iter().any(|gear| gear.joint == *joint);
        let found = robot.joint_mut(joint).filter(|_| !follows);
        let Some(found) = found.filter(|j| j.kind.is_single() && value.is_finite()) else {
            let message = format!("no initial value can be given to `{}`", joint.escape_debug());
            let help = "name a hinge or a slide of the description that follows no other joint";
            return Err(Refusal::of_all(message, help));
        };
        found.value = value - found.reference;
    }
    follow(robot)?;
    let bounded = |value: f64| value.is_finite() && value.abs() <= 1e15;
    let wild = robot.links.iter().flat_map(|l| &l.joints).find(|j| !bounded(j.value));
    wild.map_or(Ok(()), |joint| {
        let message = "its initial value follows other joints without end";
        Err(Refusal::at(&joint.place, message, "correct the joints that follow each other"))
    })
}

/// Passes over joints that follow each other at most.
const PASSES: usize = 1000;

/// Gives joints that follow others their values.
fn follow(robot: &mut Robot) -> source::Result<()> {
    let joints = robot.links.iter_mut().flat_map(|l| &mut l.joints);
    let mut values: BTreeMap<String, &mut f64> =
        joints.map(|j| (j.name.clone(), &mut j.value)).collect();
    for _ in 0..PASSES.min(robot.gears.len() + 1) {
        let mut changed = false;
        for gear in &robot.gears {
            let other = gear.of.as_ref().map_or(Some(0.0), |of| values.get(of).map(|x| **x));
            let (Some(other), Some(value)) = (other, values.get_mut(&gear.joint)) else { continue };
            let follows = gear.offset + gear.factor * other;
            changed |= follows.to_bits() != value.to_bits();
            **value = follows;
        }
        if !changed {
            return Ok(());
        }
    }
    let place = robot.gears.first().map(|gear| &gear.place);
    let message = "joints follow each other in a circle";
    let help = "let each of them follow a joint that follows no other";
    Err(place.map_or_else(|| Refusal::of_all(message, help), |p| Refusal::at(p, message, help)))
}
