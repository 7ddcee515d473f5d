//! Reads files within the size limit of their kind.

use std::fs::{self, File, Metadata};
use std::io::{self, ErrorKind, Read};
use std::path::Path;

use super::limits::describe_size;

/// The bytes of a regular file of at most `limit` bytes.
///
/// # Errors
/// The operating system's error; an error that states what was expected unless the path is a regular file within the
/// limit.
pub fn read(path: &Path, limit: u64) -> io::Result<Vec<u8>> {
    let file = open(path, limit)?;
    let mut bytes = Vec::with_capacity(file.metadata()?.len().min(limit) as usize);
    // the file may grow while it is read
    file.take(limit.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit { Err(too_large(limit)) } else { Ok(bytes) }
}

/// As [`read`], of a file that must be UTF-8.
pub fn read_to_string(path: &Path, limit: u64) -> io::Result<String> {
    let not_text = |e: std::string::FromUtf8Error| {
        io::Error::new(ErrorKind::InvalidData, format!("the text is not UTF-8 ({}); save it as UTF-8", e.utf8_error()))
    };
    String::from_utf8(read(path, limit)?).map_err(not_text)
}

/// Opens a regular file of at most `limit` bytes for reading. A pipe is never opened, because opening it would block
/// until a writer appears.
pub fn open(path: &Path, limit: u64) -> io::Result<File> {
    check(&fs::metadata(path)?, limit)?;
    let file = File::open(path)?;
    // the file may have been replaced in between
    check(&file.metadata()?, limit)?;
    Ok(file)
}

fn check(metadata: &Metadata, limit: u64) -> io::Result<()> {
    if metadata.is_dir() {
        return Err(io::Error::new(ErrorKind::IsADirectory, "is a directory, expected a file"));
    }
    if !metadata.is_file() {
        let message = "is a device, a pipe or a socket, expected a regular file; copy its content to a file first";
        return Err(io::Error::new(ErrorKind::InvalidInput, message));
    }
    if metadata.len() > limit { Err(too_large(limit)) } else { Ok(()) }
}

fn too_large(limit: u64) -> io::Error {
    let message = format!("larger than {}, the limit for a file of this kind", describe_size(limit));
    io::Error::new(ErrorKind::FileTooLarge, message)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_read_up_to_its_limit_and_no_further() {
        let file = tempfile::NamedTempFile::new().unwrap();
        fs::write(file.path(), vec![b'x'; 2048]).unwrap();
        assert_eq!(read(file.path(), 2048).unwrap().len(), 2048);
        let error = read(file.path(), 2047).unwrap_err();
        assert_eq!(error.to_string(), "larger than 1 KiB, the limit for a file of this kind");
        fs::write(file.path(), [0xff, 0xfe]).unwrap();
        assert!(read_to_string(file.path(), 10).unwrap_err().to_string().contains("not UTF-8"));
    }

    #[test]
    fn a_file_of_many_gigabytes_is_refused_by_its_length_alone() {
        let file = tempfile::NamedTempFile::new().unwrap();
        file.as_file().set_len(1 << 40).unwrap(); // a sparse file: it takes no space
        assert_eq!(read(file.path(), super::super::limits::ARRAYS).unwrap_err().kind(), ErrorKind::FileTooLarge);
    }

    #[cfg(unix)]
    #[test]
    fn directories_devices_and_pipes_are_refused_without_being_opened() {
        let folder = tempfile::tempdir().unwrap();
        assert_eq!(read(folder.path(), 10).unwrap_err().to_string(), "is a directory, expected a file");
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        for path in [pipe.as_path(), Path::new("/dev/zero")] {
            assert!(read(path, 10).unwrap_err().to_string().contains("expected a regular file"), "{path:?}");
        }
    }
}
