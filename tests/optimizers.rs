//! placeholder
use motorfit::candidates::Candidates;
use motorfit::criterion::{Criterion, Norm, Scale};
use motorfit::evaluate::*;
use motorfit::experiment::*;
use motorfit::motor::*;
use motorfit::optimize::*;
use std::sync::Arc;
#[test] fn dist() {
    let rec = simulated(&Parameters::M2, &Excitation::step(10.5,1.0,3.0,0.001).unwrap(), Discretization::Zoh).unwrap();
    for (crit, name) in [(Criterion::default(),"std"), (Criterion{norm:Norm::Euclidean, scale:Scale::Peak, ..Criterion::default()},"peak"), (Criterion{norm:Norm::Euclidean, scale:Scale::None, ..Criterion::default()},"none")] {
    let p = Arc::new(Problem::new(std::slice::from_ref(&rec), Model::default(), Space::table2(), crit).unwrap());
    for m in 0..5 {
        let mut runs: Vec<Run> = (0..200).map(|r| { let s = Setup{bounds: p.space().bounds(), population:100, generations:100, seed:1, run:r};
            let o: Box<dyn Optimizer> = match m {0=>Box::new(Gwo::new(s, GwoOptions::default()).unwrap()),1=>Box::new(Jaya::new(s, JayaOptions::default()).unwrap()),2=>Box::new(Jaya::new(s, JayaOptions{sharing:Sharing::Agent, greedy:true}).unwrap()),3=>Box::new(Genetic::new(s,GeneticOptions::default()).unwrap()),_=>Box::new(Random::new(s).unwrap())};
            Run::new(o)}).collect();
        let mut simd = Simd::default();
        minimize(&mut runs, 100, &mut |c: &[Candidates<'_>], costs: &mut [f64]| { let g: Vec<Group<'_>> = c.iter().map(|c| Group{problem:&p, candidates:*c, reference:None}).collect(); simd.evaluate(&Batch{groups:&g}, costs)}, &mut |_| std::ops::ControlFlow::Continue(())).unwrap();
        let mut c: Vec<f64> = runs.iter().map(|r| r.cost()).collect(); c.sort_by(f64::total_cmp);
        println!("{name} {m}: {:.5} {:.5} {:.5} max {:.5}", c[10], c[100], c[190], c[199]);
    }}
}
