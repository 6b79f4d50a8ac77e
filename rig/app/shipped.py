"""The configs that come with pamrig: where they lie, and which is meant by a name. No part of a loop is imported."""

import os
from pathlib import Path

from rig.config import suggest
from rig.errors import ConfigError

OWN_FOLDERS = {"model": "models", "rig": "rigs", "map": "modbus", "input_map": "modbus"}
"""Setting of a device that names a file -> folder of pamrig's own files that may be named without path and suffix."""


def configs() -> Path:
    """The folder of the configs that come with pamrig: in the checkout, or inside the installed package."""
    root = Path(__file__).resolve().parent.parent
    checkout = root.parent / "configs"
    return checkout if checkout.is_dir() else root / "_configs"


def default_rig() -> Path:
    """The simulated rig."""
    return configs() / "rigs" / "simulated.yaml"


def find_config(path: Path, folder: str) -> Path:
    """`path` as it stands, or the config of that name among those that come with pamrig (`paper`,
    `configs/sweeps/paper.yaml`); a folder of that name, of records say, is none.

    ConfigError when `path` is neither.
    """
    if os.path.exists(path) and not os.path.isdir(path):
        return path
    if folder == "models":
        from rig.model.external.simulator import is_external  # late: loop and watchers find files here, and no models

        if is_external(path):
            return path
    ours = {item.stem: item for item in (configs() / folder).glob("*.yaml")}
    if path.parent in (Path("."), Path("configs") / folder):
        if found := ours.get(path.name.removesuffix(".yaml")):
            return found
        if not os.path.isdir(path):
            hint = suggest(path.stem, list(ours))
            raise ConfigError(f"{path}: no such file, nor one of pamrig's own {folder}; {hint}")
    return path


def own_names(setting: str) -> list[str]:
    """The names of pamrig's own files that a device's setting may mean; none where it means no file of ours."""
    folder = OWN_FOLDERS.get(setting)
    return [] if folder is None else sorted(place.stem for place in (configs() / folder).glob("*.yaml"))


def own_file(setting: str, name: str) -> Path:
    """Where pamrig's own file of that name lies, which a device's setting may mean."""
    return configs() / OWN_FOLDERS.get(setting, "") / f"{name}.yaml"
