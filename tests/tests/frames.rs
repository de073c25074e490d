//! Whole frames: the same bits twice, only the passes that are called for, and every embedded scene with every method.

use glam::DVec3;
use mica_oracle::wang2020::AccumulationRule;
use mica_render::scene::{EquirectMap, Glint, Instance, Light, Material, Scene, procedural};
use mica_render::{EMBEDDED_SCENES, Environment, METHODS, OcclusionBackend, Renderer, View, embedded_scene};
use mica_tests::shapes::{OVER_PLANE, conductor, plane, seen_plane};
use mica_tests::{Gpu, Shot, dpf_cache};

const SIZE: [u32; 2] = [96, 54];

/// An embedded scene as the program shows it by default, but for the triangles of large ones, and a view of it.
fn embedded(name: &str, method: &str, occlusion: OcclusionBackend) -> (Renderer, View) {
    let scene = embedded_scene(name).expect("it is embedded").load_coarse().expect("it is sound");
    let view = View::new(scene.default_camera(), SIZE);
    let map = procedural::environment(scene.environment.as_deref().unwrap_or("studio")).expect("it is listed");
    let environment = Environment { map, rotation_radians: 0.0 };
    let mut renderer = Renderer::new(scene, &[], Some(&environment), occlusion).expect("the scene is sound");
    renderer.set_method(None, method).expect("the method exists");
    (renderer, view)
}

/// Cheap tables, where their quality does not matter.
fn coarse(renderer: &mut Renderer) {
    for (key, value) in [("samples", "1"), ("depth", "7")] {
        renderer.set(None, key, value).expect("a setting of wang2020");
    }
}

#[test]
fn two_runs_give_the_same_bits() {
    for method in ["smooth", "wang2020"] {
        let [first, second] = [0, 1].map(|_| {
            let mut gpu = Gpu::new();
            let (mut renderer, view) = embedded("shoe", method, OcclusionBackend::Bvh);
            gpu.precompute(&mut renderer);
            gpu.render(&mut renderer, &view).picture
        });
        assert!(first.variance() > 0.0, "{method}: there is something to see");
        assert_eq!(first.differing(&second).len(), 0, "{method}");
    }
}

#[test]
fn samples_of_a_pixel_are_averaged() {
    let mut gpu = Gpu::new();
    let (mut renderer, view) = embedded("sphere", "smooth", OcclusionBackend::None);
    let alone: Vec<_> = (0..3).map(|index| gpu.render(&mut renderer, &view.sample(index)).picture).collect();
    assert!(!alone[0].differing(&alone[1]).is_empty(), "the rays of each sample are its own");
    // Twice, as the second series starts anew.
    for series in 0..2 {
        for index in 0..3 {
            let shown = gpu.render_sample(&mut renderer, &view.sample(index), Some(index)).picture;
            for (pixel, shown) in shown.pixels.iter().enumerate() {
                let of = |channel: usize| alone[..=index as usize].iter().map(move |one| one.pixels[pixel][channel]);
                for (channel, shown) in shown.iter().enumerate() {
                    let mean = of(channel).sum::<f32>() / (index + 1) as f32;
                    let close = (shown - mean).abs() <= 1e-5 * mean.abs().max(1e-3);
                    assert!(close, "series {series}, sample {index}, pixel {pixel}: {shown} is not {mean}");
                }
            }
        }
    }
}

/// A plane of large flakes under one light, where a pixel holds a few: what its parts show of them adds up to what the
/// pixel shows, but for directions that differ by less than a pixel's angle, which turn a flake on or off here and there.
#[test]
fn parts_of_a_pixel_show_each_flake_once() {
    let mut gpu = Gpu::new();
    let glint = Glint { count: 2e3, alpha: 0.2, gamma_deg: 20.0, color: Some([1.0; 3]), ..Glint::default() };
    let light = Light::Directional { direction: DVec3::new(0.1, -1.0, 1.4).normalize(), irradiance: [1.0; 3] };
    let scene = plane(conductor("flakes", glint), 40.0);
    let mut renderer = Renderer::new(scene, &[light], None, OcclusionBackend::None).expect("a sound scene");
    let view = OVER_PLANE.view(SIZE);
    let whole = gpu.render(&mut renderer, &view).picture;
    let parts = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(column, row)| {
        let part = view.part(2, column, row);
        gpu.render(&mut renderer, &part).picture
    });
    let green = |pixel: [f32; 4]| f64::from(pixel[1]);
    let (mut same, mut lit, mut sums) = (0, 0, [0.0; 2]);
    for (pixel, shown) in whole.pixels.iter().enumerate() {
        let mean = parts.iter().map(|part| green(part.pixels[pixel])).sum::<f64>() / 4.0;
        sums = [sums[0] + green(*shown), sums[1] + mean];
        if green(*shown) > 0.0 {
            lit += 1;
            same += usize::from((mean / green(*shown) - 1.0).abs() < 0.03);
        }
    }
    assert!(lit > 200 && same * 100 > lit * 80, "{same} of {lit} pixels that glint");
    assert!((sums[1] / sums[0] - 1.0).abs() < 0.01, "in all {} of {}", sums[1], sums[0]);
    // Parts with footprints of whole pixels would show a flake in several of them, and sums alone would not tell.
    let overlapping = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(column, row)| {
        let part = View { span: 1.0, ..view.part(2, column, row) };
        gpu.render(&mut renderer, &part).picture
    });
    let differ = whole.pixels.iter().enumerate().filter(|(pixel, shown)| {
        let mean = overlapping.iter().map(|part| green(part.pixels[*pixel])).sum::<f64>() / 4.0;
        green(**shown) > 0.0 && (mean / green(**shown) - 1.0).abs() >= 0.03
    });
    let differ = differ.count();
    assert!(differ * 100 > lit * 50, "{differ} of {lit}");
}

#[test]
fn without_glints_a_frame_is_what_lies_below_them_and_tables_are_kept() {
    let mut gpu = Gpu::new();
    let (mut renderer, view) = embedded("car", "wang2020", OcclusionBackend::Bvh);
    coarse(&mut renderer);
    gpu.precompute(&mut renderer);
    let with = gpu.render(&mut renderer, &view);
    let below = View { glints: false, ..view.clone() };
    let without = gpu.render(&mut renderer, &below);
    for pass in ["glints", "composite", "occlusion", "blur_glints"] {
        assert!(with.declares(pass) && !without.declares(pass), "{pass}: {:?}", without.draws);
    }
    let again = gpu.render(&mut renderer, &view);
    assert!(again.updates.is_empty(), "tables are made anew: {:?}", again.updates);
    assert_eq!(with.picture.differing(&again.picture).len(), 0);
    // Flakes that reflect nothing leave the same: what they add is all that is missing.
    let darker = with.picture.pixels.iter().zip(&without.picture.pixels);
    let (mut added, mut taken) = (0, 0);
    for (with, without) in darker {
        added += usize::from(with[1] > without[1]);
        taken += usize::from(with[1] < without[1]);
    }
    assert!(added > 100 && taken == 0, "{added} pixels are brighter with glints, {taken} darker");
}

#[test]
fn the_seed_changes_the_glints_and_nothing_else() {
    let mut gpu = Gpu::new();
    let (mut renderer, view) = embedded("sphere", "wang2020", OcclusionBackend::None);
    coarse(&mut renderer);
    renderer.set(None, "blur", "off").expect("a setting");
    renderer.set(None, "count", "1e4").expect("a setting");
    gpu.precompute(&mut renderer);
    let [first, other, again] = ["1", "17", "1"].map(|seed| {
        renderer.set(None, "seed", seed).expect("a setting");
        gpu.render(&mut renderer, &view).picture
    });
    let differing = first.differing(&other);
    let hits = first.hits();
    assert!(differing.len() > hits.iter().filter(|hit| **hit).count() / 20, "{} pixels", differing.len());
    assert!(differing.iter().all(|pixel| hits[*pixel]), "the sky has no flakes");
    assert_eq!(first.differing(&again).len(), 0);
}

#[test]
fn smooth_declares_neither_passes_nor_tables_of_glints() {
    let mut gpu = Gpu::new();
    let (mut renderer, view) = embedded("shoe", "smooth", OcclusionBackend::Bvh);
    let shot = gpu.render(&mut renderer, &view);
    let of_glints = ["glints", "blur_glints", "occlusion", "blur_visibility"];
    let of_tables = ["dpf", "dpf_accumulate", "prefilter_probability", "prefilter", "quadtree"];
    for pass in of_glints.into_iter().chain(of_tables) {
        assert!(!shot.declares(pass), "{pass} is declared: {:?} {:?}", shot.updates, shot.draws);
    }
    let tables = ["dpf", "prefilter", "quadtree"];
    let kept: Vec<String> = gpu.executor().memory().into_iter().map(|row| row.name).collect();
    assert!(!kept.iter().any(|name| tables.iter().any(|table| name.contains(table))), "{kept:?}");

    // The same words are found where they belong, and given back when the method is changed.
    renderer.set_method(None, "wang2020").expect("the method exists");
    coarse(&mut renderer);
    gpu.precompute(&mut renderer);
    let shot = gpu.render(&mut renderer, &view);
    // All but `dpf`, which was made beforehand.
    for pass in of_glints.into_iter().chain(of_tables).filter(|pass| *pass != "dpf") {
        assert!(shot.declares(pass), "{pass} is not declared: {:?} {:?}", shot.updates, shot.draws);
    }
    renderer.set_method(None, "smooth").expect("the method exists");
    gpu.render(&mut renderer, &view);
    gpu.executor().collect();
    let kept: Vec<String> = gpu.executor().memory().into_iter().map(|row| row.name).collect();
    assert!(!kept.iter().any(|name| tables.iter().any(|table| name.contains(table))), "{kept:?}");
}

#[test]
fn an_edit_updates_what_depends_on_it() {
    let mut gpu = Gpu::new();
    let (mut renderer, mut view) = embedded("sphere", "wang2020", OcclusionBackend::Bvh);
    coarse(&mut renderer);
    gpu.precompute(&mut renderer);
    let first = gpu.render(&mut renderer, &view);
    for pass in ["dpf_accumulate", "prefilter_probability", "prefilter"] {
        assert!(first.update_shaders().contains(&pass), "{pass} belongs to the first frame: {:?}", first.updates);
    }
    for pass in ["environment_irradiance", "environment_specular"] {
        assert!(!first.declares(pass), "nothing but flakes reflects: {:?}", first.updates);
    }
    assert!(gpu.render(&mut renderer, &view).updates.is_empty(), "nothing was edited");
    view.camera.world_from_camera.translation.y += 0.1;
    let moved = gpu.render(&mut renderer, &view);
    assert!(moved.updates.is_empty(), "a moved camera updates no table: {:?}", moved.updates);
    assert!(!first.picture.differing(&moved.picture).is_empty());

    let quadtree = vec!["quadtree"; 7];
    let accumulated = vec!["dpf_accumulate", "prefilter_probability", "prefilter"];
    for (key, value, passes) in [
        ("count", "3e4", quadtree.clone()),
        ("seed", "9", quadtree),
        ("gamma_deg", "5", accumulated.clone()),
        ("alpha", "0.3", accumulated),
        ("samples", "2", vec!["prefilter_probability", "prefilter"]),
        ("p_hat", "closed", vec!["prefilter_probability", "prefilter"]),
        ("micro", "2", vec![]),
        ("macro", "100", vec![]),
        ("cosine", "true", vec![]),
        ("blur", "off", vec![]),
    ] {
        renderer.set(None, key, value).expect("a setting");
        let shot = gpu.render(&mut renderer, &view);
        assert_eq!(shot.updates, passes, "after {key}={value}");
        assert!(gpu.render(&mut renderer, &view).updates.is_empty(), "{key} is up to date");
    }
    let before = gpu.render(&mut renderer, &view);
    for (key, value) in [("color", "0.1,0.9,0.2"), ("uv_scale", "2")] {
        renderer.set(None, key, value).expect("a setting");
        let shot = gpu.render(&mut renderer, &view);
        assert!(shot.updates.is_empty(), "no table depends on {key}: {:?}", shot.updates);
        assert!(shot.declares("upload materials"), "after {key}={value}: {:?}", shot.draws);
        assert!(!before.picture.differing(&shot.picture).is_empty(), "{key} shows");
        assert!(!gpu.render(&mut renderer, &view).declares("upload materials"), "{key} is up to date");
    }
    // Set to what it is: nothing to do.
    renderer.set(None, "count", "3e4").expect("a setting");
    renderer.set(None, "gamma_deg", "5").expect("a setting");
    assert!(gpu.render(&mut renderer, &view).updates.is_empty());
}

/// The renderer's choice of whole-degree offsets is the rule that the oracle states.
#[test]
fn the_accumulated_offsets_are_those_of_the_oracle() {
    let mut gpu = Gpu::new();
    let glint = Glint { count: 1e4, ..Glint::default() };
    let mut renderer =
        Renderer::new(plane(conductor("wang2020", glint), 2.0), &[], None, OcclusionBackend::None).expect("sound");
    coarse(&mut renderer);
    gpu.precompute(&mut renderer);
    for gamma_degrees in [0.01, 0.6, 1.0, 1.6, 2.0, 3.0, 6.0, 7.4, 30.0] {
        renderer.set(None, "gamma_deg", &gamma_degrees.to_string()).expect("a setting");
        let mut graph = mica_graph::Graph::new();
        renderer.frame(&mut graph, &OVER_PLANE.view(SIZE), None).expect("the frame is declared");
        let passes: Vec<_> = graph.passes().iter().filter(|pass| pass.name == "dpf_accumulate").collect();
        assert_eq!(passes.len(), 1, "gamma {gamma_degrees}");
        let mica_graph::Work::Compute { params, .. } = &passes[0].work else { panic!("it is a compute pass") };
        let word = |at: usize| i32::from_le_bytes(params[at..at + 4].try_into().expect("four bytes"));
        let rule = AccumulationRule::Rounded.offsets(gamma_degrees);
        assert_eq!([word(12), word(16)], [*rule.start(), *rule.end()], "gamma {gamma_degrees}");
    }
}

#[test]
fn a_scene_without_glints_declares_neither_glints_nor_composite() {
    let mut gpu = Gpu::new();
    let environment = Environment { map: EquirectMap::constant([1.0; 3]), rotation_radians: 0.0 };
    let scene = |glint: Option<Glint>| {
        plane(Material { base_color: [0.5, 0.5, 0.5, 1.0], metallic: 0.0, glint, ..Material::default() }, 40.0)
    };
    let none = Glint { count: 0.0, ..Glint::default() };
    for glint in [None, Some(none)] {
        let mut renderer =
            Renderer::new(scene(glint), &[], Some(&environment), OcclusionBackend::Bvh).expect("the scene is sound");
        let shot = gpu.render(&mut renderer, &OVER_PLANE.view(SIZE));
        for pass in
            ["glints", "smooth", "composite", "occlusion", "blur_glints", "blur_visibility", "clear specular_layer"]
        {
            assert!(!shot.declares(pass), "{pass} is declared: {:?}", shot.draws);
        }
        assert!(shot.left_out.iter().any(|left_out| left_out.what == "glints"), "{:?}", shot.left_out);
        let mean = shot.picture.mean()[1];
        assert!((0.45..0.6).contains(&mean), "half of the light is scattered, and a little mirrored: {mean}");
    }
    let glinting = Glint { count: 1e4, method: Some("smooth".to_owned()), ..Glint::default() };
    let mut renderer = Renderer::new(scene(Some(glinting)), &[], Some(&environment), OcclusionBackend::Bvh)
        .expect("the scene is sound");
    let shot = gpu.render(&mut renderer, &OVER_PLANE.view(SIZE));
    assert!(shot.declares("smooth") && shot.declares("composite"), "{:?}", shot.draws);
}

#[test]
fn every_embedded_scene_renders_with_every_method() {
    let mut gpu = Gpu::new();
    for scene in EMBEDDED_SCENES {
        for method in METHODS {
            let (mut renderer, view) = embedded(scene.name, method.name, OcclusionBackend::Bvh);
            assert!(!renderer.materials().is_empty(), "{} glints", scene.name);
            if method.name == "wang2020" {
                renderer.set(None, "samples", "2").expect("a setting");
                renderer.set(None, "depth", "9").expect("a setting");
                gpu.precompute(&mut renderer);
            }
            let shot = gpu.render(&mut renderer, &view);
            let case = format!("{} by {}", scene.name, method.name);
            assert_eq!((shot.picture.nonfinite(), shot.picture.negative()), (0, 0), "{case}");
            assert!(shot.picture.mean().iter().all(|mean| *mean > 0.0), "{case}: {:?}", shot.picture.mean());
            assert!(shot.picture.variance() > 0.0, "{case}");
            let pass = if method.name == "smooth" { "smooth" } else { "glints" };
            assert!(shot.declares(pass) && shot.declares("composite"), "{case}: {:?}", shot.draws);
            let hits = shot.picture.hits().iter().filter(|hit| **hit).count();
            assert!(hits > SIZE[0] as usize, "{case}: only {hits} pixels show anything");
            println!("{case}: mean {:?}, {hits} pixels hit", shot.picture.mean());
        }
    }
}

#[test]
fn the_dress_shades_two_glinting_materials() {
    let mut gpu = Gpu::new();
    let (mut renderer, view) = embedded("dress", "smooth", OcclusionBackend::None);
    let materials = renderer.materials().to_vec();
    assert_eq!(materials.len(), 2);
    let all = gpu.render(&mut renderer, &view);
    assert_eq!(all.draws.iter().filter(|pass| *pass == "smooth").count(), 2);
    // Each material has pixels of its own, and only those follow its settings.
    let mut pixels = Vec::new();
    for material in &materials {
        let [by_color, by_alpha] = [("color", "0,0,0"), ("alpha", "0.77")].map(|(key, value)| {
            renderer.set(Some(&material.name), key, value).expect("a setting");
            let changed = gpu.render(&mut renderer, &view).picture.differing(&all.picture);
            let before = material.values.get(key).to_string();
            renderer.set(Some(&material.name), key, &before).expect("a setting");
            changed
        });
        println!("{}: {} pixels follow its colour, {} its alpha", material.name, by_color.len(), by_alpha.len());
        assert!(by_color.len() > 30 && by_alpha.len() > 30, "{}: {} {}", material.name, by_color.len(), by_alpha.len());
        assert!(by_alpha.iter().all(|pixel| by_color.contains(pixel)), "{} changes another's pixels", material.name);
        pixels.push(by_color);
    }
    assert!(pixels[0].iter().all(|pixel| !pixels[1].contains(pixel)), "no pixel is of both");
}

#[test]
fn without_occlusion_nothing_of_it_is_left() {
    let mut gpu = Gpu::new();
    let traces = |shot: &Shot| {
        let passes = ["occlusion", "shadows", "blur_visibility"];
        let passes = passes.iter().filter(|pass| shot.declares(pass)).count();
        passes + shot.resources.iter().filter(|name| name.contains("bvh")).count()
    };
    let lamp = Light::Point { position: glam::DVec3::new(2.0, 3.0, 2.0), radiant_intensity: [20.0; 3], range: None };
    let of = |gpu: &mut Gpu, occlusion| {
        let scene = embedded_scene("shoe").expect("it is embedded").load().expect("it is sound");
        let view = View::new(scene.default_camera(), SIZE);
        let mut renderer = Renderer::new(scene, &[lamp], None, occlusion).expect("the scene is sound");
        renderer.set_method(None, "wang2020").expect("the method exists");
        coarse(&mut renderer);
        gpu.precompute(&mut renderer);
        gpu.render(&mut renderer, &view)
    };
    let with = of(&mut gpu, OcclusionBackend::Bvh);
    let without = of(&mut gpu, OcclusionBackend::None);
    assert!(with.declares("shadows") && with.declares("occlusion") && traces(&with) > 3, "{:?}", with.resources);
    assert_eq!(traces(&without), 0, "{:?} {:?}", without.draws, without.resources);
    for what in ["shadows", "occlusion"] {
        assert!(without.left_out.iter().any(|left_out| left_out.what == what), "{:?}", without.left_out);
    }
    let shaded = |shot: &Shot| shot.picture.mean()[1];
    assert!(shaded(&with) < shaded(&without), "shadows take light away");
}

/// Two halves of the plane y = 0, `left` where x < 0 and `right` where x > 0, of one kind of flakes.
fn halves(left: &str, right: &str) -> Scene {
    let glint = Glint { count: 2e4, alpha: 0.4, gamma_deg: 4.0, ..Glint::default() };
    let half = |name: &str, method: &str, x: f64| {
        let color = Some([0.9, 0.6, 0.3]);
        let material = Material { name: name.to_owned(), ..conductor(method, Glint { color, ..glint.clone() }) };
        let mut scene = plane(material, 20.0);
        scene.instances[0].world_from_local = glam::DAffine3::from_translation(glam::DVec3::new(x, 0.0, 0.0));
        scene
    };
    let mut scene = half("left", left, -20.0);
    let mut other = half("right", right, 20.0);
    other.meshes[0].material = 1;
    other.instances[0].mesh = 1;
    scene.meshes.append(&mut other.meshes);
    scene.instances.append(&mut other.instances);
    scene.materials.append(&mut other.materials);
    scene
}

/// Catches one table for all materials, made from whichever asked last, and tables dropped by the next material's.
#[test]
fn tables_of_every_source_in_use_are_kept() {
    let mut gpu = Gpu::new();
    let lamp = Light::Point { position: glam::DVec3::new(0.4, 1.2, -1.0), radiant_intensity: [5.0; 3], range: None };
    let mut renderer =
        Renderer::new(halves("wang2020", "wang2020"), &[lamp], None, OcclusionBackend::None).expect("sound");
    coarse(&mut renderer);
    renderer.set(None, "blur", "off").expect("a setting");
    let precompute = |gpu: &mut Gpu, renderer: &mut Renderer| {
        let made = renderer.precompute(gpu.executor(), Some(dpf_cache()), &mut |_, _, _| {}).expect("tables");
        made.len()
    };
    let view = OVER_PLANE.view(SIZE);
    assert_eq!(precompute(&mut gpu, &mut renderer), 1, "both ask for the same");
    let alike = gpu.render(&mut renderer, &view).picture;

    // So few flakes that the tables differ.
    for (key, value) in [("dpf", "counted"), ("dpf_flakes", "1000")] {
        renderer.set(Some("right"), key, value).expect("a setting");
    }
    assert_eq!(precompute(&mut gpu, &mut renderer), 1, "one is there");
    let both = gpu.render(&mut renderer, &view);
    let accumulations = both.updates.iter().filter(|pass| *pass == "dpf_accumulate").count();
    assert_eq!(accumulations, 1, "only of the material that changed: {:?}", both.updates);
    assert_eq!(precompute(&mut gpu, &mut renderer), 0, "both are kept");
    assert!(gpu.render(&mut renderer, &view).updates.is_empty(), "and so is what was made of them");
    let differing = both.picture.differing(&alike);
    let seen = seen_plane(SIZE);
    assert!(differing.len() > seen.len() / 20, "{} pixels follow the other table", differing.len());
    assert!(differing.iter().all(|pixel| seen[*pixel].0.x > 0.0), "the left half keeps its own");

    // What nobody asks for any more is given back.
    renderer.set(Some("right"), "dpf", "quadrature").expect("a setting");
    assert_eq!(gpu.render(&mut renderer, &view).picture.differing(&alike).len(), 0);
    renderer.set(Some("right"), "dpf", "counted").expect("a setting");
    assert_eq!(precompute(&mut gpu, &mut renderer), 1);
}

/// What a method asks for after shading is done to its own materials: next to `wang2020`, `smooth` neither blurs nor is
/// dimmed where its mirror direction is occluded. The blur of 3 pixels reaches one pixel beyond its material.
#[test]
fn a_method_finishes_its_own_materials_only() {
    let mut gpu = Gpu::new();
    let environment = Environment { map: procedural::environment("studio").expect("listed"), rotation_radians: 0.0 };
    let mut shown = |left: &str, right: &str, occlusion: OcclusionBackend| {
        let mut scene = halves(left, right);
        let black = Material { name: "roof".to_owned(), base_color: [0.0, 0.0, 0.0, 1.0], ..Material::default() };
        let mut roof = plane(black, 1.5);
        roof.meshes[0].material = 2;
        scene.meshes.append(&mut roof.meshes);
        scene.materials.append(&mut roof.materials);
        // Above both halves, and above the view.
        let world_from_local = glam::DAffine3::from_translation(glam::DVec3::new(0.0, 1.5, -4.5));
        scene.instances.push(Instance { mesh: 2, world_from_local, name: "roof".to_owned() });
        let mut renderer = Renderer::new(scene, &[], Some(&environment), occlusion).expect("the scene is sound");
        if renderer.materials().iter().any(|material| material.method.name == "wang2020") {
            renderer.set(None, "samples", "4").expect("a setting of wang2020");
            renderer.set(None, "depth", "7").expect("a setting of wang2020");
        }
        gpu.precompute(&mut renderer);
        gpu.render(&mut renderer, &OVER_PLANE.view(SIZE)).picture
    };
    let smooth = shown("smooth", "smooth", OcclusionBackend::Bvh);
    let mixed = shown("wang2020", "smooth", OcclusionBackend::Bvh);
    let differing = mixed.differing(&smooth);
    let seen = seen_plane(SIZE);
    let on_the_left = |x: u32, y: u32| seen[(y * SIZE[0] + x) as usize].0.x < 0.0;
    let (mut reached, mut all_left) = (0, 0);
    for pixel in 0..seen.len() {
        let [x, y] = [pixel as u32 % SIZE[0], pixel as u32 / SIZE[0]];
        if on_the_left(x, y) {
            all_left += usize::from(differing.contains(&pixel));
        } else if on_the_left(x - 1, y) {
            reached += usize::from(differing.contains(&pixel));
        } else {
            assert!(!differing.contains(&pixel), "pixel {x}, {y} is smooth, and not next to the other material");
        }
    }
    println!("{all_left} pixels on the left differ, {reached} next to them");
    assert!(all_left * 3 > seen.len(), "the methods differ");
    assert!(reached * 3 > SIZE[1] as usize, "the blur reaches the next pixel");
    // The roof would dim the right half too.
    let [with, without] = [OcclusionBackend::Bvh, OcclusionBackend::None].map(|by| shown("wang2020", "wang2020", by));
    let dimmed = with.differing(&without).into_iter().filter(|pixel| seen[*pixel].0.x > 0.1).count();
    assert!(dimmed > 100, "{dimmed} pixels");
}
