//! Filters of the chunks of HDF5 datasets.
//!
//! Beside those of the decoder there is LZF, which h5py offers as `compression="lzf"`.

use hdf5_reader::FilterRegistry;
use hdf5_reader::error::{Error, Result as Decoded};
use hdf5_reader::filters::{
    FILTER_DEFLATE, FILTER_FLETCHER32, FILTER_NBIT, FILTER_SCALEOFFSET, FILTER_SHUFFLE, FILTER_SZIP, nbit,
};
use hdf5_reader::messages::filter_pipeline::{FilterDescription, FilterPipelineMessage};

/// Number of the filter LZF in HDF5 files.
const LZF: u16 = 32000;
/// Filters that are read.
const KNOWN: [u16; 7] =
    [FILTER_DEFLATE, FILTER_SHUFFLE, FILTER_FLETCHER32, FILTER_SZIP, FILTER_NBIT, FILTER_SCALEOFFSET, LZF];
/// Largest number of filters of a dataset, as in the HDF5 library.
const FILTERS_MAX: usize = 32;

/// Returns the filters of the decoder and LZF; a chunk may decompress to `unpacked_max` bytes.
pub(super) fn filters(unpacked_max: usize) -> FilterRegistry {
    let mut filters = FilterRegistry::new();
    let damaged = |name: &str| Error::DecompressionError(format!("damaged data of the filter {name}"));
    filters.register(LZF, Box::new(move |_, data, _| unpacked(data, unpacked_max).ok_or_else(|| damaged("LZF"))));
    // The decoder does not bound the work for elements that are not numbers.
    let nbit = move |filter: &FilterDescription, data: &[u8], _: usize| -> Decoded<Vec<u8>> {
        if is_plain(filter) {
            nbit::decompress_with_limit(data, &filter.client_data, unpacked_max)
        } else {
            Err(damaged("nbit"))
        }
    };
    filters.register(FILTER_NBIT, Box::new(nbit));
    filters
}

/// Returns true if the parameters of the filter nbit are those of numbers.
fn is_plain(nbit: &FilterDescription) -> bool {
    /// Number of parameters, and the fourth of them for numbers.
    const PARAMETERS: (usize, u32) = (8, 1);
    (nbit.client_data.len(), nbit.client_data.get(3).copied().unwrap_or(0)) == PARAMETERS
}

/// Checks that the filters of a dataset are read.
///
/// # Errors
/// Returns a description of a filter that is not.
pub(super) fn supported(pipeline: &FilterPipelineMessage) -> Result<(), String> {
    let ids: Vec<u16> = pipeline.filters.iter().map(|filter| filter.id).collect();
    if let Some(id) = ids.iter().find(|id| !KNOWN.contains(id)) {
        let (name, remedy) = (name(*id), "rewrite it with h5repack -f GZIP=4");
        return Err(format!("compressed with {name}, expected gzip, szip or lzf: {remedy}"));
    }
    if pipeline.filters.iter().any(|filter| filter.id == FILTER_NBIT && !is_plain(filter)) {
        return Err("elements of several numbers compressed with nbit".to_owned());
    }
    // The decoder bounds the results of successive decompressions only for some filters.
    let unpacks = |id: &&u16| ![FILTER_SHUFFLE, FILTER_FLETCHER32].contains(*id);
    let unbounded = [LZF, FILTER_NBIT, FILTER_SZIP].iter().any(|id| ids.contains(id));
    if ids.len() > FILTERS_MAX || unbounded && ids.iter().filter(unpacks).count() > 1 {
        return Err("compressed several times".to_owned());
    }
    Ok(())
}

/// Returns the name of a filter in the registry of the HDF Group.
fn name(id: u16) -> String {
    let name = match id {
        305 => "LZO",
        307 => "bzip2",
        32001 => "Blosc",
        32004 => "LZ4",
        32008 => "bitshuffle",
        32013 => "ZFP",
        32015 => "Zstandard",
        32026 => "Blosc2",
        id => return format!("filter {id}"),
    };
    name.to_owned()
}

/// Decompresses a chunk of LZF; returns `None` if it is damaged or exceeds `unpacked_max` bytes.
///
/// The data of LZF are runs of new bytes and copies of earlier ones. The first byte of a run is its length less 1, below 32. A copy
/// has its length in the upper 3 bits of the first byte, continued in the next one if they are all set, and its distance in
/// the lower 5 bits and in the last byte.
fn unpacked(mut data: &[u8], unpacked_max: usize) -> Option<Vec<u8>> {
    let mut unpacked: Vec<u8> = Vec::new();
    let mut next = |count: usize| {
        let (taken, rest) = data.split_at_checked(count)?;
        data = rest;
        Some(taken)
    };
    while let Some(&[first]) = next(1) {
        let first = usize::from(first);
        if first < 32 {
            unpacked.extend_from_slice(next(first + 1)?);
        } else {
            let more = if first >> 5 == 7 { next(1)?.first()? } else { &0 };
            let length = (first >> 5) + usize::from(*more) + 2;
            let distance = ((first & 31) << 8) + usize::from(*next(1)?.first()?) + 1;
            let start = unpacked.len().checked_sub(distance)?;
            // A copy may overlap its own result: a byte repeats if the distance is 1.
            for at in start..start + length {
                unpacked.push(*unpacked.get(at)?);
            }
        }
        if unpacked.len() > unpacked_max {
            return None;
        }
    }
    Some(unpacked)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_and_copies() {
        assert_eq!(unpacked(&[2, b'a', b'b', b'c', 0x20, 2], 6).unwrap(), b"abcabc");
        assert_eq!(unpacked(&[0, b'x', 0xe0, 3, 0], 13).unwrap(), b"xxxxxxxxxxxxx");
        assert_eq!(unpacked(&[], 0).unwrap(), b"");
    }

    #[test]
    fn damaged_data_and_large_results_are_refused() {
        assert!(unpacked(&[2, b'a', b'b'], 100).is_none());
        assert!(unpacked(&[0, b'x', 0x20, 1], 100).is_none());
        assert!(unpacked(&[0, b'x', 0xe0], 100).is_none());
        assert!(unpacked(&[0, b'x', 0xe0, 3, 0], 12).is_none());
    }
}
