//! Regions of a body: groups of links, for results by part of the body.

use serde::{Deserialize, Serialize};

use super::{Humanoid, Landmark, skin::links_of_segments};

/// A region of a body. Left and right limbs are one region.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum BodyRegion {
    /// Head and neck.
    Head,
    /// Pelvis, abdomen, thorax and collar bones.
    Trunk,
    /// Shoulders to elbows.
    UpperArms,
    /// Elbows to finger tips.
    ForearmsAndHands,
    /// Hips to knees.
    Thighs,
    /// Knees to toes.
    ShanksAndFeet,
}

/// Every region, from head to feet.
pub const BODY_REGIONS: [BodyRegion; 6] = [
    BodyRegion::Head,
    BodyRegion::Trunk,
    BodyRegion::UpperArms,
    BodyRegion::ForearmsAndHands,
    BodyRegion::Thighs,
    BodyRegion::ShanksAndFeet,
];

/// Segments of the trunk: the links from the root to them belong to the trunk.
const TRUNK: [(&str, Option<Landmark>); 5] = [
    ("pelvis", Some(Landmark::Pelvis)),
    ("abdomen", None),
    ("thorax", Some(Landmark::Thorax)),
    ("left_clavicle", None),
    ("right_clavicle", None),
];
/// Head, arms and legs, with their segments from the trunk outwards.
const CHAINS: [&[(&str, Landmark, BodyRegion)]; 5] = {
    use BodyRegion as R;
    use Landmark as L;
    [
        &[("neck", L::HeadTop, R::Head), ("head", L::HeadTop, R::Head)],
        &[
            ("left_upper_arm", L::LeftShoulder, R::UpperArms),
            ("left_forearm", L::LeftElbow, R::ForearmsAndHands),
            ("left_hand", L::LeftWrist, R::ForearmsAndHands),
        ],
        &[
            ("right_upper_arm", L::RightShoulder, R::UpperArms),
            ("right_forearm", L::RightElbow, R::ForearmsAndHands),
            ("right_hand", L::RightWrist, R::ForearmsAndHands),
        ],
        &[
            ("left_thigh", L::LeftHip, R::Thighs),
            ("left_shank", L::LeftKnee, R::ShanksAndFeet),
            ("left_foot", L::LeftAnkle, R::ShanksAndFeet),
        ],
        &[
            ("right_thigh", L::RightHip, R::Thighs),
            ("right_shank", L::RightKnee, R::ShanksAndFeet),
            ("right_foot", L::RightAnkle, R::ShanksAndFeet),
        ],
    ]
};

impl BodyRegion {
    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Head => "head",
            Self::Trunk => "trunk",
            Self::UpperArms => "upper arms",
            Self::ForearmsAndHands => "forearms and hands",
            Self::Thighs => "thighs",
            Self::ShanksAndFeet => "shanks and feet",
        }
    }

    /// The region of every link, by the body's landmarks. The hinges of a joint belong to the segment that the joint
    /// moves, and everything else to the region of its parent: fingers to the hand. A link that carries two segments
    /// belongs to the one nearer to the trunk: a leg without a knee is a thigh.
    pub fn of_links(body: &Humanoid) -> Vec<Self> {
        let segments = links_of_segments(body);
        let link_of = |name: &str, landmark: Option<Landmark>| {
            segments.get(name).copied().or_else(|| Some(body.markers[landmark? as usize]?.link))
        };
        let chains = CHAINS.map(|chain| {
            let own =
                chain.iter().filter_map(|(name, landmark, region)| Some((link_of(name, Some(*landmark))?, *region)));
            own.collect::<Vec<_>>()
        });
        let of_trunk = TRUNK.iter().filter_map(|(name, landmark)| link_of(name, *landmark));
        let mut regions = vec![None; body.links.len()];
        for link in of_trunk.flat_map(|link| path_to_root(body, link)).chain(meetings(body, &chains)) {
            regions[link] = Some(Self::Trunk);
        }
        for (link, region) in chains.iter().flatten() {
            regions[*link].get_or_insert(*region);
        }
        for (link, region) in chains.iter().flatten() {
            for hinge in path_to_root(body, *link).skip(1) {
                if regions[hinge].is_some() {
                    break;
                }
                regions[hinge] = Some(*region);
            }
        }
        // parents come first
        let mut found: Vec<Self> = Vec::with_capacity(regions.len());
        for (link, region) in regions.into_iter().enumerate() {
            let of_parent = body.parent(link).map_or(Self::Trunk, |parent| found[parent]);
            found.push(region.unwrap_or(of_parent));
        }
        found
    }
}

/// A link and its ancestors, the root last.
fn path_to_root(body: &Humanoid, link: usize) -> impl Iterator<Item = usize> {
    std::iter::successors(Some(link), |&link| body.parent(link))
}

/// The root, and the links from which two or more of the chains branch off.
fn meetings(body: &Humanoid, chains: &[Vec<(usize, BodyRegion)>]) -> Vec<usize> {
    let mut chains_below = vec![0_usize; body.links.len()];
    for chain in chains {
        let mut is_above = vec![false; body.links.len()];
        chain.iter().flat_map(|(link, _)| path_to_root(body, *link)).for_each(|link| is_above[link] = true);
        chains_below.iter_mut().zip(is_above).for_each(|(count, is_above)| *count += usize::from(is_above));
    }
    let meet = chains_below.iter().enumerate().filter(|(link, count)| *link == 0 || **count > 1);
    meet.map(|(link, _)| link).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;

    fn by_name(body: &Humanoid) -> Vec<(String, BodyRegion)> {
        body.links.iter().map(|link| link.name.clone()).zip(BodyRegion::of_links(body)).collect()
    }

    /// The region by the link's name, for built-in robots; `None` for hinges.
    fn expected(name: &str) -> Option<BodyRegion> {
        let name = name.strip_prefix("left_").or_else(|| name.strip_prefix("right_")).unwrap_or(name);
        Some(match name {
            "head" | "neck" => BodyRegion::Head,
            "pelvis" | "abdomen" | "thorax" | "torso" | "clavicle" => BodyRegion::Trunk,
            "upper_arm" => BodyRegion::UpperArms,
            "forearm" | "hand" => BodyRegion::ForearmsAndHands,
            "thigh" => BodyRegion::Thighs,
            "shank" | "foot" | "toes" => BodyRegion::ShanksAndFeet,
            _ => return None,
        })
    }

    #[test]
    fn links_of_built_in_robots_belong_to_the_region_of_their_name() {
        for robot in ["actor", "tracker25", "tracker40"] {
            let body = shipped(robot).unwrap();
            let found = by_name(&body);
            for (name, region) in &found {
                if let Some(expected) = expected(name) {
                    assert_eq!(*region, expected, "{robot}: {name}");
                }
            }
            for region in BODY_REGIONS {
                assert!(found.iter().any(|(_, own)| *own == region), "{robot} has no {}", region.name());
            }
        }
    }

    #[test]
    fn a_hinge_belongs_to_the_segment_that_it_moves() {
        let body = shipped("actor").unwrap();
        let regions = BodyRegion::of_links(&body);
        for link in 1..body.links.len() {
            let drawn = |link: usize| !body.links[link].solids.is_empty();
            if drawn(link) {
                let hinges = path_to_root(&body, link).skip(1).take_while(|up| *up != 0 && !drawn(*up));
                for hinge in hinges {
                    let next = (1..body.links.len()).find(|next| body.parent(*next) == Some(hinge)).unwrap();
                    assert_eq!(regions[hinge], regions[next], "{}", body.links[hinge].name);
                }
            }
        }
    }

    #[test]
    fn a_body_without_landmarks_is_all_trunk_and_one_without_a_knee_has_thighs_only() {
        let mut body = shipped("actor").unwrap();
        body.markers[Landmark::LeftKnee as usize] = None;
        body.markers[Landmark::LeftAnkle as usize] = None;
        let found = by_name(&body);
        let region = |name: &str| found.iter().find(|(link, _)| link == name).map(|(_, region)| *region);
        assert_eq!(region("left_foot"), Some(BodyRegion::Thighs));
        assert_eq!(region("right_foot"), Some(BodyRegion::ShanksAndFeet));
        body.markers = [None; crate::body::LANDMARKS.len()];
        assert!(BodyRegion::of_links(&body).iter().all(|region| *region == BodyRegion::Trunk));
    }

    #[test]
    fn regions_in_files_keep_their_names() {
        let text = serde_json::to_string(&BODY_REGIONS).unwrap();
        assert_eq!(text, r#"["head","trunk","upper_arms","forearms_and_hands","thighs","shanks_and_feet"]"#);
        assert!(BODY_REGIONS.is_sorted());
    }
}
