"""What the first compiled kernel of a process brings with it: which modules are loaded is checked, not time."""

import subprocess
import sys


def modules_after(code: str) -> list[str]:
    """All modules that are loaded after `code`, in a fresh interpreter; what it prints comes first."""
    script = f"import sys\n{code}\nprint('\\n' + ' '.join(sys.modules))"
    done = subprocess.run([sys.executable, "-c", script], check=True, capture_output=True, text=True)
    return done.stdout.split()


def test_the_first_kernel_loads_no_linear_algebra_of_scipy() -> None:
    code = (
        "import numpy as np\nfrom rig.model.compiled.response import stops\n"
        "print(stops(np.array([0.0, 1.0, 3.0]), np.array([2.0]), np.ones(1)).tolist())"
    )
    after = modules_after(code)
    assert after[:3] == ["[0.0,", "1.0,", "2.0]"]
    assert "numba.np.arraymath" in after
    assert "scipy.linalg" not in after


def test_a_kernel_of_someone_else_still_finds_linear_algebra() -> None:
    code = (
        "import numpy as np, numba\nimport rig.model.compiled.stages\n"
        "print(numba.njit(lambda a, b: np.dot(a, b))(np.ones(3), np.ones(3)))"
    )
    after = modules_after(code)
    assert after[0] == "3.0"
    assert "scipy.linalg" in after
