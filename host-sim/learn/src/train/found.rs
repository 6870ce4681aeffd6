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
    /// For each start its layers, and the options for fitting weights to them.
    of_starts: Vec<(&'s Start, Layers, Options)>,
}

impl<'s> Found<'s> {
    /// Layers that K-means and `refinement` find, from each of `starts`.
    ///
    /// # Errors
    /// As [`train`](super::train).
    pub fn new(
        starts: &'s [Start],
        options: &Options,
        refinement: Option<(&Refinement, Examples<'_>)>,
        progress: &dyn Progress,
    ) -> Result<Self> {
        let of_start = |start: &'s Start| {
            let mut layers = start.layers(options);
            if let Some((settings, examples)) = refinement {
                let frames = &start.frames;
                layers = refine(frames, &layers, options, settings, examples, progress)?;
            }
            let settings = refinement.map(|(settings, _)| settings);
            let fitting = start.fitting(&layers, options, settings)?;
            Ok((start, layers, fitting))
        };
        Ok(Self { of_starts: starts.iter().map(of_start).collect::<Result<_>>()? })
    }

    /// Fits weights in a `format`, or with `or_f32` in f32 where that does not hold them.
    ///
    /// # Errors
    /// [`Error`](crate::Error) for data or layers that the format does not hold.
    pub fn fit(&self, format: Format, or_f32: bool, progress: &dyn Progress) -> Result<Trained> {
        let mut trained = Trained::default();
        for (start, layers, options) in &self.of_starts {
            let options = Options { format, or_f32, ..*options };
            for networks in fit(layers, &options, &[options.penalty], progress)? {
                trained.add(start.front(layers.projection.as_ref()), networks);
            }
        }
        Ok(trained)
    }
}
