//! Evaluation: errors and costs of models, and the tables of these.

pub mod gate;
pub mod drift;
pub mod readout;
pub mod limit;
pub mod table1;
pub mod trade;
