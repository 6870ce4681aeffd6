//! The image for the board NUCLEO-F446RE that reads the sensor by its own converters.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod device {
    use board_common::CAPACITY;
    use cortex_m_rt::entry;
    use firmware::circuit::ZeroPotential;
    use firmware::readout::PassScanner;
    use nucleo_f446re::{COLUMNS, LINES, OnChip, run};

    const _: () = assert!(
        CAPACITY.rows < LINES && CAPACITY.columns <= COLUMNS,
        "the pins are for 8 rows and 18 columns"
    );

    /// Constants of the circuit, until others are kept: `host-sim link PORT calibrate` measures your own.
    const CIRCUIT: ZeroPotential<{ LINES - 1 }, COLUMNS> = ZeroPotential::TYPICAL;

    #[entry]
    fn main() -> ! {
        run(|readout: OnChip| PassScanner::<_, _, LINES, COLUMNS>::new(readout, CIRCUIT))
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("an image for a board: `cargo nucleo-onchip` flashes it");
}
