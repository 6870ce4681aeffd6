//! All tests of the crate in one program: it is linked once. Modules have the names of the source files that they test.

#[path = "../../../../proof/extremes.rs"]
mod table;

mod cost;
mod decoders {
    mod centroid;
    mod textbook;
}
mod export {
    mod c;
}
mod faults;
mod filtered;
mod folds;
mod infer {
    mod fixed16;
    mod pairs;
}
mod number_formats;
mod outliers;
mod random_models;
mod reading_model;
mod recalibration;
mod rls;
mod train;
mod extremes;
