"""The page of a campaign of days: one overview with a line a day, each leading to that day's own page."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Final
from urllib.parse import quote

from rig.gap.answer.result import Diagnosis
from rig.gap.answer.words.sentences import headline
from rig.gap.answer.words.sizes import degrees
from rig.outputs import OutputKind, write_text
from rig.own_units import own_text
from rig.report.templates import rendered

_PAGE: Final = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Gap diagnosis of {{ days | length }} days</title>
<style>
:root { color-scheme: light; }
body { font: 16px/1.5 system-ui, sans-serif; color: #1a1a1a; background: #fff;
  margin: 0 auto; padding: 1rem; max-width: 60rem; overflow-wrap: anywhere; }
table { border-collapse: collapse; width: 100%; }
th, td { text-align: left; padding: .25rem .6rem; border-bottom: 1px solid #ddd; overflow-wrap: break-word; }
td:first-child { overflow-wrap: anywhere; min-width: 6rem; }
td.n, th.n { text-align: right; font-variant-numeric: tabular-nums; }
@media (max-width: 40rem) {
  table, tbody, tr, td { display: block; } tr:first-child { display: none; } tr { border-bottom: 2px solid #bbb; }
  td, td.n { border: 0; text-align: left; padding: .1rem 0; overflow-wrap: anywhere; }
  td[data-is]::before { content: attr(data-is) ": "; color: #555; }
}
</style>
</head>
<body>
<h1>Gap between simulator and rig, {{ days | length }} days</h1>
{% if sessions %}
<p>Compared with {{ sessions | join(", ") }}.</p>
{% endif %}
<table class="wide">
<tr><th>day</th><th>verdict</th><th>causes</th>
<th class="n">gap, deg rms</th><th class="n">times what is usual</th>
<th class="n">with the causes, deg rms</th></tr>
{% for day in days %}
<tr><td><a href="{{ day.link }}">{{ day.name }}</a></td><td data-is="verdict">{{ day.verdict }}</td>
<td data-is="causes">{{ day.causes }}{% if day.answer %}<br><small>{{ day.answer }}</small>{% endif %}</td>
<td class="n" data-is="gap, deg rms">{{ day.gap }}</td>
<td class="n" data-is="times what is usual">{{ day.ratio }}</td>
<td class="n" data-is="with the causes, deg rms">{{ day.after }}</td></tr>
{% endfor %}
</table>
</body>
</html>
"""


def write_page(path: Path, diagnoses: Mapping[str, Diagnosis], pages: Mapping[str, Path], sessions: list[str]) -> None:
    """Write the page; `pages` has each day's own, in the same folder. RigError when the file cannot be written."""
    days = [_line(name, diagnosis, pages[name]) for name, diagnosis in diagnoses.items()]
    channels = next(iter(diagnoses.values())).channels
    page = own_text(_PAGE, channels)
    write_text(path, rendered(page, days=days, sessions=sessions), OutputKind.PAGE)


def _line(name: str, diagnosis: Diagnosis, page: Path) -> dict[str, str]:
    causes, by = diagnosis.causes, diagnosis.channels.output_per_deg
    return {
        "name": name,
        "link": quote(os.fsencode(page.name)),
        "verdict": diagnosis.verdict.replace("_", " "),
        "answer": own_text(headline(diagnosis)[0], diagnosis.channels) if causes else "",
        "causes": ", ".join(cause.effect for cause in causes) or "-",
        "gap": degrees(by * diagnosis.gap.rms_deg),
        "ratio": f"{diagnosis.gap.ratio:.1f}",
        "after": degrees(by * diagnosis.gap.after_deg) if causes else "-",
    }
