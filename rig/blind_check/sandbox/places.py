"""What an interpreter with our packages needs to read, and the device that swallows."""

import sys
import sysconfig
from pathlib import Path
from typing import Final

_SYSTEM: Final = (
    "/usr",
    "/lib",
    "/lib64",
    "/bin",
    "/etc",
    "/sys/devices/system/cpu",
    "/proc/cpuinfo",
    "/proc/meminfo",
    "/dev/urandom",
)
SYSTEM_PLACES: Final = tuple(Path(path) for path in _SYSTEM)
SYSTEM_WRITABLE: Final = (Path("/dev/null"),)


def python_places() -> list[Path]:
    """Installation, environment and the package `rig`, not its neighbours."""
    import rig

    paths = [sys.prefix, sys.base_prefix, sysconfig.get_path("stdlib"), sysconfig.get_path("platstdlib")]
    return [*(Path(path) for path in paths), Path(rig.__file__).parent]
