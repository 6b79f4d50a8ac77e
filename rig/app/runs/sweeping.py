"""What `pamrig run` does: a sweep expanded, checked against the rig's envelope, and carried out."""

import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, cast

import yaml

from rig.app import compose, shipped
from rig.app.runs import record_folders, runner
from rig.app.runs.outcome import RunOutcome
from rig.config import read_yaml
from rig.excite.envelope import check_run
from rig.excite.run_plan import expand
from rig.excite.sweep import load_sweep, with_files
from rig.rig_config import RigConfig
from rig.service.session.run_setup import program_of


@dataclass(frozen=True)
class SweepOptions:
    """How a sweep is to be carried out."""

    out: Path | None = None
    """Folder of the records; None: a new one under logs/."""
    virtual: bool = False
    seed: int | None = None
    force: bool = False
    facts: Mapping[str, Any] = field(default_factory=dict)
    device_options: Mapping[str, Any] = field(default_factory=dict)
    """Settings of devices to override (effects of the simulated rig)."""


def read_from(sweep: Path, folder: Path) -> dict[str, Any]:
    """The sweep at `sweep` as the YAML of a file in another folder: paths of its tables are rewritten."""
    raw = cast(dict[str, Any], read_yaml(sweep))

    def seen(file: Path) -> Path:
        return Path(os.path.relpath((sweep.parent / file).resolve(), folder.resolve()))

    return raw | {"records": with_files(raw["records"], seen)}


def text_from(sweep: Path, folder: Path) -> str:
    """The same as text: word for word where no table is moved."""
    read = read_from(sweep, folder)
    if read == read_yaml(sweep):
        return sweep.read_text(encoding="utf-8")
    return yaml.safe_dump(read, sort_keys=False)


def run_sweep(sweep: Path, rig: RigConfig, options: SweepOptions) -> RunOutcome:
    """Carry out the sweep at `sweep` (or the one of that name that comes with pamrig), one MCAP file a record.

    ConfigError for a sweep that cannot be read, EnvelopeError for one that would leave the envelope: before anything
    moves.
    """
    sweep = shipped.find_config(sweep, "sweeps")
    if options.virtual:
        compose.allow_virtual(rig)
    plan = load_sweep(sweep)
    plans = expand(plan, rig.period_ns)
    for item in plans:
        check_run(item, rig.limits, rig.period_ns)
    runs = [runner.Planned(item.name, program_of(item, number), item.facts) for number, item in enumerate(plans, 1)]
    return runner.carry_out(
        rig,
        runs,
        runner.RunOptions(
            out=options.out or record_folders.made_folder(plan.name),
            virtual=options.virtual,
            seed=options.seed,
            force=options.force,
            facts=options.facts,
            attachments={"sweep.yaml": plan.text.encode()},
            device_options=options.device_options,
        ),
    )
