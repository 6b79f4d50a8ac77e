"""A new rig's YAML from a few answers: one of the rigs that come with pamrig as a pattern, with what is different here.

What is asked is plain data; who asks, on a terminal or by options, is the command's business.
"""

import copy
import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import yaml

from rig.app import compose, shipped
from rig.config import read_yaml
from rig.errors import ConfigError
from rig.outputs import OutputKind, write_text
from rig.rig_config import RigConfig

PATTERNS: Final = {
    "simulated": "no hardware: the model's chain",
    "paper_myrio": "one myRIO: two valves, two monitors, potentiometer",
    "serial_modbus": "two valves over RS-232C, potentiometer on a Modbus module",
    "all_modbus": "everything on a Modbus module",
    "emulated_myrio": "the myRIO's driver on emulated hardware",
    "emulated_serial_modbus": "the serial drivers on emulated hardware",
    "emulated_all_modbus": "the Modbus driver on emulated hardware",
}
"""Pattern -> what is there."""
_PATHS: Final = (".yaml", ".yml", ".lvbitx")
"""A setting that ends so is a file, beside the pattern."""
Ask = Callable[[str, Any], Any]
"""Asked with a question and the usual answer, which says the type; returns the answer."""


def settings_of(raw: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    """What a device's part of a pattern sets, by dotted key: numbers and text, no lists."""
    for key, value in raw.items():
        name = f"{before}{key}"
        if isinstance(value, Mapping):
            yield from settings_of(value, f"{name}.")
        elif key != "kind" and isinstance(value, str | int | float) and not isinstance(value, bool):
            yield name, value


def filled(pattern: str, target: Path, ask: Ask) -> dict[str, Any]:
    """The YAML of a rig after `pattern`, with every answer in its place; files are named relative to `target`."""
    source = shipped.find_config(Path(pattern), "rigs")
    raw = copy.deepcopy(read_yaml(source))
    assert isinstance(raw, dict)
    raw["name"] = ask("name", target.stem)
    raw["period_ms"] = ask("period of the loop, ms", float(raw["period_ms"]))
    limits = raw.setdefault("limits", {})
    low, high = limits.get("pressure_mpa", (0.0, 0.5))
    limits["pressure_mpa"] = [
        ask("lowest pressure of the regulators, MPa", float(low)),
        ask("highest pressure of the regulators, MPa", float(high)),
    ]
    for muscle in (1, 2):
        raw["safe"][f"p{muscle}_mpa"] = ask(
            f"safe pressure of muscle {muscle}, MPa", float(raw["safe"][f"p{muscle}_mpa"])
        )
    left, right = limits.get("angle_deg", (-90.0, 90.0))
    limits["angle_deg"] = [ask("lowest angle, deg", float(left)), ask("highest angle, deg", float(right))]
    for name, device in raw["devices"].items():
        for key, usual in list(settings_of(device)):
            _put(device, key, ask(f"{name}: {key}", _beside(key, usual, source, target)))
    return raw


def short_form(question: str) -> str:
    """What a question is called in an answer beforehand."""
    return question.partition(",")[0]


def questions_of(pattern: str) -> list[str]:
    """What is asked about a rig like `pattern`, each in its short form."""
    asked: list[str] = []

    def usual_one(question: str, usual: Any) -> Any:
        asked.append(short_form(question))
        return usual

    filled(pattern, Path("rig.yaml"), usual_one)
    return asked


def write_rig(raw: Mapping[str, Any], target: Path) -> RigConfig:
    """Write the YAML, once it is a rig that loads; ConfigError, and nothing written, when it is not."""
    text = yaml.safe_dump(dict(raw), sort_keys=False, allow_unicode=True, default_flow_style=None, width=110)
    trial = target.with_name(f".{target.name}.{os.getpid()}.trial")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        trial.write_text(text, encoding="utf-8")
        compose.check_wiring(compose.load(trial))
    except OSError as error:
        raise ConfigError(f"{target}: cannot be written: {error.strerror}") from None
    except ConfigError as error:
        raise ConfigError(str(error).replace(str(trial), str(target))) from None
    finally:
        trial.unlink(missing_ok=True)
    write_text(target, text, OutputKind.RIG)
    return compose.load(target)


def _beside(key: str, usual: Any, source: Path, target: Path) -> Any:
    """A setting of the pattern as it has to be written in the target's folder: pamrig's own files by their names."""
    if isinstance(usual, str) and usual.endswith(_PATHS) and not os.path.isabs(usual):
        place = (source.parent / usual).resolve()
        if place == shipped.own_file(key.rpartition(".")[2], place.stem).resolve():
            return place.stem
        return os.path.relpath(place, target.resolve().parent)
    return usual


def _put(raw: dict[str, Any], key: str, value: Any) -> None:
    head, _, rest = key.partition(".")
    if rest:
        _put(raw[head], rest, value)
    else:
        raw[head] = value
