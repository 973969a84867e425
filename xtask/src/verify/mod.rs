//! `cargo xtask verify`: every property on every kind of system, measured and judged.

mod age;
mod cases;
mod closed_forms;
mod criteria;
mod exact;
mod long_tests;
mod markdown;
pub mod mutants;
mod summary;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use cases::Case;
use holonom::verification::certificate::{Certificate, Criterion, Finding, Verdict, counts};
use holonom::verification::certify::certify;
use holonom_reliability::text_file;
use long_tests::LongTests;
use mutants::table::Found;
use serde::{Deserialize, Serialize};

/// What was asked for.
#[derive(Default)]
struct Wanted {
    quick: bool,
    age: bool,
    only: Option<String>,
    criterion: Option<String>,
    json: Option<PathBuf>,
    from: Option<PathBuf>,
}

impl Wanted {
    fn parse(arguments: &[&str]) -> Result<Self, String> {
        let (mut wanted, mut rest) = (Self::default(), arguments.iter());
        while let Some(argument) = rest.next() {
            let mut value = |of: &str| rest.next().copied().ok_or(format!("{of} needs a value"));
            match *argument {
                "--quick" => wanted.quick = true,
                "--age" => wanted.age = true,
                "--only" => wanted.only = Some(value("--only")?.to_owned()),
                "--criterion" => wanted.criterion = Some(value("--criterion")?.to_owned()),
                "--json" => wanted.json = Some(value("--json")?.into()),
                "--from" => wanted.from = Some(value("--from")?.into()),
                other => return Err(format!("unknown argument `{other}`")),
            }
        }
        Ok(wanted)
    }
}

/// The readings of a run, from which its page can be made again.
#[derive(Serialize, Deserialize)]
struct Readings {
    /// The commit that was measured.
    commit: String,
    /// Wall time of all systems, s.
    seconds: f64,
    systems: Vec<Reading>,
}

#[derive(Serialize, Deserialize)]
struct Reading {
    /// Wall time, s, where it is known.
    seconds: Option<f64>,
    certificate: Certificate,
}

impl Readings {
    /// Reads them, for the same cases.
    fn read(path: &Path, cases: &[Case]) -> Result<Self, String> {
        let place = |e: &dyn std::fmt::Display| format!("{}: {e}", path.display());
        let text = text_file::read(path)?;
        let readings: Self = serde_json::from_str(&text).map_err(|e| place(&e))?;
        let names = readings.systems.iter().map(|reading| reading.certificate.system.as_str());
        if !names.eq(cases.iter().map(|case| case.name)) {
            return Err(place(&"the systems are not those of this verification"));
        }
        Ok(readings)
    }

    fn measure(cases: &[Case], root: &Path) -> Self {
        let begin = Instant::now();
        let systems = certify_all(cases);
        Self { commit: markdown::commit(root), seconds: begin.elapsed().as_secs_f64(), systems }
    }
}

/// A case with what was read of it.
struct Certified {
    case: Case,
    reading: Reading,
}

/// Runs the verification; `Ok(true)` when no property fails.
///
/// A full run of all cases writes `VERIFICATION.md` at the root of the repository, and the pages
/// below `docs/verification`.
///
/// # Errors
/// What could not be measured or written, in words.
pub fn run(arguments: &[&str]) -> Result<bool, String> {
    let wanted = Wanted::parse(arguments)?;
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    if wanted.age {
        println!("{}", age::age(&root)?);
        return Ok(true);
    }
    let all = cases::all(wanted.quick)?;
    let known = all.iter().map(|case| case.name).collect::<Vec<_>>().join(", ");
    let chosen = |case: &Case| wanted.only.as_ref().is_none_or(|only| case.name.contains(&**only));
    let mut cases: Vec<Case> = all.into_iter().filter(chosen).collect();
    if let Some(name) = &wanted.criterion {
        if !Criterion::ALL.iter().any(|criterion| criterion.name() == name) {
            let known = Criterion::ALL.map(Criterion::name).join(", ");
            return Err(format!("no criterion `{name}`; there are {known}"));
        }
        cases.iter_mut().for_each(|case| case.plan.criteria.retain(|c| c.name() == name));
    }
    if cases.is_empty() {
        return Err(format!("no system of that name; there are {known}"));
    }
    let readings = match &wanted.from {
        Some(path) => Readings::read(path, &cases)?,
        None => Readings::measure(&cases, &root),
    };
    if let Some(path) = &wanted.json {
        text_file::write(
            path,
            &serde_json::to_string_pretty(&readings).map_err(|e| e.to_string())?,
        )?;
    }
    let Readings { commit, seconds, systems } = readings;
    let certified: Vec<Certified> =
        cases.into_iter().zip(systems).map(|(case, reading)| Certified { case, reading }).collect();
    let full = wanted.only.is_none() && wanted.criterion.is_none() && !wanted.quick;
    let around = if full { Some(Around::measure(&root)?) } else { None };
    let text = markdown::page(&certified, around.as_ref(), (wanted.quick, seconds), &commit);
    if full {
        let folder = root.join(markdown::FOLDER);
        std::fs::create_dir_all(&folder).map_err(|e| format!("{}: {e}", folder.display()))?;
        for c in &certified {
            text_file::write(&folder.join(format!("{}.md", c.case.name)), &markdown::system(c))?;
        }
        text_file::write(&folder.join(markdown::QUANTITIES), &markdown::quantities(&certified))?;
        text_file::write(&root.join("VERIFICATION.md"), &text)?;
    } else if wanted.only.is_some() || wanted.criterion.is_some() {
        print!("{text}");
        certified.iter().for_each(|c| print!("\n{}", markdown::system(c)));
    }
    let findings: Vec<&Finding> =
        certified.iter().flat_map(|c| &c.reading.certificate.findings).collect();
    for c in &certified {
        for finding in c.reading.certificate.findings.iter().filter(|f| f.verdict == Verdict::Fail)
        {
            eprintln!("{}: {finding}", c.case.name);
        }
    }
    eprintln!("{} systems in {seconds:.0} s: {}", certified.len(), counts(&findings));
    let unfalsifiable = without_mutant(&certified);
    for (criterion, quantity) in &unfalsifiable {
        eprintln!("no mutant breaks {} of {quantity}", criterion.name());
    }
    let around_holds = around.as_ref().is_none_or(Around::holds);
    Ok(certified.iter().all(|c| c.reading.certificate.holds())
        && unfalsifiable.is_empty()
        && around_holds)
}

/// What is measured beside the systems.
struct Around {
    mutants: Vec<Found>,
    long_tests: LongTests,
}

impl Around {
    fn measure(root: &Path) -> Result<Self, String> {
        let mutants = mutants::table::measure(&|what| eprintln!("       mutant: {what}"))?;
        eprintln!("       long tests");
        Ok(Self { mutants, long_tests: long_tests::run(root)? })
    }

    fn holds(&self) -> bool {
        self.mutants.iter().all(|found| found.named) && self.long_tests.failed() == 0
    }
}

/// Criterion and quantity of the passes that no mutant breaks.
fn without_mutant(certified: &[Certified]) -> Vec<(Criterion, String)> {
    let all = mutants::list::all();
    let has =
        |f: &Finding| all.iter().any(|m| m.criterion == f.criterion && m.quantity == f.quantity);
    let mut missing: Vec<(Criterion, String)> = certified
        .iter()
        .flat_map(|c| &c.reading.certificate.findings)
        .filter(|f| f.verdict == Verdict::Pass && !has(f))
        .map(|f| (f.criterion, f.quantity.clone()))
        .collect();
    missing.sort();
    missing.dedup();
    missing
}

/// All cases, as many at a time as there are processors; results in the order of the cases.
fn certify_all(cases: &[Case]) -> Vec<Reading> {
    let count = cases.len();
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    // the longest first, so that none is left alone at the end
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by_key(|&k| std::cmp::Reverse(cases[k].weight));
    let (next, done) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..workers.min(count) {
            scope.spawn(|| {
                while let Some(&k) = order.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let case = &cases[k];
                    let begin = Instant::now();
                    let mut progress = |what: &str| {
                        let seconds = begin.elapsed().as_secs_f64();
                        eprintln!("       {} after {seconds:.1} s: {what}", case.name);
                    };
                    let mut certificate =
                        certify(&*case.subject, case.name, &case.plan, &mut progress);
                    certificate.findings.extend((case.closed_forms)());
                    let seconds = begin.elapsed().as_secs_f64();
                    let fails = certificate.count(Verdict::Fail);
                    let mut done = done.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    done.push((k, certificate, seconds));
                    eprintln!(
                        "{:>3}/{count} {}: {seconds:.1} s, {fails} fail",
                        done.len(),
                        case.name
                    );
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    done.sort_by_key(|(k, ..)| *k);
    done.into_iter()
        .map(|(_, certificate, seconds)| Reading { seconds: Some(seconds), certificate })
        .collect()
}
