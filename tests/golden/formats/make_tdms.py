"""Writes the TDMS files of the tests: python3 make_tdms.py (needs numpy and nptdms).

npTDMS writes only little-endian contiguous segments with complete lists of objects. Other files are written byte by byte after
"TDMS File Format Internal Structure" of NI, and read again with npTDMS as a check.
"""
import struct
import numpy as np
from nptdms import ChannelObject, GroupObject, RootObject, TdmsFile, TdmsWriter
from nptdms.timestamp import TdmsTimestamp

HEADINGS = ["time_s", "voltage_V", "current_A", "speed_rad_s"]
UNITS = {"time_s": "s", "voltage_V": "V", "current_A": "A", "speed_rad_s": "rad/s"}
TABLE = np.loadtxt("recording.csv", delimiter=",", skiprows=1)
T, U, I, W = (TABLE[:, n].copy() for n in range(4))


def units(name, **more):
    return {"unit_string": UNITS[name], **more}


with TdmsWriter("recording.tdms", version=4713) as file:
    root = RootObject({"name": "bench", "supply_V": 24.0, "on": True, "NI_hidden": 1})
    group = GroupObject("motor", {"gear_ratio": 12, "made": np.datetime64("2026-01-02T03:04:05")})
    file.write_segment([root, group] + [ChannelObject("motor", n, c, units(n)) for n, c in zip(HEADINGS, (T, U, I, W))])

# Waveforms instead of a time: two groups, the second of which starts 0.25 s later, and a third with two lengths.
START = np.datetime64("2026-01-02T03:04:05.500")
LATER = np.datetime64("2026-01-02T03:04:05.750")
with TdmsWriter("waveform.tdms") as file:
    fast = {"wf_start_time": START, "wf_start_offset": 0.0, "wf_increment": 0.002, "wf_samples": 401}
    slow = {"wf_start_time": LATER, "wf_start_offset": 0.5, "wf_increment": 1 / 512, "wf_samples": 5}
    spectrum = {"wf_increment": 1.0, "wf_xunit_string": "Hz"}
    file.write_segment([ChannelObject("motor", n, c, units(n, **fast)) for n, c in zip(HEADINGS[1:], (U, I, W))])
    file.write_segment([
        ChannelObject("slow", "temperature", np.arange(5, dtype=np.float32) / 4, {"unit_string": "°C", **slow}),
        ChannelObject("mixed", "a", np.array([1, 2, 3], dtype=np.uint8)),
        ChannelObject("mixed", "b", np.array([4, 5], dtype=np.int64)),
        ChannelObject("mixed", "c", np.array([6, 7, 8], dtype=np.uint32)),
        ChannelObject("mixed", "magnitude", np.array([9, 10, 11], dtype=np.float64), spectrum),
    ])


def linear(slope, intercept):
    scale = {"Scale_Type": "Linear", "Linear_Slope": slope, "Linear_Y_Intercept": intercept}
    return {"NI_Scaling_Status": "unscaled", "NI_Number_Of_Scales": 1, **{f"NI_Scale[0]_{k}": v for k, v in scale.items()}}


POLYNOMIAL = {"Scale_Type": "Polynomial", "Polynomial_Coefficients_Size": 3, "Polynomial_Input_Source": 0}
POLYNOMIAL |= {f"Polynomial_Coefficients[{n}]": c for n, c in enumerate([0.5, -2.0, 0.25])}
CHAIN = linear(0.5, 1.0) | {f"NI_Scale[1]_{k}": v for k, v in POLYNOMIAL.items()} | {"NI_Number_Of_Scales": 2}
TABLE_SCALE = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Table"}
COUNTS = np.round(U * 1000).astype(np.int16)
STAMPS = START + np.arange(401) * np.timedelta64(2000, "us")
with TdmsWriter("scaled.tdms") as file:
    file.write_segment([
        GroupObject("motor", linear(0.125, 0.0)),
        ChannelObject("motor", "stamp", STAMPS),
        ChannelObject("motor", "voltage", COUNTS, {"unit_string": "V", **linear(0.001, 0.25)}),
        ChannelObject("motor", "current", I.astype(np.float32), CHAIN),
        ChannelObject("motor", "speed", np.arange(401, dtype=np.int32), {}),
        ChannelObject("motor", "done", W.astype(np.float32), {**linear(2.0, 0.0), "NI_Scaling_Status": "scaled"}),
        ChannelObject("motor", "sensor", COUNTS, TABLE_SCALE),
    ])
read = TdmsFile.read("scaled.tdms")["motor"]
assert np.array_equal(read["voltage"][:], COUNTS * 0.001 + 0.25)
assert np.array_equal(read["speed"][:], np.arange(401) * 0.125)

META, NEW, RAW, INTERLEAVED, BIG, DAQMX = 2, 4, 8, 32, 64, 128
NO_DATA, SAME = 0xFFFFFFFF, 0


class Writer:
    """Writer of segments, in either byte order."""

    def __init__(self, order):
        self.order = order
        self.bytes = b""

    def pack(self, form, *values):
        return struct.pack(self.order + form, *values)

    def text(self, text):
        return self.pack("I", len(text.encode())) + text.encode()

    def object(self, path, index, properties=()):
        """Metadata of an object: `index` is a number, or type and count, or bytes."""
        if isinstance(index, tuple):
            kind, count, *size = index
            index = self.pack("IIIQ", 28 if size else 20, kind, 1, count) + b"".join(self.pack("Q", n) for n in size)
        elif isinstance(index, int):
            index = self.pack("I", index)
        parts = self.text(path) + index + self.pack("I", len(properties))
        for name, kind, value in properties:
            parts += self.text(name) + self.pack("I", kind) + value
        return parts

    def segment(self, toc, objects, data, length=None):
        metadata = self.pack("I", len(objects)) + b"".join(objects) if toc & META else b""
        length = len(metadata) + len(data) if length is None else length
        toc |= BIG if self.order == ">" else 0
        self.bytes += b"TDSm" + struct.pack("<I", toc) + self.pack("IQQ", 4713, length, len(metadata)) + metadata + data

    def save(self, name):
        open(name, "wb").write(self.bytes)
        return TdmsFile.read(name, raw_timestamps=True)


# Interleaved big-endian data in two segments, the second without metadata.
big = Writer(">")
paths = [f"/'motor'/'{name}'" for name in HEADINGS]
objects = [big.object("/", NO_DATA, [("supply_V", 10, big.pack("d", 24.0))]), big.object("/'motor'", NO_DATA)]
objects += [big.object(path, (10, 100), [("unit_string", 0x20, big.text(UNITS[n]))]) for path, n in zip(paths, HEADINGS)]
big.segment(META | NEW | RAW | INTERLEAVED, objects, TABLE[:300].astype(">f8").tobytes())
big.segment(RAW | INTERLEAVED, [], TABLE[300:].astype(">f8").tobytes())
read = big.save("interleaved.tdms")["motor"]
assert all(np.array_equal(read[name][:], column) for name, column in zip(HEADINGS, (T, U, I, W)))

# Segments with changing lists of objects and layouts.
little = Writer("<")
A, B, C, TEXT = ("/'it''s'/'%s'" % name for name in ("a", "b", "c", "text"))
f64 = lambda *values: struct.pack(f"<{len(values)}d", *values)
i16 = lambda *values: struct.pack(f"<{len(values)}h", *values)
# Three chunks of a: 2 values, b: 1 value.
little.segment(META | NEW | RAW, [little.object("/", NO_DATA), little.object(A, (10, 2)), little.object(B, (2, 1))],
               f64(0, 1) + i16(-1) + f64(2, 3) + i16(-2) + f64(4, 5) + i16(-3))
# The same layout, without metadata.
little.segment(RAW, [], f64(6, 7) + i16(-4))
# The layout of b changes, that of a stays, c and text are added.
strings = struct.pack("<2I", 2, 5) + b"onetw"
little.segment(META | RAW, [little.object(B, (2, 3)), little.object(C, (0x21, 2)), little.object(TEXT, (0x20, 2, len(strings)))],
               f64(8, 9) + i16(-5, -6, -7) + b"\x01\x00" + strings)
# b has no data; a and c have their earlier layouts.
little.segment(META | RAW, [little.object(B, NO_DATA), little.object(TEXT, NO_DATA)], f64(10, 11) + b"\x00\x01")
# A new list with c and b only, and a new property of a, which has no data.
little.segment(META | NEW | RAW, [little.object(C, SAME), little.object(B, SAME), little.object(A, NO_DATA, [
    ("unit_string", 0x20, little.text("mV"))])], b"\x01\x01" + i16(-8, -9, -10))
# Properties only.
little.segment(META | NEW, [little.object("/'it''s'", NO_DATA, [("mass", 9, struct.pack("<f", 0.5))])], b"")
# A last chunk that is shorter: half of the values.
little.segment(META | NEW | RAW, [little.object(A, (10, 4)), little.object(B, (2, 4))],
               f64(12, 13, 14, 15) + i16(-11, -12, -13, -14) + f64(16, 17) + i16(-15, -16))
# A big-endian segment in a file of little-endian ones.
big = Writer(">")
big.segment(META | NEW | RAW, [big.object(A, (10, 1)), big.object(B, (2, 1))], struct.pack(">dh", 18, -17))
little.bytes += big.bytes
read = little.save("changing.tdms")["it's"]
assert np.array_equal(read["a"][:], np.arange(19)) and np.array_equal(read["b"][:], -np.arange(1, 18))
assert np.array_equal(read["c"][:], [1, 0, 0, 1, 1, 1]) and read["a"].properties["unit_string"] == "mV"

# All types, and raw data of an acquisition card in a segment of its own.
types = Writer("<")
kinds = [(1, "b"), (2, "h"), (3, "i"), (4, "q"), (5, "B"), (6, "H"), (7, "I"), (8, "Q"), (9, "f"), (10, "d"),
         (0x19, "f"), (0x1A, "d"), (0x21, "B")]
objects, data = [], b""
for code, form in kinds:
    limits = [0.1, -2.5] if form in "fd" else [1, 0] if code == 0x21 else \
        [-(2 ** (8 * struct.calcsize(form) - 1)), 2 ** (8 * struct.calcsize(form) - 1) - 1] if form.islower() else \
        [0, 2 ** (8 * struct.calcsize(form)) - 1]
    objects.append(types.object(f"/'types'/'{code}'", (code, 2)))
    data += struct.pack("<2" + form, *limits)
objects += [types.object("/'types'/'complex'", (0x08000C, 2)), types.object("/'types'/'double complex'", (0x10000D, 2))]
data += bytes(16 + 32)
objects += [types.object("/'types'/'stamp'", (0x44, 2))]
data += struct.pack("<QqQq", 2**63, 3_800_000_000, 2**62, 3_800_000_001)
types.segment(META | NEW | RAW, objects, data)
scaler = struct.pack("<5I", 3, 0, 0, 0, 0)
index = struct.pack("<IIIQI", 0x1269, 0xFFFFFFFF, 1, 3, 1) + scaler + struct.pack("<2I", 1, 2)
card = types.object("/'card'/'ai0'", index)
types.segment(META | NEW | RAW | DAQMX, [card], i16(1, 2, 3))
read = types.save("types.tdms")
assert read["types"]["8"][1] == 2**64 - 1 and read["card"]["ai0"].raw_scaler_data[0].tolist() == [1, 2, 3]
assert read["types"]["stamp"][1] == TdmsTimestamp(3_800_000_001, 2**62)
