//! Where results go: stdout, and files that are written whole or not at all.

use crate::error::Failure;
use signal_hook::consts::SIGXFSZ;
use std::fs::{self, File};
use std::io::{self, ErrorKind, Write};
use std::os::fd::AsFd;
use std::os::unix::fs::FileTypeExt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Prints to stdout. A reader that has seen enough is no failure, nor is a terminal that was closed.
pub fn print(text: &str) -> Result<(), Failure> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != ErrorKind::BrokenPipe && !is_closed_terminal(&error) => {
            Err(Failure::bad_input(format!("stdout cannot be written: {error}")))
        }
        _ => Ok(()),
    }
}

/// Whether a write failed because the terminal is gone: then it is no terminal any more, but still a device.
fn is_closed_terminal(error: &io::Error) -> bool {
    const EIO: i32 = 5;
    let device = || File::from(io::stdout().as_fd().try_clone_to_owned().ok()?).metadata().ok();
    error.raw_os_error() == Some(EIO) && device().is_some_and(|device| device.file_type().is_char_device())
}

/// Prints a report as indented JSON.
pub fn print_json(report: &impl serde::Serialize) -> Result<(), Failure> {
    print(&(json(report)? + "\n"))
}

/// A report as indented JSON.
pub fn json(report: &impl serde::Serialize) -> Result<String, Failure> {
    serde_json::to_string_pretty(report).map_err(|error| Failure::bad_input(format!("the report is no JSON: {error}")))
}

/// A file that may not grow any further (`ulimit -f`) is a write that fails, and not the end of the process.
pub fn survive_size_limits() -> Result<(), Failure> {
    let handled = signal_hook::flag::register(SIGXFSZ, Arc::default());
    handled.map(|_| ()).map_err(|error| Failure::bad_input(format!("limits of files cannot be handled: {error}")))
}

/// Refuses names that would be more than one line where they are printed: what lists or scripts make of them is anyone's
/// guess.
pub fn check_name(path: &Path) -> Result<(), Failure> {
    match path.file_name() {
        Some(name) if name.to_string_lossy().contains(char::is_control) => {
            Err(Failure::bad_input(format!("{}: has a control character in its name; leave it out", path.display())))
        }
        _ => Ok(()),
    }
}

/// Makes a folder, and those above it, where they are not there.
pub fn make_folder(path: &Path) -> Result<(), Failure> {
    check_name(path)?;
    fs::create_dir_all(path).map_err(|error| Failure::bad_input(format!("{}: {error}; name a folder", path.display())))
}

/// A file to be written, that could be written when it was checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Destination {
    /// As the user gave it.
    pub path: PathBuf,
    /// The file that a rename is to replace, symbolic links followed; none where the path leads to a device or a pipe,
    /// which is written into.
    replaced: Option<PathBuf>,
}

impl Destination {
    /// Checks, before any work is done, that the file can be written; leaves the old one as it is.
    pub fn check(path: &Path) -> Result<Self, Failure> {
        check_name(path)?;
        let failed = |why: &str| Failure::bad_input(format!("{}: {why}", path.display()));
        let replaced = match fs::metadata(path) {
            Ok(found) if found.is_dir() => return Err(failed("is a folder; name a file in it")),
            Ok(found) => {
                // Opening a pipe would wait for its reader.
                if !found.file_type().is_fifo() {
                    open(path).map_err(|error| failed(&format!("cannot be written: {error}")))?;
                }
                let file = found.is_file().then(|| path.canonicalize()).transpose();
                file.map_err(|error| failed(&error.to_string()))?
            }
            Err(error) if error.kind() == ErrorKind::NotFound => Some(path.to_owned()),
            Err(error) => return Err(failed(&error.to_string())),
        };
        if let Some(replaced) = &replaced {
            if replaced.file_name().is_none() {
                return Err(failed("names no file"));
            }
            let folder = mica_files::folder_of(replaced);
            if !folder.is_dir() {
                return Err(failed(&format!("there is no folder {}; make it first", folder.display())));
            }
            mica_files::probe(replaced).map_err(|error| failed(&format!("its folder cannot be written: {error}")))?;
        }
        Ok(Self { path: path.to_owned(), replaced })
    }

    /// Writes the file: under another name first, which then takes its place once every byte is on the disk.
    pub fn write(&self, bytes: &[u8]) -> Result<(), Failure> {
        let written = match &self.replaced {
            Some(replaced) => mica_files::replace(replaced, &[bytes]),
            None => open(&self.path).and_then(|mut file| file.write_all(bytes)),
        };
        written.map_err(|error| Failure::bad_input(format!("{} cannot be written: {error}", self.path.display())))
    }
}

/// Opens what is there, and leaves it as it is until it is written into.
fn open(path: &Path) -> io::Result<File> {
    File::options().write(true).open(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries = fs::read_dir(folder).expect("a folder");
        entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned()).collect()
    }

    #[test]
    fn a_check_leaves_nothing_and_changes_nothing() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("a.json");
        assert!(Destination::check(&path).is_ok());
        assert_eq!(names(folder.path()), Vec::<String>::new());
        fs::write(&path, "old").expect("a file");
        Destination::check(&path).expect("a destination").write(b"new").expect("written");
        assert_eq!((names(folder.path()), fs::read(&path).ok()), (vec!["a.json".to_owned()], Some(b"new".to_vec())));
    }

    #[test]
    fn a_link_stays_a_link_to_what_was_replaced() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (file, link) = (folder.path().join("file"), folder.path().join("link"));
        fs::write(&file, "old").expect("a file");
        std::os::unix::fs::symlink("file", &link).expect("a link");
        Destination::check(&link).expect("a destination").write(b"new").expect("written");
        assert_eq!(fs::read(&file).ok(), Some(b"new".to_vec()));
        assert!(link.is_symlink());
    }

    #[test]
    fn what_cannot_be_a_file_is_refused_before_any_work() {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let file = folder.path().join("file");
        fs::write(&file, "x").expect("a file");
        let long = folder.path().join("x".repeat(300));
        let socket = folder.path().join("socket");
        let _listening = std::os::unix::net::UnixListener::bind(&socket).expect("a socket");
        let [newline, nul] = ["a\nb", "a\0b"].map(|name| folder.path().join(name));
        let missing = folder.path().join("missing/a");
        for bad in
            [folder.path(), &missing, &file.join("a"), &long, &socket, &newline, &nul, Path::new(""), Path::new("..")]
        {
            assert!(Destination::check(bad).is_err(), "{}", bad.display());
        }
    }

    #[test]
    fn a_full_device_is_seen_and_not_replaced() {
        let full = Destination::check(Path::new("/dev/full")).expect("a device can be written into");
        assert!(full.write(b"x").is_err_and(|failure| failure.to_string().contains("/dev/full")));
    }
}
