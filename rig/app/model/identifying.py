"""What `pamrig identify` does: the model at the start and the settings of the search from what was asked, then the
fit."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rig.app.shipped import find_config
from rig.channels import common
from rig.errors import ConfigError, RecordError
from rig.fields import bounded
from rig.gap.records.cleaning.outliers import fall_notes, without_falls
from rig.identify.fit import Identified, Report, SearchSettings, identify
from rig.identify.records.data import RecordOptions, best_input, check_length, cut
from rig.identify.records.rest import at_own_rest, far_from_all, require_rest
from rig.identify.records.zero import why_zero_is_free
from rig.identify.response.mean_law import PROPORTIONAL, mean_law
from rig.identify.search.stability import SweepRange
from rig.identify.search.swarm import SwarmSettings
from rig.identify.templates import Template, input_gain, template_model, template_rest
from rig.model.parameters import Input, Model, StageKind, load_model
from rig.record import Record

DEFAULT_SAMPLE_TIME_S = 0.005
"""Of a model whose records are resampled, or do not say their period, s: the loop's usual one."""
SHORTEST_SAMPLE_TIME_S, LONGEST_SAMPLE_TIME_S = 0.001, 0.05
"""Outside, a period is more often a wrong unit of time than a rig."""
_SAMPLE_TIMES_S = (1e-4, 1.0)
"""What --sample-time may insist on, 10 kHz to 1 Hz."""
_SWEEP_AMPLITUDES_MPA = (0.01, 1.0)
"""Between these the amplitude of the sweep range is taken from the records: a verdict at next to none says nothing, and
no regulator gives more."""
SLOWEST_HZ, FASTEST_HZ = 0.01, 20.0
"""Between these a model may be asked to stay bounded."""
_SMALLER = (("ms", 1e3), ("us", 1e6), ("ns", 1e9))
"""Units that somebody's t_s may be in, and how many make a second."""


@dataclass(frozen=True)
class StartOptions:
    """What the model is at the start: a given one, or a template of this kind."""

    start: Path | None
    """A model whose `free` parameters are searched within its own bounds; then the rest is its own too."""
    kind: str
    drive: str
    """auto, or an Input."""
    joint: str
    sample_time_s: float | None
    """None: what the records say."""
    p0_mpa: float | None
    """None: what the records say."""
    u_unit_mpa: float
    free_offset: bool | None
    """None: identified where the records show it."""
    mean_exponent: float | None
    """None: identified where the records show it."""

    def __post_init__(self) -> None:
        low, high = _SAMPLE_TIMES_S
        if self.sample_time_s is not None and not low <= self.sample_time_s <= high:
            raise ConfigError(f"sample_time_s: {self.sample_time_s:g} s; allowed is {low:g} to {high:g} s")


@dataclass(frozen=True)
class SearchOptions:
    """How is searched."""

    optimizer: str
    seed: int = bounded(0, 2**63 - 1)
    """Of the first search."""
    seeds: int = bounded(1, 100)
    particles: int = bounded(1, 100_000)
    iterations: int = bounded(1, 1_000_000)
    early_stop: int | None = bounded(1, 1_000_000)
    """Rounds without gain that end a search; None: all are made."""
    polish: bool = True
    bounded: bool = True


def identify_model(
    records: list[Record],
    start: StartOptions,
    search: SearchOptions,
    sweep: SweepRange,
    options: RecordOptions,
    report: Report | None,
) -> Identified:
    """The model fitted to the records; `report(title, share, best)` during the searches."""
    settings = SearchSettings(
        optimizer=search.optimizer,
        seeds=tuple(range(search.seed, search.seed + search.seeds)),
        swarm=SwarmSettings(particles=search.particles, iterations=search.iterations),
        patience=search.early_stop,
        polish=search.polish,
        bounded=search.bounded,
        sweep=sweep,
    )
    for record in records:
        check_length(record)
    channels = common([(record.name, record.channels) for record in records])
    records, rests = at_own_rest(records)
    records, left_out = _without_falls(records)
    model, choices = start_model(start, records, options)
    model = replace(model, channels=None if channels.has_valves else channels)
    return replace(
        identify(records, model, settings, options, report), choices=choices + [rests] * bool(rests) + left_out
    )


def _without_falls(records: Sequence[Record]) -> tuple[list[Record], list[str]]:
    """The records as a diagnosis reads an earlier day's, without what no joint did: samples that fell to a rail, and
    pulses; and what was left out, in words."""
    cleaned = without_falls(records)
    return cleaned.records, [*fall_notes(cleaned), *cleaned.notes]


def start_model(start: StartOptions, records: list[Record], options: RecordOptions) -> tuple[Model, list[str]]:
    """The given model, or the template of the kind with bounds that fit the records; and what was chosen for the
    caller, with why."""
    if start.start is not None:
        return load_model(find_config(start.start, "models")), []
    drive, choices = Input.COMMAND, []
    pneumatic = all(record.channels.has_valves for record in records)
    if start.drive != "auto":
        drive = Input(start.drive)
    elif pneumatic:  # else there is nothing but the command
        drive, why = best_input(records, options)
        choices.append(why)
    if start.p0_mpa is not None and (doubt := far_from_all(start.p0_mpa, records)):
        choices.append(doubt)
    p0_mpa = start.p0_mpa if start.p0_mpa is not None else template_rest(records)
    if pneumatic and any(record.has_pressures for record in records):
        require_rest(p0_mpa, "--p0" if start.p0_mpa is not None else f"{records[0].name}'s fact p0_mpa")
    exponent = start.mean_exponent
    if exponent is None and not pneumatic:
        exponent = 0.0
    if exponent is None and start.kind != StageKind.BW_CONTINUOUS:
        exponent, why = mean_law(records, drive, p0_mpa)
        choices.append(why)
    shown = [cut(record, options) for record in records]
    free_offset = start.free_offset
    if free_offset is None:
        why = why_zero_is_free(shown, drive, p0_mpa, PROPORTIONAL if exponent is None else exponent)
        choices += [why] if why else []
        free_offset = bool(why)
    template = Template(
        kind=start.kind,
        drive=drive,
        sample_time_s=start.sample_time_s or sample_time_s(records, options),
        p0_mpa=p0_mpa,
        u_unit_mpa=start.u_unit_mpa,
        joint=start.joint,
        free_offset=free_offset,
        mean_exponent=exponent,
    )
    return template_model(template, input_gain(shown, template.u_unit_mpa)), choices


def sample_time_s(records: Sequence[Record], options: RecordOptions) -> float:
    """The records' own period where they are to stay on it, else the usual one; RecordError for one outside 1 to 50 ms.

    Periods of logs differ in their last digits: three are kept.
    """
    if options.resample:
        return DEFAULT_SAMPLE_TIME_S
    period = float(f"{np.median([record.period_s for record in records if len(record) > 1] or [0.0]):.3g}")
    if period and not SHORTEST_SAMPLE_TIME_S <= period <= LONGEST_SAMPLE_TIME_S:
        fits = [unit for unit, of in _SMALLER if SHORTEST_SAMPLE_TIME_S <= period / of <= LONGEST_SAMPLE_TIME_S]
        doubt = f"is t_s in {fits[0]}? Else " if fits else ""
        raise RecordError(
            f"{records[0].name}: sampled every {1e3 * period:.4g} ms; a model is identified at "
            f"{1e3 * SHORTEST_SAMPLE_TIME_S:g} to {1e3 * LONGEST_SAMPLE_TIME_S:g} ms; {doubt}--resample puts the "
            f"records onto {1e3 * DEFAULT_SAMPLE_TIME_S:g} ms, --sample-time insists"
        )
    return period or DEFAULT_SAMPLE_TIME_S


def sweep_range(low_hz: float, high_hz: float, amplitude_mpa: float | None, records: Sequence[Record]) -> SweepRange:
    """Where the model has to stay bounded; without an amplitude, up to the largest command of the records.
    ConfigError for frequencies that no check is made at."""
    if not SLOWEST_HZ <= low_hz < high_hz <= FASTEST_HZ:
        raise ConfigError(
            f"sweep range {low_hz:g}-{high_hz:g} Hz: allowed is {SLOWEST_HZ:g} to {FASTEST_HZ:g} Hz, lower one first"
        )
    largest = max(float(np.nanmax(np.abs(record.dp_cmd_mpa))) for record in records)
    least, most = _SWEEP_AMPLITUDES_MPA
    return SweepRange(low_hz, high_hz, amplitude_mpa or round(min(max(largest, least), most), 3))
