//! `cargo xtask verify`: every promise on every kind of system, measured and judged.

mod cases;
mod closed_forms;
mod exact;
mod markdown;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use cases::Case;
use holonom::evidence::certificate::{Certificate, Verdict};
use holonom::evidence::certify::certify;

/// What was asked for.
#[derive(Default)]
struct Wanted {
    quick: bool,
    only: Option<String>,
    json: Option<PathBuf>,
}

impl Wanted {
    fn parse(arguments: &[&str]) -> Result<Self, String> {
        let (mut wanted, mut rest) = (Self::default(), arguments.iter());
        while let Some(argument) = rest.next() {
            let mut value = |of: &str| rest.next().copied().ok_or(format!("{of} needs a value"));
            match *argument {
                "--quick" => wanted.quick = true,
                "--only" => wanted.only = Some(value("--only")?.to_owned()),
                "--json" => wanted.json = Some(value("--json")?.into()),
                other => return Err(format!("unknown argument `{other}`")),
            }
        }
        Ok(wanted)
    }
}

/// A case with its certificate.
struct Certified {
    case: Case,
    certificate: Certificate,
    seconds: f64,
}

/// Runs the verification; `Ok(true)` when every promise holds.
///
/// A full run of all cases writes `VERIFICATION.md` at the root of the repository.
pub(crate) fn run(arguments: &[&str]) -> Result<bool, String> {
    let wanted = Wanted::parse(arguments)?;
    let all = cases::all(wanted.quick)?;
    let known = all.iter().map(|case| case.name).collect::<Vec<_>>().join(", ");
    let chosen = |case: &Case| wanted.only.as_ref().is_none_or(|only| case.name.contains(&**only));
    let cases: Vec<Case> = all.into_iter().filter(chosen).collect();
    if cases.is_empty() {
        return Err(format!("no system of that name; there are {known}"));
    }
    let begin = Instant::now();
    let certified = certify_all(cases);
    let seconds = begin.elapsed().as_secs_f64();
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    if let Some(path) = &wanted.json {
        let certificates: Vec<&Certificate> = certified.iter().map(|c| &c.certificate).collect();
        let text = serde_json::to_string_pretty(&certificates).map_err(|e| e.to_string())?;
        write(path, &text)?;
    }
    let text = markdown::page(&certified, wanted.quick, seconds, &root);
    if wanted.only.is_some() || wanted.quick {
        if wanted.only.is_some() {
            print!("{text}");
        }
    } else {
        write(&root.join("VERIFICATION.md"), &text)?;
    }
    let count = |verdict| certified.iter().map(|c| c.certificate.count(verdict)).sum::<usize>();
    for c in &certified {
        for finding in c.certificate.findings.iter().filter(|f| f.verdict == Verdict::Fail) {
            eprintln!("{}: {finding}", c.case.name);
        }
    }
    eprintln!(
        "{} systems in {seconds:.0} s: {} pass, {} known, {} open, {} fail",
        certified.len(),
        count(Verdict::Pass),
        count(Verdict::Known),
        count(Verdict::Open),
        count(Verdict::Fail)
    );
    Ok(certified.iter().all(|c| c.certificate.holds()))
}

fn write(path: &Path, text: &str) -> Result<(), String> {
    std::fs::write(path, text).map_err(|e| format!("{}: {e}", path.display()))
}

/// All cases, as many at a time as there are processors; results in the order of the cases.
fn certify_all(cases: Vec<Case>) -> Vec<Certified> {
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
    cases
        .into_iter()
        .zip(done)
        .map(|(case, (_, certificate, seconds))| Certified { case, certificate, seconds })
        .collect()
}
