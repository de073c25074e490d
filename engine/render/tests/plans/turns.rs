//! Effects come and go: a frame is that of its scene, whatever was there before.

use crate::scenes::{Declared, black, chalk, coated, declare, glitter, masked, metal, point, sky, spot, sun, unlit};
use mica_graph::Effects;
use mica_render::Renderer;
use mica_render::scene::{Light, Material};
use mica_shaders::{base, blur_glints, composite, effects as e, surface, tonemap};

/// A frame after all tables are there.
fn settled(renderer: &mut Renderer) -> Declared {
    let view = black().view();
    declare(renderer, &view);
    let settled = declare(renderer, &view);
    assert!(settled.updates.is_empty(), "a frame without an edit makes {:?}", settled.updates);
    settled
}

fn materials(renderer: &mut Renderer, [left, right]: [Material; 2]) {
    renderer.set_material(0, left).expect("the left one");
    renderer.set_material(1, right).expect("the right one");
}

#[test]
fn adding_an_effect_and_taking_it_away_leaves_the_frame_and_its_bytes_as_they_were() {
    let start = [unlit(), chalk()];
    let mut renderer = black().left(unlit()).right(chalk()).renderer();
    let before = settled(&mut renderer);
    let lights: [(&str, Vec<Light>); 3] =
        [("a point light", vec![point()]), ("a sun", vec![sun()]), ("spots", vec![spot(), spot()])];
    for (what, lights) in lights {
        renderer.set_lights(&lights).expect("few lights");
        assert_ne!(settled(&mut renderer), before, "{what}");
        renderer.set_lights(&[]).expect("no lights");
        assert_eq!(settled(&mut renderer), before, "after {what}");
    }
    renderer.set_environment(Some(&sky()));
    assert_ne!(settled(&mut renderer), before, "a sky");
    renderer.set_environment(None);
    assert_eq!(settled(&mut renderer), before, "after a sky");
    let added = [
        metal(),
        coated(unlit()),
        masked(unlit()),
        glitter("smooth"),
        glitter("wang2018"),
        glitter("wang2020"),
        glitter("flakes"),
        glitter("jakob"),
        glitter("chermain"),
        glitter("deliot_belcour"),
    ];
    for material in added {
        let what = material.name.clone();
        materials(&mut renderer, [material, chalk()]);
        assert_ne!(settled(&mut renderer), before, "{what}");
        materials(&mut renderer, start.clone());
        assert_eq!(settled(&mut renderer), before, "after {what}");
    }
}

#[test]
fn effects_are_taken_away_in_another_order_than_they_came() {
    let mut renderer = black().renderer();
    let before = settled(&mut renderer);
    materials(&mut renderer, [coated(glitter("wang2020")), masked(metal())]);
    renderer.set_environment(Some(&sky()));
    renderer.set_lights(&[sun(), point()]).expect("few lights");
    let all = settled(&mut renderer);
    for name in ["GLINTS", "CLEAR_COAT", "ALPHA_MASKS", "ENVIRONMENT", "DIRECTIONAL_LIGHTS", "POINT_LIGHTS", "SHADOWS"]
    {
        assert!(all.effects.contains(name), "{name} of {:?}", all.effects);
    }
    materials(&mut renderer, [unlit(), unlit()]);
    settled(&mut renderer);
    renderer.set_lights(&[]).expect("no lights");
    settled(&mut renderer);
    renderer.set_environment(None);
    assert_eq!(settled(&mut renderer), before);
}

#[test]
fn what_is_forced_is_simulated_and_what_is_not_forced_any_more_is_given_back() {
    let mut renderer = black().renderer();
    let before = settled(&mut renderer);
    renderer.simulate(Effects::ALL);
    let forced = settled(&mut renderer);
    assert_eq!(forced.effects, e::ALL.iter().map(|(name, _)| *name).collect());
    assert!(forced.kept.iter().any(|(name, _)| name == "environment_irradiance"), "{:?}", forced.kept);
    renderer.simulate(Effects::NONE);
    assert_eq!(settled(&mut renderer), before);
}

#[test]
fn the_census_follows_edits() {
    let mut renderer = black().renderer();
    assert_eq!((renderer.census().lights.count(), renderer.census().moved_instances), (0, 0));
    renderer.set_lights(&[sun(), spot(), spot()]).expect("few lights");
    let lights = renderer.census().lights;
    assert_eq!([lights.point, lights.directional, lights.spot], [0, 1, 2]);
    renderer.place_instance(1, renderer.scene().instances[0].world_from_local).expect("a place");
    assert_eq!(renderer.census().moved_instances, 1);
    materials(&mut renderer, [glitter("flakes"), unlit()]);
    let glints = renderer.census().materials[0].glints.clone().expect("it glints");
    assert_eq!((glints.method, glints.count, glints.tiles, glints.beyond_floats), ("flakes", 1_000_000, false, false));
    renderer.set(None, "uv_scale", "3").expect("a setting");
    renderer.set(None, "count", "2e7").expect("a setting");
    let glints = renderer.census().materials[0].glints.clone().expect("it glints");
    assert_eq!((glints.tiles, glints.beyond_floats, glints.uv_range), (true, true, Some([[0.0; 2], [3.0; 2]])));
    renderer.set(None, "count", "0").expect("a setting");
    assert_eq!(renderer.census().materials[0].glints, None);
}

#[test]
fn a_method_that_is_left_to_the_renderer_follows_the_light() {
    let mut renderer = black().left(glitter("auto")).light(sun()).renderer();
    let chosen = |renderer: &Renderer| {
        let material = &renderer.materials()[0];
        assert!(material.chosen.as_ref().is_some_and(|why| !why.is_empty()), "{material:?}");
        material.method.name
    };
    assert_eq!(chosen(&renderer), "deliot_belcour");
    renderer.set(None, "count", "500").expect("a setting");
    assert_eq!(chosen(&renderer), "flakes");
    renderer.set(None, "count", "1e6").expect("a setting");
    // A map whose light comes from one texel of 32,768.
    let mut map = mica_render::scene::EquirectMap { width: 256, height: 128, texels: vec![[0.01; 3]; 256 * 128] };
    map.texels[64 * 256 + 128] = [1e6; 3];
    renderer.set_lights(&[]).expect("no lights");
    renderer.set_environment(Some(&mica_render::Environment { map, rotation_radians: 0.0 }));
    assert_eq!(chosen(&renderer), "wang2020");
    renderer.set_method(None, "smooth").expect("a method");
    assert_eq!((renderer.materials()[0].method.name, &renderer.materials()[0].chosen), ("smooth", &None));
}

#[test]
fn shaders_are_specialised_for_nothing_that_their_code_does_not_ask_about() {
    let lights = e::POINT_LIGHTS | e::DIRECTIONAL_LIGHTS | e::SPOT_LIGHTS;
    assert_eq!(tonemap::SHADER.effects, Effects::NONE);
    assert_eq!(blur_glints::SHADER.effects, Effects::NONE);
    assert_eq!(composite::SHADER.effects, e::CLEAR_COAT);
    assert_eq!(surface::SHADER.effects, e::TEXTURES | e::NORMAL_MAPS | e::VERTEX_COLORS | e::GLINTS);
    assert!(base::SHADER.effects.contains(lights), "it sums over lights");
}
