//! The image for the board NUCLEO-F446RE, which reads the sensor by the chip's own converters.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod device {
    use cortex_m_rt::entry;
    use nucleo_f446re::{COLUMNS, LINES, restart, run};
    use taxel_firmware::circuit::ZeroPotential;
    use taxel_firmware::readout::PassScanner;

    /// Constants of the circuit, until others are kept: `taxel link PORT constants FILE` sets your own.
    const CIRCUIT: ZeroPotential<{ LINES - 1 }, COLUMNS> = ZeroPotential::TYPICAL;

    #[entry]
    fn main() -> ! {
        let sums = cortex_m::singleton!(: [[u32; COLUMNS]; LINES] = [[0; COLUMNS]; LINES]);
        let Some(sums) = sums else { restart() };
        run(|readout| PassScanner::new(readout, CIRCUIT, sums))
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("an image for a board: `cargo nucleo` flashes it");
}
