//! Devices that hang, whose clock is wrong, or whose memory comes in small pieces.

use crate::{chain, faults};
use ash::vk;
use std::collections::HashSet;
use std::ffi::{CStr, c_void};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{LazyLock, Mutex, PoisonError};
use std::time::Duration;

/// What `MICA_FAULTS` asks for.
struct Mood {
    largest_allocation: Option<u64>,
    hang: Option<Hang>,
    clock: Option<Clock>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Hang {
    /// The first submission that never begins.
    first: u32,
    /// How many times faster than the clock of the wall time passes for who waits.
    times_faster: u32,
}

/// What is wrong with timestamps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Clock {
    /// They run backwards.
    Back,
    /// All but the first of a frame are years later.
    Jump,
    /// A counter of 36 bits wraps a moment after the first of a frame, and what is above them means nothing.
    Wrap,
}

impl Mood {
    fn of(items: &[String]) -> Self {
        let value = |name: &str| items.iter().find_map(|item| item.strip_prefix(name)?.strip_prefix('='));
        let hang = |value: &str| {
            let (first, times_faster) = value.split_once('/').unwrap_or((value, "1"));
            Some(Hang { first: first.parse().ok()?, times_faster: times_faster.parse().ok().filter(|n| *n > 0)? })
        };
        let clock = |value: &str| match value {
            "back" => Some(Clock::Back),
            "jump" => Some(Clock::Jump),
            "wrap" => Some(Clock::Wrap),
            _ => None,
        };
        Self {
            largest_allocation: value("largestAllocation").and_then(|bytes| bytes.parse().ok()),
            hang: value("hang").and_then(hang),
            clock: value("clock").and_then(clock),
        }
    }
}

static MOOD: LazyLock<Mood> = LazyLock::new(|| Mood::of(&faults::items()));

/// The layer's function for a call that behaves otherwise. Such a call does not fail in other ways.
pub(crate) fn function(name: &CStr) -> vk::PFN_vkVoidFunction {
    type Void = unsafe extern "system" fn();
    let own = match name.to_bytes() {
        b"vkAllocateMemory" if MOOD.largest_allocation.is_some() => allocate as *const (),
        b"vkQueueSubmit2" if MOOD.hang.is_some() => submit as *const (),
        b"vkWaitForFences" if MOOD.hang.is_some() => wait as *const (),
        b"vkQueueWaitIdle" if MOOD.hang.is_some() => queue_wait_idle as *const (),
        b"vkDeviceWaitIdle" if MOOD.hang.is_some() => device_wait_idle as *const (),
        b"vkCreateQueryPool" if MOOD.clock.is_some() => create_queries as *const (),
        b"vkGetQueryPoolResults" if MOOD.clock.is_some() => read_queries as *const (),
        _ => return None,
    };
    // SAFETY: whoever asks for a function by its name calls it with the arguments of that name.
    Some(unsafe { std::mem::transmute::<*const (), Void>(own) })
}

/// The call as it is below.
macro_rules! call_below {
    ($object:expr, $name:literal as $type:ty, ($($argument:expr),*)) => {
        match chain::function($object, $name) {
            // SAFETY: the arguments are those of the caller, for a function of this name.
            Some(below) => unsafe {
                std::mem::transmute::<unsafe extern "system" fn(), $type>(below)($object $(, $argument)*)
            },
            None => vk::Result::ERROR_UNKNOWN,
        }
    };
}

type Callbacks = *const vk::AllocationCallbacks<'static>;

unsafe extern "system" fn allocate(
    device: vk::Device,
    info: *const vk::MemoryAllocateInfo<'_>,
    callbacks: Callbacks,
    made: *mut vk::DeviceMemory,
) -> vk::Result {
    // SAFETY: the caller passes a description.
    let bytes = unsafe { (*info).allocation_size };
    if MOOD.largest_allocation.is_some_and(|largest| bytes > largest) {
        return vk::Result::ERROR_OUT_OF_DEVICE_MEMORY;
    }
    call_below!(device, c"vkAllocateMemory" as vk::PFN_vkAllocateMemory, (info, callbacks, made))
}

/// Submissions so far.
static SUBMITTED: AtomicU32 = AtomicU32::new(0);

/// The hang, once it has begun.
fn hang() -> Option<Hang> {
    MOOD.hang.filter(|hang| SUBMITTED.load(Ordering::Relaxed) > hang.first)
}

/// Takes work that never begins.
unsafe extern "system" fn submit(
    queue: vk::Queue,
    count: u32,
    submits: *const vk::SubmitInfo2<'_>,
    fence: vk::Fence,
) -> vk::Result {
    SUBMITTED.fetch_add(1, Ordering::Relaxed);
    if hang().is_some() {
        return vk::Result::SUCCESS;
    }
    call_below!(queue, c"vkQueueSubmit2" as vk::PFN_vkQueueSubmit2, (count, submits, fence))
}

unsafe extern "system" fn wait(
    device: vk::Device,
    count: u32,
    fences: *const vk::Fence,
    all: vk::Bool32,
    timeout_ns: u64,
) -> vk::Result {
    if let Some(hang) = hang() {
        std::thread::sleep(Duration::from_nanos(timeout_ns / u64::from(hang.times_faster)));
        return vk::Result::TIMEOUT;
    }
    call_below!(device, c"vkWaitForFences" as vk::PFN_vkWaitForFences, (count, fences, all, timeout_ns))
}

/// A wait that names no end has none.
fn wait_for_ever() {
    while hang().is_some() {
        std::thread::sleep(Duration::from_secs(3600));
    }
}

unsafe extern "system" fn queue_wait_idle(queue: vk::Queue) -> vk::Result {
    wait_for_ever();
    call_below!(queue, c"vkQueueWaitIdle" as vk::PFN_vkQueueWaitIdle, ())
}

unsafe extern "system" fn device_wait_idle(device: vk::Device) -> vk::Result {
    wait_for_ever();
    call_below!(device, c"vkDeviceWaitIdle" as vk::PFN_vkDeviceWaitIdle, ())
}

/// The pools of timestamps.
static CLOCKS: LazyLock<Mutex<HashSet<vk::QueryPool>>> = LazyLock::new(Mutex::default);

unsafe extern "system" fn create_queries(
    device: vk::Device,
    info: *const vk::QueryPoolCreateInfo<'_>,
    callbacks: Callbacks,
    made: *mut vk::QueryPool,
) -> vk::Result {
    let result = call_below!(device, c"vkCreateQueryPool" as vk::PFN_vkCreateQueryPool, (info, callbacks, made));
    // SAFETY: the caller passes a description, and a pool was made where that succeeded.
    unsafe {
        if result == vk::Result::SUCCESS {
            let mut clocks = CLOCKS.lock().unwrap_or_else(PoisonError::into_inner);
            // A handle may be that of an earlier pool of another kind.
            clocks.remove(&*made);
            if (*info).query_type == vk::QueryType::TIMESTAMP {
                clocks.insert(*made);
            }
        }
    }
    result
}

unsafe extern "system" fn read_queries(
    device: vk::Device,
    pool: vk::QueryPool,
    first: u32,
    count: u32,
    bytes: usize,
    data: *mut c_void,
    stride: u64,
    flags: vk::QueryResultFlags,
) -> vk::Result {
    let result = call_below!(
        device,
        c"vkGetQueryPoolResults" as vk::PFN_vkGetQueryPoolResults,
        (pool, first, count, bytes, data, stride, flags)
    );
    let is_clock = CLOCKS.lock().unwrap_or_else(PoisonError::into_inner).contains(&pool);
    if let Some(clock) = MOOD.clock.filter(|_| is_clock && flags.contains(vk::QueryResultFlags::TYPE_64)) {
        // SAFETY: every result begins with its 64 bits, a stride after the last.
        let tick = |index: u32| unsafe { &mut *data.byte_add(index as usize * stride as usize).cast::<u64>() };
        let begun = if count > 0 { *tick(0) } else { 0 };
        for index in 0..count {
            let tick = tick(index);
            *tick = shown(clock, begun, *tick, index);
        }
    }
    result
}

/// What a wrong clock shows in the place of a tick.
fn shown(clock: Clock, begun: u64, tick: u64, index: u32) -> u64 {
    const YEARS: u64 = 1 << 58;
    const BITS: u32 = 36;
    match clock {
        Clock::Back => (u64::MAX / 2).wrapping_sub(tick),
        Clock::Jump => tick.wrapping_add(if index > 0 { YEARS } else { 0 }),
        Clock::Wrap => {
            let moment_before = (1 << BITS) - 5;
            let counted = tick.wrapping_sub(begun).wrapping_add(moment_before) & ((1 << BITS) - 1);
            counted | u64::from(index + 1) << BITS
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn items_say_what_a_device_is_like() {
        let items = ["largestAllocation=4096", "hang=3/60", "clock=wrap"].map(str::to_owned);
        let mood = Mood::of(&items);
        assert_eq!(mood.largest_allocation, Some(4096));
        assert_eq!(mood.hang, Some(Hang { first: 3, times_faster: 60 }));
        assert_eq!(mood.clock, Some(Clock::Wrap));
        let none = Mood::of(&["vkQueueSubmit2@3=-4".to_owned(), "hang=1/0".to_owned()]);
        assert!(none.largest_allocation.is_none() && none.hang.is_none() && none.clock.is_none());
    }

    #[test]
    fn a_clock_that_wraps_keeps_its_low_bits() {
        let low = |tick, index| shown(Clock::Wrap, 1000, tick, index) & ((1 << 36) - 1);
        assert_eq!([low(1000, 0), low(1004, 1), low(1005, 2), low(1105, 3)], [(1 << 36) - 5, (1 << 36) - 1, 0, 100]);
    }
}
