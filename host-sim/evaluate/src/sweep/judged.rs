//! Results of a model that was judged, by their names.

use taxel_core::filter::Settings;

use super::point::Results;
use crate::metrics::{self, Blocks, Definition, Errors};
use crate::touches::Way;

/// RMSE of each group, and of [all](metrics::ALL) together if they are several.
pub(super) fn rmse_of_groups(errors: &[Errors]) -> Vec<(String, f64)> {
    let mut rmse: Vec<(String, f64)> =
        errors.iter().map(|errors| (errors.group.clone(), errors.rmse)).collect();
    if let (true, Some(all)) = (errors.len() > 1, metrics::rmse_of(errors, metrics::ALL)) {
        rmse.push((metrics::ALL.into(), all));
    }
    rmse
}

/// What a model makes of contacts that it was not trained on.
pub struct OtherContact {
    pub name: String,
    /// RMSE by group.
    pub(super) rmse: Vec<(String, f64)>,
    pub(super) blocks: Blocks,
}

impl OtherContact {
    /// RMSE of a group, in its unit.
    pub fn rmse(&self, group: &str) -> Option<f64> {
        self.rmse.iter().find(|(of, _)| of == group).map(|(_, rmse)| *rmse)
    }
}

/// Errors and cost of a model, without a filter in time, and on contacts that move behind one.
pub struct Judged {
    pub(super) before: Results,
    pub others: Vec<OtherContact>,
    pub(super) ways: Vec<Way>,
    /// Without a filter, and behind one.
    pub(super) ram_bytes: [usize; 2],
}

impl Judged {
    /// Without a filter; or with the last of what stands behind the model: its tracker, or else a filter.
    pub(super) fn way(&self, filter: bool) -> &Way {
        &self.ways[if filter { self.ways.len() - 1 } else { 0 }]
    }

    /// Results by their names.
    pub(super) fn results(&self, filter: bool) -> Results {
        let way = self.way(filter);
        let mut results = self.before.clone();
        for errors in &way.errors {
            for definition in Definition::ALL {
                let (name, group) = (definition.name, &errors.group);
                results.add(&format!("{name}_{group}"), definition.of(errors));
                let error = (definition.standard_error)(errors);
                results.add(&format!("{name}_standard_error_{group}"), error);
            }
        }
        for (group, rmse) in rmse_of_groups(&way.errors) {
            results.add_estimate("rmse", &group, rmse, way.blocks.get(&group));
            // What a filter in time makes of still contacts is not judged.
            let others = self.others.iter().filter_map(|it| Some((it.rmse(&group)?, &it.blocks)));
            let others = others.filter(|(rmse, _)| *rmse > 0.0);
            if let Some(other) = others.reduce(|a, b| if b.0 > a.0 { b } else { a }) {
                let own = (rmse, &way.blocks);
                let (worst, blocks) = if other.0 > rmse { other } else { own };
                results.add_estimate("worst_rmse", &group, worst, blocks.get(&group));
            }
        }
        let times = &way.times;
        results.add("decode_ms", Some(times.decode_ms));
        results.add("frame_ms", Some(times.frame_ms));
        results.add("frames_per_s", Some(times.frames_per_s));
        results.add("age_ms", times.age_ms);
        results.add("instructions", Some(way.cost.instructions as f64));
        results.add("cycles", Some(way.cost.cycles as f64));
        results.add("ram_bytes", Some(self.ram_bytes[usize::from(filter)] as f64));
        if way.is_tracked {
            results.add("tracked", Some(1.0));
        } else if filter {
            let Settings { time_constant_us, lead_us, .. } = way.filter;
            results.add("filter_ms", Some(f64::from(time_constant_us) / 1000.0));
            results.add("lead_ms", Some(f64::from(lead_us) / 1000.0));
        }
        results
    }
}
