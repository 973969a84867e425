//! Mutants against criteria, measured.

use super::{Mutant, list};
use holonom::verification::certificate::Criterion;
use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

/// A mutant with the criteria that fail on it.
#[derive(Debug)]
pub struct Found {
    /// The mutant.
    pub mutant: Mutant,
    /// The criteria that fail.
    pub by: Vec<Criterion>,
    /// Whether its own criterion fails in its own quantity.
    pub named: bool,
}

/// All mutants by all criteria, on as many threads as there are processors.
///
/// # Errors
/// Why a mutant could not be built, in words.
pub fn measure(progress: &(dyn Fn(&str) + Sync)) -> Result<Vec<Found>, String> {
    let all = list::all();
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    let (next, found) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some(mutant) = all.get(next.fetch_add(1, Ordering::Relaxed)) {
                    progress(&format!("{} on {}", mutant.name, mutant.base.name()));
                    let one = one(mutant);
                    found.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(one);
                }
            });
        }
    });
    let mut found = found.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    let mut found: Vec<Found> = found.drain(..).collect::<Result<_, String>>()?;
    let place = |of: &Found| all.iter().position(|m| m.name == of.mutant.name);
    found.sort_by_key(|of| (place(of), of.mutant.base.name()));
    Ok(found)
}

fn one(mutant: &Mutant) -> Result<Found, String> {
    let certificate = mutant.certificate(&Criterion::ALL)?;
    let by = Criterion::ALL.into_iter().filter(|c| mutant.finds(&certificate, *c)).collect();
    Ok(Found { mutant: mutant.clone(), by, named: mutant.names_it(&certificate) })
}

/// A row for each defect: on how many systems each criterion fails; in bold the one that names the
/// defect.
#[must_use]
pub fn table(found: &[Found]) -> String {
    let heads: Vec<&str> = Criterion::ALL.iter().map(|c| c.name()).collect();
    let mut text = format!("| defect | systems | {} |\n", heads.join(" | "));
    text += &format!("|---|---|{}\n", "---|".repeat(heads.len()));
    let mut rows: Vec<&str> = Vec::new();
    let mut of: BTreeMap<&str, Vec<&Found>> = BTreeMap::new();
    for one in found {
        if !rows.contains(&one.mutant.name) {
            rows.push(one.mutant.name);
        }
        of.entry(one.mutant.name).or_default().push(one);
    }
    for name in rows {
        let group = &of[name];
        let mut systems: Vec<&str> = group.iter().map(|one| one.mutant.base.name()).collect();
        systems.dedup();
        let cell = |criterion: &Criterion| {
            let fails = group.iter().filter(|one| one.by.contains(criterion)).count();
            let names = group.iter().any(|one| one.mutant.criterion == *criterion && one.named);
            match (fails, names) {
                (0, _) => String::new(),
                (_, true) => format!("**{fails}/{}**", group.len()),
                _ => format!("{fails}/{}", group.len()),
            }
        };
        let cells: Vec<String> = Criterion::ALL.iter().map(cell).collect();
        text += &format!("| {name} | {} | {} |\n", systems.join(", "), cells.join(" | "));
    }
    text
}
