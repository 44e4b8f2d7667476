"""The questions of the cookbook, and which commands, topics, forms and files each has to do with."""

from __future__ import annotations

import re
from collections import Counter
from dataclasses import dataclass
from functools import cache, cached_property

import console

from frametool.cli.command import HEADINGS
from frametool.cli.commands.help import names, topic, topics
from frametool.errors import FormatError
from frametool.formats.detect import detect
from frametool.formats.table import FORMATS
from site_pages.calls import Call, calls
from site_pages.markup import slug

EXAMPLES = console.ROOT / "examples"
INCIDENTAL = ("errors",)  # the topic of --precision, --output and the like, which no question is about
PLAIN = ("text", "json", "yaml", "csv")  # how any result is printed
FEW = 2  # topics that may have a rare word, or show a command, for it to be theirs
SHARED = 3  # rare words that make a topic that of a question


@dataclass(frozen=True)
class Question:
    """A question with its answer.

    shell: commands, each with what it prints; prose: the sentences around them
    """

    chapter: str
    title: str
    shell: list[tuple[str, str]]
    prose: str

    @cached_property
    def path(self) -> str:
        """Return where its page is."""
        return f"cookbook/{slug(self.title)}.md"

    @cached_property
    def line(self) -> str:
        """Return all of its commands."""
        return "\n".join(command for command, _ in self.shell)

    @cached_property
    def calls(self) -> list[Call]:
        """Return the calls of frametool in its commands."""
        return [call for command, _ in self.shell for call in calls(command)]

    @cached_property
    def commands(self) -> list[str]:
        """Name the commands it uses."""
        return list(dict.fromkeys(call.name for call in self.calls))

    @cached_property
    def files(self) -> list[str]:
        """Name the example files it uses."""
        return [name for name in example_files() if re.search(rf"(?<![\w.]){re.escape(name)}(?![\w.])", self.line)]

    @cached_property
    def topics(self) -> list[str]:
        """Name the topics it mentions, those of its commands and options, and those with which it shares rare words."""
        found = re.findall(r"frametool help (\w+)", f"{self.prose}\n{self.line}") + self.commands
        found += [name for each in self.commands if len(topics_with(each)) <= FEW for name in topics_with(each)]
        for option in (option for call in self.calls for option in call.options):
            found += [_topic_of(heading) for heading in HEADINGS[1:] if heading.startswith(getattr(option, "under", HEADINGS[0]))]
            found += [name for name in topics() if option.opts[-1].startswith(f"--{name}")]
        own = words(f"{self.title} {self.line}")
        found += [name for name in topics() if len(own & rare_words()[name]) >= SHARED]
        return [name for name in topics() if name in found and name not in INCIDENTAL]

    @cached_property
    def forms(self) -> list[str]:
        """Name the forms of its files, and those that its commands name."""
        found = [form_of(name) for name in self.files]
        for call in self.calls:
            found += [word for word in re.findall(r"(?:--format|-f|--in) ([\w-]+)", call.rest) if word not in PLAIN]
            found += [call.rest] * (call.name == "formats")
        return [name for name in FORMATS if name in found]


def _topic_of(heading: str) -> str:
    """Return the topic that the heading of a group of options names first."""
    found = re.search(r"help (\w+)", heading)
    return found[1] if found else ""


def words(text: str) -> set[str]:
    """Return the words and options in a text."""
    return set(re.findall(r"--[a-z][\w-]+|[a-z][a-z_]{2,}", text.lower()))


@cache
def rare_words() -> dict[str, set[str]]:
    """Return the words of each topic that hardly any other has."""
    own = {name: words(topic(name)) for name in topics()}
    count = Counter(word for each in own.values() for word in each)
    return {name: {word for word in each if count[word] <= FEW} for name, each in own.items()}


@cache
def topics_with(command: str) -> list[str]:
    """Name the topics with examples of a command."""
    return [name for name in topics() if re.search(rf"(?m)^ +(?:.*\| )?frametool {command}\b", topic(name))]


@cache
def example_files() -> list[str]:
    """Name the example files, without the texts that have pages of their own."""
    return [name for name in names() if not name.endswith(".md")]


@cache
def form_of(name: str) -> str:
    """Return the form of an example file; "" of one that has none, as a list of commands."""
    try:
        return detect((EXAMPLES / name).read_bytes(), "tree", "records", "rows", "arrays", name=name)
    except FormatError:
        return ""


@cache
def questions() -> list[Question]:
    """Return the questions in the cookbook's order."""
    found = []
    for part in (EXAMPLES / "COOKBOOK.md").read_text("utf-8").split("\n## ")[1:]:
        chapter, *asked = part.split("\n### ")
        for title, _, answer in (each.partition("\n") for each in asked):
            shell = [pair for block in console.BLOCK.findall(answer) for pair in console.commands(block)]
            prose = re.sub(r"\n{3,}", "\n\n", console.BLOCK.sub("", answer)).strip()
            found.append(Question(chapter.strip(), title, shell, prose))
    return found


def asked_about(kind: str, name: str) -> list[str]:
    """Return links to the questions that use one of the `commands`, `topics`, `forms` or `files`."""
    return [f"[{each.title}](/{each.path})" for each in questions() if name in getattr(each, kind)]
