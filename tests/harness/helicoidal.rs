//! Cases of helicoidal beam elements: one element, equilibria, modes, motions.
#![allow(non_snake_case)] // letters of the element

use super::case::{Deviation, Runs, Tolerance, raise};
use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, Matrix6, Vector3, Vector6};
use serde::Deserialize;
use std::sync::Arc;
use vi_beam::averaged::AveragedStrains;
use vi_beam::element::{ElementKind, StrainLaw};
use vi_beam::helicoidal::{Forms, Helicoidal, forms};
use vi_beam::strain::{ElementCoordinates, Strain};
use vi_beam::{BeamMesh, BeamModel, Elements, MassKind, Section};
use vi_constraints::{InitialValues, Options, SchemeKind};
use vi_core::linear::norm_inf;
use vi_core::potential::Potential;
use vi_core::{Quadrature, SparseMatrix};
use vi_emscheme::beam::BeamGradient;
use vi_emscheme::{EmForm, EmOptions, EmSystem};
use vi_multibody::mechanism::Mechanism;
use vi_multibody::pair::PairKind;
use vi_multibody::run::{Solver, integrator};
use vi_rigid::load::{Load, LoadKind};
use vi_rigid::time_history::TimeHistory;

/// A case; fields that are not read say where it comes from.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HelicoidalCase {
    name: String,
    kind: String,
    description: String,
    strain_rule: String,
    mass: String,
    nodes: Vec<[f64; 12]>,
    elements: Vec<ElementCase>,
    fixed_unknowns: Vec<usize>,
    gravity: [f64; 3],
    tolerance: f64,
    // one element
    reduced_stiffness: Option<Vec<Vec<f64>>>,
    weights: Option<[f64; 6]>,
    #[serde(default)]
    states: Vec<StateCase>,
    discrete_derivative: Option<Vec<Vec<f64>>>,
    mass_matrix: Option<Vec<Vec<f64>>>,
    // equilibria and modes
    load: Option<LoadCase>,
    iterations_of_oracle: Option<usize>,
    q: Option<Vec<Vec<f64>>>,
    strain: Option<Vec<[f64; 6]>>,
    strain_energy: Option<f64>,
    omega2: Option<Vec<f64>>,
    unstable: Option<usize>,
    // motions
    scheme: Option<String>,
    mu: Option<Vec<f64>>,
    tension_mass: Option<Vec<f64>>,
    kappa: Option<f64>,
    h: Option<f64>,
    steps: Option<u64>,
    #[serde(default)]
    loads: Vec<LoadCase>,
    iterations_per_step: Option<f64>,
    #[serde(default)]
    outputs: Vec<OutputCase>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ElementCase {
    nodes: [usize; 2],
    length: f64,
    stiffness: Vec<Vec<f64>>,
    mass_per_length: MassCase,
    reference: [f64; 6],
}

#[derive(Debug, Deserialize)]
#[serde(untagged)]
enum MassCase {
    Diagonal([f64; 4]),
    Full([[f64; 4]; 4]),
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct StateCase {
    q: [Vec<f64>; 2],
    forms: [f64; 7],
    helicoidal: [f64; 6],
    strain: [f64; 6],
    energy: f64,
    gradient: Vec<f64>,
    hessian_of_weighted_strains: Vec<Vec<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct OutputCase {
    step: u64,
    t: f64,
    q: Vec<Vec<f64>>,
    #[serde(rename = "E_d")]
    e_d: Option<f64>,
    linear_momentum: [f64; 3],
    angular_momentum: [f64; 3],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LoadCase {
    node: usize,
    force: [f64; 3],
    torque: [f64; 3],
    history: Option<String>,
}

fn matrix(rows: &[Vec<f64>]) -> DMatrix<f64> {
    DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

/// The largest difference over the largest expected entry; NaN where a number is.
fn relative(found: &DMatrix<f64>, expected: &DMatrix<f64>) -> f64 {
    if found.shape() != expected.shape() {
        return f64::NAN;
    }
    norm_inf((found - expected).as_slice()) / norm_inf(expected.as_slice())
}

/// `P`, the velocity map of all nodes: `u_φ` and the spatial `θ` of each.
fn node_map(q: &[f64]) -> DMatrix<f64> {
    let count = q.len() / 12;
    let mut P = DMatrix::zeros(12 * count, 6 * count);
    for node in 0..count {
        (0..3).for_each(|k| P[(12 * node + k, 6 * node + k)] = 1.0);
        for first in [3, 6, 9].map(|k| 12 * node + k) {
            let d = Vector3::from_column_slice(&q[first..first + 3]);
            P.view_mut((first, 6 * node + 3), (3, 3)).copy_from(&-d.cross_matrix());
        }
    }
    P
}

/// What `exp(θ)` adds to the second derivative by the rotation vectors of nodes, where the slope by
/// the coordinates is `slope`.
fn add_curvature(q: &[f64], slope: &[f64], K: &mut DMatrix<f64>) {
    for node in 0..q.len() / 12 {
        let mut own = K.view_mut((6 * node + 3, 6 * node + 3), (3, 3));
        for first in [3, 6, 9].map(|k| 12 * node + k) {
            let [d, g] = [q, slope].map(|x| Vector3::from_column_slice(&x[first..first + 3]));
            let both = d * g.transpose();
            own += 0.5 * (both + both.transpose()) - Matrix3::identity() * d.dot(&g);
        }
    }
}

/// Slope and second derivative of the energy in `u_φ` and the rotation vectors of the nodes.
fn derivatives(elements: &Elements, q: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
    let (n, P) = (q.len(), node_map(q));
    let (mut slope, mut K) = (vec![0.0; n], DMatrix::zeros(n, n));
    elements.add_gradient(q, 1.0, &mut slope);
    elements.add_hessian(q, 1.0, &mut K);
    let mut K = P.tr_mul(&(K * &P));
    add_curvature(q, &slope, &mut K);
    (P.tr_mul(&DVector::from_vec(slope)), K)
}

impl HelicoidalCase {
    pub fn run(&self) -> Result<Runs, String> {
        let (name, off) = match (self.kind.as_str(), self.scheme.as_deref()) {
            ("element", _) => ("element", self.element()?),
            ("static", _) => ("static", self.equilibrium()?),
            ("modes", _) => ("modes", self.modes()?),
            ("dynamic", Some("averaged")) => ("nodal", self.averaged()?),
            ("dynamic", Some("em")) => ("em-nodal", self.energy_momentum()?),
            (kind, scheme) => return Err(format!("unknown kind `{kind}`, scheme {scheme:?}")),
        };
        Ok(vec![(name, off)])
    }

    fn tolerance(&self) -> Tolerance {
        let all = self.tolerance;
        Tolerance { q: all, p: all, constraint_force: all, energy: all, momentum: all }
    }

    fn elements(&self) -> Result<Elements, String> {
        let (mut elements, q0) = (Elements::new(), self.nodes.concat());
        let kind = match self.strain_rule.as_str() {
            "helicoidal, order 2" => ElementKind::SecondOrder,
            "helicoidal, order 4" => ElementKind::Helicoidal,
            other => return Err(format!("unknown strains `{other}`")),
        };
        let mass = match self.mass.as_str() {
            "bubble" => MassKind::Quadratic,
            "consistent" => MassKind::Consistent,
            other => return Err(format!("unknown mass `{other}`")),
        };
        for own in &self.elements {
            let C = Matrix6::from_fn(|i, j| own.stiffness[i][j]);
            let m = match &own.mass_per_length {
                MassCase::Diagonal(m) => Matrix4::from_diagonal(&(*m).into()),
                MassCase::Full(m) => Matrix4::from_fn(|i, j| m[i][j]),
            };
            let section = Section::general(C, m).map_err(|e| e.to_string())?;
            let section = elements.add_section(section);
            let k = elements.add_stress_free(own.nodes, own.length, section, &q0);
            let k = k.map_err(|e| e.to_string())?;
            elements.set_strains(k..k + 1, kind, &q0).map_err(|e| e.to_string())?;
            elements.set_mass(k..k + 1, mass);
            let off = (elements.list()[k].reference - Vector6::from(own.reference)).amax();
            if off.is_nan() || off > 1e-12 {
                return Err(format!("reference strain of element {k} off by {off:e}"));
            }
        }
        Ok(elements)
    }

    fn free(&self) -> Vec<usize> {
        (0..6 * self.nodes.len()).filter(|k| !self.fixed_unknowns.contains(k)).collect()
    }

    /// Forms, strains, energy and derivatives of one element; its mass.
    fn element(&self) -> Result<Deviation, String> {
        let missing = |what: &str| format!("{what} is missing");
        let elements = self.elements()?;
        let element = &elements.list()[0];
        let StrainLaw::Helicoidal(law) = &element.law else { return Err(missing("a helix")) };
        let law: &Arc<Helicoidal> = law;
        let reference = element.reference;
        let copy = |m: &[f64], rows, columns| DMatrix::from_column_slice(rows, columns, m);
        let C_r = law.stiffness();
        let expected = self.reduced_stiffness.as_ref().ok_or_else(|| missing("C_r"))?;
        let mut worst = relative(&copy(C_r.as_slice(), 6, 6), &matrix(expected));
        let mut M = DMatrix::zeros(24, 24);
        elements.emit_mass(&mut M);
        let M = DMatrix::from_fn(8, 8, |i, j| M[(3 * i, 3 * j)]);
        let expected = self.mass_matrix.as_ref().ok_or_else(|| missing("mass_matrix"))?;
        raise(&mut worst, relative(&M, &matrix(expected)));
        let n = Strain::from(self.weights.ok_or_else(|| missing("weights"))?);
        let mut all: Vec<Forms> = Vec::new();
        for state in &self.states {
            let x = ElementCoordinates::from_iterator(state.q.iter().flatten().copied());
            let y = forms(&x, element.length);
            let eta = element.strain(&x);
            for (found, expected) in [
                (y.as_slice(), &state.forms[..]),
                (law.helix(&y).as_slice(), &state.helicoidal[..]),
                (eta.as_slice(), &state.strain[..]),
            ] {
                let n = expected.len();
                raise(&mut worst, relative(&copy(found, n, 1), &copy(expected, n, 1)));
            }
            let energy = 0.5 * element.length * eta.dot(&(C_r * eta));
            raise(&mut worst, (energy / state.energy - 1.0).abs());
            let P = node_map(x.as_slice());
            let at = element.at(x);
            let gradient = at.force(&(element.length * C_r * eta));
            let gradient = P.tr_mul(&copy(gradient.as_slice(), 24, 1));
            raise(&mut worst, relative(&gradient, &copy(&state.gradient, 12, 1)));
            let H = at.tangent(&Matrix6::zeros(), &n);
            let mut H = P.tr_mul(&(copy(H.as_slice(), 24, 24) * &P));
            add_curvature(x.as_slice(), at.force(&n).as_slice(), &mut H);
            let expected = matrix(&state.hessian_of_weighted_strains);
            raise(&mut worst, relative(&H, &expected));
            all.push(y);
        }
        let [from, to] = &all[..] else { return Err(missing("one of two states")) };
        let between = law.discrete_slopes([from, to], &reference);
        let expected = self.discrete_derivative.as_ref();
        let expected = matrix(expected.ok_or_else(|| missing("discrete_derivative"))?);
        raise(&mut worst, relative(&copy(between.as_slice(), 6, 7), &expected));
        Ok(Deviation { q: worst / self.tolerance, ..Deviation::default() })
    }

    /// A step of Newton's method from the equilibrium; its strains and energy.
    fn equilibrium(&self) -> Result<Deviation, String> {
        let missing = |what: &str| format!("{what} is missing");
        let elements = self.elements()?;
        let q = self.q.as_ref().ok_or_else(|| missing("q"))?.concat();
        let (mut r, K) = derivatives(&elements, &q);
        let load = self.load.as_ref().ok_or_else(|| missing("load"))?;
        for k in 0..3 {
            r[6 * load.node + k] -= load.force[k];
            r[6 * load.node + 3 + k] -= load.torque[k];
        }
        let free = self.free();
        let (r, K) = (r.select_rows(&free), K.select_rows(&free).select_columns(&free));
        let scale: Vec<f64> = K.diagonal().iter().map(|k| k.abs().sqrt().recip()).collect();
        let scale = DMatrix::from_diagonal(&scale.into());
        let step = (&scale * &K * &scale).lu().solve(&(&scale * r));
        let step = &scale * step.ok_or("the stiffness is singular")?;
        let (mut deviation, tolerance) = (Deviation::default(), self.tolerance());
        deviation.q(step.as_slice(), &vec![0.0; step.len()], &tolerance);
        let strains = self.strain.as_ref().ok_or_else(|| missing("strain"))?;
        for (element, expected) in elements.list().iter().zip(strains) {
            let found = element.strain(&element.coordinates(&q));
            deviation.q(found.as_slice(), expected, &tolerance);
        }
        let expected = self.strain_energy.ok_or_else(|| missing("strain_energy"))?;
        deviation.energy(elements.value(&q) / expected, 1.0, &tolerance);
        Ok(deviation)
    }

    /// The lowest eigenvalues of `(K_m + K_g) v = ω² M v`, and how many are negative.
    fn modes(&self) -> Result<Deviation, String> {
        let missing = |what: &str| format!("{what} is missing");
        let (elements, free) = (self.elements()?, self.free());
        let q = self.q.as_ref().ok_or_else(|| missing("q"))?.concat();
        let (_, K) = derivatives(&elements, &q);
        let (n, P) = (q.len(), node_map(&q));
        let mut M = DMatrix::zeros(n, n);
        elements.emit_mass(&mut M);
        let M = P.tr_mul(&(M * &P)).select_rows(&free).select_columns(&free);
        let K = K.select_rows(&free).select_columns(&free);
        let L = M.cholesky().ok_or("the mass is singular")?.l();
        let half = L.solve_lower_triangular(&K).ok_or("the mass is singular")?.transpose();
        let standard = L.solve_lower_triangular(&half).ok_or("the mass is singular")?;
        let mut omega2: Vec<f64> = standard.symmetric_eigenvalues().iter().copied().collect();
        omega2.sort_by(f64::total_cmp);
        let expected = self.omega2.as_ref().ok_or_else(|| missing("omega2"))?;
        let column = |x: &[f64]| DMatrix::from_column_slice(expected.len(), 1, x);
        let off = relative(&column(&omega2[..expected.len()]), &column(expected));
        let unstable = omega2.iter().filter(|omega2| **omega2 < 0.0).count();
        let same = if Some(unstable) == self.unstable { 0.0 } else { f64::NAN };
        Ok(Deviation { q: off / self.tolerance, energy: same, ..Deviation::default() })
    }

    /// Nodes, joints and gravity as a mechanism: nodes that are held are clamped or pinned.
    fn mechanism(&self) -> Result<Mechanism, String> {
        let mut model = BeamModel::new(self.gravity.into());
        for (k, node) in self.nodes.iter().enumerate() {
            let triad = Matrix3::from_column_slice(&node[3..]);
            let center = Vector3::from_column_slice(&node[..3]);
            let mesh = BeamMesh { centers: vec![center], triads: vec![triad], lengths: Vec::new() };
            model.add_frame(mesh.nodes(&format!("node {k}")).remove(0));
        }
        for (k, node) in self.nodes.iter().enumerate() {
            let own = 6 * k..6 * k + 6;
            let held: Vec<usize> =
                self.fixed_unknowns.iter().filter(|i| own.contains(i)).map(|i| i - 6 * k).collect();
            match held[..] {
                [] => {}
                [0, 1, 2] => {
                    let at = Vector3::from_column_slice(&node[..3]);
                    model.join(PairKind::Spherical, None, k, &at, &Vector3::z());
                }
                [0, 1, 2, 3, 4, 5] => _ = model.clamp(k),
                _ => return Err(format!("node {k} is held in {held:?}, as no joint does")),
            }
        }
        Ok(model.mechanism())
    }

    fn mass(&self, mechanism: &Mechanism, elements: &Elements) -> SparseMatrix {
        mechanism.mass(|out| elements.emit_mass(out))
    }

    fn loads(&self) -> Result<Vec<Load>, String> {
        let load = |own: &LoadCase| {
            let history = match own.history.as_deref() {
                Some("triangle 0 - 1 - 0 at t = 0, 0.5, 1") => {
                    TimeHistory::Triangle { start: 0.0, peak: 0.5, end: 1.0, amplitude: 1.0 }
                }
                other => return Err(format!("unknown history {other:?}")),
            };
            let (force, torque) = (own.force.into(), own.torque.into());
            Load::new(12 * own.node, LoadKind::Dead, force, torque, history)
                .map_err(|e| e.to_string())
        };
        self.loads.iter().map(load).collect()
    }

    /// Coordinates and, of a free beam, momenta (what holds a node changes them) at the outputs.
    fn compare(
        &self,
        mechanism: &Mechanism,
        mut step: impl FnMut() -> Result<(Vec<f64>, Vec<f64>), String>,
    ) -> Result<Deviation, String> {
        let (mut deviation, tolerance) = (Deviation::default(), self.tolerance());
        for n in 1..=self.steps.ok_or("steps is missing")? {
            let (q, p) = step()?;
            let Some(expected) = self.outputs.iter().find(|output| output.step == n) else {
                continue;
            };
            deviation.q(&q, &expected.q.concat(), &tolerance);
            if self.fixed_unknowns.is_empty() {
                let momentum = mechanism.momentum(&q, &p);
                deviation.momentum(&momentum.linear, &expected.linear_momentum, &tolerance);
                deviation.momentum(&momentum.angular, &expected.angular_momentum, &tolerance);
            }
        }
        Ok(deviation)
    }

    fn averaged(&self) -> Result<Deviation, String> {
        let h = self.h.ok_or("h is missing")?;
        let (elements, mechanism) = (self.elements()?, self.mechanism()?);
        let mass = self.mass(&mechanism, &elements);
        let mu = self.mu.as_ref().ok_or("mu is missing")?;
        let most = norm_inf(mu);
        let slowness = mu.iter().map(|mu| (most - mu) * h * h).collect(); // μ = most − slowness/h²
        let mut strains = AveragedStrains::mass_scaled(elements, most, slowness);
        if let Some(bounds) = &self.tension_mass {
            strains = strains.with_tension_mass(bounds.clone());
        }
        let system = mechanism.system_with_mass(mass, Quadrature::Midpoint);
        let mut system = system.discrete_potential(Box::new(strains));
        for load in self.loads()? {
            system = system.force(Box::new(load));
        }
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let (options, at) = (Options::new(SchemeKind::Nodal, h), InitialValues::new(0.0, &q, &v));
        let run = integrator(self.mechanism()?, system, options, Solver::Auto, at);
        let mut run = run.map_err(|e| e.to_string())?;
        self.compare(&mechanism, || {
            run.step().map_err(|e| e.to_string())?;
            Ok((run.state().q.clone(), run.state().p.clone()))
        })
    }

    fn energy_momentum(&self) -> Result<Deviation, String> {
        let h = self.h.ok_or("h is missing")?;
        let (elements, mechanism) = (self.elements()?, self.mechanism()?);
        let mass = self.mass(&mechanism, &elements);
        let weight = mechanism.system_with_mass(mass.clone(), Quadrature::Midpoint);
        let mut system = EmSystem::of_linear(&weight).gradient(BeamGradient(elements.clone()));
        for load in self.loads()? {
            system = system.load(load);
        }
        let options = EmOptions::new(EmForm::Nodal, h);
        let run = vi_emscheme::run::integrator(system, self.mechanism()?, options);
        let mut run = run.map_err(|e| e.to_string())?;
        let mut energies: Vec<f64> = Vec::new();
        let deviation = self.compare(&mechanism, || {
            run.step().map_err(|e| e.to_string())?;
            let (q, v) = (run.state().q.clone(), &run.state().v);
            let mut p = vec![0.0; q.len()];
            mass.mul_add(1.0, v, &mut p);
            energies.push(0.5 * mass.bilinear(v, v) + elements.value(&q));
            Ok((q, p))
        })?;
        let after = (1.0 / h).round() as usize; // where loads have ended
        let Some(free) = energies.get(after..).filter(|free| !free.is_empty()) else {
            return Ok(deviation);
        };
        let drifts: Vec<f64> = free.iter().map(|e| e / free[0] - 1.0).collect();
        let drift = norm_inf(&drifts);
        Ok(Deviation { energy: drift / 1e-12, ..deviation })
    }
}
