//! `mica doctor`: whether this machine can render, what with, and what is missing if not.

use crate::args::{Cli, Command, DoctorArgs};
use crate::error::{Failure, NO_DEVICE};
use crate::output;
use crate::progress::Progress;
use crate::session::Session;
use crate::table;
use clap::Parser;
use mica_gpu::{Device, DeviceInfo, DeviceKind, DeviceOptions, Error, Executor, Timing, devices};
use mica_render::OcclusionBackend;
use mica_stability::{Canary, Effort, Laboratory, StabilityError};
use serde::Serialize;
use std::ffi::OsString;
use std::time::Instant;

/// Prints what was found, and fails if a render would.
pub fn doctor(args: &DoctorArgs) -> Result<(), Failure> {
    let mut report = examine(args);
    let mut failed = None;
    if args.canaries && report.works {
        match canaries(args) {
            Ok(found) => report.canaries = Some(found),
            Err(failure) => failed = Some(failure),
        }
    }
    if args.json {
        output::print_json(&report)?;
    } else {
        output::print(&for_people(&report))?;
    }
    match report.trial {
        Trial { error: Some(error), .. } => {
            Err(Failure::with_code(NO_DEVICE, format!("a render would not work here: {error}")))
        }
        _ => failed.map_or(Ok(()), Err),
    }
}

#[derive(Serialize)]
struct DoctorReport {
    schema: &'static str,
    /// Whether a render would work.
    works: bool,
    /// Of all drivers.
    devices: Vec<DeviceFound>,
    /// That of the device which would be used.
    occlusion: Occlusion,
    validation: Validation,
    missing: Vec<Missing>,
    trial: Trial,
    /// What the arithmetic of the device does that was tried, where that was asked and a render works.
    #[serde(skip_serializing_if = "Option::is_none")]
    canaries: Option<Vec<Canary>>,
}

#[derive(Serialize)]
struct DeviceFound {
    index: usize,
    name: String,
    kind: &'static str,
    driver: String,
    api: String,
    memory_bytes: u64,
    measures_time: bool,
    ray_query: bool,
    /// The extensions and features that it lacks for ray queries.
    ray_query_lacks: Vec<String>,
    /// What `--occlusion auto` takes there.
    occlusion: Occlusion,
    /// Why it cannot serve; none if it can.
    unusable: Option<String>,
}

impl DeviceFound {
    fn new(info: &DeviceInfo) -> Self {
        Self {
            index: info.index,
            name: info.name.clone(),
            kind: info.kind.name(),
            driver: format!("{} {}", info.driver, info.driver_version).trim().to_owned(),
            api: info.api_version.to_string(),
            memory_bytes: info.limits.device_memory_bytes,
            measures_time: info.limits.timestamp_valid_bits > 0,
            ray_query: info.offers_ray_query(),
            ray_query_lacks: info.ray_query_lacks.clone(),
            occlusion: Occlusion::on(info),
            unusable: info.unusable.clone(),
        }
    }
}

/// Who would answer questions about occlusion.
#[derive(Clone, Serialize)]
struct Occlusion {
    body: &'static str,
    why: String,
}

impl Occlusion {
    fn on(info: &DeviceInfo) -> Self {
        if info.unusable.is_some() {
            return Self { body: OcclusionBackend::None.name(), why: "the device cannot be used".to_owned() };
        }
        let (backend, why) = OcclusionBackend::auto(info, 0);
        Self { body: backend.name(), why }
    }
}

/// Whether `--validation` would work. Only development needs it.
#[derive(Serialize)]
struct Validation {
    present: bool,
    error: Option<String>,
}

/// What is not there, and what brings it.
#[derive(Serialize)]
struct Missing {
    what: &'static str,
    /// A package of Debian.
    package: &'static str,
    /// Whether rendering needs it.
    needed: bool,
}

/// A tiny render.
#[derive(Serialize)]
struct Trial {
    /// The device it ran on.
    device: Option<String>,
    /// Its number.
    index: Option<usize>,
    /// From nothing to the picture.
    ns: Option<u64>,
    error: Option<String>,
}

fn examine(args: &DoctorArgs) -> DoctorReport {
    let found = devices();
    let mut missing = Vec::new();
    match &found {
        Err(Error::NoLoader(_)) => {
            missing.push(Missing { what: "the Vulkan loader", package: "libvulkan1", needed: true });
        }
        Err(Error::NoDriver(_)) => {
            missing.push(Missing { what: "a Vulkan driver", package: "mesa-vulkan-drivers", needed: true });
        }
        _ => {}
    }
    let validated = Device::new(&DeviceOptions { select: args.device.clone(), validation: mica_gpu::Validation::Core });
    let validation =
        Validation { present: validated.is_ok(), error: validated.as_ref().err().map(ToString::to_string) };
    if let Err(Error::NoValidation(_)) = validated {
        let what = "Vulkan's validation layer";
        missing.push(Missing { what, package: "vulkan-validationlayers", needed: false });
    }
    let trial = trial(args);
    let devices: Vec<DeviceFound> = found.iter().flatten().map(DeviceFound::new).collect();
    let chosen = devices.iter().find(|device| Some(device.index) == trial.index);
    let nobody = || Occlusion { body: OcclusionBackend::None.name(), why: "there is no device that works".to_owned() };
    let occlusion = chosen.map_or_else(nobody, |device| device.occlusion.clone());
    DoctorReport {
        schema: "mica-doctor-1",
        works: trial.error.is_none(),
        devices,
        occlusion,
        validation,
        missing,
        trial,
        canaries: None,
    }
}

/// Asks the device that was tried.
fn canaries(args: &DoctorArgs) -> Result<Vec<Canary>, Failure> {
    let device = Device::new(&DeviceOptions { select: args.device.clone(), ..DeviceOptions::default() })?;
    let mut executor = Executor::new(device)?;
    let mut laboratory = Laboratory { executor: &mut executor, effort: Effort::Quick };
    mica_stability::canaries(&mut laboratory).map_err(|error| match error {
        StabilityError::Gpu(error) => error.into(),
        error => Failure::with_code(NO_DEVICE, error.to_string()),
    })
}

/// Renders 16 by 16 pixels of a sphere through all passes, with small tables, and looks at what came back.
fn trial(args: &DoctorArgs) -> Trial {
    let start = Instant::now();
    let run = || -> Result<DeviceInfo, Failure> {
        let words = ["mica", "render", "sphere", "--size", "16x16", "--set", "samples=1", "--set", "depth=2"];
        let words = words.map(OsString::from);
        let device = args.device.iter().flat_map(|device| [OsString::from("--device"), device.into()]);
        let cli = Cli::try_parse_from(words.into_iter().chain(device));
        let Ok(Cli { command: Command::Render(render) }) = cli else {
            return Err(Failure::bad_input("the trial's own command line is wrong"));
        };
        let mut progress = Progress::new(args.json);
        let mut session = Session::new(&render.scene, &mut progress)?;
        session.precompute(&mut progress)?;
        let shot = session.frame(None, Timing::Overlapped, true)?;
        match shot.picture.map(|picture| picture.summary()) {
            Some(summary) if summary.nonfinite == 0 && summary.max > 0.0 => Ok(session.device().clone()),
            Some(summary) => Err(Failure::with_code(
                NO_DEVICE,
                format!(
                    "the trial's picture is wrong ({} pixels not finite, brightest {}): try another driver",
                    summary.nonfinite, summary.max
                ),
            )),
            None => Err(Failure::with_code(NO_DEVICE, "the trial gave no picture: try another driver")),
        }
    };
    let result = run();
    Trial {
        ns: result.is_ok().then(|| u64::try_from(start.elapsed().as_nanos()).unwrap_or(u64::MAX)),
        error: result.as_ref().err().map(ToString::to_string),
        index: result.as_ref().ok().map(|info| info.index),
        device: result.ok().map(|info| info.name),
    }
}

/// How to see a software driver with ray queries beside one without.
fn hint(devices: &[DeviceFound]) -> &'static str {
    match devices {
        [only] if only.kind == DeviceKind::Cpu.name() && !only.ray_query => {
            "drivers: those that VK_DRIVER_FILES names, if it is set; in a checkout, VK_DRIVER_FILES=$(ci/drivers) names one with \
             ray queries too\n"
        }
        _ => "",
    }
}

fn for_people(report: &DoctorReport) -> String {
    let mut text = String::new();
    for device in &report.devices {
        text += &format!(
            "device {}: {} ({}), {}, Vulkan {}, {} of memory\n",
            device.index,
            device.name,
            device.kind,
            device.driver,
            device.api,
            table::bytes(device.memory_bytes)
        );
        if let Some(why) = &device.unusable {
            text += &format!("  not usable: {why}\n");
            continue;
        }
        text += if device.measures_time { "  usable, measures time\n" } else { "  usable, measures no time\n" };
        let Occlusion { body, why } = &device.occlusion;
        let rays = if device.ray_query { "offered" } else { "not offered" };
        text += &format!("  occlusion: {body}, because {why}; ray queries {rays}\n");
    }
    text += hint(&report.devices);
    text += &match &report.validation.error {
        None => "validation: there, for --validation\n".to_owned(),
        Some(error) => format!("validation: not there, which only --validation needs ({error})\n"),
    };
    for missing in &report.missing {
        let need = if missing.needed { "needed" } else { "of use in development only" };
        text += &format!("missing: {} ({need}); on Debian: apt install {}\n", missing.what, missing.package);
    }
    text += &match &report.trial {
        Trial { error: Some(error), .. } => format!("trial: failed: {error}\n"),
        Trial { device, index, ns, .. } => format!(
            "trial: 16x16 pixels on device {}, {}, in {} ms, occlusion {}\n",
            index.unwrap_or_default(),
            device.as_deref().unwrap_or_default(),
            table::milliseconds(*ns),
            report.occlusion.body
        ),
    };
    for Canary { name, question, found, means } in report.canaries.iter().flatten() {
        text += &format!("canary {name}: {question}\n  {found}\n  {means}\n");
    }
    text += if report.works { "A render works here.\n" } else { "A render does not work here.\n" };
    text
}
