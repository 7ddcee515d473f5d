//! Points at which a camera's rays graze a body.

use std::sync::OnceLock;

use nalgebra::{Isometry3, Point3, Vector3};

use super::mesh_outline::{MeshOutline, sample_edges};
use super::samples::{OutlineSample, SampleSink};
use skiagraph_core::body::{Humanoid, LinkFrames, Skin, Solid};
use skiagraph_core::camera::Camera;
use skiagraph_core::raster::{Mask, TaperedCapsule};

/// A body's solids, prepared for sampling their outlines.
#[derive(Debug)]
pub(in crate::tracker) struct BodyOutline {
    /// Solids other than tapered capsules: link, index of the solid on it, and surface.
    surfaces: Vec<(usize, u32, MeshOutline)>,
}

impl BodyOutline {
    pub(in crate::tracker) fn new(body: &Humanoid) -> Self {
        let of_link = |(link, solids): (usize, &Vec<Solid>)| {
            let surface = |(number, solid)| Some((link, number, MeshOutline::from_solid(solid)?));
            (0..).zip(solids).filter_map(surface).collect::<Vec<_>>()
        };
        // a skin hides all solids
        let drawn = if body.skin.is_some() { &[] } else { body.links.as_slice() };
        Self { surfaces: drawn.iter().map(|l| &l.solids).enumerate().flat_map(of_link).collect() }
    }

    /// Samples about `spacing` pixels apart on the outlines of all solids beyond the near plane: those on the contour
    /// of the `drawn` body, or all if it is absent, including parts hidden by other solids.
    pub(in crate::tracker) fn sample(
        &self,
        body: &Humanoid,
        frames: &LinkFrames,
        camera: &Camera,
        spacing: f64,
        drawn: Option<&Mask>,
        samples: &mut Vec<OutlineSample>,
    ) {
        let pinhole = &camera.pinhole;
        let mut sink = SampleSink { link: 0, solid: 0, pinhole, drawn, samples };
        if let Some(skin) = &body.skin {
            return sample_skin(skin, frames, camera, spacing, &mut sink);
        }
        for (link, solids) in body.links.iter().map(|link| &link.solids).enumerate() {
            let camera_from_link = camera.camera_from_world * frames[link];
            for (number, solid) in (0..).zip(solids) {
                if let Solid::TaperedCapsule(capsule) = solid {
                    (sink.link, sink.solid) = (link, number);
                    sample_capsule(&capsule.transformed(&camera_from_link), spacing, &mut sink);
                }
            }
        }
        for (link, solid, surface) in &self.surfaces {
            let camera_from_link: Isometry3<f64> = camera.camera_from_world * frames[*link];
            (sink.link, sink.solid) = (*link, *solid);
            surface.sample(&camera_from_link, spacing, &mut sink);
        }
    }

    /// A vertex of a solid other than a tapered capsule, in its link's frame.
    pub(in crate::tracker) fn vertex(&self, link: usize, solid: u32, vertex: u32) -> Option<Point3<f64>> {
        let found = self.surfaces.iter().find(|(of, number, _)| (*of, *number) == (link, solid));
        found.and_then(|(_, _, surface)| surface.vertex(vertex))
    }
}

/// Samples of a skin's outline. Each belongs to the link with the largest skinning weight at the edge's first end: a
/// descent step moves it with that link only, and the next step deforms the skin again.
fn sample_skin(skin: &Skin, frames: &LinkFrames, camera: &Camera, spacing: f64, sink: &mut SampleSink<'_>) {
    let mut vertices = Vec::new();
    skin.deform_with(&camera.camera_from_world, frames, &mut vertices);
    let edges = skin.topology().edges().iter().map(|edge| (edge.ends, edge.triangles));
    let parts = skin.parts();
    sample_edges(&vertices, skin.topology().triangles(), edges, spacing, sink, |sink, ends| {
        sink.link = parts[ends[0] as usize] as usize;
    });
}

/// The outline of a tapered capsule: two sides, along which planes through the camera's centre touch both balls, and
/// the part of each ball's grazing circle that the other ball does not cover.
fn sample_capsule(capsule: &TaperedCapsule, spacing: f64, sink: &mut SampleSink<'_>) {
    for (normal, [from, to]) in sides(capsule).into_iter().flatten() {
        let (Some(a), Some(b)) = (sink.project(&from), sink.project(&to)) else { continue };
        let Some(normal) = sink.grazed_normal(&normal) else { continue };
        let steps = ((a[0] - b[0]).hypot(a[1] - b[1]) / spacing).ceil().clamp(1.0, MAX_SAMPLES) as u32;
        for step in 0..steps {
            let share = (f64::from(step) + 0.5) / f64::from(steps);
            sink.push(from + share * (to - from), normal, [0, 1], share);
        }
    }
    let TaperedCapsule { a, b, radius_a, radius_b } = *capsule;
    for (end, centre, radius, other, other_radius) in [(0, a, radius_a, b, radius_b), (1, b, radius_b, a, radius_a)] {
        let beyond = |normal: &Vector3<f64>| normal.dot(&(other - centre)) + other_radius - radius < 0.0;
        sample_ball(&centre, radius, spacing, beyond, end, sink);
    }
}

/// Maximum number of samples: a side that is partly behind the camera may project to an unbounded length.
const MAX_SAMPLES: f64 = 512.0;

/// The circle at which rays graze the ball at one `end` of a capsule, limited to normals for which `is_outline` holds.
///
/// With centre c, radius r and unit normal n, the grazed points are c + r n with n.(c + r n) = 0, that is n.c = -r.
fn sample_ball(
    centre: &Point3<f64>,
    radius: f64,
    spacing: f64,
    is_outline: impl Fn(&Vector3<f64>) -> bool,
    end: u32,
    sink: &mut SampleSink<'_>,
) {
    let square = centre.coords.norm_squared();
    let rest = 1.0 - radius * radius / square;
    if radius <= 0.0 || rest <= 0.0 || centre.z <= sink.pinhole.near {
        return;
    }
    let axis = centre.coords / square.sqrt();
    let across = if axis.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
    let first = axis.cross(&across).normalize();
    let second = axis.cross(&first);
    let circumference = 2.0 * std::f64::consts::PI * radius * sink.pinhole.focal[1] / centre.z;
    let count = (circumference / spacing).ceil().clamp(1.0, MAX_SAMPLES) as usize;
    for [sin, cos] in directions(count) {
        let normal = axis * (-radius / square.sqrt()) + (first * *cos + second * *sin) * rest.sqrt();
        if is_outline(&normal)
            && let Some(direction) = sink.grazed_normal(&normal)
        {
            sink.push(centre + normal * radius, direction, [end, end], 0.0);
        }
    }
}

/// Sines and cosines of `count` directions around a circle, up to [`MAX_SAMPLES`], computed once.
fn directions(count: usize) -> &'static [[f64; 2]] {
    static KEPT: [OnceLock<Vec<[f64; 2]>>; MAX_SAMPLES as usize + 1] =
        [const { OnceLock::new() }; MAX_SAMPLES as usize + 1];
    let direction = |k: usize| <[f64; 2]>::from(libm::sincos(2.0 * std::f64::consts::PI * k as f64 / count as f64));
    KEPT[count].get_or_init(|| (0..count).map(direction).collect())
}

/// A side of a capsule as seen by the camera: its outward normal and its ends.
pub(in crate::tracker) type CapsuleSide = (Vector3<f64>, [Point3<f64>; 2]);

/// Outward normals of the two planes through the camera's centre that touch both balls, and the points of contact;
/// `None` if one ball hides the other.
///
/// Such a plane has n.a = -ra and n.b = -rb. With w = a x b and q = ra b - rb a that is
/// n = -(q x w +- w sqrt(|w|^2 - |q|^2)) / |w|^2.
pub(in crate::tracker) fn sides(capsule: &TaperedCapsule) -> [Option<CapsuleSide>; 2] {
    let (a, b) = (capsule.a.coords, capsule.b.coords);
    let (w, q) = (a.cross(&b), capsule.radius_a * b - capsule.radius_b * a);
    let (square, rest) = (w.norm_squared(), w.norm_squared() - q.norm_squared());
    if square <= 0.0 || rest <= 0.0 {
        return [None; 2];
    }
    [1.0, -1.0].map(|sign| {
        let normal = -(q.cross(&w) + sign * rest.sqrt() * w) / square;
        Some((normal, [capsule.a + capsule.radius_a * normal, capsule.b + capsule.radius_b * normal]))
    })
}
