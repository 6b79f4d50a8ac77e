"""What `pamrig identify` leaves in a model's file beside the parameters, so that the file alone is worth a day of
records.

The numbers of a response model (`rig.model.response.model`), what it misses of the records that it was fitted to, their
noise, and the range that they showed. Plain data, read and written with the model;
`rig.identify.response.fingerprint` makes it, `rig.model.response.fingerprint_check` says whether it may be used.
"""

from dataclasses import dataclass
from enum import StrEnum

VERSION = 3
"""Of what is written; 1 has no corrections, 1 and 2 keep no records."""
READ = (1, 2, 3)
"""Versions that can be used."""
FORMER = {"compliance": 1.0}
"""What these had beside the fields here, and never another value: it counts in their checksums."""


class PressureSource(StrEnum):
    """Where the pressures of the records come from."""

    MEASURED = "measured"
    VIRTUAL = "virtual"
    """Not measured: set-points through the model's regulators, or through usual ones."""


@dataclass(frozen=True)
class Fingerprint:
    """The response of one rig on some records, and how closely it is known. Everything stands at its default in a newer
    version's."""

    version: int = VERSION
    checksum: str = ""
    """Over the numbers here and those of the model that they stand beside: neither was changed alone."""
    pressures: PressureSource = PressureSource.MEASURED
    records: int = 0
    seconds: float = 0.0
    """Of all records together."""
    grid_s: float = 0.01
    p0_mpa: float = 0.2
    regulators_s: tuple[tuple[float, float, float], ...] = ()
    """Dead time, fill and exhaust time constant of each valve."""
    corrections: tuple[tuple[float, ...], ...] = ()
    """Of each valve: what its monitor shows beside the regulator, see `rig.model.response.model.regulator_terms`;
    none where the pressures are virtual, and in version 1."""
    weights: tuple[float, ...] = ()
    """Of the bank, see `rig.model.compiled.response`."""
    viscous_s: float = 0.0
    inertia_s: float = 0.0
    slip: tuple[float, ...] = ()
    curve: tuple[float, ...] = ()
    """The joint's balance, see `rig.model.response.model.Balance`."""
    exponent: float = 1.0
    misfit_deg: float = 0.0
    """Rms that the response model leaves of the angles it was fitted to."""
    misfit_mpa: tuple[float, ...] = ()
    """The same of each regulator, offsets aside; none where the pressures are virtual."""
    left_out_deg: float | None = None
    left_out_mpa: tuple[float, ...] = ()
    """The same on each record by weights fitted to the others (the law of the mean pressure is that of all); only from
    three records on."""
    noise_deg: float = 0.0
    noise_mpa: tuple[float, ...] = ()
    """White noise of the sensor and of each monitor as they were recorded, one standard deviation."""
    drive_mpa: tuple[float, float] = (0.0, 0.0)
    mean_mpa: tuple[float, float] = (0.0, 0.0)
    """Lowest and highest drive d and mean pressure that the records showed; outside of it nothing is known."""
    day: str = ""
    """The records themselves, see `rig.model.response.kept_day`; none in versions 1 and 2."""
