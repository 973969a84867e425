//! Arguments of `import`, `schema` and `examples`, which are about model files.

use std::path::PathBuf;

use clap::Args;
use holonom::import::{Close, JointValue, LoopJointKind};

#[derive(Args)]
#[command(
    after_help = "What has no counterpart in a model file is listed at the head of the file and on standard error. URDF: the root \
                        link is a part of the ground, unless --free-base is given."
)]
pub(crate) struct ImportArguments {
    /// The description: URDF (<robot>) or MJCF (<mujoco>)
    pub(crate) robot: PathBuf,
    /// The file to write; by default the name of the description with the extension toml, in the
    /// current directory
    #[arg(short, long, value_name = "FILE")]
    pub(crate) output: Option<PathBuf>,
    /// The root link of a URDF robot moves freely
    #[arg(long)]
    pub(crate) free_base: bool,
    /// Initial value of a joint, m or rad; may be repeated
    #[arg(long, value_name = "NAME=VALUE", value_parser = joint_value)]
    pub(crate) joint: Vec<JointValue>,
    /// Density of URDF links that have geometry and state no inertia, kg/m³: their visual geometry
    /// gives them a mass
    #[arg(long, value_name = "RHO", value_parser = density)]
    pub(crate) density: Option<f64>,
    /// Replace moments of inertia that no body has by their mean, as MuJoCo's `balanceinertia`
    /// does, and those that are zero by those of the geometry or of a ball; each is listed
    #[arg(long)]
    pub(crate) repair_inertia: bool,
    /// Close a loop between two links, bodies or sites: `spherical` by default, or `A=B:revolute`,
    /// `:prismatic` (about and along the third axis of A), `:fixed`; may be repeated
    #[arg(long, value_name = "A=B", value_parser = close)]
    pub(crate) close: Vec<Close>,
    /// Leave out the armatures of MJCF, which become rotors geared to their joints
    #[arg(long)]
    pub(crate) no_armature: bool,
    /// Servos of MJCF (`position`, `velocity`, affine `general`, …) become motors and laws that act
    /// as without controls
    #[arg(long)]
    pub(crate) actuators: bool,
    /// Bodies touch the ground and one another with their geometry for contact: planes of MJCF, of
    /// URDF a plane under the lowest point
    #[arg(long)]
    pub(crate) contacts: bool,
    /// Time step, s; by default that of the description, or 1 ms
    #[arg(long, value_name = "H", allow_negative_numbers = true)]
    pub(crate) step: Option<f64>,
    /// End time, s
    #[arg(long, value_name = "T", default_value_t = 1.0, allow_negative_numbers = true)]
    pub(crate) end: f64,
    /// Replace the file if it exists
    #[arg(long)]
    pub(crate) force: bool,
    /// Print what was and was not translated as JSON on standard output
    #[arg(long)]
    pub(crate) json: bool,
}

fn density(text: &str) -> Result<f64, String> {
    let number: Option<f64> = text.parse().ok();
    number
        .filter(|rho| *rho > 0.0 && *rho <= 1e6)
        .ok_or_else(|| "write a positive density in kg/m³, such as 2700".to_owned())
}

fn close(text: &str) -> Result<Close, String> {
    let kinds = [
        (":spherical", LoopJointKind::Spherical),
        (":revolute", LoopJointKind::Revolute),
        (":prismatic", LoopJointKind::Prismatic),
        (":fixed", LoopJointKind::Fixed),
    ];
    let stated = kinds.iter().find_map(|(end, kind)| Some((text.strip_suffix(end)?, *kind)));
    let (ends, kind) = stated.unwrap_or((text, LoopJointKind::default()));
    let named = ends.split_once('=').map(|(a, b)| [a, b].map(|end| end.trim().to_owned()));
    let ends = named.filter(|ends| ends.iter().all(|end| !end.is_empty()));
    ends.map(|ends| Close { ends, kind }).ok_or_else(|| {
        "write A=B with two links, bodies or sites, such as --close coupler_end=rocker_end:revolute"
            .to_owned()
    })
}

fn joint_value(text: &str) -> Result<JointValue, String> {
    let stated = text.rsplit_once('=').and_then(|(joint, value)| {
        let value = value.trim().parse().ok().filter(|x: &f64| x.is_finite())?;
        Some(JointValue { joint: joint.trim().to_owned(), value })
    });
    stated.ok_or_else(|| "write NAME=VALUE, such as elbow=0.5".to_owned())
}

#[derive(Args)]
pub(crate) struct SchemaArguments {
    /// A section, such as joint: its keys, units, defaults and an example; without it, the JSON
    /// schema of all
    pub(crate) section: Option<String>,
}

#[derive(Args)]
pub(crate) struct ExamplesArguments {
    /// The model to write; without it, the list of all
    #[arg(conflicts_with = "all")]
    pub(crate) name: Option<String>,
    /// Write it to this file instead of standard output
    #[arg(short, long, value_name = "FILE", requires = "name")]
    pub(crate) output: Option<PathBuf>,
    /// Write all models into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) all: Option<PathBuf>,
    /// Replace files that exist
    #[arg(long)]
    pub(crate) force: bool,
}
