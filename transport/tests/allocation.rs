//! A warm exchange allocates no message buffers: those that arrive are the next to be filled.

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

use atoll_transport::channel::{self, ChannelOptions};
use atoll_transport::{Incoming, Rank, Transport};

/// Messages of one direction, in bytes. The other direction is short, so a buffer that is replaced by a shorter one
/// shows when it has to grow again.
const LONG: usize = 50_000;

/// Smaller requests are not counted: the channels' own lists of waiting threads, and this test.
const COUNTED: usize = LONG / 2;

static LARGE_ALLOCATIONS: AtomicUsize = AtomicUsize::new(0);

struct CountLarge;

// SAFETY: every call is passed on unchanged to the system allocator, which keeps the contract.
unsafe impl GlobalAlloc for CountLarge {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if layout.size() >= COUNTED {
            LARGE_ALLOCATIONS.fetch_add(1, SeqCst);
        }
        // SAFETY: the caller keeps the contract of `alloc`, which is the same.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller keeps the contract of `dealloc`, and `pointer` came from the system allocator.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: CountLarge = CountLarge;

#[test]
fn warm_exchanges_recycle_their_buffers() {
    let counts = channel::run(3, ChannelOptions::default(), |mut endpoint| {
        let own = endpoint.rank();
        let lengths: Vec<usize> = Rank::all(3).map(|to| if to > own { LONG } else { 10 }).collect();
        let mut incoming = Incoming::default();
        let mut rounds = |count: usize| {
            for _ in 0..count {
                endpoint.prepare(&lengths).unwrap();
                endpoint.exchange(&mut incoming).unwrap();
            }
            // No rank is more than one round away, and the next rounds are warm as well.
            LARGE_ALLOCATIONS.load(SeqCst)
        };
        let warm = rounds(20);
        (warm, rounds(200))
    });
    for (warm, end) in counts.into_iter().map(Result::unwrap) {
        assert!(warm > 0, "the allocator is not the one that counts");
        assert_eq!(warm, end, "buffers allocated in warm rounds");
    }
}
