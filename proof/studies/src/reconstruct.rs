//! Study `reconstruct`: which set-ups come near the paper's printed Table 1.

use std::path::{Path, PathBuf};

use clap::Args;
use host_sim::commands::progress::Terminal;
use host_sim::commands::table1::comparison;
use host_sim::commands::{Common, print};
use host_sim::report;
use host_sim::{Error, Result};
use serde::{Deserialize, Serialize};
use taxel_data::digest::digest;
use taxel_data::{input, output};
use taxel_evaluate::evaluate::printed::{CELLS, Nearness};

mod setup;
mod cells;
mod search;

use cells::{FORMULAS, INITIAL_COVARIANCES};
use search::{Candidate, Reconstruction, Tried};
use setup::AXES;

/// Search what the paper leaves open for set-ups whose Table 1 comes near the printed one.
///
/// It takes some minutes, saves what it has tried (`--saved`), and goes on from there (docs/paper.md).
#[derive(Args)]
#[command(after_help = "Example: cargo xtask study reconstruct --svg reconstruct.svg")]
pub struct Arguments {
    /// Set-ups to try.
    #[arg(long, value_name = "N", default_value_t = search::USUAL_SETUPS)]
    setups: usize,
    /// File that the search is saved to, and goes on from.
    #[arg(long, value_name = "FILE", default_value = "out/reconstruct.json")]
    saved: PathBuf,
    /// Picture to write: the tables found beside the printed one.
    #[arg(long, value_name = "FILE")]
    svg: Option<PathBuf>,
}

/// Search as it is saved, to go on from.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved {
    seed: u64,
    /// Digest of the axes: set-ups of other axes mean something else.
    axes: String,
    tried: Vec<Tried>,
}

fn axes() -> String {
    format!("{:016x}", digest(format!("{AXES:?}{FORMULAS:?}{INITIAL_COVARIANCES:?}").as_bytes()))
}

/// Searches, prints what was found, and draws it if that was asked for.
pub fn answer(arguments: &Arguments, common: &Common) -> Result<()> {
    let Arguments { setups, saved, svg } = arguments;
    let (setups, saved_to, svg) = (*setups, saved.as_path(), svg.as_deref());
    if setups == 0 {
        return Err(Error::Usage("--setups 0: give at least 1".into()));
    }
    let seed = common.seed.unwrap_or(1);
    print::check_output(saved_to, &[])?;
    if let Some(svg) = svg {
        print::check_output(svg, &[saved_to])?;
    }
    let tried = load(saved_to, seed)?;
    if !tried.is_empty() {
        eprintln!("goes on from {} set-ups in {}", tried.len(), saved_to.display());
    }
    let save = |tried: &[Tried]| -> Result<()> {
        let saved = Saved { seed, axes: axes(), tried: tried.to_vec() };
        let text = serde_json::to_string(&saved)
            .map_err(|cause| Error::failed(format!("cannot write JSON: {cause}")))?;
        Ok(output::write_bytes(saved_to, text.as_bytes())?)
    };
    let found = search::search(seed, setups, tried, save, &Terminal::new())?;
    if let Some(svg) = svg {
        output::write_bytes(svg, picture(&found).as_bytes())?;
    }
    if common.json {
        return print::json(&found);
    }
    page_of(&found).print()
}

/// Set-ups tried before, if the file is there.
fn load(path: &Path, seed: u64) -> Result<Vec<Tried>> {
    if !path.exists() {
        return Ok(Vec::new());
    }
    let other = |what: &str| {
        let path = path.display();
        Error::Usage(format!("{path}: {what}; remove it, or give another file with --saved"))
    };
    let saved: Saved = serde_json::from_str(&input::read_text(path)?)
        .map_err(|cause| other(&format!("it is no saved search ({cause})")))?;
    if saved.seed != seed {
        return Err(other(&format!("it is a search with --seed {}", saved.seed)));
    }
    if saved.axes != axes() || !saved.tried.iter().all(Tried::is_valid) {
        return Err(other("it is a search of another version of this program"));
    }
    Ok(saved.tried)
}

fn picture(found: &Reconstruction) -> String {
    let named = [("nearest", &found.nearest), ("in words", &found.within_words)];
    let tables: Vec<_> = named
        .iter()
        .filter_map(|(name, candidates)| Some((*name, candidates.first()?.cells)))
        .collect();
    report::printed_svg(&tables)
}

fn page_of(found: &Reconstruction) -> print::Page {
    let mut page = print::Page::default();
    page.line(format_args!(
        "{} set-ups were tried, {} tables compared with the paper's printed Table 1 (seed {}).\n\
         Chosen by 20 of the 40 cells, judged by the other 20. Figures are points: per cent of error.\n\
         The printed cells scatter by {:.2} about any table that is a sum of one function of spread and one of noise.",
        found.setups, found.tables, found.seed, found.roughness
    ));
    page.line(format_args!("\n{}", comparison::header("set-up")));
    page.line(comparison::line("printed", &Nearness::new(&CELLS)));
    page.line(comparison::line("a constant", &found.constant));
    list(&mut page, "nearest", &found.nearest);
    list(&mut page, "in words", &found.within_words);
    page.line(
        "\nin words: keeps to the paper's words, which speak of test samples. ± : between single draws.\n",
    );
    if let Some(first) = found.nearest.first() {
        page.line("The nearest, computed / printed, %:");
        comparison::cells(&mut page, &first.cells);
    }
    page.line(format_args!(
        "\nWhat distinguishes: the least gap of all set-ups with a value, on the fitted cells and held out; and on the\n\
         fitted cells where this value alone is changed, in the nearest set-up and in the nearest in words.\n\
         {:<21} {:<37} {:>7} {:>9} {:>8} {:>7} {:>8}",
        "open", "value", "set-ups", "least gap", "held out", "nearest", "in words"
    ));
    let mut axis = "";
    for value in &found.values {
        let name = if axis == value.axis { "" } else { &value.axis };
        axis = &value.axis;
        let points = |points: Option<f64>| points.map_or("-".into(), |p| format!("{p:.2}"));
        page.line(format_args!(
            "{name:<21} {:<37} {:>7} {:>9} {:>8} {:>7} {:>8}",
            value.value,
            value.setups,
            points(value.least_gap_fitted),
            points(value.its_gap_held_out),
            points(value.changed_alone[0]),
            points(value.changed_alone[1])
        ));
    }
    if !found.scatter.is_empty() {
        page.line(
            "\nScatter of a cell between draws (nearest in words), if so few samples judge it:",
        );
        for it in &found.scatter {
            page.line(format_args!("{:>6} samples  {:.2} points", it.samples, it.points));
        }
    }
    page.line("\nPrinted cells that the nearest set-ups miss by most:");
    for it in &found.unexplained {
        page.line(format_args!(
            "spread {:?}, noise {}: printed {:.2} %, nearest {:.2} %",
            it.spread,
            print::percent(it.noise_level),
            it.printed_percent,
            it.nearest_percent
        ));
    }
    page
}

fn list(page: &mut print::Page, name: &str, candidates: &[Candidate]) {
    // JSON has all of them.
    for (number, candidate) in (1..=4).zip(candidates) {
        let [gap, deviation] = candidate.gap_held_out_of_a_draw;
        page.line(format_args!(
            "{}   {gap:.2} ± {deviation:.2}",
            comparison::line(&format!("{name} {number}"), &candidate.nearness)
        ));
        let [samples, centres] = candidate.samples_and_centres;
        let choices: Vec<String> = candidate
            .choices
            .iter()
            .filter(|(axis, _)| axis != "samples N" && axis != "centres K")
            .map(|(axis, value)| format!("{axis}: {value}"))
            .collect();
        print::wrapped(page, &format!("N = {samples}, K = {centres}; {}.\n", choices.join("; ")));
    }
}

#[cfg(test)]
mod tests {
    use taxel_data::random::{Purpose, Random, Stream};

    use super::*;
    use setup::Setup;

    #[test]
    fn a_search_goes_on_from_the_file_that_it_was_saved_to() {
        let saved = std::env::temp_dir().join(format!("taxel-{}-s.json", std::process::id()));
        let _ = std::fs::remove_file(&saved);
        let search = |seed| {
            let arguments = Arguments { setups: 1, saved: saved.clone(), svg: None };
            answer(&arguments, &Common { seed: Some(seed), json: true, ..Common::default() })
        };
        search(1).unwrap();
        let bytes = std::fs::read(&saved).unwrap();
        search(1).unwrap();
        assert!(std::fs::read(&saved).unwrap() == bytes);
        let refused = search(2).unwrap_err().to_string();
        assert!(refused.contains("s.json") && refused.contains("--seed 1"), "{refused}");
        std::fs::write(&saved, "{}").unwrap();
        assert!(search(1).unwrap_err().to_string().contains("it is no saved search"));
        std::fs::remove_file(&saved).unwrap();
    }

    #[test]
    fn a_saved_search_is_read_back_to_the_last_bit() {
        let mut random = Random::new(1, Stream::Test, Purpose::Setup, 0, 0);
        for _ in 0..50 {
            let cells = [[0.0; 4]; 10].map(|line: [f64; 4]| line.map(|_| 10.0 * random.unit()));
            let gaps = vec![(0, 1, [random.unit(), random.unit()])];
            let setup = Setup::random(&mut random);
            let tried = Tried { setup, covariance: 0, formula: 1, cells, gaps };
            let text = serde_json::to_string(&tried).unwrap();
            assert_eq!(serde_json::from_str::<Tried>(&text).unwrap(), tried);
        }
    }
}
