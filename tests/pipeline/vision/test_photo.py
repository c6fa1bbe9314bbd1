"""One loader for every photo; Pillow is the other witness for what a file shows."""

import os
import struct
import subprocess
import sys
import zlib
from io import BytesIO
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image, ImageOps

from pipeline.records import Rejected
from pipeline.settings.vision import PhotoSettings
from pipeline.vision.photo import Photo, decode_photo, load_photo

SETTINGS = PhotoSettings()


def picture(dtype: type, channels: int) -> np.ndarray:
    rng = np.random.default_rng(1)
    top = 255 if dtype is np.uint8 else 65535
    shape = (40, 64) if channels == 1 else (40, 64, channels)
    return rng.integers(0, top, shape, endpoint=True).astype(dtype)


def coded(pixels: np.ndarray, suffix: str) -> bytes:
    done, data = cv2.imencode(suffix, pixels)
    assert done
    return data.tobytes()


@pytest.mark.parametrize("suffix", [".png", ".tif"])
@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
@pytest.mark.parametrize("channels", [1, 3, 4])
def test_lossless_files_come_back_as_stored_without_alpha(suffix: str, dtype: type, channels: int) -> None:
    pixels = picture(dtype, channels)
    photo = decode_photo(coded(pixels, suffix), SETTINGS, name="a")
    assert isinstance(photo, Photo)
    np.testing.assert_array_equal(photo.pixels, pixels if channels < 4 else pixels[..., :3])
    assert photo.pixels.dtype == dtype
    assert (photo.channels, photo.size) == (1 if channels == 1 else 3, (64, 40))


@pytest.mark.parametrize("channels", [1, 3])
def test_bmp_comes_back_as_stored(channels: int) -> None:
    photo = decode_photo(coded(picture(np.uint8, channels), ".bmp"), SETTINGS, name="a")
    assert isinstance(photo, Photo)
    expected = picture(np.uint8, channels)
    shown = photo.pixels if photo.pixels.ndim == expected.ndim else photo.pixels[..., 0]
    np.testing.assert_array_equal(shown, expected)


@pytest.mark.parametrize(("bits", "peak"), [(8, 200), (10, 1000), (12, 4095), (14, 9000), (16, 60000)])
def test_bits_in_use_are_told_from_the_values(bits: int, peak: int) -> None:
    pixels = np.full((40, 40), peak // 3, np.uint16)
    pixels[3, 4] = peak
    photo = decode_photo(coded(pixels, ".png"), SETTINGS, name="a")
    assert isinstance(photo, Photo)
    assert (photo.bit_depth, photo.full_scale) == (bits, 2**bits - 1)


@pytest.mark.parametrize("orientation", range(1, 9))
@pytest.mark.parametrize(
    ("form", "mode"), [("JPEG", "L"), ("JPEG", "RGB"), ("TIFF", "L"), ("TIFF", "I;16"), ("PNG", "L")]
)
def test_photo_is_turned_as_its_orientation_says(orientation: int, form: str, mode: str) -> None:
    ramp = np.add.outer(np.arange(40) * 3, np.arange(64))
    stored = np.dstack([ramp, ramp // 2, ramp // 3]) if mode == "RGB" else ramp
    image = Image.fromarray(stored.astype(np.uint16 if mode == "I;16" else np.uint8))
    exif = Image.Exif()
    exif[0x0112] = orientation
    stream = BytesIO()
    image.save(stream, form, exif=exif, **({"quality": 100, "subsampling": 0} if form == "JPEG" else {}))
    photo = decode_photo(stream.getvalue(), SETTINGS, name="a")
    assert isinstance(photo, Photo)
    shown = np.asarray(ImageOps.exif_transpose(image if form != "JPEG" else Image.open(stream)))
    if form != "JPEG":
        image.getexif()[0x0112] = orientation
        shown = np.asarray(ImageOps.exif_transpose(image))
    shown = shown[..., ::-1] if mode == "RGB" else shown
    # two decoders of jpg may round differently by one level
    assert np.abs(photo.pixels.astype(int) - shown.astype(int)).max() <= (2 if form == "JPEG" else 0)


def test_variants_unknown_to_opencv_are_read_by_pillow() -> None:
    stream = BytesIO()
    Image.fromarray(picture(np.uint8, 1)).convert("1").save(stream, "TIFF")
    photo = decode_photo(stream.getvalue(), SETTINGS, name="a")
    assert isinstance(photo, Photo)
    assert set(np.unique(photo.pixels)) == {0, 255}


def test_path_outside_ascii_is_read(tmp_path: Path) -> None:
    path = tmp_path / "Prüfling Ω 07.png"
    path.write_bytes(coded(picture(np.uint8, 3), ".png"))
    photo = load_photo(path, SETTINGS)
    assert isinstance(photo, Photo)
    assert photo.name == path.name


def refused(data: bytes, settings: PhotoSettings = SETTINGS) -> str:
    outcome = decode_photo(data, settings, name="bad.jpg")
    assert isinstance(outcome, Rejected)
    assert outcome.image == "bad.jpg"
    assert len(outcome.reason) > 10
    return outcome.code


def test_empty_and_foreign_files_are_refused() -> None:
    assert refused(b"") == "photo/empty"
    assert refused(b"step;force\n0;1.5\n" * 20) == "photo/unreadable"
    stream = BytesIO()
    Image.fromarray(picture(np.uint8, 3)).save(stream, "GIF")
    assert refused(stream.getvalue()) == "photo/unreadable"


@pytest.mark.parametrize("suffix", [".jpg", ".png", ".bmp", ".tif"])
@pytest.mark.parametrize("share", [0.02, 0.3, 0.9])
def test_cut_files_are_refused(suffix: str, share: float) -> None:
    data = coded(picture(np.uint8, 3), suffix)
    assert refused(data[: int(share * len(data))]) in ("photo/truncated", "photo/unreadable")


def test_cut_jpg_with_a_whole_thumbnail_is_refused() -> None:
    thumbnail = coded(picture(np.uint8, 3)[:8, :8], ".jpg")
    whole = coded(picture(np.uint8, 3), ".jpg")
    segment = b"\xff\xe1" + struct.pack(">H", len(thumbnail) + 2) + thumbnail
    assert isinstance(decode_photo(whole[:2] + segment + whole[2:], SETTINGS, name="a"), Photo)
    assert refused(whole[:2] + segment + whole[2 : len(whole) // 2]) == "photo/truncated"


def bare_png(width: int, height: int) -> bytes:
    """Header of an enormous picture with hardly a pixel behind it."""
    chunks = [b"IHDR" + struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0), b"IDAT" + zlib.compress(b"0"), b"IEND"]
    coded_chunks = [struct.pack(">I", len(c) - 4) + c + struct.pack(">I", zlib.crc32(c)) for c in chunks]
    return b"\x89PNG\r\n\x1a\n" + b"".join(coded_chunks)


@pytest.mark.parametrize("side", [12_000, 14_000, 60_000])
def test_enormous_picture_is_refused_by_its_header(side: int) -> None:
    outcome = decode_photo(bare_png(side, side), SETTINGS, name="big")
    assert isinstance(outcome, Rejected)
    assert outcome.code == "photo/too-large"
    assert outcome.said.values["megapixels"] > SETTINGS.max_megapixels


def test_limits_are_settings() -> None:
    data = coded(picture(np.uint8, 1), ".png")
    assert refused(data, PhotoSettings(max_megapixels=0.001)) == "photo/too-large"
    assert refused(data, PhotoSettings(min_side_px=41)) == "photo/too-small"


def test_missing_file_and_folder_are_refused(tmp_path: Path) -> None:
    for path in (tmp_path / "none.png", tmp_path):
        outcome = load_photo(path, SETTINGS)
        assert isinstance(outcome, Rejected)
        assert outcome.code == "photo/missing"


def png_chunks(data: bytes) -> list[tuple[int, bytes, int]]:
    """Place, name and length of each chunk."""
    found, place = [], 8
    while place < len(data):
        length = int.from_bytes(data[place : place + 4], "big")
        found.append((place, data[place + 4 : place + 8], length))
        place += 12 + length
    return found


MEASURE = """
import resource, sys
from pathlib import Path
from pipeline.settings.vision import PhotoSettings
from pipeline.vision.photo import load_photo
used = lambda: resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
before = used()
print(getattr(load_photo(Path(sys.argv[1]), PhotoSettings()), "code", "read"), used() - before)
"""


def test_a_damaged_length_in_a_png_costs_no_memory(tmp_path: Path) -> None:
    data = bytearray(coded(picture(np.uint8, 3), ".png"))
    place = next(place for place, name, _ in png_chunks(data) if name == b"IDAT")
    data[place : place + 4] = struct.pack(">I", 0xFFFFFFF0)
    path = tmp_path / "damaged.png"
    path.write_bytes(data)
    done = subprocess.run([sys.executable, "-c", MEASURE, path], capture_output=True, text=True, check=True)
    outcome, megabytes = done.stdout.split()
    assert outcome == "photo/unreadable"
    assert float(megabytes) < 200.0  # the length asks for 4,300


def test_every_damaged_chunk_of_a_png_is_refused() -> None:
    whole = coded(np.vstack([picture(np.uint8, 3)] * 3), ".png")
    chunks = png_chunks(whole)
    assert [name for _, name, _ in chunks].count(b"IDAT") > 1  # the last rows are in a chunk of their own
    for place, _, length in chunks:
        for wrong in (0xFFFFFFF0, 0x7FFFFFFF, length + 100):
            damaged = whole[:place] + struct.pack(">I", wrong) + whole[place + 4 :]
            assert refused(damaged) in ("photo/unreadable", "photo/truncated")
        if length:
            changed = bytearray(whole)
            changed[place + 8 + length // 2] ^= 0x55
            assert refused(bytes(changed)) in ("photo/unreadable", "photo/too-large")


def test_a_damaged_remark_behind_the_pixels_of_a_png_is_no_reason_to_refuse_its_pixels() -> None:
    whole = coded(picture(np.uint8, 3), ".png")
    remark = b"tEXtComment\0hello"
    chunk = struct.pack(">I", len(remark) - 4) + remark + b"\0\0\0\0"  # a wrong checksum
    place = next(place for place, name, _ in png_chunks(whole) if name == b"IEND")
    assert isinstance(decode_photo(whole[:place] + chunk + whole[place:], SETTINGS, name="a"), Photo)


@pytest.mark.parametrize(("side", "megapixels"), [(12_000, "144"), (14_000, "196"), (60_000, "3600")])
def test_the_true_size_of_an_enormous_picture_is_told(side: int, megapixels: str) -> None:
    outcome = decode_photo(bare_png(side, side), SETTINGS, name="big")
    assert isinstance(outcome, Rejected)
    assert outcome.reason == f"the photo has {megapixels} Mpx, more than the limit of 120 Mpx"


def test_the_limit_on_megapixels_can_be_raised_beyond_that_of_the_library() -> None:
    width, height = 18_000, 10_000  # 180 Mpx; Pillow refuses more than 179
    done, data = cv2.imencode(".png", np.zeros((height, width), np.uint8), [cv2.IMWRITE_PNG_COMPRESSION, 1])
    assert done
    photo = decode_photo(data.tobytes(), PhotoSettings(max_megapixels=200.0), name="big")
    assert isinstance(photo, Photo)
    assert photo.size == (width, height)


def test_a_pipe_is_not_opened(tmp_path: Path) -> None:
    path = tmp_path / "pipe.png"
    os.mkfifo(path)
    outcome = load_photo(path, SETTINGS)  # waits for a writer for ever if it is opened
    assert isinstance(outcome, Rejected)
    assert outcome.reason == "the file cannot be opened (it is no ordinary file)"


def test_a_tif_of_absurd_tiles_is_refused() -> None:
    values = {256: 120, 257: 90, 258: 8, 259: 1, 262: 1, 277: 1, 322: 2**31, 323: 16, 324: 200, 325: 1000}
    entries = b"".join(struct.pack("<HHII", tag, 4, 1, value) for tag, value in values.items())
    data = b"II*\0" + struct.pack("<IH", 8, len(values)) + entries + bytes(20_000)
    assert refused(data) == "photo/unreadable"
