//! Which charts a run has.

use super::chart::{ChartAxis, LineChart, Series, Strokes};
use super::series::{PointList, subsample};
use holonom_sim::output::columns::{
    self, ANGULAR_MOMENTUM, DISCRETE_ENERGY, HAMILTONIAN, LEVELS, LINEAR_MOMENTUM, OutputColumn,
    POSITION_NAMES, TIME,
};
use holonom_sim::output::{ResidualRow, Trajectory};

/// Components whose positions are drawn.
pub(super) const MEMBERS: usize = 12;

/// A chart with the name of its file and words to go with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Plot {
    /// File name without extension.
    pub name: String,
    /// What to look for.
    pub caption: String,
    /// The chart.
    pub chart: LineChart,
}

impl Plot {
    /// In statics `t` is the load factor.
    pub(super) fn over_load(&mut self) {
        if self.chart.x == ChartAxis::time() {
            self.chart.x = ChartAxis::load_factor();
        }
    }

    /// The caption, with the curves that are zero throughout.
    #[must_use]
    pub fn words(&self) -> String {
        let note = match self.chart.zero_curves().as_slice() {
            [] => String::new(),
            names => format!(" Identically zero: {}.", names.join(", ")),
        };
        format!("{}{note}", self.caption).trim().to_owned()
    }
}

/// All charts of a run.
#[must_use]
pub fn plots(trajectory: &Trajectory) -> Vec<Plot> {
    let curves = PlotCurves { trajectory, t: trajectory.column(TIME.name).unwrap_or_default() };
    let mut plots = vec![curves.energy(), curves.energy_error()];
    plots.push(curves.drift("angular", ANGULAR_MOMENTUM));
    plots.push(curves.drift("linear", LINEAR_MOMENTUM));
    if !trajectory.residuals.is_empty() {
        plots.push(residuals(&trajectory.residuals));
    }
    let members = trajectory.charted();
    let several = members.len() > 1;
    let shown = members.into_iter().take(MEMBERS).enumerate();
    plots.extend(shown.map(|(i, name)| curves.position(i, name, several)));
    plots
}

/// All charts of a continuation of equilibria: load paths and positions of the components that move
/// most.
#[must_use]
pub fn static_plots(trajectory: &Trajectory) -> Vec<Plot> {
    let curves = PlotCurves { trajectory, t: trajectory.column(TIME.name).unwrap_or_default() };
    let ways = curves.ways();
    let mut plots = vec![curves.load_path(&ways), curves.potential()];
    let shown = ways.iter().enumerate();
    plots.extend(shown.map(|(i, (name, _))| curves.position(i, name, ways.len() > 1)));
    plots.iter_mut().for_each(Plot::over_load);
    for plot in &mut plots {
        if curves.t.len() <= 60 {
            plot.chart.strokes = Strokes::MarkedLine;
        }
    }
    plots
}

/// Components whose load paths are drawn.
const PATHS: usize = 4;
/// A displacement, as a part of the largest one, that is none.
const AT_REST: f64 = 1e-12;

struct PlotCurves<'a> {
    trajectory: &'a Trajectory,
    t: &'a [f64],
}

impl PlotCurves<'_> {
    fn of(&self, column: &str, name: &str, relative: bool) -> Option<Series> {
        let values = self.trajectory.column(column)?;
        let start = if relative { values.first().copied().unwrap_or(0.0) } else { 0.0 };
        let values: Vec<f64> = values.iter().map(|v| v - start).collect();
        Some(Series { name: name.to_owned(), points: subsample(self.t, &values) })
    }

    fn energy(&self) -> Plot {
        let curves =
            [self.of(DISCRETE_ENERGY.name, "E_d", false), self.of(HAMILTONIAN.name, "H_d", false)];
        Plot {
            name: "energy".into(),
            caption: "Discrete energy E_d of a step and H_d at a node.".into(),
            chart: linear("Energy", "energy", "J", curves),
        }
    }

    fn energy_error(&self) -> Plot {
        let curves = [
            self.of(DISCRETE_ENERGY.name, "E_d − E_d(0)", true),
            self.of(HAMILTONIAN.name, "H_d − H_d(0)", true),
        ];
        Plot {
            name: "energy_error".into(),
            caption: "With a variational integrator the energy error of a conservative system is bounded, \
                      without secular drift."
                .into(),
            chart: linear("Energy error", "deviation", "J", curves),
        }
    }

    /// Displacements of the components that move most.
    fn ways(&self) -> Vec<(&str, Vec<f64>)> {
        let way = |name: &str| -> Vec<f64> {
            let axes = POSITION_NAMES.map(|axis| self.trajectory.column(&format!("{name}.{axis}")));
            let axes: Vec<&[f64]> = axes.into_iter().flatten().filter(|x| !x.is_empty()).collect();
            let from = |k: usize, x: &&[f64]| (x[k] - x[0]).powi(2);
            (0..self.t.len()).map(|k| axes.iter().map(|x| from(k, x)).sum::<f64>().sqrt()).collect()
        };
        let mut ways: Vec<(&str, Vec<f64>)> =
            self.trajectory.charted().into_iter().map(|name| (name, way(name))).collect();
        let farthest = |way: &[f64]| way.iter().copied().fold(0.0, f64::max);
        ways.sort_by(|a, b| farthest(&b.1).total_cmp(&farthest(&a.1)));
        let largest = ways.first().map_or(0.0, |way| farthest(&way.1));
        ways.retain(|way| farthest(&way.1) > AT_REST * largest);
        ways.truncate(PATHS);
        ways
    }

    /// The load factor over these ways.
    fn load_path(&self, ways: &[(&str, Vec<f64>)]) -> Plot {
        let curve = |(name, way): &(&str, Vec<f64>)| Series {
            name: (*name).to_owned(),
            points: way.iter().copied().zip(self.t.iter().copied()).collect(),
        };
        Plot {
            name: "load_path".into(),
            caption:
                "Displacement from the first equilibrium of the components that move most, against the load \
                      factor t: loads without a history are t/end of what is stated. Beyond a limit point it decreases."
                    .into(),
            chart: LineChart {
                title: "Load path".into(),
                x: ChartAxis::linear("displacement", "m"),
                y: ChartAxis::load_factor(),
                strokes: Strokes::Line,
                resolution: 0.0, marks: Vec::new(),
                curves: ways.iter().map(curve).collect(),
            },
        }
    }

    fn potential(&self) -> Plot {
        Plot {
            name: "energy".into(),
            caption: "Potential energy of elements, springs and weight.".into(),
            chart: linear(
                "Potential energy",
                "energy",
                "J",
                [self.of(HAMILTONIAN.name, "V", false)],
            ),
        }
    }

    fn drift(&self, kind: &str, columns: [OutputColumn; 3]) -> Plot {
        let [OutputColumn { unit, .. }, ..] = columns;
        let curve = |name: &str| self.of(name, &format!("{name} − {name}(0)"), true);
        let curves = columns.map(|column| curve(column.name));
        let title = match kind {
            "angular" => "Angular momentum: change since t = 0",
            _ => "Linear momentum: change since t = 0",
        };
        Plot {
            name: format!("{kind}_momentum"),
            caption: "Components whose symmetry the system has change by round-off only; gravity, \
                      loads and supports change the others."
                .into(),
            chart: linear(title, "change", unit, curves),
        }
    }

    fn position(&self, index: usize, member: &str, several: bool) -> Plot {
        let column = |axis: &str| self.of(&format!("{member}.{axis}"), axis, false);
        let name = file_name(member);
        let number = if several { format!("{:02}_", index + 1) } else { String::new() };
        Plot {
            name: format!("position_{number}{name}"),
            caption: String::new(),
            chart: linear(
                &format!("Position of {member}"),
                "position",
                "m",
                POSITION_NAMES.map(column),
            ),
        }
    }
}

/// A name as a part of a file name.
pub(super) fn file_name(name: &str) -> String {
    let word = |c: char| if c.is_ascii_alphanumeric() || c == '_' || c == '-' { c } else { '_' };
    name.chars().map(word).collect()
}

fn linear<const N: usize>(
    title: &str,
    quantity: &str,
    unit: &str,
    curves: [Option<Series>; N],
) -> LineChart {
    LineChart {
        title: title.to_owned(),
        x: ChartAxis::time(),
        y: ChartAxis::linear(quantity, unit),
        strokes: Strokes::Line,
        resolution: 0.0,
        marks: Vec::new(),
        curves: curves.into_iter().flatten().collect(),
    }
}

fn residuals(rows: &[ResidualRow]) -> Plot {
    let t: Vec<f64> = rows.iter().map(|r| r.t).collect();
    let [position, velocity, momentum] = columns::names(&LEVELS);
    let curve = |name: &str, value: fn(&ResidualRow) -> f64| {
        let values: Vec<f64> = rows.iter().map(value).collect();
        let points: PointList = subsample(&t, &values);
        Series { name: name.to_owned(), points }
    };
    Plot {
        name: "residuals".into(),
        caption: "Largest residual of the constraints: of positions |g(q)|, of velocities \
                  |G(q_mid) Δq/h|, of momenta |G M⁻¹ p|. Values of zero are not drawn."
            .into(),
        chart: LineChart {
            title: "Constraint residuals".into(),
            x: ChartAxis::time(),
            y: ChartAxis::logarithmic("largest residual", "SI"),
            strokes: Strokes::Line,
            resolution: 0.0,
            marks: Vec::new(),
            curves: vec![
                curve(position, |r| r.position),
                curve(velocity, |r| r.velocity),
                curve(momentum, |r| r.momentum),
            ],
        },
    }
}
