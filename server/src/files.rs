//! Files that somebody named: only plain ones are read, and never more of one than it may have.

use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// The bytes of the plain file at `path`.
///
/// # Errors
/// Where it is none, cannot be read, or has more than `max` bytes.
pub fn read(path: &Path, max: usize) -> io::Result<Vec<u8>> {
    // Asked before it is opened: opening a pipe waits for who writes into it.
    if !std::fs::metadata(path)?.is_file() {
        return Err(io::Error::other("it is no plain file"));
    }
    let mut bytes = Vec::new();
    File::open(path)?.take(max as u64 + 1).read_to_end(&mut bytes)?;
    match bytes.len() <= max {
        true => Ok(bytes),
        false => Err(io::Error::other(format!("it is longer than {max} bytes, the most that is read"))),
    }
}

/// The same as text.
///
/// # Errors
/// As [`read`], and where it is no UTF-8.
pub fn read_text(path: &Path, max: usize) -> io::Result<String> {
    String::from_utf8(read(path, max)?).map_err(io::Error::other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_plain_files_of_bounded_length_are_read() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        std::fs::write(&file, "12345678").unwrap();
        assert_eq!(read_text(&file, 8).unwrap(), "12345678");
        let said = read(&file, 7).unwrap_err().to_string();
        assert!(said.contains("longer than 7 bytes"), "{said}");
        // No end of it is ever reached.
        let said = read_text(Path::new("/dev/zero"), 8).unwrap_err().to_string();
        assert!(said.contains("no plain file"), "{said}");
        assert!(read(folder.path(), 8).is_err());
        std::fs::write(&file, [0xff]).unwrap();
        assert!(read_text(&file, 8).is_err());
    }
}
