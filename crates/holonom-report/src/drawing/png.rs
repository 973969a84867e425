//! A drawing as PNG: lines, areas and outlines of glyphs, with smoothed edges.

use tiny_skia::{
    FillRule, LineCap, LineJoin, Paint, Path, PathBuilder, Pixmap, PixmapMut, Stroke as Pen,
    StrokeDash, Transform,
};
use ttf_parser::OutlineBuilder;

use super::font::Font;
use super::{Color, Drawing, Mark, Point, Words, placed};

/// Largest width and height, pixels.
const LARGEST: f64 = 20_000.0;
/// Width of the line that makes glyphs bold, as a part of the size of the font.
pub(super) const BOLD: f64 = 0.045;

pub(super) fn write(drawing: &Drawing, scale: f64) -> Result<Vec<u8>, String> {
    let [width, height] = [drawing.width, drawing.height].map(|v| (v * scale).round());
    if ![width, height].iter().all(|v| (1.0..=LARGEST).contains(v)) {
        return Err(format!("a picture of {width} × {height} pixels"));
    }
    let mut pixels = Pixmap::new(width as u32, height as u32).ok_or("no memory for the picture")?;
    pixels.fill(tiny_skia::Color::WHITE);
    let mut canvas = Canvas { pixels: pixels.as_mut(), scale: scale as f32 };
    for mark in &drawing.marks {
        match mark {
            Mark::Line(points, stroke) => {
                let pen = Pen {
                    width: stroke.width as f32,
                    line_join: LineJoin::Round,
                    line_cap: LineCap::Butt,
                    dash: StrokeDash::new(stroke.dashes.iter().map(|d| *d as f32).collect(), 0.0),
                    ..Pen::default()
                };
                canvas.stroke(polyline(points, false), stroke.color, &pen);
            }
            Mark::Polygon(points, color) => canvas.fill(polyline(points, true), *color),
            Mark::Disc(center, radius, color) => {
                let disc =
                    PathBuilder::from_circle(center[0] as f32, center[1] as f32, *radius as f32);
                canvas.fill(disc, *color);
            }
            Mark::Words(words) => canvas.words(words, Font::of(drawing.typeface)?, drawing),
        }
    }
    encode(&pixels, scale)
}

/// Without transparency, with the number of pixels per metre.
fn encode(pixels: &Pixmap, scale: f64) -> Result<Vec<u8>, String> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, pixels.width(), pixels.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let density = (scale * 96.0 / 0.0254).round() as u32;
    let unit = png::Unit::Meter;
    encoder.set_pixel_dims(Some(png::PixelDimensions { xppu: density, yppu: density, unit }));
    let rgb: Vec<u8> = pixels.data().chunks_exact(4).flat_map(|p| [p[0], p[1], p[2]]).collect();
    let mut writer = encoder.write_header().map_err(|e| e.to_string())?;
    writer.write_image_data(&rgb).map_err(|e| e.to_string())?;
    writer.finish().map_err(|e| e.to_string())?;
    Ok(bytes)
}

struct Canvas<'a> {
    pixels: PixmapMut<'a>,
    scale: f32,
}

impl Canvas<'_> {
    fn fill(&mut self, path: Option<Path>, color: Color) {
        let Some(path) = path else { return };
        let to = Transform::from_scale(self.scale, self.scale);
        self.pixels.fill_path(&path, &paint(color), FillRule::Winding, to, None);
    }

    fn stroke(&mut self, path: Option<Path>, color: Color, pen: &Pen) {
        let Some(path) = path else { return };
        let to = Transform::from_scale(self.scale, self.scale);
        self.pixels.stroke_path(&path, &paint(color), pen, to, None);
    }

    fn words(&mut self, words: &Words, font: &Font, drawing: &Drawing) {
        let mut outline = GlyphPath { path: PathBuilder::new(), place: Transform::identity() };
        let about = (words.at[0] as f32, words.at[1] as f32);
        let angle = if words.upward { -90.0 } else { 0.0 };
        let rotation = Transform::from_rotate_at(angle, about.0, about.1);
        for run in placed(words, drawing.typeface) {
            let size = (run.size * font.unit()) as f32;
            let mut x = run.at[0];
            for letter in run.text.chars() {
                let glyph = font.glyph(letter).unwrap_or(0);
                let at = Transform::from_row(size, 0.0, 0.0, -size, x as f32, run.at[1] as f32);
                outline.place = rotation.pre_concat(at);
                font.outline(glyph, &mut outline);
                x += run.size * font.advance(glyph);
            }
        }
        let path = outline.path.finish();
        if words.bold {
            let pen = Pen { width: (BOLD * words.size) as f32, ..Pen::default() };
            self.stroke(path.clone(), words.color, &pen);
        }
        self.fill(path, words.color);
    }
}

fn paint(color: Color) -> Paint<'static> {
    let [r, g, b] = color.rgb;
    let mut paint = Paint::default();
    paint.set_color_rgba8(r, g, b, (255.0 * color.opacity).round() as u8);
    paint
}

fn polyline(points: &[Point], closed: bool) -> Option<Path> {
    let mut path = PathBuilder::new();
    for (k, [x, y]) in points.iter().map(|p| p.map(|v| v as f32)).enumerate() {
        if k == 0 { path.move_to(x, y) } else { path.line_to(x, y) }
    }
    if closed {
        path.close();
    }
    path.finish()
}

/// Glyphs as a path.
struct GlyphPath {
    path: PathBuilder,
    place: Transform,
}

impl GlyphPath {
    fn at(&self, x: f32, y: f32) -> (f32, f32) {
        let mut point = tiny_skia::Point::from_xy(x, y);
        self.place.map_point(&mut point);
        (point.x, point.y)
    }
}

impl OutlineBuilder for GlyphPath {
    fn move_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.move_to(x, y);
    }

    fn line_to(&mut self, x: f32, y: f32) {
        let (x, y) = self.at(x, y);
        self.path.line_to(x, y);
    }

    fn quad_to(&mut self, x1: f32, y1: f32, x: f32, y: f32) {
        let ((x1, y1), (x, y)) = (self.at(x1, y1), self.at(x, y));
        self.path.quad_to(x1, y1, x, y);
    }

    fn curve_to(&mut self, x1: f32, y1: f32, x2: f32, y2: f32, x: f32, y: f32) {
        let ((x1, y1), (x2, y2), (x, y)) = (self.at(x1, y1), self.at(x2, y2), self.at(x, y));
        self.path.cubic_to(x1, y1, x2, y2, x, y);
    }

    fn close(&mut self) {
        self.path.close();
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::sample;

    /// Reads the pixels back.
    fn pixels(bytes: &[u8]) -> (u32, u32, Vec<u8>) {
        let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
        let mut rgb = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut rgb).unwrap();
        (info.width, info.height, rgb)
    }

    #[test]
    fn marks_are_where_they_belong() {
        let (width, height, rgb) = pixels(&sample().png(2.0).unwrap());
        assert_eq!((width, height), (400, 200));
        let at = |x: u32, y: u32| -> [u8; 3] {
            let k = 3 * (2 * y * width + 2 * x) as usize;
            [rgb[k], rgb[k + 1], rgb[k + 2]]
        };
        assert_eq!(at(100, 80), [200, 0, 0], "disc");
        assert_eq!(at(36, 70), [200, 0, 0], "polygon");
        assert_eq!(at(14, 80), [255; 3], "beside the polygon");
        let dark = |x: u32, y: u32| at(x, y) != [255; 3];
        assert!((50..150).any(|x| dark(x, 40)) && (20..90).any(|y| dark(180, y)), "words");
        assert!((10..190).any(|x| dark(x, 10)) && (10..190).any(|x| !dark(x, 10)), "dashes");
    }

    #[test]
    fn sizes_that_are_no_picture_are_refused() {
        for scale in [0.0, 1e9, f64::NAN] {
            assert!(sample().png(scale).is_err(), "{scale}");
        }
    }
}
