//! Slices of memory shared with other processes, loaned for one message each.

use iceoryx2::prelude::ZeroCopySend;
use iceoryx2::sample::Sample;
use iceoryx2::sample_mut::SampleMut;
use iceoryx2::service::ipc_threadsafe::Service;

use crate::Rank;

/// What a message says about itself. Its length is that of its slice.
#[derive(Clone, Copy, Debug, Default, ZeroCopySend)]
#[repr(C)]
pub(crate) struct Header {
    /// The round it belongs to, counted from 0.
    pub(crate) round: u64,
    /// The sender's flag word, upper half first.
    pub(crate) flag_word: [u64; 2],
    /// The sending rank.
    pub(crate) source: u32,
    /// Fills the header up, so that every byte of it has a value.
    pub(crate) unused: u32,
}

/// A buffer to fill: a slice that one other process will read.
pub(crate) type Loan = SampleMut<Service, [u8], Header>;

/// A received message: a slice that another process filled. It goes back to that process when this is dropped.
pub(crate) type Message = Sample<Service, [u8], Header>;

/// The buffers that one rank fills.
#[derive(Debug)]
pub(crate) struct LoanedOutgoing {
    frames: Vec<LoanedFrame>,
}

/// The buffer for one destination.
#[derive(Debug)]
pub(crate) enum LoanedFrame {
    /// To oneself: memory of this process, which is moved.
    Own(Vec<u8>),
    /// To another rank. Absent before the first prepare, and from the sending to the next one.
    Loan(Option<Loan>),
}

impl LoanedFrame {
    pub(super) fn bytes(&mut self) -> &mut [u8] {
        match self {
            LoanedFrame::Own(bytes) => bytes,
            LoanedFrame::Loan(loan) => loan.as_mut().map_or(&mut [], Loan::payload_mut),
        }
    }
}

impl LoanedOutgoing {
    /// The buffers of rank `own` among `size`.
    pub(crate) fn new(own: Rank, size: usize) -> LoanedOutgoing {
        let frame = |to| if to == own { LoanedFrame::Own(Vec::new()) } else { LoanedFrame::Loan(None) };
        LoanedOutgoing { frames: Rank::all(size).map(frame).collect() }
    }

    pub(super) fn to(&mut self, rank: Rank) -> &mut [u8] {
        self.frames[rank.index()].bytes()
    }

    pub(super) fn iter_mut(&mut self) -> std::slice::IterMut<'_, LoanedFrame> {
        self.frames.iter_mut()
    }

    /// Gives back what was loaned and not sent.
    pub(crate) fn give_back(&mut self) {
        for frame in &mut self.frames {
            if let LoanedFrame::Loan(loan) = frame {
                *loan = None;
            }
        }
    }

    /// The buffer for `to`, as what it is.
    pub(crate) fn frame(&mut self, to: Rank) -> &mut LoanedFrame {
        &mut self.frames[to.index()]
    }
}

/// The buffers that one rank received.
#[derive(Debug, Default)]
pub(crate) struct LoanedIncoming {
    /// By source; none from oneself.
    messages: Vec<Option<Message>>,
    /// From oneself.
    own: Vec<u8>,
}

impl LoanedIncoming {
    pub(super) fn from(&self, rank: Rank) -> &[u8] {
        self.messages[rank.index()].as_ref().map_or(&self.own, Message::payload)
    }

    /// Gives every message back and makes room for one from each rank.
    pub(crate) fn empty(&mut self, size: usize) {
        self.messages.clear();
        self.messages.resize_with(size, || None);
    }

    /// Puts a received message in its place.
    pub(crate) fn put(&mut self, from: Rank, message: Message) {
        self.messages[from.index()] = Some(message);
    }

    /// The message to oneself.
    pub(crate) fn own_mut(&mut self) -> &mut Vec<u8> {
        &mut self.own
    }
}
