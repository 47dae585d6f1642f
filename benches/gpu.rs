//! Measures GPU evaluation on the best adapter against SIMD in the same run: end-to-end rates, the latency of the smallest
//! batch, and many small runs against a large one. Results of a software adapter do not transfer to a GPU.
#![allow(missing_docs, reason = "a bench has no public interface")]
#![allow(clippy::print_stdout, clippy::unwrap_used, reason = "a bench prints and may stop")]

mod support;

#[cfg(feature = "gpu")]
fn main() {
    use motorfit::candidates::Candidates;
    use motorfit::evaluate::gpu::{Gpu, Precision, Selector};
    use motorfit::evaluate::{Batch, Evaluator as _, Group, Simd};
    use support::{candidates, evaluate, m2_problem, median, ratio, seconds};

    extensions();
    let problem = m2_problem();
    let tiny = support::problem_of(0.006);
    let (small, large) = (candidates(1), candidates(25_600));
    for precision in [Precision::F64, Precision::F32] {
        let mut gpu = match Gpu::open(&Selector::Best, Some(precision)) {
            Ok(gpu) => gpu,
            Err(error) => {
                println!("{}: {error}", precision.name());
                continue;
            }
        };
        println!("{} ({}), {}", gpu.facts().name, gpu.facts().driver, precision.name());
        let mut costs = vec![0.0; 25_600];
        let mut simd_costs = costs.clone();
        let simd = || evaluate(&mut Simd::default(), &problem, &large, &mut simd_costs);
        let against = ratio(9, || evaluate(&mut gpu, &problem, &large, &mut costs), simd);
        let time = median((0..9).map(|_| seconds(|| evaluate(&mut gpu, &problem, &large, &mut costs))).collect());
        let rate = (25_600 * problem.active()) as f64 / time / 1e9;
        println!("  25,600 candidates: {rate:.2} G candidate-steps/s, {against:.2} of SIMD f64 on the same cores");

        let trip = median((0..5000).map(|_| seconds(|| evaluate(&mut gpu, &tiny, &small, &mut costs[..1]))).collect());
        println!("  one candidate on six samples, round trip: {:.0} µs", 1e6 * trip);

        let problems: Vec<_> = (0..256).map(|_| m2_problem()).collect();
        let groups: Vec<Group<'_>> = problems
            .iter()
            .zip(large.chunks(500))
            .map(|(problem, values)| Group { problem, candidates: Candidates::new(values, 5), reference: None })
            .collect();
        let mut many = || gpu.evaluate(&Batch { groups: &groups }, &mut costs).unwrap();
        let apart = median((0..9).map(|_| seconds(&mut many)).collect());
        println!("  256 runs of 100 on 256 recordings: {:.2} of the rate of one run of 25,600", time / apart);
        // The same samples as one run, too many for a uniform buffer: the difference is the overhead of groups.
        let records: Vec<_> = (0..256).map(|_| support::m2_record()).collect();
        let joint = support::problem_with(&records);
        let joint =
            median((0..9).map(|_| seconds(|| evaluate(&mut gpu, &joint, &large[..500], &mut costs[..100]))).collect());
        println!("    and {:.2} of that of one run of 100 on all 256 recordings jointly", joint / apart);
    }
}

/// Measures motors with extensions, alternating the adapter and SIMD. f32 is without deviations, because motors with
/// extensions are evaluated so.
#[cfg(feature = "gpu")]
fn extensions() {
    use motorfit::evaluate::gpu::{Gpu, Precision, Selector};

    let mut evaluators = vec![support::simd()];
    for precision in [Precision::F64, Precision::F32Plain] {
        if let Ok(gpu) = Gpu::open(&Selector::Best, Some(precision)) {
            evaluators.push((format!("{} {}", gpu.facts().name, precision.name()), Box::new(gpu)));
        }
    }
    support::extensions(&mut evaluators, &support::m2_record(), 8);
}

#[cfg(not(feature = "gpu"))]
fn main() {}
