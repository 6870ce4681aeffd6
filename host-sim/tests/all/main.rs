//! Every integration test in one program: it is linked once.

mod common;
mod confidence;
mod virtual_board;
mod virtual_device;

mod accuracy;
mod contact;
mod data_files;
mod device;
mod drift;
mod export;
mod frozen;
mod health;
#[cfg(target_os = "linux")]
mod interruption;
mod json_keys;
mod limit;
mod manners;
mod mat;
mod log;
mod measured;
mod options;
#[cfg(unix)]
mod output;
mod readout;
mod recordings;
mod refusals;
mod refused_readings;
mod settings;
mod sweep;
mod trade;
#[cfg(target_os = "linux")]
mod view;
mod workflow;
