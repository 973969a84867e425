//! A set of numbers of which the lowest is taken next, with room for all from the beginning.

/// Bits of a word.
const BITS: usize = u64::BITS as usize;

/// A bit for each number, and one for each word of them that is not zero.
pub(super) struct Pending {
    words: Vec<u64>,
    summary: Vec<u64>,
}

impl Pending {
    /// For numbers below `count`.
    pub(super) fn new(count: usize) -> Self {
        let words = count.div_ceil(BITS);
        Self { words: vec![0; words], summary: vec![0; words.div_ceil(BITS)] }
    }

    /// Adds a number.
    #[inline]
    pub(super) fn insert(&mut self, number: usize) {
        let word = number / BITS;
        self.words[word] |= 1 << (number % BITS);
        self.summary[word / BITS] |= 1 << (word % BITS);
    }

    /// Takes the lowest number out.
    #[inline]
    pub(super) fn take_lowest(&mut self) -> Option<usize> {
        let at = self.summary.iter().position(|words| *words != 0)?;
        let word = BITS * at + self.summary[at].trailing_zeros() as usize;
        let own = &mut self.words[word];
        let number = BITS * word + own.trailing_zeros() as usize;
        *own &= *own - 1;
        if *own == 0 {
            self.summary[at] &= self.summary[at] - 1;
        }
        Some(number)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn numbers_come_out_in_their_order() {
        let (mut pending, mut expected) = (Pending::new(10_000), BTreeSet::new());
        let mut number = 1_usize;
        for step in 0..5_000 {
            number = (number * 5_477 + 13) % 10_000;
            pending.insert(number);
            expected.insert(number);
            if step % 3 == 0 {
                assert_eq!(pending.take_lowest(), expected.pop_first());
            }
        }
        while let Some(number) = expected.pop_first() {
            assert_eq!(pending.take_lowest(), Some(number));
        }
        assert_eq!(pending.take_lowest(), None);
    }
}
