//! Whether a model fits into memory: an allocation that fails ends a program without a word.

use std::fs;

use holonom::Model;
use holonom::model::Beam;

use crate::failure::Failure;

/// Bytes that a body, a node of a beam or a point mass takes at least, assembled.
const EACH: u64 = 8_000;
/// Members of which the system is not asked: it takes a tenth of the time to read such a model.
const FEW: u64 = 1_000;

/// Refuses a model that needs more memory than there is, where the system tells how much that is.
pub(crate) fn check(model: &Model) -> Result<(), Failure> {
    shortage(model).map_or(Ok(()), |message| Err(Failure::Memory { message }))
}

/// What a model lacks of memory, in words; `None` where it fits or the system does not tell.
#[must_use]
pub fn shortage(model: &Model) -> Option<String> {
    let members = members(model);
    if members < FEW { None } else { lack(members, available()?) }
}

fn members(model: &Model) -> u64 {
    let nodes: usize = model.beams.iter().map(Beam::node_count).sum();
    (model.bodies.len() + model.particles.len() + nodes) as u64
}

fn lack(members: u64, available: u64) -> Option<String> {
    let needed = members.saturating_mul(EACH);
    if needed <= available {
        return None;
    }
    let [needed, available] =
        [needed, available].map(|bytes| format!("{:.1} GB", bytes as f64 / 1e9));
    Some(format!(
        "the {members} bodies, nodes and point masses of the model take at least {needed} of memory, and {available} are \
         available"
    ))
}

/// Memory that this process may still take, bytes: of the machine, of its group, of its address
/// space.
fn available() -> Option<u64> {
    let machine =
        number(&fs::read_to_string("/proc/meminfo").ok()?, "MemAvailable:").map(|kib| kib << 10);
    let limit = fs::read_to_string("/proc/self/limits").ok();
    let space = limit.and_then(|text| number(&text, "Max address space"));
    let group = || {
        let bytes = |name: &str| -> Option<u64> {
            fs::read_to_string(format!("/sys/fs/cgroup/{name}")).ok()?.trim().parse().ok()
        };
        Some(bytes("memory.max")?.saturating_sub(bytes("memory.current")?))
    };
    [machine, space, group()].into_iter().flatten().min()
}

/// The number that follows a word at the beginning of a line.
fn number(text: &str, word: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(word))?;
    rest.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_model_that_does_not_fit_is_refused_in_words() {
        assert_eq!(lack(1_000_000, 16 << 30), None);
        let refused = lack(1_000_000, 4 << 30).expect("too large");
        assert!(refused.contains("1000000 bodies") && refused.contains("8.0 GB"), "{refused}");
        let text = "MemTotal:       24678 kB\nMemAvailable:   16777216 kB\n";
        assert_eq!(number(text, "MemAvailable:"), Some(16_777_216));
        let limits = "Max address space         unlimited            unlimited            bytes\n";
        assert_eq!(number(limits, "Max address space"), None);
    }
}
