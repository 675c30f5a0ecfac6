#!/usr/bin/env python3
"""draw_modules.py MODULES [SVG]

Draws docs/modules.svg, or SVG, with Graphviz from the modules.txt that CMake writes into the build
directory. Each line of that file is a module and those that it links.

An arrow that follows from two others is left out: who links `flow` has `core` as well.
"""

import pathlib
import subprocess
import sys


def read(path):
    """The links of each module, by name."""
    lines = pathlib.Path(path).read_text(encoding="utf-8").splitlines()
    return {words[0]: set(words[1:]) for words in (line.split() for line in lines)}


def below(links, module):
    """All modules that `module` reaches by links."""
    found = set()
    waiting = [module]
    while waiting:
        for other in links[waiting.pop()] - found:
            found.add(other)
            waiting.append(other)
    return found


def reduced(links):
    """The arrows that do not follow from others."""
    return {(module, other) for module, others in links.items() for other in others
            if not any(other in below(links, between) for between in others - {other})}


def layers(links):
    """The layer of each module: one above the highest that it links."""
    def layer(module):
        return max((layer(other) + 1 for other in links[module]), default=0)
    return {module: layer(module) for module in links}


def dot(links):
    layer = layers(links)
    lines = ["digraph modules {", "rankdir=TB; nodesep=0.3; ranksep=0.35;",
             'node [shape=box, style="rounded,filled", fillcolor="#f4f6fa", color="#5a6478", '
             'fontname="sans-serif", fontsize=13, height=0.35];', 'edge [color="#5a6478", arrowsize=0.7];']
    for number in sorted(set(layer.values())):
        same = " ".join(sorted(module for module in links if layer[module] == number))
        lines.append(f"{{ rank=same; {same} }}")
    lines += [f"{module} -> {other};" for module, other in sorted(reduced(links))]
    return "\n".join(lines + ["}"])


def main():
    links = read(sys.argv[1])
    target = sys.argv[2] if len(sys.argv) > 2 else pathlib.Path(__file__).with_name("modules.svg")
    svg = subprocess.run(["dot", "-Tsvg"], input=dot(links), capture_output=True, text=True,
                         check=True).stdout
    pathlib.Path(target).write_text(svg, encoding="utf-8")


if __name__ == "__main__":
    main()
