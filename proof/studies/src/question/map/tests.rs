use taxel_data::progress::Silent;

use super::claims::Verdict;
use super::*;

fn small() -> (Experiment, Plan) {
    let mut experiment = Experiment::load("paper").unwrap();
    experiment.world.read_rows = vec![3];
    let plan = Plan {
        samples: vec![30, 400],
        centres: vec![4, 16, 64],
        spreads: vec![0.2, 0.5, 1.0],
        test_frames: 300,
        initial_covariance: 1e9,
        ..Plan::default()
    };
    (experiment, plan)
}

#[test]
fn interpolation_meets_its_samples_and_no_others_in_any_number_of_threads() {
    let (experiment, plan) = small();
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| compute(&experiment, "dz_mm", &plan, &Silent).unwrap())
    };
    let study = with_threads(1);
    assert_eq!(study, with_threads(3));
    assert_eq!(study.maps.len(), 4);
    for map in &study.maps {
        let centres: Vec<usize> = map.cells.iter().step_by(3).map(|cell| cell.centres).collect();
        assert_eq!(centres, if map.samples == 30 { vec![4, 16, 30] } else { vec![4, 16, 64, 400] });
        // Uniform on 1 mm.
        assert!((map.mean_rmse - 12_f64.sqrt().recip()).abs() < 0.02, "{}", map.mean_rmse);
        let all = map.cells.iter().find(|cell| cell.centres == map.samples).unwrap();
        assert!(all.training_rmse < 0.01 * map.mean_rmse, "{all:?}");
        assert!(all.test_rmse > 0.8 * map.mean_rmse, "{all:?}");
    }
}

#[test]
fn more_centres_and_less_noise_fit_the_samples_better() {
    let (experiment, plan) = small();
    let study = compute(&experiment, "dz_mm", &plan, &Silent).unwrap();
    let training = |map: &Map, centres| {
        let mut cells = map.cells.iter().filter(|cell| cell.spread == 1.0);
        cells.find(|cell| cell.centres == centres).unwrap().training_rmse
    };
    let [_, quiet, _, loud] = study.maps.as_slice() else { panic!("four maps") };
    assert!(training(quiet, 64) < training(quiet, 16));
    assert!(training(quiet, 64) < training(loud, 64));
    let claim = study.claims.last().unwrap();
    assert_eq!((claim.claim, claim.verdict), ("the error grows with noise", Verdict::Holds));
}
