//! Files that are whole or not there: written under a name that nobody uses, and renamed once every byte is on the disk.
//!
//! A full disk, a kill or a crash leaves the old file or none, never a part of one. What a killed process leaves behind is a
//! file of ours under a temporary name, which a later write to the same folder removes.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

/// Temporary files that are older belong to no process that is still writing.
const STALE: Duration = Duration::from_secs(24 * 60 * 60);
const PREFIX: &str = ".mica-";
const SUFFIX: &str = ".tmp";

/// Writes a file that holds these parts, one after the other, in place of the one of that name if there is one.
///
/// # Errors
/// Those of the file system; what was there is then as it was.
pub fn replace(path: &Path, parts: &[&[u8]]) -> io::Result<()> {
    let folder = folder_of(path);
    remove_stale(folder);
    let (mut file, temporary) = temporary_in(folder)?;
    let written = parts
        .iter()
        .try_for_each(|part| file.write_all(part))
        // A disk may tell only now that it is full.
        .and_then(|()| file.sync_all())
        .and_then(|()| fs::rename(&temporary, path));
    match written {
        Ok(()) => {
            // The folder too, so that a crash does not bring the old file back. Not every file system can.
            let _ = File::open(folder).and_then(|folder| folder.sync_all());
            Ok(())
        }
        Err(error) => {
            // It is of no use; whether it can be removed changes nothing.
            let _ = fs::remove_file(&temporary);
            Err(error)
        }
    }
}

/// Whether files can be made beside this one; leaves everything as it is.
///
/// # Errors
/// Those of the file system.
pub fn probe(path: &Path) -> io::Result<()> {
    let (_, temporary) = temporary_in(folder_of(path))?;
    fs::remove_file(temporary)
}

/// The folder of a file, `.` where none is named.
pub fn folder_of(path: &Path) -> &Path {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// A new file under a name that nobody uses. Only within a folder a rename is atomic.
fn temporary_in(folder: &Path) -> io::Result<(File, PathBuf)> {
    static NEXT: AtomicU32 = AtomicU32::new(0);
    loop {
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = folder.join(format!("{PREFIX}{}-{number}{SUFFIX}", std::process::id()));
        match File::create_new(&path) {
            // That of a process with the same number: killed, or in another container.
            Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
            made => return made.map(|file| (file, path)),
        }
    }
}

/// Removes what processes left behind that were killed while they wrote.
fn remove_stale(folder: &Path) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        let is_ours = name.to_str().is_some_and(|name| name.starts_with(PREFIX) && name.ends_with(SUFFIX));
        let modified = || entry.metadata().and_then(|metadata| metadata.modified());
        if is_ours && modified().is_ok_and(|time| time.elapsed().is_ok_and(|age| age > STALE)) {
            // Another process may have removed it.
            let _ = fs::remove_file(entry.path());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::SystemTime;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        let mut names: Vec<String> =
            entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_file_is_replaced_by_its_parts_and_nothing_else_is_left() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a");
        probe(&path).expect("it can be written");
        assert_eq!(names(folder.path()), [""; 0]);
        for parts in [&[&b"one, "[..], b"two"][..], &[b"shorter"], &[]] {
            replace(&path, parts).expect("written");
            assert_eq!((fs::read(&path).ok(), names(folder.path())), (Some(parts.concat()), vec!["a".to_owned()]));
        }
    }

    #[test]
    fn what_cannot_be_replaced_stays_and_nothing_is_left() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let taken = folder.path().join("taken");
        fs::create_dir(&taken).expect("a folder");
        assert!(replace(&taken, &[b"x"]).is_err());
        assert!(probe(&folder.path().join("missing/a")).is_err());
        assert_eq!(names(folder.path()), ["taken"]);
    }

    #[test]
    fn temporary_files_of_others_are_neither_used_nor_removed_until_they_are_a_day_old() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let of = |number: u32| format!("{PREFIX}{}-{number}{SUFFIX}", std::process::id());
        // As a process of the same number would have left them.
        for number in 0..100 {
            fs::write(folder.path().join(of(number)), "of another").expect("a file");
        }
        let path = folder.path().join("a");
        replace(&path, &[b"x"]).expect("written");
        assert_eq!(names(folder.path()).len(), 101);
        let foreign = folder.path().join("mine.tmp");
        fs::write(&foreign, "x").expect("a file");
        let aged = |hours: u64, path: &Path| {
            let then = SystemTime::now() - Duration::from_secs(hours * 3600);
            File::options().write(true).open(path).and_then(|file| file.set_modified(then)).expect("a time");
        };
        aged(23, &folder.path().join(of(0)));
        aged(25, &folder.path().join(of(1)));
        aged(25, &foreign);
        replace(&path, &[b"y"]).expect("written");
        let left = names(folder.path());
        assert!(left.contains(&of(0)) && !left.contains(&of(1)) && left.contains(&"mine.tmp".to_owned()), "{left:?}");
    }
}
