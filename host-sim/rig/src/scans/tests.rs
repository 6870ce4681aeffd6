use std::io::Write;
use std::net::{TcpListener, TcpStream};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;

use taxel_core::blob::Floats;
use taxel_firmware::link::message::{EstimateReport, EventReport, Report};
use taxel_firmware::readout::Diagnosis;

use super::*;
use crate::Error;

/// Two ends of a line.
fn line() -> (TcpStream, TcpStream) {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let far = TcpStream::connect(listener.local_addr().unwrap()).unwrap();
    (far, listener.accept().unwrap().0)
}

/// Numbers and readings of `count` scans that `source` hears.
fn heard(source: &mut dyn Source, count: usize) -> (Vec<u32>, Vec<Vec<f32>>) {
    let (mut scans, end) = (vec![], Instant::now() + Duration::from_secs(20));
    while scans.len() < count && Instant::now() < end {
        source.hear(Instant::now(), &mut |scan| scans.push((scan.number, scan.readings))).unwrap();
    }
    scans.into_iter().unzip()
}

#[test]
fn lines_of_numbers_are_scans_and_all_other_lines_are_skipped() {
    let (mut far, near) = line();
    let mut source = NumberLines::new(near, 0).unwrap();
    // The first line may be cut, whatever it looks like.
    far.write_all(b"3,4\nr1c1,r1c2,r1c3\n1,2,3\r\n\xff,1,2\n4;5;6\n 7 8  9 \n1,2\n\n10,,nan\n,,\n")
        .unwrap();
    far.write_all(b"11\t12\t").unwrap();
    // Two successive lines of as many numbers tell the count.
    let (_, scans) = heard(&mut source, 3);
    assert_eq!(scans[..2], [[4.0, 5.0, 6.0], [7.0, 8.0, 9.0]]);
    assert!(scans[2][0] == 10.0 && scans[2][1].is_nan() && scans[2][2].is_nan());
    far.write_all(b"13\n14,15\n16,17,18\nx,y\n").unwrap();
    let (numbers, _) = heard(&mut source, 2);
    // The cut line between both counts as lost.
    assert_eq!(numbers[1], numbers[0] + 2);
    while source.refused() < 4 {
        source.hear(Instant::now(), &mut |_| panic!("no scan")).unwrap();
    }
    drop(far);
    let ended = source.hear(Instant::now() + Duration::from_secs(9), &mut |_| {});
    assert!(matches!(ended, Err(Error::Closed)), "{ended:?}");
}

#[test]
fn frames_are_found_between_marks_when_readings_look_like_marks() {
    let (mut far, near) = line();
    let mut source = MarkedBytes::new(near, 4).unwrap();
    let frames: [[u8; 4]; 3] = [[0xAA, 0x55, 1, 2], [0xAA, 0xAA, 0x55, 0x55], [7, 8, 9, 0xAA]];
    // Bytes of a frame that began before anybody listened come first, and one byte is lost later on.
    let mut bytes = vec![0x55, 3, 0xAA, 0x55];
    for frame in frames.iter().chain(&frames) {
        bytes.extend([&[0xAA, 0x55], &frame[..]].concat());
    }
    bytes.remove(4 + 12 + 3);
    bytes.extend([0xAA, 0x55]);
    far.write_all(&bytes).unwrap();
    let floats = |frame: [u8; 4]| frame.map(f32::from).to_vec();
    let expected: Vec<Vec<f32>> = [0, 1, 0, 1, 2].map(|at| floats(frames[at])).to_vec();
    assert_eq!(heard(&mut source, 5), (vec![0, 1, 3, 4, 5], expected));
}

#[test]
fn a_question_that_comes_as_the_line_fails_is_answered() {
    let (sender, receiver) = mpsc::channel();
    let open = |_: &_| Ok((Box::new(Numbers(receiver, vec![])) as Box<dyn Source>, ()));
    let (listener, _opened) = Listener::start(2, open).unwrap();
    let asker = thread::spawn(move || while listener.set_baseline(vec![]).is_ok() {});
    thread::sleep(Duration::from_millis(20));
    drop(sender);
    let end = Instant::now() + Duration::from_secs(20);
    while !asker.is_finished() {
        assert!(Instant::now() < end, "it waits for good");
        thread::sleep(Duration::from_millis(1));
    }
}

/// A source that sends the numbers that it is given, and ends with the sender.
struct Numbers(mpsc::Receiver<u32>, Vec<Vec<f32>>);

impl Source for Numbers {
    fn hear(&mut self, deadline: Instant, take: &mut dyn FnMut(Scan)) -> Result<()> {
        match self.0.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
            Ok(number) => {
                let readings = self.1.last().cloned().unwrap_or_default();
                take(Scan {
                    number,
                    start_us: 0,
                    heard: Instant::now(),
                    readings,
                    estimate: None,
                    events: vec![],
                });
                Ok(())
            }
            Err(mpsc::RecvTimeoutError::Timeout) => Ok(()),
            Err(mpsc::RecvTimeoutError::Disconnected) => Err(Error::Closed),
        }
    }

    fn set_baseline(&mut self, readings: &[f32]) -> Result<()> {
        self.1.push(readings.to_vec());
        Ok(())
    }
}

#[test]
fn a_listener_keeps_the_newest_scans_and_counts_lost_ones() {
    const WAIT: Duration = Duration::from_secs(20);
    let (sender, receiver) = mpsc::channel();
    let open = |_: &_| Ok((Box::new(Numbers(receiver, vec![])) as Box<dyn Source>, "opened"));
    let (listener, opened) = Listener::start(2, open).unwrap();
    assert_eq!(opened.recv().unwrap().unwrap(), "opened");
    listener.set_baseline(vec![60.0]).unwrap();
    // One never came; then the sender starts anew.
    [7, 9, 10, 0, 1].into_iter().for_each(|number| sender.send(number).unwrap());
    let end = Instant::now() + WAIT;
    while listener.lost() < 1 + 3 && Instant::now() < end {
        thread::sleep(Duration::from_millis(1));
    }
    let first = listener.next(WAIT).unwrap().unwrap();
    assert_eq!((first.number, first.readings), (0, vec![60.0]));
    assert_eq!(listener.lost(), 1 + 3);
    sender.send(2).unwrap();
    assert_eq!(listener.next(WAIT).unwrap().unwrap().number, 1);
    assert_eq!(listener.next(WAIT).unwrap().unwrap().number, 2);
    assert_eq!(listener.newest(WAIT).unwrap().unwrap().number, 2);
    assert!(listener.newest(Duration::ZERO).unwrap().is_none());
    assert!(listener.next(Duration::from_millis(1)).unwrap().is_none());
    drop(sender);
    let ended = listener.next(WAIT).unwrap_err();
    assert_eq!(ended.to_string(), Error::Closed.to_string());
    assert!(listener.set_baseline(vec![]).is_err());
}

#[test]
fn a_source_that_cannot_be_opened_ends_its_listener() {
    let refuse = |_: &_| Err::<(Box<dyn Source>, ()), _>(Error::failed("no such port"));
    let (listener, opened) = Listener::start(1, refuse).unwrap();
    assert_eq!(opened.recv().unwrap().unwrap_err().to_string(), "no such port");
    assert!(listener.next(Duration::from_secs(9)).is_err());
}

#[test]
fn readings_of_another_scan_do_not_stand_beside_an_estimate() {
    let mut assembler = Assembler::new(Sent { readings: true, estimates: true });
    let readings_ohm = Floats::new(&[60.0, 61.0]);
    let readings = Report::Readings { frame: 1, start_us: 0, readings_ohm };
    assert!(assembler.take(&readings).unwrap().is_none());
    let estimate = EstimateReport {
        frame: 2,
        start_us: 10,
        flags: 0,
        row_status: &[0],
        outputs: Floats::new(&[0.5]),
        novelty: None,
        deviation: Floats::new(&[]),
    };
    let scan = assembler.take(&Report::Estimate(estimate)).unwrap().unwrap();
    assert!(scan.number == 2 && scan.readings.is_empty(), "{scan:?}");
    // Events go with the next scan, whichever they are of.
    let event =
        EventReport { frame: 3, start_us: 20, after_us: 1234, changed: 0b101, going_on: 0b001 };
    assert!(assembler.take(&Report::Event(event)).unwrap().is_none());
    let scan = assembler.take(&Report::Estimate(estimate)).unwrap().unwrap();
    assert_eq!(scan.events, ["touch begins, slip ends (frame 3, 1.2 ms after its start)"]);
    assert!(assembler.take(&Report::Estimate(estimate)).unwrap().unwrap().events.is_empty());
    // A device that gave up a scan says which part of its readout was the first to stall.
    let diagnosis = Diagnosis { items_left: [0, 0, 5, 1], ..Diagnosis::default() };
    let given_up = assembler.take(&Report::Diagnosis(diagnosis)).unwrap_err().to_string();
    assert!(given_up.contains("stalls: numbers;"), "{given_up}");
}
