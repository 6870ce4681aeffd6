//! Points in words.

use crate::report::format::{fixed, grouped, significant};
use taxel_evaluate::evaluate::trade::{Bounds, Point, Trade};

/// Text of a rate.
pub fn rate(frames_per_s: f64) -> String {
    if frames_per_s < 1000.0 {
        fixed(frames_per_s, 1)
    } else {
        grouped(frames_per_s.round() as usize)
    }
}

/// Text of an error with its unit.
pub fn error(trade: &Trade, rmse: f64) -> String {
    format!("{} {}", significant(rmse, 3), trade.unit).trim_end().into()
}

/// Number of centres, and what is read if points differ in it.
pub fn brief(trade: &Trade, point: &Point) -> String {
    let of = trade.distinction(&trade.readings[point.readings]);
    if of.is_empty() {
        format!("K {}", point.centres)
    } else {
        format!("K {}, {of}", point.centres)
    }
}

/// The chosen point in few words.
pub fn chosen(trade: &Trade, point: &Point) -> String {
    format!("chosen: {}, {}", brief(trade, point), error(trade, point.rmse(&trade.group)))
}

/// Bounds that are given.
pub fn bounds(bounds: &Bounds) -> String {
    let given = [
        bounds.error.map(|most| format!("an error of at most {most}")),
        bounds.cycles.map(|most| format!("at most {} cycles at zero wait", grouped(most as usize))),
        bounds.blob_bytes.map(|most| format!("a blob of at most {} bytes", grouped(most))),
        bounds.frame_rate_hz.map(|least| format!("at least {least} frames a second")),
        bounds.latency_ms.map(|most| format!("at most {most} ms for scan and decoding")),
    ];
    given.into_iter().flatten().collect::<Vec<_>>().join(", ")
}
