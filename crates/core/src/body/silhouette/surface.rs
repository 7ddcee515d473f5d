//! The surface point seen by every pixel.

use nalgebra::{Isometry3, Point3, Unit, Vector3};

use super::regions::Reach;
use super::{SilhouettePainter, solid};
use crate::body::{Humanoid, LinkFrames, Prop, Skin, Solid};

/// The nearest surface point at the centre of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SurfacePixel {
    /// Column.
    pub x: u32,
    /// Row.
    pub y: u32,
    /// Index of the link or prop.
    pub part: usize,
    /// Depth along the camera's z axis, metres.
    pub depth: f64,
    /// The point in the link's frame; for a prop, in the world.
    pub point_in_link: Point3<f64>,
    /// Outward normal in the world, towards the camera.
    pub normal_in_world: Unit<Vector3<f64>>,
    /// For a body with a skin, the point on the skin: it moves with the skin, not with one link.
    pub on_skin: Option<SkinPoint>,
}

/// A point on a skin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkinPoint {
    /// Index of the triangle.
    pub triangle: u32,
    /// Barycentric coordinates: shares of the triangle's corners.
    pub shares: [f64; 3],
}

impl SkinPoint {
    /// The point of the plane of triangle `[a, b, c]` nearest to `p`.
    fn new(triangle: u32, [a, b, c]: &[Point3<f64>; 3], p: &Point3<f64>) -> Self {
        let normal = (b - a).cross(&(c - a));
        let share = |q: &Point3<f64>, r: &Point3<f64>| (q - p).cross(&(r - p)).dot(&normal) / normal.norm_squared();
        let (first, second) = (share(b, c), share(c, a));
        Self { triangle, shares: [first, second, 1.0 - first - second] }
    }

    /// Its position with the vertices of `skin` at `vertices`.
    pub fn at(&self, skin: &Skin, vertices: &[Point3<f64>]) -> Option<Point3<f64>> {
        let corners = skin.triangles().get(self.triangle as usize)?;
        let term = |(corner, share): (&u32, f64)| Some(vertices.get(*corner as usize)?.coords * share);
        corners.iter().zip(self.shares).map(term).sum::<Option<Vector3<f64>>>().map(Point3::from)
    }
}

/// The nearest surface found so far at a pixel.
#[derive(Clone, Copy)]
struct Nearest {
    depth: f64,
    part: u32,
    solid: u32,
    facet: u32,
}

const NOTHING: Nearest = Nearest { depth: f64::INFINITY, part: u32::MAX, solid: 0, facet: 0 };

impl SilhouettePainter {
    /// The surface of a body seen at pixel centres, row by row; pixels that show none are omitted. The same pixels as
    /// in [`Self::depth`].
    pub fn surface(&mut self, humanoid: &Humanoid, frames: &LinkFrames) -> Vec<SurfacePixel> {
        if let Some(skin) = &humanoid.skin {
            return self.surface_of_skin(skin, frames);
        }
        let parts: Vec<(&[Solid], Isometry3<f64>)> =
            humanoid.links.iter().map(|link| link.solids.as_slice()).zip(frames.0.iter().copied()).collect();
        self.surface_of(&parts)
    }

    /// As [`Self::surface`], for props.
    pub fn surface_of_props(&mut self, props: &[Prop]) -> Vec<SurfacePixel> {
        let parts: Vec<_> =
            props.iter().map(|prop| (std::slice::from_ref(&prop.solid), Isometry3::identity())).collect();
        self.surface_of(&parts)
    }

    /// For a skin: the part is the link that carries most of the triangle, the normal is the triangle's.
    fn surface_of_skin(&mut self, skin: &Skin, frames: &LinkFrames) -> Vec<SurfacePixel> {
        let near = self.camera.pinhole.near;
        let world_from_camera = self.camera.camera_from_world.inverse();
        skin.deform_with(&self.camera.camera_from_world, frames, &mut self.skin);
        let (rays, vertices) = (self.rays(), &self.skin);
        let window = rays.window(Reach::around(vertices.iter().copied()).view(near).into_iter());
        let mut nearest = vec![NOTHING; window.pixels()];
        solid::each_depth_of_mesh(vertices, skin.triangles(), rays, near, &mut |x, y, depth, facet| {
            let pixel = &mut nearest[window.place(x, y)];
            if (depth as f32) < pixel.depth as f32 {
                *pixel = Nearest { depth, part: skin.part_of(facet as usize), solid: 0, facet };
            }
        });
        let seen = nearest.iter().enumerate().filter(|(_, pixel)| pixel.part != u32::MAX);
        seen.map(|(place, pixel)| {
            let ((x, y), part) = (window.pixel(place), pixel.part as usize);
            let [u, v] = rays.ray(x, y);
            let in_camera = Point3::new(u, v, 1.0) * pixel.depth;
            let corners = skin.triangles()[pixel.facet as usize].map(|corner| vertices[corner as usize]);
            let on_skin = Some(SkinPoint::new(pixel.facet, &corners, &in_camera));
            let [a, b, c] = corners;
            let normal = Unit::new_normalize((b - a).cross(&(c - a)));
            // a mesh is visible from either side
            let normal = if normal.dot(&in_camera.coords) > 0.0 { -normal } else { normal };
            let point_in_link = frames[part].inverse() * (world_from_camera * in_camera);
            let normal_in_world = world_from_camera * normal;
            SurfacePixel { x, y, part, depth: pixel.depth, point_in_link, normal_in_world, on_skin }
        })
        .collect()
    }

    fn surface_of(&mut self, parts: &[(&[Solid], Isometry3<f64>)]) -> Vec<SurfacePixel> {
        let near = self.camera.pinhole.near;
        let camera_from_world = self.camera.camera_from_world;
        let rays = self.rays();
        let views = parts.iter().flat_map(|(solids, world_from_link)| {
            let camera_from_link = camera_from_world * world_from_link;
            solids.iter().filter_map(move |solid| solid::reach_of(solid, &camera_from_link).view(near))
        });
        let window = rays.window(views);
        let mut nearest = vec![NOTHING; window.pixels()];
        for (part, (solids, world_from_link)) in parts.iter().enumerate() {
            let camera_from_link = camera_from_world * world_from_link;
            for (index, solid) in solids.iter().enumerate() {
                solid::each_depth(solid, &camera_from_link, rays, near, &mut |x, y, depth, facet| {
                    let pixel = &mut nearest[window.place(x, y)];
                    // the same comparison as for depth images, so that ties are resolved equally
                    if (depth as f32) < pixel.depth as f32 {
                        *pixel = Nearest { depth, part: part as u32, solid: index as u32, facet };
                    }
                });
            }
        }
        let links_from_camera: Vec<Isometry3<f64>> =
            parts.iter().map(|(_, world_from_link)| (camera_from_world * world_from_link).inverse()).collect();
        let seen = nearest.iter().enumerate().filter(|(_, pixel)| pixel.part != u32::MAX);
        seen.map(|(place, pixel)| {
            let ((x, y), part) = (window.pixel(place), pixel.part as usize);
            let [u, v] = rays.ray(x, y);
            let in_camera = Point3::new(u, v, 1.0) * pixel.depth;
            let point_in_link = links_from_camera[part] * in_camera;
            let (solids, world_from_link) = &parts[part];
            let normal = world_from_link * solids[pixel.solid as usize].normal_at(&point_in_link, pixel.facet as usize);
            let away = (camera_from_world * normal).dot(&in_camera.coords) > 0.0;
            // a mesh is visible from either side
            let normal_in_world = if away { -normal } else { normal };
            SurfacePixel { x, y, part, depth: pixel.depth, point_in_link, normal_in_world, on_skin: None }
        })
        .collect()
    }
}
