//! README and docs: links and words are checked, figures and pictures are made again; the site is built.

mod pages;
mod numbers;
mod made;
pub mod site;

use crate::process::Outcome;
use made::Made;
use pages::Page;

/// Most words of README and docs together.
const MOST_WORDS: usize = 22_000;

/// What to make again, besides the checks of links and words.
#[derive(clap::Args)]
pub struct Options {
    /// Commands in docs/made.toml to run, or `all`, which takes half an hour: their figures and pictures are compared with those in
    /// the docs [default: those of seconds].
    names: Vec<String>,
    /// Write what the commands give into the docs, instead of comparing.
    #[arg(long)]
    accept: bool,
}

/// Checks README and docs, and makes again what the options name.
pub fn run(options: &Options) -> Outcome {
    let pages = Page::all()?;
    let made = Made::read()?;
    let mut faults = pages::faults(&pages);
    faults.extend(made.faults(&pages));
    let documentation = pages.iter().filter(|page| page.is_documentation());
    let words: usize = documentation.map(|page| words(&page.text)).sum();
    println!("{words} words, {} links", pages::link_count(&pages));
    if words > MOST_WORDS {
        faults.push(format!("README and docs have {words} words, more than {MOST_WORDS}"));
    }
    for run in made.chosen(&options.names)? {
        let wrong = made::again(run, options.accept).unwrap_or_else(|cause| vec![cause]);
        wrong.iter().for_each(|fault| println!("  {fault}"));
        faults.extend(wrong);
    }
    if faults.is_empty() { Ok(()) } else { Err(faults.join("\n")) }
}

/// Words of a text, those in cells of tables and in code among them.
fn words(text: &str) -> usize {
    let parts = text.split(|letter: char| letter.is_whitespace() || letter == '|');
    parts.filter(|part| part.contains(char::is_alphanumeric)).count()
}

#[cfg(test)]
mod tests {
    #[test]
    fn words_of_tables_count_and_their_lines_do_not() {
        assert_eq!(super::words("# A b\n\n|c d|1.5|\n|---|--:|\n\n- e — f"), 7);
    }
}
