#![doc = include_str!("../README.md")]

pub use taxel_core as core;
pub use taxel_data as data;
pub use taxel_evaluate as evaluate;
pub use taxel_firmware as firmware;
pub use taxel_learn as learn;
pub use taxel_limit as limit;
pub use taxel_recording as recording;
pub use taxel_rig as rig;
pub use taxel_simulate as simulate;
pub use taxel_view as view;
