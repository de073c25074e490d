//! H43. Logarithms of densities, up to e^50.

use crate::{Check, Form, Laboratory, Random, StabilityError, arithmetic, worst_ratio};
use mica_render::method;
use mica_shaders::types::Operands;

/// Measures it.
pub fn measure(laboratory: &mut Laboratory) -> Result<Vec<Check>, StabilityError> {
    Ok(vec![cells(laboratory)?, settings()?])
}

/// Flakes in cells of one square and less.
fn cells(laboratory: &mut Laboratory) -> Result<Check, StabilityError> {
    let mut random = Random::new(43);
    let operands: Vec<Operands> = (0..laboratory.inputs(100_000, 10_000_000))
        .map(|_| {
            let density = random.between(10.0, 50.0);
            let area = random.log_between((1.0 - density).max(-20.0).exp(), 1.0);
            Operands { a: [density as f32, area as f32, 0.0, 0.0], b: [0.0; 4], c: [0.0; 4] }
        })
        .collect();
    let truth: Vec<f64> = operands.iter().map(|of| f64::from(of.a[0]).exp() * f64::from(of.a[1])).collect();
    let naive = laboratory.floats(&operands, arithmetic!(flakes_of_density_unsigned))?;
    let stable = laboratory.floats(&operands, arithmetic!(flakes_of_density))?;
    Ok(Check {
        what: "flakes in a cell, of densities e^10 to e^50".to_owned(),
        error_of: "|flakes / flakes in f64 - 1|".to_owned(),
        inputs: operands.len() as u64,
        naive: Form::new("uint(area exp(log density))", worst_ratio(&naive, &truth)),
        stable: Form::new("area exp(log density) as a float below 1e30", worst_ratio(&stable, &truth)),
        // Vulkan promises exp(x) within 3 + 2 |x| places.
        tolerance: 1.25e-5,
    })
}

/// Counts that a scene or a command line may ask for. Beyond 1e12 flakes the counts of a quadtree's leaves and the deviations of
/// their halves are no longer what they are said to be.
fn settings() -> Result<Check, StabilityError> {
    let beyond = ["1.001e12", "5.2e21", "1e30", "inf", "-1", "NaN"];
    let info = method("deliot_belcour")?;
    let taken = |text: &&&str| info.values().parse(info.name, "count", text).is_ok();
    let positive = |text: &&&str| text.parse::<f64>().is_ok_and(|count| count.is_finite() && count > 0.0);
    let share = |accepted: usize| accepted as f64 / beyond.len() as f64;
    Ok(Check {
        what: "numbers of flakes beyond 1e12, below 0 and that are none".to_owned(),
        error_of: "share that is accepted".to_owned(),
        inputs: beyond.len() as u64,
        naive: Form::new("what is finite and above 0", share(beyond.iter().filter(positive).count())),
        stable: Form::new("what is in the range of a setting", share(beyond.iter().filter(taken).count())),
        tolerance: 0.0,
    })
}
