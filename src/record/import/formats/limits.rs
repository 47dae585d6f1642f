//! Limits of workbooks and MAT-files.

use super::{archive, cells, mat_file};
use crate::limit::{Limit, limit, limit_of};

pub(in super::super) const LIMITS: [Limit; 10] = [
    limit("bytes that a workbook or MAT-file unpacks to", cells::UNPACKED_MAX, "refused while it is checked"),
    limit("bytes that a small one unpacks to", cells::UNPACKED_FREE, "refused, unless it is within the next limit"),
    limit("times its own size that it unpacks to", cells::UNPACKED_RATIO, "refused: save the recording alone"),
    limit_of("cells of the table of a workbook or MAT-file", cells::CELLS_MAX, "refused: cut the recording"),
    limit_of("cells of that of a small one, of fewer bytes", cells::CELLS_FREE, "refused: save the recording alone"),
    limit_of("columns of a workbook or MAT-file", cells::COLUMNS_MAX, "refused"),
    limit_of("files in a workbook", archive::ENTRIES_MAX, "refused"),
    limit_of("variables and fields of a MAT-file", mat_file::ARRAYS_MAX, "refused"),
    limit_of("columns of a matrix of a MAT-file", mat_file::MATRIX_MAX, "the matrix is left out, and named"),
    limit_of(
        "structures inside each other in a MAT-file",
        mat_file::DEPTH_MAX,
        "what is inside is left out, and named",
    ),
];
