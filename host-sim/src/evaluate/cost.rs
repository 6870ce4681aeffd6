//! What decoding costs a Cortex-M4F: the figures that `cargo xtask cycles` measures and checks in.

use model_core::rbf::Format;
use serde::Serialize;

use crate::error::{Error, Result};
use crate::infer::Kernel;

/// `firmware/cycles.csv`: compiler, kernel, centres, affine, scope, instructions, cycles.
const MEASURED: &str = include_str!("../../../firmware/cycles.csv");

/// Instructions, and cycles by the model of `docs/cycles.md` (zero wait states; not checked against silicon).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Cost {
    /// Instructions that are executed: exact.
    pub instructions: u64,
    /// Cycles by the model.
    pub cycles: u64,
}

/// What was measured of one compiler's code.
#[derive(Debug, Clone, PartialEq)]
pub struct Costs {
    /// The compiler.
    pub compiler: String,
    lines: Vec<Line>,
}

#[derive(Debug, Clone, PartialEq)]
struct Line {
    kernel: String,
    centres: usize,
    affine: bool,
    scope: String,
    cost: Cost,
}

impl Costs {
    /// The checked-in figures; those of the compiler that comes first.
    ///
    /// # Errors
    /// [`Error::Failed`] if the file holds none, or not what it should.
    pub fn measured() -> Result<Self> {
        Self::parse(MEASURED)
    }

    fn parse(text: &str) -> Result<Self> {
        let failed = |cause: String| {
            Error::Failed(format!(
                "firmware/cycles.csv: {cause}; cargo xtask cycles --accept writes it anew"
            ))
        };
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let mut compiler: Option<String> = None;
        let mut lines = Vec::new();
        for record in reader.deserialize() {
            type Record = (String, String, usize, String, String, u64, u64);
            let record: Record = record.map_err(|cause| failed(cause.to_string()))?;
            let (by, kernel, centres, affine, scope, instructions, cycles) = record;
            let affine = match affine.as_str() {
                "yes" => true,
                "no" => false,
                other => return Err(failed(format!("affine is {other:?}, not yes or no"))),
            };
            if *compiler.get_or_insert_with(|| by.clone()) == by {
                let cost = Cost { instructions, cycles };
                lines.push(Line { kernel, centres, affine, scope, cost });
            }
        }
        let compiler = compiler.ok_or_else(|| failed("no figures".into()))?;
        Ok(Self { compiler, lines })
    }

    /// Every number of centres that was measured, ascending.
    #[must_use]
    pub fn centres(&self) -> Vec<usize> {
        let mut centres: Vec<usize> = self.lines.iter().map(|line| line.centres).collect();
        centres.sort_unstable();
        centres.dedup();
        centres
    }

    /// The cost of `scope` (`inference`, `row` or `frame`); `None` if it was not measured.
    #[must_use]
    pub fn of(&self, kernel: &str, centres: usize, affine: bool, scope: &str) -> Option<Cost> {
        let wanted = |line: &&Line| {
            (line.kernel.as_str(), line.centres, line.affine, line.scope.as_str())
                == (kernel, centres, affine, scope)
        };
        self.lines.iter().find(wanted).map(|line| line.cost)
    }
}

/// The name under which a format's figures stand.
#[must_use]
pub fn kernel_name(format: Format, exponential: Kernel) -> String {
    match (format, exponential) {
        (Format::F32Direct, Kernel::Libm) => "f32-direct-libm".into(),
        (Format::F32Direct, Kernel::Micromath) => "f32-direct-micromath".into(),
        _ => format.name().into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_checked_in_figures_cover_what_trade_needs() {
        let costs = Costs::measured().unwrap();
        assert_eq!(costs.centres(), [16, 32, 64, 128, 256]);
        for kernel in ["f32", "fixed16", "f32-direct", "f32-direct-libm", "f32-direct-micromath"] {
            let mut before = 0;
            for centres in costs.centres() {
                for affine in [false, true] {
                    let cost = costs.of(kernel, centres, affine, "frame").unwrap();
                    assert!(cost.instructions > before && cost.cycles > cost.instructions);
                    before = cost.instructions;
                }
            }
        }
    }

    #[test]
    fn a_file_without_figures_is_refused() {
        let header = "compiler,kernel,centres,affine,scope,instructions,cycles\n";
        let line = |line: &str| format!("{header}{line}\n");
        for text in [
            header.to_owned(),
            line("rustc 1,f32,many,yes,frame,1,2"),
            line("rustc 1,f32,16,perhaps,frame,1,2"),
        ] {
            let message = Costs::parse(&text).unwrap_err().to_string();
            assert!(message.contains("firmware/cycles.csv"), "{message}");
        }
        let two = format!("{header}a,f32,16,yes,frame,1,2\nb,f32,32,no,frame,3,4\n");
        let costs = Costs::parse(&two).unwrap();
        assert_eq!((costs.compiler.as_str(), costs.centres()), ("a", vec![16]));
    }
}
