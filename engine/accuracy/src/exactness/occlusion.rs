//! Occlusion: what hides the environment and the lights from flakes.
//!
//! The truth is many rays over the distribution of normals in each pixel, one for each direction that its flakes mirror, and
//! one towards each light. Cheaper rungs share what they are compared with: radiance is that of infinitely many flakes that
//! reflect everything, so that an error is of visibility alone.

use super::resample::resampled;
use super::{Chart, EXACTNESS_SCHEMA, Effort, ExactnessError, ExactnessLine, in_turn, pass_ns, spread};
use crate::{Estimate, Machine};
use glam::{DMat3, DVec3, Vec3};
use mica_gpu::{Executor, Run, Timing};
use mica_graph::{Buffer, Graph, Lifetime};
use mica_oracle::microfacet::{Microfacets, Ndf, SmithFit};
use mica_render::scene::{EquirectMap, Light, Scene, procedural};
use mica_render::{
    Environment, GlintMaterial, OcclusionBackend, Progress, Question, Ray, RayAnswer, Renderer, View, embedded_scene,
};
use std::f64::consts::TAU;
use std::sync::Arc;

/// Scenes with glints that hide one another from an environment and from a lamp.
const SCENES: [&str; 2] = ["shoe", "cloth"];
/// Pixels along x and y.
const SIZE: [u32; 2] = [160, 90];
/// Rays for each pixel of the truth.
const TRUTH_RAYS: u32 = 192;

/// How free the environment is, as a rung has it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sky {
    /// Entirely.
    Open,
    /// As the mirror direction is; then blurred over nine pixels or not.
    Mirror { blurred: bool },
    /// As so many rays over the distribution of normals are.
    Rays(u32),
}

/// One way to know what is hidden.
#[derive(Debug)]
struct Rung {
    name: &'static str,
    what: &'static str,
    sky: Sky,
    /// Whether each light is asked for by itself; otherwise lights are as free as the environment.
    lights: bool,
}

const RUNGS: [Rung; 8] = [
    Rung { name: "none", what: "Nothing hides anything.", sky: Sky::Open, lights: false },
    Rung {
        name: "mirror",
        what: "One ray in the mirror direction dims all glints of a pixel (Wang et al. 2020, without the blur).",
        sky: Sky::Mirror { blurred: false },
        lights: false,
    },
    Rung {
        name: "mirror, blurred",
        what: "One ray in the mirror direction, blurred over nine pixels, dims all glints (Wang et al. 2020 as printed).",
        sky: Sky::Mirror { blurred: true },
        lights: false,
    },
    Rung { name: "lights", what: "A ray towards each light; the environment is open.", sky: Sky::Open, lights: true },
    Rung {
        name: "lights + mirror",
        what: "A ray towards each light, and one in the mirror direction for the environment.",
        sky: Sky::Mirror { blurred: false },
        lights: true,
    },
    Rung {
        name: "lights + mirror, blurred",
        what: "The same, the mirror direction's blurred over nine pixels.",
        sky: Sky::Mirror { blurred: true },
        lights: true,
    },
    Rung {
        name: "lights + 4 rays",
        what: "A ray towards each light, and four over the distribution of normals for the environment.",
        sky: Sky::Rays(4),
        lights: true,
    },
    Rung {
        name: "lights + 16 rays",
        what: "A ray towards each light, and sixteen over the distribution of normals for the environment.",
        sky: Sky::Rays(16),
        lights: true,
    },
];

/// A pixel that glints.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// Which it is, row by row.
    pixel: usize,
    /// Which of the glinting materials it shows.
    material: usize,
    position: DVec3,
    normal: DVec3,
    geometric_normal: DVec3,
    /// Towards the viewer.
    o: DVec3,
}

/// A direction that flakes mirror, and how much radiance it would send if nothing were in its way.
struct Mirrored {
    direction: DVec3,
    radiance: f64,
}

/// A scene whose glints are asked about.
pub struct Glints {
    renderer: Renderer,
    view: View,
    map: EquirectMap,
    facets: Vec<Microfacets>,
    seen: Vec<Seen>,
    /// Pixels that see any surface.
    surfaces: usize,
    shadow_mask: Vec<u32>,
    /// Visibility of the mirror direction, as it is and blurred.
    mirror: [Vec<f32>; 2],
    lights: Vec<Light>,
}

fn map_of(scene: &Scene) -> EquirectMap {
    let named = scene.environment.as_deref().and_then(procedural::environment);
    named.unwrap_or_else(|| EquirectMap::constant([1.0; 3]))
}

fn luminance([r, g, b]: [f32; 3]) -> f64 {
    0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
}

impl Glints {
    /// An embedded scene by its name, with what the renderer's own passes say of its pixels.
    ///
    /// # Errors
    /// Those of the device.
    ///
    /// # Panics
    /// If there is no scene of that name: a mistake of the caller, not of any input.
    pub fn new(executor: &mut Executor, name: &str) -> Result<Self, ExactnessError> {
        let scene = embedded_scene(name).expect("an embedded scene").load()?;
        let map = map_of(&scene);
        let environment = Environment { map: map.clone(), rotation_radians: 0.0 };
        let triangles = scene.meshes.iter().map(|mesh| mesh.triangle_count() as u64).sum();
        let (backend, _) = OcclusionBackend::auto(executor.device().info(), triangles);
        let view = View::new(scene.default_camera(), SIZE);
        let lights = scene.lights.clone();
        let mut renderer = Renderer::new(scene, &[], Some(&environment), backend)?;
        // The one method that asks for the mirror direction; its tables do not matter here, and are as small as they can be.
        renderer.set_method(None, "wang2020")?;
        for (key, value) in [("depth", "1"), ("samples", "1"), ("blur", "false")] {
            renderer.set(None, key, value)?;
        }
        renderer.precompute(executor, None, &mut |_, _, _| {})?;
        let roughness = |material: &GlintMaterial| {
            Microfacets::new(Ndf::Beckmann, material.values.number("alpha"), SmithFit::Rational)
        };
        let facets = renderer.materials().iter().map(roughness).collect::<Result<_, _>>()?;
        let mut glints = Self {
            renderer,
            view,
            map,
            facets,
            seen: Vec::new(),
            surfaces: 0,
            shadow_mask: Vec::new(),
            mirror: [Vec::new(), Vec::new()],
            lights,
        };
        glints.look(executor)?;
        Ok(glints)
    }

    /// Renders two frames, one with the blur of visibility and one without, for what their passes say.
    fn look(&mut self, executor: &mut Executor) -> Result<(), ExactnessError> {
        for (blurred, value) in [(0, "false"), (1, "true")] {
            self.renderer.set(None, "blur", value)?;
            let mut g = Graph::new();
            let frame = self.renderer.frame(&mut g, &self.view, None)?;
            let ids = g.download_image(&frame.ids);
            let surface = [&frame.position, &frame.normal].map(|image| g.download_image(image));
            let shadows = frame.shadow_mask.as_ref().map(|image| g.download_image(image));
            let visibility: Vec<_> = frame.visibility.iter().map(|image| g.download_image(image)).collect();
            let mut run = executor.run(g, Timing::Overlapped)?;
            // Layers ask for the same where their methods are the same.
            self.mirror[blurred] =
                visibility.first().map(|image| bytemuck::pod_collect_to_vec(&run.take(*image))).unwrap_or_default();
            self.shadow_mask = shadows.map(|image| bytemuck::pod_collect_to_vec(&run.take(image))).unwrap_or_default();
            let ids: Vec<[u32; 2]> = bytemuck::pod_collect_to_vec(&run.take(ids));
            let [position, normal] = surface.map(|image| bytemuck::pod_collect_to_vec(&run.take(image)));
            self.see(&ids, &position, &normal);
        }
        Ok(())
    }

    /// Keeps the pixels that glint.
    fn see(&mut self, ids: &[[u32; 2]], position: &[[f32; 4]], normal: &[[f32; 4]]) {
        let scene = self.renderer.scene();
        let eye = self.view.camera.eye() - self.renderer.scene_center();
        let material_of = |id: u32| {
            let mesh = scene.instances[id.checked_sub(1)? as usize].mesh;
            let material = scene.meshes[mesh].material;
            self.renderer.materials().iter().position(|glinting| glinting.index == material)
        };
        let xyz = |of: [f32; 4]| Vec3::new(of[0], of[1], of[2]).as_dvec3();
        let pixels = ids.iter().zip(position).zip(normal).enumerate();
        self.seen = pixels
            .filter_map(|(pixel, (([id, _], position), normal))| {
                let material = material_of(*id)?;
                let geometric_normal = unfolded(position[3], normal[3]);
                let (position, normal) = (xyz(*position), xyz(*normal));
                Some(Seen { pixel, material, position, normal, geometric_normal, o: (eye - position).normalize() })
            })
            .collect();
        self.surfaces = ids.iter().filter(|[id, _]| *id != 0).count();
    }

    /// What `count` normals of the pixel's distribution mirror, evenly spread.
    fn mirrored(&self, seen: &Seen, count: u32) -> Vec<Mirrored> {
        let facets = &self.facets[seen.material];
        let (tangent, bitangent) = seen.normal.any_orthonormal_pair();
        let from_local = DMat3::from_cols(tangent, bitangent, seen.normal);
        let o = from_local.transpose() * seen.o;
        let mirror = |index: u32| {
            let u = (f64::from(index) + 0.5) / f64::from(count);
            let turn = TAU * (f64::from(index.reverse_bits()) + 0.5) / 4_294_967_296.0;
            let slope = facets.alpha() * (-(-u).ln_1p()).sqrt();
            let m = DVec3::new(slope * turn.cos(), slope * turn.sin(), 1.0).normalize();
            let r = 2.0 * o.dot(m) * m - o;
            let direction = from_local * r;
            let shown = o.dot(m) / m.z * facets.g1_over_cos(r) * r.z * facets.g1_over_cos(o);
            let radiance =
                if o.dot(m) > 0.0 && r.z > 0.0 { shown * luminance(self.map.radiance(direction)) } else { 0.0 };
            Mirrored { direction, radiance: radiance / f64::from(count) }
        };
        (0..count).map(mirror).filter(|mirrored| mirrored.radiance > 0.0).collect()
    }

    /// What each light would send to the viewer if nothing were in its way.
    fn lit(&self, seen: &Seen) -> Vec<f64> {
        let facets = &self.facets[seen.material];
        let (tangent, bitangent) = seen.normal.any_orthonormal_pair();
        let to_local = DMat3::from_cols(tangent, bitangent, seen.normal).transpose();
        let of = |light: &Light| {
            let (towards, irradiance) = match light {
                Light::Directional { direction, irradiance } => (-*direction, luminance(*irradiance)),
                // The embedded scenes have no spots, nor lights that end.
                Light::Point { position, radiant_intensity, .. } | Light::Spot { position, radiant_intensity, .. } => {
                    let to_light = *position - self.renderer.scene_center() - seen.position;
                    (to_light.normalize(), luminance(*radiant_intensity) / to_light.length_squared())
                }
            };
            let (i, o) = (to_local * towards, to_local * seen.o);
            if i.z > 0.0 && o.z > 0.0 { irradiance * i.z * facets.brdf(i, o) } else { 0.0 }
        };
        self.lights.iter().map(of).collect()
    }

    /// A ray from a pixel's surface. One into the surface itself goes along it, as in the renderer's own pass.
    fn ray(seen: &Seen, direction: DVec3) -> Ray {
        let into = (1e-3 - direction.dot(seen.geometric_normal)).max(0.0);
        Ray {
            origin: seen.position.as_vec3().to_array(),
            t_min: 0.0,
            direction: (direction + into * seen.geometric_normal).as_vec3().to_array(),
            t_max: 1e30,
            normal: seen.geometric_normal.as_vec3().to_array(),
            ..Ray::default()
        }
    }

    /// For each pixel, what `count` rays over its distribution of normals would send, and the share of it that arrives.
    fn through_rays(&mut self, executor: &mut Executor, count: u32) -> Result<Vec<[f64; 2]>, ExactnessError> {
        let mirrored: Vec<Vec<Mirrored>> = self.seen.iter().map(|seen| self.mirrored(seen, count)).collect();
        let pairs = self.seen.iter().zip(&mirrored);
        let rays: Vec<Ray> =
            pairs.flat_map(|(seen, all)| all.iter().map(|one| Self::ray(seen, one.direction))).collect();
        let blocked = self.trace(executor, &rays)?.0;
        let mut next = blocked.into_iter();
        let of_pixel = |all: &Vec<Mirrored>| {
            let sent: f64 = all.iter().map(|one| one.radiance).sum();
            let arrives: f64 = all.iter().map(|one| if next.next() == Some(false) { one.radiance } else { 0.0 }).sum();
            [sent, if sent > 0.0 { arrives / sent } else { 1.0 }]
        };
        Ok(mirrored.iter().map(of_pixel).collect())
    }

    /// Whether each ray is blocked, and the run that says so.
    fn trace(&mut self, executor: &mut Executor, rays: &[Ray]) -> Result<(Vec<bool>, Run), ExactnessError> {
        let mut g = Graph::new();
        let bytes: Arc<[u8]> = Arc::from(bytemuck::cast_slice::<_, u8>(rays));
        let mut asked = Buffer::new("rays", bytes.len() as u64, Lifetime::Frame);
        g.upload(&mut asked, bytes);
        let mut answers = g.buffer("answers", (rays.len() * size_of::<RayAnswer>()) as u64);
        self.renderer.trace(&mut g, &asked, rays.len() as u32, Question::Any, &mut answers)?;
        let download = g.download(&answers);
        let mut run = executor.run(g, Timing::Isolated)?;
        let answers: Vec<RayAnswer> = bytemuck::pod_collect_to_vec(&run.take(download));
        Ok((answers.iter().map(|answer| answer.blocked != 0).collect(), run))
    }

    /// The shares that arrive in each glinting pixel as the renderer's own pass has them.
    pub fn mirror(&self, blurred: bool) -> Vec<f64> {
        let image = &self.mirror[usize::from(blurred)];
        self.seen.iter().map(|seen| f64::from(image[seen.pixel])).collect()
    }

    /// Whether a ray in the mirror direction of each glinting pixel arrives, asked here.
    ///
    /// # Errors
    /// Those of the device.
    pub fn mirror_asked(&mut self, executor: &mut Executor) -> Result<Vec<f64>, ExactnessError> {
        let mirror = |seen: &Seen| Self::ray(seen, 2.0 * seen.o.dot(seen.normal) * seen.normal - seen.o);
        let rays: Vec<Ray> = self.seen.iter().map(mirror).collect();
        Ok(self.trace(executor, &rays)?.0.into_iter().map(|blocked| if blocked { 0.0 } else { 1.0 }).collect())
    }
}

/// A unit vector from its place on the octahedron (Cigolle et al. 2014).
fn unfolded(x: f32, y: f32) -> DVec3 {
    let (x, y) = (f64::from(x), f64::from(y));
    let z = 1.0 - x.abs() - y.abs();
    let below = (-z).max(0.0);
    DVec3::new(x - below.copysign(x), y - below.copysign(y), z).normalize()
}

/// Nanoseconds for a glinting pixel.
struct Times {
    mirror: Estimate,
    blur: Estimate,
    lights: Estimate,
    /// By the number of rays.
    rays: Vec<(u32, Estimate)>,
}

/// A sum of times, their ends too.
fn sum(times: &[Estimate]) -> Estimate {
    let of = |part: fn(&Estimate) -> f64| times.iter().map(part).sum();
    Estimate { value: of(|time| time.value), low: of(|time| time.low), high: of(|time| time.high) }
}

impl Glints {
    /// The renderer's own passes, each pass over the pixels that it asks for, and rays over the distribution of normals.
    fn time(&mut self, executor: &mut Executor, rounds: usize) -> Result<Times, ExactnessError> {
        const RAYS: [u32; 2] = [4, 16];
        let rays = RAYS.map(|count| {
            let of_pixel = |seen: &Seen| -> Vec<Ray> {
                self.mirrored(seen, count).iter().map(|one| Self::ray(seen, one.direction)).collect()
            };
            self.seen.iter().flat_map(of_pixel).collect::<Vec<Ray>>()
        });
        self.renderer.set(None, "blur", "true")?;
        let (glinting, surfaces) = (self.seen.len() as f64, self.surfaces as f64);
        let pixels = f64::from(SIZE[0] * SIZE[1]);
        let mut of_frames = Vec::new();
        let of_rays = in_turn(rounds, 1 + RAYS.len(), |thing| {
            if thing > 0 {
                let run = self.trace(executor, &rays[thing - 1])?.1;
                return Ok(pass_ns(executor, &run, "trace_rays")? / glinting);
            }
            let mut g = Graph::new();
            let frame = self.renderer.frame(&mut g, &self.view, None)?;
            g.export(&frame.display);
            let run = executor.run(g, Timing::Isolated)?;
            let of = |name, asked: f64| pass_ns(executor, &run, name).map(|ns| ns / asked);
            of_frames.push([of("occlusion", glinting)?, of("blur_visibility", pixels)?, of("shadows", surfaces)?]);
            Ok::<_, ExactnessError>(0.0)
        })?;
        // As `in_turn`: drivers compile in the first round.
        let spread_of = |pass: usize| spread(&of_frames[1..].iter().map(|frame| frame[pass]).collect::<Vec<_>>());
        let rays = RAYS.into_iter().zip(&of_rays[1..]).map(|(count, times)| (count, spread(times))).collect();
        Ok(Times { mirror: spread_of(0), blur: spread_of(1), lights: spread_of(2), rays })
    }

    /// Radiance of each glinting pixel, `shares` of the environment arriving, and lights as their own rays say or as the
    /// environment.
    fn radiance(&self, sent: &[f64], shares: &[f64], lights: bool) -> Vec<f64> {
        let of_pixel = |((seen, sent), share): ((&Seen, &f64), &f64)| {
            let mask = self.shadow_mask.get(seen.pixel).copied().unwrap_or(0);
            let arrives = |light: usize| if lights { f64::from(1 - (mask >> light & 1)) } else { *share };
            let of_lights = self.lit(seen).into_iter().enumerate().map(|(light, each)| each * arrives(light));
            sent * share + of_lights.sum::<f64>()
        };
        self.seen.iter().zip(sent).zip(shares).map(of_pixel).collect()
    }

    /// The error of each rung, in the order in which the chart has them.
    ///
    /// # Errors
    /// Those of the device.
    pub fn errors(&mut self, executor: &mut Executor) -> Result<Vec<Estimate>, ExactnessError> {
        let pairs = self.through_rays(executor, TRUTH_RAYS)?;
        let (sent, arrives): (Vec<f64>, Vec<f64>) = pairs.into_iter().map(|[sent, share]| (sent, share)).unzip();
        let truth = self.radiance(&sent, &arrives, true);
        let mut errors = Vec::new();
        for rung in &RUNGS {
            let shares = match rung.sky {
                Sky::Open => vec![1.0; sent.len()],
                Sky::Mirror { blurred } => self.mirror(blurred),
                Sky::Rays(count) => self.through_rays(executor, count)?.into_iter().map(|[_, share]| share).collect(),
            };
            errors.push(self.error(&self.radiance(&sent, &shares, rung.lights), &truth));
        }
        Ok(errors)
    }

    /// Mean distance of pixels from the truth, over the truth's mean; its interval from tiles of 8 x 8 pixels.
    fn error(&self, radiance: &[f64], truth: &[f64]) -> Estimate {
        let mut tiles = std::collections::BTreeMap::new();
        for ((seen, radiance), truth) in self.seen.iter().zip(radiance).zip(truth) {
            let (column, row) = (seen.pixel % SIZE[0] as usize, seen.pixel / SIZE[0] as usize);
            let sums: &mut [f64; 2] = tiles.entry((row / 8, column / 8)).or_default();
            sums[0] += (radiance - truth).abs();
            sums[1] += truth;
        }
        let tiles: Vec<[f64; 2]> = tiles.into_values().collect();
        resampled(tiles.len(), |picks| {
            let sum = |part: usize| picks.iter().map(|pick| tiles[*pick][part]).sum::<f64>();
            sum(0) / sum(1)
        })
    }
}

/// The lines of the chart.
///
/// # Errors
/// Those of the device.
pub fn measure(
    executor: &mut Executor,
    effort: &Effort,
    machine: &Machine,
    progress: Progress,
) -> Result<Vec<ExactnessLine>, ExactnessError> {
    let mut lines = Vec::new();
    for (done, name) in (0..).zip(SCENES) {
        progress("occlusion of glints", done, SCENES.len() as u64);
        let mut glints = Glints::new(executor, name)?;
        let machine = Machine { occlusion: glints.renderer.occlusion().name().to_owned(), ..machine.clone() };
        let times = glints.time(executor, effort.frame_rounds())?;
        let nothing = Estimate::exact(0.0);
        for (rung, error) in RUNGS.iter().zip(glints.errors(executor)?) {
            let time = match rung.sky {
                Sky::Open => nothing,
                Sky::Mirror { blurred: false } => times.mirror,
                Sky::Mirror { blurred: true } => sum(&[times.mirror, times.blur]),
                Sky::Rays(count) => times.rays.iter().find(|(of, _)| *of == count).map_or(nothing, |(_, time)| *time),
            };
            lines.push(ExactnessLine {
                schema: EXACTNESS_SCHEMA.to_owned(),
                chart: Chart::Occlusion.name().to_owned(),
                case: name.to_owned(),
                rung: rung.name.to_owned(),
                what: rung.what.to_owned(),
                error_of:
                    "mean |radiance - truth| / mean truth of the glinting pixels, with its 95 % interval; truth: a \
                           ray towards each light and 192 over the distribution of normals"
                        .to_owned(),
                error,
                ns: if rung.lights { sum(&[time, times.lights]) } else { time },
                per: "glinting pixel, by the device's timestamps".to_owned(),
                machine: machine.clone(),
            });
        }
    }
    Ok(lines)
}
