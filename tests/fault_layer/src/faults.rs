//! Which call fails next, and what was called so far.

use ash::vk;
use std::ffi::{CStr, c_char};
use std::ops::Range;
use std::sync::{LazyLock, Mutex, MutexGuard, PoisonError};

/// Lets the call number `call` from now on, of all that may fail, and those after it that make `times` of them, return the
/// result number `choice` of those that each may return. There is none where it may return fewer. With a name, which has to
/// live on, only calls of this function count.
pub type Arm = unsafe extern "C" fn(call: u32, times: u32, choice: u32, name: *const c_char);

/// Writes what happened since the last [`Arm`], and lets nothing fail any more.
pub type ReportOf = unsafe extern "C" fn(report: *mut Report);

/// What happened since a fault was asked for.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Report {
    /// How many calls were made that may fail.
    pub calls: u32,
    /// How many results the last call in question may return beside success; 0 if none was made.
    pub choices: u32,
    /// What it returned; `SUCCESS` if it did not fail.
    pub result: vk::Result,
    /// Its name; null if it was not made.
    pub name: *const c_char,
}

impl Report {
    const NOTHING: Self = Self { calls: 0, choices: 0, result: vk::Result::SUCCESS, name: std::ptr::null() };
}

// SAFETY: the name is a literal.
unsafe impl Send for Report {}

struct State {
    /// `None` unless the process asks.
    armed: Option<Armed>,
    report: Report,
    /// From the environment, each with the calls of this function so far.
    planned: Vec<(Planned, u32)>,
}

/// As [`Arm`] says.
struct Armed {
    calls: Range<u32>,
    choice: u32,
    name: Option<&'static CStr>,
}

/// One item of `MICA_FAULTS`: a call that fails.
#[derive(Debug, PartialEq, Eq)]
struct Planned {
    name: String,
    first: u32,
    /// Whether all later ones fail too.
    onwards: bool,
    result: vk::Result,
}

impl Planned {
    fn of(item: &str) -> Option<Self> {
        let (name, rest) = item.split_once('@')?;
        let (at, result) = rest.split_once('=')?;
        let (at, onwards) = at.strip_suffix('+').map_or((at, false), |at| (at, true));
        let result = vk::Result::from_raw(result.parse().ok()?);
        Some(Self { name: name.to_owned(), first: at.parse().ok()?, onwards, result })
    }

    fn is_now(&self, call: u32) -> bool {
        call == self.first || (self.onwards && call > self.first)
    }
}

fn state() -> MutexGuard<'static, State> {
    static STATE: LazyLock<Mutex<State>> = LazyLock::new(|| {
        let planned = items().iter().filter_map(|item| Planned::of(item)).map(|planned| (planned, 0)).collect();
        Mutex::new(State { armed: None, report: Report::NOTHING, planned })
    });
    STATE.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The items of `MICA_FAULTS`.
pub(crate) fn items() -> Vec<String> {
    let all = std::env::var("MICA_FAULTS").unwrap_or_default();
    all.split(';').map(|item| item.trim().to_owned()).filter(|item| !item.is_empty()).collect()
}

/// What a call returns instead of being made, if it is its turn. `name` ends with a NUL.
pub(crate) fn result_of(name: &'static str, may_return: &[vk::Result]) -> Option<vk::Result> {
    let mut state = state();
    let State { armed, report, .. } = &mut *state;
    let counts = |armed: &&Armed| armed.name.is_none_or(|only| only.to_bytes_with_nul() == name.as_bytes());
    if let Some(armed) = armed.as_ref().filter(counts) {
        let call = report.calls;
        report.calls += 1;
        if !armed.calls.contains(&call) {
            return None;
        }
        let result = may_return.get(armed.choice as usize).copied();
        report.name = name.as_ptr().cast();
        report.choices = may_return.len() as u32;
        report.result = result.unwrap_or(vk::Result::SUCCESS);
        return result;
    }
    let plain = name.trim_end_matches('\0');
    let of_name = state.planned.iter_mut().filter(|(planned, _)| planned.name == plain);
    let mut result = None;
    for (planned, calls) in of_name {
        if planned.is_now(*calls) {
            result = Some(planned.result);
        }
        *calls += 1;
    }
    result
}

/// [`Arm`].
///
/// # Safety
/// The name is null or a string that lives until the next call of this.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mica_faults_arm(call: u32, times: u32, choice: u32, name: *const c_char) {
    // SAFETY: as the caller promises.
    let name = (!name.is_null()).then(|| unsafe { CStr::from_ptr(name) });
    let mut state = state();
    state.armed = Some(Armed { calls: call..call.saturating_add(times), choice, name });
    state.report = Report::NOTHING;
}

/// [`ReportOf`].
///
/// # Safety
/// The pointer is good for a write.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mica_faults_report(report: *mut Report) {
    let mut state = state();
    state.armed = None;
    // SAFETY: as the caller promises.
    unsafe { report.write(state.report) };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_item_names_the_call_its_number_and_its_result() {
        let planned = Planned::of("vkQueueSubmit2@3=-4").expect("an item");
        assert_eq!((planned.name.as_str(), planned.result), ("vkQueueSubmit2", vk::Result::ERROR_DEVICE_LOST));
        assert_eq!([2, 3, 4].map(|call| planned.is_now(call)), [false, true, false]);
        let onwards = Planned::of("vkQueueSubmit2@3+=-4").expect("an item");
        assert_eq!([2, 3, 4].map(|call| onwards.is_now(call)), [false, true, true]);
        assert_eq!(Planned::of("maxStorageBufferRange=4096"), None);
    }
}
