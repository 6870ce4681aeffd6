//! Measured figures, made from the counts of regions and their names in the image's log.

use super::flash::WAIT_STATES;
use super::regions::{Count, Region};
use crate::process::Outcome;

/// Regions whose cost is known, in the order in which the image runs them.
const CALIBRATION: [&str; 2] = ["calibration empty", "calibration loop"];

/// Cost of an empty region: the call at its end, a branch taken.
const EMPTY: Count = Count { instructions: 1, cycles: 3, flash_cycles: 3 };

/// Instructions of `mov r0, #1000`, then 1000 times `subs` and `bne`, and cycles: 1 + 1000 + 999·(1 + 2) + 1.
const LOOP: [u64; 2] = [2001, 3999];

/// Whether `count` is that of the known loop. From flash it waits at least for its first line, and how often for
/// another depends on where it stands.
fn is_loop(count: Count) -> bool {
    let Count { instructions, cycles, flash_cycles } = count;
    [instructions, cycles] == LOOP && flash_cycles >= cycles + WAIT_STATES
}

/// Part of decoding whose cost a figure is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scope {
    /// One row's outputs from scaled inputs.
    Inference,
    /// Powers of two of all centres in an inference, where they are a separate loop.
    Exponential,
    /// One row's outputs from readings in Ω.
    Row,
    /// All rows' outputs from a frame.
    Frame,
    /// All rows' outputs behind a gate that finds all rows at rest.
    RestingFrame,
    /// All rows' outputs behind a gate that finds all rows awake (not at rest), each by its last reading.
    AwakeFrame,
    /// All rows' outputs by one network for the whole array.
    ArrayFrame,
    /// All rows' outputs by one network, behind a gate that finds the array at rest.
    ArrayRestingFrame,
    /// All rows' outputs by one network, behind a gate that finds the array awake by its last reading.
    ArrayAwakeFrame,
    /// Deviations of all outputs and the novelty of a frame, without decoding it.
    Confidence,
}

impl Scope {
    const ALL: [Self; 10] = [
        Self::Inference,
        Self::Exponential,
        Self::Row,
        Self::Frame,
        Self::RestingFrame,
        Self::AwakeFrame,
        Self::ArrayFrame,
        Self::ArrayRestingFrame,
        Self::ArrayAwakeFrame,
        Self::Confidence,
    ];

    /// Name of the scope in the image's log and in the accepted figures.
    pub fn name(self) -> &'static str {
        match self {
            Self::Inference => "inference",
            Self::Exponential => "exponential",
            Self::Row => "row",
            Self::Frame => "frame",
            Self::RestingFrame => "resting-frame",
            Self::AwakeFrame => "awake-frame",
            Self::ArrayFrame => "array-frame",
            Self::ArrayRestingFrame => "array-resting-frame",
            Self::ArrayAwakeFrame => "array-awake-frame",
            Self::Confidence => "confidence",
        }
    }

    /// The scope of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|scope| scope.name() == name)
    }
}

/// Cost of one kernel in one scope with one model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    pub kernel: String,
    pub centres: u64,
    /// Whether the model has an affine tail.
    pub affine: bool,
    pub scope: Scope,
    pub count: Count,
}

impl Figure {
    /// Whether both figures have the same kernel, K, tail and scope.
    pub fn is_of(&self, other: &Self) -> bool {
        let of = |figure: &Self| (figure.centres, figure.affine, figure.scope);
        self.kernel == other.kernel && of(self) == of(other)
    }
}

/// All figures of one kernel and K.
#[derive(Clone, Copy)]
pub struct Group<'f>(&'f [Figure]);

impl<'f> Group<'f> {
    /// The groups in `figures`, which must be sorted by kernel and K.
    pub fn of(figures: &'f [Figure]) -> impl Iterator<Item = Self> {
        figures.chunk_by(|a, b| (&a.kernel, a.centres) == (&b.kernel, b.centres)).map(Self)
    }

    pub fn kernel(self) -> &'f str {
        self.0.first().map_or("", |figure| &figure.kernel)
    }

    pub fn centres(self) -> u64 {
        self.0.first().map_or(0, |figure| figure.centres)
    }

    pub fn count(self, affine: bool, scope: Scope) -> Option<Count> {
        let wanted = |figure: &&Figure| (figure.affine, figure.scope) == (affine, scope);
        self.0.iter().find(wanted).map(|figure| figure.count)
    }
}

/// A region of a run, with the names of its kernel and scope.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Measured {
    pub kernel: String,
    pub scope: Scope,
    pub counts: Region,
}

/// Joins the `counts` of a run's regions with the names in its `log`. The call at the end of each is taken off.
pub fn measured(log: &str, counts: &[Region]) -> Outcome<Vec<Measured>> {
    let names: Vec<&str> = named(log, "region ").collect();
    if names.len() != counts.len() {
        return Err(format!(
            "{} regions were counted, {} named in the log:\n{log}",
            counts.len(),
            names.len()
        ));
    }
    let (Some((known, names)), Some(([empty, loops], counts))) =
        (names.split_first_chunk(), counts.split_first_chunk())
    else {
        return Err(format!("the image did not calibrate; it logged\n{log}"));
    };
    let (empty, loops) = (empty.whole, loops.whole - EMPTY);
    if *known != CALIBRATION || empty != EMPTY || !is_loop(loops) {
        return Err(format!(
            "the count is wrong: of an empty region {empty:?}, expected {EMPTY:?}; of a known loop \
             {loops:?}, expected {LOOP:?}"
        ));
    }
    let region = |(name, counts): (&&str, &Region)| {
        let (kernel, scope) = name.split_once(' ')?;
        let counts = Region { whole: counts.whole - EMPTY, ..*counts };
        Some(Measured { kernel: kernel.to_owned(), scope: Scope::named(scope)?, counts })
    };
    let regions = names.iter().zip(counts).map(region).collect::<Option<_>>();
    regions.ok_or_else(|| format!("not understood: {}", names.join(", ")))
}

/// Figures of a run. The run's model has an affine tail if `affine`; only models without one give figures for
/// [`Scope::Inference`] and [`Scope::Exponential`].
pub fn of_run(log: &str, counts: &[Region], affine: bool) -> Outcome<Vec<Figure>> {
    let centres = named(log, "centres ").next().and_then(|centres| centres.parse().ok());
    let centres = centres.ok_or_else(|| format!("the image names no centres:\n{log}"))?;
    let mut figures = Vec::new();
    for Measured { kernel, scope, counts } in measured(log, counts)? {
        let mut add = |scope, count| {
            figures.push(Figure { kernel: kernel.clone(), centres, affine, scope, count });
        };
        match scope {
            Scope::Inference if affine => (),
            Scope::Inference if counts.exponential != Count::default() => {
                add(scope, counts.whole);
                add(Scope::Exponential, counts.exponential);
            }
            _ => add(scope, counts.whole),
        }
    }
    Ok(figures)
}

/// What stands behind `what` in the lines of the log that start with it.
fn named<'l>(log: &'l str, what: &'static str) -> impl Iterator<Item = &'l str> {
    log.lines().filter_map(move |line| line.strip_prefix("INFO ")?.strip_prefix(what))
}

#[cfg(test)]
mod tests {
    use super::*;

    const LOG: &str = "INFO region calibration empty\nINFO region calibration loop\n\
        INFO centres 16\nINFO region a inference\nINFO region a row\nINFO region a frame\n";

    fn counts(pairs: &[(u64, u64)]) -> Vec<Region> {
        // From flash, all but the call at the end takes twice as long.
        let count = |&(instructions, cycles)| Count {
            instructions,
            cycles,
            flash_cycles: 2 * cycles - EMPTY.cycles,
        };
        pairs.iter().map(|pair| Region { whole: count(pair), ..Region::default() }).collect()
    }

    /// Count of `n` instructions.
    fn of(n: u64) -> Count {
        Count { instructions: n, cycles: 2 * n, flash_cycles: 4 * n }
    }

    #[test]
    fn what_an_empty_region_costs_is_taken_off() {
        let mut counts = counts(&[(1, 3), (2002, 4002), (11, 23), (21, 43), (31, 63)]);
        let figure = |affine, scope, n| Figure {
            kernel: "a".into(),
            centres: 16,
            affine,
            scope,
            count: of(n),
        };
        let [inference, row, frame] =
            [(Scope::Inference, 10), (Scope::Row, 20), (Scope::Frame, 30)]
                .map(|(scope, n)| figure(false, scope, n));
        let expected = vec![inference.clone(), row.clone(), frame.clone()];
        assert_eq!(of_run(LOG, &counts, false), Ok(expected));

        counts[2].exponential = of(5);
        let expected = vec![inference, figure(false, Scope::Exponential, 5), row, frame];
        assert_eq!(of_run(LOG, &counts, false), Ok(expected));

        let expected = vec![figure(true, Scope::Row, 20), figure(true, Scope::Frame, 30)];
        assert_eq!(of_run(LOG, &counts, true), Ok(expected));
    }

    #[test]
    fn regions_come_in_any_order_and_of_several_kernels() {
        let log = format!("{LOG}INFO region b resting-frame\nINFO region a awake-frame\n");
        let known = [(1, 3), (2002, 4002), (1, 3), (1, 3), (1, 3)];
        let mut all = counts(&[&known[..], &[(41, 83), (51, 103)]].concat());
        all[6].assembly = of(7);
        let found = measured(&log, &all).unwrap();
        let region = |kernel: &str, scope, n, assembly| Measured {
            kernel: kernel.into(),
            scope,
            counts: Region { whole: of(n), assembly, ..Region::default() },
        };
        let expected = [
            region("b", Scope::RestingFrame, 40, Count::default()),
            region("a", Scope::AwakeFrame, 50, all[6].assembly),
        ];
        assert_eq!(found[3..], expected);
    }

    #[test]
    fn the_array_has_scopes_of_its_own() {
        let log = "INFO region calibration empty\nINFO region calibration loop\nINFO centres 16\n\
            INFO region a array-frame\nINFO region a array-resting-frame\n\
            INFO region b array-frame\n";
        let counts = counts(&[(1, 3), (2002, 4002), (11, 23), (21, 43), (31, 63)]);
        let figure = |kernel: &str, scope, n| Figure {
            kernel: kernel.into(),
            centres: 16,
            affine: true,
            scope,
            count: of(n),
        };
        let expected = vec![
            figure("a", Scope::ArrayFrame, 10),
            figure("a", Scope::ArrayRestingFrame, 20),
            figure("b", Scope::ArrayFrame, 30),
        ];
        assert_eq!(of_run(log, &counts, true), Ok(expected));
        let error = of_run(&log.replace("b array-frame", "b else"), &counts, true).unwrap_err();
        assert!(error.starts_with("not understood: "), "{error}");
    }

    #[test]
    fn a_wrong_count_of_what_is_known_is_refused() {
        for (empty, loops) in
            [((2, 3), (2002, 4002)), ((1, 3), (2002, 4001)), ((1, 2), (2002, 4002))]
        {
            let counts = counts(&[empty, loops, (1, 3), (1, 3), (1, 3)]);
            let error = of_run(LOG, &counts, false).unwrap_err();
            assert!(error.starts_with("the count is wrong: "), "{error}");
        }
    }

    #[test]
    fn regions_without_a_name_are_refused() {
        let error = of_run(LOG, &counts(&[(1, 3), (2002, 4002)]), false).unwrap_err();
        assert!(error.starts_with("2 regions were counted, 5 named"), "{error}");
    }
}
