"""What can be chosen on the page, by name: sweeps and models in the folders that the daemon allows. A name is looked up
in a listing and never made a path, so that none leads out of a folder; bytes in it that are no UTF-8 are spelt out."""

from collections.abc import Iterable
from pathlib import Path

from rig.errors import ConfigError
from rig.service.web.files.records import spelt


class Catalogue:
    """The YAML files of some folders; of two with the same name, the one of the earlier folder."""

    def __init__(self, kind: str, folders: Iterable[Path]) -> None:
        """`kind` is what a file is called in messages."""
        self._kind, self._folders = kind, tuple(folders)

    @property
    def names(self) -> list[str]:
        """All there are, sorted."""
        return sorted(self._listing())

    def path(self, name: str) -> Path:
        """Where that one lies; ConfigError when there is none."""
        found = self._listing().get(name)
        if found is None:
            raise ConfigError(f"{name[:80]!a}: no such {self._kind}")
        return found

    def _listing(self) -> dict[str, Path]:
        found: dict[str, Path] = {}
        for folder in reversed(self._folders):
            if folder.is_dir():
                found |= {spelt(file.stem): file.absolute() for file in folder.glob("*.yaml") if file.is_file()}
        return found
