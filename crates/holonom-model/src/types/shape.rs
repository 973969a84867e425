//! Homogeneous shapes: mass properties from dimensions, and the picture of a body.

use nalgebra::{Matrix3, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Kind of a shape; the origin is the centre of mass, axes of revolution are the body's third axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum ShapeKind {
    /// `dimensions = [x, y, z]`: edge lengths, m.
    #[default]
    Box,
    /// `dimensions = [radius, height]`, m.
    Cylinder,
    /// `dimensions = [radius]`, m.
    Sphere,
    /// `dimensions = [length, radius]`, m: a slender cylinder.
    Rod,
    /// `dimensions = [radius, height]`, m: base radius; the tip points along minus the third axis.
    Cone,
    /// `dimensions = [radius, length]`, m: a cylinder with half balls whose centres are `length`
    /// apart.
    Capsule,
    /// `dimensions = [x, y, z]`: half axes, m.
    Ellipsoid,
    /// `file`: the triangles of a file.
    Mesh,
}

impl ShapeKind {
    /// Whether it is drawn by triangles alone.
    #[must_use]
    pub fn is_of_triangles(self) -> bool {
        matches!(self, Self::Mesh | Self::Capsule | Self::Ellipsoid)
    }

    /// What its dimensions are.
    #[must_use]
    pub fn dimensions(self) -> &'static [&'static str] {
        match self {
            Self::Box | Self::Ellipsoid => &["x", "y", "z"],
            Self::Capsule => &["radius", "length"],
            Self::Cylinder | Self::Cone => &["radius", "height"],
            Self::Sphere => &["radius"],
            Self::Rod => &["length", "radius"],
            Self::Mesh => &[],
        }
    }
}

/// `scale` of a mesh.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "scale is a number or a list of three, [x, y, z]")]
pub enum Scale {
    /// The same factor along all axes.
    Uniform(f64),
    /// Factors along the axes of the file.
    Axes([f64; 3]),
}

impl Scale {
    /// The factors along the axes of the file.
    #[must_use]
    pub fn vector(&self) -> Vector3<f64> {
        match self {
            Self::Uniform(factor) => Vector3::repeat(*factor),
            Self::Axes(factors) => Vector3::from(*factors),
        }
    }
}

/// `shape`: a homogeneous solid.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Shape {
    /// Kind of the shape.
    #[serde(rename = "type")]
    pub kind: ShapeKind,
    /// Its dimensions, m: box `[x, y, z]`, cylinder and cone `[radius, height]`, sphere `[radius]`,
    /// rod `[length, radius]`, capsule `[radius, length]`, ellipsoid `[x, y, z]`; none for a mesh.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub dimensions: Vec<f64>,
    /// Density, kg/m³; needed when the body states no mass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// Of a mesh, its file: STL or OBJ, relative to the folder of the model file. It must be closed
    /// where mass or inertia follow from it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Of a mesh, a factor for the coordinates of the file, or one for each axis: 0.001 for
    /// millimetres.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub scale: Option<Scale>,
    /// Of a mesh, the origin of the file in the body's frame, m; by default such that the mesh has
    /// its centre of mass in the origin of the body where mass or inertia follow from it, else
    /// `[0, 0, 0]`. Of another shape of a `picture` or a `collision`, its centre of mass.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position: Option<[f64; 3]>,
    /// Of a mesh and of the shapes of a `picture` or a `collision`, from their own axes to those of
    /// the body: a unit quaternion `[w, x, y, z]`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub quaternion: Option<[f64; 4]>,
}

impl Shape {
    /// A shape with dimensions, m.
    #[must_use]
    pub fn new(kind: ShapeKind, dimensions: Vec<f64>) -> Self {
        Self { kind, dimensions, ..Self::default() }
    }

    /// The solid of the rigid-body crate; `None` for a mesh. Premise: as many dimensions as the
    /// kind has.
    fn solid(&self) -> Option<vi_rigid::shape::Shape> {
        self.solid_of(|i| self.dimensions.get(i).copied().unwrap_or_default())
    }

    /// The same with other dimensions.
    pub fn solid_of<T>(&self, at: impl Fn(usize) -> T) -> Option<vi_rigid::shape::Shape<T>> {
        use vi_rigid::shape::Shape as Solid;
        Some(match self.kind {
            ShapeKind::Box => Solid::Box { lengths: [at(0), at(1), at(2)] },
            ShapeKind::Cylinder => Solid::Cylinder { radius: at(0), length: at(1) },
            ShapeKind::Sphere => Solid::Sphere { radius: at(0) },
            ShapeKind::Rod => Solid::Cylinder { radius: at(1), length: at(0) },
            ShapeKind::Cone => Solid::Cone { radius: at(0), length: at(1) },
            ShapeKind::Capsule => Solid::Capsule { radius: at(0), length: at(1) },
            ShapeKind::Ellipsoid => Solid::Ellipsoid { half_axes: [at(0), at(1), at(2)] },
            ShapeKind::Mesh => return None,
        })
    }

    /// Volume, m³; zero for a mesh, whose mass a resolved model states.
    #[must_use]
    pub fn volume(&self) -> f64 {
        self.solid().map_or(0.0, |solid| solid.volume())
    }

    /// Principal moments of inertia about the centre of mass per mass, m²; zero for a mesh, and
    /// when the dimensions are not those of a solid.
    #[must_use]
    pub fn inertia_per_mass(&self) -> [f64; 3] {
        let properties = self.solid().and_then(|solid| solid.mass_properties_of(1.0).ok());
        properties.map_or([0.0; 3], |p| p.inertia.moments())
    }
}

/// `inertia`: about the centre of mass, in the body's own frame, kg·m².
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(
    untagged,
    expecting = "inertia is 3 principal moments `[I1, I2, I3]` or a full tensor of 3 rows of 3 numbers"
)]
pub enum Inertia {
    /// Principal moments about the body's axes, kg·m².
    Principal([f64; 3]),
    /// The full symmetric tensor, rows, kg·m².
    Tensor([[f64; 3]; 3]),
}

impl Inertia {
    /// The tensor.
    #[must_use]
    pub fn tensor(&self) -> Matrix3<f64> {
        match self {
            Self::Principal(moments) => Matrix3::from_diagonal(&Vector3::from(*moments)),
            Self::Tensor(rows) => Matrix3::from_fn(|i, j| rows[i][j]),
        }
    }

    /// What is not physical about it, in words.
    #[must_use]
    pub fn fault(&self) -> Option<String> {
        let tensor = self.tensor();
        let size = tensor.amax();
        if (tensor - tensor.transpose()).amax() > 1e-12 * size {
            return Some("the inertia tensor is not symmetric".into());
        }
        let symmetric = (tensor + tensor.transpose()) * 0.5;
        let mut moments = match self {
            Self::Principal(moments) => *moments,
            Self::Tensor(_) => symmetric.symmetric_eigenvalues().into(),
        };
        moments.sort_by(f64::total_cmp);
        let [a, b, c] = moments;
        if a < -1e-12 * size {
            return Some(format!("a principal moment of inertia is negative: {a}"));
        }
        if b <= 0.0 {
            return Some("at least two principal moments of inertia must be positive".into());
        }
        if c > (a + b) * (1.0 + 1e-9) {
            return Some(format!(
                "no body has these moments of inertia: the largest exceeds the sum of the other \
                 two, {c} > {a} + {b}"
            ));
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shape_is_physical_and_the_cone_is_the_heavy_top_of_the_literature() {
        let shape = |kind, dimensions: &[f64]| Shape {
            density: Some(2700.0),
            ..Shape::new(kind, dimensions.to_vec())
        };
        let shapes = [
            shape(ShapeKind::Box, &[0.1, 0.2, 0.3]),
            shape(ShapeKind::Cylinder, &[0.1, 0.5]),
            shape(ShapeKind::Sphere, &[0.1]),
            shape(ShapeKind::Rod, &[1.0, 0.01]),
            shape(ShapeKind::Cone, &[0.05, 0.1]),
            shape(ShapeKind::Capsule, &[0.05, 0.1]),
            shape(ShapeKind::Ellipsoid, &[0.05, 0.1, 0.2]),
        ];
        for shape in &shapes {
            assert_eq!(Inertia::Principal(shape.inertia_per_mass()).fault(), None, "{shape:?}");
            assert!(shape.volume() > 0.0);
        }
        let mass = 2700.0 * shapes[4].volume();
        assert!((mass - 0.706_858_347_057_703_8).abs() < 1e-15, "{mass}");
        let moments = shapes[4].inertia_per_mass().map(|i| i * mass);
        for moment in moments {
            assert!((moment - 5.301_437_602_932_793e-4).abs() < 1e-17, "{moment}");
        }
    }

    #[test]
    fn faults_are_named() {
        let fault = |i: Inertia| i.fault().unwrap_or_default();
        assert!(fault(Inertia::Principal([1.0, 1.0, 3.0])).contains("3 > 1 + 1"));
        assert!(fault(Inertia::Principal([-1.0, 1.0, 1.0])).contains("negative"));
        assert!(fault(Inertia::Principal([0.0, 0.0, 0.0])).contains("two"));
        let tensor = [[1.0, 0.5, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        assert!(fault(Inertia::Tensor(tensor)).contains("symmetric"));
        assert_eq!(Inertia::Principal([1.0, 1.0, 0.0]).fault(), None); // a rod
        assert_eq!(Inertia::Principal([1.0, 1.0, 2.0]).fault(), None); // a lamina
    }
}
