//! Mutants of the firmware: each has one fault, and the emulated board must show it.

use crate::process::Outcome;

/// A fault: a change of one file.
pub enum Fault {
    /// The first text, which stands once in the file, is replaced by the second.
    Instead(&'static str, &'static str),
    /// Before the first text, which stands once in the file, stands the second.
    Before(&'static str, &'static str),
}

use Fault::{Before, Instead};

/// A fault, and how it shows.
pub struct Mutant {
    pub name: &'static str,
    pub file: &'static str,
    fault: Fault,
    /// Scenario that must fail.
    pub scenario: &'static str,
    /// Text that the scenario must print.
    pub shown_by: &'static str,
}

impl Mutant {
    /// `text` of the file with the fault.
    pub fn apply(&self, text: &str) -> Outcome<String> {
        let (Instead(sound, _) | Before(sound, _)) = self.fault;
        let count = text.matches(sound).count();
        if count != 1 {
            let (name, file) = (self.name, self.file);
            return Err(format!(
                "mutant {name}: {sound:?} stands {count} times in {file}, not once"
            ));
        }
        Ok(match self.fault {
            Instead(sound, faulty) => text.replacen(sound, faulty, 1),
            Before(place, faulty) => text.replacen(place, &format!("{faulty}\n{place}"), 1),
        })
    }
}

const fn mutant(
    name: &'static str,
    file: &'static str,
    fault: Fault,
    [scenario, shown_by]: [&'static str; 2],
) -> Mutant {
    Mutant { name, file, fault, scenario, shown_by }
}

const BOARD: &str = "firmware/nucleo-f446re/src/board.rs";
const BUS: &str = "firmware/nucleo-f446re/src/bus.rs";
const FLASH: &str = "firmware/nucleo-f446re/src/flash.rs";
const SERIAL: &str = "firmware/nucleo-f446re/src/serial.rs";
const SLOT: &str = "firmware/nucleo-f446re/src/slot.rs";
const DEVICE: &str = "firmware/nucleo-f446re/src/device.rs";
const HELD_PIN: &str = "firmware/nucleo-f446re/src/held_pin.rs";
const ROWS: &str = "firmware/src/readout/rows.rs";

/// Line of [`BOARD`] before which the clocks are set up, and the peripherals are not.
const CLOCKS_SET: &str = "        let gpioa = parts.GPIOA.split(&mut rcc);\n";
/// Line of [`BOARD`] before which SPI2 is set up.
const SPI_SET: &str = "        let converter = |select: ErasedPin<Output>| {\n";
/// Line of [`HELD_PIN`] behind which the pin is high.
const HIGH: &str = "        asm::delay(HIGH);\n";

/// All mutants. The first ones bring back faults that the image had.
pub const MUTANTS: &[Mutant] = &[
    mutant(
        "sck-slow",
        BOARD,
        Instead(".speed(Speed::High)", ".speed(Speed::Low)"),
        ["session", "BREACH sck-slow"],
    ),
    mutant(
        "readings-off",
        BOARD,
        Instead(".speed(Speed::High)", ".speed(Speed::Low)"),
        ["session", "FAILED  session: the baseline is"],
    ),
    mutant(
        "not-fed-before-erase",
        "firmware/src/store/upload.rs",
        Instead("            feed();\n            let marked", "            let marked"),
        ["slow-erase-bare", "resets by: watchdog"],
    ),
    mutant(
        "log-blocks",
        "firmware/nucleo-f446re/Cargo.toml",
        Instead(", features = [\"disable-blocking-mode\"]", ""),
        ["log-abandoned", "blocking_write"],
    ),
    mutant(
        "no-fallback",
        "firmware/nucleo-f446re/src/oscillator.rs",
        Instead("PATIENCE_CYCLES: u32 = 1_600_000", "PATIENCE_CYCLES: u32 = u32::MAX"),
        ["no-clock", "host-sim link identify ended with 1"],
    ),
    mutant(
        "select-early",
        BUS,
        Instead("        (0..MOST_LOOKS).find(|_| !self.0.is_busy());\n", ""),
        ["restart", "BREACH select-early"],
    ),
    mutant(
        "wait-short",
        BOARD,
        Instead("Timer::syst(core.SYST", "Timer::syst_external(core.SYST"),
        ["restart", "BREACH wait-short"],
    ),
    mutant(
        "erase-by-bytes",
        FLASH,
        Instead("psize().variant(PSIZE::Psize32).ser()", "psize().variant(PSIZE::Psize8).ser()"),
        ["session", "erasing and writing take"],
    ),
    mutant(
        "clock-short",
        "firmware/nucleo-f446re/src/clock.rs",
        Instead("w.bits(u32::MAX)", "w.bits(u32::MAX - 1)"),
        ["restart", "the clock in us ends early"],
    ),
    mutant(
        "cycles-off",
        BOARD,
        Instead("        core.DWT.enable_cycle_counter();\n", ""),
        ["restart", "the counter of cycles is off"],
    ),
    // Clocks.
    mutant(
        "over-drive",
        BOARD,
        Before(
            CLOCKS_SET,
            "unsafe { Peripherals::steal() }.PWR.cr().modify(|_, w| w.oden().clear_bit());",
        ),
        ["restart", "BREACH over-drive"],
    ),
    mutant(
        "wait-states",
        BOARD,
        Before(CLOCKS_SET, "parts.FLASH.acr().modify(|_, w| unsafe { w.latency().bits(4) });"),
        ["restart", "BREACH wait-states"],
    ),
    mutant(
        "bus-speed",
        BOARD,
        Before(
            CLOCKS_SET,
            "unsafe { Peripherals::steal() }.RCC.cfgr().modify(|_, w| unsafe { w.ppre1().bits(4) });",
        ),
        ["restart", "BREACH bus-speed"],
    ),
    mutant(
        "pll-range",
        BOARD,
        Instead("Config::hse(8.MHz())", "Config::hse(4.MHz())"),
        ["restart", "BREACH pll-range"],
    ),
    mutant(
        "pll-running",
        BOARD,
        Before(CLOCKS_SET, "unsafe { Peripherals::steal() }.RCC.pllcfgr().modify(|_, w| w);"),
        ["restart", "BREACH pll-running"],
    ),
    mutant(
        "pll-not-ready",
        BOARD,
        Before(
            CLOCKS_SET,
            "rcc.cr().modify(|_, w| w.pllon().clear_bit()); rcc.cfgr().modify(|_, w| w);",
        ),
        ["restart", "BREACH pll-not-ready"],
    ),
    mutant(
        "clock-gate",
        BOARD,
        Before(
            SPI_SET,
            "unsafe { Peripherals::steal() }.RCC.apb1enr().modify(|_, w| w.spi2en().clear_bit());",
        ),
        ["restart", "BREACH clock-gate"],
    ),
    mutant(
        "baud",
        SERIAL,
        Instead("baudrate(BAUD.bps())", "baudrate((BAUD / 100 * 97).bps())"),
        ["restart", "BREACH baud"],
    ),
    // Pins and buses.
    mutant(
        "pin-function",
        BOARD,
        Before(
            SPI_SET,
            "unsafe { Peripherals::steal() }.GPIOB.moder().modify(|r, w| unsafe { w.bits(r.bits() & !(3 << 30)) });",
        ),
        ["restart", "BREACH pin-function"],
    ),
    mutant(
        "line-floats",
        BOARD,
        Instead("internal_resistor(Pull::Up)", "internal_resistor(Pull::None)"),
        ["restart", "BREACH line-floats"],
    ),
    mutant(
        "spi-mode",
        BOARD,
        Instead("use embedded_hal::spi::MODE_0;", "use embedded_hal::spi::MODE_1 as MODE_0;"),
        ["restart", "BREACH spi-mode"],
    ),
    mutant(
        "spi-off",
        BOARD,
        Before(
            SPI_SET,
            "unsafe { Peripherals::steal() }.SPI2.cr1().modify(|_, w| w.spe().clear_bit());",
        ),
        ["restart", "BREACH spi-off"],
    ),
    mutant(
        "usart-send",
        SERIAL,
        Instead(
            "let _ = self.tx.write(byte);",
            "for _ in 0..3 { unsafe { USART2::steal().dr().write(|w| w.bits(byte.into())) }; }",
        ),
        ["restart", "BREACH usart-send"],
    ),
    mutant(
        "usart-overrun",
        HELD_PIN,
        Instead(
            "        asm::delay(LOW);\n",
            "        cortex_m::interrupt::free(|_| asm::delay(LOW + 3000));\n",
        ),
        ["restart", "BREACH usart-overrun"],
    ),
    // Converters.
    mutant(
        "converter-speed",
        BOARD,
        Instead("SPI_HZ: u32 = firmware::timing::NUCLEO_SPI_HZ", "SPI_HZ: u32 = 1_406_250"),
        ["restart", "BREACH converter-speed"],
    ),
    mutant(
        "converter-command",
        "firmware/src/readout/columns.rs",
        Instead("[0b0000_0110 | channel >> 2", "[0b0000_0100 | channel >> 2"),
        ["restart", "BREACH converter-command"],
    ),
    mutant(
        "select-short",
        HELD_PIN,
        Before(HIGH, "if HIGH == 90 { self.0.set_low(); self.0.set_high(); }"),
        ["restart", "BREACH select-short"],
    ),
    mutant(
        "two-converters",
        HELD_PIN,
        Before(HIGH, "if HIGH == 90 { self.0.set_low(); }"),
        ["restart", "BREACH two-converters"],
    ),
    // Rows.
    mutant(
        "rows-undefined",
        ROWS,
        Instead("        self.latch.set_high()\n", "        Ok(())\n"),
        ["restart", "BREACH rows-undefined"],
    ),
    mutant(
        "two-rows",
        ROWS,
        Instead("(Some(output) == active).into()", "active.is_some().into()"),
        ["restart", "BREACH two-rows"],
    ),
    mutant(
        "register-timing",
        HELD_PIN,
        Before(HIGH, "if HIGH == 18 { self.0.set_low(); self.0.set_high(); }"),
        ["restart", "BREACH register-timing"],
    ),
    mutant(
        "not-settled",
        "firmware/src/readout/scanner.rs",
        Instead("delay_us(settings.settling_us)", "delay_us(settings.settling_us / 4)"),
        ["restart", "BREACH not-settled"],
    ),
    // Flash.
    mutant(
        "flash-key",
        FLASH,
        Instead("0xCDEF_89AB", "0xCDEF_89AC"),
        ["slow-erase", "BREACH flash-key"],
    ),
    mutant(
        "flash-locked",
        FLASH,
        Instead("for key in KEYS {", "for key in KEYS.into_iter().take(0) {"),
        ["slow-erase", "BREACH flash-locked"],
    ),
    mutant(
        "flash-width",
        FLASH,
        Instead("psize().variant(PSIZE::Psize32).pg()", "psize().variant(PSIZE::Psize16).pg()"),
        ["session", "BREACH flash-width"],
    ),
    mutant(
        "flash-not-erased",
        SLOT,
        Instead(
            "pub fn erase(&mut self) -> Result<(), SlotError> {\n",
            "pub fn erase(&mut self) -> Result<(), SlotError> {\nif self.0.length() > 0 { return Ok(()) }\n",
        ),
        ["session", "BREACH flash-not-erased"],
    ),
    mutant(
        "flash-sector",
        SLOT,
        Instead("flash.sector(self.0.start())", "flash.sector(self.0.start() - 0x40000)"),
        ["slow-erase", "BREACH flash-sector"],
    ),
    mutant(
        "cache-reset",
        FLASH,
        Instead("        self.0.acr().modify(|_, w| w.dcen().clear_bit());\n", ""),
        ["slow-erase", "BREACH cache-reset"],
    ),
    mutant(
        "cache-stale",
        FLASH,
        Instead("        self.0.acr().modify(|_, w| w.dcrst().set_bit());\n", ""),
        ["slow-erase", "BREACH cache-stale"],
    ),
    // Processor.
    mutant(
        "watchdog-off",
        BOARD,
        Instead("        watchdog.start(WATCHDOG_MS.millis());\n", ""),
        ["silent-sensor", "resets by [], expected ['watchdog']"],
    ),
    mutant(
        "watchdog-short",
        BOARD,
        Instead("WATCHDOG_MS: u32 = 8000", "WATCHDOG_MS: u32 = 4000"),
        ["slow-erase", "resets by: watchdog"],
    ),
    mutant(
        "watchdog-unfed",
        DEVICE,
        Instead("        self.watchdog.feed();\n", ""),
        ["patience", "resets by ['watchdog']"],
    ),
    mutant(
        "watchdog-locked",
        BOARD,
        Before(
            CLOCKS_SET,
            "unsafe { Peripherals::steal() }.IWDG.pr().write(|w| unsafe { w.bits(0) });",
        ),
        ["restart", "BREACH watchdog-locked"],
    ),
    mutant(
        "reset-key",
        "firmware/nucleo-f446re/src/reset.rs",
        Instead(
            "    SCB::sys_reset()\n",
            "    unsafe { (*SCB::PTR).aircr.write(4) };\n    loop {}\n",
        ),
        ["restart", "BREACH reset-key"],
    ),
    mutant(
        "fault",
        DEVICE,
        Before(
            "    let nucleo = Nucleo {\n",
            "unsafe { core::ptr::read_volatile(0x1000_0000 as *const u32) };",
        ),
        ["restart", "BREACH fault"],
    ),
];

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;
    use std::fs;

    use super::*;
    use crate::process::root;

    fn read(file: &str) -> String {
        fs::read_to_string(root().join(file)).unwrap_or_else(|cause| panic!("{file}: {cause}"))
    }

    #[test]
    fn every_mutant_finds_its_text_once_and_has_a_name_of_its_own() {
        for mutant in MUTANTS {
            let text = read(mutant.file);
            let faulty = mutant.apply(&text).unwrap_or_else(|cause| panic!("{cause}"));
            assert_ne!(faulty, text, "{}", mutant.name);
        }
        let names: BTreeSet<_> = MUTANTS.iter().map(|mutant| mutant.name).collect();
        assert_eq!(names.len(), MUTANTS.len());
    }

    #[test]
    fn every_rule_has_a_mutant_that_breaks_it() {
        let rules = read("proof/board-emulator/rules.txt");
        let rules = rules.lines().filter(|line| !line.is_empty() && !line.starts_with('#'));
        let rules: BTreeSet<_> = rules.map(|line| line.split('|').next().unwrap().trim()).collect();
        let broken = MUTANTS.iter().filter_map(|mutant| mutant.shown_by.strip_prefix("BREACH "));
        assert_eq!(broken.collect::<BTreeSet<_>>(), rules);
    }
}
