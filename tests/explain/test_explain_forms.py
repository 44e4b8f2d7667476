"""Text fits its width, Markdown renders and its formulas are balanced."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

import pytest
from written import HOSTILE, ROTATIONS, SPECS, pose, rotation, seeded

import frametool
from frametool import explain
from frametool.cli.command import OPTIONAL
from frametool.explain.render import FORMS, as_latex, as_text
from frametool.explain.run import evaluated, parsed

if TYPE_CHECKING:
    from frametool.explain.render import Explanation

ODD = {"name": "my {frame}_#1 $x^2 \\ ü 中 %&~`|<>'\"--", "parent": "a*b_c[d](e)", "xyz": [1, 2, 3], "rpy_deg": [10, 20, 30]}


def explanations() -> list[Explanation]:
    """Derive something of everything."""
    random = seeded("forms")
    made = [explain("convert", rotation(spec, random.choice([*ROTATIONS, *HOSTILE])), to=",".join(random.sample(SPECS, 3)), precision=random.choice((6, None))) for spec in SPECS]
    made += [explain("compose", *(pose(random) for _ in range(5))), explain("relative", pose(random), pose(random)), explain("invert", ODD)]
    made += [explain("interpolate", pose(random), pose(random), 0.3), explain("apply", ODD, [1e-9, 2, 3])]
    return [*made, explain("follow", frametool.follow_steps(frametool.tutorial(target="moving-carrot", delay=1.0), 13))]


MADE = explanations()


@pytest.mark.parametrize("made", MADE, ids=lambda made: made.title)
def test_formulas_are_balanced(made: Explanation) -> None:
    for text in re.findall(r"\$\$(.*?)\$\$", made.markdown(), re.DOTALL):
        bare = re.sub(r"\\[\\{}]", "", text)
        depth = 0
        for letter in bare:
            depth += (letter == "{") - (letter == "}")
            assert depth >= 0
        assert depth == 0
        open_now: list[str] = []
        for kind, name in re.findall(r"\\(begin|end)\{(\w+\*?)\}", text):
            if kind == "begin":
                open_now.append(name)
            else:
                assert open_now.pop() == name
        assert open_now == []
        assert len(re.findall(r"\\left(?![a-z])", bare)) == len(re.findall(r"\\right(?![a-z])", bare))
        assert not re.search(r"\^\{[^{}]*\}\^|\^\w\^", text)  # TeX refuses two exponents


@pytest.mark.parametrize("made", MADE, ids=lambda made: made.title)
def test_markdown_has_its_headings_and_its_formulas_between_dollar_signs(made: Explanation) -> None:
    text = made.markdown()
    lines = text.split("\n")
    fences = [at for at, line in enumerate(lines) if line == "$$"]
    assert len(fences) % 2 == 0
    for begin, end in zip(fences[::2], fences[1::2], strict=True):
        assert lines[begin - 1] == lines[end + 1] == ""
        assert lines[begin + 1] == r"\begin{aligned}"
        assert lines[end - 1] == r"\end{aligned}"
        assert "" not in lines[begin:end]  # an empty line would end the formula
    assert lines[0].startswith("## ")
    headings = [int(number) for number in re.findall(r"^### (\d+)\. ", text, re.MULTILINE)]
    assert headings == list(range(1, len(headings) + 1))
    outside = re.sub(r"\$\$.*?\$\$|```.*?```", "", text, flags=re.DOTALL)
    assert not re.search(r"(?<!\\)[$_]", outside)


@pytest.mark.parametrize("made", MADE, ids=lambda made: made.title)
def test_text_fits_eighty_columns_at_six_digits(made: Explanation) -> None:
    lines = re.sub(r"\nResult.*", "", str(made), flags=re.DOTALL).splitlines()
    if re.search(r"\d\.\d{9}", "".join(lines)) and "Step" not in lines[0]:
        return  # full digits take the room they need
    assert [line for line in lines if len(line) > 80 and "my {frame}" not in line] == []


@pytest.mark.parametrize(("formula", "text", "latex"), [
    ("2*atan2(s, w)", "2·atan2(s, w)", r"2 \cdot \operatorname{atan2}\left(s, w\right)"),
    ("-x**2", "-x^2", "-x^{2}"),
    ("(-x)**2", "(-x)^2", r"\left(-x\right)^{2}"),
    ("a - (b + c)", "a - (b + c)", r"a - \left(b + c\right)"),
    ("a*(b/c)", "a·(b/c)", r"a \, \frac{b}{c}"),
    ("a + -b", "a + (-b)", r"a + \left(-b\right)"),
    ("sqrt(x**2)/2", "sqrt(x^2)/2", r"\frac{\sqrt{x^{2}}}{2}"),
])  # fmt: skip
def test_a_formula_is_the_same_arithmetic_in_text_and_latex(formula: str, text: str, latex: str) -> None:
    tree = parsed(formula)
    assert (as_text(tree, str), as_latex(tree, str)) == (text, latex)
    values = {"a": 0.3, "b": 0.7, "c": -1.1, "x": -1.5, "s": 0.6, "w": 0.8}
    again = parsed(text.replace("·", "*").replace("^", "**"))
    assert evaluated(again, values) == evaluated(tree, values)


def test_the_forms_of_the_option_are_those_there_are() -> None:
    assert list(FORMS) == list(OPTIONAL["--explain"])
    with pytest.raises(frametool.FrametoolError, match="unknown format 'html'; formats: markdown, text"):
        MADE[0].render("html")


def test_jupyter_shows_the_formulas() -> None:
    assert MADE[0]._repr_markdown_() == MADE[0].markdown()
    assert repr(explain("invert", {"name": "a", "parent": "b", "xyz": [1, 0, 0]})) == "<Explanation of a_from_b>"
