//! Standard output that survives a reader who has gone.

use std::io::{self, ErrorKind, Write};

use crate::input::harmless;

/// Prints text for people and a newline, without control characters of the files that it quotes.
pub(super) fn print(text: &str) -> io::Result<()> {
    let harmless = |c: char| if c == '\n' { c } else { harmless(c) };
    write(&text.chars().map(harmless).collect::<String>())
}

/// Prints text and a newline; a closed pipe (`| head`) is no error.
fn write(text: &str) -> io::Result<()> {
    let mut stdout = io::stdout().lock();
    match writeln!(stdout, "{text}").and_then(|()| stdout.flush()) {
        Err(e) if e.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}

/// Prints one JSON object.
pub(super) fn print_json(value: &impl serde::Serialize) -> io::Result<()> {
    write(&serde_json::to_string_pretty(value)?)
}

/// A number of things: `1 model`, `2 models`.
pub(super) fn counted(count: usize, thing: &str) -> String {
    format!("{count} {thing}{}", if count == 1 { "" } else { "s" })
}
