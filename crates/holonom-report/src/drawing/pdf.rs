//! A drawing as a PDF of one page. Words stay words: the glyphs in use are embedded as a TrueType
//! font.

use std::collections::BTreeMap;

use miniz_oxide::deflate::compress_to_vec_zlib;
use pdf_writer::types::{
    CidFontType, FontFlags, LineCapStyle, LineJoinStyle, SystemInfo, TextRenderingMode, UnicodeCmap,
};
use pdf_writer::{Content, Filter, Name, Pdf, Rect, Ref, Str};
use subsetter::GlyphRemapper;

use super::font::Font;
use super::png::BOLD;
use super::{Color, Drawing, Mark, Point, Words, placed};

/// Points of 1/72 inch for each px.
const POINTS: f64 = 72.0 / 96.0;
/// Control points of a quarter of a circle, as a part of the radius.
const QUARTER: f64 = 0.552_284_749_8;
/// Of zlib, 0 to 10.
const COMPRESSION: u8 = 9;
/// Name of the font on the page.
const FONT: Name<'static> = Name(b"F");

const CATALOG: Ref = Ref::new(1);
const PAGES: Ref = Ref::new(2);
const PAGE: Ref = Ref::new(3);
const CONTENT: Ref = Ref::new(4);
const FONT_DICTIONARY: Ref = Ref::new(5);
const CID_FONT: Ref = Ref::new(6);
const DESCRIPTOR: Ref = Ref::new(7);
const LETTERS: Ref = Ref::new(8);
const FONT_FILE: Ref = Ref::new(9);

const SYSTEM: SystemInfo<'static> =
    SystemInfo { registry: Str(b"Adobe"), ordering: Str(b"Identity"), supplement: 0 };

pub(super) fn write(drawing: &Drawing) -> Result<Vec<u8>, String> {
    let font = Font::of(drawing.typeface)?;
    let mut page =
        Page { content: Content::new(), glyphs: Glyphs::new(font), height: drawing.height };
    page.content.set_line_join(LineJoinStyle::RoundJoin).set_line_cap(LineCapStyle::ButtCap);
    for mark in &drawing.marks {
        page.push(mark, drawing);
    }
    let mut pdf = Pdf::new();
    pdf.catalog(CATALOG).pages(PAGES);
    pdf.pages(PAGES).kids([PAGE]).count(1);
    let mut sheet = pdf.page(PAGE);
    let [width, height] = [drawing.width, drawing.height].map(|v| (v * POINTS) as f32);
    sheet.parent(PAGES).media_box(Rect::new(0.0, 0.0, width, height)).contents(CONTENT);
    sheet.resources().fonts().pair(FONT, FONT_DICTIONARY);
    drop(sheet);
    let content = compress_to_vec_zlib(&page.content.finish(), COMPRESSION);
    pdf.stream(CONTENT, &content).filter(Filter::FlateDecode);
    page.glyphs.embed(&mut pdf)?;
    Ok(pdf.finish())
}

struct Page {
    content: Content,
    glyphs: Glyphs,
    height: f64,
}

impl Page {
    /// A place of the drawing on the page.
    fn at(&self, p: Point) -> [f32; 2] {
        [(p[0] * POINTS) as f32, ((self.height - p[1]) * POINTS) as f32]
    }

    fn push(&mut self, mark: &Mark, drawing: &Drawing) {
        match mark {
            Mark::Line(points, stroke) => {
                let [r, g, b] = rgb(stroke.color);
                let dashes = stroke.dashes.iter().map(|d| (d * POINTS) as f32);
                self.content.set_stroke_rgb(r, g, b).set_dash_pattern(dashes, 0.0);
                self.content.set_line_width((stroke.width * POINTS) as f32);
                self.path(points);
                self.content.stroke();
            }
            Mark::Polygon(points, color) => {
                self.fill(*color);
                self.path(points);
                self.content.close_path().fill_nonzero();
            }
            Mark::Disc(center, radius, color) => {
                self.fill(*color);
                self.circle(*center, *radius);
                self.content.fill_nonzero();
            }
            Mark::Words(words) => self.words(words, drawing),
        }
    }

    fn fill(&mut self, color: Color) {
        let [r, g, b] = rgb(color);
        self.content.set_fill_rgb(r, g, b);
    }

    fn path(&mut self, points: &[Point]) {
        for (k, point) in points.iter().enumerate() {
            let [x, y] = self.at(*point);
            let _ = if k == 0 { self.content.move_to(x, y) } else { self.content.line_to(x, y) };
        }
    }

    fn circle(&mut self, center: Point, radius: f64) {
        let at = |x: f64, y: f64| self.at([center[0] + radius * x, center[1] + radius * y]);
        let quarter = |(x, y): (f64, f64)| {
            // from (x, y) a quarter further
            let (next, k) = ((-y, x), QUARTER);
            [
                at(x + k * next.0, y + k * next.1),
                at(next.0 + k * x, next.1 + k * y),
                at(next.0, next.1),
            ]
        };
        let start = at(1.0, 0.0);
        let arcs = [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)].map(quarter);
        self.content.move_to(start[0], start[1]);
        for [a, b, end] in arcs {
            self.content.cubic_to(a[0], a[1], b[0], b[1], end[0], end[1]);
        }
    }

    fn words(&mut self, words: &Words, drawing: &Drawing) {
        self.fill(words.color);
        let mode = match words.bold {
            true => TextRenderingMode::FillStroke,
            false => TextRenderingMode::Fill,
        };
        if words.bold {
            let [r, g, b] = rgb(words.color);
            self.content.set_stroke_rgb(r, g, b).set_dash_pattern([], 0.0);
            self.content.set_line_width((BOLD * words.size * POINTS) as f32);
        }
        self.content.begin_text();
        self.content.set_text_rendering_mode(mode);
        for run in placed(words, drawing.typeface) {
            // about Words::at, a quarter of a revolution for words that are read from below
            let (x, y) = (run.at[0] - words.at[0], run.at[1] - words.at[1]);
            let (place, [cos, sin]) = match words.upward {
                true => ([words.at[0] + y, words.at[1] - x], [0.0, 1.0]),
                false => (run.at, [1.0, 0.0]),
            };
            let [x, y] = self.at(place);
            self.content.set_font(FONT, (run.size * POINTS) as f32);
            self.content.set_text_matrix([cos, sin, -sin, cos, x, y]);
            let codes = self.glyphs.codes(&run.text);
            self.content.show(Str(&codes));
        }
        self.content.end_text();
    }
}

fn rgb(color: Color) -> [f32; 3] {
    color.on_white().map(|c| f32::from(c) / 255.0)
}

/// The glyphs in use.
struct Glyphs {
    font: &'static Font,
    remapper: GlyphRemapper,
    /// Letter and width of each, by its code.
    used: BTreeMap<u16, (char, f64)>,
}

impl Glyphs {
    fn new(font: &'static Font) -> Self {
        Self { font, remapper: GlyphRemapper::new(), used: BTreeMap::new() }
    }

    /// The letters as codes of two bytes.
    fn codes(&mut self, text: &str) -> Vec<u8> {
        let mut codes = Vec::new();
        for letter in text.chars() {
            let glyph = self.font.glyph(letter).unwrap_or(0);
            let code = self.remapper.remap(glyph);
            self.used.insert(code, (letter, self.font.advance(glyph)));
            codes.extend(code.to_be_bytes());
        }
        codes
    }

    /// Writes the font with these glyphs alone.
    fn embed(&self, pdf: &mut Pdf) -> Result<(), String> {
        let file =
            subsetter::subset(self.font.bytes, 0, &self.remapper).map_err(|e| e.to_string())?;
        // the six letters name a subset
        let name = format!("HOLONO+{}", self.font.name);
        let name = Name(name.as_bytes());
        pdf.type0_font(FONT_DICTIONARY)
            .base_font(name)
            .encoding_predefined(Name(b"Identity-H"))
            .descendant_font(CID_FONT)
            .to_unicode(LETTERS);
        let mut cid = pdf.cid_font(CID_FONT);
        cid.subtype(CidFontType::Type2).base_font(name).system_info(SYSTEM);
        cid.font_descriptor(DESCRIPTOR).cid_to_gid_map_predefined(Name(b"Identity"));
        let mut widths = cid.widths();
        for (code, (_, width)) in &self.used {
            widths.consecutive(*code, [(1000.0 * width) as f32]);
        }
        drop(widths);
        drop(cid);
        let ([ascent, descent, capital], all) = self.font.metrics();
        let thousandths = |v: f64| (1000.0 * v) as f32;
        let [left, bottom, right, top] = all.map(thousandths);
        pdf.font_descriptor(DESCRIPTOR)
            .name(name)
            .flags(FontFlags::SYMBOLIC)
            .bbox(Rect::new(left, bottom, right, top))
            .italic_angle(0.0)
            .ascent(thousandths(ascent))
            .descent(thousandths(descent))
            .cap_height(thousandths(capital))
            .stem_v(80.0)
            .font_file2(FONT_FILE);
        let mut letters = UnicodeCmap::new(Name(b"Custom"), SYSTEM);
        for (code, (letter, _)) in &self.used {
            letters.pair(*code, *letter);
        }
        let letters = compress_to_vec_zlib(&letters.finish(), COMPRESSION);
        pdf.cmap(LETTERS, &letters).filter(Filter::FlateDecode);
        let compressed = compress_to_vec_zlib(&file, COMPRESSION);
        let mut stream = pdf.stream(FONT_FILE, &compressed);
        stream.filter(Filter::FlateDecode);
        stream.pair(Name(b"Length1"), i32::try_from(file.len()).unwrap_or(i32::MAX));
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::sample;

    #[test]
    fn the_page_has_the_size_of_the_drawing_and_a_part_of_the_font() {
        let pdf = sample().pdf().unwrap();
        let text = String::from_utf8_lossy(&pdf);
        assert!(text.starts_with("%PDF-1.7") && text.trim_end().ends_with("%%EOF"));
        assert!(text.contains("/MediaBox [0 0 150 75]"), "200 × 100 px are 150 × 75 points");
        assert!(text.contains("/HOLONO+LiberationSans"));
        assert!((2_000..30_000).contains(&pdf.len()), "{} bytes", pdf.len());
    }
}
