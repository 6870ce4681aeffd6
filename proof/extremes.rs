//! What the tests called `extremes` share: the number of their cases, and the table of docs/reliability.md, of which each
//! prints a row.
//!
//! A file and no crate, since taxel-core is tested with it too.

const PAGE: &str = include_str!("../docs/reliability.md");

/// Runs `case` for the seeds 0, 1, … : so many as the environment variable `TAXEL_CASES` says, or a `few`. A case gives
/// how far off the product is, at most `bound`; `None` for a case that the product refuses by name.
///
/// Prints the row `name` of the table. The page must have that row with the same bound.
///
/// # Panics
/// A case is beyond the bound, all are refused, or the page says otherwise.
pub fn hold(name: &str, bound: f64, few: u64, mut case: impl FnMut(u64) -> Option<f64>) {
    let count = match std::env::var("TAXEL_CASES") {
        Ok(text) => text.parse().expect("TAXEL_CASES is a number of cases"),
        Err(_) => few,
    };
    let (mut refused, mut worst) = (0, 0.0_f64);
    for seed in 0..count {
        let Some(off) = case(seed) else {
            refused += 1;
            continue;
        };
        assert!(off <= bound, "{name}, case {seed}: {off:e} is beyond {bound}");
        worst = worst.max(off);
    }
    println!(
        "| `{name}` | {worst:.3} | {bound} | {count} cases, {refused} of them refused by name"
    );
    assert!(refused < count, "{name}: all cases are refused");
    let row = PAGE.lines().find(|line| line.starts_with(&format!("| `{name}` | ")));
    let says = row.and_then(|row| row.split(" | ").nth(2)).and_then(|cell| cell.parse().ok());
    assert_eq!(says, Some(bound), "docs/reliability.md, table of extremes, bound of {name}");
}
