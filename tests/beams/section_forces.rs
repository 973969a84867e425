//! Section forces along helicoidal elements: in equilibrium with what holds and what loads a beam.

use crate::benchmark::samples;
use crate::harness::case::distance;
use crate::statics::static_models::rows;
use holonom::nalgebra::Vector3;
use holonom::{Model, Simulation};

/// A cantilever that sways under its weight, a wind and a torque along it, held by a mass at its
/// tip; section forces at the clamp and at the tip, and the reaction of the clamp.
fn cantilever(elements: u32, more: &str) -> String {
    let sensor = |name: &str, own: &str| format!("[[sensor]]\nname = \"{name}\"\n{own}\n");
    let section = |at: f64| format!("type = \"section_force\"\nof = \"arm\"\nat = {at}");
    let h = "history = { type = \"harmonic\", frequency = 0.5 }\n";
    let loads = format!(
        "[[load]]\nname = \"wind\"\nbeam = \"arm\"\nforce = [0.0, 0.3, 0.0]\n{h}\
                 [[load]]\nname = \"pressure\"\nbeam = \"arm\"\nframe = \"body\"\nforce = [0.2, 0.0, 0.0]\n{h}\
                 [[load]]\nname = \"turn\"\nbeam = \"arm\"\ntorque = [0.02, 0.03, 0.05]\n{h}"
    );
    format!(
        "model = {{ name = \"cantilever\", gravity = [0.0, 0.0, -2.0] }}\n\
         simulation = {{ step = 2e-3, end = 0.8, start = \"relaxed\" }}\n\
         [[beam]]\nname = \"arm\"\npoints = [[0, 0, 0], [1, 0, 0]]\nelements = {elements}\n\
         normal = [0, 0, 1]\nstart = \"clamped\"\n{more}\
         section = {{ EA = 1e3, GA1 = 1e3, GA2 = 1e3, EI1 = 1, EI2 = 2, GJ = 1, rhoA = 0.5, rhoI1 = 1e-3, rhoI2 = 1e-3 }}\n\
         {loads}{}{}{}",
        sensor("reaction", "type = \"reaction\"\nof = \"arm.start\"\nframe = \"space\""),
        sensor("clamp", &section(0.0)),
        sensor("tip", &section(1.0)),
    )
}

/// Largest differences of force and moment at the clamp from its reaction, and of those at the free
/// end from zero, over the largest reaction.
fn off(elements: u32, more: &str) -> [f64; 4] {
    let model = Model::from_toml(&cantilever(elements, more)).unwrap();
    let mut simulation = Simulation::new(&model).unwrap();
    let (mut worst, mut largest) = ([0.0_f64; 4], [0.0_f64; 2]);
    for sample in samples(&mut simulation).iter().filter(|sample| sample.step > 0) {
        let three = |first: usize| Vector3::from_column_slice(&sample.sensors[first..first + 3]);
        // reaction: force, torque, uniqueness; the triad of the clamp is (e_3, −e_2, e_1)
        let spatial = |n: Vector3<f64>| Vector3::new(n.z, -n.y, n.x);
        let found = [three(7), three(10), three(13), three(16)].map(spatial);
        let exact = [-three(0), -three(3), Vector3::zeros(), Vector3::zeros()];
        for (k, (found, exact)) in found.iter().zip(exact).enumerate() {
            worst[k] = worst[k].max((found - exact).norm());
        }
        largest = [0, 1].map(|k| largest[k].max(exact[k].norm()));
    }
    std::array::from_fn(|k| worst[k] / largest[k % 2])
}

#[test]
fn section_forces_are_in_equilibrium_with_the_clamp_the_loads_and_inertia() {
    for (more, bound) in [("", 2e-3), ("mass = \"lumped\"\n", 6e-3)] {
        let [coarse, fine] = [4, 8].map(|elements| off(elements, more));
        println!("clamp and free end off by {coarse:?}, {fine:?} (relative)");
        for (k, bound) in [bound, 2e-4, bound, 2e-4].into_iter().enumerate() {
            let order = (coarse[k] / fine[k]).log2();
            assert!(fine[k] < bound && (order > 1.8 || fine[k] < 1e-4), "{k}: {order}");
        }
    }
}

/// A straight cantilever under a force and a torque within its only element, a weight along it and
/// a force at its tip: shear force and moments at any place are those of the loads beyond it.
#[test]
fn a_load_within_an_element_is_felt_on_the_side_of_the_clamp() {
    let (place, force, torque, tip, weight) = (0.7, 2e-4, [3e-4, 1e-4], 1e-4, 5e-4);
    for elements in [1, 3] {
        for at in [0.0, 0.3, 0.699, 0.701, 0.9, 1.0] {
            let text = format!(
                "model = {{ name = \"loads\", gravity = [0.0, 0.0, {}] }}\n\
                 simulation = {{ scheme = \"static\", step = 1, end = 1 }}\n\
                 [[beam]]\nname = \"arm\"\npoints = [[0, 0, 0], [1, 0, 0]]\nelements = {elements}\n\
                 normal = [0, 0, 1]\nstart = \"clamped\"\n\
                 section = {{ EA = 1e3, GA1 = 1e3, GA2 = 1e3, EI1 = 1, EI2 = 2, GJ = 1, rhoA = 1, rhoI1 = 1e-3, rhoI2 = 1e-3 }}\n\
                 [[load]]\nname = \"place\"\nbeam = \"arm\"\nat = {place}\n\
                 force = [0.0, 0.0, {}]\ntorque = [{}, {}, 0.0]\n\
                 [[load]]\nname = \"tip\"\nbody = \"arm.end\"\nforce = [0.0, 0.0, {}]\n\
                 [[sensor]]\nname = \"s\"\ntype = \"section_force\"\nof = \"arm\"\nat = {at}\n",
                -weight, -force, torque[0], torque[1], -tip
            );
            let (samples, _) = rows(&Model::from_toml(&text).unwrap());
            let found = &samples.last().unwrap().sensors;
            let beyond = f64::from(u8::from(at < place));
            // the triad is (e_3, −e_2, e_1): N_1 along e_3, M_2 about −e_2, M_3 about e_1
            let shear = -(tip + weight * (1.0 - at) + beyond * force);
            let bending = -(tip * (1.0 - at)
                + 0.5 * weight * (1.0 - at).powi(2)
                + beyond * (force * (place - at) + torque[1]));
            let expected = [shear, 0.0, 0.0, 0.0, bending, beyond * torque[0]];
            let off = distance(found, &expected);
            assert!(off < 1e-6, "{elements} elements, at {at}: {found:?} in place of {expected:?}");
        }
    }
}
