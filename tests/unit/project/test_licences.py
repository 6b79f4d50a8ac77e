"""The licences of what pamrig stands on, checked against its own, Apache-2.0."""

import re
import tomllib
from importlib.metadata import PackageNotFoundError, metadata

import pytest
from conftest import ROOT

PERMISSIVE = (
    "MIT",
    "BSD",
    "Apache",
    "PSF",
    "Python Software Foundation",
    "0BSD",
    "Zlib",
    "CC0",
    "HPND",
    "ISC",
    "matplotlib",
)
"""May be used by and shipped beside a program under Apache-2.0 without further conditions than to name them."""
EXTRAS = {
    "nptdms": "LGPL-3.0: an extra, imported unchanged as a library of its own and never shipped with pamrig",
    "fmpy": "BSD-2-Clause, by its file; its metadata do not say so",
    "tqdm": "MPL-2.0 and MIT: files of their own, unchanged",
}
TESTS_ONLY = {
    "hypothesis": "MPL-2.0: runs the tests",
    "pytest-rerunfailures": "MPL-2.0: runs the tests",
    "pathspec": "MPL-2.0: used by the linters and the build",
    "certifi": "MPL-2.0: of requests, which builds the site",
    "pymcap-cli": "GPL-3.0: a program of its own that the tests start to open our files; nothing of ours imports it",
    "mcap-ros2-support-fast": "GPL-3.0: of pymcap-cli",
    "ros-parser": "GPL-3.0: of pymcap-cli",
    "small-mcap": "GPL-3.0: of pymcap-cli",
}


def locked(file: str) -> list[str]:
    return re.findall(r"^([A-Za-z0-9_.-]+)==", (ROOT / file).read_text(), re.MULTILINE)


def licence(package: str) -> str:
    """What the package says of itself: the expression, else the classifiers, else the first line of its text."""
    said = metadata(package)
    classifiers = [line for line in said.get_all("Classifier") or [] if line.startswith("License ::")]
    text = said.get("License") or ""
    return said.get("License-Expression") or " ".join(classifiers[-1:]) or text.partition("\n")[0]


def permissive(text: str) -> bool:
    return any(word in text for word in PERMISSIVE) and not re.search(r"GPL|MPL|Mozilla|AGPL|EUPL|SSPL", text)


@pytest.mark.parametrize("package", sorted({*locked("requirements.lock"), *locked("requirements-test.lock")}))
def test_a_dependency_may_stand_beside_apache_2(package: str) -> None:
    try:
        said = licence(package)
    except PackageNotFoundError:
        pytest.skip("not for this machine")
    runs = package in locked("requirements.lock") and package not in ("pathspec", "hatchling")
    excused = EXTRAS | ({} if runs else TESTS_ONLY)
    assert permissive(said) or package in excused, f"{package}: {said}"


def test_what_others_wrote_and_we_keep_has_its_licence_beside_it() -> None:
    shipped, tests_only = ROOT / "rig" / "service" / "web" / "static" / "uplot", ROOT / "tests" / "support" / "axe"
    assert "MIT License" in (shipped / "LICENSE").read_text()
    assert "Mozilla Public License" in (tests_only / "LICENSE").read_text()  # unchanged, and in no wheel
    assert {path.name for path in shipped.iterdir()} == {"LICENSE", "uPlot.iife.min.js", "uPlot.min.css"}


def test_a_copyleft_licence_is_no_permissive_one() -> None:
    assert permissive("OSI Approved :: MIT License")
    assert not permissive("LGPL-3.0-only")
    assert not permissive("MPL-2.0 AND MIT")
    assert not permissive("")


def test_the_licence_is_there_and_the_package_says_it() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["license"] == "Apache-2.0"
    assert "Apache License" in (ROOT / "LICENSE").read_text()


def test_the_changelog_knows_the_version() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert f"\n## [{project['version']}]" in (ROOT / "CHANGELOG.md").read_text()
