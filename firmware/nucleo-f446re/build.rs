//! Hands the linker its scripts.

fn main() {
    board_common::link_scripts::hand_over();
}
