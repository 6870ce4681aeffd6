//! Evaluation: what models err and cost, and the tables made of that.

pub mod cost;
pub mod ram;
pub mod gate;
pub mod readout;
pub mod table1;
pub mod trade;
