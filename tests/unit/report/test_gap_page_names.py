"""The page reads what the diagnosis writes: a field that was renamed is found here, not by who asks for a page."""

import re
from dataclasses import fields
from importlib.resources import files

from rig.gap.raw_tests.signature import Signature

PAGE = files("rig.report").joinpath("gap_page.html.jinja").read_text(encoding="utf-8")


def test_a_signature_is_read_by_the_names_that_it_has() -> None:
    used = set(re.findall(r"\braw\.(\w+)", PAGE))
    assert used
    assert used <= {field.name for field in fields(Signature)}
