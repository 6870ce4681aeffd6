//! Results of sweeps in words: what stands at their axes, above their columns and in their bounds.

use super::data::number;
use super::format::{grouped, symbol, with_unit};
use super::sections::Digits;
use taxel_evaluate::metrics::{Definition, unit_of_rmse};
use taxel_evaluate::sweep::bounds::{Bound, Bounds};
use taxel_evaluate::sweep::point::{GENERAL, General};

/// Result of a point, by the name that files give it.
pub struct Quantity {
    /// Heading of a column.
    pub heading: String,
    /// Its unit; empty for none, or if the heading has it.
    pub unit: String,
    /// Name in full, without a unit.
    in_full: String,
    /// What stands behind the number of a bound.
    bounded: String,
    pub digits: Digits,
}

impl Quantity {
    /// The result called `name`.
    pub fn of(name: &str) -> Self {
        let general = GENERAL.iter().find(|it| it.name == name);
        if let Some(General { heading, unit, in_full, bounded, .. }) = general {
            let is_count = unit.is_empty() && *heading != "spread" || *unit == "B";
            return Self {
                heading: (*heading).into(),
                unit: (*unit).into(),
                in_full: (*in_full).into(),
                bounded: (*bounded).into(),
                digits: if is_count { Digits::Count } else { Digits::Significant(4) },
            };
        }
        let (in_full, unit) = of_group(name);
        let bounded = if unit.is_empty() { in_full.clone() } else { format!("{unit} {in_full}") };
        let heading = in_full.replace("least possible RMSE of", "least possible");
        Self { heading, unit, in_full, bounded, digits: Digits::Significant(4) }
    }

    /// Name in full, with its unit.
    pub fn label(&self) -> String {
        with_unit(&self.in_full, &self.unit)
    }
}

/// Heading and unit of a result of a group of outputs; the name itself of one that is not known.
fn of_group(name: &str) -> (String, String) {
    let errors = [
        ("limit_standard_error_", "standard error of the least possible RMSE of"),
        ("rmse_standard_error_", "standard error of the RMSE of"),
        ("worst_rmse_standard_error_", "standard error of the worst RMSE of"),
        ("limit_", "least possible RMSE of"),
        ("worst_rmse_", "worst RMSE of"),
        ("rmse_", "RMSE of"),
    ];
    for (start, words) in errors {
        if let Some(group) = name.strip_prefix(start) {
            return (format!("{words} {}", symbol(group)), unit_of_rmse(group).into());
        }
    }
    for Definition { name: of, heading, unit, .. } in Definition::ALL {
        if let Some(group) = name.strip_prefix(of).and_then(|rest| rest.strip_prefix('_')) {
            let heading = if of == "ratio_to_limit" { "× the limit" } else { heading };
            return (format!("{heading} of {}", symbol(group)), unit.into());
        }
    }
    (name.into(), String::new())
}

/// Bounds in words, such as `at least 100 frames/s`.
pub fn in_bounds(bounds: &Bounds) -> String {
    let in_words = |(name, bound): (&String, &Bound)| {
        let (word, value) = match bound {
            Bound::Most(most) => ("at most", *most),
            Bound::Least { least } => ("at least", *least),
        };
        let is_count = value.fract() == 0.0 && value >= 0.0;
        let value = if is_count { grouped(value as usize) } else { number(value) };
        format!("{word} {value} {}", Quantity::of(name).bounded)
    };
    bounds.iter().map(in_words).collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bounds_are_told_as_people_say_them() {
        let bounds = [
            ("blob_bytes", Bound::Most(40_000.0)),
            ("frames_per_s", Bound::Least { least: 100.0 }),
            ("ratio_to_limit_dz_mm", Bound::Most(1.25)),
            ("rmse_dz_mm", Bound::Most(0.05)),
        ];
        let bounds = Bounds::from(bounds.map(|(name, bound)| (name.to_owned(), bound)));
        let words = "at most 40\u{202f}000 bytes of flash, at least 100 frames/s, at most 1.25 × the limit of Δz, at most \
                     0.05 mm RMSE of Δz";
        assert_eq!(in_bounds(&bounds), words);
    }
}
