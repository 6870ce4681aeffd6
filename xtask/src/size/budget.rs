//! The budget file: flash and RAM that each image may take.

use crate::process::Outcome;

/// Bytes of flash and RAM that an image may take at most.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Budget<'a> {
    pub name: &'a str,
    pub flash: u64,
    pub ram: u64,
}

impl Budget<'_> {
    /// Descriptions of what exceeds the budget.
    pub fn exceeded_by(&self, flash: u64, ram: u64) -> Vec<String> {
        [("flash", flash, self.flash), ("RAM", ram, self.ram)]
            .into_iter()
            .filter(|(_, taken, budget)| taken > budget)
            .map(|(memory, taken, budget)| {
                format!("{} takes {taken} bytes of {memory}, {budget} allowed", self.name)
            })
            .collect()
    }
}

/// Parses lines of `name flash ram`, one for each image; `#` starts a comment.
pub fn parse(text: &str) -> Outcome<Vec<Budget<'_>>> {
    let mut budgets = Vec::new();
    for (number, line) in (1..).zip(text.lines()) {
        let line = line.split('#').next().unwrap_or_default();
        let words: Vec<_> = line.split_whitespace().collect();
        let budget = match words[..] {
            [] => continue,
            [name, flash, ram] => flash
                .parse()
                .ok()
                .zip(ram.parse().ok())
                .map(|(flash, ram)| Budget { name, flash, ram }),
            _ => None,
        };
        budgets.push(budget.ok_or(format!("line {number} is not `name flash ram`: {line}"))?);
    }
    if budgets.is_empty() { Err("it names no image".into()) } else { Ok(budgets) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_empty_lines_count_for_nothing() {
        let text = "# images\n\nhello  100 20 # bytes\n";
        assert_eq!(parse(text), Ok(vec![Budget { name: "hello", flash: 100, ram: 20 }]));
    }

    #[test]
    fn a_line_that_says_something_else_is_refused_by_number() {
        for line in ["hello 100", "hello 100 -1", "hello 100 20 30", "hello 1k 20"] {
            let text = format!("# images\n{line}\n");
            assert_eq!(parse(&text), Err(format!("line 2 is not `name flash ram`: {line}")));
        }
        assert_eq!(parse("# none\n"), Err("it names no image".into()));
    }

    #[test]
    fn the_budget_may_be_used_up_but_not_exceeded() {
        let budget = Budget { name: "hello", flash: 100, ram: 20 };
        assert!(budget.exceeded_by(100, 20).is_empty());
        assert_eq!(
            budget.exceeded_by(101, 21),
            [
                "hello takes 101 bytes of flash, 100 allowed",
                "hello takes 21 bytes of RAM, 20 allowed"
            ]
        );
    }
}
