//! A few seeds of each sweep over power cuts, decay and attacks. `cargo xtask torture` takes many.

use mock_board::sweep::{Job, abort_and_decay, cut, forge, upload_to_worn};

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
fn power_lost_at_any_time_leaves_a_device_as_before_or_as_after() {
    for job in Job::ALL {
        let cases = sweep(12, |seed| cut(job, seed));
        let cuts: u64 = cases.iter().map(|case| case.count).sum();
        let quarters = [0, 1, 2, 3].map(|it| cases.iter().map(|case| case.quarters[it]).sum());
        let few = quarters.iter().any(|first_cuts: &u64| *first_cuts < 2);
        assert!(cuts > 1000 && !few, "{job:?}: {cuts}, {quarters:?}");
    }
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
fn whatever_is_changed_in_a_sealed_request_it_is_refused() {
    sweep(9 * 64, forge);
}
