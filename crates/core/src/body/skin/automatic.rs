//! Weights by distance to the links' solids.
//!
//! A link's share of a vertex falls with the fourth power of the vertex's distance from the link's solids. Only the
//! nearest link and its neighbours contribute: otherwise hands hanging beside the thighs would be bound to them, and
//! one thigh to the other. Two passes of smoothing over the mesh's edges follow.

use std::collections::BTreeMap;

use nalgebra::Point3;

use super::mesh::SkinError;
use super::segments::keep_greatest;
use super::{Influence, MOST_INFLUENCES};
use crate::body::{Humanoid, LinkFrames, Solid};
use crate::input::excerpt;

/// Least distance used, metres: it keeps weights smooth for vertices inside several solids.
const LEAST_DISTANCE: f64 = 0.005;

/// Number of smoothing passes.
const PASSES: usize = 2;

/// The influences of every vertex, with the body's links at `bind`.
pub(super) fn weights(
    body: &Humanoid,
    bind: &LinkFrames,
    vertices: &[Point3<f64>],
    triangles: &[[u32; 3]],
) -> Result<Vec<Vec<Influence>>, SkinError> {
    let solid_links: Vec<usize> = (0..body.links.len()).filter(|&link| !body.links[link].solids.is_empty()).collect();
    if solid_links.is_empty() {
        return Err(SkinError::Unsuited(format!(
            "`{}` has no solids, so weights cannot be computed by distance; give the skin a file of weights",
            excerpt(&body.name)
        )));
    }
    let neighbours = neighbours(body, &solid_links);
    let near = |point: &Point3<f64>| {
        let distances: Vec<f64> = solid_links.iter().map(|&link| distance(body, link, bind, point)).collect();
        let nearest = (0..solid_links.len()).min_by(|&a, &b| distances[a].total_cmp(&distances[b])).unwrap_or(0);
        let share = |&index: &usize| {
            let depth = distances[index].max(LEAST_DISTANCE);
            Influence { link: solid_links[index] as u32, weight: libm::pow(depth, -4.0) }
        };
        let mut own: Vec<Influence> = neighbours[nearest].iter().map(share).collect();
        keep_greatest(&mut own);
        own
    };
    let mut influences: Vec<Vec<Influence>> = vertices.iter().map(near).collect();
    for _ in 0..PASSES {
        influences = smoothed(&influences, triangles);
    }
    Ok(influences)
}

/// For every link in `solid_links`, by its index there, the link itself and those joined to it, skipping links without
/// solids.
fn neighbours(body: &Humanoid, solid_links: &[usize]) -> Vec<Vec<usize>> {
    let mut neighbours: Vec<Vec<usize>> = (0..solid_links.len()).map(|index| vec![index]).collect();
    for (index, &link) in solid_links.iter().enumerate() {
        let mut above = body.parent(link);
        while let Some(parent) = above {
            if let Ok(other) = solid_links.binary_search(&parent) {
                neighbours[index].push(other);
                neighbours[other].push(index);
                break;
            }
            above = body.parent(parent);
        }
    }
    neighbours
}

/// Distance of a point from a link's solids, metres; negative inside capsules.
fn distance(body: &Humanoid, link: usize, bind: &LinkFrames, point: &Point3<f64>) -> f64 {
    let own = bind[link].inverse_transform_point(point);
    body.links[link].solids.iter().map(|solid| from_solid(solid, &own)).fold(f64::INFINITY, f64::min)
}

fn from_solid(solid: &Solid, point: &Point3<f64>) -> f64 {
    match solid {
        Solid::TaperedCapsule(capsule) => {
            let (axis, from) = (capsule.b - capsule.a, point - capsule.a);
            let along = (from.dot(&axis) / axis.norm_squared().max(1e-18)).clamp(0.0, 1.0);
            (from - axis * along).norm() - (capsule.radius_a + along * (capsule.radius_b - capsule.radius_a))
        }
        Solid::Box { link_from_box, half_extents } => {
            let own = link_from_box.inverse_transform_point(point);
            (0..3).map(|i| (own[i].abs() - half_extents[i]).max(0.0)).map(|d| d * d).sum::<f64>().sqrt()
        }
        Solid::Cylinder { link_from_cylinder, radius, half_length } => {
            let own = link_from_cylinder.inverse_transform_point(point);
            libm::hypot((libm::hypot(own.x, own.y) - radius).max(0.0), (own.z.abs() - half_length).max(0.0))
        }
        Solid::Mesh { vertices, .. } => vertices.iter().map(|v| (v - point).norm()).fold(f64::INFINITY, f64::min),
    }
}

/// Replaces every vertex's influences by the mean of its own and those of its neighbours.
fn smoothed(influences: &[Vec<Influence>], triangles: &[[u32; 3]]) -> Vec<Vec<Influence>> {
    let mut around: Vec<Vec<u32>> = vec![Vec::new(); influences.len()];
    for triangle in triangles {
        for side in 0..3 {
            let (a, b) = (triangle[side], triangle[(side + 1) % 3]);
            around[a as usize].push(b);
            around[b as usize].push(a);
        }
    }
    let mean = |(vertex, others): (usize, &mut Vec<u32>)| {
        others.sort_unstable();
        others.dedup();
        let mut sums: BTreeMap<u32, f64> = BTreeMap::new();
        let share = 0.5 / others.len().max(1) as f64;
        let own = if others.is_empty() { 1.0 } else { 0.5 };
        let all = others.iter().map(|other| (*other as usize, share)).chain([(vertex, own)]);
        for (from, share) in all {
            influences[from].iter().for_each(|i| *sums.entry(i.link).or_default() += share * i.weight);
        }
        let mut mean: Vec<Influence> = sums.into_iter().map(|(link, weight)| Influence { link, weight }).collect();
        keep_greatest(&mut mean);
        debug_assert!(mean.len() <= MOST_INFLUENCES);
        mean
    };
    around.iter_mut().enumerate().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::body::shipped;

    #[test]
    fn limb_vertices_belong_to_their_limb_and_hands_are_not_bound_to_thighs() {
        let body = shipped("actor").unwrap();
        let frames = body.link_frames(&body.zero_pose());
        let link = |name: &str| body.find_link(name).unwrap();
        let at = |name: &str, z: f64| frames[link(name)] * Point3::new(0.0, 0.0, z);
        // beside the hanging hand, on the side of the thigh, nearer to the hand
        let hand = at("left_hand", -0.08) - nalgebra::Vector3::y() * 0.03;
        let points = [at("left_thigh", -0.2), at("right_forearm", -0.13), hand];
        let found = weights(&body, &frames, &points, &[]).unwrap();
        let share = |vertex: usize, name| {
            let link = link(name) as u32;
            found[vertex].iter().filter(|i| i.link == link).map(|i| i.weight).sum::<f64>()
        };
        assert!(share(0, "left_thigh") > 0.95 && share(0, "right_thigh") == 0.0, "{:?}", found[0]);
        assert!(share(1, "right_forearm") > 0.9);
        assert!(share(2, "left_hand") > 0.5 && share(2, "left_thigh") == 0.0, "{:?}", found[2]);
        assert!(found.iter().all(|own| (own.iter().map(|i| i.weight).sum::<f64>() - 1.0).abs() < 1e-12));
    }

    #[test]
    fn a_body_without_solids_is_refused() {
        let mut body = shipped("tracker25").unwrap();
        let frames = body.link_frames(&body.zero_pose());
        body.links.iter_mut().for_each(|link| link.solids.clear());
        assert!(weights(&body, &frames, &[Point3::origin()], &[]).unwrap_err().to_string().contains("no solids"));
    }
}
