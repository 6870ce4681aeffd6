//! Prices of all pieces of code, as `cargo xtask cycles --accept` measures them.

use std::collections::HashMap;

use super::pieces::Pieces;
use crate::error::{Error, Result};

/// What the first line of a price list starts with; the compiler follows.
const COMPILER: &str = "# code of ";

/// The second line of a price list.
const HEAD: &str = "piece,instructions,cycles,flash cycles";

/// What one execution of a piece of code costs: instructions, cycles at zero wait, and cycles from flash.
pub type Price = [f64; 3];

/// A price list.
#[derive(Debug, Clone, PartialEq)]
pub struct Prices {
    /// Name and version of the compiler.
    pub compiler: String,
    by_piece: HashMap<String, Price>,
}

impl Prices {
    /// Parses a price list.
    ///
    /// # Errors
    /// [`Error::Prices`] names the line that is not understood.
    pub fn parse(text: &str) -> Result<Self> {
        let mut lines = text.lines();
        let compiler = lines.next().and_then(|line| line.strip_prefix(COMPILER));
        let (Some(compiler), Some(HEAD)) = (compiler, lines.next()) else {
            return Err(Error::Prices(format!(
                "the first lines are not {COMPILER:?} and {HEAD:?}"
            )));
        };
        let price = |line: &str| {
            // Names contain commas, and no quotation marks.
            let (name, numbers) = line.strip_prefix('"')?.split_once("\",")?;
            let numbers: Vec<f64> =
                numbers.split(',').map(|number| number.parse().ok()).collect::<Option<_>>()?;
            Some((name.to_owned(), numbers.try_into().ok()?))
        };
        let not_understood = |line: &str| Error::Prices(format!("not understood: {line}"));
        let prices = lines.map(|line| price(line).ok_or_else(|| not_understood(line)));
        Ok(Self { compiler: compiler.to_owned(), by_piece: prices.collect::<Result<_>>()? })
    }

    /// The price list of these pieces and prices, of code by `compiler`, as text.
    pub fn text(compiler: &str, prices: &[(String, Price)]) -> String {
        let line = |(name, [instructions, cycles, flash]): &(String, Price)| {
            format!("\"{name}\",{instructions},{cycles},{flash}\n")
        };
        format!("{COMPILER}{compiler}\n{HEAD}\n{}", prices.iter().map(line).collect::<String>())
    }

    /// What all `pieces` cost together, not rounded.
    ///
    /// # Errors
    /// [`Error::Prices`] names a piece without a price.
    pub fn sum(&self, pieces: &Pieces) -> Result<Price> {
        let mut sum = [0.0; 3];
        for (name, times) in pieces.iter() {
            let unknown = || Error::Prices(format!("no price for {name:?}"));
            let price = self.by_piece.get(name).ok_or_else(unknown)?;
            sum.iter_mut().zip(price).for_each(|(sum, price)| *sum += price * times as f64);
        }
        Ok(sum)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pieces() -> Pieces {
        let mut pieces = Pieces::default();
        pieces.add("a, b", 3);
        pieces.add("c", 1);
        pieces.add("never", 0);
        pieces
    }

    #[test]
    fn what_is_written_is_read_and_summed() {
        let prices = [("a, b".to_owned(), [2.0, 2.5, 3.0]), ("c".to_owned(), [1.0, 0.25, 0.0])];
        let text = Prices::text("rustc 1", &prices);
        assert!(text.ends_with("\n\"a, b\",2,2.5,3\n\"c\",1,0.25,0\n"), "{text}");
        let prices = Prices::parse(&text).unwrap();
        assert_eq!(prices.compiler, "rustc 1");
        assert_eq!(prices.sum(&pieces()).unwrap(), [7.0, 7.75, 9.0]);
    }

    #[test]
    fn a_list_that_lacks_something_is_refused() {
        for (text, named) in [
            (format!("{HEAD}\n"), "first line"),
            (format!("{COMPILER}rustc\npiece\n"), "first line"),
            (format!("{COMPILER}rustc\n{HEAD}\na,1,2,3\n"), "not understood: a,1,2,3"),
            (format!("{COMPILER}rustc\n{HEAD}\n\"a\",1,2\n"), "not understood"),
            (format!("{COMPILER}rustc\n{HEAD}\n\"a\",1,2,x\n"), "not understood"),
        ] {
            let error = Prices::parse(&text).unwrap_err().to_string();
            assert!(error.contains(named) && error.contains("firmware/prices.csv"), "{error}");
        }
        let prices = Prices::parse(&Prices::text("rustc", &[("c".to_owned(), [1.0; 3])])).unwrap();
        let error = prices.sum(&pieces()).unwrap_err().to_string();
        assert!(error.contains("no price for \"a, b\""), "{error}");
    }
}
