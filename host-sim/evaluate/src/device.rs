//! Times of a frame on a device, which scans it and then decodes it.

use std::collections::BTreeSet;

use serde::{Deserialize, Serialize};
use taxel_data::{BadValue, columns};
use taxel_firmware::timing::{ONCHIP_READINGS_US, ONCHIP_SAMPLES, ONCHIP_SUMS_US, ScanPlan};
use taxel_learn::cost::Cost;
use taxel_simulate::World;
use taxel_simulate::noise::Noise;

use crate::moving::age_ms;

/// Clock of the NUCLEO-F446RE in MHz.
pub const BOARD_CLOCK_MHZ: f64 = 180.0;

/// What samples columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Readout {
    /// MCP3208 converters on a bus of a board of your own. The processor scans, and decodes the frame afterwards.
    Spi,
    /// The NUCLEO-F446RE's own converters (docs/board.md), which scan by themselves while the processor decodes the frame
    /// before.
    #[default]
    OnChip,
}

/// Device whose times are given.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Device {
    pub clock_mhz: f64,
    pub readout: Readout,
    /// Time of a scan with one sample a reading, instead of what the readout takes.
    pub scan_ms: Option<f64>,
}

impl Default for Device {
    /// The NUCLEO-F446RE.
    fn default() -> Self {
        Self { clock_mhz: BOARD_CLOCK_MHZ, readout: Readout::default(), scan_ms: None }
    }
}

/// Wires that a scan reads: rows, one after the other, and columns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Wires {
    pub rows: usize,
    pub columns: usize,
}

impl Wires {
    /// Wires that a scan of `world`'s sensor reads.
    pub fn of(world: &World) -> Self {
        Self { rows: world.read_rows.len(), columns: world.sensor.column_wires }
    }

    /// Wires that readings are named after, such as `r4c17_ohm`; `None` if any has another name.
    pub fn named(readings: &[String]) -> Option<Self> {
        let wires = readings.iter().map(|name| Some(columns::cell_of(name)?.0));
        let wires: Vec<[usize; 2]> = wires.collect::<Option<_>>()?;
        let count = |of: usize| wires.iter().map(|wire| wire[of]).collect::<BTreeSet<_>>().len();
        (!wires.is_empty()).then(|| Self { rows: count(0), columns: count(1) })
    }
}

/// Times of one frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Times {
    /// Time of the scan; `None` if it is unknown.
    pub scan_ms: Option<f64>,
    /// Time of decoding.
    pub decode_ms: f64,
    /// Time from the start of the scan until its estimate is finished: both, and what the processor does between them; of
    /// decoding alone if the scan's is unknown.
    pub frame_ms: f64,
    /// Frames in a second, at most: one over the time of a frame, or of the longer of scan and processor's work where both go
    /// on at once ([`Readout::OnChip`]).
    pub frames_per_s: f64,
    /// Mean age of the newest finished estimate when it is used: the time since the middle of its scan. `None` if the
    /// scan's time is unknown.
    pub age_ms: Option<f64>,
}

impl Times {
    /// Time from the start of one scan to the start of the next.
    pub fn period_ms(&self) -> f64 {
        1000.0 / self.frames_per_s
    }
}

impl Device {
    /// Checks that the numbers are positive.
    pub fn check(&self) -> Result<(), BadValue> {
        let numbers =
            [("device.clock_mhz", Some(self.clock_mhz)), ("device.scan_ms", self.scan_ms)];
        for (name, number) in numbers {
            if let Some(number) = number.filter(|number| !(number.is_finite() && *number > 0.0)) {
                return Err(BadValue::new(name, number, "give a positive number"));
            }
        }
        Ok(())
    }

    /// Time of a scan of `wires` with so many `samples` a reading in ms; `None` if nothing tells it.
    ///
    /// A time that the user gives is taken once for every sample.
    pub fn scan_ms(&self, wires: Option<Wires>, samples: usize) -> Option<f64> {
        let short = |number: usize| u16::try_from(number).unwrap_or(u16::MAX);
        let of_board = |Wires { rows, columns }| {
            let plan = match self.readout {
                Readout::Spi => ScanPlan::of_spi,
                Readout::OnChip => ScanPlan::of_nucleo_onchip,
            };
            f64::from(plan(short(rows), short(columns), short(samples)).scan_us()) / 1000.0
        };
        self.scan_ms.map(|once| once * samples as f64).or(wires.map(of_board))
    }

    /// Number of passes over the rows in which so many `samples` a reading are taken.
    pub fn passes(&self, samples: usize) -> usize {
        match (self.readout, self.scan_ms) {
            (Readout::OnChip, None) => samples.div_ceil(usize::from(ONCHIP_SAMPLES)).max(1),
            _ => 1,
        }
    }

    /// What means of so many `samples` leave of `noise`. White noise falls with the root of their number, the other part by
    /// the times at which a scan of `wires` takes them; by none if nothing tells these.
    pub fn averaged(&self, noise: Noise, wires: Option<Wires>, samples: usize) -> Noise {
        let scan_s = |samples| self.scan_ms(wires, samples).unwrap_or(0.0) / 1000.0;
        // Samples are taken one after the other, by on-chip converters those of half a row at once.
        let in_turn = |wires: Wires| match self.readout {
            Readout::Spi => wires.rows * wires.columns,
            Readout::OnChip => 2 * wires.rows,
        };
        let spacing_s = wires.map_or(0.0, |wires| (scan_s(2) - scan_s(1)) / in_turn(wires) as f64);
        let passes = self.passes(samples);
        let in_pass = samples.div_ceil(passes);
        let of_pass = noise.averaged(in_pass, spacing_s);
        let left = of_pass.averaged(passes, scan_s(in_pass) + f64::from(ONCHIP_SUMS_US) * 1e-6);
        Noise { level: noise.level / (samples as f64).sqrt(), ..left }
    }

    /// Times of a frame whose decoding has this `cost`.
    pub fn times(&self, scan_ms: Option<f64>, cost: &Cost) -> Times {
        let decode_ms = cost.cycles as f64 / (self.clock_mhz * 1000.0);
        let (period_ms, frame_ms) = match (self.readout, scan_ms) {
            // Decoding alone is known.
            (_, None) => (decode_ms, decode_ms),
            (Readout::Spi, Some(scan_ms)) => (scan_ms + decode_ms, scan_ms + decode_ms),
            // Sums wait until the frame before is decoded.
            (Readout::OnChip, Some(scan_ms)) => {
                let [sums_ms, readings_ms] =
                    [ONCHIP_SUMS_US, ONCHIP_READINGS_US].map(|us| f64::from(us) / 1000.0);
                let work_ms = readings_ms + decode_ms;
                let period_ms = scan_ms.max(work_ms) + sums_ms;
                (period_ms, period_ms + work_ms)
            }
        };
        let age_ms = scan_ms.map(|scan_ms| age_ms(scan_ms, frame_ms, period_ms));
        Times { scan_ms, decode_ms, frame_ms, frames_per_s: 1000.0 / period_ms, age_ms }
    }
}

#[cfg(test)]
mod tests {
    use taxel_simulate::noise::NoiseKind;

    use super::*;

    #[test]
    fn a_frame_takes_its_scan_and_then_its_decoding() {
        let board = Device { readout: Readout::Spi, ..Device::default() };
        let cost = Cost { instructions: 1, cycles: 36_000 };
        let paper = Some(Wires { rows: 8, columns: 18 });
        let scans = [1, 4].map(|samples| board.scan_ms(paper, samples).unwrap());
        assert_eq!(scans, [5.573, 21.022]);
        let times = board.times(Some(5.5), &cost);
        assert_eq!((times.decode_ms, times.frame_ms), (0.2, 5.7));
        // Half the scan and the decoding, and half a frame until the next one is finished.
        assert!((times.age_ms.unwrap() - (2.75 + 0.2 + 2.85)).abs() < 1e-12);
        assert!((times.frames_per_s - 175.4).abs() < 0.1);
        // The board's own converters scan while the frame before is decoded.
        let onchip = Device { readout: Readout::OnChip, ..board };
        let scans = [1, 12].map(|samples| onchip.scan_ms(paper, samples).unwrap());
        assert_eq!(scans, [0.226, 0.913]);
        // Sums are added up before the next scan, and turned into Ω while it runs.
        let times = onchip.times(Some(0.9), &cost);
        assert!((times.frame_ms - (0.9 + 0.061 + 0.16 + 0.2)).abs() < 1e-12);
        assert!((times.period_ms() - 0.961).abs() < 1e-12);
        assert!((times.age_ms.unwrap() - (0.45 + 0.421 + 0.5 * 0.961)).abs() < 1e-12);
        // With a short scan the processor is what takes longest, and the next frame waits for it.
        let times = onchip.times(Some(0.2), &cost);
        assert!((times.period_ms() - 0.421).abs() < 1e-12);
        assert!((times.frame_ms - (0.421 + 0.36)).abs() < 1e-12);
        let slower = Device { clock_mhz: 90.0, ..board };
        for device in [slower, Device { readout: Readout::OnChip, ..slower }] {
            let times = device.times(None, &cost);
            assert_eq!((times.frame_ms, times.frames_per_s), (0.4, 2500.0));
        }
    }

    #[test]
    fn samples_of_several_passes_lie_apart() {
        let noise = Noise {
            correlated_level: 0.01,
            time_constant_ms: 1.0,
            ..Noise::white(NoiseKind::Relative, 0.01)
        };
        let (paper, onchip) = (
            Some(Wires { rows: 8, columns: 18 }),
            Device { readout: Readout::OnChip, ..Device::default() },
        );
        let left = |samples: usize, device: Device| device.averaged(noise, paper, samples);
        let [one, three] = [left(16, onchip), left(48, onchip)];
        assert!((three.level / 0.01 - (1.0 / 48.0_f64).sqrt()).abs() < 1e-12);
        // Passes of 1.22 ms: means of 16 samples within 0.1 ms, whose correlations are e^(−1.22), and its square.
        let (a, rest) = ((-1.223_f64).exp(), one.correlated_level / 0.01);
        let expected = ((1.0 + 2.0 * (2.0 * a + a * a) / 3.0) / 3.0).sqrt() * rest;
        assert!((three.correlated_level / 0.01 / expected - 1.0).abs() < 1e-3, "{three:?}");
        assert!(rest > 0.95 && (onchip.passes(17), onchip.passes(16)) == (2, 1));
        // On SPI all samples of a reading follow one another, 36 µs apart.
        let board = Device { readout: Readout::Spi, ..Device::default() };
        let spi = left(48, board).correlated_level / 0.01;
        assert!((0.7..0.8).contains(&spi), "{spi}");
        let given = Device { scan_ms: Some(1.0), ..onchip };
        assert_eq!((given.passes(48), onchip.averaged(noise, None, 4).correlated_level), (1, 0.01));
    }

    #[test]
    fn wires_are_told_by_the_names_of_readings() {
        let named = |names: &[&str]| {
            Wires::named(&names.iter().map(|name| (*name).into()).collect::<Vec<String>>())
        };
        assert_eq!(named(&["r4c1_ohm", "r4c2_ohm"]), Some(Wires { rows: 1, columns: 2 }));
        assert_eq!(
            named(&["r1c1_ohm", "r1c2_ohm", "r2c1_ohm", "r2c2_ohm"]),
            Some(Wires { rows: 2, columns: 2 })
        );
        assert_eq!(
            (named(&["ch1", "ch2"]), named(&["r1c1_ohm", "rest"]), named(&[])),
            (None, None, None)
        );
    }

    #[test]
    fn a_scan_is_as_long_as_the_user_says_or_unknown() {
        let given = Device { scan_ms: Some(2.5), ..Device::default() };
        assert_eq!(given.scan_ms(Some(Wires { rows: 8, columns: 18 }), 1), Some(2.5));
        assert_eq!(given.scan_ms(None, 4), Some(10.0));
        assert_eq!(Device::default().scan_ms(None, 1), None);
        assert!(given.check().is_ok());
        for bad in [0.0, -1.0, f64::NAN] {
            let message = Device { scan_ms: Some(bad), ..given }.check().unwrap_err().to_string();
            assert!(message.contains("device.scan_ms"), "{message}");
            let message = Device { clock_mhz: bad, ..given }.check().unwrap_err().to_string();
            assert!(message.contains("device.clock_mhz"), "{message}");
        }
    }
}
