"""The reference page of the effects, written from the library itself: docs/reference/effects.md."""

from rig.gap.hypotheses.library import LIBRARY, alike
from rig.model.effect_stages import EFFECT_STAGES, EffectStage

HEAD = """# Effects

Every effect that the diagnosis can name and that a model or the simulated rig can carry (`effects:` in their YAML: a
stage and its numbers; what is left out, but for the size, stands at its neutral value or is the rig's own). This page
is written from the library: change `rig/gap/hypotheses/library.py` or `rig/model/effect_stages`, then
`python -m rig.report.effects_page > docs/reference/effects.md`.

"Alike" are the declared classes: effects that what was measured may not tell apart. They were stated before any blind
check.
"""


def effects_markdown() -> str:
    """The page as text."""
    parts = [HEAD]
    for effect in LIBRARY.values():
        stages = [key for key, stage in EFFECT_STAGES.items() if stage.effect == effect.name]
        parts.append(f"\n## {effect.name}\n\n")
        parts.append(f"Stage: {effect.stage}. Looks like: {effect.looks_like}.\n\n")
        found_by = "its signature in the raw records" if effect.signature else "fitting it to the frozen nominal rig"
        parts.append(f"Found by {found_by}. ")
        parts.append(
            f"Alike from the angle alone: {_names(alike(effect.name, False))}; with pressures: "
            f"{_names(alike(effect.name, True))}.\n"
        )
        parts += [_numbers(key, EFFECT_STAGES[key]) for key in stages]
    return "".join(parts)


def _names(names: list[str]) -> str:
    return ", ".join(names) if names else "none"


def _numbers(key: str, stage: EffectStage) -> str:
    rows = [
        f"\nStage `{key}`, slot {stage.slot.value}, size `{stage.size}`:\n\n",
        "| number | unit | allowed | neutral | meaning |\n|---|---|---|---|---|\n",
    ]
    rows += [
        f"| `{one.name}` | {one.unit} | {one.low:g} to {one.high:g} | {one.own or f'{one.neutral:g}'} | "
        f"{one.meaning} |\n"
        for one in stage.numbers
    ]
    return "".join(rows)


if __name__ == "__main__":
    print(effects_markdown(), end="")
