//! Which models the device's key lets come into force.

use crate::link::message::{KeyState, Refusal, SealFault};
use crate::log::{info, warning};
use crate::seal::{Key, Seal, is_same};
use crate::store::{DeviceKey, SEAL_BYTES, Slot, blob_in_slot, capacity, generation, seal_in_slot};

/// The device's key, and the seals that it has found good.
pub struct Authenticity {
    key: DeviceKey,
    /// Good seals in the slots when the session began.
    seals: [Option<Seal>; 2],
    /// Highest version that was ever confirmed, as far as the slots tell.
    highest: Option<u32>,
}

impl Authenticity {
    /// Reads the key in this `area` of flash, and makes it last.
    pub fn new<S: Slot>(area: &mut S) -> Self {
        let key = DeviceKey::find(area.bytes());
        match key.settle(area) {
            Ok(false) => {}
            Ok(true) => info!("key: a damaged or unfinished copy was found and made good"),
            Err(_) => warning!("key: not two sound copies, no place or the flash failed"),
        }
        Self { key, seals: [None; 2], highest: None }
    }

    /// Looks at the seals in both slots.
    pub fn read_seals<S: Slot>(&mut self, slots: &[S; 2]) {
        let DeviceKey::Set(key) = &self.key else { return };
        for ((index, slot), seal) in slots.iter().enumerate().zip(&mut self.seals) {
            let bytes = slot.bytes();
            *seal = seal_in_slot(bytes).filter(|seal| seal.fits(key, blob_in_slot(bytes)));
            if generation(index, bytes).is_some() {
                self.highest = self.highest.max(seal.map(|seal| seal.version));
            }
        }
    }

    /// Whether the model in `slot` may come into force.
    pub fn allows(&self, slot: usize) -> bool {
        match self.key {
            DeviceKey::None => true,
            DeviceKey::Set(_) => self.seal_of(slot).is_some(),
            DeviceKey::Damaged => false,
        }
    }

    /// Good seal in `slot`.
    pub fn seal_of(&self, slot: usize) -> Option<Seal> {
        self.seals.get(slot).copied().flatten()
    }

    /// Largest blob for `slot`, in bytes.
    pub fn capacity(&self, slot: &[u8]) -> usize {
        let seal = if matches!(self.key, DeviceKey::None) { 0 } else { SEAL_BYTES };
        capacity(slot).saturating_sub(seal)
    }

    /// Whether there is a key.
    pub fn key_state(&self) -> KeyState {
        match self.key {
            DeviceKey::None => KeyState::None,
            DeviceKey::Set(_) => KeyState::Set,
            DeviceKey::Damaged => KeyState::Damaged,
        }
    }

    /// Highest version that was confirmed.
    pub fn highest(&self) -> Option<u32> {
        self.highest
    }

    /// Checks whether `blob` may come into force with this `seal`. The same seal again is no step back.
    pub fn check(&self, blob: &[u8], seal: Option<Seal>) -> Result<(), Refusal> {
        let fault = match (&self.key, seal) {
            (DeviceKey::None, None) => return Ok(()),
            (DeviceKey::None, Some(_)) => SealFault::NoKey,
            (DeviceKey::Damaged, _) => SealFault::KeyDamaged,
            (DeviceKey::Set(_), None) => SealFault::Missing,
            (DeviceKey::Set(key), Some(seal)) if !seal.fits(key, blob) => SealFault::Forged,
            (DeviceKey::Set(_), Some(seal)) => return self.check_version(seal),
        };
        Err(Refusal::Seal(fault))
    }

    /// Checks that a good `seal` leads to no older model.
    fn check_version(&self, seal: Seal) -> Result<(), Refusal> {
        match self.highest {
            Some(highest) if seal.version < highest || self.is_another_of(seal, highest) => {
                Err(Refusal::Seal(SealFault::Outdated { highest }))
            }
            _ => Ok(()),
        }
    }

    /// Whether `seal` has the version `highest`, and is not one that stands in a slot.
    fn is_another_of(&self, seal: Seal, highest: u32) -> bool {
        seal.version == highest && !self.seals.contains(&Some(seal))
    }

    /// Checks that going back to the model in `slot` is no step to a lower version.
    pub fn check_undo(&self, slot: usize) -> Result<(), Refusal> {
        match (&self.key, self.seal_of(slot)) {
            (DeviceKey::None, _) => Ok(()),
            (DeviceKey::Damaged, _) => Err(Refusal::Seal(SealFault::KeyDamaged)),
            (DeviceKey::Set(_), None) => Err(Refusal::Seal(SealFault::Missing)),
            (DeviceKey::Set(_), Some(seal)) => self.check_version(seal),
        }
    }

    /// Sets the key for good. The same key again makes copies good that have decayed.
    pub fn provision<S: Slot>(&mut self, area: &mut S, key: &Key) -> Result<(), Refusal> {
        match &self.key {
            DeviceKey::None => {
                // The key may be set although the flash failed: in its second copy.
                let _ = DeviceKey::set(area, key);
            }
            DeviceKey::Set(old) if is_same(old, key) => {
                let _ = self.key.settle(area);
                return Ok(());
            }
            DeviceKey::Set(_) => return Err(Refusal::Seal(SealFault::KeyIsSet)),
            DeviceKey::Damaged => {
                if DeviceKey::mend(area, key) == Ok(false) {
                    return Err(Refusal::Seal(SealFault::KeyDamaged));
                }
            }
        }
        self.key = DeviceKey::find(area.bytes());
        if matches!(self.key, DeviceKey::Set(_)) { Ok(()) } else { Err(Refusal::Flash) }
    }
}
