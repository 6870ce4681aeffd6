//! Flash for the device's key.

use firmware::seal::Key;
use firmware::store::{DeviceKey, FlashError, Slot};

/// Flash that holds a key, or none. A clone is another chip with the same content.
#[derive(Clone)]
pub struct KeyArea(Vec<u8>);

impl KeyArea {
    /// Length in bytes.
    pub const BYTES: usize = 256;

    /// Flash as it comes from the factory.
    #[must_use]
    pub fn erased() -> Self {
        Self(vec![0xFF; Self::BYTES])
    }

    /// Flash in which this key is set.
    ///
    /// # Panics
    /// Never: there is room.
    #[must_use]
    pub fn with(key: &Key) -> Self {
        let mut area = Self::erased();
        DeviceKey::set(&mut area, key).expect("there is room");
        area
    }

    /// Flips `bits` of the byte at `place`, as an old cell does.
    ///
    /// # Panics
    /// `place` is outside the area.
    pub fn decay(&mut self, place: usize, bits: u8) {
        self.0[place] ^= bits;
    }
}

impl Slot for KeyArea {
    fn bytes(&self) -> &[u8] {
        &self.0
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        self.0.fill(0xFF);
        Ok(())
    }

    /// # Panics
    /// A byte is not erased, or outside the area.
    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        let place = &mut self.0[offset..offset + bytes.len()];
        assert!(place.iter().all(|byte| *byte == 0xFF), "not erased");
        place.copy_from_slice(bytes);
        Ok(())
    }
}
