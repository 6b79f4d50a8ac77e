"""One unit of each family of physics plants, for the tests that ask the same of all of them."""

import pytest

from hil.reference.names import NAMES


@pytest.fixture(scope="module", params=NAMES)
def build(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(scope="module")
def plant(build):
    from hil.reference.families import unit  # every pytest loads this file, and these are compiled

    return unit(build, 3)
