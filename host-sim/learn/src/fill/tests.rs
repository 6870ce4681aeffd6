use std::sync::OnceLock;

use taxel_data::{Silent, Stream};
use taxel_simulate::{World, synthesise};

use super::*;
use crate::train::train;
use crate::{Options, Origin, pack};

/// Model of two rows that fills missing readings, and frames that it was not trained on.
fn model() -> &'static (ModelBlob, Table) {
    static MODEL: OnceLock<(ModelBlob, Table)> = OnceLock::new();
    MODEL.get_or_init(|| {
        let world = World { read_rows: vec![3, 4], ..World::press() };
        let frames = synthesise(&world, Stream::Training, 1500);
        let options = Options { centres: 8, ..Options::of_rows() };
        let trained = train(&frames, &options, &Silent).unwrap();
        let blob = pack(&trained, &frames, &Origin::of_data("rows", 0, 1, &frames)).unwrap();
        let blob = add(&blob, &frames.inputs).unwrap();
        (blob, synthesise(&world, Stream::Test, 400).inputs)
    })
}

#[test]
fn filled_readings_are_as_near_as_noise_lets_them_be() {
    let (blob, fresh) = model();
    let model = blob.prepare();
    let deviations = fresh.deviations();
    for missing in [vec![4], (0..36).step_by(18).map(|row| row + 9).collect::<Vec<_>>()] {
        let mut faulty = fresh.clone();
        for line in faulty.values.chunks_exact_mut(36) {
            missing.iter().for_each(|at| line[*at] = f64::NAN);
        }
        let (filled, counts) = model.filled(&faulty.values).unwrap();
        assert!(counts.iter().all(|count| *count == missing.len()));
        let errors = filled.iter().zip(&fresh.values).enumerate();
        for at in &missing {
            let of = errors.clone().skip(*at).step_by(36).map(|(_, (a, b))| (a - b).powi(2));
            let error = (of.sum::<f64>() / fresh.len() as f64).sqrt();
            // The noise alone is 0.5 % of 57 Ω, which is 0.29 Ω; the mean would be off by the deviation.
            assert!((0.2..0.4).contains(&error), "{at}: {error} Ω");
            assert!(error < 0.7 * deviations[*at], "{at}: {error} Ω of {}", deviations[*at]);
        }
        let untouched = filled.iter().zip(&faulty.values).filter(|(_, b)| !b.is_nan());
        untouched.for_each(|(a, b)| assert_eq!(a.to_bits(), b.to_bits()));
    }
    // A row is half of the readings: too much.
    let mut faulty = fresh.clone();
    faulty.values.chunks_exact_mut(36).for_each(|line| line[..18].fill(f64::NAN));
    let (_, counts) = model.filled(&faulty.values).unwrap();
    assert!(counts.iter().all(|count| *count == 0));
}

#[test]
fn models_that_cannot_fill_are_refused_with_what_they_lack() {
    let (blob, fresh) = model();
    assert!(blob.parse().fill().is_some());
    let few = Table { names: vec!["a".into()], values: vec![1.0, 2.0].into() };
    let mut bad = fresh.clone();
    bad.values[0] = f64::INFINITY;
    let first =
        |frames: usize| Table { values: fresh.values[..36 * frames].into(), ..fresh.clone() };
    for (readings, says) in [
        (few, "fewer than four readings"),
        (bad, "are no numbers"),
        (first(300), "300 frames are too few"),
        (first(359), "give 360"),
    ] {
        let message = add(blob, &readings).unwrap_err().to_string();
        assert!(message.contains(says), "{message}");
    }
    assert!(add(blob, &first(360)).is_ok());
}
