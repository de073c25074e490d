//! Edits between the frames of one run, as they are typed: settings by `[MATERIAL:]KEY=VALUE`, all else by `WORD=VALUE`.

use crate::args::{CameraChoice, LARGEST_COORDINATE, camera, exposure, finite, light, numbers, size};
use crate::change::Change;
use crate::environment_choice;
use crate::error::Failure;
use crate::progress::Progress;
use crate::session::{self, Session};
use glam::{DAffine3, DVec3};
use mica_render::Environment;
use mica_render::scene::{Instance, Light};
use std::fmt;
use std::path::{Path, PathBuf};

/// The words that are no settings. Those that options have too take the same values.
const WORDS: [&str; 7] = ["light", "env", "env-rotate", "camera", "exposure", "size", "move"];

/// An edit, as it was typed.
#[derive(Clone, Debug, PartialEq)]
pub struct Edit {
    text: String,
    what: What,
}

#[derive(Clone, Debug, PartialEq)]
enum What {
    Setting(Change),
    /// Another light, or none at all any more.
    Light(Option<Light>),
    Environment(PathBuf),
    EnvironmentRotation(f64),
    Camera(CameraChoice),
    Exposure(f64),
    Size([u32; 2]),
    /// An instance by its name or number, and by how many metres it moves.
    Move(String, DVec3),
}

impl Edit {
    /// Reads an edit. Values of words may hold equals signs, as paths do.
    pub fn parse(text: &str) -> Result<Self, String> {
        let word = text.split_once('=').filter(|(word, _)| WORDS.contains(word));
        let what = match word {
            Some(("light", "none")) => What::Light(None),
            Some(("light", value)) => What::Light(Some(light(value)?)),
            Some(("env", value)) => What::Environment(PathBuf::from(value)),
            Some(("env-rotate", value)) => What::EnvironmentRotation(finite(value)?),
            Some(("camera", value)) => What::Camera(camera(value)?),
            Some(("exposure", value)) => What::Exposure(exposure(value)?),
            Some(("size", value)) => What::Size(size(value)?),
            Some((_, value)) => {
                let wanted = || format!("expected move=INSTANCE:X,Y,Z, in metres up to {LARGEST_COORDINATE:e}");
                let (instance, by) = value.rsplit_once(':').ok_or_else(wanted)?;
                let by = numbers::<3>(by).map(DVec3::from).ok_or_else(wanted)?;
                if by.abs().max_element() > LARGEST_COORDINATE {
                    return Err(wanted());
                }
                What::Move(instance.to_owned(), by)
            }
            None => What::Setting(
                Change::of_any(text).map_err(|wanted| format!("{wanted}, or {}=...", WORDS.join("=..., ")))?,
            ),
        };
        Ok(Self { text: text.to_owned(), what })
    }

    /// Whether it can be made, as far as that is known before any frame.
    pub fn check(&self, session: &Session) -> Result<(), Failure> {
        match &self.what {
            What::Setting(change) => change.check(session.renderer.materials())?,
            What::Environment(asked) => environment_choice::check(asked)?,
            What::Size(size) => session::check_size(*size, session.device())?,
            What::Move(instance, _) => {
                self.instance(&session.renderer.scene().instances, instance)?;
            }
            What::Light(_) | What::EnvironmentRotation(_) | What::Camera(_) | What::Exposure(_) => {}
        }
        Ok(())
    }

    /// Makes the edit.
    pub fn apply(&self, session: &mut Session, progress: &mut Progress) -> Result<(), Failure> {
        match &self.what {
            What::Setting(change) => change.apply(&mut session.renderer)?,
            What::Light(added) => {
                let kept = added.map_or(Vec::new(), |_| session.lights.clone());
                let lights: Vec<Light> = kept.into_iter().chain(*added).collect();
                session.renderer.set_lights(&lights)?;
                session.lights = lights;
            }
            What::Environment(asked) => self.exchange_environment(session, asked, progress)?,
            What::EnvironmentRotation(degrees) => {
                session.renderer.turn_environment(degrees.to_radians());
                session.environment_rotation_deg = *degrees;
            }
            What::Camera(choice) => session.view.camera = session::camera(*choice),
            What::Exposure(stops) => session.view.exposure = stops.exp2() as f32,
            What::Size(size) => session.view.size = *size,
            What::Move(instance, by) => {
                let index = self.instance(&session.renderer.scene().instances, instance)?;
                let place = session.renderer.scene().instances[index].world_from_local;
                session.renderer.place_instance(index, DAffine3::from_translation(*by) * place)?;
            }
        }
        Ok(())
    }

    fn exchange_environment(
        &self,
        session: &mut Session,
        asked: &Path,
        progress: &mut Progress,
    ) -> Result<(), Failure> {
        let map = environment_choice::of_command_line(asked, progress)?;
        let rotation_radians = session.environment_rotation_deg.to_radians();
        session.renderer.set_environment(map.map(|map| Environment { map, rotation_radians }).as_ref());
        session.environment = asked.display().to_string();
        Ok(())
    }

    /// The instance of a name that no other has, or else of a number.
    fn instance(&self, instances: &[Instance], asked: &str) -> Result<usize, Failure> {
        let count = instances.len();
        let mut named = (0..count).filter(|index| instances[*index].name == asked);
        match (named.next(), named.count()) {
            (Some(index), 0) => Ok(index),
            (Some(_), others) => Err(Failure::bad_input(format!(
                "--edit {self}: {} instances have this name; name one by its number, from 0 to {}",
                others + 1,
                count - 1
            ))),
            (None, _) => asked.parse().ok().filter(|index| *index < count).ok_or_else(|| {
                let what = "no instance has this name or number";
                Failure::bad_input(format!("--edit {self}: {what}; the scene has {count}, counted from 0"))
            }),
        }
    }
}

impl fmt::Display for Edit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use mica_render::{COMMON_SETTINGS, METHODS};

    #[test]
    fn words_are_told_from_settings() {
        let settings = COMMON_SETTINGS.iter().chain(METHODS.iter().flat_map(|method| method.settings));
        assert!(settings.into_iter().all(|setting| !WORDS.contains(&setting.key)), "a word hides a setting");
        let what = |text: &str| Edit::parse(text).map(|edit| edit.what);
        assert!(matches!(what("light:alpha=.2"), Ok(What::Setting(_))), "a material called light");
        assert!(matches!(what("leather:count=1e5"), Ok(What::Setting(_))));
        assert_eq!(what("env=a=b/c:d.exr"), Ok(What::Environment(PathBuf::from("a=b/c:d.exr"))));
        assert_eq!(what("light=none"), Ok(What::Light(None)));
        assert_eq!(what("move=a:b=c:1,-2,3"), Ok(What::Move("a:b=c".to_owned(), DVec3::new(1.0, -2.0, 3.0))));
        for bad in
            ["", "light", "lihgt", "light=", "light=sun", "camera=1,2,3", "size=0x0", "move=1,2,3", "env-rotate=NaN"]
        {
            assert!(what(bad).is_err(), "{bad}");
        }
        for bad in ["move=a:1,2", "move=a:1,2,inf", "move=a:2e9,0,0", "exposure=99"] {
            assert!(what(bad).is_err(), "{bad}");
        }
    }
}
