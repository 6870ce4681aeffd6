//! Doing pieces of work, two at a time.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

/// Number of pieces at a time: a test, or a program in QEMU, takes one core, and small computers have two.
const AT_A_TIME: usize = 2;

/// Does `work` on all `pieces`, telling it the number of the worker. Passes the results to `take` in the order of the
/// pieces, each as soon as it and all before it are done.
pub fn work_through<T: Sync, R: Send>(
    pieces: &[T],
    work: impl Fn(&T, usize) -> R + Sync,
    mut take: impl FnMut(&T, R),
) {
    let next = AtomicUsize::new(0);
    let (done, finished) = mpsc::channel();
    thread::scope(|scope| {
        for worker in 0..AT_A_TIME {
            let (done, next, work) = (done.clone(), &next, &work);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(piece) = pieces.get(index) else { return };
                    // Sending fails only if the receiver has panicked.
                    let _ = done.send((index, work(piece, worker)));
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

/// Results of `work` on all `pieces`, in their order.
pub fn results<T: Sync, R: Send>(pieces: &[T], work: impl Fn(&T, usize) -> R + Sync) -> Vec<R> {
    let mut results = Vec::new();
    work_through(pieces, work, |_, result| results.push(result));
    results
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_pieces_of_which_no_more_than_two_are_done_at_a_time() {
        // The first piece takes longest: all others are done before it.
        let pieces = [60, 0, 20, 0, 5, 0, 0];
        let busy = AtomicUsize::new(0);
        let work = |milliseconds: &u64, _| {
            assert!(busy.fetch_add(1, Ordering::SeqCst) < AT_A_TIME);
            thread::sleep(Duration::from_millis(*milliseconds));
            busy.fetch_sub(1, Ordering::SeqCst);
            2 * milliseconds
        };
        assert_eq!(results(&pieces, work), pieces.map(|piece| 2 * piece));
        assert!(results(&[], work).is_empty());
    }
}
