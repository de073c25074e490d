//! What occlusion is used for, whoever answers: each light's shadow, and the mirror direction of the glints; and
//! nothing where nobody asks.

use glam::DVec3;
use mica_graph::{Graph, Shader};
use mica_render::scene::{Camera, EquirectMap, Glint, Instance, Light, Material, Scene};
use mica_render::{Environment, METHODS, OcclusionBackend, Renderer, View, embedded_scene};
use mica_tests::shapes::{OVER_PLANE, conductor, plane, seen_plane};
use mica_tests::triangles::{Triangles, decided};
use mica_tests::{Gpu, Picture};

const SIZE: [u32; 2] = [112, 63];
/// The roof: a rectangle above the plane, out of the camera's view.
const ROOF_HEIGHT: f64 = 1.5;
const ROOF_CENTER: [f64; 2] = [0.0, -4.5];
const ROOF_HALF: [f64; 2] = [1.0, 1.5];

/// The glinting plane below a black roof.
fn under_a_roof(method: &str, count: f64) -> Scene {
    let glint = Glint { count, alpha: 0.5, gamma_deg: 6.0, color: Some([1.0; 3]), ..Glint::default() };
    let mut scene = plane(conductor(method, glint), 40.0);
    let black = Material { name: "roof".to_owned(), base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() };
    let mut roof = plane(black, 1.0);
    roof.meshes[0].material = 1;
    scene.meshes.append(&mut roof.meshes);
    scene.materials.append(&mut roof.materials);
    let [x, z] = ROOF_CENTER;
    let [half_x, half_z] = ROOF_HALF;
    let world_from_local = glam::DAffine3::from_translation(DVec3::new(x, ROOF_HEIGHT, z))
        * glam::DAffine3::from_scale(DVec3::new(half_x, 1.0, half_z));
    scene.instances.push(Instance { mesh: 1, world_from_local, name: "roof".to_owned() });
    scene
}

/// Whether the ray from a point of the plane upwards in a direction meets the roof; `None` where it nearly touches the
/// roof's edge.
fn meets_roof(point: DVec3, direction: DVec3) -> Option<bool> {
    const EDGE: f64 = 0.03;
    let at = point + direction * (ROOF_HEIGHT / direction.y);
    let beyond = (0..2)
        .map(|axis| (at.to_array()[2 * axis] - ROOF_CENTER[axis]).abs() - ROOF_HALF[axis])
        .fold(f64::NEG_INFINITY, f64::max);
    (beyond.abs() > EDGE).then_some(beyond < 0.0)
}

/// Towards what the plane mirrors at a point.
fn mirrored(point: DVec3) -> DVec3 {
    let ray = point - OVER_PLANE.eye;
    DVec3::new(ray.x, -ray.y, ray.z)
}

/// Where a light is hidden, every method shows, to the bit, what it shows without shadows once that light is put out:
/// black in its channel, and the other light as it was. The one that dims glints whose mirror direction is occluded
/// does that in addition. A method that is added is tested here without a word about it.
#[test]
fn each_light_has_its_own_shadow_by_every_method() {
    let mut gpu = Gpu::new();
    let bodies = gpu.occlusion_bodies();
    let positions = [DVec3::new(0.8, 4.0, -5.0), DVec3::new(-1.5, 5.0, -6.0)];
    let light = |index: usize, lit: bool| {
        let mut radiant_intensity = [0.0; 3];
        radiant_intensity[index] = if lit { 30.0 } else { 0.0 };
        Light::Point { position: positions[index], radiant_intensity, range: None }
    };
    for method in METHODS {
        let mut shown = |occlusion, lit: [bool; 2]| {
            let scene = under_a_roof(method.name, 1e5);
            let lights = [light(0, lit[0]), light(1, lit[1])];
            let mut renderer = Renderer::new(scene, &lights, None, occlusion).expect("the scene is sound");
            for (key, value) in [("samples", "1"), ("depth", "6"), ("blur", "off")] {
                if method.settings.iter().any(|setting| setting.key == key) {
                    renderer.set(None, key, value).expect("a setting");
                }
            }
            gpu.precompute(&mut renderer);
            gpu.render(&mut renderer, &OVER_PLANE.view(SIZE))
        };
        // By the light that is put out; the last with both.
        let open = [[false, true], [true, false], [true, true]].map(|lit| shown(OcclusionBackend::None, lit).picture);
        for body in &bodies {
            let with = shown(*body, [true; 2]);
            let mut counts = [0; 4];
            for (pixel, (point, _)) in seen_plane(SIZE).into_iter().enumerate() {
                let dimmed = !with.declares("occlusion") || meets_roof(point, mirrored(point)) == Some(false);
                let [Some(first), Some(second)] = positions.map(|position| meets_roof(point, position - point)) else {
                    continue;
                };
                let expected = match [first, second] {
                    [true, true] => [0.0; 4],
                    [true, false] => open[0].pixels[pixel],
                    [false, true] => open[1].pixels[pixel],
                    [false, false] => open[2].pixels[pixel],
                };
                let [red, green, ..] = with.picture.pixels[pixel];
                if dimmed {
                    let case = format!("{}, {}: pixel {pixel} at {point}", method.name, body.name());
                    assert_eq!([red, green], expected[..2], "{case}, hidden {first} {second}");
                    // Of those that have something to lose.
                    let [red, green, ..] = open[2].pixels[pixel];
                    counts[usize::from(first) + 2 * usize::from(second)] += usize::from(red > 0.0 && green > 0.0);
                }
            }
            println!("{}, {}: {counts:?} pixels lit, by one light, by none", method.name, body.name());
            assert!(counts[0] > 300 && counts[1..].iter().all(|count| *count > 20), "{}: {counts:?}", method.name);
        }
    }
}

#[test]
fn glints_vanish_where_their_mirror_direction_is_occluded() {
    let mut gpu = Gpu::new();
    let bodies = gpu.occlusion_bodies();
    let environment = Environment { map: EquirectMap::constant([1.0; 3]), rotation_radians: 0.0 };
    let mut shown = |occlusion| {
        let scene = under_a_roof("wang2020", 1e12);
        let mut renderer = Renderer::new(scene, &[], Some(&environment), occlusion).expect("the scene is sound");
        for (key, value) in [("samples", "16"), ("depth", "4"), ("blur", "off")] {
            renderer.set(None, key, value).expect("a setting");
        }
        gpu.precompute(&mut renderer);
        gpu.render(&mut renderer, &OVER_PLANE.view(SIZE)).picture
    };
    let without = shown(OcclusionBackend::None);
    for body in bodies {
        let with = shown(body);
        let mut counts = [0; 2];
        for (pixel, (point, _)) in seen_plane(SIZE).into_iter().enumerate() {
            let [shown, free] = [&with, &without].map(|picture| picture.pixels[pixel][1]);
            let Some(hidden) = meets_roof(point, mirrored(point)) else { continue };
            assert!(free > 0.0, "pixel {pixel} has something to lose");
            assert_eq!(shown, if hidden { 0.0 } else { free }, "{}: pixel {pixel} at {point}", body.name());
            counts[usize::from(hidden)] += 1;
        }
        println!("{}: {} pixels free, {} hidden", body.name(), counts[0], counts[1]);
        assert!(counts[0] > 3000 && counts[1] > 300, "{}: {counts:?}", body.name());
    }
}

/// The triangle that a camera sees through a point of the picture, and which lights arrive there, in f64; nothing where
/// nothing is seen.
fn lit_by(
    triangles: &Triangles,
    lights: &[Light],
    camera: &Camera,
    size: [u32; 2],
    [x, y]: [f64; 2],
) -> Option<(usize, usize, Vec<bool>)> {
    let half_height = (0.5 * camera.vertical_fov_radians).tan();
    let [width, height] = size.map(f64::from);
    let half_width = half_height * width / height;
    let local = DVec3::new((2.0 * x / width - 1.0) * half_width, (1.0 - 2.0 * y / height) * half_height, -1.0);
    let direction = camera.world_from_camera.transform_vector3(local);
    let seen = triangles.first_met(camera.eye(), direction)?;
    let point = camera.eye() + seen.t * direction;
    let arrives = |light: &Light| {
        let (towards, end) = match *light {
            Light::Directional { direction, .. } => (-direction, f64::INFINITY),
            Light::Point { position, .. } | Light::Spot { position, .. } => (position - point, 1.0),
        };
        // As far from the surface as `shared/ray_offset.glsl` begins, or about that.
        let origin = point + 1e-5 * (point - camera.eye()).length() * seen.normal;
        seen.normal.dot(towards) > 0.0 && triangles.met(origin, towards, 0.0).all(|met| met.t >= end)
    };
    Some((seen.instance, seen.triangle, lights.iter().map(arrives).collect()))
}

/// What says of a pixel that it is a tie says so nowhere but on a shadow's edge, and elsewhere what arrives.
#[test]
fn only_where_a_shadow_ends_is_a_pixel_a_tie() {
    let scene = under_a_roof("smooth", 0.0);
    let triangles = Triangles::of(&scene);
    let sun = Light::Directional { direction: DVec3::NEG_Y, irradiance: [1.0; 3] };
    let camera = OVER_PLANE.view(SIZE).camera;
    let [mut lit, mut dark] = [0; 2];
    for (pixel, (point, _)) in seen_plane(SIZE).into_iter().enumerate() {
        let at = [pixel as u32 % SIZE[0], pixel as u32 / SIZE[0]];
        let sure = decided(at, |point| lit_by(&triangles, &[sun], &camera, SIZE, point).map(|(.., lit)| lit));
        match (sure.flatten(), meets_roof(point, DVec3::Y)) {
            (None, expected) => assert_eq!(expected, None, "{point} is not on an edge"),
            (Some(arrives), Some(hidden)) => {
                assert_eq!(arrives, [!hidden], "{point}");
                *(if hidden { &mut dark } else { &mut lit }) += 1;
            }
            (Some(_), None) => {}
        }
    }
    assert!(lit > 3000 && dark > 100, "{lit} lit, {dark} dark");
}

/// Both bodies, at the size that users meet: over a million triangles.
#[test]
fn the_large_scene_has_the_same_shadows_by_both_bodies() {
    const SIZE: [u32; 2] = [96, 54];
    let mut gpu = Gpu::new();
    let scene = embedded_scene("drift").expect("it is embedded").load().expect("it is sound");
    assert!(scene.triangle_count() > 1_000_000);
    let view = View::new(scene.default_camera(), SIZE);
    let sun = Light::Directional { direction: DVec3::new(-0.9, -0.15, -0.3).normalize(), irradiance: [3.0, 0.0, 0.0] };
    let bodies = gpu.occlusion_bodies();
    let mut shown = |body| {
        let mut scene = scene.clone();
        scene.lights.clear();
        let mut renderer = Renderer::new(scene, &[sun], None, body).expect("the scene is sound");
        renderer.set_method(None, "smooth").expect("the method exists");
        gpu.render(&mut renderer, &view).picture
    };
    let open = shown(OcclusionBackend::None);
    let pictures: Vec<Picture> = bodies.into_iter().map(&mut shown).collect();
    for picture in &pictures {
        // Of the surfaces that face the sun.
        let facing: Vec<usize> = (0..open.pixels.len()).filter(|pixel| open.pixels[*pixel][0] > 0.0).collect();
        let lit = facing.iter().filter(|pixel| picture.pixels[**pixel][0] == open.pixels[**pixel][0]).count();
        let dark = facing.iter().filter(|pixel| picture.pixels[**pixel][0] == 0.0).count();
        println!(
            "{} face the sun, {lit} lit, {dark} in shadow; {:?} differ",
            facing.len(),
            pictures[0].differing(picture)
        );
        assert_eq!(lit + dark, facing.len());
        assert!(20 * dark > facing.len() && 5 * lit > facing.len(), "{lit} lit, {dark} in shadow");
        assert!(pictures[0].differing(picture).len() <= 1, "{:?}", pictures[0].differing(picture));
    }
}

/// Ray queries and the BVH render the same picture of a scene, but for ties: rays that pass an edge by less than
/// rounding, and where f64 sees one thing a 64th of a pixel to one side and another to the other. Of the 20,736 pixels
/// of each scene, with a ray to either light, two may be such.
#[test]
fn pictures_of_both_bodies_differ_only_at_ties() {
    const SIZE: [u32; 2] = [192, 108];
    let mut gpu = Gpu::new();
    let bodies = gpu.occlusion_bodies();
    for name in ["shoe", "snow", "car", "dress"] {
        let scene = embedded_scene(name).expect("it is embedded").load().expect("it is sound");
        let bounds = scene.bounds().expect("there is something");
        let at = |x: f64, y: f64, z: f64| bounds.center() + bounds.radius() * DVec3::new(x, y, z);
        let power = (8.0 * bounds.radius().powi(2)) as f32;
        let lights = [
            Light::Directional { direction: DVec3::new(-0.6, -0.5, -0.3).normalize(), irradiance: [0.0, 3.0, 0.0] },
            Light::Point { position: at(0.2, 0.9, 0.6), radiant_intensity: [0.0, 0.0, power], range: None },
        ];
        let camera = scene.default_camera();
        let view = View::new(camera.clone(), SIZE);
        let pictures: Vec<Picture> = bodies
            .iter()
            .map(|body| {
                let mut renderer = Renderer::new(scene.clone(), &lights, None, *body).expect("the scene is sound");
                renderer.set_method(None, "smooth").expect("the method exists");
                gpu.render(&mut renderer, &view).picture
            })
            .collect();
        let [bvh, others @ ..] = pictures.as_slice() else { unreachable!("there is always the BVH") };
        let mean = bvh.mean();
        assert!(mean[1] > 0.0 && mean[2] > 0.0, "{name}: both lights arrive: {mean:?}");
        for other in others {
            let differing = bvh.differing(other);
            println!("{name}: {} of {} pixels differ", differing.len(), bvh.pixels.len());
            assert!(differing.len() <= 2, "{name}: {differing:?}");
            if !differing.is_empty() {
                let triangles = Triangles::of(&scene);
                for pixel in differing {
                    let at = [pixel as u32 % SIZE[0], pixel as u32 / SIZE[0]];
                    let sure = decided(at, |point| lit_by(&triangles, &lights, &camera, SIZE, point));
                    assert_eq!(sure, None, "{name}: pixel {at:?} is no tie");
                }
            }
        }
    }
    println!("compared: {:?}", bodies.iter().map(|body| body.name()).collect::<Vec<_>>());
}

/// Without lights and without a method that asks, no hierarchy is built, uploaded or bound and no ray is traced,
/// whoever would answer; one light, or the method that asks, brings just its own pass.
#[test]
fn nothing_is_built_or_traced_unless_asked() {
    let gpu = Gpu::new();
    let environment = Environment { map: EquirectMap::constant([1.0; 3]), rotation_radians: 0.0 };
    let lamp = Light::Point { position: DVec3::new(0.8, 4.0, -5.0), radiant_intensity: [30.0; 3], range: None };
    for body in gpu.occlusion_bodies() {
        let traced = |method: &str, lights: &[Light]| {
            let scene = under_a_roof(method, 1e5);
            let mut renderer = Renderer::new(scene, lights, Some(&environment), body).expect("the scene is sound");
            if method == "wang2020" {
                renderer.set(None, "samples", "1").expect("a setting");
            }
            let mut graph = Graph::new();
            let frame = renderer.frame(&mut graph, &OVER_PLANE.view(SIZE), None).expect("the frame is declared");
            let asked: Vec<&str> = frame.rays.iter().map(|rays| rays.pass).collect();
            let passes = graph.passes();
            let of_rays = |name: &str| ["bvh", "structure", "ray_counts"].iter().any(|word| name.contains(word));
            let uses = passes.iter().flat_map(|pass| &pass.uses).filter(|used| of_rays(&used.resource.name)).count();
            let built = passes.iter().filter(|pass| pass.name.starts_with("build") || of_rays(&pass.name)).count();
            let declared = |name: &str| passes.iter().any(|pass| pass.name == name);
            for pass in ["shadows", "occlusion"] {
                assert_eq!(declared(pass), asked.contains(&pass), "{method}: {pass} of {asked:?}");
            }
            assert_eq!(uses + built > 0, !asked.is_empty(), "{method}: {uses} uses, {built} builds for {asked:?}");
            asked.join(" ")
        };
        for method in METHODS {
            let mirrors = if method.name == "wang2020" { "occlusion" } else { "" };
            assert_eq!(traced(method.name, &[]), mirrors, "{} without lights", method.name);
        }
        assert_eq!(traced("smooth", &[lamp]), "shadows");
        assert_eq!(traced("wang2020", &[lamp]), "shadows occlusion");
    }
}

/// Rays are traced towards lights, into the glints' mirror direction, and by the caller: there is no ambient occlusion,
/// and nothing else that nobody asked for.
#[test]
fn no_other_shader_traces_rays() {
    let traces = |shader: &&&Shader| {
        shader.bindings.iter().any(|binding| ["bvh_nodes", "scene_structure"].contains(&binding.name))
    };
    let mut found: Vec<&str> = mica_shaders::ALL.iter().filter(traces).map(|shader| shader.name).collect();
    found.dedup();
    assert_eq!(found, ["occlusion", "shadows", "trace_rays"]);
}
