"""The story of a hunt as one page: what was found after each step, and why the next sweep."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.sentences import headline
from rig.gap.answer.words.sizes import percent
from rig.outputs import OutputKind, write_text
from rig.own_units import own_text
from rig.report.templates import rendered

_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Hunt for the gap of {{ rig }}</title>
<style>
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff;
  margin: 0 auto; padding: 1rem; max-width: 50rem; }
li { margin-bottom: 1rem; }
.bar { display: inline-block; height: .7em; background: #0072b2; }
table { border-collapse: collapse; }
td { padding: .1rem .6rem .1rem 0; }
</style>
</head>
<body>
<h1>Hunt for the gap of {{ rig }}</h1>
{% for line in lines %}
<p>{{ line }}</p>
{% endfor %}
<p>{{ steps | length }} {{ "sweep" if steps | length == 1 else "sweeps" }}, {{ minutes }} min on the rig.
Ended: {{ ended }}.
{% if report %}<a href="{{ report }}">The whole report</a>.{% endif %}</p>
<ol>
{% for step in steps %}
<li><b>{{ step.why }}</b> ({{ step.minutes }} min, <code>{{ step.sweep }}</code>)
{% if step.names %}
<br>Still possible afterwards:
<table>
{% for name, chance in step.names %}
<tr><td>{{ name }}</td><td>{{ percent(chance) }}</td>
<td><span class="bar" style="width: {{ (12 * chance) | round(2) }}rem"></span></td></tr>
{% endfor %}
</table>
{% else %}
<br>Not recorded.
{% endif %}
</li>
{% endfor %}
</ol>
</body>
</html>
"""


@dataclass(frozen=True)
class ToldStep:
    """One step as the page tells it."""

    sweep: str
    why: str
    minutes: str
    names: Sequence[tuple[str, float]]


def write_hunt(
    path: Path,
    rig: str,
    steps: Sequence[ToldStep],
    minutes: float,
    ended: str,
    diagnosis: Diagnosis | None,
    report: str,
) -> None:
    """Write the page; `report` is the name of the diagnosis' own page beside it. RigError when it cannot be written."""
    page = rendered(
        _PAGE,
        rig=rig,
        lines=[] if diagnosis is None else [own_text(line, diagnosis.channels) for line in headline(diagnosis)],
        steps=steps,
        percent=percent,
        minutes=f"{minutes:.1f}",
        ended=ended or "before its end",
        report=report,
    )
    write_text(path, page, OutputKind.PAGE)
