//! Evaluation: errors and costs of models, and the tables of these.

pub mod distribution;
pub mod device_cost;
pub mod limit;
pub mod confidence;
pub mod paper_networks;
pub mod moving_contacts;
