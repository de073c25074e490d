//! NumPy's array files, as far as lists of flakes need them: N x 5 numbers of 64 bits.
//!
//! The format is that of NumPy's `numpy.lib.format`, versions 1 to 3: magic, version, length of the header, the header (a
//! Python dictionary of three entries), the numbers. The crates that read all of it bring a parser of Python literals;
//! this one refuses what it does not need, and reserves no memory before the file has shown that it is long enough.

use crate::error::Failure;
use std::fs::File;
use std::io::{BufReader, Read};
use std::path::Path;

/// Bytes before the header's length.
const MAGIC: &[u8; 6] = b"\x93NUMPY";
/// Headers of arrays without fields are not longer.
const LONGEST_HEADER: u64 = 1 << 16;
/// Numbers in a row.
const COLUMNS: usize = 5;

/// How the numbers lie in the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Layout {
    big_endian: bool,
    column_after_column: bool,
    rows: u64,
}

/// Reads the rows of a file.
pub fn read_rows(path: &Path) -> Result<Vec<[f64; COLUMNS]>, Failure> {
    let wrong = |why: &str| Failure::bad_input(format!("{}: {why}", path.display()));
    // Before it is opened: a pipe would keep us waiting for a writer.
    let found = std::fs::metadata(path).map_err(|error| wrong(&format!("cannot be read: {error}")))?;
    if !found.is_file() {
        return Err(wrong("is no file"));
    }
    let file = File::open(path).map_err(|error| wrong(&format!("cannot be read: {error}")))?;
    rows_from(BufReader::new(file), found.len()).map_err(|why| wrong(&why))
}

/// Reads the rows of a source of `length` bytes.
fn rows_from(mut source: impl Read, length: u64) -> Result<Vec<[f64; COLUMNS]>, String> {
    let truncated = |_| "ends before its header does; it is no NumPy array file, or was cut off".to_owned();
    let mut start = [0; 8];
    source.read_exact(&mut start).map_err(truncated)?;
    if start[..6] != *MAGIC {
        return Err("is no NumPy array file (.npy)".to_owned());
    }
    let (header_length, before) = match start[6] {
        1 => {
            let mut bytes = [0; 2];
            source.read_exact(&mut bytes).map_err(truncated)?;
            (u64::from(u16::from_le_bytes(bytes)), 10)
        }
        2 | 3 => {
            let mut bytes = [0; 4];
            source.read_exact(&mut bytes).map_err(truncated)?;
            (u64::from(u32::from_le_bytes(bytes)), 12)
        }
        version => return Err(format!("is of version {version} of the format; expected 1 to 3")),
    };
    if header_length > LONGEST_HEADER.min(length) {
        return Err("declares a header that is longer than any of an array of f64".to_owned());
    }
    let mut header = vec![0; header_length as usize];
    source.read_exact(&mut header).map_err(truncated)?;
    let header = std::str::from_utf8(&header).map_err(|_| "has a header that is no text".to_owned())?;
    let layout = layout_of(header)?;

    let row_bytes = (COLUMNS * size_of::<f64>()) as u64;
    let wanted = layout.rows.checked_mul(row_bytes).and_then(|bytes| bytes.checked_add(before + header_length));
    match wanted {
        Some(wanted) if wanted == length => {}
        Some(wanted) if wanted < length => {
            return Err(format!("has {} bytes more than its header declares", length - wanted));
        }
        _ => return Err(format!("is too short for the {} rows that its header declares", layout.rows)),
    }
    numbers(source, layout)
}

fn numbers(mut source: impl Read, layout: Layout) -> Result<Vec<[f64; COLUMNS]>, String> {
    let count = layout.rows as usize;
    let mut rows = Vec::new();
    rows.try_reserve_exact(count).map_err(|_| format!("has {count} rows, more than fit into memory"))?;
    rows.resize(count, [0.0; COLUMNS]);
    let mut next = || {
        let mut bytes = [0; 8];
        source.read_exact(&mut bytes).map_err(|error| format!("cannot be read: {error}"))?;
        Ok::<f64, String>(if layout.big_endian { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) })
    };
    if layout.column_after_column {
        for column in 0..COLUMNS {
            for row in &mut rows {
                row[column] = next()?;
            }
        }
    } else {
        for number in rows.as_flattened_mut() {
            *number = next()?;
        }
    }
    Ok(rows)
}

/// What a header such as `{'descr': '<f8', 'fortran_order': False, 'shape': (3, 5), }` says.
fn layout_of(header: &str) -> Result<Layout, String> {
    let shown = || header.trim_end().chars().take(100).collect::<String>();
    let unreadable = || format!("has a header that cannot be read: {}", shown());
    let inner = header.trim().strip_prefix('{').and_then(|rest| rest.strip_suffix('}')).ok_or_else(unreadable)?;
    let (mut descr, mut order, mut shape) = (None, None, None);
    let mut rest = inner.trim();
    while !rest.is_empty() {
        let (key, after) = quoted(rest).ok_or_else(unreadable)?;
        let value = after.trim_start().strip_prefix(':').ok_or_else(unreadable)?.trim_start();
        // A value ends at the next comma outside its brackets.
        let mut depth = 0_i32;
        let end = value.find(|character| {
            depth += match character {
                '(' | '[' => 1,
                ')' | ']' => -1,
                _ => 0,
            };
            character == ',' && depth == 0
        });
        let (value, after) = end.map_or((value, ""), |end| (&value[..end], &value[end + 1..]));
        let place = match key {
            "descr" => &mut descr,
            "fortran_order" => &mut order,
            "shape" => &mut shape,
            _ => return Err(unreadable()),
        };
        if place.replace(value.trim()).is_some() {
            return Err(unreadable());
        }
        rest = after.trim_start();
    }
    let (Some(descr), Some(order), Some(shape)) = (descr, order, shape) else { return Err(unreadable()) };
    let big_endian = match quoted(descr) {
        Some(("<f8", "")) => false,
        Some((">f8", "")) => true,
        _ => return Err(format!("holds numbers of type {descr}; expected '<f8' (float64)")),
    };
    let column_after_column = match order {
        "True" => true,
        "False" => false,
        _ => return Err(unreadable()),
    };
    let sizes = shape.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')).ok_or_else(unreadable)?;
    let sizes: Vec<&str> = sizes.split(',').map(str::trim).collect();
    match sizes[..] {
        [rows, "5"] | [rows, "5", ""] => {
            Ok(Layout { big_endian, column_after_column, rows: rows.parse().map_err(|_| unreadable())? })
        }
        _ => Err(format!("has the shape {shape}; expected (N, 5), the columns u, v, mx, my, mz")),
    }
}

/// The text between the quotes at the start, and what follows them.
fn quoted(text: &str) -> Option<(&str, &str)> {
    let quote = text.chars().next().filter(|character| matches!(character, '\'' | '"'))?;
    text[1..].split_once(quote)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(version: u8, header: &str, numbers: &[u8]) -> Vec<u8> {
        let length = if version == 1 {
            (header.len() as u16).to_le_bytes().to_vec()
        } else {
            (header.len() as u32).to_le_bytes().to_vec()
        };
        [&MAGIC[..], &[version, 0], &length, header.as_bytes(), numbers].concat()
    }

    fn read(bytes: &[u8]) -> Result<Vec<[f64; 5]>, String> {
        rows_from(bytes, bytes.len() as u64)
    }

    const TWO_ROWS: [[f64; 5]; 2] = [[0.0, 1.0, 2.0, 3.0, 4.0], [5.0, 6.0, 7.0, 8.0, 9.0]];

    #[test]
    fn rows_are_read_in_every_layout() {
        let by_rows: Vec<u8> = TWO_ROWS.concat().iter().flat_map(|number| number.to_le_bytes()).collect();
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 5), }      \n";
        for version in [1, 2, 3] {
            assert_eq!(read(&file(version, header, &by_rows)), Ok(TWO_ROWS.to_vec()));
        }
        let by_columns: Vec<u8> =
            (0..5).flat_map(|column| TWO_ROWS.map(|row| row[column])).flat_map(|number| number.to_be_bytes()).collect();
        let header = "{\"shape\":(2,5,),\"fortran_order\":True,\"descr\":\">f8\"}";
        assert_eq!(read(&file(1, header, &by_columns)), Ok(TWO_ROWS.to_vec()));
        let none = "{'descr': '<f8', 'fortran_order': False, 'shape': (0, 5), }";
        assert_eq!(read(&file(1, none, &[])), Ok(Vec::new()));
    }

    #[test]
    fn what_is_no_list_of_flakes_is_refused_before_memory_is_taken() {
        let header = |descr: &str, order: &str, shape: &str| {
            format!("{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}")
        };
        for (header, words) in [
            (header("'<f4'", "False", "(0, 5)"), "'<f4'"),
            (header("'|O'", "False", "(0, 5)"), "'|O'"),
            (header("[('u', '<f8'), ('v', '<f8')]", "False", "(0,)"), "'<f8'), ("),
            (header("'<f8'", "False", "(0, 4)"), "(0, 4)"),
            (header("'<f8'", "False", "(5,)"), "(5,)"),
            (header("'<f8'", "False", "(1, 5, 5)"), "(1, 5, 5)"),
            (header("'<f8'", "False", "()"), "()"),
            (header("'<f8'", "False", "(-1, 5)"), "cannot be read"),
            (header("'<f8'", "Maybe", "(0, 5)"), "cannot be read"),
            (header("'<f8'", "False", "(1, 5)"), "too short"),
            (header("'<f8'", "False", "(4000000000000, 5)"), "too short"),
            (header("'<f8'", "False", "(18446744073709551615, 5)"), "too short"),
            (header("'<f8'", "False", "(99999999999999999999, 5)"), "cannot be read"),
            ("{'descr': '<f8'}".to_owned(), "cannot be read"),
            ("{'descr: '<f8'}".to_owned(), "cannot be read"),
            ("{'descr' '<f8'}".to_owned(), "cannot be read"),
            (String::new(), "cannot be read"),
        ] {
            let error = read(&file(1, &header, &[])).expect_err("must be refused");
            assert!(error.contains(words), "{header}: {error}");
        }
        let good = header("'<f8'", "False", "(1, 5)");
        assert!(read(&file(1, &good, &[0; 41])).expect_err("too long").contains("1 bytes more"));
        assert!(read(&file(9, &good, &[0; 40])).expect_err("a version").contains("version 9"));
        assert!(read(b"hello, world").expect_err("no magic").contains("no NumPy"));
    }

    #[test]
    fn a_file_cut_anywhere_is_refused() {
        let whole = file(1, "{'descr': '<f8', 'fortran_order': False, 'shape': (2, 5), }\n", &[0; 80]);
        for length in 0..whole.len() {
            assert!(read(&whole[..length]).is_err(), "{length}");
        }
        for (at, bit) in (0..whole.len() - 80).flat_map(|at| (0..8).map(move |bit| (at, bit))) {
            let mut flipped = whole.clone();
            flipped[at] ^= 1 << bit;
            // Whatever it says now, it says it without a panic.
            let _ = read(&flipped);
        }
    }
}
