//! Virtual board at the other end of a line, and a device that scans it; both in this process.

use std::cell::Cell;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::sync::Arc;
use std::thread;
use std::time::Instant;

use firmware::circuit::ZeroPotential;
use firmware::platform::Port;
use firmware::readout::{
    FrameSource, Mcp3208s, ScanReport, ScanSettings, Scanner, Selection, ShiftRegister595,
};
use model_core::RowWire;
use remote_readout::Remote;
use taxel_data::progress::Silent;
use taxel_data::random::Stream;
use taxel_learn::train::train;
use taxel_learn::{ModelBlob, Options, Origin, pack};
use taxel_rig::device::{Device, scan};
use taxel_simulate::World;
use taxel_simulate::readout::Readout;
use taxel_simulate::synthesise;
use taxel_simulate::virtual_board::{SeriesResistance, VirtualBoard};

/// All wires of the virtual board.
const WIRES: Selection<'static> = Selection { rows: &ROWS, columns: 18 };
const ROWS: [RowWire; 8] = [
    RowWire(0),
    RowWire(1),
    RowWire(2),
    RowWire(3),
    RowWire(4),
    RowWire(5),
    RowWire(6),
    RowWire(7),
];

static CIRCUIT: ZeroPotential<8, 18> = ZeroPotential::TYPICAL;
/// Series resistances for which the device corrects.
const SERIES: SeriesResistance = SeriesResistance { row_source_ohm: 0.26, column_ohm: 0.0 };

/// World `press` on a board with every fault, of the image's parts.
fn world() -> World {
    let mut world = World::press();
    world.readout = Readout {
        cross_talk: Some(true),
        row_switch_ohm: Some(0.26),
        line_ohm: Some(0.1),
        op_amp_offset_v: Some(5e-4),
        adc_noise_counts: Some(0.5),
        time_constant_us: Some(5.0),
        oversampling: Some(2),
        ..Readout::default()
    };
    scan::with_parts_of_image(&world).unwrap()
}

fn ohm(frame: u32) -> Vec<f64> {
    (0..144).map(|i| 45.0 + f64::from((i * 37 + 11 * frame) % 144) * 0.16).collect()
}

fn line() -> [TcpStream; 2] {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).unwrap();
    let near = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    let (far, _) = listener.accept().unwrap();
    for end in [&near, &far] {
        end.set_nodelay(true).unwrap();
    }
    [near, far]
}

/// The device's end of a line, which reads without blocking.
#[derive(Clone)]
struct Socket {
    stream: Arc<TcpStream>,
    start: Instant,
}

impl Socket {
    fn new(stream: TcpStream) -> Self {
        stream.set_nonblocking(true).unwrap();
        Self { stream: Arc::new(stream), start: Instant::now() }
    }
}

impl Read for Socket {
    fn read(&mut self, bytes: &mut [u8]) -> std::io::Result<usize> {
        (&*self.stream).read(bytes)
    }
}

impl Write for Socket {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        loop {
            match (&*self.stream).write(bytes) {
                Err(cause) if cause.kind() == std::io::ErrorKind::WouldBlock => thread::yield_now(),
                other => return other,
            }
        }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        (&*self.stream).flush()
    }
}

impl Port for Socket {
    /// Slow clock, so that nothing stalls however busy the computer is.
    fn now_us(&mut self) -> u32 {
        (self.start.elapsed().as_micros() / 10) as u32
    }

    fn receive(&mut self) -> Option<u8> {
        let mut byte = [0];
        let received = self.read(&mut byte).is_ok_and(|count| count == 1);
        if !received {
            thread::yield_now();
        }
        received.then_some(byte[0])
    }

    fn send(&mut self, byte: u8) -> bool {
        self.write(&[byte]).is_ok_and(|count| count == 1)
    }
}

/// The image's readout at the other end of a line.
#[derive(Clone)]
struct RemoteReadout(Socket);

impl FrameSource for RemoteReadout {
    fn scan(
        &mut self,
        settings: ScanSettings,
        wires: Selection<'_>,
        frame: &mut [f32],
    ) -> ScanReport {
        let remote = Remote::new(self.0.clone());
        let [data, clock, latch] = [12, 13, 14].map(|pin| remote.pin(pin));
        let drive = ShiftRegister595::<_, 8> { data, clock, latch };
        let sampler = Mcp3208s { chips: [0, 1, 2].map(|chip| remote.spi(chip)) };
        let mut scanner = Scanner::<_, _, _, _, 18>::new(drive, sampler, remote.delay(), &CIRCUIT);
        scanner.scan(settings, wires, frame)
    }
}

/// Readout over a line with one bit wrong in every second scan.
#[derive(Clone)]
struct Spoilt(RemoteReadout, u32);

impl FrameSource for Spoilt {
    fn scan(
        &mut self,
        settings: ScanSettings,
        wires: Selection<'_>,
        frame: &mut [f32],
    ) -> ScanReport {
        let report = self.0.scan(settings, wires, frame);
        let reading = &mut frame[143];
        *reading = f32::from_bits(reading.to_bits() ^ self.1);
        self.1 ^= 1;
        report
    }
}

fn bits(frame: &[f32]) -> Vec<u32> {
    frame.iter().map(|ohm| ohm.to_bits()).collect()
}

/// Scans so many frames over a line. Returns their bits and reports, and the outcome of serving them.
fn scan_served(
    world: &World,
    frames: u32,
) -> (Vec<(Vec<u32>, ScanReport)>, taxel_simulate::Result<()>) {
    let [near, far] = line();
    thread::scope(|scope| {
        let served = scope.spawn(move || {
            let board = VirtualBoard::new(world).unwrap();
            let shown = Cell::new(0);
            let show_next = || {
                board.set_readings(&ohm(shown.get()));
                shown.set(shown.get() + 1);
            };
            show_next();
            let outcome = board.serve(far, show_next);
            assert_eq!(shown.get(), frames + 1, "one more after every scan");
            outcome
        });
        let settings = VirtualBoard::new(world).unwrap().scan_settings();
        let mut readout = RemoteReadout(Socket::new(near));
        let mut frame = [f32::NAN; 144];
        let scans = (0..frames).map(|_| {
            let report = readout.scan(settings, WIRES, &mut frame);
            (bits(&frame), report)
        });
        let scans = scans.collect();
        readout.0.stream.shutdown(Shutdown::Both).unwrap();
        (scans, served.join().unwrap())
    })
}

/// Scans so many frames with the board's own handles.
fn scan_directly(world: &World, frames: u32) -> Vec<(Vec<u32>, ScanReport)> {
    let board = VirtualBoard::new(world).unwrap();
    let mut scanner = board.scanner(SERIES);
    let mut frame = [f32::NAN; 144];
    let scans = (0..frames).map(|number| {
        board.set_readings(&ohm(number));
        let report = scanner.scan(board.scan_settings(), WIRES, &mut frame);
        (bits(&frame), report)
    });
    scans.collect()
}

#[test]
fn a_board_over_a_line_is_the_board_itself() {
    let world = world();
    let (scans, outcome) = scan_served(&world, 5);
    outcome.unwrap();
    assert_eq!(scans, scan_directly(&world, 5));
    assert!(scans.iter().all(|(_, report)| report.failed_samples == 0));
    assert_ne!(scans[0].0, scans[1].0);
}

#[test]
fn what_the_parts_refuse_is_told_when_the_line_closes() {
    let mut hasty = world();
    hasty.readout.settling_us = Some(20);
    let (scans, outcome) = scan_served(&hasty, 2);
    assert_eq!(scans, scan_directly(&hasty, 2));
    assert!(scans[1].1.failed_samples > 0);
    let refused = outcome.unwrap_err();
    assert!(refused.to_string().contains("settling takes 46 µs"), "{refused}");
}

#[test]
fn what_is_not_there_ends_serving_at_once() {
    let board = VirtualBoard::new(&world()).unwrap();
    for (bytes, says) in
        [(&[0x80 | 14 << 1, 0x55][..], "request 0x55"), (&[0x80 | 40 << 1], "pin 40")]
    {
        let [mut near, far] = line();
        near.write_all(bytes).unwrap();
        let refused = board.serve(far, || ()).unwrap_err();
        assert!(refused.to_string().contains(says), "{refused}");
    }
    board.check().unwrap();
    // A chip gives back as many bytes as it is sent, whatever they ask.
    let [mut near, far] = line();
    near.write_all(&[0x01, 7, 2, 0xAA, 0xAA]).unwrap();
    near.shutdown(Shutdown::Write).unwrap();
    assert!(board.serve(far, || ()).is_err());
    let mut answer = Vec::new();
    near.read_to_end(&mut answer).unwrap();
    assert_eq!(answer, [0xFF, 0xFF]);
}

fn model(world: &World) -> ModelBlob {
    let frames = synthesise(world, Stream::Training, 300);
    let trained = train(&frames, &Options { centres: 8, ..Options::default() }, &Silent).unwrap();
    pack(&trained, &frames, &Origin::of_data("test", 0, 1, &frames)).unwrap()
}

/// Checks a device in a thread of this process, whose `source` scans `world` on a served board.
fn check<F: FrameSource + Clone + Send + 'static>(
    world: &World,
    scans: usize,
    source: impl FnOnce(RemoteReadout) -> F,
) -> taxel_rig::Result<scan::ScanFindings> {
    let model = model(world);
    let ([near, far], [readout, board_end]) = (line(), line());
    let sound = crate::virtual_device::Line { one_in: None };
    let source = source(RemoteReadout(Socket::new(readout)));
    crate::virtual_device::run_with(Socket::new(far), sound, model.bytes(), source);
    let mut device = Device::new(near).unwrap();
    let findings = scan::check(&mut device, world, &model, None, board_end, scans, &Silent);
    // Scanning is over, and the device answers without any repetition.
    device.identify().unwrap();
    assert_eq!((device.repeated, device.damaged), (0, 0));
    findings
}

#[test]
fn a_device_that_scans_is_held_to_the_host() {
    let findings = check(&world(), 20, |readout| readout).unwrap();
    assert!(findings.all_good(), "{findings:?}");
    assert_eq!(findings.bit_identical_readings, 20);
    let less = scan::ScanFindings { bit_identical_estimates: 19, ..findings.clone() };
    assert!(!less.all_good());
    assert!(!scan::ScanFindings { failed_samples: 1, ..findings }.all_good());

    let spoilt = check(&world(), 6, |readout| Spoilt(readout, 1)).unwrap();
    assert!(!spoilt.all_good());
    assert_eq!(spoilt.bit_identical_readings, 3);
    assert!(spoilt.bit_identical_estimates >= 3);
}
