//! The figures that were accepted: a file of data, and tables for people made from it.

use super::figures::{Figure, Scope};
use super::regions::Count;
use super::table;
use crate::process::Outcome;

/// The first line of the data.
const HEAD: &str = "compiler,kernel,centres,affine,scope,instructions,cycles";

/// The heading that the tables stand under, in a document, to its end.
const HEADING: &str = "## Figures\n";

/// By how much cycles may differ, in per cent: the model may learn, instructions may not change.
const TOLERANCE_PERCENT: u64 = 1;

/// Figures by compiler, each in the order of its measurement.
#[derive(Debug, PartialEq, Eq, Default)]
pub struct Accepted(Vec<(String, Vec<Figure>)>);

impl Accepted {
    /// Reads the data.
    ///
    /// # Errors
    /// A line is not understood: which.
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

    /// The data.
    pub fn data(&self) -> String {
        let lines = self.0.iter().flat_map(|(compiler, figures)| {
            figures.iter().map(move |figure| {
                let Figure { kernel, centres, affine, scope, count } = figure;
                let (affine, scope) = (yes_or_no(*affine), scope.name());
                let Count { instructions, cycles } = count;
                format!("{compiler},{kernel},{centres},{affine},{scope},{instructions},{cycles}\n")
            })
        });
        format!("{HEAD}\n{}", lines.collect::<String>())
    }

    /// The figures for `compiler`; `None` if there are none.
    pub fn of(&self, compiler: &str) -> Option<&[Figure]> {
        self.0.iter().find(|(name, _)| name == compiler).map(|(_, figures)| figures.as_slice())
    }

    /// Puts `figures` in the place of those for `compiler`.
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

    /// `document` with the tables of these figures, and nothing behind them.
    ///
    /// # Errors
    /// It has no place for them.
    pub fn in_document(&self, document: &str) -> Outcome<String> {
        let start = document.find(HEADING).ok_or(format!("it lacks {}", HEADING.trim()))?;
        let tables = self
            .0
            .iter()
            .map(|(compiler, figures)| format!("\n### {compiler}\n\n{}", table::markdown(figures)));
        Ok(document[..start + HEADING.len()].to_owned() + &tables.collect::<String>())
    }
}

/// No comma may stand in a field.
pub fn in_csv(compiler: &str) -> String {
    compiler.replace(',', ";")
}

fn yes_or_no(value: bool) -> &'static str {
    if value { "yes" } else { "no" }
}

fn parse(line: &str) -> Option<(&str, Figure)> {
    let fields: Vec<&str> = line.split(',').collect();
    let [compiler, kernel, centres, affine, scope, instructions, cycles] = fields[..] else {
        return None;
    };
    let affine = match affine {
        "yes" => true,
        "no" => false,
        _ => return None,
    };
    let count = Count { instructions: instructions.parse().ok()?, cycles: cycles.parse().ok()? };
    let (kernel, centres) = (kernel.to_owned(), centres.parse().ok()?);
    Some((compiler, Figure { kernel, centres, affine, scope: Scope::named(scope)?, count }))
}

/// What `measured` differs in from what was `accepted`, in words.
pub fn differences(accepted: &[Figure], measured: &[Figure]) -> Vec<String> {
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
    let apart = 100 * then.cycles.abs_diff(now.cycles) > TOLERANCE_PERCENT * then.cycles;
    apart.then(|| format!("{} cycles, were {}", now.cycles, then.cycles))
}

#[cfg(test)]
mod tests {
    use super::super::table::tests::sample;
    use super::*;

    fn figure(kernel: &str, instructions: u64, cycles: u64) -> Figure {
        let count = Count { instructions, cycles };
        Figure { kernel: kernel.into(), centres: 16, affine: false, scope: Scope::Row, count }
    }

    #[test]
    fn what_is_written_is_read_back() {
        let mut accepted = Accepted::default();
        accepted.replace("rustc 1 (a, b)", &sample());
        accepted.replace("rustc 2", &[figure("a", 1, 2)]);
        let data = accepted.data();
        assert!(data.contains("\nrustc 1 (a; b),f32,16,yes,row,5,840\n"), "{data}");
        assert_eq!(Accepted::parse(&data).as_ref(), Ok(&accepted));
        assert_eq!(accepted.of(&in_csv("rustc 1 (a, b)")), Some(sample().as_slice()));
        assert_eq!(accepted.of("rustc"), None);
        accepted.replace("rustc 2", &[figure("b", 3, 4)]);
        assert_eq!(accepted.of("rustc 2"), Some([figure("b", 3, 4)].as_slice()));
    }

    #[test]
    fn a_line_that_says_something_else_is_refused() {
        for line in ["a,b,16,no,row,1", "a,b,K,no,row,1,1", "a,b,16,0,row,1,1", "a,b,16,no,x,1,1"] {
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
        assert!(differences(&accepted, &[figure("a", 100, 1010)]).is_empty());
        assert_eq!(
            differences(&accepted, &[figure("a", 100, 1011)]),
            ["a, K = 16, row: 1011 cycles, were 1000"]
        );
        assert_eq!(
            differences(&accepted, &[figure("a", 101, 1000)]),
            ["a, K = 16, row: 101 instructions, were 100"]
        );
    }

    #[test]
    fn a_kernel_that_is_new_or_gone_is_a_difference() {
        assert_eq!(
            differences(&[figure("a", 1, 1)], &[figure("b", 1, 1)]),
            ["b, K = 16, row: not accepted yet", "a, K = 16, row: accepted, but not measured"]
        );
    }
}
