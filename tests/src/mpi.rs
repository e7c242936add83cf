//! Starting programs as the ranks of an MPI job.

use atoll_transport::mpi::Mpi;
use std::env;
use std::ffi::OsString;
use std::process::{Command, Stdio};

/// Names the launcher to use instead of the one that is found.
pub const LAUNCHER: &str = "ATOLL_MPIRUN";

/// The launcher of the MPI that this program and so the ranks are linked with, told to start so many of them; the
/// program and its arguments are to follow. More ranks than cores are allowed, and so is any user.
///
/// # Panics
/// If there is no such launcher.
pub fn mpirun(size: usize) -> Command {
    launch_with(env::var_os(LAUNCHER).unwrap_or_else(launcher), size)
}

/// The launcher of another MPI than that, if there is one, told to start so many ranks.
pub fn foreign_mpirun(size: usize) -> Option<Command> {
    let name = if Mpi::library().contains("Open MPI") { "mpirun.mpich" } else { "mpirun.openmpi" };
    on_path(name).then(|| launch_with(name.into(), size))
}

fn launch_with(launcher: OsString, size: usize) -> Command {
    let mut command = Command::new(launcher);
    command.stdin(Stdio::null()).arg("-n").arg(size.to_string());
    let open_mpi = [
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        // Ranks that wait leave their core to others,
        ("OMPI_MCA_mpi_yield_when_idle", "1"),
        // and jobs side by side do not all sit on the first cores.
        ("OMPI_MCA_hwloc_base_binding_policy", "none"),
        // Containers do not let processes read each other's memory.
        ("OMPI_MCA_btl_vader_single_copy_mechanism", "none"),
    ];
    // Other MPIs do not know these.
    command.envs(open_mpi);
    command
}

/// The first launcher of the right MPI on the path. Systems with several MPIs add its name to that of the launcher.
fn launcher() -> OsString {
    let library = Mpi::library();
    let names: &[&str] = if library.contains("Open MPI") {
        &["mpirun.openmpi", "mpirun"]
    } else if library.contains("MPICH") {
        &["mpirun.mpich", "mpiexec.mpich", "mpirun"]
    } else {
        &["mpirun"]
    };
    let found = names.iter().find(|name| on_path(name));
    found.unwrap_or_else(|| panic!("none of {names:?} of {library} is on the path; name one in {LAUNCHER}")).into()
}

fn on_path(name: &str) -> bool {
    let path = env::var_os("PATH").unwrap_or_default();
    env::split_paths(&path).any(|folder| folder.join(name).is_file())
}
