//! Training where nothing is moderate: widths, numbers of centres, samples that are alike, readings that are nearly the
//! same, no noise. Models are judged on frames that they have not seen.

use taxel_core::rbf::Format;
use taxel_data::dataset::Dataset;
use taxel_data::progress::Silent;
use taxel_data::random::{Purpose, Random, Stream};
use taxel_learn::train::train;
use taxel_learn::{Options, Origin, pack};
use taxel_simulate::{Synthesis, World};

use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tools::Tools;

pub const EXTREMES: Promise = Promise {
    name: "training-extremes",
    text: "any width, K, data: fresh frames, over the mean",
    share: 1,
    check: extremes,
};

const SAMPLES: usize = 60;
const FRESH: usize = 200;
/// Typical distance of two samples, on scaled inputs.
const DISTANCE: f64 = 0.5;
/// Least width with which a Gaussian reaches the samples next to its centre. Narrower ones say nothing of fresh frames.
const REACHES: f64 = 0.1;
/// Error over that of the mean that only rounding explains.
const ROUNDING: f64 = 1.01;
/// The same of fresh frames without noise: few samples stand for them.
const OF_FRESH: f64 = 1.1;
/// The same of fresh frames of a press: the axes that hardly show may be a little worse than the mean.
const OF_PRESS: f64 = 1.5;

fn extremes(effort: &Effort, _: &Tools) -> Result<Found, String> {
    Ok(effort.worst_of_accepted((3000, 1_000_000), (f64::INFINITY, "of mean"), |seed| {
        if seed == effort.seed() {
            return few_without_noise().map_err(|why| format!("few frames without noise: {why}"));
        }
        let mut random = Random::new(seed, Stream::Test, Purpose::Noise, 0, 0);
        let law = Law::new(&mut random);
        let formats = Format::ALL;
        let options = Options {
            format: formats[random.below(formats.len())],
            spread: DISTANCE * 10_f64.powf(random.between([-3.0, 3.0])),
            centres: [1, 2, 20, SAMPLES - 1, SAMPLES, 10 * SAMPLES][random.below(6)],
            affine_tail: random.below(2) == 0,
            seed,
            ..Options::default()
        };
        let [data, fresh] = [SAMPLES, FRESH].map(|count| law.frames(count, &mut random));
        // Gaussians that reach no other sample say nothing of fresh frames, and noise may be learnt.
        let is_bound = law.noise == 0.0 && options.spread >= REACHES;
        let most = if is_bound { OF_FRESH } else { f64::INFINITY };
        let worst = judge([&data, &fresh], &options, most).map_err(|why| {
            let (format, centres) = (options.format.name(), options.centres);
            format!("{format}, K = {centres}, spread {:e}, {law:?}: {why}", options.spread)
        })?;
        Ok(worst.map(|worst| if options.spread >= REACHES { worst } else { 0.0 }))
    }))
}

/// Readings of a row that hang together but for rounding, and no noise that a fit could average over.
fn few_without_noise() -> Result<Option<f64>, String> {
    let world = World { read_rows: vec![3], ..World::press() };
    let frames = |stream, count| Synthesis::new(&world).noise_level(0.0).frames(stream, count);
    let (data, fresh) = (frames(Stream::Training, 300), frames(Stream::Test, 2000));
    judge([&data, &fresh], &Options { centres: 8, ..Options::default() }, OF_PRESS)
}

/// What frames are drawn from.
#[derive(Debug)]
struct Law {
    /// Places of two inputs: none for places that are all different.
    places: Vec<[f64; 2]>,
    /// Standard deviation of the outputs.
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
        let inputs = ["a", "b", "sum"][..2 + usize::from(self.apart.is_some())].iter();
        let names = inputs.map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let width = names.len();
        let mut data = Dataset::empty(names, vec!["y".into()], 1, count);
        for sample in 0..count {
            let drawn = [random.unit(), random.unit()];
            let of_few = || self.places[sample % self.places.len()];
            let [a, b] = if self.places.is_empty() { drawn } else { of_few() };
            let sum = a + b + self.apart.unwrap_or(0.0) * random.normal();
            data.inputs.values[width * sample..][..width].copy_from_slice(&[a, b, sum][..width]);
            let y = (3.0 * a).sin() * (2.0 * b).cos() + self.noise * random.normal();
            data.outputs.values[sample] = y;
        }
        data
    }
}

/// RMSE on fresh frames of the model as a device has it, as a share of that of always predicting the mean: that of the
/// worst output, and at most so much. None if training is refused.
fn judge(
    [data, fresh]: [&Dataset; 2],
    options: &Options,
    most: f64,
) -> Result<Option<f64>, String> {
    let trained = match train(data, options, &Silent) {
        Ok(trained) => trained,
        Err(refusal) => {
            let refusal = refusal.to_string();
            let names_it =
                ["spread", "centres", "output \"y\""].iter().any(|it| refusal.contains(it));
            return if names_it { Ok(None) } else { Err(format!("unclear refusal: {refusal}")) };
        }
    };
    let packed = pack(&trained, data, &Origin::of_data("extreme", 0, 1, data));
    let blob = packed.map_err(|refusal| refusal.to_string())?;
    let prepared = blob.prepare();
    let means = data.outputs.means();
    let over_mean = |frames: &Dataset| {
        let decoded = prepared.decode_lines(&frames.inputs.values);
        if let Some(stray) = decoded.iter().find(|y| !y.is_finite()) {
            return Err(format!("an output is {stray}"));
        }
        let count = frames.frames();
        let [own, of_mean] =
            [decoded, means.repeat(count)].map(|it| frames.outputs.squared_errors(&it));
        let outputs = own.iter().zip(&of_mean).zip(&means).map(|((own, of_mean), mean)| {
            // Where nothing changes, only rounding to f32 is left.
            let least = count as f64 * (f64::from(f32::EPSILON) * mean).powi(2);
            if *own <= least { 0.0 } else { (own / of_mean.max(least)).sqrt() }
        });
        Ok(outputs.fold(0.0, f64::max))
    };
    let (of_samples, of_fresh) = (over_mean(data)?, over_mean(fresh)?);
    if of_samples > ROUNDING || of_fresh > most {
        return Err(format!("{of_samples:.3} times the error of the mean, fresh {of_fresh:.3}"));
    }
    Ok(Some(of_fresh))
}
