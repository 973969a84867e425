//! Every test of the program, in one binary.
#![allow(clippy::unwrap_used)] // tests

mod statics {
    mod critical_loads;
    mod equilibria_and_modes;
    mod harmonic_response;
}

mod model {
    mod import_files;
    mod includes;
    mod invalid_models;
}

mod output {
    pub(crate) mod browser;
    mod browser_process;
    mod columns;
    mod drawings;
    mod export;
    mod export_gltf;
    mod export_parquet;
    mod export_svg;
    mod export_vtk;
    mod layout;
    mod looks;
    pub(crate) mod meshes;
    mod scene;
    mod scene_found;
    mod scene_modes;
    mod scene_pages;
}

mod program {
    mod bench_command;
    mod checkpoints;
    pub(crate) mod command;
    mod events;
    mod exit_codes;
    mod foreign_files;
    mod gradients;
    mod guide;
    mod identify;
    pub(crate) mod interrupted;
    mod interruption;
    mod optima;
    mod run_files;
    #[cfg(unix)]
    mod signals;
    #[cfg(unix)]
    mod special_files;
    mod studies;
    mod sweeps;
    mod words;
}

mod robust {
    mod hostile_files;
}
