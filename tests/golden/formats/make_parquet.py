"""Writes the Parquet files of the tests: python3 make_parquet.py (needs numpy and pyarrow)."""
import csv
import datetime
import decimal
import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

NAMES = ["time_s", "voltage_V", "current_A", "speed_rad_s"]
rows = list(csv.DictReader(open("recording.csv")))
T, U, I, W = (np.array([float(row[name]) for row in rows]) for name in NAMES)
N = len(T)
K = np.arange(N)
MISSING = K % 7 == 3
START_NS = 1_700_000_000_123_456_789
COUNT = np.round(T * 1000).astype(np.int64)  # milliseconds

pq.write_table(pa.table(dict(zip(NAMES, (T, U, I, W)))), "recording.parquet")


def decimals(digits, kind, values):
    return pa.array([decimal.Decimal(int(v)).scaleb(-digits) for v in values], kind)


# Dictionaries, nulls, structures and all numeric types, in row groups of 150 rows.
HALF = np.clip(W, -60000, 60000).astype(np.float16)
state = pa.StructArray.from_arrays(
    [pa.array(W), pa.StructArray.from_arrays([pa.array(I, mask=MISSING)], ["current"])], ["velocity", "motor"]
)
TYPES = {
    "stamp_ns": pa.array(START_NS + COUNT * 1_000_000, pa.timestamp("ns")),
    "stamp_us": pa.array(START_NS // 1000 + COUNT * 1000, pa.timestamp("us", tz="UTC"), mask=K == 0),
    "stamp_ms": pa.array(START_NS // 1_000_000 + COUNT, pa.timestamp("ms")),
    "clock_us": pa.array(COUNT * 1000, pa.time64("us")),
    "clock_ms": pa.array(COUNT.astype(np.int32), pa.time32("ms")),
    "day": pa.array([datetime.date(2024, 1, 1)] * N),
    "voltage": pa.array(U, mask=MISSING),
    "state": state,
    "i8": pa.array((K % 256 - 128).astype(np.int8)),
    "u8": pa.array((K % 256).astype(np.uint8)),
    "i16": pa.array((K * 163 - 32768).astype(np.int16)),
    "u16": pa.array((K * 163).astype(np.uint16)),
    "i32": pa.array((K * 10_000_000 - 2**31).astype(np.int32)),
    "u32": pa.array((K * 10_000_000).astype(np.uint32)),
    "i64": pa.array(K * 20_000_000_000_000_000 - 2**62),
    "u64": pa.array(K.astype(np.uint64) * np.uint64(40_000_000_000_000_000)),
    "f16": pa.array(HALF, mask=MISSING),
    "f32": pa.array(W.astype(np.float32)),
    "on": pa.array(K % 3 == 0, mask=MISSING),
    "cents": decimals(2, pa.decimal128(7, 2), K - 200),
    "micro": decimals(6, pa.decimal128(16, 6), K * 1_000_003 - 5),
    "huge": decimals(20, pa.decimal128(38, 20), [int(k) * 10**33 + 12345678901234567 for k in K - 200]),
    "wide": decimals(3, pa.decimal256(60, 3), K),
    "text": pa.array(["motor"] * N),
    "empty": pa.array([None] * N, pa.float64()),
    "nested": pa.array([[[1.0, 2.0]]] * N),
    "pairs": pa.array([[("a", 1.0)]] * N, pa.map_(pa.string(), pa.float64())),
    "points": pa.array([[{"x": float(k), "y": -float(k)}, {"x": 0.5, "y": None}] for k in K]),
}
pq.write_table(
    pa.table(TYPES),
    "types.parquet",
    compression="zstd",
    row_group_size=150,
    store_decimal_as_integer=True,
    write_statistics=False,
)

# Encodings other than dictionaries, in pages of version 2.
ENCODINGS = {
    "delta32": pa.array((K * K % 1000 - 400).astype(np.int32), mask=MISSING),
    "delta64": pa.array(START_NS + COUNT * 1_000_000),
    "split64": pa.array(W, mask=MISSING),
    "split32": pa.array(W.astype(np.float32)),
    "split16": pa.array(HALF, mask=MISSING),
    "plain": pa.array(U),
    "bits": pa.array(K % 3 == 0, mask=MISSING),
}
SPLIT = "BYTE_STREAM_SPLIT"
pq.write_table(
    pa.table(ENCODINGS),
    "encodings.parquet",
    compression="none",
    data_page_version="2.0",
    data_page_size=1000,
    write_batch_size=50,
    use_dictionary=False,
    column_encoding={
        "delta32": "DELTA_BINARY_PACKED",
        "delta64": "DELTA_BINARY_PACKED",
        "split64": SPLIT,
        "split32": SPLIT,
        "split16": SPLIT,
        "plain": "PLAIN",
        "bits": "RLE",
    },
)

# Columns as LeRobot's data sets have them: two episodes of lists with the same number of elements.
pairs = np.stack([W, I], axis=1).astype(np.float32)
action = pa.array([[float(u), float(-u)] if k != 5 else None for k, u in enumerate(U.astype(np.float32))])
LEROBOT = {
    "observation.state": pa.FixedSizeListArray.from_arrays(pa.array(pairs.ravel()), 2),
    "action": action.cast(pa.list_(pa.float32())),
    "timestamp": pa.array((K % 200 / 500).astype(np.float32)),
    "frame_index": pa.array(K % 200),
    "episode_index": pa.array(K // 200),
    "index": pa.array(K),
    "varying": pa.array([[1.0] * (2 + (k == 170)) for k in K]),
    "frames": pa.array([[0.0] * 2000 if k == 0 else None for k in K]),
}
pq.write_table(pa.table(LEROBOT), "lerobot.parquet", row_group_size=160)

# Timestamps of 96 bits, and the remaining codecs.
small = {"t": pa.array(START_NS + COUNT[:40] * 1_000_000, pa.timestamp("ns")), "u": pa.array(U[:40])}
pq.write_table(pa.table(small), "int96.parquet", use_deprecated_int96_timestamps=True)
for codec in ("gzip", "brotli", "lz4"):
    pq.write_table(pa.table(small), f"{codec}.parquet", compression=codec)
