"""The healthy rig as the diagnosis sees it: its mean baseline, and the response model fitted to that baseline alone,
never to the case.

The response model is used in differences only: what an effect changes in it is added to the measured baseline, so its
own misfit cancels. The model is `rig.model.response.model`, its fits are `rig.identify.response.response_fit`.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.gap.records.pairs import Pair
from rig.identify.response.response_fit import (
    Drive,
    RegulatorRecord,
    fit_regulator,
    fit_response,
    shown_mean_exponent,
)
from rig.model.compiled.response import regulated
from rig.model.parameters import Model
from rig.model.response.model import Regulator, ResponseModel, regulators_of
from rig.record import Column


@dataclass(frozen=True)
class Reference:
    """The healthy rig under one pair's command; all columns (n,). Pressures are virtual when none were measured."""

    p1_mpa: Column
    p2_mpa: Column
    angle_deg: Column


def mean_session(pair: Pair, pressures: bool) -> tuple[Column | None, Column | None, Column]:
    """The mean of a pair's baseline sessions, each (n,): p1 and p2 (MPa), None without `pressures`, and angle (deg)."""
    angle = np.mean([session.angle_deg for session in pair.days], axis=0)
    if not pressures:
        return None, None, angle
    first = np.mean([session.p1_mpa for session in pair.days if session.p1_mpa is not None], axis=0)
    second = np.mean([session.p2_mpa for session in pair.days if session.p2_mpa is not None], axis=0)
    return first, second, angle


def fit_regulators(pairs: Sequence[Pair], measured: Sequence[tuple[Column, Column]]) -> tuple[Regulator, Regulator]:
    """Dead time, fill and exhaust time constants (s) of both valves from the pairs' set-points and the `measured`
    pressures of each, p1 and p2 (n,) in MPa."""
    both = list(zip(pairs, measured, strict=True))
    return (
        fit_regulator([RegulatorRecord(pair.dt_s, pair.u1_mpa, pressures[0], pair.used) for pair, pressures in both]),
        fit_regulator([RegulatorRecord(pair.dt_s, pair.u2_mpa, pressures[1], pair.used) for pair, pressures in both]),
    )


def describe(
    pairs: Sequence[Pair], references: Sequence[Reference], p0_mpa: float, regulators: tuple[Regulator, Regulator]
) -> ResponseModel:
    """The response model of the reference rig."""
    records = [
        Drive(pair.dt_s, reference.p1_mpa, reference.p2_mpa, reference.angle_deg, pair.used)
        for pair, reference in zip(pairs, references, strict=True)
    ]
    return fit_response(records, p0_mpa, regulators, shown_mean_exponent(records, p0_mpa))


def references_of(
    model: Model | None,
    pairs: Sequence[Pair],
    sessions: Sequence[tuple[Column | None, Column | None, Column]],
) -> tuple[tuple[Regulator, Regulator], list[Reference]]:
    """Both regulators and a reference for each pair, from its mean session as `mean_session` gives it: fitted to the
    pressures where every session has them, else the model's regulators, or usual ones, and virtual pressures."""
    measured = [(first, second) for first, second, _ in sessions if first is not None and second is not None]
    if len(measured) == len(pairs):
        regulators: tuple[Regulator, Regulator] = fit_regulators(pairs, measured)
        return regulators, [
            Reference(first, second, angle) for (first, second), (_, _, angle) in zip(measured, sessions, strict=True)
        ]
    regulators = regulators_of(model)
    virtual = [
        Reference(
            regulated(pair.u1_mpa, *regulators[0], pair.dt_s), regulated(pair.u2_mpa, *regulators[1], pair.dt_s), angle
        )
        for pair, (_, _, angle) in zip(pairs, sessions, strict=True)
    ]
    return regulators, virtual
