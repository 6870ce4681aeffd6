//! What was measured: from the counts of regions and what the image says they are.

use super::regions::Count;
use crate::process::Outcome;

/// Regions whose cost is known, in the order in which the image runs them.
const CALIBRATION: [&str; 2] = ["calibration empty", "calibration loop"];

/// What an empty region costs: the call at its end, a branch taken.
const EMPTY: Count = Count { instructions: 1, cycles: 3 };

/// `mov r0, #1000`, then 1000 times `subs` and `bne`: 1 + 1000 + 999·(1 + 2) + 1 cycles.
const LOOP: Count = Count { instructions: 2001, cycles: 3999 };

/// The scopes that every kernel is measured in, in the image's order.
const SCOPES: [&str; 3] = ["inference", "row", "frame"];

/// What one kernel costs with one model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figures {
    pub kernel: String,
    /// K.
    pub centres: u64,
    /// One row's outputs from scaled inputs, without the affine tail.
    pub inference: Count,
    /// One row's outputs from readings in ohm.
    pub row: Count,
    /// All rows' outputs from a frame.
    pub frame: Count,
}

/// Puts the `counts` of a run's regions together with the names in its `log`.
///
/// # Errors
/// They do not fit one another, or what is known from the start was not counted so.
pub fn of_run(log: &str, counts: &[Count]) -> Outcome<Vec<Figures>> {
    let named = |what: &'static str| {
        log.lines().filter_map(move |line| line.strip_prefix("INFO ")?.strip_prefix(what))
    };
    let regions: Vec<&str> = named("region ").collect();
    if regions.len() != counts.len() {
        return Err(format!(
            "{} regions were counted, {} named in the log:\n{log}",
            counts.len(),
            regions.len()
        ));
    }
    let (Some((names, regions)), Some(([empty, loops], counts))) =
        (regions.split_first_chunk(), counts.split_first_chunk())
    else {
        return Err(format!("the image did not calibrate; it logged\n{log}"));
    };
    if *names != CALIBRATION || *empty != EMPTY || without(*loops, EMPTY) != LOOP {
        return Err(format!(
            "the count is wrong: of an empty region {empty:?}, expected {EMPTY:?}; of a known loop \
             {:?}, expected {LOOP:?}",
            without(*loops, EMPTY)
        ));
    }
    let centres = named("centres ").next().and_then(|centres| centres.parse().ok());
    let centres = centres.ok_or_else(|| format!("the image names no centres:\n{log}"))?;

    let (scopes, counts) = (regions.as_chunks::<3>(), counts.as_chunks::<3>());
    if !scopes.1.is_empty() {
        return Err(format!("a kernel lacks a scope:\n{log}"));
    }
    let kernels = scopes.0.iter().zip(counts.0);
    let figures = kernels.map(|(names, counts)| {
        let kernel = names[0].split(' ').next().unwrap_or_default();
        if *names != SCOPES.map(|scope| format!("{kernel} {scope}")) {
            return Err(format!("the scopes are not {}:\n{log}", SCOPES.join(", ")));
        }
        let [inference, row, frame] = counts.map(|count| without(count, EMPTY));
        Ok(Figures { kernel: kernel.to_owned(), centres, inference, row, frame })
    });
    figures.collect()
}

fn without(count: Count, less: Count) -> Count {
    Count {
        instructions: count.instructions.saturating_sub(less.instructions),
        cycles: count.cycles.saturating_sub(less.cycles),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: &str = "INFO region calibration empty\nINFO region calibration loop\n\
        INFO centres 16\nINFO region a inference\nINFO region a row\nINFO region a frame\n";

    fn counts(pairs: &[(u64, u64)]) -> Vec<Count> {
        pairs.iter().map(|&(instructions, cycles)| Count { instructions, cycles }).collect()
    }

    #[test]
    fn what_an_empty_region_costs_is_taken_off() {
        let counts = counts(&[(1, 3), (2002, 4002), (11, 23), (21, 43), (31, 63)]);
        let [inference, row, frame] =
            [10, 20, 30].map(|n| Count { instructions: n, cycles: 2 * n });
        let figures = Figures { kernel: "a".into(), centres: 16, inference, row, frame };
        assert_eq!(of_run(LOG, &counts), Ok(vec![figures]));
    }

    #[test]
    fn a_wrong_count_of_what_is_known_is_refused() {
        for (empty, loops) in
            [((2, 3), (2002, 4002)), ((1, 3), (2002, 4001)), ((1, 2), (2002, 4002))]
        {
            let error = of_run(LOG, &counts(&[empty, loops, (1, 3), (1, 3), (1, 3)])).unwrap_err();
            assert!(error.starts_with("the count is wrong: "), "{error}");
        }
    }

    #[test]
    fn regions_without_a_name_are_refused() {
        let error = of_run(LOG, &counts(&[(1, 3), (2002, 4002)])).unwrap_err();
        assert!(error.starts_with("2 regions were counted, 5 named"), "{error}");
    }
}
