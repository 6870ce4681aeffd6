//! Cost of decoding on a Cortex-M4F, as `cargo xtask cycles` measures it and the repository holds it.

use model_core::blob::Model;
use model_core::rbf::Format;
use serde::Serialize;
use taxel_learn::Exponential;

use crate::error::{Error, Result};

/// Rows, readings of a row and outputs of a row that `cargo xtask cycles` measures.
pub const MEASURED_SHAPE: [usize; 3] = [8, 18, 18];

/// Content of `firmware/cycles.csv`: compiler, kernel, centres, affine, scope, instructions, cycles, flash_cycles.
const MEASURED: &str = include_str!("../../../firmware/cycles.csv");

/// Instructions, and cycles by the model of `docs/cycles.md` (zero wait states; not checked against
/// silicon).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Cost {
    /// Number of instructions that are executed: exact.
    pub instructions: u64,
    /// Number of cycles, by the model.
    pub cycles: u64,
}

/// Costs of a frame without a gate and behind one, in any measure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Frames<T> {
    /// Cost without a gate.
    pub ungated: T,
    /// Cost behind a gate that finds all rows untouched.
    pub at_rest: T,
    /// Cost behind a gate that finds all rows touched, each by its last reading.
    pub awake: T,
}

impl<T> Frames<T> {
    /// Costs in another measure, by `of`.
    pub fn map<U>(self, of: impl Fn(T) -> U) -> Frames<U> {
        Frames { ungated: of(self.ungated), at_rest: of(self.at_rest), awake: of(self.awake) }
    }
}

impl Frames<u64> {
    /// Mean cost of frames behind a gate, with this share of untouched rows. It lies between the
    /// measured costs of frames with all rows untouched and all touched.
    #[must_use]
    pub fn mean(&self, share_at_rest: f64) -> f64 {
        let [awake, at_rest] = [self.awake, self.at_rest].map(|cost| cost as f64);
        awake + share_at_rest * (at_rest - awake)
    }

    /// Mean cost of frames behind a gate, relative to a frame without a gate.
    #[must_use]
    pub fn relative(&self, share_at_rest: f64) -> f64 {
        self.mean(share_at_rest) / self.ungated as f64
    }
}

impl Frames<Cost> {
    /// Mean cost of frames behind a gate, rounded.
    #[must_use]
    pub fn mean_cost(&self, share_at_rest: f64) -> Cost {
        let mean = |of: fn(Cost) -> u64| self.map(of).mean(share_at_rest).round() as u64;
        Cost { instructions: mean(|cost| cost.instructions), cycles: mean(|cost| cost.cycles) }
    }
}

/// Measured costs of one compiler's code.
#[derive(Debug, Clone, PartialEq)]
pub struct Costs {
    /// Name and version of the compiler.
    pub compiler: String,
    lines: Vec<Line>,
}

/// Number format and exponential, K, whether there is an affine tail, and whether one network decodes
/// the whole array.
pub type Kind<'k> = (&'k str, usize, bool, bool);

#[derive(Debug, Clone, PartialEq)]
struct Line {
    kernel: String,
    centres: usize,
    affine: bool,
    scope: String,
    cost: Cost,
}

impl Costs {
    /// Costs in the repository, of the first compiler there.
    ///
    /// # Errors
    /// [`Error::Cycles`] if the file holds no figures, or not the expected ones.
    pub fn measured() -> Result<Self> {
        Self::parse(MEASURED)
    }

    fn parse(text: &str) -> Result<Self> {
        let failed = Error::Cycles;
        let mut reader = csv::Reader::from_reader(text.as_bytes());
        let mut compiler: Option<String> = None;
        let mut lines = Vec::new();
        for record in reader.deserialize() {
            type Record = (String, String, usize, String, String, u64, u64, u64);
            let record: Record = record.map_err(|cause| failed(cause.to_string()))?;
            let (by, kernel, centres, affine, scope, instructions, cycles, _) = record;
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

    /// Cost of a frame without a gate; `None` if it was not measured.
    #[must_use]
    pub fn frame(&self, kind: Kind<'_>) -> Option<Cost> {
        self.of(kind, "frame")
    }

    /// Costs of a frame with and without a gate.
    ///
    /// `None` if they were not measured, as with exponentials other than the firmware's.
    #[must_use]
    pub fn frames(&self, kind: Kind<'_>) -> Option<Frames<Cost>> {
        let of = |scope| self.of(kind, scope);
        Some(Frames {
            ungated: of("frame")?,
            at_rest: of("resting-frame")?,
            awake: of("awake-frame")?,
        })
    }

    /// Costs of a frame with and without a gate for `model`, with the firmware's exponential.
    ///
    /// `None` if they were not measured, if the networks are not all alike, or for another shape than
    /// the measured one.
    #[must_use]
    pub fn frames_of_model(&self, model: &Model<'_>) -> Option<Frames<Cost>> {
        let shape = model.shape();
        if [shape.rows, shape.inputs, shape.outputs] != MEASURED_SHAPE {
            return None;
        }
        let mut kinds = model
            .networks()
            .map(|network| (network.format(), network.shape().centres, network.has_affine_tail()));
        let kind = kinds.next()?;
        let (format, centres, affine) = kinds.all(|other| other == kind).then_some(kind)?;
        let kernel = kernel_name(format, Exponential::default());
        self.frames((&kernel, centres, affine, model.projection().is_some()))
    }

    fn of(&self, (kernel, centres, affine, whole_array): Kind<'_>, scope: &str) -> Option<Cost> {
        let scope = format!("{}{scope}", if whole_array { "array-" } else { "" });
        let wanted = |line: &&Line| {
            (line.kernel.as_str(), line.centres, line.affine, line.scope.as_str())
                == (kernel, centres, affine, &scope)
        };
        self.lines.iter().find(wanted).map(|line| line.cost)
    }
}

/// Name of a format in the file of costs.
#[must_use]
pub fn kernel_name(format: Format, exponential: Exponential) -> String {
    match (format, exponential) {
        (Format::F32Direct, Exponential::Libm) => "f32-direct-libm".into(),
        (Format::F32Direct, Exponential::Micromath) => "f32-direct-micromath".into(),
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
                    let cost = costs.frame((kernel, centres, affine, false)).unwrap();
                    assert!(cost.instructions > before && cost.cycles > cost.instructions);
                    before = cost.instructions;
                }
            }
        }
        // The array's activations serve all rows; its projection has a cost of its own.
        for centres in [64, 128, 256] {
            let [of_rows, of_array] = [false, true]
                .map(|whole_array| costs.frame(("fixed16", centres, true, whole_array)).unwrap());
            assert!(of_array.cycles < of_rows.cycles, "{centres}");
        }
    }

    #[test]
    fn a_gates_frames_cost_between_all_at_rest_and_all_awake() {
        let cost = |instructions, cycles| Cost { instructions, cycles };
        let frames =
            Frames { ungated: cost(90, 1000), at_rest: cost(11, 100), awake: cost(100, 1050) };
        let means = [0.0, 0.25, 1.0].map(|share| frames.mean_cost(share));
        // 1050 - 0.25·950 = 812.5; 100 - 0.25·89 = 77.75
        assert_eq!(means, [cost(100, 1050), cost(78, 813), cost(11, 100)]);
        let cycles = frames.map(|cost| cost.cycles);
        assert_eq!([0.0, 0.5, 1.0].map(|share| cycles.relative(share)), [1.05, 0.575, 0.1]);
    }

    #[test]
    fn a_gate_was_measured_with_the_firmwares_exponential_alone() {
        let costs = Costs::measured().unwrap();
        for centres in costs.centres() {
            for affine in [false, true] {
                for kernel in ["f32", "fixed16", "f32-direct"] {
                    let frames = costs.frames((kernel, centres, affine, false)).unwrap();
                    let Frames { ungated, at_rest, awake } = frames.map(|cost| cost.cycles);
                    assert!(at_rest < ungated && ungated < awake, "{kernel} {centres}");
                }
                assert_eq!(costs.frames(("f32-direct-libm", centres, affine, false)), None);
            }
        }
    }

    #[test]
    fn a_file_without_figures_is_refused() {
        let header = "compiler,kernel,centres,affine,scope,instructions,cycles,flash_cycles\n";
        let line = |line: &str| format!("{header}{line}\n");
        for text in [
            header.to_owned(),
            line("rustc 1,f32,many,yes,frame,1,2,3"),
            line("rustc 1,f32,16,perhaps,frame,1,2,3"),
        ] {
            let message = Costs::parse(&text).unwrap_err().to_string();
            assert!(message.contains("firmware/cycles.csv"), "{message}");
        }
        let two = format!("{header}a,f32,16,yes,frame,1,2,3\nb,f32,32,no,frame,3,4,5\n");
        let costs = Costs::parse(&two).unwrap();
        assert_eq!((costs.compiler.as_str(), costs.centres()), ("a", vec![16]));
    }
}
