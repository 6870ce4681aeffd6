//! Ctrl-C and SIGTERM: the first ends the work in good order, the second at once.

use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use host_sim::{Error, Result};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag;

/// Exit status of a program that Ctrl-C ended.
const INTERRUPTED: i32 = 130;

/// Flag that Ctrl-C or SIGTERM sets from now on, instead of ending the program.
pub fn flag() -> Result<Arc<AtomicBool>> {
    let interrupted = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal finds the flag clear, and the second finds it set.
        flag::register_conditional_shutdown(signal, INTERRUPTED, interrupted.clone())
            .and_then(|_| flag::register(signal, interrupted.clone()))
            .map_err(|cause| Error::Failed(format!("cannot watch for Ctrl-C: {cause}")))?;
    }
    Ok(interrupted)
}
