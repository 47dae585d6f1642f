//! Limits of workbooks and MAT-files.

use super::{archive, cells, mat_file};
use motorfit_core::limit::{Limit, limit, limit_of};

/// Limits of the readers of workbooks and MAT-files.
pub const LIMITS: [Limit; 10] = [
    limit("bytes of a decompressed workbook or MAT-file", cells::UNPACKED_MAX, "refused during the check"),
    limit(
        "bytes of a decompressed file whose compression ratio exceeds the next limit",
        cells::UNPACKED_FREE,
        "refused: save only the recording",
    ),
    limit(
        "compression ratio of a file that decompresses to more than the previous limit",
        cells::UNPACKED_RATIO,
        "refused: save only the recording",
    ),
    limit_of("cells of the table of a workbook or MAT-file", cells::CELLS_MAX, "refused: cut the recording"),
    limit_of(
        "cells of a table with more cells than its compressed file has bytes",
        cells::CELLS_FREE,
        "refused: save only the recording",
    ),
    limit_of("columns of a workbook or MAT-file", cells::COLUMNS_MAX, "refused"),
    limit_of("files in a workbook", archive::ENTRIES_MAX, "refused"),
    limit_of("variables and fields of a MAT-file", mat_file::ARRAYS_MAX, "refused"),
    limit_of("columns of a matrix of a MAT-file", mat_file::MATRIX_MAX, "the matrix is left out, and named"),
    limit_of(
        "levels of nested structures of a MAT-file",
        mat_file::DEPTH_MAX,
        "deeper structures are left out, and named",
    ),
];
