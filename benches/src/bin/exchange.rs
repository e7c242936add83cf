//! What an exchange costs over each transport, beside a memcpy and a plain ping-pong of MPI, and what two ranks bring.
//!
//! ```sh
//! cargo run --release -p atoll-benches --features iceoryx2,mpi --bin exchange [exchanges|normal] [REPEATS [STEPS]]
//! ```
//!
//! The first part sends messages of 8 B to 16 MB around a ring of 2, 4 and 8 ranks. The second runs NORMAL on two ranks of
//! one thread over each transport, in turns with one rank alone. The transports whose ranks are processes take part where
//! they are built in.

use atoll_benches::exchange::{Method, normal, rank_program, table};
use atoll_benches::part_and_arguments;
use std::process::ExitCode;

fn main() -> ExitCode {
    let given: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = given.iter().map(String::as_str).collect();
    let result = match words[..] {
        ["run", ..] => return atoll::main(),
        ["--rank", name, ranks] => match (Method::of_name(name), ranks.parse()) {
            (Some(method), Ok(ranks)) => rank_program(method, ranks),
            _ => Err(format!("there is no method {name} on {ranks} ranks")),
        },
        _ => run(),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("exchange: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run() -> Result<(), String> {
    let (chosen, [repeats, steps]) = part_and_arguments(&["exchanges", "normal"], ["REPEATS", "STEPS"], [5, 60])?;
    if chosen("exchanges") {
        for ranks in [2, 4, 8] {
            let methods = Method::all().into_iter().filter(|method| method.supports(ranks));
            let columns: Result<Vec<_>, String> = methods.map(|method| Ok((method, method.measure(ranks)?))).collect();
            table::print(ranks, &columns?);
        }
    }
    if chosen("normal") {
        normal::compare(repeats, steps)?;
    }
    Ok(())
}
