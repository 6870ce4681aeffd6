//! Digests.

use taxel_data::digest::{digest, of_debug, of_table};

#[test]
fn the_digest_of_a_table_is_that_of_its_names_and_numbers() {
    let of = |names: &[&str], values: &[f64]| of_table(names, values.iter().copied());
    let whole = of(&["a", "b"], &[1.0, f64::NAN, 0.0, 3.0]);
    assert_eq!(whole, of(&["a", "b"], &[1.0, -f64::NAN, -0.0, 3.0]));
    assert_ne!(whole, of(&["a", "b"], &[1.0, f64::NAN, 0.0, 4.0]));
    assert_ne!(whole, of(&["a", "c"], &[1.0, f64::NAN, 0.0, 3.0]));
}

#[test]
fn the_digest_is_crc_64_xz() {
    assert_eq!(of_debug(&vec![1, 2]), digest(b"[1, 2]"));
    assert_eq!(digest(b"123456789"), 0x995d_c9bb_df19_39fa); // the catalogue's check value
}
