//! K-means.

use taxel_data::{Purpose, Random, Stream};
use taxel_learn::train::kmeans::{Search, fit, refine};
use taxel_learn::train::squared_distance;

/// Points whose sums are taken before these are added up, where there are at most 32,768.
const PIECE: usize = 512;

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

/// One of Lloyd's iterations by definition: the sum of squared distances of points from their centres, and the next
/// centres. Of equal centres the first one is the nearest, and a centre without points takes the farthest point that is
/// left.
fn lloyd(points: &[f64], dimensions: usize, centres: &[f64]) -> (f64, Vec<f64>) {
    let nearest = |point: &[f64]| {
        let all = centres.chunks_exact(dimensions).map(|centre| squared_distance(point, centre));
        all.enumerate().reduce(|best, one| if one.1 < best.1 { one } else { best }).unwrap()
    };
    let nearest: Vec<(usize, f64)> = points.chunks_exact(dimensions).map(nearest).collect();
    let (mut inertia, mut next) = (0.0, vec![0.0; centres.len()]);
    let mut counts = vec![0_usize; centres.len() / dimensions];
    for (points, nearest) in points.chunks(PIECE * dimensions).zip(nearest.chunks(PIECE)) {
        let (mut of_piece, mut sums) = (0.0, vec![0.0; centres.len()]);
        for (point, (centre, squared_distance)) in points.chunks_exact(dimensions).zip(nearest) {
            of_piece += squared_distance;
            counts[*centre] += 1;
            let sums = &mut sums[centre * dimensions..];
            sums.iter_mut().zip(point).for_each(|(sum, x)| *sum += x);
        }
        inertia += of_piece;
        next.iter_mut().zip(sums).for_each(|(all, sum)| *all += sum);
    }
    let mut farthest: Vec<usize> = (0..nearest.len()).collect();
    farthest.sort_by(|a, b| nearest[*a].1.total_cmp(&nearest[*b].1));
    for (mean, count) in next.chunks_exact_mut(dimensions).zip(counts) {
        if count > 0 {
            mean.iter_mut().for_each(|x| *x /= count as f64);
        } else {
            let point = farthest.pop().unwrap_or(0);
            mean.copy_from_slice(&points[point * dimensions..][..dimensions]);
        }
    }
    (inertia, next)
}

/// Compares every one of `iterations` with one that looks at every centre in f64.
fn check_steps(points: &[f64], dimensions: usize, centres: &[f64], iterations: usize) {
    // It ends if the sum rises, and never for a small gain.
    let search = Search { iterations: 1, enough: f64::NEG_INFINITY, ..Search::default() };
    let (mut centres, (mut inertia, mut next)) =
        (centres.to_vec(), lloyd(points, dimensions, centres));
    for _ in 0..iterations {
        let found = refine(points, dimensions, &centres, &search);
        let (after, following) = lloyd(points, dimensions, &next);
        let moved = after <= inertia;
        let expected = if moved { (&next, after) } else { (&centres, inertia) };
        assert!((&found.centres, found.inertia) == expected, "not the nearest of all centres");
        assert_eq!(found.iterations, usize::from(moved));
        (centres, inertia, next) = (next, after, following);
    }
}

/// Points on a coarse grid: duplicates, ties, and centres without any point.
#[test]
fn the_screen_changes_nothing_however_points_coincide() {
    for seed in 0..300 {
        let mut draw = random(seed);
        let (dimensions, centres) = (1 + draw.below(5), 1 + draw.below(89));
        let count = (6 + draw.below(894)) / dimensions;
        let points: Vec<f64> =
            (0..count * dimensions).map(|_| (draw.below(7) as f64 - 3.0) / 3.0).collect();
        let start: Vec<f64> =
            points.iter().cycle().take(centres * dimensions).map(|x| x * 1.5).collect();
        check_steps(&points, dimensions, &start, 4);
    }
}

#[test]
fn the_screen_changes_nothing_whatever_the_scale() {
    for seed in 0..300 {
        let mut draw = random(seed);
        let (dimensions, centres) = (1 + draw.below(19), 1 + draw.below(39));
        let count = (60 + draw.below(1940)) / dimensions;
        let scale = [1.0, 1e-6, 1e-101, 1e-130, 1e-170, 1e30, 1e120][draw.below(7)];
        let offset = [0.0, 1.0, -1e5, 1e9][draw.below(4)];
        let points: Vec<f64> =
            (0..count * dimensions).map(|_| (draw.unit() + offset) * scale).collect();
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
