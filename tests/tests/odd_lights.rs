//! Lights in places that scenes have by accident: in a surface, on it, inside of a body, behind everything, along a
//! surface, and far beyond a small scene. Nothing may be but finite, and nothing shades itself, or hides its own mirror
//! directions.

use glam::{DAffine3, DMat3, DVec3};
use mica_render::scene::{Camera, EquirectMap, Glint, Light, Material, Scene};
use mica_render::{Environment, OcclusionBackend, Renderer, View};
use mica_tests::shapes::{BEFORE_SPHERE, conductor, plane, sphere, sphere_on_plane};
use mica_tests::{Gpu, Picture};

const SIZE: [u32; 2] = [64, 36];
/// Scale of the scenes, metres.
const SCALES: [f64; 3] = [1e-3, 1.0, 1e3];

fn matte() -> Material {
    Material { metallic: 0.0, ..Material::default() }
}

/// A lamp that lights what is a scale away like daylight.
fn lamp(position: DVec3, scale: f64) -> Light {
    Light::Point { position, radiant_intensity: [(20.0 * scale * scale) as f32; 3], range: None }
}

/// The sphere of this radius on the plane, from above.
fn over_the_sphere(scale: f64) -> View {
    let [eye, target] = [DVec3::new(1.5, 4.0, 6.0), DVec3::new(-0.6, 0.4, -0.2)].map(|point| scale * point);
    View::new(Camera::looking_at("test", eye, target, 0.45, 0.01 * scale), SIZE)
}

fn shown(gpu: &mut Gpu, scene: &Scene, light: Light, occlusion: OcclusionBackend, view: &View) -> Picture {
    let mut renderer = Renderer::new(scene.clone(), &[light], None, occlusion).expect("the scene is sound");
    let picture = gpu.render(&mut renderer, view).picture;
    assert_eq!((picture.nonfinite(), picture.negative()), (0, 0), "{light:?}");
    picture
}

fn lit(picture: &Picture) -> usize {
    picture.pixels.iter().filter(|pixel| pixel[1] > 0.0).count()
}

#[test]
fn a_light_in_or_behind_things_is_dark_and_finite() {
    let mut gpu = Gpu::new();
    for body in gpu.occlusion_bodies() {
        for scale in SCALES {
            let scene = sphere_on_plane(matte(), 16, scale, DVec3::ZERO);
            let view = over_the_sphere(scale);
            for (what, place, expected) in [
                ("inside of the sphere", DVec3::new(0.2, 1.1, 0.1), Some(0)),
                ("in the middle of the sphere", DVec3::Y, Some(0)),
                ("at the contact", DVec3::ZERO, Some(0)),
                ("below the plane", DVec3::new(0.5, -1.0, 0.3), Some(0)),
                ("far below the plane", DVec3::new(0.5, -1e4, 0.3), Some(0)),
                // It lights the sphere, but the plane only along itself: not at all.
                ("in the plane", DVec3::new(2.0, 0.0, 3.0), None),
                ("on top of the sphere", DVec3::new(0.0, 2.0, 0.0), None),
                ("at the eye", DVec3::new(1.5, 4.0, 6.0), None),
            ] {
                let picture = shown(&mut gpu, &scene, lamp(scale * place, scale), body, &view);
                let lit = lit(&picture);
                println!("{}, scale {scale:e}: {lit} pixels lit by a light {what}", body.name());
                if let Some(expected) = expected {
                    assert_eq!(lit, expected, "{}, scale {scale:e}: a light {what}", body.name());
                }
            }
        }
    }
}

/// A lamp lies on a ceiling as large as the floor, and on ones 100 and 10,000 times larger: what it lights is what it lights without
/// the ceiling, down to 3 degrees from it. Catches rays that go as far as the lamp, or beyond it by what their origin is
/// lifted.
#[test]
fn what_a_lamp_lies_on_does_not_hide_it() {
    let mut gpu = Gpu::new();
    for body in gpu.occlusion_bodies() {
        for scale in SCALES {
            // Any direction but an axis's, so that all coordinates round.
            let turn = DMat3::from_rotation_x(0.4) * DMat3::from_rotation_z(0.3);
            let placed = |height: f64, half: f64| {
                DAffine3::from_mat3_translation(turn * (scale * half), turn * DVec3::new(0.0, scale * height, 0.0))
            };
            for (height, half) in [(0.3, 4.0), (2.0, 4.0), (0.3, 400.0), (2.0, 400.0), (0.3, 4e4), (2.0, 4e4)] {
                let mut open = plane(matte(), 1.0);
                open.instances[0].world_from_local = placed(0.0, 4.0);
                let mut roofed = open.clone();
                roofed.instances.push(roofed.instances[0].clone());
                roofed.instances[1].world_from_local = placed(height, half);
                let light = lamp(turn * (scale * DVec3::new(0.3, height, 0.2)), scale * height);
                // From between both.
                let [eye, target] = [DVec3::new(0.0, 0.5 * height, 3.0), DVec3::new(0.2, -0.3 * height, 0.0)]
                    .map(|point| turn * (scale * point));
                let view = View::new(Camera::looking_at("test", eye, target, 0.5, 0.001 * scale), SIZE);
                let free = shown(&mut gpu, &open, light, body, &view);
                let below = shown(&mut gpu, &roofed, light, body, &view);
                // The ceiling moves the scene's centre, and so the last bits.
                let dark =
                    free.pixels.iter().zip(&below.pixels).filter(|(free, below)| free[1] > 0.0 && below[1] == 0.0);
                let dark = dark.count();
                println!(
                    "{}, scale {scale:e}, ceiling of {half} at {height}: {} pixels lit, {dark} dark",
                    body.name(),
                    lit(&free)
                );
                assert!(lit(&free) > 300, "there is a floor");
                assert_eq!(dark, 0, "{}, scale {scale:e}, ceiling of {half} at {height}", body.name());
            }
        }
    }
}

/// The square of [`plane`] in two large triangles, before which its mesh lists one that is next to nothing and lies as near
/// below its middle: nothing about that says how exact the others are.
fn plane_with_a_speck(material: Material) -> Scene {
    let mut scene = plane(material, 1.0);
    let mesh = &mut scene.meshes[0];
    mesh.positions.extend([[0.0, -1e-5, 0.0], [0.0, -1e-5, 1e-6], [1e-6, -1e-5, 0.0]]);
    mesh.normals.extend([[0.0, 1.0, 0.0]; 3]);
    mesh.uv[0].extend([[0.0; 2]; 3]);
    mesh.indices.splice(0..0, [4, 5, 6]);
    scene
}

/// A surface along which the light shines is lit, every pixel of it, down to a hundredth of a degree, from afar and in its
/// middle, a thousandth of its size around the scene's centre. Catches offsets too small for the coordinates, for the
/// triangle or for the angle.
#[test]
fn nothing_shades_itself_under_grazing_light() {
    let mut gpu = Gpu::new();
    for body in gpu.occlusion_bodies() {
        for scale in SCALES {
            for (axis, angle) in
                [(DVec3::X, 0.0), (DVec3::new(0.48, 0.6, 0.64), 1.0), (DVec3::new(0.6, 0.0, -0.8), 2.0)]
            {
                let turn = DMat3::from_axis_angle(axis, angle);
                let mut scene = plane_with_a_speck(matte());
                scene.instances[0].world_from_local =
                    DAffine3::from_mat3_translation(turn * (8.0 * scale), turn * DVec3::new(scale, 2.0 * scale, 0.0));
                let at = |point: DVec3| turn * (scale * (point + DVec3::new(1.0, 2.0, 0.0)));
                let view = |size: f64| {
                    let eye = at(size * DVec3::new(0.0, 2.0, 3.0));
                    View::new(Camera::looking_at("test", eye, at(DVec3::ZERO), 0.6, 0.01 * size * scale), SIZE)
                };
                for elevation in [1e-2f64, 0.1, 5.0] {
                    let (sin, cos) = elevation.to_radians().sin_cos();
                    let towards = turn * DVec3::new(0.8 * cos, sin, -0.6 * cos);
                    let irradiance = [(1.0 / sin) as f32; 3];
                    for light in [
                        Light::Directional { direction: -towards, irradiance },
                        lamp(at(DVec3::ZERO) + 100.0 * scale * towards, 100.0 * scale / sin.sqrt()),
                    ] {
                        for size in [1.0, 1e-3] {
                            let picture = shown(&mut gpu, &scene, light, body, &view(size));
                            let hits = picture.hits().iter().filter(|hit| **hit).count();
                            let dark = hits - lit(&picture);
                            let case = format!("{}, scale {scale:e}, {size} of it, {elevation} degrees", body.name());
                            assert!(hits > 1000, "{case}: {hits} pixels show the plane");
                            assert_eq!(dark, 0, "{case}, {light:?}");
                        }
                    }
                }
            }
        }
    }
}

/// Three hundred metres from a scene of millimetres, and a million scales from any, a lamp is a directional light. A
/// shade close before a far lamp hides it. Catches ends of rays that scale with the distance.
#[test]
fn far_lamps_are_suns_and_their_shades_hide_them() {
    let mut gpu = Gpu::new();
    let towards = DVec3::new(0.8, 0.6, 0.1).normalize();
    for body in gpu.occlusion_bodies() {
        for scale in SCALES {
            let scene = sphere_on_plane(matte(), 16, scale, DVec3::ZERO);
            let view = over_the_sphere(scale);
            let sun = Light::Directional { direction: -towards, irradiance: [1.0; 3] };
            let by_sun = shown(&mut gpu, &scene, sun, body, &view);
            for distance in [3e5, 1e6, 1e9] {
                let far = lamp(distance * scale * towards, distance * scale);
                let by_lamp = shown(&mut gpu, &scene, far, body, &view);
                let dark = |picture: &Picture| picture.pixels.iter().map(|pixel| pixel[1] == 0.0).collect::<Vec<_>>();
                let differing = dark(&by_sun).iter().zip(dark(&by_lamp)).filter(|(sun, lamp)| **sun != *lamp).count();
                println!("{}, scale {scale:e}, {distance:e} away: {differing} pixels differ", body.name());
                assert!(differing <= 2, "{}, scale {scale:e}, {distance:e} away: {differing}", body.name());
            }
            // A 25th of a scale before a lamp a thousand scales away.
            is_hidden_by_a_card(&mut gpu, body, &scene, scale, 1e3, 0.04);
        }
    }
}

/// Where a dome is 100,000 times larger than all below it, a shade a thousandth before a lamp hides it. Catches ends of
/// rays that go with the scene.
#[test]
fn a_shade_hides_its_lamp_whatever_is_around_them() {
    let mut gpu = Gpu::new();
    for body in gpu.occlusion_bodies() {
        for scale in SCALES {
            let mut scene = sphere_on_plane(matte(), 16, scale, DVec3::ZERO);
            let mut dome = scene.instances[1].clone();
            dome.world_from_local = DAffine3::from_scale(DVec3::splat(1e6 * scale));
            scene.instances.push(dome);
            is_hidden_by_a_card(&mut gpu, body, &scene, scale, 5.0, 5e-3);
        }
    }
}

/// Fails unless a lamp so many scales away from the contact lights a scene, and nothing of it behind a card of 2 by 2 scales
/// that lies in the gap before the lamp.
fn is_hidden_by_a_card(gpu: &mut Gpu, body: OcclusionBackend, scene: &Scene, scale: f64, distance: f64, gap: f64) {
    let view = over_the_sphere(scale);
    let towards = DVec3::new(0.8, 0.6, 0.1).normalize();
    let mut shaded = scene.clone();
    let mut card = shaded.instances[0].clone();
    let upright = DMat3::from_cols(towards.cross(DVec3::Z).normalize(), towards, DVec3::Z);
    card.world_from_local = DAffine3::from_mat3_translation(upright * scale, scale * (distance - gap) * towards);
    shaded.instances.push(card);
    let lamp = lamp(distance * scale * towards, distance * scale);
    let open = lit(&shown(gpu, scene, lamp, body, &view));
    let hidden = lit(&shown(gpu, &shaded, lamp, body, &view));
    println!("{}, scale {scale:e}: {open} pixels lit, {hidden} behind the shade", body.name());
    assert!(open > 1000, "the lamp lights something");
    assert_eq!(hidden, 0, "{}, scale {scale:e}: behind the shade", body.name());
}

/// What a convex body mirrors is never the body itself, however coarse its facets are under their smooth normals; nor does a
/// plane mirror itself, in its middle, a thousandth of its size around the scene's centre. Catches mirror directions of
/// interpolated normals that lead into the facet they start from, and starts that are not off it.
#[test]
fn a_convex_body_does_not_hide_its_own_mirror_directions() {
    let mut gpu = Gpu::new();
    let bodies = gpu.occlusion_bodies();
    let environment = Environment { map: EquirectMap::constant([1.0; 3]), rotation_radians: 0.0 };
    let glint = Glint { count: 1e12, alpha: 0.5, gamma_deg: 2.0, color: Some([1.0; 3]), ..Glint::default() };
    let mut wide = plane_with_a_speck(conductor("wang2020", glint.clone()));
    let turn = DMat3::from_axis_angle(DVec3::new(0.48, 0.6, 0.64), 1.0);
    wide.instances[0].world_from_local = DAffine3::from_mat3(turn * 8.0);
    let eye = turn * DVec3::new(0.0, 1e-3, 3e-3);
    let near_its_middle = View::new(Camera::looking_at("test", eye, DVec3::ZERO, 0.6, 1e-5), SIZE);
    let round = sphere(conductor("wang2020", glint), 6);
    for (name, scene, view) in [("sphere", round, BEFORE_SPHERE.view([96, 54])), ("plane", wide, near_its_middle)] {
        let mut shown = |occlusion| {
            let mut renderer = Renderer::new(scene.clone(), &[], Some(&environment), occlusion).expect("a sound scene");
            for (key, value) in [("samples", "4"), ("depth", "4"), ("blur", "off")] {
                renderer.set(None, key, value).expect("a setting");
            }
            gpu.precompute(&mut renderer);
            gpu.render(&mut renderer, &view).picture
        };
        let without = shown(OcclusionBackend::None);
        assert!(lit(&without) > 1000, "{name}: {} pixels mirror something", lit(&without));
        for body in &bodies {
            let hidden = shown(*body).differing(&without).len();
            assert_eq!(hidden, 0, "{}, {name}: {hidden} pixels hide themselves", body.name());
        }
    }
}
