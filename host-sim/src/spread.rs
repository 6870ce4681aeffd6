//! The width σ of Gaussians on scaled inputs.

/// Checks a width σ; `field` names it in the message, which tells the value and the fix.
///
/// # Errors
/// The message.
pub fn check_spread(field: &str, spread: f64) -> std::result::Result<(), String> {
    let decay = 1.0 / (2.0 * spread * spread);
    if spread > 0.0 && (decay as f32).is_normal() {
        Ok(())
    } else {
        Err(format!(
            "{field} = {spread:?}: give a positive number, so that 1/(2σ²) fits an f32 (1e-18 to 1e18)"
        ))
    }
}
