//! Decoders besides the packed network, and their common parts.

use taxel_data::Dataset;

use crate::decoder::{Decoder, Estimates, FrameDecoder, Frames};
use crate::parallel;

pub mod centroid;
pub mod linear;
pub mod mean;
pub mod standard;
pub mod textbook;

/// Decoder that every network is compared with.
#[derive(Debug, Clone, Copy)]
pub struct Baseline {
    /// Name of the decoder in tables and results.
    pub name: &'static str,
    /// What it is, for legends.
    pub in_words: &'static str,
    fit: Fit,
}

/// Fits a decoder to some lines of a data set.
type Fit = fn(&Dataset, &[usize]) -> Option<Box<dyn Decoder>>;

impl Baseline {
    /// Fits the decoder to `training`; `None` if it cannot decode such readings to any of the outputs.
    pub fn fit(&self, training: &Dataset) -> Option<Box<dyn Decoder>> {
        self.fit_to(training, &(0..training.frames()).collect::<Vec<_>>())
    }

    /// Fits the decoder to these `lines` of `dataset` as [`fit`](Self::fit) does.
    pub fn fit_to(&self, dataset: &Dataset, lines: &[usize]) -> Option<Box<dyn Decoder>> {
        (self.fit)(dataset, lines)
    }
}

/// The best linear decoder of each row-wire.
pub const LINEAR: Baseline = Baseline {
    name: linear::NAME,
    in_words: "best linear decoder",
    fit: |dataset, lines| Some(Box::new(linear::fit(dataset, lines))),
};

/// The centroid of the touch.
pub const CENTROID: Baseline = Baseline {
    name: centroid::NAME,
    in_words: "centroid",
    fit: |dataset, lines| Some(Box::new(centroid::Centroid::fit(&dataset.subset(lines))?)),
};

/// Every baseline: `run`, `table1`, `trade`, selection and the report go through this list.
pub const BASELINES: &[Baseline] = &[
    LINEAR,
    CENTROID,
    Baseline {
        name: mean::NAME,
        in_words: "always predicting the mean",
        fit: |dataset, lines| Some(Box::new(mean::Mean::fit(&dataset.subset(lines)))),
    },
];

/// Decoder of one row-wire's readings.
pub trait RowDecoder: Sync {
    /// Predicts the outputs (`lines × outputs`) for every line of `readings` (`lines × inputs`).
    fn predict(&self, readings: &[f64]) -> Vec<f64>;
}

/// Decoder of whole frames, made of one decoder for each row-wire.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows<D> {
    name: &'static str,
    inputs: usize,
    decoders: Vec<D>,
}

impl<D: RowDecoder + Send> Rows<D> {
    /// Fits one decoder to each row of `training`, by `fit`.
    pub fn fit(name: &'static str, training: &Dataset, fit: impl Fn(&Dataset) -> D + Sync) -> Self {
        let decoders = parallel::map(training.rows, &|row| fit(&training.row_table(row)));
        Self::new(name, training, decoders)
    }

    /// Joins decoders that were already fitted to the rows of `training`, in their order.
    pub fn new(name: &'static str, training: &Dataset, decoders: Vec<D>) -> Self {
        Self { name, inputs: training.inputs.names.len() / training.rows.max(1), decoders }
    }
}

impl<D: RowDecoder + Send> FrameDecoder for Rows<D> {
    type State = ();

    fn name(&self) -> &str {
        self.name
    }

    fn inputs(&self) -> usize {
        self.decoders.len() * self.inputs
    }

    fn decode(&self, (): &mut (), frames: Frames<'_>) -> Estimates {
        let frames = frames.readings.chunks_exact(FrameDecoder::inputs(self).max(1));
        let of_row = |row: usize| {
            let places = row * self.inputs..(row + 1) * self.inputs;
            let readings: Vec<f64> =
                frames.clone().flat_map(|frame| &frame[places.clone()]).copied().collect();
            self.decoders[row].predict(&readings)
        };
        let parts = parallel::map(self.decoders.len(), &of_row);
        Estimates::of_values(side_by_side(&parts, frames.len()))
    }
}

/// Joins the outputs of all rows, each of so many `frames`, frame after frame.
fn side_by_side(parts: &[Vec<f64>], frames: usize) -> Vec<f64> {
    let width = parts.first().map_or(0, Vec::len) / frames.max(1);
    let of_frame = |frame: usize| {
        parts.iter().flat_map(move |part| &part[frame * width..(frame + 1) * width]).copied()
    };
    (0..frames).flat_map(of_frame).collect()
}
