//! The drawing of one configuration, as SVG, PDF or PNG: the first frame of the animated one.

use holonom_model::{Model, ModelError};
use holonom_report::Drawing;
use holonom_sim::output::Frames;

use super::item::{self, ItemStyle, SvgItem};
use super::view::{Directions, Sheet};
use super::{HEIGHT, MARGIN, OPACITY, WIDTH};
use crate::look::{INK, Look, poses};

/// px of the drawing for each unit of the animated one.
const PX: f64 = 0.1;
/// The thinnest line, px.
const THINNEST: f64 = 3.0;

/// A model in its initial configuration, drawn as the frames of
/// [`Format::Svg`](crate::Format::Svg). `None` without bodies, beams and point masses.
///
/// # Errors
/// [`ModelError`] when the model cannot be assembled.
pub fn configuration(model: &Model) -> Result<Option<Drawing>, ModelError> {
    let frames = Frames::initial(model)?;
    let Some(look) = Look::new(model, &frames, &[]) else { return Ok(None) };
    let view = Directions::new(&look.up, model.header.dimension == 2);
    let poses = poses(&frames.members, &frames.q[0]);
    let mut items = item::all(&look);
    items.iter_mut().for_each(|item| item.follow(0.0, &poses, &view));
    items.sort_by(SvgItem::order);
    let points = items.iter().flat_map(SvgItem::points);
    let size = [PX * WIDTH, PX * HEIGHT];
    let sheet = Sheet::around(points, size, PX * MARGIN);
    Ok(sheet.map(|sheet| drawing(&items, &sheet)))
}

fn drawing(items: &[SvgItem], sheet: &Sheet) -> Drawing {
    let mut drawing = Drawing::sheet(PX * WIDTH, sheet.height.ceil());
    for item in items {
        let points = item.points().map(|point| sheet.placed(point)).collect();
        match item.stroke {
            ItemStyle::Surface => {
                drawing.area(points, item.color, OPACITY * item.opacity, INK);
            }
            ItemStyle::Line(metres) => {
                drawing.line(points, item.color, (metres * sheet.scale).max(THINNEST));
            }
        }
    }
    drawing
}
