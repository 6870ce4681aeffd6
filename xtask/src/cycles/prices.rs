//! The price list of code, `firmware/prices.csv`: made from many designs, and checked with others.

use std::fs;
use std::path::Path;

use taxel_learn::cost::Prices;

use super::code::Code;
use super::loops::Loop;
use super::predicted::{self, Frame};
use super::regions::Count;
use super::{designs, fit};
use crate::process::{Outcome, root};

/// File of the price list.
const FILE: &str = "firmware/prices.csv";

/// Largest error in per cent of what the list tells of a frame's instructions and cycles.
const TOLERANCE_PERCENT: f64 = 2.0;

/// Largest error in per cent of cycles from flash: how long code waits depends on what was executed before it.
const FLASH_TOLERANCE_PERCENT: f64 = 10.0;

/// Largest error in per cent with exponentials that branch by their arguments: their prices are those of one spread of
/// arguments.
const BRANCHING_PERCENT: f64 = 10.0;

/// How many per cent more cycles than predicted a frame may take with another compiler: that error, and as much as accepted
/// figures may be exceeded by.
const OTHER_COMPILERS_PERCENT: f64 = 4.0;

/// Measures many designs, and writes the price list that fits them best. A list of another compiler stays.
pub fn accept(image: &Path, code: &Code, directory: &Path, compiler: &str) -> Outcome {
    if let Some(other) = prices().ok().map(|list| list.compiler).filter(|it| it != compiler) {
        eprintln!("{FILE} stays that of {other}: remove it to make one of {compiler}");
        return Ok(());
    }
    let designs = designs::for_prices();
    eprintln!("measuring {} designs for {FILE}", designs.len());
    let (frames, _) = predicted::measure_designs(&designs, image, code, directory)?;
    let text = Prices::text(compiler, &fit::prices(&frames)?);
    fs::write(root().join(FILE), text).map_err(|cause| format!("{FILE}: {cause}"))
}

/// Measures other designs than those that the list was made from, and says how well it predicts their costs; also
/// returns the loops in them. With another `compiler` than the list's, code in assembly must be predicted exactly, and
/// nothing may take more cycles than predicted by more than a margin.
pub fn check(
    image: &Path,
    code: &Code,
    directory: &Path,
    compiler: &str,
) -> Outcome<(String, Vec<Loop>)> {
    let designs = designs::to_check();
    let (frames, loops) = predicted::measure_designs(&designs, image, code, directory)?;
    let prices = prices()?;
    let compared = compare(&frames, &prices)?;
    let range = |of: fn(&Compared<'_>) -> f64| {
        let errors = compared.iter().map(of);
        let [least, most] =
            errors.fold([0.0_f64; 2], |[least, most], it| [least.min(it), most.max(it)]);
        format!("{least:+.2} to {most:+.2} %")
    };
    held(&compared, prices.compiler != compiler)?;
    let said = format!(
        "{FILE} predicts the costs of {} frames of {} random designs: of assembly exactly, all instructions to {}, \
         cycles to {}, cycles from flash to {}",
        compared.len(),
        designs.len(),
        range(|it| it.instructions_percent),
        range(|it| it.cycles_percent),
        range(|it| it.flash_percent),
    );
    Ok((said, loops))
}

/// Prints what the list tells of a model's `frames` beside what was counted: a table, or a list of JSON objects.
pub fn compare_model(frames: &[Frame], compiler: &str, json: bool) -> Outcome {
    let prices = prices()?;
    let compared = compare(frames, &prices)?;
    print!("{}", if json { objects(&compared) } else { table(&compared) });
    held(&compared, prices.compiler != compiler)
}

/// What the list predicts of each of `frames`, with all weights in RAM.
pub fn predicted(frames: &[Frame], compiler: &str) -> Outcome<Vec<Count>> {
    let prices = prices()?;
    let compared = compare(frames, &prices)?;
    held(&compared, prices.compiler != compiler)?;
    let count = |it: &Compared<'_>| {
        let [instructions, cycles, flash_cycles] = it.predicted;
        Count { instructions, cycles, flash_cycles }
    };
    Ok(compared.iter().map(count).collect())
}

/// A frame and what the list tells of it.
struct Compared<'f> {
    frame: &'f Frame,
    /// Instructions, cycles, and cycles from flash.
    predicted: [u64; 3],
    assembly_is_exact: bool,
    /// What is predicted over what was counted, less 100 %.
    instructions_percent: f64,
    cycles_percent: f64,
    flash_percent: f64,
}

/// The price list: not that which was compiled in, since `accept` may have replaced it.
fn prices() -> Outcome<Prices> {
    let text = fs::read_to_string(root().join(FILE)).map_err(|cause| format!("{FILE}: {cause}"))?;
    Prices::parse(&text).map_err(|cause| cause.to_string())
}

fn compare<'f>(frames: &'f [Frame], prices: &Prices) -> Outcome<Vec<Compared<'f>>> {
    frames.iter().map(|frame| Compared::new(frame, prices)).collect()
}

impl<'f> Compared<'f> {
    fn new(frame: &'f Frame, prices: &Prices) -> Outcome<Self> {
        let [assembly, whole] = frame.predicted(prices)?;
        let percent = |predicted: f64, counted: u64| 100.0 * (predicted / counted as f64 - 1.0);
        Ok(Self {
            frame,
            predicted: whole.map(|cost| cost.round() as u64),
            assembly_is_exact: assembly[0].round() as u64 == frame.assembly.instructions,
            instructions_percent: percent(whole[0], frame.whole.instructions),
            cycles_percent: percent(whole[1], frame.whole.cycles),
            flash_percent: percent(whole[2], frame.whole.flash_cycles),
        })
    }

    /// Whether the costs are predicted well enough.
    fn holds(&self, other_compiler: bool) -> bool {
        let errors = [self.instructions_percent, self.cycles_percent];
        let predicted = if other_compiler {
            // Less than predicted is no fault then.
            self.cycles_percent >= -OTHER_COMPILERS_PERCENT
        } else {
            let branches = ["-libm", "-micromath"].iter().any(|it| self.frame.kernel.ends_with(it));
            let most = if branches { BRANCHING_PERCENT } else { TOLERANCE_PERCENT };
            errors.iter().all(|error| error.abs() <= most)
                && self.flash_percent.abs() <= FLASH_TOLERANCE_PERCENT.max(most)
        };
        self.assembly_is_exact && predicted
    }
}

fn held(compared: &[Compared<'_>], other_compiler: bool) -> Outcome {
    let wrong: Vec<String> = compared
        .iter()
        .filter(|it| !it.holds(other_compiler))
        .map(|it| {
            let (counted, exact) =
                (it.frame.whole, if it.assembly_is_exact { "" } else { ", assembly not exact" });
            format!(
                "  {}: {} instructions, {} cycles and {} from flash predicted, {}, {} and {} counted{exact}\n",
                it.frame.what(),
                it.predicted[0],
                it.predicted[1],
                it.predicted[2],
                counted.instructions,
                counted.cycles,
                counted.flash_cycles
            )
        })
        .collect();
    if wrong.is_empty() {
        return Ok(());
    }
    Err(format!(
        "{FILE} predicts wrong costs of\n{}if the code was changed on purpose, `cargo xtask cycles --accept`",
        wrong.concat()
    ))
}

fn table(compared: &[Compared<'_>]) -> String {
    let line = |name: &str, cells: [String; 6]| {
        let [a, b, c, d, e, f] = cells;
        format!("{name:34} | {a:>12} {b:>9} | {c:>9} {d:>9} | {e:>10} {f:>9}\n")
    };
    let lines = compared.iter().map(|it| {
        let name = format!("{} {}", it.frame.kernel, it.frame.scope.name());
        let (counted, predicted) = (it.frame.whole, it.predicted);
        let cells = [
            counted.instructions,
            predicted[0],
            counted.cycles,
            predicted[1],
            counted.flash_cycles,
            predicted[2],
        ];
        line(&name, cells.map(|number| number.to_string()))
    });
    let head = ["instructions", "predicted", "cycles", "predicted", "from flash", "predicted"]
        .map(str::to_owned);
    line("kernel and scope", head) + &lines.collect::<String>()
}

fn objects(compared: &[Compared<'_>]) -> String {
    let object = |it: &Compared<'_>| {
        serde_json::json!({
            "kernel": it.frame.kernel,
            "scope": it.frame.scope.name(),
            "instructions": it.frame.whole.instructions,
            "predicted_instructions": it.predicted[0],
            "cycles": it.frame.whole.cycles,
            "predicted_cycles": it.predicted[1],
            "flash_cycles": it.frame.whole.flash_cycles,
            "predicted_flash_cycles": it.predicted[2],
        })
    };
    let lines: Vec<String> = compared.iter().map(|it| object(it).to_string()).collect();
    format!("[{}]\n", lines.join(",\n "))
}
