use nalgebra::{Isometry3, Point2, Point3, Vector3};
use rand::RngExt;

use super::*;
use crate::body::{Link, Ray, shipped, shipped_skin};
use crate::camera::{Distortion, FieldOfView};
use crate::rng::{Purpose, stream};

/// A camera `distance` metres from the world's origin, looking at it; at yaw 0 it sees the body's front.
fn camera(width: u32, yaw: f64, distance: f64, distortion: Distortion) -> Camera {
    let outwards = Vector3::new(yaw.cos(), yaw.sin(), 0.0);
    let eye = Point3::from(outwards * distance);
    let view = FieldOfView::Horizontal(0.98);
    let camera = Camera::look_at("test", eye, eye - outwards, Vector3::z(), view, width, width * 3 / 4).unwrap();
    Camera { distortion, ..camera }
}

fn lens() -> Distortion {
    Distortion::from_coefficients([-0.25, 0.09, 0.001, -0.0008, 0.0])
}

fn mask_of(body: &Humanoid, frames: &LinkFrames, camera: &Camera) -> Mask {
    SilhouettePainter::new(camera).silhouette(body, frames)
}

fn iou(a: &Mask, b: &Mask) -> f64 {
    let common = a.count_common(b) as f64;
    common / (a.count() as f64 + b.count() as f64 - common)
}

/// An independent method: every pixel's ray against every solid.
fn by_every_ray(body: &Humanoid, frames: &LinkFrames, camera: &Camera) -> Mask {
    let world_from_camera = camera.camera_from_world.inverse();
    Mask::from_fn(camera.pinhole.width, camera.pinhole.height, |x, y| {
        let (u, v) = camera.pinhole.normalised(&Point2::new(f64::from(x) + 0.5, f64::from(y) + 0.5));
        let Some((u, v)) = camera.distortion.undistort(u, v) else { return false };
        let direction = Vector3::new(u, v, 1.0);
        let ray = Ray { origin: (direction * camera.pinhole.near).into(), direction }.transformed(&world_from_camera);
        body.links.iter().zip(&frames.0).any(|(link, world_from_link)| {
            let ray = ray.transformed(&world_from_link.inverse());
            link.solids.iter().any(|solid| solid.ray_entry(&ray).is_some())
        })
    })
}

fn single(solid: Solid) -> Humanoid {
    let mut body = shipped("tracker25").unwrap();
    body.links = vec![Link { name: "only".into(), solids: vec![solid], inertia: None }];
    body.joints.clear();
    body.degrees_of_freedom.clear();
    body
}

/// A cube of half edge `h` as a mesh.
fn cube_mesh(h: f64) -> Solid {
    let vertices = (0..8).map(|i| {
        let side = |bit: u32| if i >> bit & 1 == 1 { h } else { -h };
        Point3::new(side(0), side(1), side(2))
    });
    let quads = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Solid::Mesh { vertices: vertices.collect(), triangles }
}

#[test]
fn the_two_standing_robots_have_nearly_the_same_silhouette() {
    let (tracker, actor) = (shipped("tracker25").unwrap(), shipped("actor").unwrap());
    for yaw in [0.0, 0.8, 1.6, 2.5, 3.1] {
        let camera = camera(640, yaw, 3.5, Distortion::default());
        let masks = [&tracker, &actor].map(|body| mask_of(body, &body.link_frames(&body.zero_pose()), &camera));
        assert!(masks[0].count() > 7_000, "the body fills {} pixels", masks[0].count());
        let bounds = masks[0].bounds();
        assert!(bounds.top > 0 && bounds.bottom < 480, "upright and within the image: {bounds:?}");
        let overlap = iou(&masks[0], &masks[1]);
        assert!(overlap > 0.9, "yaw {yaw}: {overlap}");
    }
}

#[test]
fn solids_of_every_kind_agree_with_every_pixel_ray() {
    let frame = Isometry3::new(Vector3::new(0.1, 0.2, -0.1), Vector3::new(0.5, 0.3, -0.7));
    let kinds = [
        Solid::Box { link_from_box: frame, half_extents: [0.3, 0.2, 0.5] },
        Solid::Cylinder { link_from_cylinder: frame, radius: 0.3, half_length: 0.5 },
        cube_mesh(0.4),
        Solid::TaperedCapsule(TaperedCapsule {
            a: Point3::new(0.0, 0.3, 0.5),
            b: Point3::new(0.2, -0.2, -0.3),
            radius_a: 0.3,
            radius_b: 0.1,
        }),
    ];
    let mut rng = stream(5, Purpose::Corruption, 0, 0, 0);
    let mut seen = 0;
    for body in kinds.map(single) {
        for round in 0..12 {
            let mut pose = body.zero_pose();
            let mut turn = || 3.0 * (rng.random::<f64>() - 0.5);
            pose.world_from_root =
                Isometry3::new(Vector3::new(turn(), turn(), turn()), Vector3::new(turn(), turn(), turn()));
            let distortion = if round % 2 == 0 { lens() } else { Distortion::default() };
            // From well in front of the body to inside it.
            let camera = camera(160, turn(), 0.5 * f64::from(round % 4), distortion);
            let frames = body.link_frames(&pose);
            let (drawn, expected) = (mask_of(&body, &frames, &camera), by_every_ray(&body, &frames, &camera));
            let differing = drawn.count() + expected.count() - 2 * drawn.count_common(&expected);
            assert!(differing <= 1 + expected.count() / 1000, "{differing} of {}: round {round}", expected.count());
            seen += expected.count();
        }
    }
    assert!(seen > 30_000, "{seen}");
}

/// A person with the shipped skin, in a pose of its own for every seed.
fn skinned(seed: u64) -> (Humanoid, LinkFrames) {
    let mut body = shipped("actor").unwrap();
    let bind = body.link_frames(&body.zero_pose());
    body.skin = Some(Skin::bound(&shipped_skin("person").unwrap(), &body, &bind).unwrap().into());
    let mut random = stream(seed, Purpose::Refinement, 0, 0, 0);
    let mut pose = body.zero_pose();
    pose.joint_angles.iter_mut().for_each(|angle| *angle = 0.8 * (random.random::<f64>() - 0.5));
    pose.world_from_root = Isometry3::translation(0.0, 0.4 * (random.random::<f64>() - 0.5), random.random());
    let frames = body.link_frames(&pose);
    (body, frames)
}

#[test]
fn a_skin_drawn_through_a_lens_by_its_edges_is_that_drawn_by_its_triangles() {
    let pincushion = Distortion::from_coefficients([0.12, 0.02, -0.001, 0.0005, 0.0]);
    let (mut by_edges, mut inside) = (0, 0);
    for seed in 0..40 {
        let (body, frames) = skinned(seed);
        let lens = [lens(), pincushion, Distortion::default()][seed as usize % 3];
        // from near enough that head or feet are out of the image to so far that triangles are smaller than pixels
        let camera = camera(200, seed as f64, 1.2 + 0.15 * seed as f64, lens);
        let (skin, rays, near) = (body.skin.as_ref().unwrap(), PixelRays::new(&camera), camera.pinhole.near);
        let mut vertices = Vec::new();
        skin.deform_with(&camera.camera_from_world, &frames, &mut vertices);
        let mut by_triangles = Mask::new(200, 150);
        let mut visit = |x, y, _, _| by_triangles.set(x, y, true);
        solid::each_depth_of_mesh(&vertices, skin.triangles(), &rays, near, &mut visit);
        let (mut scratch, mut mask) = (LensScratch::default(), Mask::new(200, 150));
        if mesh_through_lens::paint(skin.topology(), &vertices, &rays, near, &mut scratch, &mut mask) {
            by_edges += 1;
            assert_eq!(mask, by_triangles, "seed {seed}");
        }
        inside += by_triangles.count();
        assert_eq!(SilhouettePainter::new(&camera).silhouette(&body, &frames), by_triangles, "seed {seed}");
    }
    assert!(by_edges > 25 && inside > 20_000, "{by_edges} of 40 are drawn by their edges, {inside} pixels");
}

#[test]
fn the_pixels_that_see_a_triangle_are_those_of_every_ray() {
    let mut random = stream(5, Purpose::Refinement, 0, 0, 0);
    let folded = Distortion::from_coefficients([-0.6, 0.0, 0.0, 0.0, 0.0]);
    let mut seen = 0;
    for number in 0..60 {
        let camera = camera(48, 0.0, 2.0, [lens(), folded, Distortion::default()][number % 3]);
        let rays = PixelRays::new(&camera);
        let size = [0.02, 0.3, 3.0][number / 3 % 3];
        let middle = Vector3::new(random.random::<f64>() - 0.5, random.random::<f64>() - 0.5, 1.0) * 2.0;
        let mut corner = || Point3::from(middle + Vector3::from_fn(|_, _| size * (random.random::<f64>() - 0.5)));
        let corners = [corner(), corner(), corner()];
        let mut found = Mask::new(48, 36);
        let mut visit = |x, y, _, _| found.set(x, y, true);
        solid::each_depth_of_mesh(&corners, &[[0, 1, 2]], &rays, 0.05, &mut visit);
        let triangle = Solid::Mesh { vertices: corners.to_vec(), triangles: vec![[0, 1, 2]] };
        let expected = Mask::from_fn(48, 36, |x, y| {
            let [u, v] = rays.ray(x, y);
            let direction = Vector3::new(u, v, 1.0);
            !u.is_nan() && triangle.ray_entry(&Ray { origin: (direction * 0.05).into(), direction }).is_some()
        });
        assert_eq!(found, expected, "triangle {number}");
        seen += found.count();
    }
    assert!(seen > 2000, "{seen}");
}
