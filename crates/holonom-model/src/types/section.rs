//! `section` of a beam: stiffness and inertia per length, stated or from shape and material.
//!
//! A stated number is used as it is; what is not stated follows from shape and material. Numbers
//! hold about own axes and centres; [`Section::numbers`] brings them to the line of the nodes.

use crate::text::problem::{Problem, fault};
use crate::types::damping::{Damping, matrix, matrix_by};
use crate::types::outline::{Material, NumberAtKey, Outline, OutlineKind};
use nalgebra::Matrix4;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use vi_beam::profile::Stated;
use vi_beam::section::{Section as Section6, SectionError};
use vi_core::Number;

/// How many of the stated numbers are stiffnesses; the others are masses.
const OF_STIFFNESS: usize = 6;

/// `section`: of a beam. `d_1` and `d_2` lie in the section, `d_3` is normal to it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Section {
    /// Its shape; with `material` gives all that is not stated, and the picture.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shape: Option<Outline>,
    /// Its material.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<Material>,
    /// Shear factors `[k_1, k_2]` of the shape: `GA1 = k_1 G A`; Cowper's by default, of thin walls
    /// those of the energy of their shear flow.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_factors: Option<[f64; 2]>,
    /// Torsion constant of the shape, m⁴: `GJ = G J_t`; Saint-Venant's by default, of
    /// thin walls that of their middle lines.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub torsion_constant: Option<f64>,
    /// Extensional stiffness, N.
    #[serde(default, rename = "EA", skip_serializing_if = "Option::is_none")]
    pub ea: Option<f64>,
    /// Shear stiffness along `d_1`, N. A section without `GA1` and `GA2`, and without a shape, does
    /// not shear (Euler and Bernoulli).
    #[serde(default, rename = "GA1", skip_serializing_if = "Option::is_none")]
    pub ga1: Option<f64>,
    /// Shear stiffness along `d_2`, N.
    #[serde(default, rename = "GA2", skip_serializing_if = "Option::is_none")]
    pub ga2: Option<f64>,
    /// Bending stiffness about `d_1`, N·m².
    #[serde(default, rename = "EI1", skip_serializing_if = "Option::is_none")]
    pub ei1: Option<f64>,
    /// Bending stiffness about `d_2`, N·m².
    #[serde(default, rename = "EI2", skip_serializing_if = "Option::is_none")]
    pub ei2: Option<f64>,
    /// Torsional stiffness, N·m².
    #[serde(default, rename = "GJ", skip_serializing_if = "Option::is_none")]
    pub gj: Option<f64>,
    /// Mass per length, kg/m.
    #[serde(default, rename = "rhoA", skip_serializing_if = "Option::is_none")]
    pub rho_a: Option<f64>,
    /// Moment of inertia per length about `d_1`, kg·m.
    #[serde(default, rename = "rhoI1", skip_serializing_if = "Option::is_none")]
    pub rho_i1: Option<f64>,
    /// Moment of inertia per length about `d_2`, kg·m.
    #[serde(default, rename = "rhoI2", skip_serializing_if = "Option::is_none")]
    pub rho_i2: Option<f64>,
    /// Moment of inertia per length about `d_3`, kg·m; `rhoI1 + rhoI2` by default, as of a plane
    /// section.
    #[serde(default, rename = "rhoJ", skip_serializing_if = "Option::is_none")]
    pub rho_j: Option<f64>,
    /// The whole stiffness, 6 lists of 6 numbers: between shears along `d_1` and `d_2`, extension,
    /// curvatures about `d_1` and `d_2`, twist, about the line of the nodes; N, N·m, N·m². In the
    /// place of `EA`, `GA1`, `GA2`, `EI1`, `EI2`, `GJ`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<[[f64; 6]; 6]>,
    /// The whole mass per length, 6 lists of 6 numbers: between velocities along and angular
    /// velocities about `d_1`, `d_2`, `d_3`, about the line of the nodes; kg/m, kg, kg·m. In the
    /// place of `rhoA`, `rhoI1`, `rhoI2`, `rhoJ`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<[[f64; 6]; 6]>,
    /// Where tension bends nothing, along `d_1` and `d_2` from the line of the nodes, m: `EI1` and
    /// `EI2` hold there; `[0, 0]` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tension_center: Option<[f64; 2]>,
    /// Where shear forces twist nothing, m: `GA1`, `GA2` and `GJ` hold there; that of the shape
    /// beside its `tension_center` by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear_center: Option<[f64; 2]>,
    /// The centre of mass, m: `rhoI1`, `rhoI2` and `rhoJ` hold there; the tension centre by
    /// default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_center: Option<[f64; 2]>,
    /// Angle about `d_3` from `d_1` to the axis in whose place shape, stiffnesses, masses and
    /// matrices have theirs, rad; centres are along `d_1` and `d_2`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub angle: Option<f64>,
    /// Material damping: a relaxation time `τ` (s), one for each strain, a loss factor at a
    /// frequency, or a matrix; none by default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub damping: Option<Damping>,
}

/// The ten numbers that hold about own axes and centres, and the shear centre.
struct Resolved<T> {
    ten: [Option<T>; 10], // EA, GA1, GA2, EI1, EI2, GJ, rhoA, rhoI1, rhoI2, rhoJ
    shear: Option<[T; 2]>,
}

/// Two numbers.
fn pair<T: Number>(key: &str, own: Option<[f64; 2]>, number: NumberAtKey<'_, T>) -> Option<[T; 2]> {
    own.map(|own| [0, 1].map(|i| number(&format!("{key}.{i}"), own[i])))
}

impl Section {
    /// What it states, and what `base` states otherwise.
    pub(crate) fn over(&self, base: &Self) -> Self {
        let mut own = self.clone();
        macro_rules! or {
            ($($key:ident),*) => { $(if own.$key.is_none() { own.$key = base.$key.clone(); })* };
        }
        or!(shape, material, shear_factors, torsion_constant, ea, ga1, ga2, ei1, ei2, gj);
        or!(rho_a, rho_i1, rho_i2, rho_j, stiffness, mass, tension_center, shear_center);
        or!(mass_center, angle, damping);
        own
    }

    /// Whether a strain has a relaxation time.
    #[must_use]
    pub fn is_damped(&self) -> bool {
        self.damping.as_ref().is_some_and(Damping::is_any)
    }

    /// The ten stated numbers with their keys.
    fn stated(&self) -> [(&'static str, Option<f64>); 10] {
        [
            ("EA", self.ea),
            ("GA1", self.ga1),
            ("GA2", self.ga2),
            ("EI1", self.ei1),
            ("EI2", self.ei2),
            ("GJ", self.gj),
            ("rhoA", self.rho_a),
            ("rhoI1", self.rho_i1),
            ("rhoI2", self.rho_i2),
            ("rhoJ", self.rho_j),
        ]
    }

    /// What shape and material give for the ten numbers, and the shear centre.
    fn computed<T: Number>(
        &self,
        number: NumberAtKey<'_, T>,
    ) -> Result<([Option<T>; 10], [T; 2]), Problem> {
        if let Some(fault) = self.shape.as_ref().and_then(Outline::fault) {
            return Err(fault);
        }
        let solid = self.material.as_ref().map(|own| own.solid(number)).transpose()?;
        let (Some(shape), Some(solid)) = (&self.shape, solid) else {
            return Ok(([None; 10], [T::of(0.0); 2]));
        };
        let stated = Stated {
            shear_factors: pair("shear_factors", self.shear_factors, number),
            torsion_constant: self.torsion_constant.map(|own| number("torsion_constant", own)),
        };
        let refuse = |error: SectionError| {
            fault("", error.to_string(), "correct the shape or what is stated with it")
        };
        let profile = shape.profile(number);
        let numbers = profile.about_centers(&solid, &stated).map_err(refuse)?;
        let [ga1, ga2, ea, ei1, ei2, gj] = numbers.stiffness();
        let [rho_a, euler1, euler2, euler3] = numbers.inertia();
        let moments = [euler2 + euler3, euler3 + euler1, euler1 + euler2];
        let [rho_i1, rho_i2, rho_j] = moments;
        let all = [ea, ga1, ga2, ei1, ei2, gj, rho_a, rho_i1, rho_i2, rho_j];
        Ok((all.map(Some), profile.shear_center()))
    }

    /// This section with all numbers that its matrices do not hold.
    pub(crate) fn resolved(&self) -> Result<Self, Problem> {
        let Resolved { ten: [ea, ga1, ga2, ei1, ei2, gj, rho_a, rho_i1, rho_i2, rho_j], shear } =
            self.resolved_by(&|_, value| value)?;
        let mut own = self.clone();
        (own.ea, own.ga1, own.ga2, own.ei1, own.ei2, own.gj) = (ea, ga1, ga2, ei1, ei2, gj);
        (own.rho_a, own.rho_i1, own.rho_i2, own.rho_j) = (rho_a, rho_i1, rho_i2, rho_j);
        own.shear_center = shear;
        Ok(own)
    }

    fn resolved_by<T: Number>(&self, number: NumberAtKey<'_, T>) -> Result<Resolved<T>, Problem> {
        if let Some(problem) = self.stated_twice() {
            return Err(problem);
        }
        let mut ten = self.stated().map(|(key, own)| own.map(|value| number(key, value)));
        let mut shear = pair("shear_center", self.shear_center, number);
        let (computed, beside) = self.computed(number)?;
        let (of_stiffness, of_mass) = (self.stiffness.is_none(), self.mass.is_none());
        let open = |k: usize| if k < OF_STIFFNESS { of_stiffness } else { of_mass };
        for (k, (stated, computed)) in ten.iter_mut().zip(computed).enumerate() {
            if open(k) {
                *stated = stated.or(computed);
            }
        }
        if of_stiffness && shear.is_none() && beside.iter().any(|x| !x.vanishes()) {
            let none = [T::of(0.0); 2];
            let [x, y] = pair("tension_center", self.tension_center, number).unwrap_or(none);
            let angle = self.angle.map(|own| number("angle", own).sine_cosine());
            let [s, c] = angle.unwrap_or([T::of(0.0), T::of(1.0)]);
            let [a, b] = beside;
            shear = Some([x + c * a - s * b, y + s * a + c * b]);
        }
        let [.., rho_i1, rho_i2, rho_j] = &mut ten;
        if of_mass && rho_j.is_none() {
            *rho_j = rho_i1.zip(*rho_i2).map(|(a, b)| a + b);
        }
        let no_shear = self.shape.is_none() && self.ga1.is_none() && self.ga2.is_none();
        let may_lack = |k: usize, key: &str| !open(k) || no_shear && key.starts_with("GA");
        let named = self.stated().into_iter().zip(&ten).enumerate();
        let missing = named.filter(|(k, ((key, _), own))| own.is_none() && !may_lack(*k, key));
        let missing: Vec<&str> = missing.map(|(_, ((key, _), _))| key).collect();
        if missing.is_empty() {
            return Ok(Resolved { ten, shear });
        }
        let help = match (&self.shape, &self.material) {
            (None, Some(_)) => "add a `shape`, or state the numbers",
            (Some(_), None) => "add a `material`, or state the numbers",
            _ => "state them, or give the section a `shape` and a `material`",
        };
        let bends = missing.iter().any(|key| ["EI1", "EI2", "GJ"].contains(key));
        let of_rope = self.ea.filter(|_| bends).map_or_else(String::new, |ea| {
            format!(
                "; of a rope that hardly bends EI1, EI2 and GJ are small and never 0: write 1e-6 EA ℓ² = {:e} ℓ² N m² for \
                 each, ℓ the length of an element, m",
                1e-6 * ea
            )
        });
        let message = format!("the section lacks {}", missing.join(", "));
        Err(fault("", message, help.to_owned() + &of_rope))
    }

    /// Stiffness and inertia as the elements use them.
    ///
    /// # Errors
    /// [`Problem`] with its key below that of the section.
    pub fn numbers(&self) -> Result<Section6, Problem> {
        self.numbers_by(&|_, value| value)
    }

    /// The same from its numbers by their key paths below that of the section: themselves, or with
    /// their derivatives by a parameter.
    ///
    /// # Errors
    /// As of [`Section::numbers`].
    pub fn numbers_by<T: Number>(
        &self,
        number: NumberAtKey<'_, T>,
    ) -> Result<Section6<T>, Problem> {
        let resolved = self.resolved_by(number)?;
        for ((key, _), value) in self.stated().into_iter().zip(resolved.ten) {
            if let Some(value) = value.map(Number::real).filter(|value| *value <= 0.0) {
                let message = format!("{key} = {value} is not positive");
                return Err(fault(key, message, "write a positive number"));
            }
        }
        let refuse =
            |key: &str, error: SectionError, help: &str| fault(key, error.to_string(), help);
        let mass = self.own_mass(&resolved, number)?;
        let numbers = match &self.stiffness {
            Some(rows) => {
                let (stiffness, one) = (matrix_by(rows, "stiffness", number), T::of(1.0));
                let own = Section6::general(stiffness, Matrix4::from_diagonal_element(one));
                own.map_err(|error| {
                    let help = "write a symmetric, positive definite matrix in the order shear along \
                                d_1, shear along d_2, extension, bending about d_1, bending about d_2, twist";
                    refuse("stiffness", error, help)
                })?
            }
            None => {
                let [ea, ga1, ga2, ei1, ei2, gj, ..] = resolved.ten;
                let of = |value: Option<T>| value.unwrap_or_else(|| T::of(0.0));
                let rest = [of(ea), of(ei1), of(ei2), of(gj)];
                let ([ea, ei1, ei2, gj], one) = (rest, [T::of(1.0); 4]);
                match (ga1, ga2) {
                    (Some(ga1), Some(ga2)) => Section6::new([ga1, ga2, ea, ei1, ei2, gj], one),
                    _ => Section6::rigid_in_shear(rest, one),
                }
                .map_err(|error| refuse("", error, "correct the numbers of the section"))?
            }
        };
        let numbers = numbers.with_mass(mass).map_err(|error| {
            let help =
                "write the mass and the inertias of one distribution, about the line of the nodes";
            refuse(if self.mass.is_some() { "mass" } else { "" }, error, help)
        })?;
        let damped = self.damping.as_ref().map(|damping| damping.of(numbers, number));
        Ok(self.placed(damped.unwrap_or(Ok(numbers))?, &resolved, number))
    }

    /// `m` about its own axes.
    fn own_mass<T: Number>(
        &self,
        resolved: &Resolved<T>,
        number: NumberAtKey<'_, T>,
    ) -> Result<Matrix4<T>, Problem> {
        let refuse =
            |key: &str, error: SectionError, help: &str| fault(key, error.to_string(), help);
        if let Some(rows) = &self.mass {
            let mass = Section6::mass_of_velocities(&matrix_by(rows, "mass", number));
            let (mass, _) = mass.map_err(|error| {
                let help = "write m on the diagonal of velocities, the moments of the centre of mass between \
                            velocities and angular velocities, and the inertias about the line of the nodes";
                refuse("mass", error, help)
            })?;
            return Ok(mass);
        }
        let [.., rho_a, rho_i1, rho_i2, rho_j] =
            resolved.ten.map(|own| own.unwrap_or_else(|| T::of(0.0)));
        let [e1, e2, e3] = Section6::euler_moments([rho_i1, rho_i2, rho_j]).map_err(|error| {
            refuse("rhoJ", error, "each of rhoI1, rhoI2, rhoJ is at most the sum of the others")
        })?;
        Ok(Matrix4::from_diagonal(&[rho_a, e1, e2, e3].into()))
    }

    /// What is stated about own axes and centres, in the axes of the nodes.
    fn placed<T: Number>(
        &self,
        own: Section6<T>,
        resolved: &Resolved<T>,
        number: NumberAtKey<'_, T>,
    ) -> Section6<T> {
        let mut numbers = own;
        let moves = |own: &[T]| own.iter().any(|x| !x.vanishes());
        if let Some(angle) = self.angle.map(|own| number("angle", own)).filter(|own| moves(&[*own]))
        {
            numbers = numbers.turned(angle);
        }
        let tension = pair("tension_center", self.tension_center, number);
        let tension = tension.unwrap_or([T::of(0.0); 2]);
        let shear = resolved.shear.unwrap_or(tension);
        let mass = pair("mass_center", self.mass_center, number).unwrap_or(tension);
        if self.stiffness.is_none() && (moves(&tension) || moves(&shear)) {
            numbers = numbers.with_centers(tension, shear);
        }
        if self.mass.is_none() && moves(&mass) {
            numbers = numbers.with_mass_center(mass);
        }
        numbers
    }

    /// Whether it says more than a diagonal: centres, own axes, matrices, no shear.
    #[must_use]
    pub fn is_general(&self) -> bool {
        let centers = [self.tension_center, self.shear_center, self.mass_center];
        let no_shear = self.shape.is_none() && self.ga1.is_none() && self.ga2.is_none();
        self.stiffness.is_some()
            || self.mass.is_some()
            || self.angle.is_some()
            || centers.iter().any(Option::is_some)
            || no_shear
            || self.shape.as_ref().is_some_and(|shape| shape.kind == OutlineKind::Channel)
    }

    /// By which part the inertia about `d_3` of a stated mass misses that of a plane section, where
    /// that is not for rounding.
    #[must_use]
    pub fn misses_plane(&self) -> Option<f64> {
        let (_, miss) = Section6::mass_of_velocities(&matrix(self.mass.as_ref()?)).ok()?;
        (miss > 0.01).then_some(miss)
    }

    /// What a stated matrix holds already.
    fn stated_twice(&self) -> Option<Problem> {
        let named = |key: &'static str, stated: bool| stated.then_some(key);
        let of_stiffness = [
            named("EA", self.ea.is_some()),
            named("GA1", self.ga1.is_some()),
            named("GA2", self.ga2.is_some()),
            named("EI1", self.ei1.is_some()),
            named("EI2", self.ei2.is_some()),
            named("GJ", self.gj.is_some()),
            named("tension_center", self.tension_center.is_some()),
            named("shear_center", self.shear_center.is_some()),
        ];
        let of_mass = [
            named("rhoA", self.rho_a.is_some()),
            named("rhoI1", self.rho_i1.is_some()),
            named("rhoI2", self.rho_i2.is_some()),
            named("rhoJ", self.rho_j.is_some()),
            named("mass_center", self.mass_center.is_some()),
        ];
        let find = |matrix: &str, stated: bool, keys: &[Option<&'static str>]| {
            let key = keys.iter().flatten().next().filter(|_| stated)?;
            let message = format!("`{key}` is stated twice: the matrix `{matrix}` holds it");
            Some(fault(key, message, format!("remove `{key}`, or the matrix")))
        };
        find("stiffness", self.stiffness.is_some(), &of_stiffness)
            .or_else(|| find("mass", self.mass.is_some(), &of_mass))
    }
}
