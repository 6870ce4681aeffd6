//! Figures as text: a table for people, which can be read back, and JSON.

use super::figures::Figures;
use super::regions::Count;
use crate::process::Outcome;

/// The clock that times are given for: an STM32F4's at its usual highest.
const CLOCK_MHZ: f64 = 168.0;

/// Marks columns of numbers, in Markdown.
const RULE: &str = "|---|--:|--:|--:|--:|--:|--:|--:|--:|";

const HEAD: &str = "| kernel | K | inference: instructions | cycles | row: instructions | cycles | \
                    frame: instructions | cycles | µs at 168 MHz |";

const ALIGNED_HEAD: &str = concat!(
    "                            |           inference |                 row |               frame",
    "     µs at\n",
    "kernel                    K |    instr.    cycles |    instr.    cycles |    instr.    cycles",
    "   168 MHz\n",
);

/// A Markdown table.
pub fn markdown(figures: &[Figures]) -> String {
    let rows = figures.iter().map(|f| {
        let (i, r, a) = (f.inference, f.row, f.frame);
        format!(
            "| {} | {} | {} | {} | {} | {} | {} | {} | {:.0} |\n",
            f.kernel,
            f.centres,
            i.instructions,
            i.cycles,
            r.instructions,
            r.cycles,
            a.instructions,
            a.cycles,
            a.cycles as f64 / CLOCK_MHZ
        )
    });
    format!("{HEAD}\n{RULE}\n{}", rows.collect::<String>())
}

/// The same with its columns aligned, for a terminal.
pub fn aligned(figures: &[Figures]) -> String {
    let rows = figures.iter().map(|f| {
        format!(
            "{:22} {:4} | {:9} {:9} | {:9} {:9} | {:9} {:9} {:9.0}\n",
            f.kernel,
            f.centres,
            f.inference.instructions,
            f.inference.cycles,
            f.row.instructions,
            f.row.cycles,
            f.frame.instructions,
            f.frame.cycles,
            f.frame.cycles as f64 / CLOCK_MHZ
        )
    });
    ALIGNED_HEAD.to_owned() + &rows.collect::<String>()
}

/// Reads a Markdown table back; other text is passed over.
pub fn parse(text: &str) -> Outcome<Vec<Figures>> {
    let rows = text.lines().filter(|line| line.starts_with('|') && ![HEAD, RULE].contains(line));
    rows.map(|row| figures(row).ok_or_else(|| format!("not understood: {row}"))).collect()
}

fn figures(row: &str) -> Option<Figures> {
    let cells: Vec<&str> = row.trim().trim_matches('|').split('|').map(str::trim).collect();
    let [kernel, numbers @ .., _] = &cells[..] else { return None };
    let numbers: Option<Vec<u64>> = numbers.iter().map(|number| number.parse().ok()).collect();
    let [centres, i, ic, r, rc, a, ac] = numbers?[..] else { return None };
    let [inference, row, frame] =
        [(i, ic), (r, rc), (a, ac)].map(|(instructions, cycles)| Count { instructions, cycles });
    Some(Figures { kernel: (*kernel).to_owned(), centres, inference, row, frame })
}

/// A list of objects. Kernels' names have nothing in them that JSON would escape.
pub fn json(figures: &[Figures]) -> String {
    let objects: Vec<String> = figures
        .iter()
        .map(|f| {
            format!(
                "  {{\"kernel\": \"{}\", \"centres\": {}, \"instructions\": {}, \"cycles\": {}, \
                 \"row_instructions\": {}, \"row_cycles\": {}, \"frame_instructions\": {}, \
                 \"frame_cycles\": {}}}",
                f.kernel,
                f.centres,
                f.inference.instructions,
                f.inference.cycles,
                f.row.instructions,
                f.row.cycles,
                f.frame.instructions,
                f.frame.cycles
            )
        })
        .collect();
    format!("[\n{}\n]\n", objects.join(",\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> Figures {
        let [inference, row, frame] =
            [1, 3, 5].map(|n| Count { instructions: n, cycles: 168 * (n + 1) });
        Figures { kernel: "f32-direct".into(), centres: 16, inference, row, frame }
    }

    #[test]
    fn a_table_says_what_was_measured_and_is_read_back() {
        let text = markdown(&[sample()]);
        assert!(
            text.ends_with("| f32-direct | 16 | 1 | 336 | 3 | 672 | 5 | 1008 | 6 |\n"),
            "{text}"
        );
        assert_eq!(parse(&text), Ok(vec![sample()]));
    }

    #[test]
    fn a_row_that_says_something_else_is_refused() {
        for row in ["| a | 16 |", "| a | K | 1 | 1 | 1 | 1 | 1 | 1 | 1 |"] {
            assert_eq!(parse(row), Err(format!("not understood: {row}")));
        }
    }

    #[test]
    fn json_names_every_figure() {
        assert_eq!(
            json(&[sample()]),
            "[\n  {\"kernel\": \"f32-direct\", \"centres\": 16, \"instructions\": 1, \"cycles\": 336, \
             \"row_instructions\": 3, \"row_cycles\": 672, \"frame_instructions\": 5, \
             \"frame_cycles\": 1008}\n]\n"
        );
    }
}
