"""What somebody else puts at the place of an output while it is being made: judged by the same rule."""

import errno
import os
from pathlib import Path

import pytest

from rig.errors import RigError
from rig.outputs import OutputKind, writing


def no_links(*_: object, **__: object) -> None:
    """A file system such as FAT."""
    raise PermissionError(errno.EPERM, "Operation not permitted")


@pytest.mark.parametrize("links", [True, False])
@pytest.mark.parametrize(
    ("kind", "there"),
    [
        (OutputKind.MODEL, "# notes of the day\n"),
        (OutputKind.RECORDING, "\x89MCAP0\n"),
        (OutputKind.JSON, "muscle:\n  kind: mbw\n"),
    ],
)
def test_what_appears_at_the_place_meanwhile_is_not_overwritten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: OutputKind, there: str, links: bool
) -> None:
    if not links:
        monkeypatch.setattr(os, "link", no_links)
    place = tmp_path / "result.yaml"

    def meanwhile() -> None:
        with writing(place, kind) as part:
            part.write_text("mine")
            place.write_text(there)

    with pytest.raises(RigError, match="came while this was at work, whose result is ") as refused:
        meanwhile()
    assert place.read_text() == there
    (kept,) = (path for path in tmp_path.iterdir() if path != place)
    assert str(refused.value).endswith(str(kept))
    assert (kept.read_text(), kept.suffix) == ("mine", ".yaml")


def test_what_becomes_another_kind_meanwhile_is_not_overwritten(tmp_path: Path) -> None:
    place = tmp_path / "result.json"
    place.write_text("{}")

    def meanwhile() -> None:
        with writing(place, OutputKind.JSON) as part:
            part.write_text("[]")
            place.write_text("notes")

    with pytest.raises(RigError, match="is not a JSON file; it is not overwritten"):
        meanwhile()
    assert place.read_text() == "notes"


@pytest.mark.parametrize("links", [True, False])
def test_a_file_of_its_own_kind_that_appears_meanwhile_is_replaced(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, links: bool
) -> None:
    if not links:
        monkeypatch.setattr(os, "link", no_links)
    place = tmp_path / "result.json"
    for there in ("", "{}"):
        with writing(place, OutputKind.JSON) as part:
            part.write_text("[1]")
            if there:
                place.write_text(there)
        assert place.read_text() == "[1]"
    assert list(tmp_path.iterdir()) == [place]
