"""Whatever numbers a fingerprint holds, the file gives back the same ones, and a change of any one of them is seen."""

import base64
from dataclasses import fields, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from hypothesis import given, settings
from hypothesis import strategies as st

from rig.model.fingerprint import READ, Fingerprint, PressureSource
from rig.model.parameters import Model, load_model, save_model
from rig.model.response.fingerprint_check import fingerprint_checksum, fingerprint_trouble

RIG = load_model(Path(__file__).parents[2] / "configs" / "models" / "simulated.yaml")
NUMBER = st.floats(allow_nan=False, allow_infinity=False, width=64)
ROW = st.lists(NUMBER, max_size=20).map(tuple)
PAIR = st.tuples(NUMBER, NUMBER)
TRIPLE = st.tuples(NUMBER, NUMBER, NUMBER)
FINGERPRINTS = st.builds(
    Fingerprint,
    version=st.sampled_from(READ),
    checksum=st.just(""),
    pressures=st.sampled_from(PressureSource),
    records=st.integers(0, 10**6),
    corrections=st.lists(ROW, max_size=2).map(tuple),
    regulators_s=st.lists(TRIPLE, max_size=2).map(tuple),
    **dict.fromkeys(("seconds", "grid_s", "p0_mpa", "viscous_s", "inertia_s", "exponent"), NUMBER),
    **dict.fromkeys(("misfit_deg", "noise_deg"), NUMBER),
    left_out_deg=st.none() | NUMBER,
    **dict.fromkeys(("weights", "slip", "curve", "misfit_mpa", "left_out_mpa", "noise_mpa"), ROW),
    drive_mpa=PAIR,
    mean_mpa=PAIR,
    day=st.binary(max_size=500).map(lambda packed: base64.b64encode(packed).decode()),
)


def stamped(fingerprint: Fingerprint) -> Model:
    return replace(RIG, fingerprint=replace(fingerprint, checksum=fingerprint_checksum(fingerprint, RIG)))


@settings(max_examples=60, deadline=None)
@given(FINGERPRINTS)
def test_a_file_gives_back_every_number(fingerprint: Fingerprint) -> None:
    model = stamped(fingerprint)
    with TemporaryDirectory() as folder:
        save_model(model, Path(folder) / "model.yaml")
        again = load_model(Path(folder) / "model.yaml")
    assert again == model
    assert fingerprint_trouble(again) is None


def another(value: object) -> object:
    """A value of the same kind that is not this one."""
    if isinstance(value, PressureSource):
        return next(each for each in PressureSource if each is not value)
    if isinstance(value, str):
        return f"{value[:-1]}\n"
    if isinstance(value, tuple):
        return value[:-1] if value else (1.0,)
    return 7.0 if value is None else float(value) / 2 + 1.0  # type: ignore[arg-type]


@settings(max_examples=60, deadline=None)
@given(
    FINGERPRINTS,
    st.sampled_from([each.name for each in fields(Fingerprint) if each.name not in ("checksum", "version")]),
)
def test_a_changed_number_is_seen(fingerprint: Fingerprint, name: str) -> None:
    model = stamped(fingerprint)
    now = getattr(fingerprint, name)
    other = another(now)
    if other == now:
        return
    assert model.fingerprint is not None
    changed = replace(model, fingerprint=replace(model.fingerprint, **{name: other}))
    assert "changed after the identification" in (fingerprint_trouble(changed) or "")
