//! Who started this process, as far as its environment tells.

use crate::Rank;

/// What a launcher says about this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Launched {
    /// How many ranks it has started.
    pub size: usize,
    /// Which of them this is.
    pub rank: Rank,
    /// Whether they were started to join each other: by a launcher of MPI, or another one in a way that MPI understands.
    pub is_joint: bool,
}

/// What the launcher says, if there was one that says it: `mpirun` of Open MPI or of MPICH and those like it, or `srun`.
///
/// If its number of ranks is not the [size](crate::Transport::size) of the run, the program was started by the launcher of
/// another MPI than the one that it was built with.
pub fn launched() -> Option<Launched> {
    launched_in(|name| std::env::var(name).ok())
}

/// How many of the ranks run on this machine, this one among them, if the launcher says so.
pub fn ranks_here() -> Option<usize> {
    ranks_here_in(|name| std::env::var(name).ok())
}

fn launched_in(variable: impl Fn(&str) -> Option<String>) -> Option<Launched> {
    let number = |name| variable(name)?.parse().ok();
    let names = [
        ("OMPI_COMM_WORLD_SIZE", "OMPI_COMM_WORLD_RANK"),
        ("PMI_SIZE", "PMI_RANK"),
        // The last, as a launcher within a job of Slurm may have been started by srun itself.
        ("SLURM_STEP_NUM_TASKS", "SLURM_PROCID"),
    ];
    let is_told = ["OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK"].iter().any(|name| variable(name).is_some());
    let found = |(size, rank)| {
        let (size, rank) = (number(size)? as usize, Rank(number(rank)?));
        Some(Launched { size, rank, is_joint: is_told && size > 1 })
    };
    names.into_iter().find_map(found)
}

fn ranks_here_in(variable: impl Fn(&str) -> Option<String>) -> Option<usize> {
    // Of Open MPI; of MPICH and those like it; of srun, which tells it of each machine, such as `4(x2),1`: the first of equals.
    let all = ["OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", "SLURM_STEP_TASKS_PER_NODE"];
    let first = |text: String| text.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok();
    all.into_iter().find_map(|name| first(variable(name)?)).filter(|&ranks| ranks > 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn launchers_say_how_many_ranks_there_are_and_which_this_is() {
        let with = |variables: &'static [(&str, &str)]| {
            launched_in(move |asked| Some(variables.iter().find(|(name, _)| *name == asked)?.1.to_owned()))
        };
        let launched = |size, rank| Some(Launched { size, rank: Rank(rank), is_joint: true });
        assert_eq!(with(&[("OMPI_COMM_WORLD_SIZE", "4"), ("OMPI_COMM_WORLD_RANK", "3")]), launched(4, 3));
        assert_eq!(with(&[("PMI_SIZE", "8"), ("PMI_RANK", "0")]), launched(8, 0));
        let within_slurm = &[
            ("SLURM_STEP_NUM_TASKS", "2"),
            ("SLURM_PROCID", "1"),
            ("OMPI_COMM_WORLD_SIZE", "16"),
            ("OMPI_COMM_WORLD_RANK", "9"),
        ];
        // Of tasks alone nobody knows whether they are to join.
        let alone = Some(Launched { size: 2, rank: Rank(1), is_joint: false });
        assert_eq!(with(&within_slurm[..2]), alone);
        assert_eq!(with(within_slurm), launched(16, 9));
        let of_one = with(&[("PMI_SIZE", "1"), ("PMI_RANK", "0")]);
        assert_eq!(of_one, Some(Launched { size: 1, rank: Rank(0), is_joint: false }));
        assert_eq!(with(&[("PMI_SIZE", "many"), ("PMI_RANK", "0")]), None);
        assert_eq!(with(&[("HOME", "1")]), None);
    }

    #[test]
    fn launchers_say_how_many_ranks_are_here() {
        let with = |name: &'static str, value: &'static str| {
            ranks_here_in(move |asked| (asked == name).then(|| value.to_owned()))
        };
        assert_eq!(with("OMPI_COMM_WORLD_LOCAL_SIZE", "4"), Some(4));
        assert_eq!(with("MPI_LOCALNRANKS", "12"), Some(12));
        assert_eq!(with("SLURM_STEP_TASKS_PER_NODE", "16(x2),3"), Some(16));
        assert_eq!([with("MPI_LOCALNRANKS", "0"), with("MPI_LOCALNRANKS", "few"), with("HOME", "1")], [None; 3]);
    }
}
