//! Every test in one program: it is linked once.

#[path = "../../../../proof/extremes.rs"]
mod table;

mod sensor;
mod lanes;
mod dent;
mod path;
mod timetable;
mod rubber;
mod noise;
mod synth;
mod trajectories;
mod extremes;
