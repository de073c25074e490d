//! Submission on a device of our own: one command buffer, one fence, and never an endless wait.

use crate::device::Device;
use crate::error::{Call, Error, is_out_of_memory};
use crate::timing::process_cpu_ns;
use ash::vk;
use std::sync::atomic::Ordering;
use std::sync::{Arc, PoisonError};
use std::time::Duration;

/// What a submission needs.
pub(crate) struct Submission {
    device: Arc<Device>,
    pool: vk::CommandPool,
    command_buffer: vk::CommandBuffer,
    fence: vk::Fence,
}

impl Submission {
    pub(crate) fn new(device: Arc<Device>) -> Result<Self, Error> {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(device.queue_family);
        // SAFETY: the device has a queue of this family.
        let pool = unsafe { device.raw.create_command_pool(&info, None) }.call("vkCreateCommandPool")?;
        let mut submission = Self { device, pool, command_buffer: vk::CommandBuffer::null(), fence: vk::Fence::null() };
        let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
        // SAFETY: the pool is alive.
        let buffers =
            unsafe { submission.device.raw.allocate_command_buffers(&info) }.call("vkAllocateCommandBuffers")?;
        submission.command_buffer = buffers[0];
        // SAFETY: the description is empty.
        submission.fence = unsafe { submission.device.raw.create_fence(&vk::FenceCreateInfo::default(), None) }
            .call("vkCreateFence")?;
        Ok(submission)
    }

    /// Where a frame is recorded after [`Submission::begin`].
    pub(crate) fn command_buffer(&self) -> vk::CommandBuffer {
        self.command_buffer
    }

    /// Empties the command buffer and begins it anew.
    pub(crate) fn begin(&mut self) -> Result<(), Error> {
        let device = &self.device.raw;
        // SAFETY: the last submission of the command buffer was waited for, so nothing uses it or the fence.
        unsafe {
            device.reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty()).call("vkResetCommandPool")?;
            device.reset_fences(&[self.fence]).call("vkResetFences")?;
        }
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the command buffer is in its initial state.
        unsafe { device.begin_command_buffer(self.command_buffer, &info) }.call("vkBeginCommandBuffer")
    }

    /// Submits what was recorded and waits for it. Returns the processor time that passed, in nanoseconds.
    ///
    /// After a wait that timed out or could not be made, the device counts as lost and whatever it may still use is left
    /// to it.
    pub(crate) fn submit_and_wait(&mut self, timeout: Duration) -> Result<Option<u64>, Error> {
        let submitted = self.submit_and_wait_alive(timeout);
        match submitted {
            Err(Error::DeviceLost { .. }) => self.wait_for_the_lost(),
            Err(Error::Timeout { .. }) => self.give_up(),
            _ => {}
        }
        submitted
    }

    /// The device may still be at work, and nobody knows when it ends.
    fn give_up(&self) {
        self.device.lost.store(true, Ordering::Relaxed);
        self.device.hung.store(true, Ordering::Relaxed);
    }

    /// A device that is lost still ends what it began, or never looks at it again: this wait has an end, and after it
    /// everything may be destroyed.
    fn wait_for_the_lost(&self) {
        let Some(own) = &self.device.own else { return };
        let _queue = own.queue.lock().unwrap_or_else(PoisonError::into_inner);
        // SAFETY: the lock keeps other threads off the queue. That the device is lost is known.
        let _ = unsafe { self.device.raw.device_wait_idle() };
    }

    fn submit_and_wait_alive(&mut self, timeout: Duration) -> Result<Option<u64>, Error> {
        let device = &self.device.raw;
        let Some(own) = &self.device.own else { return Err(Error::Borrowed) };
        // SAFETY: the frame was recorded into the command buffer.
        unsafe { device.end_command_buffer(self.command_buffer) }.call("vkEndCommandBuffer")?;
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(self.command_buffer)];
        let submits = [vk::SubmitInfo2::default().command_buffer_infos(&buffers)];
        let before = process_cpu_ns();
        {
            let queue = own.queue.lock().unwrap_or_else(PoisonError::into_inner);
            // SAFETY: the lock keeps other threads off the queue; the fence is unsignalled and in no other submission.
            unsafe { device.queue_submit2(*queue, &submits, self.fence) }.call("vkQueueSubmit2")?;
        }
        let timeout_ns = u64::try_from(timeout.as_nanos()).unwrap_or(u64::MAX);
        // SAFETY: the fence was submitted.
        let wait = || unsafe { device.wait_for_fences(&[self.fence], true, timeout_ns) };
        // A wait that fails for want of memory says nothing about the frame: it is made once more.
        let waited = wait().or_else(|result| if is_out_of_memory(result) { wait() } else { Err(result) });
        match waited {
            Err(vk::Result::TIMEOUT) => return Err(Error::Timeout { seconds: timeout.as_secs_f64(), pass: None }),
            waited => waited.call("vkWaitForFences").inspect_err(|error| {
                if !matches!(error, Error::DeviceLost { .. }) {
                    self.give_up();
                }
            })?,
        }
        let after = process_cpu_ns();
        Ok(before.zip(after).map(|(before, after)| after.saturating_sub(before)))
    }
}

impl Drop for Submission {
    fn drop(&mut self) {
        if !self.device.may_destroy() {
            return;
        }
        // SAFETY: every submission was waited for, or the device is lost and does nothing any more.
        unsafe {
            self.device.raw.destroy_fence(self.fence, None);
            self.device.raw.destroy_command_pool(self.pool, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::{Device, DeviceOptions, Error, Executor, Messages, Timing, Validation};
    use ash::vk;
    use mica_graph::{Extent, Format, Graph, Image, ImageDesc, Lifetime};
    use std::cell::Cell;
    use std::sync::Arc;

    unsafe extern "system" fn lost_in_submission(
        _: vk::Queue,
        _: u32,
        _: *const vk::SubmitInfo2<'_>,
        _: vk::Fence,
    ) -> vk::Result {
        vk::Result::ERROR_DEVICE_LOST
    }

    unsafe extern "system" fn lost_in_wait(
        _: vk::Device,
        _: u32,
        _: *const vk::Fence,
        _: vk::Bool32,
        _: u64,
    ) -> vk::Result {
        vk::Result::ERROR_DEVICE_LOST
    }

    fn frame() -> Graph {
        let mut graph = Graph::new();
        let mut words = graph.buffer("words", 64);
        graph.fill(&mut words, 7);
        graph.download(&words);
        graph
    }

    type Tables = (ash::DeviceFnV1_0, ash::DeviceFnV1_3);

    /// A device some of whose functions are others.
    fn changed_device(change: impl FnOnce(&mut Tables)) -> (Arc<Device>, Messages) {
        let mut device =
            Device::new(&DeviceOptions { validation: Validation::Synchronization, ..DeviceOptions::default() })
                .expect("a device");
        let messages = device.messages();
        let raw = &mut Arc::get_mut(&mut device).expect("nobody else has it").raw;
        let mut tables = (raw.fp_v1_0().clone(), raw.fp_v1_3().clone());
        change(&mut tables);
        let (vulkan11, vulkan12) = (raw.fp_v1_1().clone(), raw.fp_v1_2().clone());
        *raw = ash::Device::from_parts_1_3(raw.handle(), tables.0, vulkan11, vulkan12, tables.1);
        (device, messages)
    }

    /// Runs frames on such a device; everything is destroyed in the end.
    fn check_loss(change: impl FnOnce(&mut Tables)) {
        let (device, messages) = changed_device(change);
        let mut executor = Executor::new(device).expect("an executor");
        for _ in 0..2 {
            let error = executor.run(frame(), Timing::Isolated).expect_err("the device is lost");
            assert!(matches!(error, Error::DeviceLost { .. }) && error.exit_code() == 4, "{error:?}");
        }
        drop(executor);
        assert_eq!(messages.take(), [], "everything is destroyed");
    }

    thread_local! {
        static SUBMIT: Cell<Option<vk::PFN_vkQueueSubmit2>> = const { Cell::new(None) };
        static LEFT: Cell<u32> = const { Cell::new(4) };
    }

    unsafe extern "system" fn without_memory_at_first(
        queue: vk::Queue,
        count: u32,
        submits: *const vk::SubmitInfo2<'_>,
        fence: vk::Fence,
    ) -> vk::Result {
        if let Some(left) = LEFT.get().checked_sub(1) {
            LEFT.set(left);
            return vk::Result::ERROR_OUT_OF_HOST_MEMORY;
        }
        match SUBMIT.get() {
            // SAFETY: the arguments are those of the caller.
            Some(submit) => unsafe { submit(queue, count, submits, fence) },
            None => vk::Result::ERROR_UNKNOWN,
        }
    }

    #[test]
    fn f24_frames_that_could_not_be_submitted_leave_no_trace() {
        let image = ImageDesc::new(Format::R32Float, Extent::new(4, 4));
        let mut image = Image::new("image", image, Lifetime::Scene);
        let (device, messages) = changed_device(|tables| {
            SUBMIT.set(Some(tables.1.queue_submit2));
            tables.1.queue_submit2 = without_memory_at_first;
        });
        let mut executor = Executor::new(device).expect("an executor");
        // More often than frames may be in flight.
        for attempt in 0..6 {
            let mut graph = Graph::new();
            graph.clear(&mut image, 0.5);
            let download = graph.download_image(&image);
            match executor.run(graph, Timing::Overlapped) {
                Err(error) => assert!(attempt < 4 && matches!(error, Error::OutOfMemory { .. }), "{error:?}"),
                Ok(mut run) => assert_eq!(run.take(download), 0.5_f32.to_le_bytes().repeat(16)),
            }
        }
        drop(executor);
        assert_eq!(messages.take(), [], "the image was taken to its layout when a frame ran at last");
    }

    #[test]
    fn f25_a_device_lost_in_submission_is_said_and_cleaned_up() {
        check_loss(|tables| tables.1.queue_submit2 = lost_in_submission);
    }

    #[test]
    fn f25_a_device_lost_in_a_wait_is_said_and_cleaned_up() {
        check_loss(|tables| tables.0.wait_for_fences = lost_in_wait);
    }
}
