//! The accepted figures: a file of data, and tables in a document made from it.

use super::figures::{Figure, Scope};
use super::regions::Count;
use super::table;
use crate::process::Outcome;

/// The first line of the data.
const HEAD: &str = "compiler,kernel,centres,affine,scope,instructions,cycles,flash_cycles";

/// Heading in the document, behind which the tables go to its end.
const HEADING: &str = "## Figures\n";

/// Largest difference of cycles in per cent, with the compiler of the accepted figures. The model of the processor
/// may be improved; instructions may not change.
const TOLERANCE_PERCENT: u64 = 1;

/// A number in a count, of which there may be more than another compiler's accepted code has, but not much more.
/// Less is no fault.
pub struct Excess {
    pub what: &'static str,
    pub of: fn(Count) -> u64,
    /// Largest excess in per cent.
    pub percent: u64,
}

/// Largest excess of cycles at zero wait.
pub const EXCESS: Excess = Excess { what: "cycles", of: |count| count.cycles, percent: 2 };

/// Largest excess of cycles from flash. They also depend on where code stands within lines of flash: moved by 2 to 14
/// bytes, the accepted code takes up to 13.5 % more.
pub const FLASH_EXCESS: Excess =
    Excess { what: "cycles from flash", of: |count| count.flash_cycles, percent: 16 };

/// Accepted figures by compiler, each in the order of its measurement.
#[derive(Debug, PartialEq, Eq, Default)]
pub struct Accepted(Vec<(String, Vec<Figure>)>);

/// The accepted figures that a compiler's are compared with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Reference<'a> {
    /// Compiler of the accepted figures.
    pub compiler: &'a str,
    pub figures: &'a [Figure],
    /// Whether this is the compiler in use.
    pub is_own: bool,
}

impl Accepted {
    /// Parses the file of accepted figures.
    pub fn parse(data: &str) -> Outcome<Self> {
        let mut lines = data.lines();
        if lines.next() != Some(HEAD) {
            return Err(format!("the first line is not {HEAD}"));
        }
        let mut accepted = Self::default();
        for line in lines {
            let (compiler, figure) = parse(line).ok_or(format!("not understood: {line}"))?;
            accepted.of_mut(compiler).push(figure);
        }
        Ok(accepted)
    }

    /// The contents of the file of accepted figures.
    pub fn data(&self) -> String {
        let lines = self.0.iter().flat_map(|(compiler, figures)| {
            figures.iter().map(move |figure| {
                let Figure { kernel, centres, affine, scope, count } = figure;
                let (affine, scope) = (yes_or_no(*affine), scope.name());
                let Count { instructions, cycles, flash_cycles } = count;
                let counts = format!("{instructions},{cycles},{flash_cycles}");
                format!("{compiler},{kernel},{centres},{affine},{scope},{counts}\n")
            })
        });
        format!("{HEAD}\n{}", lines.collect::<String>())
    }

    /// The figures that `compiler` is compared with: its own, else the first other's; `None` if there are none at
    /// all.
    pub fn reference(&self, compiler: &str) -> Option<Reference<'_>> {
        let compiler = in_csv(compiler);
        let own = self.0.iter().find(|(name, _)| *name == compiler);
        let (name, figures) = own.or(self.0.first())?;
        Some(Reference { compiler: name, figures, is_own: own.is_some() })
    }

    /// Replaces the figures of `compiler` by `figures`.
    pub fn replace(&mut self, compiler: &str, figures: &[Figure]) {
        *self.of_mut(&in_csv(compiler)) = figures.to_vec();
    }

    fn of_mut(&mut self, compiler: &str) -> &mut Vec<Figure> {
        let at = self.0.iter().position(|(name, _)| name == compiler).unwrap_or_else(|| {
            self.0.push((compiler.to_owned(), Vec::new()));
            self.0.len() - 1
        });
        &mut self.0[at].1
    }

    /// The `document` with the tables of these figures at its end.
    pub fn in_document(&self, document: &str) -> Outcome<String> {
        let start = document.find(HEADING).ok_or(format!("it lacks {}", HEADING.trim()))?;
        let tables = self
            .0
            .iter()
            .map(|(compiler, figures)| format!("\n### {compiler}\n\n{}", table::markdown(figures)));
        Ok(document[..start + HEADING.len()].to_owned() + &tables.collect::<String>())
    }
}

/// The compiler's name as a field of a CSV file, in which no comma may stand.
fn in_csv(compiler: &str) -> String {
    compiler.replace(',', ";")
}

fn yes_or_no(value: bool) -> &'static str {
    if value { "yes" } else { "no" }
}

fn parse(line: &str) -> Option<(&str, Figure)> {
    let fields: Vec<&str> = line.split(',').collect();
    let [compiler, kernel, centres, affine, scope, counts @ ..] = &fields[..] else { return None };
    let [instructions, cycles, flash_cycles] = counts else { return None };
    let affine = match *affine {
        "yes" => true,
        "no" => false,
        _ => return None,
    };
    let count = Count {
        instructions: instructions.parse().ok()?,
        cycles: cycles.parse().ok()?,
        flash_cycles: flash_cycles.parse().ok()?,
    };
    let (kernel, centres) = ((*kernel).to_owned(), centres.parse().ok()?);
    Some((compiler, Figure { kernel, centres, affine, scope: Scope::named(scope)?, count }))
}

/// Descriptions of all figures in `measured` that differ from the accepted ones by more than they may.
pub fn differences(reference: &Reference<'_>, measured: &[Figure]) -> Vec<String> {
    let accepted = reference.figures;
    let difference = if reference.is_own { difference } else { excess };
    let name = |figure: &Figure| {
        let tail = if figure.affine { " with affine tail" } else { "" };
        format!("{}, K = {}, {}{tail}", figure.kernel, figure.centres, figure.scope.name())
    };
    let mut differences = Vec::new();
    for now in measured {
        match accepted.iter().find(|then| then.is_of(now)) {
            None => differences.push(format!("{}: not accepted yet", name(now))),
            Some(then) => {
                let change = difference(then.count, now.count);
                differences.extend(change.map(|change| format!("{}: {change}", name(now))));
            }
        }
    }
    let gone = accepted.iter().filter(|then| !measured.iter().any(|now| then.is_of(now)));
    differences.extend(gone.map(|then| format!("{}: accepted, but not measured", name(then))));
    differences
}

fn difference(then: Count, now: Count) -> Option<String> {
    if then.instructions != now.instructions {
        return Some(format!("{} instructions, were {}", now.instructions, then.instructions));
    }
    let pairs = [
        ("cycles", then.cycles, now.cycles),
        ("cycles from flash", then.flash_cycles, now.flash_cycles),
    ];
    let apart =
        |&(_, then, now): &(_, u64, u64)| 100 * then.abs_diff(now) > TOLERANCE_PERCENT * then;
    let (what, then, now) = pairs.into_iter().find(apart)?;
    Some(format!("{now} {what}, were {then}"))
}

fn excess(then: Count, now: Count) -> Option<String> {
    [EXCESS, FLASH_EXCESS].iter().find_map(|Excess { what, of, percent }| {
        let (then, now) = (of(then), of(now));
        let exceeds = 100 * now > then * (100 + percent);
        exceeds.then(|| format!("{now} {what}, {then} of the other compiler"))
    })
}

/// Largest differences in per cent of `what`, below and above the accepted figures.
pub fn range_percent(
    reference: &Reference<'_>,
    measured: &[Figure],
    Excess { of, .. }: &Excess,
) -> [f64; 2] {
    let pairs = measured.iter().filter_map(|now| {
        let then = reference.figures.iter().find(|then| then.is_of(now))?;
        Some(100.0 * (of(now.count) as f64 / of(then.count).max(1) as f64 - 1.0))
    });
    pairs.fold([0.0; 2], |[least, most], percent| [percent.min(least), percent.max(most)])
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::sample;
    use super::*;

    fn figure(kernel: &str, instructions: u64, cycles: u64) -> Figure {
        let count = Count { instructions, cycles, flash_cycles: 2 * cycles };
        Figure { kernel: kernel.into(), centres: 16, affine: false, scope: Scope::Row, count }
    }

    fn own(figures: &[Figure]) -> Reference<'_> {
        Reference { compiler: "rustc", figures, is_own: true }
    }

    fn others(figures: &[Figure]) -> Reference<'_> {
        Reference { compiler: "rustc", figures, is_own: false }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let mut accepted = Accepted::default();
        accepted.replace("rustc 1 (a, b)", &sample());
        accepted.replace("rustc 2", &[figure("a", 1, 2)]);
        let data = accepted.data();
        assert!(data.contains("\nrustc 1 (a; b),f32,16,yes,row,5,840,900\n"), "{data}");
        assert_eq!(Accepted::parse(&data).as_ref(), Ok(&accepted));
        let figures = |accepted: &Accepted, compiler| {
            let reference = accepted.reference(compiler).unwrap();
            (reference.figures.to_vec(), reference.is_own)
        };
        assert_eq!(figures(&accepted, "rustc 1 (a, b)"), (sample(), true));
        accepted.replace("rustc 2", &[figure("b", 3, 4)]);
        assert_eq!(figures(&accepted, "rustc 2"), (vec![figure("b", 3, 4)], true));
    }

    #[test]
    fn a_line_that_says_something_else_is_refused() {
        for line in [
            "a,b,16,no,row,1,1",
            "a,b,K,no,row,1,1,1",
            "a,b,16,0,row,1,1,1",
            "a,b,16,no,x,1,1,1",
            "a,b,16,no,row,1,1,1,1",
        ] {
            let error = Accepted::parse(&format!("{HEAD}\n{line}\n")).unwrap_err();
            assert_eq!(error, format!("not understood: {line}"));
        }
        assert!(Accepted::parse("").is_err());
    }

    #[test]
    fn the_tables_of_the_document_are_those_of_the_data() {
        let data = include_str!("../../../firmware/cycles.csv");
        let document = include_str!("../../../docs/cycles.md");
        let accepted = Accepted::parse(data).unwrap();
        assert!(!accepted.0.is_empty());
        assert_eq!(accepted.data(), data);
        assert!(
            accepted.in_document(document).unwrap() == document,
            "docs/cycles.md has other figures than firmware/cycles.csv: cargo xtask cycles --accept"
        );
    }

    #[test]
    fn instructions_are_compared_exactly_and_cycles_to_a_per_cent() {
        let accepted = [figure("a", 100, 1000)];
        assert!(differences(&own(&accepted), &[figure("a", 100, 1010)]).is_empty());
        assert_eq!(
            differences(&own(&accepted), &[figure("a", 100, 1011)]),
            ["a, K = 16, row: 1011 cycles, were 1000"]
        );
        assert_eq!(
            differences(&own(&accepted), &[figure("a", 101, 1000)]),
            ["a, K = 16, row: 101 instructions, were 100"]
        );
    }

    #[test]
    fn a_kernel_that_is_new_or_gone_is_a_difference() {
        assert_eq!(
            differences(&own(&[figure("a", 1, 1)]), &[figure("b", 1, 1)]),
            ["b, K = 16, row: not accepted yet", "a, K = 16, row: accepted, but not measured"]
        );
        assert_eq!(differences(&others(&[]), &[figure("b", 1, 1)]).len(), 1);
    }

    #[test]
    fn a_compiler_without_figures_is_held_to_the_first_others() {
        let mut accepted = Accepted::default();
        assert_eq!(accepted.reference("rustc 1"), None);
        accepted.replace("rustc 1", &[figure("a", 1, 2)]);
        accepted.replace("rustc 2", &[figure("b", 3, 4)]);
        let reference = accepted.reference("rustc 3 (new)").unwrap();
        assert_eq!((reference.compiler, reference.is_own), ("rustc 1", false));
        assert_eq!(reference.figures, [figure("a", 1, 2)]);
    }

    #[test]
    fn another_compiler_may_take_two_per_cent_more_cycles_and_any_number_less() {
        let accepted = [figure("a", 100, 1000)];
        for (instructions, cycles) in [(100, 1020), (200, 1020), (10, 100)] {
            let measured = [figure("a", instructions, cycles)];
            assert!(differences(&others(&accepted), &measured).is_empty());
        }
        assert_eq!(
            differences(&others(&accepted), &[figure("a", 100, 1021)]),
            ["a, K = 16, row: 1021 cycles, 1000 of the other compiler"]
        );
    }

    #[test]
    fn cycles_from_flash_have_tolerances_of_their_own() {
        let of = |flash_cycles| {
            let count = Count { instructions: 100, cycles: 1000, flash_cycles };
            [Figure { count, ..figure("a", 0, 0) }]
        };
        let accepted = of(2000);
        for flash_cycles in [1980, 2020] {
            assert!(differences(&own(&accepted), &of(flash_cycles)).is_empty());
        }
        assert_eq!(
            differences(&own(&accepted), &of(2021)),
            ["a, K = 16, row: 2021 cycles from flash, were 2000"]
        );
        for flash_cycles in [1000, 2320] {
            assert!(differences(&others(&accepted), &of(flash_cycles)).is_empty());
        }
        assert_eq!(
            differences(&others(&accepted), &of(2321)),
            ["a, K = 16, row: 2321 cycles from flash, 2000 of the other compiler"]
        );
    }

    #[test]
    fn how_far_figures_are_apart_is_told_on_both_sides() {
        let accepted = [figure("a", 1, 1000), figure("b", 1, 1000), figure("c", 1, 1000)];
        let measured = [figure("a", 1, 990), figure("b", 1, 1015), figure("d", 1, 5000)];
        let [least, most] = range_percent(&others(&accepted), &measured, &EXCESS);
        assert!((least + 1.0).abs() < 1e-9 && (most - 1.5).abs() < 1e-9, "{least} {most}");
    }
}
