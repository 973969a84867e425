//! A drawing in the plane of lines, arrows, dots and words, both axes to one scale, as SVG.
//!
//! Configurations of space come to the plane by [`axonometric`].

use super::drawing::{self, Anchor, Color, Drawing, Mark, Point, Stroke, Typeface};
use super::series::range;
use super::style::{INK, color};

/// Room around the drawing, px.
const MARGIN: f64 = 28.0;
/// Height of the title, px.
const TITLE: f64 = 34.0;
/// Distance of words from their point, px.
const BESIDE: f64 = 7.0;
/// Width of a letter, px, about.
const LETTER: f64 = 8.0;
/// Length of an arrow's head, px.
const HEAD: f64 = 9.0;

/// The colour of a stroke.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Paint {
    /// Text colour, faded to the given strength in `[0, 1]`.
    Ink(f64),
    /// One of the colours of curves, faded to the given strength.
    Curve(usize, f64),
}

impl Paint {
    fn color(self) -> Color {
        let (color, strength) = match self {
            Self::Ink(strength) => (INK, strength),
            Self::Curve(index, strength) => (color(index), strength),
        };
        Color::new(color.faded(strength.clamp(0.0, 1.0)).on_white())
    }
}

/// On which side of their point words stand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LabelSide {
    /// They end at it.
    Left,
    /// They begin at it.
    Right,
}

/// What can be drawn; widths and sizes in px.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// A polyline.
    Line(Vec<Point>, Paint, f64),
    /// An arrow between two points.
    Arrow([Point; 2], Paint),
    /// A disc about a point, with its radius.
    Dot(Point, Paint, f64),
    /// Words beside a point.
    Words(Point, Paint, String, LabelSide),
}

impl Item {
    fn points(&self) -> &[Point] {
        match self {
            Self::Line(points, ..) => points,
            Self::Arrow(points, _) => points,
            Self::Dot(point, ..) | Self::Words(point, ..) => std::slice::from_ref(point),
        }
    }
}

/// A drawing; later items lie on top of earlier ones.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// What it shows.
    pub title: String,
    /// Its width, px; the height follows from the items.
    pub width: f64,
    /// What is drawn.
    pub items: Vec<Item>,
}

/// The place in the plane of a point of space, seen from the direction `(1, −1, 0.7)`, `z` upwards.
#[must_use]
pub fn axonometric(x: &[f64; 3]) -> Point {
    const ACROSS: [f64; 3] =
        [std::f64::consts::FRAC_1_SQRT_2, std::f64::consts::FRAC_1_SQRT_2, 0.0];
    let view = [1.0, -1.0, 0.7];
    let length = dot(&view, &view).sqrt();
    let view = view.map(|v| v / length);
    let up = [
        view[1] * ACROSS[2] - view[2] * ACROSS[1],
        view[2] * ACROSS[0] - view[0] * ACROSS[2],
        view[0] * ACROSS[1] - view[1] * ACROSS[0],
    ];
    [dot(x, &ACROSS), dot(x, &up)]
}

fn dot(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Picture {
    /// The drawing as a stand-alone SVG on white.
    ///
    /// # Errors
    /// Points that are not finite.
    pub fn svg(&self) -> Result<String, String> {
        let sheet = PixelMap::of(self)?;
        let mut drawing = Drawing::new(self.width.ceil(), sheet.height.ceil(), Typeface::Sans);
        let at = [14.0, TITLE / 2.0];
        drawing.push(words(at, &self.title, 17.0, INK, Anchor::Start, true));
        for item in &self.items {
            sheet.draw(item, &mut drawing);
        }
        Ok(drawing.svg())
    }
}

fn words(at: Point, text: &str, size: f64, color: Color, anchor: Anchor, bold: bool) -> Mark {
    let text = text.to_owned();
    let (upward, exact) = (false, false);
    Mark::Words(drawing::Words { at, text, size, color, anchor, bold, upward, exact })
}

/// The head of an arrow, `None` for one that is shorter than that.
fn head(from: Point, to: Point) -> Option<[Point; 3]> {
    let (x, y) = (to[0] - from[0], to[1] - from[1]);
    let length = x.hypot(y);
    let (x, y) = (x / length * HEAD, y / length * HEAD);
    let back = [to[0] - x, to[1] - y];
    let side = |s: f64| [back[0] - s * y, back[1] + s * x];
    (length > HEAD).then(|| [to, side(0.4), side(-0.4)])
}

/// From points of the drawing to pixels.
struct PixelMap {
    low: Point, // of the drawing
    high: Point,
    scale: f64, // px per unit
    height: f64,
    left: f64, // px left of the drawing
}

/// Room on one side for the words that reach over the edge, px; `x`: the range of all points.
fn margin(picture: &Picture, side: LabelSide, x: (f64, f64)) -> f64 {
    let span = (x.1 - x.0).max(f64::MIN_POSITIVE);
    let unit = (picture.width - 2.0 * MARGIN) / span;
    let over = |item: &Item| match item {
        Item::Words(point, _, text, own) if *own == side => {
            let inside = if side == LabelSide::Left { point[0] - x.0 } else { x.1 - point[0] };
            BESIDE + LETTER * text.chars().count() as f64 - unit * inside
        }
        _ => 0.0,
    };
    picture.items.iter().map(over).fold(MARGIN, f64::max)
}

impl PixelMap {
    fn of(picture: &Picture) -> Result<Self, String> {
        let all = || picture.items.iter().flat_map(Item::points);
        if all().flatten().any(|x| !x.is_finite()) {
            return Err("a point that is not finite".into());
        }
        let x = range(all().map(|p| p[0])).unwrap_or((0.0, 1.0));
        let y = range(all().map(|p| p[1])).unwrap_or((0.0, 1.0));
        let [left, right] =
            [LabelSide::Left, LabelSide::Right].map(|side| margin(picture, side, x));
        let scale = (picture.width - left - right) / (x.1 - x.0).max(f64::MIN_POSITIVE);
        let tallest = 2.0 * picture.width / (y.1 - y.0).max(f64::MIN_POSITIVE);
        let scale = scale.min(tallest);
        let height = TITLE + 2.0 * MARGIN + scale * (y.1 - y.0);
        Ok(Self { low: [x.0, y.0], high: [x.1, y.1], scale, height, left })
    }

    fn draw(&self, item: &Item, drawing: &mut Drawing) {
        match item {
            Item::Line(points, paint, width) => {
                let points = points.iter().map(|p| self.place(p)).collect();
                drawing.push(Mark::Line(points, Stroke::solid(paint.color(), *width)));
            }
            Item::Arrow([from, to], paint) => {
                let (from, to) = (self.place(from), self.place(to));
                drawing.push(Mark::Line(vec![from, to], Stroke::solid(paint.color(), 2.0)));
                if let Some(head) = head(from, to) {
                    drawing.push(Mark::Polygon(head.into(), paint.color()));
                }
            }
            Item::Dot(point, paint, radius) => {
                drawing.push(Mark::Disc(self.place(point), *radius, paint.color()));
            }
            Item::Words(point, paint, text, side) => {
                let [x, y] = self.place(point);
                let (x, anchor) = match side {
                    LabelSide::Left => (x - BESIDE, Anchor::End),
                    LabelSide::Right => (x + BESIDE, Anchor::Start),
                };
                drawing.push(words([x, y], text, 14.0, paint.color(), anchor, false));
            }
        }
    }

    fn place(&self, p: &Point) -> Point {
        let (x, y) = (p[0] - self.low[0], self.high[1] - p[1]);
        [self.left + self.scale * x, TITLE + MARGIN + self.scale * y]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_axes_have_one_scale() {
        let line = Item::Line(vec![[0.0, 0.0], [2.0, 1.0]], Paint::Ink(1.0), 1.0);
        let picture = Picture { title: "t".into(), width: 256.0, items: vec![line] };
        let sheet = PixelMap::of(&picture).unwrap();
        let [a, b] = [sheet.place(&[0.0, 0.0]), sheet.place(&[2.0, 1.0])];
        assert!((b[0] - a[0] - 200.0).abs() < 1e-12 && (a[1] - b[1] - 100.0).abs() < 1e-12);
        assert!(picture.svg().unwrap().starts_with("<svg width=\"256\""));
    }

    #[test]
    fn axonometric_places_have_unit_rows() {
        // three orthonormal vectors of space have images whose squares add up to two units of the
        // plane
        let images = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|x| axonometric(&x));
        let sum: f64 = images.iter().map(|p| p[0] * p[0] + p[1] * p[1]).sum();
        assert!((sum - 2.0).abs() < 1e-12, "{images:?}");
        assert!(images[2][0].abs() < 1e-12 && images[2][1] > 0.0, "z points upwards: {images:?}");
    }

    #[test]
    fn what_is_not_finite_is_refused() {
        let dot = Item::Dot([f64::NAN, 0.0], Paint::Curve(0, 1.0), 3.0);
        let picture = Picture { title: String::new(), width: 200.0, items: vec![dot] };
        assert!(picture.svg().is_err());
    }
}
