//! Every test of the facade that runs systems, in one binary.
#![allow(clippy::unwrap_used)] // tests

use std::path::Path;

mod benchmark;
mod bits;
mod harness;

mod schemes {
    mod a01_simple_pendulum;
    mod certificates;
    mod chain_and_top;
    mod compare;
    mod contact_tops;
    mod energy_band;
    mod energy_momentum;
    mod four_particles;
    mod free_body;
    mod galerkin;
    mod galerkin_systems;
    mod heavy_top;
    mod long_run;
    mod rates;
    mod reacting_models;
    mod recording;
    mod reference;
    mod restart;
    mod rolling;
    mod shadow_energy;
    mod step_resolution;
    mod substeps;
    mod work_and_energy;
}

mod pairs {
    mod doubled_joints;
    mod efforts;
    pub(crate) mod every_freedom;
    mod reaction_agreement;
    mod reactions;
    mod redundant_reactions;
    mod scalar_constraints;
    mod start_rates;
    mod turned_models;
}

mod loops {
    mod a02_four_bar_windows;
    mod a03_andrews_squeezer;
    mod a04_bricard;
    mod a05_flyball_governor;
    mod four_bar_loop;
    mod loops_of_bars;
    mod loops_of_few_digits;
    mod loops_within_loops_of_few_digits;
    mod nested_loops;
    mod rough_linkages;
    mod shipped_mechanisms;
    pub(crate) mod singular_start;
    mod six_hinge_linkages;
    mod slider_crank;
}

mod beams {
    mod beam_benchmarks;
    mod beam_models;
    mod catenaries;
    mod curved_elements;
    mod dissipative_strains;
    mod driven_beams;
    mod flexible_multibody;
    mod helicoidal_benchmarks;
    mod helicoidal_schemes;
    mod material_damping;
    mod ropes;
    mod section_forces;
    mod slack_starts;
    mod stations;
    mod stiff_beams;
    mod tensioned_models;
}

mod statics {
    mod mode_models;
    mod moving_models;
    mod rotating_models;
    pub(crate) mod static_models;
    mod unstable_equilibria;
}

mod model {
    mod beam_contacts;
    mod box_contacts;
    mod bushing_laws;
    mod contact_benchmarks;
    mod contact_energy;
    mod contact_laws;
    mod contact_motion;
    mod contact_nodes;
    mod contact_wiring;
    mod contacts;
    mod cylinder_contacts;
    mod events;
    mod events_with_contact;
    mod foreign_words;
    mod heaps;
    mod import_contacts;
    mod import_dialects;
    mod import_forces;
    mod import_inertia;
    mod import_sensors;
    mod imports;
    mod joint_stops;
    pub(crate) mod keys;
    mod law_tables;
    mod laws;
    mod mesh_contacts;
    mod model_file;
    mod overlaps;
    mod parameters;
    mod random_contacts;
    mod relative_frames;
    mod sensed;
    mod shape_runs;
    mod shipped_gradients;
    mod shipped_models;
    mod signal_states;
    mod signals;
    mod slips;
    mod time_functions;
}

mod output {
    mod energies;
    mod force_sensors;
    mod momenta;
    mod motion_sensors;
    mod report;
    mod sensors;
    mod tables;
}

mod robust {
    mod allocation;
    mod contradictions;
    mod far_from_origin;
    mod hostile;
    mod hostile_numbers;
    mod hostile_starts;
    mod hostile_steps;
    mod large_systems;
    mod shape_allocation;
}

/// A file that no binary lists would not be compiled.
#[test]
fn every_file_of_the_folder_is_a_module() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests");
    let binaries = ["systems", "command_line", "harnesses", "reliability"];
    let read = |path: &Path| std::fs::read_to_string(path).unwrap_or_default();
    let all = binaries.map(|name| read(&folder.join(name).with_extension("rs"))).concat();
    let mut folders = vec![folder.clone()];
    while let Some(inner) = folders.pop() {
        // a folder with a `mod.rs` lists its own files, all others stand in the list of a binary
        let own = read(&inner.join("mod.rs"));
        let list = if own.is_empty() { &all } else { &own };
        for path in std::fs::read_dir(&inner).unwrap().map(|entry| entry.unwrap().path()) {
            let name = path.file_stem().unwrap().to_string_lossy().into_owned();
            if path.is_dir() && name != "alone" {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs") && name != "mod" {
                let known = inner == folder && binaries.contains(&name.as_str());
                assert!(known || list.contains(&format!("mod {name};\n")), "{}", path.display());
            }
        }
    }
}

/// The text of all tests, one after the other.
fn sources(folder: &Path) -> String {
    let paths = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let one = |path: std::path::PathBuf| match path.is_dir() {
        true => sources(&path),
        false if path.extension().is_some_and(|e| e == "rs") => {
            std::fs::read_to_string(&path).unwrap()
        }
        false => String::new(),
    };
    paths.map(one).collect()
}

/// A model that no test names would be kept for nothing.
#[test]
fn every_model_of_the_folder_is_used() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tests");
    let all = sources(&folder);
    let models = std::fs::read_dir(folder.join("models")).unwrap();
    let names = models.map(|entry| entry.unwrap().path().file_stem().unwrap().to_owned());
    for name in names.map(|name| name.into_string().unwrap()) {
        let used = [format!("models/{name}.toml"), format!("\"{name}\"")];
        assert!(used.iter().any(|used| all.contains(used)), "tests/models/{name}.toml");
    }
}
