"""result.json and its schema: every field says what it is, further ones are passed over, versions are named."""

import json
import re

import jsonschema
import pytest

from pipeline.diagnosis.causes.law import FORMS
from pipeline.errors import InputError
from pipeline.result import from_json, read_result, schema, to_json
from tests.pipeline.report.virtual_diagnosis import diagnosis_of
from tests.pipeline.report.virtual_result import measured_result

# end of a name -> unit in its description
UNITS = {"_per_m": "1/m", "_Nm2": "N m^2", "_Nm": "N m", "_N": "N", "_m": "m", "_px": "px", "_rad": "rad", "_mm": "mil"}


@pytest.fixture(scope="module")
def document():
    result = measured_result()
    named = diagnosis_of("named", result.photos)
    return json.loads(to_json(result.model_copy(update={"diagnosis": named, "answer_": result.answer.stored()})))


def objects():
    whole = schema()
    return {"Result": whole, **whole["$defs"]}


def test_a_result_keeps_the_schema_and_so_does_one_with_more(document):
    validator = jsonschema.Draft202012Validator
    validator.check_schema(schema())
    validator(schema()).validate(document)
    more = {**document, "tomorrow": 1, "specimen": {**document["specimen"], "tomorrow": [1]}}
    validator(schema()).validate(more)
    assert all(part["additionalProperties"] is True for part in objects().values())


def test_the_schema_names_itself_and_is_asked_for(document):
    assert schema()["$id"] == "urn:cablebend:result:1"
    assert schema()["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    nameless = {name: value for name, value in document.items() if name != "schema"}
    with pytest.raises(jsonschema.ValidationError, match="'schema' is a required property"):
        jsonschema.validate(nameless, schema())
    with pytest.raises(ValueError, match="names no schema"):
        from_json(json.dumps(nameless))


def test_every_property_says_what_it_is_and_its_unit():
    told = [(part, name, text) for part, one in objects().items() for name, text in one["properties"].items()]
    assert [f"{part}.{name}" for part, name, text in told if not text.get("description")] == []
    ends = [(part, name, next((end for end in UNITS if name.endswith(end)), None), text) for part, name, text in told]
    assert [
        f"{part}.{name}"
        for part, name, end, text in ends
        if end and not re.search(rf"(^|\W){re.escape(UNITS[end])}", text.get("description", ""))
    ] == []


@pytest.mark.parametrize("version", ["cablebend/result/0", "cablebend/result/9"])
def test_a_result_of_another_version_is_refused_by_name(document, version, tmp_path):
    (tmp_path / "result.json").write_text(json.dumps({**document, "schema": version}))
    with pytest.raises(InputError, match=f"is of version {version}, and this program reads cablebend/result/1") as told:
        read_result(tmp_path)
    assert told.value.code == "result/version"


@pytest.mark.parametrize("form", range(4))
def test_a_plastic_set_is_the_form_that_its_label_says(document, form):
    """Its number once stood where now stands how soon the set slows down."""
    set_then = {"label": FORMS[form], "amount": 0.08, "std": 0.01, "at": float(form), "width": 2.0, "tuned": ["width"]}
    (read,) = read_with(document, set_then).forms
    assert (read.label, read.at, read.width, read.amount) == (FORMS[form], 0.0, 2.0, 0.08)


def test_a_set_that_slows_down_keeps_how_soon(document):
    slows = {"label": FORMS[1], "amount": 0.08, "std": 0.01, "at": 0.3, "width": 2.0, "tuned": ["at", "width"]}
    assert read_with(document, slows).forms[0].at == 0.3


def read_with(document, form):
    """The cause of a stored document that has a plastic set of that form, read back."""
    cause = {**document["diagnosis"]["causes"][0], "name": "plastic_set", "class": ["plastic_set"], "forms": [form]}
    stored = {**document, "diagnosis": {**document["diagnosis"], "causes": [cause]}}
    return from_json(json.dumps(stored)).diagnosis.causes[0]


def test_a_result_from_before_there_were_answers_has_one(document):
    earlier = from_json(json.dumps({name: value for name, value in document.items() if name != "answer"}))
    assert earlier.answer.method == "extended" and earlier.answer.usable


@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"kappa_per_m": lambda kappa: kappa[::-1]}, "does not increase"),
        ({"tangent_factor_Nm2": lambda factor: [*factor[:-1], factor[-1][:-1]]}, "rows of different lengths"),
        ({"pre_curvature_factor_per_m": lambda rest: [*rest, 0.0]}, "has not the length of the rows"),
        ({"moment_Nm": lambda moment: moment[:-1]}, "lists of different lengths"),
    ],
    ids=lambda value: "" if isinstance(value, str) else next(iter(value)),
)
def test_a_curve_whose_parts_do_not_fit_is_refused(document, changes, told):
    curve = document["inverse"]["curve"]
    columns = {
        "tangent_factor_Nm2": [[1e-4, 0.0]] * len(curve["kappa_per_m"]),
        "pre_curvature_factor_per_m": [0.1, 0.2],
    }
    whole = {**curve, **columns}
    from_json(json.dumps({**document, "inverse": {**document["inverse"], "curve": whole}}))
    damaged = {**whole, **{name: change(whole[name]) for name, change in changes.items()}}
    with pytest.raises(ValueError, match=told):
        from_json(json.dumps({**document, "inverse": {**document["inverse"], "curve": damaged}}))
