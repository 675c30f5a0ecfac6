#!/usr/bin/env python3
"""system_calls_test.py ROOT

Sources outside src/platform know no system: they include no header of one, nor those of the C++
library that not every system has.
"""

import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(sys.argv.pop(1))
SYSTEM = re.compile(
    r"#\s*include <(sys/.*|arpa/.*|net.*/.*|(unistd|fcntl|poll|signal|dirent|glob|fnmatch|malloc|pwd|grp|"
    r"termios|pthread|spawn|windows|io|process|psapi|shellapi|direct)\.h|"
    r"csignal|filesystem|fstream|thread|mutex|condition_variable|future|semaphore|stop_token)>")
SYSTEM_NAMES = re.compile(r"\b(_WIN32|__APPLE__|__linux__|__wasi__|__wasm__|__unix__|__GLIBC__)\b")
# Threads, and what stands in for them; wide registers, which only some compilers know.
EXCEPTIONS = {"src/core/include/unflex/core/threads.hpp", "src/core/include/unflex/core/lanes.hpp"}


class Sources(unittest.TestCase):
    def test_know_no_system(self):
        read = 0
        for folder in ("src", "include"):
            for path in sorted((ROOT / folder).rglob("*.[ch]pp")):
                name = path.relative_to(ROOT).as_posix()
                if name.startswith("src/platform/") or name in EXCEPTIONS:
                    continue
                read += 1
                for number, line in enumerate(path.read_text().splitlines(), 1):
                    for pattern in (SYSTEM, SYSTEM_NAMES):
                        if pattern.search(line):
                            self.fail(f"{name}:{number}: {line}")
        self.assertGreater(read, 500)


if __name__ == "__main__":
    unittest.main()
