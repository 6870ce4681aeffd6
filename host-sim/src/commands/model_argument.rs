//! Options of a model, over those of its scene or the usual ones.

use clap::Args;
use taxel_core::blob::Model;
use taxel_core::rbf::Format;
use taxel_learn::Options;
use taxel_learn::train::{Features, Kinds, Solver};

use super::arguments::{format, solver};
use super::stderr;
use crate::subject::Subject;
use crate::{Error, Result};

/// Numbers that a network is trained with, or candidates for them.
#[derive(Args, Default)]
pub struct NetworkArguments {
    /// Centres K; with `train --select`, candidates [default: the scene's, or 64].
    #[arg(long, value_name = "K", value_delimiter = ',')]
    pub centres: Vec<usize>,
    /// Width σ on scaled inputs, where refinement starts; with `train --select`, candidates [default: the scene's, or 0.4;
    /// 0.8 for the readings of a row].
    #[arg(long, value_name = "S", value_delimiter = ',')]
    pub spread: Vec<f64>,
    /// Ridge penalty on squared weights, for each frame: 1 is as strong as an input that is always 1. More of it
    /// generalises better from few or noisy frames, or to another day. With `train --select`, candidates [default: 1e-6 for all
    /// frames together, or 1e-7 a frame if refined].
    #[arg(long, value_name = "P", value_delimiter = ',', allow_negative_numbers = true)]
    pub penalty: Vec<f64>,
}

impl NetworkArguments {
    /// Sets `options` to the numbers that were given.
    ///
    /// # Errors
    /// Error for several values of an option, which only `train --select` takes.
    pub fn apply(&self, options: &mut Options) -> Result<()> {
        options.centres = one("--centres", &self.centres)?.unwrap_or(options.centres);
        options.spread = one("--spread", &self.spread)?.unwrap_or(options.spread);
        options.penalty = one("--penalty", &self.penalty)?.or(options.penalty);
        Ok(())
    }
}

/// The one value of an option, if it was given.
fn one<T: Copy + std::fmt::Debug>(option: &str, given: &[T]) -> Result<Option<T>> {
    match given {
        [] => Ok(None),
        [value] => Ok(Some(*value)),
        _ => Err(Error::Usage(format!(
            "{option} {given:?}: give one value, or `train` with --select"
        ))),
    }
}

/// What a model computes, and how its numbers are held.
#[derive(Args, Default)]
pub struct ModelArguments {
    /// Train as the paper does: a network for each row in f32 without an affine tail, centres by K-means, weights by
    /// recursion, and nothing refined.
    #[arg(long)]
    paper: bool,
    /// Train a network for each row, instead of one for all rows behind a projection of all readings. It is less accurate,
    /// but one missing reading costs only its row.
    #[arg(long)]
    each_row: bool,
    /// Features that all readings are projected to: no more than outputs and products of two or three of these [default:
    /// as many as a row has readings; none for outputs that belong to no row].
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    features: Option<usize>,
    /// Features: `plain`, made of readings as they are; or `normalised`, the shape of a touch apart from its strength, made of
    /// what exceeds 3 standard deviations of a reading at rest (normalised:K: K of them) [default: those with the least error
    /// on frames that are held out, for places and for amounts].
    #[arg(long, value_name = "KIND", conflicts_with_all = ["paper", "each_row"])]
    features_kind: Option<Features>,
    /// Number format of the weights [default: the scene's, or fixed16, or f32 where that does not hold the model].
    #[arg(long, value_name = "FORMAT", value_parser = format())]
    format: Option<Format>,
    /// How output weights are computed. Both ways give the same estimates [default: the scene's, or qr].
    #[arg(long, value_name = "SOLVER", value_parser = solver())]
    solver: Option<Solver>,
}

impl ModelArguments {
    /// Options of the `subject` with what was given. As the paper trains it, it is not refined.
    pub fn over(&self, subject: &mut Subject) -> Options {
        let mut options = subject.options();
        if self.paper {
            subject.refine_not();
            options = options.as_in_paper();
        }
        if self.each_row {
            options = options.for_each_row(true);
        } else if self.features.is_some() {
            options = options.for_each_row(false);
        }
        options.features = self.features.or(options.features);
        options.kinds = self.features_kind.map(Kinds::all).or(options.kinds);
        options.solver = self.solver.unwrap_or(options.solver);
        if let Some(format) = self.format {
            (options.format, options.or_f32) = (format, false);
        }
        options
    }
}

/// Notes on stderr that a `model` is in f32, because no other format was asked for and fixed16 does not hold it. A frame of it
/// takes so many `cycles`.
pub fn note_format(model: &Model<'_>, options: &Options, cycles: u64) {
    let is_other = model.networks().any(|network| network.format() != options.format);
    if options.or_f32 && is_other {
        stderr::remark(format_args!(
            "note: {} does not hold this model (--format {0} tells why), so it is in {}: a frame takes {cycles} cycles",
            options.format.name(),
            Format::F32.name()
        ));
    }
}
