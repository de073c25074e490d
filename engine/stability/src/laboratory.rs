//! A device on which formulas are asked.

use crate::StabilityError;
use crate::flushed::flushed;
use mica_gpu::{Executor, Timing};
use mica_graph::{Buffer, Download, Graph};
use mica_shaders::types::{Operands, Words};

/// How many inputs are tried.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effort {
    /// As many as a test has time for: a second or so for each case.
    Quick,
    /// As many as say something new: of functions of one number, all of them.
    Full,
}

/// A device, and how much is asked of it.
pub struct Laboratory<'a> {
    /// Runs what is declared.
    pub executor: &'a mut Executor,
    /// How many inputs are tried.
    pub effort: Effort,
}

impl Laboratory<'_> {
    /// So many inputs in a test, so many on demand.
    pub fn inputs(&self, quick: usize, full: usize) -> usize {
        if self.effort == Effort::Quick { quick } else { full }
    }

    /// What a formula of `rungs/arithmetic` makes of each operand; `declare` adds its pass, which reads the operands and
    /// writes a float for each:
    ///
    /// ```ignore
    /// laboratory.floats(&operands, |g, operand_list, answers, count| {
    ///     let bind = exact_arithmetic::angle_acos::Bind { operand_list, answers };
    ///     g.pass(bind, exact_arithmetic::angle_acos::Params { count, evaluations: 1 }, Extent::new(count, 1));
    /// })
    /// ```
    ///
    /// # Errors
    /// Those of the device.
    pub fn floats(
        &mut self,
        operands: &[Operands],
        declare: impl FnOnce(&mut Graph, &Buffer, &mut Buffer, u32),
    ) -> Result<Vec<f32>, StabilityError> {
        self.answers(operands, declare)
    }

    /// As [`Laboratory::floats`] on a device that makes 0 of every float below a threshold.
    ///
    /// # Errors
    /// Those of the device.
    pub fn flushed_floats(
        &mut self,
        operands: &[Operands],
        below: f32,
        declare: impl FnOnce(&mut Graph, &Buffer, &mut Buffer, u32),
    ) -> Result<Vec<f32>, StabilityError> {
        let (graph, download) = asking::<Operands, f32>(operands, declare);
        let bytes = self.executor.run(flushed(&graph, below), Timing::Overlapped)?.take(download);
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    /// What a formula of `rungs/bits` makes of each pair of words, likewise: four words for each.
    ///
    /// # Errors
    /// Those of the device.
    pub fn words(
        &mut self,
        words: &[Words],
        declare: impl FnOnce(&mut Graph, &Buffer, &mut Buffer, u32),
    ) -> Result<Vec<[u32; 4]>, StabilityError> {
        self.answers(words, declare)
    }

    /// What a pass adds up of so many questions in so many words, which are 0 before it.
    ///
    /// # Errors
    /// Those of the device.
    pub fn totals<Q: bytemuck::NoUninit>(
        &mut self,
        questions: &[Q],
        words: usize,
        declare: impl FnOnce(&mut Graph, &Buffer, &mut Buffer, u32),
    ) -> Result<Vec<u32>, StabilityError> {
        let mut graph = Graph::new();
        let mut asked = graph.buffer("questions", size_of_val(questions) as u64);
        graph.upload(&mut asked, bytemuck::cast_slice::<Q, u8>(questions));
        let mut totals = graph.buffer("totals", (size_of::<u32>() * words) as u64);
        graph.fill(&mut totals, 0);
        declare(&mut graph, &asked, &mut totals, questions.len() as u32);
        let download = graph.download(&totals);
        let bytes = self.executor.run(graph, Timing::Overlapped)?.take(download);
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }

    fn answers<Q: bytemuck::NoUninit, A: bytemuck::Pod>(
        &mut self,
        questions: &[Q],
        declare: impl FnOnce(&mut Graph, &Buffer, &mut Buffer, u32),
    ) -> Result<Vec<A>, StabilityError> {
        let (graph, download) = asking::<Q, A>(questions, declare);
        let bytes = self.executor.run(graph, Timing::Overlapped)?.take(download);
        Ok(bytemuck::pod_collect_to_vec(&bytes))
    }
}

/// A frame that asks a list of questions, and what its answers are asked for by.
fn asking<Q: bytemuck::NoUninit, A>(
    questions: &[Q],
    declare: impl FnOnce(&mut Graph, &Buffer, &mut Buffer, u32),
) -> (Graph, Download) {
    let mut graph = Graph::new();
    let mut asked = graph.buffer("questions", size_of_val(questions) as u64);
    graph.upload(&mut asked, bytemuck::cast_slice::<Q, u8>(questions));
    let mut answers = graph.buffer("answers", (size_of::<A>() * questions.len()) as u64);
    declare(&mut graph, &asked, &mut answers, questions.len() as u32);
    let download = graph.download(&answers);
    (graph, download)
}

/// The pass of a formula in `rungs/arithmetic`, for [`Laboratory::floats`].
#[macro_export]
macro_rules! arithmetic {
    ($module:ident) => {
        |graph: &mut mica_graph::Graph,
         operand_list: &mica_graph::Buffer,
         answers: &mut mica_graph::Buffer,
         count: u32| {
            let bind = mica_shaders::exact_arithmetic::$module::Bind { operand_list, answers };
            let params = mica_shaders::exact_arithmetic::$module::Params { count, evaluations: 1 };
            graph.pass(bind, params, mica_graph::Extent::new(count, 1));
        }
    };
}

/// The pass of a formula in `rungs/bits`, for [`Laboratory::words`].
#[macro_export]
macro_rules! bits {
    ($module:ident) => {
        |graph: &mut mica_graph::Graph, word_list: &mica_graph::Buffer, answers: &mut mica_graph::Buffer, count: u32| {
            let bind = mica_shaders::exact_bits::$module::Bind { word_list, answers };
            graph.pass(bind, mica_shaders::exact_bits::$module::Params { count }, mica_graph::Extent::new(count, 1));
        }
    };
}
