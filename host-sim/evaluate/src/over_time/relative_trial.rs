//! Trial of relative inputs on a log: what they would change, found by K-means alone.

use serde::Serialize;
use taxel_data::{Dataset, Silent, columns};
use taxel_learn::{Options, pack, relative, train::train};

use crate::measurements::Measurements;
use crate::metrics::{self, ALL};

/// Share of the frames that the trial holds out, the last ones: one of so many.
const HELD_OUT: usize = 5;

/// Errors of readings as they are beside those of readings relative to the baseline of the pause before.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RelativeTrial {
    /// Groups of outputs.
    pub groups: Vec<String>,
    /// RMSE with readings as they are, by group.
    pub rmse: Vec<f64>,
    /// RMSE with relative readings, by group.
    pub relative_rmse: Vec<f64>,
    /// Mean over the groups of RMSE/standard deviation with relative readings, as a share of that with readings as they
    /// are.
    pub ratio: f64,
}

impl RelativeTrial {
    /// Trains twice on the first four fifths of the training lines of `data` with `options`, without refinement, and judges
    /// by the others. `None` if the sensor at rest is not known from the log, inputs are relative already, or the frames do
    /// not allow it.
    pub fn new(data: &Measurements, options: &Options) -> Option<Self> {
        let rest = data.rest.as_ref().filter(|rest| rest.lines.is_some())?;
        if data.training.relative_inputs {
            return None;
        }
        let baselines = rest.baselines(&data.log.lines);
        let relative = relative::dataset(data.training.clone(), &baselines);
        let [as_they_are, relative] =
            [&data.training, &relative].map(|frames| Self::errors(frames, data, options));
        let (as_they_are, relative) = (as_they_are?, relative?);
        let names = &data.training.outputs.names;
        let groups = columns::groups(names).into_iter().map(|(group, _)| group.to_owned());
        let rmse = |errors: &[metrics::Errors]| errors.iter().map(|group| group.rmse).collect();
        let score = |errors| metrics::rmse_of(errors, ALL);
        Some(Self {
            groups: groups.collect(),
            rmse: rmse(&as_they_are),
            relative_rmse: rmse(&relative),
            ratio: score(&relative)? / score(&as_they_are)?,
        })
    }

    fn errors(
        frames: &Dataset,
        data: &Measurements,
        options: &Options,
    ) -> Option<Vec<metrics::Errors>> {
        let kept = frames.frames() - frames.frames() / HELD_OUT;
        let [first, last] = [0..kept, kept..frames.frames()];
        let first = frames.subset(&first.collect::<Vec<_>>());
        let last = frames.subset(&last.collect::<Vec<_>>());
        let trained = train(&first, options, &Silent).ok()?;
        let blob = pack(&trained, &first, &data.origin()).ok()?;
        let model = blob.prepare().of_inputs();
        Some(metrics::judge(&model, &last, &data.measure()).errors)
    }
}
