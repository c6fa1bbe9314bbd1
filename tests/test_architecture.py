"""The plan of the house, held: which way imports run, where guests live, how long a file may get."""

import ast
import itertools
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
LONGEST_FILE = 400

# From left to right: a room may import itself and anything to its left. Rooms in one tuple do not see each other.
ROD = [
    ("array",),
    ("measurement", "measured_law", "spline", "moment_curve"),
    ("midline",),
    ("characteristic", "compliance_law"),
    ("stiffness_law",),
    ("law_prior",),
    ("laws", "section", "support"),
    ("discretisation",),
    ("reduction",),
    ("newton",),
    ("path",),
    ("equilibrium",),
    ("iteration", "bending_test"),
    ("parameters",),
    ("sensitivity",),
    ("inverse", "balance", "paper_fit"),
    ("paper",),
]
INSIDE = {
    "rod.inverse": [
        ("prediction", "noise", "force_noise"),
        ("camera", "cause", "common_errors"),
        ("simulation", "observation"),
        ("linearised", "laws"),
        ("base",),
        ("extension",),
        ("bending", "step"),
        ("sensitivities",),
        ("fit",),
        ("base_fit", "photo_fit"),
        ("mean_law",),
        ("gains",),
        ("estimate",),
    ],
    "rod.balance": [("moment_points",), ("moment_regression",), ("graph",)],
    "pipeline.faults": [("record", "stuck_forces"), ("input",)],
    "pipeline.diagnosis": [
        ("causes", "statistics"),
        ("fits",),
        ("posterior",),
        ("explanations",),
        ("plans",),
        ("words", "rediscovery"),
        ("presentation",),
        ("diagnose",),
    ],
    "pipeline.diagnosis.statistics": [
        ("score", "twins", "gain"),
        ("pairs",),
    ],
    "pipeline.diagnosis.fits": [
        ("search", "extended", "maps"),
        ("workbench",),
        ("identified_again", "heldout", "force_breaks", "outlier"),
    ],
    "pipeline.diagnosis.posterior": [
        ("explanation", "products"),
        ("error_grid",),
        ("unknowns",),
        ("evidence", "hypotheses"),
        ("weigh", "detectable", "mixture"),
    ],
    "pipeline.diagnosis.explanations": [
        ("candidates", "refit"),
        ("forms",),
        ("free_profile",),
        ("single_cause", "pair_fits"),
        ("search",),
        ("conclusion",),
    ],
    "pipeline.diagnosis.presentation": [("leftover", "named", "table", "findings"), ("part",)],
    "pipeline.diagnosis.plans": [("plan",), ("next_experiment",), ("design",)],
    "pipeline.vision": [
        ("guard",),
        ("photo_file",),
        ("median", "polyline", "photo", "render"),
        ("evidence",),
        ("rough",),
        ("scale", "search"),
        ("bearings", "centerline", "preview"),
        ("judgement",),
        ("by_hand",),
        ("segmentation",),
        ("series_search", "still_ground"),
        ("what_moves",),
        ("shots", "single"),
        ("stated_width",),
        ("series",),
    ],
    "pipeline.vision.scale": [("plane",), ("calibration", "corners", "plane_fit"), ("board",)],
    "pipeline.vision.search": [
        ("strips", "backdrop"),
        ("crosscut",),
        ("closeup",),
        ("candidates",),
        ("ends",),
        (
            "beyond",
            "border",
        ),
    ],
    "pipeline.vision.bearings": [("rim",), ("rings", "cut"), ("covers",), ("cover_size", "steady")],
    "pipeline.vision.centerline": [
        ("curvature", "smoothing", "ground_waves"),
        ("edge_profile",),
        ("curve_fit", "edges", "axes_of_series"),
        ("midline", "continuation"),
        ("path", "refusal"),
        ("measurement", "side"),
    ],
    "pipeline.vision.render": [
        ("lens", "lighting", "sensor", "sheath"),
        ("ground",),
        ("strand",),
        ("clutter",),
        ("scene",),
    ],
}
PIPELINE = [
    ("threads",),
    ("rounding",),
    ("units",),
    ("messages",),
    ("errors", "records"),
    ("settings",),
    ("result",),
    ("intake",),
    ("vision",),
    ("faults",),
    ("identify",),
    ("diagnosis",),
    ("simulate", "identified_model"),
    ("predict", "compare"),
    ("report",),
    ("assembly",),
    ("run",),
    ("batch",),
    ("cli", "door"),
]
GUESTS = {
    "cv2": {"vision"},
    "skimage": {"vision"},
    "PIL": {"vision"},
    "pandas": {"intake", "report"},
    "matplotlib": {"report"},
    "jinja2": {"report"},
    "dask": {"batch"},
    "distributed": {"batch"},
    "click": {"cli"},
    "rich": {"cli"},
    "pydantic": {"settings", "result", "run", "batch", "cli"},
}
SOURCES = sorted(itertools.chain((ROOT / "rod").rglob("*.py"), (ROOT / "pipeline").rglob("*.py")))


def imports(path: Path) -> set[str]:
    """Full names of everything a file imports, wherever in the file the import stands."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found.update(alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative imports hide where they go"
            found.update(f"{node.module}.{alias.name}" for alias in node.names)
    return found


def room(path: Path) -> tuple[str, str]:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return parts[0], parts[1]


def test_imports_run_from_right_to_left_only():
    for path in SOURCES:
        runs_left(path)


def runs_left(path):
    """In a room of a plan, and imports only from rooms to its left."""
    package, here = room(path)
    if here in ("__init__", "__main__"):
        return
    order = {name: rank for rank, names in enumerate(ROD if package == "rod" else PIPELINE) for name in names}
    assert here in order, (
        f"{here} has no place in the plan of {package}: put it in here and in fixtures/readme/house.md"
    )
    for name in imports(path):
        top, _, rest = name.partition(".")
        target = rest.split(".")[0]
        assert not (package == "rod" and top == "pipeline"), f"{path} imports {name}"
        if top == package and target in order and target != here:
            assert order[target] < order[here], f"{path} imports {name}, which is not to its left"
        if top in GUESTS:
            assert here in GUESTS[top], f"{top} is a guest of {GUESTS[top]} alone, not of {path}"
        assert package != "rod" or top in {"rod", "numpy", "scipy"} or top in STANDARD, f"{path} imports {name}"


@pytest.mark.parametrize("package", INSIDE)
def test_the_files_of_a_package_have_an_order_too(package):
    order = {name: rank for rank, names in enumerate(INSIDE[package]) for name in names}
    folder = ROOT / package.replace(".", "/")
    for path in folder.rglob("*.py"):
        here = path.relative_to(folder).with_suffix("").parts[0]
        if here == "__init__":
            continue
        for name in imports(path):
            target = name.removeprefix(package + ".").split(".")[0]
            if name.startswith(package + ".") and target != here:
                assert order[target] < order[here], f"{here} imports {name}, which is not to its left"


STANDARD = {
    "__future__",
    "abc",
    "collections",
    "copy",
    "dataclasses",
    "enum",
    "functools",
    "itertools",
    "math",
    "typing",
}


def test_no_file_swallows_the_library():
    files = (path for top in ("rod", "pipeline", "tests", "fixtures") for path in (ROOT / top).rglob("*.py"))
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in files}
    assert len(lines) > 500
    assert {path: count for path, count in lines.items() if count > LONGEST_FILE} == {}, "split it by noun"


def test_no_room_is_a_lumber_room():
    lumber = {"utils", "helpers", "common", "misc", "util", "helper"}
    assert not [p for p in SOURCES if p.stem in lumber or p.parent.name in lumber]
