//! A fixed number of buffers that go back and forth between who fills and who empties them.

use std::sync::mpsc::{self, Receiver, RecvTimeoutError, Sender};
use std::time::Duration;

/// The end of who fills them.
#[derive(Debug)]
pub(super) struct Buffers<T> {
    back: Receiver<T>,
    /// One that came back and was not taken yet.
    spare: Option<T>,
    /// How many may still be made.
    unmade: usize,
}

impl<T: Default> Buffers<T> {
    /// So many buffers, made when they are needed, and where they come back to.
    pub(super) fn new(count: usize) -> (Self, Sender<T>) {
        let (sender, back) = mpsc::channel();
        (Self { back, spare: None, unmade: count }, sender)
    }

    /// A buffer to fill, once there is one. None if nobody will give any back.
    pub(super) fn take(&mut self) -> Option<T> {
        // One that was used has its memory already.
        if let Some(buffer) = self.spare.take().or_else(|| self.back.try_recv().ok()) {
            return Some(buffer);
        }
        if self.unmade > 0 {
            self.unmade -= 1;
            return Some(T::default());
        }
        self.back.recv().ok()
    }

    /// Waits until [`take`](Self::take) need not, but no longer than `patience`, and says whether that is so.
    pub(super) fn wait(&mut self, patience: Duration) -> bool {
        if self.spare.is_none() && self.unmade == 0 {
            match self.back.recv_timeout(patience) {
                Ok(buffer) => self.spare = Some(buffer),
                Err(RecvTimeoutError::Timeout) => return false,
                Err(RecvTimeoutError::Disconnected) => {}
            }
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;

    #[test]
    fn no_more_are_made_than_were_allowed() {
        let (mut buffers, back) = Buffers::<Vec<u8>>::new(2);
        let (first, second) = (buffers.take().unwrap(), buffers.take().unwrap());
        let third = thread::scope(|scope| {
            let third = scope.spawn(|| buffers.take());
            back.send(vec![7]).unwrap();
            third.join().unwrap()
        });
        assert_eq!((first, second, third), (vec![], vec![], Some(vec![7])));
        assert!(!buffers.wait(Duration::from_millis(1)));
        back.send(vec![8]).unwrap();
        assert!(buffers.wait(Duration::ZERO) && buffers.wait(Duration::ZERO));
        assert_eq!(buffers.take(), Some(vec![8]));
        drop(back);
        assert!(buffers.wait(Duration::from_secs(100)));
        assert_eq!(buffers.take(), None);
    }
}
