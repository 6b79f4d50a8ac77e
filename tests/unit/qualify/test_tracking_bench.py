"""The program of `pamrig bench tracking` that times a closed tick is one: it looks at the angle in every tick."""

from rig.app import compose, shipped
from rig.qualify.benchmarks.tracking import CASES, closed_at_rest
from rig.realtime.closed_loop import TrackingProgram
from rig.sample import Phase


def test_the_timed_program_follows_an_angle_all_the_time() -> None:
    made = closed_at_rest(compose.load(None), 50)
    assert isinstance(made, TrackingProgram)
    rest = made.rest_p1_mpa, made.rest_p2_mpa
    at = [made.at(index, rest, 2.0, 0, rest) for index in range(10, 60)]
    assert {phase for phase, _, _ in at} == {Phase.SWEEP}
    assert at[20][1] < rest[0] < at[20][2], "an angle above its reference is pushed down"


def test_every_case_names_a_rig_that_comes_with_pamrig() -> None:
    for case in CASES:
        assert (shipped.configs() / "rigs" / f"{case.rig}.yaml").is_file()
        assert case.changed
