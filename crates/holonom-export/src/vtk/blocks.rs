//! The blocks of a frame: what ParaView shows as parts of one data set.

use nalgebra::Vector3;

use super::poly_data::{Array, ArrayValues, PolyData};
use super::rates::Rate;
use super::reactions::InstantReaction;
use crate::look::{NamedJoint, NamedLine, holds, point};
use crate::run::ShownRun;
use crate::tube::{MemberPose, Tube};

/// Names of the blocks with whether a run has them, in their order.
pub(super) fn names(run: &ShownRun<'_>, reactions: bool) -> Vec<&'static str> {
    let look = &run.look;
    let all = [
        ("bodies", !look.solids.is_empty()),
        ("centers", !look.solids.is_empty()),
        ("beams", !look.beams.is_empty()),
        ("beam_surfaces", !look.beams.is_empty()),
        ("joints", !look.joints.is_empty()),
        ("reactions", reactions),
        ("lines", !look.lines.is_empty()),
    ];
    all.into_iter().filter(|(_, there)| *there).map(|(name, _)| name).collect()
}

/// A frame with all that is known of it.
pub(super) struct FrameData<'a> {
    pub(super) run: &'a ShownRun<'a>,
    /// Its time, s: what events have released before is not there.
    pub(super) t: f64,
    /// Of all members, at the first frame and at this one.
    pub(super) poses: [&'a [MemberPose]; 2],
    /// Of the bodies and point masses.
    pub(super) rates: &'a [Rate],
    /// Of each beam twelve numbers for each interval between nodes: `Γ, K, N, M`; empty where they
    /// are not known.
    pub(super) sections: &'a [Vec<[f64; 12]>],
    pub(super) reactions: &'a [InstantReaction],
}

impl FrameData<'_> {
    /// A block by its name.
    pub(super) fn block(&self, name: &str) -> PolyData {
        match name {
            "bodies" => self.bodies(),
            "centers" => self.centers(),
            "beams" => self.beams(),
            "beam_surfaces" => self.beam_surfaces(),
            "joints" => self.joints(),
            "reactions" => self.reactions(),
            _ => self.lines(),
        }
    }

    fn pose(&self, member: usize) -> &MemberPose {
        &self.poses[1][member]
    }

    fn displacement(&self, member: usize) -> [f64; 3] {
        (self.pose(member).center - self.poses[0][member].center).into()
    }

    /// One vector of each body and point mass; `None` unless all are known.
    fn all(&self, which: impl Fn(&Rate) -> Option<[f64; 3]>) -> Option<Vec<[f64; 3]>> {
        self.rates.iter().map(which).collect()
    }

    fn bodies(&self) -> PolyData {
        let mut data = PolyData::default();
        let (mut normals, mut velocities) = (Vec::new(), Vec::new());
        let (mut body, mut colors, mut opacities) = (Vec::new(), Vec::new(), Vec::new());
        let known = self.all(|rate| rate.velocity).is_some();
        for (k, solid) in self.run.look.solids.iter().enumerate() {
            let (pose, rate) = (self.pose(solid.member), &self.rates[k]);
            let first = data.points.len() as u32;
            let velocity = Vector3::from(rate.velocity.unwrap_or_default());
            let omega = Vector3::from(rate.angular_velocity.unwrap_or_default());
            for (x, n) in solid.mesh.points.iter().zip(&solid.mesh.normals) {
                let point = pose.point(*x);
                velocities.push((velocity + omega.cross(&(point - pose.center))).into());
                normals.extend((pose.directors * Vector3::from(*n)).iter().map(|n| *n as f32));
                data.points.push(point.into());
            }
            data.triangles.extend(solid.mesh.triangles.iter().map(|t| t.map(|i| first + i)));
            let count = solid.mesh.triangles.len();
            body.extend(std::iter::repeat_n(k as i32, count));
            colors.extend([solid.color].repeat(count).concat());
            opacities.extend(std::iter::repeat_n(solid.opacity, count));
        }
        data.point_data.push(Array::normals(normals));
        let frames = self.run.look.solids.iter().zip(self.rates);
        let turning = frames
            .clone()
            .all(|(solid, rate)| !self.is_frame(solid.member) || rate.angular_velocity.is_some());
        if known && turning {
            data.point_data.push(Array::vectors("velocity", &velocities));
        }
        data.cell_data.push(Array::scalars("body", ArrayValues::Int32(body)));
        data.cell_data.push(Array::colors(colors));
        if opacities.iter().any(|opacity| *opacity < 1.0) {
            data.cell_data.push(Array::scalars("opacity", ArrayValues::Float64(opacities)));
        }
        data
    }

    fn is_frame(&self, member: usize) -> bool {
        self.run.members[member].kind == holonom_sim::sample::MemberKind::Frame
    }

    fn centers(&self) -> PolyData {
        let solids = &self.run.look.solids;
        let members: Vec<usize> = solids.iter().map(|solid| solid.member).collect();
        let mut data = self.frames(&members);
        let names = solids.iter().map(|solid| solid.name.clone()).collect();
        let index = (0..solids.len() as i32).collect();
        data.vertices = true;
        data.point_data.insert(0, Array::scalars("name", ArrayValues::Text(names)));
        data.point_data.insert(1, Array::scalars("body", ArrayValues::Int32(index)));
        let still = [0.0; 3]; // point masses do not turn
        let angular = |(rate, member): (&Rate, &usize)| match self.is_frame(*member) {
            true => rate.angular_velocity,
            false => Some(still),
        };
        let angular: Option<Vec<[f64; 3]>> = self.rates.iter().zip(&members).map(angular).collect();
        for (name, values) in [
            ("velocity", self.all(|rate| rate.velocity)),
            ("angular_velocity", angular),
            ("momentum", self.all(|rate| rate.momentum)),
        ] {
            data.point_data.extend(values.map(|values| Array::vectors(name, &values)));
        }
        data
    }

    /// Centres of members with their directors.
    fn frames(&self, members: &[usize]) -> PolyData {
        let poses = || members.iter().map(|member| self.pose(*member));
        let director = |k: usize| -> Vec<[f64; 3]> {
            poses().map(|pose| pose.directors.column(k).into_owned().into()).collect()
        };
        let displacement: Vec<[f64; 3]> = members.iter().map(|m| self.displacement(*m)).collect();
        PolyData {
            points: poses().map(|pose| pose.center.into()).collect(),
            point_data: vec![
                Array::vectors("displacement", &displacement),
                Array::vectors("d1", &director(0)),
                Array::vectors("d2", &director(1)),
                Array::vectors("d3", &director(2)),
            ],
            ..PolyData::default()
        }
    }

    fn beams(&self) -> PolyData {
        let look = &self.run.look;
        let legs: Vec<_> = look.beams.iter().flat_map(|beam| beam.legs()).collect();
        let members: Vec<usize> = legs.iter().cloned().flatten().collect();
        let mut data = self.frames(&members);
        let (mut beams, mut nodes) = (Vec::new(), Vec::new());
        let mut first = 0;
        for (k, beam) in look.beams.iter().enumerate() {
            let count: usize = beam.beam.legs.iter().sum();
            beams.extend(std::iter::repeat_n(k as i32, count));
            nodes.extend(0..count as i32);
            for leg in &beam.beam.legs {
                let last = first + *leg as u32 - 1;
                data.lines.extend((first..last).map(|node| [node, node + 1]));
                first = last + 1;
            }
        }
        data.point_data.insert(0, Array::scalars("beam", ArrayValues::Int32(beams)));
        data.point_data.insert(1, Array::scalars("node", ArrayValues::Int32(nodes)));
        let intervals: Vec<Option<[f64; 12]>> = (0..look.beams.len())
            .flat_map(|k| (0..self.intervals(k)).map(move |i| (k, i)))
            .map(|(k, i)| self.sections[k].get(i).copied())
            .collect();
        data.cell_data = section_arrays(intervals);
        data
    }

    fn intervals(&self, beam: usize) -> usize {
        self.run.look.beams[beam].beam.legs.iter().map(|nodes| nodes - 1).sum()
    }

    fn beam_surfaces(&self) -> PolyData {
        let mut data = PolyData::default();
        let (mut normals, mut beams) = (Vec::new(), Vec::new());
        let (mut colors, mut sections) = (Vec::new(), Vec::new());
        for (k, beam) in self.run.look.beams.iter().enumerate() {
            let mut before = 0; // intervals of earlier legs
            for leg in beam.legs() {
                let tube = Tube::new(&beam.beam, &self.poses[1][leg.clone()]);
                let first = data.points.len() as u32;
                data.points.extend(tube.points);
                normals.extend(tube.normals.iter().flatten().map(|n| *n as f32));
                for strip in tube.strips {
                    data.strips.push(strip.corners.iter().map(|corner| first + corner).collect());
                    beams.push(k as i32);
                    colors.extend(beam.color);
                    sections.push(self.sections[k].get(before + strip.interval).copied());
                }
                before += leg.len() - 1;
            }
        }
        data.point_data = vec![Array::normals(normals)];
        data.cell_data =
            vec![Array::scalars("beam", ArrayValues::Int32(beams)), Array::colors(colors)];
        data.cell_data.extend(section_arrays(sections));
        data
    }

    fn joints(&self) -> PolyData {
        let joints = self.run.look.joints.iter();
        let joints: Vec<&NamedJoint> =
            joints.filter(|named| holds(named.joint.until, self.t)).collect();
        let axis = |named: &&NamedJoint| -> [f64; 3] {
            let axis = Vector3::from(named.joint.axis.unwrap_or_default());
            match usize::try_from(named.joint.parent.member) {
                Ok(parent) => (self.pose(parent).directors * axis).into(),
                Err(_) => axis.into(),
            }
        };
        let names = joints.iter().map(|joint| joint.name.clone()).collect();
        let axes: Vec<[f64; 3]> = joints.iter().map(axis).collect();
        PolyData {
            points: joints.iter().map(|j| point(&j.joint.child, self.poses[1]).into()).collect(),
            vertices: true,
            point_data: vec![
                Array::scalars("name", ArrayValues::Text(names)),
                Array::vectors("axis", &axes),
            ],
            ..PolyData::default()
        }
    }

    fn reactions(&self) -> PolyData {
        let all = self.reactions;
        let vectors =
            |which: fn(&InstantReaction) -> [f64; 3]| all.iter().map(which).collect::<Vec<_>>();
        PolyData {
            points: all.iter().map(|reaction| reaction.point.into()).collect(),
            vertices: true,
            point_data: vec![
                Array::scalars(
                    "name",
                    ArrayValues::Text(all.iter().map(|r| r.joint.clone()).collect()),
                ),
                Array::vectors("force", &vectors(|reaction| reaction.force)),
                Array::vectors("moment", &vectors(|reaction| reaction.moment)),
            ],
            ..PolyData::default()
        }
    }

    fn lines(&self) -> PolyData {
        let lines = self.run.look.lines.iter();
        let lines: Vec<&NamedLine> = lines.filter(|own| holds(own.line.until, self.t)).collect();
        let ends = |l: &&NamedLine| [&l.line.from, &l.line.to].map(|end| point(end, self.poses[1]));
        let length = |l| {
            let [from, to] = ends(l);
            (to - from).norm()
        };
        let points = lines.iter().flat_map(ends).map(Into::into).collect();
        let spring = lines.iter().map(|line| i32::from(line.spring)).collect();
        PolyData {
            points,
            lines: (0..lines.len() as u32).map(|k| [2 * k, 2 * k + 1]).collect(),
            cell_data: vec![
                Array::scalars(
                    "name",
                    ArrayValues::Text(lines.iter().map(|l| l.name.clone()).collect()),
                ),
                Array::scalars("spring", ArrayValues::Int32(spring)),
                Array::scalars("length", ArrayValues::Float64(lines.iter().map(length).collect())),
            ],
            ..PolyData::default()
        }
    }
}

/// Strains and section forces of cells; nothing unless all are known.
fn section_arrays(cells: Vec<Option<[f64; 12]>>) -> Vec<Array> {
    let Some(cells) = cells.into_iter().collect::<Option<Vec<[f64; 12]>>>() else {
        return Vec::new();
    };
    let array = |(k, name)| {
        let part = |cell: &[f64; 12]| std::array::from_fn(|i| cell[3 * k + i]);
        Array::vectors(name, &cells.iter().map(part).collect::<Vec<[f64; 3]>>())
    };
    ["Gamma", "K", "N", "M"].into_iter().enumerate().map(array).collect()
}
