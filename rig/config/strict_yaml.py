"""YAML read strictly: no key twice, numbers that are what they look like, no document that grows when it is written
out; and what is wrong with one in words of somebody who writes it."""

import itertools
import re
from typing import Any

import yaml

MOST_VALUES = 500_000
"""No config holds more values; anchors and aliases that multiply count as often as they stand for something."""
_PROBLEMS = {
    "found character '\\t' that cannot start any token": "a tab; indent by spaces",
    "expected <block end>, but found '<block mapping start>'": "it is indented otherwise than the lines before it",
    "expected <block end>, but found '-'": "a list is indented otherwise than the lines before it",
    "mapping values are not allowed here": (
        "a colon where none can stand: here or in the line before, a space behind a colon is missing or the indent is "
        "wrong"
    ),
}
"""What PyYAML says -> the same for somebody who knows no tokens and blocks."""


def built(text: str) -> object:
    """The document as plain data; yaml.YAMLError, or ValueError, when it is broken or too large."""
    loader = StrictLoader(text)
    try:
        root = loader.get_single_node()
        if root is None:
            return None
        if _values(root, {}) > MOST_VALUES:
            raise yaml.YAMLError(f"it stands for more than {MOST_VALUES} values, written out")
        return loader.construct_document(root)
    finally:
        loader.dispose()


def _values(node: yaml.Node, known: dict[int, int]) -> int:
    """How many values a part of a document stands for when each alias is written out."""
    if isinstance(node, yaml.ScalarNode):
        return 1
    if id(node) not in known:
        known[id(node)] = MOST_VALUES  # a list that holds itself has no end
        parts = itertools.chain(*node.value) if isinstance(node, yaml.MappingNode) else node.value
        known[id(node)] = 1 + sum(_values(part, known) for part in parts)
    return known[id(node)]


def problem(error: yaml.MarkedYAMLError) -> str:
    """What is wrong, without the place."""
    text = str(error.problem)
    return _PROBLEMS.get(text, text)


class StrictLoader(yaml.SafeLoader):
    """SafeLoader that refuses duplicate keys, and whose numbers are what they look like.

    YAML 1.1 reads 010 as 8, 1:30 as 90 and 1e-3 as text; here the first two are text, which no number field takes, and
    the third is a number. A date is text as well, and so is a key that YAML 1.1 takes for true or false: on, off, y, n.
    """


def _mapping_without_duplicates(loader: StrictLoader, node: yaml.MappingNode) -> dict[Any, Any]:
    seen: set[str] = set()
    for key, _ in node.value:
        if not isinstance(key, yaml.ScalarNode):
            raise yaml.constructor.ConstructorError(None, None, "a key must be a single word", key.start_mark)
        if key.value in seen:
            raise yaml.constructor.ConstructorError(None, None, f"the key {key.value!r} stands twice", key.start_mark)
        seen.add(key.value)
        if key.tag == "tag:yaml.org,2002:bool":
            key.tag = "tag:yaml.org,2002:str"
    loader.flatten_mapping(node)
    return loader.construct_mapping(node, deep=True)


def _forced_date(loader: StrictLoader, node: yaml.ScalarNode) -> Any:
    """Of a text that looks like no date PyYAML asks for the parts without having found any."""
    if not StrictLoader.timestamp_regexp.match(str(loader.construct_scalar(node))):
        raise yaml.constructor.ConstructorError(None, None, f"{node.value!r} is no date", node.start_mark)
    return loader.construct_yaml_timestamp(node)


StrictLoader.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, _mapping_without_duplicates)
StrictLoader.add_constructor("tag:yaml.org,2002:timestamp", _forced_date)
StrictLoader.yaml_implicit_resolvers = {
    first: [(tag, pattern) for tag, pattern in resolvers if tag.rpartition(":")[2] not in ("int", "float", "timestamp")]
    for first, resolvers in yaml.SafeLoader.yaml_implicit_resolvers.items()
}
StrictLoader.add_implicit_resolver(
    "tag:yaml.org,2002:int", re.compile(r"^[-+]?(0|[1-9][0-9]*)$|^0x[0-9a-fA-F]+$"), list("-+0123456789")
)
StrictLoader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(
        r"^[-+]?([0-9]+\.[0-9]*|\.[0-9]+|[0-9]+(?=[eE]))([eE][-+]?[0-9]+)?$|^[-+]?\.(inf|Inf|INF)$|^\.(nan|NaN|NAN)$"
    ),
    list("-+0123456789."),
)
