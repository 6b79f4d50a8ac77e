"""The words of `rig.gap.answer.words.effects` for a rig that says by its channel map that it has no valves (a motor, a
servo, a damper), and which of the two a rig's effects are told in.

What it is built of nobody says: its words are an actuator, a joint, a sensor.
"""

# ruff: noqa: E501 (one line an effect reads best as a table)
from collections.abc import Mapping
from dataclasses import replace

from rig.channels import Channels
from rig.gap.answer.words.effects import EFFECT_WORDS, EffectWords, Numbers, through, value
from rig.gap.answer.words.sizes import size


def _creep(numbers: Numbers) -> str:
    on = "goes on" if value(numbers, "share") >= 0.0 else "comes back"
    return (
        f"Once the command rests the angle still {on} by {size(numbers['share'])}, over about {size(numbers['tau_s'])}"
    )


def _warming(numbers: Numbers) -> str:
    if "rise_per_min" in numbers:
        firmer = "stiffer" if value(numbers, "rise_per_min") >= 0.0 else "softer"
        return f"The joint is held ever {firmer}, by {size(numbers['rise_per_min'])}"
    side = (
        ""
        if "muscle" not in numbers
        else " to the upper side"
        if value(numbers, "muscle") < 1.5
        else " to the lower side"
    )
    grows = "grows" if value(numbers, "rate_per_min") >= 0.0 else "shrinks"
    return f"The motion{side} {grows} by {size(numbers['rate_per_min'])}{through(numbers)}"


def _stiffness(numbers: Numbers) -> str:
    return (
        EFFECT_WORDS["stiffness"]
        .sentence(numbers)
        .replace("muscles, mass and weight turn", "actuator, mass and weight turn")
    )


_OTHERWISE: Mapping[str, EffectWords] = {
    "delay": replace(EFFECT_WORDS["delay"], reasons="samples or commands wait in a buffer; another program or bus stands between",
        look_at="the time stamps of commands and readings; the controller's buffers; the bus"),
    "creep": replace(EFFECT_WORDS["creep"], sentence=_creep,
        reasons="belts, cables, plastic or rubber parts give way slowly; an integrator of the position loop", look_at="a long hold at one command; whether it fades once the rig is warm; the loop's integral gain"),
    "thermal_drift": replace(EFFECT_WORDS["thermal_drift"], sentence=_warming,
        reasons="the actuator or its amplifier warms up; the room's temperature", look_at="a long record from cold; the actuator's temperature"),
    "coulomb_friction": replace(EFFECT_WORDS["coulomb_friction"], reasons="more: a dry, tight or dirty bearing or gear, a cable that rubs; less: a bearing that was greased or has run in, less preload",
        look_at="the bearing by hand with the actuator off; cables that touch; preload and tension"),
    "stiffness": replace(EFFECT_WORDS["stiffness"], sentence=_stiffness, reasons="another gain of the position loop; a spring, a belt or a stiff cable at the joint; another supply voltage",
        look_at="the loop's gain; the supply; how far the joint gives way to a known weight"),
    "backlash": replace(EFFECT_WORDS["backlash"], look_at="gears, coupling and set screws: turn by hand with the actuator holding"),
    "end_stop": replace(EFFECT_WORDS["end_stop"], reasons="the joint touches the frame; a limit set in the controller; the sensor's range ends",
        look_at="what the joint touches there; the controller's limits; the sensor's range"),
}  # fmt: skip
"""Effect -> its words where those of two muscles and their regulators would be another rig's."""


def words_of(effect: str, channels: Channels) -> EffectWords | None:
    """An effect in the words of a rig; None for one of another package."""
    return EFFECT_WORDS.get(effect) if channels.has_valves else _OTHERWISE.get(effect, EFFECT_WORDS.get(effect))
