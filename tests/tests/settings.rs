//! Every method can be set to everything it offers, and shows a picture.

use mica_render::scene::{EquirectMap, Glint, Light};
use mica_render::{Environment, Kind, METHODS, MethodInfo, OcclusionBackend, Renderer};
use mica_tests::shapes::{Eye, conductor, plane};
use mica_tests::{Gpu, Picture};

const SIZE: [u32; 2] = [48, 27];
/// Along the plane, askew to its texture: footprints are long and lie across its axes.
const ALONG_PLANE: Eye =
    Eye { eye: glam::DVec3::new(2.0, 0.4, 2.5), target: glam::DVec3::new(0.3, 0.0, 0.2), vertical_fov_radians: 0.15 };

/// The plane under a lamp, and under a sky where that is asked for: tables made from it take their time.
fn shown(gpu: &mut Gpu, method: &MethodInfo, set: &[(&str, &str)], sky: bool) -> Picture {
    let lamp = Light::Point { position: glam::DVec3::new(-1.0, 0.5, -1.5), radiant_intensity: [5.0; 3], range: None };
    let environment = Environment { map: EquirectMap::constant([0.5, 0.6, 0.7]), rotation_radians: 0.3 };
    let glint = Glint { count: 3e4, alpha: 0.2, gamma_deg: 3.0, ..Glint::default() };
    let scene = plane(conductor(method.name, glint), 40.0);
    let mut renderer =
        Renderer::new(scene, &[lamp], sky.then_some(&environment), OcclusionBackend::None).expect("the scene is sound");
    for (key, value) in set {
        renderer.set(None, key, value).unwrap_or_else(|error| panic!("{}: {error}", method.name));
    }
    gpu.precompute(&mut renderer);
    gpu.render(&mut renderer, &ALONG_PLANE.view(SIZE)).picture
}

fn assert_sound(picture: &Picture, what: &str) {
    assert_eq!((picture.nonfinite(), picture.negative()), (0, 0), "{what}");
    assert!(picture.mean()[1] > 0.0, "{what}: there is something to see");
}

/// Whatever its meaning, a flag or a choice that changes nothing is not one: at least one of a setting's values shows
/// another picture than the default, for every setting that is no number.
#[test]
fn every_flag_and_every_choice_shows_a_sound_picture_of_its_own() {
    let mut gpu = Gpu::new();
    for method in METHODS {
        for setting in method.settings {
            let values: Vec<&str> = match setting.kind {
                Kind::Flag => vec!["true", "false"],
                // Counting flakes for a table takes long; it has tests of its own.
                Kind::Choice(words) => words.iter().copied().filter(|word| *word != "counted").collect(),
                _ => continue,
            };
            // Some flakes; so many that what is done for many of them is called for; far from the texture's origin; hardly any.
            let calls = [("count", "3e4"), ("count", "1e7"), ("uv_scale", "1e5"), ("count", "300")];
            let changed = calls.iter().any(|call| {
                let picture_of = |gpu: &mut Gpu, value: &str| {
                    let picture = shown(gpu, method, &[*call, (setting.key, value)], true);
                    assert_sound(&picture, &format!("{} {}={value}, {call:?}", method.name, setting.key));
                    picture
                };
                let first = picture_of(&mut gpu, values[0]);
                values[1..].iter().any(|value| !picture_of(&mut gpu, value).differing(&first).is_empty())
            });
            assert!(changed || values.len() < 2, "{}: {} changes nothing", method.name, setting.key);
        }
    }
}

#[test]
fn every_rung_of_every_ladder_shows_a_sound_picture() {
    let mut gpu = Gpu::new();
    for method in METHODS {
        assert!(!method.ladder.is_empty(), "{} has a ladder", method.name);
        for rung in method.ladder {
            assert_sound(&shown(&mut gpu, method, rung.set, false), &format!("{} {}", method.name, rung.name));
        }
    }
}

/// The ends of every number's range are taken, one at a time, and nothing breaks. Numbers that set how much work is done stay
/// moderate: their largest are for machines that have the time.
#[test]
fn every_number_can_be_at_the_ends_of_its_range() {
    const MODERATE: f64 = 4096.0;
    let mut gpu = Gpu::new();
    for method in METHODS {
        for setting in method.settings.iter().chain(mica_render::COMMON_SETTINGS) {
            let ends = match setting.kind {
                Kind::Real { min, max } => [min, max],
                Kind::Integer { min, max } => [min as f64, (max as f64).min(MODERATE)],
                _ => continue,
            };
            for end in ends {
                let picture = shown(&mut gpu, method, &[(setting.key, &end.to_string())], false);
                let what = format!("{} {}={end}", method.name, setting.key);
                assert_eq!((picture.nonfinite(), picture.negative()), (0, 0), "{what}");
            }
        }
    }
}

#[test]
fn methods_say_where_they_come_from_and_what_they_promise() {
    let mut names: Vec<&str> = METHODS.iter().map(|method| method.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), METHODS.len(), "no name twice");
    for method in METHODS {
        let year = method.citation.split(|c: char| !c.is_ascii_digit()).any(|digits| digits.len() == 4);
        assert!(year && method.citation.len() > 40, "{}: {}", method.name, method.citation);
        let [least, most] = method.mean_between;
        assert!(!method.summary.is_empty() && least <= 1.0 && most >= 1.0, "{}", method.name);
        for setting in method.settings {
            assert!(setting.meaning.ends_with('.'), "{}: {}", method.name, setting.key);
        }
    }
}
