//! One small file a subcommand: arguments in, library calls, results out.

pub mod decode;
pub mod eval;
pub mod forward;
pub mod inspect;
pub mod run;
pub mod synth;
pub mod table1;
pub mod train;

mod print;
mod scene_argument;
