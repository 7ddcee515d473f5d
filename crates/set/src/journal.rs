//! Which files of a set that is being drawn are whole: a line for each as soon as it is written, as `sha256sum` writes
//! it.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};

use super::SetError;
use super::listing::{Stop, files_below, listing_line, listing_parts, unless};
use super::shard_plan::ShardPlan;
use crate::input::{self, hex_sha256_of, limits};
use crate::parallel;

/// SHA-256 of whole files, by their paths.
#[derive(Debug, Default)]
pub(super) struct WholeFiles {
    /// Of files of their own.
    pub(super) loose: BTreeMap<String, String>,
    /// Of those in shards.
    pub(super) packed: BTreeMap<String, String>,
}

/// A journal that lines are added to, from any thread.
#[derive(Debug)]
pub(super) struct Journal {
    path: PathBuf,
    file: Mutex<File>,
}

impl Journal {
    /// Goes on with the journal at `path` of the files in `folder`, or begins one: the files that are whole, by the
    /// SHA-256 of what is there now. All others in `folder` are removed, for they may be half written. Files that lie
    /// in whole shards of `plan` are whole, too.
    pub(super) fn resume(
        path: &Path,
        folder: &Path,
        plan: Option<ShardPlan>,
        stop: Stop<'_>,
    ) -> Result<(Self, WholeFiles), SetError> {
        let listed: Vec<(String, String)> = listed_in(path)?.into_iter().collect();
        let is_whole = |index: usize| {
            let (path, digest): &(String, String) = &listed[index];
            let found = File::open(folder.join(path)).and_then(hex_sha256_of);
            !stop() && found.is_ok_and(|found| found == *digest)
        };
        let are_whole = parallel::map(listed.len(), is_whole);
        unless(stop)?;
        let (loose, others): (Vec<_>, Vec<_>) = listed.into_iter().zip(are_whole).partition(|(_, whole)| *whole);
        let loose: BTreeMap<String, String> = loose.into_iter().map(|(line, _)| line).collect();
        for file in files_below(folder, "")?.iter().filter(|file| !loose.contains_key(*file)) {
            let file = folder.join(file);
            fs::remove_file(&file).map_err(SetError::io(&file, "remove"))?;
        }
        let tars = |path: &String| plan.and_then(|plan| plan.tars_of(path));
        let is_packed = |path: &String| tars(path).is_some_and(|tars| tars.iter().all(|tar| loose.contains_key(tar)));
        let packed = others.into_iter().map(|(line, _)| line).filter(|(path, _)| is_packed(path)).collect();
        let whole = WholeFiles { loose, packed };
        // written anew: the last line may be cut
        let lines: String = whole.loose.iter().chain(&whole.packed).map(listing_line).collect();
        let meanwhile = path.with_extension("writing");
        let written = fs::write(&meanwhile, lines).and_then(|()| fs::rename(&meanwhile, path));
        let opened = written.and_then(|()| File::options().append(true).open(path));
        let file = Mutex::new(opened.map_err(SetError::io(path, "write"))?);
        Ok((Self { path: path.to_owned(), file }, whole))
    }

    /// A file is whole.
    pub(super) fn add(&self, path: &String, digest: &String) -> Result<(), SetError> {
        let line = listing_line((path, digest));
        let mut file = self.file.lock().unwrap_or_else(PoisonError::into_inner);
        file.write_all(line.as_bytes()).map_err(SetError::io(&self.path, "write"))
    }
}

/// The whole lines of a journal: digests by path; none where there is no journal.
fn listed_in(path: &Path) -> Result<BTreeMap<String, String>, SetError> {
    let bytes = match input::read(path, limits::LISTING) {
        Ok(bytes) => bytes,
        Err(e) if e.kind() == std::io::ErrorKind::NotFound => return Ok(BTreeMap::new()),
        Err(e) => return Err(SetError::io(path, "read")(e)),
    };
    let text = String::from_utf8_lossy(&bytes);
    let lines = text.split_inclusive('\n').filter_map(|line| listing_parts(line.strip_suffix('\n')?));
    Ok(lines.map(|(digest, path)| (path.to_owned(), digest.to_owned())).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::hex_sha256;

    #[test]
    fn files_that_are_cut_changed_or_not_listed_are_drawn_again_and_a_cut_line_is_none() {
        let root = tempfile::tempdir().unwrap();
        let (folder, path) = (root.path().join("set"), root.path().join("finished.sha256"));
        fs::create_dir_all(folder.join("deep")).unwrap();
        for (name, text) in [("a", "one"), ("deep/b", "two"), ("c", "three"), ("d", "four"), ("deep/e", "five")] {
            fs::write(folder.join(name), text).unwrap();
        }
        let line = |name: &str, text: &str| format!("{}  {name}\n", hex_sha256(text.as_bytes()));
        let lines = line("a", "one") + &line("deep/b", "two") + "nonsense\n" + &line("c", "other") + &line("gone", "x");
        fs::write(&path, lines.clone() + line("d", "four").trim_end()).unwrap();
        let (journal, whole) = Journal::resume(&path, &folder, None, &|| false).unwrap();
        assert_eq!(whole.loose.keys().collect::<Vec<_>>(), ["a", "deep/b"]);
        assert_eq!(files_below(&folder, "").unwrap(), ["a", "deep/b"]);
        journal.add(&"f".to_owned(), &hex_sha256(b"six")).unwrap();
        let now = fs::read_to_string(&path).unwrap();
        assert_eq!(now, line("a", "one") + &line("deep/b", "two") + &line("f", "six"));
        assert!(matches!(Journal::resume(&path, &folder, None, &|| true), Err(SetError::Stopped)));
    }
}
