"""What the stages saw is gathered into a result: nothing that cost a photo is missing among the findings."""

import pytest

from pipeline.assembly import photo_findings
from pipeline.records import Finding, Rejected
from pipeline.report.words import Words

ENDS = "the file ends before the picture does; copy it again"


@pytest.mark.parametrize("reason", [ENDS, f"images/b.png: {ENDS}"])
def test_a_rejected_photo_is_a_finding_with_its_own_code_and_its_name_once(reason):
    found = photo_findings(Rejected("images/b.png", "photo/truncated", reason))
    assert found == (Finding("photo/truncated", "warning", f"images/b.png: {ENDS}"),)
    assert Words("de").said(found[0].message).language == "de"
