//! Which link of a body carries a segment that weights are given for.

use super::mesh::{SkinError, SkinMesh};
use super::{Influence, MOST_INFLUENCES};
use crate::body::Humanoid;
use std::collections::BTreeMap;

/// Where a body has no link of a segment's own, the segment that carries it; without the side.
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

/// The influences of every vertex: names become links, the greatest are kept and brought to a sum of 1.
pub(super) fn of_links(
    weights: &BTreeMap<String, Vec<(u32, f64)>>,
    mesh: &SkinMesh,
    body: &Humanoid,
) -> Result<Vec<Vec<Influence>>, SkinError> {
    let found: Vec<(&String, Option<usize>)> = weights.keys().map(|name| (name, link_of(body, name))).collect();
    let missing: Vec<&str> = found.iter().filter(|(_, link)| link.is_none()).map(|(name, _)| name.as_str()).collect();
    if !missing.is_empty() {
        let links: Vec<&str> = body.links.iter().map(|link| link.name.as_str()).collect();
        return Err(SkinError::OtherSkeleton {
            skin: mesh.name.clone(),
            segments: missing.join(", "),
            body: body.name.clone(),
            links: links.join(", "),
        });
    }
    let mut influences = vec![Vec::<Influence>::new(); mesh.vertices.len()];
    for ((_, link), pairs) in found.iter().zip(weights.values()) {
        let Some(link) = link.and_then(|link| u32::try_from(link).ok()) else { continue };
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

/// Keeps the [`MOST_INFLUENCES`] greatest, in the order of links, with a sum of 1.
pub(super) fn keep_greatest(own: &mut Vec<Influence>) {
    own.sort_by(|a, b| b.weight.total_cmp(&a.weight).then(a.link.cmp(&b.link)));
    own.truncate(MOST_INFLUENCES);
    own.sort_by_key(|influence| influence.link);
    let sum: f64 = own.iter().map(|influence| influence.weight).sum();
    own.iter_mut().for_each(|influence| influence.weight /= sum);
}

/// The link of that name, or the one that carries the segment.
fn link_of(body: &Humanoid, name: &str) -> Option<usize> {
    if let Some(link) = body.find_link(name) {
        return Some(link);
    }
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
    (part == "pelvis").then_some(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;

    #[test]
    fn segments_that_a_body_lacks_are_carried_by_the_next_one() {
        let (actor, tracker) = (shipped("actor").unwrap(), shipped("tracker25").unwrap());
        for name in ["left_toes", "right_hand", "abdomen", "neck", "left_clavicle"] {
            assert_eq!(actor.links[link_of(&actor, name).unwrap()].name, name);
        }
        let on_tracker = |name| tracker.links[link_of(&tracker, name).unwrap()].name.as_str();
        assert_eq!(on_tracker("left_toes"), "left_shank");
        assert_eq!(on_tracker("right_hand"), "right_forearm");
        assert_eq!(on_tracker("head"), "head");
        assert_eq!(on_tracker("abdomen"), on_tracker("pelvis"));
        assert_eq!(link_of(&actor, "tail"), None);
    }

    #[test]
    fn the_greatest_four_shares_are_kept_and_sum_to_1() {
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
