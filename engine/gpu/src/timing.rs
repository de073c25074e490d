//! What is measured: timestamps of the device, and the processor time of this process.

use crate::device::Device;
use crate::error::{Call, Error};
use ash::vk;
use std::time::Duration;

/// How a frame is timed. The two are never mixed: a barrier between passes changes what is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Timing {
    /// A full barrier between passes and a time for each: the table per pass.
    Isolated,
    /// Only the barriers that the plan asks for, and one time: the real frame.
    Overlapped,
}

/// The time of one pass.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PassTime {
    /// Its name.
    pub name: String,
    /// Nanoseconds; `None` with [`Timing::Overlapped`], and on devices that measure no time.
    pub ns: Option<u64>,
}

/// Timestamps of one frame.
pub(crate) struct Timestamps {
    pub(crate) pool: vk::QueryPool,
    capacity: u32,
}

impl Timestamps {
    pub(crate) fn new(device: &Device, capacity: u32) -> Result<Self, Error> {
        let capacity = capacity.next_power_of_two().max(16);
        let info = vk::QueryPoolCreateInfo::default().query_type(vk::QueryType::TIMESTAMP).query_count(capacity);
        // SAFETY: every device has timestamp queries, and the count is not zero.
        let pool = unsafe { device.raw.create_query_pool(&info, None) }.call("vkCreateQueryPool")?;
        Ok(Self { pool, capacity })
    }

    pub(crate) fn holds(&self, count: u32) -> bool {
        count <= self.capacity
    }

    /// The ticks written so far; `None` for those that the device has not come to.
    pub(crate) fn read(&self, device: &Device, count: u32) -> Result<Vec<Option<u64>>, Error> {
        let mut results = vec![[0_u64; 2]; count as usize];
        if count == 0 {
            return Ok(Vec::new());
        }
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WITH_AVAILABILITY;
        // SAFETY: the queries were reset and written by the frame, and each result has room for value and availability.
        let read = unsafe { device.raw.get_query_pool_results(self.pool, 0, &mut results, flags) };
        match read {
            Ok(()) | Err(vk::Result::NOT_READY) => {
                Ok(results.iter().map(|[ticks, available]| (*available != 0).then_some(*ticks)).collect())
            }
            Err(result) => Err(result).call("vkGetQueryPoolResults"),
        }
    }
}

/// Nanoseconds between two timestamps of which only some bits count. The counter may wrap once in between.
pub fn elapsed_ns(from: u64, to: u64, valid_bits: u32, period_ns: f32) -> u64 {
    let mask = if valid_bits >= 64 { u64::MAX } else { (1 << valid_bits) - 1 };
    let ticks = to.wrapping_sub(from) & mask;
    // Exact wherever a tick is a nanosecond, as on most devices; f64 would round there after 104 days.
    if period_ns == 1.0 { ticks } else { (ticks as f64 * f64::from(period_ns)).round() as u64 }
}

/// A time of the device, if it fits into what passed on the host's clock around it. A clock of the device that jumps or runs
/// backwards gives any number, mostly a huge one: a time that cannot be is no time.
pub(crate) fn believed_ns(ns: u64, around: Duration) -> Option<u64> {
    // Clocks differ by parts in a million, and coarse ones tick after a while.
    let most = around + around / 16 + Duration::from_millis(1);
    (u128::from(ns) <= most.as_nanos()).then_some(ns)
}

/// Processor time that all threads of this process have taken, in nanoseconds; `None` where the system does not say.
/// It hardly moves when other processes take a core, which doubles any other time (measured on lavapipe: 1 to 7 %).
pub fn process_cpu_ns() -> Option<u64> {
    #[cfg(unix)]
    {
        let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        Some(u64::try_from(time.tv_sec).ok()? * 1_000_000_000 + u64::try_from(time.tv_nsec).ok()?)
    }
    #[cfg(not(unix))]
    None
}

#[cfg(test)]
mod tests {
    use super::{believed_ns, elapsed_ns};
    use std::time::Duration;

    #[test]
    fn a_counter_that_wraps_once_is_understood() {
        let bits = 36;
        let last = (1_u64 << bits) - 1;
        assert_eq!(elapsed_ns(last - 9, 90, bits, 1.0), 100);
        assert_eq!(elapsed_ns(u64::MAX - 9, 90, 64, 1.0), 100);
    }

    #[test]
    fn f40_a_time_that_is_longer_than_the_frame_was_under_way_is_none() {
        let around = Duration::from_millis(160);
        assert_eq!(believed_ns(160_000_000, around), Some(160_000_000));
        assert_eq!(believed_ns(171_000_000, around), Some(171_000_000), "two clocks differ a little");
        assert_eq!(believed_ns(171_000_001, around), None);
        assert_eq!(believed_ns(elapsed_ns(100, 99, 64, 1.0), around), None, "it ran backwards");
        assert_eq!(believed_ns(elapsed_ns(100, 99, 36, 1.0), around), None, "a counter of few bits ran backwards");
        assert_eq!(believed_ns(0, Duration::ZERO), Some(0));
    }

    #[test]
    fn bits_that_do_not_count_are_ignored() {
        assert_eq!(elapsed_ns(0xab00_0000_0064, 0xcd00_0000_00c8, 32, 1.0), 100);
    }

    #[test]
    fn ticks_are_turned_into_nanoseconds() {
        assert_eq!(elapsed_ns(0, 3, 64, 41.666), 125);
    }
}
