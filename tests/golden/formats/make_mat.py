"""Writes the MAT-files of the tests: python3 make_mat.py (needs numpy and scipy)."""
import struct
import numpy as np
from scipy.io import savemat

T = np.arange(5) * 0.001
MIXED = {
    "t": T,
    "u": np.array([[0.0], [1.5], [-2.25], [1 / 3], [1e-300]]),
    "i8": np.array([-128, 127, 0, 1, 2], dtype=np.int8),
    "u16": np.array([0, 65535, 1, 2, 3], dtype=np.uint16),
    "i32": np.array([-(2**31), 2**31 - 1, 0, 1, 2], dtype=np.int32),
    "i64": np.array([-(2**53), 2**53, 0, 1, 2], dtype=np.int64),
    "f32": np.array([0.5, 0.1, np.nan, np.inf, -np.inf], dtype=np.float32),
    "on": np.array([True, False, True, True, False]),
    "m": np.array([[1, 2], [3, 4], [5, 6], [7, 8], [9, 10]], dtype=float),
    "fs": 1000.0,
    "short": np.array([1.0, 2.0, 3.0]),
    "wide": np.zeros((2, 70)),
    "cube": np.zeros((2, 3, 4)),
    "thin": np.arange(5.0).reshape(1, 1, 5),
    "z": np.array([1 + 2j, 3]),
    "label": "motor",
    "mixed": np.array([1, "a"], dtype=object),
    "empty": np.zeros((0, 0)),
}
savemat("mixed_v6.mat", MIXED, do_compression=False, oned_as="row")
savemat("mixed_v7.mat", MIXED, do_compression=True, oned_as="column")
savemat("mixed_v4.mat", {"t": T, "u": 2 * T}, format="4")
savemat("tiny.mat", {"t": np.array([0.0, 0.5]), "s": {"w": np.array([1.0, 2.0])}}, do_compression=False)

signals = np.zeros((2,), dtype=[("values", object), ("label", object)])
signals[0] = (T * 2, "a")
signals[1] = (T * 3, "b")
DEEP = {"b": {"c": {"d": {"e": {"f": T}}}}}
savemat(
    "structs.mat",
    {
        "out": {"time": T, "signals": signals, "inner": {"more": {"w": T * 5}}},
        "deep": DEEP,
        "none": {},
    },
    do_compression=True,
)


class Big:
    """Writer of MAT elements in big-endian byte order, which scipy does not support."""

    def element(self, kind, data):
        if 0 < len(data) <= 4:
            return struct.pack(">HH", len(data), kind) + data.ljust(4, b"\0")
        return struct.pack(">II", kind, len(data)) + data + b"\0" * (-len(data) % 8)

    def array(self, name, cls, dims, kind, data, flags=0):
        parts = self.element(6, struct.pack(">II", cls | flags << 8, 0))
        parts += self.element(5, struct.pack(f">{len(dims)}i", *dims))
        parts += self.element(1, name.encode())
        parts += self.element(kind, data)
        return struct.pack(">II", 14, len(parts)) + parts


big = Big()
header = b"MATLAB 5.0 MAT-file, by hand".ljust(116) + b" " * 8 + b"\x01\x00" + b"MI"
body = big.array("t", 6, (3, 1), 9, struct.pack(">3d", 0, 0.25, 0.5))
body += big.array("u", 6, (1, 3), 3, struct.pack(">3h", -300, 0, 300))  # doubles stored as int16
body += big.array("b", 9, (3, 1), 2, bytes([1, 0, 1]), flags=2)  # logical
body += big.array("w", 7, (3, 1), 7, struct.pack(">3f", 1.5, -0.25, 3))
open("big_endian.mat", "wb").write(header + body)


class Little(Big):
    """Writer of MAT elements in little-endian byte order."""

    def element(self, kind, data):
        if 0 < len(data) <= 4:
            return struct.pack("<HH", kind, len(data)) + data.ljust(4, b"\0")
        return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)


# A timeseries as saved by MATLAB: an opaque array of class 17, and its contents in an array without a name.
little = Little()
parts = little.element(6, struct.pack("<II", 17, 0))
for text in (b"ts", b"MCOS", b"timeseries"):
    parts += little.element(1, text)
matrix = little.element(6, struct.pack("<II", 13, 0)) + little.element(5, struct.pack("<ii", 6, 1))
matrix += little.element(1, b"") + little.element(6, struct.pack("<6I", 0xDD000000, 2, 1, 1, 1, 1))
parts += struct.pack("<II", 14, len(matrix)) + matrix
header = b"MATLAB 5.0 MAT-file, by hand".ljust(116) + b" " * 8 + b"\x00\x01" + b"IM"
sub = little.element(6, struct.pack("<II", 9, 0)) + little.element(5, struct.pack("<ii", 1, 8))
sub += little.element(1, b"") + little.element(2, bytes(8))
open("opaque.mat", "wb").write(
    header + struct.pack("<II", 14, len(parts)) + parts + struct.pack("<II", 14, len(sub)) + sub
)
