//! The application on a board that is opaque to the optimiser.

use taxel_firmware::app::{App, Buffers};
use taxel_firmware::capacity::Capacity;
use taxel_firmware::circuit::{Constants, ConstantsFault, ZeroPotential};
use taxel_firmware::link::message::{Configuration, Memory};
use taxel_firmware::platform::{Platform, Port};
use taxel_firmware::readout::{FrameSource, ScanReport, ScanSettings, Selection};
use taxel_firmware::store::{FlashError, Journal, Slot};

use crate::opaque::{opaque, slot};

struct Board(Journal<Flash>);

impl Port for Board {
    fn now_us(&mut self) -> u32 {
        opaque(0)
    }

    fn receive(&mut self) -> Option<u8> {
        opaque(Some(0))
    }

    fn send(&mut self, byte: u8) -> bool {
        opaque(byte);
        opaque(true)
    }
}

impl Platform for Board {
    type Page = Flash;

    const BOARD: &'static str = "link-check";

    fn feed_watchdog(&mut self) {
        opaque(());
    }

    fn memory(&self) -> Memory {
        opaque(Memory::default())
    }

    fn journal(&mut self) -> &mut Journal<Flash> {
        &mut self.0
    }
}

struct Sensor(ZeroPotential<8, 18>);

impl FrameSource for Sensor {
    fn scan(
        &mut self,
        settings: ScanSettings,
        wires: Selection<'_>,
        frame: &mut [f32],
    ) -> ScanReport {
        opaque((settings, wires));
        frame.fill(opaque(60.0));
        opaque(ScanReport::default())
    }

    fn start(&mut self, settings: ScanSettings, wires: Selection<'_>) -> bool {
        opaque((settings, wires));
        opaque(true)
    }

    fn poll(&mut self) -> bool {
        opaque(true)
    }

    fn take(&mut self, frame: &mut [f32]) -> ScanReport {
        frame.fill(opaque(60.0));
        opaque(ScanReport::default())
    }

    fn stop(&mut self) {
        opaque(());
    }

    fn constants(&self) -> Option<Constants<'_>> {
        Some(self.0.constants())
    }

    fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        self.0.set_constants(constants)
    }
}

struct Flash;

impl Slot for Flash {
    fn bytes(&self) -> &[u8] {
        slot()
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        opaque(Ok(()))
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        opaque((offset, bytes));
        opaque(Ok(()))
    }
}

pub fn exercise() {
    let mut buffers = Buffers::<8, 18, 18, { Capacity::PAPER.message_bytes() }>::new();
    let configuration = opaque(Configuration::DEFAULT);
    let sensor = Sensor(opaque(ZeroPotential::TYPICAL));
    let mut app =
        App::new(Board(Journal::new([Flash, Flash])), sensor, configuration, &mut buffers);
    let mut weights = [0; 1024];
    app.run(&mut [Flash, Flash], &mut weights);
    opaque(weights);
}
