//! Tables for people: one look for all programs of this package.

use comfy_table::{CellAlignment, Table, presets::UTF8_FULL_CONDENSED};

/// A table of right-aligned columns; its width is its content's, not the terminal's, so that it can be pasted.
pub fn table(header: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> Table {
    let mut table = Table::new();
    table.load_style(UTF8_FULL_CONDENSED).set_header(header).add_rows(rows);
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}
