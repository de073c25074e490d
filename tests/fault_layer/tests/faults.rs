//! The layer as the loader opened it, told which call is to fail.

use ash::vk;
use mica_fault_layer::{ARM, Arm, REPORT, Report, ReportOf};
use std::ffi::CStr;
use std::mem::MaybeUninit;

/// The layer as the loader opened it.
pub struct Faults {
    library: libloading::Library,
}

/// A call that was made instead of failing, or failed.
#[derive(Debug)]
pub struct Happened {
    /// How many calls there were.
    pub calls: u32,
    /// The call in question with how many results it may return; `None` if it was not made.
    pub call: Option<(&'static str, u32)>,
    pub result: vk::Result,
}

impl Faults {
    pub fn open() -> Self {
        // SAFETY: the layer's library has no initialisers.
        let library = unsafe { libloading::Library::new(mica_fault_layer::library()) };
        Self { library: library.expect("the layer lies beside this program") }
    }

    /// Does something while the call number `call`, of all or of those with one name, fails in one of its ways.
    pub fn during<T>(
        &self,
        name: Option<&'static CStr>,
        call: u32,
        choice: u32,
        act: impl FnOnce() -> T,
    ) -> (T, Happened) {
        self.during_some(name, (call, 1), choice, act)
    }

    /// The same, and so many calls fail, one after another.
    pub fn during_some<T>(
        &self,
        name: Option<&'static CStr>,
        (call, times): (u32, u32),
        choice: u32,
        act: impl FnOnce() -> T,
    ) -> (T, Happened) {
        let of = name.map_or(std::ptr::null(), CStr::as_ptr);
        // SAFETY: the symbols are of these types.
        unsafe { self.library.get::<Arm>(ARM).expect("a symbol")(call, times, choice, of) };
        let done = act();
        let mut report = MaybeUninit::<Report>::uninit();
        // SAFETY: as above; the function writes the whole report, and names are literals of a library that stays open.
        let report = unsafe {
            self.library.get::<ReportOf>(REPORT).expect("a symbol")(report.as_mut_ptr());
            report.assume_init()
        };
        // SAFETY: as above.
        let name = |name| unsafe { CStr::from_ptr(name) }.to_str().expect("names of calls are plain");
        let call = (!report.name.is_null()).then(|| (name(report.name), report.choices));
        (done, Happened { calls: report.calls, call, result: report.result })
    }
}
