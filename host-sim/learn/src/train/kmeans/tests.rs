use proptest::prelude::*;

use super::*;
use taxel_data::{Purpose, Stream};

fn random(seed: u64) -> Random {
    Random::new(seed, Stream::Training, Purpose::Centres, 0, 0)
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}

#[test]
fn separate_clusters_are_found_whatever_the_seed() {
    let points: Vec<f64> =
        (0..300).map(|i| f64::from(i % 3) * 10.0 + f64::from(i / 3 % 10) * 0.01).collect();
    for seed in 0..20 {
        let found = fit(&points, 1, 3, &Search::default(), &mut random(seed));
        for (centre, expected) in sorted(found.centres).iter().zip([0.045, 10.045, 20.045]) {
            assert!((centre - expected).abs() < 1e-9, "seed {seed}: {centre}");
        }
    }
}

#[test]
fn duplicates_end_with_one_centre_a_distinct_point() {
    let points = [1.0, 2.0, 1.0, 2.0, 1.0, 2.0, 5.0, 2.0];
    let found = fit(&points, 1, 6, &Search::default(), &mut random(1));
    assert_eq!(sorted(found.centres), [1.0, 2.0, 5.0]);
    assert_eq!(found.inertia, 0.0);
    let found = fit(&[7.0; 50], 1, 4, &Search::default(), &mut random(1));
    assert_eq!(found.centres, [7.0]);
}

#[test]
fn an_empty_cluster_takes_the_farthest_point() {
    // The third centre is nearest to no point.
    let points = [0.0, 1.0, 10.0, 11.0, 30.0];
    let found = refine(&points, 1, &[0.5, 10.5, 1e6], &Search::default());
    assert_eq!(sorted(found.centres), [0.5, 10.5, 30.0]);
}

#[test]
fn restarts_never_end_worse() {
    let mut source = random(9);
    let points: Vec<f64> = (0..4000).map(|_| source.unit()).collect();
    let with = |restarts| {
        let search = Search { restarts, ..Search::default() };
        fit(&points, 4, 25, &search, &mut random(4)).inertia
    };
    assert!(with(8) <= with(1));
}

/// Assignment by definition: the least squared distance in f64, and the first centre that has it.
fn nearest_of_all(points: &[f64], dimensions: usize, centres: &[f64]) -> Vec<Nearest> {
    let nearest = |point: &[f64]| {
        let all = centres.chunks_exact(dimensions).enumerate().map(|(k, centre)| Nearest {
            centre: k as u32,
            squared_distance: crate::train::squared_distance(point, centre),
        });
        all.reduce(|best, one| if one.is_nearer(&best) { one } else { best }).unwrap()
    };
    points.chunks_exact(dimensions).map(nearest).collect()
}

fn all_nearest(assignment: &Assignment<'_>) -> Vec<Nearest> {
    assignment.pieces.iter().flat_map(|piece| piece.nearest.clone()).collect()
}

/// Compares every step of `iterations` with an assignment that looks at every centre in f64.
fn check_steps(points: &[f64], dimensions: usize, centres: &[f64], iterations: usize) {
    let points = Points::new(points, dimensions);
    let mut assignment = Assignment::new(&points, centres.to_vec());
    for _ in 0..iterations {
        let exact = nearest_of_all(points.values, dimensions, &assignment.centres);
        assert!(all_nearest(&assignment) == exact, "not the nearest of all centres");
        assignment.move_to(means(&assignment));
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..Default::default() })]

    /// Points on a coarse grid: duplicates, ties, and centres without any point.
    #[test]
    fn the_screen_changes_nothing_however_points_coincide(
        dimensions in 1_usize..6,
        grid in prop::collection::vec(-3_i8..4, 6..900),
        centres in 1_usize..90,
    ) {
        let whole = grid.len() / dimensions * dimensions;
        let points: Vec<f64> = grid[..whole].iter().map(|x| f64::from(*x) / 3.0).collect();
        let start: Vec<f64> =
            points.iter().cycle().take(centres * dimensions).map(|x| x * 1.5).collect();
        check_steps(&points, dimensions, &start, 4);
    }

    #[test]
    fn the_screen_changes_nothing_whatever_the_scale(
        dimensions in 1_usize..20,
        unit in prop::collection::vec(0.0_f64..1.0, 60..2000),
        centres in 1_usize..40,
        scale in prop::sample::select(vec![1.0, 1e-6, 1e-101, 1e-130, 1e-170, 1e30, 1e120]),
        offset in prop::sample::select(vec![0.0, 1.0, -1e5, 1e9]),
    ) {
        let whole = unit.len() / dimensions * dimensions;
        let points: Vec<f64> = unit[..whole].iter().map(|x| (x + offset) * scale).collect();
        let start: Vec<f64> = points.iter().take(centres * dimensions).copied().collect();
        check_steps(&points, dimensions, &start, 4);
    }
}

/// Smooth, noisy points, enough for several pieces and groups.
fn cloud(count: usize, dimensions: usize) -> Vec<f64> {
    let mut source = random(17);
    let mut points = Vec::with_capacity(count * dimensions);
    for _ in 0..count {
        let (a, b) = (source.unit(), source.unit());
        points.extend((0..dimensions).map(|i| (a * i as f64).sin() + b + 0.05 * source.normal()));
    }
    points
}

#[test]
fn the_screen_changes_nothing_with_many_centres() {
    let points = cloud(3000, 7);
    check_steps(&points, 7, &points[..700 * 7], 5);
}
