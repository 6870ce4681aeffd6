//! Analogue half of the board: the voltage at each column's converter input.

use taxel_data::{Purpose, Random, Stream};
use taxel_firmware::circuit::{Divider, ZeroPotential};
use taxel_firmware::timing::{OP_AMP_HZ, noise_gain, time_constant_ns};

use super::fault::BoardFault;
use super::network::{Tie, potentials_v};
use super::{COLUMNS, ROWS};
use taxel_simulate::readout::{Circuit, Readout};

/// Largest conductance of a node, in S; a node of no resistance has it.
const MOST_CONDUCTANCE_S: f64 = 1e6;

const ZERO_POTENTIAL: ZeroPotential<1, 1> = ZeroPotential::TYPICAL;

/// Time constant in µs with which the op-amps of the board follow, when they hold the columns of the paper's sensor.
pub fn op_amp_time_constant_us() -> f64 {
    let [feedback_ohm] = ZERO_POTENTIAL.feedback_ohm;
    f64::from(time_constant_ns(noise_gain(feedback_ohm, 55.0, 8), OP_AMP_HZ)) / 1e3
}

/// Actual values of a board's parts in the zero-potential circuit; the firmware's constants should be the same.
#[derive(Debug, Clone, PartialEq)]
pub struct Parts {
    /// Voltage in V by which the active row is pulled below the others.
    pub drive_v: f64,
    /// Resistance in Ω of each row's switch and lead.
    pub row_source_ohm: [f64; ROWS],
    /// Feedback resistance in Ω of each column.
    pub feedback_ohm: [f64; COLUMNS],
}

/// Network of the sensor, and the circuit around it.
#[derive(Debug)]
pub(super) struct Analogue {
    circuit: Circuit,
    cross_talk: bool,
    parts: Parts,
    line_ohm: f64,
    offset_v: [f64; COLUMNS],
    conductance_s: Vec<f64>,
    faults: Vec<BoardFault>,
    /// Outputs in V by active row, then for none active; computed when first asked for.
    outputs_v: [Option<[f64; COLUMNS]>; ROWS + 1],
}

/// Reference voltage of the converter, which also supplies everything else.
pub(super) fn reference_v() -> f64 {
    ZERO_POTENTIAL.reference_v.into()
}

impl Analogue {
    pub(super) fn new(readout: &Readout, seed: u64) -> Self {
        let most_v = readout.op_amp_offset_v.unwrap_or(0.0);
        let offset_v = std::array::from_fn(|k| {
            let mut random = Random::new(seed, Stream::Test, Purpose::OpAmpOffset, 0, k as u64);
            random.between([-most_v, most_v])
        });
        let line_ohm = readout.line_ohm.unwrap_or(0.0);
        Self {
            circuit: readout.circuit.unwrap_or_default(),
            cross_talk: readout.cross_talk.unwrap_or(false),
            parts: Parts {
                drive_v: ZERO_POTENTIAL.drive_v.into(),
                row_source_ohm: [readout.row_switch_ohm.unwrap_or(0.0) + line_ohm; ROWS],
                feedback_ohm: [ZERO_POTENTIAL.feedback_ohm[0].into(); COLUMNS],
            },
            line_ohm,
            offset_v,
            conductance_s: vec![0.0; ROWS * COLUMNS],
            faults: vec![],
            outputs_v: [None; ROWS + 1],
        }
    }

    /// Sets the resistance in Ω between every row-wire and column-wire, row after row; infinite is open.
    pub(super) fn set_readings(&mut self, ohm: &[f64]) {
        assert_eq!(ohm.len(), ROWS * COLUMNS, "a reading of every row-wire and column-wire");
        for (siemens, ohm) in self.conductance_s.iter_mut().zip(ohm) {
            assert!(*ohm >= 0.0, "a resistance of {ohm} Ω");
            *siemens = (1.0 / ohm).min(MOST_CONDUCTANCE_S);
        }
        self.outputs_v = [None; ROWS + 1];
    }

    pub(super) fn set_faults(&mut self, faults: &[BoardFault]) {
        self.faults = faults.to_vec();
        self.outputs_v = [None; ROWS + 1];
    }

    pub(super) fn faults(&self) -> &[BoardFault] {
        &self.faults
    }

    /// Potentials in V of all wires with these ties, after the faults have changed them.
    fn potentials_v(&self, mut rows: [Tie; ROWS], mut columns: [Tie; COLUMNS]) -> Vec<f64> {
        self.faults.iter().for_each(|fault| fault.change(reference_v(), &mut rows, &mut columns));
        let links: Vec<_> = self.faults.iter().filter_map(|fault| fault.link()).collect();
        potentials_v(&self.conductance_s, &rows, &columns, &links)
    }

    pub(super) fn set_parts(&mut self, parts: Parts) {
        self.parts = parts;
        self.outputs_v = [None; ROWS + 1];
    }

    /// Voltages in V at the converters' inputs with row `active`, after settling.
    pub(super) fn outputs_v(&mut self, active: Option<usize>) -> [f64; COLUMNS] {
        let state = active.unwrap_or(ROWS);
        if let Some(known) = self.outputs_v[state] {
            return known;
        }
        let outputs = match self.circuit {
            Circuit::Divider => self.divider_v(active),
            Circuit::ZeroPotential => self.zero_potential_v(active),
        };
        // No output leaves the range of the supply.
        let outputs = outputs.map(|volt| volt.clamp(0.0, reference_v()));
        self.outputs_v[state] = Some(outputs);
        outputs
    }

    /// Ties of all rows: the `active` one to `driven_v`, the others to `idle_v`, or floating.
    fn row_ties(&self, active: Option<usize>, driven_v: f64, idle_v: Option<f64>) -> [Tie; ROWS] {
        std::array::from_fn(|row| {
            let volt = if Some(row) == active { Some(driven_v) } else { idle_v };
            let through_ohm = self.parts.row_source_ohm[row];
            volt.map_or(Tie::Floating, |volt| Tie::Held { volt, through_ohm })
        })
    }

    fn divider_v(&self, active: Option<usize>) -> [f64; COLUMNS] {
        let reference_ohm = f64::from(Divider::<1, 1>::TYPICAL.reference_ohm[0]);
        if !self.cross_talk {
            // Without cross-talk, every reading is a circuit of its own.
            return std::array::from_fn(|k| {
                let siemens = active.map_or(0.0, |m| self.conductance_s[m * COLUMNS + k]);
                reference_v() * siemens * reference_ohm / (siemens * reference_ohm + 1.0)
            });
        }
        let to_ground_ohm = reference_ohm + self.line_ohm;
        let columns = [Tie::Held { volt: 0.0, through_ohm: to_ground_ohm }; COLUMNS];
        let rows = self.row_ties(active, reference_v(), None);
        let potentials = self.potentials_v(rows, columns);
        std::array::from_fn(|k| potentials[ROWS + k] * reference_ohm / to_ground_ohm)
    }

    /// Outputs in V of the circuit with one potential.
    ///
    /// Without switch and lead resistance, held wires do not disturb each other. A scene without
    /// cross-talk therefore needs no separate case.
    fn zero_potential_v(&self, active: Option<usize>) -> [f64; COLUMNS] {
        let drive_v = self.parts.drive_v;
        let rest_v = drive_v; // the active row is pulled to ground
        let rows = self.row_ties(active, rest_v - drive_v, Some(rest_v));
        let columns = self
            .offset_v
            .map(|offset| Tie::Held { volt: rest_v + offset, through_ohm: self.line_ohm });
        let potentials = self.potentials_v(rows, columns);
        let links: Vec<_> = self.faults.iter().filter_map(|fault| fault.link()).collect();
        std::array::from_fn(|k| {
            let stuck = self.faults.iter().find_map(|fault| fault.op_amp_v(k, reference_v()));
            if let Some(volt) = stuck {
                return volt;
            }
            let current = |m: usize| {
                (potentials[ROWS + k] - potentials[m]) * self.conductance_s[m * COLUMNS + k]
            };
            let touching = |([a, b], siemens): &([usize; 2], f64)| {
                let other = if *a == ROWS + k { *b } else { *a };
                let touches = [*a, *b].contains(&(ROWS + k));
                if touches { (potentials[ROWS + k] - potentials[other]) * siemens } else { 0.0 }
            };
            let nodes_a: f64 = (0..ROWS).map(current).sum();
            let current_a = nodes_a + links.iter().map(touching).sum::<f64>();
            rest_v + self.offset_v[k] + self.parts.feedback_ohm[k] * current_a
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fault_shows_in_the_next_sample() {
        let mut analogue = Analogue::new(&Readout::default(), 1);
        analogue.set_readings(&[50.0; ROWS * COLUMNS]);
        let sound = analogue.outputs_v(Some(3));
        analogue.set_faults(&[BoardFault::RowOpen(3)]);
        assert_ne!(analogue.outputs_v(Some(3)), sound);
    }
}
