//! Confidence of a model: how many errors its intervals cover, and which frames it finds novel.

use serde::Serialize;
use taxel_data::columns;
use taxel_data::random::Stream;
use taxel_data::table::Table;
use taxel_learn::PreparedModel;
use taxel_simulate::Synthesis;
use taxel_simulate::anomaly::{self, Anomaly};
use taxel_simulate::synth::BASELINE_FRAMES;

use crate::experiment::Experiment;

/// Errors of one group of outputs beside their deviations.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Coverage {
    /// Name of the group: `dz_mm`, or a column's name.
    pub group: String,
    pub unit: String,
    pub all: Covered,
    /// The quarter of the errors with the least deviations.
    pub surest_quarter: Covered,
    /// The quarter of the errors with the largest deviations.
    pub least_sure_quarter: Covered,
}

/// Errors, and how many of them the intervals cover.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Covered {
    pub count: usize,
    /// Root mean square of the errors, in their unit.
    pub rmse: f64,
    /// Share of the errors within one deviation; it should be 68 %.
    pub percent_within_68: f64,
    /// Share of the errors within the ratio's number of deviations; it should be 95 %.
    pub percent_within_95: f64,
}

/// One error, with its deviation and the number of deviations of the 95 % interval.
#[derive(Clone, Copy)]
struct Judged {
    error: f64,
    deviation: f64,
    ratio_95: f64,
}

impl Covered {
    fn of(judged: &[Judged]) -> Self {
        let count = judged.len();
        let share = |within: &dyn Fn(&Judged) -> bool| {
            100.0 * judged.iter().filter(|one| within(one)).count() as f64 / count as f64
        };
        let squares: f64 = judged.iter().map(|one| one.error * one.error).sum();
        Self {
            count,
            rmse: (squares / count as f64).sqrt(),
            percent_within_68: share(&|one| one.error.abs() <= one.deviation),
            percent_within_95: share(&|one| one.error.abs() <= one.ratio_95 * one.deviation),
        }
    }
}

/// Coverage of the errors of `estimates` by group of outputs. Missing truths, estimates and deviations do not count; a
/// group without any is left out.
///
/// # Panics
/// If there are not as many estimates and deviations as truths, or ratios as columns.
pub fn coverage(
    truth: &Table,
    estimates: &[f64],
    deviations: &[f64],
    ratios_95: &[f32],
) -> Vec<Coverage> {
    assert_eq!([estimates.len(), deviations.len()], [truth.values.len(); 2], "one for every truth");
    let width = truth.names.len();
    let of_group = |(group, members): &(&str, Vec<usize>)| {
        let judged = |line: usize, column: usize| {
            let at = line * width + column;
            let (error, ratio_95) =
                (estimates[at] - truth.values[at], f64::from(ratios_95[column]));
            Judged { error, deviation: deviations[at], ratio_95 }
        };
        let lines = 0..truth.len();
        let mut all: Vec<Judged> = lines
            .flat_map(|line| members.iter().map(move |column| judged(line, *column)))
            .filter(|one| !(one.error.is_nan() || one.deviation.is_nan()))
            .collect();
        all.sort_by(|a, b| a.deviation.total_cmp(&b.deviation));
        let quarter = all.len().div_ceil(4);
        (!all.is_empty()).then(|| Coverage {
            group: (*group).into(),
            unit: columns::unit_of(&truth.names[members[0]]).into(),
            all: Covered::of(&all),
            surest_quarter: Covered::of(&all[..quarter]),
            least_sure_quarter: Covered::of(&all[all.len() - quarter..]),
        })
    };
    columns::groups(&truth.names).iter().filter_map(of_group).collect()
}

/// Share of some frames that a model finds novel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Detection {
    /// What is wrong with the frames.
    pub anomaly: String,
    pub frames: usize,
    /// Share of them that are novel.
    pub percent_novel: f64,
}

/// Shares of the largest depth, and of the face's longer side, that two contacts have and are apart at least.
const CONDITIONS: [[f64; 2]; 5] = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.4], [0.2, 0.5], [0.3, 0.6]];

/// Judges which of the scene's frames `model` finds novel: usual ones, and so many `frames` of every anomaly.
///
/// A `model` without a confidence finds none.
pub fn detections(scene: &Experiment, model: &PreparedModel<'_>, frames: usize) -> Vec<Detection> {
    let world = &scene.world;
    let rest =
        Synthesis::of(world).drift(None).untouched().frames(Stream::Anomaly, BASELINE_FRAMES);
    let model = model.clone().with_baseline(&rest.inputs.means());
    let mut detections = Vec::new();
    for kind in Anomaly::ALL {
        let Some(drawn) = anomaly::frames(world, kind, frames) else { continue };
        let Some((_, novelty)) = model.assess(&drawn.readings_ohm) else { continue };
        let mut add = |anomaly: String, chosen: &mut dyn Iterator<Item = &f64>| {
            let novel: Vec<bool> = chosen.map(|novelty| *novelty > 0.0).collect();
            if novel.is_empty() {
                return;
            }
            let count = novel.iter().filter(|novel| **novel).count() as f64;
            let percent_novel = 100.0 * count / novel.len() as f64;
            detections.push(Detection { anomaly, frames: novel.len(), percent_novel });
        };
        if kind != Anomaly::TwoContacts {
            add(kind.description().into(), &mut novelty.iter());
            continue;
        }
        let [_, most_mm] = world.motion.range_mm()[2];
        let side_mm = world.sensor.size_mm[0].max(world.sensor.size_mm[1]);
        for [depth, apart] in CONDITIONS {
            let (depth_mm, apart_mm) = (depth * most_mm, apart * side_mm);
            let depth_text = format!(", {depth_mm:.1} mm deep or more");
            let apart_text = format!(", {apart_mm:.0} mm apart or more");
            let parts = [(depth > 0.0, &depth_text), (apart > 0.0, &apart_text)];
            let given =
                parts.into_iter().filter(|(given, _)| *given).map(|(_, text)| text.as_str());
            let text: String = [kind.description()].into_iter().chain(given).collect();
            let pairs = novelty.iter().zip(&drawn.contacts_mm);
            let mut chosen = pairs
                .filter(|(_, [apart, depth])| *apart >= apart_mm && *depth >= depth_mm)
                .map(|(novelty, _)| novelty);
            add(text, &mut chosen);
        }
    }
    detections
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn coverage_counts_errors_within_their_own_deviations() {
        let truth =
            Table { names: vec!["r1e1_dz_mm".into(), "r1e2_dz_mm".into()], values: vec![0.0; 8] };
        // Errors of ½, 1½, 2½ deviations and so on.
        let estimates = [0.05, 0.3, -0.15, 0.9, 0.25, -1.5, f64::NAN, 0.1];
        let deviations = [0.1, 0.2, 0.1, 0.6, 0.1, 0.6, 0.1, 0.2];
        let found = coverage(&truth, &estimates, &deviations, &[2.0, 2.0]);
        let [group] = &found[..] else { panic!("{found:?}") };
        assert_eq!((group.group.as_str(), group.unit.as_str()), ("dz_mm", "mm"));
        let covered = |of: Covered| (of.count, of.percent_within_68, of.percent_within_95);
        let (one, two) = (100.0 / 7.0 * 2.0, 100.0 / 7.0 * 5.0);
        assert_eq!(covered(group.all), (7, one, two));
        // The two with the least deviations, and the two with the largest.
        assert_eq!(covered(group.surest_quarter), (2, 50.0, 100.0));
        assert_eq!(covered(group.least_sure_quarter), (2, 0.0, 50.0));
    }
}
