//! The image for the board NUCLEO-F446RE that reads the sensor by its own converters.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod device {
    use board_common::CAPACITY;
    use cortex_m_rt::entry;
    use nucleo_f446re::{COLUMNS, LINES, OnChip, restart, run};
    use taxel_firmware::circuit::ZeroPotential;
    use taxel_firmware::readout::PassScanner;

    const _: () = assert!(
        CAPACITY.rows < LINES && CAPACITY.columns <= COLUMNS,
        "the pins are for 8 rows and 18 columns"
    );

    /// Constants of the circuit, until others are kept: `taxel link PORT constants FILE` sets your own.
    const CIRCUIT: ZeroPotential<{ LINES - 1 }, COLUMNS> = ZeroPotential::TYPICAL;

    #[entry]
    fn main() -> ! {
        let sums = cortex_m::singleton!(: [[u32; COLUMNS]; LINES] = [[0; COLUMNS]; LINES]);
        let Some(sums) = sums else { restart() };
        run(|readout: OnChip| PassScanner::new(readout, CIRCUIT, sums))
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("an image for a board: `cargo nucleo-onchip` flashes it");
}
