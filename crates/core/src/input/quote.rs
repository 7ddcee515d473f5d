//! Quotes input from files and command lines in messages: short, and without control characters.

use std::fmt::{Display, Write};

/// Greatest number of characters quoted from an input.
const SHOWN: usize = 200;

const LONGEST_MESSAGE: usize = 1200;

/// At most 200 characters of a text, on one line.
pub fn excerpt(text: &str) -> String {
    shortened(text.chars().map(harmless), SHOWN)
}

/// The first `most` names, each as an [`excerpt`], and how many more there are.
pub fn excerpts<'a>(names: impl ExactSizeIterator<Item = &'a String>, most: usize) -> String {
    let more = names.len().saturating_sub(most);
    let listed = names.take(most).map(|name| excerpt(name)).collect::<Vec<_>>().join(", ");
    if more == 0 { listed } else { format!("{listed} and {more} more") }
}

/// A message or a path without control characters, truncated if too long.
pub fn plain(message: impl Display) -> String {
    let mut writer = Harmless { text: String::new(), characters: 0 };
    write!(writer, "{message}").ok();
    if writer.characters > LONGEST_MESSAGE { shortened(writer.text.chars(), LONGEST_MESSAGE) } else { writer.text }
}

/// An error message of another crate about an input. Such messages quote the input and end with `, expected ...`: the
/// quote is shortened, the end is kept.
pub fn foreign(message: impl Display) -> String {
    let message = message.to_string();
    let (found, expected) = match message.rfind(", expected ") {
        Some(at) => message.split_at(at),
        None => (message.as_str(), ""),
    };
    plain(format_args!("{}{expected}", excerpt(found)))
}

/// Whether a text is of this program's own formats: those contain `"skiagraph.KIND/1"` as their schema.
pub fn is_own_output(text: &[u8]) -> bool {
    const MARK: &[u8] = b"skiagraph.";
    text.windows(MARK.len()).any(|found| found == MARK)
}

/// An error message of another crate about a file with this text; quotes are kept only if the file is in one of this
/// program's formats.
pub fn foreign_about(text: &[u8], message: impl Display) -> String {
    if is_own_output(text) { foreign(message) } else { unquoted(message) }
}

/// An error message of another crate about an untrusted input: quotes of the input are removed, the expectation is
/// kept.
pub fn unquoted(message: impl Display) -> String {
    let message = message.to_string();
    let (found, expected) = message.split_at(message.rfind(", expected ").unwrap_or(message.len()));
    let is_quote = |c: char| matches!(c, '"' | '`' | '\'');
    let shown = match (found.find(is_quote), found.rfind(is_quote)) {
        (Some(first), Some(last)) => format!("{}…{}", &found[..first], &found[last + 1..]),
        _ => found.to_owned(),
    };
    plain(format_args!("{shown}{expected}"))
}

/// Collects a message character by character, so that a huge message is never held in memory.
struct Harmless {
    text: String,
    characters: usize,
}

impl Write for Harmless {
    fn write_str(&mut self, piece: &str) -> std::fmt::Result {
        let room = (LONGEST_MESSAGE + 1).saturating_sub(self.characters);
        self.text.extend(piece.chars().take(room).map(harmless));
        self.characters += piece.chars().take(room).count();
        Ok(())
    }
}

fn shortened(characters: impl Iterator<Item = char>, most: usize) -> String {
    let mut characters = characters.peekable();
    let mut text: String = characters.by_ref().take(most).collect();
    if characters.peek().is_some() {
        text.pop();
        text.push('…');
    }
    text
}

/// A text as a cell of a CSV table: without control characters, and with a leading apostrophe where a spreadsheet
/// would run it as a formula (`=cmd|...`). Numbers are unchanged.
pub fn table_cell(text: &str) -> String {
    let text: String = text.chars().map(harmless).collect();
    let is_formula = text.trim_start().starts_with(['=', '+', '-', '@']) && text.parse::<f64>().is_err();
    if is_formula { format!("'{text}") } else { text }
}

/// A word or path quoted for a POSIX shell.
pub fn shell_word(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "/._-+=:,@%".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// The character, or a replacement if it would control a terminal or change the text direction.
pub fn harmless(character: char) -> char {
    match character {
        '\n' | '\r' | '\t' | '\u{2028}' | '\u{2029}' => ' ',
        '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\u{200e}' | '\u{200f}' => '\u{fffd}',
        c if c.is_control() => '\u{fffd}',
        c => c,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn excerpts_and_messages_have_a_limited_number_of_characters_of_any_width() {
        assert_eq!(excerpt("short"), "short");
        assert_eq!(excerpt(&"é".repeat(200)), "é".repeat(200));
        let cut = excerpt(&"é".repeat(201));
        assert_eq!((cut.chars().count(), cut.chars().last()), (200, Some('…')));
        assert_eq!(plain("y".repeat(100_000)).chars().count(), LONGEST_MESSAGE);
    }

    #[test]
    fn control_characters_and_changes_of_direction_are_removed() {
        assert_eq!(plain("a\u{1b}[2Jb\r\nc\u{9b}d\u{202e}e"), "a\u{fffd}[2Jb  c\u{fffd}d\u{fffd}e");
        assert_eq!(excerpt("two\nlines"), "two lines");
    }

    #[test]
    fn quotes_in_foreign_messages_are_shortened_and_expectations_are_kept() {
        let message = format!("unknown field `{}`, expected one of `a`, `b`", "x".repeat(5000));
        let shown = foreign(&message);
        assert!(shown.starts_with("unknown field `xxx") && shown.ends_with("…, expected one of `a`, `b`"), "{shown}");
        assert!(shown.matches('x').count() < 200 + 2);
        assert_eq!(foreign("missing field `name`"), "missing field `name`");
    }

    #[test]
    fn nothing_is_quoted_from_files_of_other_programs() {
        for (message, shown) in [
            (
                "invalid type: string \"hunter2, expected x\", expected u32 at line 2 column 4",
                "invalid type: string …, expected u32 at line 2 column 4",
            ),
            ("unknown field `hunter2`, expected one of `a`, `b`", "unknown field …, expected one of `a`, `b`"),
            ("expected 'hunter2' tag, not 'x' at 1:5", "expected … at 1:5"),
            ("missing field `Frames` at line 3", "missing field … at line 3"),
            ("trailing characters at line 1 column 2", "trailing characters at line 1 column 2"),
        ] {
            assert_eq!(unquoted(message), shown);
            assert_eq!(foreign_about(b"secret", message), shown);
            assert_eq!(foreign_about(b"schema = 'skiagraph.scenario/1'", message), foreign(message));
        }
    }

    #[test]
    fn table_cells_contain_neither_formulas_nor_control_characters() {
        for (text, cell) in [
            ("=cmd|' /C calc'!A0", "'=cmd|' /C calc'!A0"),
            (" @SUM(A1)", "' @SUM(A1)"),
            ("+1+1", "'+1+1"),
            ("-2+3", "'-2+3"),
            ("-2.5", "-2.5"),
            ("+1e-3", "+1e-3"),
            ("cam00", "cam00"),
            ("a\u{1b}[2Jb\n=c", "a\u{fffd}[2Jb =c"),
        ] {
            assert_eq!(table_cell(text), cell);
        }
    }
}
