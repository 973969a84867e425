//! Every test of the facade that runs systems, in one binary.
#![allow(clippy::unwrap_used)] // tests

mod benchmark;
mod harness;

mod a01_simple_pendulum;
mod a02_four_bar_windows;
mod a03_andrews_squeezer;
mod a04_bricard;
mod a05_flyball_governor;
mod allocation;
mod beam_benchmarks;
mod beam_models;
mod bits;
mod certificates;
mod chain_and_top;
mod compare;
mod contradictions;
mod dissipative_strains;
mod doubled_joints;
mod driven_beams;
mod efforts;
mod energies;
mod energy_band;
mod energy_momentum;
mod every_freedom;
mod far_from_origin;
mod flexible_multibody;
mod foreign_words;
mod four_bar_loop;
mod four_particles;
mod free_body;
mod galerkin;
mod galerkin_systems;
mod heavy_top;
mod hostile;
mod hostile_numbers;
mod hostile_starts;
mod hostile_steps;
mod import_dialects;
mod imports;
mod keys;
mod large_systems;
mod long_run;
mod loops_of_bars;
mod loops_of_few_digits;
mod loops_within_loops_of_few_digits;
mod material_damping;
mod mode_models;
mod model_file;
mod momenta;
mod motion_sensors;
mod nested_loops;
mod parameters;
mod reaction_agreement;
mod reactions;
mod recording;
mod reference;
mod relative_frames;
mod report;
mod restart;
mod rotating_models;
mod rough_linkages;
mod scalar_constraints;
mod sensors;
mod shadow_energy;
mod shipped_mechanisms;
mod shipped_models;
mod singular_start;
mod six_hinge_linkages;
mod slider_crank;
mod slips;
mod start_rates;
mod static_models;
mod step_resolution;
mod stiff_beams;
mod substeps;
mod tables;
mod turned_models;
mod unstable_equilibria;
mod work_and_energy;

/// A file of this folder that no binary lists would not be compiled.
#[test]
fn every_file_of_the_folder_is_a_module() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests");
    let listed =
        [include_str!("systems.rs"), include_str!("command_line.rs"), include_str!("harnesses.rs")]
            .concat();
    let files = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let names = files.filter(|path| path.extension().is_some_and(|e| e == "rs"));
    for name in names.map(|path| path.file_stem().unwrap().to_string_lossy().into_owned()) {
        let binaries = ["systems", "command_line", "harnesses"];
        let known = binaries.contains(&name.as_str());
        assert!(known || listed.contains(&format!("mod {name};\n")), "tests/{name}.rs");
    }
}
