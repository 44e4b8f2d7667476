"""The values of expressions, written: poses and points as everywhere, numbers bare or, for a person, with units."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from frametool.calc.demands import wanted
from frametool.calc.shown import line_of_value, plain_results
from frametool.calc.values import LIST, POINT, POSE, VECTOR
from frametool.errors import ValueInvalid
from frametool.formats import FORMATS
from frametool.grammar.result import Result

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from frametool.calc.values import Term
    from frametool.grammar.result import Style


def value_texts(terms: Iterable[Term], style: Style) -> Iterator[str]:
    """Yield the text of each value in the form of a style, what parts it from the one before included.

    Each is written before the next one is looked at, but for the rows of a table, which share their columns.
    """
    values = (item for term in terms for item in (term.items if term.type.kind == LIST else (wanted(term),)))
    if style.form == "csv":
        yield _csv(list(values), style)
        return
    before = ""
    for value in values:
        text = _for_a_person(value, style) if style.form == "text" else _machine(value, style)
        if before and style.form == "yaml":
            yield "---\n"
        elif before and style.form == "text" and (before.count("\n") > 1 or text.count("\n") > 1):
            yield "\n"
        yield text
        before = text


def _for_a_person(term: Term, style: Style) -> str:
    """Describe one value."""
    from frametool.view.pose_text import write_points, write_poses

    kind = term.type.kind
    if kind == POSE:
        known = term.type.target is not None and term.type.source is not None
        heading = "" if known or term.type.target is term.type.source else f"{term.type}\n"
        return heading + write_poses(plain_results(term, style), style)
    if kind in (POINT, VECTOR):
        return write_points(plain_results(term, style), style)
    return line_of_value(term, style)


def _machine(term: Term, style: Style) -> str:
    """Write one value as a document or line of a machine format."""
    module = import_module(FORMATS[style.form].writer)
    (result,) = plain_results(term, style)
    if isinstance(result, Result):
        return str(module.write_poses([result], style))
    if isinstance(result, float) and style.form not in ("json", "yaml"):
        raise ValueInvalid(f"{style.form} has no form for {term.type.named}; write it as text, json, yaml or csv")
    if term.type.kind not in (POINT, VECTOR) and style.form not in ("json", "yaml"):
        raise ValueInvalid(f"{style.form} has no form for {term.type.named}; write it as text, json, yaml or csv")
    return str(module.write_points([result], style))


def _csv(terms: Sequence[Term], style: Style) -> str:
    """Write values as a table."""
    from frametool.calc.formula import NAMES, RESULT

    module = import_module(FORMATS["csv"].writer)
    results = [each for term in terms for each in plain_results(term, style)]
    if results and all(isinstance(each, Result) for each in results):
        return str(module.write_poses(results, style))
    rows: list[dict[str, Any]] = []
    for term, result in zip(terms, results, strict=True):
        if isinstance(result, Result):
            raise ValueInvalid("a table holds poses or other values; write json or yaml")
        if isinstance(result, float):
            rows.append({RESULT: result})
            continue
        *_, numbers = result.values()
        suffix = "_deg" if "rpy_deg" in result else ""
        names = [f"{name}{suffix}" for name in NAMES[term.type.kind]]
        frame = {} if term.type.target is None else {"frame": term.type.target}
        rows.append(frame | dict(zip(names, numbers, strict=True)))
    return str(module.write_points(rows, style))
