//! Points in words.

use crate::report::format::significant;
use taxel_evaluate::sweep::bounds::Bound;
use taxel_evaluate::trade::{Point, Trade};

/// Text that begins a sentence.
pub fn capital(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or(String::new(), |first| first.to_uppercase().chain(letters).collect())
}

/// Text of an error with its unit.
pub fn error(trade: &Trade, rmse: f64) -> String {
    format!("{} {}", significant(rmse, 3), trade.unit).trim_end().into()
}

/// Number of centres, and what is read if points differ in it.
pub fn brief(trade: &Trade, point: &Point) -> String {
    let of = trade.distinction(point);
    if of.is_empty() {
        format!("K {}", point.centres)
    } else {
        format!("K {}, {of}", point.centres)
    }
}

/// The chosen point, which has this error, in few words.
pub fn chosen(trade: &Trade, point: &Point, rmse: f64) -> String {
    format!("chosen: {}, {}", brief(trade, point), error(trade, rmse))
}

/// The least number with three digits that is not below an error, as a bound that it keeps.
pub fn above(rmse: f64) -> String {
    let step = 10_f64.powi(rmse.log10().floor() as i32 - 2);
    significant((rmse / step).ceil() * step, 3)
}

/// Options that configure a device for a point.
pub fn device_options(trade: &Trade, point: &Point) -> String {
    let period = period_us(trade, point).map(|us| format!(" --period-us {us}"));
    let oversampling =
        (point.samples_averaged > 1).then(|| format!(" --oversampling {}", point.samples_averaged));
    let filter = point.filter.map(|filter| {
        format!(" --filter-ms {} --lead-ms {}", filter.time_constant_ms, filter.lead_ms)
    });
    [period, oversampling, filter].into_iter().flatten().collect()
}

/// Period of frames in µs to configure: as asked for, or the shortest that the point can keep up with. On contacts that move
/// the latter, at which the point was judged.
fn period_us(trade: &Trade, point: &Point) -> Option<u64> {
    let shortest = point.times.scan_ms.map(|_| (1000.0 * point.times.period_ms()).ceil())?;
    let asked = match trade.bounds.get("frames_per_s") {
        Some(Bound::Least { least }) if trade.motion.is_none() => Some((1e6 / least).floor()),
        _ => None,
    };
    Some(asked.unwrap_or(shortest) as u64)
}
