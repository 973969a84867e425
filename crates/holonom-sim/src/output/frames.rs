//! Configurations of a run at some instants, read back from its files.

use std::collections::BTreeMap;
use std::io;

use super::columns::{self, COORDINATE_NAMES, HEAD};
use super::readable::{self, Lines, invalid};
use crate::sample::{Member, MemberKind};
use crate::system::{self, System};
use holonom_model::{Model, ModelError};

/// All coordinates of a run at some instants.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Frames {
    /// The members, in the order of their coordinates.
    pub members: Vec<Member>,
    /// Step indices.
    pub steps: Vec<u64>,
    /// Times, s.
    pub times: Vec<f64>,
    /// `q` at each time.
    pub q: Vec<Vec<f64>>,
}

/// A member and its columns of `trajectory.csv`.
#[derive(Clone, Debug, PartialEq)]
pub struct MemberColumns {
    /// The member.
    pub member: Member,
    /// Index of the first of its columns.
    pub first: usize,
}

/// The members that columns of `trajectory.csv` belong to.
#[must_use]
pub fn members(header: &[String]) -> Vec<MemberColumns> {
    let member = |(first, column): (usize, &String)| {
        let name = columns::member(column)?;
        let has = |axis: usize| {
            let own = format!("{name}.{}", COORDINATE_NAMES[axis]);
            header.get(first + axis) == Some(&own)
        };
        let kind = match (has(2), has(3)) {
            (_, true) => MemberKind::Frame,
            (true, _) => MemberKind::Particle3,
            _ => MemberKind::Particle2,
        };
        Some(MemberColumns { member: Member { name: name.to_owned(), kind }, first })
    };
    header.iter().enumerate().filter_map(member).collect()
}

/// A recorded node: its configuration.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// Step index.
    pub step: u64,
    /// Time, s.
    pub t: f64,
    /// `q`, members one after the other.
    pub q: Vec<f64>,
}

/// Some rows of `trajectory.csv`, one after the other, evenly spread from the first to the last.
#[derive(Debug)]
pub struct FrameReader {
    lines: Lines,
    members: Vec<Member>,
    width: usize, // coordinates
    rows: usize,  // of the file
    count: usize, // rows that are read
    row: usize,   // the next of the file
    next: usize,  // the next that is read
}

impl FrameReader {
    /// Up to `numbers` coordinates in all of a file, which is opened twice; at least two rows, at
    /// most `most`.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn new(
        trajectory: impl Fn() -> io::Result<Lines>,
        numbers: usize,
        most: usize,
    ) -> io::Result<Self> {
        let rows = trajectory()?.pass_over(usize::MAX)?;
        let lines = trajectory()?;
        let members = members(lines.columns()).into_iter().map(|of| of.member);
        let members: Vec<Member> = members.collect();
        let width: usize = members.iter().map(|m| m.kind.columns().len()).sum();
        let count = (numbers / width.max(1)).clamp(2, most.max(2)).min(rows);
        Ok(Self { lines, members, width, rows, count, row: 0, next: 0 })
    }

    /// The members, in the order of their coordinates.
    #[must_use]
    pub fn members(&self) -> &[Member] {
        &self.members
    }

    /// How many rows are read.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// How many rows the file has.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows
    }

    fn read(&mut self) -> io::Result<Option<Snapshot>> {
        if self.next >= self.count {
            return Ok(None);
        }
        let chosen = self.next * (self.rows - 1) / (self.count - 1).max(1);
        self.lines.pass_over(chosen - self.row)?;
        if !self.lines.advance()? {
            return Ok(None);
        }
        (self.row, self.next) = (chosen + 1, self.next + 1);
        self.frame().map(Some)
    }

    fn frame(&self) -> io::Result<Snapshot> {
        let mut fields = self.lines.fields();
        let mut number = |k: usize| {
            let value: f64 = readable::number(fields.next(), k)?;
            let finite = value.is_finite().then_some(value);
            finite.ok_or_else(|| invalid(&format!("no finite number in column {}", k + 1)))
        };
        let (step, t) = (number(0)? as u64, number(1)?);
        Ok(Snapshot {
            step,
            t,
            q: (HEAD.len()..HEAD.len() + self.width).map(number).collect::<io::Result<_>>()?,
        })
    }
}

impl Iterator for FrameReader {
    type Item = io::Result<Snapshot>;

    fn next(&mut self) -> Option<Self::Item> {
        self.read().transpose()
    }
}

/// The members with their coordinates in a configuration `q`.
pub fn coordinates<'a>(
    members: &'a [Member],
    q: &'a [f64],
) -> impl Iterator<Item = (&'a Member, &'a [f64])> {
    let mut rest = q;
    members.iter().map(move |member| {
        let own;
        (own, rest) = rest.split_at(member.kind.columns().len());
        (member, own)
    })
}

impl Frames {
    /// The initial configuration of a model.
    ///
    /// # Errors
    /// [`ModelError`] when the model cannot be assembled.
    pub fn initial(model: &Model) -> Result<Self, ModelError> {
        let System { mechanism, members, .. } = system::build(model)?;
        let q = vec![mechanism.initial_configuration()];
        Ok(Self { members, steps: vec![0], times: vec![0.0], q })
    }

    /// The rows of a [`FrameReader`].
    ///
    /// # Errors
    /// When the file cannot be read, or is not one of ours.
    pub fn read(
        trajectory: impl Fn() -> io::Result<Lines>,
        numbers: usize,
        most: usize,
    ) -> io::Result<Self> {
        let reader = FrameReader::new(trajectory, numbers, most)?;
        let mut frames = Self { members: reader.members().to_vec(), ..Self::default() };
        for frame in reader {
            let Snapshot { step, t, q } = frame?;
            frames.steps.push(step);
            frames.times.push(t);
            frames.q.push(q);
        }
        Ok(frames)
    }

    /// The members with their coordinates in the frame of an index.
    pub fn coordinates(&self, frame: usize) -> impl Iterator<Item = (&Member, &[f64])> {
        coordinates(&self.members, &self.q[frame])
    }

    /// Positions of the members in the frame of an index, m; the third number is 0 in the plane.
    pub fn points(&self, frame: usize) -> impl Iterator<Item = [f64; 3]> {
        let z = |own: &[f64]| own.get(2).copied().unwrap_or_default();
        self.coordinates(frame).map(move |(_, own)| [own[0], own[1], z(own)])
    }

    /// Magnitude of the bending moment, N·m, in all rows of `beams.csv` for a beam at the steps of
    /// these frames: for each beam by name one list for each frame.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn bending_moments(&self, mut lines: Lines) -> io::Result<BTreeMap<String, Vec<Vec<f64>>>> {
        let mut found: BTreeMap<String, Vec<Vec<f64>>> = BTreeMap::new();
        let mut frame = 0;
        let column = |name: &str| lines.columns().iter().position(|c| c == name);
        let [m1, m2, ..] = columns::MOMENTS;
        let all = (column(columns::BEAM.name), column(m1), column(m2));
        let (Some(beam), Some(m1), Some(m2)) = all else {
            return Err(invalid("not the beams of a run"));
        };
        while lines.advance()? {
            let Ok(step) = readable::number::<u64>(lines.fields().next(), 0) else { continue };
            while frame < self.steps.len() && self.steps[frame] < step {
                frame += 1;
            }
            if self.steps.get(frame) != Some(&step) {
                continue;
            }
            let record = lines.record()?;
            let field = |k: usize| record.get(k).unwrap_or_default();
            let moment = |k: usize| field(k).parse::<f64>().unwrap_or_default();
            let lists = found.entry(field(beam).to_owned()).or_default();
            lists.resize(frame + 1, Vec::new());
            lists[frame].push(moment(m1).hypot(moment(m2)));
        }
        Ok(found)
    }
}
