//! Limbs missed by the segmentation.

use std::sync::Arc;

use rand::RngExt;

use super::{Corruption, Draw, draws};
use skiagraph_core::body::{Humanoid, Landmark};
use skiagraph_core::rng::KeyedSeed;

/// Duration for which a limb is missing, seconds.
const INTERVAL_S: f64 = 0.5;

/// Landmarks at which the parts that may be missing begin.
const LIMBS: [Landmark; 4] = [Landmark::LeftElbow, Landmark::RightElbow, Landmark::LeftKnee, Landmark::RightKnee];

/// Copies of a body, each without one limb from the link of its elbow or knee marker on. Limbs without a marker are
/// skipped.
pub(super) fn without_limbs(body: &Humanoid) -> Vec<Humanoid> {
    let roots = LIMBS.iter().filter_map(|limb| Some(body.markers[*limb as usize]?.link));
    roots.filter(|root| *root > 0).map(|root| without_subtree(body, root)).collect()
}

fn without_subtree(body: &Humanoid, root: usize) -> Humanoid {
    let mut reduced = body.clone();
    let mut removed = vec![false; body.links.len()];
    for link in root..body.links.len() {
        // parents come first; joint `link - 1` moves `link`
        removed[link] = link == root || removed[body.joints[link - 1].parent];
        if removed[link] {
            reduced.links[link].solids.clear();
        }
    }
    reduced.skin = reduced.skin.map(|skin| Arc::new(skin.without_links(&removed)));
    reduced
}

/// Index, out of `limbs`, of the limb missing in camera `camera` at `time_s`, if any.
pub(super) fn missing(
    corruption: &Corruption,
    seed: KeyedSeed,
    time_s: f64,
    camera: usize,
    limbs: usize,
) -> Option<usize> {
    if corruption.missing_limb == 0.0 || limbs == 0 {
        return None;
    }
    let interval = (time_s / INTERVAL_S).floor().max(0.0) as usize;
    let mut random = draws(seed, interval, Draw::Limb, camera);
    (random.random::<f64>() < corruption.missing_limb).then(|| random.random_range(0..limbs))
}

#[cfg(test)]
mod tests {
    use super::*;
    use skiagraph_core::body::{Skin, shipped, shipped_skin};

    #[test]
    fn a_missing_limb_includes_all_its_descendants_and_nothing_else() {
        let body = shipped("actor").unwrap();
        let limbs = without_limbs(&body);
        assert_eq!(limbs.len(), 4);
        let bare = |less: &Humanoid| -> Vec<String> {
            let both = body.links.iter().zip(&less.links);
            both.filter(|(a, b)| a.solids.len() != b.solids.len()).map(|(a, _)| a.name.clone()).collect()
        };
        for (limb, hand) in limbs.iter().zip(["left_hand", "right_hand", "left_foot", "right_foot"]) {
            let bare = bare(limb);
            assert!(bare.contains(&hand.to_owned()), "{bare:?}");
            let side = &hand[..4];
            assert!(bare.iter().all(|name| name.starts_with(side)), "{bare:?}");
            assert!(!bare.iter().any(|name| name.contains("thorax") || name.contains("pelvis")));
        }
    }

    #[test]
    fn a_missing_limb_includes_its_part_of_the_skin() {
        let mesh = shipped_skin("person_coarse").unwrap();
        let mut body = shipped("actor").unwrap();
        let bind = body.link_frames(&body.zero_pose());
        body.skin = Some(Arc::new(Skin::bound(&mesh, &body, &bind).unwrap()));
        let whole = body.skin.as_ref().unwrap();
        for less in without_limbs(&body) {
            let left = less.skin.as_ref().unwrap();
            let of_gone = |link: u32| less.links[link as usize].solids.len() < body.links[link as usize].solids.len();
            let lost = (0..whole.triangles().len()).filter(|t| of_gone(whole.part_of(*t))).count();
            assert!(lost > 10, "{lost}");
            assert_eq!(left.triangles().len(), whole.triangles().len() - lost);
            assert!((0..left.triangles().len()).all(|t| !of_gone(left.part_of(t))));
        }
    }

    #[test]
    fn limbs_are_missing_for_half_a_second_in_the_given_share_of_time() {
        let corruption = Corruption { missing_limb: 0.25, ..Corruption::default() };
        let spells: Vec<_> =
            (0..4000).map(|i| missing(&corruption, 8.into(), f64::from(i) * 0.5 + 0.01, 0, 4)).collect();
        let share = spells.iter().flatten().count();
        assert!(share.abs_diff(1000) < 4 * 28, "{share}");
        for (i, spell) in spells.iter().enumerate() {
            assert_eq!(missing(&corruption, 8.into(), i as f64 * 0.5 + 0.49, 0, 4), *spell);
        }
        let of_limb = |limb| spells.iter().flatten().filter(|l| **l == limb).count();
        assert!((0..4).all(|limb| of_limb(limb).abs_diff(share / 4) < 70));
    }
}
