#!/usr/bin/env python3
"""run.py BLENDER SCRIPT ZIP [XVFB-RUN]: runs one test script in Blender, with settings of its own,
and with the add-on's zip to install; headless, or in a window of the X server that xvfb-run
starts. Fails if the script does, or doesn't come to its end."""

import os
import subprocess
import sys
import tempfile

DONE = "all passed"
# Where Debian puts numpy: Blender forgets it once PYTHONPATH is set.
NUMPY = "/usr/lib/python3/dist-packages"


def main():
    blender, script, archive = sys.argv[1:4]
    x_server = sys.argv[4:]
    with tempfile.TemporaryDirectory(prefix="nacre-blender-test-") as folder:
        environment = dict(os.environ)
        environment.update(
            BLENDER_USER_CONFIG=os.path.join(folder, "config"),
            BLENDER_USER_SCRIPTS=os.path.join(folder, "scripts"),
            NACRE_TEST_ZIP=archive,
            NACRE_TEST_FOLDER=folder,
            PYTHONPATH=os.pathsep.join([os.path.dirname(os.path.abspath(__file__)), NUMPY]),
            PYTHONDONTWRITEBYTECODE="1",
            TMPDIR=folder,  # crash logs of parallel runs would meet there
            XDG_DATA_HOME=os.path.join(folder, "data"),
        )
        call = [blender, "-noaudio", "--factory-startup", "--python-exit-code", "1"]
        if x_server:
            environment["LIBGL_ALWAYS_SOFTWARE"] = "1"
            call = [*x_server, "-a", "-s", "-screen 0 1100x900x24 +extension GLX", *call,
                    "-p", "0", "0", "1100", "900"]
        else:
            call.append("-b")
        call += ["--python", script]
        done = subprocess.run(call, env=environment, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT, text=True, check=False)
    print(done.stdout)
    if done.returncode != 0 or DONE not in done.stdout.splitlines():
        sys.exit("%s: exit code %d" % (os.path.basename(script), done.returncode))


if __name__ == "__main__":
    main()
