//! Files of BeamDyn: the blade file, and the primary file that names it.
//!
//! ```text
//! blade    station_total, damp_type, mu_1 … mu_6; for each station η, stiffness 6×6, mass 6×6
//! primary  "…"  BldFile;   kp_total key points x, y, z (m), initial twist (degrees)
//! ```
//! Its axes are `x` toward the suction side, `y` toward the trailing edge, `z` along the blade,
//! those of moments are the same: they are `d_1, d_2, d_3` and the matrices those of a section. The
//! twist is about `−z`. `η` is the part of the length of the blade. A damping `μ_i` is a relaxation
//! time; between strains of unlike ones BeamDyn takes `μ_i K_ij`, which is not symmetric, here it
//! is `K_ij √(μ_i μ_j)`.
//!
//! Source: BeamDyn user's guide and theory manual, National Renewable Energy Laboratory.

use std::path::Path;

use crate::mesh::Meshes;

use crate::types::damping::{Damping, RelaxationTimes};
use crate::types::section::Section;
use crate::types::station::Station;

/// η, stiffness, mass.
const NUMBERS: usize = 1 + 36 + 36;

/// The stations of a blade of a length, m, from a blade file, or from a primary file at a path.
pub(super) fn rows(
    text: &str,
    path: &Path,
    meshes: &mut Meshes,
    length: f64,
) -> Result<Vec<Station>, String> {
    let Some(name) = text_of(text, "bldfile") else { return blade(text, length) };
    let file = path.parent().unwrap_or(Path::new("")).join(name);
    let mut rows = blade(&super::text(&file, meshes)?, length)?;
    let twists = twists(text)?;
    for row in &mut rows {
        row.twist = twist_at(&twists, row.at / length);
    }
    Ok(rows)
}

/// A number as Fortran writes it.
fn number(token: &str) -> Option<f64> {
    let token = token.replace(['d', 'D'], "e");
    token.parse().ok().filter(|x: &f64| x.is_finite())
}

/// The line whose second word is a name, in any case.
fn line_of<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let is = |line: &&str| {
        line.split_whitespace().nth(1).is_some_and(|word| word.eq_ignore_ascii_case(name))
    };
    text.lines().find(is)
}

/// The text in quotation marks before a name.
fn text_of<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let word = |rest: &str| rest.split_whitespace().next().map(str::to_ascii_lowercase);
    let mut lines = text.lines();
    lines.find_map(|line| {
        let mut parts = line.split('"');
        let (_, quoted, rest) = (parts.next()?, parts.next()?, parts.next()?);
        (word(rest)? == name).then_some(quoted)
    })
}

fn count_of(text: &str, name: &str) -> Result<usize, String> {
    let line = line_of(text, name).ok_or_else(|| format!("it has no `{name}`"))?;
    let count = line.split_whitespace().next().and_then(|word| word.parse().ok());
    count.filter(|count| *count <= 100_000).ok_or_else(|| format!("`{name}` is no number of lines"))
}

/// What follows a line that contains some words.
fn after<'a>(text: &'a str, words: &str) -> Option<&'a str> {
    let mut rest = text;
    while let Some((line, next)) = rest.split_once('\n') {
        rest = next;
        if line.to_ascii_lowercase().contains(words) {
            return Some(rest);
        }
    }
    None
}

fn blade(text: &str, length: f64) -> Result<Vec<Station>, String> {
    let count = count_of(text, "station_total")?;
    let damping = match count_of(text, "damp_type")? {
        0 => None,
        1 => Some(damping(text)?),
        _ => {
            return Err(
                "damping by modes is not that of a section: write damp_type 0 or 1".to_owned()
            );
        }
    };
    let table = after(text, "distributed properties").ok_or("it has no distributed properties")?;
    let tokens: Vec<&str> = table.split_whitespace().take(count * NUMBERS).collect();
    if tokens.len() < count * NUMBERS {
        return Err(format!("station {} of {count} is not complete", tokens.len() / NUMBERS + 1));
    }
    let station = |(k, tokens): (usize, &[&str])| {
        let numbers: Option<Vec<f64>> = tokens.iter().map(|token| number(token)).collect();
        let numbers = numbers.ok_or_else(|| {
            let wrong = tokens.iter().find(|token| number(token).is_none()).unwrap_or(&"");
            format!("station {} has `{}`, which is no number", k + 1, wrong.escape_debug())
        })?;
        let matrix = |from: usize| {
            std::array::from_fn(|i| std::array::from_fn(|j| numbers[from + 6 * i + j]))
        };
        let (stiffness, mass) = (Some(matrix(1)), Some(matrix(37)));
        let section = Section { stiffness, mass, damping: damping.clone(), ..Section::default() };
        Ok(Station { at: numbers[0] * length, section: Some(section), twist: 0.0 })
    };
    tokens.chunks_exact(NUMBERS).enumerate().map(station).collect()
}

/// The first line of six numbers below the heading of the damping.
fn damping(text: &str) -> Result<Damping, String> {
    let six = |line: &str| {
        let numbers: Vec<f64> = line.split_whitespace().map_while(number).collect();
        <[f64; 6]>::try_from(numbers.get(..6)?).ok()
    };
    let rest = after(text, "mu1").ok_or("it has no damping coefficients `mu1` to `mu6`")?;
    let mu = rest.lines().take(3).find_map(six).ok_or("it has no six damping coefficients")?;
    let [ga1, ga2, ea, ei1, ei2, gj] = mu;
    Ok(Damping::Times(RelaxationTimes { ea, ga1, ga2, ei1, ei2, gj }))
}

/// Parts of the length with the angle about `z` there, rad, from the key points.
fn twists(text: &str) -> Result<Vec<[f64; 2]>, String> {
    let count = count_of(text, "kp_total")?;
    let four = |line: &str| {
        let numbers: Vec<f64> = line.split_whitespace().map_while(number).collect();
        <[f64; 4]>::try_from(numbers.get(..4)?).ok()
    };
    let rest = after(text, "kp_zr").ok_or("it has no key points")?;
    let points: Vec<[f64; 4]> = rest.lines().skip(1).map_while(four).take(count).collect();
    if points.len() < count.max(2) {
        return Err(format!("it has {} of {count} key points", points.len()));
    }
    let mut along = vec![0.0];
    for pair in points.windows(2) {
        let chord: f64 = (0..3).map(|i| (pair[1][i] - pair[0][i]).powi(2)).sum();
        along.push(along[along.len() - 1] + chord.sqrt());
    }
    let total = along[along.len() - 1];
    Ok(along.iter().zip(&points).map(|(s, point)| [s / total, -point[3].to_radians()]).collect())
}

fn twist_at(twists: &[[f64; 2]], eta: f64) -> f64 {
    let k = twists.partition_point(|[at, _]| *at <= eta).clamp(1, twists.len() - 1);
    let ([from, a], [to, b]) = (twists[k - 1], twists[k]);
    a + (b - a) * ((eta - from) / (to - from)).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two stations, the second with everything twice as large.
    fn blade_text() -> String {
        let rows = |factor: f64, first: f64| {
            let row = |i: usize| {
                let entry = |j: usize| {
                    let value = if i == j { first + i as f64 } else { 0.0 };
                    format!("{:.6E}", factor * value).replace('E', if j == 0 { "D" } else { "E+" })
                };
                (0..6).map(entry).collect::<Vec<_>>().join("  ")
            };
            (0..6).map(row).collect::<Vec<_>>().join("\n")
        };
        let station = |eta: f64, factor: f64| {
            format!("  {eta:.6}\n{}\n\n{}\n\n", rows(factor, 10.0), rows(factor, 1.0))
        };
        format!(
            " ------- BEAMDYN INDIVIDUAL BLADE INPUT FILE ---\n two stations\n 2  station_total - number\n \
             1  damp_type - type\n mu1 mu2 mu3 mu4 mu5 mu6\n (-) (-) (-) (-) (-) (-)\n\
             1.0E-03 2.0E-03 3.0E-03 0.004 0.005 0.006\n ---- Distributed Properties ---\n{}{}",
            station(0.0, 1.0),
            station(1.0, 2.0)
        )
    }

    #[test]
    #[allow(clippy::float_cmp)] // the numbers of the file
    fn a_blade_file_gives_matrices_and_dampings() {
        let rows = blade(&blade_text(), 8.0).unwrap();
        assert_eq!(rows.iter().map(|row| row.at).collect::<Vec<_>>(), [0.0, 8.0]);
        let section = rows[1].section.as_ref().unwrap();
        let diagonal =
            |m: Option<[[f64; 6]; 6]>| std::array::from_fn::<f64, 6, _>(|i| m.unwrap()[i][i]);
        assert_eq!(diagonal(section.stiffness), [20.0, 22.0, 24.0, 26.0, 28.0, 30.0]);
        assert_eq!(diagonal(section.mass), [2.0, 4.0, 6.0, 8.0, 10.0, 12.0]);
        let Some(Damping::Times(times)) = &section.damping else { panic!("{section:?}") };
        let found = [times.ga1, times.ga2, times.ea, times.ei1, times.ei2, times.gj];
        assert_eq!(found, [1e-3, 2e-3, 3e-3, 4e-3, 5e-3, 6e-3]);
    }

    #[test]
    fn a_primary_file_gives_the_twist_about_the_other_direction() {
        let text = "1 member_total - members\n 3  kp_total - points\n kp_xr kp_yr kp_zr initial_twist\n (m) (m) (m) (deg)\n\
                    0.0 0.0 0.0 13.3\n 0.0 0.0 30.0 13.3\n 0.0 0.0 40.0 3.3\n\"blade.dat\" BldFile - name\n";
        assert_eq!(text_of(text, "bldfile"), Some("blade.dat"));
        let twists = twists(text).unwrap();
        assert!((twist_at(&twists, 0.5).to_degrees() + 13.3).abs() < 1e-12);
        assert!((twist_at(&twists, 0.875).to_degrees() + 8.3).abs() < 1e-12);
        assert!((twist_at(&twists, 1.0).to_degrees() + 3.3).abs() < 1e-12);
    }

    #[test]
    fn faults_are_named_with_their_station() {
        let text = blade_text();
        let fault = |from: &str, to: &str| blade(&text.replacen(from, to, 1), 8.0).unwrap_err();
        assert_eq!(fault("2  station_total", "3  station_total"), "station 3 of 3 is not complete");
        assert_eq!(fault("1.000000D1", "x"), "station 1 has `x`, which is no number");
        assert!(fault("1  damp_type", "2  damp_type").starts_with("damping by modes"));
        assert_eq!(fault("station_total", "number"), "it has no `station_total`");
        assert_eq!(fault("Distributed", "Other"), "it has no distributed properties");
    }
}
