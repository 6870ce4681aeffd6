//! Verdict on a model in plain words.

use serde::Serialize;

use crate::metrics::{DecoderErrors, LimitSummary};

/// What a model is worth, in words.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Verdict {
    /// One or two sentences.
    pub sentence: String,
    /// What to beware of, a sentence each.
    pub warnings: Vec<String>,
}

impl Verdict {
    /// Verdict on the first of `decoders` beside the others and the `limit`, for the outputs of `group`.
    #[must_use]
    pub fn of(group: &str, decoders: &[DecoderErrors], limit: &LimitSummary) -> Self {
        let rmse = |decoder: &DecoderErrors| {
            decoder.errors.iter().find(|e| e.group == group).map_or(f64::NAN, |e| e.rmse)
        };
        let others: Vec<(&str, f64)> =
            decoders.iter().skip(1).map(|d| (d.decoder.as_str(), rmse(d))).collect();
        let Some(model) = decoders.first().map(rmse) else {
            return Self { sentence: String::new(), warnings: vec![] };
        };
        let unit = decoders[0].errors.iter().find(|e| e.group == group).map_or("", |e| &e.unit);
        let against = |(name, other): &(&str, f64)| {
            let less = 100.0 * (1.0 - model / other);
            let name = if *name == "mean" {
                "always predicting the mean"
            } else {
                "the best linear decoder"
            };
            if less >= 0.5 {
                format!("{less:.0} % less than {name}")
            } else {
                format!("no less than {name}")
            }
        };
        let against: Vec<String> = others.iter().rev().map(against).collect();
        let limit = limit.groups.iter().find(|limit| limit.group == group);
        let limit = limit.map_or(String::new(), |limit| {
            format!(" The least possible error of any decoder is {:.3} {unit}.", limit.limit)
        });
        let beside = if against.is_empty() {
            String::new()
        } else {
            format!(": {}", against.join(", and "))
        };
        let sentence =
            format!("The model decodes {group} with an RMSE of {model:.3} {unit}{beside}.{limit}");
        Self { sentence, warnings: vec![] }
    }
}
