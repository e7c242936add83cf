//! Exchanges over every transport this build has: how ranks are started, and what each of them measures.
//!
//! The program `exchange` is its own rank: what it starts, directly, through mpirun or as a launcher of processes, is
//! itself with `--rank METHOD`. With `run` as its first argument it is the program `atoll`.

pub mod normal;
mod rank;
pub mod table;

use std::fmt;
use std::path::Path;
use std::process::Command;

pub use rank::{SIZES, Timing, rank_program};

/// A way for bytes to get from rank to rank.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Method {
    /// One core copies, for comparison.
    Memcpy,
    /// Two ranks of MPI, `MPI_Send` and `MPI_Recv`, for comparison.
    PingPong,
    /// Threads of one process.
    Channel,
    /// Processes that share memory.
    Iceoryx2,
    /// MPI, by all-to-all.
    Alltoallv,
    /// MPI, by messages between those that have some.
    Sparse,
}

impl Method {
    /// Those of this build.
    pub fn all() -> Vec<Self> {
        let mut all = vec![Self::Memcpy];
        if cfg!(feature = "mpi") {
            all.push(Self::PingPong);
        }
        all.push(Self::Channel);
        if cfg!(feature = "iceoryx2") {
            all.push(Self::Iceoryx2);
        }
        if cfg!(feature = "mpi") {
            all.extend([Self::Alltoallv, Self::Sparse]);
        }
        all
    }

    /// In tables, and after `--rank`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Memcpy => "memcpy",
            Self::PingPong => "mpi-ping-pong",
            Self::Channel => "channel",
            Self::Iceoryx2 => "iceoryx2",
            Self::Alltoallv => "mpi-alltoallv",
            Self::Sparse => "mpi-sparse",
        }
    }

    /// What the program calls the transport; the comparisons are none of its.
    fn transport(self) -> Option<&'static str> {
        match self {
            Self::Memcpy | Self::PingPong => None,
            Self::Channel => Some("channel"),
            Self::Iceoryx2 => Some("iceoryx2"),
            Self::Alltoallv | Self::Sparse => Some("mpi"),
        }
    }

    /// The one of that name.
    pub fn of_name(name: &str) -> Option<Self> {
        let all = [Self::Memcpy, Self::PingPong, Self::Channel, Self::Iceoryx2, Self::Alltoallv, Self::Sparse];
        all.into_iter().find(|method| method.name() == name)
    }

    /// Whether it works among so many ranks.
    pub fn supports(self, ranks: usize) -> bool {
        match self {
            Self::Memcpy | Self::PingPong => ranks == 2,
            _ => true,
        }
    }

    /// A command that runs `arguments` of this program on so many ranks.
    fn command(self, program: &Path, ranks: usize) -> Command {
        match self {
            Self::PingPong | Self::Alltoallv | Self::Sparse => {
                let mut command = mpirun(ranks);
                command.arg(program);
                command
            }
            _ => Command::new(program),
        }
    }

    /// Measures all sizes on so many ranks, in processes of their own.
    ///
    /// # Errors
    /// If they cannot be started, or fail.
    pub fn measure(self, ranks: usize) -> Result<Vec<Timing>, String> {
        let program = std::env::current_exe().map_err(|error| error.to_string())?;
        let mut command = self.command(&program, ranks);
        command.args(["--rank", self.name(), &ranks.to_string()]);
        let output = command.output().map_err(|error| format!("{command:?}: {error}"))?;
        if !output.status.success() {
            return Err(format!("{self} on {ranks} ranks: {}", String::from_utf8_lossy(&output.stderr)));
        }
        let text = String::from_utf8_lossy(&output.stdout);
        let timings: Option<Vec<Timing>> = text.lines().map(Timing::parse).collect();
        timings.filter(|timings| timings.len() == SIZES.len()).ok_or_else(|| format!("{self} said {text:?}"))
    }
}

impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The launcher of Open MPI, or the one that `ATOLL_MPIRUN` names, also where ranks outnumber cores and for root.
fn mpirun(ranks: usize) -> Command {
    let mut command = Command::new(std::env::var_os("ATOLL_MPIRUN").unwrap_or_else(|| "mpirun".into()));
    command.args(["-n", &ranks.to_string()]);
    for name in ["OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "OMPI_MCA_rmaps_base_oversubscribe"] {
        command.env(name, "1");
    }
    command.env("OMPI_MCA_btl_vader_single_copy_mechanism", "none");
    command
}
