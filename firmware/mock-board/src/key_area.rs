//! Flash for the device's key.

use std::any::Any;

use firmware::seal::Key;
use firmware::store::{DeviceKey, FlashError, Slot};

/// Flash that holds a key, or none. A clone is another chip with the same content.
pub struct KeyArea(Box<dyn Chip>);

/// Any flash.
trait Chip: Any {
    fn bytes(&self) -> &[u8];
    fn erase(&mut self) -> Result<(), FlashError>;
    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError>;
    fn copy(&self) -> Box<dyn Chip>;
}

impl<S: Slot + Clone + 'static> Chip for S {
    fn bytes(&self) -> &[u8] {
        Slot::bytes(self)
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        Slot::erase(self)
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        Slot::write(self, offset, bytes)
    }

    fn copy(&self) -> Box<dyn Chip> {
        Box::new(self.clone())
    }
}

/// Flash without faults.
#[derive(Clone)]
struct Sound(Vec<u8>);

impl KeyArea {
    /// Length in bytes.
    pub const BYTES: usize = 256;

    /// Flash as it comes from the factory.
    pub fn erased() -> Self {
        Self::of(Sound(vec![0xFF; Self::BYTES]))
    }

    /// This flash.
    pub fn of(flash: impl Slot + Clone + 'static) -> Self {
        Self(Box::new(flash))
    }

    /// The flash that [`KeyArea::of`] was given, if it was of this type.
    pub fn flash<S: 'static>(&self) -> Option<&S> {
        (&*self.0 as &dyn Any).downcast_ref()
    }

    /// Flash in which this key is set.
    ///
    /// # Panics
    /// Never: there is room.
    pub fn with(key: &Key) -> Self {
        let mut area = Self::erased();
        DeviceKey::set(&mut area, key).expect("there is room");
        area
    }

    /// Flips `bits` of the byte at `place`, as an old cell does. The flash has no other faults from then on.
    ///
    /// # Panics
    /// `place` is outside the area.
    pub fn decay(&mut self, place: usize, bits: u8) {
        let mut bytes = self.0.bytes().to_vec();
        bytes[place] ^= bits;
        *self = Self::of(Sound(bytes));
    }
}

impl Clone for KeyArea {
    fn clone(&self) -> Self {
        Self(self.0.copy())
    }
}

impl Slot for KeyArea {
    fn bytes(&self) -> &[u8] {
        self.0.bytes()
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        self.0.erase()
    }

    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        self.0.write(offset, bytes)
    }
}

impl Slot for Sound {
    fn bytes(&self) -> &[u8] {
        &self.0
    }

    fn erase(&mut self) -> Result<(), FlashError> {
        self.0.fill(0xFF);
        Ok(())
    }

    /// # Panics
    /// A byte is neither erased nor to be zero, or outside the area.
    fn write(&mut self, offset: usize, bytes: &[u8]) -> Result<(), FlashError> {
        let place = &mut self.0[offset..offset + bytes.len()];
        assert!(
            place.iter().zip(bytes).all(|(there, new)| *there == 0xFF || *new == 0),
            "not erased"
        );
        place.copy_from_slice(bytes);
        Ok(())
    }
}
