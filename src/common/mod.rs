//! What the rooms of the application share: their error, progress and interruption, and JSON files.

use std::borrow::Cow;
use std::path::PathBuf;

mod error;
mod progress;

pub use error::ExperimentError;
pub use progress::{NoProgress, Progress, Stage};

pub(crate) use error::{ONE_CAMERA, TRY_AGAIN, key_error, read_file, stays_unreadable};
pub(crate) use progress::{OnlyInterruption, advance};

/// Named bytes, in the order in which they are written.
pub type NamedFiles = Vec<(Cow<'static, str>, Vec<u8>)>;

/// A JSON file's bytes, ending in a newline.
pub(crate) fn to_json(value: &impl serde::Serialize) -> Result<Vec<u8>, ExperimentError> {
    let mut bytes = serde_json::to_vec_pretty(value)?;
    bytes.push(b'\n');
    Ok(bytes)
}

/// The middle value, of an even number the greater of the two; `None` without any.
pub(crate) fn median(mut values: Vec<f64>) -> Option<f64> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Frames as ranges, of which the three longest are named, and their number: `31 frames (4-20, 30, 41-53)`.
pub(crate) fn frame_ranges(frames: &[usize]) -> String {
    let ranges: Vec<&[usize]> = frames.chunk_by(|one, next| one + 1 == *next).collect();
    let mut longest = ranges.clone();
    longest.sort_by_key(|range| std::cmp::Reverse(range.len()));
    longest.truncate(MOST_RANGES);
    longest.sort();
    let word = |range: &[usize]| match range {
        [one] => one.to_string(),
        [first, .., last] => format!("{first}-{last}"),
        [] => String::new(),
    };
    let mut words: Vec<String> = longest.iter().map(|range| word(range)).collect();
    if ranges.len() > MOST_RANGES {
        words.push("...".to_owned());
    }
    let unit = if frames.len() == 1 { "frame" } else { "frames" };
    format!("{} {unit} ({})", frames.len(), words.join(", "))
}

/// Sorts files by their names, in which numbers count as such: `9.png` comes before `10.png`.
pub(crate) fn sort_by_numbers(files: &mut [PathBuf]) {
    // a number is compared by its length without leading zeros, and then by its digits; other characters as usual
    let key = |path: &PathBuf| -> Vec<(u8, usize, String)> {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let characters: Vec<char> = name.chars().collect();
        let runs = characters.chunk_by(|a, b| a.is_ascii_digit() && b.is_ascii_digit());
        let part = |run: &[char]| {
            let digits: String = run.iter().collect();
            if !run[0].is_ascii_digit() {
                return (if run[0] < '0' { 0 } else { 2 }, 0, digits);
            }
            let number = digits.trim_start_matches('0').to_owned();
            (1, number.len(), number)
        };
        runs.map(part).collect()
    };
    files.sort_by_cached_key(|path| (key(path), path.clone()));
}

const MOST_RANGES: usize = 3;

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    #[test]
    fn images_without_leading_zeros_are_in_order() {
        let mut files: Vec<PathBuf> =
            ["b10.png", "b9.png", "b1.png", "a.png", "b010c2.png", "b10c1.png"].map(PathBuf::from).to_vec();
        super::sort_by_numbers(&mut files);
        let expected = ["a.png", "b1.png", "b9.png", "b10.png", "b10c1.png", "b010c2.png"].map(PathBuf::from);
        assert_eq!(files, expected);
    }

    #[test]
    fn the_longest_ranges_are_named() {
        assert_eq!(super::frame_ranges(&[7]), "1 frame (7)");
        assert_eq!(super::frame_ranges(&[0, 2, 3, 5, 7, 8, 9]), "7 frames (0, 2-3, 7-9, ...)");
    }
}
