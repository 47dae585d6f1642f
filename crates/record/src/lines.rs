//! Line numbers of samples in their file.

/// Line numbers of samples, stored as runs of consecutive lines, of which even a file of a gigabyte has few.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
pub struct Lines {
    /// First sample of each run of consecutive lines, and its line.
    stretches: Vec<(usize, u64)>,
    count: usize,
}

impl Lines {
    /// Appends the line of the next sample.
    pub fn push(&mut self, line: u64) {
        self.extend(line, 1);
    }

    /// Appends `count` consecutive lines for the next samples, starting with `line`.
    pub(super) fn extend(&mut self, line: u64, count: usize) {
        let next = |&(first, at): &(usize, u64)| at.checked_add((self.count - first) as u64);
        let follows = self.stretches.last().and_then(next) == Some(line);
        if !follows && count > 0 {
            self.stretches.push((self.count, line));
        }
        self.count += count;
    }

    /// Returns the line of a sample; `None` if it has none.
    #[must_use]
    pub fn get(&self, sample: usize) -> Option<u64> {
        if sample >= self.count {
            return None;
        }
        let run = self.stretches.partition_point(|&(first, _)| first <= sample).checked_sub(1)?;
        let (first, line) = self.stretches[run];
        line.checked_add((sample - first) as u64)
    }

    /// Returns the number of samples that have a line.
    #[must_use]
    pub fn len(&self) -> usize {
        self.count
    }

    /// Returns true if no sample has a line.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the lines of the given samples, which must be in increasing order.
    #[must_use]
    pub fn of(&self, samples: impl Iterator<Item = usize>) -> Self {
        let mut lines = Self::default();
        samples.filter_map(|n| self.get(n)).for_each(|line| lines.push(line));
        lines
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn consecutive_lines_form_runs() {
        let list = [2, 3, 4, 8, 9, 20];
        let mut lines = Lines::default();
        list.into_iter().for_each(|line| lines.push(line));
        assert_eq!(lines.stretches.len(), 3);
        assert_eq!(
            (0..7).map(|n| lines.get(n)).collect::<Vec<_>>(),
            [2, 3, 4, 8, 9, 20].map(Some).into_iter().chain([None]).collect::<Vec<_>>()
        );
        assert_eq!(lines.of([1, 2, 4].into_iter()).get(2), Some(9));
    }
}
