//! What the journal holds when the device starts: any bytes in its pages, or any bytes that are kept as a setting. The device must start, take nothing that is out of range, and answer.

use mock_board::{Bench, Board, Flash, Memory, ask, blob, crc_of, model_crc, quiet};
use taxel_firmware::app::Session;
use taxel_firmware::link::message::{Report, Request, Setting};
use taxel_firmware::store::{Journal, PAGE_BYTES};

/// Turns of the loop that the application takes on such settings.
const TURNS: usize = 20;

/// The first byte says where the others go: over the pages, from a place on, or into one setting each.
pub fn check(bytes: &[u8]) -> bool {
    let Some((kind, bytes)) = bytes.split_first() else { return false };
    let journal = match kind % 3 {
        0 => raw(bytes),
        kind => kept(bytes, kind == 2),
    };
    let model = blob(1, 3);
    let mut slots = Flash::slots_with(&model);
    let mut memory = Memory::new();
    let mut bench = Bench::on(Board::new(journal), &mut memory, quiet());
    let board = bench.board.clone();
    let mut session = Session::start(&mut bench.app, &mut slots, &mut []);
    for _ in 0..TURNS {
        assert!(session.step().is_none(), "the session ended by itself");
    }
    assert_eq!(model_crc(&mut session, &board), Some(crc_of(&model)), "another model in force");
    let configuration = ask(&mut session, &board, &Request::Configuration, |report| match report {
        Report::Configuration(configuration) => configuration,
        other => panic!("{other:?}"),
    });
    // What it works with, it must take from a host as well.
    let again = Request::Configure(configuration.0);
    let taken = ask(&mut session, &board, &again, |report| !matches!(report, Report::Refused(_)));
    assert!(taken.0, "a configuration that it would refuse: {:?}", configuration.0);
    configuration.0 != quiet()
}

/// Pages that hold these bytes, and are erased behind them.
fn raw(bytes: &[u8]) -> Journal<Flash> {
    let mut pages = vec![0xFF; 2 * PAGE_BYTES];
    let length = bytes.len().min(pages.len());
    pages[..length].copy_from_slice(&bytes[..length]);
    let (one, other) = pages.split_at(PAGE_BYTES);
    Flash::journal_of([one, other])
}

/// Pages in which these bytes are kept, all of them for each setting, or cut to three parts.
fn kept(bytes: &[u8], is_cut: bool) -> Journal<Flash> {
    let mut journal = Flash::journal();
    let third = bytes.len().div_ceil(3).max(1);
    for (number, setting) in Setting::ALL.into_iter().enumerate() {
        let cut = || bytes.chunks(third).nth(number).unwrap_or_default();
        let part = if is_cut { cut() } else { bytes };
        // What is too long is refused, which is right.
        let _ = journal.keep(setting.into(), &[&part[..part.len().min(512)]]);
    }
    journal
}
