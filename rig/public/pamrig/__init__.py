"""pamrig as a library: what a notebook, a script or another project's tests call. Whatever is not in `__all__` here is
private and may change without notice.

    >>> import pamrig
    >>> runs = pamrig.run("quick", pamrig.simulated_rig(seed=7), out="first")
    >>> records = pamrig.read("first")
    >>> model = pamrig.load_model("simulated")
    >>> pamrig.validate(model, records).bounded
    True

Places are paths as text or `Path`; a sweep, a rig or a model may also be the name of one that comes with pamrig. Bad
input raises an `Error`, whose text is one line that says what, where and what is allowed. Importing this takes
milliseconds: numpy and all that stands on it come with the first call.
"""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from pamrig._comparing import Comparison, compare
    from pamrig._diagnosing import Diagnosis, diagnose
    from pamrig._models import Identified, Model, Validation, identify, load_model, save_model, simulate, validate
    from pamrig._picture import Picture
    from pamrig._records import Record, Records, read
    from pamrig._rigs import Replay, Rig, Runs, load_rig, replay, run, simulated_rig
    from rig.errors import CheckFailed, ConfigError, EnvelopeError, ModelError, RecordError, StateError
    from rig.errors import RigError as Error
    from rig.service.client import Client

__all__ = [
    "CheckFailed", "Client", "Comparison", "ConfigError", "Diagnosis", "EnvelopeError", "Error", "Identified", "Model",
    "ModelError", "Picture", "Record", "RecordError", "Records", "Replay", "Rig", "Runs", "StateError", "Validation",
    "compare", "diagnose", "identify", "load_model", "load_rig", "read", "replay", "run", "save_model", "simulate",
    "simulated_rig", "validate",
]  # fmt: skip

_HOMES = {
    "pamrig._records": ("Record", "Records", "read"),
    "pamrig._rigs": ("Replay", "Rig", "Runs", "load_rig", "replay", "run", "simulated_rig"),
    "pamrig._models": (
        "Identified", "Model", "Validation", "identify", "load_model", "save_model", "simulate", "validate"
    ),
    "pamrig._diagnosing": ("Diagnosis", "diagnose"),
    "pamrig._comparing": ("Comparison", "compare"),
    "pamrig._picture": ("Picture",),
    "rig.errors": ("CheckFailed", "ConfigError", "EnvelopeError", "ModelError", "RecordError", "StateError"),
    "rig.service.client": ("Client",),
}  # fmt: skip
"""Module -> the public names that live there; each is imported when one of its names is first asked for."""
_HOME_OF = {name: home for home, names in _HOMES.items() for name in names}


def __getattr__(name: str) -> Any:
    if name == "Error":
        found: Any = importlib.import_module("rig.errors").RigError
    elif name in _HOME_OF:
        found = getattr(importlib.import_module(_HOME_OF[name]), name)
    else:
        raise AttributeError(f"module 'pamrig' has no attribute {name!r}")
    globals()[name] = found
    return found


def __dir__() -> list[str]:
    return __all__
