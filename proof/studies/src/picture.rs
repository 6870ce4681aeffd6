//! Pictures of the studies, each as a file of its own: light or dark like the viewer.

mod heat;
mod by_noise;
mod map;
mod recursion;
mod rate;

pub use by_noise::{decoding_svg, equations_svg};
pub use map::svg as study_map_svg;
pub use rate::svg as rate_svg;
pub use recursion::svg as recursion_svg;
