"""A real FMU for tests: C compiled here, FMI 2 or 3 for co-simulation. A first-order joint with a play behind it."""

import subprocess
import zipfile
from pathlib import Path

import fmpy
from fmpy.fmi2 import FMU2Slave
from fmpy.fmi3 import FMU3Slave

LAG_S, PLAY_DEG, DEG_PER_MPA = 0.06, 1.5, 180.0
GUID = "{5d1c1f0e-0b1f-4a55-9d0c-0a5c3c1e9f11}"
NAMES = {1: "p1_cmd_mpa", 2: "p2_cmd_mpa", 3: "angle_deg", 4: "start_deg"}

_PHYSICS = f"""
#include <stdlib.h>
#include <math.h>
typedef struct {{ double v[5]; double x; double y; }} Plant;
static void begin(Plant *m) {{ m->x = m->v[4]; m->y = m->v[4]; m->v[3] = m->v[4]; }}
static void step(Plant *m, double h) {{
    m->x += (1.0 - exp(-h / {LAG_S})) * ({DEG_PER_MPA} * (m->v[1] - m->v[2]) - m->x);
    if (m->x - m->y > {PLAY_DEG}) m->y = m->x - {PLAY_DEG};
    if (m->y - m->x > {PLAY_DEG}) m->y = m->x + {PLAY_DEG};
    m->v[3] = m->y;
}}
"""
_FMI2 = """
#include "fmi2Functions.h"
const char *fmi2GetTypesPlatform(void) { return "default"; }
const char *fmi2GetVersion(void) { return "2.0"; }
fmi2Component fmi2Instantiate(fmi2String n, fmi2Type t, fmi2String g, fmi2String r, const fmi2CallbackFunctions *f,
                              fmi2Boolean v, fmi2Boolean l) { return calloc(1, sizeof(Plant)); }
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean l, size_t n, const fmi2String k[]) { return fmi2OK; }
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean a, fmi2Real t, fmi2Real b, fmi2Boolean d, fmi2Real e)
    { return fmi2OK; }
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { begin(c); return fmi2OK; }
fmi2Status fmi2Terminate(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2Reset(fmi2Component c) { return fmi2OK; }
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, fmi2Real v[])
    { for (size_t k = 0; k < n; k++) v[k] = ((Plant *)c)->v[r[k]]; return fmi2OK; }
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference r[], size_t n, const fmi2Real v[])
    { for (size_t k = 0; k < n; k++) ((Plant *)c)->v[r[k]] = v[k]; return fmi2OK; }
fmi2Status fmi2DoStep(fmi2Component c, fmi2Real t, fmi2Real h, fmi2Boolean p) { step(c, h); return fmi2OK; }
"""
_FMI3 = """
#include "fmi3Functions.h"
const char *fmi3GetVersion(void) { return "3.0"; }
fmi3Instance fmi3InstantiateCoSimulation(fmi3String n, fmi3String g, fmi3String r, fmi3Boolean v, fmi3Boolean l,
    fmi3Boolean e, fmi3Boolean early, const fmi3ValueReference q[], size_t m, fmi3InstanceEnvironment env,
    fmi3LogMessageCallback log, fmi3IntermediateUpdateCallback u) { return calloc(1, sizeof(Plant)); }
void fmi3FreeInstance(fmi3Instance c) { free(c); }
fmi3Status fmi3SetDebugLogging(fmi3Instance c, fmi3Boolean l, size_t n, const fmi3String k[]) { return fmi3OK; }
fmi3Status fmi3EnterInitializationMode(fmi3Instance c, fmi3Boolean a, fmi3Float64 t, fmi3Float64 b, fmi3Boolean d,
    fmi3Float64 e) { return fmi3OK; }
fmi3Status fmi3ExitInitializationMode(fmi3Instance c) { begin(c); return fmi3OK; }
fmi3Status fmi3Terminate(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3Reset(fmi3Instance c) { return fmi3OK; }
fmi3Status fmi3GetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, fmi3Float64 v[], size_t m)
    { for (size_t k = 0; k < n; k++) v[k] = ((Plant *)c)->v[r[k]]; return fmi3OK; }
fmi3Status fmi3SetFloat64(fmi3Instance c, const fmi3ValueReference r[], size_t n, const fmi3Float64 v[], size_t m)
    { for (size_t k = 0; k < n; k++) ((Plant *)c)->v[r[k]] = v[k]; return fmi3OK; }
fmi3Status fmi3DoStep(fmi3Instance c, fmi3Float64 t, fmi3Float64 h, fmi3Boolean p, fmi3Boolean *ev, fmi3Boolean *te,
    fmi3Boolean *early, fmi3Float64 *last) { step(c, h); *ev = *te = *early = 0; *last = t + h; return fmi3OK; }
"""


def make_fmu(path: Path, version: int = 2, platform: str | None = None) -> Path:
    """The FMU at `path`, for this machine or (then without a library that could be loaded) for `platform`."""
    work = path.parent / f"{path.stem}_source"
    work.mkdir()
    source, library = work / "plant.c", work / "plant.so"
    code = _PHYSICS + (_FMI2 if version == 2 else _FMI3)
    source.write_text(code)
    (work / "rest.c").write_text(_rest(code, FMU2Slave if version == 2 else FMU3Slave))
    headers = Path(fmpy.__file__).parent / "c-code"
    call = ["gcc", "-shared", "-fPIC", "-O2", f"-I{headers}", source, work / "rest.c", "-o", library, "-lm"]
    subprocess.run(call, check=True)
    folder = platform or (fmpy.platform if version == 2 else fmpy.platform_tuple)
    with zipfile.ZipFile(path, "w") as fmu:
        fmu.writestr("modelDescription.xml", _description(version))
        fmu.write(library, f"binaries/{folder}/plant.{'dll' if folder.startswith('win') else 'so'}")
    return path


def _rest(code: str, kind: type) -> str:
    """What the standard wants exported as well, and this plant has no use for: each says that it failed."""
    wanted = [name for name in dir(kind) if name.startswith(("fmi2", "fmi3")) and f"{name}(" not in code]
    return "".join(f"int {name}(void) {{ return 3; }}\n" for name in wanted)


def _description(version: int) -> str:
    rows = {
        "p1_cmd_mpa": 'causality="input" variability="continuous"',
        "p2_cmd_mpa": 'causality="input" variability="continuous"',
        "angle_deg": 'causality="output" variability="continuous"',
        "start_deg": 'causality="parameter" variability="fixed"',
    }
    start = {name: "" if name == "angle_deg" else 'start="0"' for name in rows}
    if version == 2:
        variables = "".join(
            f'<ScalarVariable name="{name}" valueReference="{number}" {rows[name]}><Real {start[name]}/>'
            "</ScalarVariable>"
            for number, name in NAMES.items()
        )
        structure = '<Outputs><Unknown index="3"/></Outputs>'
        return (
            f'<?xml version="1.0"?><fmiModelDescription fmiVersion="2.0" modelName="plant" guid="{GUID}">'
            '<CoSimulation modelIdentifier="plant" canHandleVariableCommunicationStepSize="true"/>'
            f"<ModelVariables>{variables}</ModelVariables><ModelStructure>{structure}</ModelStructure>"
            "</fmiModelDescription>"
        )
    variables = "".join(
        f'<Float64 name="{name}" valueReference="{number}" {rows[name]} {start[name]}/>'
        for number, name in NAMES.items()
    )
    return (
        f'<?xml version="1.0"?><fmiModelDescription fmiVersion="3.0" modelName="plant" instantiationToken="{GUID}">'
        '<CoSimulation modelIdentifier="plant" canHandleVariableCommunicationStepSize="true"/>'
        f"<ModelVariables>{variables}</ModelVariables>"
        '<ModelStructure><Output valueReference="3"/></ModelStructure></fmiModelDescription>'
    )
