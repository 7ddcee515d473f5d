"""Readers of the images of a set: PNG and OpenEXR as the program writes them, and JPEG with Pillow."""

from __future__ import annotations

import io
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .camera import MOST_PIXELS
from .errors import imported, reading

_PNG = b"\x89PNG\r\n\x1a\n"
_UP = 2
_GREY, _RGB = 0, 2


def silhouette(data: bytes, path: object) -> NDArray[np.bool_]:
    """The mask (height, width) of a grey PNG of 8 bits: where it is brighter than the middle grey."""
    with reading(path, "a grey PNG of a set"):
        rows, _ = _rows(data, kinds={_GREY: 1})
    columns = np.flatnonzero(np.maximum.reduce(rows, axis=0))
    place = slice(columns[0], columns[-1] + 1) if len(columns) else slice(0)
    mask = np.zeros(rows.shape, np.bool_)
    np.greater(np.add.accumulate(rows[:, place], axis=0, dtype=np.uint8), 127, out=mask[:, place])
    return mask


def picture(data: bytes, path: object) -> NDArray[np.uint8]:
    """The pixels of a PNG or JPEG image of the scene: (height, width, 3), red first, or (height, width)."""
    with reading(path, "an image of a set"):
        if data[:8] != _PNG:
            return _jpeg(data)
        rows, channels = _rows(data, kinds={_GREY: 1, _RGB: 3})
        pixels: NDArray[np.uint8] = np.add.accumulate(rows, axis=0, dtype=np.uint8)
        return pixels if channels == 1 else pixels.reshape(len(pixels), -1, channels)


def _jpeg(data: bytes) -> NDArray[np.uint8]:
    pillow = imported("PIL.Image", "a set with JPEG images", "pillow")
    with pillow.open(io.BytesIO(data)) as image:
        return np.array(image)


def _rows(data: bytes, kinds: dict[int, int]) -> tuple[NDArray[np.uint8], int]:
    """Rows as differences to the rows above, and channels of a PNG of 8 bits of one of these kinds."""
    if data[:8] != _PNG or data[12:16] != b"IHDR":
        raise ValueError("it does not begin as a PNG")
    width, height, depth, kind, *other = struct.unpack_from(">IIBBBBB", data, 16)
    fits = 0 < width <= MOST_PIXELS and 0 < height <= MOST_PIXELS
    if not fits or depth != 8 or kind not in kinds or any(other):
        raise ValueError(f"it has {width} x {height} pixels of {depth} bits, kind {[kind, *other]}")
    channels = kinds[kind]
    row_bytes = 1 + width * channels
    # a damaged file must not unpack to more than its header says; zlib's own sum, of the unpacked bytes, is left out
    # because the sum of the packed ones is much quicker
    raw = zlib.decompressobj(-zlib.MAX_WBITS).decompress(_image_data(data)[2:], height * row_bytes)
    if len(raw) != height * row_bytes:
        raise ValueError(f"it holds {len(raw)} bytes instead of {height * row_bytes}")
    rows = np.frombuffer(raw, np.uint8).reshape(height, row_bytes)
    filters, rows = rows[:, 0], rows[:, 1:]
    if not filters.any():
        # the first row is its difference to nothing
        return np.diff(rows, axis=0, prepend=np.uint8(0)), channels
    if filters[0] not in (0, _UP) or (filters[1:] != _UP).any():
        raise ValueError("its rows are filtered in another way than those of skiagraph")
    return rows, channels


def _image_data(data: bytes) -> bytes:
    parts, at = [], 8
    while at + 8 <= len(data):
        length, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"IDAT":
            end = at + 8 + length
            if zlib.crc32(data[at + 4 : end]).to_bytes(4, "big") != data[end : end + 4]:
                raise ValueError("its bytes are not those that were written")
            parts.append(data[at + 8 : end])
        at += 12 + length
    return parts[0] if len(parts) == 1 else b"".join(parts)


_EXR_TYPES: dict[int, np.dtype[Any]] = {0: np.dtype("<u4"), 1: np.dtype("<f2"), 2: np.dtype("<f4")}
_NO_COMPRESSION, _RLE = range(2)


def exr(data: bytes) -> tuple[dict[str, NDArray[Any]], tuple[slice, slice], tuple[int, int]]:
    """The channels of an OpenEXR file by name, their place in the image (rows, columns), and its (height, width)."""
    magic, version = struct.unpack_from("<II", data)
    if magic != 20000630 or version & ~0xFF & ~0x400:
        raise ValueError("it is no OpenEXR file of one image in rows")
    attributes, at = _exr_header(data)
    channels = _exr_channels(attributes["channels"])
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["displayWindow"])
    width, height = right - left + 1, bottom - top + 1
    compression = attributes["compression"][0]
    # rows and columns of the image are made by the display window
    if not (x0 <= left and right <= x1 < x0 + MOST_PIXELS and y0 <= top and bottom <= y1 < y0 + MOST_PIXELS):
        raise ValueError(f"its data window {left, top, right, bottom} is not in its display window {x0, y0, x1, y1}")
    if not (0 < width <= MOST_PIXELS and 0 < height <= MOST_PIXELS) or compression not in (_NO_COMPRESSION, _RLE):
        raise ValueError(f"its data window has {width} x {height} pixels, its compression is {compression}")
    row_bytes = width * sum(dtype.itemsize for _, dtype in channels)
    # two bytes hold a run of at most 128
    if height * row_bytes > 64 * len(data):
        raise ValueError("it is too short for its data window")
    table = np.empty((height, row_bytes), np.uint8)
    for offset in struct.unpack_from(f"<{height}Q", data, at):
        y, size = struct.unpack_from("<iI", data, offset)
        if not 0 <= y - top < height:
            raise ValueError(f"it has a row {y} outside of its data window")
        table[y - top] = _exr_row(data[offset + 8 : offset + 8 + size], row_bytes)
    found: dict[str, NDArray[Any]] = {}
    column = 0
    for name, dtype in channels:
        end = column + width * dtype.itemsize
        found[name] = np.ascontiguousarray(table[:, column:end]).view(dtype)
        column = end
    place = (slice(top - y0, bottom - y0 + 1), slice(left - x0, right - x0 + 1))
    return found, place, (y1 - y0 + 1, x1 - x0 + 1)


def _exr_header(data: bytes) -> tuple[dict[str, bytes], int]:
    attributes: dict[str, bytes] = {}
    at = 8
    while data[at] != 0:
        name, kind, _ = data[at : at + 1024].split(b"\0", 2)
        at += len(name) + len(kind) + 2
        (size,) = struct.unpack_from("<I", data, at)
        attributes[name.decode()] = data[at + 4 : at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def _exr_channels(packed: bytes) -> list[tuple[str, np.dtype[Any]]]:
    channels: list[tuple[str, np.dtype[Any]]] = []
    at = 0
    while packed[at] != 0:
        end = packed.index(b"\0", at)
        (kind,) = struct.unpack_from("<I", packed, end + 1)
        channels.append((packed[at:end].decode(), _EXR_TYPES[kind]))
        at = end + 17
    return channels


def _exr_row(packed: bytes, size: int) -> NDArray[np.uint8]:
    """A row; one that compression would not shorten is stored as it is."""
    if len(packed) == size:
        return np.frombuffer(packed, np.uint8)
    shuffled = _run_lengths(packed, size)
    if len(shuffled) != size:
        raise ValueError(f"a row has {len(shuffled)} bytes instead of {size}")
    # every byte is stored as its difference to the one before, plus 128; then even and odd bytes are apart
    steps = np.frombuffer(shuffled, np.uint8).copy()
    steps[1:] += 128
    values = np.add.accumulate(steps, dtype=np.uint8)
    out = np.empty(size, np.uint8)
    out[0::2], out[1::2] = values[: (size + 1) // 2], values[(size + 1) // 2 :]
    return out


def _run_lengths(packed: bytes, size: int) -> bytes:
    out, at = bytearray(), 0
    while at < len(packed) and len(out) <= size:
        count = packed[at]
        if count < 128:
            out += packed[at + 1 : at + 2] * (count + 1)
            at += 2
        else:
            out += packed[at + 1 : at + 257 - count]
            at += 257 - count
    return bytes(out)
