//! Formats that are not read, with their converters.

use motorfit_core::{Error, Result};

/// A format that is not read.
struct Foreign {
    /// First bytes of its files; empty if they are not known.
    magic: &'static [u8],
    /// Extension of its files, by which formats without known first bytes are found.
    extension: &'static str,
    name: &'static str,
    hint: &'static str,
}

const FOREIGN: [Foreign; 5] = [
    Foreign {
        magic: b"",
        extension: "hoot",
        name: "a Phoenix 6 log of CTRE (.hoot), a closed format",
        hint: "Convert it with CTRE's owlet: owlet LOG.hoot LOG.wpilog -f wpilog; or export WPILOG in Phoenix Tuner X.",
    },
    Foreign {
        magic: b"",
        extension: "rlog",
        name: "an old log of AdvantageKit (.rlog)",
        hint: "Open it in AdvantageScope and export WPILOG.",
    },
    Foreign {
        magic: b"SQLite format 3\0",
        extension: "db3",
        name: "an SQLite database, such as a bag of ROS 2 (.db3)",
        hint: "Convert it to MCAP: ros2 bag convert -i FILE.db3 -o convert.yaml, where convert.yaml has output_bags: [{uri: converted, \
               storage_id: mcap, all: true}].",
    },
    Foreign {
        magic: b"#ROSBAG V",
        extension: "bag",
        name: "a bag of ROS 1",
        hint: "Convert it to MCAP: mcap convert BAG.bag BAG.mcap.",
    },
    Foreign {
        magic: b"TDSh",
        extension: "tdms_index",
        name: "the index of a TDMS file",
        hint: "Give the .tdms file beside it.",
    },
];

/// Refuses a file of a format that is not read, by its first bytes.
///
/// # Errors
/// Returns `Data` with the converter of the format.
pub(crate) fn refused(head: &[u8]) -> Result<()> {
    let found = FOREIGN.iter().find(|format| !format.magic.is_empty() && head.starts_with(format.magic));
    found.map_or(Ok(()), |format| Err(error(format)))
}

/// Refuses a file of a format that is not read, by the end of its name.
///
/// # Errors
/// Returns `Data` with the converter of the format.
pub fn refused_name(extension: &str) -> Result<()> {
    let found = FOREIGN.iter().find(|format| format.extension.eq_ignore_ascii_case(extension));
    found.map_or(Ok(()), |format| Err(error(format)))
}

fn error(format: &Foreign) -> Error {
    Error::data(format!("is {}", format.name), format.hint)
}
