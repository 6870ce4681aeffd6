//! What the readout's test of itself means: the supply, converters, pins, and the parts of a pass.

use taxel_firmware::readout::{Diagnosis, PINS};
use taxel_firmware::timing::{NUCLEO_MHZ, ScanPlan};

use super::stage::Stage;

/// Names of the converters' pins, three of each.
const PIN_NAMES: [&str; PINS] = ["PA0", "PA1", "PA4", "PA6", "PA7", "PB0", "PC0", "PC1", "PC2"];
const PINS_A_CONVERTER: usize = 3;

/// Supply in V at which the factory measured, and the temperatures in °C.
const FACTORY_V: f64 = 3.3;
const FACTORY_CELSIUS: [f64; 2] = [30.0, 110.0];

/// Supply in V and temperature in °C that are allowed.
const SUPPLY_V: [f64; 2] = [3.0, 3.6];
const CELSIUS: [f64; 2] = [-10.0, 60.0];

/// Least counts of a pin by its pull-up, and most by its pull-down, at which nothing else is.
const PULLED_UP: u16 = 3500;
const PULLED_DOWN: u16 = 600;

/// Most counts between both pulls of a pin that a circuit holds; counts of V_b, of ground and of 3.3 V.
const HELD: u16 = 150;
const BIAS: [u16; 2] = [150, 350];
const GROUND: u16 = 60;
const SUPPLY: u16 = 4000;

/// Largest difference of a pass from its plan, as a share.
const PASS_OFF: f64 = 0.03;

/// What is at a pin.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pin {
    /// Nothing: it follows its own pulls.
    Open,
    /// A circuit with V_b.
    Biased,
    Silent,
    Ground,
    Supply,
    Elsewhere,
}

/// What is at each pin.
pub fn pins(found: &Diagnosis) -> [Pin; PINS] {
    let mut pins = [Pin::Elsewhere; PINS];
    let counts = found.pulled_up.iter().zip(found.pulled_down).zip(found.rise_along);
    for (pin, ((up, down), along)) in pins.iter_mut().zip(counts) {
        *pin = match (*up, down) {
            (Diagnosis::NO_ANSWER, _) | (_, Diagnosis::NO_ANSWER) => Pin::Silent,
            (PULLED_UP.., ..=PULLED_DOWN) if along == 0 => Pin::Open,
            (up, down) if up.abs_diff(down) > HELD || along != 0 => Pin::Elsewhere,
            (up, _) if (BIAS[0]..=BIAS[1]).contains(&up) => Pin::Biased,
            (..=GROUND, _) => Pin::Ground,
            (SUPPLY.., _) => Pin::Supply,
            _ => Pin::Elsewhere,
        };
    }
    pins
}

/// Judges what the readout found.
pub fn stages(found: &Diagnosis) -> Vec<Stage> {
    let [reference, cold, hot] = found.factory.map(f64::from);
    let supply_v = FACTORY_V * reference / f64::from(found.reference.max(1));
    let counts = f64::from(found.temperature) * supply_v / FACTORY_V;
    let [low, high] = FACTORY_CELSIUS;
    let celsius = low + (counts - cold) * (high - low) / (hot - cold);
    let rounded = |value: f64| (100.0 * value).round() / 100.0;
    let mut stages = vec![
        Stage::within(
            "supply by VREFINT, V",
            rounded(supply_v),
            SUPPLY_V,
            "V_DDA is too low or too high: look at the 3.3 V regulator, JP5 and what draws from 3V3; or ADC1 is dead",
        ),
        Stage::within(
            "chip's temperature, °C",
            rounded(celsius),
            CELSIUS,
            "the chip is too hot or too cold: an output that is shorted heats it",
        ),
    ];
    let pins = pins(found);
    for (index, pins) in pins.chunks(PINS_A_CONVERTER).enumerate() {
        let answering = pins.iter().filter(|pin| **pin != Pin::Silent).count();
        let cause = (answering < PINS_A_CONVERTER)
            .then(|| format!("ADC{} does not answer: the converter is dead", index + 1));
        let name = format!("ADC{}, pins of three that it samples", index + 1);
        stages.push(Stage::new(name, answering, "3", cause));
    }
    stages.extend((0..PINS).map(|pin| of_pin(found, &pins, pin)));
    stages.extend(of_pass(found));
    stages
}

fn of_pin(found: &Diagnosis, pins: &[Pin; PINS], pin: usize) -> Stage {
    let name = PIN_NAMES[pin];
    let others: Vec<usize> =
        (0..PINS).filter(|other| found.rise_along[pin] >> other & 1 == 1).collect();
    let names = || others.iter().map(|other| PIN_NAMES[*other]).collect::<Vec<_>>().join(", ");
    let are_all = |kind: Pin| pins.iter().all(|pin| *pin == kind);
    let cause = match pins[pin] {
        // A converter that is silent has a stage of its own.
        Pin::Open | Pin::Biased | Pin::Silent => None,
        Pin::Elsewhere if !others.is_empty() && found.pulled_up[pin] < PULLED_UP => {
            Some(format!("{name} is swapped with {}", names()))
        }
        Pin::Elsewhere if !others.is_empty() => {
            Some(format!("{name} is connected to {}: a solder bridge", names()))
        }
        Pin::Ground if are_all(Pin::Ground) => {
            Some("V_b is off: the circuit holds every pin at 0 V".to_owned())
        }
        Pin::Ground => Some(format!("{name} is shorted to ground")),
        Pin::Supply => Some(format!("{name} is at 3.3 V: a short, or an op-amp without feedback")),
        Pin::Elsewhere => {
            Some(format!("something holds {name} that is neither open nor at V_b of 0.2 V"))
        }
    };
    let measured =
        format!("{} pulled up, {} pulled down", found.pulled_up[pin], found.pulled_down[pin]);
    let [least, most] = BIAS;
    let allowed = format!(
        "over {PULLED_UP} and under {PULLED_DOWN}, no other rises; or V_b: {least} to {most}"
    );
    Stage::new(format!("pin {name}, counts"), measured, allowed, cause)
}

/// The parts of a pass, in the order in which one needs the other.
fn of_pass(found: &Diagnosis) -> Vec<Stage> {
    let [_, _, numbers_left, _] = found.items_left;
    let of_numbers = if found.has_overrun {
        "DMA2 stream 0 stalls: it does not take the converters' numbers"
    } else if numbers_left == found.items[2] {
        "timer 8 does not trigger the converters: no number came"
    } else {
        "timer 8 triggers too seldom, or a converter stops: numbers are missing"
    };
    let causes = [
        "DMA2 stream 6 stalls: it does not drive the rows (timer 1, channel 3)",
        "DMA2 stream 2 stalls: it does not switch the multiplexers (timer 1, channel 2)",
        of_numbers,
        "DMA2 stream 5 stalls: it does not let the rows idle behind the last one (timer 1, update)",
    ];
    let moved = found.items.iter().zip(found.items_left);
    let mut stages: Vec<Stage> = moved
        .zip(Diagnosis::PARTS.into_iter().zip(causes))
        .map(|((items, left), (part, cause))| {
            let cause = (left != 0).then_some(cause);
            Stage::new(
                format!("{part} by DMA"),
                items.saturating_sub(left),
                items.to_string(),
                cause,
            )
        })
        .collect();
    let deaf = "timer 1 does not stop behind the last row: it does not count, or repeats";
    let cause = (!found.has_stopped).then_some(deaf);
    stages.push(Stage::new("timer 1 has stopped", found.has_stopped, "true", cause));
    let overrun = "a converter's number was lost: DMA2 is late or stalls";
    let cause = found.has_overrun.then_some(overrun);
    stages.push(Stage::new("overrun of a converter", found.has_overrun, "false", cause));
    let planned = f64::from(ScanPlan::of_nucleo_onchip(8, 18, 1).longest_us() * NUCLEO_MHZ);
    let bounds = [1.0 - PASS_OFF, 1.0 + PASS_OFF].map(|share| (share * planned).round() as u32);
    let slow = "a pass takes another time than planned: look at the parts before this one, or the timers' clock";
    stages.push(Stage::within("cycles of a pass", found.pass_cycles, bounds, slow));
    stages
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sound() -> Diagnosis {
        Diagnosis {
            reference: 1501,
            temperature: 944,
            factory: [1501, 959, 1207],
            pulled_up: [4090; PINS],
            pulled_down: [3; PINS],
            rise_along: [0; PINS],
            items_left: [0; 4],
            items: [9, 9, 162, 1],
            has_stopped: true,
            has_overrun: false,
            pass_cycles: 45_450,
        }
    }

    fn causes(found: &Diagnosis) -> Vec<String> {
        stages(found).into_iter().filter_map(|stage| stage.probable_cause).collect()
    }

    #[test]
    fn a_sound_board_has_no_fault_bare_or_with_its_circuit() {
        assert_eq!(causes(&sound()), [""; 0]);
        let held = Diagnosis { pulled_up: [248; PINS], pulled_down: [247; PINS], ..sound() };
        assert_eq!(causes(&held), [""; 0]);
    }

    #[test]
    fn bridges_swaps_shorts_and_saturated_op_amps_are_distinguished() {
        let with = |pin: usize, up, down, along| {
            let mut found = sound();
            (found.pulled_up[pin], found.pulled_down[pin]) = (up, down);
            found.rise_along[pin] = along;
            causes(&found).join("; ")
        };
        assert!(with(1, 3600, 3, 1 << 4).contains("PA1 is connected to PA7"));
        assert!(with(1, 3, 3, 1 << 4).contains("PA1 is swapped with PA7"));
        assert!(with(2, 5, 4, 0).contains("PA4 is shorted to ground"));
        assert!(with(8, 4094, 4093, 0).contains("PC2 is at 3.3 V"));
        assert!(with(3, 900, 890, 0).contains("something holds PA6"));
    }

    #[test]
    fn a_pass_that_loses_some_numbers_is_told_from_one_without_any() {
        let left = |items_left, has_overrun| {
            causes(&Diagnosis { items_left, has_overrun, ..sound() }).join("; ")
        };
        assert!(left([0, 0, 162, 0], false).contains("timer 8 does not trigger"));
        assert!(left([0, 0, 80, 0], false).contains("numbers are missing"));
        assert!(left([0, 0, 162, 0], true).contains("DMA2 stream 0 stalls"));
        assert!(left([0, 9, 0, 0], false).contains("stream 2"));
    }
}
