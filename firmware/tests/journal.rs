//! The journal survives power cuts at any word, flipped bits, and pages that hold anything.

use crate::mock::Flash;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use taxel_core::checksum::CRC_32;
use taxel_firmware::store::{Journal, KeepError, Kind, PAGE_BYTES, Slot};

/// Kinds of settings.
const SETTINGS: [Kind; 3] = [Kind::Configuration, Kind::Constants, Kind::Baseline];

/// What both pages hold.
fn bytes_of(journal: &mut Journal<Flash>) -> [Vec<u8>; 2] {
    journal.pages().each_ref().map(|page| page.bytes().to_vec())
}

fn erases(journal: &mut Journal<Flash>) -> usize {
    journal.pages().iter().map(|page| page.erases).sum()
}

/// A journal with the constants `[7; 100]`, in its second page.
fn with_constants() -> Journal<Flash> {
    let mut journal = Flash::journal();
    journal.keep(Kind::Constants, &[&[7; 100]]).unwrap();
    journal
}

/// Places of the start items in a page.
fn starts(page: &[u8]) -> Vec<usize> {
    let places = (0..PAGE_BYTES).step_by(32);
    places.filter(|place| page[*place..].starts_with(b"ITEM\xFF\0\x04\0")).collect()
}

#[test]
fn no_flipped_bit_of_a_start_item_loses_anything() {
    let mut journal = with_constants();
    let pages = bytes_of(&mut journal);
    let starts = starts(&pages[1]);
    assert_eq!(starts.len(), 2);
    for bit in starts.iter().flat_map(|start| 8 * start..8 * (start + 24)) {
        let mut page = pages[1].clone();
        page[bit / 8] ^= 1 << (bit % 8);
        let mut journal = Flash::journal_of([&pages[0], &page]);
        for _ in 0..2 {
            assert_eq!(journal.recover(), Ok(()));
            assert_eq!(journal.read(Kind::Constants), Some(&[7; 100][..]), "{bit}");
        }
        let whole = bytes_of(&mut journal).iter().map(|page| self::starts(page).len()).max();
        assert!(whole >= Some(2), "{bit}");
    }
}

#[test]
fn the_number_of_a_page_goes_on_at_0_behind_its_largest_value() {
    let mut pages = bytes_of(&mut with_constants());
    for start in starts(&pages[1]) {
        let item = &mut pages[1][start..];
        item[8..12].fill(0xFF);
        let crc = CRC_32.checksum(&item[4..12]);
        item[12..16].copy_from_slice(&crc.to_le_bytes());
    }
    let mut journal = Flash::journal_of([&pages[0], &pages[1]]);
    for number in 0..=255 {
        assert_eq!(journal.keep(Kind::Configuration, &[&[number; 40]]), Ok(true));
        assert_eq!(journal.read(Kind::Configuration), Some(&[number; 40][..]));
        assert_eq!(journal.read(Kind::Constants), Some(&[7; 100][..]), "{number}");
    }
    assert!(erases(&mut journal) > 1);
}

#[test]
fn pages_that_hold_anything_are_no_harm_and_can_be_used() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(11);
    for case in 0..1000_u32 {
        let mut pages = [0, 1].map(|_| vec![0; PAGE_BYTES]);
        pages.iter_mut().for_each(|page| random.fill_bytes(page));
        // Half of them are noise behind the marks of items.
        let cells = pages.iter_mut().flat_map(|page| page.as_chunks_mut::<16>().0);
        for cell in cells.filter(|_| case % 2 == 1) {
            let kind = [0, 1, 2, 3, 4, 5, 6, 0xFF][random.next_u32() as usize % 8];
            let length = cell[6];
            cell[..8].copy_from_slice(&[b'I', b'T', b'E', b'M', kind, 0, length, 0]);
        }
        let mut journal = Flash::journal_of([&pages[0], &pages[1]]);
        assert!(Kind::ALL.into_iter().all(|kind| journal.read(kind).is_none()), "case {case}");
        for (kind, length) in Kind::ALL.into_iter().zip([40, 187, 585, 16]) {
            let new: Vec<u8> = (0..length).map(|i| (i * 7 + case * 13) as u8).collect();
            assert_eq!(journal.keep(kind, &[&new]), Ok(true), "case {case}");
            assert_eq!(journal.read(kind), Some(&new[..]), "case {case}");
        }
    }
}

#[test]
fn what_does_not_fit_is_refused_and_nothing_is_lost() {
    let mut journal = Flash::journal();
    journal.keep(Kind::Constants, &[&[7; 100]]).unwrap();
    let too_large = Err(KeepError::TooLarge);
    assert_eq!(journal.keep(Kind::Baseline, &[&[1; PAGE_BYTES - 100]]), too_large);
    assert_eq!(journal.read(Kind::Constants), Some(&[7; 100][..]));
    assert_eq!(erases(&mut journal), 1); // before the first one was kept
    journal.keep(Kind::Constants, &[]).unwrap();
    // Beside three small items, room for four start items.
    let most = PAGE_BYTES - 3 * 32 - 4 * 32 - 16;
    for (length, outcome) in [(most + 1, too_large), (most, Ok(true))] {
        assert_eq!(journal.keep(Kind::Baseline, &[&vec![1; length]]), outcome);
    }
    // What an upload needs fits beside it.
    assert_eq!(journal.keep(Kind::Models, &[&[2; 16]]), Ok(true));
    assert_eq!(journal.read(Kind::Baseline).map(<[u8]>::len), Some(most));
}

#[test]
fn settings_of_16_rows_and_32_columns_fit_after_many_changes() {
    let mut journal = with_constants();
    let lengths = [40, 11 + 4 * (16 + 2 * 32), 9 + 4 * 16 * 32];
    for seed in 0..30_u8 {
        for (kind, length) in SETTINGS.into_iter().zip(lengths) {
            let bytes = vec![seed; length];
            assert_eq!(journal.keep(kind, &[&bytes]), Ok(true), "{seed}");
            assert_eq!(journal.read(kind), Some(&bytes[..]), "{seed}");
        }
    }
    assert!(erases(&mut journal) > 4);
}
