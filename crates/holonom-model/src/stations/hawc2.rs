//! Files of HAWC2 with the structure of a body (`st`).
//!
//! ```text
//! #k …    a set;  $j n …    a subset of n rows of 19 or 30 numbers
//! 19   r m x_m y_m r_ix r_iy x_s y_s E G I_x I_y K k_x k_y A θ_s x_e y_e
//! 30   r m x_m y_m r_ix r_iy θ_s x_e y_e K_11 … K_16 K_22 … K_66
//! ```
//! Its axes `x`, `y` are `d_1`, `d_2`. `m`, `s`, `e` are the centres of mass, of shear and the
//! elastic one, `θ_s` the angle (degrees) of the principal axes. About the elastic centre and along
//! these hold the stiffnesses, in the order of those of a section, and the radii of gyration, whose
//! product of inertia is zero. Torsion and shear of the 19 numbers hold at the shear centre.
//!
//! Source: T. J. Larsen, A. M. Hansen, How 2 HAWC2, the user's manual, Risø-R-1597, DTU Wind
//! Energy: format of the file of distributed beam properties.

use nalgebra::{Matrix6, Vector2};

use crate::types::section::Section;
use crate::types::station::Station;

/// Numbers of a row, with one modulus, and with a whole stiffness.
const ISOTROPIC: usize = 19;
const WHOLE: usize = 30;

/// A file with its set and subset, `NAME#k$j`; the first ones by default.
pub(super) fn selected(name: &str) -> (&str, [usize; 2]) {
    let marks = || {
        let (file, marks) = name.rsplit_once('#')?;
        let (set, subset) = marks.split_once('$').unwrap_or((marks, "1"));
        Some((file, [set.parse().ok()?, subset.parse().ok()?]))
    };
    marks().unwrap_or((name, [1, 1]))
}

/// Whether a text has sets and subsets.
pub(super) fn is_own(text: &str) -> bool {
    ['#', '$'].iter().all(|mark| text.lines().any(|line| numbered(line, *mark).is_some()))
}

/// The number behind a mark that begins a line, and the rest.
fn numbered(line: &str, mark: char) -> Option<(usize, &str)> {
    let rest = line.trim_start().strip_prefix(mark)?.trim_start();
    let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    Some((rest[..digits].parse().ok()?, &rest[digits..]))
}

/// What follows a mark with its number where they begin a line.
fn begins(line: &str, mark: char, number: usize) -> Option<&str> {
    numbered(line, mark).filter(|(own, _)| *own == number).map(|(_, rest)| rest)
}

/// The stations of a subset.
pub(super) fn rows(text: &str, [set, subset]: [usize; 2]) -> Result<Vec<Station>, String> {
    let mut lines = text.lines();
    let found = lines.find_map(|line| begins(line, '#', set));
    found.ok_or_else(|| format!("it has no set #{set}"))?;
    let mut own = lines.take_while(|line| numbered(line, '#').is_none());
    let heading = own.find_map(|line| begins(line, '$', subset));
    let heading = heading.ok_or_else(|| format!("set #{set} has no subset ${subset}"))?;
    let count = heading.split_whitespace().next().and_then(|word| word.parse::<usize>().ok());
    let count = count.ok_or_else(|| format!("subset ${subset} has no number of rows"))?;
    let own = own.take_while(|line| numbered(line, '$').is_none());
    let filled: Vec<&str> = own.filter(|line| !line.trim().is_empty()).take(count).collect();
    if filled.len() < count {
        return Err(format!("subset ${subset} has {} of {count} rows", filled.len()));
    }
    let row = |(k, line): (usize, &&str)| station(line).map_err(|e| format!("row {}: {e}", k + 1));
    filled.iter().enumerate().map(row).collect()
}

/// The beginning of a line, for a message.
fn shown(line: &str) -> String {
    line.trim().chars().take(20).collect::<String>().escape_debug().to_string()
}

fn station(line: &str) -> Result<Station, String> {
    let number = |word: &str| {
        let value: Option<f64> = word.replace(['d', 'D'], "e").parse().ok();
        value.filter(|x| x.is_finite()).ok_or_else(|| format!("`{}` is no number", shown(word)))
    };
    let all: Vec<f64> = line.split_whitespace().map(number).collect::<Result<_, _>>()?;
    let section = match all.len() {
        ISOTROPIC => isotropic(&all),
        WHOLE => whole(&all),
        count => return Err(format!("{count} numbers, where {ISOTROPIC} or {WHOLE} are expected")),
    };
    Ok(Station { at: all[0], section: Some(section), twist: 0.0 })
}

fn isotropic(row: &[f64]) -> Section {
    let [e, g, area] = [row[8], row[9], row[15]];
    let (angle, elastic) = (row[16].to_radians(), [row[17], row[18]]);
    Section {
        ea: Some(e * area),
        ga1: Some(row[13] * g * area),
        ga2: Some(row[14] * g * area),
        ei1: Some(e * row[10]),
        ei2: Some(e * row[11]),
        gj: Some(g * row[12]),
        tension_center: Some(elastic),
        shear_center: Some([row[6], row[7]]),
        mass: Some(mass(row, angle, elastic)),
        angle: Some(angle),
        ..Section::default()
    }
}

fn whole(row: &[f64]) -> Section {
    let (angle, elastic) = (row[6].to_radians(), [row[7], row[8]]);
    let mut own = Matrix6::zeros();
    let entries = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
    for ((i, j), value) in entries.zip(&row[9..]) {
        (own[(i, j)], own[(j, i)]) = (*value, *value);
    }
    let [x, y] = along(angle, elastic);
    let mut at_center = Matrix6::identity(); // strains there from those at the nodes
    at_center[(0, 5)] = -y;
    at_center[(1, 5)] = x;
    at_center[(2, 3)] = y;
    at_center[(2, 4)] = -x;
    let stiffness = at_center.transpose() * own * at_center;
    let entry = |i: usize, j: usize| 0.5 * (stiffness[(i, j)] + stiffness[(j, i)]);
    Section {
        stiffness: Some(std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)))),
        mass: Some(mass(row, angle, elastic)),
        angle: Some(angle),
        ..Section::default()
    }
}

/// A place in the principal axes.
fn along(angle: f64, [x, y]: [f64; 2]) -> [f64; 2] {
    let (s, c) = libm::sincos(angle);
    [c * x + s * y, c * y - s * x]
}

/// The mass about the line of the nodes in the principal axes, from the radii of gyration about the
/// elastic centre.
fn mass(row: &[f64], angle: f64, elastic: [f64; 2]) -> [[f64; 6]; 6] {
    let line = row[1];
    let e = Vector2::from(along(angle, elastic));
    let moment = line * Vector2::from(along(angle, [row[2], row[3]]));
    let off = moment - line * e;
    // ∫ρ (e + s)(e + s)ᵀ
    let [xx, yy] = [line * row[5] * row[5], line * row[4] * row[4]];
    let [xx, yy] =
        [xx + 2.0 * e.x * off.x + line * e.x * e.x, yy + 2.0 * e.y * off.y + line * e.y * e.y];
    let xy = e.x * off.y + e.y * off.x + line * e.x * e.y;
    let mut all = [[0.0; 6]; 6];
    let mut set = |i: usize, j: usize, value: f64| (all[i][j], all[j][i]) = (value, value);
    (0..3).for_each(|i| set(i, i, line));
    set(3, 3, yy);
    set(4, 4, xx);
    set(5, 5, xx + yy);
    set(3, 4, -xy);
    set(0, 5, -moment.y);
    set(1, 5, moment.x);
    set(2, 3, moment.y);
    set(2, 4, -moment.x);
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two sets; the second subset of the first has the same row in both forms.
    fn file() -> String {
        let (e, g) = (2.0e3, 0.8e3);
        let isotropic = format!(
            "2.5 3.0 0.3 -0.1 0.4 0.6 0.2 0.15 {e} {g} 0.5 0.7 0.9 0.6 0.8 4.0 30.0 0.2 0.15"
        );
        let entry = |i: usize, j: usize| match (i, j) {
            (0, 0) => 0.6 * g * 4.0,
            (1, 1) => 0.8 * g * 4.0,
            (2, 2) => e * 4.0,
            (3, 3) => e * 0.5,
            (4, 4) => e * 0.7,
            (5, 5) => g * 0.9,
            _ => 0.0,
        };
        let upper = (0..6).flat_map(|i| (i..6).map(move |j| (i, j)));
        let upper: Vec<String> = upper.map(|(i, j)| format!("{:.6E}", entry(i, j))).collect();
        let whole = format!("2.5 3.0 0.3 -0.1 0.4 0.6 30.0 0.2 0.15 {}", upper.join(" "));
        let stiff = isotropic.replace("2.5 3.0", "0.0 1.0");
        format!(
            "2 main data sets available\n#1 blade\n r m x_m y_m\n$1 1 stiff\n{stiff}\n$2 2 own\n{isotropic}\n{whole}\n\
             #2 hub\n$1 1\n{stiff}\n"
        )
    }

    fn stiffness(row: &Station) -> Matrix6<f64> {
        *row.section.as_ref().unwrap().numbers().unwrap().stiffness_matrix()
    }

    #[test]
    fn both_forms_of_a_row_are_one_section() {
        let rows = rows(&file(), [1, 2]).unwrap();
        let [one, other] = [0, 1].map(|k| rows[k].section.as_ref().unwrap().numbers().unwrap());
        assert!(rows.iter().all(|row| (row.at - 2.5).abs() < 1e-15));
        let off = (stiffness(&rows[0]) - stiffness(&rows[1])).amax();
        println!("stiffnesses {off:.1e} apart");
        assert!(off < 1e-11, "{off:e}");
        assert_eq!(one.mass_matrix(), other.mass_matrix());
    }

    /// Tension at the elastic centre bends nothing, a moment about a principal axis bends about it,
    /// the shear centre is that of the file.
    #[test]
    fn stiffnesses_hold_at_their_centers_along_their_axes() {
        let text = file().replace(" 0.2 0.15 2000 ", " -0.4 0.35 2000 ");
        let row = &rows(&text, [1, 2]).unwrap()[0];
        let stiffness = stiffness(row);
        let (sin, cos) = libm::sincos(30.0_f64.to_radians());
        let strain = |about: [f64; 2], extension: f64, twist: f64| {
            // at the elastic centre
            let gamma = extension - 0.15 * about[0] + 0.2 * about[1];
            nalgebra::Vector6::new(0.0, 0.0, gamma, about[0], about[1], twist)
        };
        let tension = stiffness * strain([0.0; 2], 1.0, 0.0);
        let arm = [tension[3] / tension[2] - 0.15, -tension[4] / tension[2] - 0.2];
        assert!((tension[2] - 8e3).abs() < 1e-9 && arm.iter().all(|x| x.abs() < 1e-14), "{arm:?}");
        let bent = stiffness * strain([cos, sin], 0.0, 0.0);
        assert!(bent[2].abs() < 1e-10, "{bent}");
        assert!((bent[3] - 1e3 * cos).abs() < 1e-9 && (bent[4] - 1e3 * sin).abs() < 1e-9, "{bent}");
        let centers = row.section.as_ref().unwrap().numbers().unwrap().centers();
        let [x, y]: [f64; 2] = centers.shear;
        assert!((x + 0.4).abs() < 1e-12 && (y - 0.35).abs() < 1e-12, "{x}, {y}");
    }

    /// Four points of mass at `±r` on axes through the elastic centre.
    #[test]
    fn radii_of_gyration_hold_about_the_elastic_center() {
        let (sin, cos) = libm::sincos(30.0_f64.to_radians());
        let row = "0.0 4.0 0.2 0.15 0.4 0.6 30.0 0.2 0.15".to_owned();
        let text = format!("#1\n$1 1\n{row}{}\n", " 1.0".repeat(21));
        let all = rows(&text, [1, 1]).unwrap();
        let found = crate::types::damping::matrix(&all[0].section.as_ref().unwrap().mass.unwrap());
        let (found, _) = vi_beam::section::Section::mass_of_velocities(&found).unwrap();
        let mut right = nalgebra::Matrix4::zeros();
        let e = along(30.0_f64.to_radians(), [0.2, 0.15]);
        // in the principal axes; ∫ρ y² = m r_ix²
        let reach = 2.0_f64.sqrt();
        for (x, y) in
            [(0.6 * reach, 0.0), (-0.6 * reach, 0.0), (0.0, 0.4 * reach), (0.0, -0.4 * reach)]
        {
            let at = nalgebra::Vector4::new(1.0, e[0] + x, e[1] + y, 0.0);
            right += at * at.transpose();
        }
        let off = (found - right).amax();
        assert!(off < 1e-14 && (e[0] - (0.2 * cos + 0.15 * sin)).abs() < 1e-15, "{found} {right}");
    }

    #[test]
    fn sets_and_subsets_are_named() {
        assert_eq!(selected("blade.st"), ("blade.st", [1, 1]));
        assert_eq!(selected("a#b/blade.st#2$3"), ("a#b/blade.st", [2, 3]));
        assert_eq!(selected("blade.st#4"), ("blade.st", [4, 1]));
        assert!(is_own(&file()) && !is_own("# a comment\n 1 station_total\n"));
        let line = rows(&file(), [2, 1]).unwrap()[0].section.clone().unwrap();
        assert!((line.mass.unwrap()[0][0] - 1.0).abs() < 1e-15);
        let fault = |text: &str, set| rows(text, set).unwrap_err();
        assert_eq!(fault(&file(), [3, 1]), "it has no set #3");
        assert_eq!(fault(&file(), [2, 2]), "set #2 has no subset $2");
        assert_eq!(fault(&file().replace("$2 2", "$2 3"), [1, 2]), "subset $2 has 2 of 3 rows");
        assert_eq!(
            fault("#1\n$1 1\n1 2 3\n", [1, 1]),
            "row 1: 3 numbers, where 19 or 30 are expected"
        );
        assert_eq!(fault("#1\n$1 1\n1 x\n", [1, 1]), "row 1: `x` is no number");
    }
}
