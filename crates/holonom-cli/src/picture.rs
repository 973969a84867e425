//! Drawings as files: SVG, PDF or PNG.

use std::fs;
use std::path::Path;

use holonom::output::{OutputError, atomically};
use holonom::report::Drawing;

use crate::failure::Failure;
use crate::stderr;

/// The format of a drawing.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum PictureFormat {
    Svg,
    Pdf,
    Png,
}

impl PictureFormat {
    /// By the extension of a file; `others`: those that the command knows beside them.
    pub(crate) fn of(file: &Path, others: &[&str]) -> Result<Self, Failure> {
        let extension = file.extension().map(|e| e.to_string_lossy().to_lowercase());
        match extension.as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("pdf") => Ok(Self::Pdf),
            Some("png") => Ok(Self::Png),
            _ => Err(Failure::Usage {
                message: format!("{} states no format that can be drawn", file.display()),
                help: match others {
                    [] => "let the file end with .svg, .pdf or .png".into(),
                    others => {
                        format!("let the file end with .svg, .pdf, .png or {}", others.join(", "))
                    }
                },
            }),
        }
    }
}

/// Writes a drawing; a PNG with `pixels` for each px of 1/96 inch.
pub(crate) fn write(
    file: &Path,
    drawing: &Drawing,
    format: PictureFormat,
    pixels: f64,
) -> Result<(), Failure> {
    let bytes = bytes(drawing, format, pixels).map_err(|reason| {
        let name = file.display().to_string();
        Failure::Output(OutputError::Plot { name, reason })
    })?;
    whole(file, &bytes)
}

/// Writes a file as a whole or not at all.
pub(crate) fn whole(file: &Path, bytes: &[u8]) -> Result<(), Failure> {
    atomically(file, |temporary| fs::write(temporary, bytes))
        .map_err(|source| Failure::Output(OutputError::Io { path: file.to_owned(), source }))
}

/// The bytes of a drawing.
pub(crate) fn bytes(
    drawing: &Drawing,
    format: PictureFormat,
    pixels: f64,
) -> Result<Vec<u8>, String> {
    if format != PictureFormat::Svg {
        let missing = drawing.missing_letters()?;
        if !missing.is_empty() {
            stderr::line(&format!(
                "note: the font lacks `{missing}`; SVG uses those of the reader"
            ));
        }
    }
    match format {
        PictureFormat::Svg => Ok(drawing.svg().into_bytes()),
        PictureFormat::Pdf => drawing.pdf(),
        PictureFormat::Png => drawing.png(pixels),
    }
}
