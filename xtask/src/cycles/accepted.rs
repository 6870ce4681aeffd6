//! The figures that were accepted: a table for each compiler, in a document for people.

use super::figures::Figures;
use super::regions::Count;
use super::table;
use crate::process::Outcome;

/// What every table stands under, before the compiler's name.
const HEADING: &str = "### ";

/// By how much cycles may differ, in per cent: the model may learn, instructions may not change.
const TOLERANCE_PERCENT: u64 = 1;

/// The figures in `document` for `compiler`; `None` if it has none.
///
/// # Errors
/// A row of its table is not understood: which.
pub fn read(document: &str, compiler: &str) -> Outcome<Option<Vec<Figures>>> {
    let Some((start, end)) = section(document, compiler) else { return Ok(None) };
    table::parse(&document[start..end]).map(Some)
}

/// `document` with `figures` as those for `compiler`: in the place of what was there, or at the end.
pub fn write(document: &str, compiler: &str, figures: &[Figures]) -> String {
    let text = format!("{HEADING}{compiler}\n\n{}", table::markdown(figures));
    match section(document, compiler) {
        Some((start, end)) if end < document.len() => {
            format!("{}{text}\n{}", &document[..start], &document[end..])
        }
        Some((start, _)) => format!("{}{text}", &document[..start]),
        None => format!("{}\n\n{text}", document.trim_end()),
    }
}

/// From the heading for `compiler` to the next heading of whatever level, or the end.
fn section(document: &str, compiler: &str) -> Option<(usize, usize)> {
    let mut at = 0;
    let mut start = None;
    for line in document.split_inclusive('\n') {
        match start {
            None if line.strip_prefix(HEADING).map(str::trim) == Some(compiler) => start = Some(at),
            Some(start) if line.starts_with('#') => return Some((start, at)),
            _ => (),
        }
        at += line.len();
    }
    start.map(|start| (start, at))
}

/// What `measured` differs in from what was `accepted`, in words.
pub fn differences(accepted: &[Figures], measured: &[Figures]) -> Vec<String> {
    let same = |a: &Figures, b: &Figures| a.kernel == b.kernel && a.centres == b.centres;
    let name = |figures: &Figures| format!("{}, K = {}", figures.kernel, figures.centres);
    let mut differences = Vec::new();
    for now in measured {
        let Some(then) = accepted.iter().find(|then| same(then, now)) else {
            differences.push(format!("{}: not accepted yet", name(now)));
            continue;
        };
        for (scope, then, now_count) in [
            ("inference", then.inference, now.inference),
            ("row", then.row, now.row),
            ("frame", then.frame, now.frame),
        ] {
            let change = difference(then, now_count);
            differences.extend(change.map(|change| format!("{}, {scope}: {change}", name(now))));
        }
    }
    for then in accepted {
        if !measured.iter().any(|now| same(then, now)) {
            differences.push(format!("{}: accepted, but not measured", name(then)));
        }
    }
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
    use super::*;

    fn figures(kernel: &str, instructions: u64, cycles: u64) -> Figures {
        let count = Count { instructions, cycles };
        Figures { kernel: kernel.into(), centres: 16, inference: count, row: count, frame: count }
    }

    #[test]
    fn what_is_written_is_read_back_and_the_rest_of_the_document_stays() {
        let document = "# Cycles\n\nText.\n\n### rustc 1\n\nold\n\n### rustc 2\n\nmore\n";
        let written = write(document, "rustc 1", &[figures("a", 1, 2)]);
        assert!(written.starts_with("# Cycles\n\nText.\n\n### rustc 1\n\n| kernel"), "{written}");
        assert!(written.ends_with("|\n\n### rustc 2\n\nmore\n"), "{written}");
        assert_eq!(read(&written, "rustc 1"), Ok(Some(vec![figures("a", 1, 2)])));
        assert_eq!(read(&written, "rustc"), Ok(None));

        let again = write(&written, "rustc 2", &[figures("b", 3, 4)]);
        let again = write(&again, "rustc 3", &[figures("c", 5, 6)]);
        for (compiler, kernel, count) in
            [("rustc 1", "a", (1, 2)), ("rustc 2", "b", (3, 4)), ("rustc 3", "c", (5, 6))]
        {
            let expected = vec![figures(kernel, count.0, count.1)];
            assert_eq!(read(&again, compiler), Ok(Some(expected)));
        }
        assert_eq!(write(&again, "rustc 3", &[figures("c", 5, 6)]), again);
        assert_eq!(write(&again, "rustc 1", &[figures("a", 1, 2)]), again);
    }

    #[test]
    fn every_table_of_the_document_is_understood() {
        let document = include_str!("../../../docs/cycles.md");
        let compilers: Vec<_> =
            document.lines().filter_map(|line| line.strip_prefix(HEADING)).collect();
        assert!(!compilers.is_empty());
        for compiler in compilers {
            let figures = read(document, compiler).unwrap().unwrap();
            assert!(!figures.is_empty(), "{compiler}");
            assert_eq!(write(document, compiler, &figures), document, "{compiler}");
        }
    }

    #[test]
    fn instructions_are_compared_exactly_and_cycles_to_a_per_cent() {
        let accepted = [figures("a", 100, 1000)];
        assert!(differences(&accepted, &[figures("a", 100, 1010)]).is_empty());
        assert_eq!(
            differences(&accepted, &[figures("a", 100, 1011)])[0],
            "a, K = 16, inference: 1011 cycles, were 1000"
        );
        assert_eq!(
            differences(&accepted, &[figures("a", 101, 1000)])[2],
            "a, K = 16, frame: 101 instructions, were 100"
        );
    }

    #[test]
    fn a_kernel_that_is_new_or_gone_is_a_difference() {
        assert_eq!(
            differences(&[figures("a", 1, 1)], &[figures("b", 1, 1)]),
            ["b, K = 16: not accepted yet", "a, K = 16: accepted, but not measured"]
        );
    }
}
