//! An animated drawing for pages and slides: one SVG file that browsers play, without scripts
//! (SMIL).
//!
//! ```text
//! frames ── poses ── items (points in space) ── view (points of the drawing, depth) ── polygons and lines
//! ```
//! A body is the convex hull of its shape, or of each shape of its picture, in the plane of the
//! drawing, a beam the line of its nodes. What an event released is hidden from then on. Items lie
//! on one another in the order of their mean depth, joints on top. The drawing is orthographic,
//! against gravity upwards.

mod hull;
mod item;
pub(crate) mod still;
mod view;

use std::fmt::Write as _;
use std::io::{self, Write};

use crate::pace::AnimationPace;
use crate::run::ShownRun;
use crate::{ExportError, Exported};
use item::{ItemStyle, SvgItem};
use view::{Directions, Sheet};

/// Width of the drawing, tenths of a pixel.
const WIDTH: f64 = 6400.0;
/// Its greatest height.
const HEIGHT: f64 = 4800.0;
const MARGIN: f64 = 150.0;
/// Of bodies.
const OPACITY: f64 = 0.85;

/// A drawing and what is said of it.
#[derive(Debug)]
pub(crate) struct AnimatedDrawing {
    svg: String,
    pub(crate) exported: Exported,
}

impl AnimatedDrawing {
    /// Of the frames of a run.
    pub(crate) fn of(run: &ShownRun<'_>) -> Result<Self, ExportError> {
        let reader = run.frames()?;
        let recorded = reader.rows();
        let view = Directions::new(&run.look.up, run.model.header.dimension == 2);
        let mut items = item::all(&run.look);
        let mut times = Vec::new();
        for (index, frame) in reader.enumerate() {
            let frame = frame.map_err(|error| run.unreadable(error.to_string()))?;
            times.push(run.time(&frame, index));
            let poses = run.poses(&frame);
            items.iter_mut().for_each(|item| item.follow(frame.t, &poses, &view));
        }
        let sheet = Sheet::around(items.iter().flat_map(SvgItem::points), [WIDTH, HEIGHT], MARGIN);
        let sheet =
            sheet.ok_or_else(|| run.unreadable("it has numbers that are too large".into()))?;
        items.sort_by(SvgItem::order);
        let pace = AnimationPace::of(&times, run.is_static());
        let exported = Exported { frames: times.len(), recorded, pace: pace.reported() };
        Ok(Self { svg: svg(&run.model.header.name, &items, &sheet, pace.length(&times)), exported })
    }

    /// Writes the file.
    pub(crate) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        out.write_all(self.svg.as_bytes())
    }
}

/// The document; `length` of the animation, s.
fn svg(title: &str, items: &[SvgItem], sheet: &Sheet, length: f64) -> String {
    let height = sheet.height.ceil();
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{}\" height=\"{}\">\n\
         <title>{title}</title>\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n\
         <g stroke-linejoin=\"round\" stroke-linecap=\"round\">\n",
        WIDTH / 10.0,
        height / 10.0
    );
    for item in items {
        element(&mut out, item, sheet, length);
    }
    out + "</g>\n</svg>\n"
}

fn element(out: &mut String, item: &SvgItem, sheet: &Sheet, length: f64) {
    let [r, g, b] = item.color;
    let color = format!("#{r:02x}{g:02x}{b:02x}");
    let width = |metres: f64, least: f64| (metres * sheet.scale).max(least).round();
    let (tag, style) = match item.stroke {
        ItemStyle::Surface => (
            "polygon",
            format!(
                "fill=\"{color}\" fill-opacity=\"{}\" stroke=\"#404754\" stroke-width=\"8\"",
                OPACITY * item.opacity
            ),
        ),
        ItemStyle::Line(metres) => {
            let width = width(metres, 30.0);
            ("polyline", format!("fill=\"none\" stroke=\"{color}\" stroke-width=\"{width}\""))
        }
    };
    let frames: Vec<String> = item.frames.iter().map(|points| sheet.written(points)).collect();
    let first = frames.first().map_or("", String::as_str);
    let animate = |attribute: &str, values: &[String]| {
        format!(
            "<animate attributeName=\"{attribute}\" dur=\"{length}s\" calcMode=\"discrete\" \
             repeatCount=\"indefinite\" values=\"{}\"/>",
            values.join(";")
        )
    };
    let mut inner = String::new();
    if frames.windows(2).any(|pair| pair[0] != pair[1]) && length > 0.0 {
        inner += &animate("points", &frames);
    }
    if item.held < frames.len() && length > 0.0 {
        let state = |k: usize| if k < item.held { "visible" } else { "hidden" };
        let states: Vec<String> = (0..frames.len()).map(|k| state(k).to_owned()).collect();
        inner += &animate("visibility", &states);
    }
    let _ = match inner.is_empty() {
        true => writeln!(out, "<{tag} {style} points=\"{first}\"/>"),
        false => writeln!(out, "<{tag} {style} points=\"{first}\">{inner}</{tag}>"),
    };
}
