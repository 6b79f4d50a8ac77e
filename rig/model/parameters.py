"""A model as plain data: its parameters with value, unit, bounds, free or fixed; where they come from; what they are
valid for.

Reads and writes the YAML files of `configs/models`. It knows which kinds of stage each slot has and the names of their
parameters, and nothing about running them (see `rig.model.chain` and `rig.model.simulation`).
"""

import dataclasses
import math
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any

import yaml

from rig.channels import PNEUMATIC, Channels, check_channels
from rig.config import read_yaml, structure, suggest, unstructure
from rig.errors import ModelError
from rig.fields import bounded
from rig.model.external.simulator import KIND as EXTERNAL
from rig.model.external.simulator import PATIENCE_S, PYTHON, is_external
from rig.model.external.simulator import load as load_external
from rig.model.fingerprint import FORMER, VERSION, Fingerprint
from rig.outputs import OutputKind, write_text


class Input(StrEnum):
    """What drives the muscles: the commanded pressures (the paper's way) or the regulators' pressures."""

    COMMAND = "command"
    PRESSURE = "pressure"


@dataclass(frozen=True)
class Parameter:
    """One number of a model with what is known about it."""

    value: float
    unit: str = "1"
    low: float = -1e6
    high: float = 1e6
    free: bool = False
    """Identification may change it."""
    std: float | None = None
    """Standard deviation from the identification; None for a parameter that was given, that ended at a bound, or that
    the records do not determine."""
    at_bound: bool = False
    """Identification ended on `low` or `high`: the true value may lie beyond."""


@dataclass(frozen=True)
class StageModel:
    """The nominal stage of one slot."""

    kind: str
    parameters: dict[str, Parameter] = field(default_factory=dict)

    def value(self, name: str) -> float:
        """What a parameter is, also where the file leaves it out; KeyError for one that the kind does not have."""
        return self.parameters[name].value if name in self.parameters else LEFT_OUT[name]


@dataclass(frozen=True)
class MuscleModel(StageModel):
    """The muscles: what they are driven by, and the Bouc-Wen model that answers; or a simulator that is not ours."""

    input: Input = Input.PRESSURE
    source: str = ""
    """Of the kind external: python:MODULE:FUNCTION or an FMU, see `rig.model.external.simulator`."""
    names: dict[str, str] = field(default_factory=dict)
    """Of an FMU: our names of its inputs and its output -> its own."""
    patience_s: float = bounded(0.1, 86_400.0, "s", default=PATIENCE_S)
    """Of the kind external: a record may take so long."""


@dataclass(frozen=True)
class AddedEffect:
    """An effect put into the chain, see `rig.model.effect_stages`."""

    effect: str
    parameters: dict[str, float]


@dataclass(frozen=True)
class SourceLog:
    """One record the model was identified on, by the content of its file."""

    file: str
    sha256: str
    record: str
    rmse_deg: float


@dataclass(frozen=True)
class Provenance:
    """Where the numbers come from."""

    text: str = ""
    logs: list[SourceLog] = field(default_factory=list)
    rmse_deg: float | None = None
    optimizer: str = ""
    seed: int | None = None
    evaluations: int | None = None
    pamrig: str = ""
    """Version of the program."""


@dataclass(frozen=True)
class ValidRange:
    """What excitation the model was checked on; outside it a warning is due."""

    frequency_hz: tuple[float, float] = (0.1, 1.0)
    amplitude_mpa: float = bounded(0.0, 1.0, "MPa", default=0.24)
    """Largest |p1 - p2|."""
    bounded: bool = False
    """The output was seen to stay bounded over all of that range."""


@dataclass(frozen=True)
class Model:
    """The simulator: valves -> muscles -> joint -> sensor, with added effects in their slots."""

    muscle: MuscleModel
    sample_time_s: float = bounded(1e-4, 1.0, "s", default=0.005)
    """The models are difference equations: their parameters hold for this sample time only."""
    p0_mpa: float = bounded(0.0, 0.5, "MPa", default=0.2)
    """Pressure of both muscles at rest."""
    valve: StageModel = field(default_factory=lambda: StageModel(StageKind.DIRECT))
    joint: StageModel = field(default_factory=lambda: StageModel(StageKind.RIGID))
    sensor: StageModel = field(default_factory=lambda: StageModel(StageKind.IDEAL))
    effects: list[AddedEffect] = field(default_factory=list)
    valid: ValidRange = field(default_factory=ValidRange)
    provenance: Provenance = field(default_factory=Provenance)
    fingerprint: Fingerprint | None = None
    """How the rig answered beside these parameters; ask `fingerprint_trouble` before using it."""
    channels: Channels | None = None
    """Input and output of the rig, where they are not p1 - p2 and an angle: the parameters then hold on the working
    range of these."""

    @property
    def own_channels(self) -> Channels:
        """What its input and its output are."""
        return PNEUMATIC if self.channels is None else self.channels

    def stages(self) -> dict[str, StageModel]:
        """Slot -> its nominal stage, in the order of the chain."""
        return {"valve": self.valve, "muscle": self.muscle, "joint": self.joint, "sensor": self.sensor}


_REGULATOR = ("gain", "offset_mpa", "tau_s", "fill_limit_mpa_per_s", "exhaust_limit_mpa_per_s", "exhaust_ratio")
_MUSCLE_UNITS = ("theta_divisor_s", "u_unit_mpa", "y_unit_deg", "mean_exponent")
"""The scales of (8) and (11) that the paper leaves open: divisor of theta, units of u and y, how the mean pressure
counts."""


class StageKind(StrEnum):
    """What a nominal stage is, in the words of a model's file; its names of parameters stand in KINDS."""

    DIRECT = "direct"
    """No regulators: the pressures are the commands."""
    REGULATORS = "regulators"
    MBW = "mbw"
    """Modified Bouc-Wen, equation (11)."""
    BW = "bw"
    """The same without its second terms."""
    BW_CONTINUOUS = "bw_continuous"
    EXTERNAL = EXTERNAL
    RIGID = "rigid"
    """The joint follows the muscles."""
    SECOND_ORDER = "second_order"
    IDEAL = "ideal"
    """The sensor reads the angle."""
    AFFINE = "affine"


KINDS: dict[str, dict[str, tuple[str, ...]]] = {
    "valve": {
        StageKind.DIRECT: (),
        StageKind.REGULATORS: tuple(f"valve{n}_{name}" for n in (1, 2) for name in _REGULATOR),
    },
    "muscle": {
        StageKind.MBW: ("lambda1", "lambda2", "xi1", "xi2", "phi1", "phi2", "beta1", "beta2", *_MUSCLE_UNITS),
        StageKind.BW: ("lambda1", "lambda2", "xi", "psi", "beta", *_MUSCLE_UNITS),
        StageKind.BW_CONTINUOUS: ("rho", "k", "eps", "psi", "gamma", "n", "u_unit_mpa", "y_unit_deg"),
        EXTERNAL: (),
    },
    "joint": {StageKind.RIGID: (), StageKind.SECOND_ORDER: ("omega_rad_per_s", "damping")},
    "sensor": {StageKind.IDEAL: (), StageKind.AFFINE: ("gain", "offset_deg")},
}
"""Slot -> kind of stage -> the names of its parameters, in the order in which the stage reads them."""
LEFT_OUT = {f"valve{n}_exhaust_ratio": 1.0 for n in (1, 2)}
"""Parameters that a file may leave out, with what they are then: older files do not know them."""

_POSITIVE = (1e-9, math.inf)
_LEGAL = {
    "theta_divisor_s": _POSITIVE,
    "u_unit_mpa": _POSITIVE,
    "n": (1.0, 10.0),
    "omega_rad_per_s": (1e-3, 1e4),
    "damping": (0.0, 0.999),
    **{f"valve{n}_{name}": _POSITIVE for n in (1, 2) for name in _REGULATOR[2:]},
}
"""Parameters with values that would divide by zero or mean nothing, whatever their bounds say."""


def regulator_times_s(valve: StageModel) -> tuple[tuple[float, float], tuple[float, float]]:
    """Time constants of filling, of valve 1 and of valve 2, and those of exhausting; of the kind regulators."""
    fills = valve.value("valve1_tau_s"), valve.value("valve2_tau_s")
    exhausts = valve.value("valve1_exhaust_ratio") * fills[0], valve.value("valve2_exhaust_ratio") * fills[1]
    return fills, exhausts


def load_model(path: Path) -> Model:
    """The model of a YAML file, or around a simulator that is not ours (`python:MODULE:FUNCTION`, `PLANT.fmu`).

    ConfigError or ModelError, one line, when it is not one.
    """
    if is_external(path):
        return _checked_external(Model(MuscleModel(EXTERNAL, input=Input.COMMAND, source=str(path))))
    model = structure(_known_part(read_yaml(path)), Model, str(path))
    check_model(model, str(path))
    if model.channels is not None:
        check_channels(model.channels, f"{path}: channels")
    return _checked_external(_beside(model, path.parent)) if model.muscle.kind == EXTERNAL else model


def _beside(model: Model, folder: Path) -> Model:
    """The model with the FMU that its file names relative to itself."""
    source = model.muscle.source
    if source.startswith(PYTHON) or Path(source).is_absolute():
        return model
    return dataclasses.replace(model, muscle=dataclasses.replace(model.muscle, source=str(folder / source)))


def _checked_external(model: Model) -> Model:
    """The model, once its simulator could be had."""
    load_external(model.muscle.source, model.muscle.names)
    return model


def _known_part(raw: object) -> object:
    """The file's data without what a fingerprint formerly had; of one of a newer version only the version: its keys are
    not known here."""
    found = raw.get("fingerprint") if isinstance(raw, dict) else None
    version = found.get("version") if isinstance(found, dict) else None
    if isinstance(raw, dict) and isinstance(found, dict):
        raw = raw | {"fingerprint": {key: value for key, value in found.items() if key not in FORMER}}
    if isinstance(raw, dict) and isinstance(version, int) and version > VERSION:
        return raw | {"fingerprint": {"version": version}}
    return raw


def save_model(model: Model, path: Path) -> None:
    """Write `model` as YAML; RigError when the file cannot be written, or is there and holds no model."""
    text = yaml.dump(_plain(model), Dumper=_Dumper, sort_keys=False, width=150, allow_unicode=True)
    write_text(path, text, OutputKind.MODEL)


def check_model(model: Model, where: str) -> None:
    """ModelError when a stage, a parameter or a value is not one that exists."""
    for slot, stage in model.stages().items():
        if stage.kind not in KINDS[slot]:
            raise ModelError(
                f"{where}: {slot}.kind: unknown kind {stage.kind!r}; {suggest(stage.kind, list(map(str, KINDS[slot])))}"
            )
        _check_names(
            f"{where}: {slot}.parameters", list(stage.parameters), KINDS[slot][stage.kind], f"kind '{stage.kind}'"
        )
        for name, parameter in stage.parameters.items():
            _check_value(f"{where}: {slot}.parameters.{name}", name, parameter)
    if (model.muscle.kind == EXTERNAL) != is_external(model.muscle.source):
        raise ModelError(
            f"{where}: muscle.source: {model.muscle.source!r}; the kind {EXTERNAL} has a source, "
            "python:MODULE:FUNCTION or PLANT.fmu, and no other kind has one"
        )
    if model.muscle.input is Input.COMMAND and model.valve.kind != StageKind.DIRECT:
        raise ModelError(
            f"{where}: valve.kind: muscles driven by the command contain the regulators; allowed with input "
            "'command': direct"
        )
    low, high = model.valid.frequency_hz
    if not 0 <= low <= high:
        raise ModelError(f"{where}: valid.frequency_hz: {low:g} .. {high:g} Hz is no range")


def _check_names(where: str, given: list[str], wanted: tuple[str, ...], owner: str) -> None:
    for name in given:
        if name not in wanted:
            raise ModelError(
                f"{where}: unknown parameter {name!r} of {owner}; "
                f"{suggest(name, list(wanted)) if wanted else 'it has none'}"
            )
    for name in wanted:
        if name not in given and name not in LEFT_OUT:
            raise ModelError(f"{where}: the parameter {name!r} of {owner} is missing")


def _check_value(where: str, name: str, parameter: Parameter) -> None:
    low, high = _LEGAL.get(name, (-math.inf, math.inf))
    if not low <= parameter.value <= high:
        raise ModelError(f"{where}: {parameter.value:g} is outside {low:g} .. {high:g}")
    if not parameter.low <= parameter.value <= parameter.high:
        raise ModelError(
            f"{where}: {parameter.value:g} {parameter.unit} is outside its own bounds {parameter.low:g} .. "
            f"{parameter.high:g}"
        )


class _Inline(dict[str, object]):
    """A mapping that YAML writes on one line."""


class _InlineList(list[object]):
    """A list that YAML writes on one line."""


class _Lines(str):
    """Text that YAML writes line by line."""


class _Dumper(yaml.SafeDumper):
    """Writes a parameter, and a row of numbers, on one line."""


_Dumper.add_representer(
    _Inline, lambda dumper, data: dumper.represent_mapping("tag:yaml.org,2002:map", data.items(), flow_style=True)
)
_Dumper.add_representer(
    _InlineList, lambda dumper, data: dumper.represent_sequence("tag:yaml.org,2002:seq", data, flow_style=True)
)
_Dumper.add_representer(_Lines, lambda dumper, data: dumper.represent_scalar("tag:yaml.org,2002:str", data, style="|"))


def _plain(value: object) -> object:
    """A model as data for YAML, without the entries that stand at their defaults."""
    if isinstance(value, list):
        return [_plain(item) for item in value]
    if isinstance(value, tuple):
        return _InlineList(unstructure(value))
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, str) and "\n" in value:
        return _Lines(value)
    if not dataclasses.is_dataclass(value):
        return unstructure(value)
    stated = {
        f.name: _plain(getattr(value, f.name))
        for f in dataclasses.fields(value)
        if not _is_default(f, getattr(value, f.name))
    }
    return _Inline(stated) if isinstance(value, Parameter) else stated


def _is_default(item: "dataclasses.Field[Any]", value: object) -> bool:
    default = item.default_factory() if item.default_factory is not dataclasses.MISSING else item.default
    return item.name not in ("unit", "free", "input", "sample_time_s", "p0_mpa", "version") and value == default
