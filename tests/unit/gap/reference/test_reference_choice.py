"""Which reference stands for the rig, and what is said when the model's fingerprint cannot."""

from dataclasses import replace

import numpy as np
import pytest
from conftest import ROOT

from rig.errors import ConfigError
from rig.gap.reference.build import outside_fingerprint
from rig.gap.reference.kinds import ReferenceKind, because, choose
from rig.model.fingerprint import Fingerprint
from rig.model.parameters import Model, load_model
from rig.model.response.fingerprint_check import fingerprint_checksum

RIG = load_model(ROOT / "configs" / "models" / "simulated.yaml")
KNOWN = Fingerprint(drive_mpa=(-0.2, 0.2), mean_mpa=(0.19, 0.21))
STAMPED = replace(RIG, fingerprint=replace(KNOWN, checksum=fingerprint_checksum(KNOWN, RIG)))
EDITED = replace(STAMPED, p0_mpa=0.25)
NEWER = replace(RIG, fingerprint=Fingerprint(version=4))


@pytest.mark.parametrize(
    ("model", "days", "kind"),
    [
        (STAMPED, 2, ReferenceKind.SESSIONS),
        (STAMPED, 1, ReferenceKind.SESSION),
        (STAMPED, 0, ReferenceKind.FINGERPRINT),
        (RIG, 0, ReferenceKind.SIMULATOR),
        (EDITED, 0, ReferenceKind.SIMULATOR),
        (NEWER, 0, ReferenceKind.SIMULATOR),
        (None, 1, ReferenceKind.SESSION),
    ],
)
def test_the_best_there_is(model: Model | None, days: int, kind: ReferenceKind) -> None:
    assert choose("auto", model, days) is kind


@pytest.mark.parametrize(
    ("model", "reason"),
    [(RIG, "the model file has none"), (EDITED, "changed after the identification"), (NEWER, "version 4")],
)
def test_a_fingerprint_that_is_asked_for_and_cannot_be_used_is_an_error_of_the_call(model: Model, reason: str) -> None:
    with pytest.raises(ConfigError, match=reason):
        choose("fingerprint", model, 0)


@pytest.mark.parametrize(("half", "lines"), [(0.2, 0), (0.235, 0), (0.245, 1)])
def test_records_beyond_what_the_fingerprint_has_seen_are_said(half: float, lines: int) -> None:
    drive = half * np.sin(np.linspace(0.0, 20.0, 1000))
    said = outside_fingerprint(KNOWN, [drive], [(0.2 + 0.5 * drive, 0.2 - 0.5 * drive)])
    assert len(said) == lines
    assert all("the fingerprint knows -0.2 to 0.2" in text for text in said.values())


def test_a_reference_that_there_is_not_is_an_error_of_the_call() -> None:
    with pytest.raises(ConfigError, match=r"reference 'sesion'.*session"):
        choose("sesion", RIG, 2)


@pytest.mark.parametrize(
    ("model", "said"),
    [
        (RIG, "and the model file has no fingerprint"),
        (
            EDITED,
            "and the model file's fingerprint cannot be used (the model's parameters or",
        ),
    ],
)
def test_why_the_simulator_alone_is_the_reference(model: Model, said: str) -> None:
    assert said in because("auto", choose("auto", model, 0), model, 0)
