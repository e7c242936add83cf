//! One rank's publishers and its subscriber.
//!
//! Each rank has a publish-subscribe service of its own, with one subscriber, itself, and one publisher for each other
//! rank: so every directed pair has a queue and a data segment of its own, and the number of services is that of ranks.

use std::thread::sleep;
use std::time::Duration;

use iceoryx2::config::Config;
use iceoryx2::node::{Node, NodeBuilder};
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::update_connections::UpdateConnections;
use iceoryx2::port::{LoanError, ReceiveError};
use iceoryx2::prelude::{
    Alignment, AllocationStrategy, BackpressureStrategy, FileName, LogLevel, Path as NodePath, PortFactory as _,
    SemanticString as _, ServiceName, SignalHandlingMode, set_log_level,
};
use iceoryx2::service::ipc_threadsafe::Service;
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use rustix::io::Errno;

use super::limits;
use super::memory::{Backed, with_old_bytes};
use super::run_folder::RunFolder;
use crate::Rank;
use crate::frame::{Header, LoanedFrame, LoanedOutgoing, Message};

/// Messages that a queue holds. Lockstep leaves at most two unread.
const QUEUE: usize = 2;

/// Messages of one sender that a receiver may keep: those of three `Incoming` values, and one of the next round, which
/// may be at hand before the present one is complete.
const KEPT: usize = 4;

/// The length of a message, in bytes, for which memory is reserved from the start.
const FIRST_LENGTH: usize = 4096;

/// Messages begin at multiples of this. Not more: the slices of iceoryx2 0.10 begin where only 8 bytes are aligned, and
/// with a greater alignment each growth of a segment loses it one slice, until there are none.
const ALIGNMENT: usize = 8;

/// How long one process waits for another that is just making the same thing.
const CREATION_TIMEOUT: Duration = Duration::from_secs(30);

/// Between two looks at whether other ranks have arrived.
const POLL: Duration = Duration::from_millis(1);

/// The publisher to one rank.
#[derive(Debug)]
struct Port {
    publisher: Publisher<Service, [u8], Header>,
    service: PortFactory<Service, [u8], Header>,
    /// The longest message so far. No shorter one makes the segment grow, which moves it to another place.
    longest: usize,
    backed: Backed,
}

/// One rank's ports. Dropping them discards what peers have not yet received.
#[derive(Debug)]
pub(super) struct Ports {
    /// By destination; none to oneself.
    publishers: Vec<Option<Port>>,
    /// None where there is no other rank.
    subscriber: Option<Subscriber<Service, [u8], Header>>,
    /// Last, as the ports above belong to it.
    node: Node<Service>,
}

/// Why a message could not be sent.
pub(super) enum SendFailure {
    /// The destination does not receive any more.
    NoReceiver,
    /// Something else, as a clause that begins with "it".
    Other(String),
}

impl Ports {
    /// Makes the ports of rank `own` and waits until each other rank has its own, or until `go_on`, which is told for whom it
    /// waits, fails.
    pub(super) fn open<E: From<String>>(
        folder: &RunFolder,
        own: Rank,
        size: usize,
        go_on: impl Fn(Option<Rank>) -> Result<(), E>,
    ) -> Result<Ports, E> {
        let failed = |what: &str, error: &dyn std::fmt::Display| format!("it could not make its {what}: {error}");
        // What it has to say is in its results; the rest is noise on the program's standard error.
        set_log_level(LogLevel::Fatal);
        let config = config(folder, size).ok_or_else(|| {
            format!("it cannot use the folder {}, whose name is too long or not UTF-8", folder.path().display())
        })?;
        let node = NodeBuilder::new()
            .config(&config)
            .signal_handling_mode(SignalHandlingMode::Disabled)
            .create::<Service>()
            .map_err(|error| failed("node", &error))?;
        let mut ports = Ports { publishers: Rank::all(size).map(|_| None).collect(), subscriber: None, node };
        // Every rank begins with another service, its own, so that they do not all make the same one.
        for to in (0..size).filter(|_| size > 1).map(|offset| Rank::from_index((own.index() + offset) % size)) {
            go_on(None)?;
            let service = ports.service(to, size).map_err(|error| failed("service", &error))?;
            if to == own {
                let subscriber = service.subscriber_builder().create().map_err(|error| failed("subscriber", &error))?;
                ports.subscriber = Some(subscriber);
            } else {
                let publisher = service
                    .publisher_builder()
                    .max_loaned_samples(1)
                    .backpressure_strategy(BackpressureStrategy::DiscardData)
                    .initial_max_slice_len(FIRST_LENGTH)
                    .allocation_strategy(AllocationStrategy::PowerOfTwo)
                    .create()
                    .map_err(|error| failed("publisher", &error))?;
                let port = Port { publisher, service, longest: FIRST_LENGTH, backed: Backed::default() };
                ports.publishers[to.index()] = Some(port);
            }
        }
        for (to, port) in Rank::all(size).zip(&ports.publishers) {
            let Some(port) = port else { continue };
            while port.service.dynamic_config().number_of_subscribers() == 0 {
                go_on(Some(to))?;
                sleep(POLL);
            }
            port.publisher.update_connections().map_err(|error| failed("connections", &error))?;
        }
        Ok(ports)
    }

    /// The service by which `to` receives.
    fn service(&self, to: Rank, size: usize) -> Result<PortFactory<Service, [u8], Header>, Box<dyn std::error::Error>> {
        let name = ServiceName::new(&format!("to {to}"))?;
        let alignment = Alignment::new(ALIGNMENT).ok_or("an alignment is a power of two")?;
        let builder = self.node.service_builder(&name).publish_subscribe::<[u8]>().user_header::<Header>();
        let service = builder
            .payload_alignment(alignment)
            .enable_safe_overflow(false)
            .history_size(0)
            .max_publishers(size)
            .max_subscribers(1)
            .max_nodes(size)
            .subscriber_max_buffer_size(QUEUE)
            .subscriber_max_borrowed_samples(KEPT)
            .open_or_create()?;
        Ok(service)
    }

    /// Loans a slice of the given length for each other rank, giving back what was loaned before.
    ///
    /// # Errors
    /// A clause that begins with "it", if there is no memory.
    pub(super) fn loan(&mut self, lengths: &[usize], outgoing: &mut LoanedOutgoing) -> Result<(), String> {
        outgoing.give_back();
        let ports = self.publishers.iter().zip(lengths);
        let growth: usize = ports
            .filter_map(|(port, &length)| port.as_ref().filter(|port| length > port.longest).map(|_| length))
            .fold(0, usize::saturating_add);
        if growth > 0 {
            limits::check_growth(growth as u64)?;
        }
        for ((to, port), &length) in Rank::all(lengths.len()).zip(&mut self.publishers).zip(lengths) {
            match (outgoing.frame(to), port) {
                (LoanedFrame::Loan(place), Some(port)) => {
                    if length > port.longest {
                        port.longest = length;
                        port.backed.forget();
                    }
                    let short = |error: &dyn std::fmt::Display| limits::out_of_memory(to, length, error);
                    let loan = port.publisher.loan_slice_uninit(length).map_err(|error| match error {
                        // More would have to be kept by the receiver than its queue and its hands can hold.
                        LoanError::ExceedsMaxLoans => "it loaned a second slice for one rank".to_owned(),
                        error => short(&error),
                    })?;
                    let mut loan = with_old_bytes(loan);
                    port.backed.ensure(&mut loan).map_err(|error| match error {
                        // An address that is good, but has no page and gets none.
                        Errno::FAULT => short(&"no page is left"),
                        error => short(&error),
                    })?;
                    *place = Some(loan);
                }
                (LoanedFrame::Own(bytes), _) => bytes.resize(length, 0),
                (LoanedFrame::Loan(place), None) => *place = None,
            }
        }
        Ok(())
    }

    /// Sends what was loaned for `to`.
    pub(super) fn send(&self, to: Rank, outgoing: &mut LoanedOutgoing, header: Header) -> Result<(), SendFailure> {
        let LoanedFrame::Loan(place) = outgoing.frame(to) else { return Ok(()) };
        let mut loan = place.take().ok_or_else(|| SendFailure::Other("it sent a message twice".to_owned()))?;
        *loan.user_header_mut() = header;
        match loan.send() {
            Ok(1) => Ok(()),
            Ok(_) => Err(SendFailure::NoReceiver),
            Err(error) => Err(SendFailure::Other(format!("it could not send to rank {to}: {error}"))),
        }
    }

    /// The next message from whichever rank, if there is one.
    ///
    /// # Errors
    /// A clause that begins with "it".
    pub(super) fn receive(&self) -> Result<Option<Message>, String> {
        let Some(subscriber) = &self.subscriber else { return Ok(None) };
        subscriber.receive().map_err(|error| match error {
            ReceiveError::ExceedsMaxBorrows => format!(
                "it keeps the messages of more than {} rounds; pass an old Incoming to exchange, or drop it",
                KEPT - 1
            ),
            error => format!("it could not receive: {error}"),
        })
    }
}

/// iceoryx2 as this run uses it: everything that it leaves lies in the run folder or bears the run's prefix.
fn config(folder: &RunFolder, size: usize) -> Option<Config> {
    let mut config = Config::default();
    config.global.prefix = FileName::new(folder.prefix().as_bytes()).ok()?;
    config.global.set_root_path(&NodePath::new(folder.node_files().to_str()?.as_bytes()).ok()?);
    config.global.creation_timeout = CREATION_TIMEOUT;
    // A dead rank's messages are still to be received. The launcher cleans up when all have ended.
    config.global.service.cleanup_dead_nodes_on_open = false;
    config.global.node.cleanup_dead_nodes_on_creation = false;
    config.global.node.cleanup_dead_nodes_on_destruction = false;
    config.defaults.publish_subscribe.subscriber_expired_connection_buffer = size.max(KEPT);
    Some(config)
}
