"""What the bytes of a picture say before anything is decoded: kind, size, and whether the file is whole.

A decoder believes what a file claims: one wrong length in a png of 11 kB makes it ask for gigabytes, and a file that
was cut or changed comes back as a picture with grey areas. Sizes are read by Pillow's readers of each kind, which
decode nothing, and beside its limit on large pictures: the limit is a setting of `photo`, and its caller's.
"""

from __future__ import annotations

import io
import struct
import warnings
import zlib
from dataclasses import dataclass

from PIL import ImageFile
from PIL.BmpImagePlugin import BmpImageFile
from PIL.JpegImagePlugin import JpegImageFile
from PIL.PngImagePlugin import PngImageFile
from PIL.TiffImagePlugin import TiffImageFile

from pipeline.vision.guard import UNFORESEEN

PNG_BEGIN = b"\x89PNG\r\n\x1a\n"
READERS: tuple[tuple[bytes, str, type[ImageFile.ImageFile]], ...] = (
    (PNG_BEGIN, "png", PngImageFile),
    (b"\xff\xd8\xff", "jpg", JpegImageFile),
    (b"BM", "bmp", BmpImageFile),
    *((begin, "tif", TiffImageFile) for begin in (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")),
)
"""First bytes, kind and reader."""
BROKEN = (*UNFORESEEN, EOFError, OSError, SyntaxError, struct.error)
"""What a reader of files from anywhere raises on a damaged one."""


@dataclass(frozen=True)
class Header:
    """Kind (png, jpg, bmp, tif), width and height in px as stored; bytes that tell it, up to the pixels of a jpg."""

    kind: str
    width: int
    height: int
    length: int


def opened(data: bytes) -> ImageFile.ImageFile | None:
    """The picture for Pillow, its header read and nothing decoded; None if it is of no kind that is read.

    Raises
    ------
    Exception
        One of ``BROKEN`` if the file is damaged.
    """
    for begin, _, reader in READERS:
        if data.startswith(begin):
            return reader(io.BytesIO(data))
    return None


def read_header(data: bytes) -> Header | None:
    """Kind and size without decoding; None if no reader knows the file."""
    with warnings.catch_warnings():
        # Damaged metadata is no reason to refuse the pixels.
        warnings.simplefilter("ignore", UserWarning)
        try:
            image = opened(data)
            if image is None:
                return None
            with image:
                kind = next(kind for begin, kind, _ in READERS if data.startswith(begin))
                return Header(kind, image.width, image.height, image.fp.tell() if image.fp else 0)
        except BROKEN:
            return None


def is_whole(data: bytes, header: Header) -> bool:
    """True unless the file was cut."""
    if header.kind == "jpg":
        # The end mark cannot occur inside the coded picture, but a thumbnail before it has one of its own.
        return data.find(b"\xff\xd9", header.length) >= 0
    if header.kind == "png":
        return data.rfind(b"IEND") >= 0
    if header.kind == "bmp":
        return len(data) >= int.from_bytes(data[10:14], "little") + 1
    return True


def is_sound(data: bytes, kind: str) -> bool:
    """True unless a part of a png claims to be longer than the file or has other contents than it was written with.

    The other kinds have no checksums, and their decoders no trust in lengths.
    """
    if kind != "png":
        return True
    view, place, name = memoryview(data), len(PNG_BEGIN), b""
    while name != b"IEND":  # a chunk: length, four letters, contents and their checksum
        name = data[place + 4 : place + 8]
        end = place + 8 + int.from_bytes(data[place : place + 4], "big")
        if len(name) < 4 or end + 4 > len(data):
            return False
        ancillary = bool(name[0] & 0x20)  # small first letter: a remark, no part of the picture
        if not ancillary and zlib.crc32(view[place + 4 : end]) != int.from_bytes(data[end : end + 4], "big"):
            return False
        place = end + 4
    return True
