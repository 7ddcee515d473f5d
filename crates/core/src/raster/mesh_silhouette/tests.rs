use super::*;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};

const PINHOLE: Pinhole =
    Pinhole { focal: [300.0, 310.0], principal_point: [160.0, 118.0], width: 320, height: 240, near: 0.05 };

/// The result of [`paint_triangles`], triangle by triangle.
fn painted(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Mask {
    let mut mask = Mask::new(320, 240);
    paint_triangles(&PINHOLE, vertices, triangles, &mut mask);
    mask
}

fn drawn(vertices: &[Point3<f64>], triangles: &[[u32; 3]]) -> Mask {
    let mut mask = Mask::new(320, 240);
    let topology = MeshTopology::new(vertices.len(), triangles);
    topology.paint(&PINHOLE, vertices, &mut MeshScratch::default(), &mut mask);
    mask
}

fn soup(seed: u64, vertices: usize, triangles: usize, near: f64) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let mut rng = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    let mut within = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let places = (0..vertices).map(|_| Point3::new(within(-1.5, 1.5), within(-1.2, 1.2), within(near, 4.0))).collect();
    let corner = |rng: &mut dyn FnMut(f64, f64) -> f64| rng(0.0, vertices as f64 - 0.01) as u32;
    let triangles = (0..triangles).map(|_| [(); 3].map(|()| corner(&mut within))).collect();
    (places, triangles)
}

#[test]
fn random_triangles_have_the_silhouette_of_single_triangles() {
    // the last has unusually many edges in a row
    for (seed, vertices, triangles, most) in (0..40).map(|seed| (seed, 12, 9, 1)).chain([(3, 300, 400, 2)]) {
        let (vertices, triangles) = soup(seed, vertices, triangles, 1.0);
        let (drawn, painted) = (drawn(&vertices, &triangles), painted(&vertices, &triangles));
        let differing = drawn.count() + painted.count() - 2 * drawn.count_common(&painted);
        // a pixel centre may be on an edge up to rounding
        assert!(differing <= most, "{differing} of {} in {seed}", painted.count());
    }
}

#[test]
fn parts_nearer_than_the_near_plane_are_cut_off() {
    let (vertices, triangles) = soup(7, 12, 9, -1.0);
    assert!(vertices.iter().any(|v| v.z < 0.05));
    assert_eq!(drawn(&vertices, &triangles), painted(&vertices, &triangles));
}

#[test]
fn shared_edges_of_a_closed_mesh_leave_neither_gaps_nor_double_pixels() {
    // a fan around a vertex on a pixel centre, seen from both sides
    let ring = |k: u32| {
        let (sin, cos) = libm::sincos(f64::from(k) * 0.4);
        Point3::new(cos, sin, 3.0)
    };
    let mut vertices = vec![Point3::new(0.5 / 300.0 * 3.0, 0.5 / 310.0 * 3.0, 3.0)];
    vertices.extend((0..15).map(ring));
    let fan: Vec<[u32; 3]> = (0..15).map(|k| [0, 1 + k, 1 + (k + 1) % 15]).collect();
    let back: Vec<[u32; 3]> = fan.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
    let mask = drawn(&vertices, &fan);
    assert_eq!(mask, drawn(&vertices, &back), "whichever side it shows");
    assert_eq!(mask, drawn(&vertices, &[fan.clone(), back].concat()), "twice");
    for y in 0..240 {
        assert!(mask.runs(y).count() <= 1, "row {y} has a hole");
    }
}

#[test]
fn all_instruction_sets_and_both_methods_give_the_same_pixels_with_reused_buffers() {
    let (mut scratch, mut other) = (MeshScratch::default(), MeshScratch::default());
    let camera_from_world = Isometry3::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.2, -0.1, 0.4));
    for seed in 0..30 {
        let (vertices, triangles) = soup(seed, 60, 20 + 5 * seed as usize, if seed % 7 == 3 { -1.0 } else { 2.0 });
        let topology = MeshTopology::new(vertices.len(), &triangles);
        let in_camera: Vec<_> = vertices.iter().map(|vertex| camera_from_world * vertex).collect();
        let mut masks = [Mask::new(320, 240), Mask::new(320, 240), Mask::new(320, 240)];
        topology.paint(&PINHOLE, &in_camera, &mut scratch, &mut masks[0]);
        let mut columns = MeshVertices::default();
        columns.replace(&vertices);
        other.draw_here(&topology, &PINHOLE, &camera_from_world, &columns);
        other.image.merge_into(&mut masks[1]);
        let mut best = MeshScratch::default();
        dispatch(Drawing(&mut best, &topology, &camera_from_world, &columns));
        best.image.merge_into(&mut masks[2]);
        assert_eq!(masks[1], masks[2], "{seed}");
        let differing = masks[0].count() + masks[1].count() - 2 * masks[0].count_common(&masks[1]);
        assert!(differing <= 1, "{differing} in {seed}; a centre on an edge may explain one");
    }
}

struct Drawing<'a>(&'a mut MeshScratch, &'a MeshTopology, &'a Isometry3<f64>, &'a MeshVertices);

impl Dispatched for Drawing<'_> {
    type Output = ();

    #[inline(always)]
    fn work(self) {
        self.0.draw_here(self.1, &PINHOLE, self.2, self.3);
    }
}

#[test]
fn more_triangles_than_can_be_counted_in_a_pixel_are_drawn_one_by_one() {
    let (places, _) = soup(11, 70_000, 0, 1.0);
    let corner = |place: &Point3<f64>, x: f64, y: f64| place + Vector3::new(x, y, 0.0);
    let corners = |place: &Point3<f64>| [*place, corner(place, 0.02, 0.0), corner(place, 0.0, 0.02)];
    let vertices: Vec<_> = places.iter().flat_map(corners).collect();
    let triangles: Vec<_> = (0..70_000).map(|k| [3 * k, 3 * k + 1, 3 * k + 2]).collect();
    assert_eq!(drawn(&vertices, &triangles), painted(&vertices, &triangles));
    let few = &triangles[..300];
    assert_eq!(drawn(&vertices, few), painted(&vertices, few));
}

#[test]
fn a_mesh_is_clipped_at_the_image_border_and_invalid_indices_are_ignored() {
    let square = [[-9.0, -0.5], [0.0, -0.5], [0.0, 0.5], [-9.0, 0.5]].map(|[x, y]| Point3::new(x, y, 1.0));
    let mask = drawn(&square, &[[0, 1, 2], [0, 2, 3], [0, 1, 77]]);
    let is_seen = |x: u32, y: u32| x < 160 && (118.0 - 155.0..118.0 + 155.0).contains(&(f64::from(y) + 0.5));
    assert_eq!(mask, Mask::from_fn(320, 240, is_seen));
    let beside = square.map(|p| p + Vector3::new(40.0, 0.0, 0.0));
    assert!(drawn(&beside, &[[0, 1, 2], [0, 2, 3]]).is_empty());
}
