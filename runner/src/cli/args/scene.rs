//! Options of `atoll scene`.

use super::values::ValueArgs;
use clap::{Args, Subcommand, ValueEnum};
use std::path::PathBuf;

/// Options of `atoll scene`.
#[derive(Debug, Args)]
pub struct SceneArgs {
    /// What to do.
    #[command(subcommand)]
    pub command: SceneCommand,
}

/// What can be done with the files of a scene.
#[derive(Debug, Subcommand)]
pub enum SceneCommand {
    /// Write the start of a configuration, or a recorded step of a run, as the files of a scene.
    Export(Box<SceneExportArgs>),
    /// Look at all that the files of a scene say: the exit code is 2 if anything is wrong, told in one line each.
    Check(SceneCheckArgs),
    /// Write what another program has saved as the files of a scene: a Box2D world as R.U.B.E. saves it (.json), or a data file
    /// of LAMMPS with discs.
    Import(SceneImportArgs),
}

/// Options of `atoll scene export`.
#[derive(Debug, Args)]
#[command(allow_negative_numbers = true)]
pub struct SceneExportArgs {
    /// A configuration or a scene, whose start is written; or the folder of a run, with --step.
    pub from: PathBuf,
    /// Write scene.toml and the bodies to this folder.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// How the bodies are written.
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t)]
    pub bodies_as: BodiesAs,
    /// Which recorded step of the run: its angles are those of the recording, which are rounded to 32 bits, so a run from there
    /// differs from the recorded one in the last bits.
    #[arg(long, value_name = "K")]
    pub step: Option<u64>,
    /// Let it replace files of these names.
    #[arg(long)]
    pub overwrite: bool,
    /// What wins over the configuration's values.
    #[command(flatten)]
    pub values: ValueArgs,
}

/// Options of `atoll scene check`.
#[derive(Debug, Args)]
pub struct SceneCheckArgs {
    /// The text of the scene, such as world.toml.
    pub scene: PathBuf,
}

/// Options of `atoll scene import`.
#[derive(Debug, Args)]
pub struct SceneImportArgs {
    /// The file of the other program.
    pub from: PathBuf,
    /// Write scene.toml and the bodies to this folder.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// How the bodies are written.
    #[arg(long, value_name = "FORMAT", value_enum, default_value_t)]
    pub bodies_as: BodiesAs,
    /// Leave out what there is no counterpart for, and tell what that was.
    #[arg(long)]
    pub lossy: bool,
    /// Let it replace files of these names.
    #[arg(long)]
    pub overwrite: bool,
}

/// How bodies are written.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug, ValueEnum)]
pub enum BodiesAs {
    /// Text, which any program reads.
    Csv,
    /// A fifth of the bytes, read by region.
    #[default]
    Parquet,
}
