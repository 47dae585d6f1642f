//! Times of the messages of a topic.

use super::limits::STAMP_AWAY_MAX_NS;
use motorfit_core::numeric::count_u64;

/// Times of the messages seen so far \[ns\].
#[derive(Debug, Clone, Default)]
pub(super) struct Clock {
    pub count: u64,
    /// First and last time of logging.
    logged: Option<[u64; 2]>,
    latest: u64,
    /// True if a message was logged before its predecessor.
    pub unordered: bool,
    /// First and last acceptable time of the headers.
    stamped: Option<[u64; 2]>,
    /// Number of headers without an acceptable time.
    pub without: u64,
}

/// Largest part of the headers without an acceptable time with which those of the others are used.
const WITHOUT_MAX: f64 = 0.02;

impl Clock {
    /// Adds a message.
    pub fn add(&mut self, logged: u64, stamp: Option<u64>) {
        let acceptable = stamp.filter(|stamp| stamp.abs_diff(logged) <= STAMP_AWAY_MAX_NS);
        match acceptable {
            Some(stamp) => {
                let [first, last] = self.stamped.unwrap_or([stamp; 2]);
                self.stamped = Some([first.min(stamp), last.max(stamp)]);
            }
            None => self.without += 1,
        }
        self.unordered |= logged < self.latest;
        self.latest = logged;
        let [first, last] = self.logged.unwrap_or([logged; 2]);
        self.logged = Some([first.min(logged), last.max(logged)]);
        self.count += 1;
    }

    /// Returns true if the times of the headers are used instead of the times of logging.
    pub fn uses_stamps(&self) -> bool {
        self.stamped.is_some() && count_u64(self.without) <= WITHOUT_MAX * count_u64(self.count)
    }

    /// Returns true if there are times of headers that are not used.
    pub fn refuses_stamps(&self) -> bool {
        self.stamped.is_some() && !self.uses_stamps()
    }

    /// Returns first and last time \[ns\].
    pub fn span(&self) -> Option<[u64; 2]> {
        self.stamped.filter(|_| self.uses_stamps()).or(self.logged)
    }
}

/// Returns the time since the start of the log \[s\].
pub(super) fn seconds(time: u64, origin: u64) -> f64 {
    count_u64(time.saturating_sub(origin)) / 1e9
}

/// Sorts columns by their times, those of equal times in their order.
pub(super) fn sort(times: &mut Vec<u64>, columns: &mut [Vec<f64>]) {
    if times.is_sorted() {
        return;
    }
    let mut order: Vec<usize> = (0..times.len()).collect();
    order.sort_by_key(|&at| times.get(at).copied());
    for column in columns {
        *column = order.iter().filter_map(|&at| column.get(at).copied()).collect();
    }
    *times = order.iter().filter_map(|&at| times.get(at).copied()).collect();
}

#[cfg(test)]
mod tests {
    use super::*;

    type Messages<'a> = &'a [(u64, Option<u64>)];

    fn clock(messages: Messages<'_>) -> Clock {
        let mut clock = Clock::default();
        messages.iter().for_each(|&(logged, stamp)| clock.add(logged, stamp));
        clock
    }

    #[test]
    fn stamps_are_used_if_nearly_all_are_acceptable() {
        const FAR: u64 = STAMP_AWAY_MAX_NS;
        let cases: [(Messages<'_>, bool, [u64; 2]); 6] = [
            (&[(10, Some(5)), (20, Some(15)), (30, Some(15))], true, [5, 15]),
            (&[(10, Some(5)), (20, Some(15)), (30, Some(14))], true, [5, 15]),
            (&[(10, Some(5)), (20, None), (30, Some(25))], false, [10, 30]),
            (&[(10, None), (20, Some(15))], false, [10, 20]),
            (&[(10, Some(10 + FAR)), (20, Some(20 + FAR))], true, [10 + FAR, 20 + FAR]),
            (&[(10, Some(11 + FAR))], false, [10, 10]),
        ];
        for (messages, stamped, span) in cases {
            let clock = clock(messages);
            assert_eq!((clock.uses_stamps(), clock.span()), (stamped, Some(span)), "{messages:?}");
        }
        assert_eq!(clock(&[]).span(), None);
        let mut many = vec![(10, Some(5)); 99];
        many.push((10, None));
        let clock = clock(&many);
        assert_eq!((clock.uses_stamps(), clock.without), (true, 1));
    }

    #[test]
    fn messages_out_of_order() {
        let clock = clock(&[(20, None), (10, None), (30, None)]);
        assert!(clock.unordered && clock.span() == Some([10, 30]));
        let (mut times, mut columns) = (vec![20, 10, 30, 10], [vec![1.0, 2.0, 3.0, 4.0]]);
        sort(&mut times, &mut columns);
        assert_eq!((times, columns), (vec![10, 10, 20, 30], [vec![2.0, 4.0, 1.0, 3.0]]));
    }
}
