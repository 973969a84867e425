//! `trajectory.csv` and `residuals.csv`: writing them row by row, reading them back.

use std::collections::{BTreeMap, BTreeSet};
use std::io::{self, Write};
use std::ops::Range;

use serde::{Deserialize, Serialize};

use super::columns::{self, POSITION_NAMES};
use super::readable::{Lines, end, invalid, number};
use super::rows::{RowBlocks, RowField};
use crate::sample::{Member, Sample};
use holonom_model::Columns;

/// Names of the columns before and after those of the members.
pub(super) const HEAD: [&str; 2] = columns::names(&columns::HEAD);
const TAIL: [&str; 8] = columns::names(&columns::TAIL);

/// Names of the columns of `residuals.csv` after [`HEAD`].
const RESIDUALS: [&str; 4] = columns::names(&columns::RESIDUALS);
const UNSTABLE: &str = columns::UNSTABLE.name;

/// A row of `residuals.csv`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ResidualRow {
    /// Step index.
    pub step: u64,
    /// Time, s.
    pub t: f64,
    /// `|g(q_n)|_∞`.
    pub position: f64,
    /// LMO08 (45).
    pub velocity: f64,
    /// LMO08 (46).
    pub momentum: f64,
    /// Newton iterations of the step that led here.
    pub newton_iterations: f64,
}

impl ResidualRow {
    fn read<'a>(mut fields: impl Iterator<Item = &'a [u8]>, is_static: bool) -> io::Result<Self> {
        let step = number(fields.next(), 0)?;
        let mut next = |column: usize| number(fields.next(), column);
        let [t, position, velocity, momentum, newton_iterations] =
            [next(1)?, next(2)?, next(3)?, next(4)?, next(5)?];
        if is_static {
            fields.next();
        }
        end(fields)?;
        Ok(Self { step, t, position, velocity, momentum, newton_iterations })
    }
}

/// Writes both files, whole rows only.
///
/// Rows are handed to the file in blocks; [`TrajectoryWriter::finish`] and `Drop` hand over the
/// rest. Numbers are the shortest decimals that read back as the same number.
#[derive(Debug)]
pub struct TrajectoryWriter<W: Write> {
    trajectory: RowBlocks<W>,
    residuals: RowBlocks<W>,
    /// Where the recorded coordinates are in `q`.
    recorded: Vec<Range<usize>>,
    is_static: bool,
}

impl<W: Write> TrajectoryWriter<W> {
    /// Writes both headers; of equilibria `is_static`, with how many directions are unstable.
    ///
    /// # Errors
    /// What the files say.
    pub fn new(
        [trajectory, residuals]: [W; 2],
        members: &[Member],
        columns: &[Columns],
        is_static: bool,
    ) -> io::Result<Self> {
        let all = columns.contains(&Columns::Coordinates);
        let positions = columns.contains(&Columns::Positions);
        let own = |member: &Member| match member.kind {
            kind if all => kind.columns(),
            kind if positions => &kind.columns()[..kind.columns().len().min(POSITION_NAMES.len())],
            _ => &[],
        };
        let of = |m: &Member| own(m).iter().map(|c| format!("{}.{c}", m.name)).collect();
        let columns: Vec<Vec<String>> = members.iter().map(of).collect();
        let mut first = 0;
        let place = |member: &Member| {
            let place = first..first + own(member).len();
            first += member.kind.columns().len();
            place
        };
        let recorded = members.iter().map(place).collect();
        let owned = |names: &[&str]| names.iter().map(|n| (*n).to_owned()).collect::<Vec<_>>();
        let header = [owned(&HEAD), columns.concat(), owned(&TAIL)].concat();
        let [trajectory, residuals] = [trajectory, residuals].map(RowBlocks::new);
        let mut writer = Self { trajectory, residuals, recorded, is_static };
        writer.trajectory.push(|row| row.write_record(&header))?;
        let header = HEAD.into_iter().chain(RESIDUALS).chain(is_static.then_some(UNSTABLE));
        writer.residuals.push(|row| row.write_record(header))?;
        writer.flush()?; // a run that fails at once leaves two files with headers
        Ok(writer)
    }

    /// Writes one node to both files.
    ///
    /// # Errors
    /// What the files say.
    pub fn record(&mut self, sample: &Sample) -> io::Result<()> {
        let Sample { step, t, q, energy, hamiltonian, momentum, residuals, .. } = sample;
        let energies = [*energy, *hamiltonian];
        let (own, t) = (self.recorded.iter().flat_map(|place| &q[place.clone()]), [*t]);
        let rest = energies.iter().chain(&momentum.angular).chain(&momentum.linear);
        let numbers = t.iter().chain(own).chain(rest);
        self.trajectory.fields(*step, numbers.map(|x| RowField::Number(*x)))?;
        let levels = [residuals.position, residuals.velocity, residuals.momentum];
        let numbers = t.iter().chain(&levels).chain([&sample.newton_iterations]);
        let unstable = || sample.unstable.map_or(RowField::Empty, RowField::Index);
        let fields = numbers.map(|x| RowField::Number(*x)).chain(self.is_static.then(unstable));
        self.residuals.fields(*step, fields)
    }

    /// Hands everything to the files.
    ///
    /// # Errors
    /// What the files say.
    pub fn flush(&mut self) -> io::Result<()> {
        self.trajectory.flush()?;
        self.residuals.flush()
    }

    /// Ends both files.
    ///
    /// # Errors
    /// What the files say.
    pub fn finish(mut self) -> io::Result<()> {
        self.flush()
    }
}

/// A trajectory read back from its files, as far as it is drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trajectory {
    /// Names of all columns of `trajectory.csv`.
    columns: Vec<String>,
    /// Values of the columns that were read, by name.
    values: BTreeMap<String, Vec<f64>>,
    /// The rows of `residuals.csv`; empty when there is no such file.
    pub residuals: Vec<ResidualRow>,
}

impl Trajectory {
    /// Reads both files; positions of the first `members` charted members only.
    ///
    /// # Errors
    /// When a file cannot be read, or `trajectory.csv` is not one of ours.
    pub fn read(
        mut trajectory: Lines,
        residuals: Option<Lines>,
        members: usize,
    ) -> io::Result<Self> {
        let columns = trajectory.columns().to_vec();
        let ends = columns.starts_with(&HEAD.map(str::to_owned))
            && columns.ends_with(&TAIL.map(str::to_owned));
        if !ends {
            return Err(invalid("not a trajectory of holonom"));
        }
        let mut read = Self { columns, ..Self::default() };
        let wanted = read.wanted(members);
        let mut values = vec![Vec::new(); wanted.len()];
        while trajectory.advance()? {
            let (mut fields, mut next) = (trajectory.fields(), 0);
            for (&column, values) in wanted.iter().zip(&mut values) {
                values.push(number(fields.nth(column - next), column)?);
                next = column + 1;
            }
            end(fields)?; // the last column is wanted
        }
        let names = wanted.iter().map(|&column| read.columns[column].clone());
        read.values = names.zip(values).collect();
        if let Some(mut lines) = residuals {
            let names = lines.columns();
            let is_static = names.last().is_some_and(|name| name == UNSTABLE);
            let own = &names[..names.len() - usize::from(is_static)];
            if !own.iter().eq(HEAD.iter().chain(&RESIDUALS)) {
                return Err(invalid("not the residuals of a run"));
            }
            while lines.advance()? {
                read.residuals.push(ResidualRow::read(lines.fields(), is_static)?);
            }
        }
        Ok(read)
    }

    /// Members whose positions are worth a chart: all but the inner nodes of beams.
    #[must_use]
    pub fn charted(&self) -> Vec<&str> {
        let members = self.members();
        let beam = |k: usize| members.get(k).and_then(|name| name.split_once('.')).map(|(b, _)| b);
        let inner = |k: usize| {
            k > 0 && beam(k).is_some() && beam(k - 1) == beam(k) && beam(k + 1) == beam(k)
        };
        (0..members.len()).filter(|&k| !inner(k)).map(|k| members[k]).collect()
    }

    /// Columns to read: time, energies and momenta, positions of the first members.
    fn wanted(&self, members: usize) -> Vec<usize> {
        let unowned = HEAD.into_iter().chain(TAIL);
        let mut shown: BTreeSet<String> = unowned.map(str::to_owned).collect();
        for name in self.charted().into_iter().take(members) {
            shown.extend(POSITION_NAMES.map(|axis| format!("{name}.{axis}")));
        }
        (0..self.columns.len()).filter(|&i| shown.contains(&self.columns[i])).collect()
    }

    /// The values of a column that was read.
    #[must_use]
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.values.get(name).map(Vec::as_slice)
    }

    /// All columns that were read, by name.
    pub fn columns_read(&self) -> impl Iterator<Item = (&str, &[f64])> {
        self.values.iter().map(|(name, values)| (name.as_str(), values.as_slice()))
    }

    /// Names of all members, in order.
    #[must_use]
    pub fn members(&self) -> Vec<&str> {
        let own = HEAD.len()..self.columns.len().saturating_sub(TAIL.len());
        let own = self.columns.get(own).unwrap_or_default();
        own.iter().filter_map(|c| columns::member(c)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample::{MemberKind, ResidualsAtLevels};
    use vi_core::momentum_map::Momentum;

    fn sample(step: u64) -> Sample {
        Sample {
            step,
            t: step as f64 * 0.1,
            q: vec![0.1 + 0.2, -1e-300],
            energy: 1.0 / 3.0,
            hamiltonian: 0.0,
            shadow: None,
            work: 0.0,
            momentum: Momentum { linear: [1.0, 2.0, 3.0], angular: [4.0, 5.0, 6.0] },
            residuals: ResidualsAtLevels { position: 1e-16, velocity: 0.0, momentum: 2.5e-7 },
            newton_iterations: 3.0,
            sensors: vec![],
            energies: vec![],
            momenta: None,
            unstable: None,
            notice: None,
            contacts: Vec::new(),
            events: Vec::new(),
        }
    }

    #[test]
    fn header_and_rows_are_those_of_the_contract() {
        let members = [Member { name: "bob".into(), kind: MemberKind::Particle2 }];
        let (mut trajectory, mut residuals) = (Vec::new(), Vec::new());
        let mut writer = TrajectoryWriter::new(
            [&mut trajectory, &mut residuals],
            &members,
            &Columns::usual(),
            false,
        )
        .unwrap();
        writer.record(&sample(0)).unwrap();
        writer.record(&sample(3)).unwrap();
        writer.finish().unwrap();
        let text = String::from_utf8(trajectory).unwrap();
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("step,t,bob.x,bob.y,E,H,Lx,Ly,Lz,Px,Py,Pz"));
        let first = "0,0.0,0.30000000000000004,-1e-300,0.3333333333333333,0.0,\
                     4.0,5.0,6.0,1.0,2.0,3.0";
        assert_eq!(lines.next(), Some(first));
        assert!(lines.next().unwrap().starts_with("3,0.30000000000000004,"));
        let text = String::from_utf8(residuals).unwrap();
        let expected = "step,t,position,velocity,momentum,newton_iterations\n\
                        0,0.0,1e-16,0.0,2.5e-7,3.0\n";
        assert!(text.starts_with(expected), "{text}");
    }

    #[test]
    fn only_the_columns_that_are_drawn_are_read() {
        let member = |name: &str| Member { name: name.into(), kind: MemberKind::Particle2 };
        let path = std::env::temp_dir().join(format!("columns-{}.csv", std::process::id()));
        let (mut text, mut other) = (Vec::new(), Vec::new());
        let members = [member("bob"), member("rob")];
        let mut writer =
            TrajectoryWriter::new([&mut text, &mut other], &members, &Columns::usual(), true)
                .unwrap();
        let q = vec![1.0, 2.0, 3.0, 4.0];
        writer.record(&Sample { q: q.clone(), ..sample(3) }).unwrap();
        writer.record(&Sample { q, unstable: Some(2), ..sample(4) }).unwrap();
        writer.finish().unwrap();
        let other = String::from_utf8(other).unwrap();
        let ends = ["newton_iterations,unstable", "3.0,", "3.0,2"];
        assert!(other.lines().zip(ends).all(|(line, end)| line.ends_with(end)), "{other}");
        let residuals = path.with_extension("residuals");
        std::fs::write(&path, text).unwrap();
        std::fs::write(&residuals, &other).unwrap();
        let lines = Lines::new(super::super::readable::open(&path, None).unwrap()).unwrap();
        let others = Lines::new(super::super::readable::open(&residuals, None).unwrap()).unwrap();
        let read = Trajectory::read(lines, Some(others), 1).unwrap();
        std::fs::remove_file(&residuals).unwrap();
        assert_eq!(read.residuals.len(), 2);
        assert_eq!(read.members(), ["bob", "rob"]);
        assert_eq!((read.column("bob.y"), read.column("rob.x")), (Some(&[2.0, 2.0][..]), None));
        let names: Vec<&str> = read.columns_read().map(|(name, _)| name).collect();
        let expected = "E H Lx Ly Lz Px Py Pz bob.x bob.y step t";
        assert_eq!(names.join(" "), expected);
        std::fs::remove_file(&path).unwrap();
    }

    /// Fails after some bytes, keeping what it took.
    struct Full(std::rc::Rc<std::cell::RefCell<Vec<u8>>>, usize);
    impl Write for Full {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            if self.0.borrow().len() + bytes.len() > self.1 {
                return Err(io::Error::other("no space left"));
            }
            self.0.borrow_mut().extend_from_slice(bytes);
            Ok(bytes.len())
        }
        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn blocks_end_with_whole_rows() {
        let members = [Member { name: "bob".into(), kind: MemberKind::Particle2 }];
        let disk = std::rc::Rc::new(std::cell::RefCell::new(Vec::new()));
        let other = std::rc::Rc::default();
        let files = [Full(disk.clone(), 200_000), Full(other, usize::MAX)];
        let mut writer = TrajectoryWriter::new(files, &members, &Columns::usual(), false).unwrap();
        let failed = (0..10_000).find_map(|step| writer.record(&sample(step)).err());
        assert!(failed.is_some());
        drop(writer);
        assert_eq!(disk.borrow().last(), Some(&b'\n'));
        assert!(disk.borrow().len() > 60_000);
    }
}
