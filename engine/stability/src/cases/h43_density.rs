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

/// Counts that a scene or a command line may ask for.
fn settings() -> Result<Check, StabilityError> {
    let beyond = ["1.001e12", "5.2e21", "1e30", "inf", "-1", "NaN"];
    let mut accepted = 0;
    for text in beyond {
        let info = method("deliot_belcour")?;
        accepted += usize::from(info.values().parse(info.name, "count", text).is_ok());
    }
    let unchanged = |text: &&&str| text.parse::<f64>().is_ok_and(|count| f64::from(count as u32) == count);
    let misread = beyond.len() - beyond.iter().filter(unchanged).count();
    Ok(Check {
        what: "numbers of flakes beyond 1e12, below 0 and that are none".to_owned(),
        error_of: "share that is accepted, or taken for another number".to_owned(),
        inputs: beyond.len() as u64,
        naive: Form::new("an unsigned integer of what is asked for", misread as f64 / beyond.len() as f64),
        stable: Form::new("refused by a setting's range", accepted as f64 / beyond.len() as f64),
        tolerance: 0.0,
    })
}
