//! Tables for people: columns as wide as their widest entry.

/// A column, by its heading.
#[derive(Clone, Copy)]
pub enum Column {
    /// Text.
    Left(&'static str),
    /// Numbers.
    Right(&'static str),
}

/// Lines with a heading, each ended; rows may be shorter than the heading.
pub fn table(columns: &[Column], rows: &[Vec<String>]) -> String {
    let heading = |column: &Column| match column {
        Column::Left(heading) | Column::Right(heading) => (*heading).to_owned(),
    };
    let headings: Vec<String> = columns.iter().map(heading).collect();
    let lines: Vec<&Vec<String>> = std::iter::once(&headings).chain(rows).collect();
    let width =
        |k: usize| lines.iter().filter_map(|line| line.get(k)).map(|cell| cell.chars().count()).max().unwrap_or(0);
    let mut text = String::new();
    for line in &lines {
        let cells: Vec<String> = line
            .iter()
            .zip(columns)
            .enumerate()
            .map(|(k, (cell, column))| match column {
                Column::Left(_) => format!("{cell:<width$}", width = width(k)),
                Column::Right(_) => format!("{cell:>width$}", width = width(k)),
            })
            .collect();
        text += cells.join("  ").trim_end();
        text.push('\n');
    }
    text
}

/// Milliseconds to the microsecond; a dash for what was not measured.
pub fn milliseconds(ns: Option<u64>) -> String {
    ns.map_or_else(|| "-".to_owned(), |ns| format!("{:.3}", ns as f64 * 1e-6))
}

/// Bytes in the largest unit that leaves at least one.
pub fn bytes(bytes: u64) -> String {
    let units = [(30, "GiB"), (20, "MiB"), (10, "KiB")];
    match units.into_iter().find(|(shift, _)| bytes >> shift > 0) {
        Some((shift, unit)) => format!("{:.1} {unit}", bytes as f64 / (1_u64 << shift) as f64),
        None => format!("{bytes} B"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_are_aligned_and_lines_end_with_their_text() {
        let rows = [vec!["a".to_owned(), "10".to_owned()], vec!["long".to_owned()]];
        assert_eq!(table(&[Column::Left("name"), Column::Right("ms")], &rows), "name  ms\na     10\nlong\n");
    }

    #[test]
    fn figures_have_units_of_their_size() {
        assert_eq!([bytes(0), bytes(1023), bytes(1536), bytes(3 << 30)], ["0 B", "1023 B", "1.5 KiB", "3.0 GiB"]);
        assert_eq!([milliseconds(Some(1_234_567)), milliseconds(None)], ["1.235", "-"]);
    }
}
