//! Statics, modes, masses and motions of helicoidal elements against values of an independent
//! implementation.
#![allow(clippy::unwrap_used, non_snake_case)] // a test; K, M, P

use holonom::vi_beam::averaged::AveragedStrains;
use holonom::vi_beam::element::ElementKind;
use holonom::vi_beam::{BeamModel, Elements, MassKind, Mesh, Section};
use holonom::vi_constraints::{InitialValues, Options, SchemeKind};
use holonom::vi_core::potential::Potential;
use holonom::vi_core::{Quadrature, SparseMatrix};
use holonom::vi_emscheme::beam::BeamGradient;
use holonom::vi_emscheme::{self, EmForm, EmOptions, EmSystem};
use holonom::vi_multibody::mechanism::Mechanism;
use holonom::vi_multibody::pair::PairKind;
use holonom::vi_multibody::run::{Solver, integrator};
use holonom::vi_rigid::load::{Load, LoadKind};
use holonom::vi_rigid::time_history::TimeHistory;
use nalgebra::{DMatrix, DVector, Matrix3, Matrix4, Matrix6, Vector3};
use serde::Deserialize;

#[derive(Deserialize)]
struct Case {
    name: String,
    strain_rule: String,
    mass: String,
    nodes: Vec<[f64; 12]>,
    elements: Vec<ReferenceElement>,
    fixed_unknowns: Vec<usize>,
    tolerance: f64,
    load: Option<NodeLoad>,
    q: Option<Vec<Vec<f64>>>,
    strain: Option<Vec<[f64; 6]>>,
    strain_energy: Option<f64>,
    omega2: Option<Vec<f64>>,
    gravity: [f64; 3],
    mu: Option<Vec<f64>>,
    tension_mass: Option<Vec<f64>>,
    h: Option<f64>,
    steps: Option<u64>,
    #[serde(default)]
    loads: Vec<NodeLoad>,
    #[serde(default)]
    outputs: Vec<ReferenceNode>,
    unstable: Option<usize>,
    mass_matrix: Option<Vec<Vec<f64>>>,
}

#[derive(Deserialize)]
struct ReferenceElement {
    nodes: [usize; 2],
    length: f64,
    stiffness: Vec<Vec<f64>>,
    mass_per_length: serde_json::Value,
    reference: [f64; 6],
}

#[derive(Deserialize)]
struct ReferenceNode {
    step: u64,
    q: Vec<Vec<f64>>,
    linear_momentum: [f64; 3],
    angular_momentum: [f64; 3],
}

#[derive(Deserialize)]
struct NodeLoad {
    node: usize,
    force: [f64; 3],
    torque: [f64; 3],
}

fn read(text: &str) -> Case {
    serde_json::from_str(text).unwrap()
}

fn mass_per_length(value: &serde_json::Value) -> Matrix4<f64> {
    match serde_json::from_value::<[f64; 4]>(value.clone()) {
        Ok(diagonal) => Matrix4::from_diagonal(&diagonal.into()),
        Err(_) => {
            let rows: Vec<Vec<f64>> = serde_json::from_value(value.clone()).unwrap();
            Matrix4::from_fn(|i, j| rows[i][j])
        }
    }
}

impl Case {
    fn elements(&self) -> Elements {
        let (mut elements, q0) = (Elements::new(), self.nodes.concat());
        let kind = match self.strain_rule.as_str() {
            "helicoidal, order 2" => ElementKind::Rope,
            _ => ElementKind::Helicoidal,
        };
        for own in &self.elements {
            let C = Matrix6::from_fn(|i, j| own.stiffness[i][j]);
            let section = Section::general(C, mass_per_length(&own.mass_per_length)).unwrap();
            let section = elements.add_section(section);
            let k = elements.add_stress_free(own.nodes, own.length, section, &q0).unwrap();
            elements.set_strains(k..k + 1, kind, &q0).unwrap();
            let mass =
                if self.mass == "bubble" { MassKind::Quadratic } else { MassKind::Consistent };
            elements.set_mass(k..k + 1, mass);
            let off = (elements.list()[k].reference - Matrix6x1::from(own.reference)).amax();
            assert!(off < 1e-13, "{}: reference strain off by {off:e}", self.name);
        }
        elements
    }

    fn free(&self) -> Vec<usize> {
        (0..6 * self.nodes.len()).filter(|k| !self.fixed_unknowns.contains(k)).collect()
    }
}

type Matrix6x1 = nalgebra::Vector6<f64>;

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

/// Slope and second derivative of the energy in `u_φ` and the rotation vectors of the nodes.
fn derivatives(elements: &Elements, q: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
    let (n, P) = (q.len(), node_map(q));
    let (mut slope, mut K) = (vec![0.0; n], DMatrix::zeros(n, n));
    elements.add_gradient(q, 1.0, &mut slope);
    elements.add_hessian(q, 1.0, &mut K);
    let mut K = P.tr_mul(&(K * &P));
    for node in 0..n / 12 {
        let mut own = K.view_mut((6 * node + 3, 6 * node + 3), (3, 3));
        for first in [3, 6, 9].map(|k| 12 * node + k) {
            let [d, g] = [q, &slope].map(|x| Vector3::from_column_slice(&x[first..first + 3]));
            let both = d * g.transpose();
            own += 0.5 * (both + both.transpose()) - Matrix3::identity() * d.dot(&g);
        }
    }
    (P.tr_mul(&DVector::from_vec(slope)), K)
}

const STATIC: [&str; 5] = [
    include_str!("../reference/beam-strains/04_bend45_4.json"),
    include_str!("../reference/beam-strains/05_bend45_8_h2.json"),
    include_str!("../reference/beam-strains/06_princeton_45_4.json"),
    include_str!("../reference/beam-strains/07_slender_1e6.json"),
    include_str!("../reference/beam-strains/08_helix_full_section.json"),
];

#[test]
fn the_equilibria_of_the_reference_are_equilibria() {
    for case in STATIC.map(read) {
        let (elements, q) = (case.elements(), case.q.as_ref().unwrap().concat());
        let (mut r, K) = derivatives(&elements, &q);
        let load = case.load.as_ref().unwrap();
        for k in 0..3 {
            r[6 * load.node + k] -= load.force[k];
            r[6 * load.node + 3 + k] -= load.torque[k];
        }
        let free = case.free();
        let (r, K) = (r.select_rows(&free), K.select_rows(&free).select_columns(&free));
        let scale: Vec<f64> = K.diagonal().iter().map(|k| k.abs().sqrt().recip()).collect();
        let scale = DMatrix::from_diagonal(&scale.into());
        let step = &scale * (&scale * &K * &scale).lu().solve(&(&scale * r)).unwrap();
        let (off, mut strains) = (step.amax(), 0.0_f64);
        for (element, expected) in elements.list().iter().zip(case.strain.as_ref().unwrap()) {
            let found = element.strain(&element.coordinates(&q));
            strains = strains.max((found - Matrix6x1::from(*expected)).amax());
        }
        let energy = elements.value(&q) / case.strain_energy.unwrap() - 1.0;
        println!("{}: off by {off:.1e}, strains {strains:.1e}, energy {energy:.1e}", case.name);
        assert!(off < case.tolerance && strains < 1e-11 && energy.abs() < 1e-9, "{off:e}");
    }
}

#[test]
fn a_taut_rope_has_the_frequencies_of_the_reference_and_nothing_unstable() {
    let case = read(include_str!("../reference/beam-strains/09_taut_modes.json"));
    let (elements, q, free) = (case.elements(), case.q.as_ref().unwrap().concat(), case.free());
    let (_, K) = derivatives(&elements, &q);
    let (n, P) = (q.len(), node_map(&q));
    let mut M = DMatrix::zeros(n, n);
    elements.emit_mass(&mut M);
    let M = P.tr_mul(&(M * &P)).select_rows(&free).select_columns(&free);
    let K = K.select_rows(&free).select_columns(&free);
    let L = M.cholesky().unwrap().l();
    let half = L.solve_lower_triangular(&K).unwrap().transpose();
    let standard = L.solve_lower_triangular(&half).unwrap();
    let mut omega2: Vec<f64> = standard.symmetric_eigenvalues().iter().copied().collect();
    omega2.sort_by(f64::total_cmp);
    let expected = case.omega2.as_ref().unwrap();
    let largest = expected.iter().copied().fold(0.0, f64::max);
    let off = omega2.iter().zip(expected).map(|(a, b)| (a - b).abs() / largest).fold(0.0, f64::max);
    let unstable = omega2.iter().filter(|omega2| **omega2 < 0.0).count();
    println!("ω² off by {off:.1e}, {unstable} unstable modes");
    assert!(off < case.tolerance && Some(unstable) == case.unstable);
}

#[test]
fn the_masses_are_those_of_the_reference() {
    for text in [
        include_str!("../reference/beam-strains/01_element_h4_diagonal.json"),
        include_str!("../reference/beam-strains/02_element_h4_full.json"),
        include_str!("../reference/beam-strains/03_element_h2_full.json"),
    ] {
        let case = read(text);
        let mut M = DMatrix::zeros(24, 24);
        case.elements().emit_mass(&mut M);
        let mut off = 0.0_f64;
        for (i, row) in case.mass_matrix.as_ref().unwrap().iter().enumerate() {
            for (j, expected) in row.iter().enumerate() {
                off = off.max((M[(3 * i, 3 * j)] - expected).abs());
            }
        }
        println!("{}: mass off by {off:.1e}", case.name);
        assert!(off < 1e-15, "{off:e}");
    }
}

impl Case {
    /// Nodes, joints and gravity as a mechanism, with the first node clamped or pinned.
    fn mechanism(&self) -> Mechanism {
        let mut model = BeamModel::new(self.gravity.into());
        for (k, node) in self.nodes.iter().enumerate() {
            let triad = Matrix3::from_column_slice(&node[3..]);
            let center = Vector3::from_column_slice(&node[..3]);
            let mesh = Mesh { centers: vec![center], triads: vec![triad], lengths: Vec::new() };
            model.add_frame(mesh.nodes(&format!("node {k}")).remove(0));
        }
        match self.fixed_unknowns.len() {
            0 => {}
            3 => {
                let at = Vector3::from_column_slice(&self.nodes[0][..3]);
                model.join(PairKind::Spherical, None, 0, &at, &Vector3::z());
            }
            _ => _ = model.clamp(0),
        }
        model.mechanism()
    }

    fn mass(&self, mechanism: &Mechanism, elements: &Elements) -> SparseMatrix {
        mechanism.mass(|out| elements.emit_mass(out))
    }

    fn loads(&self) -> Vec<Load> {
        let history = TimeHistory::Triangle { start: 0.0, peak: 0.5, end: 1.0, amplitude: 1.0 };
        let load = |own: &NodeLoad| {
            let (force, torque) = (own.force.into(), own.torque.into());
            Load::new(12 * own.node, LoadKind::Dead, force, torque, history.clone()).unwrap()
        };
        self.loads.iter().map(load).collect()
    }

    /// The largest deviation of coordinates and momenta from those of the reference.
    fn deviation(
        &self,
        mut step: impl FnMut() -> (Vec<f64>, Vec<f64>),
        mechanism: &Mechanism,
    ) -> [f64; 2] {
        let mut worst = [0.0_f64; 2];
        for n in 1..=self.steps.unwrap() {
            let (q, p) = step();
            let Some(expected) = self.outputs.iter().find(|output| output.step == n) else {
                continue;
            };
            let off = |(a, b): (&f64, &f64)| (a - b).abs();
            worst[0] = q.iter().zip(&expected.q.concat()).map(off).fold(worst[0], larger);
            let momentum = mechanism.momentum(&q, &p);
            let found = [momentum.linear, momentum.angular];
            let expected = [expected.linear_momentum, expected.angular_momentum];
            let pairs = found.iter().flatten().zip(expected.iter().flatten());
            worst[1] = pairs.map(off).fold(worst[1], larger);
        }
        worst
    }
}

/// The larger of two; NaN stays.
fn larger(a: f64, b: f64) -> f64 {
    if a > b || a.is_nan() { a } else { b }
}

#[test]
fn averaged_strains_move_as_the_reference() {
    for text in [
        include_str!("../reference/beam-strains/10_helix_averaged.json"),
        include_str!("../reference/beam-strains/11_flying_averaged.json"),
        include_str!("../reference/beam-strains/13_rope_tension_mass.json"),
    ] {
        let case = read(text);
        let (elements, mechanism) = (case.elements(), case.mechanism());
        let mass = case.mass(&mechanism, &elements);
        let mu = case.mu.as_ref().unwrap()[0];
        let count = elements.list().len();
        let mut strains = AveragedStrains::mass_scaled(elements, mu, vec![0.0; count]);
        if let Some(bounds) = &case.tension_mass {
            strains = strains.with_tension_mass(bounds.clone());
        }
        let system = mechanism.system_with_mass(mass, Quadrature::Midpoint);
        let mut system = system.discrete_potential(Box::new(strains));
        for load in case.loads() {
            system = system.force(Box::new(load));
        }
        let (q, v) = (mechanism.initial_configuration(), mechanism.initial_velocity());
        let options = Options::new(SchemeKind::Nodal, case.h.unwrap());
        let at = InitialValues::new(0.0, &q, &v);
        let mut run = integrator(case.mechanism(), system, options, Solver::Auto, at).unwrap();
        let step = || {
            run.step().unwrap();
            (run.state().q.clone(), run.state().p.clone())
        };
        let [q, momenta] = case.deviation(step, &mechanism);
        println!("{}: off by {q:.1e}, momenta by {momenta:.1e}", case.name);
        assert!(q < case.tolerance, "{q:e}");
        let is_free = case.fixed_unknowns.is_empty(); // what holds a node changes momenta
        assert!(!is_free || momenta < case.tolerance, "{momenta:e}");
    }
}

#[test]
fn the_energy_momentum_scheme_moves_as_the_reference() {
    let case = read(include_str!("../reference/beam-strains/12_flying_em.json"));
    let (elements, mechanism) = (case.elements(), case.mechanism());
    let mass = case.mass(&mechanism, &elements);
    let weight = mechanism.system_with_mass(mass.clone(), Quadrature::Midpoint);
    let mut system = EmSystem::of_linear(&weight).gradient(BeamGradient(elements.clone()));
    for load in case.loads() {
        system = system.load(load);
    }
    let options = EmOptions::new(EmForm::Nodal, case.h.unwrap());
    let mut run = vi_emscheme::run::integrator(system, case.mechanism(), options).unwrap();
    let mut energies: Vec<f64> = Vec::new();
    let step = || {
        run.step().unwrap();
        let (q, v) = (run.state().q.clone(), &run.state().v);
        let mut p = vec![0.0; q.len()];
        mass.mul_add(1.0, v, &mut p);
        energies.push(0.5 * mass.bilinear(v, v) + elements.value(&q));
        (q, p)
    };
    let [q, momenta] = case.deviation(step, &mechanism);
    let after = &energies[40..]; // loads end at t = 1
    let drift = after.iter().map(|e| (e / after[0] - 1.0).abs()).fold(0.0, larger);
    println!("off by {q:.1e}, momenta by {momenta:.1e}; energy drifts by {drift:.1e}");
    assert!(q < case.tolerance && momenta < 1e-7 && drift < 1e-12, "{q:e}, {momenta:e}");
}
