//! XML as a tree of elements with their places.
//!
//! Names keep their prefixes, declared or not, since descriptions of robots do without namespaces.
//! Reading takes linear time.

use std::collections::BTreeSet;
use std::ops::Range;

use holonom_model::{LineColumn, line_column};
use quick_xml::events::Event;
use quick_xml::events::attributes::Attributes;
use quick_xml::{Reader, XmlVersion};

use crate::remark::Remarks;
use crate::source::{FilePlace, Refusal, Result};

/// Elements may stand in each other to this depth.
const MAX_DEPTH: usize = 250;

/// Elements of a file at most.
pub(crate) const MAX_ELEMENTS: usize = 1_000_000;

/// Attributes of an element at most.
const MAX_ATTRIBUTES: usize = 1000;

/// The greatest magnitude of a number: products of several remain numbers of a model file.
const LARGEST: f64 = 1e15;

/// An attribute.
#[derive(Clone, Debug)]
pub(crate) struct Attribute {
    pub(crate) name: String,
    pub(crate) value: String,
    pub(crate) place: FilePlace,
}

/// An element with its attributes and the elements in it; texts and comments are left out.
#[derive(Clone, Debug)]
pub(crate) struct XmlElement {
    pub(crate) name: String,
    pub(crate) attributes: Vec<Attribute>,
    pub(crate) children: Vec<XmlElement>,
    pub(crate) place: FilePlace,
}

impl Remarks {
    /// A remark on an element.
    pub(crate) fn add(&mut self, message: impl Into<String>, element: &XmlElement) {
        self.mention(message, element.label(), &element.place);
    }
}

impl XmlElement {
    /// The root element of a text, the one of number `file`.
    pub(crate) fn parse(file: usize, text: &str, remarks: &mut Remarks) -> Result<Self> {
        XmlParser { file, text, open: Vec::new(), declared: Vec::new(), elements: 0, remarks }
            .root()
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
            Refusal::at(&self.place, message, format!("add {name}=\"…\""))
        })
    }

    /// The place of an attribute, or of the element.
    pub(crate) fn place_of(&self, name: &str) -> &FilePlace {
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
                let help = match ["${", "$("].iter().any(|open| attribute.value.contains(open)) {
                    true => {
                        "expand the macros of xacro first: `xacro robot.urdf.xacro > robot.urdf`"
                    }
                    false => "write a number such as 0.25",
                };
                Refusal::at(&attribute.place, message, help)
            })
        };
        // commas between numbers are common, and read as blanks by other programs
        let words = attribute.value.split_whitespace().map(|word| word.trim_end_matches(','));
        words.filter(|word| !word.is_empty()).map(number).collect::<Result<_>>().map(Some)
    }

    /// An attribute of exactly `N` numbers.
    pub(crate) fn vector<const N: usize>(&self, name: &str) -> Result<Option<[f64; N]>> {
        let Some(numbers) = self.numbers(name)? else { return Ok(None) };
        let count = numbers.len();
        <[f64; N]>::try_from(numbers).map(Some).map_err(|_| {
            let message = format!("`{name}` has {count} number(s), not {N}");
            Refusal::at(self.place_of(name), message, format!("write {N} numbers"))
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
            return Err(Refusal::at(self.place_of(name), message, "write 0 or a positive number"));
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
        let stated: BTreeSet<&str> = self.attributes.iter().map(|a| a.name.as_str()).collect();
        let left = defaults.iter().filter(|d| !stated.contains(d.name.as_str())).cloned();
        let attributes = self.attributes.iter().cloned().chain(left).collect();
        let (name, place) = (self.name.clone(), self.place.clone());
        Self { name, attributes, children: Vec::new(), place }
    }

    /// It and all elements in it.
    pub(crate) fn size(&self) -> usize {
        1 + self.children.iter().map(Self::size).sum::<usize>()
    }

    /// What it is called in messages: `geom "floor"`.
    pub(crate) fn label(&self) -> String {
        match self.word("name") {
            Some(name) => format!("{} \"{}\"", self.name, name.escape_debug()),
            None => self.name.clone(),
        }
    }
}

/// What is open while a text is read.
struct XmlParser<'a, 'b> {
    file: usize,
    text: &'a str,
    /// The elements that are not closed yet, and how many prefixes were declared before each.
    open: Vec<(XmlElement, usize)>,
    /// Prefixes of namespaces.
    declared: Vec<&'a str>,
    elements: usize,
    remarks: &'b mut Remarks,
}

impl<'a> XmlParser<'a, '_> {
    fn root(mut self) -> Result<XmlElement> {
        let begin = self.text.strip_prefix('\u{feff}').unwrap_or(self.text);
        // a further mark at the start of the content is dropped by the reader without being counted
        let is_blank = |c: char| c == '\u{feff}' || c.is_whitespace();
        let content = begin.trim_start_matches(is_blank);
        let skipped = self.text.len() - content.len();
        let blank = content.len() < begin.len() && content.starts_with("<?xml");
        let mut reader = Reader::from_str(content);
        let mut root = None;
        loop {
            let start = skipped + position(reader.buffer_position());
            let event = reader.read_event().map_err(|error| {
                let at = skipped + position(reader.error_position());
                self.malformed(at, &error.to_string())
            })?;
            let span = start..skipped + position(reader.buffer_position());
            match event {
                Event::Start(tag) => self.start(span, tag.name().as_ref(), root.is_some())?,
                Event::Empty(tag) => {
                    self.start(span, tag.name().as_ref(), root.is_some())?;
                    self.close(&mut root);
                }
                Event::End(_) => self.close(&mut root),
                Event::Text(words) if self.open.is_empty() && !words.trim().is_empty() => {
                    let Some(root) = &root else {
                        return Err(self.malformed(span.start, "text before the root element"));
                    };
                    self.remarks.add("text after the root element: not read", root);
                }
                Event::Eof => break,
                _ => {}
            }
        }
        if let Some((open, _)) = self.open.last() {
            let message = format!("`<{}>` is not closed", open.name);
            return Err(self.malformed(open.place.span.start, &message));
        }
        let root = root.ok_or_else(|| self.malformed(0, "there is no root element"))?;
        if blank {
            self.remarks.add("blanks before the XML declaration: skipped", &root);
        }
        Ok(root)
    }

    fn start(&mut self, span: Range<usize>, name: &str, second: bool) -> Result<()> {
        let place = FilePlace { file: self.file, span: span.clone() };
        if second && self.open.is_empty() {
            return Err(self.malformed(span.start, "there is a second root element"));
        }
        if self.open.len() > MAX_DEPTH {
            let message = format!("more than {MAX_DEPTH} elements stand in each other");
            return Err(Refusal::at(&place, message, "is this a description of a robot?"));
        }
        self.elements += 1;
        if self.elements > MAX_ELEMENTS {
            let message = format!("there are more than {MAX_ELEMENTS} elements");
            return Err(Refusal::at(&place, message, "is this a description of a robot?"));
        }
        self.named(name, span.start)?;
        let before = self.declared.len();
        let attributes = self.attributes(&place, name.len())?;
        let element = XmlElement { name: name.to_owned(), attributes, children: Vec::new(), place };
        let names = element.attributes.iter().map(|a| &a.name).chain([&element.name]);
        for prefix in names.filter_map(|name| Some(name.split_once(':')?.0)) {
            if prefix != "xml" && !self.declared.contains(&prefix) {
                let message = format!(
                    "the prefix `{prefix}` stands for no namespace (no `xmlns:{prefix}`): read as it stands"
                );
                self.remarks.add(message, &element);
            }
        }
        self.open.push((element, before));
        Ok(())
    }

    /// The attributes of a tag but those that declare namespaces.
    fn attributes(&mut self, tag: &FilePlace, name: usize) -> Result<Vec<Attribute>> {
        let text = self.text;
        let whole = &text[tag.span.clone()];
        let inside = whole.trim_start_matches('<').trim_end_matches('>').trim_end_matches('/');
        // `part` is a part of `text`
        let offset = |part: &str| part.as_ptr() as usize - text.as_ptr() as usize;
        let (mut list, mut known) = (Vec::new(), BTreeSet::new());
        for attribute in Attributes::new(inside, name).with_checks(false) {
            let attribute =
                attribute.map_err(|error| self.malformed(tag.span.start, &error.to_string()))?;
            let key = attribute.key.0;
            let at = offset(key);
            let end = at + key.len();
            self.named(key, at)?;
            let value = attribute
                .normalized_value(XmlVersion::Implicit1_0)
                .map_err(|error| self.malformed(at, &error.to_string()))?;
            if !known.insert(key) {
                return Err(self.malformed(at, &format!("a second attribute `{key}`")));
            }
            if known.len() > MAX_ATTRIBUTES {
                let message = format!("an element with more than {MAX_ATTRIBUTES} attributes");
                return Err(Refusal::at(tag, message, "is this a description of a robot?"));
            }
            if let Some(prefix) = key.strip_prefix("xmlns:") {
                self.declared.push(&text[end - prefix.len()..end]);
            } else if key != "xmlns" {
                let quote = text[end..tag.span.end].find(['"', '\'']).unwrap_or(0);
                let end = (end + quote + 2 + attribute.value.len()).min(tag.span.end);
                let place = FilePlace { file: self.file, span: at..end };
                list.push(Attribute { name: key.to_owned(), value: value.into_owned(), place });
            }
        }
        Ok(list)
    }

    fn close(&mut self, root: &mut Option<XmlElement>) {
        let Some((element, declared)) = self.open.pop() else { return };
        self.declared.truncate(declared);
        match self.open.last_mut() {
            Some((parent, _)) => parent.children.push(element),
            None => *root = Some(element),
        }
    }

    /// A name of XML: letters, digits, `_`, `-`, `.` and `:`, a letter or `_` first.
    fn named(&self, name: &str, at: usize) -> Result<()> {
        let good = name.chars().all(|c| c.is_alphanumeric() || "_-.:".contains(c))
            && name.starts_with(|c: char| c.is_alphabetic() || c == '_');
        let shown: String = name.chars().take(40).collect();
        let message = format!("`{}` is no name", shown.escape_debug());
        if good { Ok(()) } else { Err(self.malformed(at, &message)) }
    }

    fn malformed(&self, at: usize, reason: &str) -> Refusal {
        let at = at.min(self.text.len());
        let place = FilePlace { file: self.file, span: at..(at + 1).min(self.text.len()) };
        let LineColumn { line, column } = line_column(self.text, at);
        let message = format!("this is not well-formed XML: {reason} at {line}:{column}");
        Refusal::at(&place, message, "correct the XML")
    }
}

/// A position in a text that is in memory.
fn position(at: u64) -> usize {
    usize::try_from(at).unwrap_or(usize::MAX)
}
