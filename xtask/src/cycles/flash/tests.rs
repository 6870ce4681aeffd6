//! Cases counted by hand. Addresses begin at a line; every line of 16 bytes takes the port 6 cycles.

use super::*;

const NO_LITERAL: Range<u32> = 0..0;

/// Cycles of instructions of one cycle and `bytes` each, one behind the other, at the addresses `code`.
fn straight(flash: &mut Flash, code: Range<u32>, bytes: u32) -> u64 {
    let starts = code.step_by(bytes as usize);
    starts.map(|start| flash.execute(&(start..start + bytes), &NO_LITERAL, 1)).sum()
}

#[test]
fn prefetching_hides_all_but_the_first_read_from_code_of_short_instructions() {
    for keeps in Keeps::ALL {
        // Line 0 is read in cycles 0 to 5. Every other line is there when the 8 instructions before it are done.
        let mut flash = Flash::cold(keeps);
        assert_eq!(straight(&mut flash, 0..64, 2), 5 + 32);
    }
}

#[test]
fn prefetching_hides_a_part_from_code_of_long_instructions() {
    for keeps in Keeps::ALL {
        // The port needs 6 cycles for a line, its 4 instructions take 4: 2 are waited for the lines 1, 2, 3.
        let mut flash = Flash::cold(keeps);
        assert_eq!(straight(&mut flash, 0..64, 4), 5 + 16 + 3 * 2);
    }
}

#[test]
fn a_branch_waits_until_the_prefetch_that_it_made_useless_is_over() {
    let mut flash = Flash::cold(Keeps::Executed);
    // Done in cycle 8; line 1 is read in cycles 6 to 11. Line 10 comes after 12 + 5.
    assert_eq!(flash.execute(&(0..2), &NO_LITERAL, 3), 5 + 3);
    assert_eq!(flash.execute(&(160..162), &NO_LITERAL, 1), (17 - 8) + 1);
}

#[test]
fn a_loop_that_fits_the_cache_waits_in_its_first_pass_alone() {
    let mut flash = Flash::cold(Keeps::Executed);
    assert_eq!(straight(&mut flash, 0..1024, 4), 256 + 5 + 63 * 2);
    for _ in 0..3 {
        assert_eq!(straight(&mut flash, 0..1024, 4), 256);
    }
}

#[test]
fn a_loop_waits_in_every_pass_if_prefetched_lines_are_not_kept() {
    let mut flash = Flash::cold(Keeps::Missed);
    // Lines 0 to 3, and line 4 is read for nothing.
    assert_eq!(straight(&mut flash, 0..64, 4), 16 + 5 + 3 * 2);
    // Cycle 27: line 4 is still read until 29. Then come line 1 after 30 + 5, and lines 2 and 3 after 6 more each.
    assert_eq!(straight(&mut flash, 0..64, 4), (47 + 4) - 27);
}

#[test]
fn a_literal_is_waited_for_once() {
    let mut flash = Flash::cold(Keeps::Executed);
    // Code comes after 5 cycles. The prefetch of line 1 would begin in cycle 6: the literal is read in its place and
    // comes after 11.
    assert_eq!(flash.execute(&(0..2), &(64..68), 2), 11 + 2);
    // The same line of data again.
    assert_eq!(flash.execute(&(2..4), &(68..76), 2), 2);
    // Cycle 15. Line 1 is read in cycles 12 to 17, so this literal comes after 18 + 5.
    assert_eq!(flash.execute(&(4..6), &(80..84), 2), (23 - 15) + 2);
    // Cycle 25: line 1 is there.
    assert_eq!(flash.execute(&(16..18), &NO_LITERAL, 1), 1);
}

#[test]
fn eight_lines_of_literals_are_kept() {
    let mut flash = Flash::cold(Keeps::Executed);
    straight(&mut flash, 0..2, 2);
    let literal = |line: u32| line * 16..line * 16 + 4;
    let mut load = |line| flash.execute(&(2..4), &literal(line), 100);
    for line in 10..18 {
        assert!(load(line) > 100);
    }
    assert_eq!(load(10), 100);
    // The ninth takes the place of 11, which was used least recently.
    assert_eq!((load(18), load(10), load(11)), (105, 100, 105));
}
