//! Requests to a device with a key: only what was sealed with it, for it and just now, changes anything.

use mock_board::sweep::{KINDS, forge};

use crate::promise::Promise;

pub const FORGED: Promise = Promise {
    name: "seal-forged",
    text: "no forged or replayed request changes anything",
    share: 1,
    check: |effort, _| {
        let cases = (8 * KINDS * 256, 10_000_000);
        Ok(effort.worst(cases, (0.0, "taken"), forge))
    },
};
