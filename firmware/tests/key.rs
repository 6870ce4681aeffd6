//! The device's key in its flash: what was there before, what decays, and who may set it again.

use firmware::seal::{KEY_BYTES, Key};
use firmware::store::{DeviceKey, Slot};
use mock_board::Flash;
use rand_core::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

const OURS: Key = [0xA5; KEY_BYTES];
const OTHER: Key = [0x3C; KEY_BYTES];
/// Words of a copy, of the key's start in it, and of its first mark.
const COPY: usize = 12;
const KEY: usize = 1;
const FIRST_MARK: usize = 10;

/// The key that a start finds, once it has made it firm; `Err` if it is damaged.
fn start(flash: &mut Flash) -> Result<Option<Key>, ()> {
    let found = DeviceKey::find(flash.bytes());
    assert!(found.settle(flash).is_ok());
    match found {
        DeviceKey::None => Ok(None),
        DeviceKey::Set(key) => Ok(Some(key)),
        DeviceKey::Damaged => Err(()),
    }
}

#[test]
fn whatever_its_flash_held_before_a_key_is_set_in_two_copies() {
    let old_code = [0x9E, 0x37, 0x79, 0xB9].repeat(Flash::KEY_BYTES / 4);
    let nearly_full = old_code.len() - 4 * COPY;
    for held in [&[][..], &[0; Flash::KEY_BYTES], &old_code, &old_code[..nearly_full]] {
        let mut flash = Flash::without_key();
        flash.flash(0, held);
        assert_eq!(start(&mut flash), Ok(None));
        assert_eq!(DeviceKey::set(&mut flash, &OURS), Ok(()));
        flash.decay(KEY, 1);
        assert_eq!(start(&mut flash), Ok(Some(OURS)));
    }
}

#[test]
fn old_code_is_never_taken_for_a_decayed_key() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    for sector in 0..2000 {
        let mut code = [0; Flash::KEY_BYTES];
        random.fill_bytes(&mut code);
        assert!(matches!(DeviceKey::find(&code), DeviceKey::None), "{sector}");
    }
    // Not even where all its words are marks but for a bit.
    let near = b"KGY1".repeat(Flash::KEY_BYTES / 4);
    assert!(matches!(DeviceKey::find(&near), DeviceKey::None));
}

#[test]
fn no_flipped_bit_turns_the_key_off_or_takes_it_away_and_a_start_makes_it_good() {
    for bit in 0..8 * Flash::KEY_BYTES {
        let mut flash = Flash::with_key(&OURS);
        for bit in [bit, 32 * COPY + bit % (32 * COPY)] {
            flash.decay(bit / 32, 1 << (bit % 32));
            assert_eq!(start(&mut flash), Ok(Some(OURS)), "{bit}");
        }
    }
}

#[test]
fn with_both_copies_decayed_the_owner_alone_can_set_the_key_again() {
    let mut flash = Flash::with_key(&OURS);
    for (copy, words) in [(0, 8), (COPY, 9)] {
        (0..words).for_each(|word| flash.decay(copy + KEY + word % 8, 1 << word));
    }
    assert_eq!(start(&mut flash), Err(()));
    let mut wrong = OURS;
    wrong[20] ^= 2; // a ninth bit beside the eight
    assert_eq!(DeviceKey::mend(&mut flash, &OTHER), Ok(false));
    assert_eq!(DeviceKey::mend(&mut flash, &wrong), Ok(false));
    assert_eq!(start(&mut flash), Err(()));
    assert_eq!(DeviceKey::mend(&mut flash, &OURS), Ok(true));
    assert_eq!(start(&mut flash), Ok(Some(OURS)));
}

#[test]
fn a_copy_whose_marks_are_overwritten_is_no_key() {
    let mut flash = Flash::with_key(&OURS);
    for copy in [0, COPY] {
        flash.flash(4 * (copy + FIRST_MARK), &[0; 8]);
    }
    assert_eq!(start(&mut flash), Ok(None));
}
