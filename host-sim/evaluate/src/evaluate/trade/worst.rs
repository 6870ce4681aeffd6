//! Errors of points on contacts that their models were not trained on.

use serde::Serialize;
use taxel_learn::PreparedModel;
use taxel_simulate::noise::Noise;

use super::Point;
use crate::metrics::{self, Measure};
use crate::others::{self, OtherFrames};
use crate::subject::Subject;

/// Still frames of other contacts, and the group of outputs that is judged there.
pub(super) struct OtherContacts {
    frames: OtherFrames,
    group: String,
}

/// Error of a point on other contacts.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OtherError {
    pub name: String,
    /// RMSE of the chosen group, in its unit.
    pub rmse: f64,
}

impl OtherContacts {
    pub fn new(subject: &Subject, noise: Option<Noise>, group: &str) -> Self {
        Self { frames: others::frames(subject, noise), group: group.into() }
    }

    /// Errors of a `model`. What it lacks on a contact is left out.
    pub fn errors(&self, model: &PreparedModel<'_>, measure: &Measure) -> Vec<OtherError> {
        let measure = Measure { limit: None, ..measure.clone() };
        let of = |(name, frames): &(String, _)| {
            let errors = metrics::judge(model, frames, &measure).errors;
            Some(OtherError { name: name.clone(), rmse: metrics::rmse_of(&errors, &self.group)? })
        };
        self.frames.iter().filter_map(of).collect()
    }
}

impl Point {
    /// Other contact on which the point's error is the largest.
    pub fn worst_other(&self) -> Option<&OtherError> {
        self.others.iter().max_by(|a, b| a.rmse.total_cmp(&b.rmse))
    }

    /// RMSE of a group that the point is chosen by: that of the subject's own frames or, in the worst case, the largest of
    /// these and all other contacts.
    pub fn counted_rmse(&self, group: &str, worst_case: bool) -> f64 {
        let own = self.rmse(group);
        let other = self.worst_other().filter(|_| worst_case);
        other.map_or(own, |other| own.max(other.rmse))
    }
}

#[cfg(test)]
mod tests {
    use taxel_data::progress::Silent;

    use super::super::{Bounds, Device, Plan, Trade, compute};
    use crate::experiment::Experiment;
    use crate::subject::Subject;

    #[test]
    fn the_worst_case_counts_other_contacts_in_front_and_choice() {
        let mut scene = Experiment::load("press").unwrap();
        scene.world.read_rows = vec![3];
        let training = &mut scene.training;
        (training.frames, training.test_frames, training.refine) = (2000, 500, false);
        let subject = Subject::Scene(scene.into());
        let plan = |worst_case| Plan {
            centres: vec![8, 64],
            samples_averaged: vec![1],
            column_steps: vec![1],
            device: Device::default(),
            worst_case,
        };
        let bounds = Bounds { frame_rate_hz: Some(1.0), ..Bounds::default() };
        let [own, worst] = [false, true].map(|worst_case| {
            let plan = plan(worst_case);
            let mut trade = compute(&subject, &plan, "dz_mm", &bounds, &Silent).unwrap();
            trade.choose(&bounds).unwrap();
            trade
        });
        for (a, b) in own.points.iter().zip(&worst.points) {
            assert_eq!((a.others.len(), &a.others), (8, &b.others));
            let largest = a.others.iter().map(|other| other.rmse).fold(a.rmse("dz_mm"), f64::max);
            assert_eq!(a.counted_rmse("dz_mm", true), largest);
            assert_eq!(a.counted_rmse("dz_mm", false), a.rmse("dz_mm"));
        }
        let least = |of: &dyn Fn(&super::Point) -> f64| {
            own.points.iter().map(of).fold(f64::INFINITY, f64::min)
        };
        let chosen = |trade: &Trade| trade.points[trade.chosen.unwrap()].clone();
        let by_own = least(&|point| point.rmse("dz_mm"));
        assert!(chosen(&own).rmse("dz_mm") <= 1.005 * by_own);
        let by_worst = least(&|point| point.counted_rmse("dz_mm", true));
        assert!(chosen(&worst).counted_rmse("dz_mm", true) <= 1.005 * by_worst);
        // No point of the front is beaten in the worst case by a faster one.
        let front = worst.front();
        let errors = front.iter().map(|i| worst.points[*i].counted_rmse("dz_mm", true));
        let errors: Vec<f64> = errors.collect();
        assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
        assert_eq!(errors.last(), Some(&by_worst));
    }
}
