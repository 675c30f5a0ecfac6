#!/usr/bin/env python3
"""fixed_math_test.py ROOT

Sources use the functions of unflex/core/math.hpp, whose results are the same everywhere, and none
of the C library's, of Eigen's or of the standard library's that round or draw in their own way.
"""

import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(sys.argv.pop(1))
FUNCTIONS = ("exp exp2 exp10 expm1 log log2 log10 log1p pow sqrtf tan sin cos asin acos atan atan2 "
             "sinh cosh tanh asinh acosh atanh hypot cbrt fma erf erfc tgamma lgamma polar arg "
             "cyl_bessel_i cyl_bessel_j riemann_zeta beta expint")
FORBIDDEN = [
    re.compile(rf"std::({'|'.join(FUNCTIONS.split())})\("),
    # Eigen's, of arrays
    re.compile(r"\.(exp|log|log10|log1p|sin|cos|tan|atan|tanh|pow)\(\)"),
    re.compile(r"std::\w+_distribution\b|std::shuffle\b|std::random_shuffle\b"),
]


class FixedMath(unittest.TestCase):
    def test_is_all_that_is_used(self):
        for folder in ["src", "include"]:
            for path in sorted((ROOT / folder).rglob("*.[ch]pp")):
                for number, line in enumerate(path.read_text().splitlines(), 1):
                    code = line.split("//")[0]
                    for pattern in FORBIDDEN:
                        with self.subTest(place=f"{path.relative_to(ROOT)}:{number}"):
                            self.assertNotRegex(code, pattern)


if __name__ == "__main__":
    unittest.main()
