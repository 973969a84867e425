//! Charts of chosen columns of one or several runs: `holonom plot DIR --what …`.
//!
//! ```text
//! energy,bob.x,rate:angle  →  columns of each run  →  curves  →  a chart for each unit
//! ```

mod columns;
mod names;
mod nodes;
mod scales;
mod table;
mod values;

use std::collections::BTreeSet;

use holonom_sim::output::{OutputError, RunFolder};

use super::chart::{ChartAxis, LineChart, Series, Strokes};
use super::drawing::Drawing;
use super::panels::panels;
use super::series::subsample;
use super::style::{CURVES, Style};
pub use columns::{FileColumn, columns};
pub use names::{NameError, WordGroup, groups};
pub(crate) use scales::Scales;
pub use table::table;
use values::ColumnSamples;

/// Charts of one drawing.
const CHARTS: usize = 6;
/// Equilibria up to this number are drawn as points, too.
const MARKED: usize = 60;

/// What is to be drawn.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ChartRequest {
    /// Columns and groups, with commas between them; `y:x` draws one over another.
    pub what: String,
    /// The column of the horizontal axis; time by default.
    pub against: Option<String>,
    /// Changes since the first node in the place of values.
    pub change: bool,
}

/// Why it cannot be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SelectionError {
    /// A file of a run cannot be read.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A name stands for nothing, or for several columns.
    #[error("{run}: {error}")]
    Name {
        /// The run.
        run: String,
        /// What is wrong.
        error: NameError,
    },
    /// The columns have too many units.
    #[error("{0} charts in one drawing, one for each unit; at most {CHARTS}")]
    TooMany(usize),
}

/// The charts of a request.
#[derive(Clone, Debug, PartialEq)]
pub struct Selected {
    /// One for each unit.
    pub charts: Vec<LineChart>,
    /// What is not drawn.
    pub notes: Vec<String>,
}

impl Selected {
    /// The charts below one another.
    #[must_use]
    pub fn drawing(&self, style: &Style) -> Drawing {
        panels(&self.charts, style)
    }
}

/// A run to draw.
#[derive(Clone, Debug)]
pub struct NamedRun {
    /// Its name in legends.
    pub name: String,
    /// Where it is.
    pub folder: RunFolder,
}

/// Reads the columns of a request from the runs and draws them.
///
/// # Errors
/// [`SelectionError`].
pub fn selected(runs: &[NamedRun], request: &ChartRequest) -> Result<Selected, SelectionError> {
    let mut traces = Vec::new();
    let mut scales = Scales::default();
    let mut models = BTreeSet::new();
    let mut marked = true;
    for NamedRun { name, folder } in runs {
        let summary = folder.summary()?;
        let statics = summary.statics.is_some();
        let read = ChartedRun { name, folder, statics }.traces(request, &mut scales)?;
        marked &= statics && read.iter().all(|trace| trace.points.len() <= MARKED);
        models.insert(summary.model);
        traces.extend(read);
    }
    let title = match (models.len(), models.into_iter().next()) {
        (1, Some(model)) => model,
        _ => String::new(),
    };
    let mut keys: Vec<(String, String)> = Vec::new();
    for trace in &traces {
        if !keys.contains(&trace.key()) {
            keys.push(trace.key());
        }
    }
    if keys.len() > CHARTS {
        return Err(SelectionError::TooMany(keys.len()));
    }
    let mut notes = Vec::new();
    let mut charts = Vec::new();
    let vanishes = |key: &(String, String)| {
        traces.iter().filter(|trace| trace.key() == *key).all(ColumnCurve::vanishes)
    };
    let (zero, drawn): (Vec<_>, Vec<_>) = keys.into_iter().partition(vanishes);
    let (zero, drawn) = if drawn.is_empty() { (drawn, zero) } else { (zero, drawn) };
    for key in zero {
        let own = traces.iter().filter(|trace| trace.key() == key);
        let names: BTreeSet<&str> = own.map(|trace| trace.y.name.as_str()).collect();
        let names = names.into_iter().collect::<Vec<_>>().join(", ");
        notes.push(format!("zero throughout, not drawn: {names}"));
    }
    for key in drawn {
        let own: Vec<&ColumnCurve> = traces.iter().filter(|trace| trace.key() == key).collect();
        if own.len() > CURVES {
            let of = format!("{} of {} ({})", CURVES, own.len(), own[0].y.quantity);
            notes.push(format!("the first {of} are drawn: choose by --what"));
        }
        let own = &own[..own.len().min(CURVES)];
        let title = if charts.is_empty() { title.clone() } else { String::new() };
        charts.push(chart(own, title, runs.len() > 1, marked, &scales));
    }
    Ok(Selected { charts, notes })
}

/// The curve of a column of a run.
struct ColumnCurve {
    run: String,
    x: FileColumn,
    y: FileColumn,
    change: bool,
    is_named: bool,
    points: Vec<(f64, f64)>,
}

impl ColumnCurve {
    /// Whether it is one of several that a name stands for, and zero at every node.
    fn vanishes(&self) -> bool {
        !self.is_named && self.points.iter().all(|(_, y)| *y == 0.0)
    }

    /// Curves with the same key share a chart.
    fn key(&self) -> (String, String) {
        let kind = |column: &FileColumn| match column.unit {
            "" => column.quantity.clone(),
            unit => format!("{unit} {}", column.logarithmic),
        };
        (kind(&self.x), kind(&self.y))
    }
}

struct ChartedRun<'a> {
    name: &'a str,
    folder: &'a RunFolder,
    statics: bool,
}

impl ChartedRun<'_> {
    fn traces(
        &self,
        request: &ChartRequest,
        scales: &mut Scales,
    ) -> Result<Vec<ColumnCurve>, SelectionError> {
        let all = columns(self.folder)?;
        let chosen = names::resolve(request, &all)
            .map_err(|error| SelectionError::Name { run: self.name.to_owned(), error })?;
        let wanted = chosen.iter().flat_map(|pair| [Some(pair.y), pair.x]).flatten().collect();
        let values = ColumnSamples::read(self.folder, &all, &wanted)?;
        scales.merge(&values.scales);
        let time = match self.statics {
            true => FileColumn::time("load factor", ""),
            false => FileColumn::time("time", "s"),
        };
        let trace = |pair: names::ColumnPair| {
            let (y, t) = (values.of(pair.y), values.t.as_slice());
            let first = y.iter().copied().find(|v| v.is_finite()).unwrap_or(0.0);
            let y: Vec<f64> = match pair.change {
                true => y.iter().map(|v| v - first).collect(),
                false => y.to_vec(),
            };
            let points = match pair.x {
                None => subsample(t, &y),
                Some(x) => values.of(x).iter().copied().zip(y).collect(),
            };
            let x = pair.x.map_or_else(|| time.clone(), |x| all[x].clone());
            let logarithmic = all[pair.y].logarithmic && !pair.change;
            let y = FileColumn { logarithmic, ..all[pair.y].clone() };
            let names::ColumnPair { change, is_named, .. } = pair;
            ColumnCurve { run: self.name.to_owned(), x, y, change, is_named, points }
        };
        Ok(chosen.into_iter().map(trace).collect())
    }
}

/// The chart of curves with the same units.
fn chart(
    own: &[&ColumnCurve],
    title: String,
    several: bool,
    marked: bool,
    scales: &Scales,
) -> LineChart {
    let y = &own[0].y;
    let columns: BTreeSet<&str> = own.iter().map(|trace| trace.y.name.as_str()).collect();
    let one = columns.len() == 1;
    let label = |of: fn(&ColumnCurve) -> &FileColumn, alone: bool| {
        let mut words: Vec<&str> = Vec::new();
        for column in own.iter().map(|trace| of(trace)) {
            let word = if alone { &column.name } else { &column.quantity };
            if !words.contains(&word.as_str()) {
                words.push(word);
            }
        }
        words.join(", ")
    };
    let abscissas: BTreeSet<&str> = own.iter().map(|trace| trace.x.name.as_str()).collect();
    let x = &own[0].x;
    let across = label(|trace| &trace.x, abscissas.len() == 1 && !x.file.is_empty());
    let up = label(|trace| &trace.y, one);
    let up = if own.iter().all(|trace| trace.change) { format!("change of {up}") } else { up };
    let name = |trace: &ColumnCurve| match (several, one) {
        (true, true) => trace.run.clone(),
        (true, false) => format!("{}, {}", trace.y.name, trace.run),
        (false, _) if own.len() == 1 => String::new(),
        (false, _) => trace.y.name.clone(),
    };
    let curve = |trace: &&ColumnCurve| Series { name: name(trace), points: trace.points.clone() };
    let chart = LineChart {
        title,
        x: ChartAxis { logarithmic: x.logarithmic, ..ChartAxis::linear(&across, x.unit) },
        y: ChartAxis { logarithmic: y.logarithmic, ..ChartAxis::linear(&up, y.unit) },
        strokes: if marked { Strokes::MarkedLine } else { Strokes::Line },
        resolution: scales.resolution(y.unit),
        marks: Vec::new(),
        curves: own.iter().map(curve).collect(),
    };
    // one curve needs a name where something is to be said of it
    match chart.curves.as_slice() {
        [curve] if curve.name.is_empty() => {
            let named = Series { name: columns.into_iter().collect(), ..curve.clone() };
            let noted = LineChart { curves: vec![named.clone()], ..chart.clone() };
            if noted.legend() == [named.name] { chart } else { noted }
        }
        _ => chart,
    }
}
