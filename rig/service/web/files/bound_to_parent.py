"""`python -m rig.service.web.files.bound_to_parent PARENT MODULE ...`: runs a module as if it were called itself.

It runs at the lowest priority, and ends with the process PARENT that started it, however that ends.
"""

import ctypes
import os
import runpy
import signal
import sys
from typing import Final

_PR_SET_PDEATHSIG: Final = 1
_NICE: Final = 19


def main() -> None:
    """The parent may be gone before the kernel has been asked, so its pid is compared too."""
    os.setpriority(os.PRIO_PROCESS, 0, _NICE)
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    parent, module, *sys.argv[1:] = sys.argv[1:]
    if os.getppid() == int(parent):
        runpy.run_module(module, run_name="__main__", alter_sys=True)


if __name__ == "__main__":
    main()
