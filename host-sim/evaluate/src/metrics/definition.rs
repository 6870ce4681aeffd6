//! Definitions of error: a line of the list is a column of all tables and files.

use super::Errors;

/// Definition of error, as tables, their legends and files know it.
#[derive(Debug, Clone, Copy)]
pub struct Definition {
    /// Name in CSV and JSON, with the unit.
    pub name: &'static str,
    /// Heading of a column, and its unit; empty for none, or for that of the output.
    pub heading: &'static str,
    pub unit: &'static str,
    /// Decimals to show; `None` for three digits.
    pub decimals: Option<usize>,
    /// What it is, in symbols: error e, truth Δ.
    pub formula: &'static str,
    value: fn(&Errors) -> Option<f64>,
    /// Standard error of the value, where it is known.
    pub standard_error: fn(&Errors) -> Option<f64>,
}

impl Definition {
    /// All definitions: first what matters most, since narrow windows show that.
    pub const ALL: [Self; 8] = [
        Self::new("rmse", "RMSE", "", None, "√mean(e²), in the output’s unit", |it| {
            Some(it.rmse)
        }),
        Self {
            standard_error: |it| it.ratio_standard_error,
            ..Self::new(
                "ratio_to_limit",
                "× limit",
                "",
                Some(2),
                "RMSE/least possible RMSE, both on the frames of the limit",
                |it| it.ratio_to_limit,
            )
        },
        Self::new(
            "rmse_of_noise",
            "of noise",
            "",
            None,
            "RMSE that the noise of readings at rest causes in the estimates, in the output’s unit",
            |it| it.rmse_of_noise,
        ),
        Self::new("r_squared", "R²", "", Some(3), "1 − Σe²/Σ(Δ − mean Δ)²", |it| {
            it.r_squared
        }),
        Self::new(
            "full_scale_percent",
            "%FS",
            "",
            Some(2),
            "mean|e|/full scale, in per cent of the range that the scene allows or a measured column spans",
            |it| it.full_scale_percent,
        ),
        Self::new("relative_l2_percent", "relative L2", "%", Some(2), "‖e‖/‖Δ‖", |it| {
            it.relative_l2_percent
        }),
        Self::new(
            "positional_percent",
            "positional",
            "%",
            Some(2),
            "mean|e|/(H − Δz) with the sensor’s thickness H",
            |it| it.positional_percent,
        ),
        Self::new(
            "mean_relative_percent",
            "mean relative",
            "%",
            Some(2),
            "mean(|e|/|Δ|) where |Δ| > 10 % of full scale",
            |it| it.mean_relative_percent,
        ),
    ];

    const fn new(
        name: &'static str,
        heading: &'static str,
        unit: &'static str,
        decimals: Option<usize>,
        formula: &'static str,
        value: fn(&Errors) -> Option<f64>,
    ) -> Self {
        Self { name, heading, unit, decimals, formula, value, standard_error: |_| None }
    }

    /// Error by this definition, where it is defined.
    pub fn of(&self, errors: &Errors) -> Option<f64> {
        (self.value)(errors)
    }

    /// Heading, unit and formula, for captions.
    pub fn in_words(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" ({})", self.unit) };
        format!("{}{unit} = {}", self.heading, self.formula)
    }
}
