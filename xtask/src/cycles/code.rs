//! An image's code, by address.

use std::collections::HashMap;
use std::fs;
use std::ops::Range;
use std::path::Path;

use object::{Object, ObjectSegment, ObjectSymbol, SymbolKind};

use super::thumb::{self, Instruction};
use crate::process::Outcome;

/// The bytes that an image loads, and the addresses of its symbols.
pub struct Code {
    segments: Vec<(u32, Vec<u8>)>,
    symbols: HashMap<String, Symbol>,
}

/// Address and length of a symbol's code or data.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Symbol {
    address: u32,
    /// Length in bytes; 0 if the image does not say.
    length: u32,
    is_function: bool,
}

impl Code {
    /// Reads the code of the ELF file at `elf`.
    pub fn read(elf: &Path) -> Outcome<Self> {
        let failed = |cause: String| format!("{}: {cause}", elf.display());
        let bytes = fs::read(elf).map_err(|cause| failed(cause.to_string()))?;
        let file = object::File::parse(&*bytes).map_err(|cause| failed(cause.to_string()))?;
        let mut segments = Vec::new();
        for segment in file.segments() {
            let data = segment.data().map_err(|cause| failed(cause.to_string()))?;
            segments.push((segment.address() as u32, data.to_owned()));
        }
        // The lowest bit of a function's address only marks Thumb code.
        let of_file = |symbol: object::Symbol<'_, '_>| Symbol {
            address: symbol.address() as u32 & !1,
            length: symbol.size() as u32,
            is_function: symbol.kind() == SymbolKind::Text,
        };
        let symbols = file
            .symbols()
            .filter_map(|symbol| Some((symbol.name().ok()?.to_owned(), of_file(symbol))))
            .collect();
        Ok(Self { segments, symbols })
    }

    /// Code that starts at `address`, without symbols.
    #[cfg(test)]
    pub fn of(address: u32, halfwords: &[u16]) -> Self {
        let bytes = halfwords.iter().flat_map(|halfword| halfword.to_le_bytes()).collect();
        let segments = vec![(address, bytes)];
        Self { segments, symbols: HashMap::new() }
    }

    /// Adds a symbol.
    #[cfg(test)]
    pub fn with_symbol(mut self, name: &str, address: u32, length: u32) -> Self {
        self.symbols.insert(name.to_owned(), Symbol { address, length, is_function: true });
        self
    }

    /// The address of `symbol`.
    pub fn symbol(&self, symbol: &str) -> Outcome<u32> {
        let found = self.symbols.get(symbol).map(|symbol| symbol.address);
        found.ok_or_else(|| format!("the image has no symbol {symbol}"))
    }

    /// Names of functions, with the addresses of their code.
    pub fn functions(&self) -> impl Iterator<Item = (&str, Range<u32>)> {
        let range = |symbol: &Symbol| symbol.address..symbol.address.saturating_add(symbol.length);
        let functions = self.symbols.iter().filter(|(_, symbol)| symbol.is_function);
        functions.map(move |(name, symbol)| (name.as_str(), range(symbol)))
    }

    /// The instruction at `address`.
    pub fn instruction(&self, address: u32) -> Outcome<Instruction> {
        let first = self
            .halfword(address)
            .ok_or_else(|| format!("no code was loaded to {address:#010x}, which was executed"))?;
        let second = self.halfword(address.wrapping_add(2));
        thumb::decode(first, second).ok_or_else(|| {
            let bytes = match second.filter(|_| thumb::is_wide(first)) {
                Some(second) => format!("{first:04x} {second:04x}"),
                None => format!("{first:04x}"),
            };
            format!(
                "the instruction {bytes} at {address:#010x} is not known; teach it to \
                 xtask/src/cycles/thumb.rs, and docs/cycles.md what it costs"
            )
        })
    }

    /// Whether the instruction at `address` returns from a function: `bx lr`, or `pop` with the program counter.
    pub fn returns(&self, address: u32) -> bool {
        let second = self.halfword(address.wrapping_add(2)).unwrap_or(0);
        match self.halfword(address) {
            Some(0x4770 | 0xBD00..=0xBDFF) => true,
            Some(0xE8BD) => second & 0x8000 != 0,
            _ => false,
        }
    }

    fn halfword(&self, address: u32) -> Option<u16> {
        self.segments.iter().find_map(|(start, bytes)| {
            let at = address.checked_sub(*start)? as usize;
            let bytes = bytes.get(at..at.checked_add(2)?)?;
            Some(u16::from_le_bytes([bytes[0], bytes[1]]))
        })
    }
}
