//! Surfaces of beams: sections along a smooth line through the nodes.
//!
//! ```text
//! centre line   cubic between two nodes, tangents d_3 times their distance
//! section       along d_1 and d_2, turned evenly from node to node
//! ```

use crate::mesh::SurfaceMesh;
use holonom_report::scene::parts::SceneBeam;
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Sections from one node to the next.
pub(crate) const SECTIONS: usize = 3;
/// Corners of a round section.
const CORNERS: usize = 16;

/// Where a member is: its centre, m, and its directors as columns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct MemberPose {
    pub(crate) center: Vector3<f64>,
    pub(crate) directors: Matrix3<f64>,
}

impl MemberPose {
    /// A point given by components along the directors, m.
    pub(crate) fn point(&self, components: [f64; 3]) -> Vector3<f64> {
        self.center + self.directors * Vector3::from(components)
    }

    fn quaternion(&self) -> Quaternion<f64> {
        let [x, y, z, w] = holonom_report::scene::quaternion(&self.directors);
        Quaternion::new(w, x, y, z)
    }
}

/// A section: between the node `node` and the next one, at the part `place` of the way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TubeSection {
    pub(crate) node: usize,
    pub(crate) place: f64,
}

/// The sections of a line of nodes, the first and the last at its ends.
pub(crate) fn sections(nodes: usize) -> Vec<TubeSection> {
    let last = nodes.saturating_sub(1) * SECTIONS;
    let section = |k: usize| match k {
        _ if k > 0 && k == last => TubeSection { node: k / SECTIONS - 1, place: 1.0 },
        _ => TubeSection { node: k / SECTIONS, place: (k % SECTIONS) as f64 / SECTIONS as f64 },
    };
    (0..=last).map(section).collect()
}

/// Corners of a section and their normals, along `d_1` and `d_2`; all counterclockwise about `d_3`.
struct SectionOutline {
    corners: Vec<([f64; 2], [f64; 2])>,
    /// Its smooth parts, each by its corners.
    parts: Vec<Vec<u32>>,
    /// Corners around it, each place once.
    around: Vec<u32>,
}

impl SectionOutline {
    fn of(beam: &SceneBeam) -> Self {
        let [a, b] = beam.half;
        if beam.round {
            let corner = |k: usize| {
                let (sin, cos) = (std::f64::consts::TAU * k as f64 / CORNERS as f64).sin_cos();
                let normal = nalgebra::Vector2::new(cos * b, sin * a);
                let normal = normal.try_normalize(0.0).unwrap_or_default();
                ([a * cos, b * sin], normal.into())
            };
            let count = CORNERS as u32;
            return Self {
                corners: (0..CORNERS).map(corner).collect(),
                parts: vec![(0..=count).map(|k| k % count).collect()],
                around: (0..count).collect(),
            };
        }
        let corners = vec![
            ([a, -b], [1.0, 0.0]),
            ([a, b], [1.0, 0.0]),
            ([a, b], [0.0, 1.0]),
            ([-a, b], [0.0, 1.0]),
            ([-a, b], [-1.0, 0.0]),
            ([-a, -b], [-1.0, 0.0]),
            ([-a, -b], [0.0, -1.0]),
            ([a, -b], [0.0, -1.0]),
        ];
        let parts = [[0, 1], [2, 3], [4, 5], [6, 7]].map(Vec::from).into();
        Self { corners, parts, around: vec![0, 2, 4, 6] }
    }
}

/// Triangles side by side: each corner from the third on makes one with the two before it, the
/// first of them counterclockwise as seen from outside.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Strip {
    /// The interval between nodes.
    pub(crate) interval: usize,
    pub(crate) corners: Vec<u32>,
}

impl Strip {
    fn triangles(&self) -> impl Iterator<Item = [u32; 3]> {
        let triangle = |(k, t): (usize, &[u32])| match k % 2 {
            0 => [t[0], t[1], t[2]],
            _ => [t[1], t[0], t[2]],
        };
        self.corners.windows(3).enumerate().map(triangle)
    }
}

/// The surface of a beam along a line of nodes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Tube {
    /// Corners, m.
    pub(crate) points: Vec<[f64; 3]>,
    /// Unit vectors outwards at the corners.
    pub(crate) normals: Vec<[f64; 3]>,
    /// The section of each corner.
    pub(crate) sections: Vec<TubeSection>,
    pub(crate) strips: Vec<Strip>,
}

impl Tube {
    /// Of a beam with the given nodes of one of its legs, at least two.
    pub(crate) fn new(beam: &SceneBeam, nodes: &[MemberPose]) -> Self {
        let outline = SectionOutline::of(beam);
        let mut tube = Self::default();
        let sections = sections(nodes.len());
        for section in &sections {
            let (center, [d1, d2]) = place(nodes, section);
            for ([x, y], [nx, ny]) in &outline.corners {
                tube.push(*section, center + d1 * *x + d2 * *y, d1 * *nx + d2 * *ny);
            }
        }
        let per = outline.corners.len() as u32;
        for (k, section) in sections.iter().enumerate().skip(1) {
            let interval = if section.place > 0.0 { section.node } else { section.node - 1 };
            let (low, high) = ((k as u32 - 1) * per, k as u32 * per);
            for part in &outline.parts {
                let corners = part.iter().flat_map(|c| [high + c, low + c]).collect();
                tube.strips.push(Strip { interval, corners });
            }
        }
        let ends = sections.first().map(|s| (s, -1.0)).into_iter();
        for (section, sign) in ends.chain(sections.last().map(|s| (s, 1.0))) {
            tube.cap(&outline, nodes, section, sign);
        }
        tube
    }

    /// The same as a surface of triangles.
    pub(crate) fn mesh(&self) -> SurfaceMesh {
        SurfaceMesh {
            points: self.points.clone(),
            normals: self.normals.clone(),
            triangles: self.strips.iter().flat_map(Strip::triangles).collect(),
        }
    }

    fn push(&mut self, section: TubeSection, point: Vector3<f64>, normal: Vector3<f64>) {
        self.points.push(point.into());
        self.normals.push(normal.try_normalize(0.0).unwrap_or_else(Vector3::z).into());
        self.sections.push(section);
    }

    /// The end of a line; `sign`: whether its normal is along `d_3` or against it.
    fn cap(
        &mut self,
        outline: &SectionOutline,
        nodes: &[MemberPose],
        section: &TubeSection,
        sign: f64,
    ) {
        let (center, [d1, d2]) = place(nodes, section);
        let first = self.points.len() as u32;
        for corner in &outline.around {
            let [x, y] = outline.corners[*corner as usize].0;
            self.push(*section, center + d1 * x + d2 * y, sign * d1.cross(&d2));
        }
        // from both sides of the first corner on in turn
        let count = outline.around.len() as u32;
        let zigzag = |k: u32| if k % 2 == 1 { k.div_ceil(2) } else { (count - k / 2) % count };
        let turned = |k: u32| if sign > 0.0 { k } else { (count - k) % count };
        let corners = (0..count).map(|k| first + turned(zigzag(k))).collect();
        self.strips.push(Strip { interval: section.node, corners });
    }
}

/// The centre of a section and its first two axes.
fn place(nodes: &[MemberPose], section: &TubeSection) -> (Vector3<f64>, [Vector3<f64>; 2]) {
    let p = &nodes[section.node];
    let q = nodes.get(section.node + 1).unwrap_or(p);
    let s = section.place;
    let chord = (q.center - p.center).norm();
    let tangent = |pose: &MemberPose| pose.directors.column(2) * chord;
    let center = p.center * ((1.0 + 2.0 * s) * (1.0 - s).powi(2))
        + tangent(p) * (s * (1.0 - s).powi(2))
        + q.center * (s * s * (3.0 - 2.0 * s))
        + tangent(q) * (s * s * (s - 1.0));
    let (from, to) = (p.quaternion(), q.quaternion());
    let to = if from.dot(&to) < 0.0 { -to } else { to };
    let turn = UnitQuaternion::try_new(from * (1.0 - s) + to * s, 0.0).unwrap_or_default();
    (center, [turn * Vector3::x(), turn * Vector3::y()])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::tests::{faces_outwards, volume};

    fn beam(round: bool) -> SceneBeam {
        let shape = match round {
            true => "type = \"circle\", dimensions = [0.1]",
            false => "type = \"rectangle\", dimensions = [0.2, 0.4]",
        };
        let text = format!(
            "[model]\nname = \"b\"\n[simulation]\nstep = 0.1\nend = 0.1\n[[beam]]\nname = \"b\"\n\
             points = [[0, 0, 0], [0, 0, 1]]\nelements = 2\nnormal = [1, 0, 0]\n\
             section = {{ shape = {{ {shape} }}, material = {{ E = 1, nu = 0.3, density = 1 }} }}\n"
        );
        let model = holonom_model::Model::from_toml(&text).unwrap();
        let pose = |z: f64| vec![0.0, 0.0, z, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0];
        let members = (0..3)
            .map(|k| holonom_sim::sample::Member {
                name: format!("b.{k}"),
                kind: holonom_sim::sample::MemberKind::Frame,
            })
            .collect();
        let frames = holonom_sim::output::Frames {
            members,
            q: vec![[pose(0.0), pose(0.5), pose(1.0)].concat()],
            ..Default::default()
        };
        let parts = holonom_report::scene::parts::SceneParts::new(&model, &frames).unwrap();
        parts.beams(&Default::default()).remove(0)
    }

    #[test]
    fn a_straight_beam_is_a_prism() {
        let pose = |z: f64| MemberPose {
            center: Vector3::new(0.3, 0.0, z),
            directors: Matrix3::identity(),
        };
        let nodes = [pose(0.0), pose(0.5), pose(1.0)];
        let ellipse = 0.5 * CORNERS as f64 * (std::f64::consts::TAU / CORNERS as f64).sin() * 0.01;
        for (round, expected) in [(true, ellipse), (false, 0.08)] {
            let tube = Tube::new(&beam(round), &nodes);
            let mesh = tube.mesh();
            let found = volume(&mesh);
            assert!((found - expected).abs() < 1e-14, "volume {found}, expected {expected}");
            faces_outwards(&mesh);
            assert_eq!(tube.sections.len(), tube.points.len());
        }
    }

    #[test]
    fn the_centre_line_goes_through_the_nodes() {
        let turn = |angle: f64| {
            nalgebra::Rotation3::from_axis_angle(&Vector3::y_axis(), angle).into_inner()
        };
        let pose = |a: f64| MemberPose {
            center: Vector3::new(1.0 - a.cos(), 0.0, a.sin()),
            directors: turn(a),
        };
        let nodes = [pose(0.0), pose(0.25), pose(0.5)]; // a circle of radius 1
        let mut worst: f64 = 0.0;
        for section in sections(3) {
            let (center, [d1, _]) = place(&nodes, &section);
            let angle = 0.25 * (section.node as f64 + section.place);
            let exact = pose(angle);
            worst = worst.max((center - exact.center).norm());
            worst = worst.max((d1 - exact.directors.column(0)).norm());
            if section.place.fract() == 0.0 {
                assert!((center - exact.center).norm() < 1e-15);
            }
        }
        assert!(worst < 2e-3, "{worst:e} from a circle");
    }
}
