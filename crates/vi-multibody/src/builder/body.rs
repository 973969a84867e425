//! Rigid bodies of a builder: mass, attitude, initial velocity.

use super::error::finite;
use super::{BodyId, BuildError};
use crate::mechanism::description::BodySpec;
use nalgebra::{Matrix3, Vector3};
use vi_rigid::body::RigidBody;
use vi_rigid::inertia::{InertiaError, PrincipalInertia};
use vi_rigid::rotation;
use vi_rigid::shape::{MassProperties, Shape};

/// Largest `|RᵀR − I|` of an attitude that is taken for rounding of the input.
const ROTATION_TOLERANCE: f64 = 1e-9;

/// Mass and inertia of a body, about its centre of mass and along its axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Inertia {
    /// Mass (kg) and principal inertias about the axes of the body (kg·m²).
    Principal {
        /// kg.
        mass: f64,
        /// `J_1, J_2, J_3`.
        moments: [f64; 3],
    },
    /// Mass (kg) and inertia tensor along the axes of the body (kg·m²); the directors of the frame
    /// are then its principal axes.
    Tensor {
        /// kg.
        mass: f64,
        /// Symmetric.
        tensor: Matrix3<f64>,
    },
    /// A homogeneous shape of a density, kg/m³.
    Density(Shape, f64),
    /// A homogeneous shape of a mass, kg.
    Mass(Shape, f64),
    /// A body whose mass properties are known.
    Given(RigidBody),
    /// No mass of its own: a part that joints hold to the ground.
    Massless,
}

impl Inertia {
    /// Mass (kg) and principal inertias about the axes of the body (kg·m²).
    #[must_use]
    pub fn principal(mass: f64, moments: [f64; 3]) -> Self {
        Self::Principal { mass, moments }
    }

    /// Mass (kg) and inertia tensor along the axes of the body (kg·m²).
    #[must_use]
    pub fn tensor(mass: f64, tensor: impl Into<Matrix3<f64>>) -> Self {
        Self::Tensor { mass, tensor: tensor.into() }
    }

    /// A homogeneous shape of a density, kg/m³.
    #[must_use]
    pub fn shape(shape: Shape, density: f64) -> Self {
        Self::Density(shape, density)
    }

    /// A homogeneous shape of a mass, kg.
    #[must_use]
    pub fn shape_of_mass(shape: Shape, mass: f64) -> Self {
        Self::Mass(shape, mass)
    }

    /// The body, and its principal axes (columns) in the components that were given.
    fn resolve(&self) -> Result<(Option<RigidBody>, Matrix3<f64>), InertiaError> {
        let along_axes = |p: MassProperties| RigidBody::from_inertia(p.mass, &p.inertia);
        let body = match *self {
            Self::Principal { mass, moments } => {
                RigidBody::from_inertia(mass, &PrincipalInertia::new(moments)?)?
            }
            Self::Tensor { mass, tensor } => {
                let axes = PrincipalInertia::from_tensor(&tensor)?;
                return Ok((Some(RigidBody::from_inertia(mass, &axes.inertia)?), axes.triad));
            }
            Self::Density(shape, density) => along_axes(shape.mass_properties(density)?)?,
            Self::Mass(shape, mass) => along_axes(shape.mass_properties_of(mass)?)?,
            Self::Given(body) => body,
            Self::Massless => return Ok((None, Matrix3::identity())),
        };
        Ok((Some(body), Matrix3::identity()))
    }
}

impl From<RigidBody> for Inertia {
    fn from(body: RigidBody) -> Self {
        Self::Given(body)
    }
}

impl From<MassProperties> for Inertia {
    fn from(properties: MassProperties) -> Self {
        Self::principal(properties.mass, properties.inertia.moments())
    }
}

/// A body as it was described.
#[derive(Clone, Debug)]
pub(super) enum BodyPart {
    Described(Box<DescribedBody>),
    Given(BodySpec),
}

#[derive(Clone, Debug)]
pub(super) struct DescribedBody {
    name: String,
    inertia: Inertia,
    center: Vector3<f64>,
    attitude: Matrix3<f64>,
    velocity: Vector3<f64>,
    omega: Vector3<f64>,
}

impl BodyPart {
    pub(super) fn new(name: &str, inertia: Inertia) -> Self {
        Self::Described(Box::new(DescribedBody {
            name: name.to_owned(),
            inertia,
            center: Vector3::zeros(),
            attitude: Matrix3::identity(),
            velocity: Vector3::zeros(),
            omega: Vector3::zeros(),
        }))
    }

    pub(super) fn name(&self) -> &str {
        match self {
            Self::Described(body) => &body.name,
            Self::Given(body) => &body.name,
        }
    }

    /// The body with its directors along principal axes, and these axes in its own components.
    pub(super) fn resolve(&self) -> Result<(BodySpec, Matrix3<f64>), BuildError> {
        match self {
            Self::Described(body) => body.resolve(),
            Self::Given(body) => Ok((body.clone(), Matrix3::identity())),
        }
    }
}

impl DescribedBody {
    fn resolve(&self) -> Result<(BodySpec, Matrix3<f64>), BuildError> {
        let vectors = [
            ("position", &self.center),
            ("velocity", &self.velocity),
            ("angular velocity", &self.omega),
        ];
        for (what, vector) in vectors {
            finite(|| format!("body `{}`", self.name), what, vector.as_slice())?;
        }
        finite(|| format!("body `{}`", self.name), "attitude", self.attitude.as_slice())?;
        let product = self.attitude.transpose() * self.attitude;
        let reflected = self.attitude.determinant() < 0.0;
        let defect = if reflected { 2.0 } else { (product - Matrix3::identity()).amax() };
        if defect > ROTATION_TOLERANCE {
            return Err(BuildError::NotARotation { body: self.name.clone(), defect });
        }
        let refuse = |source| BuildError::Inertia { body: self.name.clone(), source };
        let (body, axes) = self.inertia.resolve().map_err(refuse)?;
        let spec = BodySpec {
            name: self.name.clone(),
            body,
            center: self.center,
            triad: self.attitude * axes,
            velocity: self.velocity,
            omega: self.omega,
        };
        Ok((spec, axes))
    }
}

/// A body that was added; at rest in the origin along the axes of space until said otherwise.
#[derive(Debug)]
pub struct BodyEntry<'a> {
    id: BodyId,
    body: &'a mut DescribedBody,
}

impl<'a> BodyEntry<'a> {
    pub(super) fn new(id: BodyId, part: &'a mut BodyPart) -> Self {
        match part {
            BodyPart::Described(body) => Self { id, body },
            BodyPart::Given(_) => unreachable!("an entry is of a described body"),
        }
    }

    /// Its centre of mass, m.
    pub fn at(self, position: impl Into<Vector3<f64>>) -> Self {
        self.body.center = position.into();
        self
    }

    /// Its attitude: the matrix whose columns are the axes of the body in space.
    pub fn attitude(self, rotation: impl Into<Matrix3<f64>>) -> Self {
        self.body.attitude = rotation.into();
        self
    }

    /// Its attitude: turned about the direction of `rotation` by its length, rad.
    pub fn rotation_vector(self, rotation: impl Into<Vector3<f64>>) -> Self {
        self.body.attitude = rotation::exp(&rotation.into());
        self
    }

    /// The velocity of its centre of mass, m/s.
    pub fn velocity(self, velocity: impl Into<Vector3<f64>>) -> Self {
        self.body.velocity = velocity.into();
        self
    }

    /// Its angular velocity in space, rad/s.
    pub fn angular_velocity(self, omega: impl Into<Vector3<f64>>) -> Self {
        self.body.omega = omega.into();
        self
    }

    /// By which later parts refer to it.
    #[must_use]
    pub fn id(self) -> BodyId {
        self.id
    }
}
