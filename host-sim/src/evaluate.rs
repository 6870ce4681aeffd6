//! Evaluation: errors by every definition, and the tables made of them.

pub mod cost;
pub mod gate;
pub mod metrics;
pub mod quantisation;
pub mod ram;
pub mod readout;
pub mod table1;
pub mod trade;
