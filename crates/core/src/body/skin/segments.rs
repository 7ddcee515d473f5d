//! Assigns the segments of a skin's weights to links of a body.

use super::mesh::{SkinError, SkinMesh};
use super::recognised::links_of_segments;
use super::{Influence, MOST_INFLUENCES};
use crate::body::{Humanoid, LANDMARKS};
use crate::input::{excerpt, excerpts};
use std::collections::BTreeMap;

/// For a body without a link for a segment, the segment that carries it; without the side.
const CARRIED_BY: [(&str, &str); 9] = [
    ("toes", "foot"),
    ("foot", "shank"),
    ("hand", "forearm"),
    ("clavicle", "thorax"),
    ("head", "neck"),
    ("neck", "thorax"),
    ("thorax", "abdomen"),
    ("abdomen", "torso"),
    ("torso", "pelvis"),
];

/// Greatest number of links named in a message.
const MOST_NAMED: usize = 100;

/// The influences of every vertex: names become links, the greatest are kept and normalised.
pub(super) fn of_links(
    weights: &BTreeMap<String, Vec<(u32, f64)>>,
    mesh: &SkinMesh,
    body: &Humanoid,
) -> Result<Vec<Vec<Influence>>, SkinError> {
    let found = found(weights, mesh, body)?;
    let mut influences = vec![Vec::<Influence>::new(); mesh.vertices.len()];
    for (link, pairs) in found.into_iter().zip(weights.values()) {
        let link = link as u32;
        for (vertex, weight) in pairs.iter().filter(|(_, weight)| *weight > 0.0) {
            let own = &mut influences[*vertex as usize];
            match own.iter_mut().find(|influence| influence.link == link) {
                Some(influence) => influence.weight += weight,
                None => own.push(Influence { link, weight: *weight }),
            }
        }
    }
    influences.iter_mut().for_each(keep_greatest);
    Ok(influences)
}

/// Checks that every segment has a link.
pub(super) fn check(
    weights: &BTreeMap<String, Vec<(u32, f64)>>,
    mesh: &SkinMesh,
    body: &Humanoid,
) -> Result<(), SkinError> {
    found(weights, mesh, body).map(drop)
}

/// The link of every segment, in the order of their names.
fn found(
    weights: &BTreeMap<String, Vec<(u32, f64)>>,
    mesh: &SkinMesh,
    body: &Humanoid,
) -> Result<Vec<usize>, SkinError> {
    let segments = SegmentLinks::new(body);
    let found: Vec<(&String, Option<usize>)> = weights.keys().map(|name| (name, segments.link_of(name))).collect();
    let missing: Vec<&str> = found.iter().filter(|(_, link)| link.is_none()).map(|(name, _)| name.as_str()).collect();
    if missing.is_empty() {
        return Ok(found.into_iter().filter_map(|(_, link)| link).collect());
    }
    let links = excerpts(body.links.iter().map(|link| &link.name), MOST_NAMED);
    Err(SkinError::Unsuited(format!(
        "skin `{}` has weights for {}, which `{}` does not have{}; its links are: {links}; rename the groups of the \
         weights, or remove the weights to have them computed by distance",
        excerpt(&mesh.name),
        excerpt(&missing.join(", ")),
        excerpt(&body.name),
        unknown_landmarks(body)
    )))
}

/// Keeps the [`MOST_INFLUENCES`] greatest, in the order of links, normalised.
pub(super) fn keep_greatest(own: &mut Vec<Influence>) {
    own.sort_by(|a, b| b.weight.total_cmp(&a.weight).then(a.link.cmp(&b.link)));
    own.truncate(MOST_INFLUENCES);
    own.sort_by_key(|influence| influence.link);
    let sum: f64 = own.iter().map(|influence| influence.weight).sum();
    own.iter_mut().for_each(|influence| influence.weight /= sum);
}

/// Describes the landmarks that the body lacks; empty if it has all.
fn unknown_landmarks(body: &Humanoid) -> String {
    let pairs = LANDMARKS.iter().zip(&body.markers);
    let unknown: Vec<&str> = pairs.filter(|(_, marker)| marker.is_none()).map(|(own, _)| own.name()).collect();
    if unknown.is_empty() {
        String::new()
    } else {
        format!(
            " (no link has this name or is recognised as this segment, because the body lacks the landmarks {}; place \
             them with fixed, empty links marker_NAME)",
            unknown.join(", ")
        )
    }
}

/// Segments whose links have these names on a robot built like the built-in ones.
const OWN_LIMBS: [&str; 4] = ["upper_arm", "forearm", "thigh", "shank"];

struct SegmentLinks<'a> {
    body: &'a Humanoid,
    /// Whether its limbs are named as in the built-in robots.
    has_own_limbs: bool,
    /// For a robot with other names, or with another trunk.
    recognised: Option<BTreeMap<String, usize>>,
}

impl<'a> SegmentLinks<'a> {
    fn new(body: &'a Humanoid) -> Self {
        let has = |part: &str| ["left", "right"].iter().all(|side| body.find_link(&format!("{side}_{part}")).is_some());
        let has_own_limbs = OWN_LIMBS.into_iter().all(has);
        let links = || Some(links_of_segments(body)).filter(|links| !has_own_limbs || has_other_trunk(body, links));
        let is_like_actor = has_own_limbs && body.find_link("thorax").is_some();
        Self { body, has_own_limbs, recognised: if is_like_actor { None } else { links() } }
    }

    /// The link with this name, the one recognised as the segment, or the one that carries it.
    fn link_of(&self, name: &str) -> Option<usize> {
        // a one-piece trunk is mostly the chest
        let segment = if name == "torso" { "thorax" } else { name };
        let recognised = || self.recognised.as_ref().and_then(|links| links.get(segment).copied());
        let own = self.body.find_link(name).or_else(recognised).or_else(|| carrier(self.body, name));
        // built-in robots have their pelvis at the root; for other robots this is unknown
        own.or_else(|| (self.has_own_limbs && is_of_trunk(name)).then_some(0))
    }
}

/// Whether a link other than the root carries the thorax under another name: `chest`.
fn has_other_trunk(body: &Humanoid, links: &BTreeMap<String, usize>) -> bool {
    body.find_link("thorax").is_none() && links.get("thorax").is_some_and(|link| *link != 0)
}

/// The link that carries a segment without its own link.
fn carrier(body: &Humanoid, name: &str) -> Option<usize> {
    let (side, mut part) = match name.split_once('_') {
        Some((side @ ("left" | "right"), part)) => (side, part),
        _ => ("", name),
    };
    for (segment, carrier) in CARRIED_BY {
        if part == segment {
            part = carrier;
            let link = body.find_link(&format!("{side}_{part}")).or_else(|| body.find_link(part));
            if link.is_some() {
                return link;
            }
        }
    }
    None
}

/// Whether a segment belongs to the trunk, whose fallback is the pelvis.
fn is_of_trunk(name: &str) -> bool {
    let part = name.split_once('_').map_or(name, |(_, part)| part);
    name == "pelvis" || CARRIED_BY[3..].iter().any(|(segment, _)| [name, part].contains(segment))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;

    fn link_of(body: &Humanoid, name: &str) -> Option<usize> {
        SegmentLinks::new(body).link_of(name)
    }

    /// Every segment that weights may name, with its links on the built-in robots. Regression test: the trunk of
    /// `tracker40` was assigned to its pelvis.
    #[test]
    fn every_segment_has_the_link_that_moves_it_on_built_in_robots() {
        let (actor, tracker25, tracker40) =
            ["actor", "tracker25", "tracker40"].map(|robot| shipped(robot).unwrap()).into();
        for (segment, of_actor, of_25, of_40) in [
            ("pelvis", "pelvis", "pelvis", "pelvis"),
            ("torso", "pelvis", "pelvis", "chest"),
            ("abdomen", "abdomen", "pelvis", "chest"),
            ("thorax", "thorax", "pelvis", "chest"),
            ("neck", "neck", "pelvis", "chest"),
            ("head", "head", "head", "head"),
            ("_clavicle", "_clavicle", "pelvis", "_clavicle"),
            ("_upper_arm", "_upper_arm", "_upper_arm", "_upper_arm"),
            ("_forearm", "_forearm", "_forearm", "_forearm"),
            ("_hand", "_hand", "_forearm", "_hand"),
            ("_thigh", "_thigh", "_thigh", "_thigh"),
            ("_shank", "_shank", "_shank", "_shank"),
            ("_foot", "_foot", "_shank", "_foot"),
            ("_toes", "_toes", "_shank", "_foot"),
        ] {
            for side in ["left", "right"] {
                let of_side =
                    |name: &str| if name.starts_with('_') { format!("{side}{name}") } else { name.to_owned() };
                for (body, expected) in [(&actor, of_actor), (&tracker25, of_25), (&tracker40, of_40)] {
                    let found = link_of(body, &of_side(segment)).map(|link| body.links[link].name.as_str());
                    let expected = of_side(expected);
                    assert_eq!(found, Some(expected.as_str()), "{} on {}", of_side(segment), body.name);
                }
            }
        }
        assert_eq!(link_of(&actor, "tail"), None);
    }

    /// Regression test: the thorax of a robot with other names was assigned to its root.
    #[test]
    fn segments_of_robots_with_other_names_are_recognised_or_unknown_but_never_the_root() {
        let mut body = shipped("actor").unwrap();
        body.links.iter_mut().for_each(|link| link.name = format!("part_of_{}", link.name));
        for name in ["thorax", "left_upper_arm", "right_toes", "head"] {
            assert_eq!(body.links[link_of(&body, name).unwrap()].name, format!("part_of_{name}"));
        }
        body.markers = Default::default();
        for name in ["pelvis", "thorax", "left_upper_arm", "head"] {
            assert_eq!(link_of(&body, name), None);
        }
    }

    #[test]
    fn the_greatest_four_weights_are_kept_and_sum_to_1() {
        let mut own: Vec<Influence> = [0.3, 0.05, 0.3, 0.2, 0.15]
            .iter()
            .zip(0..)
            .map(|(weight, link)| Influence { link, weight: *weight })
            .collect();
        keep_greatest(&mut own);
        assert_eq!(own.iter().map(|i| i.link).collect::<Vec<_>>(), [0, 2, 3, 4]);
        assert!((own.iter().map(|i| i.weight).sum::<f64>() - 1.0).abs() < 1e-15);
    }
}
