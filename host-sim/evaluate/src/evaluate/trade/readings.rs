//! Readings that points decode, and what other decoders make of the same ones.

use serde::Serialize;
use taxel_learn::decoders::{BASELINES, centroid, linear, mean};

use super::device::Wires;
use super::frames::Frames;
use crate::error::Result;
use crate::metrics::{self, DecoderErrors, LimitSummary, Measure};
use crate::subject::Subject;

/// Readings of the same columns, with as many samples each.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Readings {
    /// Wires that a scan reads; `None` if the readings are not those of wires.
    pub wires: Option<Wires>,
    /// Numbers of the column-wires (from 1) as a scene's `[readout]` takes them; `None` if all are read.
    pub column_wires: Option<Vec<usize>>,
    pub samples_averaged: usize,
    /// Noise level of these means, as a fraction; 0 where a measured sensor at rest is not known.
    pub noise_level: f64,
    /// Least possible errors of a decoder that sees all these readings of a frame.
    pub limit: LimitSummary,
    /// Errors of the baselines, fitted to these readings. On contacts that move, decoding them takes no time.
    pub decoders: Vec<DecoderErrors>,
}

impl Readings {
    /// Readings of a subject's `frames`, with baselines that are judged by their `measure`.
    pub(super) fn new(
        subject: &Subject,
        frames: &Frames<'_>,
        (measure, limit): (&Measure, LimitSummary),
    ) -> Result<Self> {
        let decoders: Vec<DecoderErrors> = BASELINES
            .iter()
            .filter_map(|baseline| baseline.fit(frames.training()))
            .map(|decoder| {
                let Some(touches) = &frames.touches else {
                    return Ok(metrics::judge(decoder.as_ref(), &frames.test, measure));
                };
                let touched = touches.while_scanned(frames.scan_ms)?;
                let estimates = decoder.decode_all(&touched.moving.frames.inputs.values, 1);
                let errors = touched.errors_at_once(&estimates.values, measure);
                Ok(DecoderErrors::new(decoder.name(), errors))
            })
            .collect::<Result<_>>()?;
        let sensor = subject.scene().map(|scene| &scene.world.sensor);
        let chosen = sensor.filter(|sensor| sensor.read_columns.is_some());
        Ok(Self {
            wires: frames.wires,
            column_wires: chosen.map(|it| it.column_numbers().map(|wire| wire + 1).collect()),
            samples_averaged: frames.samples_averaged,
            noise_level: match subject {
                Subject::Scene(_) => frames.noise_level(),
                Subject::Measured(data) => data.noise_level().unwrap_or(0.0),
            },
            limit,
            decoders,
        })
    }

    /// Number of column-wires; `None` if the readings are not those of wires.
    pub fn columns(&self) -> Option<usize> {
        self.wires.map(|wires| wires.columns)
    }

    /// Errors of a group to compare points with, by name, where they are known: of the baselines, and the least possible.
    pub fn references(&self, group: &str) -> impl Iterator<Item = (&'static str, f64)> {
        let of = |name| {
            let decoder = self.decoders.iter().find(|baseline| baseline.decoder == name)?;
            metrics::rmse_of(&decoder.errors, group)
        };
        let least = self.limit.groups.iter().find(|limit| limit.group == group);
        let references = [
            ("always predicting the mean", of(mean::NAME)),
            ("best linear decoder", of(linear::NAME)),
            ("centroid", of(centroid::NAME)),
            ("least possible", least.map(|limit| limit.limit)),
        ];
        references.into_iter().filter_map(|(name, rmse)| Some((name, rmse?)))
    }
}

/// Numbers of columns and samples in words, as far as they are told, each behind a comma.
pub(super) fn in_words(columns: Option<usize>, samples: Option<usize>) -> String {
    let counted = |number: Option<usize>, name| match number {
        None => String::new(),
        Some(1) => format!(", 1 {name}"),
        Some(number) => format!(", {number} {name}s"),
    };
    counted(columns, "column") + &counted(samples, "sample")
}
