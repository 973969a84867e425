//! No member costs more than its share of a step.
//!
//! ```text
//! t(2n + 1) ≤ GROWTH t(n + 1)       n members and one more: work that is linear doubles, dense matrices take eight times as long
//! t(n + 1)  ≤ FORM t(n)             one more that no potential couples
//! ```
//! `t`: CPU time of a step of this thread, the least of some rounds ([`holonom::bench`]); what is
//! found is measured again, and the least of all counts. Potentials between members replace sweeps
//! by sparse matrices, which take up to some tens of times as long at every size: of those the
//! growth alone is judged. Times depend on the machine and on what else it does, so this is no
//! test.

use super::generate::large::{Addition, Topology, large};
use holonom::Model;
use holonom::bench::{BenchRequest, bench};
use holonom::model::LinearSolver;
use std::fmt::Write as _;

/// Members of the smaller mechanism.
const MEMBERS: usize = 64;
/// What twice the members may cost: twice the time, and twice that for memory and for other
/// iterations.
const GROWTH: f64 = 4.0;
/// What one more member may cost that no potential couples. Beside point masses trees are solved by
/// operators, which take up to eight times as long as the sweeps of a tree alone, at every size.
const FORM: f64 = 12.0;
/// Times that a time that is too long is measured anew.
const AGAIN: usize = 3;
/// Steps of a round.
const STEPS: u64 = 10;

/// The times of one mechanism, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunTimes {
    /// Of `n` members.
    pub alone: f64,
    /// Of `n` members and one more.
    pub with_one: f64,
    /// Of `2 n` members and one more.
    pub twice: f64,
}

impl RunTimes {
    /// What is wrong with them, in words; `couples`: whether a potential couples the member with
    /// others.
    #[must_use]
    pub fn fault(&self, couples: bool) -> Option<String> {
        let Self { alone, with_one, twice } = *self;
        let grown = twice.is_nan() || twice > GROWTH * with_one;
        let changed = !couples && (with_one.is_nan() || with_one > FORM * alone);
        let words = match (grown, changed) {
            (true, _) => format!("twice the members take {:.1} times as long", twice / with_one),
            (_, true) => format!("one member more takes {:.1} times as long", with_one / alone),
            _ => return None,
        };
        Some(words)
    }

    fn least(self, other: Self) -> Self {
        Self {
            alone: self.alone.min(other.alone),
            with_one: self.with_one.min(other.with_one),
            twice: self.twice.min(other.twice),
        }
    }
}

/// The time of a step, s.
fn time(model: &Model) -> Result<f64, String> {
    let name = &model.header.name;
    let measured = bench(model, &BenchRequest { schemes: Vec::new(), steps: STEPS });
    let measured = measured.map_err(|error| format!("{name}: {error}"))?;
    let cost = measured.schemes.into_iter().next().ok_or("no scheme")?;
    let refused = || format!("{name}: {}", cost.missing.clone().unwrap_or_default());
    cost.cost.map(|cost| cost.step).ok_or_else(refused)
}

/// The times of a base with a member; `dense`: all with dense matrices, a defect on purpose.
fn times(seed: u64, base: Topology, member: Addition, dense: bool) -> Result<RunTimes, String> {
    let of = |size: usize, member: Option<Addition>| {
        let mut model = large(seed, base, size, member);
        if dense && member.is_some() {
            model.settings.solver = LinearSolver::Dense;
        }
        time(&model)
    };
    Ok(RunTimes {
        alone: of(MEMBERS, None)?,
        with_one: of(MEMBERS, Some(member))?,
        twice: of(2 * MEMBERS, Some(member))?,
    })
}

/// The times of a base with a member, measured until nothing is wrong or often enough.
///
/// # Errors
/// A mechanism that is refused, in words.
pub fn measured(
    seed: u64,
    base: Topology,
    member: Addition,
    dense: bool,
) -> Result<RunTimes, String> {
    let mut found = times(seed, base, member, dense)?;
    for _ in 0..AGAIN {
        if found.fault(member.couples()).is_none() {
            break;
        }
        found = found.least(times(seed, base, member, dense)?);
    }
    Ok(found)
}

/// Measures all bases with all members, and that dense matrices are found; whether nothing is
/// wrong.
///
/// # Errors
/// A mechanism that is refused, in words.
pub fn run(seed: u64) -> Result<bool, String> {
    let mut sound = true;
    println!(
        "{MEMBERS} members, times of a step in µs: alone, with one more, twice as many with one more"
    );
    for base in Topology::ALL {
        for member in Addition::ALL {
            let found = measured(seed, base, member, false)?;
            let fault = found.fault(member.couples());
            sound &= fault.is_none();
            let RunTimes { alone, with_one, twice } = found;
            let mut line = format!("{base:?}, {member:?}:");
            for time in [alone, with_one, twice] {
                let _ = write!(line, " {:.1}", 1e6 * time);
            }
            println!("  {line}{}", fault.map_or_else(String::new, |fault| format!(": {fault}")));
        }
    }
    let planted = measured(seed, Topology::Chain, Addition::FreeBody, true)?;
    let found = planted.fault(false);
    println!("  dense matrices on purpose: {}", found.as_deref().unwrap_or("not found"));
    Ok(sound && found.is_some())
}
