#!/usr/bin/env python3
"""Breaks what the nacre command stands on, and looks at what comes of it.

    faults.py NACRE FAULT_IO_LIBRARY [--most N] [--parts system-calls,damage,…]
              [--only VERB] [--table FILE.md]

Prints what went wrong with the command that shows it, and a table of how many of each
kind were tried and survived; exit code 1 if any didn't.
"""

import argparse
import collections
import sys
import tempfile
from pathlib import Path

import damage
import surroundings
import system_calls
from line import Line


class Report:
    def __init__(self):
        self.tried = collections.Counter()
        self.survived = collections.Counter()

    def add(self, verb, kind, wrong, how):
        self.tried[verb, kind] += 1
        if wrong is None:
            self.survived[verb, kind] += 1
        else:
            print(f"{verb}, {kind}: {wrong}\n    {how}", flush=True)

    def failed(self):
        return sum(self.tried.values()) - sum(self.survived.values())

    def table(self):
        """Kinds by verbs: survived of tried."""
        kinds = collections.Counter()
        good = collections.Counter()
        verbs = collections.defaultdict(list)
        for (verb, kind), tried in self.tried.items():
            kinds[kind] += tried
            good[kind] += self.survived[verb, kind]
            verbs[kind].append(verb)
        lines = ["| fault | verbs | tried | survived |", "|---|---|---|---|"]
        for kind, tried in kinds.items():
            lines.append(f"| {kind} | {len(set(verbs[kind]))} | {tried} | {good[kind]} |")
        return "\n".join(lines) + "\n"


PARTS = {"system-calls": system_calls.run, "damage": damage.run, "surroundings": surroundings.run}


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n", maxsplit=1)[0])
    parser.add_argument("nacre", type=Path)
    parser.add_argument("library", type=Path)
    parser.add_argument("--most", type=int, default=12, help="tries of a kind and verb")
    parser.add_argument("--parts", default=",".join(PARTS), help="comma separated")
    parser.add_argument("--only", action="append", help="this verb alone")
    parser.add_argument("--table", type=Path, help="write the table there too")
    arguments = parser.parse_args()
    report = Report()
    with tempfile.TemporaryDirectory(prefix="nacre-faults-") as folder:
        line = Line(arguments.nacre.resolve(), Path(folder) / "line")
        for part in arguments.parts.split(","):
            PARTS[part](
                line,
                arguments.library.resolve(),
                Path(folder) / "trial",
                arguments.most,
                report,
                arguments.only,
            )
    print(report.table())
    if arguments.table:
        arguments.table.write_text(report.table())
    return 1 if report.failed() else 0


if __name__ == "__main__":
    sys.exit(main())
