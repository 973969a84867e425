//! The two fonts of PDF and PNG: widths and outlines of their glyphs.
//!
//! Liberation Sans and Liberation Serif have the widths of Helvetica and Times. Licence:
//! `fonts/LICENSE-OFL`. Their files are compressed as they are (zlib), and decompressed when a
//! letter is first drawn.

use std::sync::LazyLock;

use miniz_oxide::inflate::decompress_to_vec_zlib;
use ttf_parser::{Face, GlyphId, OutlineBuilder};

use super::Typeface;

static FILES: [&[u8]; 2] = [
    include_bytes!("../../fonts/LiberationSans-Regular.ttf.zlib"),
    include_bytes!("../../fonts/LiberationSerif-Regular.ttf.zlib"),
];

static FACES: [LazyLock<Result<Font, String>>; 2] =
    [LazyLock::new(|| Font::read(0)), LazyLock::new(|| Font::read(1))];

/// A font; lengths as parts of its size.
pub(super) struct Font {
    face: Face<'static>,
    /// The file.
    pub(super) bytes: &'static [u8],
    /// Its name in a PDF.
    pub(super) name: &'static str,
    unit: f64, // 1 / units per em
}

impl Font {
    pub(super) fn of(typeface: Typeface) -> Result<&'static Self, String> {
        FACES[typeface as usize].as_ref().map_err(Clone::clone)
    }

    fn read(index: usize) -> Result<Self, String> {
        let bytes = decompress_to_vec_zlib(FILES[index]).map_err(|e| e.to_string())?;
        let bytes: &'static [u8] = bytes.leak(); // once for each font
        let face = Face::parse(bytes, 0).map_err(|e| e.to_string())?;
        let unit = 1.0 / f64::from(face.units_per_em());
        Ok(Self { face, bytes, name: ["LiberationSans", "LiberationSerif"][index], unit })
    }

    /// The glyph of a letter; `None`: the font lacks it.
    pub(super) fn glyph(&self, letter: char) -> Option<u16> {
        self.face.glyph_index(letter).map(|glyph| glyph.0)
    }

    /// How far the next glyph is.
    pub(super) fn advance(&self, glyph: u16) -> f64 {
        self.unit * f64::from(self.face.glyph_hor_advance(GlyphId(glyph)).unwrap_or(0))
    }

    pub(super) fn width(&self, text: &str) -> f64 {
        // a letter that the font lacks is a square in most others
        text.chars().map(|c| self.glyph(c).map_or(1.0, |glyph| self.advance(glyph))).sum()
    }

    /// Draws a glyph in units of [`Font::unit`], `y` upwards.
    pub(super) fn outline(&self, glyph: u16, builder: &mut dyn OutlineBuilder) {
        let _ = self.face.outline_glyph(GlyphId(glyph), builder); // blanks have none
    }

    pub(super) fn unit(&self) -> f64 {
        self.unit
    }

    /// Ascender, descender, height of capitals, and the box around all glyphs.
    pub(super) fn metrics(&self) -> ([f64; 3], [f64; 4]) {
        let face = &self.face;
        let capital = face.capital_height().unwrap_or_else(|| face.ascender());
        let heights = [face.ascender(), face.descender(), capital];
        let all = face.global_bounding_box();
        let all = [all.x_min, all.y_min, all.x_max, all.y_max];
        let part = |v: i16| self.unit * f64::from(v);
        (heights.map(part), all.map(part))
    }
}
