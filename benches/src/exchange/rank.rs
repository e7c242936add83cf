//! What one rank measures.

use super::Method;
use crate::median;
#[cfg(feature = "iceoryx2")]
use atoll_transport::Rank;
use atoll_transport::{Collective, Incoming, Transport, TransportError, channel};
use std::hint::black_box;
use std::time::Instant;

/// Lengths of a message, in bytes.
pub const SIZES: [usize; 8] = [8, 64, 1 << 10, 16 << 10, 128 << 10, 1 << 20, 4 << 20, 16 << 20];

/// How long one exchange took, in seconds.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Timing {
    /// Length of each message, in bytes.
    pub length: usize,
    /// The exchange alone.
    pub bare: f64,
    /// With each message written from elsewhere before, and read to elsewhere after.
    pub with_copies: f64,
}

impl Timing {
    /// Reads what [`rank_program`] writes.
    pub fn parse(line: &str) -> Option<Self> {
        let mut words = line.split(' ');
        let (length, bare, with_copies) = (words.next()?, words.next()?, words.next()?);
        Some(Self { length: length.parse().ok()?, bare: bare.parse().ok()?, with_copies: with_copies.parse().ok()? })
    }
}

/// Measures as one rank, or, with channels, as all of them. The first writes what came of it, a line per length.
///
/// # Errors
/// If the transport fails.
pub fn rank_program(method: Method, ranks: usize) -> Result<(), String> {
    let text = |error: TransportError| error.to_string();
    let timings = match method {
        Method::Memcpy => memcpy(),
        Method::Channel => {
            let results = channel::run(ranks, channel::ChannelOptions::default(), |mut endpoint| all(&mut endpoint));
            let first = results.into_iter().next().ok_or("no ranks")?;
            first.map_err(|failure| failure.to_string())?.map_err(text)?
        }
        #[cfg(feature = "iceoryx2")]
        Method::Iceoryx2 => return iceoryx2(ranks),
        #[cfg(feature = "mpi")]
        Method::Alltoallv | Method::Sparse => {
            use atoll_transport::mpi::{self, Mpi, MpiOptions};
            let sparse = method == Method::Sparse;
            let method = if sparse { mpi::Method::Sparse } else { mpi::Method::Alltoallv };
            let mut endpoint = Mpi::init(MpiOptions { method, ..MpiOptions::default() }).map_err(text)?;
            let timings = all(&mut endpoint).map_err(text)?;
            if endpoint.rank().0 != 0 {
                return Ok(());
            }
            timings
        }
        #[cfg(feature = "mpi")]
        Method::PingPong => match ping_pong() {
            Some(timings) => timings,
            None => return Ok(()),
        },
        #[allow(unreachable_patterns)]
        _ => return Err(format!("{method} is not built in: use --features iceoryx2, mpi or both")),
    };
    for Timing { length, bare, with_copies } in timings {
        println!("{length} {bare:e} {with_copies:e}");
    }
    Ok(())
}

/// The launcher, and each of the ranks it launches.
#[cfg(feature = "iceoryx2")]
fn iceoryx2(ranks: usize) -> Result<(), String> {
    use atoll_transport::iceoryx2::{self, Control, LaunchOptions};
    if iceoryx2::is_rank_process() {
        let mut endpoint = iceoryx2::join().map_err(|error| error.to_string())?;
        let timings = all(&mut endpoint).map_err(|error| error.to_string())?;
        for Timing { length, bare, with_copies } in timings {
            println!("{length} {bare:e} {with_copies:e}");
        }
        return Ok(());
    }
    let program = std::env::current_exe().map_err(|error| error.to_string())?;
    let command = |_: Rank| {
        let mut command = std::process::Command::new(&program);
        command.args(std::env::args_os().skip(1));
        command
    };
    let exits = iceoryx2::launch(ranks, LaunchOptions::default(), &|| Control::Run, command);
    let exits = exits.map_err(|error| error.to_string())?;
    if let Some(failed) = exits.iter().find(|exit| !exit.status.success()) {
        return Err(format!("rank {}: {}", failed.rank, failed.status));
    }
    print!("{}", String::from_utf8_lossy(&exits[0].stdout));
    Ok(())
}

/// Every length, on this rank among others. Each sends to its two neighbours on a ring, as a strip of tiles does.
fn all(transport: &mut impl Transport) -> Result<Vec<Timing>, TransportError> {
    SIZES.into_iter().map(|length| one(transport, length)).collect()
}

fn one(transport: &mut impl Transport, length: usize) -> Result<Timing, TransportError> {
    let mut ring = Ring::new(transport, length);
    ring.rounds(transport, 3, true)?;
    let seconds = ring.rounds(transport, 3, true)?;
    let slowest = transport.all_max_u64((seconds * 1e9) as u64)?;
    // A fifth of a second, the same number on all ranks.
    let count = (200_000_000 / slowest.max(1)).clamp(5, 5000);
    let (mut bare, mut with_copies) = (Vec::new(), Vec::new());
    for _ in 0..3 {
        bare.push(ring.rounds(transport, count, false)?);
        with_copies.push(ring.rounds(transport, count, true)?);
    }
    Ok(Timing { length, bare: median(bare), with_copies: median(with_copies) })
}

/// What one rank sends to its neighbours, and where from and to.
struct Ring {
    lengths: Vec<usize>,
    source: Vec<u8>,
    sink: Vec<u8>,
    incoming: Incoming,
}

impl Ring {
    fn new(transport: &impl Transport, length: usize) -> Self {
        let (rank, size) = (transport.rank().index(), transport.size());
        let mut lengths = vec![0; size];
        lengths[(rank + 1) % size] = length;
        lengths[(rank + size - 1) % size] = length;
        Self { lengths, source: vec![1; length], sink: vec![0; length], incoming: Incoming::default() }
    }

    /// Seconds per round.
    fn rounds(&mut self, transport: &mut impl Transport, count: u64, copies: bool) -> Result<f64, TransportError> {
        transport.barrier()?;
        self.round(transport, copies)?;
        let start = Instant::now();
        for _ in 0..count {
            self.round(transport, copies)?;
        }
        Ok(start.elapsed().as_secs_f64() / count as f64)
    }

    fn round(&mut self, transport: &mut impl Transport, copies: bool) -> Result<(), TransportError> {
        let outgoing = transport.prepare(&self.lengths)?;
        if copies {
            for (_, message) in outgoing.iter_mut().filter(|(_, message)| !message.is_empty()) {
                message.copy_from_slice(&self.source);
            }
        }
        transport.exchange(&mut self.incoming)?;
        if copies {
            for (_, message) in self.incoming.iter().filter(|(_, message)| !message.is_empty()) {
                self.sink.copy_from_slice(message);
                black_box(&mut self.sink);
            }
        }
        Ok(())
    }
}

/// One copy, and three: what a message costs that is copied on its way once more than it is written and read.
fn memcpy() -> Vec<Timing> {
    let time = |length: usize, copies: usize| {
        let source = vec![1_u8; length];
        let mut sinks = vec![vec![0_u8; length]; copies];
        let count = (200_000_000 / (length + 50)).clamp(5, 1_000_000);
        let start = Instant::now();
        for _ in 0..count {
            for sink in &mut sinks {
                black_box(&mut *sink).copy_from_slice(black_box(&source));
            }
        }
        start.elapsed().as_secs_f64() / count as f64
    };
    SIZES.into_iter().map(|length| Timing { length, bare: time(length, 1), with_copies: time(length, 3) }).collect()
}

/// Half a round trip of blocking messages between two ranks, on the first.
#[cfg(feature = "mpi")]
fn ping_pong() -> Option<Vec<Timing>> {
    use mpi::traits::*;
    let universe = mpi::initialize().expect("MPI starts once");
    let world = universe.world();
    let (first, other) = (world.rank() == 0, world.process_at_rank(1 - world.rank()));
    let timing = |length: usize| {
        let mut buffer = vec![1_u8; length];
        let mut trips = |count: usize| {
            world.barrier();
            let start = Instant::now();
            for _ in 0..count {
                if first {
                    other.send(&buffer[..]);
                    other.receive_into(&mut buffer[..]);
                } else {
                    other.receive_into(&mut buffer[..]);
                    other.send(&buffer[..]);
                }
            }
            start.elapsed().as_secs_f64() / (2 * count) as f64
        };
        trips(3);
        let count = (400_000_000 / (length + 2000)).clamp(5, 5000);
        let half = median((0..3).map(|_| trips(count)).collect());
        Timing { length, bare: half, with_copies: half }
    };
    let timings = SIZES.into_iter().map(timing).collect();
    first.then_some(timings)
}
