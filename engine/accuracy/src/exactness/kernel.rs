//! Rungs run on the device: once for their answers, in turn and many times over for their cost.

use super::{Clock, Effort, ExactnessError, in_turn, spread};
use crate::Estimate;
use mica_gpu::{Executor, Timing};
use mica_graph::{Buffer, Graph, Lifetime};

/// How much a rung is asked: so many rows of so many questions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Amount {
    /// Questions in a row.
    pub questions: u32,
    /// Rows.
    pub rows: u32,
    /// How often each question is answered.
    pub evaluations: u32,
}

impl Amount {
    fn answers(self) -> u64 {
        u64::from(self.questions) * u64::from(self.rows)
    }
}

/// Declares the pass that answers so many questions; it knows where they are.
pub(super) type Declare<'a> = Box<dyn Fn(&mut Graph, &mut Buffer, Amount) + 'a>;

/// One way to compute a quantity.
pub(super) struct Rung<'a> {
    /// In lines and charts.
    pub word: &'static str,
    /// What it computes, and whose it is.
    pub what: &'static str,
    /// Its pass.
    pub declare: Declare<'a>,
}

/// A buffer of questions on the device.
pub(super) fn upload<T: bytemuck::NoUninit>(
    executor: &mut Executor,
    name: &str,
    questions: &[T],
) -> Result<Buffer, ExactnessError> {
    let mut buffer = Buffer::new(name, size_of_val(questions) as u64, Lifetime::Settings);
    let mut g = Graph::new();
    g.upload(&mut buffer, bytemuck::cast_slice::<T, u8>(questions));
    executor.run(g, Timing::Overlapped)?;
    Ok(buffer)
}

/// What a rung answers, each question once, row by row.
pub(super) fn answers(executor: &mut Executor, rung: &Rung, amount: Amount) -> Result<Vec<f64>, ExactnessError> {
    let amount = Amount { evaluations: 1, ..amount };
    let mut g = Graph::new();
    let mut answers = g.buffer("answers", 4 * amount.answers());
    (rung.declare)(&mut g, &mut answers, amount);
    let download = g.download(&answers);
    let bytes = executor.run(g, Timing::Overlapped)?.take(download);
    Ok(bytes.chunks_exact(4).map(|four| f64::from(f32::from_ne_bytes([four[0], four[1], four[2], four[3]]))).collect())
}

/// Most times that a rung's pass is put into a frame.
const MOST_REPEATS: f64 = 64.0;

/// Nanoseconds that one answer of each rung takes beyond reading and writing, which `nothing` does: differences within
/// rounds. Where a pass is over too soon to be timed, a frame has it several times.
pub(super) fn costs(
    executor: &mut Executor,
    effort: &Effort,
    nothing: &Declare,
    rungs: &[Rung],
    amount: Amount,
) -> Result<Vec<Estimate>, ExactnessError> {
    let clock = Clock::of(executor);
    let mut answers = Buffer::new("answers", 4 * amount.answers(), Lifetime::Settings);
    let mut time = |thing: usize, repeats: usize| {
        let declare = thing.checked_sub(1).map_or(nothing, |rung| &rungs[rung].declare);
        let mut g = Graph::new();
        (0..repeats).for_each(|_| declare(&mut g, &mut answers, amount));
        let run = executor.run(g, clock.timing())?;
        clock.ns(&run).ok_or_else(|| ExactnessError::NoClock { device: executor.device().info().name.clone() })
    };
    let things = rungs.len() + 1;
    let once = in_turn(1, things, |thing| time(thing, 1))?;
    let repeats: Vec<usize> =
        once.iter().map(|ns| (effort.round_ns / ns[0].max(1.0)).clamp(1.0, MOST_REPEATS) as usize).collect();
    let of_answers = amount.answers() as f64 * f64::from(amount.evaluations);
    let times = in_turn(effort.rounds, things, |thing| {
        Ok::<_, ExactnessError>(time(thing, repeats[thing])? / (of_answers * repeats[thing] as f64))
    })?;
    let of_rung = |of_rung: &Vec<f64>| {
        let beyond: Vec<f64> = of_rung.iter().zip(&times[0]).map(|(with, without)| with - without).collect();
        spread(&beyond)
    };
    Ok(times[1..].iter().map(of_rung).collect())
}
