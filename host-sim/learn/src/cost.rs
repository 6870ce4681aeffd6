//! What decoding costs on a Cortex-M4F, predicted from a model's [`Design`]: instructions, cycles, flash and RAM.
//!
//! The cost of a frame is a linear formula: a design tells how often each of its [`terms`] counts, and a price list what
//! one of it costs. `cargo xtask cycles --fit` finds the prices, by least squares over frames that it counts in QEMU.
//! `docs/cycles.md` says how, and how exact they are.

mod design;
mod memory;
mod terms;

use std::collections::HashMap;

pub use design::{Design, NetworkDesign};
pub use memory::DecoderRam;
use serde::Serialize;
use taxel_core::blob::ModelShape;
pub use terms::{Terms, filter_terms, terms};

use crate::error::{Error, Result};

/// The price list in the repository.
const FITTED: &str = taxel_firmware::timing::DECODING_PRICES;

/// What the first line of a price list starts with; the compiler follows. The second line.
const COMPILER: &str = "# code of ";
const HEAD: &str = "term,instructions,cycles,flash cycles";

/// Bytes of a line of an STM32F446's flash, and the cycles that reading one waits at 180 MHz.
const FLASH_LINE_BYTES: usize = 16;
const WAIT_STATES: u64 = 5;

/// Cost of one frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Cost {
    /// Instructions executed.
    pub instructions: u64,
    /// Cycles at zero wait states, by a model of the processor.
    pub cycles: u64,
    /// Cycles with code in flash at 5 wait states, by a model of an STM32F446's flash. The weights are in RAM, if the
    /// images have room for them there; else they are in flash, and this is a lower bound.
    pub flash_cycles: u64,
}

impl Cost {
    /// Cost of both.
    #[must_use]
    pub fn plus(self, other: Self) -> Self {
        Self {
            instructions: self.instructions + other.instructions,
            cycles: self.cycles + other.cycles,
            flash_cycles: self.flash_cycles + other.flash_cycles,
        }
    }
}

/// What one of a term costs: instructions, cycles at zero wait, and cycles from flash.
pub type Price = [f64; 3];

/// A price list.
#[derive(Debug, Clone, PartialEq)]
pub struct Prices {
    /// Name and version of the compiler.
    pub compiler: String,
    by_term: HashMap<String, Price>,
}

fn bad_prices(why: &str) -> Error {
    Error::unfit(format!(
        "prices of code (firmware/prices.csv): {why}; `cargo xtask cycles --fit` writes them anew"
    ))
}

impl Prices {
    /// The price list in the repository, `firmware/prices.csv`.
    ///
    /// # Errors
    /// [`Error`] if it is not sound.
    pub fn accepted() -> Result<Self> {
        Self::parse(FITTED)
    }

    /// Parses a price list.
    ///
    /// # Errors
    /// [`Error`] names the line that is not understood.
    pub fn parse(text: &str) -> Result<Self> {
        let mut lines = text.lines();
        let compiler = lines.next().and_then(|line| line.strip_prefix(COMPILER));
        let (Some(compiler), Some(HEAD)) = (compiler, lines.next()) else {
            return Err(bad_prices(&format!("the first lines are not {COMPILER:?} and {HEAD:?}")));
        };
        let price = |line: &str| {
            let (name, numbers) = line.strip_prefix('"')?.split_once("\",")?;
            let numbers: Vec<f64> =
                numbers.split(',').map(|number| number.parse().ok()).collect::<Option<_>>()?;
            Some((name.to_owned(), numbers.try_into().ok()?))
        };
        let by_term = lines
            .map(|line| price(line).ok_or_else(|| bad_prices(&format!("not understood: {line}"))))
            .collect::<Result<_>>()?;
        Ok(Self { compiler: compiler.to_owned(), by_term })
    }

    /// The text of a price list, in the order of `prices`.
    #[must_use]
    pub fn text(compiler: &str, prices: &[(String, Price)]) -> String {
        let line = |(name, [instructions, cycles, flash]): &(String, Price)| {
            format!("\"{name}\",{instructions:.3},{cycles:.3},{flash:.3}\n")
        };
        format!("{COMPILER}{compiler}\n{HEAD}\n{}", prices.iter().map(line).collect::<String>())
    }

    /// What one frame costs a model of this `design`.
    ///
    /// # Errors
    /// [`Error`] names a term that the list lacks.
    pub fn frame(&self, design: &Design) -> Result<Cost> {
        let cost = self.of(&terms(design))?;
        let waiting = design.least_waiting_for_weights();
        Ok(Cost { flash_cycles: cost.flash_cycles + waiting, ..cost })
    }

    /// What the [filter in time](taxel_core::filter) adds to a frame with estimates of this `shape`.
    ///
    /// # Errors
    /// As [`frame`](Self::frame).
    pub fn filter(&self, shape: ModelShape) -> Result<Cost> {
        self.of(&filter_terms(shape))
    }

    /// What these `terms` cost together, with all weights in RAM.
    ///
    /// # Errors
    /// As [`frame`](Self::frame).
    pub fn of(&self, terms: &Terms) -> Result<Cost> {
        let mut sum = [0.0; 3];
        for (name, times) in terms {
            let unknown = || bad_prices(&format!("no price for {name:?}"));
            let price = self.by_term.get(name).ok_or_else(unknown)?;
            sum.iter_mut().zip(price).for_each(|(sum, price)| *sum += price * *times as f64);
        }
        let [instructions, cycles, flash_cycles] = sum.map(|cost| cost.round() as u64);
        Ok(Cost { instructions, cycles, flash_cycles })
    }
}

impl Design {
    /// Least waiting in cycles for the weights that one frame reads: 0 if they are in RAM.
    #[must_use]
    pub fn least_waiting_for_weights(&self) -> u64 {
        if self.weights_in_ram {
            return 0;
        }
        let networks: usize = self.row_networks().map(NetworkDesign::bytes).sum();
        least_waiting_for_weights(networks + self.projection_bytes())
    }
}

/// Least waiting in cycles for weights in flash of which so many `bytes` are read, once and in order: for every line, the
/// wait states of one read. Weights are too many for the cache of data, and nothing prefetches data.
#[must_use]
pub fn least_waiting_for_weights(bytes: usize) -> u64 {
    bytes.div_ceil(FLASH_LINE_BYTES) as u64 * WAIT_STATES
}

#[cfg(test)]
mod tests {
    use taxel_core::rbf::Format;

    use super::*;

    #[test]
    fn each_line_of_flash_is_waited_for_once() {
        assert_eq!([0, 1, 16, 17, 160].map(least_waiting_for_weights), [0, 5, 5, 10, 50]);
    }
    #[test]
    fn a_list_that_lacks_something_is_refused() {
        for (text, named) in [
            (format!("{HEAD}\n"), "first line"),
            (format!("{COMPILER}rustc\nterm\n"), "first line"),
            (format!("{COMPILER}rustc\n{HEAD}\na,1,2,3\n"), "not understood: a,1,2,3"),
            (format!("{COMPILER}rustc\n{HEAD}\n\"a\",1,2\n"), "not understood"),
        ] {
            let error = Prices::parse(&text).unwrap_err().to_string();
            assert!(error.contains(named) && error.contains("firmware/prices.csv"), "{error}");
        }
        let prices =
            Prices::parse(&Prices::text("rustc", &[("rows".to_owned(), [1.0; 3])])).unwrap();
        let shape = ModelShape { rows: 1, inputs: 2, outputs: 3 };
        let design = Design::of_rows(shape, Format::F32, 4, false);
        let error = prices.frame(&design).unwrap_err();
        assert!(error.to_string().contains("no price for \"f32"), "{error}");
    }
}
