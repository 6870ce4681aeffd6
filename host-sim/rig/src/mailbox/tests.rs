//! Both ends of the mailbox against each other, in memory where the host's end copies each byte at a
//! moment of its own.

use std::cell::RefCell;
use std::rc::Rc;

use super::*;
use taxel_data::{Purpose, Random, Stream};

#[path = "../../../../firmware/qemu/src/mailbox.rs"]
#[allow(dead_code, unreachable_pub, reason = "the image's file, of which tests use a part")]
mod image;

use image::SharedMemory;

/// Size of the memory that a mailbox takes, in bytes.
const BYTES: usize = 0x9000;

/// Memory that both ends share.
#[derive(Debug, Clone)]
struct Memory(Rc<RefCell<Vec<u8>>>);

impl Memory {
    fn empty() -> Self {
        Self(Rc::new(RefCell::new(vec![0; BYTES])))
    }
}

impl SharedMemory for Memory {
    fn byte(&self, place: usize) -> u8 {
        self.0.borrow()[place]
    }

    fn set_byte(&mut self, place: usize, byte: u8) {
        self.0.borrow_mut()[place] = byte;
    }

    fn number(&self, place: usize) -> u16 {
        u16::from_le_bytes([self.byte(place), self.byte(place + 1)])
    }

    fn set_number(&mut self, place: usize, number: u16) {
        let [lower, upper] = number.to_le_bytes();
        self.set_byte(place, lower);
        self.set_byte(place + 1, upper);
    }

    fn barrier(&self) {}
}

impl SharedBytes for Memory {
    fn read_at(&mut self, bytes: &mut [u8], place: u64) -> io::Result<()> {
        bytes.iter_mut().zip(place as usize..).for_each(|(byte, place)| *byte = self.byte(place));
        Ok(())
    }

    fn write_at(&mut self, bytes: &[u8], place: u64) -> io::Result<()> {
        bytes.iter().zip(place as usize..).for_each(|(byte, place)| self.set_byte(place, *byte));
        Ok(())
    }
}

/// Value of the `n`th byte sent: never 0, and different from one round before.
fn byte(n: usize) -> u8 {
    1 + (n % 251) as u8
}

/// The image's end, which sends and receives, and checks what it receives.
struct Image {
    mailbox: image::Mailbox<Memory>,
    random: Random,
    sent: usize,
    received: usize,
}

impl Image {
    /// Receives and sends nothing, a few bytes, or more than the lower byte of a position counts.
    fn step(&mut self) {
        let most = [0, 0, 0, 0, 0, 0, 1, 3, 400][self.random.below(9)];
        let [receives, sends] = [0; 2].map(|_| self.random.below(most + 1));
        for found in (0..receives).map_while(|_| self.mailbox.try_read()) {
            assert_eq!(found, byte(self.received), "byte {} for the image", self.received);
            self.received += 1;
        }
        for _ in 0..sends {
            self.sent += usize::from(self.mailbox.try_write(byte(self.sent)));
        }
    }
}

/// Memory whose bytes are copied one by one, in any order, while the image goes on.
struct Torn {
    memory: Memory,
    image: Image,
    random: Random,
}

impl Torn {
    /// Places of so many bytes in the order in which they are copied: it begins anywhere.
    fn order(&mut self, count: usize) -> Vec<usize> {
        let mut order: Vec<usize> = (0..count).collect();
        order.rotate_left(self.random.below(count));
        order
    }
}

impl SharedBytes for Torn {
    fn read_at(&mut self, bytes: &mut [u8], place: u64) -> io::Result<()> {
        for index in self.order(bytes.len()) {
            self.image.step();
            bytes[index] = self.memory.byte(place as usize + index);
        }
        Ok(())
    }

    fn write_at(&mut self, bytes: &[u8], place: u64) -> io::Result<()> {
        for index in self.order(bytes.len()) {
            self.image.step();
            self.memory.set_byte(place as usize + index, bytes[index]);
        }
        Ok(())
    }
}

#[test]
fn every_byte_arrives_once_in_order_when_accesses_are_torn() {
    for seed in 0..2_u64 {
        let draws = |index: u64| Random::new(1, Stream::Test, Purpose::Damage, 3 * seed + index, 0);
        let memory = Memory::empty();
        memory.clone().write_at(&MAGIC, 0).unwrap();
        let mailbox = image::Mailbox::find(memory.clone()).unwrap();
        let image = Image { mailbox, random: draws(0), sent: 0, received: 0 };
        let mut host = Mailbox::new(Torn { memory, image, random: draws(1) }).unwrap();
        let (mut random, mut sent, mut received) = (draws(2), 0, 0);
        // Positions go round twice, in either direction.
        let mut turns = 0;
        while sent < 140_000 || received < 140_000 {
            turns += 1;
            assert!(turns < 10_000, "{sent} bytes sent, {received} received");
            let bytes: Vec<u8> = (sent..sent + random.below(1500)).map(byte).collect();
            sent += host.try_write(&bytes).unwrap();
            assert!(sent - host.shared.image.received <= usize::from(CAPACITY));

            let mut bytes = vec![0; random.below(1500)];
            let count = host.try_read(&mut bytes).unwrap();
            let expected: Vec<u8> = (received..received + count).map(byte).collect();
            assert_eq!(bytes[..count], expected, "bytes from {received} on for the host");
            received += count;
            assert!(received <= host.shared.image.sent);
        }
        // Bytes that are still on their way arrive too.
        (0..10_000).for_each(|_| host.shared.image.step());
        assert_eq!(host.shared.image.received, sent);
    }
}

/// Mailbox whose image does nothing by itself.
fn still() -> (Mailbox<Memory>, image::Mailbox<Memory>) {
    let memory = Memory::empty();
    let host = Mailbox::new(memory.clone()).unwrap();
    (host, image::Mailbox::find(memory).unwrap())
}

#[test]
fn a_restart_of_the_image_loses_no_byte() {
    let (mut host, mut image) = still();
    assert_eq!(host.try_write(b"before").unwrap(), 6);
    assert_eq!((image.try_read(), image.try_write(b'x')), (Some(b'b'), true));
    let mut restarted = image::Mailbox::find(host.shared.clone()).unwrap();
    assert!(restarted.try_write(b'y'));
    let rest: Vec<u8> = std::iter::from_fn(|| restarted.try_read()).collect();
    let mut bytes = [0; 9];
    assert_eq!((rest.as_slice(), host.try_read(&mut bytes).unwrap()), (&b"efore"[..], 2));
    assert_eq!(&bytes[..2], b"xy");
}

#[test]
fn reading_and_writing_end_with_the_time_for_them() {
    let (mut host, mut image) = still();
    host.set_read_timeout(Duration::from_millis(20)).unwrap();
    let start = Instant::now();
    let cause = host.read(&mut [0; 4]).unwrap_err();
    assert_eq!(cause.kind(), ErrorKind::TimedOut);
    assert!(start.elapsed() >= Duration::from_millis(20));
    assert_eq!(host.write(&vec![7; 1 << 16]).unwrap(), usize::from(CAPACITY));
    assert_eq!(host.write(&[7]).unwrap_err().kind(), ErrorKind::TimedOut);
    // Bytes that are there are read at once, without a request and without waiting.
    assert!(image.try_write(9));
    let (start, mut bytes) = (Instant::now(), [0; 4]);
    host.set_read_timeout(Duration::from_mins(1)).unwrap();
    assert_eq!((host.read(&mut bytes).unwrap(), bytes[0]), (1, 9));
    assert_eq!((host.read(&mut []).unwrap(), host.write(&[]).unwrap()), (0, 0));
    assert!(start.elapsed() < Duration::from_secs(30));
}

#[test]
fn positions_that_do_not_fit_together_are_an_error() {
    let (mut host, _image) = still();
    host.set_position(TO_HOST.written, CAPACITY + 1).unwrap();
    host.set_position(TO_IMAGE.read, 1).unwrap();
    assert_eq!(host.read(&mut [0]).unwrap_err().kind(), ErrorKind::InvalidData);
    assert_eq!(host.write(&[0]).unwrap_err().kind(), ErrorKind::InvalidData);
}

#[test]
fn the_file_holds_what_the_machine_maps() {
    let name = format!("taxel-mailbox-test-{}", std::process::id());
    let path = std::env::temp_dir().join(name);
    let mut host = Mailbox::create(&path).unwrap();
    assert!(Mailbox::create(&path).is_err(), "another program's file is kept");
    assert_eq!(host.write(b"request").unwrap(), 7);
    let bytes = std::fs::read(&path).unwrap();
    std::fs::remove_file(&path).unwrap();
    assert_eq!(bytes.len() as u64, FILE_BYTES);
    let mut mailbox = image::Mailbox::find(Memory(Rc::new(RefCell::new(bytes)))).unwrap();
    let received: Vec<u8> = std::iter::from_fn(|| mailbox.try_read()).collect();
    assert_eq!(received, b"request");
}
