//! Options of a model, over those of its scene or the usual ones.

use clap::Args;
use taxel_core::rbf::Format;
use taxel_learn::Options;
use taxel_learn::train::{Solver, WHOLE_ARRAY_SPREAD};

use super::arguments::{format, gigabytes, solver};

/// What a model computes, and how its numbers are held.
#[derive(Args, Default)]
pub struct ModelArguments {
    /// Train without the affine tail A·x.
    #[arg(long)]
    no_affine: bool,
    /// Train one network for all rows, behind a projection of all readings, instead of one a row. It is
    /// more accurate, and faster from K = 64 on, but one missing reading leaves nothing to decode.
    #[arg(long)]
    whole_array: bool,
    /// Features that --whole-array projects all readings to: no more than outputs and products of two or three of these
    /// [default: as many as a row has readings, or 18 for outputs that belong to no row].
    #[arg(long, value_name = "F", allow_negative_numbers = true)]
    features: Option<usize>,
    /// Number format of the weights [default: the scene's, or f32].
    #[arg(long, value_name = "FORMAT", value_parser = format())]
    format: Option<Format>,
    /// How output weights are computed. Both ways give the same estimates [default: the scene's, or qr].
    #[arg(long, value_name = "SOLVER", value_parser = solver())]
    solver: Option<Solver>,
    /// Memory in GB that training may take; where it would take more, it is refused at once [default: 8].
    #[arg(long, value_name = "GB", value_parser = gigabytes)]
    most_memory: Option<u64>,
}

impl ModelArguments {
    /// `options` with what was given.
    pub fn over(&self, mut options: Options) -> Options {
        options.affine_tail &= !self.no_affine;
        if self.whole_array && !options.whole_array {
            options.whole_array = true;
            options.spread *= WHOLE_ARRAY_SPREAD;
        }
        options.features = self.features.or(options.features);
        options.most_memory_bytes = self.most_memory.unwrap_or(options.most_memory_bytes);
        options.format = self.format.unwrap_or(options.format);
        options.solver = self.solver.unwrap_or(options.solver);
        options
    }
}
