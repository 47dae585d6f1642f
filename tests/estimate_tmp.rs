mod support;
use motorfit::estimate::*;
use motorfit::experiment::*;
use motorfit::motor::*;
use motorfit::criterion::Noise;
#[test]
fn t() {
    let rec = support::m2_record();
    let t0=Parameters::M2.to_array();
    let e = steiglitz_mcbride(&rec,&SmOptions::default()).unwrap();
    let t=std::time::Instant::now();
    let e2 = steiglitz_mcbride(&rec,&SmOptions::default()).unwrap(); assert_eq!(e,e2);
    println!("{:?} {} conv {} {:?}", t.elapsed(), e.iterations, e.converged, [0,1,2,3,4].map(|p| e.parameters.to_array()[p]/t0[p]-1.0));
    let foh = { let mut x = Excitation::step(10.5,1.0,3.0,0.001).unwrap(); for (n,v) in x.voltage.iter_mut().enumerate() { *v = 5.0*(n as f64*0.01).sin()+3.0; } x};
    for d in [Discretization::Foh, Discretization::Zoh] { let r = simulated(&Parameters::M2,&foh,d).unwrap();
      let o = SmOptions{model: motorfit::evaluate::Model{discretization:d, initial: Default::default()},..Default::default()};
      let e = steiglitz_mcbride(&r,&o).unwrap();
      println!("{d:?} {} conv {} {:?}", e.iterations, e.converged, [0,1,2,3,4].map(|p| e.parameters.to_array()[p]/t0[p]-1.0)); }
    for db in [80.0,60.0,40.0,30.0,20.0] {
        let sigma = noise_of(&rec, Noise::Decibels(db));
        let crb = refine(std::slice::from_ref(&rec), &Space::table2(), &t0, &RefineOptions{sigma:Some(sigma),..Default::default()}).unwrap().uncertainty.std_error;
        let mut s=[0.0;5]; let mut l=[0.0;5]; let mut it=0; let mut ev=0; let mut worst=0.0f64;let mut conv=0; let mut tsm=0.0; let mut tlm=0.0;
        for seed in 0..200 {
            let noisy = with_noise(&rec, sigma, seed).unwrap();
            let t=std::time::Instant::now();
            let e = steiglitz_mcbride(&noisy,&SmOptions::default()).unwrap();
            tsm+=t.elapsed().as_secs_f64();
            it+=e.iterations; conv+=usize::from(e.converged);
            let t=std::time::Instant::now();
            let f = refine(std::slice::from_ref(&noisy), &Space::table2(), &e.parameters.to_array(), &RefineOptions::default()).unwrap();
            tlm+=t.elapsed().as_secs_f64();
            ev+=f.evaluations;
            let g = refine(std::slice::from_ref(&noisy), &Space::table2(), &t0, &RefineOptions::default()).unwrap();
            for p in 0..5 { s[p]+=((e.parameters.to_array()[p]-t0[p])/crb[p].unwrap()).powi(2); l[p]+=((f.values[p]-t0[p])/crb[p].unwrap()).powi(2);
              worst=worst.max(((f.values[p]-g.values[p])/crb[p].unwrap()).abs()); }
        }
        println!("{db} sm {:.3?} it {:.1} conv {conv} {:.0} us | lm {:.3?} ev {:.1} {:.0} us| apart {worst:.1e}", s.map(|v| (v/200.0f64).sqrt()), it as f64/200.0, 5e3*tsm, l.map(|v| (v/200.0f64).sqrt()), ev as f64/200.0, 5e3*tlm);
    }
}
