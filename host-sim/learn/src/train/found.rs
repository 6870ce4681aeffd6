//! Layers that training finds, before weights are fitted to them in a format.

use taxel_core::rbf::Format;
use taxel_data::Progress;

use super::Options;
use super::layers::Layers;
use super::refine::{Examples, Refinement, refine};
use super::start::Start;
use super::trained::{Trained, fit};
use crate::error::Result;

/// Layers of all networks, whose weights can be fitted in any format.
#[derive(Debug)]
pub struct Found<'s> {
    options: Options,
    /// For each start its layers, and the penalties that weights are fitted with.
    of_starts: Vec<(&'s Start, Layers, Vec<Option<f64>>)>,
}

impl<'s> Found<'s> {
    /// Layers that `refinement` finds from each of `starts`, whose own `layers` have K-means centres, or these themselves with
    /// the spread of `options`. Weights will be fitted with each of `penalties`; refinement looks at that of `options`.
    ///
    /// # Errors
    /// As [`train`](super::train).
    pub fn new(
        starts: &'s [Start],
        layers: Vec<Layers>,
        options: &Options,
        penalties: &[Option<f64>],
        refinement: Option<(&Refinement, Examples<'_>)>,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let of_start = |(start, mut layers): (&'s Start, Layers)| {
            layers.hidden.iter_mut().for_each(|layer| layer.spread = options.spread);
            if let Some((settings, examples)) = refinement {
                let frames = &start.frames;
                layers = refine(frames, &layers, options, settings, examples, progress)?;
            }
            let settings = refinement.map(|(settings, _)| settings);
            let with = |penalty: &Option<f64>| {
                start.penalty(&layers, &Options { penalty: *penalty, ..*options }, settings)
            };
            let penalties = penalties.iter().map(with).collect::<Result<_>>()?;
            Ok((start, layers, penalties))
        };
        let of_starts = starts.iter().zip(layers).map(of_start).collect::<Result<_>>()?;
        Ok(Self { options: *options, of_starts })
    }

    /// Fits weights in a `format`, or with `or_f32` in f32 where that does not hold them: a model for each penalty, or an
    /// [`Error`](crate::Error) for data or layers that the format does not hold.
    pub fn fit(
        &self,
        format: Format,
        or_f32: bool,
        progress: &dyn Progress,
    ) -> Vec<Result<Trained>> {
        let options = Options { format, or_f32, ..self.options };
        let mut all = Vec::new();
        for (start, layers, penalties) in &self.of_starts {
            all.resize_with(penalties.len(), || Ok(Trained::default()));
            let front = start.front(layers.projection.as_ref());
            let fitted = fit(layers, &options, penalties, progress);
            for (trained, networks) in all.iter_mut().zip(fitted) {
                match (&mut *trained, networks) {
                    (Ok(trained), Ok(networks)) => trained.add(front.clone(), networks),
                    (Ok(_), Err(cause)) => *trained = Err(cause),
                    (Err(_), _) => {}
                }
            }
        }
        all
    }
}
