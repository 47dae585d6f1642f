//! Packed whole numbers in the pages of Parquet files: runs, differences and split bytes.

use super::thrift::{unzigzag, varint};

/// Largest number of values of a block of differences.
const BLOCK_MAX: u64 = 1 << 16;

/// Reads `count` whole numbers of `width` bits in runs of equal and of packed ones; calls `push` with a value and its
/// repetitions.
pub(crate) fn hybrid(
    mut bytes: &[u8],
    width: u32,
    count: usize,
    push: &mut impl FnMut(u32, usize) -> Option<()>,
) -> Option<()> {
    if width > 32 {
        return None;
    }
    let mut left = count;
    while left > 0 {
        let (head, length) = varint(bytes)?;
        bytes = bytes.get(length..)?;
        let length = usize::try_from(head >> 1).ok()?;
        if head & 1 == 0 {
            let whole = usize::try_from(width.div_ceil(8)).ok()?;
            let value = bytes.get(..whole)?.iter().rev().fold(0, |value, &byte| value << 8 | u64::from(byte));
            bytes = bytes.get(whole..)?;
            let n = length.min(left);
            if n > 0 {
                push(u32::try_from(value).ok()?, n)?;
            }
            left -= n;
        } else {
            let n = length.saturating_mul(8).min(left);
            unpack(bytes, width, n, &mut |value| push(u32::try_from(value).ok()?, 1))?;
            // Some writers end the last run with its last value instead of a whole group.
            let end = length.saturating_mul(usize::try_from(width).ok()?).min(bytes.len());
            bytes = bytes.get(end..)?;
            left -= n;
        }
    }
    Some(())
}

/// Reads `count` numbers of `width` bits, at most 64, packed from the least significant bit on.
fn unpack(bytes: &[u8], width: u32, count: usize, push: &mut impl FnMut(u64) -> Option<()>) -> Option<()> {
    let width = usize::try_from(width).ok()?;
    if count.checked_mul(width)?.div_ceil(8) > bytes.len() || width > 64 {
        return None;
    }
    let mask = if width == 64 { u64::MAX } else { (1 << width) - 1 };
    for n in 0..count {
        let bit = n * width;
        let window = bytes.get(bit / 8..)?;
        let value = if let (true, Some(eight)) = (width <= 56, window.first_chunk()) {
            u64::from_le_bytes(*eight) >> (bit % 8)
        } else {
            let all = window.iter().take(9).rev().fold(0_u128, |value, &byte| value << 8 | u128::from(byte));
            u64::try_from(all >> (bit % 8) & u128::from(u64::MAX)).ok()?
        };
        push(value & mask)?;
    }
    Some(())
}

/// Appends `count` numbers that are stored as packed differences to their predecessors.
pub(crate) fn differences(mut bytes: &[u8], count: usize, out: &mut Vec<i64>) -> Option<()> {
    let next = |bytes: &mut &[u8]| {
        let (value, length) = varint(bytes)?;
        *bytes = bytes.get(length..)?;
        Some(value)
    };
    let block = next(&mut bytes)?;
    let parts = next(&mut bytes)?;
    let total = usize::try_from(next(&mut bytes)?).ok()?;
    let mut value = unzigzag(next(&mut bytes)?);
    if parts == 0 || block > BLOCK_MAX || block % parts != 0 || block / parts % 32 != 0 || block == 0 || total < count {
        return None;
    }
    let (parts, part) = (usize::try_from(parts).ok()?, usize::try_from(block / parts).ok()?);
    if count > 0 {
        out.push(value);
    }
    let mut left = count.saturating_sub(1);
    while left > 0 {
        let least = unzigzag(next(&mut bytes)?);
        let widths = bytes.get(..parts)?;
        bytes = bytes.get(parts..)?;
        for &width in widths {
            let n = left.min(part);
            unpack(bytes, u32::from(width), n, &mut |difference| {
                value = value.wrapping_add(least).wrapping_add(difference.cast_signed());
                out.push(value);
                Some(())
            })?;
            left -= n;
            if left == 0 {
                break;
            }
            bytes = bytes.get(part / 8 * usize::from(width)..)?;
        }
    }
    Some(())
}

/// Joins the bytes of `count` values of `width` bytes, whose first bytes come first, then the second ones, and so on.
pub(crate) fn join(bytes: &[u8], width: usize, count: usize, out: &mut Vec<u8>) -> Option<()> {
    let stride = bytes.len() / width;
    if count > stride {
        return None;
    }
    out.clear();
    out.resize(count * width, 0);
    for (n, stream) in bytes.chunks_exact(stride.max(1)).take(width).enumerate() {
        for (value, &byte) in out.chunks_exact_mut(width).zip(stream) {
            *value.get_mut(n)? = byte;
        }
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn runs(bytes: &[u8], width: u32, count: usize) -> Option<Vec<u32>> {
        let mut all = Vec::new();
        let mut push = |value, n| {
            all.extend(std::iter::repeat_n(value, n));
            Some(())
        };
        hybrid(bytes, width, count, &mut push)?;
        Some(all)
    }

    #[test]
    fn runs_follow_the_specification() {
        // The example of the specification: 0 to 7, packed in 3 bits; then 5 times 300.
        assert_eq!(runs(&[0x03, 0x88, 0xc6, 0xfa], 3, 8), Some((0..8).collect()));
        assert_eq!(runs(&[0x0a, 0x2c, 0x01], 9, 4), Some(vec![300; 4]));
        // The last group is cut off behind its last value.
        assert_eq!(runs(&[0x03, 0x88, 0xc6], 3, 5), Some((0..5).collect()));
        assert_eq!(runs(&[0x03, 0x88, 0xc6], 3, 6), None);
        assert_eq!(runs(&[0x03], 33, 1), None);
        assert_eq!(runs(&[0x80; 11], 1, 1), None);
        assert_eq!(runs(&[4], 0, 2), Some(vec![0, 0]));
    }

    #[test]
    fn differences_follow_the_specification() {
        let mut out = Vec::new();
        // Blocks of 128 in 4 parts, 3 values from 7 on with the differences -2 and 5 of 3 bits.
        let bytes = [0x80, 1, 4, 3, 14, 3, 3, 0, 0, 0, 0b0011_1000, 0];
        assert_eq!(differences(&bytes, 3, &mut out), Some(()));
        assert_eq!(out, [7, 5, 10]);
        assert_eq!(differences(&bytes, 4, &mut out), None);
        assert_eq!(differences(&[0x80, 1, 0, 3, 14], 1, &mut out), None);
    }
}
