# Writes candidates-*.parquet: 25 candidates in double precision, in other types and compressions, and with invalid
# values. Python 3.11, pyarrow 26.0.1: python tests/golden/candidates.py tests/golden
import sys
import pyarrow as pa
import pyarrow.parquet as pq

folder = sys.argv[1]
rows = 25
centre = {"R": 0.9, "L": 0.0078, "K": 0.0735, "B": 0.00068, "J": 0.000136}
# n/1024 is exact, so that a float equals the double wherever the product is rounded once.
column = {p: [v * (1 + ((7 * n + 3 * k) % 11 - 5) / 1024) for n in range(rows)] for k, (p, v) in enumerate(centre.items())}
column["note"] = [f"row {n}" for n in range(rows)]


def write(name, columns, **options):
    pq.write_table(pa.table(columns), f"{folder}/candidates-{name}.parquet", **options)


write("snappy", column, compression="snappy", row_group_size=10)
write("zstd", column, compression="zstd", use_dictionary=False, data_page_version="2.0")
# Other order of columns, no compression, floats.
floats = {p: pa.array(column[p], pa.float32() if p in "RK" else pa.float64()) for p in "JBKLR"}
write("float", floats, compression="none")
nulls = dict(column, K=[None if n == 16 else v for n, v in enumerate(column["K"])])
write("null", nulls, compression="none", row_group_size=10)
write("text", dict(column, B=column["note"]), compression="none")
with open(f"{folder}/candidates.csv", "w") as out:
    out.write("R,L,K,B,J\n")
    for n in range(rows):
        out.write(",".join(repr(column[p][n]) for p in centre) + "\n")
