//! Rays of the caller's own: what is one, where it ends, how many there may be; and scenes whose numbers are unusual.

use glam::{DAffine3, DQuat, DVec3};
use mica_graph::{Buffer, Extent, Graph, Work};
use mica_render::scene::bvh::{MeshBvh, SceneBvh};
use mica_render::scene::{Instance, Material, Scene};
use mica_render::{OcclusionBackend, Question, Ray, RayAnswer, RayCounts, Renderer};
use mica_shaders::trace_rays::bvh::{Bind, Params};
use mica_tests::Gpu;
use mica_tests::shapes::{plane, sphere, sphere_on_plane};

fn gray() -> Material {
    Material { name: "gray".to_owned(), base_color: [0.5, 0.5, 0.5, 1.0], ..Material::default() }
}

/// Without lights: nothing asks but the caller.
fn dark(scene: Scene, body: OcclusionBackend) -> Renderer {
    Renderer::new(scene, &[], None, body).expect("the scene is sound")
}

fn ray(origin: DVec3, direction: DVec3) -> Ray {
    let [origin, direction] = [origin, direction].map(|vector| vector.as_vec3().to_array());
    Ray { origin, direction, t_max: f32::INFINITY, ..Ray::default() }
}

/// The declared builds and copies of structures.
fn structures(graph: &Graph) -> Vec<&str> {
    let of_structures =
        |work: &Work| matches!(work, Work::BuildMeshes { .. } | Work::BuildInstances { .. } | Work::Compact);
    graph.passes().iter().filter(|pass| of_structures(&pass.work)).map(|pass| pass.name.as_str()).collect()
}

/// Traces a ray so many times in one graph, and says what that built.
fn traced_in_one_graph(gpu: &mut Gpu, renderer: &mut Renderer, times: usize) -> Vec<String> {
    let mut graph = Graph::new();
    for _ in 0..times {
        let [mut rays, mut answers] = ["rays", "answers"].map(|name| graph.buffer(name, 48));
        graph.upload(&mut rays, bytemuck::bytes_of(&ray(DVec3::Y, DVec3::NEG_Y)));
        renderer.trace(&mut graph, &rays, 1, Question::Any, &mut answers).expect("declared");
    }
    let built = structures(&graph).into_iter().map(str::to_owned).collect();
    gpu.run(graph, &[]);
    built
}

/// However many rays are declared in one graph: what a build needs is known when the graph is finished.
#[test]
fn who_only_traces_gets_compacted_structures_too() {
    let mut gpu = Gpu::new();
    if !gpu.occlusion_bodies().contains(&OcclusionBackend::RayQuery) {
        let mut graph = Graph::new();
        let [mut rays, mut answers] = ["rays", "answers"].map(|name| graph.buffer(name, 48));
        graph.fill(&mut rays, 0);
        let mut renderer = dark(sphere(gray(), 4), OcclusionBackend::RayQuery);
        renderer.trace(&mut graph, &rays, 1, Question::Any, &mut answers).expect("declared");
        let refused = gpu.executor().run(graph, mica_gpu::Timing::Overlapped).expect_err("refused").to_string();
        assert!(refused.contains("VK_KHR_ray_query"), "{refused}");
        return;
    }
    let mut renderer = dark(sphere(gray(), 16), OcclusionBackend::RayQuery);
    let built: Vec<_> = (0..7).map(|_| traced_in_one_graph(&mut gpu, &mut renderer, 3)).collect();
    let expected: [&[&str]; 7] =
        [&["build meshes", "build scene"], &[], &[], &[], &["compact structure of mesh 0", "build scene"], &[], &[]];
    assert_eq!(built, expected);
}

/// A ray that begins on a triangle does not meet it, and one whose span is tiny meets what is in it.
#[test]
fn a_span_may_begin_on_a_triangle_and_be_tiny() {
    let mut gpu = Gpu::new();
    let two = |power| 2.0f64.powi(power);
    let on = DVec3::new(0.25, 0.0, 0.125);
    let rays = [
        (ray(on, DVec3::NEG_Y), None),
        (ray(on, DVec3::Y), None),
        (ray(on, DVec3::new(0.5, -1.0, 0.25)), None),
        (ray(on + two(-10) * DVec3::Y, two(90) * DVec3::NEG_Y), Some(two(-100))),
        (Ray { t_max: two(-99) as f32, ..ray(on + two(-10) * DVec3::Y, two(90) * DVec3::NEG_Y) }, Some(two(-100))),
        (Ray { t_max: two(-100) as f32, ..ray(on + two(-10) * DVec3::Y, two(90) * DVec3::NEG_Y) }, None),
    ];
    for body in gpu.occlusion_bodies() {
        let mut renderer = dark(plane(gray(), 1.0), body);
        let (answers, counts) = gpu.trace(&mut renderer, &rays.map(|(ray, _)| ray), Question::Closest);
        for ((ray, expected), answer) in rays.iter().zip(&answers) {
            let met = (answer.blocked == 1).then_some(f64::from(answer.t));
            assert_eq!(met, *expected, "{body:?}: {ray:?}");
        }
        assert_eq!(counts, RayCounts { traced: 6, cut_short: 0 }, "{body:?}");
        let (any, _) = gpu.trace(&mut renderer, &rays.map(|(ray, _)| ray), Question::Any);
        assert!(any.iter().zip(&answers).all(|(any, closest)| any.blocked == closest.blocked), "{body:?}");
    }
}

/// Down to 1e-18, in meshes of any size; a shorter direction is none.
#[test]
fn a_direction_has_a_least_length() {
    let mut gpu = Gpu::new();
    let above = DVec3::new(0.25, 0.5, 0.125);
    for body in gpu.occlusion_bodies() {
        for scale in [1e-9, 1.0, 1e9] {
            let mut scene = plane(gray(), scale as f32);
            scene.instances[0].world_from_local = DAffine3::from_scale(DVec3::splat(1.0 / scale));
            let mut renderer = dark(scene, body);
            let aslant = DVec3::new(0.25, -1.0, 0.5);
            let lengths = [1e-40, 1e-31, 0.9e-18, 1.1e-18, 1e-6, 1e20];
            let rays = lengths.map(|length| ray(above, length * aslant));
            let (answers, counts) = gpu.trace(&mut renderer, &rays, Question::Closest);
            for (length, answer) in lengths.into_iter().zip(&answers) {
                let met = (answer.blocked == 1).then_some(f64::from(answer.t) * length);
                let right = met.map_or(length < 1e-18, |t| length >= 1e-18 && (t - 0.5).abs() < 1e-5);
                assert!(right, "{body:?}: {length} long, mesh {scale} large: {answer:?}");
            }
            assert_eq!(counts.traced, 3, "{body:?}: {counts:?}");
        }
    }
}

/// A vertex that no triangle has moves neither the centre nor the scene's unit, and so no ray's start.
#[test]
fn a_stray_vertex_changes_no_answer() {
    let mut gpu = Gpu::new();
    let tidy = sphere_on_plane(gray(), 6, 0.5, DVec3::new(2.0, 1.0, 0.0));
    let mut stray = tidy.clone();
    let mesh = &mut stray.meshes[1];
    mesh.positions.push([1e20, -1e20, 1e20]);
    mesh.normals.push([0.0, 1.0, 0.0]);
    mesh.uv[0].push([0.0; 2]);
    assert_eq!(stray.bounds(), tidy.bounds());
    let leaving = |k: i32| {
        let [x, z] = [k % 32, k / 32].map(|step| (f64::from(step) - 15.5) * 0.05);
        let normal = [0.0, 1.0, 0.0];
        Ray { normal, ..ray(DVec3::new(x, -0.5, z), DVec3::new(-x, 1.0, -z)) }
    };
    let rays: Vec<Ray> = (0..32 * 32).map(leaving).collect();
    for body in gpu.occlusion_bodies() {
        let said = [&tidy, &stray].map(|scene| {
            let mut renderer = dark(scene.clone(), body);
            assert_eq!(renderer.scene_center(), DVec3::new(2.0, 1.5, 0.0));
            let near = DAffine3::from_translation(DVec3::Y * 0.01) * scene.instances[1].world_from_local;
            let moved = renderer.place_instance(1, near);
            assert!(moved.is_ok(), "{body:?}: nothing of it leaves the world: {moved:?}");
            gpu.trace(&mut renderer, &rays, Question::Closest)
        });
        assert!(said[0].0.iter().any(|answer| answer.blocked == 1), "{body:?}");
        assert!(said[0] == said[1], "{body:?}: the answers differ");
    }
}

/// Transforms with an inverse in f64 that f32 takes for 0 or infinity: their instances still block rays, and move.
#[test]
fn instances_scaled_beyond_f32_block_rays() {
    let mut gpu = Gpu::new();
    let scales = [
        (1.0, DVec3::new(1.0, 1e-46, 1.0)),
        (1.0, DVec3::new(1.0, -1e-39, 1.0)),
        (1.0, DVec3::new(1.0, 1e-30, 1.0)),
        (1e-25, DVec3::splat(1e25)),
        (1e-38, DVec3::splat(1e38)),
        (1e-15, DVec3::splat(1e15)),
        (1e12, DVec3::splat(1e-12)),
    ];
    for body in gpu.occlusion_bodies() {
        for (size, scale) in scales {
            let mut scene = plane(gray(), 4.0);
            let mut ball = sphere(gray(), 6);
            for position in &mut ball.meshes[0].positions {
                *position = position.map(|coordinate| (f64::from(coordinate) * size) as f32);
            }
            scene.meshes.append(&mut ball.meshes);
            let at = |y: f64| DAffine3::from_translation(DVec3::new(1.0, y, 0.0)) * DAffine3::from_scale(scale);
            scene.instances.push(Instance { mesh: 1, world_from_local: at(1.0), name: "ball".to_owned() });
            let mut renderer = dark(scene, body);
            for y in [1.0, 0.5] {
                renderer.place_instance(1, at(y)).expect("it can be there");
                let down = ray(DVec3::new(1.1, 9.0, 0.2) - renderer.scene_center(), DVec3::NEG_Y);
                let (answers, _) = gpu.trace(&mut renderer, &[down], Question::Closest);
                let top = if scale.y.abs() < 1e-20 { y } else { y + 0.9 };
                let height = 9.0 - f64::from(answers[0].t);
                let case = format!("{body:?}: mesh {size} large, scaled by {scale}: {:?}", answers[0]);
                assert_eq!((answers[0].blocked, answers[0].instance), (1, 1), "{case}");
                assert!((height - top).abs() < if top == y { 1e-5 } else { 0.1 }, "{case}");
            }
        }
    }
}

/// Bit for bit, for turned and mirrored instances: what is looked at is the same box of each mesh.
#[test]
fn turned_instances_answer_alike_whether_they_were_moved_or_made_there() {
    let mut gpu = Gpu::new();
    let turned = |turn: f64| {
        let rotation = DQuat::from_axis_angle(DVec3::new(0.36, 0.48, 0.8), turn);
        let place = DVec3::new(1.0 - turn, 0.75, 0.2);
        DAffine3::from_scale_rotation_translation(DVec3::new(0.5, -0.7, 0.3), rotation, place)
    };
    let made = |turn| {
        let mut scene = sphere_on_plane(gray(), 8, 0.5, DVec3::ZERO);
        // Large, and aside: whatever is turned stays within the scene's box.
        let aside = DAffine3::from_translation(DVec3::new(-6.0, 0.0, 0.0)) * DAffine3::from_scale(DVec3::splat(3.0));
        scene.instances[1].world_from_local = aside;
        scene.instances.push(Instance { mesh: 1, world_from_local: turned(turn), name: "turned".to_owned() });
        scene
    };
    for body in gpu.occlusion_bodies() {
        let mut moved = dark(made(0.1), body);
        let center = moved.scene_center();
        let rays: Vec<Ray> = (0..4096)
            .map(|k| {
                let [x, z] = [k % 64, k / 64].map(|step| (f64::from(step) - 31.5) * 0.06);
                ray(DVec3::new(x, 5.0, z) - center, DVec3::new(0.1, -1.0, 0.05))
            })
            .collect();
        for turn in [0.7, 1.3] {
            moved.place_instance(2, turned(turn)).expect("it can be there");
            let mut fresh = dark(made(turn), body);
            assert_eq!(fresh.scene_center(), center, "it is within the others");
            let answers = gpu.trace(&mut moved, &rays, Question::Closest);
            assert!(answers.0.iter().any(|answer| answer.blocked == 1 && answer.instance == 2), "{body:?}");
            assert!(answers == gpu.trace(&mut fresh, &rays, Question::Closest), "{body:?}: they differ");
        }
    }
}

fn filled(graph: &mut Graph, name: &str, bytes: &[u8]) -> Buffer {
    let mut buffer = graph.buffer(name, bytes.len() as u64);
    graph.upload(&mut buffer, bytes);
    buffer
}

/// Every device runs 65,535 groups along an axis; more rays than these make rows of them. Rays are counted up to
/// 2^32 - 1, and no further.
#[test]
fn many_rays_are_asked_in_rows_and_counted_to_the_end() {
    const COUNT: u32 = 150;
    let mut gpu = Gpu::new();
    let scene = plane(gray(), 1.0);
    let mesh = MeshBvh::build(&scene.meshes[0].positions, &scene.meshes[0].indices).expect("a usable mesh");
    let bvh = SceneBvh::build(&[(0, DAffine3::IDENTITY)], &[mesh]).expect("a usable scene");
    // Those of odd number go upwards.
    let of_number = |k: u32| ray(DVec3::new(0.1, 1.0, 0.2), if k.is_multiple_of(2) { DVec3::NEG_Y } else { DVec3::Y });
    let rays: Vec<Ray> = (0..COUNT).map(of_number).collect();
    for (counted, expected) in [(0, COUNT), (u32::MAX - COUNT, u32::MAX), (u32::MAX - 70, u32::MAX)] {
        let mut graph = Graph::new();
        let nodes = filled(&mut graph, "nodes", bytemuck::cast_slice(&bvh.nodes));
        let triangles = filled(&mut graph, "triangles", bytemuck::cast_slice(&bvh.triangles));
        let instances = filled(&mut graph, "instances", bytemuck::cast_slice(&bvh.instances));
        let rays = filled(&mut graph, "rays", bytemuck::cast_slice(&rays));
        let mut counts = graph.buffer("counts", size_of::<RayCounts>() as u64);
        graph.fill(&mut counts, counted);
        let mut answers = graph.buffer("answers", u64::from(COUNT) * size_of::<RayAnswer>() as u64);
        let bind = Bind {
            bvh_nodes: &nodes,
            bvh_triangles: &triangles,
            bvh_instances: &instances,
            rays: &rays,
            ray_answers: &mut answers,
            ray_counts: &mut counts,
        };
        graph.pass(bind, Params { count: COUNT, closest: 0, scene_unit: 1.0 }, Extent::new(64, 3));
        let read = gpu.run(graph, &[&answers, &counts]);
        let blocked = bytemuck::pod_collect_to_vec::<u8, RayAnswer>(&read[0]).into_iter().map(|answer| answer.blocked);
        assert!(blocked.eq((0..COUNT).map(|k| 1 - k % 2)), "each is answered");
        let counts: RayCounts = bytemuck::pod_read_unaligned(&read[1]);
        assert_eq!(counts, RayCounts { traced: expected, cut_short: counted });
    }

    let mut graph = Graph::new();
    let most = 2 * 65_535 * 64 + 1;
    let rays = graph.buffer("rays", u64::from(most) * size_of::<Ray>() as u64);
    let mut answers = graph.buffer("answers", u64::from(most) * size_of::<RayAnswer>() as u64);
    let mut renderer = dark(scene, OcclusionBackend::Bvh);
    renderer.trace(&mut graph, &rays, most, Question::Any, &mut answers).expect("declared");
    let last = graph.passes().last().map(|pass| &pass.work);
    assert!(matches!(last, Some(Work::Compute { groups: [65_535, 3, 1], .. })), "{last:?}");
}
