"""The paper's sweep on a rig of one's choice, and a simulated rig without noise to compare with."""

import subprocess
import sys
from pathlib import Path

EXACT = """
name: simulated without noise
safe: {{p1_mpa: 0.2, p2_mpa: 0.2, return_mpa_s: 0.2}}
limits: {{pressure_mpa: [0.005, 0.5], slew_mpa_s: 5.0, angle_deg: [-90.0, 90.0]}}
devices:
  main:
    {{kind: simulated, model: {model}, pressure_noise_mpa: 0.0, angle_noise_deg: 0.0, monitor_bits: 24, angle_bits: 24,
     angle_offset_deg: 0.0}}
roles: {{valve_1: main, valve_2: main, monitor_1: main, monitor_2: main, angle: main}}
"""


def run(rig: Path, out: Path, clock: str = "virtual") -> Path:
    """`pamrig run quick`, the paper's 0.5 Hz sine of 0.2 MPa."""
    code = "from rig.cli.main import main; main()"
    arguments = ["run", "quick", "--rig", str(rig), "--out", str(out), "--clock", clock]
    done = subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return out
