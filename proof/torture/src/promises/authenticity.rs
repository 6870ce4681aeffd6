//! Models for a device with a key: only what was sealed with it, and nothing older, comes into force.

use mock_board::sweep::{KINDS, forge};

use crate::promise::Promise;

pub const FORGED: Promise = Promise {
    name: "seal-forged",
    text: "no forged, replayed or older model is confirmed",
    share: 1,
    check: |effort, _| {
        let cases = (8 * KINDS * 256, 10_000_000);
        Ok(effort.worst(cases, (0.0, "taken"), forge))
    },
};
