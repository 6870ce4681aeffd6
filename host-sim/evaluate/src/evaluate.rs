//! Evaluation: errors and costs of models, and the tables of these.

pub mod distribution;
pub mod device_cost;
pub mod worth;
pub mod limit;
pub mod confidence;
pub mod printed;
pub mod table1;
pub mod moving_contacts;
