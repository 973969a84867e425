//! A drawing as SVG. Words stay words, in the reader's font of the same widths.

use std::fmt::Write;

use super::{Anchor, BOLD, Color, Drawing, HALF_CAPITAL, Mark, Point, Typeface, Words};
use crate::page::escape;

pub(super) fn write(drawing: &Drawing) -> String {
    let Drawing { width, height, typeface, attributes, marks } = drawing;
    let [width, height] = [width, height].map(|v| length(*v));
    let family = match typeface {
        Typeface::Sans => "Helvetica, Arial, Liberation Sans, sans-serif",
        Typeface::Serif => "Times New Roman, Times, Liberation Serif, serif",
    };
    let mut svg = format!(
        "<svg {attributes}width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"{family}\" xmlns=\"http://www.w3.org/2000/svg\">\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#FFFFFF\"/>\n"
    );
    for mark in marks {
        push(&mut svg, mark, *typeface);
    }
    svg += "</svg>\n";
    svg
}

fn push(svg: &mut String, mark: &Mark, typeface: Typeface) {
    let _ = match mark {
        Mark::Line(points, stroke) => {
            let list: Vec<String> = stroke.dashes.iter().map(|d| length(*d)).collect();
            let dashes = match list.is_empty() {
                true => String::new(),
                false => format!(" stroke-dasharray=\"{}\"", list.join(" ")),
            };
            writeln!(
                svg,
                "<polyline fill=\"none\" {} stroke-width=\"{}\"{dashes} stroke-linejoin=\"round\" points=\"{}\"/>",
                paint("stroke", stroke.color),
                length(stroke.width),
                places(points)
            )
        }
        Mark::Polygon(points, color) => {
            writeln!(svg, "<polygon {} points=\"{}\"/>", paint("fill", *color), places(points))
        }
        Mark::Disc(center, radius, color) => writeln!(
            svg,
            "<circle cx=\"{}\" cy=\"{}\" r=\"{}\" {}/>",
            length(center[0]),
            length(center[1]),
            length(*radius),
            paint("fill", *color)
        ),
        Mark::Words(words) => writeln!(svg, "{}", text(words, typeface)),
    };
}

fn text(words: &Words, typeface: Typeface) -> String {
    let (x, y) = (length(words.at[0]), length(words.at[1] + HALF_CAPITAL * words.size));
    let anchor = match words.anchor {
        Anchor::Start => "start",
        Anchor::Middle => "middle",
        Anchor::End => "end",
    };
    let bold = if words.bold { " font-weight=\"bold\"" } else { "" };
    let upward = match words.upward {
        true => {
            format!(" transform=\"rotate(-90 {} {})\"", length(words.at[0]), length(words.at[1]))
        }
        false => String::new(),
    };
    let exact = match words.exact {
        true => {
            let bold = if words.bold { BOLD } else { 1.0 };
            let wide = bold * super::width(&words.text, words.size, typeface);
            format!(" textLength=\"{}\" lengthAdjust=\"spacingAndGlyphs\"", length(wide))
        }
        false => String::new(),
    };
    format!(
        "<text x=\"{x}\" y=\"{y}\" font-size=\"{}\" text-anchor=\"{anchor}\" {}{bold}{upward}{exact}>{}</text>",
        length(words.size),
        paint("fill", words.color),
        escape(&words.text)
    )
}

fn paint(what: &str, color: Color) -> String {
    let [r, g, b] = color.rgb;
    let opacity = match color.opacity < 1.0 {
        true => format!(" {what}-opacity=\"{}\"", length(color.opacity)),
        false => String::new(),
    };
    format!("{what}=\"#{r:02X}{g:02X}{b:02X}\"{opacity}")
}

fn places(points: &[Point]) -> String {
    let mut list = String::with_capacity(12 * points.len());
    for (k, [x, y]) in points.iter().enumerate() {
        list += if k > 0 { " " } else { "" };
        push_tenths(&mut list, *x);
        list.push(',');
        push_tenths(&mut list, *y);
    }
    list
}

/// Hundredths of a px.
fn length(value: f64) -> String {
    short(&format!("{value:.2}"))
}

/// Tenths of a px: half of the distance that points of a curve keep.
fn push_tenths(list: &mut String, value: f64) {
    let tenths = (10.0 * value).round_ties_even() as i64;
    let (whole, rest) = (tenths.unsigned_abs() / 10, tenths.unsigned_abs() % 10);
    if tenths < 0 {
        list.push('-');
    }
    list.push_str(itoa::Buffer::new().format(whole));
    if rest > 0 {
        list.push('.');
        list.push(char::from(b'0' + rest as u8));
    }
}

/// Without trailing zeros.
fn short(text: &str) -> String {
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::super::tests::sample;
    use super::places;

    #[test]
    fn places_are_tenths_without_trailing_zeros() {
        let points = [[0.04, -0.04], [12.0, -3.06], [-0.26, 1999.95]];
        assert_eq!(places(&points), "0,0 12,-3.1 -0.3,2000");
    }

    #[test]
    fn marks_and_words() {
        let svg = sample().svg();
        assert!(
            svg.contains("stroke-opacity=\"0.5\" stroke-width=\"1.5\" stroke-dasharray=\"4 2\"")
        );
        assert!(svg.contains("ω &lt;10⁻³ kg·m²/s&gt;</text>"), "{svg}");
        assert!(svg.contains("transform=\"rotate(-90 180 50)\""), "{svg}");
    }
}
