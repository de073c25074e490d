//! The hierarchies that rays are asked of: made where something asks, followed where instances move, alike in all bodies.

use glam::{DAffine3, DQuat, DVec3};
use mica_gpu::{DeviceKind, Feature, Timing};
use mica_graph::{Graph, Lifetime, Pass, Work};
use mica_render::scene::{AlphaMode, Instance, Light, Material, Mesh, Scene};
use mica_render::{OcclusionBackend, Question, Ray, RayCounts, RenderError, Renderer, View};
use mica_tests::shapes::{OVER_PLANE, plane, sphere};
use mica_tests::{Gpu, Picture};

const SIZE: [u32; 2] = [64, 36];
const SUN: Light = Light::Directional { direction: DVec3::new(0.0, -1.0, 0.0), irradiance: [1.0; 3] };
/// Which instance of [`yard`] moves, and where it is at first: within the box of the others, also after each move.
const BALL: usize = 3;
/// The meshes of [`yard`] that have triangles.
const MESHES: [usize; 3] = [0, 2, 3];
const BALL_AT: DVec3 = DVec3::new(0.0, 1.0, 0.0);

fn gray(name: &str) -> Material {
    Material { name: name.to_owned(), base_color: [0.5, 0.5, 0.5, 1.0], ..Material::default() }
}

/// Adds the one mesh of another scene, placed so.
fn add(scene: &mut Scene, mut other: Scene, places: &[DAffine3]) {
    let (mesh, material) = (scene.meshes.len(), scene.materials.len());
    other.meshes[0].material = material;
    scene.meshes.append(&mut other.meshes);
    scene.materials.append(&mut other.materials);
    let name = format!("part {mesh}");
    let place = |&world_from_local| Instance { mesh, world_from_local, name: name.clone() };
    scene.instances.extend(places.iter().map(place));
}

fn ball(at: DVec3) -> DAffine3 {
    let turn = DQuat::from_axis_angle(DVec3::new(0.6, 0.0, 0.8), 0.7);
    DAffine3::from_scale_rotation_translation(DVec3::new(0.3, -0.2, 0.4), turn, at)
}

/// A ground, an instance of a mesh without triangles, a roof high above the ground, and two balls below it.
fn yard() -> Scene {
    let mut scene = plane(gray("ground"), 40.0);
    let nothing = Scene { meshes: vec![Mesh::default()], materials: vec![gray("nothing")], ..Scene::default() };
    add(&mut scene, nothing, &[DAffine3::IDENTITY]);
    add(&mut scene, plane(gray("roof"), 0.5), &[DAffine3::from_translation(DVec3::new(3.0, 4.0, 0.0))]);
    add(&mut scene, sphere(gray("ball"), 6), &[ball(BALL_AT), ball(DVec3::new(-1.0, 1.0, -1.0))]);
    scene
}

fn renderer(scene: Scene, body: OcclusionBackend) -> Renderer {
    Renderer::new(scene, &[SUN], None, body).expect("the scene is sound")
}

fn view() -> View {
    OVER_PLANE.view(SIZE)
}

/// What brings the scene up to date in the next frame, with the reasons; and the frame's picture.
fn next_frame(gpu: &mut Gpu, renderer: &mut Renderer) -> (Vec<[String; 2]>, Picture) {
    let mut graph = Graph::new();
    let frame = renderer.frame(&mut graph, &view(), None).expect("the frame is declared");
    let why = |pass: &Pass| [pass.name.clone(), pass.why.clone()];
    let updates = graph.passes()[frame.updates].iter().map(why).collect();
    let download = graph.download_image(&frame.radiance);
    let mut run = gpu.executor().run(graph, Timing::Overlapped).expect("the frame runs");
    (updates, Picture::from_bytes(SIZE, &run.take(download)))
}

fn names(updates: &[[String; 2]]) -> Vec<&str> {
    updates.iter().map(|[name, _]| name.as_str()).collect()
}

/// A ray through world space, as the renderer takes it.
fn ray(renderer: &Renderer, origin: DVec3, direction: DVec3) -> Ray {
    Ray {
        origin: (origin - renderer.scene_center()).as_vec3().to_array(),
        direction: direction.as_vec3().to_array(),
        t_max: 1e30,
        ..Ray::default()
    }
}

/// Rays from a grid over the yard, straight down and aslant.
fn rain(renderer: &Renderer) -> Vec<Ray> {
    let drop = |k: i32| {
        let [x, z] = [k % 64, k / 64].map(|step| (f64::from(step) - 31.5) * 0.09);
        let aslant = if k % 2 == 0 { DVec3::ZERO } else { DVec3::new(0.3, 0.0, -0.2) };
        ray(renderer, DVec3::new(x, 9.0, z), DVec3::NEG_Y + aslant)
    };
    (0..64 * 64).map(drop).collect()
}

/// The instance that each ray meets first, none where it meets nothing.
fn met(gpu: &mut Gpu, renderer: &mut Renderer, rays: &[Ray]) -> Vec<Option<u32>> {
    let (closest, _) = gpu.trace(renderer, rays, Question::Closest);
    let (any, _) = gpu.trace(renderer, rays, Question::Any);
    assert!(closest.iter().zip(&any).all(|(closest, any)| closest.blocked == any.blocked), "both questions agree");
    closest.iter().map(|answer| (answer.blocked == 1).then_some(answer.instance)).collect()
}

/// The bytes of the rows whose name begins so.
fn rows(gpu: &mut Gpu, beginning: &str) -> Vec<(String, u64)> {
    gpu.executor().collect();
    let of_name = gpu.executor().memory().into_iter().filter(|row| row.name.starts_with(beginning));
    let mut rows: Vec<(String, u64)> = of_name
        .map(|row| {
            assert_eq!(row.lifetime, Lifetime::Scene, "{}", row.name);
            (row.name, row.bytes)
        })
        .collect();
    rows.sort();
    rows
}

#[test]
fn nothing_is_built_where_nothing_asks() {
    let mut gpu = Gpu::new();
    for body in [OcclusionBackend::None, OcclusionBackend::Bvh, OcclusionBackend::RayQuery] {
        let mut dark = Renderer::new(yard(), &[], None, body).expect("the scene is sound");
        assert_eq!(dark.precompute(gpu.executor(), None, &mut |_, _, _| {}).expect("nothing to do"), []);
        for _ in 0..6 {
            let shot = gpu.render(&mut dark, &view());
            let of_rays = ["bvh", "structure", "scratch", "ray_counts"];
            assert!(!shot.resources.iter().any(|name| of_rays.iter().any(|word| name.contains(word))), "{body:?}");
            assert!(!shot.declares("shadows") && !shot.declares("occlusion"), "{body:?}: {:?}", shot.draws);
        }
        let mut graph = Graph::new();
        assert!(dark.frame(&mut graph, &view(), None).expect("declared").rays.is_empty());
        gpu.run(graph, &[]);
        assert_eq!([rows(&mut gpu, "bvh"), rows(&mut gpu, "structure")], [vec![], vec![]], "{body:?}");
    }
}

#[test]
fn the_first_frame_that_asks_builds_and_those_after_it_do_not() {
    let mut gpu = Gpu::new();
    let without = next_frame(&mut gpu, &mut renderer(yard(), OcclusionBackend::None)).0;
    for body in gpu.occlusion_bodies() {
        let mut renderer = renderer(yard(), body);
        let (first, _) = next_frame(&mut gpu, &mut renderer);
        let added: Vec<[String; 2]> = first.iter().filter(|update| !without.contains(update)).cloned().collect();
        let expected: &[&str] = match body {
            OcclusionBackend::RayQuery => &["build meshes", "build scene"],
            _ => &["upload bvh_nodes", "upload bvh_triangles", "upload bvh_instances"],
        };
        assert_eq!(names(&added), expected);
        assert!(added.iter().all(|[_, why]| why == "first frame that asks for occlusion"), "{added:?}");
        assert_eq!(first.len(), without.len() + added.len());
        let frames: Vec<Vec<[String; 2]>> = (1..8).map(|_| next_frame(&mut gpu, &mut renderer).0).collect();
        // Compaction waits until no host can still have the build under way.
        let (idle, compacting): (Vec<_>, Vec<_>) =
            frames.iter().enumerate().partition(|(_, updates)| updates.is_empty());
        if body == OcclusionBackend::Bvh {
            assert_eq!(idle.len(), 7, "{frames:?}");
            continue;
        }
        let [(3, updates)] = compacting[..] else { panic!("compacted once, in the fifth frame: {frames:?}") };
        let (copies, top) = updates.split_at(3);
        let known = "how much room it needs is known since it was built";
        let copy = |mesh| [format!("compact structure of mesh {mesh}"), known.to_owned()];
        assert_eq!(copies, MESHES.map(copy));
        assert_eq!(top, [["build scene", "the structures below it were compacted"]]);
    }
}

#[test]
fn a_moved_instance_updates_what_depends_on_it_and_nothing_else() {
    let mut gpu = Gpu::new();
    for body in [OcclusionBackend::None].into_iter().chain(gpu.occlusion_bodies()) {
        let mut renderer = renderer(yard(), body);
        (0..5).for_each(|_| drop(next_frame(&mut gpu, &mut renderer)));
        let (_, before) = next_frame(&mut gpu, &mut renderer);
        let expected: &[&str] = match body {
            OcclusionBackend::None => &["upload instances"],
            OcclusionBackend::Bvh => &["upload instances", "update bvh_nodes", "upload bvh_instances"],
            OcclusionBackend::RayQuery => &["upload instances", "build scene"],
        };
        let because = |why| expected.iter().map(|name| [(*name).to_owned(), String::from(why)]).collect::<Vec<_>>();
        renderer.place_instance(BALL, ball(DVec3::new(0.4, 0.8, 0.2))).expect("it can be there");
        let (updates, after) = next_frame(&mut gpu, &mut renderer);
        assert_eq!(updates, because("instance 3 moved"), "{body:?}");
        assert!(!before.differing(&after).is_empty(), "{body:?}: it shows");
        for _ in 0..5 {
            assert_eq!(names(&next_frame(&mut gpu, &mut renderer).0), [""; 0], "{body:?}: up to date");
        }
        // To where it is: nothing to do.
        let there = renderer.scene().instances[BALL].world_from_local;
        renderer.place_instance(BALL, there).expect("it is there");
        assert_eq!(names(&next_frame(&mut gpu, &mut renderer).0), [""; 0], "{body:?}: it did not move");
        for (instance, x) in [(BALL, 0.1), (BALL + 1, 0.2), (BALL, 0.3)] {
            renderer.place_instance(instance, ball(DVec3::new(x, 1.0, 0.0))).expect("it can be there");
        }
        assert_eq!(next_frame(&mut gpu, &mut renderer).0, because("2 instances moved"), "{body:?}");
        // The one without triangles blocks no ray, wherever it is.
        renderer.place_instance(1, ball(DVec3::ONE)).expect("it can be there");
        next_frame(&mut gpu, &mut renderer);
    }
}

#[test]
fn rays_meet_each_instance_where_it_is() {
    let mut gpu = Gpu::new();
    for body in gpu.occlusion_bodies() {
        let mut renderer = renderer(yard(), body);
        let down = [[3.0, 0.0], [0.0, 0.0], [-1.0, -1.0], [-2.0, 2.0], [50.0, 0.0]];
        let rays = down.map(|[x, z]| ray(&renderer, DVec3::new(x, 9.0, z), DVec3::NEG_Y));
        assert_eq!(met(&mut gpu, &mut renderer, &rays), [Some(2), Some(3), Some(4), Some(0), None], "{body:?}");
    }
}

#[test]
fn what_moves_while_nobody_asks_is_followed_when_somebody_does() {
    let mut gpu = Gpu::new();
    for body in gpu.occlusion_bodies() {
        let mut dark = Renderer::new(yard(), &[], None, body).expect("the scene is sound");
        next_frame(&mut gpu, &mut dark);
        let rays = rain(&dark);
        let before = met(&mut gpu, &mut dark, &rays);
        for x in [1.2, 0.7] {
            dark.place_instance(BALL, ball(DVec3::new(x, 2.0, 0.0))).expect("it can be there");
            assert_eq!(names(&next_frame(&mut gpu, &mut dark).0), ["upload instances"], "{body:?}");
        }
        let after = met(&mut gpu, &mut dark, &rays);
        assert!(before.contains(&Some(BALL as u32)) && after.contains(&Some(BALL as u32)), "{body:?}");
        assert!(before != after, "{body:?}: it moved");
        let mut scene = yard();
        scene.instances[BALL].world_from_local = ball(DVec3::new(0.7, 2.0, 0.0));
        assert!(after == met(&mut gpu, &mut renderer(scene, body), &rays), "{body:?}: it is met elsewhere");
    }
}

/// Bit for bit: the moved scene is traced and drawn as one that was made where it moved to.
#[test]
fn a_moved_scene_is_one_that_was_made_so() {
    let mut gpu = Gpu::new();
    let places = [DVec3::new(0.3, 0.9, 0.4), DVec3::new(-0.7, 1.5, 1.0), DVec3::new(2.9, 2.0, 0.1)].map(ball);
    for body in gpu.occlusion_bodies() {
        let mut moved = renderer(yard(), body);
        let mut pictures = vec![next_frame(&mut gpu, &mut moved).1];
        for place in places {
            moved.place_instance(BALL, place).expect("it can be there");
            let (_, picture) = next_frame(&mut gpu, &mut moved);
            let mut scene = yard();
            scene.instances[BALL].world_from_local = place;
            assert_eq!(moved.scene(), &scene);
            let mut fresh = renderer(scene, body);
            let (_, expected) = next_frame(&mut gpu, &mut fresh);
            assert_eq!(picture.differing(&expected), [0; 0], "{body:?}");
            for question in [Question::Any, Question::Closest] {
                let rays = rain(&fresh);
                let answers = gpu.trace(&mut moved, &rays, question);
                assert!(answers == gpu.trace(&mut fresh, &rays, question), "{body:?} {question:?}: they differ");
            }
            assert!(met(&mut gpu, &mut moved, &rain(&fresh)).contains(&Some(BALL as u32)), "{body:?}: it is met");
            assert!(pictures.iter().all(|earlier| !earlier.differing(&picture).is_empty()), "{body:?}: it shows");
            pictures.push(picture);
        }
    }
}

#[test]
fn precomputation_builds_beforehand_and_changes_no_pixel() {
    let mut gpu = Gpu::new();
    for body in gpu.occlusion_bodies() {
        let mut early = renderer(yard(), body);
        let mut heard = Vec::new();
        let mut hear = |what: &str, done, all| heard.push((what.to_owned(), done, all));
        let updates = early.precompute(gpu.executor(), None, &mut hear).expect("it is built");
        let built: Vec<&str> = updates.iter().map(|update| update.pass.as_str()).collect();
        if body == OcclusionBackend::Bvh {
            assert_eq!(built, ["build bvh"]);
        } else {
            let copies = MESHES.map(|mesh| format!("compact structure of mesh {mesh}"));
            assert_eq!(built, ["build meshes", &copies[0], &copies[1], &copies[2], "build scene"]);
            assert_eq!(heard.iter().map(|(_, done, _)| *done).collect::<Vec<_>>(), [0, 1, 2], "builds, then copies");
        }
        // Triangles and instances find their places in a hierarchy.
        let yard_parts = yard().meshes.iter().map(|mesh| mesh.triangle_count() as u64).sum::<u64>() + 5;
        let all = if body == OcclusionBackend::Bvh { yard_parts } else { 2 };
        assert_eq!(heard.last(), Some(&("building occlusion".to_owned(), all, all)));
        assert!(heard.iter().all(|(_, done, of)| done <= of && *of == all), "{heard:?}");
        assert!(heard.windows(2).all(|pair| pair[0].1 <= pair[1].1), "{heard:?}");
        assert!(updates.iter().all(|update| update.ns > 0 && !update.why.is_empty()), "{updates:?}");
        assert_eq!(early.precompute(gpu.executor(), None, &mut |_, _, _| {}).expect("there is nothing to do"), []);

        let mut late = renderer(yard(), body);
        let (_, expected) = next_frame(&mut gpu, &mut late);
        let (first, picture) = next_frame(&mut gpu, &mut early);
        assert!(
            !names(&first).iter().any(|name| name.starts_with("build") || name.starts_with("compact")),
            "{first:?}"
        );
        assert_eq!(picture.differing(&expected), [0; 0], "{body:?}");
        for _ in 0..6 {
            assert_eq!(names(&next_frame(&mut gpu, &mut early).0), [""; 0], "{body:?}: all is done");
        }
        // Moved before anything was uploaded.
        let mut moved = renderer(yard(), body);
        moved.precompute(gpu.executor(), None, &mut |_, _, _| {}).expect("it is built");
        moved.place_instance(BALL, ball(DVec3::ONE)).expect("it can be there");
        late.place_instance(BALL, ball(DVec3::ONE)).expect("it can be there");
        let (_, expected) = next_frame(&mut gpu, &mut late);
        assert_eq!(next_frame(&mut gpu, &mut moved).1.differing(&expected), [0; 0], "{body:?}");
    }
}

#[test]
fn each_part_is_in_memory_once() {
    let mut gpu = Gpu::new();
    let bytes = |rows: &[(String, u64)]| rows.iter().map(|(_, bytes)| bytes).sum::<u64>();
    for body in gpu.occlusion_bodies() {
        let mut renderer = renderer(yard(), body);
        next_frame(&mut gpu, &mut renderer);
        if body == OcclusionBackend::Bvh {
            let names: Vec<String> = rows(&mut gpu, "bvh").into_iter().map(|(name, _)| name).collect();
            assert_eq!(names, ["bvh_instances", "bvh_nodes", "bvh_triangles"]);
            continue;
        }
        let built = rows(&mut gpu, "structure of");
        let names: Vec<&str> = built.iter().map(|(name, _)| name.as_str()).collect();
        let expected = ["structure of mesh 0", "structure of mesh 2", "structure of mesh 3", "structure of scene"];
        assert_eq!(names, expected);
        (0..6).for_each(|_| drop(next_frame(&mut gpu, &mut renderer)));
        let compacted = rows(&mut gpu, "structure of");
        assert_eq!(compacted.iter().map(|(name, _)| name.as_str()).collect::<Vec<_>>(), expected);
        println!("{} bytes of structures became {}", bytes(&built), bytes(&compacted));
        assert!(bytes(&compacted) <= bytes(&built), "{built:?} {compacted:?}");
        drop(renderer);
        assert_eq!(rows(&mut gpu, "structure of"), [], "given back");
    }
}

/// Each build has working space of its own, for as long as its pass takes.
#[test]
fn one_pass_builds_over_a_bounded_number_of_triangles() {
    let mesh = |triangles: usize| Mesh {
        positions: vec![[0.0; 3]],
        normals: vec![[0.0, 1.0, 0.0]],
        indices: vec![0; 3 * triangles],
        ..Mesh::default()
    };
    let mut scene = Scene {
        meshes: [1_200_000, 500_000, 500_000, 500_000, 10].map(mesh).to_vec(),
        materials: vec![gray("points")],
        ..Scene::default()
    };
    let instance = |mesh| Instance { mesh, world_from_local: DAffine3::IDENTITY, name: "points".to_owned() };
    scene.instances.extend((0..scene.meshes.len()).map(instance));
    let mut graph = Graph::new();
    renderer(scene, OcclusionBackend::RayQuery).frame(&mut graph, &view(), None).expect("declared");
    let built = graph.passes().iter().filter_map(|pass| match &pass.work {
        Work::BuildMeshes { meshes } => Some(meshes.len()),
        _ => None,
    });
    assert_eq!(built.collect::<Vec<_>>(), [1, 2, 2]);
}

#[test]
fn scenes_without_triangles_block_nothing() {
    let mut gpu = Gpu::new();
    let nothing = Mesh { name: "nothing".to_owned(), ..Mesh::default() };
    let empty_mesh = Scene {
        meshes: vec![nothing],
        materials: vec![gray("none")],
        instances: vec![Instance { mesh: 0, world_from_local: ball(DVec3::ONE), name: "nothing".to_owned() }],
        ..Scene::default()
    };
    for body in gpu.occlusion_bodies() {
        for scene in [Scene::default(), empty_mesh.clone()] {
            let mut renderer = renderer(scene, body);
            renderer.precompute(gpu.executor(), None, &mut |_, _, _| {}).expect("nothing is built quickly");
            let rays = rain(&renderer);
            assert!(met(&mut gpu, &mut renderer, &rays).iter().all(Option::is_none), "{body:?}");
            assert_eq!(next_frame(&mut gpu, &mut renderer).1.nonfinite(), 0, "{body:?}");
        }
    }
}

/// Instances without an inverse are stored in scene space, and followed there.
#[test]
fn flattened_instances_block_rays_and_move() {
    let mut gpu = Gpu::new();
    let flat = |y: f64| {
        let turned = DAffine3::from_rotation_x(0.4) * DAffine3::from_scale(DVec3::new(0.9, 0.0, 0.9));
        DAffine3::from_translation(DVec3::new(0.0, y, 0.0)) * turned
    };
    for body in gpu.occlusion_bodies() {
        let mut scene = yard();
        scene.instances[BALL].world_from_local = flat(2.0);
        let mut renderer = renderer(scene, body);
        next_frame(&mut gpu, &mut renderer);
        let down = [ray(&renderer, DVec3::new(0.1, 9.0, 0.1), DVec3::NEG_Y)];
        let height = |gpu: &mut Gpu, renderer: &mut Renderer| {
            let (answers, _) = gpu.trace(renderer, &down, Question::Closest);
            assert_eq!((answers[0].blocked, answers[0].instance), (1, BALL as u32), "{body:?}");
            9.0 - f64::from(answers[0].t)
        };
        // The plane through (0, y, 0), turned about x.
        let expected = |y: f64| y - 0.1 * 0.4f64.tan();
        assert!((height(&mut gpu, &mut renderer) - expected(2.0)).abs() < 1e-5, "{body:?}");

        // Its triangles move, and nothing of the others.
        (0..5).for_each(|_| drop(next_frame(&mut gpu, &mut renderer)));
        renderer.place_instance(BALL, flat(1.0)).expect("it can be there");
        let (updates, _) = next_frame(&mut gpu, &mut renderer);
        let all_bvh = ["upload instances", "upload bvh_nodes", "upload bvh_triangles", "upload bvh_instances"];
        let part = ["upload instances", "upload positions_in_scene_space", "build meshes", "build scene"];
        assert_eq!(names(&updates), if body == OcclusionBackend::Bvh { all_bvh } else { part });
        assert!(updates.iter().all(|[_, why]| why == "instance 3 moved"), "{updates:?}");
        assert!((height(&mut gpu, &mut renderer) - expected(1.0)).abs() < 1e-5, "{body:?}");

        // A ball again: its mesh is still there for the other one.
        renderer.place_instance(BALL, ball(BALL_AT)).expect("it can be there");
        let (updates, picture) = next_frame(&mut gpu, &mut renderer);
        let part = ["upload instances", "build scene"];
        let expected: &[&str] = if body == OcclusionBackend::Bvh { &all_bvh } else { &part };
        assert_eq!(names(&updates), expected);
        let kept: Vec<String> = rows(&mut gpu, "structure of instance").into_iter().map(|(name, _)| name).collect();
        assert_eq!(kept, [""; 0], "given back");
        let mut fresh = self::renderer(yard(), body);
        assert_eq!(picture.differing(&next_frame(&mut gpu, &mut fresh).1), [0; 0], "{body:?}");
    }
}

/// What `shared/ray_offset.glsl` counts coordinates in, as the next trace says it.
fn scene_unit(renderer: &mut Renderer) -> f32 {
    let mut graph = Graph::new();
    let [rays, mut answers] = ["rays", "answers"].map(|name| graph.buffer(name, 64));
    renderer.trace(&mut graph, &rays, 1, Question::Any, &mut answers).expect("declared");
    let last = graph.passes().last().expect("the pass that traces");
    let Work::Compute { params, .. } = &last.work else { panic!("{}: it is a compute pass", last.name) };
    bytemuck::pod_read_unaligned(&params[8..12])
}

#[test]
fn the_scene_unit_follows_what_moves_and_the_centre_stays() {
    let mut renderer = renderer(yard(), OcclusionBackend::Bvh);
    let center = renderer.scene_center();
    assert_eq!(scene_unit(&mut renderer), 64.0);
    for (x, unit) in [(1000.0, 1024.0), (-70_000.0, 131_072.0), (0.0, 64.0)] {
        renderer.place_instance(BALL, ball(DVec3::new(x, 1.0, 0.0))).expect("it can be there");
        assert_eq!(scene_unit(&mut renderer), unit);
        assert_eq!(renderer.scene_center(), center);
    }
}

#[test]
fn a_bad_placement_is_refused_and_changes_nothing() {
    let mut gpu = Gpu::new();
    for body in gpu.occlusion_bodies() {
        let mut renderer = renderer(yard(), body);
        let (_, before) = next_frame(&mut gpu, &mut renderer);
        let missing = renderer.place_instance(5, DAffine3::IDENTITY).expect_err("there are five");
        assert_eq!(missing.to_string(), "there is no instance 5: the scene has 5, counted from 0");
        let mut nan = ball(BALL_AT);
        nan.matrix3.x_axis.y = f64::NAN;
        let mut infinite = ball(BALL_AT);
        infinite.translation.z = f64::INFINITY;
        let far = [2e12, -1e300].map(|x| ball(DVec3::new(x, 0.0, 0.0)));
        let large = DAffine3::from_scale(DVec3::splat(1e13));
        for place in [nan, infinite, far[0], far[1], large] {
            let refused = renderer.place_instance(BALL, place).expect_err("it cannot be there");
            assert!(matches!(refused, RenderError::BadPlacement { index: BALL }), "{refused}");
        }
        assert_eq!(renderer.scene(), &yard());
        let (updates, after) = next_frame(&mut gpu, &mut renderer);
        assert_eq!(names(&updates), [""; 0], "{body:?}");
        assert_eq!(before.differing(&after), [0; 0], "{body:?}");
        // As far as it may be.
        renderer.place_instance(BALL, ball(DVec3::new(9.9e11, 0.0, 0.0))).expect("it can be there");
        assert_eq!(next_frame(&mut gpu, &mut renderer).1.nonfinite(), 0, "{body:?}");
    }
}

#[test]
fn what_cannot_be_traced_is_refused() {
    let mut renderer = renderer(yard(), OcclusionBackend::None);
    let mut graph = Graph::new();
    let [rays, mut answers] = [("rays", 480), ("answers", 239)].map(|(name, bytes)| graph.buffer(name, bytes));
    let mut refused = |renderer: &mut Renderer, count| {
        renderer.trace(&mut graph, &rays, count, Question::Any, &mut answers).expect_err("refused").to_string()
    };
    let off = "rays cannot be traced: occlusion is off; make the renderer with another occlusion backend";
    assert_eq!(refused(&mut renderer, 1), off);
    let mut renderer = self::renderer(yard(), OcclusionBackend::Bvh);
    assert_eq!(refused(&mut renderer, 11), "11 rays take 528 bytes, and their buffer has 480: make it larger");
    assert_eq!(refused(&mut renderer, 10), "10 answers take 240 bytes, and their buffer has 239: make it larger");
    assert!(graph.passes().is_empty(), "nothing is declared for what is refused");
}

#[test]
fn rays_are_counted_for_each_pass() {
    let mut gpu = Gpu::new();
    for body in gpu.occlusion_bodies() {
        let mut renderer = renderer(yard(), body);
        let mut graph = Graph::new();
        let frame = renderer.frame(&mut graph, &view(), None).expect("declared");
        let [of_shadows] = &frame.rays[..] else { panic!("{body:?}: one pass traces rays") };
        assert_eq!(of_shadows.pass, "shadows");
        let read = gpu.run(graph, &[&of_shadows.counts]);
        let counts: RayCounts = bytemuck::pod_read_unaligned(&read[0]);
        // The camera sees nothing but surfaces; all but some on the lower half of balls face the sun.
        let pixels = SIZE[0] * SIZE[1];
        assert!((pixels * 9 / 10..=pixels).contains(&counts.traced), "{body:?}: {counts:?}");
        assert_eq!(counts.cut_short, 0, "{body:?}");

        let rays = rain(&renderer);
        let expected = RayCounts { traced: rays.len() as u32, cut_short: 0 };
        assert_eq!(gpu.trace(&mut renderer, &rays, Question::Any).1, expected, "{body:?}");
        // Rays without a direction are none, and none may be asked for.
        let none = [Ray::default(); 3];
        assert_eq!(gpu.trace(&mut renderer, &none, Question::Closest).1, RayCounts::default(), "{body:?}");
        let mut graph = Graph::new();
        let [mut rays, mut answers] = ["rays", "answers"].map(|name| graph.buffer(name, 48));
        graph.fill(&mut rays, 0);
        let counts = renderer.trace(&mut graph, &rays, 0, Question::Any, &mut answers).expect("declared");
        assert_eq!(gpu.run(graph, &[&counts]), [[0; 8]], "{body:?}");
    }
}

#[test]
fn alpha_masks_are_tested_where_there_are_some() {
    let shaders = |scene: Scene, body| {
        let mut graph = Graph::new();
        renderer(scene, body).frame(&mut graph, &view(), None).expect("declared");
        let shadows = graph.passes().iter().find(|pass| pass.name == "shadows").expect("the pass").work.shader();
        shadows.expect("its shader").variant
    };
    let masked = |alpha, mesh: usize| {
        let mut scene = yard();
        let material = scene.meshes[mesh].material;
        scene.materials[material].alpha = alpha;
        scene
    };
    let mask = AlphaMode::Mask { cutoff: 0.5 };
    for (body, plain, with_masks) in [
        (OcclusionBackend::Bvh, "occlusion=bvh", "occlusion=bvh_masked"),
        (OcclusionBackend::RayQuery, "occlusion=ray_query", "occlusion=ray_query_masked"),
    ] {
        assert_eq!(shaders(yard(), body), plain);
        assert_eq!(shaders(masked(mask, 2), body), with_masks);
        assert_eq!(shaders(masked(AlphaMode::Blend, 3), body), with_masks);
        // A mask that no instance has asks for nothing.
        let mut unused = masked(mask, 2);
        unused.instances.remove(2);
        assert_eq!(shaders(unused, body), plain);
    }
}

#[test]
fn ray_queries_are_refused_by_name_where_there_are_none() {
    let mut gpu = Gpu::new();
    let device = gpu.executor().device().clone();
    let mut asks = renderer(yard(), OcclusionBackend::RayQuery);
    let built = asks.precompute(gpu.executor(), None, &mut |_, _, _| {});
    let mut graph = Graph::new();
    let mut asks = renderer(yard(), OcclusionBackend::RayQuery);
    asks.frame(&mut graph, &view(), None).expect("declared");
    let drawn = gpu.executor().run(graph, Timing::Overlapped);
    if device.has(Feature::RayQuery) {
        assert!(built.is_ok() && drawn.is_ok());
    } else {
        for refused in [built.expect_err("refused").to_string(), drawn.expect_err("refused").to_string()] {
            assert!(refused.contains("VK_KHR_ray_query"), "{refused}");
            assert!(!refused.contains('\n'), "{refused}");
        }
    }
}

#[test]
fn ray_queries_are_the_choice_of_gpus_that_have_them() {
    let mut info = Gpu::new().executor().device().info().clone();
    for kind in [DeviceKind::Discrete, DeviceKind::Integrated, DeviceKind::Virtual, DeviceKind::Cpu] {
        info.kind = kind;
        info.ray_query_lacks = Vec::new();
        let (body, why) = OcclusionBackend::auto(&info, 1_000_000);
        let expected = if kind == DeviceKind::Cpu { OcclusionBackend::Bvh } else { OcclusionBackend::RayQuery };
        assert_eq!(body, expected, "{kind:?}: {why}");
        let (body, why) = OcclusionBackend::auto(&info, info.limits.max_storage_buffer_range_bytes);
        assert_eq!(body, OcclusionBackend::RayQuery, "more triangles than a buffer holds: {why}");
        info.ray_query_lacks = vec!["VK_KHR_ray_query".to_owned()];
        let (body, why) = OcclusionBackend::auto(&info, u64::MAX);
        assert_eq!(body, OcclusionBackend::Bvh, "{kind:?}: {why}");
        assert!(why.contains("VK_KHR_ray_query"), "{kind:?}: {why}");
    }
    let names = [OcclusionBackend::None, OcclusionBackend::Bvh, OcclusionBackend::RayQuery].map(OcclusionBackend::name);
    assert_eq!(names, ["none", "bvh", "ray-query"]);
}
