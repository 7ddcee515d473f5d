//! What a set is known by: the lines whose SHA-256 is its hash.
//!
//! A line a file, as `sha256sum` writes it. Truth images and shards do not count: they follow from the rest, and
//! images in shards stand with the paths that they have without. Nor does what explains the files (`README.txt`,
//! `FORMATS.txt` and `read_truth.py`): better explanations are no other test.
//!
//! In sets with a key (`truth/key.txt`) all lines of the truth are one, `truth`, the SHA-256 of these lines. The key is
//! among them, so that nobody can compute that line, or the hash of the set, from a guess of the truth. A set without
//! its truth has the lines of the complete one in `complete.sha256`.

use std::collections::BTreeMap;
use std::path::Path;

use super::SetError;
use super::listing::{COMPLETE, FORMATS, KEY_FILE, LAYERS, LISTING, READER, README, digests_in};
use super::shard_plan::is_packing;
use crate::input::{self, hex_sha256, limits, listing_of};

/// What [`super::BlindSet::set_hash`] covers, in words.
pub const SET_HASH_COVERS: &str = "what is tested: observations, start, cameras and truth, without layers and shards";

/// What [`super::BlindSet::full_hash`] covers, in words.
pub const FULL_HASH_COVERS: &str = "every file, layers and shards included; sha256sum files.sha256";

/// The one line of a truth with a key.
const SEALED: &str = "truth";

/// What sets with other people, and sets whose cameras film, have besides; `README.txt` explains it there.
const DISTRACTORS: &str = "truth/distractors.npz";
const MOMENTS: &str = "cameras.npz";

/// SHA-256 of `README.txt` when sets were first known by their hash: without and with cameras that film, then the same
/// with other people. Sets without a key are known by these, whatever the file explains since.
const FIRST_READMES: [[&str; 2]; 2] = [
    [
        "ec52a03f92ac218c00647563bf07594f0b5e3e9ec1cfdc45e0c65d6fe24d1fcb",
        "b6b941a9c2b7953cafc8ba82341c315743f446ceae5843833ce1b876c2b9a1c8",
    ],
    [
        "98cf30972ea17ba54810046f3fd82b1db713b2232ee2101cb264703155d6a057",
        "79d74546e26330a9cfb43d5c45a374efaca56e7dfb6f566d082bcd4ce6e28586",
    ],
];

/// The same of `read_truth.py`.
const FIRST_READER: &str = "cf953c013cc3b756720858845fc718df82e5669e017700ae77ea720e423c8348";

/// Whether a file belongs to what a set is known by.
fn counts(path: &str) -> bool {
    !path.starts_with(LAYERS) && !is_packing(path) && path != FORMATS
}

/// The lines of a complete set, of all its files, those in shards included.
pub(super) fn identity_lines(files: &BTreeMap<&String, &String>) -> String {
    let counted = files.iter().filter(|(path, _)| counts(path)).map(|(path, digest)| (path.as_str(), digest.as_str()));
    if files.keys().any(|path| *path == KEY_FILE) {
        return sealed(counted);
    }
    let has = |path: &str| usize::from(files.keys().any(|known| *known == path));
    let readme = FIRST_READMES[has(DISTRACTORS)][has(MOMENTS)];
    let as_first = |(path, digest)| match path {
        README => line(path, readme),
        READER => line(path, FIRST_READER),
        _ => line(path, digest),
    };
    counted.map(as_first).collect()
}

/// The lines of a set with a key.
fn sealed<'a>(files: impl Iterator<Item = (&'a str, &'a str)>) -> String {
    let (truth, others): (Vec<_>, Vec<_>) = files.partition(|(path, _)| path.starts_with("truth/"));
    let truth: String = truth.into_iter().map(|(path, digest)| line(path, digest)).collect();
    let others = others.into_iter().filter(|(path, _)| ![README, READER].contains(path));
    let others: String = others.map(|(path, digest)| line(path, digest)).collect();
    others + &line(SEALED, &hex_sha256(truth.as_bytes()))
}

fn line(path: &str, digest: &str) -> String {
    listing_of([(&path.to_owned(), &digest.to_owned())])
}

/// The lines of the complete set, in a set without its truth whose files are `listed`, those in shards included; each
/// file that is there must be among them.
pub(super) fn complete_lines(
    directory: &Path,
    own: Option<&String>,
    listed: &BTreeMap<&String, &String>,
) -> Result<Option<String>, SetError> {
    let Some(own) = own else { return Ok(None) };
    let path = directory.join(COMPLETE);
    let text = input::read_to_string(&path, limits::LISTING).map_err(SetError::io(&path, "read"))?;
    let found = hex_sha256(text.as_bytes());
    if found != *own {
        let file = path.display().to_string();
        return Err(SetError::Tampered { file, listed: own.clone(), found });
    }
    let complete = digests_in(directory, COMPLETE, &text)?;
    let shared = |path: &str| {
        let is_apart = path.starts_with("truth/") || [README, READER, COMPLETE, SEALED].contains(&path);
        counts(path) && !is_apart
    };
    let here = listed.iter().map(|(path, digest)| (*path, *digest)).filter(|(path, _)| shared(path));
    if here.eq(complete.iter().filter(|(path, _)| shared(path))) {
        Ok(Some(text))
    } else {
        let detail = format!("{LISTING} and {COMPLETE} list different files; get the set again");
        Err(SetError::NotASet { path: directory.to_owned(), detail })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{distractors_file, moments_file};

    fn lines_of(files: &[(&str, &str)]) -> String {
        let files: Vec<(String, String)> =
            files.iter().map(|(path, text)| ((*path).to_owned(), hex_sha256(text.as_bytes()))).collect();
        identity_lines(&files.iter().map(|(path, digest)| (path, digest)).collect())
    }

    const PLAIN: [(&str, &str); 5] = [
        ("README.txt", "words"),
        ("set.toml", "a"),
        ("truth/layers/x.exr", "b"),
        ("truth/shards/000000.tar", "c"),
        ("truth/truth.npz", "d"),
    ];

    #[test]
    fn explanations_layers_and_shards_do_not_change_what_a_set_is_known_by() {
        let whole = lines_of(&PLAIN);
        let mut other = PLAIN;
        (other[0].1, other[2].1, other[3].1) = ("better words", "x", "y");
        assert_eq!(lines_of(&other), whole);
        assert_eq!(lines_of(&[PLAIN[0], PLAIN[1], PLAIN[4]]), whole);
        assert_eq!((DISTRACTORS, MOMENTS), (distractors_file::PATH, moments_file::PATH));
        assert!(whole.contains(FIRST_READMES[0][0]) && whole.lines().count() == 3, "{whole}");
        for at in [1, 4] {
            let mut other = PLAIN;
            other[at].1 = "changed";
            assert_ne!(lines_of(&other), whole);
        }
    }

    #[test]
    fn a_key_hides_the_lines_of_the_truth_and_changes_with_each() {
        let with = |truth: &'static str, key: &'static str| {
            let mut files = PLAIN.to_vec();
            files[4].1 = truth;
            files.insert(2, (KEY_FILE, key));
            lines_of(&files)
        };
        let lines = with("d", "one");
        assert_eq!(lines.lines().count(), 2, "{lines}");
        assert!(lines.lines().last().unwrap().ends_with("  truth"), "{lines}");
        assert!(!lines.contains(&hex_sha256(b"d")) && !lines.contains(&hex_sha256(b"one")), "{lines}");
        assert!(lines != with("e", "one") && lines != with("d", "two"));
    }
}
