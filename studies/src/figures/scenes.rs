//! Figures 1 and 11: objects carved from the solids of three synthetic photographs, in one image.

use std::ops::ControlFlow;
use std::path::Path;

use anyhow::{Context, Result};
use nalgebra::{Point3, Vector3};
use stereology::render::{Camera, Material, RenderOptions, render_material};
use stereology::shape::TriangleMesh;
use stereology::volume::{Solid, turned};

use super::carvings::{bowl, column, knot, slab, vase};
use super::materials::{asphalt, foam, terrazzo};

/// A mesh at its place in the scene, and its solid.
struct Thing<'a> {
    mesh: TriangleMesh,
    solid: &'a Solid,
    /// A box that contains it and no other object.
    low: Point3<f64>,
    high: Point3<f64>,
}

/// Points within this distance of an object belong to it; objects are at least this far apart.
const NEAR: f64 = 0.25;

impl<'a> Thing<'a> {
    /// `mesh` translated by `to`.
    fn new(mesh: &TriangleMesh, to: [f64; 3], solid: &'a Solid) -> Result<Self> {
        let mesh = mesh.mapped(|p| p + Vector3::from(to));
        let (low, high) = mesh.bounding_box().context("a mesh without vertices")?;
        let margin = Vector3::repeat(NEAR);
        Ok(Self {
            mesh,
            solid,
            low: low - margin,
            high: high + margin,
        })
    }

    fn holds(&self, p: &Point3<f64>) -> bool {
        (0..3).all(|k| (self.low[k]..=self.high[k]).contains(&p[k]))
    }
}

fn picture(things: &[Thing<'_>], camera: &Camera, options: &RenderOptions, file: &Path) -> Result<()> {
    let of = |p: &Point3<f64>| things.iter().find(|thing| thing.holds(p));
    let colour = |p: &Point3<f64>| of(p).map_or([0.5; 3], |thing| thing.solid.colour_at(&turned(p)));
    let voids = |p: &Point3<f64>| {
        of(p)
            .filter(|thing| !thing.solid.voids().is_empty())
            .map_or(f64::INFINITY, |thing| thing.solid.void_distance_at(&turned(p)))
    };
    let none = TriangleMesh {
        vertices: Vec::new(),
        triangles: Vec::new(),
    };
    let all = things.iter().fold(none, |all, thing| all.with(&thing.mesh));
    let material = Material::new(&colour).with_voids(&voids);
    render_material(&all, &material, camera, options, &|_| ControlFlow::Continue(()))?
        .save(file)
        .with_context(|| format!("{} cannot be written", file.display()))
}

/// A vase, a bowl and a sponge on a table.
pub fn draw_still_life(folder: &Path) -> Result<()> {
    let (terrazzo, asphalt, foam) = (terrazzo()?.solid, asphalt()?.solid, foam()?.solid);
    let top = 44.0 + 2.0 * NEAR;
    let things = [
        Thing::new(&slab(520.0, 44.0), [0.0; 3], &terrazzo)?,
        Thing::new(&vase(480.0), [-190.0, 130.0, top], &asphalt)?,
        Thing::new(&bowl(190.0), [215.0, 110.0, top], &terrazzo)?,
        Thing::new(&TriangleMesh::icosphere(190.0, 6), [40.0, -190.0, top + 95.0], &foam)?,
    ];
    let camera = Camera {
        up: Vector3::z_axis(),
        azimuth: 8.0,
        elevation: 24.0,
        ..Camera::default()
    };
    let options = RenderOptions::default().with_size(960, 720).with_samples(6);
    picture(&things, &camera, &options, &folder.join("figure-01-scene.png"))
}

/// A knot on a column, and further objects on steps.
pub fn draw_sculpture(folder: &Path) -> Result<()> {
    let (terrazzo, asphalt, foam) = (terrazzo()?.solid, asphalt()?.solid, foam()?.solid);
    let [step, height] = [70.0, 560.0];
    let floor = 2.0 * step + 4.0 * NEAR;
    let standing = knot(68.0, 40.0).mapped(|p| Point3::new(p.x, -p.z, p.y));
    let foot = floor + height + 2.0 * NEAR + 3.0 * 64.0 + 52.0;
    let things = [
        Thing::new(
            &TriangleMesh::cuboid([980.0, 760.0, step]),
            [0.0, 0.0, 0.5 * step],
            &asphalt,
        )?,
        Thing::new(
            &TriangleMesh::cuboid([780.0, 560.0, step]),
            [0.0, 0.0, 1.5 * step + 2.0 * NEAR],
            &asphalt,
        )?,
        Thing::new(&column(120.0, height), [-120.0, 60.0, floor], &terrazzo)?,
        Thing::new(&standing, [-120.0, 60.0, foot], &foam)?,
        Thing::new(
            &TriangleMesh::icosphere(210.0, 6),
            [220.0, -90.0, floor + 105.0],
            &terrazzo,
        )?,
    ];
    let camera = Camera {
        up: Vector3::z_axis(),
        azimuth: 28.0,
        elevation: 16.0,
        ..Camera::default()
    };
    let options = RenderOptions::default().with_size(720, 960).with_samples(6);
    picture(&things, &camera, &options, &folder.join("figure-11-scene.png"))
}
