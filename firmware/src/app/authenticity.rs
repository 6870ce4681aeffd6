//! The device's key: what a host may change, and what it must seal for that.

use crate::link::message::{KeyState, Refusal, Request, SealFault};
use crate::platform::Platform;

#[cfg(feature = "seal")]
mod keyed {
    use super::{KeyState, Platform, Refusal, Request, SealFault};
    use crate::log::info;
    use crate::seal::{Key, is_same, tag};
    use crate::store::{Journal, KeyFound, Kind, Slot};

    /// Largest distance from one counter to the next: nobody who has the key for a while can use up all of them.
    const MOST_AHEAD: u64 = 1_000_000;

    /// Number of requests between two writes of the counter to flash.
    const RESERVED: u64 = 1000;

    /// The device's key, and the counter of sealed requests.
    pub struct Authenticity {
        state: KeyState,
        key: Key,
        /// Largest counter so far, or beyond.
        last: u64,
        /// Number from which on counters are written down before they count.
        reserved: u64,
    }

    impl Authenticity {
        /// Reads key and counter in a `journal`. No request that counted before the start counts again.
        pub fn new<S: Slot>(journal: &Journal<S>) -> Self {
            let (state, key) = match journal.key() {
                KeyFound::None => (KeyState::None, Key::default()),
                KeyFound::Set(key) => (KeyState::Set, *key),
                KeyFound::Damaged => (KeyState::Damaged, Key::default()),
            };
            let counter = journal.read(Kind::Counter).and_then(|bytes| bytes.first_chunk());
            let last = counter.copied().map_or(0, u64::from_le_bytes);
            Self { state, key, last, reserved: last }
        }

        /// Whether there is a key.
        pub fn key_state(&self) -> KeyState {
            self.state
        }

        /// Largest counter so far, or beyond.
        pub fn counter(&self) -> u64 {
            self.last
        }

        /// Checks whether a host may ask for this: it returns the bytes of a request in a seal, which it may.
        pub fn open<'r, P: Platform>(
            &mut self,
            request: &Request<'r>,
            platform: &mut P,
        ) -> Result<Option<&'r [u8]>, Refusal> {
            let fault = match (self.state, request) {
                (KeyState::None, Request::Sealed { .. }) => SealFault::NoKey,
                (KeyState::Set, Request::Sealed { counter, tag: found, request }) => {
                    let right = tag(&self.key, &platform.unique_id(), *counter, request);
                    if is_same(&right, found) {
                        self.count(*counter, platform)?;
                        return Ok(Some(request));
                    }
                    SealFault::Forged
                }
                _ if request.is_free() => return Ok(None),
                (KeyState::None, Request::Provision { .. }) if !platform.may_provision() => {
                    SealFault::NotAllowed
                }
                (KeyState::None, _) => return Ok(None),
                // The answer was lost.
                (KeyState::Set, Request::Provision { key }) if is_same(key, &self.key) => {
                    return Ok(None);
                }
                (KeyState::Set, _) => SealFault::Missing,
                (KeyState::Damaged, _) => SealFault::KeyDamaged,
            };
            Err(Refusal::Seal(fault))
        }

        /// Takes note of a `counter`: neither it nor a lower one counts again, not even after a restart.
        fn count<P: Platform>(&mut self, counter: u64, platform: &mut P) -> Result<(), Refusal> {
            let ahead = counter.checked_sub(self.last).filter(|ahead| *ahead > 0);
            if ahead.is_none_or(|ahead| ahead > MOST_AHEAD) {
                return Err(Refusal::Seal(SealFault::Counter { last: self.last }));
            }
            if counter > self.reserved {
                let reserved = counter.saturating_add(RESERVED);
                platform.feed_watchdog(); // it may erase flash
                let kept = platform.journal().keep(Kind::Counter, &[&reserved.to_le_bytes()]);
                kept.map_err(|_| Refusal::Flash)?;
                self.reserved = reserved;
            }
            self.last = counter;
            Ok(())
        }

        /// Sets the key.
        pub fn provision<P: Platform>(
            &mut self,
            key: &Key,
            platform: &mut P,
        ) -> Result<(), Refusal> {
            platform.feed_watchdog(); // it erases flash
            let kept = platform.journal().keep(Kind::Key, &[key]);
            *self =
                Self { last: self.last, reserved: self.reserved, ..Self::new(platform.journal()) };
            kept.map_err(|_| Refusal::Flash)?;
            info!("the device has a key from now on");
            Ok(())
        }
    }
}

#[cfg(not(feature = "seal"))]
mod keyless {
    use super::{KeyState, Platform, Refusal, Request, SealFault};
    use crate::store::{Journal, Slot};

    const UNSUPPORTED: Refusal = Refusal::Seal(SealFault::Unsupported);

    /// No key: any host may change anything.
    pub struct Authenticity;

    #[expect(clippy::unused_self, reason = "as with a key")]
    impl Authenticity {
        pub fn new<S: Slot>(_: &Journal<S>) -> Self {
            Self
        }

        pub fn key_state(&self) -> KeyState {
            KeyState::None
        }

        pub fn counter(&self) -> u64 {
            0
        }

        pub fn open<'r, P: Platform>(
            &mut self,
            request: &Request<'r>,
            _: &mut P,
        ) -> Result<Option<&'r [u8]>, Refusal> {
            let is_known = !matches!(request, Request::Sealed { .. } | Request::Provision { .. });
            if is_known { Ok(None) } else { Err(UNSUPPORTED) }
        }

        pub fn provision<P: Platform>(&mut self, _: &[u8; 32], _: &mut P) -> Result<(), Refusal> {
            Err(UNSUPPORTED)
        }
    }
}

#[cfg(feature = "seal")]
pub use keyed::Authenticity;
#[cfg(not(feature = "seal"))]
pub use keyless::Authenticity;
