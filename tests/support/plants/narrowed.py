"""Physics rigs that can have the effects of some stages only, for blind checks of which the way is looked at and not
what is answered: a diagnosis weighs what its records say that their rig can have."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from hil.reference.source import PhysicsSource
from rig.blind_check.source import BenchData, CaseData, Commands, Label, Named
from rig.channels import EFFECTS_FACT


@dataclass(frozen=True)
class Narrowed(PhysicsSource):
    """The same rigs, records and labels."""

    stages: tuple[str, ...] = ()

    def bench(self, label: Label) -> BenchData:
        bench = super().bench(label)
        return replace(bench, baselines=[self._said(day) for day in bench.baselines], sister=self._said(bench.sister))

    def case(self, label: Label) -> CaseData:
        case = super().case(label)
        return replace(case, records=self._said(case.records))

    def repeat(self, label: Label, facts: Mapping[str, Any], commands: Commands, number: int) -> Named:
        return self._said(super().repeat(label, facts, commands, number))

    def _said(self, day: Named) -> Named:
        return {name: {**columns, "facts": {EFFECTS_FACT: list(self.stages)}} for name, columns in day.items()}
