"""Specimen folders as they are found on disk: clean, messy, linked, hostile."""

import hashlib
import os
import unicodedata

import pytest

from pipeline.errors import InputError
from pipeline.intake.folder import find_specimens, find_undescribed, read_specimen
from pipeline.intake.photos import natural_key
from pipeline.settings.intake import IntakeSettings

SETTINGS = IntakeSettings()


def test_clean_folder(specimen_folder):
    specimen = specimen_folder().read()
    assert specimen.id == "cable-07"
    assert (specimen.length_m, specimen.diameter_m) == pytest.approx((0.181, 0.0046))
    assert specimen.camera.scale_px_per_m == pytest.approx(11_000.0)
    assert [step.image for step in specimen.steps] == [f"images/step_{n}.png" for n in range(3)]
    assert list(specimen.images) == [f"images/step_{n}.png" for n in range(3)]
    assert specimen.findings == ()  # that the log leaves the folder out of the names is not worth a word


def test_hashes_of_everything_that_was_read(specimen_folder):
    folder = specimen_folder()
    hashes = folder.read().hashes
    assert set(hashes) == {"specimen.toml", "force.csv", *(f"images/step_{n}.png" for n in range(3))}
    for name, digest in hashes.items():
        assert digest == hashlib.sha256((folder.path / name).read_bytes()).hexdigest()


def test_missing_photo_is_a_finding(specimen_folder):
    folder = specimen_folder()
    (folder.path / "images/step_1.png").unlink()
    specimen = folder.read()
    assert len(specimen.steps) == 3
    assert "images/step_1.png" not in specimen.images
    assert folder.message("photo/missing") == (
        "force.csv, line 5: photo 'step_1.png' of step 1 does not exist; the step keeps its force only"
    )


def test_pictures_of_a_telephone_are_to_be_converted(specimen_folder):
    log = "force_N,displacement_mm\n0.001,0\n2.3,4\n"
    folder = specimen_folder(log=log, photos=("images/IMG_0001.HEIC", "images/IMG_0002.HEIC"))
    with pytest.raises(InputError) as refused:
        folder.read()
    assert refused.value.sentence == (
        f"{folder.path}: has no photos, only pictures of other kinds: IMG_0001.HEIC, IMG_0002.HEIC; "
        "convert them to png or jpg at full size."
    )


def test_a_picture_of_a_telephone_among_others_is_named(specimen_folder):
    folder = specimen_folder()
    folder.write("images/step_1.HEIC", b"\0\0\0\x18ftypheic")
    assert "photo/other-kind" not in folder.codes()  # the same picture twice, as telephones keep it
    (folder.path / "images/step_1.png").unlink()
    assert folder.message("photo/other-kind") == (
        "pictures of a kind that is not read were not measured: images/step_1.HEIC; "
        "convert them to png or jpg at full size"
    )
    assert len(folder.read().images) == 2
    (folder.path / "images/step_1.HEIC").rename(folder.path / "images/step_1.jpg")  # converted, but not in the log
    log = folder.path / "force.csv"
    log.write_text(log.read_text().replace("step_1.png", "step_1.HEIC"))
    assert "photo 'step_1.HEIC' was taken to be images/step_1.jpg" in folder.message("photo/name")
    folder.write("images/step_1.HEIC", b"\0\0\0\x18ftypheic")
    log.write_text(log.read_text().replace("step_1.HEIC", "images/step_1.HEIC"))
    assert "images/step_1.jpg" in folder.read().images and "photo/other-kind" not in folder.codes()


def test_doubled_photos_are_told(specimen_folder):
    folder = specimen_folder()
    folder.write("images/step_2.png", (folder.path / "images/step_1.png").read_bytes())
    assert folder.message("photo/doubled") == (
        "the same picture under several names: images/step_1.png, images/step_2.png"
    )
    folder.write("images/step_0.png", (folder.path / "images/step_1.png").read_bytes())
    told = "the same picture under several names: images/step_0.png, images/step_1.png, images/step_2.png"
    assert folder.message("photo/doubled") == told
    twice = specimen_folder(log=(folder.path / "force.csv").read_text().replace("step_2.png", "step_1.png"), name="b")
    assert "photo/doubled" in twice.codes()
    for name in ("step_0", "step_1", "step_2"):
        folder.write(f"images/{name}.png", b"")
    assert "photo/doubled" not in folder.codes()  # none of them is a picture


@pytest.mark.parametrize(
    "written", ["images\\step_1.png", "STEP_1.PNG", "Images/Step_1.png", "step_1", "./images/step_1.png"]
)
def test_names_are_found_as_people_write_them(written, specimen_folder):
    log = (specimen_folder().path / "force.csv").read_text().replace("step_1.png", written)
    folder = specimen_folder(log=log, name="other")
    assert len(folder.read().images) == 3


def test_accents_put_together_otherwise_are_the_same_name(specimen_folder):
    """A Mac writes the names of files in parts, u and its two dots; a spreadsheet writes one letter."""
    photos = [unicodedata.normalize("NFD", f"images/Stück_{n}.png") for n in range(3)]
    log = (specimen_folder().path / "force.csv").read_text().replace("step_", "Stück_")
    folder = specimen_folder(log=log, photos=photos, name="mac")
    assert [step.image for step in folder.read().steps] == photos


def test_natural_order():
    names = ["bild_10.png", "Bild_2.png", "bild_1.png", "a/bild_3.png", "bild.png", "bild_2b.png"]
    expected = ["a/bild_3.png", "bild.png", "bild_1.png", "Bild_2.png", "bild_2b.png", "bild_10.png"]
    assert sorted(names, key=natural_key) == expected


def test_photos_without_names_go_by_natural_order(specimen_folder):
    log = (specimen_folder().path / "force.csv").read_text()
    log = "\n".join(",".join(line.split(",")[:-1]) for line in log.splitlines())
    photos = ("bilder/bild_2.jpg", "bilder/bild_10.jpg", "bilder/bild_1.jpg")
    folder = specimen_folder(log=log, photos=photos, name="unnamed")
    assert [step.image for step in folder.read().steps] == [
        "bilder/bild_1.jpg",
        "bilder/bild_2.jpg",
        "bilder/bild_10.jpg",
    ]
    assert "photo/inferred" in folder.codes()


def test_photos_without_names_by_step_numbers(specimen_folder):
    log = (specimen_folder().path / "force.csv").read_text()
    log = "\n".join(",".join(line.split(",")[:-1]) for line in log.splitlines())
    folder = specimen_folder(log=log, photos=("images/s_0.png", "images/s_2.png"), name="unnamed")
    assert [step.image for step in folder.read().steps] == ["images/s_0.png", None, "images/s_2.png"]
    assert [f.level for f in folder.read().findings if f.code == "photo/inferred"] == ["warning"]


def test_numbers_in_the_names_go_before_their_order(specimen_folder):
    """The log counts unloading down again: in natural order, photo 2 was given to step 10."""
    rows = [(0, 0.0, 0.0), (10, 4.0, 2.3), (30, 8.0, 2.9), (2, 3.0, 2.1)]
    log = "step,displacement_mm,force_N\n" + "".join(f"{step},{d},{f}\n" for step, d, f in rows)
    folder = specimen_folder(log=log, photos=[f"images/step_{n}.png" for n in (0, 2, 10, 30)], name="unnamed")
    assert [step.image for step in folder.read().steps] == [f"images/step_{n}.png" for n in (0, 10, 30, 2)]
    folder = specimen_folder(log=log, photos=[f"images/step_{n}.png" for n in (0, 1, 2, 30)], name="other")
    assert folder.message("photo/number").startswith("images/step_2.png was given to step 30, but its name has the")
    folder = specimen_folder(log=log, photos=[f"images/IMG_{n}.png" for n in (41, 42, 43, 44)], name="counted")
    assert "photo/number" not in folder.codes()


def test_photos_in_the_only_folder_within_images_are_read(specimen_folder):
    folder = specimen_folder(photos=[f"images/DCIM/step_{n}.png" for n in range(3)])
    assert list(folder.read().images) == [f"images/DCIM/step_{n}.png" for n in range(3)]
    folder.write("images/again/step_0.png", b"\x89PNG")
    with pytest.raises(InputError, match=r"move the photos from images/DCIM, images/again into its folder images"):
        folder.read()


def test_thumbnails_system_files_and_calibration_are_no_photos(specimen_folder):
    more = """
    [force_log]
    file = "force.csv"
    """
    toml = """
[specimen]
length_mm = 181.0
diameter_mm = 4.6
[camera]
calibration = "calibration"
board = {columns = 9, rows = 6, square_mm = 10.0}
"""
    extra = ["Thumbs.db", ".DS_Store", "._step_0.png", "thumb_step_0.png", "step_0_preview.png", "@eaDir/step_0.png"]
    extra = [f"images/{name}" for name in extra] + ["desktop.ini", "__MACOSX/step_0.png", "calibration/board_1.png"]
    folder = specimen_folder(toml=toml, more=more)
    for name in extra:
        folder.write(name, name)
    specimen = folder.read()
    assert len(specimen.images) == 3
    assert "calibration/board_1.png" in specimen.hashes
    assert "photo/unused" not in folder.codes()


def test_photos_that_belong_to_no_step_are_told(specimen_folder):
    folder = specimen_folder()
    folder.write("images/test shot.jpg", "x")
    assert "images/test shot.jpg" in folder.message("photo/unused")


def test_umlauts_and_blanks_in_paths(specimen_folder):
    log = (specimen_folder().path / "force.csv").read_text().replace("step_1.png", "Stufe Größe 1.png")
    folder = specimen_folder(log=log, photos=("images/step_0.png", "images/Stufe Größe 1.png"), name="Prüfling Nr 7")
    assert folder.read().id == "Prüfling Nr 7"
    assert "images/Stufe Größe 1.png" in folder.read().images


def test_force_log_of_another_name(specimen_folder):
    folder = specimen_folder(log=None)
    folder.write("Kraft Messung.TXT", (specimen_folder(name="b").path / "force.csv").read_bytes())
    assert "log/file-inferred" in folder.codes()


@pytest.mark.parametrize("how", ["..", "absolute", "link to a file", "link to a folder"])
def test_photos_outside_the_folder_are_not_read(how, specimen_folder, tmp_path):
    secret = tmp_path / "secret" / "step_1.png"
    secret.parent.mkdir()
    secret.write_text("secret")
    folder = specimen_folder()
    (folder.path / "images/step_1.png").unlink()
    name = {"..": "../secret/step_1.png", "absolute": str(secret), "link to a folder": "linked/step_1.png"}.get(how)
    if how == "link to a file":
        (folder.path / "images/step_1.png").symlink_to(secret)
    elif how == "link to a folder":
        (folder.path / "linked").symlink_to(secret.parent)
    if name is not None:
        folder.write("force.csv", (folder.path / "force.csv").read_text().replace("step_1.png", name))
    specimen = folder.read()
    assert len(specimen.images) == 2
    assert hashlib.sha256(b"secret").hexdigest() not in specimen.hashes.values()
    assert {"photo/outside", "photo/missing"} & {finding.code for finding in specimen.findings}
    if how != "absolute":
        assert len(folder.read(allow_outside=True).images) == 3


@pytest.mark.parametrize("name", ["specimen.toml", "force.csv"])
def test_linked_description_or_log_is_refused(name, specimen_folder, tmp_path):
    folder = specimen_folder()
    outside = tmp_path / f"outside-{name}"
    (folder.path / name).rename(outside)
    (folder.path / name).symlink_to(outside)
    with pytest.raises(InputError) as refused:
        folder.read()
    assert refused.value.code == "file/outside"
    assert folder.read(allow_outside=True).id == "cable-07"


def test_a_linked_specimen_folder_is_a_specimen(specimen_folder, tmp_path):
    folder = specimen_folder()
    batch = tmp_path / "batch"
    batch.mkdir()
    for name in ("one", "two"):
        (batch / name).symlink_to(folder.path)
    assert find_specimens([batch], SETTINGS) == [batch / "one", batch / "two"]
    assert len(read_specimen(batch / "one", SETTINGS).images) == 3


def test_links_in_a_circle_end(specimen_folder, tmp_path):
    specimen_folder(name="batch/inner/cable")
    (tmp_path / "batch/inner/again").symlink_to(tmp_path / "batch")
    (tmp_path / "batch/self").symlink_to("self")
    found = find_specimens([tmp_path / "batch"], SETTINGS)
    assert found[0] == tmp_path / "batch/inner/cable"
    assert len(found) <= 2


def test_cyclic_links_in_the_place_of_files(specimen_folder):
    folder = specimen_folder()
    (folder.path / "images/step_1.png").unlink()
    (folder.path / "images/step_1.png").symlink_to("step_1.png")
    assert len(folder.read().images) == 2


def test_pipes_are_not_opened(specimen_folder):
    folder = specimen_folder()
    (folder.path / "images/step_1.png").unlink()
    os.mkfifo(folder.path / "images/step_1.png")
    specimen = folder.read()
    assert len(specimen.images) == 2  # and does not wait for a writer
    codes = {finding.code for finding in specimen.findings}
    assert "photo/not-a-file" in codes
    assert not any("'images/step_1.png' was taken to be" in finding.message for finding in specimen.findings)
    (folder.path / "force.csv").unlink()
    os.mkfifo(folder.path / "force.csv")
    with pytest.raises(InputError) as refused:
        folder.read()
    assert refused.value.code == "file/not-a-file"


def test_too_large_photo_is_a_finding(specimen_folder):
    folder = specimen_folder()
    folder.write("images/step_2.png", b"x" * 1000)
    assert folder.message("photo/too-large", photo_max_bytes=500).startswith("images/step_2.png: has 1000 bytes")
    assert len(folder.read(photo_max_bytes=500).images) == 2


def test_specimens_are_found_below_in_natural_order(specimen_folder, tmp_path):
    for name in ("b/cable_10", "b/cable_2", "a/deep/er/cable", "b/cable_2/nested"):
        specimen_folder(name=name)
    found = find_specimens([tmp_path, tmp_path / "b"], SETTINGS)
    assert [path.relative_to(tmp_path).as_posix() for path in found] == ["a/deep/er/cable", "b/cable_2", "b/cable_10"]


def test_a_folder_somebody_forgot_to_describe_is_noticed(specimen_folder, tmp_path):
    specimen_folder(name="batch/described")
    forgotten = specimen_folder(name="batch/forgotten")
    (forgotten.path / "specimen.toml").unlink()
    assert find_specimens([tmp_path / "batch"], SETTINGS) == [tmp_path / "batch/described"]
    assert find_undescribed([tmp_path / "batch"], SETTINGS) == [forgotten.path]


def test_a_description_in_capitals_is_told_as_such(specimen_folder, tmp_path):
    folder = specimen_folder(name="cable")
    (folder.path / "specimen.toml").rename(folder.path / "Specimen.TOML")
    with pytest.raises(InputError, match=r"holds Specimen\.TOML, but no specimen\.toml; write its name in small"):
        find_specimens([tmp_path / "cable"], SETTINGS)


def test_photos_in_a_folder_that_is_not_searched_are_told_with_its_name(specimen_folder):
    folder = specimen_folder(name="cable")
    (folder.path / "images").rename(folder.path / "pictures of May")
    with pytest.raises(InputError, match=r"move the photos from pictures of May into its folder images"):
        read_specimen(folder.path, SETTINGS)
