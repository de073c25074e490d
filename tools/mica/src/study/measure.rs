//! A point: a method with a rung of its ladder at a place.

use super::effort::Effort;
use super::place::OpenPlace;
use super::reference::path_frames;
use super::{Reference, paired};
use crate::error::Failure;
use crate::interrupt::Interrupt;
use crate::picture::png_of;
use mica_accuracy::{ErrorMap, POINT_SCHEMA, Point, displayed};
use mica_render::{MethodInfo, Rung};

/// What was measured of a point.
pub struct Measured {
    /// Its line; without pictures, whose names its folder knows.
    pub point: Point,
    /// The tone-mapped picture and the map of its FLIP, as PNG files, if there was a reference.
    pub pictures: Option<[Vec<u8>; 2]>,
}

/// Measures a method with a rung of its ladder: its time, and against a reference its error.
///
/// # Errors
/// Those of frames, and one with the code of an interrupt.
pub fn measure(
    open: &mut OpenPlace,
    method: &'static MethodInfo,
    rung: &Rung,
    reference: Option<&Reference>,
    effort: &Effort,
    interrupt: &Interrupt,
) -> Result<Measured, Failure> {
    let mut point =
        unmeasured(open, method, rung, &if reference.is_some() { effort.describe() } else { effort.of_times() });
    open.set(method, rung.set)?;
    point.cost = paired(open, effort, interrupt)?;
    let Some(reference) = reference else { return Ok(Measured { point, pictures: None }) };
    let Reference { pixels, path, base, .. } = reference;
    let view = open.session.view.clone();
    let picture = open.radiance(&view)?;
    let mut errors = pixels.errors(&picture, base, view.exposure)?;
    errors.path = pixels.path_errors(&path_frames(open, &picture, path, interrupt)?)?;
    point.errors = Some(errors);

    let size = view.size;
    let [shown, of_reference] = [&picture, &pixels.whole].map(|radiance| displayed(radiance, view.exposure));
    let map = ErrorMap::of_displayed(size, &shown, &of_reference)?.magma();
    Ok(Measured { point, pictures: Some([png_of(&shown, size)?, png_of(&map, size)?]) })
}

/// The line of a point before anything is measured: what decides whether it was measured already.
pub fn unmeasured(open: &OpenPlace, method: &MethodInfo, rung: &Rung, effort: &str) -> Point {
    let set: Vec<(String, String)> =
        rung.set.iter().map(|(key, value)| ((*key).to_owned(), (*value).to_owned())).collect();
    let settings: String = set.iter().map(|(key, value)| format!(" --set {key}={value}")).collect();
    let scene = shell_word(&open.place.scene);
    Point {
        schema: POINT_SCHEMA.to_owned(),
        place: open.place.clone(),
        method: method.name.to_owned(),
        rung: rung.name.to_owned(),
        set,
        claim: method.claim.name().to_owned(),
        machine: open.machine.clone(),
        effort: effort.to_owned(),
        content: open.content.clone(),
        command: format!("mica render {scene}{} --method {}{settings} -o point.png", open.options, method.name),
        errors: None,
        cost: super::timing::nothing_yet(),
        pictures: None,
    }
}

/// A word as a POSIX shell takes it.
pub fn shell_word(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}

#[cfg(test)]
mod tests {
    use super::shell_word;

    #[test]
    fn a_command_can_be_pasted_whatever_the_scene_is_called() {
        assert_eq!(shell_word("models/a-b_1.glb"), "models/a-b_1.glb");
        assert_eq!(shell_word("my model's.glb"), r"'my model'\''s.glb'");
        assert_eq!(shell_word("$(x)"), "'$(x)'");
    }
}
