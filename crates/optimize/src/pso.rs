//! Particle swarm optimization in the constriction form (M. Clerc, J. Kennedy, IEEE Trans. Evol. Comput. 6 (2002), Eqs. 3
//! and 4 with κ = 1).
//!
//! `v' = χ (v + c₁ r₁ (p − x) + c₂ r₂ (g − x))`, `x' = x + v'`, with `χ = 2/|2 − φ − √(φ² − 4φ)|` and `φ = c₁ + c₂ > 4`: p
//! is the best position of the particle, g that of the swarm, r₁ and r₂ are uniform in \[0, 1) for each axis and particle.
//! Initial velocities are zero (A. P. Engelbrecht, IEEE CEC 2012); velocities are clamped to a fraction of the range of
//! each axis (R. C. Eberhart, Y. Shi, IEEE CEC 2000). A particle that would leave the box is placed on its boundary, where
//! the velocity is set to zero or reversed (J. Robinson, Y. Rahmat-Samii, IEEE Trans. Antennas Propag. 52 (2004)).

use super::numbers::{PIECE, split};
use super::population::{Population, each_piece};
use super::rule::Rule;
use super::table::{NOT_NEGATIVE, Range, search, setting_choice};
use motorfit_core::{Error, Result};

/// Treatment of the velocity of a particle at the boundary of the box.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wall {
    /// The velocity is set to zero.
    Absorbing,
    /// The velocity is reversed.
    Reflecting,
}

setting_choice!(Wall: Wall::Absorbing, Wall::Reflecting);

search! {
    Pso = "pso", "Particle swarm";
    /// Settings of the particle swarm.
    pub struct PsoOptions {
        /// Coefficient of attraction to the best position of the particle; c1 + c2 must exceed 4.
        c1: f64 = 2.05, "c1" in NOT_NEGATIVE;
        /// Coefficient of attraction to the best position of the swarm.
        c2: f64 = 2.05, "c2" in NOT_NEGATIVE;
        /// Largest velocity along an axis, as a fraction of its range.
        velocity: f64 = 0.5, "velocity" in Range::Number(0.0, 1.0, true);
        /// Velocity of a particle at the boundary of the box: set to zero (absorb) or reversed (reflect).
        walls: Wall = Wall::Absorbing, "walls" in Range::Choice(&["absorb", "reflect"]);
    }
}

#[derive(Default)]
struct Pso {
    options: PsoOptions,
    velocities: Vec<f64>,
    /// Best position of each particle, row-major.
    own: Vec<f64>,
    /// Cost of the best position of each particle.
    costs: Vec<f64>,
}

impl Pso {
    /// Returns φ, the sum of both coefficients of attraction.
    fn attraction(&self) -> f64 {
        self.options.c1 + self.options.c2
    }

    /// Returns the constriction coefficient χ.
    fn constriction(&self) -> f64 {
        let phi = self.attraction();
        2.0 / (2.0 - phi - (phi * phi - 4.0 * phi).sqrt()).abs()
    }
}

impl Rule for Pso {
    fn check(&self) -> Result<()> {
        let phi = self.attraction();
        if phi > 4.0 {
            return Ok(());
        }
        let message = format!("c1 + c2 of pso is {phi}");
        let hint = "Give c1 and c2 with a sum above 4; the constriction needs it for convergence.";
        Err(Error::usage(message, hint))
    }

    fn learn(&mut self, swarm: &Population, costs: Vec<f64>) {
        if self.costs.is_empty() {
            self.velocities.resize(swarm.values.len(), 0.0);
            self.own.clone_from(&swarm.values);
            self.costs = costs;
            return;
        }
        let rows = self.own.chunks_exact_mut(swarm.width()).zip(&mut self.costs).zip(costs).enumerate();
        for (agent, ((own, lowest), cost)) in rows.filter(|(_, ((_, lowest), cost))| cost < *lowest) {
            *lowest = cost;
            own.copy_from_slice(swarm.row(agent));
        }
    }

    /// A position is remembered only if its cost is below that of the particle's best.
    fn cutoffs(&self) -> &[f64] {
        &self.costs
    }

    /// Moves every particle by Eq. 3 of Clerc and Kennedy.
    fn advance(&mut self, swarm: &mut Population) {
        let Population { setup, numbers, values, .. } = swarm;
        let (width, constriction) = (setup.bounds.len(), self.constriction());
        let best = self.costs.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)).map_or(0, |(agent, _)| agent);
        let best = &self.own[best * width..(best + 1) * width];
        let PsoOptions { c1, c2, velocity, walls } = self.options;
        let size = PIECE * width;
        let states = values.chunks_mut(size).zip(self.velocities.chunks_mut(size));
        each_piece(states.zip(self.own.chunks(size)).zip(numbers), |(((values, velocities), own), numbers)| {
            let mut draws = vec![0; width];
            let rows = values.chunks_exact_mut(width).zip(velocities.chunks_exact_mut(width));
            for ((x, v), own) in rows.zip(own.chunks_exact(width)) {
                numbers.fill(&mut draws);
                for axis in 0..width {
                    let ((r1, r2), (min, max)) = (split(draws[axis]), setup.bounds[axis]);
                    let pulled = v[axis] + c1 * r1 * (own[axis] - x[axis]) + c2 * r2 * (best[axis] - x[axis]);
                    let fastest = velocity * (max - min);
                    let moved = (constriction * pulled).clamp(-fastest, fastest);
                    let free = x[axis] + moved;
                    x[axis] = free.max(min).min(max);
                    let is_inside = (min..=max).contains(&free);
                    v[axis] = match walls {
                        _ if is_inside => moved,
                        Wall::Absorbing => 0.0,
                        Wall::Reflecting => -moved,
                    };
                }
            }
        });
    }
}

#[allow(clippy::float_cmp, reason = "exact equality is meant")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::rule::Moving;
    use crate::{Optimizer as _, SearchSettings};

    fn setup() -> SearchSettings {
        SearchSettings {
            bounds: vec![(-1.0, 3.0), (10.0, 20.0)],
            population: 3,
            generations: 4,
            seed: 5,
            run: 2,
            ..SearchSettings::default()
        }
    }

    fn swarm(options: PsoOptions) -> Result<Moving<Pso>> {
        Moving::new(Pso { options, ..Pso::default() }, setup())
    }

    /// Compares generations with the formula evaluated particle by particle from the same random numbers.
    #[test]
    fn generations_are_the_formula() {
        for walls in [Wall::Absorbing, Wall::Reflecting] {
            let options = PsoOptions { c1: 2.5, c2: 1.9, velocity: 0.1, walls };
            let mut swarm = swarm(options).unwrap();
            let mut numbers = Population::new(setup()).unwrap().numbers;
            let chi = 2.0 / (2.0_f64 - 4.4 - (4.4_f64 * 4.4 - 4.0 * 4.4).sqrt()).abs();
            let mut x: Vec<[f64; 2]> = swarm.ask().values().chunks(2).map(|row| [row[0], row[1]]).collect();
            let (mut v, mut own, mut lowest) = ([[0.0; 2]; 3], x.clone(), [f64::INFINITY; 3]);
            let (mut clamped, mut at_wall) = (0, 0);
            for _ in 0..12 {
                let costs: Vec<f64> = x.iter().map(|[a, b]| (a - 2.99).powi(2) + (b - 10.01).powi(2)).collect();
                swarm.tell(&costs);
                for n in 0..3 {
                    if costs[n] < lowest[n] {
                        (lowest[n], own[n]) = (costs[n], x[n]);
                    }
                }
                let leader = own[(0..3).min_by(|a, b| lowest[*a].total_cmp(&lowest[*b])).unwrap()];
                for n in 0..3 {
                    for (axis, (min, max)) in [(-1.0, 3.0), (10.0, 20.0)].into_iter().enumerate() {
                        let (r1, r2) = numbers[0].pair();
                        let pull = 2.5 * r1 * (own[n][axis] - x[n][axis]) + 1.9 * r2 * (leader[axis] - x[n][axis]);
                        let unclamped = chi * (v[n][axis] + pull);
                        let fastest = 0.1 * (max - min);
                        v[n][axis] = if unclamped.abs() > fastest { fastest * unclamped.signum() } else { unclamped };
                        clamped += usize::from(unclamped.abs() > fastest);
                        x[n][axis] += v[n][axis];
                        if x[n][axis] < min || x[n][axis] > max {
                            x[n][axis] = if x[n][axis] < min { min } else { max };
                            v[n][axis] *= if walls == Wall::Absorbing { 0.0 } else { -1.0 };
                            at_wall += 1;
                        }
                    }
                }
                for (moved, expected) in swarm.ask().values().iter().zip(x.as_flattened()) {
                    assert!((moved - expected).abs() < 1e-12, "{walls:?}: {moved} {expected}");
                }
            }
            assert!(clamped > 0 && at_wall > 0, "{walls:?}: {clamped} clamped, {at_wall} at a wall");
        }
    }

    #[test]
    fn the_constriction_is_that_of_clerc_and_kennedy() {
        let constriction = Pso::default().constriction();
        assert!((constriction - 0.729_843_788).abs() < 1e-9, "{constriction}");
        assert!(swarm(PsoOptions { c1: 2.0, c2: 2.0, ..PsoOptions::default() }).is_err());
    }

    #[test]
    fn random_numbers_do_not_depend_on_costs() {
        let after = |cost: fn(usize) -> f64| {
            let mut swarm = swarm(PsoOptions::default()).unwrap();
            for _ in 0..3 {
                swarm.ask();
                swarm.tell(&[0, 1, 2].map(cost));
            }
            swarm.ask();
            swarm.population.numbers[0].unit()
        };
        assert_eq!(after(|_| f64::INFINITY), after(|agent| [1.0, f64::NAN, 0.5][agent]));
    }
}
