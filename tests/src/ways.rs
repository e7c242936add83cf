//! Every way to run the program on some ranks that this build has.

use crate::program;
use std::fmt;
use std::path::Path;
use std::process::Command;

/// What carries the bytes, and how.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Way {
    /// One rank, alone.
    Local,
    /// Threads of one process.
    Channel,
    /// Processes that share memory.
    Iceoryx2,
    /// Processes started by mpirun, with a value of `mpi_exchange`.
    Mpi(&'static str),
}

impl Way {
    /// Those that are built into the program, as the features of this package say; with the environment variable `ATOLL_WAYS=mpi` only one
    /// rank alone and those of MPI.
    pub fn all() -> Vec<Self> {
        let mut ways = vec![Self::Local, Self::Channel];
        if cfg!(feature = "iceoryx2") {
            ways.push(Self::Iceoryx2);
        }
        if cfg!(feature = "mpi") {
            ways.extend([Self::Mpi("alltoallv"), Self::Mpi("sparse")]);
        }
        if std::env::var("ATOLL_WAYS").is_ok_and(|chosen| chosen == "mpi") {
            ways.retain(|way| matches!(way, Self::Local | Self::Mpi(_)));
        }
        ways
    }

    /// Whether ranks are processes, which can be killed one by one.
    pub fn has_processes(self) -> bool {
        matches!(self, Self::Iceoryx2 | Self::Mpi(_))
    }

    /// Whether it can run so many ranks.
    pub fn supports(self, ranks: usize) -> bool {
        self != Self::Local || ranks == 1
    }

    /// As `--transport` and the summary call it.
    pub fn transport(self) -> &'static str {
        match self {
            Self::Local => "local",
            Self::Channel => "channel",
            Self::Iceoryx2 => "iceoryx2",
            Self::Mpi(_) => "mpi",
        }
    }

    /// `atoll run CONFIG` on so many ranks, started as a user would start it. More options can be added.
    pub fn command(self, ranks: usize, config: &str) -> Command {
        self.run(ranks, &[config])
    }

    /// `atoll run --resume FOLDER` on so many ranks. More options can be added.
    pub fn resume(self, ranks: usize, folder: &Path) -> Command {
        self.run(ranks, &["--resume", folder.to_str().expect("folders of tests have simple names")])
    }

    fn run(self, ranks: usize, what: &[&str]) -> Command {
        let mut command = self.program(ranks);
        command.arg("run").args(what).args(["--transport", self.transport()]);
        match self {
            Self::Mpi(exchange) => command.args(["--set", &format!("mpi_exchange={exchange}")]),
            _ => command.args(["--ranks", &ranks.to_string()]),
        };
        command
    }

    /// The program, as a user would start it for so many ranks. A verb and its options are to follow.
    #[cfg_attr(not(feature = "mpi"), expect(unused_variables, reason = "only a launcher is told here"))]
    pub fn program(self, ranks: usize) -> Command {
        match self {
            #[cfg(feature = "mpi")]
            Self::Mpi(_) => {
                let mut command = crate::mpi::mpirun(ranks);
                command.arg(program::atoll(program::Profile::CURRENT));
                program::at_home(&mut command);
                command
            }
            _ => program::command(),
        }
    }
}

impl fmt::Display for Way {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Mpi(exchange) => write!(f, "mpi ({exchange})"),
            _ => f.write_str(self.transport()),
        }
    }
}
