#!/usr/bin/env python3
"""unreached_errors.py ROOT COVERAGE

Lists the places of the sources that put an error into words and that no test reaches: none was
counted there by gcovr's JSON file COVERAGE and, as processes may end without their counts, none
expects the words either. Exits with 1 if there are any.
"""

import json
import pathlib
import re
import sys

MAKES_ERROR = re.compile(r"\b(fail|refuse|usage|broken|conflict)\(|\bError\{")
WORDS = re.compile(r'"((?:[^"\\]|\\.)*)"')


def without_comment(line):
    return line.split("//")[0].rstrip()


def joined(text):
    """The text with string literals that stand one after the other made one."""
    return re.sub(r'"\s*"', "", text)


def statement(lines, first):
    """The numbers of the lines of the statement that begins at line `first`."""
    last = first
    while last < len(lines) and not without_comment(lines[last - 1]).endswith((";", "{", "}")):
        last += 1
    return range(first, last + 1)


def longest_words(code):
    """The longest piece of a literal without a place for a value."""
    pieces = [
        piece for literal in WORDS.findall(joined(code)) for piece in re.split(r"\{[^}]*\}", literal)
    ]
    return max(pieces, key=len, default="")


def unreached(source, counts, tests):
    lines = source.read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines, start=1):
        if not MAKES_ERROR.search(without_comment(line)):
            continue
        numbers = statement(lines, number)
        counted = [counts[n] for n in numbers if n in counts]
        words = longest_words("\n".join(without_comment(lines[n - 1]) for n in numbers))
        if words and counted and max(counted) == 0 and words not in tests:
            yield number, words


def main():
    root = pathlib.Path(sys.argv[1])
    tests = "\n".join(
        joined(file.read_text(encoding="utf-8")) for file in (root / "tests").rglob("*_test.cpp")
    )
    found = 0
    for file in json.loads(pathlib.Path(sys.argv[2]).read_text(encoding="utf-8"))["files"]:
        counts = {
            line["line_number"]: line["count"]
            for line in file["lines"]
            if not line["gcovr/noncode"]
        }
        for number, words in unreached(root / file["file"], counts, tests):
            print(f"{file['file']}:{number}: no test reaches \"{words}\"")
            found += 1
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
