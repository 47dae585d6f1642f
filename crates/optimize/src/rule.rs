//! The run of a search whose candidates move by a rule.

use super::population::Population;
use super::run::{Best, LocalOptimum, LocalSearches, Optimizer};
use super::search_settings::SearchSettings;
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;
use motorfit_core::numeric::index;

/// The rule by which the candidates of a search move.
pub(super) trait Rule: Send {
    /// Checks combinations of settings, each of which is in its range.
    fn check(&self) -> Result<()> {
        Ok(())
    }

    /// Replaces the first population, which is uniform in the box, if the search begins with another one.
    fn begin(&mut self, _population: &mut Population) {}

    /// Takes the costs of the population, none of which is NaN or −∞. A cost above its cutoff is a lower bound. If the budget ends
    /// within a generation of a search that changes its size, there are fewer costs than candidates.
    fn learn(&mut self, population: &Population, costs: Vec<f64>);

    /// Returns for each candidate a cost above which `learn` ignores it, at least the lowest cost so far; empty if every cost is
    /// used.
    fn cutoffs(&self) -> &[f64] {
        &[]
    }

    /// Returns true if populations have different sizes or local searches are requested, so that the budget is one of evaluations.
    fn changes_size(&self) -> bool {
        false
    }

    /// Returns true if the search requests local searches.
    fn needs_local_search(&self) -> bool {
        false
    }

    /// Replaces the population by the next one, which may have another size.
    fn advance(&mut self, population: &mut Population);

    /// Returns the starts of the local searches to run before the next population, row-major; empty without one.
    fn starts(&self) -> &[f64] {
        &[]
    }

    /// Returns the largest number of evaluations of a local search with so many free parameters.
    fn longest(&self, _axes: usize) -> u64 {
        u64::MAX
    }

    /// Takes the ends of the local searches, in the order of their starts.
    fn arrive(&mut self, _ends: &[LocalOptimum]) {}
}

/// A run of a search whose candidates move by a rule.
pub(super) struct Moving<R> {
    pub rule: R,
    pub population: Population,
    told: bool,
    /// Number of evaluations so far.
    evaluations: u64,
}

impl<R: Rule> Moving<R> {
    pub(super) fn new(mut rule: R, setup: SearchSettings) -> Result<Self> {
        rule.check()?;
        let mut population = Population::new(setup)?;
        rule.begin(&mut population);
        Ok(Self { rule, population, told: false, evaluations: 0 })
    }

    /// Returns the number of candidates that wait for their costs.
    fn asked(&self) -> usize {
        if self.told { 0 } else { self.population.count().min(index(self.left())) }
    }

    /// Returns the number of evaluations left; any number for a search of generations of one size.
    fn left(&self) -> u64 {
        if self.rule.changes_size() {
            self.population.setup.evaluations().saturating_sub(self.evaluations)
        } else {
            u64::MAX
        }
    }
}

impl<R: Rule> Optimizer for Moving<R> {
    fn ask(&mut self) -> Candidates<'_> {
        if self.told && self.left() > 0 && self.rule.starts().is_empty() {
            self.told = false;
            self.rule.advance(&mut self.population);
        }
        let asked = self.asked();
        let candidates = Candidates::new(&self.population.values, self.population.width());
        let cutoffs = self.rule.cutoffs();
        let is_cut = cutoffs.len() == candidates.count();
        let candidates = if is_cut { candidates.with_cutoffs(cutoffs) } else { candidates };
        candidates.rows(0, asked)
    }

    fn tell(&mut self, costs: &[f64]) {
        let asked = self.asked();
        if asked == 0 {
            return;
        }
        // A cost of NaN or −∞ is invalid and counts as +∞, as one that is missing.
        let ordered = |&cost: &f64| if cost > f64::NEG_INFINITY { cost } else { f64::INFINITY };
        let mut costs: Vec<f64> = costs.iter().map(ordered).collect();
        costs.resize(asked, f64::INFINITY);
        self.evaluations += costs.len() as u64;
        self.population.note(&costs);
        self.rule.learn(&self.population, costs);
        self.told = true;
    }

    fn best(&self) -> Option<Best<'_>> {
        let Population { best, best_cost, .. } = &self.population;
        best_cost.is_finite().then_some(Best { values: best, cost: *best_cost })
    }

    fn evaluations_max(&self) -> Option<u64> {
        self.rule.changes_size().then(|| self.population.setup.evaluations())
    }

    fn needs_local_search(&self) -> bool {
        self.rule.needs_local_search()
    }

    fn local_searches(&mut self) -> Option<LocalSearches<'_>> {
        let starts = Candidates::new(self.rule.starts(), self.population.width());
        let each = (self.left() / (starts.count().max(1) as u64)).min(self.rule.longest(self.population.width()));
        (starts.count() > 0 && each > 0).then_some(LocalSearches { starts, evaluations: each })
    }

    fn arrive(&mut self, ends: &[LocalOptimum]) {
        for end in ends {
            self.evaluations += end.evaluations;
            self.population.note_end(end);
        }
        self.rule.arrive(ends);
    }
}
