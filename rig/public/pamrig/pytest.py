"""The pytest plugin: a simulated rig in the tests of other people's repositories.

Installed with pamrig, it is there in every pytest: the fixtures `simulated_rig`, `run_sweep`, `assert_close_to` and
`assert_no_gap`, and the option `--pamrig-update`. Nothing of pamrig is imported before a test asks for one of them.
"""

from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import pytest

if TYPE_CHECKING:
    from pamrig import Model, Record, Records, Rig
    from pamrig._places import Logs

GOLDEN = "golden"
"""Folder beside a test file that holds its reference records."""
REFERENCE_FACTS = ("signal", "frequency_hz", "amplitude_mpa", "p0_mpa", "repeat", "rig", "seed", "pamrig", "channels")
"""What a reference says of its run: nothing of the machine, so that it changes when the rig does."""


class RunSweep(Protocol):
    """What the fixture `run_sweep` is."""

    def __call__(self, sweep: str | Path | dict[str, Any], rig: "Rig | str | Path | None" = None) -> "Records":
        """The records of a sweep on a rig, on the virtual clock where it is simulated."""


class AssertCloseTo(Protocol):
    """What the fixture `assert_close_to` is."""

    def __call__(self, record: "Record", to: "Logs | None" = None, *, within: float) -> None:
        """Fails when the angle differs by more than `within` (deg) anywhere from `to`, or from the test's own
        reference."""


class AssertNoGap(Protocol):
    """What the fixture `assert_no_gap` is."""

    def __call__(
        self, logs: "Logs", model: "Model | str | Path | None" = "simulated", baselines: "Iterable[Logs]" = ()
    ) -> None:
        """Fails, with the diagnosis in words, when the records differ from the simulator or from earlier days by more
        than usual."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """The option that writes references anew."""
    group = parser.getgroup("pamrig", "a pneumatic-muscle rig and its simulator")
    group.addoption("--pamrig-update", action="store_true", help="write the reference records of assert_close_to anew")


@pytest.fixture
def simulated_rig() -> "Callable[..., Rig]":
    """`simulated_rig(effects={"delay": {"delay_s": 0.02}}, seed=3)`: see `pamrig.simulated_rig`."""
    import pamrig

    return pamrig.simulated_rig


@pytest.fixture
def run_sweep(tmp_path_factory: pytest.TempPathFactory) -> RunSweep:
    """`run_sweep(sweep, rig)`: the records of a sweep, recorded in a temporary folder. A run that is not valid fails
    the test."""

    def carry_out(sweep: str | Path | dict[str, Any], rig: "Rig | str | Path | None" = None) -> "Records":
        import pamrig

        try:
            return pamrig.run(sweep, rig, out=tmp_path_factory.mktemp("sweep")).records
        except pamrig.CheckFailed as error:
            pytest.fail(str(error), pytrace=False)

    return carry_out


@pytest.fixture
def assert_close_to(request: pytest.FixtureRequest) -> AssertCloseTo:
    """`assert_close_to(record, within=0.5)`: as the reference in golden/ beside the test file, which
    `--pamrig-update` writes; or `assert_close_to(record, other, within=0.5)`."""

    def check(record: "Record", to: "Logs | None" = None, *, within: float) -> None:
        import pamrig

        reference = to if to is not None else _reference(request, record)
        try:
            pamrig.compare(reference, record).require_within(within)
        except pamrig.CheckFailed as error:
            pytest.fail(str(error), pytrace=False)

    return check


@pytest.fixture
def assert_no_gap() -> AssertNoGap:
    """`assert_no_gap(records)`: the simulator says what the rig does; with `baselines`, the rig does what it did."""

    def check(logs: "Logs", model: "Model | str | Path | None" = "simulated", baselines: "Iterable[Logs]" = ()) -> None:
        import pamrig

        found = pamrig.diagnose(model, logs, baselines)
        if found.verdict != "none":
            pytest.fail("\n".join(f"{question} {answer}" for question, answer in found.answers.items()), pytrace=False)

    return check


def _reference(request: pytest.FixtureRequest, record: "Record") -> Path:
    """The reference of this record in this test; written now where that was asked for."""
    from rig.log.convert import write_record
    from rig.outputs import file_name

    test = request.node
    place: Path = test.path.parent / GOLDEN / file_name(test.name) / f"{file_name(record.name)}.mcap"
    if test.config.getoption("--pamrig-update"):
        place.parent.mkdir(parents=True, exist_ok=True)
        place.unlink(missing_ok=True)
        known = {key: record.facts[key] for key in REFERENCE_FACTS if key in record.facts}
        write_record(replace(record, extra={}, facts=known), place, {})
    if not place.exists():
        pytest.fail(f"{place}: no reference yet; `pytest --pamrig-update` writes it", pytrace=False)
    return place
