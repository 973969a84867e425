//! A drawing as a list of marks, written as SVG, PDF or PNG.
//!
//! ```text
//! Chart, Picture → Drawing → svg.rs, pdf.rs, png.rs
//! ```
//! Lengths are px of 1/96 inch; `x` points right, `y` down. Words are set in a family whose widths
//! are those of Helvetica or Times, so that the three formats agree.

mod font;
mod pdf;
mod png;
mod svg;

use font::Font;

/// A point of a drawing or a picture.
pub type Point = [f64; 2];

/// A colour on white.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Color {
    pub(crate) rgb: [u8; 3],
    /// In `[0, 1]`; 1: the colour covers what lies beneath.
    pub(crate) opacity: f64,
}

impl Color {
    pub(crate) const fn new(rgb: [u8; 3]) -> Self {
        Self { rgb, opacity: 1.0 }
    }

    pub(crate) fn faded(self, opacity: f64) -> Self {
        Self { opacity, ..self }
    }

    /// The colour that it gives on white.
    pub(crate) fn on_white(self) -> [u8; 3] {
        let fade = |c: u8| (255.0 - (255.0 - f64::from(c)) * self.opacity).round() as u8;
        self.rgb.map(fade)
    }
}

/// How a line is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Stroke {
    pub(crate) color: Color,
    pub(crate) width: f64,
    /// Lengths of dashes and gaps in turn, px; none: a solid line.
    pub(crate) dashes: &'static [f64],
}

impl Stroke {
    pub(crate) fn solid(color: Color, width: f64) -> Self {
        Self { color, width, dashes: &[] }
    }
}

/// Which part of a word stands at its point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Anchor {
    Start,
    Middle,
    End,
}

/// One line of words.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Words {
    /// Half the height of its capitals above the line that they stand on.
    pub(crate) at: Point,
    pub(crate) text: String,
    /// Size of the font, px.
    pub(crate) size: f64,
    pub(crate) color: Color,
    pub(crate) anchor: Anchor,
    pub(crate) bold: bool,
    /// Read from below.
    pub(crate) upward: bool,
    /// As wide as it was measured, whatever font a reader has.
    pub(crate) exact: bool,
}

/// Half the height of capitals, as a part of the size of the font.
const HALF_CAPITAL: f64 = 0.36;
/// Width of bold letters, as a part of that of plain ones.
pub(crate) const BOLD: f64 = 1.08;
/// Size and height of exponents, as parts of the size of the font.
const RAISED: (f64, f64) = (0.65, 0.38);

/// What can be drawn.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Mark {
    Line(Vec<Point>, Stroke),
    Polygon(Vec<Point>, Color),
    Disc(Point, f64, Color),
    Words(Words),
}

/// The typeface of a drawing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Typeface {
    /// As Helvetica.
    #[default]
    Sans,
    /// As Times.
    Serif,
}

/// Marks on white, later ones on top.
#[derive(Clone, Debug, PartialEq)]
pub struct Drawing {
    width: f64,
    height: f64,
    typeface: Typeface,
    /// Attributes of the SVG.
    attributes: String,
    marks: Vec<Mark>,
}

impl Drawing {
    pub(crate) fn new(width: f64, height: f64, typeface: Typeface) -> Self {
        Self { width, height, typeface, attributes: String::new(), marks: Vec::new() }
    }

    /// An empty sheet, px.
    #[must_use]
    pub fn sheet(width: f64, height: f64) -> Self {
        Self::new(width, height, Typeface::Sans)
    }

    /// Adds a filled polygon, of an opacity in `[0, 1]`, with an outline of 1 px in another colour.
    pub fn area(&mut self, points: Vec<Point>, fill: [u8; 3], opacity: f64, edge: [u8; 3]) {
        let mut outline = points.clone();
        outline.extend(points.first());
        self.push(Mark::Polygon(points, Color::new(fill).faded(opacity)));
        self.push(Mark::Line(outline, Stroke::solid(Color::new(edge), 0.8)));
    }

    /// Adds a polyline; a point of no length is a disc.
    pub fn line(&mut self, points: Vec<Point>, color: [u8; 3], width: f64) {
        let color = Color::new(color);
        match points.as_slice() {
            [a, b] if (b[0] - a[0]).hypot(b[1] - a[1]) < 0.05 => {
                self.push(Mark::Disc(*a, 0.5 * width, color));
            }
            _ => self.push(Mark::Line(points, Stroke::solid(color, width))),
        }
    }

    /// Adds a mark; control characters, which no format can hold, are left out of words.
    pub(crate) fn push(&mut self, mut mark: Mark) {
        if let Mark::Words(words) = &mut mark {
            words.text.retain(|c| !c.is_control());
        }
        self.marks.push(mark);
    }

    /// States an attribute of the SVG.
    pub(crate) fn attribute(&mut self, name: &str, value: &str) {
        self.attributes += &format!("{name}=\"{value}\" ");
    }

    /// The drawing as a stand-alone SVG.
    #[must_use]
    pub fn svg(&self) -> String {
        svg::write(self)
    }

    /// The drawing as a PDF of one page with its fonts.
    ///
    /// # Errors
    /// What is wrong with the fonts.
    pub fn pdf(&self) -> Result<Vec<u8>, String> {
        pdf::write(self)
    }

    /// The drawing as a PNG with `scale` pixels for each px.
    ///
    /// # Errors
    /// A size that is no picture.
    pub fn png(&self, scale: f64) -> Result<Vec<u8>, String> {
        png::write(self, scale)
    }

    /// Letters that the font of PDF and PNG lacks.
    ///
    /// # Errors
    /// What is wrong with the fonts.
    pub fn missing_letters(&self) -> Result<String, String> {
        let font = Font::of(self.typeface)?;
        let words = self.marks.iter().filter_map(|mark| match mark {
            Mark::Words(words) => Some(words.text.as_str()),
            _ => None,
        });
        let mut missing = String::new();
        for (text, _) in words.flat_map(runs) {
            for letter in text.chars().filter(|c| font.glyph(*c).is_none()) {
                if !missing.contains(letter) {
                    missing.push(letter);
                }
            }
        }
        Ok(missing)
    }
}

/// Width of a line of words, px.
pub(crate) fn width(text: &str, size: f64, typeface: Typeface) -> f64 {
    let average = 0.55; // of a font that cannot be read
    let Ok(font) = Font::of(typeface) else { return average * size * text.chars().count() as f64 };
    let of = |(text, raised): (String, bool)| {
        font.width(&text) * size * if raised { RAISED.0 } else { 1.0 }
    };
    runs(text).into_iter().map(of).sum()
}

/// A text that is not wider than `room`: its middle is left out where it would be.
pub(crate) fn shortened(text: &str, size: f64, typeface: Typeface, room: f64) -> String {
    if width(text, size, typeface) <= room {
        return text.to_owned();
    }
    let letters: Vec<char> = text.chars().collect();
    let with = |kept: usize| -> String {
        let (head, tail) = (kept.div_ceil(2), kept / 2);
        let ends =
            letters[..head].iter().chain(['…'].iter()).chain(&letters[letters.len() - tail..]);
        ends.collect()
    };
    let kept = (1..letters.len()).rev().find(|kept| width(&with(*kept), size, typeface) <= room);
    with(kept.unwrap_or(1))
}

/// Parts of a text, each with whether it is an exponent, written with ordinary letters.
fn runs(text: &str) -> Vec<(String, bool)> {
    const EXPONENTS: &str = "⁰¹²³⁴⁵⁶⁷⁸⁹⁻";
    const PLAIN: &str = "0123456789−";
    let mut runs: Vec<(String, bool)> = Vec::new();
    for c in text.chars() {
        let place = EXPONENTS.chars().position(|e| e == c);
        let c = place.and_then(|k| PLAIN.chars().nth(k)).unwrap_or(c);
        match runs.last_mut().filter(|last| last.1 == place.is_some()) {
            Some(last) => last.0.push(c),
            None => runs.push((c.to_string(), place.is_some())),
        }
    }
    runs
}

/// A run of letters with its place.
struct PlacedRun {
    text: String,
    size: f64,
    /// Where it begins, before the words are rotated about `Words::at`.
    at: Point,
}

/// The runs of a line of words, placed as if it were read from the left.
fn placed(words: &Words, typeface: Typeface) -> Vec<PlacedRun> {
    let all = width(&words.text, words.size, typeface);
    let before = match words.anchor {
        Anchor::Start => 0.0,
        Anchor::Middle => 0.5 * all,
        Anchor::End => all,
    };
    let (mut x, line) = (words.at[0] - before, words.at[1] + HALF_CAPITAL * words.size);
    let mut placed = Vec::new();
    for (text, raised) in runs(&words.text) {
        let (size, up) = match raised {
            true => (RAISED.0 * words.size, RAISED.1 * words.size),
            false => (words.size, 0.0),
        };
        let next = x + width(&text, size, typeface);
        placed.push(PlacedRun { text, size, at: [x, line - up] });
        x = next;
    }
    placed
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A line, a polygon, a disc and words of each kind.
    pub(super) fn sample() -> Drawing {
        let mut drawing = Drawing::new(200.0, 100.0, Typeface::Sans);
        let ink = Color::new([200, 0, 0]);
        let dashed = Stroke { dashes: &[4.0, 2.0], ..Stroke::solid(ink.faded(0.5), 1.5) };
        drawing.push(Mark::Line(vec![[10.0, 10.0], [190.0, 10.0]], dashed));
        drawing.push(Mark::Polygon(vec![[10.0, 60.0], [40.0, 60.0], [40.0, 90.0]], ink));
        drawing.push(Mark::Disc([100.0, 80.0], 8.0, ink));
        let words = |at, anchor, bold, upward| {
            let text = "ω <10⁻³ kg·m²/s>".to_owned();
            let exact = false;
            Mark::Words(Words { at, text, size: 12.0, color: ink, anchor, bold, upward, exact })
        };
        drawing.push(words([100.0, 40.0], Anchor::Middle, true, false));
        drawing.push(words([180.0, 50.0], Anchor::Middle, false, true));
        drawing
    }

    #[test]
    fn exponents_are_raised_digits() {
        let expected = [("10", false), ("−16", true), (" m", false), ("2", true)];
        let found = runs("10⁻¹⁶ m²");
        assert_eq!(found, expected.map(|(text, raised)| (text.to_owned(), raised)));
        let exponent = width("⁻¹⁶", 10.0, Typeface::Serif);
        let plain = width("−16", 10.0, Typeface::Serif);
        assert!((exponent - RAISED.0 * plain).abs() < 1e-12, "{exponent} of {plain}");
    }

    #[test]
    fn long_words_lose_their_middle() {
        let long = "Position of a very long name of a body with the number 17";
        for room in [500.0, 200.0, 80.0] {
            let found = shortened(long, 14.0, Typeface::Sans, room);
            assert!(width(&found, 14.0, Typeface::Sans) <= room, "{found}");
            assert!(found == long || found.contains('…') && found.starts_with("Po"), "{found}");
        }
        assert_eq!(shortened("x", 14.0, Typeface::Sans, 50.0), "x");
    }

    #[test]
    fn letters_without_a_glyph_are_named() {
        let mut drawing = sample();
        assert_eq!(drawing.missing_letters().unwrap(), "");
        let text = "振り子 φ\u{1b} 振".to_owned();
        let color = Color::new([0; 3]);
        let (at, size, anchor) = ([0.0, 0.0], 12.0, Anchor::Start);
        let (bold, upward, exact) = (false, false, false);
        let words = Words { at, text, size, color, anchor, bold, upward, exact };
        drawing.push(Mark::Words(words));
        assert_eq!(drawing.missing_letters().unwrap(), "振り子");
    }
}
