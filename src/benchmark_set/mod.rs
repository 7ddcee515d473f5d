//! A set on disk: manifest, writer, reader.
