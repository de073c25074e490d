//! Plans, made real: memory, pipelines, commands, and on a device of our own the submission.

use crate::borrow::{HostBuffer, HostImage};
use crate::device::Device;
use crate::error::Error;
use crate::pipeline::{Pipelines, PipelinesMade};
use crate::prepare::{Command, MARKER_BYTES, prepare};
use crate::record::{Recording, timestamp_count};
use crate::resources::{Brought, MemoryRow, Resources};
use crate::run::{Recorded, Run};
use crate::slot::{Slot, Staging};
use crate::submit::Submission;
use crate::timing::{PassTime, Timing, believed_ns, elapsed_ns};
use ash::vk;
use mica_graph::{Buffer, Description, Download, Graph, Image, Lifetime, Plan, Requirements, ResourceId, Work};
use std::cell::RefCell;
use std::collections::HashMap;
use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How an executor behaves.
#[derive(Clone, Debug)]
pub struct ExecutorOptions {
    /// Most bytes of device memory to take. Memory is taken in blocks of 4 MiB and more, which count whole, so limits
    /// below 16 MiB are of little use. A block beyond the limit is given back at once.
    pub memory_limit_bytes: Option<u64>,
    /// Where compiled pipelines are kept between processes.
    pub pipeline_cache: Option<PathBuf>,
    /// How long [`Executor::run`] waits for a frame before it gives the device up.
    pub timeout: Duration,
    /// Most frames that a host has recorded and not finished. Each has its own staging memory and descriptors.
    pub frames_in_flight: usize,
}

impl Default for ExecutorOptions {
    fn default() -> Self {
        Self { memory_limit_bytes: None, pipeline_cache: None, timeout: Duration::from_secs(60), frames_in_flight: 3 }
    }
}

/// Executes frames on one device, and keeps what outlives them.
///
/// Several executors may share a device; each has its own copy of every resource.
pub struct Executor {
    // Dropped from top to bottom, after `drop` below: the device last.
    submission: Option<Submission>,
    pipelines: Pipelines,
    slots: Vec<Slot>,
    pub(crate) resources: Resources,
    options: ExecutorOptions,
    next_frame: u64,
    device: Arc<Device>,
}

impl Executor {
    /// An executor with the default options.
    ///
    /// # Errors
    /// If the device has no memory left for its few objects.
    pub fn new(device: Arc<Device>) -> Result<Self, Error> {
        Self::with_options(device, ExecutorOptions::default())
    }

    /// An executor with options of its own.
    ///
    /// # Errors
    /// If the device has no memory left for its few objects.
    pub fn with_options(device: Arc<Device>, options: ExecutorOptions) -> Result<Self, Error> {
        device.check_alive()?;
        let pipelines = Pipelines::new(device.clone(), options.pipeline_cache.clone())?;
        let resources = Resources::new(device.clone(), options.memory_limit_bytes)?;
        let submission = if device.is_borrowed() { None } else { Some(Submission::new(device.clone())?) };
        Ok(Self { submission, pipelines, slots: Vec::new(), resources, options, next_frame: 1, device })
    }

    /// The device.
    pub fn device(&self) -> &Arc<Device> {
        &self.device
    }

    /// Plans a frame for this device, and executes nothing.
    ///
    /// # Errors
    /// If the graph is not well formed, or has a resource that this device cannot hold.
    pub fn plan(&self, graph: Graph) -> Result<Plan, Error> {
        let first_error = RefCell::new(None);
        let plan = Plan::new(graph, &|resource, accesses| match self.resources.requirements(resource, accesses) {
            Ok(needed) => Requirements { bytes: needed.size, alignment: needed.alignment },
            Err(error) => {
                first_error.borrow_mut().get_or_insert(error);
                Requirements { bytes: resource.bytes(), alignment: 1 }
            }
        });
        match first_error.into_inner() {
            Some(error) => Err(error),
            None => Ok(plan?),
        }
    }

    /// Executes a frame on a device of our own and waits for it.
    ///
    /// # Errors
    /// If the frame cannot be planned or recorded, memory runs out, or the device is lost or does not answer in time.
    /// [`Error::Borrowed`] on a borrowed device.
    pub fn run(&mut self, graph: Graph, timing: Timing) -> Result<Run, Error> {
        self.run_alive(graph, timing).inspect_err(|error| self.device.note_loss(error))
    }

    fn run_alive(&mut self, graph: Graph, timing: Timing) -> Result<Run, Error> {
        let Some(to) = self.submission.as_ref().map(Submission::command_buffer) else { return Err(Error::Borrowed) };
        self.device.check_alive()?;
        let plan = self.plan(graph)?;
        self.begin()?;
        // SAFETY: the command buffer was just begun, and is waited for below before anything it uses goes.
        let recorded = unsafe { self.record_plan(plan, to, timing) }?;
        let submitted = match &mut self.submission {
            Some(submission) => submission.submit_and_wait(self.options.timeout),
            None => Err(Error::Borrowed),
        };
        match submitted {
            Ok(cpu_ns) => {
                // SAFETY: the device has finished the frame.
                let mut run = unsafe { self.finish(recorded) }?;
                run.cpu_ns = cpu_ns;
                Ok(run)
            }
            Err(error) => {
                let error = self.name_pass(error, &recorded);
                self.abandon(recorded);
                Err(error)
            }
        }
    }

    /// Records a frame into a command buffer of the host. It is put after all commands before it, and what follows it
    /// may use the host's resources as they were to be left.
    ///
    /// On an error nothing was recorded.
    ///
    /// # Errors
    /// As for [`Executor::run`], and [`Error::FramesInFlight`] if too many frames are recorded and not finished.
    ///
    /// # Safety
    /// - `command_buffer` is in the recording state, outside of any rendering, of the device's queue family, and no
    ///   other thread uses it. Its bound pipelines, descriptor sets, push constants and viewport are lost.
    /// - It is submitted once; frames are submitted in the order in which they were recorded, to one queue.
    /// - The host's resources in the graph were bound with handles that are still good.
    /// - The executor is not dropped before the device has finished the command buffer.
    pub unsafe fn record(
        &mut self,
        graph: Graph,
        command_buffer: vk::CommandBuffer,
        timing: Timing,
    ) -> Result<Recorded, Error> {
        self.device.check_alive()?;
        let plan = self.plan(graph)?;
        // SAFETY: as the caller promises.
        unsafe { self.record_plan(plan, command_buffer, timing) }.inspect_err(|error| self.device.note_loss(error))
    }

    /// Takes the results of a recorded frame, and its memory back.
    ///
    /// # Errors
    /// If the device was lost.
    ///
    /// # Safety
    /// `recorded` is of this executor, and the device has finished its command buffer: the host waited for the fence or
    /// semaphore of its submission.
    pub unsafe fn finish(&mut self, recorded: Recorded) -> Result<Run, Error> {
        let Recorded { slot: index, plan, timing, recorded_at, downloads } = recorded;
        let around = recorded_at.elapsed();
        let slot = &mut self.slots[index];
        slot.frame = None;
        let memory = slot.staging.as_ref().and_then(|staging| staging.allocation.mapped_slice()).unwrap_or_default();
        let downloads = downloads.into_iter().map(|(download, place)| (download, memory[place].to_vec())).collect();
        let passes = plan.passes.len();
        let measured = self.note_compacted(index, &plan).and_then(|()| self.times(index, timing, passes, around));
        let (pass_ns, frame_ns) = measured.inspect_err(|error| self.device.note_loss(error))?;
        let passes =
            plan.passes.iter().zip(pass_ns).map(|(pass, ns)| PassTime { name: pass.name.clone(), ns }).collect();
        self.collect();
        Ok(Run { plan, passes, frame_ns, cpu_ns: None, downloads })
    }

    /// Lends an image of the host for a handle of [`Lifetime::Host`], until another is lent or the handle is dropped.
    ///
    /// # Safety
    /// The image is as [`HostImage`] says, and stays good for every frame recorded with it.
    pub unsafe fn bind_host_image(&mut self, image: &Image, host: HostImage) {
        self.resources.bind_host(image.resource(), Brought::Image(host, image.desc()));
    }

    /// Lends a buffer of the host for a handle of [`Lifetime::Host`], until another is lent or the handle is dropped.
    ///
    /// # Safety
    /// The buffer is as [`HostBuffer`] says, and stays good for every frame recorded with it.
    pub unsafe fn bind_host_buffer(&mut self, buffer: &Buffer, host: HostBuffer) {
        self.resources.bind_host(buffer.resource(), Brought::Buffer(host, buffer.bytes()));
    }

    /// What takes how many bytes of device memory.
    pub fn memory(&self) -> Vec<MemoryRow> {
        let mut rows = self.resources.rows();
        let staging = self.slots.iter().filter_map(|slot| slot.staging.as_ref());
        let bytes = staging.map(|staging| staging.allocation.size()).sum();
        if bytes > 0 {
            rows.push(MemoryRow { name: "staging".to_owned(), bytes, lifetime: Lifetime::Frame });
        }
        rows
    }

    /// The pipelines made so far. They are made as frames first call for them, and kept.
    pub fn pipelines(&self) -> PipelinesMade {
        self.pipelines.made()
    }

    /// Frees resources whose handles are all dropped and that no unfinished frame uses. Every frame begins and ends
    /// with this.
    pub fn collect(&mut self) {
        self.resources.collect(self.oldest_unfinished());
    }

    /// Writes the pipeline cache to its file if anything changed. Dropping the executor does it too.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn flush_pipeline_cache(&mut self) -> std::io::Result<()> {
        self.pipelines.cache.flush(&self.device)
    }

    /// Frees the slot of a frame that was recorded and did not come to run, or whose device is lost.
    fn abandon(&mut self, recorded: Recorded) {
        if let Some(frame) = self.slots[recorded.slot].frame.take() {
            self.resources.give_back_undefined(frame);
        }
    }

    fn begin(&mut self) -> Result<(), Error> {
        self.submission.as_mut().map_or(Err(Error::Borrowed), Submission::begin)
    }

    /// # Safety
    /// As for [`Executor::record`].
    unsafe fn record_plan(&mut self, plan: Plan, to: vk::CommandBuffer, timing: Timing) -> Result<Recorded, Error> {
        let recorded_at = Instant::now();
        let index = self.free_slot()?;
        let frame = self.next_frame;
        let objects = self.resources.resolve(&plan, frame, self.oldest_unfinished())?;
        let (device, slot) = (&self.device, &mut self.slots[index]);
        let pool = slot.ready_descriptors(device, &plan)?;
        let was_built = |id| self.resources.is_built(id);
        let prepared = prepare(device, &mut self.pipelines, pool, &plan, &objects, &was_built)?;
        slot.ready_staging(&mut self.resources.memory, device, prepared.staging_bytes as u64)?;
        let count = timestamp_count(timing, plan.passes.len());
        let measures = device.info.limits.timestamp_valid_bits > 0;
        if measures {
            slot.ready_timestamps(device, count)?;
        }
        slot.ready_sizes(device, prepared.size_queries)?;
        let downloads = fill_staging(slot, &prepared.commands);
        let undefined = self.resources.take_undefined(&plan, frame);
        let hosts = self.resources.hosts_of(&plan);
        let recording = Recording {
            device,
            to,
            plan: &plan,
            commands: &prepared.commands,
            objects: &objects,
            staging: slot.staging.as_ref().map_or(vk::Buffer::null(), |staging| staging.buffer.buffer),
            timestamps: slot.timestamps.as_ref().filter(|_| measures).map(|timestamps| (timestamps.pool, count)),
            sizes: slot.sizes.as_ref().map(|sizes| (sizes.pool, prepared.size_queries)),
            timing,
            undefined: &undefined,
            hosts: &hosts,
        };
        // SAFETY: as the caller promises; the slot and the resources are kept until the frame is finished.
        unsafe { recording.record() };
        slot.frame = Some(frame);
        self.next_frame += 1;
        self.resources.note_builds(&plan);
        Ok(Recorded { slot: index, plan, timing, recorded_at, downloads })
    }

    fn free_slot(&mut self) -> Result<usize, Error> {
        if let Some(index) = self.slots.iter().position(|slot| slot.frame.is_none()) {
            return Ok(index);
        }
        let most = self.options.frames_in_flight.max(1);
        if self.slots.len() >= most {
            return Err(Error::FramesInFlight(most));
        }
        self.slots.push(Slot::default());
        Ok(self.slots.len() - 1)
    }

    fn oldest_unfinished(&self) -> u64 {
        self.slots.iter().filter_map(|slot| slot.frame).min().unwrap_or(u64::MAX)
    }

    /// The times of each pass, and of the whole frame, which was under way within `around`.
    fn times(
        &self,
        slot: usize,
        timing: Timing,
        passes: usize,
        around: Duration,
    ) -> Result<(Vec<Option<u64>>, Option<u64>), Error> {
        let limits = &self.device.info.limits;
        let count = timestamp_count(timing, passes);
        let Some(timestamps) = self.slots[slot].timestamps.as_ref().filter(|_| limits.timestamp_valid_bits > 0) else {
            return Ok((vec![None; passes], None));
        };
        let ticks = timestamps.read(&self.device, count)?;
        let between = |pair: &[Option<u64>]| match pair {
            [Some(from), Some(to)] => {
                let ns = elapsed_ns(*from, *to, limits.timestamp_valid_bits, limits.timestamp_period_ns);
                believed_ns(ns, around)
            }
            _ => None,
        };
        Ok(match timing {
            Timing::Isolated => (ticks.chunks(2).map(between).collect(), None),
            Timing::Overlapped => (vec![None; passes], between(&ticks)),
        })
    }

    /// Keeps what the structures that a finished frame built need once they are compacted.
    fn note_compacted(&mut self, slot: usize, plan: &Plan) -> Result<(), Error> {
        let builds = plan.passes.iter().filter(|pass| matches!(pass.work, Work::BuildMeshes { .. }));
        let structures: Vec<ResourceId> = builds
            .flat_map(|pass| &pass.uses)
            .filter(|used| matches!(used.resource.description, Description::Structure(_)))
            .map(|used| used.resource.id)
            .collect();
        if let Some(sizes) = self.slots[slot].sizes.as_ref() {
            let sizes = sizes.read(&self.device, structures.len() as u32)?;
            structures.into_iter().zip(sizes).for_each(|(id, bytes)| self.resources.note_compacted(id, bytes));
        }
        Ok(())
    }

    /// Adds to an error the pass that did not finish, which isolated timing knows.
    fn name_pass(&self, error: Error, recorded: &Recorded) -> Error {
        let begun = self.slots[recorded.slot].staging.as_ref().map_or(0, Staging::marker) as usize;
        let pass = begun.checked_sub(1).and_then(|index| Some(recorded.plan.passes.get(index)?.name.clone()));
        match error {
            Error::DeviceLost { .. } => Error::DeviceLost { pass },
            Error::Timeout { seconds, .. } => Error::Timeout { seconds, pass },
            other => other,
        }
    }
}

impl std::fmt::Debug for Executor {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Executor").field("device", &self.device).field("options", &self.options).finish_non_exhaustive()
    }
}

impl Drop for Executor {
    fn drop(&mut self) {
        if self.device.may_destroy() {
            for slot in &mut self.slots {
                slot.destroy(&mut self.resources.memory, &self.device);
            }
        }
    }
}

/// Copies the uploads of a frame into staging memory, and says where its downloads will lie there.
fn fill_staging(slot: &mut Slot, commands: &[Command<'_>]) -> HashMap<Download, Range<usize>> {
    let mut places = HashMap::new();
    let memory = slot.staging.as_mut().and_then(|staging| staging.allocation.mapped_slice_mut()).unwrap_or_default();
    memory[..MARKER_BYTES].fill(0);
    for command in commands {
        match command {
            Command::Upload { bytes, data, .. } | Command::Update { bytes, data, .. } => {
                memory[bytes.clone()].copy_from_slice(data)
            }
            Command::BuildInstances { bytes, records, .. } => memory[bytes.clone()].copy_from_slice(records),
            Command::Download { bytes, download, .. } => drop(places.insert(*download, bytes.clone())),
            _ => {}
        }
    }
    places
}
