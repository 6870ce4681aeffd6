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

/// The image's end, which sends and receives at random.
struct Image {
    mailbox: image::Mailbox<Memory>,
    random: Random,
    sent: usize,
    received: usize,
}

impl Image {
    /// Sends or receives nothing, a few bytes, or more than the lower byte of a position counts.
    fn step(&mut self) {
        let most = [0, 0, 0, 0, 0, 0, 1, 3, 400][self.random.below(9)];
        for _ in 0..self.random.below(most + 1) {
            self.receive();
        }
        for _ in 0..self.random.below(most + 1) {
            self.send();
        }
    }

    fn receive(&mut self) -> bool {
        let received = self.mailbox.try_read();
        if let Some(found) = received {
            assert_eq!(found, byte(self.received), "byte {} for the image", self.received);
            self.received += 1;
        }
        received.is_some()
    }

    fn send(&mut self) -> bool {
        let is_sent = self.mailbox.try_write(byte(self.sent));
        self.sent += usize::from(is_sent);
        is_sent
    }
}

/// Memory whose bytes are copied one by one, in any order, while the image goes on.
struct Torn {
    memory: Memory,
    image: Option<Rc<RefCell<Image>>>,
    random: Random,
}

impl Torn {
    /// Offsets of `count` bytes from `place` on, each once, after the image went on.
    fn moments(
        &mut self,
        count: usize,
        place: u64,
        mut copy: impl FnMut(&mut Memory, usize, usize),
    ) {
        let mut order: Vec<usize> = (0..count).collect();
        // A long copy is cut where it starts: shuffling short ones is what matters.
        if count <= 8 {
            (1..count).for_each(|last| order.swap(last, self.random.below(last + 1)));
        } else {
            order.rotate_left(self.random.below(count));
        }
        for index in order {
            if let Some(image) = &self.image {
                image.borrow_mut().step();
            }
            copy(&mut self.memory, index, place as usize + index);
        }
    }
}

impl SharedBytes for Torn {
    fn read_at(&mut self, bytes: &mut [u8], place: u64) -> io::Result<()> {
        let count = bytes.len();
        self.moments(count, place, |memory, index, place| bytes[index] = memory.byte(place));
        Ok(())
    }

    fn write_at(&mut self, bytes: &[u8], place: u64) -> io::Result<()> {
        let copy = |memory: &mut Memory, index: usize, place| memory.set_byte(place, bytes[index]);
        self.moments(bytes.len(), place, copy);
        Ok(())
    }
}

fn random(index: u64) -> Random {
    Random::new(1, Stream::Test, Purpose::Damage, index, 0)
}

/// Mailbox whose image goes on whenever the host's end copies a byte.
fn torn(seed: u64) -> (Mailbox<Torn>, Rc<RefCell<Image>>) {
    let memory = Memory::empty();
    let torn = Torn { memory: memory.clone(), image: None, random: random(2 * seed) };
    let mut host = Mailbox::new(torn).unwrap();
    let mailbox = image::Mailbox::find(memory).unwrap();
    let random = random(2 * seed + 1);
    let image = Rc::new(RefCell::new(Image { mailbox, random, sent: 0, received: 0 }));
    host.shared.image = Some(image.clone());
    (host, image)
}

#[test]
fn every_byte_arrives_once_and_in_order_however_accesses_are_torn() {
    for seed in 0..4 {
        let (mut host, image) = torn(seed);
        let (mut random, mut sent, mut received) = (random(100 + seed), 0, 0);
        // Positions go round three times, in either direction.
        let mut turns = 0;
        while sent < 200_000 || received < 200_000 {
            turns += 1;
            assert!(turns < 10_000, "{sent} bytes sent, {received} received");
            let bytes: Vec<u8> = (sent..sent + random.below(1500)).map(byte).collect();
            sent += host.try_write(&bytes).unwrap();
            assert!(sent - image.borrow().received <= usize::from(CAPACITY));

            let mut bytes = vec![0; random.below(1500)];
            let count = host.try_read(&mut bytes).unwrap();
            let expected: Vec<u8> = (received..received + count).map(byte).collect();
            assert_eq!(bytes[..count], expected, "bytes from {received} on for the host");
            received += count;
            assert!(received <= image.borrow().sent);
        }
        // Bytes that are still on their way arrive too.
        while image.borrow_mut().receive() {}
        assert_eq!(image.borrow().received, sent);
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
