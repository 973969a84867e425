//! The charts of one model under a variational and an energy–momentum scheme: energy, momentum
//! maps, constraint fulfilment.

use holonom::report::{ChartAxis, LineChart, Strokes};
use holonom::simulation::RunOutcome;
use holonom::{Model, Sample, Simulation};

use super::{Result, curve, largest, with};

/// A scheme and its recorded nodes.
pub(super) struct Recorded {
    pub(super) scheme: &'static str,
    pub(super) samples: Vec<Sample>,
}

/// Runs a model by a scheme.
pub(super) fn record(model: &Model, scheme: &'static str) -> Result<Recorded> {
    let model = with(model, &[("simulation.scheme", scheme)])?;
    let mut simulation = Simulation::new(&model).map_err(|e| e.to_string())?;
    let mut samples = Vec::new();
    let mut observe = |sample: &Sample| -> Result<()> {
        samples.push(sample.clone());
        Ok(())
    };
    match simulation.run(&mut observe, &mut |_, _| {})? {
        RunOutcome::Done => Ok(Recorded { scheme, samples }),
        RunOutcome::Failed(failure) => Err(format!("{scheme}: {}", failure.message)),
    }
}

impl Recorded {
    /// Without the nodes before `t`.
    pub(super) fn since(mut self, t: f64) -> Self {
        self.samples.retain(|sample| sample.t >= t);
        self
    }

    /// `H − H(0)` at the nodes, J.
    pub(super) fn energy_errors(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        let start = self.samples[0].hamiltonian;
        self.samples.iter().map(move |s| (s.t, s.hamiltonian - start))
    }

    /// Largest change of a component of the linear (0) or angular (1) momentum.
    pub(super) fn momentum_errors(&self, map: usize) -> impl Iterator<Item = (f64, f64)> + '_ {
        let maps = move |s: &Sample| [s.momentum.linear, s.momentum.angular][map];
        let start = maps(&self.samples[0]);
        let change = move |s: &Sample| largest(maps(s).iter().zip(&start).map(|(a, b)| a - b));
        self.samples.iter().map(move |s| (s.t, change(s)))
    }

    /// Largest magnitude of a series.
    pub(super) fn worst(points: impl Iterator<Item = (f64, f64)>) -> f64 {
        largest(points.map(|p| p.1))
    }
}

/// The error of the energy of all runs.
pub(super) fn energy(title: &str, runs: &[Recorded]) -> LineChart {
    LineChart {
        title: title.into(),
        x: ChartAxis::time(),
        y: ChartAxis::linear("H − H(0)", "J"),
        strokes: Strokes::Line,
        resolution: 0.0,
        marks: Vec::new(),
        curves: runs.iter().map(|run| curve(run.scheme, run.energy_errors())).collect(),
    }
}

/// The change of the momentum maps of all runs.
pub(super) fn momentum(title: &str, runs: &[Recorded]) -> LineChart {
    let maps = [(0, "linear"), (1, "angular")];
    let curves = runs.iter().flat_map(|run| {
        maps.map(|(k, name)| curve(&format!("{name}, {}", run.scheme), run.momentum_errors(k)))
    });
    LineChart {
        title: title.into(),
        x: ChartAxis::time(),
        y: ChartAxis::logarithmic("largest change", "SI"),
        strokes: Strokes::Line,
        resolution: 0.0,
        marks: Vec::new(),
        curves: curves.collect(),
    }
}

/// The largest changes of the momentum maps of a variational and an energy–momentum run, in words.
pub(super) fn momentum_errors([variational, conserving]: &[Recorded; 2]) -> String {
    let worst = |run: &Recorded| [0, 1].map(|map| Recorded::worst(run.momentum_errors(map)));
    let ([a, b], [c, d]) = (worst(variational), worst(conserving));
    format!(
        "{a:.1e} kg·m/s and {b:.1e} kg·m²/s in the variational, {c:.1e} and {d:.1e} in the \
         energy–momentum scheme"
    )
}

/// The residuals of the constraints at three levels of one run.
pub(super) fn constraints(title: &str, run: &Recorded) -> LineChart {
    let level =
        |name: &str, of: fn(&Sample) -> f64| curve(name, run.samples.iter().map(|s| (s.t, of(s))));
    LineChart {
        title: title.into(),
        x: ChartAxis::time(),
        y: ChartAxis::logarithmic("residual", "SI"),
        strokes: Strokes::Line,
        resolution: 0.0,
        marks: Vec::new(),
        curves: vec![
            level("position", |s| s.residuals.position),
            level("velocity", |s| s.residuals.velocity),
            level("momentum", |s| s.residuals.momentum),
        ],
    }
}
