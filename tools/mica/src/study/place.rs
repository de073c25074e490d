//! A place of a study, opened on a device: what is seen without glints, and the materials as the scene has them.

use super::timing::Clock;
use crate::args::SceneArgs;
use crate::error::Failure;
use crate::progress::Progress;
use crate::session::{Loaded, Session, Wanted};
use mica_accuracy::{Machine, Place};
use mica_gpu::{DeviceInfo, Executor, Timing};
use mica_render::{COMMON_SETTINGS, GlintMaterial, MethodInfo};
use std::collections::BTreeSet;
use std::path::PathBuf;

/// Which of a scene's lights shine.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Lighting {
    /// All of them.
    Own,
    /// The lights, without the environment.
    Lights,
    /// The environment, without the lights.
    Environment,
}

impl Lighting {
    /// The word used on command lines and in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Own => "own",
            Self::Lights => "lights",
            Self::Environment => "environment",
        }
    }

    /// The same scene under these lights only.
    pub fn apply(self, args: &mut SceneArgs) {
        match self {
            Self::Own => {}
            Self::Lights => args.env = Some(PathBuf::from("none")),
            Self::Environment => args.no_lights = true,
        }
    }

    /// The options that do so.
    pub const fn options(self) -> &'static str {
        match self {
            Self::Own => "",
            Self::Lights => " --env none",
            Self::Environment => " --no-lights",
        }
    }
}

/// A place on a device.
pub struct OpenPlace {
    /// What is seen, and at what size.
    pub place: Place,
    /// Who measures.
    pub machine: Machine,
    /// The scene on the device.
    pub session: Session,
    /// Letters that change with anything that is seen of the scene and its environment.
    pub content: String,
    /// The options of `mica render` that show the place, ready to follow its name.
    pub options: String,
    /// The glinting materials as the scene has them.
    own: Vec<GlintMaterial>,
    /// Names of what stays on the device between frames that show no glints.
    pub(super) without_glints: BTreeSet<String>,
    /// Passes that have built something here: their shaders are compiled.
    pub(super) built: BTreeSet<String>,
}

impl OpenPlace {
    /// Loads the scene and renders it once without glints, so that what that frame needs is known and there.
    ///
    /// # Errors
    /// With the code of a missing device if there is none, or none that measures time.
    pub fn open(args: &SceneArgs, lighting: Lighting, progress: &mut Progress) -> Result<Self, Failure> {
        Self::open_on(None, args, lighting, progress)
    }

    /// The same on the device of an earlier place, so that no shader is compiled twice.
    pub fn open_on(
        earlier: Option<Executor>,
        args: &SceneArgs,
        lighting: Lighting,
        progress: &mut Progress,
    ) -> Result<Self, Failure> {
        let mut args = args.clone();
        lighting.apply(&mut args);
        let loaded = Loaded::new(&args, progress)?;
        let content = loaded.fingerprint();
        let session = Session::of(loaded, &args, earlier)?;
        Clock::of(session.device())?;
        if lighting == Lighting::Lights && session.renderer.scene().lights.is_empty() {
            let scene = &session.scene;
            return Err(Failure::bad_input(format!("{scene} has no lights; leave out --lighting lights for it")));
        }
        let [width, height] = args.size;
        let mut options = format!(" --size {width}x{height}{}", lighting.options());
        if args.occlusion != crate::args::OcclusionChoice::Auto {
            options += &format!(" --occlusion {}", session.renderer.occlusion().name());
        }
        let place = Place { scene: session.scene.clone(), lighting: lighting.name().to_owned(), size: args.size };
        Ok(Self { content, ..Self::of_session(session, place, options)? })
    }

    /// The same of a session that is there already and has shown no glints yet.
    pub fn of_session(mut session: Session, place: Place, options: String) -> Result<Self, Failure> {
        let own = session.renderer.materials().to_vec();
        if own.is_empty() {
            let scene = &session.scene;
            return Err(Failure::bad_input(format!(
                "{scene}: no material glints (none has glint_count in its extras), so there is nothing to measure"
            )));
        }
        let machine = machine(session.device(), session.renderer.occlusion().name());
        // The smooth limit makes nothing beforehand but what the scene asks for.
        session.renderer.set_method(None, "smooth")?;
        session.precompute(&mut Progress::new(true))?;
        let view = mica_render::View { glints: false, ..session.view.clone() };
        session.look(&view, Timing::Overlapped, Wanted::default())?;
        let without_glints = session.executor.memory().into_iter().map(|row| row.name).collect();
        let mut open = Self {
            place,
            machine,
            session,
            content: String::new(),
            options,
            own,
            without_glints,
            built: BTreeSet::new(),
        };
        open.reset()?;
        Ok(open)
    }

    /// The same at another size.
    pub fn resize(&mut self, size: [u32; 2]) {
        self.place.size = size;
        self.session.view.size = size;
    }

    /// Sets all materials to a method with a rung's settings, and everything else to what the scene says.
    pub fn set(&mut self, method: &MethodInfo, rung: &[(&str, &str)]) -> Result<(), Failure> {
        for material in self.own.clone() {
            self.set_material(&material, method)?;
        }
        for (key, value) in rung {
            self.session.renderer.set(None, key, value)?;
        }
        Ok(())
    }

    /// Gives up all tables of the method in use, so that it makes them anew.
    pub fn drop_tables(&mut self) -> Result<(), Failure> {
        let set: Vec<GlintMaterial> = self.session.renderer.materials().to_vec();
        let other = if set.iter().any(|material| material.method.name == "smooth") { "shopf" } else { "smooth" };
        self.session.renderer.set_method(None, other)?;
        for material in set {
            let renderer = &mut self.session.renderer;
            renderer.set_method(Some(&material.name), material.method.name)?;
            for (key, value) in material.values.iter() {
                renderer.set(Some(&material.name), key, &value.to_string())?;
            }
        }
        Ok(())
    }

    /// Each material with other flakes of the same kind.
    pub fn other_flakes(&mut self) -> Result<(), Failure> {
        for material in self.session.renderer.materials().to_vec() {
            let seed = material.values.number("seed") as u32;
            self.session.renderer.set(Some(&material.name), "seed", &seed.wrapping_add(1).to_string())?;
        }
        Ok(())
    }

    /// Everything as the scene has it.
    fn reset(&mut self) -> Result<(), Failure> {
        for material in self.own.clone() {
            self.set_material(&material, material.method)?;
        }
        Ok(())
    }

    fn set_material(&mut self, own: &GlintMaterial, method: &MethodInfo) -> Result<(), Failure> {
        let renderer = &mut self.session.renderer;
        renderer.set_method(Some(&own.name), method.name)?;
        // A method keeps what it has in common with the one before it: not here.
        for setting in method.settings {
            renderer.set(Some(&own.name), setting.key, &setting.default.to_string())?;
        }
        for setting in COMMON_SETTINGS {
            renderer.set(Some(&own.name), setting.key, &own.values.get(setting.key).to_string())?;
        }
        Ok(())
    }
}

/// Who measures on a device, whose occlusion this body answers.
pub fn machine(device: &DeviceInfo, occlusion: &str) -> Machine {
    Machine {
        device: device.name.clone(),
        driver: format!("{} {}", device.driver, device.driver_version).trim().to_owned(),
        occlusion: occlusion.to_owned(),
        build: crate::build::BUILD.to_owned(),
    }
}
