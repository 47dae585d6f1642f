//! A search that moves its candidates in other coordinates than those of the parameters.

use super::coordinates::Coordinates;
use super::run::{Best, LocalOptimum, LocalSearches, Optimizer};
use super::search_settings::SearchSettings;
use motorfit_core::Result;
use motorfit_core::candidates::Candidates;

/// A search in other coordinates.
pub(super) struct TransformedSearch {
    search: Box<dyn Optimizer>,
    coordinates: Coordinates,
    /// Bounds of the parameters.
    bounds: Vec<(f64, f64)>,
    /// Values of the candidates asked for, row-major.
    values: Vec<f64>,
    /// True if these are the values of the present candidates.
    is_current: bool,
    /// Values and cost of the best candidate.
    best: Option<(Vec<f64>, f64)>,
    /// Values of the starts of local searches, row-major.
    starts: Vec<f64>,
}

impl TransformedSearch {
    /// Begins a search in the coordinates of its settings; `begin` makes it on the transformed box.
    pub(super) fn begin(
        setup: SearchSettings,
        begin: impl FnOnce(SearchSettings) -> Result<Box<dyn Optimizer>>,
    ) -> Result<Box<dyn Optimizer>> {
        let coordinates = setup.coordinates;
        if coordinates == Coordinates::None {
            return begin(setup);
        }
        setup.check()?;
        let bounds = setup.bounds.clone();
        let search = begin(SearchSettings { bounds: coordinates.bounds(&bounds), ..setup })?;
        let (values, starts) = (Vec::new(), Vec::new());
        Ok(Box::new(Self { search, coordinates, bounds, values, is_current: false, best: None, starts }))
    }
}

/// Writes the values of rows of coordinates.
fn to_values(coordinates: Coordinates, bounds: &[(f64, f64)], rows: &[f64], values: &mut Vec<f64>) {
    values.clear();
    values.extend(rows.iter().zip(bounds.iter().cycle()).map(|(x, axis)| coordinates.value(*x, *axis)));
}

impl Optimizer for TransformedSearch {
    fn ask(&mut self) -> Candidates<'_> {
        let asked = self.search.ask();
        if !self.is_current {
            to_values(self.coordinates, &self.bounds, asked.values(), &mut self.values);
            self.is_current = true;
        }
        let candidates = Candidates::new(&self.values, self.bounds.len());
        if asked.cutoffs().is_empty() { candidates } else { candidates.with_cutoffs(asked.cutoffs()) }
    }

    fn tell(&mut self, costs: &[f64]) {
        self.search.tell(costs);
        self.changed();
    }

    fn best(&self) -> Option<Best<'_>> {
        self.best.as_ref().map(|(values, cost)| Best { values, cost: *cost })
    }

    fn evaluations_max(&self) -> Option<u64> {
        self.search.evaluations_max()
    }

    fn needs_local_search(&self) -> bool {
        self.search.needs_local_search()
    }

    fn local_searches(&mut self) -> Option<LocalSearches<'_>> {
        let searches = self.search.local_searches()?;
        to_values(self.coordinates, &self.bounds, searches.starts.values(), &mut self.starts);
        Some(LocalSearches { starts: Candidates::new(&self.starts, self.bounds.len()), ..searches })
    }

    fn arrive(&mut self, ends: &[LocalOptimum]) {
        let coordinate = |(x, axis): (&f64, &(f64, f64))| self.coordinates.coordinate(*x, *axis);
        let end = |end: &LocalOptimum| {
            let values = end.values.iter().zip(&self.bounds).map(coordinate).collect();
            LocalOptimum { values, ..*end }
        };
        for end in ends {
            // The values of the optimum are those of its cost, which those of rounded coordinates are not.
            if end.cost < self.best.as_ref().map_or(f64::INFINITY, |best| best.1) {
                self.best = Some((end.values.clone(), end.cost));
            }
        }
        let ends: Vec<LocalOptimum> = ends.iter().map(end).collect();
        self.search.arrive(&ends);
        self.changed();
    }
}

impl TransformedSearch {
    fn changed(&mut self) {
        self.is_current = false;
        let known = self.best.as_ref().map_or(f64::INFINITY, |best| best.1);
        if let Some(best) = self.search.best().filter(|best| best.cost < known) {
            let values = best.values.iter().zip(&self.bounds).map(|(x, axis)| self.coordinates.value(*x, *axis));
            self.best = Some((values.collect(), best.cost));
        }
    }
}

#[allow(clippy::float_cmp, reason = "exact equality is meant")]
#[cfg(test)]
mod tests {
    use super::*;
    use crate::coordinates::{ALL, BOUNDS};
    use crate::{ConfiguredSearch, GwoOptions, JayaOptions, SEARCHES};

    fn setup(coordinates: Coordinates) -> SearchSettings {
        let bounds = BOUNDS.to_vec();
        SearchSettings { bounds, population: 10, generations: 12, seed: 3, coordinates, ..SearchSettings::default() }
    }

    fn cost(row: &[f64]) -> f64 {
        (row[0] - 6.0).powi(2) + (row[1] - 2.1).powi(2) + row[2].powi(2)
    }

    #[test]
    fn a_search_in_other_coordinates_is_the_search_of_the_transformed_box() {
        for search in SEARCHES.into_iter().filter(|search| search.name != "multistart") {
            for coordinates in ALL {
                let mut ours = ConfiguredSearch::from(search).begin(setup(coordinates)).unwrap();
                let bounds = coordinates.bounds(&BOUNDS);
                let plain = SearchSettings { bounds, ..setup(Coordinates::None) };
                let mut theirs = ConfiguredSearch::from(search).begin(plain).unwrap();
                let mut lowest = f64::INFINITY;
                for _ in 0..12 {
                    let mut expected = Vec::new();
                    to_values(coordinates, &BOUNDS, theirs.ask().values(), &mut expected);
                    assert_eq!(ours.ask().values(), expected, "{} {coordinates}", search.name);
                    assert_eq!(ours.ask().cutoffs(), theirs.ask().cutoffs());
                    let costs: Vec<f64> = expected.chunks(3).map(cost).collect();
                    lowest = costs.iter().copied().fold(lowest, f64::min);
                    ours.tell(&costs);
                    theirs.tell(&costs);
                    let best = ours.best().unwrap();
                    assert_eq!((best.cost, cost(best.values)), (lowest, lowest));
                    assert!(best.values.iter().zip(BOUNDS).all(|(x, (a, b))| (a..=b).contains(x)));
                }
            }
        }
    }

    /// Medians over runs of the final cost of a search in coordinates.
    fn median(search: impl Into<ConfiguredSearch>, coordinates: Coordinates) -> f64 {
        let search = search.into();
        let run = |run: u64| {
            let setup = SearchSettings { generations: 40, population: 30, run, ..setup(coordinates) };
            let mut search = search.begin(setup).unwrap();
            for _ in 0..40 {
                let costs: Vec<f64> = search.ask().values().chunks(3).map(cost).collect();
                search.tell(&costs);
            }
            search.best().unwrap().cost
        };
        let mut costs: Vec<f64> = (0..41).map(run).collect();
        costs.sort_by(f64::total_cmp);
        costs[20]
    }

    #[test]
    fn gwo_depends_on_the_origin_and_jaya_on_the_sign() {
        // GWO moves by multiples of |C X_p − X|, which are larger for larger values; Jaya by |X|, which is −X for logarithms below 1.
        let gwo = |coordinates| median(GwoOptions::default(), coordinates);
        assert!(gwo(Coordinates::Shift(30.0)) > 100.0 * gwo(Coordinates::None));
        let jaya = |coordinates| median(JayaOptions::default(), coordinates);
        assert!(jaya(Coordinates::Shift(-3.0)) > 100.0 * jaya(Coordinates::None));
    }
}
