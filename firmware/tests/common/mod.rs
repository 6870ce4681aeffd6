//! A board, slots and a host for tests; all are stricter than the real ones.
#![allow(dead_code, reason = "every test file uses its part")]

use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;

use firmware::app::{App, Buffers, Leave, Session};
use firmware::circuit::{Circuit, Constants, ConstantsFault, ZeroPotential};
use firmware::link::message::{Configuration, Memory, Report, Request, UploadStep};
use firmware::link::receive::{Received, Receiver};
use firmware::link::{cobs, packet};
use firmware::platform::{Platform, Port};
use firmware::readout::{FrameSource, ScanReport, ScanSettings, Selection};
use firmware::store::{FlashError, Slot};
use model_core::AlignedBytes;
use model_core::blob::{Metadata, Model, ModelParts, ModelShape, encode_to_vec};
use model_core::confidence::{Confidence, Sizes};
use model_core::expansion::Expansion;
use model_core::projection::Projection;
use model_core::rbf::direct::{self, Parameters};
use model_core::rbf::{Network, Shape};

pub mod pages;

use pages::SharedSettings;

pub const ROWS: usize = 2;
pub const COLS: usize = 3;
pub const OUTPUTS: usize = 2;
pub const MESSAGE_BYTES: usize = 256;

pub type TestApp = App<'static, Board, Source, ROWS>;
pub type TestSession<'a> = Session<'a, 'static, Board, Source, MockSlot, ROWS>;
pub type TestFrame = [[f32; COLS]; ROWS];

/// State of the board, which a test can see while the application owns the board.
#[derive(Default)]
pub struct Pins {
    pub to_device: VecDeque<u8>,
    pub to_host: Vec<u8>,
    pub now_us: u32,
    pub feeds: u32,
    /// Number of bytes that the host's side still takes; `None` takes all.
    pub room: Option<usize>,
    /// Least time in µs between two bytes that the host's side takes.
    pub gap_us: u32,
    /// When it took the last byte.
    taken_us: u32,
}

#[derive(Clone, Default)]
pub struct Board(pub Rc<RefCell<Pins>>, pub SharedSettings);

impl Port for Board {
    fn now_us(&mut self) -> u32 {
        let mut pins = self.0.borrow_mut();
        pins.now_us = pins.now_us.wrapping_add(1);
        pins.now_us
    }

    fn receive(&mut self) -> Option<u8> {
        self.0.borrow_mut().to_device.pop_front()
    }

    fn send(&mut self, byte: u8) -> bool {
        let mut pins = self.0.borrow_mut();
        if pins.now_us.wrapping_sub(pins.taken_us) < pins.gap_us {
            return false;
        }
        pins.taken_us = pins.now_us;
        match &mut pins.room {
            Some(0) => return false,
            Some(room) => *room -= 1,
            None => {}
        }
        pins.to_host.push(byte);
        true
    }
}

impl Platform for Board {
    type Settings = SharedSettings;

    const BOARD: &'static str = "test";

    fn feed_watchdog(&mut self) {
        self.0.borrow_mut().feeds += 1;
    }

    fn memory(&self) -> Memory {
        Memory { stack_reserved: 1024, ..Memory::default() }
    }

    fn settings(&mut self) -> &mut SharedSettings {
        &mut self.1
    }
}

/// A sensor that shows the same frame until it is given another. Its circuit's constants change nothing.
#[derive(Clone)]
pub struct Source {
    pub circuit: ZeroPotential<ROWS, COLS>,
    pub frame: Rc<RefCell<TestFrame>>,
    pub board: Board,
    pub scan_us: u32,
}

impl Source {
    pub fn new(frame: &Rc<RefCell<TestFrame>>, board: &Board, scan_us: u32) -> Self {
        Self {
            circuit: ZeroPotential::TYPICAL,
            frame: frame.clone(),
            board: board.clone(),
            scan_us,
        }
    }
}

impl FrameSource for Source {
    fn scan(
        &mut self,
        settings: ScanSettings,
        wires: Selection<'_>,
        frame: &mut [f32],
    ) -> ScanReport {
        assert!(settings.oversampling > 0, "a scan without samples");
        assert_eq!(frame.len(), wires.rows.len() * wires.columns);
        for (to, row) in frame.chunks_mut(wires.columns).zip(wires.rows) {
            to.copy_from_slice(&self.frame.borrow()[row.0][..wires.columns]);
        }
        let mut pins = self.board.0.borrow_mut();
        pins.now_us = pins.now_us.wrapping_add(self.scan_us);
        let missing = frame.iter();
        ScanReport { failed_samples: missing.filter(|reading| reading.is_nan()).count() as u16 }
    }

    fn constants(&self) -> Option<Constants<'_>> {
        self.circuit.constants()
    }

    fn set_constants(&mut self, constants: Constants<'_>) -> Result<(), ConstantsFault> {
        self.circuit.set_constants(constants)
    }
}

/// Error of a slot without power; nothing more happens until [`MockSlot::power_on`].
struct PowerCut;

/// When the power is cut.
#[derive(Default)]
struct Power {
    /// Number of operations on words until the power is cut; `None` if it is not.
    left: Option<usize>,
    gone: bool,
}

/// A slot of NOR flash. It writes whole words, only where it is erased, and can lose its power in the middle of
/// any operation.
pub struct MockSlot {
    words: Vec<u32>,
    /// Power of both slots.
    power: Rc<RefCell<Power>>,
    pub erases: usize,
    pub writes: usize,
}

impl MockSlot {
    pub const BYTES: usize = 2048;

    pub fn pair() -> [Self; 2] {
        let power = Rc::new(RefCell::new(Power::default()));
        [0, 1].map(|_| Self {
            words: vec![u32::MAX; Self::BYTES / 4],
            power: power.clone(),
            erases: 0,
            writes: 0,
        })
    }

    /// A pair of slots with `blob` in the first, as if flashed together with the firmware.
    pub fn pair_with(blob: &[u8]) -> [Self; 2] {
        let mut slots = Self::pair();
        bytemuck::cast_slice_mut(&mut slots[0].words)[..blob.len()].copy_from_slice(blob);
        slots
    }

    pub fn cut_power_after(&self, operations: usize) {
        *self.power.borrow_mut() = Power { left: Some(operations), gone: false };
    }

    /// Switches the power on; returns whether it had been cut.
    pub fn power_on(&self) -> bool {
        std::mem::take(&mut *self.power.borrow_mut()).gone
    }

    /// Flips `bits` of word `place`, as an old cell does.
    pub fn decay(&mut self, place: usize, bits: u32) {
        self.words[place] ^= bits;
    }

    fn operate(&self) -> Result<(), PowerCut> {
        operate(&self.power)
    }
}

/// Carries out an operation on a word, unless the power is cut.
fn operate(power: &RefCell<Power>) -> Result<(), PowerCut> {
    let mut power = power.borrow_mut();
    match power.left {
        Some(0) => {
            power.gone = true;
            return Err(PowerCut);
        }
        Some(left) => power.left = Some(left - 1),
        None => {}
    }
    Ok(())
}

impl Slot for MockSlot {
    const ERASE_INTERVAL_S: u32 = 0;

    fn bytes(&self) -> &[u8] {
        bytemuck::cast_slice(&self.words)
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        self.erases += 1;
        for place in 0..self.words.len() {
            if self.operate().is_err() {
                // A word that is half erased has meaningless bits.
                self.words[place] ^= 0x5555_5555;
                return Err(FlashError);
            }
            self.words[place] = u32::MAX;
        }
        Ok(())
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        self.writes += 1;
        assert!(offset.is_multiple_of(4) && bytes.len().is_multiple_of(4), "whole words");
        for (place, word) in bytes.as_chunks::<4>().0.iter().enumerate() {
            let place = offset / 4 + place;
            assert_eq!(self.words[place], u32::MAX, "word {place} is not erased");
            let word = u32::from_le_bytes(*word);
            if self.operate().is_err() {
                self.words[place] = word | 0x0F0F_0F0F; // half written
                return Err(FlashError);
            }
            self.words[place] = word;
        }
        Ok(())
    }
}

/// A blob for this sensor, with `centres` centres and numbers that depend on `seed`.
pub fn blob(seed: usize, centres: usize) -> AlignedBytes {
    let number = |i: usize| ((i * 37 + seed * 11) % 101) as f32 / 50.0 - 1.0;
    let list = |from: usize, count: usize| (from..from + count).map(number).collect::<Vec<_>>();
    let (centre, weights) = (list(1, centres * COLS), list(2, centres * OUTPUTS));
    let (bias, affine) = (list(3, OUTPUTS), list(4, COLS * OUTPUTS));
    let network = direct::Network::try_new(
        Shape { inputs: COLS, centres, outputs: OUTPUTS },
        Parameters {
            input_minimum: &[50.0; COLS],
            input_per_span: &[0.05; COLS],
            centres: &centre,
            decay: &[1.5],
            output_weights: &weights,
            bias: &bias,
            affine: &affine,
        },
    )
    .unwrap();
    blob_of(network.into())
}

/// A blob with `network` for both rows.
pub fn blob_of(network: Network<'_>) -> AlignedBytes {
    blob_with(network, None, false)
}

/// The blob of [`blob`] with a confidence, for readings relative to the baseline if `relative_inputs`. Its one component
/// is of frames near 62 Ω, or near the baseline.
pub fn blob_with_confidence(relative_inputs: bool) -> AlignedBytes {
    let (readings, outputs) = (ROWS * COLS, ROWS * OUTPUTS);
    let [middle, scale] = if relative_inputs { [1.0, 20.0] } else { [62.0, 0.5] };
    let block = [
        vec![middle; readings],
        vec![scale; readings],
        vec![0.0],                            // start of the projection
        vec![0.408_248_3; readings],          // direction: the mean
        vec![-1.0, 0.0, 0.5, 1.0, 0.25, 0.5], // c, o and W
        vec![0.01, 0.0625, 4.0, 0.25],        // variances
        vec![2.0; outputs],                   // ratios
        vec![5.0],                            // threshold
    ]
    .concat();
    let sizes = Sizes { readings, directions: 1, components: 1, outputs };
    let confidence = Confidence::new(sizes, &block).unwrap();
    let blob = blob(3, 4);
    let model = Model::decode(&blob).unwrap();
    blob_with(model.networks().next().unwrap(), Some(confidence), relative_inputs)
}

fn blob_with(
    network: Network<'_>,
    confidence: Option<Confidence<'_>>,
    relative_inputs: bool,
) -> AlignedBytes {
    let shape = network.shape();
    let shape = ModelShape { rows: ROWS, inputs: shape.inputs, outputs: shape.outputs };
    let metadata = Metadata { relative_inputs, ..Metadata::unnamed(shape) };
    let parts = ModelParts {
        projection: None,
        expansion: None,
        confidence,
        fill: None,
        networks: &[network],
        row_network: &[0; ROWS],
        metadata,
    };
    encode_to_vec(&parts).unwrap()
}

/// A blob whose one network for both rows computes so many `components`, which are expanded to all outputs.
pub fn blob_of_components(components: usize) -> AlignedBytes {
    let (readings, outputs) = (ROWS * COLS, ROWS * OUTPUTS);
    let (weights, bias) = (vec![0.5; components], vec![0.25; components]);
    let network = Network::from(
        direct::Network::try_new(
            Shape { inputs: COLS, centres: 1, outputs: components },
            Parameters {
                input_minimum: &[50.0; COLS],
                input_per_span: &[0.05; COLS],
                centres: &[0.5; COLS],
                decay: &[1.5],
                output_weights: &weights,
                bias: &bias,
                affine: &[],
            },
        )
        .unwrap(),
    );
    // Every feature is the mean reading.
    let mut projection = vec![1.0 / readings as f32; (1 + readings) * COLS];
    projection[..COLS].fill(0.0);
    let expansion = vec![0.125; (1 + components) * outputs];
    let parts = ModelParts {
        projection: Projection::new(readings, COLS, &projection).ok(),
        expansion: Expansion::new(components, outputs, &expansion).ok(),
        confidence: None,
        fill: None,
        networks: &[network],
        row_network: &[0; ROWS],
        metadata: Metadata::unnamed(ModelShape { rows: ROWS, inputs: COLS, outputs: OUTPUTS }),
    };
    encode_to_vec(&parts).unwrap()
}

/// The CRC-32 that closes a blob.
pub fn crc_of(blob: &[u8]) -> u32 {
    u32::from_le_bytes(*blob.last_chunk().unwrap())
}

pub fn frame_at_rest() -> TestFrame {
    [[60.0, 61.0, 62.0], [63.0, 64.0, 65.0]]
}

/// A request for a configuration of the device's own.
pub fn configure(configuration: Configuration) -> Request<'static> {
    Request::Configure { configuration, lease_ms: 0 }
}

/// A configuration that scans only on request.
pub fn quiet() -> Configuration {
    Configuration { frame_period_us: 0, ..Configuration::DEFAULT }
}

/// Buffers that are never freed; a test needs only few.
pub fn buffers() -> &'static mut Buffers<ROWS, COLS, OUTPUTS, MESSAGE_BYTES> {
    Box::leak(Box::new(Buffers::new()))
}

/// An application's parts, and the host's ends of everything it is connected to.
pub struct Bench {
    pub app: TestApp,
    pub board: Board,
    pub frame: Rc<RefCell<TestFrame>>,
}

impl Bench {
    pub fn new(configuration: Configuration) -> Self {
        Self::with_settings(configuration, &SharedSettings::default())
    }

    /// A board on which these settings are kept.
    pub fn with_settings(configuration: Configuration, settings: &SharedSettings) -> Self {
        let board = Board(Rc::default(), settings.clone());
        let frame = Rc::new(RefCell::new(frame_at_rest()));
        let source = Source::new(&frame, &board, 10);
        Self { app: App::new(board.clone(), source, configuration, buffers()), board, frame }
    }
}

/// The bytes of one request.
pub fn request_bytes(number: u16, request: &Request<'_>) -> Vec<u8> {
    let mut buffer = [0; 1024];
    let packet = packet::encode(number, request, &mut buffer).unwrap();
    let mut bytes = Vec::new();
    assert!(cobs::encode(packet, |byte| {
        bytes.push(byte);
        true
    }));
    bytes
}

/// Reports that the host finds in a device's bytes: the number and debug text of each. Checks that each is whole.
pub fn reports(bytes: &[u8]) -> Vec<(u16, String)> {
    let mut receiver = Receiver::new([0; 1024]);
    let mut reports = Vec::new();
    for byte in bytes {
        match receiver.push(*byte) {
            Some(Received::Frame(bytes)) => {
                let packet = packet::decode::<Report<'_>>(bytes).expect("a whole report");
                reports.push((packet.number, format!("{:?}", packet.body)));
            }
            Some(other) => panic!("the device sent {other:?}"),
            None => {}
        }
    }
    reports
}

/// Runs turns of the loop until the device has read all bytes sent to it, or the session ends.
pub fn settle(session: &mut TestSession<'_>, board: &Board) -> Option<Leave> {
    while !board.0.borrow().to_device.is_empty() {
        if let Some(leave) = session.step() {
            return Some(leave);
        }
    }
    None
}

/// Sends `request` and passes the answer to `read`.
pub fn ask<T>(
    session: &mut TestSession<'_>,
    board: &Board,
    request: &Request<'_>,
    read: impl FnOnce(Report<'_>) -> T,
) -> (T, Option<Leave>) {
    board.0.borrow_mut().to_host.clear();
    board.0.borrow_mut().to_device.extend(request_bytes(77, request));
    let leave = settle(session, board);
    let answer = std::mem::take(&mut board.0.borrow_mut().to_host);
    let mut receiver = Receiver::new([0; 1024]);
    for byte in &answer {
        if let Some(Received::Frame(bytes)) = receiver.push(*byte) {
            let packet = packet::decode::<Report<'_>>(bytes).expect("a whole report");
            if packet.number == 77 {
                return (read(packet.body), leave);
            }
        }
    }
    panic!("no answer to {request:?} in {:?}", reports(&answer));
}

/// The CRC-32 of the model in force.
pub fn model_crc(session: &mut TestSession<'_>, board: &Board) -> Option<u32> {
    let read = |report: Report<'_>| match report {
        Report::Identity(identity) => identity.model.map(|model| model.crc_32),
        other => panic!("{other:?}"),
    };
    ask(session, board, &Request::Identify, read).0
}

/// The first step of an upload of `blob`.
pub fn begin(blob: &[u8]) -> UploadStep<'_> {
    UploadStep::Begin { head: &blob[..Model::HEAD_BYTES] }
}

/// The steps of an upload of `blob` in chunks of `chunk` bytes.
pub fn upload_steps(blob: &[u8], chunk: usize) -> Vec<UploadStep<'_>> {
    let mut steps = vec![begin(blob)];
    steps.extend(
        blob.chunks(chunk)
            .enumerate()
            .map(|(i, bytes)| UploadStep::Chunk { offset: (i * chunk) as u32, bytes }),
    );
    steps.push(UploadStep::Commit);
    steps
}
