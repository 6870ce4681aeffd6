//! Training where nothing is moderate: widths, numbers of centres, samples that are alike.

use model_core::rbf::Format;
use taxel_data::dataset::Dataset;
use taxel_data::progress::Silent;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_learn::train::train;
use taxel_learn::{Exponential, Options, Origin, pack};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const EXTREMES: Promise = Promise {
    name: "training-extremes",
    text: "any width, K, or equal samples: no worse than the mean",
    share: 1,
    check: extremes,
};

const SAMPLES: usize = 60;
/// Typical distance of two samples, on scaled inputs.
const DISTANCE: f64 = 0.5;

fn extremes(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let planted = effort.is_planted();
    Ok(effort.worst((3000, 1_000_000), (1.01, "of mean"), |seed| {
        let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
        let data = samples(&mut random);
        let formats = Format::ALL;
        let options = Options {
            format: formats[random.below(formats.len())],
            spread: DISTANCE * 10_f64.powf(random.between([-3.0, 3.0])),
            centres: [1, 2, 20, SAMPLES - 1, SAMPLES, 10 * SAMPLES][random.below(6)],
            affine_tail: random.below(2) == 0,
            seed,
            ..Options::default()
        };
        let case = format!(
            "{}, K = {}, spread {:e}",
            options.format.name(),
            options.centres,
            options.spread
        );
        judge(&data, &options, planted).map_err(|why| format!("{case}: {why}"))
    }))
}

/// Samples of two inputs: all different, of few kinds, or all alike.
fn samples(random: &mut Random) -> Dataset {
    let names = vec!["a".into(), "b".into()];
    let mut data = Dataset::empty(names, vec!["y".into()], 1, SAMPLES);
    let kinds = [SAMPLES, 3, 1][random.below(3)];
    let places: Vec<[f64; 2]> = (0..kinds).map(|_| [random.unit(), random.unit()]).collect();
    let noise = [0.0, 0.1][random.below(2)];
    for sample in 0..SAMPLES {
        let [a, b] = places[sample % kinds];
        data.inputs.values[2 * sample..][..2].copy_from_slice(&[a, b]);
        data.outputs.values[sample] = (3.0 * a).sin() * (2.0 * b).cos() + noise * random.normal();
    }
    data
}

/// Training RMSE of the model as a device has it, as a share of that of always predicting the mean.
fn judge(data: &Dataset, options: &Options, planted: bool) -> Result<f64, String> {
    let trained = match train(data, options, &Silent) {
        Ok(trained) => trained,
        Err(refusal) => {
            let refusal = refusal.to_string();
            let names_it =
                ["spread", "centres", "output \"y\""].iter().any(|it| refusal.contains(it));
            return if names_it { Ok(0.0) } else { Err(format!("unclear refusal: {refusal}")) };
        }
    };
    let packed = pack(&trained, data, &Origin::of_data("extreme", 0, 1, data));
    let blob = packed.map_err(|refusal| refusal.to_string())?;
    let mut decoded = blob.prepare(Exponential::default()).decode_lines(&data.inputs.values);
    let mean = data.outputs.means()[0];
    if planted {
        // The mean of the outputs is left out of the bias.
        decoded.iter_mut().for_each(|y| *y -= mean);
    }
    if let Some(stray) = decoded.iter().find(|y| !y.is_finite()) {
        return Err(format!("an output is {stray}"));
    }
    let rmse =
        |estimate: &[f64]| (data.outputs.squared_errors(estimate)[0] / SAMPLES as f64).sqrt();
    let (own, of_mean) = (rmse(&decoded), rmse(&[mean; SAMPLES]));
    // Where nothing changes, only rounding to f32 is left.
    let least = f64::from(f32::EPSILON) * mean.abs();
    Ok(if own <= least { 0.0 } else { own / of_mean.max(least) })
}
