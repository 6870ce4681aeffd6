//! Patterns of columns: lines of any text, the first a pattern and the others a header.

use taxel_data::columns;

/// Bytes of a pattern and of names, a line each.
pub fn check(bytes: &[u8]) -> bool {
    let text = String::from_utf8_lossy(bytes);
    let mut lines = text.lines().map(str::to_owned);
    let Some(pattern) = lines.next() else { return false };
    let header: Vec<String> = lines.take(64).collect();
    let selected = columns::select(&header, &pattern);
    assert!(selected.is_sorted_by(|one, next| one < next), "columns twice or out of order");
    assert!(selected.iter().all(|column| *column < header.len()), "a column that is not there");
    if !pattern.contains(['*', '?', ',', '!']) && columns::unmatched(&header, &pattern).is_none() {
        assert!(!selected.is_empty(), "a part matches, and nothing is chosen");
    }
    for name in &header {
        let without = columns::without_unit(name);
        assert!(
            name.starts_with(without) && (columns::unit_of(name).is_empty() || without != name)
        );
    }
    !selected.is_empty()
}
