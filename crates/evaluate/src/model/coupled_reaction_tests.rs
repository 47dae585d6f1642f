//! Friction that sticks and acts by factors of states and inputs: two links with dry friction in both joints against a simulation of momenta
//! that is written here, and closed forms.

#![allow(clippy::unwrap_used, reason = "a test may stop")]

use super::differences::{Derivative, derivatives};
use super::reaction_tests::{METHODS, simulated};
use super::{ModelProblem, ModelRecording, ModelSettings, ModelSpace};
use motorfit_core::numeric::{count, rms};
use motorfit_model::{Model, reference};

/// Two links in a vertical plane, with angles from the horizontal and between the links.
const ARM: &str = include_str!("../../../../examples/two-links.toml");

/// Inertias A1, A2, A3 \[kg·m²\], torques of gravity G1, G2, viscous friction B1, B2, dry friction C1, C2.
const VALUES: [f64; 9] = [0.09, 0.03, 0.035, 0.5, 0.2, 0.02, 0.01, 0.25, 0.12];
const SAMPLES: usize = 300;
const STEP_S: f64 = 5e-3;

/// Torques that move both joints, hold them and turn them around.
fn torques() -> [Vec<f64>; 2] {
    let of = |f: &dyn Fn(f64) -> f64| (0..SAMPLES).map(|n| f(count(n) * STEP_S)).collect();
    [of(&|t| 0.45 + 0.7 * (9.0 * t).sin() + 0.3 * (31.0 * t).cos()), of(&|t| 0.1 + 0.35 * (13.0 * t).cos())]
}

/// Returns the angles of the arm at the samples from time stepping of its velocities with impulses of friction at the end of each step, of
/// first order (J. J. Moreau 1988).
fn stepped([u1, u2]: &[Vec<f64>; 2], substeps: usize) -> [Vec<f64>; 2] {
    let [a1, a2, a3, g1, g2, b1, b2, c1, c2] = VALUES;
    let h = STEP_S / count(substeps);
    let (mut q, mut w): ([f64; 2], [f64; 2]) = ([0.3, -0.6], [0.0; 2]);
    let mut seen = [Vec::new(), Vec::new()];
    for n in 0..SAMPLES {
        seen[0].push(q[0]);
        seen[1].push(q[1]);
        for _ in 0..substeps {
            let (c, s) = (q[1].cos(), a3 * q[1].sin());
            let (m11, m12, m22) = (a1 + 2.0 * a3 * c, a2 + a3 * c, a2);
            let lower = g2 * (q[0] + q[1]).cos();
            let t1 = u1[n] + s * w[1] * (2.0 * w[0] + w[1]) - g1 * q[0].cos() - lower - b1 * w[0];
            let t2 = u2[n] - s * w[0] * w[0] - lower - b2 * w[1];
            let det = m11 * m22 - m12 * m12;
            let [i11, i12, i22] = [m22 / det, -m12 / det, m11 / det];
            let free = [w[0] + h * (i11 * t1 + i12 * t2), w[1] + h * (i12 * t1 + i22 * t2)];
            let mut p: [f64; 2] = [0.0; 2];
            for _ in 0..40 {
                p[0] = ((free[0] - i12 * p[1]) / i11).clamp(-h * c1, h * c1);
                p[1] = ((free[1] - i12 * p[0]) / i22).clamp(-h * c2, h * c2);
            }
            w = [free[0] - i11 * p[0] - i12 * p[1], free[1] - i12 * p[0] - i22 * p[1]];
            q = [q[0] + h * w[0], q[1] + h * w[1]];
        }
    }
    seen
}

#[test]
fn two_links_with_dry_friction_are_of_second_order() {
    let model = Model::parse(ARM).unwrap();
    let inputs = torques();
    // Richardson's extrapolation of the method of first order.
    let [fine, coarse] = [2000, 1000].map(|substeps| stepped(&inputs, substeps));
    let joint =
        |joint: usize| -> Vec<f64> { fine[joint].iter().zip(&coarse[joint]).map(|(a, b)| 2.0 * a - b).collect() };
    let expected = [joint(0), joint(1)];
    let difference = |found: &[Vec<f64>]| {
        let of = |n: usize| found[n].iter().zip(&expected[n]).map(|(a, b)| a - b).collect::<Vec<f64>>();
        rms(&[of(0), of(1)].concat())
    };
    for method in METHODS {
        let error = |substeps: usize| difference(&simulated(&model, &VALUES, (&inputs, STEP_S), (method, substeps)));
        let errors = [1, 2, 4, 8].map(error);
        // 64 is the third power of the factor 4 of the second order; some steps have two zeros, which are of first order.
        assert!(errors[0] < 5e-4 && errors[3] < errors[0] / 40.0, "{method:?}: {errors:?}");
    }
    // The oracle is of first order, and solves the same problem by sweeps: a hundredth of the step leaves that share of the friction's work.
    let own = reference::simulate(&model, &VALUES, &[], &inputs, STEP_S, 100);
    assert!(difference(&own) < 1e-4, "{}", difference(&own));
}

#[test]
fn derivatives_of_coupled_friction_are_those_of_differences() {
    let model = Model::parse(ARM).unwrap();
    let inputs = torques().to_vec();
    let time_s: Vec<f64> = (0..SAMPLES).map(|n| count(n) * STEP_S).collect();
    let recording = ModelRecording::to_simulate(&model, time_s, inputs).unwrap();
    for method in METHODS {
        let settings = ModelSettings { method: Some((method, 2)), ..ModelSettings::default() };
        let problem = ModelProblem::new(&model, ModelSpace::new(&model, 1), vec![recording.clone()], settings).unwrap();
        for Derivative { parameter, output, own, difference } in derivatives(&problem, &VALUES) {
            let error: Vec<f64> = own.iter().zip(&difference).map(|(a, b)| a - b).collect();
            let part = rms(&error) / rms(&difference);
            // Rounding over the step of the difference; the moments at which a joint comes to rest are differentiated too.
            assert!(part < 1e-5, "{method:?} {parameter} {output}: {part:e}");
        }
    }
}
