//! A few seeds of each sweep over power cuts.

use mock_board::sweep::{Job, cut};

#[test]
fn power_lost_at_any_time_leaves_a_device_as_before_or_as_after() {
    for job in Job::ALL {
        let case = |seed| cut(job, seed).unwrap_or_else(|why| panic!("seed {seed}: {why}"));
        let cases: Vec<_> = (0..12).map(case).collect();
        let cuts: u64 = cases.iter().map(|case| case.count).sum();
        let quarters = [0, 1, 2, 3].map(|it| cases.iter().map(|case| case.quarters[it]).sum());
        let few = quarters.iter().any(|first_cuts: &u64| *first_cuts < 2);
        assert!(cuts > 1000 && !few, "{job:?}: {cuts}, {quarters:?}");
    }
}
