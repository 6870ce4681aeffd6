//! Training where nothing is moderate: widths, numbers of centres, one or two samples, samples that are alike, readings
//! that are nearly the same, no noise.

use taxel_core::rbf::Format;
use taxel_data::{Dataset, Purpose, Random, Silent, Stream};
use taxel_learn::train::train;
use taxel_learn::{Options, Origin, pack};

use crate::table::hold;

const SAMPLES: usize = 60;
/// Typical distance of two samples, on scaled inputs.
const DISTANCE: f64 = 0.5;
/// Least width with which a Gaussian reaches the samples next to its centre: narrower ones say nothing of fresh frames.
const REACHES: f64 = 0.1;

#[test]
fn a_model_of_extreme_data_is_no_worse_than_the_mean() {
    let mut of_fresh = Vec::new();
    // Least squares leave no more than the mean does, and a format may take 0.01 from R²: √1.01.
    hold("training", 1.005, 900, |seed| {
        let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
        let law = Law::new(&mut random);
        let options = Options {
            format: Format::ALL[random.below(Format::ALL.len())],
            spread: DISTANCE * 10_f64.powf(random.between([-3.0, 3.0])),
            centres: [1, 2, 20, SAMPLES - 1, SAMPLES, 10 * SAMPLES][random.below(6)],
            seed,
            ..Options::of_rows()
        };
        let frames = [1, 2, SAMPLES][random.below(3)];
        let [data, fresh] = [frames, 200].map(|count| law.frames(count, &mut random));
        let errors = over_mean([&data, &fresh], &options);
        // A model may be overfitted to noise.
        let may_judge = frames == SAMPLES && law.noise == 0.0 && options.spread >= REACHES;
        of_fresh.push(errors.filter(|_| may_judge).map(|[_, fresh]| fresh));
        errors.map(|[own, _]| own)
    });
    hold("fresh", 1.0, 900, |seed| of_fresh[seed as usize]);
}

/// What frames are drawn from.
struct Law {
    /// Places of two inputs; none if all are different.
    places: Vec<[f64; 2]>,
    /// Standard deviation of the output's noise.
    noise: f64,
    /// A third input is the sum of the others, but for so much; none for two inputs.
    apart: Option<f64>,
}

impl Law {
    fn new(random: &mut Random) -> Self {
        let kinds = [0, 3, 1][random.below(3)];
        Self {
            places: (0..kinds).map(|_| [random.unit(), random.unit()]).collect(),
            noise: [0.0, 0.1][random.below(2)],
            apart: [None, Some(0.0), Some(1e-6), Some(1e-3)][random.below(4)],
        }
    }

    fn frames(&self, count: usize, random: &mut Random) -> Dataset {
        let width = 2 + usize::from(self.apart.is_some());
        let names = ["a", "b", "sum"][..width].iter().map(|name| (*name).to_owned()).collect();
        let mut data = Dataset::empty(names, vec!["y".into()], 1, count);
        let lines = data.inputs.values.chunks_exact_mut(width).zip(data.outputs.values.iter_mut());
        for (sample, (inputs, y)) in lines.enumerate() {
            let drawn = [random.unit(), random.unit()];
            let [a, b] = *self.places.get(sample % self.places.len().max(1)).unwrap_or(&drawn);
            let sum = a + b + self.apart.unwrap_or(0.0) * random.normal();
            inputs.copy_from_slice(&[a, b, sum][..width]);
            *y = (3.0 * a).sin() * (2.0 * b).cos() + self.noise * random.normal();
        }
        data
    }
}

/// RMSE of the packed model on its own and on fresh frames, as shares of that of always predicting the mean. `None` if
/// training is refused by name.
fn over_mean([data, fresh]: [&Dataset; 2], options: &Options) -> Option<[f64; 2]> {
    let has_too_few = data.frames() <= options.centres;
    let trained = match train(data, options, &Silent) {
        Ok(trained) => {
            assert!(!has_too_few, "{} centres of {} frames", options.centres, data.frames());
            trained
        }
        Err(refusal) => {
            let refusal = refusal.to_string();
            let named = ["spread", "centres", "output \"y\"", "column \""]
                .iter()
                .any(|it| refusal.contains(it));
            assert!(named, "unclear refusal: {refusal}");
            assert_eq!(refusal.contains("centres"), has_too_few, "{refusal}");
            return None;
        }
    };
    let blob = pack(&trained, data, &Origin::of_data("extreme", 0, 1, data)).unwrap();
    let prepared = blob.prepare();
    let mean = data.outputs.means()[0];
    Some([data, fresh].map(|frames| {
        let decoded = prepared.decode_lines(&frames.inputs.values);
        assert!(decoded.iter().all(|y| y.is_finite()), "{decoded:?}");
        let means = vec![mean; decoded.len()];
        let [own, of_mean] = [&decoded, &means].map(|it| frames.outputs.squared_errors(it)[0]);
        // Where nothing changes, only rounding to f32 is left.
        let rounding = decoded.len() as f64 * (f64::from(f32::EPSILON) * mean).powi(2);
        if own <= rounding { 0.0 } else { (own / of_mean.max(rounding)).sqrt() }
    }))
}
