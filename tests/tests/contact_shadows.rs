//! A sphere that lies on a plane: dark where it hides the light or turns away from it, lit everywhere else, to the
//! pixel and up to the point of contact; in millimetres, metres and kilometres, far from the origin, and inside of domes
//! that are many times larger.

use glam::{DAffine3, DVec3};
use mica_render::scene::{Camera, Instance, Light, Material, Scene};
use mica_render::{OcclusionBackend, Renderer, View};
use mica_tests::shapes::{Eye, sphere, sphere_on_plane};
use mica_tests::triangles::{Triangles, decided};
use mica_tests::{Gpu, Picture};
use rayon::prelude::*;

const SIZE: [u32; 2] = [128, 72];
const PLACES: [Place; 4] = [
    Place { radius: 1e-3, contact: DVec3::ZERO, dome: None },
    Place { radius: 1.0, contact: DVec3::ZERO, dome: None },
    Place { radius: 1e3, contact: DVec3::ZERO, dome: None },
    // Scene space is about the scene's centre: nothing is lost.
    Place { radius: 1.0, contact: DVec3::new(1e5, -1e5, 1.3e5), dome: None },
];
/// In radii about the contact: the whole of it, and the gap below the sphere from 2 degrees above the plane.
const EYES: [(&str, Eye); 2] = [
    ("whole", Eye { eye: DVec3::new(1.5, 4.0, 6.0), target: DVec3::new(-0.6, 0.4, -0.2), vertical_fov_radians: 0.45 }),
    ("gap", Eye { eye: DVec3::new(0.3, 0.105, 3.0), target: DVec3::new(0.0, -0.03, 0.0), vertical_fov_radians: 0.03 }),
];
/// The lights, one a channel, in radii about the contact.
const SUN_AND_LAMP: [Source; 2] = [Source::Towards(DVec3::new(0.8, 0.6, 0.1)), Source::At(LAMP)];
/// The same for the inside of a dome, where no sun shines.
const TWO_LAMPS: [Source; 2] = [Source::At(DVec3::new(6.4, 4.8, 0.8)), Source::At(LAMP)];
const LAMP: DVec3 = DVec3::new(-2.5, 4.5, 1.5);
/// More than what a ray's origin is lifted by, in radii: 256 units in the last place of 8.
const LIFT: f64 = 3e-4;

/// Where the sphere is, and in what.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Of the sphere, metres.
    radius: f64,
    /// The point that it touches, metres.
    contact: DVec3,
    /// Radius of the dome about it, in radii of the sphere.
    dome: Option<f64>,
}

/// Where light comes from.
#[derive(Clone, Copy, Debug)]
enum Source {
    Towards(DVec3),
    At(DVec3),
}

impl Source {
    /// The way there from a point; beyond its end, if it has one, is nothing.
    fn from(self, point: DVec3) -> DVec3 {
        match self {
            Self::Towards(direction) => direction,
            Self::At(place) => place - point,
        }
    }
}

/// What a point of the picture shows: an instance, and whether each light arrives there.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Shown {
    instance: usize,
    lit: [bool; 2],
}

/// The two sources as lights, one a channel.
fn lights(sources: [Source; 2], Place { radius, contact, .. }: Place) -> [Light; 2] {
    let strength = (50.0 * radius * radius) as f32;
    let light = |index: usize| {
        let channel = |value: f32| [0, 1, 2].map(|k| if k == index { value } else { 0.0 });
        match sources[index] {
            Source::Towards(towards) => {
                Light::Directional { direction: -towards.normalize(), irradiance: channel(1.0) }
            }
            Source::At(place) => {
                let position = contact + radius * place;
                Light::Point { position, radiant_intensity: channel(strength), range: None }
            }
        }
    };
    [light(0), light(1)]
}

/// The scene, shaded everywhere by a normal that faces the lights and the camera: nothing is dark of its own accord. The
/// dome is seen from outside only.
fn scene(rings: u32, Place { radius, contact, dome }: Place) -> Scene {
    let matte = Material { metallic: 0.0, ..Material::default() };
    let mut scene = sphere_on_plane(matte.clone(), rings, radius, contact);
    let facing = DVec3::new(0.2, 0.8, 0.6).normalize().as_vec3().to_array();
    scene.meshes.iter_mut().for_each(|mesh| mesh.normals.fill(facing));
    if let Some(dome) = dome {
        scene.meshes.append(&mut sphere(matte, 16).meshes);
        let scale = DAffine3::from_scale(DVec3::splat(dome * radius));
        let world_from_local = DAffine3::from_translation(contact) * scale;
        scene.instances.push(Instance { mesh: 2, world_from_local, name: "dome".to_owned() });
    }
    scene
}

fn view(eye: Eye, Place { radius, contact, .. }: Place) -> View {
    let [from, to] = [eye.eye, eye.target].map(|point| contact + radius * point);
    View::new(Camera::looking_at("test", from, to, eye.vertical_fov_radians, 0.01 * radius), SIZE)
}

/// How many pixels were found as they must be.
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    dark: usize,
    lit: usize,
    excluded: usize,
}

/// What each pixel must show, row by row: `None` where that is not decided, `Some(None)` where nothing is seen.
type Truth = Vec<Option<Option<Shown>>>;

fn pixels() -> Vec<[u32; 2]> {
    (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| [x, y])).collect()
}

/// What is seen of a sphere of so many rings at each of some places, as it must be.
struct Shaded<'a> {
    rings: u32,
    sources: [Source; 2],
    places: &'a [Place],
    truths: &'a [(&'a str, Eye, Truth)],
}

/// Fails unless each pixel that the truth decides is black or untouched, for each light, whoever answers: the same at
/// every place. At least so many pixels have to be dark and lit, and at most so many undecided.
fn is_shaded_so(Shaded { rings, sources, places, truths }: &Shaded, least: usize, excluded: usize) {
    let mut gpu = Gpu::new();
    let bodies = gpu.occlusion_bodies();
    for &place in *places {
        let scene = scene(*rings, place);
        let mut shown = |occlusion| {
            let lights = lights(*sources, place);
            let mut renderer = Renderer::new(scene.clone(), &lights, None, occlusion).expect("the scene is sound");
            truths.iter().map(|(_, eye, _)| gpu.render(&mut renderer, &view(*eye, place)).picture).collect()
        };
        let without: Vec<Picture> = shown(OcclusionBackend::None);
        for body in &bodies {
            let with: Vec<Picture> = shown(*body);
            for ((name, _, truth), (with, without)) in truths.iter().zip(with.iter().zip(&without)) {
                let case = format!("{name}, {place:?}, {}", body.name());
                let counts = counted(&case, with, without, truth);
                println!("{case}: {counts:?}");
                for counts in counts {
                    assert!(counts.dark > least && counts.lit > least, "{case}: {counts:?}");
                    assert!(counts.excluded < excluded, "{case}: {counts:?}");
                }
            }
        }
    }
}

fn counted(case: &str, with: &Picture, without: &Picture, truth: &Truth) -> [Counts; 2] {
    let mut counts = [Counts::default(); 2];
    for (index, (pixel, truth)) in pixels().into_iter().zip(truth).enumerate() {
        let (shown, free) = (with.pixels[index], without.pixels[index]);
        let Some(truth) = truth else {
            counts.iter_mut().for_each(|counts| counts.excluded += 1);
            continue;
        };
        let Some(truth) = truth else {
            assert_eq!(shown, [0.0; 4], "{case}: nothing is seen in pixel {pixel:?}");
            continue;
        };
        for (light, counts) in counts.iter_mut().enumerate() {
            let (shown, free, case) = (shown[light], free[light], format!("{case}: light {light}, {pixel:?}"));
            assert!(free > 0.0, "{case} has something to lose: {truth:?}");
            assert_eq!(shown, if truth.lit[light] { free } else { 0.0 }, "{case}: {truth:?}");
            *(if truth.lit[light] { &mut counts.lit } else { &mut counts.dark }) += 1;
        }
    }
    counts
}

/// What a ray from the eye shows of the true sphere and the plane; all in radii about the contact.
fn analytic(eye: Eye, point: [f64; 2]) -> Option<Shown> {
    const CENTER: DVec3 = DVec3::Y;
    let direction = eye.ray(SIZE, point).normalize();
    // Where a ray enters the sphere; `None` where it does not or only behind its origin.
    let enters = |origin: DVec3, direction: DVec3| {
        let nearest = (CENTER - origin).dot(direction);
        let below = 1.0 - (CENTER - origin - nearest * direction).length_squared();
        (below > 0.0 && nearest + below.sqrt() > 0.0).then(|| nearest - below.sqrt())
    };
    let towards = |at: DVec3| SUN_AND_LAMP.map(|source| source.from(at).normalize());
    if let Some(t) = enters(eye.eye, direction) {
        let at = eye.eye + t * direction;
        return Some(Shown { instance: 1, lit: towards(at).map(|towards| towards.dot(at - CENTER) > 0.0) });
    }
    let at = eye.eye - eye.eye.y / direction.y * direction;
    let seen = direction.y < 0.0 && at.x.abs() < 8.0 && at.z.abs() < 8.0;
    seen.then(|| Shown { instance: 0, lit: towards(at).map(|towards| enters(at, towards).is_none()) })
}

/// Whether the sphere's normal is within an angle of this sine of a right angle to a light.
fn near_terminator(eye: Eye, [x, y]: [u32; 2], sine: f64) -> bool {
    let direction = eye.ray(SIZE, [f64::from(x) + 0.5, f64::from(y) + 0.5]).normalize();
    let nearest = (DVec3::Y - eye.eye).dot(direction);
    let below = 1.0 - (DVec3::Y - eye.eye - nearest * direction).length_squared();
    let at = eye.eye + (nearest - below.max(0.0).sqrt()) * direction;
    SUN_AND_LAMP.into_iter().any(|source| source.from(at).normalize().dot(at - DVec3::Y).abs() < sine)
}

/// Against the true sphere, leaving out the pixels that an analytic outline crosses. Of 128 rings, the mesh lies
/// within 3e-4 radii of the sphere: less than 1/60 of a pixel of the whole view, 1/4 of one of the gap. Its facets
/// lean by half their 1.4 degrees: as far from the terminator, it is theirs. Catches a light too many or too few,
/// shadows that miss the contact, light that leaks below the sphere, and surfaces that shade themselves.
#[test]
fn a_sphere_on_a_plane_has_its_analytic_shadow() {
    const RINGS: u32 = 128;
    let facet = (std::f64::consts::PI / f64::from(RINGS)).sin();
    let truths = EYES.map(|(name, eye)| {
        let truth = |[x, y]: [u32; 2]| {
            let grid = [0.0, 0.5, 1.0];
            let at = |k: usize| analytic(eye, [f64::from(x) + grid[k % 3], f64::from(y) + grid[k / 3]]);
            let shown = at(4);
            let same = (0..9).all(|k| at(k) == shown);
            let flat = shown.is_none_or(|shown| shown.instance == 0) || !near_terminator(eye, [x, y], facet);
            (same && flat).then_some(shown)
        };
        (name, eye, pixels().into_par_iter().map(truth).collect::<Truth>())
    });
    // Up to the contact, as far as the sphere lets the eye see.
    let (_, gap, truth) = &truths[1];
    let dark = pixels()
        .into_iter()
        .zip(truth)
        .filter(|(_, truth)| matches!(truth, Some(Some(Shown { instance: 0, lit: [false, false] }))));
    let from_contact = dark.map(|([x, y], _)| {
        let direction = gap.ray(SIZE, [f64::from(x) + 0.5, f64::from(y) + 0.5]);
        (gap.eye - gap.eye.y / direction.y * direction).length()
    });
    let nearest = from_contact.fold(f64::INFINITY, f64::min);
    println!("the plane is seen, dark, from {nearest:.4} radii off the contact");
    assert!(nearest < 0.05, "{nearest}");
    is_shaded_so(&Shaded { rings: RINGS, sources: SUN_AND_LAMP, places: &PLACES, truths: &truths }, 500, 1200);
}

/// Against rays at the very triangles of a coarse sphere, in f64: no band is left out but what f32 cannot decide.
/// Catches what the first test does, in the pixels that it leaves out, and a terminator that is not the facets' own.
#[test]
fn a_coarse_sphere_shades_to_the_facet() {
    let truths = to_the_facet(SUN_AND_LAMP);
    is_shaded_so(&Shaded { rings: COARSE, sources: SUN_AND_LAMP, places: &PLACES, truths: &truths }, 500, 100);
}

/// The shadow is the same inside of a dome, and of domes 1,000 and 100,000 times larger. Catches offsets that go with the
/// scene: of the second dome's they are a sixteenth of the sphere, of the third's larger than the sphere.
#[test]
fn a_sphere_keeps_its_shadow_whatever_is_around_it() {
    let truths = to_the_facet(TWO_LAMPS);
    let places = [1.0, 1e3, 1e5].map(|times| Place { dome: Some(16.0 * times), ..PLACES[1] });
    is_shaded_so(&Shaded { rings: COARSE, sources: TWO_LAMPS, places: &places, truths: &truths }, 500, 100);
}

/// Rings of the coarse sphere.
const COARSE: u32 = 16;

/// What both eyes see of the coarse sphere by these lights.
fn to_the_facet(sources: [Source; 2]) -> [(&'static str, Eye, Truth); 2] {
    let triangles = Triangles::of(&scene(COARSE, PLACES[1]));
    EYES.map(|(name, eye)| {
        let shown = |point: [f64; 2], lift: f64| {
            let direction = eye.ray(SIZE, point).normalize();
            let met = triangles.first_met(eye.eye, direction)?;
            let at = eye.eye + met.t * direction;
            let lit = sources.map(|source| {
                let towards = source.from(at);
                // A lamp is at 1 in lengths of this.
                let free = triangles.met(at + lift * met.normal, towards, 0.0).next().is_none();
                free && towards.dot(met.normal) > 0.0
            });
            Some(Shown { instance: met.instance, lit })
        };
        let truth = |pixel| {
            let [low, high] = [1e-9, LIFT].map(|lift| decided(pixel, |point| shown(point, lift)));
            low.filter(|_| low == high)
        };
        (name, eye, pixels().into_par_iter().map(truth).collect::<Truth>())
    })
}
