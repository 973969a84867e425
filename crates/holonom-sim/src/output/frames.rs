//! Configurations of a run at some instants, read back from its files.

use std::collections::BTreeMap;
use std::io;

use super::csv::invalid;
use super::readable::RowReader;
use crate::sample::{Member, MemberKind};

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

/// The members that columns of `trajectory.csv` belong to, each with the index of its first column.
#[must_use]
pub fn members(columns: &[String]) -> Vec<(usize, Member)> {
    let member = |(k, column): (usize, &String)| {
        let name = column.strip_suffix(".x")?;
        let has = |offset: usize, axis: &str| {
            columns.get(k + offset).is_some_and(|c| *c == format!("{name}.{axis}"))
        };
        let kind = match (has(2, "z"), has(3, "d1x")) {
            (_, true) => MemberKind::Frame,
            (true, _) => MemberKind::Particle3,
            _ => MemberKind::Particle2,
        };
        Some((k, Member { name: name.to_owned(), kind }))
    };
    columns.iter().enumerate().filter_map(member).collect()
}

impl Frames {
    /// Up to `numbers` coordinates in all, evenly spread from the first row of `trajectory.csv`, which is opened twice, to
    /// the last; at least two rows, at most `most`.
    ///
    /// # Errors
    /// When the file cannot be read, or is not one of ours.
    pub fn read(
        trajectory: impl Fn() -> io::Result<RowReader>,
        numbers: usize,
        most: usize,
    ) -> io::Result<Self> {
        let rows = trajectory()?.into_byte_records().count();
        let mut reader = trajectory()?;
        let columns: Vec<String> = reader.headers()?.iter().map(str::to_owned).collect();
        let members = members(&columns).into_iter().map(|(_, member)| member).collect();
        let mut frames = Self { members, ..Self::default() };
        let width: usize = frames.members.iter().map(|m| m.kind.columns().len()).sum();
        let count = (numbers / width.max(1)).clamp(2, most.max(2)).min(rows);
        let chosen = |i: usize| i * (rows - 1) / (count - 1).max(1);
        let mut next = 0;
        for (row, record) in reader.records().enumerate() {
            let record = record?;
            if next >= count || row != chosen(next) {
                continue;
            }
            next += 1;
            let number = |k: usize| {
                let value = record.get(k).and_then(|field| field.parse().ok());
                value.ok_or_else(|| invalid(&format!("no number in column {}", k + 1)))
            };
            frames.steps.push(number(0)? as u64);
            frames.times.push(number(1)?);
            frames.q.push((2..2 + width).map(number).collect::<io::Result<_>>()?);
        }
        Ok(frames)
    }

    /// The members with their coordinates in the frame of an index.
    pub fn coordinates(&self, frame: usize) -> impl Iterator<Item = (&Member, &[f64])> {
        let mut rest = &self.q[frame][..];
        self.members.iter().map(move |member| {
            let own;
            (own, rest) = rest.split_at(member.kind.columns().len());
            (member, own)
        })
    }

    /// Positions of the members in the frame of an index, m; the third number is 0 in the plane.
    pub fn points(&self, frame: usize) -> impl Iterator<Item = [f64; 3]> {
        let z = |own: &[f64]| own.get(2).copied().unwrap_or_default();
        self.coordinates(frame).map(move |(_, own)| [own[0], own[1], z(own)])
    }

    /// Magnitude of the bending moment, N·m, in all rows of `beams.csv` for a beam at the steps of these frames: for each
    /// beam by name one list for each frame.
    ///
    /// # Errors
    /// When the file cannot be read.
    pub fn bending_moments(
        &self,
        mut reader: RowReader,
    ) -> io::Result<BTreeMap<String, Vec<Vec<f64>>>> {
        let mut found: BTreeMap<String, Vec<Vec<f64>>> = BTreeMap::new();
        let mut frame = 0;
        let columns: Vec<String> = reader.headers()?.iter().map(str::to_owned).collect();
        let column = |name: &str| columns.iter().position(|c| c == name);
        let all = (column("beam"), column("M1"), column("M2"));
        let (Some(beam), Some(m1), Some(m2)) = all else {
            return Err(invalid("not the beams of a run"));
        };
        let mut record = csv::StringRecord::new();
        while reader.read_record(&mut record)? {
            let field = |k: usize| record.get(k).unwrap_or_default();
            let Ok(step) = field(0).parse::<u64>() else { continue };
            while frame < self.steps.len() && self.steps[frame] < step {
                frame += 1;
            }
            if self.steps.get(frame) != Some(&step) {
                continue;
            }
            let moment = |k: usize| field(k).parse::<f64>().unwrap_or_default();
            let lists = found.entry(field(beam).to_owned()).or_default();
            lists.resize(frame + 1, Vec::new());
            lists[frame].push(moment(m1).hypot(moment(m2)));
        }
        Ok(found)
    }
}
