//! Power that can be cut in the middle of an operation.

use std::cell::RefCell;

/// Error of flash without power. Nothing more happens until the power is switched on.
pub struct PowerCut;

/// When the power is cut.
#[derive(Default)]
pub struct Power {
    /// Number of operations on words until the power is cut; `None` if it is not.
    left: Option<usize>,
    gone: bool,
}

impl Power {
    /// Power that is cut after so many `operations`.
    pub fn cut_after(operations: usize) -> Self {
        Self { left: Some(operations), gone: false }
    }

    /// Switches the power on; returns whether it had been cut.
    pub fn on(&mut self) -> bool {
        std::mem::take(self).gone
    }
}

/// Carries out an operation on a word, unless the power is cut.
pub fn operate(power: &RefCell<Power>) -> Result<(), PowerCut> {
    let mut power = power.borrow_mut();
    match power.left {
        Some(0) => {
            power.gone = true;
            return Err(PowerCut);
        }
        Some(left) => power.left = Some(left - 1),
        None => {}
    }
    Ok(())
}
