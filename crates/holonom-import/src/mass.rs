//! Mass properties: addition, and rods on an axis that are transferred from one body to another.
//!
//! ```text
//! J = J_1 + J_2 + μ (|d|² I − d dᵀ),  μ = m_1 m_2 / (m_1 + m_2),  d = c_2 − c_1      two bodies as one
//! E = ∫ x xᵀ dm = ½ tr(J) I − J                                      Euler tensor about the centre of mass
//! ```
//! A thin rod along the axis of a hinge, `J = j (I − u uᵀ)` with its centre on the axis, moves the
//! same with either side of the hinge: its inertia about the axis is zero. It may belong to the one
//! body or the other.
#![allow(non_snake_case)] // E, J: the tensors of the formulas above

use nalgebra::{Isometry3, Matrix3, Vector3};

/// Mass, centre of mass and inertia tensor in some frame; massless by default.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct ImportedMass {
    /// Mass, kg.
    pub(crate) mass: f64,
    /// Centre of mass, m.
    pub(crate) center: Vector3<f64>,
    /// Inertia tensor about the centre of mass, kg·m².
    pub(crate) J: Matrix3<f64>,
}

/// Euler moments may be negative by this part of their sum, and are then raised to zero.
pub(crate) const ROUNDED: f64 = 0.01;

/// Euler moments below this part of the largest count as zero where a rod is asked for.
const THIN: f64 = 1e-6;

impl ImportedMass {
    /// A thin rod along the unit vector `u` with the moment `j` about its centre, kg·m².
    pub(crate) fn thin_rod(mass: f64, center: Vector3<f64>, u: &Vector3<f64>, j: f64) -> Self {
        Self { mass, center, J: (Matrix3::identity() - u * u.transpose()) * j }
    }

    /// Inertia tensor about the centre of mass, kg·m², symmetric to the last bit.
    pub(crate) fn inertia(&self) -> Matrix3<f64> {
        (self.J + self.J.transpose()) * 0.5
    }

    /// Principal moments of inertia, kg·m², the least first.
    pub(crate) fn moments(&self) -> [f64; 3] {
        let mut moments: [f64; 3] = self.inertia().symmetric_eigenvalues().into();
        moments.sort_by(f64::total_cmp);
        moments
    }

    /// Euler tensor about the centre of mass, kg·m².
    pub(crate) fn euler(&self) -> Matrix3<f64> {
        Matrix3::identity() * (0.5 * self.J.trace()) - self.inertia()
    }

    /// The same in another frame, in which this frame has the given pose.
    pub(crate) fn moved(&self, pose: &Isometry3<f64>) -> Self {
        let R = pose.rotation.to_rotation_matrix();
        let center = pose.transform_point(&self.center.into()).coords;
        Self { mass: self.mass, center, J: R * self.J * R.transpose() }
    }

    /// Both as one body.
    pub(crate) fn plus(&self, other: &Self) -> Self {
        let mass = self.mass + other.mass;
        if self.mass == 0.0 || mass == 0.0 {
            return Self { J: self.J + other.J, ..*other };
        }
        let d = other.center - self.center;
        let shift = Matrix3::identity() * d.norm_squared() - d * d.transpose();
        let J = self.J + other.J + shift * (self.mass * other.mass / mass);
        Self { mass, center: self.center + d * (other.mass / mass), J }
    }

    /// This body without a part of it.
    pub(crate) fn minus(&self, part: &Self) -> Self {
        self.plus(&part.scaled(-1.0))
    }

    /// Mass and density times a factor.
    pub(crate) fn scaled(&self, factor: f64) -> Self {
        Self { mass: self.mass * factor, center: self.center, J: self.J * factor }
    }

    /// Whether a model file takes it: a mass, and at least two positive moments of inertia.
    pub(crate) fn is_body(&self) -> bool {
        let moments = self.moments();
        self.mass > 0.0 && moments[1] > 1e-12 * moments[2]
    }

    /// The least Euler moment relative to the moments of inertia: negative where no body has these.
    pub(crate) fn least_euler_moment(&self) -> f64 {
        let moments = self.moments();
        let size: f64 = moments.iter().map(|moment| moment.abs()).sum();
        if size == 0.0 { 0.0 } else { (moments[0] + moments[1] - moments[2]) / size }
    }

    /// With the mean of the principal moments in the place of each.
    pub(crate) fn balanced(&self) -> Self {
        Self { J: Matrix3::identity() * (self.J.trace() / 3.0), ..*self }
    }

    /// With negative Euler moments raised to zero.
    pub(crate) fn nearest_body(&self) -> Self {
        let mut eigen = self.euler().symmetric_eigen();
        eigen.eigenvalues.apply(|e| *e = e.max(0.0));
        let E = eigen.recompose();
        Self { J: Matrix3::identity() * E.trace() - E, ..*self }
    }

    /// A rod on the axis through `point` along the unit vector `u`, at most a half of this body in
    /// every respect; `None` where the body is thin.
    ///
    /// `m_max = 1/(1/m + cᵀE⁻¹c)` and `j_max = 1/(uᵀE⁻¹u)` are what can be taken away at most, for
    /// `c` from the centre of mass to the place on the axis where `m_max` is largest; a quarter of
    /// each is taken.
    pub(crate) fn rod(&self, point: &Vector3<f64>, u: &Vector3<f64>) -> Option<Self> {
        let E = self.euler();
        let moments = E.symmetric_eigenvalues();
        if self.mass <= 0.0 || moments.min() <= THIN * moments.max() {
            return None;
        }
        let inverse = E.try_inverse()?;
        let a = point - self.center;
        let stiff = (inverse * u).dot(u);
        let c = a - u * ((inverse * u).dot(&a) / stiff);
        let mass = 0.25 / (1.0 / self.mass + (inverse * c).dot(&c));
        Some(Self::thin_rod(mass, self.center + c, u, 0.25 / stiff))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn block() -> ImportedMass {
        let J = Matrix3::from_diagonal(&Vector3::new(0.3, 0.4, 0.5));
        ImportedMass { mass: 2.0, center: Vector3::new(0.1, -0.2, 0.3), J }
    }

    #[test]
    fn no_body_has_a_negative_moment_of_inertia() {
        for moments in [[0.03, 0.02, -1.0], [-1.0, -1.0, -1.0], [0.1, 0.2, 0.4]] {
            let J = Matrix3::from_diagonal(&Vector3::from(moments));
            let least = ImportedMass { J, ..block() }.least_euler_moment();
            assert!(least < -0.1, "{moments:?}: {least}");
        }
        assert!(block().least_euler_moment() > 0.0);
    }

    #[test]
    fn a_part_that_is_taken_away_and_given_back_changes_nothing() {
        let u = Vector3::new(1.0, 2.0, -0.5).normalize();
        let rod = block().rod(&Vector3::new(0.4, 0.0, 0.2), &u).unwrap();
        let rest = block().minus(&rod);
        let again = rest.plus(&rod);
        let error = (again.J - block().J).amax().max((again.center - block().center).amax());
        assert!(error < 1e-16, "{error:e}");
        assert!(rest.is_body() && rest.least_euler_moment() > 0.0, "{rest:?}");
        assert!(rod.is_body(), "{rod:?}");
    }

    #[test]
    fn a_rod_has_no_inertia_about_its_axis() {
        let u = Vector3::new(1.0, 2.0, -0.5).normalize();
        let rod = block().rod(&Vector3::new(0.4, 0.0, 0.2), &u).unwrap();
        let about = (rod.inertia() * u).norm();
        assert!(about < 1e-17, "{about:e}");
        let offset = (rod.center - Vector3::new(0.4, 0.0, 0.2)).cross(&u).norm();
        assert!(offset < 1e-16, "{offset:e}");
    }

    #[test]
    fn no_rod_is_taken_from_a_lamina() {
        let J = Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, 2.0));
        assert_eq!(
            ImportedMass { mass: 1.0, center: Vector3::zeros(), J }
                .rod(&Vector3::x(), &Vector3::z()),
            None
        );
    }
}
