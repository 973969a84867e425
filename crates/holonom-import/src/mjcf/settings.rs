//! `<compiler>`, `<option>` and `<default>`.

use std::collections::BTreeMap;

use nalgebra::Vector3;

use crate::element::{Attribute, XmlElement};
use crate::remark::Remarks;
use crate::source::{Refusal, Result};

/// Where mass properties of bodies come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum FromGeoms {
    Never,
    #[default]
    WhereMissing,
    Always,
}

/// Settings of the whole file.
#[derive(Clone, Debug)]
pub(crate) struct FileSettings {
    /// Angles are in degrees.
    pub(crate) degrees: bool,
    /// Axes of Euler angles: small letters rotate with the body, capitals do not.
    pub(crate) eulerseq: String,
    pub(crate) from_geoms: FromGeoms,
    pub(crate) balance: bool,
    /// kg, kg·m²
    pub(crate) least_mass: f64,
    pub(crate) least_inertia: f64,
    /// kg
    pub(crate) total_mass: Option<f64>,
    /// Groups of geoms that have mass.
    pub(crate) groups: [f64; 2],
    pub(crate) mesh_folder: String,
    pub(crate) gravity: Vector3<f64>,
    /// Whether springs and dampers of joints act.
    pub(crate) springs: bool,
    pub(crate) dampers: bool,
    pub(crate) step: f64,
}

impl FileSettings {
    /// An angle in rad.
    pub(crate) fn angle(&self, value: f64) -> f64 {
        if self.degrees { value.to_radians() } else { value }
    }

    /// Reads all `<compiler>` and `<option>` of a file; the last one counts.
    pub(crate) fn read(root: &XmlElement, remarks: &mut Remarks) -> Result<Self> {
        let mut settings = Self {
            degrees: true,
            eulerseq: "xyz".to_owned(),
            from_geoms: FromGeoms::default(),
            balance: false,
            least_mass: 0.0,
            least_inertia: 0.0,
            total_mass: None,
            groups: [f64::NEG_INFINITY, f64::INFINITY],
            mesh_folder: String::new(),
            gravity: Vector3::new(0.0, 0.0, -9.81),
            springs: true,
            dampers: true,
            step: 0.002,
        };
        for compiler in root.all("compiler") {
            settings.compiler(compiler, remarks)?;
        }
        for option in root.all("option") {
            settings.option(option, remarks)?;
        }
        for flag in root.all("option").flat_map(|option| option.all("flag")) {
            settings.flags(flag);
        }
        Ok(settings)
    }

    fn compiler(&mut self, element: &XmlElement, remarks: &mut Remarks) -> Result<()> {
        for attribute in &element.attributes {
            let Attribute { name, value, place } = attribute;
            match name.as_str() {
                "angle" => self.degrees = value != "radian",
                "eulerseq" => {
                    let letters = value.chars().all(|c| "xyzXYZ".contains(c));
                    if value.len() != 3 || !letters {
                        let message = format!("`{}` is no sequence of axes", value.escape_debug());
                        let help = "write three of the letters x, y, z, X, Y, Z";
                        return Err(Refusal::at(place, message, help));
                    }
                    self.eulerseq.clone_from(value);
                }
                "inertiafromgeom" => {
                    self.from_geoms = match value.as_str() {
                        "true" => FromGeoms::Always,
                        "false" => FromGeoms::Never,
                        _ => FromGeoms::WhereMissing,
                    }
                }
                "coordinate" if value == "global" => {
                    let help = "save the model with a recent version of MuJoCo, which writes local coordinates";
                    return Err(Refusal::at(place, "global coordinates are not supported", help));
                }
                "balanceinertia" => self.balance = value == "true",
                "boundmass" => self.least_mass = element.amount(name)?,
                "boundinertia" => self.least_inertia = element.amount(name)?,
                "settotalmass" => {
                    self.total_mass = element.number(name)?.filter(|mass| *mass > 0.0);
                }
                "inertiagrouprange" => {
                    self.groups = element.vector::<2>(name)?.unwrap_or(self.groups);
                }
                "meshdir" | "assetdir" => self.mesh_folder.clone_from(value),
                "coordinate" | "autolimits" | "texturedir" | "discardvisual" | "usethread"
                | "fusestatic" | "alignfree" | "saveinertial" | "convexhull" | "fitaabb" => {}
                other => {
                    let message =
                        format!("attribute `{}` of <compiler>: not used", other.escape_debug());
                    remarks.add(message, element);
                }
            }
        }
        Ok(())
    }

    /// What is switched off as a whole.
    fn flags(&mut self, flag: &XmlElement) {
        let off = |name: &str| flag.word(name) == Some("disable");
        if off("gravity") {
            self.gravity = Vector3::zeros();
        }
        self.springs &= !off("spring") && !off("passive");
        self.dampers &= !off("damper") && !off("passive");
    }

    fn option(&mut self, element: &XmlElement, remarks: &mut Remarks) -> Result<()> {
        if let Some(gravity) = element.vector::<3>("gravity")? {
            self.gravity = gravity.into();
        }
        if let Some(step) = element.number("timestep")? {
            if step <= 0.0 {
                let message = format!("the time step {step} s is not positive");
                return Err(Refusal::at(element.place_of("timestep"), message, "write 0.002"));
            }
            self.step = step;
        }
        for name in ["density", "viscosity", "wind"] {
            let values = element.numbers(name)?.unwrap_or_default();
            if values.iter().any(|x| *x != 0.0) {
                remarks.add(format!("forces of a fluid (`{name}`): not translated"), element);
            }
        }
        let known = ["gravity", "timestep", "density", "viscosity", "wind"];
        let mut others = element.attributes.iter().filter(|a| !known.contains(&a.name.as_str()));
        if others.next().is_some() || !element.children.is_empty() {
            remarks.add("integrator, solver and flags: not translated", element);
        }
        Ok(())
    }
}

/// Defaults by class.
#[derive(Debug, Default)]
pub(crate) struct Defaults {
    classes: BTreeMap<String, Class>,
}

/// The defaults of a class.
#[derive(Clone, Debug, Default)]
struct Class {
    /// Attributes by the kind of an element.
    kinds: BTreeMap<String, Vec<Attribute>>,
    /// Of all kinds of actuators, one after the other.
    actuators: Vec<XmlElement>,
}

/// Elements of `<actuator>`, of which classes state defaults.
const ACTUATORS: [&str; 12] = [
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "pid",
    "dcmotor",
    "plugin",
];

/// The class that holds without any.
const MAIN: &str = "main";

impl Defaults {
    /// All `<default>` of a file.
    pub(crate) fn read(root: &XmlElement) -> Result<Self> {
        let mut defaults = Self::default();
        for element in root.all("default") {
            let class = element.word("class").unwrap_or(MAIN);
            let base = defaults.classes.get(MAIN).cloned().unwrap_or_default();
            defaults.class(element, class, base)?;
            if class != MAIN {
                let own = defaults.classes.get(class).cloned().unwrap_or_default();
                defaults.classes.entry(MAIN.to_owned()).or_insert(own);
            }
        }
        Ok(defaults)
    }

    fn class(&mut self, element: &XmlElement, name: &str, inherited: Class) -> Result<()> {
        let mut own = inherited;
        for child in element.children.iter().filter(|c| c.name != "default") {
            if ACTUATORS.contains(&child.name.as_str()) {
                own.actuators.push(child.clone());
            }
            let attributes = own.kinds.entry(child.name.clone()).or_default();
            for attribute in &child.attributes {
                attributes.retain(|a| !conflict(&a.name, &attribute.name));
                attributes.push(attribute.clone());
            }
        }
        self.classes.insert(name.to_owned(), own.clone());
        for child in element.all("default") {
            self.class(child, child.required("class")?, own.clone())?;
        }
        Ok(())
    }

    /// The element with the defaults of its class, or else of the class `of_parent`.
    pub(crate) fn apply(
        &self,
        element: &XmlElement,
        of_parent: Option<&str>,
    ) -> Result<XmlElement> {
        self.apply_as(&element.name, element, of_parent)
    }

    /// The same, with the defaults of elements of the name `kind`.
    pub(crate) fn apply_as(
        &self,
        kind: &str,
        element: &XmlElement,
        of_parent: Option<&str>,
    ) -> Result<XmlElement> {
        let class = self.class_of(element, of_parent)?;
        let all = class.and_then(|class| class.kinds.get(kind)).into_iter().flatten();
        let left =
            |a: &&Attribute| element.attributes.iter().all(|own| !conflict(&own.name, &a.name));
        let defaults: Vec<Attribute> = all.filter(left).cloned().collect();
        Ok(element.with_defaults(&defaults))
    }

    /// What states an actuator: the defaults of its class, one after the other, and its element.
    pub(crate) fn actuators<'a>(&'a self, element: &'a XmlElement) -> Result<Vec<&'a XmlElement>> {
        let class = self.class_of(element, None)?;
        Ok(class.iter().flat_map(|class| &class.actuators).chain([element]).collect())
    }

    fn class_of(&self, element: &XmlElement, of_parent: Option<&str>) -> Result<Option<&Class>> {
        let stated = element.word("class");
        let class = stated.or(of_parent).unwrap_or(MAIN);
        let found = self.classes.get(class);
        if found.is_none() && class != MAIN {
            let message = format!("there is no default class `{}`", class.escape_debug());
            let help = "add <default class=\"…\">";
            return Err(Refusal::at(element.place_of("class"), message, help));
        }
        Ok(found)
    }
}

/// Attributes that state an orientation.
pub(crate) const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];

/// Whether one attribute replaces the other.
fn conflict(a: &str, b: &str) -> bool {
    a == b || (ORIENTATIONS.contains(&a) && ORIENTATIONS.contains(&b))
}
