//! `<include file="…"/>`: the elements of another file in its place.

use std::path::Path;

use crate::ImportError;
use crate::element::XmlElement;
use crate::remark::Remarks;
use crate::source::{ImportSources, Refusal};

/// Files that one description includes at most.
const MOST: usize = 200;

/// The tree with all files in it; each file may be included once.
pub(crate) fn resolve(
    root: XmlElement,
    sources: &mut ImportSources,
    remarks: &mut Remarks,
) -> Result<XmlElement, ImportError> {
    if root.name != "mujoco" {
        return Ok(root);
    }
    let folder = sources.files[0].path.parent().unwrap_or_else(|| Path::new("")).to_owned();
    let mut root = root;
    root.children = spliced(std::mem::take(&mut root.children), &folder, sources, remarks)?;
    Ok(root)
}

fn spliced(
    children: Vec<XmlElement>,
    folder: &Path,
    sources: &mut ImportSources,
    remarks: &mut Remarks,
) -> Result<Vec<XmlElement>, ImportError> {
    let mut out = Vec::with_capacity(children.len());
    for mut child in children {
        if child.name != "include" {
            child.children = spliced(child.children, folder, sources, remarks)?;
            out.push(child);
            continue;
        }
        let file = child.required("file").map_err(|f| sources.error(&[f]))?;
        let stated = folder.join(file);
        let path = if stated.is_file() { stated } else { folder.join(file.replace('\\', "/")) };
        let known = sources.files.iter().any(|source| source.path == path);
        if known || sources.files.len() > MOST {
            let message = "this file is included twice, or too many files are";
            let fault = Refusal::at(&child.place, message, "include each file once");
            return Err(sources.error(&[fault]));
        }
        let number = sources.read(&path).map_err(|error| {
            let message = format!("cannot include: {error}");
            let help = "put the file beside the model, or remove the element";
            sources.error(&[Refusal::at(child.place_of("file"), message, help)])
        })?;
        let text = &sources.files[number].text;
        let included = XmlElement::parse(number, text, remarks).map_err(|f| sources.error(&[f]))?;
        out.extend(spliced(included.children, folder, sources, remarks)?);
    }
    Ok(out)
}
