"""The words of docs/glossary.md that are retired, and where they are still used.

A retired word of prose is looked for in the pages, and in the comments, docstrings and texts of the
extension, its shaders and presets. A retired identifier is looked for in every name: `late` is in
`is_late`, `LateHair` and `late.py`, not in `later`; `most_` only where another word follows. A text
without spaces counts as a name, as it may be a key in a file. A term that is written with a capital
is looked for as it is written.

    python tools/words.py    all uses, by file and line
"""

from __future__ import annotations

import ast
import io
import json
import re
import tokenize
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, cached_property
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[1]
GLOSSARY = REPOSITORY / "docs" / "glossary.md"
#: heading in the glossary -> kind of text in which its words must not be used
SCOPES = {"## Retired in prose": "prose", "## Retired as identifiers": "code"}
_NAME = re.compile(r"[A-Za-z_]\w*")
#: the words that a name is made of
_PARTS = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\d+")


@dataclass(frozen=True)
class Text:
    """A piece of text or a name in a file."""

    scope: str
    text: str
    place: str
    line: int


@dataclass(frozen=True)
class Retired:
    scope: str
    term: str
    replacement: str

    def lines_in(self, text: Text) -> list[int]:
        """The line of each use."""
        if self.scope == "code":
            end = "" if self.term.endswith("_") else " "
            return [text.line] * (f" {_parts(self.term)} " in f" {_parts(text.text)}{end}")
        matches = self._pattern.finditer(text.text)
        return [text.line + text.text.count("\n", 0, match.start()) for match in matches]

    @cached_property
    def _pattern(self) -> re.Pattern[str]:
        words = r"\s+".join(re.escape(word) for word in self.term.split())
        flags = 0 if self.term != self.term.lower() else re.IGNORECASE
        return re.compile(rf"(?<![\w-]){words}(?![\w-])", flags)


@cache
def _parts(name: str) -> str:
    return " ".join(part.lower() for part in _PARTS.findall(name))


def retired_terms(glossary: Path = GLOSSARY) -> list[Retired]:
    """Rows of the tables under the two headings: `term`, `its other forms` | what to say."""
    terms: list[Retired] = []
    scope = ""
    for line in glossary.read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            scope = SCOPES.get(line.strip(), "")
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if scope and line.startswith("|") and len(cells) == 2:
            terms += [Retired(scope, term, cells[1]) for term in re.findall("`([^`]+)`", cells[0])]
    return terms


@dataclass(frozen=True)
class Use:
    """name: the whole identifier, or nothing in prose."""

    place: str
    line: int
    name: str

    def __str__(self) -> str:
        return f"{self.place}:{self.line} {self.name}".rstrip()


def count_uses(uses_of_term: list[Use]) -> int:
    """Uses in prose; different names in code, so that code can be moved without changing it."""
    names = {use.name for use in uses_of_term if use.name}
    return len(names) + sum(not use.name for use in uses_of_term)


def uses(repository: Path = REPOSITORY) -> dict[Retired, list[Use]]:
    """Each retired term -> the places where it is used, at best none."""
    terms = retired_terms(repository / "docs" / "glossary.md")
    by_term: dict[Retired, list[Use]] = {term: [] for term in terms}
    by_scope = {scope: [t for t in terms if t.scope == scope] for scope in ("prose", "code")}
    candidates = {scope: _first_words(of_scope) for scope, of_scope in by_scope.items()}
    unused: set[tuple[str, str]] = set()
    for text in texts_of(repository):
        key = (text.scope, text.text)
        if key in unused or not candidates[text.scope].search(text.text):
            continue
        is_used = False
        for term in by_scope[text.scope]:
            for line in term.lines_in(text):
                is_used = True
                name = text.text if text.scope == "code" else ""
                by_term[term].append(Use(text.place, line, name))
        if not is_used:
            unused.add(key)
    return by_term


def _first_words(terms: list[Retired]) -> re.Pattern[str]:
    """Matches every text in which one of these terms may be, and few others."""
    firsts = {re.escape(_PARTS.findall(term.term)[0]) for term in terms}
    return re.compile("|".join(sorted(firsts)) or r"(?!)", re.IGNORECASE)


def texts_of(repository: Path) -> Iterator[Text]:
    pages = [*repository.glob("*.md"), *(repository / "docs").rglob("*.md")]
    files = {
        _page: [*pages, *(repository / "gpu_shaders").glob("*.md")],
        _python: (repository / "addon").rglob("*.py"),
        _shader: (repository / "gpu_shaders").rglob("*.glsl"),
        _preset: [
            *(repository / "presets").rglob("*.json"),
            *(repository / "hairstyles").glob("*.json"),
        ],
    }
    for read, paths in files.items():
        for path in sorted(paths):
            place = path.relative_to(repository).as_posix()
            for scope, text, line in read(path.read_text(encoding="utf-8")):
                yield Text(scope, text, place, line)
            if read in (_python, _shader):
                yield Text("code", path.name.partition(".")[0], place, 1)


Entries = Iterator[tuple[str, str, int]]


def _page(text: str) -> Entries:
    """Its paragraphs, without code and without the glossary's own tables of retired words."""
    for heading in SCOPES:
        text = re.sub(rf"^{heading}$.*?(?=^## |\Z)", _empty, text, flags=re.M | re.S)
    text = re.sub(r"^```.*?^```$|`[^`\n]*`|\]\([^)]*\)", _empty, text, flags=re.M | re.S)
    line = 1
    for paragraph in re.split(r"(\n\s*\n)", text):
        yield "prose", paragraph, line
        line += paragraph.count("\n")


def _empty(match: re.Match[str]) -> str:
    """As many lines as the match has."""
    return "\n" * match[0].count("\n")


def _classified(text: str, line: int) -> Entries:
    """A text in code: one word is a name, as it may be a key; more are prose."""
    yield "code" if re.fullmatch(r"[\w./]+", text) else "prose", text, line


#: what may stand between the parts of one text
_TOKENS_BETWEEN_STRINGS = (tokenize.NL, tokenize.FSTRING_START, tokenize.FSTRING_END)


def _python(text: str) -> Entries:
    """By its tokens, as walking the syntax tree takes twice as long."""
    strings: list[tuple[str, int]] = []
    comment: list[str] = []
    for token in tokenize.generate_tokens(io.StringIO(text).readline):
        line = token.start[0]
        if token.type == tokenize.STRING:
            value = ast.literal_eval(token.string)
            strings += [(value, line)] * isinstance(value, str)
        elif token.type == tokenize.FSTRING_MIDDLE:
            strings.append((token.string, line))
        elif strings and token.type not in (*_TOKENS_BETWEEN_STRINGS, tokenize.COMMENT):
            yield from _classified("".join(part for part, _ in strings), strings[0][1])
            strings = []
        if token.type == tokenize.NAME:
            yield "code", token.string, line
        if token.type == tokenize.COMMENT:
            comment.append(token.string.lstrip("#: "))
        elif comment and token.type != tokenize.NL:
            yield "prose", " ".join(comment), line - len(comment)
            comment = []


def _shader(text: str) -> Entries:
    comments = r"(?:^[ \t]*//[^\n]*\n?)+|//[^\n]*|/\*.*?\*/"
    for match in re.finditer(comments, text, re.M | re.S):
        prose = re.sub(r"^[ \t]*//", " ", match[0], flags=re.M)
        yield "prose", prose, text.count("\n", 0, match.start()) + 1
    code = re.sub(comments, _empty, text, flags=re.M | re.S)
    for line, row in enumerate(code.splitlines(), 1):
        yield from (("code", name, line) for name in _NAME.findall(row))


def _preset(text: str) -> Entries:
    def walk(value: object) -> Entries:
        if isinstance(value, str):
            yield from _classified(value, 1)
        elif isinstance(value, dict):
            for key, inner in value.items():
                yield "code", key, 1
                yield from walk(inner)
        elif isinstance(value, list):
            for inner in value:
                yield from walk(inner)

    yield from walk(json.loads(text))


if __name__ == "__main__":
    for retired, found in uses().items():
        if found:
            print(f"{retired.scope}: {retired.term} (say: {retired.replacement})")
            print("".join(f"    {use}\n" for use in found), end="")
