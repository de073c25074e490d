//! Every method is held to what it claims, on the stage where each pixel is one more sample of the same random number.
//!
//! A method that is added is tested here without a word about it, for its mean and its distribution. What is particular to one
//! method is tested in the file of its name; that pixels are the oracle's, in the file of the reference, `flakes`.

use mica_accuracy::{Condition, CountErrors, CountLaw, Stage};
use mica_oracle::statistics::{Verdict, sidak};
use mica_render::{Claim, METHODS, MethodInfo};
use mica_tests::Gpu;

/// Of the whole family of a method's tests.
const SIGNIFICANCE: f64 = 1e-6;

fn condition((alpha, gamma_deg): (f64, f64), flakes: f64, angles: [f64; 3]) -> Condition {
    let [theta_i_deg, theta_o_deg, phi_deg] = angles;
    Condition { alpha, gamma_deg, flakes, theta_i_deg, theta_o_deg, phi_deg }
}

/// The values of f(A, i, o) in all pixels; pixels without a finite value of at least 0 fail the test.
fn samples(gpu: &mut Gpu, method: &MethodInfo, condition: &Condition, side: u32, set: &[(&str, &str)]) -> Vec<f64> {
    let mut stage = Stage::new(method.name, condition).expect("a stage");
    for (key, value) in set.iter().chain(&[("blur", "false")]) {
        if method.settings.iter().any(|setting| setting.key == *key) {
            stage.set(key, value).expect("a setting");
        }
    }
    gpu.precompute(stage.renderer());
    let samples = stage.samples(gpu.executor(), condition, side, 1).expect("samples");
    let bad = samples.iter().filter(|f| !f.is_finite() || **f < 0.0).count();
    assert_eq!(bad, 0, "{}: pixels that are no radiance, under {condition:?}", method.name);
    samples
}

/// The mean over many pixels is the truth's, within what each method promises and four standard errors. The cone is
/// narrow beside the lobe, so that the smooth limit and its mean over the cone are one within .5 %. Smallest bias caught: as
/// wide as what is promised, and the noise on both sides of it (2 to 5 % for methods that promise 1 %).
#[test]
fn the_mean_of_every_method_is_what_it_claims() {
    let mut gpu = Gpu::new();
    for method in METHODS {
        for material in [(0.3, 1.0), (0.5, 2.0)] {
            for (flakes, angles) in [(3e3, [30.0, 36.0, 0.0]), (1e5, [10.0, 50.0, 30.0])] {
                let condition = condition(material, flakes, angles);
                let law = CountLaw::of_method(method.name, &condition).expect("a law");
                let samples = samples(&mut gpu, method, &condition, 64, &[]);
                let errors = CountErrors::of(&law, &samples).expect("errors");
                let slack = 4.0 * errors.mean_ratio_error + 5e-3;
                let [least, most] = method.mean_between;
                let kept = |ratio: f64| (least - slack..=most + slack).contains(&ratio);
                println!(
                    "{} alpha {} gamma {} flakes {flakes} {angles:?}: mean {:.4} of {least} to {most}, +-{slack:.4}",
                    method.name, condition.alpha, condition.gamma_deg, errors.mean_ratio
                );
                assert!(kept(errors.mean_ratio), "{}: {errors:?} under {condition:?}", method.name);
                // Brighter by the width of what is promised and of the noise on both sides.
                let biased: Vec<f64> = samples.iter().map(|f| f + (most - least + 2.1 * slack) * law.mean()).collect();
                let biased = CountErrors::of(&law, &biased).expect("errors");
                assert!(!kept(biased.mean_ratio), "{}: a bias must show", method.name);
            }
        }
    }
}

/// Where no error is tolerated, pixels show whole numbers of flakes, distributed as they should be (chi-square with pooling,
/// Sidak over the method's conditions), with the law's variance and share of dark pixels within five standard errors. The
/// law of 6 % more flakes is rejected for every method.
#[test]
fn methods_that_claim_the_distribution_have_it() {
    let mut gpu = Gpu::new();
    let methods = METHODS.iter().filter(|method| matches!(method.claim, Claim::Pixels | Claim::Distribution));
    let mut tested = 0;
    for method in methods {
        let (mut fair, mut biased) = (Vec::new(), Vec::new());
        for (material, flakes, angles) in [
            ((0.1, 6.0), 30.0, [30.0, 36.0, 0.0]),
            ((0.1, 6.0), 300.0, [30.0, 30.0, 10.0]),
            ((0.5, 2.0), 1e3, [30.0, 36.0, 0.0]),
            ((0.5, 2.0), 1e4, [0.0, 20.0, 0.0]),
        ] {
            let condition = condition(material, flakes, angles);
            let law = CountLaw::of_method(method.name, &condition).expect("a law");
            let more =
                CountLaw::of_method(method.name, &Condition { flakes: 1.06 * flakes, ..condition }).expect("a law");
            let samples = samples(&mut gpu, method, &condition, 96, &[("epsilon", "0"), ("steps", "7000")]);
            let errors = CountErrors::of(&law, &samples).expect("errors");
            let none = law.probability_of_none();
            let none_allowed = 5.0 * (none * (1.0 - none) / samples.len() as f64).sqrt() + 1e-3;
            fair.push(law.chi_square(&samples).expect("cells").p_value);
            // The same flakes against a law that expects more of them: their worth stays.
            let in_its_worth: Vec<f64> =
                samples.iter().map(|f| f * law.lit() / law.mean() * more.mean() / more.lit()).collect();
            biased.push(more.chi_square(&in_its_worth).expect("cells").p_value);
            println!(
                "{} {flakes} flakes, {:.3} lit: {errors:?}, p {:.2e}",
                method.name,
                law.lit(),
                fair[fair.len() - 1]
            );
            assert!((errors.variance_ratio - 1.0).abs() < 5.0 * errors.variance_ratio_error + 0.03, "{}", method.name);
            assert!(errors.none_error.abs() < none_allowed, "{}: {errors:?}", method.name);
        }
        let verdict = Verdict::of(&fair, SIGNIFICANCE).expect("p-values");
        assert!(verdict.accepted(), "{}: {fair:?}", method.name);
        assert!(biased.iter().any(|p| *p < sidak(SIGNIFICANCE, biased.len())), "{}: 6 % must show", method.name);
        tested += 1;
    }
    println!("{tested} methods claim a distribution");
}
