//! Standard output; a closed pipe is not an error.

use std::io::{self, ErrorKind, Write};

use skiagraph_core::input::harmless;

/// Prints text and a newline; replaces control characters, which may come from quoted files.
pub(super) fn print(text: &str) -> io::Result<()> {
    let harmless = |c: char| if c == '\n' { c } else { harmless(c) };
    write(&text.chars().map(harmless).collect::<String>())
}

/// Prints text and a newline; a closed pipe (`| head`) is not an error.
fn write(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    match writeln!(stdout, "{text}").and_then(|()| stdout.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

pub(super) fn print_json(value: &impl serde::Serialize) -> io::Result<()> {
    write(&serde_json::to_string_pretty(value)?)
}

/// Prints a value as one JSON object, or else its text.
pub(super) fn print_as<T>(json: bool, value: &T, text: impl FnOnce(&T) -> String) -> io::Result<()>
where
    T: serde::Serialize,
{
    if json { print_json(value) } else { print(&text(value)) }
}

/// A count with its noun: `1 model`, `2 models`.
pub(super) fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}
