//! The findings as charts.

use super::record::{Comparison, DrawnNode, Measured, Record};
use holonom_report::{ChartAxis, LineChart, Series, Strokes};

/// A chart with words to go with it.
pub(super) struct CaptionedChart {
    pub(super) chart: LineChart,
    pub(super) caption: String,
}

/// The schemes that stand for their families: the last of each that was measured, the nodal ones
/// first.
pub(super) fn representatives(c: &Comparison) -> Vec<(&Record, &Measured)> {
    let of = |energy_momentum: bool| {
        let family = || {
            c.records.iter().filter_map(move |r| {
                (r.energy_momentum == energy_momentum).then_some((r, r.measured.as_ref()?))
            })
        };
        family().find(|(r, _)| r.scheme.ends_with("nodal")).or_else(|| family().next())
    };
    [of(false), of(true)].into_iter().flatten().collect()
}

/// What is said of the schemes that are not drawn.
fn others(c: &Comparison) -> String {
    let of = |energy_momentum: bool| {
        let family = c.records.iter().filter(|r| r.energy_momentum == energy_momentum);
        family.filter_map(|r| r.measured.as_ref()?.apart).reduce(super::larger)
    };
    let said =
        |family: &str, apart: f64| format!(" {family} schemes differ by at most {apart:.0e}.");
    let variational = of(false).map(|apart| said("The variational", apart));
    let em = of(true).map(|apart| said("The energy–momentum", apart));
    variational.into_iter().chain(em).collect()
}

fn curve(name: String, points: impl Iterator<Item = (f64, f64)>) -> Series {
    Series { name, points: points.collect() }
}

fn over_time(name: String, m: &Measured, of: fn(&DrawnNode) -> f64) -> Series {
    curve(name, m.series.iter().map(|p| (p.t, of(p))))
}

/// All charts that have something to show.
pub(super) fn figures(c: &Comparison) -> Vec<CaptionedChart> {
    let mut figures = vec![energy(c), momentum(c), constraints(c)];
    for (energy_momentum, family) in [(false, "variational"), (true, "energy–momentum")] {
        figures.push(conditions(c, energy_momentum, family));
    }
    figures.push(work_by_order(c));
    for (energy_momentum, family) in [(false, "variational"), (true, "energy–momentum")] {
        figures.push(work_by_form(c, energy_momentum, family));
    }
    figures.retain(|f| is_drawn(&f.chart));
    figures
}

/// Whether a chart shows anything: values of zero have no place on a logarithmic axis.
fn is_drawn(chart: &LineChart) -> bool {
    let mut points = chart.curves.iter().flat_map(|curve| &curve.points);
    points.any(|(_, y)| !chart.y.logarithmic || *y > 0.0)
}

/// The same from where no load acts any more.
fn while_free(c: &Comparison, name: String, m: &Measured, of: fn(&DrawnNode) -> f64) -> Series {
    let free = m.series.iter().filter(|p| p.t >= c.free_from);
    curve(name, free.map(|p| (p.t, of(p))))
}

fn energy(c: &Comparison) -> CaptionedChart {
    let curves = representatives(c).into_iter();
    let curves = curves.map(|(r, m)| while_free(c, r.scheme.clone(), m, |p| p.energy));
    CaptionedChart {
        chart: LineChart {
            title: "Energy error".into(),
            x: ChartAxis::time(),
            y: ChartAxis::linear("change of H", "J"),
            strokes: Strokes::Line,
            resolution: 0.0,
            marks: Vec::new(),
            curves: curves.collect(),
        },
        caption: format!(
            "H of the node: with the projected momentum (39), and with v_n of energy–momentum schemes.{}",
            others(c)
        ),
    }
}

fn momentum(c: &Comparison) -> CaptionedChart {
    let curves = representatives(c).into_iter();
    let curves = curves.map(|(r, m)| while_free(c, r.scheme.clone(), m, |p| p.momentum));
    CaptionedChart {
        chart: LineChart {
            title: "Change of the momentum maps".into(),
            x: ChartAxis::time(),
            y: ChartAxis::logarithmic("largest change", "SI"),
            strokes: Strokes::Line,
            resolution: 0.0,
            marks: Vec::new(),
            curves: if c.conserved.is_empty() { Vec::new() } else { curves.collect() },
        },
        caption: format!("Those that the system conserves: {}.", c.conserved.join(", ")),
    }
}

fn constraints(c: &Comparison) -> CaptionedChart {
    let levels: [(&str, fn(&DrawnNode) -> f64); 3] =
        [("g", |p| p.residuals[0]), ("Ḡ Δq/h", |p| p.residuals[1]), ("G M⁻¹p", |p| p.residuals[2])];
    let curves = representatives(c).into_iter().flat_map(|(r, m)| {
        let family = if r.energy_momentum { "EM" } else { "VI" };
        levels.map(|(name, of)| over_time(format!("{family} {name}"), m, of))
    });
    CaptionedChart {
        chart: LineChart {
            title: "Constraints".into(),
            x: ChartAxis::time(),
            y: ChartAxis::logarithmic("largest residual", "SI"),
            strokes: Strokes::Line,
resolution: 0.0, marks: Vec::new(),
            curves: curves.collect(),
        },
        caption: "VI: the variational scheme, EM: the energy–momentum scheme. g at positions, Ḡ Δq/h at velocities (45), \
                  G M⁻¹p at momenta (46), of energy–momentum schemes with the velocities v_n. Values of zero are not drawn."
            .into(),
    }
}

fn conditions(c: &Comparison, energy_momentum: bool, family: &str) -> CaptionedChart {
    let mut curves = Vec::new();
    for r in c.records.iter().filter(|r| r.energy_momentum == energy_momentum) {
        let points = || r.conditions.iter().filter_map(|at| Some((at.step, at.condition?)));
        let short = r.scheme.trim_start_matches("em-");
        let scaled = points().any(|(_, k)| k.as_written.to_bits() != k.scaled.to_bits());
        curves.push(curve(short.to_owned(), points().map(|(h, k)| (h, k.as_written))));
        if scaled && short == "constrained" {
            curves.push(curve("the same, scaled".into(), points().map(|(h, k)| (h, k.scaled))));
        }
    }
    CaptionedChart {
        chart: LineChart {
            title: format!("Condition number, {family}"),
            x: ChartAxis::logarithmic("step h", "s"),
            y: ChartAxis::logarithmic("κ", ""),
            strokes: Strokes::MarkedLine,
resolution: 0.0, marks: Vec::new(),
            curves,
        },
        caption: "Of the Newton matrix as the equations are written. Scaled: momentum rows times h and h²λ as \
                  the unknown, as the solver does it."
            .into(),
    }
}

fn work_curve(name: String, r: &Record, order: u32) -> Series {
    let points = r.work.iter().filter(|p| p.order == order);
    curve(name, points.filter_map(|p| Some((p.seconds?, p.error?))))
}

fn work_chart(c: &Comparison, title: String, curves: Vec<Series>) -> CaptionedChart {
    let time = super::table::time_word(c.clock);
    let known = c.reference.known_to.map_or(String::new(), |e| format!(", known to {e:.0e}"));
    CaptionedChart {
        chart: LineChart {
            title,
            x: ChartAxis::logarithmic(&format!("{time} of the run"), "s"),
            y: ChartAxis::logarithmic("error at the end", "m; 1"),
            strokes: Strokes::MarkedLine,
            resolution: 0.0,
            marks: Vec::new(),
            curves: curves.into_iter().filter(|curve| !curve.points.is_empty()).collect(),
        },
        caption: format!("Reference: {}{known}.", c.reference.description),
    }
}

fn work_by_order(c: &Comparison) -> CaptionedChart {
    let mut curves = Vec::new();
    for (r, _) in representatives(c) {
        let mut orders: Vec<u32> = r.work.iter().map(|p| p.order).collect();
        orders.dedup();
        curves.extend(orders.into_iter().map(|k| work_curve(format!("{}, {k}", r.scheme), r, k)));
    }
    work_chart(c, "Work–precision by order".into(), curves)
}

fn work_by_form(c: &Comparison, energy_momentum: bool, family: &str) -> CaptionedChart {
    let records = c.records.iter().filter(|r| r.energy_momentum == energy_momentum);
    let short = |r: &Record| r.scheme.trim_start_matches("em-").to_owned();
    let curves = records.map(|r| work_curve(short(r), r, 2)).collect();
    work_chart(c, format!("Work–precision, {family}, order 2"), curves)
}
