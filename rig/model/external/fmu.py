"""An FMU (FMI 2 or 3, co-simulation) as a simulator, by FMPy.

Its inputs are called p1_cmd_mpa and p2_cmd_mpa (or dp_cmd_mpa alone), its output angle_deg, unless a model's file gives
other names; a parameter start_deg, where it has one, gets the angle at the start.
"""

import atexit
import os
import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from rig.errors import ModelError

OUTPUT: Final = "angle_deg"
INPUTS: Final = ("p1_cmd_mpa", "p2_cmd_mpa", "dp_cmd_mpa")
START: Final = "start_deg"
VERSIONS: Final = ("2", "3")


class Fmu:
    """An unpacked FMU: called with columns, it answers with one."""

    def __init__(self, source: Path, folder: str, description: Any, names: Mapping[str, str]) -> None:
        self._source, self._folder, self._description = source, folder, description
        self._names = {name: names.get(name, name) for name in (*INPUTS, OUTPUT, START)}
        known = {variable.name: variable.causality for variable in description.modelVariables}
        self._inputs = [name for name in INPUTS if known.get(self._names[name]) == "input"]
        self._starts = known.get(self._names[START]) in ("parameter", "input")
        self._require(known)

    def __call__(self, time_s: Any, p1_mpa: Any, p2_mpa: Any, start_deg: float) -> Any:
        """The angle (n,) one sample time after each row's set-points were given, deg."""
        import fmpy

        given = {"p1_cmd_mpa": p1_mpa, "p2_cmd_mpa": p2_mpa, "dp_cmd_mpa": p1_mpa - p2_mpa}
        table = np.zeros(
            len(time_s), [("time", np.float64), *((self._names[name], np.float64) for name in self._inputs)]
        )
        table["time"] = time_s
        for name in self._inputs:
            table[self._names[name]] = given[name]
        dt_s = float(time_s[1] - time_s[0])
        found = fmpy.simulate_fmu(
            self._folder,
            start_time=0.0,
            stop_time=len(time_s) * dt_s,
            step_size=dt_s,
            output_interval=dt_s,
            input=table,
            output=[self._names[OUTPUT]],
            fmi_type="CoSimulation",
            model_description=self._description,
            start_values={self._names[START]: start_deg} if self._starts else {},
            validate=False,
        )
        return found[self._names[OUTPUT]][1 : len(time_s) + 1]

    def _require(self, known: Mapping[str, str]) -> None:
        inputs = [name for name, causality in known.items() if causality == "input"]
        outputs = [name for name, causality in known.items() if causality == "output"]
        if "dp_cmd_mpa" not in self._inputs and not {"p1_cmd_mpa", "p2_cmd_mpa"} <= set(self._inputs):
            raise ModelError(
                f"{self._source}: no inputs p1_cmd_mpa and p2_cmd_mpa, nor dp_cmd_mpa; its inputs are "
                f"{', '.join(inputs) or 'none'} (muscle.names in a MODEL.yaml says which is which)"
            )
        if known.get(self._names[OUTPUT]) != "output":
            raise ModelError(
                f"{self._source}: no output {self._names[OUTPUT]}; its outputs are {', '.join(outputs) or 'none'} "
                "(muscle.names in a MODEL.yaml says which is which)"
            )


def load_fmu(source: Path, names: Mapping[str, str]) -> Fmu:
    """The FMU, unpacked until the program ends; ModelError when it cannot run here."""
    try:
        import fmpy
    except ImportError:
        raise ModelError(f"{source}: an FMU needs the package fmpy: pip install 'pamrig[fmu]'") from None
    if not os.path.isfile(source):
        raise ModelError(f"{source}: no such file")
    try:
        description = fmpy.read_model_description(str(source), validate=False)
        platforms = fmpy.supported_platforms(str(source))
    except Exception as error:  # noqa: BLE001  # whatever FMPy says of a file that is no FMU
        raise ModelError(f"{source}: is no FMU: {type(error).__name__}: {' '.join(str(error).split())[:200]}") from None
    if description.coSimulation is None or str(description.fmiVersion)[:1] not in VERSIONS:
        raise ModelError(f"{source}: FMI {description.fmiVersion}; needed: FMI 2 or 3 for co-simulation")
    here = {fmpy.platform, fmpy.platform_tuple}
    if not here & set(platforms):
        raise ModelError(f"{source}: is for {', '.join(platforms) or 'no platform'}; this machine is {fmpy.platform}")
    folder = tempfile.mkdtemp(prefix="pamrig-fmu-")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    fmpy.extract(str(source), folder)
    return Fmu(source, folder, description, names)
