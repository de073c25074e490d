//! Holes that alpha cuts: a masked sheet above a plane, seen and shining through where f64 says, to the pixel.

use glam::{DAffine3, DMat3, DVec2, DVec3};
use mica_oracle::flake_set::hash2;
use mica_render::scene::{
    AlphaMode, Encoding, EquirectMap, Glint, Instance, Light, Material, Scene, Texture, TextureRef, Wrap,
};
use mica_render::{Environment, Renderer};
use mica_tests::Gpu;
use mica_tests::shapes::{Eye, conductor, plane};
use mica_tests::triangles::{Met, Triangles, decided};
use rayon::prelude::*;

const SIZE: [u32; 2] = [112, 63];
const EYE: Eye = Eye { eye: DVec3::new(0.0, 4.5, 4.0), target: DVec3::new(0.0, 0.2, 0.1), vertical_fov_radians: 0.6 };
/// Towards the directional light, and the place of the point light.
const TOWARDS: DVec3 = DVec3::new(1.1, 1.0, -0.35);
const LAMP: DVec3 = DVec3::new(-1.6, 3.0, 0.6);
/// The sheet's place; its half-side is 0.6 m.
const ABOVE: DVec3 = DVec3::new(0.1, 0.8, -0.1);
const HALF: f64 = 0.6;
/// More than what a ray's origin is lifted by, metres: 256 units in the last place of 8.
const LIFT: f64 = 3e-4;

/// The sheet in its own space, the square |x|, |z| <= 1, and how it is placed.
struct Sheet {
    material: Material,
    texture: Option<Texture>,
    /// At the corners (-1, -1), (-1, 1), (1, 1) and (1, -1) of x and z.
    uv: [Vec<[f32; 2]>; 2],
    colors: Vec<[f32; 4]>,
    world_from_local: DAffine3,
}

/// Random coverage: every byte there is, texel by texel, but for blocks of four that are opaque.
fn blobs(side: u32) -> Texture {
    let opaque = |x: u32, y: u32| hash2(x / 2, y / 2 + 100).is_multiple_of(3);
    let alpha = |x: u32, y: u32| if opaque(x, y) { 255 } else { (hash2(x, y) >> 24) as u8 };
    let texel = |k: u32| [255, 255, 255, alpha(k % side, k / side)];
    Texture {
        name: "blobs".to_owned(),
        width: side,
        height: side,
        pixels: (0..side * side).flat_map(texel).collect(),
        encoding: Encoding::Srgb,
        wrap: [Wrap::Repeat; 2],
        nearest: false,
    }
}

/// Texture coordinates from `from` to `to` across the sheet.
fn uv(from: f32, to: f32) -> Vec<[f32; 2]> {
    vec![[from, from], [from, to], [to, to], [to, from]]
}

fn vertex_alphas(alphas: [f32; 4]) -> Vec<[f32; 4]> {
    alphas.map(|alpha| [1.0, 1.0, 1.0, alpha]).to_vec()
}

impl Sheet {
    /// A sheet with random holes, about half of it.
    fn new() -> Self {
        let base_color_texture = Some(TextureRef { texture: 0, uv_set: 0, transform: TextureRef::IDENTITY });
        Self {
            material: Material {
                name: "sheet".to_owned(),
                base_color: [0.5, 0.5, 0.5, 1.0],
                metallic: 0.0,
                // Its mark in the picture.
                emissive: [0.0, 0.0, 1.0],
                base_color_texture,
                alpha: AlphaMode::Mask { cutoff: 0.5 },
                ..Material::default()
            },
            texture: Some(blobs(8)),
            uv: [uv(0.0, 1.0), Vec::new()],
            colors: Vec::new(),
            world_from_local: DAffine3::from_translation(ABOVE) * DAffine3::from_scale(DVec3::splat(HALF)),
        }
    }

    fn bare() -> Self {
        let mut sheet = Self::new();
        sheet.material.base_color_texture = None;
        sheet.texture = None;
        sheet
    }

    fn with(self, change: impl FnOnce(&mut Self)) -> Self {
        let mut sheet = self;
        change(&mut sheet);
        sheet
    }

    fn with_texture(self, change: impl FnOnce(&mut Texture, &mut TextureRef)) -> Self {
        self.with(|sheet| {
            change(
                sheet.texture.as_mut().expect("a texture"),
                sheet.material.base_color_texture.as_mut().expect("a texture"),
            );
        })
    }

    fn with_alpha(self, alpha: AlphaMode) -> Self {
        self.with(|sheet| sheet.material.alpha = alpha)
    }

    /// The sheet above a plane, which is instance 0.
    fn scene(self, ground: Material) -> Scene {
        let mut scene = plane(ground, 8.0);
        let mut mesh = plane(self.material.clone(), 1.0).meshes.swap_remove(0);
        (mesh.material, mesh.uv, mesh.colors) = (1, self.uv, self.colors);
        mesh.has_uv = !mesh.uv[0].is_empty();
        scene.meshes.push(mesh);
        scene.materials.push(self.material);
        scene.textures.extend(self.texture);
        let instance = Instance { mesh: 1, world_from_local: self.world_from_local, name: "sheet".to_owned() };
        scene.instances.push(instance);
        scene
    }
}

/// Alpha of a texture, by glTF's rules: texel centres at halves, rows downwards.
fn texture_alpha(texture: &Texture, at: DVec2) -> f64 {
    let texel = |x: f64, y: f64| {
        let wrapped = |index: f64, side: u32, wrap: Wrap| {
            let (index, side) = (index as i64, i64::from(side));
            let back_and_forth = index.rem_euclid(2 * side);
            match wrap {
                Wrap::Repeat => index.rem_euclid(side),
                Wrap::Mirror => back_and_forth.min(2 * side - 1 - back_and_forth),
                Wrap::Clamp => index.clamp(0, side - 1),
            }
        };
        let (x, y) = (wrapped(x, texture.width, texture.wrap[0]), wrapped(y, texture.height, texture.wrap[1]));
        f64::from(texture.pixels[4 * (y * i64::from(texture.width) + x) as usize + 3]) / 255.0
    };
    let at = at * DVec2::new(f64::from(texture.width), f64::from(texture.height));
    if texture.nearest {
        return texel(at.x.floor(), at.y.floor());
    }
    let base = (at - 0.5).floor();
    let part = at - 0.5 - base;
    let lerp = |a: f64, b: f64, t: f64| a + t * (b - a);
    let row = |y: f64| lerp(texel(base.x, base.y + y), texel(base.x + 1.0, base.y + y), part.x);
    lerp(row(0.0), row(1.0), part.y)
}

/// Whether there is surface where a ray met a triangle.
fn covered(scene: &Scene, met: &Met) -> bool {
    let mesh = &scene.meshes[scene.instances[met.instance].mesh];
    let material = &scene.materials[mesh.material];
    let cutoff = match material.alpha {
        AlphaMode::Opaque => return true,
        AlphaMode::Mask { cutoff } => f64::from(cutoff),
        AlphaMode::Blend => 0.5,
    };
    let corners = &mesh.indices[3 * met.triangle..][..3];
    let [second, third] = met.barycentrics;
    let interpolated = |of: &dyn Fn(usize) -> f64| {
        let [a, b, c] = [0, 1, 2].map(|corner| of(corners[corner] as usize));
        a + second * (b - a) + third * (c - a)
    };
    let mut alpha = f64::from(material.base_color[3]);
    if !mesh.colors.is_empty() {
        alpha *= interpolated(&|vertex| f64::from(mesh.colors[vertex][3])).clamp(0.0, 1.0);
    }
    if let Some(used) = material.base_color_texture {
        let set = &mesh.uv[used.uv_set as usize];
        let [u, v] = [0, 1].map(|axis| interpolated(&|vertex| set.get(vertex).map_or(0.0, |uv| f64::from(uv[axis]))));
        let [u, v] = used.transform.map(|row| row.map(f64::from)).map(|[a, b, c]| a * u + b * v + c);
        alpha *= texture_alpha(&scene.textures[used.texture], DVec2::new(u, v));
    }
    alpha >= cutoff
}

/// What the scene's triangles look like from a point of the picture: the instance seen, and for each direction asked of
/// it whether nothing covered lies there.
fn seen(
    scene: &Scene,
    triangles: &Triangles,
    point: [f64; 2],
    lift: f64,
    towards: impl Fn(DVec3, DVec3) -> [DVec3; 2],
) -> Option<(usize, [bool; 2])> {
    let ray = EYE.ray(SIZE, point);
    let double_sided = |met: &Met| {
        let instance = &scene.instances[met.instance];
        let mesh = &scene.meshes[instance.mesh];
        let front =
            instance.world_from_local.matrix3.inverse().transpose() * DVec3::from(mesh.normals[0].map(f64::from));
        scene.materials[mesh.material].double_sided || front.dot(ray) < 0.0
    };
    let visible = triangles.met(EYE.eye, ray, 0.0).filter(|met| covered(scene, met) && double_sided(met));
    let met = visible.min_by(|a, b| a.t.total_cmp(&b.t))?;
    let at = EYE.eye + met.t * ray;
    let free = towards(at, ray).map(|towards| {
        // A lamp is at 1 in lengths of this; beyond is nothing.
        !triangles.met(at + lift * met.normal, towards, 0.0).any(|met| covered(scene, &met))
    });
    Some((met.instance, free))
}

/// Of each pixel, unless f64 leaves it undecided, what [`seen`] says.
type Decisions = Vec<Option<Option<(usize, [bool; 2])>>>;

/// What f64 decides about each pixel.
fn decisions(scene: &Scene, towards: impl Fn(DVec3, DVec3) -> [DVec3; 2] + Sync) -> Decisions {
    let triangles = Triangles::of(scene);
    let pixels: Vec<[u32; 2]> = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y])).collect();
    let at = |pixel: &[u32; 2]| {
        decided(*pixel, |point| [1e-9, LIFT].map(|lift| seen(scene, &triangles, point, lift, &towards)))
            .filter(|[low, high]| low == high)
            .map(|[low, _]| low)
    };
    pixels.par_iter().map(at).collect()
}

/// Every way in which alpha comes about, each with the least share of the sheet's pixels that are holes, and the
/// greatest.
fn sheets() -> Vec<(&'static str, Sheet, [f64; 2])> {
    const SOME: [f64; 2] = [0.05, 0.9];
    const NONE: [f64; 2] = [0.0, 0.0];
    let turned = DMat3::from_rotation_y(0.5) * DMat3::from_rotation_x(0.3);
    let placed = |by: DMat3| DAffine3::from_mat3_translation(by * DMat3::from_diagonal(DVec3::splat(HALF)), ABOVE);
    vec![
        ("cutoff 0.5", Sheet::new(), SOME),
        ("cutoff 0", Sheet::new().with_alpha(AlphaMode::Mask { cutoff: 0.0 }), NONE),
        ("cutoff 1", Sheet::new().with_alpha(AlphaMode::Mask { cutoff: 1.0 }), [0.5, 0.99]),
        (
            "cutoff 1, nearest",
            Sheet::new().with_alpha(AlphaMode::Mask { cutoff: 1.0 }).with_texture(|texture, _| texture.nearest = true),
            SOME,
        ),
        ("cutoff above 1", Sheet::new().with_alpha(AlphaMode::Mask { cutoff: 1.1 }), [1.0, 1.0]),
        ("blended", Sheet::new().with_alpha(AlphaMode::Blend), SOME),
        ("opaque", Sheet::new().with_alpha(AlphaMode::Opaque), NONE),
        ("nearest texels", Sheet::new().with_texture(|texture, _| texture.nearest = true), SOME),
        (
            "mirrored tiles",
            Sheet::new()
                .with(|sheet| sheet.uv[0] = uv(-1.3, 1.2))
                .with_texture(|texture, _| texture.wrap = [Wrap::Mirror; 2]),
            SOME,
        ),
        (
            "clamped along v",
            Sheet::new()
                .with(|sheet| sheet.uv[0] = uv(-0.7, 1.6))
                .with_texture(|texture, _| texture.wrap = [Wrap::Repeat, Wrap::Clamp]),
            SOME,
        ),
        ("tiles far from zero", Sheet::new().with(|sheet| sheet.uv[0] = uv(-1e6, -999_999.0)), SOME),
        (
            "nearest tiles far from zero",
            Sheet::new()
                .with(|sheet| sheet.uv[0] = uv(1e5, 100_001.0))
                .with_texture(|texture, _| texture.nearest = true),
            SOME,
        ),
        (
            "a transform",
            Sheet::new().with_texture(|_, used| used.transform = [[0.9, 0.5, 0.3], [-0.6, 1.2, -40.7]]),
            SOME,
        ),
        (
            "the second set",
            Sheet::new().with(|sheet| sheet.uv = [uv(0.3, 0.4), uv(0.1, 1.4)]).with_texture(|_, used| used.uv_set = 1),
            SOME,
        ),
        ("no texture coordinates", Sheet::new().with(|sheet| sheet.uv[0].clear()), [0.0, 1.0]),
        ("alpha of vertices", Sheet::bare().with(|sheet| sheet.colors = vertex_alphas([0.0, 1.0, 0.3, 0.9])), SOME),
        (
            "alpha of vertices above 1",
            Sheet::bare().with(|sheet| {
                sheet.colors = vertex_alphas([0.0, 3.0, 0.0, 3.0]);
                sheet.material.base_color[3] = 0.4;
            }),
            [1.0, 1.0],
        ),
        (
            "opaque vertices, cutoff 1",
            Sheet::bare()
                .with(|sheet| {
                    sheet.colors = vertex_alphas([1.0; 4]);
                })
                .with_alpha(AlphaMode::Mask { cutoff: 1.0 }),
            NONE,
        ),
        (
            "all three alphas",
            Sheet::new().with(|sheet| {
                sheet.colors = vertex_alphas([1.0, 0.6, 1.0, 0.8]);
                sheet.material.base_color[3] = 0.8;
            }),
            SOME,
        ),
        ("a factor below the cutoff", Sheet::bare().with(|sheet| sheet.material.base_color[3] = 0.4), [1.0, 1.0]),
        (
            "a mirrored instance",
            Sheet::new()
                .with(|sheet| sheet.world_from_local = placed(DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)))),
            SOME,
        ),
        (
            "turned, stretched and mirrored",
            Sheet::new().with(|sheet| {
                sheet.world_from_local = placed(turned * DMat3::from_diagonal(DVec3::new(1.2, 1.0, -0.8)));
            }),
            SOME,
        ),
        (
            "its back, double-sided",
            Sheet::new().with(|sheet| {
                sheet.world_from_local = placed(DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)));
                sheet.material.double_sided = true;
            }),
            SOME,
        ),
        // It is not seen, but it blocks.
        (
            "its back, single-sided",
            Sheet::new().with(|sheet| {
                sheet.world_from_local = placed(DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0)));
            }),
            SOME,
        ),
    ]
}

/// Two lights, a channel each; the third marks the sheet.
fn lights() -> [Light; 2] {
    [
        Light::Directional { direction: -TOWARDS.normalize(), irradiance: [3.0, 0.0, 0.0] },
        Light::Point { position: LAMP, radiant_intensity: [0.0, 20.0, 0.0], range: None },
    ]
}

/// Catches a hole that is seen but does not let light through or the other way round, and alpha that is not what the
/// camera and the rays agree on with f64: each of the terms of `sheets`.
#[test]
fn holes_are_seen_and_let_light_through() {
    let mut gpu = Gpu::new();
    let bodies = gpu.occlusion_bodies();
    let ground = Material { base_color: [0.5, 0.5, 0.5, 1.0], metallic: 0.0, ..Material::default() };
    for (name, sheet, holes_between) in sheets() {
        let scene = sheet.scene(ground.clone());
        let decisions = decisions(&scene, |at, _| [TOWARDS, LAMP - at]);
        // The same without holes tells which pixels the sheet covers or shades.
        let solid = Scene { materials: solid(&scene), ..scene.clone() };
        let solid = self::decisions(&solid, |at, _| [TOWARDS, LAMP - at]);
        for body in &bodies {
            let mut renderer = Renderer::new(scene.clone(), &lights(), None, *body).expect("the scene is sound");
            let picture = gpu.render(&mut renderer, &EYE.view(SIZE)).picture;
            let (mut holes, mut behind, mut dark, mut excluded) = (0, 0, [0; 2], 0);
            for (pixel, (decision, solid)) in decisions.iter().zip(&solid).enumerate() {
                let Some(decision) = decision else {
                    excluded += 1;
                    continue;
                };
                let (instance, free) = decision.expect("the plane is behind everything");
                let [red, green, blue, _] = picture.pixels[pixel];
                let case = format!("{name}, {}: pixel {pixel}: {decision:?}", body.name());
                assert_eq!(blue == 1.0, instance == 1, "{case}: {blue}");
                assert_eq!([red > 0.0, green > 0.0], free, "{case}: {red} {green}");
                if let Some(Some((shown, _))) = solid {
                    behind += usize::from(*shown == 1);
                    holes += usize::from(*shown == 1 && instance == 0);
                }
                (0..2).for_each(|light| dark[light] += usize::from(!free[light]));
            }
            let case = format!("{name}, {}", body.name());
            println!("{case}: {holes} of {behind} pixels are holes, {dark:?} dark, {excluded} excluded");
            let share = if behind > 0 { f64::from(holes as u32) / f64::from(behind as u32) } else { 0.5 };
            assert!((holes_between[0]..=holes_between[1]).contains(&share), "{case}: {share} of {behind} are holes");
            assert!(excluded < 60, "{case}: {excluded} pixels are undecided");
            let some = holes_between[0] < 1.0;
            assert!(dark.iter().all(|dark| (*dark > 10) == some), "{case}: {dark:?}");
        }
    }
}

/// The materials with all their holes closed.
fn solid(scene: &Scene) -> Vec<Material> {
    scene.materials.iter().map(|material| Material { alpha: AlphaMode::Opaque, ..material.clone() }).collect()
}

/// The paper's occlusion of glints sees holes too: light from the mirror direction passes through them.
#[test]
fn glints_are_free_behind_holes() {
    let mut gpu = Gpu::new();
    let environment = Environment { map: EquirectMap::constant([1.0; 3]), rotation_radians: 0.0 };
    let glint = Glint { count: 1e12, alpha: 0.5, gamma_deg: 2.0, color: Some([1.0; 3]), ..Glint::default() };
    let sheet = Sheet::new().with(|sheet| {
        sheet.material.emissive = [0.0; 3];
        sheet.material.base_color = [0.0, 0.0, 0.0, 1.0];
        // Where the camera sees it in the mirror of the plane.
        sheet.world_from_local =
            DAffine3::from_translation(DVec3::new(0.0, 1.5, -2.0)) * DAffine3::from_scale(DVec3::splat(1.2));
    });
    let scene = sheet.scene(conductor("wang2020", glint));
    let decisions = decisions(&scene, |_, ray| [DVec3::new(ray.x, -ray.y, ray.z); 2]);
    for body in gpu.occlusion_bodies() {
        let mut renderer = Renderer::new(scene.clone(), &[], Some(&environment), body).expect("the scene is sound");
        for (key, value) in [("samples", "16"), ("depth", "4"), ("blur", "off")] {
            renderer.set(None, key, value).expect("a setting");
        }
        gpu.precompute(&mut renderer);
        let picture = gpu.render(&mut renderer, &EYE.view(SIZE)).picture;
        let mut counts = [0; 2];
        for (pixel, decision) in decisions.iter().enumerate() {
            if let Some(Some((0, [free, _]))) = decision {
                assert_eq!(picture.pixels[pixel][1] > 0.0, *free, "{}: pixel {pixel}", body.name());
                counts[usize::from(*free)] += 1;
            }
        }
        println!("{}: {} pixels dark, {} free", body.name(), counts[0], counts[1]);
        assert!(counts[0] > 300 && counts[1] > 3000, "{}: {counts:?}", body.name());
    }
}
