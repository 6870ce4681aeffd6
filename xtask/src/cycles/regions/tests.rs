use super::super::flash::WAIT_STATES;
use super::*;

/// Code with `begin` at 0x10 (nop; bx lr), `end` at 0x14 (bx lr), and the program at 0x16.
const FUNCTIONS: [u16; 3] = [0xBF00, 0x4770, 0x4770];
const BEGIN: u32 = 0x10;
const END: u32 = 0x14;
const START: u32 = 0x16;

fn code(program: &[u16]) -> Code {
    Code::of(BEGIN, &[&FUNCTIONS, program].concat())
}

/// Counts of the regions when these addresses are executed in sequence.
fn count(code: &Code, addresses: impl IntoIterator<Item = u32>) -> Outcome<Vec<Count>> {
    let mut regions = Regions::new(code, BEGIN, END);
    for address in addresses {
        regions.execute(&[address])?;
    }
    Ok(regions.finish()?.into_iter().map(|region| region.whole).collect())
}

/// Addresses of a call of `begin`, which returns to the program at `START`.
const CALL: [u32; 3] = [0x8, BEGIN, BEGIN + 2];

#[test]
fn an_empty_region_is_the_call_at_its_end() {
    let code = code(&[0xF7FF, 0xFFFD]); // bl end
    let addresses = [CALL.as_slice(), &[START, END, START + 4]].concat();
    let call = Count { instructions: 1, cycles: 3, flash_cycles: 3 };
    assert_eq!(count(&code, addresses.clone()), Ok(vec![call]));
    assert_eq!(count(&code, [addresses.clone(), addresses].concat()), Ok(vec![call, call]));
}

#[test]
fn a_loop_is_counted_as_by_hand() {
    // mov.w r0, #1000    1
    // subs r0, #1        1
    // bne                3; 1 the last time
    // bl end             3
    let code = code(&[0xF44F, 0x707A, 0x3801, 0xD1FD, 0xF7FF, 0xFFF9]);
    let rounds = (0..1000).flat_map(|_| [START + 4, START + 6]);
    let addresses = CALL.into_iter().chain([START]).chain(rounds).chain([START + 8, END]);
    let cycles = 1 + 1000 + 999 * 3 + 1 + 3;
    // The loop stands in one line of flash.
    let expected = Count { instructions: 1 + 2000 + 1, cycles, flash_cycles: cycles + WAIT_STATES };
    assert_eq!(count(&code, addresses), Ok(vec![expected]));
}

#[test]
fn every_region_starts_with_cold_caches_and_waits_as_the_manual_allows_at_most() {
    // nop, four times                     line 1
    // subs r0, #1; bne                    lines 1 and 2
    // bl end
    let code = code(&[0xBF00, 0xBF00, 0xBF00, 0xBF00, 0x3801, 0xD1FD, 0xF7FF, 0xFFF7]);
    let rounds = [START + 8, START + 10].repeat(3);
    let nops = [START, START + 2, START + 4, START + 6];
    let region = [CALL.as_slice(), &nops, &rounds, &[START + 12, END]].concat();
    // Line 1 comes after 5 cycles, line 2 after 11. The first round ends in cycle 14, when line 3 is read until 17.
    // If line 2 is not kept, it is read from cycle 18 and, the next round, from 30 on. It comes after 23 and 35.
    let flash_cycles = 35 + 1 + 3;
    let expected = Count { instructions: 11, cycles: 4 + 2 * 4 + 2 + 3, flash_cycles };
    assert_eq!(count(&code, region.repeat(2)), Ok(vec![expected; 2]));
}

#[test]
fn what_is_watched_is_counted_besides() {
    let code = code(&[0x3001, 0x3001, 0xF7FF, 0xFFFB]); // adds r0, #1, twice; bl end
    let watched = Watched {
        exponential: START + 2..START + 4,
        assembly: vec![START + 4..START + 6, START..START + 2],
    };
    let mut regions = Regions::new(&code, BEGIN, END).watching(watched);
    for address in [0x8, BEGIN, BEGIN + 2, START, START + 2, START + 4, END, START + 8] {
        regions.execute(&[address]).unwrap();
    }
    let whole = Count { instructions: 3, cycles: 5, flash_cycles: 5 + WAIT_STATES };
    let exponential = Count { instructions: 1, cycles: 1, flash_cycles: 1 };
    let assembly = Count { instructions: 2, cycles: 4, flash_cycles: 4 + WAIT_STATES };
    assert_eq!(regions.finish(), Ok(vec![Region { whole, exponential, assembly }]));
}

#[test]
fn an_exception_in_a_region_is_found() {
    let code = code(&[0x3001, 0x3001]); // adds r0, #1, twice
    let error = count(&code, [CALL.as_slice(), &[START, 0x400]].concat()).unwrap_err();
    assert!(error.contains("0x00000400 was executed after 0x00000016"), "{error}");
}

#[test]
fn what_the_decoder_does_not_know_is_named_with_its_address_and_bytes() {
    let code = code(&[0xEE31, 0x0B02, 0xB650]); // vadd.f64 d0, d1, d2; setend
    let error =
        |start: u32| count(&code, [CALL.as_slice(), &[start, start + 4]].concat()).unwrap_err();
    assert!(
        error(START).starts_with("the instruction ee31 0b02 at 0x00000016"),
        "{}",
        error(START)
    );
    let other = error(START + 4);
    assert!(other.starts_with("the instruction b650 at 0x0000001a is not known"), "{other}");
}

#[test]
fn a_stop_in_a_region_is_refused() {
    let code = code(&[0xBEAB, 0xBF00]); // bkpt 0xab
    let error = count(&code, [CALL.as_slice(), &[START, START + 2]].concat()).unwrap_err();
    assert!(error.contains("at 0x00000016 has no place in a region"), "{error}");
}

#[test]
fn a_region_without_an_end_is_refused() {
    let code = code(&[0xBF00, 0xBF00]);
    let addresses = [CALL.as_slice(), &[START, START + 2]].concat();
    assert_eq!(count(&code, addresses), Err("the program ended in its region 1".into()));
    let nested = [CALL.as_slice(), &[START, BEGIN]].concat();
    assert!(count(&code, nested).is_err());
}

/// Code with bl 0x30 at 0x20, blx r3 at 0x24, and an untraced function of 8 bytes at 0x30.
fn code_that_calls() -> Code {
    let mut halfwords = FUNCTIONS.to_vec();
    halfwords.resize(8, 0xBF00);
    halfwords.extend([0xF000, 0xF806, 0x4798]);
    halfwords.resize(20, 0xBF00);
    Code::of(BEGIN, &halfwords).with_symbol("_ZN7library9left_out1fE", 0x30, 8)
}

#[test]
fn a_region_that_calls_what_is_not_traced_is_refused_by_the_name_of_that() {
    let code = code_that_calls();
    let counted = |addresses: &[u32]| {
        let untraced = Untraced::of(&code, &[&["9left_out"]]);
        let mut regions = Regions::new(&code, BEGIN, END).without(untraced);
        addresses.iter().try_for_each(|address| regions.execute(&[*address]))?;
        regions.finish()
    };
    let outside = [&[0x20, 0x30], CALL.as_slice(), &[0x24, END, 0x26]].concat();
    assert_eq!(counted(&outside).map(|counted| counted.len()), Ok(1));
    for call in [0x20, 0x24] {
        let error = counted(&[CALL.as_slice(), &[call, 0x30]].concat()).unwrap_err();
        assert_eq!(
            error,
            "region 1 calls _ZN7library9left_out1fE, which is not traced: take it out of \
             xtask/src/cycles/untraced.rs"
        );
    }
}

#[test]
fn a_call_that_comes_back_at_once_went_where_nothing_is_traced() {
    let code = code_that_calls();
    for (call, behind) in [(0x20, 0x24), (0x24, 0x26)] {
        let error = count(&code, [CALL.as_slice(), &[call, behind]].concat()).unwrap_err();
        assert_eq!(error, format!("the call at {call:#010x} leads to code that is not traced"));
    }
}

#[test]
fn a_branch_within_a_block_is_refused() {
    let code = code(&[0xD100, 0xBF00, 0xBF00]); // bne; nop
    let mut regions = Regions::new(&code, BEGIN, END);
    CALL.iter().try_for_each(|address| regions.execute(&[*address])).unwrap();
    let error = regions.execute(&[START, START + 2]).unwrap_err();
    assert_eq!(error, "0x00000016 may branch, and is not the last of its block");
}
