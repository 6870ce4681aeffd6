//! Cuts while a device is given its key.

use std::cell::RefCell;
use std::rc::Rc;

use firmware::app::Session;
use firmware::link::message::{KeyState, Refusal, Report, Request, SealFault};
use firmware::platform::Platform;
use firmware::seal::{KEY_BYTES, Key};
use mock_board::{
    Bench, Board, KeyArea, Memory, MockSlot, ROWS, Source, ask, blob, model_crc, quiet,
};

use super::flash::{Flash, Supply, Torn};
use crate::effort::Effort;
use crate::found::Found;
use crate::promise::Promise;
use crate::tally::Tally;
use crate::tools::Tools;

pub const PROVISION: Promise = Promise {
    name: "cut-provision",
    text: "power cut while a key is set: none or that one",
    share: 2,
    check,
};

/// Least and most cases; a case is one first cut, and all second cuts behind it.
const LEAST: u64 = 600;
const MOST: u64 = 1 << 40;

/// Starts after a cut, at each of which weak bits settle anew.
const STARTS: usize = 6;

/// Words of the key's flash: ten places.
const WORDS: usize = 120;

const KEY: Key = [0x42; KEY_BYTES];
const OTHER: Key = [0xC7; KEY_BYTES];

fn check(effort: &Effort, _: &Tools) -> Result<Found, String> {
    let cuts = Tally::new(Torn::ALL.map(Torn::name));
    let mut found = effort
        .worst((LEAST, MOST), (0.0, "losses"), |seed| Case::new(seed).run(&cuts).map(|()| 0.0));
    found.cases = cuts.sum();
    if found.note.is_empty() {
        found.note = cuts.text();
    }
    Ok(found)
}

/// A session of such a device.
type Running<'a, 'm> = Session<'a, 'm, Board, Source, MockSlot, ROWS>;

/// What a host is told when it sets a key.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    Set,
    Cut,
    Refused(Refusal),
}

/// A device without a key, with a model that has no seal.
struct Case {
    seed: u64,
    supply: Rc<RefCell<Supply>>,
    flash: Flash,
    slots: [MockSlot; 2],
    memory: Box<Memory>,
}

impl Case {
    fn new(seed: u64) -> Self {
        let supply = Supply::new(seed);
        let mut flash = Flash::erased(WORDS, &supply, Torn::of(seed));
        flash.swings = true;
        if (seed / Torn::COUNT as u64).is_multiple_of(3) {
            // An older program's code, which must be erased.
            let mut word = seed as u32;
            let code = (0..WORDS).map(|_| {
                word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                word
            });
            flash.flash(bytemuck::cast_slice(&code.collect::<Vec<u32>>()));
        }
        let slots = MockSlot::pair_with(&blob(1, 3));
        Self { seed, supply, flash, slots, memory: Box::new(Memory::new()) }
    }

    fn run(mut self, cuts: &Tally<{ Torn::COUNT }>) -> Result<(), String> {
        let kind = Torn::of(self.seed) as usize;
        let before = self.flash.clone();
        let whole = self.provision(KEY, None);
        let operations = self.supply.borrow().operations;
        if whole != Outcome::Set || self.expect(&[Some(KEY)], "without a cut")? != Some(KEY) {
            return Err(format!("without a cut: {whole:?}"));
        }
        let first = self.seed / (3 * Torn::COUNT as u64) % operations;
        self.flash = before;
        self.provision(KEY, Some(first));
        cuts.add(kind, 1);
        let place = format!("operation {first} of {operations}");
        let after = self.flash.clone();
        for operation in 0.. {
            self.flash = after.clone();
            self.session(Some(operation), |_, _| ());
            if !self.supply.borrow().gone {
                break;
            }
            cuts.add(kind, 1);
            let place = format!("{place}, then operation {operation} of the start");
            let found = self.expect(&[None, Some(KEY)], &place)?;
            self.mend(found, &place)?;
        }
        self.flash = after;
        let found = self.expect(&[None, Some(KEY)], &place)?;
        let after = self.flash.clone();
        for second in 0.. {
            self.flash = after.clone();
            let next = self.next(found);
            if self.provision(next, Some(second)) != Outcome::Cut {
                break;
            }
            cuts.add(kind, 1);
            let place = format!("{place}, then operation {second}");
            let found = self.expect(&[found, Some(next)], &place)?;
            self.mend(found, &place)?;
        }
        Ok(())
    }

    /// The key that the next host sets: the one that was found; without one, half the hosts set another.
    fn next(&self, found: Option<Key>) -> Key {
        found.unwrap_or(if self.seed.is_multiple_of(2) { OTHER } else { KEY })
    }

    /// Starts the device, and does `work`. The power is cut in the operation after `cut_after`, if given.
    fn session<T>(
        &mut self,
        cut_after: Option<u64>,
        work: impl FnOnce(&mut Running<'_, '_>, &Board) -> T,
    ) -> T {
        self.flash.settle();
        self.supply.borrow_mut().on(cut_after);
        let area = KeyArea::of(self.flash.clone());
        let mut bench = Bench::within_with_key(&mut self.memory, quiet(), &area);
        let board = bench.board.clone();
        let mut session = Session::start(&mut bench.app, &mut self.slots, &mut []);
        let done = work(&mut session, &board);
        let area = bench.app.platform().key_area();
        self.flash = area.flash::<Flash>().expect("the same flash").clone();
        done
    }

    /// Sets `key`, as far as the power lasts.
    fn provision(&mut self, key: Key, cut_after: Option<u64>) -> Outcome {
        let outcome = self.session(cut_after, |session, board| {
            ask(session, board, &Request::Provision { key }, |report| match report {
                Report::Provisioned => Outcome::Set,
                Report::Refused(refusal) => Outcome::Refused(refusal),
                other => panic!("{other:?}"),
            })
            .0
        });
        if self.supply.borrow().gone { Outcome::Cut } else { outcome }
    }

    /// Checks that one of the `allowed` keys is set, and the same at each start; returns it.
    fn expect(&mut self, allowed: &[Option<Key>], place: &str) -> Result<Option<Key>, String> {
        let first = self.restart(place)?;
        for _ in 1..STARTS {
            let found = self.restart(place)?;
            if found != first {
                return Err(format!("{place}: {first:?} at one start, then {found:?}"));
            }
        }
        let key = match first {
            KeyState::None => None,
            // A host's key is refused unless it is the one that is set.
            KeyState::Set => {
                Some(if self.provision(KEY, None) == Outcome::Set { KEY } else { OTHER })
            }
            KeyState::Damaged => return Err(format!("{place}: the key is damaged")),
        };
        if allowed.contains(&key) {
            Ok(key)
        } else {
            Err(format!("{place}: the key is {key:02x?}"))
        }
    }

    /// Whether a key is set after a restart. With one, the model without a seal must not be in force.
    fn restart(&mut self, place: &str) -> Result<KeyState, String> {
        let (state, model) = self.session(None, |session, board| {
            let state = ask(session, board, &Request::Identify, |report| match report {
                Report::Identity(identity) => identity.key,
                other => panic!("{other:?}"),
            });
            (state.0, model_crc(session, board))
        });
        if model.is_some() == (state == KeyState::None) {
            Ok(state)
        } else {
            Err(format!("{place}: key {state:?}, model {model:08x?}"))
        }
    }

    /// The next host's key comes into force for good, and no other.
    fn mend(&mut self, found: Option<Key>, place: &str) -> Result<(), String> {
        let next = self.next(found);
        let outcome = self.provision(next, None);
        if outcome != Outcome::Set {
            return Err(format!("{place}: the next host's key is {outcome:?}"));
        }
        self.expect(&[Some(next)], &format!("{place}, mended"))?;
        let third = self.provision([1; KEY_BYTES], None);
        let is_set = Outcome::Refused(Refusal::Seal(SealFault::KeyIsSet));
        if third == is_set { Ok(()) } else { Err(format!("{place}: a third key is {third:?}")) }
    }
}
