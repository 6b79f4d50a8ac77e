"""The numbers that the paper prints for its models, as data: they are not the simulator's defaults.

What they mean is not settled by the paper (units of u and y, divisor of theta); `Reading` makes that explicit, and
docs/explanation/paper_findings.md says which readings stay bounded. Table II is
`rig.identify.search.swarm.SwarmSettings`.
"""

from dataclasses import dataclass

from rig.model.parameters import Input, Model, MuscleModel, Parameter, Provenance, StageKind, StageModel, ValidRange

TABLE_3 = {
    "lambda1": 0.9876,
    "lambda2": 0.8542,
    "xi1": 0.0016,
    "xi2": 0.3372,
    "phi1": -0.0045,
    "phi2": -0.5068,
    "beta1": 0.0080,
    "beta2": -0.2762,
}
"""Table III: the modified Bouc-Wen model (11) identified on the 0.5 Hz sine."""
FIG_1 = {"lambda1": 0.995, "lambda2": 0.995, "xi": 0.8, "psi": 0.04, "beta": -0.08}
"""Caption of Fig. 1: the Bouc-Wen model (8), u in -1..1, y in about -40..40."""
DEGREES_PER_RADIAN = 57.29577951308232


@dataclass(frozen=True)
class Reading:
    """What the printed numbers are taken to mean."""

    u_unit_mpa: float
    """Pressure at which u is 1: 1 for MPa, 0.1 for bar, the sine's amplitude for -1..1."""
    y_unit_deg: float
    """Degrees at which y is 1: 57.3 for radians."""
    theta_divisor_s: float
    """What theta in (8) divides by; the paper says the sample time, 0.005 s."""


LITERAL = Reading(1.0, DEGREES_PER_RADIAN, 0.005)
"""u in MPa, y in radians, the sample time as divisor: the only reading of Table III in the paper's own units that
closes a loop."""
FIG_1_READING = Reading(0.2, 1.0, 0.044)
"""u in -1..1 at 0.2 MPa, y in degrees, and the divisor that gives the figure's +-40."""


def printed_model(numbers: dict[str, float], reading: Reading) -> Model:
    """The printed numbers under a reading, driven by the command as in the paper."""
    units = {
        "theta_divisor_s": Parameter(reading.theta_divisor_s, "s"),
        "u_unit_mpa": Parameter(reading.u_unit_mpa, "MPa"),
        "y_unit_deg": Parameter(reading.y_unit_deg, "deg"),
        "mean_exponent": Parameter(0.0),
    }
    kind = StageKind.BW if "xi" in numbers else StageKind.MBW
    muscle = MuscleModel(kind, {name: Parameter(value) for name, value in numbers.items()} | units, Input.COMMAND)
    return Model(
        muscle,
        valve=StageModel(StageKind.DIRECT),
        valid=ValidRange((0.5, 0.5), 0.18 if kind == StageKind.MBW else 0.2),
        provenance=Provenance(
            text="Printed by Dao et al., ICAMechS 2020; see docs/explanation/paper_findings.md for the reading."
        ),
    )
