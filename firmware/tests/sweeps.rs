//! A few seeds of each sweep over power cuts, decay and attacks. `cargo xtask torture` takes many.

use mock_board::sweep::{
    Job, abort_and_decay, cut_key, cut_model, cut_settings, forge, upload_to_worn,
};

/// Runs `case` for so many seeds; returns what each gives.
fn sweep<T>(seeds: u64, case: impl Fn(u64) -> Result<T, String>) -> Vec<T> {
    let case = |seed| case(seed).unwrap_or_else(|why| panic!("seed {seed}: {why}"));
    (0..seeds).map(case).collect()
}

/// How often each of the first `N` outcomes came about.
fn counts<const N: usize>(outcomes: &[usize]) -> [usize; N] {
    std::array::from_fn(|wanted| outcomes.iter().filter(|outcome| **outcome == wanted).count())
}

#[test]
fn power_lost_in_an_upload_or_an_undo_leaves_the_old_or_the_new_model() {
    for job in [Job::Upload, Job::Undo] {
        let cuts: u64 = sweep(48, |seed| cut_model(job, seed)).iter().sum();
        assert!(cuts > 1000, "{job:?}: {cuts}");
    }
}

#[test]
fn power_lost_while_a_setting_is_kept_leaves_the_old_or_the_new_one() {
    let cuts: u64 = sweep(48, cut_settings).iter().sum();
    assert!(cuts > 1000, "{cuts}");
}

#[test]
fn power_lost_while_a_key_is_set_leaves_no_key_or_that_one() {
    let cuts: u64 = sweep(96, cut_key).iter().sum();
    assert!(cuts > 1000, "{cuts}");
}

#[test]
fn an_upload_that_was_not_confirmed_never_comes_into_force_even_if_the_other_slot_decays() {
    let outcomes = counts::<3>(&sweep(200, abort_and_decay));
    assert!(outcomes.iter().all(|count| *count > 0), "{outcomes:?}");
}

#[test]
fn an_upload_to_worn_flash_comes_into_force_whole_or_is_refused() {
    let outcomes = counts::<3>(&sweep(200, upload_to_worn));
    assert!(outcomes.iter().all(|count| *count > 0), "{outcomes:?}");
}

#[cfg(target_os = "linux")]
#[test]
fn flipped_bits_of_the_model_in_force_are_found_and_mended() {
    let outcomes = counts::<4>(&sweep(60, mock_board::sweep::flip_model));
    assert_eq!(outcomes, [10, 10, 20, 20]);
}

#[test]
fn whatever_is_changed_in_seal_or_blob_it_is_refused() {
    sweep(9 * 64, forge);
}
