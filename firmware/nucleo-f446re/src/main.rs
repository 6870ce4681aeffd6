//! The image for the board NUCLEO-F446RE with converters around it: the application, with the sensor at its pins.
#![cfg_attr(target_os = "none", no_std, no_main)]

#[cfg(target_os = "none")]
mod device {
    use board_common::CAPACITY;
    use cortex_m_rt::entry;
    use nucleo_f446re::{Converters, run};
    use taxel_firmware::circuit::ZeroPotential;
    use taxel_firmware::readout::{Mcp3208s, Scanner, ShiftRegister595};

    /// Constants of the circuit, until others are kept: `taxel link PORT constants FILE` sets your own.
    const CIRCUIT: ZeroPotential<{ CAPACITY.rows }, { CAPACITY.columns }> = ZeroPotential::TYPICAL;

    type BoardScanner<D, S, T> = Scanner<D, S, T, { CAPACITY.rows }, { CAPACITY.columns }>;

    #[entry]
    fn main() -> ! {
        run(|readout: Converters| {
            let drive = ShiftRegister595::<_, { CAPACITY.rows }> {
                data: readout.row_data,
                clock: readout.row_clock,
                latch: readout.row_latch,
            };
            let sampler = Mcp3208s { chips: readout.converters };
            BoardScanner::new(drive, sampler, readout.delay, CIRCUIT)
        })
    }
}

#[cfg(not(target_os = "none"))]
fn main() {
    eprintln!("an image for a board: `cargo nucleo` flashes it");
}
