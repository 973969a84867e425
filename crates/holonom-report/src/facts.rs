//! What was measured, in plain sentences.

pub use holonom_sim::digits::rounded;
use holonom_sim::output::{ContactCounts, EnergySummary, Status, Summary};
use holonom_sim::statics::StaticFacts;

/// A larger residual at momentum level is an error of the scheme, `O(h²)`.
const ROUND_OFF: f64 = 1e-9;

/// A time or a step, s, with the digits of a step times a count.
#[must_use]
pub fn time(t: f64) -> String {
    rounded(t, 12)
}

/// A measured fact.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fact {
    /// What it is about.
    pub subject: &'static str,
    /// What was found.
    pub finding: String,
}

/// One line with the size of the run.
#[must_use]
pub fn counts(summary: &Summary) -> String {
    let Summary { steps, step, end_time, scheme, order, counts, .. } = summary;
    let ended = match summary.status {
        Status::Done => "",
        Status::Failed => " (failed)",
        Status::Interrupted => " (interrupted)",
        Status::Running => " (not finished)",
    };
    let dof_text = counted(counts.dof as u64, "degree of freedom", "degrees of freedom");
    if let Some(statics) = &summary.statics {
        let found = counted(statics.equilibria, "equilibrium", "equilibria");
        let end = time(*end_time);
        return format!("{dof_text}; {found} to t = {end}{ended}; {scheme}");
    }
    let (step, end) = (time(*step), time(*end_time));
    let by = if summary.method.is_some() { " (Galerkin)" } else { "" };
    if *steps == 0 && summary.status == Status::Failed {
        return format!(
            "{dof_text}; the first step of {step} s failed; {scheme}, order {order}{by}"
        );
    }
    let steps = counted(*steps, "step", "steps");
    format!("{dof_text}; {steps} of {step} s to t = {end} s{ended}; {scheme}, order {order}{by}")
}

/// A number of things.
#[must_use]
pub fn counted(count: u64, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}

/// The facts of a run: constraints, momentum, energy, iterations, time.
#[must_use]
pub fn facts(summary: &Summary) -> Vec<Fact> {
    if let Some(statics) = summary.statics.as_ref().filter(|_| summary.recorded > 0) {
        return static_facts(summary, statics);
    }
    if summary.recorded == 0 || (summary.steps == 0 && summary.status == Status::Failed) {
        return Vec::new(); // nothing was measured
    }
    let [with_recording, all] = [summary.seconds_per_step, summary.wall_seconds].map(duration);
    let elapsed = match summary.step_seconds {
        Some(step) => {
            format!(
                "{} per step, {with_recording} with its recording, {all} in all",
                duration(step)
            )
        }
        None => format!("{with_recording} per step, recording included, {all} in all"),
    };
    let energy = &summary.energy;
    // the start alone was measured, or configurations alone were read
    if summary.recorded == 1 && summary.steps > 0 || energy.initial.is_nan() {
        return vec![Fact { subject: "time", finding: elapsed }];
    }
    let residual = &summary.constraint_residual;
    let newton = &summary.newton_iterations;
    let constraints = if summary.counts.constraints == 0 {
        "there are none".to_owned()
    } else {
        let momentum = residual.momentum.max;
        let falls = if momentum > ROUND_OFF { ", where it falls with the step" } else { "" };
        let kept = summary.loop_residual.filter(|kept| kept.angle.max(kept.length) > KEPT);
        let kept = kept.and_then(|kept| kept.words()).map_or_else(String::new, |kept| {
            format!("; up to {kept} in loops, as `simulation.loop_tolerance` allows")
        });
        format!(
            "residual {} at position level, {} at velocity level, {} at momentum level{falls}{kept}",
            number(residual.position.max),
            number(residual.velocity.max),
            number(momentum)
        )
    };
    let mut facts = vec![
        ("constraints", constraints),
        ("linear momentum", conserved(&summary.momentum.linear.components, "kg·m/s")),
        ("angular momentum", conserved(&summary.momentum.angular.components, "kg·m²/s")),
        ("energy", energy_words(energy, summary.contacts.is_some())),
        (
            "Newton iterations",
            format!("{:.2} per step on average, {} at most", newton.mean, iterations(newton.max)),
        ),
        ("time", elapsed),
    ];
    if let Some(variant) = summary.strains {
        let raised = summary.tension_raised.filter(|count| *count > 0);
        let raised = raised.map_or_else(String::new, |count| {
            format!("; bound of the tension raised in {count} steps")
        });
        facts.insert(4, ("strains of beams", format!("{}{raised}", variant.name())));
    }
    if let Some(counts) = &summary.contacts {
        facts.insert(4, ("contacts", contact_words(counts)));
    }
    if !summary.events.is_empty() {
        let words = |(name, count): (&String, &u64)| match count {
            0 => format!("{name} never"),
            1 => format!("{name} once"),
            _ => format!("{name} {count} times"),
        };
        let words: Vec<String> = summary.events.iter().map(words).collect();
        facts.insert(4, ("events", words.join(", ")));
    }
    facts.into_iter().map(|(subject, finding)| Fact { subject, finding }).collect()
}

/// Iterations of a step: a whole number, or the mean over the parts of a composition.
pub(super) fn iterations(count: f64) -> String {
    if count.fract() == 0.0 { format!("{count}") } else { format!("{count:.2}") }
}

/// How contacts, stops and dry friction acted, and what held nearly.
fn contact_words(counts: &ContactCounts) -> String {
    let nodes = |count: u64| counted(count, "node", "nodes");
    let mut words = format!("at most {} at once", counts.most_contacts);
    if counts.events > 0 {
        words += &format!("; {} at a first touch", nodes(counts.events));
    }
    if counts.impacts > 0 {
        words += &format!("; {} with restitution", counted(counts.impacts, "impact", "impacts"));
    }
    // by the velocities at nodes, of which those of a support that moves give and take; to the last
    // digit by the displacements in `energy.csv`
    let taken = counts.dissipated;
    if taken > 1e-10 * counts.largest_work.abs() {
        words += &format!("; about {} J taken out", rounded(taken, 3));
    }
    if let Some(gap) = counts.smallest_gap.filter(|gap| *gap < -ROUND_OFF) {
        words += &format!("; gaps down to {} m or rad", number(gap));
    }
    if counts.guarded > 0 {
        words += &format!("; restitution reduced at {}", nodes(counts.guarded));
    }
    if counts.divided > 0 {
        words += &format!("; {} put between two steps", nodes(counts.divided));
    }
    if counts.relaxed > 0 {
        let (nodes, speed) = (nodes(counts.relaxed), number(counts.largest_deviation));
        words += &format!("; at {nodes} beside Coulomb's law by up to {speed} m/s");
    }
    words
}

/// Conservation, or energy against work.
fn energy_words(energy: &EnergySummary, with_contacts: bool) -> String {
    let EnergySummary { initial, last, work, max_abs_error, .. } = *energy;
    let scale =
        [initial, last, work, max_abs_error].into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    let joules = |energy: f64| joules(energy, scale);
    let start = joules(initial);
    match energy.drift_per_step {
        Some(drift) => format!(
            "{start} J initially, error at most {} J, drift {} J per step",
            number(energy.max_abs_error),
            number(drift)
        ),
        None => format!(
            "{start} J initially, {} J at the end; work of forces{} and prescribed motions {} J, \
             difference {} J",
            joules(last),
            if with_contacts { ", contacts" } else { "" },
            joules(work),
            number(energy.balance_error)
        ),
    }
}

/// An energy beside others of the size `scale`: what is round-off of these is 0.
fn joules(energy: f64, scale: f64) -> String {
    match energy.abs() {
        e if e <= 1e-10 * scale => "0".to_owned(),
        e if e < 1e-3 => format!("{:e}", format!("{energy:.5e}").parse().unwrap_or(energy)),
        _ => rounded(energy, 6),
    }
}

fn static_facts(summary: &Summary, statics: &StaticFacts) -> Vec<Fact> {
    let halvings = counted(statics.halvings, "step was halved", "steps were halved");
    let path = if statics.arc_length { "by arc length" } else { "by steps of the load" };
    let position = summary.constraint_residual.position.max;
    let mut facts = vec![
        ("load path", format!("{path}, to t = {} at most; {halvings}", time(statics.largest_time))),
        ("residual force", format!("{} at most (N, N·m)", number(statics.max_residual))),
        ("constraints", format!("residual {}", number(position))),
        (
            "Newton iterations",
            format!(
                "{:.2} per equilibrium on average, {} at most",
                summary.newton_iterations.mean,
                iterations(summary.newton_iterations.max)
            ),
        ),
        ("time", format!("{} in all", duration(summary.wall_seconds))),
    ];
    if statics.neutral {
        let note = "some direction has zero stiffness: the equilibrium is not unique along it";
        facts.insert(1, ("stiffness", note.to_owned()));
    }
    facts.into_iter().map(|(subject, finding)| Fact { subject, finding }).collect()
}

/// Residuals of loops that are worth a word, rad and m.
const KEPT: f64 = 1e-8;

/// Below this a change of momentum is called round-off.
const CONSERVED: f64 = 1e-9;

/// How well the components of a momentum map are conserved.
fn conserved(components: &[f64; 3], unit: &str) -> String {
    let part = |is: bool| {
        let all = ["x", "y", "z"].into_iter().zip(*components);
        let (names, changes): (Vec<_>, Vec<_>) = all.filter(|c| (c.1 < CONSERVED) == is).unzip();
        (names, changes.into_iter().fold(0.0, f64::max))
    };
    let ((still, least), (moved, most)) = (part(true), part(false));
    let (least, most) = (number(least), number(most));
    let (verb, and) = (if moved.len() == 1 { "changes" } else { "change" }, " and ");
    match (still.len(), moved.len()) {
        (_, 0) if least == "0" => "conserved exactly".to_owned(),
        (_, 0) => format!("conserved to {least} {unit}"),
        (0, _) => format!("all components change, by up to {most} {unit}"),
        _ => {
            let constant = if least == "0" {
                "conserved exactly".into()
            } else {
                format!("conserved to {least}")
            };
            let (moved, still) = (moved.join(and), still.join(and));
            format!("{moved} {verb} by up to {most} {unit}, {still} {constant}")
        }
    }
}

/// Two significant digits, without a power of ten where the number is of ordinary size.
fn number(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        v if (0.01..10.0).contains(&v) => format!("{value:.2}"),
        v if (10.0..1e4).contains(&v) => format!("{value:.0}"),
        _ => format!("{value:.1e}"),
    }
}

fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{:.2} µs", s * 1e6),
        s if s < 1.0 => format!("{:.2} ms", s * 1e3),
        s if s < 120.0 => format!("{s:.2} s"),
        s => format!("{:.1} min", s / 60.0),
    }
}
