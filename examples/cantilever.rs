//! Statics of a cantilever: rolled up to a full circle by a moment at its tip.
//!
//! Shows: a beam of geometrically exact elements, its mesh and section, equilibria along a load.
//! Holds: the nodes are a regular polygon. With `n` elements of length `ℓ` the moment
//! `M = EI/(2ℓ) sin(4π/n)` turns each of them by exactly `2π/n`, so the tip returns to the clamp.

use nalgebra::Vector3;
use std::error::Error;
use std::f64::consts::PI;
use vi_beam::model::BeamModel;
use vi_beam::{BeamMesh, FrameRule, Section};
use vi_rigid::{Load, LoadKind, TimeHistory, directors};
use vi_statics::{StaticProblem, StaticSettings};

fn main() -> Result<(), Box<dyn Error>> {
    let (length, bending, elements) = (10.0, 500.0, 32); // m, N·m², –
    let section = Section::new(
        [1e4, 1e4, 1e4, bending, bending, 500.0], // GA_1, GA_2, EA (N), EI_1, EI_2, GJ (N·m²)
        [1.0, 10.0, 10.0, 0.0],                   // mass per length, of no matter here
    )?;
    let rule = FrameRule::Normal(Vector3::z());
    let mesh = BeamMesh::straight(Vector3::zeros(), length * Vector3::x(), elements, rule)?;
    let mut model = BeamModel::new(Vector3::zeros());
    let beam = model.add_beam("cantilever", &mesh, section)?;
    model.clamp(beam.nodes.start);

    let n = elements as f64;
    let moment = 0.5 * bending * n / length * (4.0 * PI / n).sin();
    let (tip, none) = (beam.nodes.end - 1, Vector3::zeros());
    let torque = moment * Vector3::z();
    let load = Load::new(12 * tip, LoadKind::Dead, none, torque, TimeHistory::default())?;
    let mechanism = model.mechanism();
    let system = model.static_system(&mechanism, vec![load]);
    let mut problem = StaticProblem::new(system, mechanism).with_elements(model.neighbours());
    let settings = StaticSettings::default();
    for factor in [0.25, 0.5, 0.75, 1.0] {
        let path = problem.solve(&[factor], &settings)?;
        let iterations: usize = path.points.iter().map(|point| point.iterations).sum();
        let tip = directors::center(&problem.configuration()[12 * tip..]);
        let torque = factor * moment;
        println!(
            "{torque:7.3} N·m: tip at ({:+.6}, {:+.6}) m, {iterations} iterations",
            tip.x, tip.y
        );
    }
    let end = directors::center(&problem.configuration()[12 * tip..]);
    println!("the full circle is open by {:.1e} m", end.norm());
    assert!(end.norm() < 1e-10, "the beam closes to a circle: {end}");
    Ok(())
}
