//! The application on a board that is opaque to the optimiser.

use firmware::app::{PaperApp, PaperBuffers};
use firmware::link::message::{Configuration, Memory};
use firmware::platform::{Platform, Port};
use firmware::readout::{FrameSource, ScanReport, ScanSettings};
use firmware::store::{FlashError, Slot};
use model_core::Frame;

use crate::opaque::{opaque, slot};

struct Board;

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
    const BOARD: &'static str = "link-check";

    fn feed_watchdog(&mut self) {
        opaque(());
    }

    fn memory(&self) -> Memory {
        opaque(Memory::default())
    }
}

struct Sensor;

impl FrameSource<8, 18> for Sensor {
    fn scan(&mut self, settings: ScanSettings, frame: &mut Frame<8, 18>) -> ScanReport {
        opaque(settings);
        *frame = opaque(Frame::missing());
        opaque(ScanReport::default())
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
    let mut buffers = PaperBuffers::new();
    let configuration = opaque(Configuration::DEFAULT);
    let mut app = PaperApp::<_, _>::new(Board, Sensor, configuration, &mut buffers);
    app.run(&mut [Flash, Flash]);
}
