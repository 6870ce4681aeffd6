//! A device in QEMU whose memory is damaged while it decodes.

use std::path::Path;
use std::time::{Duration, Instant};

use firmware::link::message::{EstimateReport, Report, Request};
use model_core::blob::Floats;
use model_core::{AlignedBytes, Decoder};
use rand_core::Rng;
use taxel_rig::Error;
use taxel_rig::device::Device;
use taxel_rig::emulator::Link;

use super::gdb::Gdb;
use super::running::{ROWS, Running, Setup};

/// What a flipped bit does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Harm {
    /// All estimates are right.
    None,
    /// The device tells: by a flag, a refusal, no answer to one kind of request, or a model that is not in force any more.
    Told,
    /// The processor faults, and the device restarts.
    Fault,
    /// The device stands still, and its watchdog is not fed.
    Watchdog,
    /// Estimates are wrong until the check in the background finds the damage, and mends it.
    Mended,
    /// Estimates are wrong, and nothing tells.
    Silent,
    /// The device answers no more, although its watchdog is fed.
    ForGood,
}

impl Harm {
    /// Every kind.
    pub const ALL: [Self; 7] = [
        Self::None,
        Self::Told,
        Self::Fault,
        Self::Watchdog,
        Self::Mended,
        Self::Silent,
        Self::ForGood,
    ];
}

/// Frames that are decoded behind a flip.
const FRAMES: usize = 24;
/// Longest time that an answer takes.
const ANSWER: Duration = Duration::from_millis(200);
/// Longest time that the check in the background takes for two passes.
const TWO_PASSES: Duration = Duration::from_secs(2);
/// The watchdog's count, which falls until it is fed.
const WATCHDOG_COUNT: u32 = 0x4000_8004;

/// Address of the copy of the model in the emulator's image.
pub const COPY: u32 = 0x2000_8000;

/// A frame, and what must be decoded of it.
struct Case {
    readings_ohm: Vec<f32>,
    outputs: Vec<f32>,
}

/// A device, in an emulator that may have to be started anew.
pub struct Victim {
    setup: Setup,
    cases: Vec<Case>,
    crc_32: u32,
    running: Option<Running>,
}

impl Victim {
    /// A device with the emulator's `image` and the model `blob`.
    pub fn new(image: &Path, blob: &AlignedBytes) -> Result<Self, String> {
        let decoder = Decoder::<ROWS>::load(blob).map_err(|cause| cause.to_string())?;
        let inputs = decoder.shape().inputs * decoder.shape().rows;
        let case = |number: usize| {
            let reading = |i: usize| 40.0 + ((i * 37 + number * 101) % 997) as f32 * 0.04;
            let readings_ohm: Vec<f32> = (0..inputs).map(reading).collect();
            let estimate = decoder.decode(&readings_ohm[..]).map_err(|cause| cause.to_string())?;
            Ok(Case { readings_ohm, outputs: estimate.outputs })
        };
        let cases = (0..FRAMES).map(case).collect::<Result<_, String>>()?;
        let setup = Setup::new(image, blob)?;
        Ok(Self { setup, cases, crc_32: decoder.model_crc(), running: None })
    }

    /// Flips a bit while the device decodes, and looks what becomes of it. The device is as new before.
    pub fn flip(&mut self, address: u32, bit: u32, random: &mut impl Rng) -> Result<Harm, String> {
        let mut running = self.renewed()?;
        let case = &self.cases[0];
        let request = Request::Decode { frame: 0, readings_ohm: Floats::new(&case.readings_ohm) };
        let failed = |cause: &dyn std::fmt::Display| format!("the emulator: {cause}");
        running.device.send(&request).map_err(|cause| failed(&cause))?;
        let (start, wait) = (Instant::now(), Duration::from_micros(random.next_u64() % 300));
        while start.elapsed() < wait {}
        running.gdb.stop().map_err(|cause| failed(&cause))?;
        running.gdb.flip(address, bit).map_err(|cause| failed(&cause))?;
        running.gdb.run().map_err(|cause| failed(&cause))?;
        let harm = self.look(&mut running);
        if matches!(harm, Harm::None | Harm::Mended | Harm::Silent | Harm::Told) {
            self.running = Some(running); // else QEMU may have ended, or stand still
        }
        Ok(harm)
    }

    /// The device after a reset, whose estimates are right.
    fn renewed(&mut self) -> Result<Running, String> {
        if let Some(mut running) = self.running.take()
            && running.gdb.stop().and_then(|()| running.gdb.reset()).is_ok()
            && running.gdb.run().is_ok()
            && self.is_sound(&mut running)
        {
            return Ok(running);
        }
        let mut running = Running::start(&self.setup)?;
        if self.is_sound(&mut running) {
            return Ok(running);
        }
        Err("the device in the emulator does not decode as the host does".to_owned())
    }

    fn is_sound(&self, running: &mut Running) -> bool {
        let mut cases = self.cases.iter().take(2);
        running.answers() && cases.all(|case| decoded(&mut running.device, case) == Ok(Harm::None))
    }

    /// Looks at estimates, and where none come at the watchdog.
    fn look(&self, running: &mut Running) -> Harm {
        let mut worst = Harm::None;
        for case in &self.cases {
            match decoded(&mut running.device, case) {
                Ok(Harm::Told) => return Harm::Told,
                Ok(Harm::Silent) => worst = Harm::Silent,
                Ok(_) => {}
                Err(is_closed) if is_closed => return Harm::Fault,
                Err(_) => {
                    return if is_fed(&mut running.gdb) { Harm::ForGood } else { Harm::Watchdog };
                }
            }
        }
        if worst == Harm::Silent && self.is_mended(running) {
            worst = Harm::Mended;
        }
        match running.device.identify() {
            Ok(identity) if identity.has_in_force(self.crc_32) => worst,
            Ok(_) => Harm::Told,
            Err(Error::Closed) => Harm::Fault,
            // It cannot say which model it has, but it decodes.
            Err(_) if decoded(&mut running.device, &self.cases[0]).is_ok() => Harm::Told,
            Err(_) if is_fed(&mut running.gdb) => Harm::ForGood,
            Err(_) => Harm::Watchdog,
        }
    }

    /// Whether the check in the background finds damage within two passes, and all estimates are right again.
    fn is_mended(&self, running: &mut Running) -> bool {
        let Ok(before) = running.device.statistics() else { return false };
        let start = Instant::now();
        loop {
            match running.device.statistics() {
                Ok(now) if now.model_damages > 0 => break,
                Ok(now)
                    if now.model_checks < before.model_checks.saturating_add(2)
                        && start.elapsed() < TWO_PASSES => {}
                _ => return false,
            }
        }
        self.cases.iter().all(|case| decoded(&mut running.device, case) == Ok(Harm::None))
    }
}

/// Whether the watchdog is fed within a second, in which its count would fall otherwise.
fn is_fed(gdb: &mut Gdb) -> bool {
    let mut last = u32::MAX;
    for _ in 0..20 {
        let Ok(count) = gdb.stop().and_then(|()| gdb.word(WATCHDOG_COUNT)) else { return false };
        if gdb.run().is_err() {
            return false;
        }
        // One that is fed all the time shows the same count again.
        if count >= last {
            return true;
        }
        last = count;
        std::thread::sleep(Duration::from_millis(50));
    }
    false
}

/// Lets the device decode a frame. An error tells whether the emulator has ended.
fn decoded(device: &mut Device<Link>, case: &Case) -> Result<Harm, bool> {
    let request = Request::Decode { frame: 0, readings_ohm: Floats::new(&case.readings_ohm) };
    let answer = device.ask(&request, ANSWER, |report| match report {
        Report::Estimate(estimate) => Some(judged(estimate, case)),
        _ => None,
    });
    match answer {
        Ok(Ok(harm)) => Ok(harm),
        Ok(Err(_)) | Err(Error::Unexpected { .. }) => Ok(Harm::Told),
        Err(Error::NoAnswer { .. }) => Err(false),
        Err(_) => Err(true),
    }
}

fn judged(estimate: &EstimateReport<'_>, case: &Case) -> Harm {
    if estimate.flags & !EstimateReport::CLAMPED != 0 || estimate.row_status.iter().any(|s| *s != 0)
    {
        return Harm::Told;
    }
    let same = |(found, right): (f32, &f32)| found.to_bits() == right.to_bits();
    let all = estimate.outputs.0.len() == 4 * case.outputs.len();
    let is_right = all && estimate.outputs.iter().zip(&case.outputs).all(same);
    if is_right { Harm::None } else { Harm::Silent }
}
