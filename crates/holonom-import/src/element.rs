//! XML as a tree of elements with their places.

use roxmltree::{Document, Node, NodeType, ParsingOptions};

use crate::source::{Fault, Place, Result};

/// Elements may stand in each other to this depth.
const MAX_DEPTH: usize = 250;

/// Elements and texts of a file at most.
const MAX_NODES: u32 = 1_000_000;

/// The greatest magnitude of a number: products of several remain numbers of a model file.
const LARGEST: f64 = 1e15;

/// An attribute.
#[derive(Clone, Debug)]
pub(crate) struct Attribute {
    pub(crate) name: String,
    pub(crate) value: String,
    pub(crate) place: Place,
}

/// An element with its attributes and the elements in it; texts and comments are left out.
#[derive(Clone, Debug)]
pub(crate) struct Element {
    pub(crate) name: String,
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) children: Vec<Element>,
    pub(crate) place: Place,
}

impl Element {
    /// The root element of a text, the one of number `file`.
    pub(crate) fn parse(file: usize, text: &str) -> Result<Self> {
        let options = ParsingOptions { nodes_limit: MAX_NODES, ..ParsingOptions::default() };
        let document = Document::parse_with_options(text, options).map_err(|error| {
            let at = offset(text, error.pos().row, error.pos().col);
            let place = Place { file, span: at..(at + 1).min(text.len()) };
            Fault::at(&place, format!("this is not well-formed XML: {error}"), "correct the XML")
        })?;
        convert(file, text, document.root_element(), 0)
    }

    /// An attribute.
    pub(crate) fn attribute(&self, name: &str) -> Option<&Attribute> {
        self.attributes.iter().find(|a| a.name == name)
    }

    /// The text of an attribute.
    pub(crate) fn word(&self, name: &str) -> Option<&str> {
        self.attribute(name).map(|a| a.value.as_str())
    }

    /// The text of an attribute that must be there.
    pub(crate) fn required(&self, name: &str) -> Result<&str> {
        self.word(name).ok_or_else(|| {
            let message = format!("<{}> has no attribute `{name}`", self.name);
            Fault::at(&self.place, message, format!("add {name}=\"…\""))
        })
    }

    /// The place of an attribute, or of the element.
    pub(crate) fn place_of(&self, name: &str) -> &Place {
        self.attribute(name).map_or(&self.place, |a| &a.place)
    }

    /// The numbers of an attribute.
    pub(crate) fn numbers(&self, name: &str) -> Result<Option<Vec<f64>>> {
        let Some(attribute) = self.attribute(name) else { return Ok(None) };
        let number = |word: &str| {
            word.parse::<f64>().ok().filter(|x| x.abs() <= LARGEST).ok_or_else(|| {
                let word: String = word.chars().take(40).collect();
                let word = word.escape_debug();
                let message = format!("`{word}` is no number, or beyond {LARGEST:e}");
                Fault::at(&attribute.place, message, "write a number such as 0.25")
            })
        };
        attribute.value.split_whitespace().map(number).collect::<Result<_>>().map(Some)
    }

    /// An attribute of exactly `N` numbers.
    pub(crate) fn vector<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>> {
        let Some(numbers) = self.numbers(name)? else { return Ok(None) };
        let count = numbers.len();
        <[f64; N]>::try_from(numbers).map(Some).map_err(|_| {
            let message = format!("`{name}` has {count} number(s), not {N}");
            Fault::at(self.place_of(name), message, format!("write {N} numbers"))
        })
    }

    /// An attribute that is a number.
    pub(crate) fn number(&self, name: &str) -> Result<Option<f64>> {
        Ok(self.vector::<1>(name)?.map(|[x]| x))
    }

    /// A number that must not be negative, 0 without it.
    pub(crate) fn amount(&self, name: &str) -> Result<f64> {
        let value = self.number(name)?.unwrap_or(0.0);
        if value < 0.0 {
            let message = format!("`{name}` is {value}: it is negative");
            return Err(Fault::at(self.place_of(name), message, "write 0 or a positive number"));
        }
        Ok(value)
    }

    /// `true` or `false`.
    pub(crate) fn flag(&self, name: &str) -> Option<bool> {
        self.word(name).map(|word| word == "true")
    }

    /// The elements of this name in it.
    pub(crate) fn all<'a>(&'a self, name: &'a str) -> impl Iterator<Item = &'a Self> {
        self.children.iter().filter(move |c| c.name == name)
    }

    /// The first element of this name in it.
    pub(crate) fn child(&self, name: &str) -> Option<&Self> {
        self.children.iter().find(|c| c.name == name)
    }

    /// Without the elements in it, and with further attributes where it does not state them.
    pub(crate) fn with_defaults(&self, defaults: &[Attribute]) -> Self {
        let mut attributes = self.attributes.clone();
        attributes.extend(defaults.iter().filter(|d| self.attribute(&d.name).is_none()).cloned());
        let (name, place) = (self.name.clone(), self.place.clone());
        Self { name, attributes, children: Vec::new(), place }
    }

    /// What it is called in messages: `geom "floor"`.
    pub(crate) fn label(&self) -> String {
        match self.word("name") {
            Some(name) => format!("{} \"{}\"", self.name, name.escape_debug()),
            None => self.name.clone(),
        }
    }
}

fn convert(file: usize, text: &str, node: Node<'_, '_>, depth: usize) -> Result<Element> {
    let range = node.range();
    let whole = text.get(range.clone()).unwrap_or_default();
    let tag = whole.find('>').map_or(whole.len(), |end| end + 1);
    let place = Place { file, span: range.start..range.start + tag };
    if depth > MAX_DEPTH {
        let message = format!("more than {MAX_DEPTH} elements stand in each other");
        return Err(Fault::at(&place, message, "is this a description of a robot?"));
    }
    let name = |namespace: Option<&str>, name: &str| match namespace
        .and_then(|uri| node.lookup_prefix(uri))
        .filter(|prefix| !prefix.is_empty())
    {
        Some(prefix) => format!("{prefix}:{name}"),
        None => name.to_owned(),
    };
    let attribute = |a: roxmltree::Attribute<'_, '_>| Attribute {
        name: name(a.namespace(), a.name()),
        value: a.value().to_owned(),
        place: Place { file, span: a.range() },
    };
    let elements = node.children().filter(|c| c.node_type() == NodeType::Element);
    Ok(Element {
        name: name(node.tag_name().namespace(), node.tag_name().name()),
        attributes: node.attributes().map(attribute).collect(),
        children: elements.map(|c| convert(file, text, c, depth + 1)).collect::<Result<_>>()?,
        place,
    })
}

/// The byte at a row and a column, both from 1.
fn offset(text: &str, row: u32, column: u32) -> usize {
    let line = text.split_inclusive('\n').take((row as usize).saturating_sub(1));
    let start: usize = line.map(str::len).sum();
    let rest = text.get(start..).unwrap_or_default();
    let skipped = rest.char_indices().nth((column as usize).saturating_sub(1));
    start + skipped.map_or(rest.len(), |(at, _)| at)
}
