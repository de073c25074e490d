//! The tables of a roughness, widened from 1 degree to a gamma.

use super::{DpfSource, TABLE_GAMMA_DEG};
use crate::methods::shared::Wanted;
use mica_graph::{Buffer, Extent, Graph, Lifetime};
use mica_shaders::{constants as c, dpf_accumulate};

/// What an accumulated table depends on: alpha, gamma in degrees, the tables it was made from.
pub(in crate::methods) type AccumulatedKey = (f64, f64, DpfSource);

/// Declares the pass that makes P(i, o, gamma). `dpf` holds tables at `alphas`.
pub(in crate::methods) fn accumulated(
    g: &mut Graph,
    wanted: Wanted<AccumulatedKey, Buffer>,
    dpf: (&[f32], &Buffer),
) -> Buffer {
    let (alpha, gamma_deg, _) = wanted.key;
    let change = match wanted.before {
        Some((before, _, _)) if before != alpha => format!("alpha is now {alpha}"),
        Some((_, before, _)) if before != gamma_deg => format!("gamma is now {gamma_deg} degrees"),
        Some(_) => "the directional probability table changed".to_owned(),
        None => format!("first frame with alpha {alpha}, gamma {gamma_deg} degrees"),
    };
    wanted.because(g, change);
    let mut table = wanted.spare.unwrap_or_else(|| table("dpf_accumulated"));
    accumulate(g, dpf, alpha, gamma_deg, &mut table);
    table
}

/// An accumulated table, not filled yet.
pub(super) fn table(name: &str) -> Buffer {
    Buffer::new(name, u64::from(c::DPF_ENTRIES) * 4, Lifetime::Settings)
}

/// Declares the pass that fills an accumulated table from tables at some roughnesses.
pub(super) fn accumulate(
    g: &mut Graph,
    (alphas, dpf): (&[f32], &Buffer),
    alpha: f64,
    gamma_deg: f64,
    accumulated: &mut Buffer,
) {
    let (low, part) = bracket(alphas, alpha as f32);
    let high = (low + 1).min(alphas.len() - 1);
    let [first_offset, last_offset] = accumulation_offsets(gamma_deg);
    let degrees = f64::from(last_offset - first_offset + 1);
    let params = dpf_accumulate::Params {
        low: low as u32 * c::DPF_ENTRIES,
        high: high as u32 * c::DPF_ENTRIES,
        part,
        first_offset,
        last_offset,
        scale: (gamma_deg / degrees).powi(2) as f32,
    };
    let bind = dpf_accumulate::Bind { dpf, accumulated };
    g.pass(bind, params, Extent::line(c::DPF_ENTRIES));
}

/// The table below a roughness, and the weight of the one above; beyond the ends, the end.
fn bracket(alphas: &[f32], alpha: f32) -> (usize, f32) {
    if alphas.len() < 2 {
        return (0, 0.0);
    }
    let low = alphas.iter().rposition(|&tabulated| tabulated <= alpha).unwrap_or(0).min(alphas.len() - 2);
    (low, ((alpha - alphas[low]) / (alphas[low + 1] - alphas[low])).clamp(0.0, 1.0))
}

/// First and last offset, in whole degrees, of the entries that are added up for a cone of this half-angle: as many as it
/// has degrees, at least one, about the middle.
fn accumulation_offsets(gamma_deg: f64) -> [i32; 2] {
    let count = (gamma_deg / TABLE_GAMMA_DEG).round().max(1.0) as i32;
    [-(count / 2), count - 1 - count / 2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roughness_lies_between_the_tables_around_it() {
        let alphas = [0.02, 0.04, 0.1, 0.2];
        assert_eq!(bracket(&alphas, 0.02), (0, 0.0));
        assert_eq!(bracket(&alphas, 0.1), (2, 0.0));
        let (low, part) = bracket(&alphas, 0.15);
        assert_eq!(low, 2);
        assert!((part - 0.5).abs() < 1e-6);
        assert_eq!(bracket(&alphas, 1.0), (2, 1.0));
        assert_eq!(bracket(&alphas, 0.001), (0, 0.0));
        assert_eq!(bracket(&[0.3], 0.3), (0, 0.0));
    }

    #[test]
    fn accumulated_entries_fill_the_cone() {
        for gamma in 1..=30 {
            let [first, last] = accumulation_offsets(f64::from(gamma));
            assert_eq!(last - first + 1, gamma);
            assert!(first <= 0 && last >= 0);
        }
        assert_eq!(accumulation_offsets(0.01), [0, 0]);
    }
}
