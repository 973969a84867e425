//! Expressions that read one another: efforts of a law, values and rates of signals.
//!
//! ```text
//! y, z ── terms in the order of their dependence ── τ, φ
//!         each with the row of its slopes by (y, z)
//! ```

use crate::system::law_fault::{LastFault, LawFault};
use holonom_model::expression::{ExpressionProgram, UndefinedPart};
use nalgebra::DMatrix;
use std::sync::{Mutex, PoisonError};
use vi_multibody::law::Law;

/// Where a number comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum NumberSource {
    /// An input.
    Input(usize),
    /// A state.
    State(usize),
    /// An earlier term.
    Term(usize),
}

impl NumberSource {
    /// Whether it changes with the motion, by which terms do.
    fn moves(self, terms: &[bool]) -> bool {
        match self {
            Self::Input(input) => input > 0, // the first is the time
            Self::State(_) => true,
            Self::Term(k) => terms[k],
        }
    }
}

/// An expression of inputs, states and earlier terms.
#[derive(Clone, Debug)]
pub(crate) struct NetworkTerm {
    /// Law or signal, for messages.
    pub(crate) owner: String,
    pub(crate) program: ExpressionProgram,
    /// What its inputs are, and their names.
    pub(crate) from: Vec<(NumberSource, String)>,
    /// How it is discontinuous in time, in the place of what `program` says: none of the parts of
    /// a controller is.
    pub(crate) is_own: bool,
}

impl NetworkTerm {
    pub(crate) fn reads(&self) -> impl Iterator<Item = NumberSource> {
        let read = |(k, _): &(usize, &(NumberSource, String))| self.program.reads(*k);
        self.from.iter().enumerate().filter(read).map(|(_, (source, _))| *source)
    }
}

/// Terms with their efforts and the rates of states.
#[derive(Debug)]
pub(crate) struct Network {
    pub(crate) terms: Vec<NetworkTerm>,
    /// `None`: zero.
    pub(crate) efforts: Vec<Option<NumberSource>>,
    pub(crate) rates: Vec<NumberSource>,
    inputs: usize,
    dissipative: bool,
    fault: LastFault,
    work: Mutex<NetworkScratch>,
}

#[derive(Debug)]
struct NetworkScratch {
    values: Vec<f64>, // of the terms
    arguments: Vec<f64>,
    slopes: Vec<f64>,
    rows: DMatrix<f64>, // terms × (y, z)
}

impl Network {
    pub(crate) fn new(
        terms: Vec<NetworkTerm>,
        efforts: Vec<Option<NumberSource>>,
        rates: Vec<NumberSource>,
        inputs: usize,
        dissipative: bool,
    ) -> Self {
        let widest = terms.iter().map(|term| term.from.len()).max().unwrap_or(0);
        let work = NetworkScratch {
            values: vec![0.0; terms.len()],
            arguments: vec![0.0; widest],
            slopes: vec![0.0; widest],
            rows: DMatrix::zeros(terms.len(), inputs + rates.len()),
        };
        let (fault, work) = (LastFault::default(), Mutex::new(work));
        Self { terms, efforts, rates, inputs, dissipative, fault, work }
    }

    /// The last fault.
    pub(crate) fn fault(&self) -> Option<LawFault> {
        self.fault.get()
    }

    /// The value of `source` at `(y, z)`; not a number where it has none.
    pub(crate) fn value(&self, source: NumberSource, y: &[f64], z: &[f64]) -> f64 {
        let work = &mut *self.work.lock().unwrap_or_else(PoisonError::into_inner);
        let last = if let NumberSource::Term(k) = source { k + 1 } else { 0 };
        for k in 0..last {
            self.evaluate_term(k, y, z, work);
        }
        taken(source, y, z, &work.values)
    }

    /// The first expression in `source` that jumps where what it reads moves, beside the time, the
    /// first input: whose it is, and the part.
    pub(crate) fn jump(&self, source: NumberSource) -> Option<(&str, &str)> {
        let NumberSource::Term(last) = source else { return None };
        let (mut moves, mut read) = (Vec::with_capacity(last + 1), vec![false; last + 1]);
        for term in &self.terms[..=last] {
            moves.push(term.reads().any(|own| own.moves(&moves)));
        }
        read[last] = true;
        for k in (0..=last).rev() {
            let own = self.terms[k].reads().filter(|_| read[k]);
            let of =
                own.filter_map(|own| if let NumberSource::Term(k) = own { Some(k) } else { None });
            of.collect::<Vec<_>>().into_iter().for_each(|k| read[k] = true);
        }
        (0..=last).filter(|k| read[*k] && !self.terms[*k].is_own).find_map(|k| {
            let NetworkTerm { owner, program, from, .. } = &self.terms[k];
            Some((&**owner, program.jumps_moved(|input| from[input].0.moves(&moves))?))
        })
    }

    /// The slopes of `source` by `(y, z)`.
    pub(crate) fn row(&self, source: NumberSource, y: &[f64], z: &[f64]) -> Vec<f64> {
        let unit = |k: usize| (0..y.len() + z.len()).map(|i| f64::from(u8::from(i == k))).collect();
        let last = match source {
            NumberSource::Input(i) => return unit(i),
            NumberSource::State(i) => return unit(y.len() + i),
            NumberSource::Term(k) => k,
        };
        let work = &mut *self.work.lock().unwrap_or_else(PoisonError::into_inner);
        for k in 0..=last {
            self.differentiate_term(k, y, z, work);
        }
        work.rows.row(last).iter().copied().collect()
    }

    /// `slopes ← Σ w` times how the slopes of a source by the inputs change where these change by
    /// `along`; without states.
    pub(crate) fn bend_of(
        &self,
        weights: impl Iterator<Item = (NumberSource, f64)>,
        [y, along]: [&[f64]; 2],
        slopes: &mut [f64],
    ) {
        slopes.fill(0.0);
        let count = self.terms.len();
        if !self.rates.is_empty() || self.terms.is_empty() {
            return;
        }
        let (mut values, mut changes) = (vec![0.0; count], vec![0.0; count]);
        let mut all: Vec<[Vec<f64>; 2]> = Vec::with_capacity(count); // slopes, D² along
        for (k, term) in self.terms.iter().enumerate() {
            let of = |y: &[f64], values: &[f64]| -> Vec<f64> {
                term.from.iter().map(|(source, _)| taken(*source, y, &[], values)).collect()
            };
            let [arguments, by] = [of(y, &values), of(along, &changes)];
            let [mut first, mut second] = [(); 2].map(|()| vec![0.0; arguments.len()]);
            let Ok(value) = term.program.gradient(&arguments, &mut first) else { return };
            term.program.bend(&arguments, &by, &mut second);
            (values[k], changes[k]) = (value, first.iter().zip(&by).map(|(a, b)| a * b).sum());
            all.push([first, second]);
        }
        let mut adjoints = vec![[0.0; 2]; count]; // and how they change
        for (source, w) in weights {
            if let NumberSource::Term(k) = source {
                adjoints[k][0] += w;
            }
        }
        for (k, term) in self.terms.iter().enumerate().rev() {
            let ([adjoint, change], [first, second]) = (adjoints[k], &all[k]);
            for ((source, _), (slope, bend)) in term.from.iter().zip(first.iter().zip(second)) {
                let moved = change * slope + adjoint * bend;
                match *source {
                    NumberSource::Input(i) => slopes[i] += moved,
                    NumberSource::State(_) => {}
                    NumberSource::Term(i) => {
                        adjoints[i][0] += adjoint * slope;
                        adjoints[i][1] += moved;
                    }
                }
            }
        }
    }

    fn evaluate_term(&self, k: usize, y: &[f64], z: &[f64], work: &mut NetworkScratch) {
        let term = &self.terms[k];
        let count = term.from.len();
        for (argument, (source, _)) in work.arguments.iter_mut().zip(&term.from) {
            *argument = taken(*source, y, z, &work.values);
        }
        let arguments = &work.arguments[..count];
        let value = term.program.value(arguments);
        work.values[k] =
            value.unwrap_or_else(|undefined| self.note(term, &undefined, arguments, y[0]));
    }

    /// The value of a term and the row of its slopes.
    fn differentiate_term(&self, k: usize, y: &[f64], z: &[f64], work: &mut NetworkScratch) {
        let term = &self.terms[k];
        let count = term.from.len();
        let NetworkScratch { values, arguments, slopes, rows } = work;
        for (argument, (source, _)) in arguments.iter_mut().zip(&term.from) {
            *argument = taken(*source, y, z, values);
        }
        let (arguments, slopes) = (&arguments[..count], &mut slopes[..count]);
        values[k] = term.program.gradient(arguments, slopes).unwrap_or_else(|undefined| {
            slopes.fill(f64::NAN);
            self.note(term, &undefined, arguments, y[0])
        });
        for j in 0..rows.ncols() {
            rows[(k, j)] = 0.0;
        }
        for ((source, _), slope) in term.from.iter().zip(slopes) {
            match *source {
                NumberSource::Input(i) => rows[(k, i)] += *slope,
                NumberSource::State(i) => rows[(k, self.inputs + i)] += *slope,
                NumberSource::Term(i) => {
                    for j in 0..rows.ncols() {
                        rows[(k, j)] += *slope * rows[(i, j)];
                    }
                }
            }
        }
    }

    #[cold]
    fn note(
        &self,
        term: &NetworkTerm,
        undefined: &UndefinedPart,
        arguments: &[f64],
        t: f64,
    ) -> f64 {
        let names: Vec<&str> = term.from.iter().map(|(_, name)| name.as_str()).collect();
        self.fault.note(&term.owner, &term.program, undefined, &names, arguments, t)
    }
}

fn taken(source: NumberSource, y: &[f64], z: &[f64], values: &[f64]) -> f64 {
    match source {
        NumberSource::Input(i) => y[i],
        NumberSource::State(i) => z[i],
        NumberSource::Term(i) => values[i],
    }
}

/// Not a number where an expression has no value: the step is then refused.
impl Law for Network {
    fn efforts(&self) -> usize {
        self.efforts.len()
    }

    fn evaluate(&self, y: &[f64], z: &[f64], values: &mut [f64]) {
        let work = &mut *self.work.lock().unwrap_or_else(PoisonError::into_inner);
        for k in 0..self.terms.len() {
            self.evaluate_term(k, y, z, work);
        }
        let all = self.efforts.iter().copied().chain(self.rates.iter().map(|rate| Some(*rate)));
        for (value, source) in values.iter_mut().zip(all) {
            *value = source.map_or(0.0, |source| taken(source, y, z, &work.values));
        }
    }

    fn gradient(&self, y: &[f64], z: &[f64], values: &mut [f64], slopes: &mut DMatrix<f64>) {
        let work = &mut *self.work.lock().unwrap_or_else(PoisonError::into_inner);
        for k in 0..self.terms.len() {
            self.differentiate_term(k, y, z, work);
        }
        slopes.fill(0.0);
        let all = self.efforts.iter().copied().chain(self.rates.iter().map(|rate| Some(*rate)));
        for (row, source) in all.enumerate() {
            values[row] = source.map_or(0.0, |source| taken(source, y, z, &work.values));
            match source {
                None => {}
                Some(NumberSource::Input(i)) => slopes[(row, i)] = 1.0,
                Some(NumberSource::State(i)) => slopes[(row, self.inputs + i)] = 1.0,
                Some(NumberSource::Term(k)) => {
                    (0..slopes.ncols()).for_each(|j| slopes[(row, j)] = work.rows[(k, j)]);
                }
            }
        }
    }

    fn bend(&self, y: &[f64], along: &[f64], w: &[f64], slopes: &mut [f64]) {
        let efforts = self.efforts.iter().zip(w);
        let weights = efforts.filter_map(|(source, w)| source.map(|source| (source, *w)));
        self.bend_of(weights, [y, along], slopes);
    }

    fn is_dissipative(&self) -> bool {
        self.dissipative
    }

    /// Where every term is: time is the first input.
    fn is_affine(&self) -> bool {
        let is_time = |source: NumberSource| source == NumberSource::Input(0);
        let mut terms = self.terms.iter();
        terms.all(|term| term.program.is_affine(|k| !is_time(term.from[k].0)))
    }
}
