//! The table: scenes, and exactly what a frame of each is made of.

use crate::scenes::{Variant, black, chalk, coated, declare, glitter, masked, metal, point, spot, sun, texture, unlit};
use mica_render::scene::{Material, TextureRef};

/// A scene and what its first frame is made of.
struct Row {
    what: &'static str,
    variant: Variant,
    /// The effects that shaders are specialised for.
    effects: &'static str,
    /// The passes that draw, but for those of every frame.
    draws: &'static str,
    /// The passes that bring tables up to date, but for the uploads of the scene itself; each once.
    tables: &'static str,
}

fn row(what: &'static str, variant: Variant, effects: &'static str, draws: &'static str, tables: &'static str) -> Row {
    Row { what, variant, effects, draws, tables }
}

const SHADOWS: &str = "fill ray_counts, shadows [occlusion=bvh]";
const OPEN: &str = "";
const BVH: &str = "upload bvh_nodes, upload bvh_triangles, upload bvh_instances";
const SKY: &str = "upload environment";

fn textured_by(change: impl Fn(&mut Material, TextureRef)) -> Material {
    let mut material = unlit();
    change(&mut material, texture());
    material
}

fn rows() -> Vec<Row> {
    let mut rows = vec![
        row("black squares", black(), "", OPEN, ""),
        row("chalk in the dark", black().left(chalk()), "DIFFUSE", OPEN, ""),
        row("metal in the dark", black().left(metal()), "SMOOTH_SPECULAR", OPEN, ""),
        row(
            "plastic in the dark",
            black().left(Material { metallic: 0.0, ..metal() }),
            "DIFFUSE SMOOTH_SPECULAR",
            OPEN,
            "",
        ),
        row("black squares under a sky", black().under_sky(), "ENVIRONMENT", OPEN, SKY),
        row(
            "chalk under a sky",
            black().left(chalk()).under_sky(),
            "ENVIRONMENT DIFFUSE",
            OPEN,
            "upload environment, environment_irradiance",
        ),
        row(
            "metal under a sky",
            black().left(metal()).under_sky(),
            "ENVIRONMENT SMOOTH_SPECULAR",
            OPEN,
            "upload environment, environment_specular, specular_albedo",
        ),
        row(
            "chalk and metal under a sky",
            black().left(chalk()).right(metal()).under_sky(),
            "ENVIRONMENT DIFFUSE SMOOTH_SPECULAR",
            OPEN,
            "upload environment, environment_irradiance, environment_specular, specular_albedo",
        ),
        row("a point light", black().left(chalk()).light(point()), "DIFFUSE POINT_LIGHTS SHADOWS", SHADOWS, BVH),
        row("a sun", black().left(chalk()).light(sun()), "DIFFUSE DIRECTIONAL_LIGHTS SHADOWS", SHADOWS, BVH),
        row("a spot", black().left(chalk()).light(spot()), "DIFFUSE SPOT_LIGHTS SHADOWS", SHADOWS, BVH),
        row(
            "lights of all kinds",
            black().left(chalk()).light(point()).light(sun()).light(spot()),
            "DIFFUSE POINT_LIGHTS DIRECTIONAL_LIGHTS SPOT_LIGHTS SHADOWS",
            SHADOWS,
            BVH,
        ),
        row(
            "two of a kind",
            black().left(chalk()).light(sun()).light(sun()),
            "DIFFUSE DIRECTIONAL_LIGHTS SHADOWS",
            SHADOWS,
            BVH,
        ),
        row(
            "a sun without occlusion",
            black().left(chalk()).light(sun()).without_occlusion(),
            "DIFFUSE DIRECTIONAL_LIGHTS",
            OPEN,
            "",
        ),
        row(
            "a sun and a sky",
            black().left(chalk()).light(sun()).under_sky(),
            "DIFFUSE DIRECTIONAL_LIGHTS SHADOWS ENVIRONMENT",
            SHADOWS,
            "upload bvh_nodes, upload bvh_triangles, upload bvh_instances, upload environment, environment_irradiance",
        ),
        row("a mask", black().left(masked(unlit())), "ALPHA_MASKS", OPEN, ""),
        row(
            "a mask in the sun",
            black().left(masked(chalk())).light(sun()),
            "ALPHA_MASKS DIFFUSE DIRECTIONAL_LIGHTS SHADOWS",
            "fill ray_counts, shadows [occlusion=bvh_masked]",
            BVH,
        ),
        row("a mask that nobody sees", black().left(masked(unlit())).left_hidden(), "", OPEN, ""),
        row("a coat", black().left(coated(unlit())), "CLEAR_COAT", OPEN, ""),
        row(
            "a coat under a sky",
            black().left(coated(unlit())).under_sky(),
            "CLEAR_COAT ENVIRONMENT",
            OPEN,
            "upload environment, environment_specular, specular_albedo",
        ),
        row(
            "a coat in the sun",
            black().left(coated(unlit())).light(sun()),
            "CLEAR_COAT DIRECTIONAL_LIGHTS SHADOWS",
            SHADOWS,
            BVH,
        ),
        row(
            "a base colour texture",
            black().left(textured_by(|m, t| m.base_color_texture = Some(t))).textured(),
            "TEXTURES",
            OPEN,
            "",
        ),
        row(
            "an emissive texture",
            black().left(textured_by(|m, t| m.emissive_texture = Some(t))).textured(),
            "TEXTURES",
            OPEN,
            "",
        ),
        row(
            "an occlusion texture",
            black().left(textured_by(|m, t| m.occlusion_texture = Some(t))).textured(),
            "TEXTURES",
            OPEN,
            "",
        ),
        row("a texture that no material uses", black().textured(), "", OPEN, ""),
        row(
            "a texture that nobody sees",
            black().left(textured_by(|m, t| m.base_color_texture = Some(t))).textured().left_hidden(),
            "",
            OPEN,
            "",
        ),
        row(
            "a normal map without tangents",
            black().left(textured_by(|m, t| m.normal_texture = Some(t))).textured(),
            "TEXTURES",
            OPEN,
            "",
        ),
        row(
            "a normal map",
            black().left(textured_by(|m, t| m.normal_texture = Some(t))).textured().with_tangents(),
            "TEXTURES NORMAL_MAPS",
            OPEN,
            "",
        ),
        row("vertex colours", black().with_colors(), "VERTEX_COLORS", OPEN, ""),
        row("vertex colours that nobody sees", black().with_colors().left_hidden(), "", OPEN, ""),
        row("glitter that nobody sees", black().left(glitter("smooth")).left_hidden(), "", OPEN, ""),
        row("a view without glints", black().left(glitter("smooth")).unseen_glints(), "GLINTS", OPEN, ""),
    ];
    rows.extend(glinting());
    rows
}

fn glinting() -> Vec<Row> {
    let of = |method: &str| black().left(glitter(method));
    vec![
        row(
            "the smooth limit in the dark",
            of("smooth"),
            "GLINTS",
            "upload tile_lists, glint_tiles, clear specular_layer, smooth [method=smooth], composite",
            "",
        ),
        row(
            "the smooth limit under a sky",
            of("smooth").under_sky(),
            "GLINTS ENVIRONMENT",
            "upload tile_lists, glint_tiles, clear specular_layer, smooth [method=smooth], composite",
            "upload environment, environment_specular, specular_albedo",
        ),
        row(
            "glints in the sun",
            of("kemppinen").light(sun()),
            "GLINTS DIRECTIONAL_LIGHTS SHADOWS",
            "fill ray_counts, shadows [occlusion=bvh], upload tile_lists, glint_tiles, clear specular_layer, \
             glints [method=kemppinen], composite",
            BVH,
        ),
        row(
            "two methods for lobes share a layer and the environment's tables",
            of("kemppinen").right(glitter("zirr_kaplanyan")).under_sky(),
            "GLINTS ENVIRONMENT",
            "upload tile_lists, glint_tiles, layer_tiles, clear specular_layer, glints [method=kemppinen], \
             glints [method=zirr_kaplanyan], composite",
            "upload environment, environment_specular, specular_albedo",
        ),
        row(
            "glitter beside chalk",
            of("kemppinen").right(chalk()).under_sky(),
            "GLINTS ENVIRONMENT DIFFUSE",
            "upload tile_lists, glint_tiles, clear specular_layer, glints [method=kemppinen], composite",
            "upload environment, environment_irradiance, environment_specular, specular_albedo",
        ),
        row(
            "glitter under a coat",
            black().left(coated(glitter("kemppinen"))).light(sun()),
            "GLINTS CLEAR_COAT DIRECTIONAL_LIGHTS SHADOWS",
            "fill ray_counts, shadows [occlusion=bvh], upload tile_lists, glint_tiles, clear specular_layer, \
             glints [method=kemppinen], composite",
            BVH,
        ),
        row(
            "a method with a table of its own",
            of("deliot_belcour"),
            "GLINTS",
            "upload tile_lists, glint_tiles, clear specular_layer, glints [method=deliot_belcour], composite",
            "deliot_belcour_noise",
        ),
        row(
            "a method that blurs and asks for occlusion, in the dark",
            of("wang2020"),
            "GLINTS",
            "upload tile_lists, glint_tiles, layer_tiles, clear specular_layer, glints [method=wang2020], \
             clear glints_blurred, blur_glints, clear glints_blurred, blur_glints, clear visibility, fill ray_counts, \
             occlusion [occlusion=bvh], clear visibility_blurred, blur_visibility, clear visibility_blurred, \
             blur_visibility, composite",
            "upload bvh_nodes, upload bvh_triangles, upload bvh_instances, dpf, dpf_accumulate, quadtree",
        ),
        row(
            "the same under a sky",
            of("wang2020").under_sky(),
            "GLINTS ENVIRONMENT",
            "upload tile_lists, glint_tiles, layer_tiles, clear specular_layer, glints [method=wang2020], \
             clear glints_blurred, blur_glints, clear glints_blurred, blur_glints, clear visibility, fill ray_counts, \
             occlusion [occlusion=bvh], clear visibility_blurred, blur_visibility, clear visibility_blurred, \
             blur_visibility, composite",
            "upload bvh_nodes, upload bvh_triangles, upload bvh_instances, upload environment, dpf, dpf_accumulate, \
             prefilter_probability, prefilter, quadtree",
        ),
        row(
            "the same without occlusion",
            of("wang2020").without_occlusion(),
            "GLINTS",
            "upload tile_lists, glint_tiles, layer_tiles, clear specular_layer, glints [method=wang2020], \
             clear glints_blurred, blur_glints, clear glints_blurred, blur_glints, composite",
            "dpf, dpf_accumulate, quadtree",
        ),
        row(
            "two layers",
            of("wang2020").right(glitter("kemppinen")).without_occlusion(),
            "GLINTS",
            "upload tile_lists, glint_tiles, layer_tiles, clear specular_layer, glints [method=wang2020], \
             clear glints_blurred, blur_glints, clear glints_blurred, blur_glints, composite, clear specular_layer, \
             glints [method=kemppinen], composite",
            "dpf, dpf_accumulate, quadtree",
        ),
        row(
            "every flake under a sky",
            of("flakes").under_sky(),
            "GLINTS ENVIRONMENT",
            "upload tile_lists, glint_tiles, clear specular_layer, fill flake_walkers, glints [method=flakes], composite",
            "upload environment, upload environment_cone, upload light_rings, upload small_lights, upload flake_counts 0, \
             flake_counts",
        ),
        row(
            "every flake in the sun, where there is no sky to mirror",
            of("flakes").light(sun()),
            "GLINTS DIRECTIONAL_LIGHTS SHADOWS",
            "fill ray_counts, shadows [occlusion=bvh], upload tile_lists, glint_tiles, clear specular_layer, \
             fill flake_walkers, glints [method=flakes], composite",
            "upload bvh_nodes, upload bvh_triangles, upload bvh_instances, upload flake_counts 0, flake_counts",
        ),
        row(
            "a masked glitter",
            black().left(masked(glitter("kemppinen"))).light(point()),
            "ALPHA_MASKS GLINTS POINT_LIGHTS SHADOWS",
            "fill ray_counts, shadows [occlusion=bvh_masked], upload tile_lists, glint_tiles, clear specular_layer, \
             glints [method=kemppinen], composite",
            BVH,
        ),
    ]
}

/// Without what comes once for each level or roughness, and uploads of the scene itself.
fn tables_of(updates: &[String]) -> String {
    const OF_SCENE: [&str; 11] = [
        "instances",
        "indices",
        "positions",
        "normals",
        "tangents",
        "uvs",
        "colors",
        "textures",
        "atlas_srgb",
        "atlas_linear",
        "lights",
    ];
    let is_of_scene = |pass: &String| OF_SCENE.iter().any(|name| *pass == format!("upload {name}"));
    let mut tables: Vec<&str> = updates.iter().filter(|pass| !is_of_scene(pass)).map(String::as_str).collect();
    tables.dedup();
    tables.join(", ")
}

#[test]
fn each_scene_is_simulated_by_exactly_what_it_calls_for() {
    let rows = rows();
    assert!(rows.len() >= 40, "{} scenes", rows.len());
    let mut wrong = String::new();
    for Row { what, variant, effects, draws, tables } in rows {
        let declared = declare(&mut variant.renderer(), &variant.view());
        let mut named: Vec<&str> = declared.effects.iter().copied().collect();
        let mut expected: Vec<&str> = effects.split_whitespace().collect();
        named.sort_unstable();
        expected.sort_unstable();
        if named != expected {
            wrong += &format!("{what}: specialised for {named:?}, and not {expected:?}\n");
        }
        let mut drawn = declared.draws.clone();
        drawn.dedup();
        let around = |middle: &str| {
            let (shadows, rest) = match middle.split_once("], ") {
                Some((shadows, rest)) if shadows.contains("shadows [") => (format!("{shadows}], "), rest.to_owned()),
                _ if middle.contains("shadows [") => (format!("{middle}, "), String::new()),
                _ => (String::new(), middle.to_owned()),
            };
            let rest = if rest.is_empty() { rest } else { format!("{rest}, ") };
            format!("upload materials, upload frame, visibility, surface, {shadows}base, {rest}tonemap")
        };
        if drawn.join(", ") != around(draws) {
            wrong += &format!("{what}: draws\n    {}\n  and not\n    {}\n", drawn.join(", "), around(draws));
        }
        if tables_of(&declared.updates) != tables {
            wrong += &format!("{what}: makes\n    {}\n  and not\n    {tables}\n", tables_of(&declared.updates));
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}
