//! What alpha masks cut out does not block, and whatever is behind it does: alike by both bodies, and as f64 has it.

use crate::bodies::{Bodies, Said};
use crate::bvh_tracer::BvhTracer;
use crate::compare::{Answers, compare};
use crate::mesh_hierarchy::built;
use crate::meshes::{self, Mesh};
use crate::random::Random;
use crate::rays::{many, of_every_kind, ray};
use crate::scenes;
use crate::truth::{Crossing, U, World};
use glam::{DAffine3, DQuat, DVec2, DVec3};
use mica_render::OcclusionBackend;
use mica_render::scene::bvh::SceneBvh;
use mica_render::scene::{AlphaMode, Encoding, Material, Scene, Texture, TextureRef, Wrap};
use mica_shaders::types::Ray;

const RAYS: usize = 1 << 16;
const SIDE: u32 = 8;
const CUTOFF: f32 = 0.5;
/// How often the texture repeats along a side.
const REPEATS: f32 = 2.5;

/// Opacities by chance, most of them clear or full and some near the cutoff, every other texel the opposite.
fn holes(nearest: bool) -> Texture {
    let mut random = Random::new(53);
    let mut pixels = Vec::new();
    for texel in 0..SIDE * SIDE {
        let full = (texel + texel / SIDE).is_multiple_of(2);
        let alpha = match random.below(4) {
            0 => 120 + random.below(16) as u8,
            _ if full => 255,
            _ => 0,
        };
        pixels.extend([255, 255, 255, alpha]);
    }
    let name = "holes".to_owned();
    Texture { name, width: SIDE, height: SIDE, pixels, encoding: Encoding::Srgb, wrap: [Wrap::Repeat; 2], nearest }
}

fn perforated(mesh: Mesh, places: &[DAffine3], nearest: bool, vertex_colors: bool) -> Scene {
    let placed: Vec<(usize, DAffine3)> = places.iter().map(|&place| (0, place)).collect();
    let mut scene = scenes::of("perforated", vec![mesh], &placed);
    let mesh = &mut scene.meshes[0];
    mesh.has_uv = true;
    mesh.uv[0] = mesh.positions.iter().map(|[x, y, _]| [x, y].map(|along| REPEATS * (0.5 * along + 0.5))).collect();
    if vertex_colors {
        mesh.colors = mesh.positions.iter().map(|[x, ..]| [1.0, 1.0, 1.0, 0.7 + 0.3 * x]).collect();
    }
    scene.textures = vec![holes(nearest)];
    let texture = TextureRef { texture: 0, uv_set: 0, transform: TextureRef::IDENTITY };
    let alpha = AlphaMode::Mask { cutoff: CUTOFF };
    scene.materials[0] =
        Material { alpha, base_color: [1.0, 1.0, 1.0, 0.9], base_color_texture: Some(texture), ..Material::default() };
    // A wall behind some of it, whole.
    let mut wall = scenes::alone("wall", meshes::grid(2).map(|point| 0.5 * point - DVec3::new(0.3, 0.2, 0.9)));
    wall.meshes[0].material = 1;
    wall.instances[0].mesh = 1;
    scene.meshes.append(&mut wall.meshes);
    scene.instances.append(&mut wall.instances);
    scene.materials.append(&mut wall.materials);
    scene
}

/// Whether a triangle is there where a ray crosses it; nothing where rounding decides.
fn covered(scene: &Scene, instance: usize, triangle: usize, crossing: &Crossing) -> Option<bool> {
    let mesh = &scene.meshes[scene.instances[instance].mesh];
    let material = &scene.materials[mesh.material];
    let AlphaMode::Mask { cutoff } = material.alpha else { return Some(true) };
    let vertices = [0, 1, 2].map(|corner| mesh.indices[3 * triangle + corner] as usize);
    let [second, third] = crossing.barycentrics;
    let weights = [1.0 - second - third, second, third];
    let uvs = vertices.map(|vertex| DVec2::from(mesh.uv[0][vertex].map(f64::from)));
    let uv: DVec2 = weights.iter().zip(uvs).map(|(weight, uv)| *weight * uv).sum();
    let spread = (uvs[1] - uvs[0]).abs() + (uvs[2] - uvs[0]).abs();
    let error = (crossing.barycentrics_error * spread.max_element() + 16.0 * U * uv.abs().max_element().max(1.0))
        * f64::from(SIDE);
    let texture = &scene.textures[0];
    let texel = |x: f64, y: f64| {
        let [x, y] = [x, y].map(|at| at.rem_euclid(f64::from(SIDE)) as usize);
        f64::from(texture.pixels[4 * (y * SIDE as usize + x) + 3]) / 255.0
    };
    let at = uv * f64::from(SIDE);
    let (alpha, alpha_error) = if texture.nearest {
        let sure = (at - error).floor() == (at + error).floor();
        (texel(at.x, at.y), if sure { 1e-6 } else { 1.0 })
    } else {
        let at = at - 0.5;
        let (base, part) = (at.floor(), at - at.floor());
        let row = |y: f64| texel(base.x, y) * (1.0 - part.x) + texel(base.x + 1.0, y) * part.x;
        // From one texel to the next alpha changes by 1 at most, along either side.
        (row(base.y) * (1.0 - part.y) + row(base.y + 1.0) * part.y, 2.0 * error + 1e-6)
    };
    let vertex_alpha = |vertex: usize| mesh.colors.get(vertex).map_or(1.0, |color| f64::from(color[3]));
    let faded: f64 = weights.iter().zip(vertices).map(|(weight, vertex)| weight * vertex_alpha(vertex)).sum();
    let factor = f64::from(material.base_color[3]);
    let over = factor * faded * alpha - f64::from(cutoff);
    (over.abs() > alpha_error + crossing.barycentrics_error + 1e-6).then_some(over > 0.0)
}

#[test]
fn masks_are_cut_alike_by_both_bodies_and_as_f64_has_them() {
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.64, 0.48), 0.8);
    let leaning =
        DAffine3::from_scale_rotation_translation(DVec3::new(1.0, -0.6, 2.0), turn, DVec3::new(0.2, 0.1, 0.3));
    let layers: Vec<DAffine3> =
        (0..3).map(|k| DAffine3::from_translation(DVec3::new(0.1, 0.05, -0.25) * f64::from(k))).collect();
    let mut bodies = Bodies::new();
    for (name, scene) in [
        ("nearest", perforated(meshes::grid(6), &[layers.clone(), vec![leaning]].concat(), true, false)),
        ("linear", perforated(meshes::grid(6), &[layers, vec![leaning]].concat(), false, false)),
        ("vertex colours", perforated(meshes::bumpy_icosphere(2), &[leaning, DAffine3::IDENTITY], false, true)),
    ] {
        let mut renderers = bodies.open(&scene);
        let masks = scene.clone();
        let world = World::new(&scene, renderers[0].scene_center())
            .with_masks(move |instance, triangle, crossing| covered(&masks, instance, triangle, crossing));
        let rays = of_every_kind(&world, RAYS, 3);
        let said: Vec<Answers> =
            bodies.ask(&mut renderers, &rays, RAYS).into_iter().map(|asked| (asked.of, asked.said)).collect();
        let tally = compare(&world, &rays, &said, 1);
        println!("{}", tally.line(name));
        tally.expect_right(name);
        assert!(tally.ties < RAYS / 200 && tally.aimed_ties < RAYS / 10, "{name}: {tally:?}");

        // The holes are there: as if whole, the scene answers otherwise.
        let whole = compare(&World::new(&scene, renderers[0].scene_center()), &rays, &said, 1);
        assert!(whole.wrong.iter().all(|&wrong| wrong > RAYS / 20), "{name}: {:?}", whole.wrong);
    }
}

/// Whole triangles and parts of others are holes; the rule depends on all that the hierarchy's walk passes on.
const RULE: &str = "
bool is_covered(uint instance, uint triangle, vec2 barycentrics) {
  return (instance + triangle) % 3u != 0u && barycentrics.x + 0.5 * barycentrics.y > 0.4;
}
";

#[test]
fn a_mask_is_asked_about_the_instance_the_triangle_and_the_place_in_it() {
    let scene = scenes::of("soup", vec![meshes::random_triangles(300, 0.4, 31)], &scenes::twelve_places());
    let whole = || World::new(&scene, scene.bounds().expect("a box").center());
    let world = whole().with_masks(|instance, triangle, crossing| {
        let [second, third] = crossing.barycentrics;
        let inside = second + 0.5 * third - 0.4;
        let sure = inside.abs() > 2.0 * crossing.barycentrics_error + 1e-6;
        if (instance + triangle).is_multiple_of(3) { Some(false) } else { sure.then_some(inside > 0.0) }
    });
    let rays = many(5_000, 32, |random, _| ray(1.5 * random.point(), random.direction()));
    let said = [(OcclusionBackend::Bvh, BvhTracer::masked(RULE).ask(&scene, &rays))];
    let tally = compare(&world, &rays, &said, 1);
    tally.expect_right("holes by rule");
    let through = compare(&whole(), &rays, &said, 1).wrong[0];
    println!("of {} rays {through} pass through a hole first, {} hit", rays.len(), tally.hits);
    assert!(through > 800 && tally.hits > 1_000, "{through} pass through a hole first, {} hit", tally.hits);
}

/// Ninety-nine panes that are holes, and a wall.
#[test]
fn a_ray_passes_through_any_number_of_holes() {
    let panes = Mesh::soup((0..100).map(|k| {
        let z = f64::from(-k);
        [DVec3::new(-1.0, -1.0, z), DVec3::new(3.0, -1.0, z), DVec3::new(-1.0, 3.0, z)]
    }));
    let panes = SceneBvh::build(&[(0, DAffine3::IDENTITY)], &[built(&panes)]).expect("a usable scene");
    let only_last = "bool is_covered(uint instance, uint triangle, vec2 barycentrics) { return triangle == 99u; }\n";
    let endless = ray(DVec3::new(0.1, 0.2, 5.0), -DVec3::Z);
    let said = BvhTracer::masked(only_last).ask_of(&panes, &[endless, Ray { t_max: 103.9, ..endless }]);
    let answers = said
        .iter()
        .map(|Said { closest, any }| (closest.blocked, any.map(|any| any.blocked), closest.triangle, closest.t))
        .collect::<Vec<_>>();
    assert_eq!(answers, [(1, Some(1), 99, 104.0), (0, Some(0), 0, 103.9)]);
}
