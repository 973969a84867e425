//! `cargo xtask figures`: the figures of Leyendecker, Marsden & Ortiz (ZAMM 88, 2008), computed
//! anew.
//!
//! Every picture and every number of the page comes from a run made here; models are the shipped
//! ones. Writes `examples/leyendecker_2008/*.svg` and its `README.md`; `ERRATA.md` there is written
//! by hand.

mod comparison;
mod flexible;
mod linkage;
mod orbit;
mod page;
mod pendulum;

use holonom_reliability::text_file;
use std::path::Path;

use holonom::report::{LineChart, Picture, Series};
use holonom::{Model, Override};

/// What goes wrong is said in words: nobody decides by it.
type Result<T> = std::result::Result<T, String>;

/// A picture and what it shows.
struct Figure {
    file: &'static str,
    svg: String,
    caption: String,
}

impl Figure {
    fn chart(file: &'static str, chart: &LineChart, caption: String) -> Result<Self> {
        Ok(Self { file, svg: chart.svg(), caption })
    }

    /// Charts below one another.
    fn panels(file: &'static str, charts: &[LineChart], caption: String) -> Result<Self> {
        const SIZE: (usize, usize) = (880, 330); // of a chart, px
        let mut svg = format!(
            "<svg width=\"{}\" height=\"{}\" xmlns=\"http://www.w3.org/2000/svg\">\n",
            SIZE.0,
            SIZE.1 * charts.len()
        );
        for (k, chart) in charts.iter().enumerate() {
            svg += &chart.svg().replacen("<svg ", &format!("<svg y=\"{}\" ", SIZE.1 * k), 1);
        }
        svg += "</svg>\n";
        Ok(Self { file, svg, caption })
    }

    fn picture(file: &'static str, picture: &Picture, caption: String) -> Result<Self> {
        Ok(Self { file, svg: picture.svg()?, caption })
    }
}

/// Figures under one heading.
struct Section {
    heading: &'static str,
    words: String,
    figures: Vec<Figure>,
}

/// Draws all figures and writes the page.
///
/// # Errors
/// What could not be measured or written, in words.
pub fn run() -> std::result::Result<(), String> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let sections = [
        pendulum::free(&shipped(&root, "pendulum_free")?)?,
        pendulum::gravity(&shipped(&root, "pendulum")?)?,
        linkage::section(&shipped(&root, "six_hinge_cube")?)?,
        flexible::section(&shipped(&root, "flexible_multibody")?)?,
    ];
    let folder = root.join("examples/leyendecker_2008");
    let write = |file: &str, text: &str| text_file::write(&folder.join(file), text);
    std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
    for figure in sections.iter().flat_map(|section| &section.figures) {
        write(figure.file, &figure.svg)?;
        println!("{}", figure.file);
    }
    write("README.md", &page::page(&sections))?;
    println!("README.md");
    Ok(())
}

fn shipped(root: &Path, name: &str) -> Result<Model> {
    let path = root.join(format!("examples/models/{name}.toml"));
    let text = text_file::read(&path)?;
    Model::from_toml(&text).map_err(|e| format!("{}: {e}", path.display()))
}

/// A shipped model with other settings: `("simulation.step", "0.1")`.
fn with(model: &Model, settings: &[(&str, &str)]) -> Result<Model> {
    let settings: Vec<_> = settings.iter().map(|(k, v)| Override::new(*k, *v)).collect();
    model.with_overrides(&settings).map_err(|e| e.to_string())
}

/// A curve of `y` over `x`.
fn curve(name: &str, points: impl IntoIterator<Item = (f64, f64)>) -> Series {
    Series { name: name.to_owned(), points: points.into_iter().collect() }
}

/// Largest magnitude; not a number if any value is none.
fn largest(values: impl IntoIterator<Item = f64>) -> f64 {
    holonom::vi_core::linear::norm_inf(&values.into_iter().collect::<Vec<_>>())
}

/// Smallest and largest value.
fn span(values: impl IntoIterator<Item = f64>) -> (f64, f64) {
    let widen = |(low, high): (f64, f64), v: f64| (low.min(v), high.max(v));
    values.into_iter().fold((f64::INFINITY, f64::NEG_INFINITY), widen)
}
