//! Where training starts from: outputs that share networks, their frames, the projection before them, and K-means centres.

use nalgebra::DMatrix;
use taxel_core::touch::Kind;
use taxel_data::Dataset;

use super::layers::Layers;
use super::refine::Refinement;
use super::samples::Samples;
use super::touch::{self, FittedTouch, Group, GroupFrames, Kinds, Places};
use super::trained::FittedFront;
use super::{Options, memory, projection};
use crate::error::Result;
use crate::parallel;

/// What training of outputs that share networks starts from: those of a [group](Group), or of all rows.
#[derive(Debug, Clone)]
pub struct Start {
    /// Outputs, and frames to train on.
    pub frames: GroupFrames,
    /// Parameters of the projection by regression.
    pub projection: Option<Vec<f32>>,
    /// Places in the examples, as maps tell them that were fitted to others, if the outputs are places.
    held_out: Option<DMatrix<f64>>,
    /// Whether networks see whole frames.
    whole_frames: bool,
}

impl Start {
    /// Starts of all networks for the frames of `dataset`.
    ///
    /// # Errors
    /// [`Error`](crate::Error) for data without a projection, or training that takes more memory than is allowed.
    pub fn all(dataset: &Dataset, options: &Options) -> Result<Vec<Self>> {
        memory::check(dataset, options, None)?;
        if options.projects(dataset) {
            projection::check(dataset, options.features)?;
        }
        let kinds =
            options.kinds.filter(|_| options.sees_frames(dataset)).unwrap_or(Kinds::AS_THEY_ARE);
        let groups = Group::all(dataset, kinds);
        let are_many = groups.len() > 1;
        // Groups whose shapes are the same share a map to places.
        let mut known: Option<(FittedTouch, Option<Places>)> = None;
        let start = |group: Group| {
            let frames = GroupFrames::new(group, dataset);
            let (group, examples) = (&frames.group, &frames.examples);
            let mut held_out = None;
            let projection = match &group.touch {
                _ if !options.projects(examples) => None,
                Some(touch) => {
                    if !known.as_ref().is_some_and(|(of, _)| of.makes_shapes_of(touch)) {
                        known = Some((touch.clone(), Places::fit(touch, dataset)?));
                    }
                    let places = known.as_ref().and_then(|(_, places)| places.as_ref());
                    let is_place = touch.kind() == Kind::Place;
                    held_out = places.filter(|_| is_place).map(|places| places.held_out.clone());
                    let features = options.features;
                    Some(touch::fit_projection(touch.kind(), examples, places, features)?)
                }
                None => {
                    // Some of the outputs have fewer products than all of them.
                    let possible = |wanted| projection::features_at_most(examples, wanted);
                    Some(projection::fit(examples, options.features.map(possible))?)
                }
            };
            let whole_frames = are_many || group.touch.is_some() || projection.is_some();
            Ok(Self { frames, projection, held_out, whole_frames })
        };
        groups.into_iter().map(start).collect()
    }

    /// Layers with K-means centres.
    pub fn layers(&self, options: &Options) -> Layers {
        let seen = self.frames.seen(self.projection.as_deref());
        let of_row = |row: usize| {
            let seen = seen.row(row);
            let samples = Samples::of(&seen);
            samples.layer(samples.centres(options, row), options)
        };
        let hidden = parallel::map(seen.table.rows, &of_row);
        Layers { projection: self.projection.clone(), seen, hidden }
    }

    /// Penalty for fitting weights to these `layers`: the usual one, if `options` give none. That of places is chosen on
    /// frames that are held out.
    ///
    /// # Errors
    /// As [`train`](super::train).
    pub fn penalty(
        &self,
        layers: &Layers,
        options: &Options,
        refinement: Option<&Refinement>,
    ) -> Result<Option<f64>> {
        Ok(match (options.penalty, &self.frames.group.touch) {
            (None, Some(touch)) if touch.kind() == Kind::Place => {
                let examples = &self.frames.examples;
                let mut seen = touch::seen(None, self.projection.as_deref(), examples).table;
                // A map tells frames that it was fitted to better than others.
                if let Some(told) = self.held_out.as_ref().filter(|it| it.nrows() == seen.frames())
                {
                    let lines = seen.inputs.values.chunks_exact_mut(seen.inputs.names.len());
                    let places = lines.zip(told.row_iter());
                    places.for_each(|(line, told)| {
                        line.iter_mut().zip(&told).for_each(|(to, from)| *to = *from);
                    });
                }
                Some(touch::best_penalty(&seen, &layers.hidden[0], options)?)
            }
            (given, _) => given.or(refinement.map(|settings| settings.ridge)),
        })
    }

    /// What stands before its network with this `projection`, if it sees whole frames.
    pub fn front(&self, projection: Option<&Vec<f32>>) -> Option<FittedFront> {
        let GroupFrames { group, examples, .. } = &self.frames;
        self.whole_frames.then(|| FittedFront {
            outputs: group.outputs.len(),
            touch: group.touch.clone(),
            inputs: examples.inputs.names.len(),
            projection: projection.cloned(),
        })
    }
}
