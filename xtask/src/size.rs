//! Flash and RAM of the images, compared with a budget.

mod budget;

use std::fs;
use std::path::Path;

use budget::Budget;
use object::{Object, ObjectSection, ObjectSymbol};

use crate::images::{NUCLEO, QEMU, build_image};
use crate::process::{Outcome, root};
use crate::toolchain::{Toolchain, elf};

const BUDGET: &str = "firmware/budget.txt";

/// Bytes of flash and RAM that an image takes as linked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Size {
    vector_table: u64,
    text: u64,
    rodata: u64,
    data: u64,
    bss: u64,
    uninit: u64,
    /// Size of the stack's region, whether it is used or not.
    stack: u64,
    /// Bytes of the constants that are networks of fixed size, as `taxel export` names them.
    weights: u64,
}

impl Size {
    /// Reads the sections of an image.
    pub fn new(elf: &Path) -> Outcome<Self> {
        let failed = |cause: String| format!("{}: {cause}", elf.display());
        let bytes = fs::read(elf).map_err(|cause| failed(cause.to_string()))?;
        let file = object::File::parse(&*bytes).map_err(|cause| failed(cause.to_string()))?;
        let section = |name| file.section_by_name(name).map_or(0, |section| section.size());
        let address = |name| {
            let symbol = file.symbols().find(|symbol| symbol.name() == Ok(name));
            symbol
                .map(|symbol| symbol.address())
                .ok_or(failed(format!("there is no symbol {name}")))
        };
        let weights = file.symbols().filter(|symbol| symbol.name().is_ok_and(is_weights));
        Ok(Self {
            weights: weights.map(|symbol| symbol.size()).sum(),
            vector_table: section(".vector_table"),
            text: section(".text"),
            rodata: section(".rodata"),
            data: section(".data"),
            bss: section(".bss"),
            uninit: section(".uninit"),
            stack: address("_stack_start")?.saturating_sub(address("_stack_end")?),
        })
    }

    /// Vector table, text, rodata and data, as a device tells them of its program.
    pub fn of_flash(&self) -> [u64; 4] {
        [self.vector_table, self.text, self.rodata, self.data]
    }

    /// Flash without the weights of networks of fixed size.
    fn flash(&self) -> u64 {
        self.vector_table + self.text + self.rodata + self.data - self.weights
    }

    fn ram(&self) -> u64 {
        self.data + self.bss + self.uninit
    }
}

/// Builds the images, prints their sections beside the budget, and fails if one exceeds it.
pub fn run() -> Outcome {
    let path = root().join(BUDGET);
    let text = fs::read_to_string(&path).map_err(|cause| format!("{BUDGET}: {cause}"))?;
    let budget = budget::parse(&text).map_err(|cause| format!("{BUDGET}: {cause}"))?;
    let toolchain = Toolchain::find()?;
    build_image(&toolchain, QEMU)?;
    build_image(&toolchain, NUCLEO)?;

    println!(
        "{:21} {:>6} {:>6} {:>6} {:>5} {:>6} {:>6} {:>7} | {:>6} of {:>6} {:>6} | {:>5} of {:>5} {:>6} | {:>5}",
        "image",
        "vector",
        "text",
        "rodata",
        "data",
        "bss",
        "uninit",
        "weights",
        "flash",
        "budget",
        "left",
        "RAM",
        "bud.",
        "left",
        "stack"
    );
    let mut exceeded = Vec::new();
    for image in &budget {
        let size = Size::new(&elf(image.name))?;
        print_line(image, &size);
        exceeded.extend(image.exceeded_by(size.flash(), size.ram()));
    }
    if exceeded.is_empty() { Ok(()) } else { Err(format!("{BUDGET}: {}", exceeded.join("; "))) }
}

fn print_line(image: &Budget<'_>, size: &Size) {
    let left = |budget: u64, taken: u64| i128::from(budget) - i128::from(taken);
    println!(
        "{:21} {:6} {:6} {:6} {:5} {:6} {:6} {:7} | {:6} of {:6} {:6} | {:5} of {:5} {:6} | {:5}",
        image.name,
        size.vector_table,
        size.text,
        size.rodata,
        size.data,
        size.bss,
        size.uninit,
        size.weights,
        size.flash(),
        image.flash,
        left(image.flash, size.flash()),
        size.ram(),
        image.ram,
        left(image.ram, size.ram()),
        size.stack,
    );
}

/// Whether a mangled name is that of a network in the module `row4`, as `taxel export` writes it.
fn is_weights(name: &str) -> bool {
    name.contains("4row49NETWORK_")
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: Size = Size {
        vector_table: 1,
        text: 20,
        rodata: 300,
        data: 4000,
        bss: 50000,
        uninit: 600_000,
        stack: 7,
        weights: 100,
    };

    #[test]
    fn variables_with_a_value_take_flash_and_ram() {
        assert_eq!((SIZE.flash(), SIZE.ram()), (4221, 654_000));
    }

    #[test]
    fn weights_are_the_networks_of_the_exported_module_alone() {
        let names = ["_ZN7minimal4row49NETWORK_017h5d2cE", "_RNvNtCs1_7minimal4row49NETWORK_0"];
        assert!(names.into_iter().all(is_weights));
        assert!(!is_weights("_ZN4link7message6REPORT11ROW_AT_REST17h0E"));
    }

    #[test]
    fn what_is_no_image_is_refused_by_name() {
        let error = Size::new(Path::new(file!())).unwrap_err();
        assert!(error.contains("size.rs: "), "{error}");
    }
}
