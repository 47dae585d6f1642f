//! Links the program at fixed addresses on Linux: 47,000 relocations would otherwise add 0.4 ms to every start (`docs/benchmarks.md`).
//! Libraries, stack and heap stay at random addresses.

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let of = |key: &str| std::env::var(key).unwrap_or_default();
    let target = ["CARGO_CFG_TARGET_OS", "CARGO_CFG_TARGET_ARCH", "CARGO_CFG_TARGET_ENV"].map(of);
    if target == ["linux", "x86_64", "gnu"] {
        println!("cargo::rustc-link-arg-bins=-no-pie");
    }
}
