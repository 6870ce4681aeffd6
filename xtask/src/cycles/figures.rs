//! Measured figures: made from counted regions, kept in `firmware/cycles.csv`, and held to what was accepted there and
//! to budgets.

use super::trace::{Count, Region};
use crate::process::Outcome;

/// The first line of the accepted figures.
const HEAD: &str = "compiler,kernel,centres,affine,scope,instructions,cycles,flash_cycles";

/// Cost of an empty region: the call at its end, a branch taken.
const EMPTY: Count = Count { instructions: 1, cycles: 3, flash_cycles: 3 };

/// Instructions of `mov r0, #1000`, then 1000 times `subs` and `bne`, and cycles: 1 + 1000 + 999·(1 + 2) + 1. They stand
/// in one or two lines of flash, and how often they wait depends on where.
const LOOP: [u64; 2] = [2001, 3999];

/// Most per cent by which instructions, cycles, and cycles from flash may differ from those accepted for the same
/// compiler. The model of the processor may be improved; instructions may not change.
const SAME_COMPILER_PERCENT: [u64; 3] = [0, 1, 1];

/// Most per cent by which they may exceed those accepted for another compiler, which makes other code. Less is no fault.
/// Cycles from flash also depend on where code stands. Loops in assembly are the same in any compiler's image; those of
/// [`COMPILED`] are not, and standing elsewhere alone takes them from 17 % less to 13.5 % more.
const OTHER_COMPILER_PERCENT: [u64; 3] = [u64::MAX / 2, 2, 16];
const COMPILED_FROM_FLASH_PERCENT: u64 = 30;
const COMPILED: &str = "f32";

/// Budgets for any compiler: kernel, K, scope, and the most cycles of a model without an affine tail.
const BUDGETS: [(&str, u64, &str, u64); 4] = [
    // Loops that fit 1 KiB hand exponents over in memory, which takes 30 cycles for sixteen centres.
    ("fixed16", 16, "inference", 1250),
    ("fixed16", 64, "inference", 4000),
    ("fixed16", 256, "inference", 15_000),
    // This is 0.2 ms at 168 MHz.
    ("fixed16", 64, "frame", 33_600),
];

/// Budgets of an inference with K = 64 from flash, with weights in RAM: kernel, and per cent of its cycles at zero
/// wait. The loops of `fixed16` fit the flash's instruction cache.
const FROM_FLASH_PERCENT: [(&str, u64); 1] = [("fixed16", 115)];

/// A region of a run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Measured {
    pub kernel: String,
    pub scope: String,
    pub region: Region,
}

/// Joins the `counts` of a run's regions with the names in its `log`. The call at the end of each is taken off.
///
/// # Errors
/// Counts and names do not fit each other, or a region of known cost was counted otherwise.
pub fn measured(log: &str, counts: &[Region]) -> Outcome<Vec<Measured>> {
    let less = |count: Count| Count {
        instructions: count.instructions.saturating_sub(EMPTY.instructions),
        cycles: count.cycles.saturating_sub(EMPTY.cycles),
        flash_cycles: count.flash_cycles.saturating_sub(EMPTY.flash_cycles),
    };
    let names = log.lines().filter_map(|line| line.strip_prefix("INFO region ")?.split_once(' '));
    let regions: Vec<Measured> = names
        .zip(counts)
        .map(|((kernel, scope), region)| Measured {
            kernel: kernel.to_owned(),
            scope: scope.to_owned(),
            region: Region { whole: less(region.whole), ..*region },
        })
        .collect();
    let is = |at: usize, scope: &str, known: [u64; 2]| {
        regions.get(at).is_some_and(|it: &Measured| {
            let Count { instructions, cycles, .. } = it.region.whole;
            it.kernel == "calibration" && it.scope == scope && [instructions, cycles] == known
        })
    };
    if regions.len() != counts.len() || !is(0, "empty", [0, 0]) || !is(1, "loop", LOOP) {
        return Err(format!("{} regions were counted wrong: {regions:?}\n{log}", counts.len()));
    }
    Ok(regions[2..].to_vec())
}

/// Cost of one kernel in one scope with one model.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Figure {
    pub kernel: String,
    /// Number of centres K.
    pub centres: u64,
    /// Whether the model has an affine tail.
    pub affine: bool,
    /// What is measured: `inference`, `frame`, and others in `docs/cycles.md`.
    pub scope: String,
    pub count: Count,
}

impl Figure {
    /// Figures of a run with a model of so many `centres`, with an affine tail or without. Only one without has figures
    /// for an inference and its exponentials.
    pub fn of_run(measured: Vec<Measured>, centres: u64, affine: bool) -> Vec<Self> {
        let figures = measured.into_iter().flat_map(|Measured { kernel, scope, region }| {
            let exponential = Self {
                kernel: kernel.clone(),
                centres,
                affine,
                scope: "exponential".to_owned(),
                count: region.exponential,
            };
            let has_exponential = scope == "inference" && exponential.count != Count::default();
            let whole = Self { kernel, centres, affine, scope, count: region.whole };
            [Some(whole), Some(exponential).filter(|_| has_exponential)].into_iter().flatten()
        });
        let with_tail = |it: &Self| affine && ["inference", "exponential"].contains(&&*it.scope);
        figures.filter(|it| !with_tail(it)).collect()
    }

    /// What this is a figure of.
    fn key(&self) -> (&str, u64, bool, &str) {
        (&self.kernel, self.centres, self.affine, &self.scope)
    }

    fn name(&self) -> String {
        let Self { kernel, centres, scope, affine, .. } = self;
        let tail = if *affine { " with affine tail" } else { "" };
        format!("{kernel}, K = {centres}, {scope}{tail}")
    }

    fn parse(line: &str) -> Option<(&str, Self)> {
        let [compiler, kernel, centres, affine, scope, instructions, cycles, flash_cycles] =
            line.split(',').collect::<Vec<_>>()[..]
        else {
            return None;
        };
        let count = Count {
            instructions: instructions.parse().ok()?,
            cycles: cycles.parse().ok()?,
            flash_cycles: flash_cycles.parse().ok()?,
        };
        let (kernel, scope, centres) = (kernel.to_owned(), scope.to_owned(), centres.parse().ok()?);
        let affine = ["no", "yes"].iter().position(|it| *it == affine)? == 1;
        Some((compiler, Self { kernel, centres, affine, scope, count }))
    }
}

/// The accepted figures and their compiler.
#[derive(Debug, PartialEq, Eq)]
pub struct Accepted {
    pub compiler: String,
    pub figures: Vec<Figure>,
}

impl Accepted {
    /// Parses `firmware/cycles.csv`.
    ///
    /// # Errors
    /// The line that is not understood.
    pub fn parse(data: &str) -> Outcome<Self> {
        let lines = data.strip_prefix(HEAD).ok_or(format!("the first line is not {HEAD}"))?.lines();
        let lines: Vec<(&str, Figure)> = lines
            .skip(1)
            .map(|line| Figure::parse(line).ok_or(format!("not understood: {line}")))
            .collect::<Outcome<_>>()?;
        let compiler = lines.first().map_or("", |(compiler, _)| compiler).replace(';', ",");
        Ok(Self { compiler, figures: lines.into_iter().map(|(_, figure)| figure).collect() })
    }

    /// The contents of `firmware/cycles.csv`.
    pub fn data(&self) -> String {
        // No comma may stand in a field.
        let compiler = self.compiler.replace(',', ";");
        let lines = self.figures.iter().map(|Figure { kernel, centres, affine, scope, count }| {
            let [instructions, cycles, flash] = count.all();
            let affine = if *affine { "yes" } else { "no" };
            format!(
                "{compiler},{kernel},{centres},{affine},{scope},{instructions},{cycles},{flash}\n"
            )
        });
        format!("{HEAD}\n{}", lines.collect::<String>())
    }

    /// Descriptions of all `measured` figures of `compiler` that differ from these by more than they may.
    pub fn differences(&self, compiler: &str, measured: &[Figure]) -> Vec<String> {
        let is_own = compiler == self.compiler;
        let percent = if is_own { SAME_COMPILER_PERCENT } else { OTHER_COMPILER_PERCENT };
        let of_one = |now: &Figure| {
            let Some(then) = self.figures.iter().find(|then| then.key() == now.key()) else {
                return Some(format!("{}: not accepted yet", now.name()));
            };
            let mut percent = percent;
            if !is_own && now.kernel.starts_with(COMPILED) {
                percent[2] = COMPILED_FROM_FLASH_PERCENT;
            }
            let whats = ["instructions", "cycles", "cycles from flash"];
            let counts = now.count.all().into_iter().zip(then.count.all()).zip(percent).zip(whats);
            let is_off = |&(((now, then), percent), _): &(((u64, u64), u64), &str)| {
                let apart = if is_own { now.abs_diff(then) } else { now.saturating_sub(then) };
                u128::from(apart) * 100 > u128::from(percent) * u128::from(then)
            };
            let (((number, accepted), _), what) = counts.into_iter().find(is_off)?;
            Some(format!("{}: {number} {what}, accepted are {accepted}", now.name()))
        };
        let gone =
            self.figures.iter().filter(|it| !measured.iter().any(|now| now.key() == it.key()));
        let gone = gone.map(|it| format!("{}: accepted, but not measured", it.name()));
        measured.iter().filter_map(of_one).chain(gone).collect()
    }
}

/// Descriptions of all figures that exceed their budgets.
pub fn over_budget(figures: &[Figure]) -> Vec<String> {
    let over = |figure: &Figure| {
        let Count { cycles, flash_cycles, .. } = figure.count;
        let (kernel, centres, affine, scope) = figure.key();
        if affine {
            return None;
        }
        let own = BUDGETS
            .iter()
            .find(|(of, k, of_scope, _)| (*of, *k, *of_scope) == (kernel, centres, scope));
        let most = match scope {
            _ => own.map_or(u64::MAX, |(.., most)| *most),
        };
        let percent = FROM_FLASH_PERCENT
            .iter()
            .find(|(of, _)| (*of, 64, "inference") == (kernel, centres, scope));
        let most_from_flash = percent.map_or(u64::MAX, |(_, percent)| cycles * percent / 100);
        if cycles > most {
            Some(format!("{}: {cycles} cycles, {most} allowed", figure.name()))
        } else if flash_cycles > most_from_flash {
            Some(format!("{}: {flash_cycles} from flash, {most_from_flash} allowed", figure.name()))
        } else {
            None
        }
    };
    figures.iter().filter_map(over).collect()
}

#[cfg(test)]
pub mod tests {
    use super::*;

    pub fn figure(kernel: &str, scope: &str, affine: bool, cycles: u64) -> Figure {
        let count = Count { instructions: 100, cycles, flash_cycles: cycles + 100 };
        Figure { kernel: kernel.into(), centres: 64, affine, scope: scope.into(), count }
    }

    #[test]
    fn regions_are_named_and_the_call_at_their_end_is_taken_off() {
        let log = "INFO region calibration empty\nINFO region calibration loop\nINFO centres 16\n\
            INFO region a inference\nINFO region a row\n";
        let region = |instructions, cycles| {
            let whole = Count { instructions, cycles, flash_cycles: 2 * cycles };
            Region { whole, exponential: Count { instructions: 5, ..Count::default() } }
        };
        let counts = [region(1, 3), region(2002, 4002), region(11, 23), region(21, 43)];
        let found = |affine| {
            let figures = Figure::of_run(measured(log, &counts).unwrap(), 16, affine).into_iter();
            figures.map(|it| (it.scope, it.count.instructions)).collect::<Vec<_>>()
        };
        let scopes = [("inference", 10), ("exponential", 5), ("row", 20)];
        assert_eq!(found(false), scopes.map(|(scope, count)| (scope.to_owned(), count)));
        assert_eq!(found(true), [("row".to_owned(), 20)]);
        let wrong = [[region(2, 3), counts[1]], [counts[0], region(2002, 4001)]].concat();
        for calibration in wrong.chunks(2) {
            assert!(measured(log, &[calibration, &counts[2..]].concat()).is_err());
        }
        assert!(measured(&log.replace("INFO region a row\n", ""), &counts).is_err());
    }

    #[test]
    fn figures_are_compared_exactly_with_their_compilers_and_by_their_excess_with_others() {
        let accepted = Accepted {
            compiler: "a, b".into(),
            figures: vec![figure("fixed16", "row", false, 1000)],
        };
        assert_eq!(Accepted::parse(&accepted.data()).as_ref(), Ok(&accepted));
        let said = |compiler: &str, instructions, cycles, flash_cycles| {
            let count = Count { instructions, cycles, flash_cycles };
            let now = Figure { count, ..figure("fixed16", "row", false, 0) };
            accepted.differences(compiler, &[now]).concat()
        };
        assert_eq!(said("a, b", 100, 1010, 1089), "");
        assert_eq!(
            said("a, b", 99, 1000, 1100),
            "fixed16, K = 64, row: 99 instructions, accepted are 100"
        );
        assert_eq!(
            said("a, b", 100, 989, 1100),
            "fixed16, K = 64, row: 989 cycles, accepted are 1000"
        );
        assert!(said("a, b", 100, 1000, 1112).ends_with("cycles from flash, accepted are 1100"));
        assert_eq!(said("c", 900, 1020, 1276), "");
        assert_eq!(said("c", 1, 1, 1), "");
        assert!(said("c", 100, 1021, 1100).contains("1021 cycles"));
        assert!(said("c", 100, 1000, 1277).contains("1277 cycles from flash"));
        let other = accepted.differences("c", &[figure("fixed16", "frame", true, 1)]);
        assert!(other[0].ends_with("not accepted yet") && other[1].ends_with("not measured"));
    }

    #[test]
    fn a_budget_may_be_used_up_but_not_exceeded() {
        let within = [
            figure("fixed16", "inference", false, 4000),
            figure("fixed16", "frame", false, 33_600),
            figure("fixed16", "inference", true, 4001),
        ];
        assert_eq!(over_budget(&within), [""; 0]);
        let more = |it: &Figure| {
            over_budget(&[figure(&it.kernel, &it.scope, it.affine, it.count.cycles + 1)])
        };
        assert_eq!(within.iter().flat_map(more).count(), 3);
        let mut figure = figure("fixed16", "inference", false, 1000);
        figure.count.flash_cycles = 1150;
        assert_eq!(over_budget(std::slice::from_ref(&figure)), [""; 0]);
        figure.count.flash_cycles = 1151;
        assert_eq!(
            over_budget(&[figure]),
            ["fixed16, K = 64, inference: 1151 from flash, 1150 allowed"]
        );
    }
}
