//! A few seeds of each sweep over power cuts, decay and attacks. `cargo xtask torture` takes many.

use mock_board::sweep::{
    Cuts, Job, abort_and_decay, cut_key, cut_model, cut_settings, forge, upload_to_worn,
};

/// Runs `case` for so many seeds; returns what each gives.
fn sweep<T>(seeds: u64, case: impl Fn(u64) -> Result<T, String>) -> Vec<T> {
    let case = |seed| case(seed).unwrap_or_else(|why| panic!("seed {seed}: {why}"));
    (0..seeds).map(case).collect()
}

/// Sweeps over cuts, of which many must be made, and some in every quarter of the work.
fn cut_everywhere(seeds: u64, case: impl Fn(u64) -> Result<Cuts, String>) {
    let cases = sweep(seeds, case);
    let cuts: u64 = cases.iter().map(|case| case.count).sum();
    let quarters: Vec<usize> = cases.iter().map(|case| case.quarter).collect();
    let quarters = counts::<4>(&quarters);
    assert!(
        cuts > 1000 && quarters.iter().all(|cases| 16 * cases > seeds as usize),
        "{cuts}, {quarters:?}"
    );
}

/// How often each of the first `N` outcomes came about.
fn counts<const N: usize>(outcomes: &[usize]) -> [usize; N] {
    std::array::from_fn(|wanted| outcomes.iter().filter(|outcome| **outcome == wanted).count())
}

#[test]
fn power_lost_in_an_upload_or_an_undo_leaves_the_old_or_the_new_model() {
    for job in [Job::Upload, Job::Undo] {
        cut_everywhere(48, |seed| cut_model(job, seed));
    }
}

#[test]
fn power_lost_while_a_setting_is_kept_leaves_the_old_or_the_new_one() {
    cut_everywhere(48, cut_settings);
}

#[test]
fn power_lost_while_a_key_is_set_leaves_no_key_or_that_one() {
    cut_everywhere(96, cut_key);
}

#[test]
fn an_upload_that_was_not_confirmed_never_comes_into_force_even_if_the_other_slot_decays() {
    let outcomes = counts::<3>(&sweep(200, abort_and_decay));
    assert!(outcomes.iter().all(|count| *count > 0), "{outcomes:?}");
}

#[test]
fn an_upload_to_worn_flash_comes_into_force_whole_or_is_refused() {
    let [in_force, refused, cut] = counts(&sweep(200, upload_to_worn));
    assert!(in_force > 15 && refused > 100 && cut > 10, "{in_force}, {refused}, {cut}");
}

#[cfg(target_os = "linux")]
#[test]
fn flipped_bits_of_the_model_in_force_are_found_and_mended() {
    sweep(60, mock_board::sweep::flip_model);
}

#[test]
fn whatever_is_changed_in_seal_or_blob_it_is_refused() {
    sweep(9 * 64, forge);
}

/// An erase that was cut may leave bits that only look erased.
#[test]
fn a_key_outlasts_what_an_erase_that_was_cut_has_left() {
    for seed in [1085, 1643, 8627] {
        cut_key(seed).unwrap();
    }
}
