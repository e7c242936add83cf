//! Catches panics without a word.

use std::cell::Cell;
use std::panic::{self, AssertUnwindSafe};
use std::sync::Once;
use std::thread;

static HOOK: Once = Once::new();

thread_local! {
    static QUIET: Cell<bool> = const { Cell::new(false) };
}

/// Does the work, and catches its panic, of which nothing is printed. Panics of other threads are printed as ever. Whatever
/// the work was changing is of no use after a panic.
pub(crate) fn catch<R>(work: impl FnOnce() -> R) -> thread::Result<R> {
    HOOK.call_once(|| {
        let usual = panic::take_hook();
        panic::set_hook(Box::new(move |panic| {
            if !QUIET.get() {
                usual(panic);
            }
        }));
    });
    QUIET.set(true);
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    QUIET.set(false);
    result
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_ends_with_the_work() {
        assert!(catch(|| QUIET.get()).unwrap());
        assert!(catch(|| panic!("nobody hears this")).is_err());
        assert!(!QUIET.get());
    }
}
