#!/usr/bin/env python3
"""unreached_errors.py ROOT COVERAGE

Lists the places of the sources that make an error and that no test reached, by gcovr's JSON file
COVERAGE. Exits with 1 if there are any.
"""

import json
import pathlib
import re
import sys

# What puts an error into words; functions with words of their own are made of these.
MAKES_ERROR = re.compile(r"\b(fail|refuse|usage|broken|conflict)\(|\bError\{")


def statement(lines, first):
    """The numbers of the lines of the statement that begins at line `first`."""
    last = first
    while last < len(lines) and not lines[last - 1].split("//")[0].rstrip().endswith((";", "{", "}")):
        last += 1
    return range(first, last + 1)


def unreached(source, counts):
    lines = source.read_text(encoding="utf-8").splitlines()
    for number, line in enumerate(lines, start=1):
        if not MAKES_ERROR.search(line.split("//")[0]):
            continue
        of_statement = [counts[n] for n in statement(lines, number) if n in counts]
        if of_statement and max(of_statement) == 0:
            yield number, line.strip()


def main():
    root = pathlib.Path(sys.argv[1])
    found = 0
    for file in json.loads(pathlib.Path(sys.argv[2]).read_text(encoding="utf-8"))["files"]:
        counts = {line["line_number"]: line["count"] for line in file["lines"]}
        for number, text in unreached(root / file["file"], counts):
            print(f"{file['file']}:{number}: no test reaches {text}")
            found += 1
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
