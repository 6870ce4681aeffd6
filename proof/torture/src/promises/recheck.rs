//! Flipped bits of the model in force, in RAM and in flash. The device checks the model while it works: what is damaged
//! is found within two passes, and replaced by what is sound.

use mock_board::sweep::flip_model;

use crate::promise::Promise;
use crate::tally::outcomes;

pub const RECHECK: Promise = Promise {
    name: "model-recheck",
    text: "flipped bits of the model: found and mended",
    share: 2,
    check: |effort, _| {
        let names = ["copied again", "noted", "the other slot's", "none is sound"];
        Ok(outcomes(effort, ("", names), "silent", flip_model))
    },
};
