//! Assignment of files to tar shards, and their names in the shards.

use std::ops::Range;

use super::listing::LAYERS;

/// Path prefix of tar shards with silhouettes, which trackers may read.
pub(super) const OBSERVED: &str = "observations/shards/";

/// Path prefix of tar shards with samples including truth.
pub(super) const WITH_TRUTH: &str = "truth/shards/";

/// The list of the files in shards, by their paths in a set without shards.
pub(super) const PACKED: &str = "packed.sha256";

/// How frames are divided among shards, as evenly as possible.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShardPlan {
    pub(super) shards: usize,
    pub(super) frames: usize,
}

/// Location of a file.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct ShardPlace {
    /// Path of the tar file in the set.
    pub(super) tar: String,
    /// Name of the file in it.
    pub(super) name: String,
}

/// Path of a shard of this kind.
pub(super) fn tar_path(kind: &str, shard: usize) -> String {
    format!("{kind}{shard:06}.tar")
}

/// Whether this is the path of a tar shard.
pub(super) fn is_shard(path: &str) -> bool {
    path.ends_with(".tar") && (path.starts_with(OBSERVED) || path.starts_with(WITH_TRUTH))
}

/// Whether a file exists only because the set has shards; its content is also in the set without shards.
pub(super) fn is_packing(path: &str) -> bool {
    path == PACKED || path.starts_with(OBSERVED) || path.starts_with(WITH_TRUTH)
}

impl ShardPlan {
    /// The frames of a shard.
    pub(super) fn frames_of(&self, shard: usize) -> Range<usize> {
        shard * self.frames / self.shards..(shard + 1) * self.frames / self.shards
    }

    /// The shard of a frame.
    fn shard_of(&self, frame: usize) -> Option<usize> {
        (frame < self.frames && self.shards > 0).then(|| ((frame + 1) * self.shards - 1) / self.frames)
    }

    /// Location of a silhouette or a truth image; `None` for any other file.
    pub(super) fn place_of(&self, path: &str) -> Option<ShardPlace> {
        let (kind, frame, name) = name_in_shard(path)?;
        Some(ShardPlace { tar: tar_path(kind, self.shard_of(frame)?), name })
    }

    /// The shards that must be complete before a silhouette or a truth image can be removed as a separate file.
    pub(super) fn tars_of(&self, path: &str) -> Option<[String; 2]> {
        let (_, frame, _) = name_in_shard(path)?;
        let shard = self.shard_of(frame)?;
        Some([OBSERVED, WITH_TRUTH].map(|kind| tar_path(kind, shard)))
    }
}

/// Frame of a silhouette or a truth image; `None` for any other file.
pub(super) fn frame_of(path: &str) -> Option<usize> {
    name_in_shard(path).map(|(_, frame, _)| frame)
}

/// How the names of truth images end, and those of their copies in samples.
pub(super) const IMAGES_OF_SAMPLES: [(&str, &str); 3] =
    [("-colour.exr", "colour.exr"), ("-depth.png", "depth.png"), (".exr", "layers.exr")];

/// Kind of shard, frame, and name in the shard. Silhouettes keep their paths, so that `tar` unpacks them to their
/// location in a set without shards; truth images are named as parts of samples.
fn name_in_shard(path: &str) -> Option<(&'static str, usize, String)> {
    if let Some((camera, file)) = path.strip_prefix(LAYERS).and_then(|rest| rest.split_once('/')) {
        let (frame, extension) =
            IMAGES_OF_SAMPLES.iter().find_map(|(end, name)| Some((file.strip_suffix(end)?, name)))?;
        return Some((WITH_TRUTH, frame.parse().ok()?, format!("{frame}_{camera}.{extension}")));
    }
    let (_, file) = path.strip_prefix("observations/cam")?.split_once("/silhouette/")?;
    Some((OBSERVED, file.strip_suffix(".png")?.parse().ok()?, path.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blind::silhouette_path;
    use crate::samples;
    use crate::{depth_png, exr_layers};

    #[test]
    fn every_frame_is_in_one_shard_and_no_shard_is_empty() {
        for (frames, shards) in [(1, 1), (7, 3), (529, 8), (9, 9), (10_000, 7)] {
            let plan = ShardPlan { shards, frames };
            let ranges: Vec<Range<usize>> = (0..shards).map(|shard| plan.frames_of(shard)).collect();
            assert_eq!(ranges.iter().cloned().flatten().collect::<Vec<_>>(), (0..frames).collect::<Vec<_>>());
            let sizes = || ranges.iter().map(ExactSizeIterator::len);
            assert!(sizes().max() <= sizes().min().map(|least| least + 1) && sizes().min() > Some(0));
            for (shard, range) in ranges.into_iter().enumerate() {
                assert!(range.into_iter().all(|frame| plan.shard_of(frame) == Some(shard)));
            }
            assert_eq!(plan.shard_of(frames), None);
        }
    }

    #[test]
    fn images_are_named_by_the_keys_of_samples_and_silhouettes_by_their_paths() {
        let plan = ShardPlan { shards: 3, frames: 7 };
        let place = |path: &str| plan.place_of(path).map(|place| (place.tar, place.name));
        let key = samples::key(11, 3);
        let truth = |name: String| Some(("truth/shards/000001.tar".to_owned(), name));
        assert_eq!(place(&exr_layers::path(11, 3)), truth(format!("{key}.layers.exr")));
        assert_eq!(place(&exr_layers::colour_path(11, 3)), truth(format!("{key}.colour.exr")));
        assert_eq!(place(&depth_png::path(11, 3)), truth(format!("{key}.depth.png")));
        let mask = silhouette_path(2, 6);
        assert_eq!(place(&mask), Some(("observations/shards/000002.tar".to_owned(), mask.clone())));
        for other in ["set.toml", "observations/shards/000000.tar", "truth/layers/README", "truth/truth.npz"] {
            assert_eq!((place(other), frame_of(other)), (None, None), "{other}");
        }
    }
}
