//! Files of a sweep's folder, each whole or not there at all.

use std::fs::{self, File};
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use crate::experiment::error::output;
use crate::experiment::{ExperimentError, unfinished};

/// A file that is written bit by bit, and put in its place when it is whole.
pub(super) struct WholeFile {
    path: PathBuf,
    meanwhile: PathBuf,
    file: BufWriter<File>,
}

impl WholeFile {
    pub(super) fn begin(path: &Path) -> Result<Self, ExperimentError> {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let meanwhile = path.with_file_name(format!(".{name}.writing-{}", std::process::id()));
        unfinished::begin(&meanwhile);
        let file = File::create(&meanwhile).map_err(|error| {
            unfinished::end(&meanwhile);
            output(path, "write")(error)
        })?;
        Ok(Self { path: path.to_owned(), meanwhile, file: BufWriter::new(file) })
    }

    pub(super) fn write(&mut self, bytes: &[u8]) -> Result<(), ExperimentError> {
        self.file.write_all(bytes).map_err(output(&self.path, "write"))
    }

    pub(super) fn finish(mut self) -> Result<(), ExperimentError> {
        let written = self.file.flush().and_then(|()| self.file.get_ref().sync_all());
        written.and_then(|()| fs::rename(&self.meanwhile, &self.path)).map_err(output(&self.path, "write"))
    }
}

impl Drop for WholeFile {
    fn drop(&mut self) {
        // after `finish` nothing is there any more
        fs::remove_file(&self.meanwhile).ok();
        unfinished::end(&self.meanwhile);
    }
}

/// Writes a whole file.
pub(super) fn put(path: &Path, bytes: &[u8]) -> Result<(), ExperimentError> {
    let mut file = WholeFile::begin(path)?;
    file.write(bytes)?;
    file.finish()
}
