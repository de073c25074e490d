//! Edits between frames: each makes anew what depends on it and nothing else, and tables live as long as something uses them. Frames
//! are declared and not executed.

use glam::{DAffine3, DVec3};
use mica_graph::{Graph, Lifetime, Resource};
use mica_render::scene::{
    AlphaMode, Camera, Clearcoat, EquirectMap, Glint, Instance, Light, Material, Mesh, Scene, Specular,
};
use mica_render::{Environment, OcclusionBackend, Renderer, View};
use std::collections::BTreeMap;
use std::sync::{Arc, Weak};

/// Materials of the scene.
const LEFT: usize = 0;
const RIGHT: usize = 1;
const WALL: usize = 2;
/// The instance of the right mesh.
const MOVED: usize = 1;

/// Three squares: two that glint, and a wall that is diffuse and mirrors nothing.
fn scene(method: &str) -> Scene {
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
    let mesh = |material| Mesh {
        positions: corners.map(|[x, z]| [x, 0.0, z]).to_vec(),
        normals: vec![[0.0, 1.0, 0.0]; 4],
        uv: [corners.to_vec(), Vec::new()],
        indices: vec![0, 1, 2, 0, 2, 3],
        has_uv: true,
        material,
        ..Mesh::default()
    };
    let instance = |mesh| {
        let world_from_local = DAffine3::from_translation(3.0 * mesh as f64 * DVec3::X);
        Instance { mesh, world_from_local, name: String::new() }
    };
    Scene {
        meshes: [LEFT, RIGHT, WALL].map(mesh).to_vec(),
        instances: [LEFT, RIGHT, WALL].map(instance).to_vec(),
        materials: vec![glinting("left", method, 1e5), glinting("right", method, 2e5), wall()],
        ..Scene::default()
    }
}

fn glinting(name: &str, method: &str, count: f64) -> Material {
    let glint = Glint { count, method: Some(method.to_owned()), ..Glint::default() };
    Material { name: name.to_owned(), glint: Some(glint), ..Material::default() }
}

fn wall() -> Material {
    let specular = Specular { factor: 0.0, ..Specular::default() };
    Material { name: "wall".to_owned(), metallic: 0.0, specular, ..Material::default() }
}

fn lamp(power: f32) -> Light {
    Light::Point { position: DVec3::new(0.0, 5.0, 0.0), radiant_intensity: [power; 3], range: None }
}

fn sky(radiance: f32) -> Environment {
    Environment { map: EquirectMap::constant([radiance; 3]), rotation_radians: 0.0 }
}

const COAT: Clearcoat = Clearcoat {
    factor: 1.0,
    texture: None,
    roughness: 0.1,
    roughness_texture: None,
    normal_texture: None,
    normal_scale: 1.0,
};

/// How many tables there are of each name, and their bytes.
type Kept = BTreeMap<String, (usize, u64)>;

/// A scene that is edited, and everything that its frames used so far.
struct Sitting {
    renderer: Renderer,
    view: View,
    used: Vec<Weak<Resource>>,
}

impl Sitting {
    fn new(method: &str) -> Self {
        let mut renderer =
            Renderer::new(scene(method), &[], Some(&sky(1.0)), OcclusionBackend::Bvh).expect("a sound scene");
        if method == "wang2020" {
            renderer.set(None, "depth", "3").expect("a setting");
        }
        let camera = Camera::looking_at("test", DVec3::new(0.0, 3.0, 5.0), DVec3::ZERO, 0.6, 0.01);
        Self { renderer, view: View::new(camera, [64, 32]), used: Vec::new() }
    }

    fn set(&mut self, material: Option<&str>, key: &str, value: &str) {
        self.renderer.set(material, key, value).expect("a setting");
    }

    fn place(&mut self, to: DVec3) {
        self.renderer.place_instance(MOVED, DAffine3::from_translation(to)).expect("a sound place");
    }

    fn replace_wall(&mut self, material: Material) {
        self.renderer.set_material(WALL, material).expect("a material");
    }

    /// Declares a frame: what it updates, as `RUNS PASS: WHY`.
    fn frame(&mut self) -> Vec<String> {
        let mut graph = Graph::new();
        let frame = self.renderer.frame(&mut graph, &self.view, None).expect("the frame is declared");
        let mut updates: Vec<(usize, String)> = Vec::new();
        for pass in &graph.passes()[frame.updates.clone()] {
            let said = format!("{}: {}", pass.name, pass.why);
            match updates.last_mut() {
                Some((runs, last)) if *last == said => *runs += 1,
                _ => updates.push((1, said)),
            }
        }
        for used in graph.passes().iter().flat_map(|pass| &pass.uses).map(|used| &used.resource) {
            if used.lifetime != Lifetime::Frame && !self.used.iter().any(|known| known.as_ptr() == Arc::as_ptr(used)) {
                self.used.push(Arc::downgrade(used));
            }
        }
        updates.into_iter().map(|(runs, said)| format!("{runs} {said}")).collect()
    }

    /// What is still there of all that was used, but for what stands in where there is no table.
    fn kept(&mut self) -> Kept {
        self.used.retain(|used| used.strong_count() > 0);
        let mut kept = Kept::new();
        for resource in self.used.iter().filter_map(Weak::upgrade) {
            if resource.name.ends_with("_absent") {
                continue;
            }
            let (count, bytes) = kept.entry(resource.name.clone()).or_default();
            *count += 1;
            *bytes += resource.bytes();
        }
        kept
    }
}

/// What differs, as `+NAME` for each more, `-NAME` for each fewer, and `~NAME` where bytes alone do.
fn differences(before: &Kept, after: &Kept) -> Vec<String> {
    let names: std::collections::BTreeSet<&String> = before.keys().chain(after.keys()).collect();
    let of = |kept: &Kept, name: &String| kept.get(name).copied().unwrap_or_default();
    let mut differences = Vec::new();
    for name in names {
        let ((count, bytes), (now, bytes_now)) = (of(before, name), of(after, name));
        differences.extend((count..now).map(|_| format!("+{name}")));
        differences.extend((now..count).map(|_| format!("-{name}")));
        if count == now && bytes != bytes_now {
            differences.push(format!("~{name}"));
        }
    }
    differences
}

/// An edit, and what the next frame is to do.
struct Step {
    what: &'static str,
    edit: fn(&mut Sitting),
    /// Each as `RUNS PASS: WHY`.
    updates: &'static [&'static str],
    /// What is there from then on and was not before, and what no more: see [`differences`].
    kept: &'static [&'static str],
}

const fn step(
    what: &'static str,
    edit: fn(&mut Sitting),
    updates: &'static [&'static str],
    kept: &'static [&'static str],
) -> Step {
    Step { what, edit, updates, kept }
}

/// A sitting that begins with two materials that differ in nothing but the number of their flakes.
const STEPS: &[Step] = &[
    step(
        "count of one",
        |s| s.set(Some("left"), "count", "3e5"),
        &["3 quadtree: material left: count is now 3e5"],
        &[],
    ),
    step(
        "count of the other, now the same",
        |s| s.set(Some("right"), "count", "3e5"),
        &[],
        &["-quadtree_bounds", "-quadtree_nodes"],
    ),
    step(
        "seed of the other",
        |s| s.set(Some("right"), "seed", "9"),
        &["3 quadtree: material right: seed is now 9"],
        &["+quadtree_bounds", "+quadtree_nodes"],
    ),
    step(
        "gamma of one",
        |s| s.set(Some("left"), "gamma_deg", "5"),
        &[
            "1 dpf_accumulate: material left: gamma is now 5 degrees",
            "1 prefilter_probability: material left: P(i, o, gamma) changed",
            "1 prefilter: material left: P(i, o, gamma) changed",
        ],
        &["+dpf_accumulated", "+prefiltered"],
    ),
    step(
        "gamma of the other, now the same",
        |s| s.set(Some("right"), "gamma_deg", "5"),
        &[],
        &["-dpf_accumulated", "-prefiltered"],
    ),
    step(
        "alpha of both",
        |s| s.set(None, "alpha", "0.2"),
        &[
            "1 dpf_accumulate: material left: alpha is now 0.2",
            "1 prefilter_probability: material left: P(i, o, gamma) changed",
            "1 prefilter: material left: P(i, o, gamma) changed",
        ],
        &[],
    ),
    step(
        "samples of one",
        |s| s.set(Some("right"), "samples", "65"),
        &[
            "1 prefilter_probability: material right: the number of samples changed",
            "1 prefilter: material right: the number of samples changed",
        ],
        &["+prefiltered"],
    ),
    step("samples of both", |s| s.set(None, "samples", "64"), &[], &["-prefiltered"]),
    step(
        "depth of one",
        |s| s.set(Some("right"), "depth", "4"),
        &["4 quadtree: material right: depth is now 4"],
        &["~quadtree_bounds", "~quadtree_nodes"],
    ),
    step(
        "count to and fro",
        |s| {
            s.set(Some("left"), "count", "4e5");
            s.set(Some("left"), "count", "3e5");
        },
        &[],
        &[],
    ),
    step(
        "values exchanged",
        |s| {
            for (key, left, right) in [("seed", "9", "0"), ("depth", "4", "3")] {
                s.set(Some("left"), key, left);
                s.set(Some("right"), key, right);
            }
        },
        &[],
        &[],
    ),
    step("colour", |s| s.set(None, "color", "0.5,0.25,1"), &[], &[]),
    step("scale of texture", |s| s.set(Some("left"), "uv_scale", "2"), &[], &[]),
    step(
        "another method",
        |s| s.renderer.set_method(Some("left"), "flakes").expect("a method"),
        &[
            "1 upload environment_cone: material left: what cones of 5 degrees mirror; first frame with them",
            "1 upload light_rings: material left: what cones of 5 degrees mirror; first frame with them",
            "1 upload small_lights: material left: what cones of 5 degrees mirror; first frame with them",
            "1 upload flake_counts 0: material left: first frame with 3e5 flakes",
            "9 flake_counts: material left: first frame with 3e5 flakes",
        ],
        &["+environment_cone", "+flake_counts", "+light_rings", "-quadtree_bounds", "-quadtree_nodes", "+small_lights"],
    ),
    step(
        "the method before",
        |s| {
            s.renderer.set_method(Some("left"), "wang2020").expect("a method");
            s.set(Some("left"), "depth", "4");
        },
        &["4 quadtree: material left: first frame with 3e5 flakes"],
        &["-environment_cone", "-flake_counts", "-light_rings", "+quadtree_bounds", "+quadtree_nodes", "-small_lights"],
    ),
    step(
        "method to and fro",
        |s| {
            for method in ["smooth", "wang2020"] {
                s.renderer.set_method(None, method).expect("a method");
            }
            s.set(Some("left"), "depth", "4");
            s.set(Some("right"), "depth", "3");
        },
        &[],
        &[],
    ),
    step(
        "a light more",
        |s| s.renderer.set_lights(&[lamp(10.0)]).expect("a light"),
        &["1 upload lights: the lights changed"],
        &["~lights"],
    ),
    step(
        "a brighter light",
        |s| s.renderer.set_lights(&[lamp(20.0)]).expect("a light"),
        &["1 upload lights: the lights changed"],
        &[],
    ),
    step(
        "lights to and fro",
        |s| {
            for lights in [vec![], vec![lamp(1.0); 2], vec![lamp(20.0)]] {
                s.renderer.set_lights(&lights).expect("lights");
            }
        },
        &[],
        &[],
    ),
    step(
        "no lights",
        |s| s.renderer.set_lights(&[]).expect("none"),
        &["1 upload lights: the lights changed"],
        &["~lights"],
    ),
    step("the environment turned", |s| s.renderer.turn_environment(1.0), &[], &[]),
    step(
        "another environment",
        |s| s.renderer.set_environment(Some(&sky(2.0))),
        &[
            "1 upload environment: first frame of the environment",
            "1 environment_irradiance: diffuse surfaces under the environment; first frame with this map",
            "1 prefilter_probability: material left: the environment changed",
            "1 prefilter: material left: the environment changed",
        ],
        &[],
    ),
    step(
        "environments to and fro",
        |s| {
            for environment in [Some(sky(3.0)), None, Some(sky(2.0))] {
                s.renderer.set_environment(environment.as_ref());
            }
        },
        &[],
        &[],
    ),
    step("no environment", |s| s.renderer.set_environment(None), &[], &["-environment_irradiance", "-prefiltered"]),
    step(
        "an environment again",
        |s| s.renderer.set_environment(Some(&sky(2.0))),
        &[
            "1 upload environment: first frame of the environment",
            "1 environment_irradiance: diffuse surfaces under the environment; first frame with this map",
            "1 prefilter_probability: material left: first frame under this environment",
            "1 prefilter: material left: first frame under this environment",
        ],
        &["+environment_irradiance", "+prefiltered"],
    ),
    step(
        "an instance moved",
        |s| s.place(DVec3::Y),
        &[
            "1 upload instances: instance 1 moved",
            "1 update bvh_nodes: instance 1 moved",
            "1 upload bvh_instances: instance 1 moved",
        ],
        &[],
    ),
    step(
        "an instance moved to and fro",
        |s| [DVec3::Z, DVec3::Y].map(|to| s.place(to)).into_iter().collect(),
        &[],
        &[],
    ),
    step(
        "a material that glints",
        |s| {
            let mut material = glinting("wall", "wang2020", 1e4);
            material.glint = material.glint.map(|glint| Glint { alpha: 0.2, gamma_deg: 5.0, ..glint });
            s.replace_wall(material);
            s.set(Some("wall"), "depth", "3");
        },
        &["3 quadtree: material wall: first frame with 10000 flakes"],
        &["-environment_irradiance", "+quadtree_bounds", "+quadtree_nodes"],
    ),
    step(
        "fewer flakes than one",
        |s| s.set(Some("wall"), "count", "0.4"),
        &[
            "1 environment_specular: smooth reflections of the environment; first frame with this map",
            "1 specular_albedo: smooth reflections of the environment; first frame with this map",
        ],
        &["+albedo_ggx", "+environment_ggx", "-quadtree_bounds", "-quadtree_nodes"],
    ),
    step(
        "a material that does not glint",
        |s| s.replace_wall(wall()),
        &["1 environment_irradiance: diffuse surfaces under the environment; first frame with this map"],
        &["-albedo_ggx", "-environment_ggx", "+environment_irradiance"],
    ),
    step(
        "a coat",
        |s| s.replace_wall(Material { clearcoat: Some(COAT), ..wall() }),
        &[
            "1 environment_specular: smooth reflections of the environment; first frame with this map",
            "1 specular_albedo: smooth reflections of the environment; first frame with this map",
        ],
        &["+albedo_ggx", "+environment_ggx"],
    ),
    step("no coat", |s| s.replace_wall(wall()), &[], &["-albedo_ggx", "-environment_ggx"]),
    step(
        "holes",
        |s| s.replace_wall(Material { alpha: AlphaMode::Mask { cutoff: 0.5 }, ..wall() }),
        &[
            "1 upload bvh_nodes: alpha masks came or went",
            "1 upload bvh_triangles: alpha masks came or went",
            "1 upload bvh_instances: alpha masks came or went",
        ],
        &[],
    ),
    step("other holes", |s| s.replace_wall(Material { alpha: AlphaMode::Mask { cutoff: 0.25 }, ..wall() }), &[], &[]),
    step(
        "holes to and fro",
        |s| {
            s.replace_wall(wall());
            s.replace_wall(Material { alpha: AlphaMode::Mask { cutoff: 0.25 }, ..wall() });
        },
        &[],
        &[],
    ),
    step(
        "no holes",
        |s| s.replace_wall(wall()),
        &[
            "1 upload bvh_nodes: alpha masks came or went",
            "1 upload bvh_triangles: alpha masks came or went",
            "1 upload bvh_instances: alpha masks came or went",
        ],
        &[],
    ),
    step("another camera", |s| s.view.camera.world_from_camera.translation.y += 0.1, &[], &[]),
    step("another size", |s| s.view.size = [128, 64], &[], &[]),
    step("glints unseen", |s| s.view.glints = false, &[], &[]),
    step("a setting of glints unseen", |s| s.set(None, "alpha", "0.3"), &[], &[]),
    step(
        "glints seen",
        |s| s.view.glints = true,
        &[
            "1 dpf_accumulate: material left: alpha is now 0.3",
            "1 prefilter_probability: material left: P(i, o, gamma) changed",
            "1 prefilter: material left: P(i, o, gamma) changed",
        ],
        &[],
    ),
];

/// What the first frame updates, beside the scene itself.
const FIRST: &[&str] = &[
    "1 upload bvh_nodes: first frame that asks for occlusion",
    "1 upload bvh_triangles: first frame that asks for occlusion",
    "1 upload bvh_instances: first frame that asks for occlusion",
    "1 upload environment: first frame of the environment",
    "1 environment_irradiance: diffuse surfaces under the environment; first frame with this map",
    "8 dpf: material left: no directional probability table was precomputed",
    "1 dpf_accumulate: material left: first frame with alpha 0.1, gamma 6 degrees",
    "1 prefilter_probability: material left: first frame under this environment",
    "1 prefilter: material left: first frame under this environment",
    "3 quadtree: material left: first frame with 1e5 flakes",
    "3 quadtree: material right: first frame with 2e5 flakes",
];

/// Steps after which what is kept is what was kept after an earlier one.
const RETURNS: &[[&str; 2]] = &[
    ["the first frame", "seed of the other"],
    ["seed of the other", "gamma of the other, now the same"],
    ["alpha of both", "samples of both"],
    ["values exchanged", "the method before"],
    ["the method before", "no lights"],
    ["another environment", "an environment again"],
    ["an environment again", "a material that does not glint"],
    ["an environment again", "no coat"],
    ["no coat", "no holes"],
    ["no holes", "glints seen"],
];

#[test]
fn an_edit_makes_anew_what_depends_on_it_and_nothing_else() {
    let mut sitting = Sitting::new("wang2020");
    let first = sitting.frame();
    let of_tables: Vec<_> = first.iter().filter(|said| !said.ends_with("first frame of the scene")).collect();
    assert_eq!(of_tables, FIRST);
    let mut kept = BTreeMap::from([("the first frame", sitting.kept())]);
    let mut before = kept["the first frame"].clone();
    for Step { what, edit, updates, kept: changed } in STEPS {
        edit(&mut sitting);
        assert_eq!(sitting.frame(), *updates, "after {what}");
        let now = sitting.kept();
        assert_eq!(differences(&before, &now), *changed, "after {what}");
        assert!(sitting.frame().is_empty(), "nothing was edited since {what}");
        assert!(kept.insert(what, now.clone()).is_none(), "{what} is there once");
        before = now;
    }
    for [earlier, later] in RETURNS {
        assert_eq!(kept[earlier], kept[later], "{earlier}, {later}");
    }
}

/// A method, the tables of a material that nobody shares, and a setting that they depend on.
struct Sharing {
    method: &'static str,
    tables: &'static [&'static str],
    key: &'static str,
    values: [&'static str; 2],
}

const SHARING: &[Sharing] = &[
    Sharing { method: "flakes", tables: &["flake_counts"], key: "count", values: ["1e5", "7e5"] },
    Sharing { method: "jakob", tables: &["jakob_triangles"], key: "alpha", values: ["0.2", "0.4"] },
    Sharing { method: "chermain", tables: &["chermain_dictionary"], key: "gamma_lobe", values: ["false", "true"] },
    Sharing { method: "wang2018", tables: &["dpf", "dpf_accumulated"], key: "alpha", values: ["0.2", "0.4"] },
    Sharing { method: "wang2018", tables: &["dpf_accumulated"], key: "gamma_deg", values: ["3", "4"] },
    Sharing { method: "wang2020", tables: &["quadtree_bounds", "quadtree_nodes"], key: "seed", values: ["1", "2"] },
    Sharing { method: "wang2020", tables: &["prefiltered"], key: "p_hat", values: ["closed", "printed"] },
];

#[test]
fn materials_share_the_tables_that_they_agree_on() {
    for Sharing { method, tables, key, values: [both, another] } in SHARING {
        let mut sitting = Sitting::new(method);
        sitting.set(None, key, both);
        // All tables but those of the flakes themselves are shared by any number of them.
        sitting.set(None, "count", "1e5");
        sitting.frame();
        let shared = sitting.kept();
        assert!(tables.iter().all(|table| shared[*table].0 == 1), "{method}: {shared:?}");
        let more: Vec<String> = tables.iter().map(|table| format!("+{table}")).collect();

        sitting.set(Some("right"), key, another);
        let updates = sitting.frame();
        assert!(!updates.is_empty() && updates.iter().all(|made| made.contains(": material right: ")), "{updates:?}");
        let apart = sitting.kept();
        assert_eq!(differences(&shared, &apart), more, "{method} {key}");

        sitting.set(Some("right"), key, both);
        assert!(sitting.frame().is_empty(), "{method} {key}: what the left one uses is there");
        assert_eq!(sitting.kept(), shared, "{method} {key}");
    }
}

#[test]
fn what_is_the_same_for_all_is_made_once_and_given_back_with_the_last() {
    let mut sitting = Sitting::new("deliot_belcour");
    let noise = |sitting: &mut Sitting| sitting.kept().get("deliot_belcour_noise").map_or(0, |(count, _)| *count);
    let made = sitting.frame().iter().filter(|made| made.contains("deliot_belcour_noise")).count();
    assert_eq!((made, noise(&mut sitting)), (1, 1));
    sitting.renderer.set_method(Some("left"), "smooth").expect("a method");
    assert!(sitting.frame().is_empty());
    assert_eq!(noise(&mut sitting), 1, "the right one is left");
    sitting.renderer.set_method(None, "smooth").expect("a method");
    assert!(sitting.frame().is_empty());
    assert_eq!(noise(&mut sitting), 0);
}
