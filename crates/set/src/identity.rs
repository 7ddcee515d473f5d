//! The identity of a set: the lines whose SHA-256 is the set hash.
//!
//! There is one line per file in the format of `sha256sum`. Truth images are excluded: they follow from the rest. The
//! files that explain a set (`README.txt`, `FORMATS.txt`, `read_truth.py`, `truth/made_by.json`) are excluded too:
//! better explanations do not change the test.
//!
//! In sets with a key (`truth/key.txt`) all lines of the truth are replaced by one, `truth`, with their SHA-256. They
//! include the key, so neither this line nor the set hash can be computed from a guess of the truth. A set without its
//! truth has the lines of the complete set in `complete.sha256`.

use std::collections::BTreeMap;
use std::path::Path;

use super::SetError;
use super::format::listing::{
    COMPLETE, FOOTAGE_MADE_BY, FORMATS, KEY_FILE, LAYERS, LISTING, MADE_BY, READER, README, digests_in,
};
use skiagraph_core::input;
use skiagraph_core::input::{hex_sha256, limits, listing_of};

/// Description of what [`super::BlindSet::set_hash`] covers.
pub const SET_HASH_COVERS: &str = "what is tested: observations, start, cameras and truth, without layers";

/// Description of what [`super::BlindSet::full_hash`] covers.
pub const FULL_HASH_COVERS: &str = "every file, layers included; sha256sum files.sha256";

/// Name in the line that replaces the truth in sets with a key.
const SEALED: &str = "truth";

/// Additional files of sets with distractors, and of sets with moving or timed cameras; their `README.txt` differs.
const DISTRACTORS: &str = "truth/distractors.npz";
const MOMENTS: &str = "cameras.npz";

/// SHA-256 of the first published `README.txt`: without and with moving cameras, then the same with distractors. The
/// identity of sets without a key uses these, so that it stays the same when the file is edited.
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

/// The same for `read_truth.py`.
const FIRST_READER: &str = "cf953c013cc3b756720858845fc718df82e5669e017700ae77ea720e423c8348";

/// Whether a file belongs to the identity of a set.
fn is_identifying(path: &str) -> bool {
    !path.starts_with(LAYERS) && ![FORMATS, MADE_BY, FOOTAGE_MADE_BY].contains(&path)
}

/// The identity of a complete set, from all its files.
pub(super) fn identity_lines(files: &BTreeMap<&String, &String>) -> String {
    let counted =
        files.iter().filter(|(path, _)| is_identifying(path)).map(|(path, digest)| (path.as_str(), digest.as_str()));
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

/// The identity of a set with a key.
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

/// The identity of the complete set, read from a set without its truth whose files are `listed`, including those in
/// shards. Every present file must agree with it.
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
        let is_separate = path.starts_with("truth/") || [README, READER, COMPLETE, SEALED].contains(&path);
        is_identifying(path) && !is_separate
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
    use crate::format::{distractors_file, moments_file};

    fn lines_of(files: &[(&str, &str)]) -> String {
        let files: Vec<(String, String)> =
            files.iter().map(|(path, text)| ((*path).to_owned(), hex_sha256(text.as_bytes()))).collect();
        identity_lines(&files.iter().map(|(path, digest)| (path, digest)).collect())
    }

    const PLAIN: [(&str, &str); 6] = [
        ("README.txt", "words"),
        ("set.toml", "a"),
        ("truth/layers/x.exr", "b"),
        ("truth/truth.npz", "d"),
        (MADE_BY, "{}"),
        (FORMATS, "said"),
    ];

    #[test]
    fn explanations_and_layers_do_not_change_the_identity_of_a_set() {
        let whole = lines_of(&PLAIN);
        let mut other = PLAIN;
        (other[0].1, other[2].1, other[4].1, other[5].1) = ("better words", "x", "y", "z");
        assert_eq!(lines_of(&other), whole);
        assert_eq!(lines_of(&[PLAIN[0], PLAIN[1], PLAIN[3]]), whole);
        assert_eq!((DISTRACTORS, MOMENTS), (distractors_file::PATH, moments_file::PATH));
        assert!(whole.contains(FIRST_READMES[0][0]) && whole.lines().count() == 3, "{whole}");
        for at in [1, 3] {
            let mut other = PLAIN;
            other[at].1 = "changed";
            assert_ne!(lines_of(&other), whole);
        }
    }

    #[test]
    fn a_key_hides_the_lines_of_the_truth_and_changes_with_each() {
        let with = |truth: &'static str, key: &'static str| {
            let mut files = PLAIN.to_vec();
            files[3].1 = truth;
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
