//! The command line: its verbs and their arguments. What carries them out stands in the file of
//! each verb.

mod configuration;
mod gradient;
mod identify;
mod model_files;
mod optimize;
mod plot;
mod response;
mod results;
mod run;
mod shared;
mod study;
mod sweep;
mod unit;

pub(crate) use configuration::{CheckArguments, ModesArguments, Speeds};
pub(crate) use gradient::{By, GradientArguments};
pub(crate) use identify::IdentifyArguments;
pub(crate) use model_files::{ExamplesArguments, ImportArguments, SchemaArguments};
pub(crate) use optimize::OptimizeArguments;
pub(crate) use plot::{PlotArguments, PlotStyle};
pub(crate) use response::ResponseArguments;
pub(crate) use results::{ExportArguments, ViewArguments};
pub(crate) use run::{ResumeArguments, RunArguments, Talk};
pub(crate) use shared::ModelArguments;
pub(crate) use study::{BenchArguments, CompareArguments, VerifyArguments};
pub(crate) use sweep::{CollectArguments, SweepArguments};
pub(crate) use unit::UnitArguments;

use std::ffi::OsString;

use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, Parser, Subcommand};
use clap_complete::Shell;
use holonom::model::nearest;

/// Variational integrators for constrained mechanical systems.
#[derive(Parser)]
#[command(name = "holonom", version, after_help = AFTER, disable_help_subcommand = true)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) verb: Verb,
}

impl Cli {
    /// Reads a command line, the name of the program first.
    ///
    /// # Errors
    /// Its answer, with the verb that may be meant.
    pub(crate) fn read(words: impl IntoIterator<Item = OsString>) -> Result<Self, clap::Error> {
        Self::try_parse_from(words).map_err(|mut error| {
            let known: Vec<String> =
                Self::command().get_subcommands().map(|verb| verb.get_name().to_owned()).collect();
            let word = match error.get(ContextKind::InvalidSubcommand) {
                Some(ContextValue::String(word)) => word.clone(),
                _ => return error,
            };
            if error.get(ContextKind::SuggestedSubcommand).is_none()
                && let Some(best) = nearest(&word, known.iter().map(String::as_str))
            {
                let meant = ContextValue::Strings(vec![best.to_owned()]);
                error.insert(ContextKind::SuggestedSubcommand, meant);
            }
            error
        })
    }
}

const AFTER: &str = "Start with:\n  holonom examples pendulum -o pendulum.toml\n  holonom run \
                     pendulum.toml\n\nExit codes: 0 done, 1 the run failed, 2 usage, 3 the model \
                     is invalid, 130 or 143 interrupted by a signal.";

#[derive(Subcommand)]
pub(crate) enum Verb {
    /// Simulate a model; write trajectory, summary, plots and a report
    Run(RunArguments),
    /// Continue a run that was interrupted or killed, from its last checkpoint
    Resume(ResumeArguments),
    /// Run a model at many points: a grid or samples of its values, in parallel
    Sweep(SweepArguments),
    /// Collect the points of a sweep into one table and a page
    Collect(CollectArguments),
    /// Validate and assemble a model: degrees of freedom, redundant joints, initial errors
    Check(CheckArguments),
    /// Run all schemes on a model: conservation, cost, error against time
    Compare(CompareArguments),
    /// What a step costs, and its parts: residual, matrix, solution, recording
    Bench(BenchArguments),
    /// Natural frequencies and mode shapes about the initial configuration or an equilibrium
    Modes(ModesArguments),
    /// Harmonic response of the sensors over a band of frequencies: amplitude and phase
    Response(ResponseArguments),
    /// Derivatives of the objectives by parameters, controls and initial values
    Gradient(GradientArguments),
    /// Find parameters, or controls, of least cost that meet the conditions
    Optimize(OptimizeArguments),
    /// Find unknown numbers of a model from measurements of its motion, with standard errors
    Identify(IdentifyArguments),
    /// Measure orders, energy, momentum, constraints and symplecticity on a model; recommend a step
    Verify(VerifyArguments),
    /// Show a finished run in the browser: the animated scene, charts, facts
    View(ViewArguments),
    /// Write the results of a finished run for other programs
    Export(ExportArguments),
    /// Write a model as a functional mock-up unit (FMI), a block for other simulation tools
    #[command(name = "export-fmu")]
    ExportFmu(UnitArguments),
    /// Draw plots and report of a run again, or chosen columns of runs as SVG, PDF or PNG
    Plot(PlotArguments),
    /// Translate a robot description (URDF, MJCF) into a model file
    Import(ImportArguments),
    /// Print the keys of a section of model files, or the JSON schema of all
    Schema(SchemaArguments),
    /// List the shipped models, or write them
    Examples(ExamplesArguments),
    /// Print a completion script for a shell
    Completions {
        /// The shell
        shell: Shell,
    },
}
