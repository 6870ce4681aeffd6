//! Doing pieces of work, two at a time.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

/// Number of pieces at a time: a program in QEMU takes one core, and small computers have two.
const AT_A_TIME: usize = 2;

/// Does `work` on all `pieces`. Passes the results to `take` in the order of the pieces, each as soon as it and
/// all before it are done.
pub fn work_through<T: Sync, R: Send>(
    pieces: &[T],
    work: impl Fn(&T) -> R + Sync,
    mut take: impl FnMut(&T, R),
) {
    let next = AtomicUsize::new(0);
    let (done, finished) = mpsc::channel();
    thread::scope(|scope| {
        for _ in 0..AT_A_TIME {
            let (done, next, work) = (done.clone(), &next, &work);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(piece) = pieces.get(index) else { return };
                    // Sending fails only if the receiver has panicked.
                    let _ = done.send((index, work(piece)));
                }
            });
        }
        drop(done);

        let (mut early, mut turn) = (BTreeMap::new(), 0);
        for (index, result) in finished {
            early.insert(index, result);
            while let Some(result) = early.remove(&turn) {
                take(&pieces[turn], result);
                turn += 1;
            }
        }
    });
}

#[cfg(test)]
mod tests {
    use std::sync::Barrier;
    use std::time::Duration;

    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_pieces() {
        // The first piece takes longest: all others are done before it.
        let pieces = [60, 0, 20, 0, 5, 0, 0];
        let mut taken = Vec::new();
        let work = |milliseconds: &u64| {
            thread::sleep(Duration::from_millis(*milliseconds));
            2 * milliseconds
        };
        work_through(&pieces, work, |piece, result| taken.push((*piece, result)));
        assert_eq!(taken, pieces.map(|piece| (piece, 2 * piece)));
        work_through(&[], work, |_, _| panic!("there is nothing to take"));
    }

    #[test]
    fn two_pieces_are_done_at_a_time_and_no_more() {
        let (busy, both) = (AtomicUsize::new(0), Barrier::new(2));
        let work = |_: &u8| {
            assert!(busy.fetch_add(1, Ordering::SeqCst) < AT_A_TIME);
            // No piece passes alone.
            both.wait();
            busy.fetch_sub(1, Ordering::SeqCst);
            both.wait();
        };
        let mut taken = 0;
        work_through(&[0; 8], work, |_, ()| taken += 1);
        assert_eq!(taken, 8);
    }
}
