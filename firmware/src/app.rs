//! The application: scan → health → track or decode → filter → report, and the link, in one loop without waits.
//!
//! A board's program makes an [`App`] of its parts and calls [`App::run`], which returns only when the program
//! must restart. All large memory is in [`Buffers`], for which the program has a static: nothing grows, nothing
//! is allocated.

use taxel_core::events::Events;
use taxel_core::filter::State;

use crate::link::message::Configuration;
use crate::link::receive::Receiver;
use crate::log::{info, warning};
use crate::platform::Platform;
use crate::readout::FrameSource;
use crate::store::Slot;

// From the ground up: a module imports only what is declared before it.
mod buffers;
mod configuration;
mod frame_clock;
mod link;
mod session_end;
mod model;
mod wiring;
mod sensor;
mod saved_settings;
mod work;
mod models;
mod session;
mod answer;

pub use buffers::Buffers;
use link::Link;
use models::Models;
use sensor::Sensor;
pub use session::Session;
pub use session_end::SessionEnd;
use wiring::Wiring;
use work::Work;

/// The application's state, except the model in force. `ROWS` is the largest number of rows.
pub struct App<'m, P, F, const ROWS: usize> {
    receiver: Receiver<&'m mut [u8]>,
    core: Core<'m, P, F, ROWS>,
}

/// The application without the receiver: a request borrows the receiver's bytes while it is answered.
struct Core<'m, P, F, const ROWS: usize> {
    sensor: Sensor<'m, F, ROWS>,
    models: Models,
    link: Link<'m, P>,
    work: Work<'m, ROWS>,
}

impl<'m, P: Platform, F: FrameSource, const ROWS: usize> App<'m, P, F, ROWS> {
    /// Makes an application. Its own configuration and constants are the stored ones, or else `configuration` and the
    /// constants of `source`.
    pub fn new<const COLUMNS: usize, const OUTPUTS: usize, const BYTES: usize>(
        mut platform: P,
        source: F,
        configuration: Configuration,
        buffers: &'m mut Buffers<ROWS, COLUMNS, OUTPUTS, BYTES>,
    ) -> Self {
        let Buffers {
            received,
            message,
            frame,
            measured,
            places,
            baseline,
            reciprocals,
            scratch,
            estimate,
            tracks,
            contact,
            deviations,
        } = buffers;
        let capacity = Buffers::<ROWS, COLUMNS, OUTPUTS, BYTES>::CAPACITY;
        let journal = platform.journal();
        if journal.recover().is_err() {
            warning!("the journal in flash failed");
        }
        let now_us = platform.now_us();
        let mut link = Link::new(platform, message);
        let memories = [frame.as_flattened_mut(), baseline.as_flattened_mut()];
        let wiring = Wiring::new(capacity, places.as_flattened_mut());
        let mut sensor = Sensor::new(source, configuration, wiring, memories, now_us);
        sensor.load_settings(&mut link);
        let work = Work {
            rows: ROWS,
            outputs: 0,
            reciprocals: reciprocals.as_flattened_mut(),
            has_reciprocals: false,
            measured: measured.as_flattened_mut(),
            scratch: scratch.as_flattened_mut().as_flattened_mut(),
            estimate: estimate.whole(),
            filter: State::new(tracks.as_flattened_mut()),
            contact,
            events: Events::default(),
            is_followed: false,
            force: None,
            deviations: deviations.as_flattened_mut(),
        };
        let core = Core { sensor, models: Models::new(capacity), link, work };
        Self { receiver: Receiver::new(received), core }
    }

    /// Runs until the host asks for a restart. When another model comes into force, another session begins.
    ///
    /// A model that fits into `weights` is copied there from its slot, and decoded from there: on most boards RAM is
    /// faster than flash.
    /// It may be empty.
    pub fn run<S: Slot>(&mut self, slots: &mut [S; 2], weights: &mut [u32]) {
        loop {
            let mut session = Session::start(self, slots, weights);
            let end = loop {
                if let Some(end) = session.step() {
                    break end;
                }
            };
            if end == SessionEnd::Restart {
                return;
            }
            info!("another session begins");
        }
    }

    /// The board's platform, for tests that inspect it.
    pub fn platform(&mut self) -> &mut P {
        self.core.link.platform()
    }
}
