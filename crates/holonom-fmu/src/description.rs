//! `modelDescription.xml`, FMI 2.0 and 3.0.

use crate::interface::{Causality, Interface, Variable};
use crate::unit::BaseUnit;
use crate::{MODEL_IDENTIFIER, VERSION};
use holonom::Model;
use quick_xml::Writer;
use quick_xml::events::{BytesDecl, Event};
use std::collections::BTreeMap;
use std::io;

/// A version of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0
    Fmi2,
    /// FMI 3.0
    Fmi3,
}

impl Version {
    /// Its number.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fmi2 => "2.0",
            Self::Fmi3 => "3.0",
        }
    }
}

/// Categories of messages.
pub const CATEGORIES: [(&str, &str); 2] = [
    ("logStatusError", "why a call was refused, and what helps"),
    ("logStatusWarning", "what is worth knowing of the model and the step"),
];

type Xml = Writer<Vec<u8>>;

/// The description of a unit.
///
/// # Errors
/// None but those of memory.
pub fn describe(
    version: Version,
    model: &Model,
    interface: &Interface,
    token: &str,
) -> io::Result<String> {
    let mut xml = Writer::new_with_indent(Vec::new(), b' ', 2);
    xml.write_event(Event::Decl(BytesDecl::new("1.0", Some("UTF-8"), None)))?;
    let token_key = match version {
        Version::Fmi2 => "guid",
        Version::Fmi3 => "instantiationToken",
    };
    let tool = format!("holonom {VERSION}");
    let convention = if interface.is_structured() { "structured" } else { "flat" };
    xml.create_element("fmiModelDescription")
        .with_attribute(("fmiVersion", version.name()))
        .with_attribute(("modelName", model.header.name.as_str()))
        .with_attribute((token_key, token))
        .with_attribute(("generationTool", tool.as_str()))
        .with_attribute(("variableNamingConvention", convention))
        .write_inner_content(|xml| {
            co_simulation(xml, version, model.settings.step)?;
            units(xml, interface)?;
            categories(xml)?;
            experiment(xml, model)?;
            xml.create_element("ModelVariables").write_inner_content(|xml| {
                let all = interface.variables.iter().enumerate();
                all.into_iter().try_for_each(|(k, own)| variable(xml, version, k, own))
            })?;
            structure(xml, version, interface)
        })?;
    let text = String::from_utf8(xml.into_inner());
    Ok(text.map_err(io::Error::other)? + "\n")
}

fn co_simulation(xml: &mut Xml, version: Version, step: f64) -> io::Result<()> {
    let step = number(step);
    let mut own = xml
        .create_element("CoSimulation")
        .with_attribute(("modelIdentifier", MODEL_IDENTIFIER))
        .with_attribute(("canHandleVariableCommunicationStepSize", "true"))
        .with_attribute(("canBeInstantiatedOnlyOncePerProcess", "false"));
    own = match version {
        Version::Fmi2 => own
            .with_attribute(("canNotUseMemoryManagementFunctions", "true"))
            .with_attribute(("canGetAndSetFMUstate", "true"))
            .with_attribute(("canSerializeFMUstate", "true")),
        Version::Fmi3 => own
            .with_attribute(("canGetAndSetFMUState", "true"))
            .with_attribute(("canSerializeFMUState", "true"))
            .with_attribute(("fixedInternalStepSize", step.as_str()))
            .with_attribute(("hasEventMode", "false")),
    };
    own.write_empty().map(drop)
}

fn units(xml: &mut Xml, interface: &Interface) -> io::Result<()> {
    let units = interface.variables.iter().filter(|own| !own.unit.is_empty());
    let known: BTreeMap<&str, BaseUnit> =
        units.filter_map(|own| Some((own.unit, BaseUnit::of(own.unit)?))).collect();
    xml.create_element("UnitDefinitions")
        .write_inner_content(|xml| {
            known.iter().try_for_each(|(name, base)| {
                xml.create_element("Unit")
                    .with_attribute(("name", *name))
                    .write_inner_content(|xml| {
                        let mut own = xml.create_element("BaseUnit");
                        for (name, exponent) in base.exponents() {
                            own = own.with_attribute((name, exponent.to_string().as_str()));
                        }
                        own.write_empty().map(drop)
                    })
                    .map(drop)
            })
        })
        .map(drop)
}

fn categories(xml: &mut Xml) -> io::Result<()> {
    xml.create_element("LogCategories")
        .write_inner_content(|xml| {
            CATEGORIES.iter().try_for_each(|(name, described)| {
                let own = xml.create_element("Category").with_attribute(("name", *name));
                own.with_attribute(("description", *described)).write_empty().map(drop)
            })
        })
        .map(drop)
}

fn experiment(xml: &mut Xml, model: &Model) -> io::Result<()> {
    let settings = &model.settings;
    xml.create_element("DefaultExperiment")
        .with_attribute(("startTime", "0"))
        .with_attribute(("stopTime", number(settings.end).as_str()))
        .with_attribute(("stepSize", number(settings.step).as_str()))
        .write_empty()
        .map(drop)
}

fn variable(xml: &mut Xml, version: Version, k: usize, own: &Variable) -> io::Result<()> {
    let (causality, variability) = match own.causality {
        Causality::Independent => ("independent", "continuous"),
        Causality::Parameter => ("parameter", "fixed"),
        Causality::Input => ("input", "continuous"),
        Causality::Output => ("output", "continuous"),
    };
    let (reference, start) = (k.to_string(), own.start.map(number));
    let outer = match version {
        Version::Fmi2 => "ScalarVariable",
        Version::Fmi3 => "Float64",
    };
    let mut element = xml
        .create_element(outer)
        .with_attribute(("name", own.name.as_str()))
        .with_attribute(("valueReference", reference.as_str()))
        .with_attribute(("causality", causality))
        .with_attribute(("variability", variability))
        .with_attribute(("description", own.description.as_str()));
    let unit = (!own.unit.is_empty()).then_some(("unit", own.unit));
    let start = start.as_deref().map(|value| ("start", value));
    let real = unit.into_iter().chain(start);
    if version == Version::Fmi3 {
        return element.with_attributes(real).write_empty().map(drop);
    }
    let initial = match own.causality {
        Causality::Parameter => Some(("initial", "exact")),
        Causality::Output => Some(("initial", "calculated")),
        _ => None,
    };
    element = element.with_attributes(initial);
    let inner =
        |xml: &mut Xml| xml.create_element("Real").with_attributes(real).write_empty().map(drop);
    element.write_inner_content(inner).map(drop)
}

/// Which outputs depend on which inputs at once.
fn structure(xml: &mut Xml, version: Version, interface: &Interface) -> io::Result<()> {
    // FMI 2.0 counts from 1
    let place = |k: usize| if version == Version::Fmi2 { k + 1 } else { k };
    let inputs: Vec<String> =
        interface.of_causality(Causality::Input).map(|(k, _)| place(k).to_string()).collect();
    let inputs = inputs.join(" ");
    let key = if version == Version::Fmi2 { "index" } else { "valueReference" };
    let outputs: Vec<(String, &str)> = interface
        .of_causality(Causality::Output)
        .map(|(k, own)| {
            (place(k).to_string(), if own.feeds_through { inputs.as_str() } else { "" })
        })
        .collect();
    let unknown = |xml: &mut Xml, name: &str, (k, dependencies): (&str, Option<&str>)| {
        let own = xml.create_element(name).with_attribute((key, k));
        let dependencies = dependencies.map(|list| ("dependencies", list));
        own.with_attributes(dependencies).write_empty().map(drop)
    };
    let outer = xml.create_element("ModelStructure");
    let content = |xml: &mut Xml| -> io::Result<()> {
        if version == Version::Fmi3 {
            for (k, dependencies) in &outputs {
                unknown(xml, "Output", (k, Some(dependencies)))?;
            }
            return outputs.iter().try_for_each(|(k, _)| unknown(xml, "InitialUnknown", (k, None)));
        }
        xml.create_element("Outputs").write_inner_content(|xml| {
            let each = |(k, list): &(String, &str)| unknown(xml, "Unknown", (k, Some(list)));
            outputs.iter().try_for_each(each)
        })?;
        xml.create_element("InitialUnknowns").write_inner_content(|xml| {
            outputs.iter().try_for_each(|(k, _)| unknown(xml, "Unknown", (k, None)))
        })?;
        Ok(())
    };
    outer.write_inner_content(content).map(drop)
}

/// The shortest decimal that reads back as the same number.
fn number(value: f64) -> String {
    format!("{value:?}")
}
