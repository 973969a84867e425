//! Every test of the program, in one binary.
#![allow(clippy::unwrap_used)] // tests

mod bench_command;
mod browser;
mod checkpoints;
mod columns;
mod command;
mod drawings;
mod equilibria_and_modes;
mod export;
mod export_gltf;
mod export_parquet;
mod export_svg;
mod export_vtk;
mod foreign_files;
mod guide;
mod hostile_files;
mod import_files;
mod includes;
mod interrupted;
mod interruption;
mod invalid_models;
mod layout;
mod looks;
mod meshes;
mod program;
mod run_files;
mod scene;
mod scene_modes;
mod scene_pages;
#[cfg(unix)]
mod signals;
#[cfg(unix)]
mod special_files;
mod studies;
mod sweeps;
mod words;
