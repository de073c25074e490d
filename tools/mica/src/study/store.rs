//! A folder of a study: lines that are only ever appended, and files that are whole or not there.

use super::place::OpenPlace;
use super::{Effort, Reference, ReferencePixels, reference_file};
use crate::error::Failure;
use crate::output::{self, Destination};
use mica_accuracy::{POINT_SCHEMA, Place, Point, REFERENCE_SCHEMA, ReferenceLine};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// A file of JSON lines that this process alone appends to.
pub struct Lines<T> {
    path: PathBuf,
    file: File,
    /// All lines, those of earlier runs first.
    pub all: Vec<T>,
    /// Lines that are something else.
    pub passed_over: usize,
}

impl Lines<Point> {
    /// Opens or makes a file of points; lines of an older form are passed over.
    ///
    /// # Errors
    /// Those of [`Lines::open`].
    pub fn of_points(path: &Path) -> Result<Self, Failure> {
        let mut lines = Self::open(path)?;
        let read = std::mem::take(&mut lines.all);
        read.into_iter().filter(|point| point.schema == POINT_SCHEMA).for_each(|point| lines.hold(point));
        Ok(lines)
    }

    /// Appends the line of a point, which counts from now on in place of an earlier one of the same point.
    ///
    /// # Errors
    /// Those of [`Lines::add`].
    pub fn renew(&mut self, point: Point) -> Result<(), Failure> {
        self.add(point)?;
        self.all.pop().into_iter().for_each(|point| self.hold(point));
        Ok(())
    }

    fn hold(&mut self, point: Point) {
        self.all.retain(|earlier| !earlier.is_same_as(&point));
        self.all.push(point);
    }
}

impl<T: Serialize + DeserializeOwned> Lines<T> {
    /// Opens or makes the file. A last line that was cut short is taken off; any other line that is not what it should
    /// be is left where it is, and not heard of again.
    ///
    /// # Errors
    /// If the file cannot be read and written, or another process has it.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        output::check_name(path)?;
        let failed = |error: std::io::Error| {
            let what_to_do = "name a file that can be written, in a folder that is there";
            Failure::bad_input(format!("{}: {error}; {what_to_do}", path.display()))
        };
        let mut file =
            OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(failed)?;
        // A device or a pipe has no lines to go on from, and may have no end.
        if !file.metadata().map_err(failed)?.is_file() {
            return Err(Failure::bad_input(format!("{}: is no file that lines can be added to", path.display())));
        }
        match file.try_lock() {
            Ok(()) => {}
            Err(TryLockError::WouldBlock) => {
                let path = path.display();
                return Err(Failure::bad_input(format!(
                    "{path}: another mica is writing it; wait for it, or name another"
                )));
            }
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed)?;
        let whole = bytes.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
        if bytes.get(whole).is_some_and(|byte| *byte != b'{') {
            let path = path.display();
            return Err(Failure::bad_input(format!("{path}: it does not end in a line of JSON; name another file")));
        }
        if whole < bytes.len() {
            log::info!("{}: the last line was cut short and is taken off", path.display());
            file.set_len(whole as u64).map_err(failed)?;
        }
        file.seek(SeekFrom::End(0)).map_err(failed)?;
        let (mut all, mut passed_over) = (Vec::new(), Vec::new());
        for (index, line) in bytes[..whole].split(|byte| *byte == b'\n').enumerate() {
            match serde_json::from_slice(line) {
                Ok(line) => all.push(line),
                Err(_) if line.iter().all(u8::is_ascii_whitespace) => {}
                Err(error) => {
                    passed_over.push(format!("{}, line {}: {error}; it is passed over", path.display(), index + 1));
                }
            }
        }
        // Of a file that has no line of this kind its reader says so, once.
        passed_over.iter().filter(|_| !all.is_empty()).for_each(|why| log::warn!("{why}"));
        let passed_over = passed_over.len();
        Ok(Self { path: path.to_owned(), file, all, passed_over })
    }

    /// Appends a line, which is on the disk before this returns.
    pub fn add(&mut self, line: T) -> Result<(), Failure> {
        let failed = |error: String| Failure::bad_input(format!("{} cannot be written: {error}", self.path.display()));
        let mut text = serde_json::to_string(&line).map_err(|error| failed(error.to_string()))?;
        text.push('\n');
        let end = self.file.stream_position().map_err(|error| failed(error.to_string()))?;
        // In one call, so that what a kill cuts off is the end of this line and nothing else.
        if let Err(error) = self.file.write_all(text.as_bytes()).and_then(|()| self.file.sync_data()) {
            // What a full disk took of it is taken off; where that fails too, it is when the file is next opened.
            let _ = self.file.set_len(end).and_then(|()| self.file.seek(SeekFrom::Start(end)));
            return Err(failed(error.to_string()));
        }
        self.all.push(line);
        Ok(())
    }
}

/// The folder of a study.
pub struct Folder {
    /// As it was named.
    pub path: PathBuf,
    /// `points.jsonl`.
    pub points: Lines<Point>,
    /// `references.jsonl`.
    references: Lines<ReferenceLine>,
}

impl Folder {
    /// Opens or makes it, for this process alone.
    pub fn open(path: &Path) -> Result<Self, Failure> {
        for folder in [path.to_owned(), path.join("pictures"), path.join("references")] {
            output::make_folder(&folder)?;
        }
        // The points' lock is the folder's.
        let points = Lines::of_points(&path.join("points.jsonl"))?;
        let mut references = Lines::<ReferenceLine>::open(&path.join("references.jsonl"))?;
        references.all.retain(|line| line.schema == REFERENCE_SCHEMA);
        Ok(Self { path: path.to_owned(), points, references })
    }

    /// Whether the files that a point names are there.
    pub fn has_pictures(&self, point: &Point) -> bool {
        let is_there = |name: &String| fs::metadata(self.path.join(name)).is_ok_and(|file| file.len() > 0);
        point.pictures.iter().flatten().all(is_there)
    }

    /// Writes a file that other files refer to by this name.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<(), Failure> {
        Destination::check(&self.path.join(name))?.write(bytes)
    }

    /// The reference of a place, if one was kept that this machine rendered with this effort.
    pub fn reference(&self, open: &OpenPlace, effort: &Effort) -> Option<(ReferenceLine, ReferencePixels)> {
        let line = self.reference_line(open, effort)?;
        let bytes = fs::read(self.path.join(&line.pictures[1])).ok()?;
        let pixels = reference_file::read(&bytes, &of(line))?;
        Some((line.clone(), pixels))
    }

    /// The file of a reference that was kept once and cannot be read any more.
    pub fn lost_reference(&self, open: &OpenPlace, effort: &Effort) -> Option<PathBuf> {
        let line = self.reference_line(open, effort).filter(|_| self.reference(open, effort).is_none())?;
        Some(self.path.join(&line.pictures[1]))
    }

    fn reference_line(&self, open: &OpenPlace, effort: &Effort) -> Option<&ReferenceLine> {
        let is_same = |line: &&ReferenceLine| {
            let same = line.place == open.place && line.machine == open.machine && line.content == open.content;
            same && line.effort == effort.of_reference()
        };
        self.references.all.iter().rev().find(is_same)
    }

    /// Keeps a reference: first its files, then the line that says they are there.
    pub fn keep_reference(&mut self, reference: &Reference, exposure: f32) -> Result<(), Failure> {
        let Reference { line, pixels, .. } = reference;
        let shown = mica_accuracy::displayed(&pixels.whole, exposure);
        self.write(&line.pictures[0], &crate::picture::png_of(&shown, pixels.size)?)?;
        let bytes = reference_file::write(pixels, &of(line))?;
        self.write(&line.pictures[1], &bytes)?;
        self.references.add(line.clone())
    }
}

/// Whose reference a file is.
fn of(ReferenceLine { place, machine, effort, content, .. }: &ReferenceLine) -> String {
    format!("{place:?} {machine:?} {effort} {content}")
}

/// The names of a reference's picture and .exr.
pub fn reference_names(place: &Place) -> [String; 2] {
    let place = place_name(place);
    [format!("pictures/{place}-reference.png"), format!("references/{place}.exr")]
}

/// The names of a point's picture and of the map of its FLIP.
pub fn picture_names(point: &Point) -> [String; 2] {
    let name = format!("pictures/{}-{}-{}", place_name(&point.place), point.method, file_word(&point.rung));
    [format!("{name}.png"), format!("{name}-difference.png")]
}

fn place_name(place: &Place) -> String {
    let [width, height] = place.size;
    format!("{}-{}-{width}x{height}", file_word(&place.scene), place.lighting)
}

/// A text as part of a file's name; where that loses something, a hash keeps texts apart.
fn file_word(text: &str) -> String {
    let word: String = text.chars().map(|c| if c.is_ascii_alphanumeric() || c == '.' { c } else { '_' }).collect();
    let word = word.trim_start_matches('.');
    if word == text.replace(' ', "_") && word.len() <= 60 {
        return word.to_owned();
    }
    // FNV-1a (Fowler, Noll and Vo).
    let hash = text.bytes().fold(0x811c_9dc5_u32, |hash, byte| (hash ^ u32::from(byte)).wrapping_mul(0x0100_0193));
    // The end of a path says more than its beginning.
    let end = word.len().saturating_sub(60);
    format!("{}-{hash:08x}", &word[end..])
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;

    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    struct Line {
        number: u32,
    }

    fn numbers(path: &Path) -> Vec<u32> {
        Lines::<Line>::open(path).expect("lines").all.iter().map(|line| line.number).collect()
    }

    #[test]
    fn a_line_that_was_cut_short_is_taken_off_and_nothing_else() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("lines.jsonl");
        let mut lines = Lines::open(&path).expect("lines");
        for number in [1, 2] {
            lines.add(Line { number }).expect("written");
        }
        drop(lines);
        let whole = fs::read(&path).expect("a file");
        for cut in 0..whole.len() {
            fs::write(&path, &whole[..cut]).expect("written");
            let kept = numbers(&path);
            assert_eq!(
                kept,
                (1..=whole[..cut].iter().filter(|byte| **byte == b'\n').count() as u32).collect::<Vec<_>>()
            );
            let mut lines = Lines::open(&path).expect("lines");
            lines.add(Line { number: 9 }).expect("written");
            drop(lines);
            assert_eq!(numbers(&path), [kept, vec![9]].concat());
        }
    }

    #[test]
    fn lines_of_another_kind_stay_and_are_passed_over() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("lines.jsonl");
        let text = "{\"number\":1}\n\n{\"word\":\"x\"}\n\u{fffd}\n{\"number\":2}\n";
        fs::write(&path, text).expect("written");
        assert_eq!(numbers(&path), [1, 2]);
        assert_eq!(fs::read_to_string(&path).expect("a file"), text);
    }

    #[test]
    fn two_processes_do_not_write_one_file() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("lines.jsonl");
        let first = Lines::<Line>::open(&path).expect("lines");
        let second = Lines::<Line>::open(&path);
        assert!(second.is_err_and(|failure| failure.code == 2 && failure.to_string().contains("another mica")));
        drop(first);
        assert!(Lines::<Line>::open(&path).is_ok());
    }

    #[test]
    fn names_of_files_are_plain_and_differ_where_texts_do() {
        assert_eq!([file_word("shoe"), file_word("epsilon .1")], ["shoe", "epsilon_.1"]);
        let texts = ["a/b.glb", "a_b.glb", "../a/b.glb", "\u{e9}", "\u{e8}", "", ".", "repaired, 4 layers"];
        let words = texts.map(file_word);
        for (index, word) in words.iter().enumerate() {
            assert!(word.chars().all(|c| c.is_ascii_alphanumeric() || "._-".contains(c)), "{word}");
            assert!(!word.starts_with('.'), "{word}");
            assert!(!words[..index].contains(word), "{word}");
        }
        assert!(file_word(&"x".repeat(4000)).len() < 80);
    }
}
