//! The content of a file of a set on its way to memory or to a disk.

use super::SetError;
use crate::npz::Npz;

/// What a file holds, before it is bytes.
pub(super) enum FileContent {
    Bytes(Vec<u8>),
    Arrays(Npz),
}

impl FileContent {
    /// All bytes in order, in parts.
    pub(super) fn write_to(
        &self,
        path: &str,
        put: &mut dyn FnMut(&[u8]) -> Result<(), SetError>,
    ) -> Result<(), SetError> {
        match self {
            Self::Bytes(bytes) => put(bytes),
            Self::Arrays(arrays) => arrays.write_to(path, put),
        }
    }

    /// All bytes at once.
    pub(super) fn into_bytes(self, path: &str) -> Result<Vec<u8>, SetError> {
        match self {
            Self::Bytes(bytes) => Ok(bytes),
            Self::Arrays(arrays) => Ok(arrays.to_bytes(path)?),
        }
    }
}
