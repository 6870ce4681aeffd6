//! Cuts while a device is given its key.

use firmware::link::message::{KeyState, Refusal, SealFault};
use firmware::seal::{KEY_BYTES, Key};

use super::{Cuts, first_cut};
use crate::device::Device;
use crate::flash::{Flash, Supply, Torn};
use crate::models::blob;

/// Starts after a cut, at each of which weak bits settle anew.
const STARTS: usize = 6;

const KEY: Key = [0x42; KEY_BYTES];
const OTHER: Key = [0xC7; KEY_BYTES];

/// Cuts the power at one word while a key is set, and at each word of the start and of the next key behind it. No key or
/// that one must be set, the same at each start.
///
/// # Errors
/// What is wrong, and where.
pub fn cut_key(seed: u64) -> Result<Cuts, String> {
    let mut case = Case::new(seed);
    let quarter = case.run()?;
    Ok(Cuts { count: case.cuts, quarter })
}

/// A device without a key, with a model that has no seal.
struct Case {
    seed: u64,
    device: Device,
    cuts: u64,
}

impl Case {
    fn new(seed: u64) -> Self {
        let supply = Supply::new(seed);
        let mut flash = Flash::erased(Flash::KEY_BYTES / 4, &supply, Torn::new(seed));
        flash.swings = true;
        if (seed / Torn::COUNT as u64).is_multiple_of(3) {
            // An older program's code, which must be erased.
            let mut word = seed as u32;
            let code = (0..Flash::KEY_BYTES / 4).map(|_| {
                word = word.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                word
            });
            flash.flash(0, bytemuck::cast_slice(&code.collect::<Vec<u32>>()));
        }
        let mut device = Device::new(Flash::slots_with(&blob(1, 3)));
        (device.key, device.supply) = (flash, supply);
        Self { seed, device, cuts: 0 }
    }

    /// Makes all cuts; returns the quarter of the work that the first one is in.
    fn run(&mut self) -> Result<usize, String> {
        let before = self.device.key.clone();
        let whole = self.device.provision(KEY);
        let operations = self.device.supply.borrow().operations;
        if whole.is_err() || self.expect(&[Some(KEY)], "without a cut")? != Some(KEY) {
            return Err(format!("without a cut: {whole:?}"));
        }
        let (first, quarter) = first_cut(self.seed, operations);
        self.device.key = before;
        let _ = self.device.cut(first).provision(KEY);
        self.cuts += 1;
        let place = format!("operation {first} of {operations}");
        let after = self.device.key.clone();
        for operation in 0.. {
            self.device.key = after.clone();
            self.device.cut(operation).session(|_, _| ());
            if !self.device.is_cut() {
                break;
            }
            self.cuts += 1;
            let place = format!("{place}, then operation {operation} of the start");
            let found = self.expect(&[None, Some(KEY)], &place)?;
            self.mend(found, &place)?;
        }
        self.device.key = after;
        let found = self.expect(&[None, Some(KEY)], &place)?;
        let after = self.device.key.clone();
        for second in 0.. {
            self.device.key = after.clone();
            let next = self.next(found);
            let _ = self.device.cut(second).provision(next);
            if !self.device.is_cut() {
                break;
            }
            self.cuts += 1;
            let place = format!("{place}, then operation {second}");
            let found = self.expect(&[found, Some(next)], &place)?;
            self.mend(found, &place)?;
        }
        Ok(quarter)
    }

    /// The key that the next host sets: the one that was found; without one, half the hosts set another.
    fn next(&self, found: Option<Key>) -> Key {
        found.unwrap_or(if self.seed.is_multiple_of(2) { OTHER } else { KEY })
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
            KeyState::Set => Some(if self.device.provision(KEY).is_ok() { KEY } else { OTHER }),
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
        let (model, state, _) = self.device.identity();
        if model.is_some() == (state == KeyState::None) {
            Ok(state)
        } else {
            Err(format!("{place}: key {state:?}, model {model:?}"))
        }
    }

    /// The next host's key comes into force for good, and no other.
    fn mend(&mut self, found: Option<Key>, place: &str) -> Result<(), String> {
        let next = self.next(found);
        let outcome = self.device.provision(next);
        if outcome.is_err() {
            return Err(format!("{place}: the next host's key is {outcome:?}"));
        }
        self.expect(&[Some(next)], &format!("{place}, mended"))?;
        let third = self.device.provision([1; KEY_BYTES]);
        let is_set = Err(Refusal::Seal(SealFault::KeyIsSet));
        if third == is_set { Ok(()) } else { Err(format!("{place}: a third key is {third:?}")) }
    }
}
