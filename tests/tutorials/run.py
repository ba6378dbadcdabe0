#!/usr/bin/env python3
"""run.py TUTORIAL.md SCRATCH: what a tutorial tells to type, typed.

All ```sh blocks run one after the other in one shell, in an empty folder; the first command that
fails is named by its line. Then each file that the text names must be there, in that folder, and
each page that it links to."""

import os
import re
import shutil
import subprocess
import sys

ENDINGS = r"exr|png|html|json|toml|xml|psf|sss|npy|py|mtlx|txt|pbrt"


def script_of(lines):
    """The blocks, on the lines where they stand, so that bash counts as the reader does."""
    inside, script = False, []
    for line in lines:
        if line.startswith("```"):
            inside = line.strip() == "```sh"
            script.append("")
        else:
            script.append(line if inside else "")
    return script


def main():
    tutorial, scratch = sys.argv[1:3]
    with open(tutorial, encoding="utf-8") as file:
        lines = file.read().split("\n")
    script = script_of(lines)
    if not any(script):
        sys.exit(tutorial + ": has no sh block")
    shutil.rmtree(scratch, ignore_errors=True)
    os.makedirs(scratch)
    name = os.path.basename(tutorial)
    typed = os.path.join(os.path.dirname(scratch), name + ".sh")
    with open(typed, "w", encoding="utf-8") as file:
        # The first line of the page is its title: there is room for what bash is to do.
        file.write("set -euo pipefail; trap 'echo \"%s:$LINENO: exit code $?\" >&2' ERR\n" % name)
        file.write("\n".join(script[1:]) + "\n")
    code = subprocess.run(["bash", typed], cwd=scratch, check=False).returncode
    if code != 0:
        sys.exit(code)

    text = "\n".join(line for line, typed in zip(lines, script) if not typed)
    missing = [named for named in re.findall(r"`([\w./-]+\.(?:%s))`" % ENDINGS, text)
               if not os.path.exists(os.path.join(scratch, named))
               and not os.path.exists(os.path.join(os.environ["NACRE_DATA"], "rigs", named))]
    missing += [link for link in re.findall(r"\]\(([^)#:]+)\)", text)
                if not os.path.exists(os.path.join(os.path.dirname(tutorial), link))]
    if missing:
        sys.exit("%s: names what isn't there: %s" % (name, ", ".join(missing)))
    shutil.rmtree(scratch)
    print(name + ": all of it works")


if __name__ == "__main__":
    main()
