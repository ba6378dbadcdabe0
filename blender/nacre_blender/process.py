"""The `nacre render` process: started, watched, stopped."""

import collections
import os
import re
import signal
import subprocess
import threading

PROGRESS = re.compile(r"^(\S[\S ]*?)\s+(\d+) %\s+(\d+)/(\d+)")
# Of the whole picture, what comes before the paths.
SHARE_BEFORE_PATHS = 0.2


class Rendering:
    """A running render; `picture` is written again and again until it ends."""

    def __init__(self, command, scene, picture, options=()):
        self.picture = picture
        self.progress = 0.0
        self.stage = "starting"
        self.last_lines = collections.deque(maxlen=12)
        self._process = subprocess.Popen(
            [command, "render", scene, "--out", picture, "--lenient", "--allow-outside",
             *options],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def _read(self):
        for line in self._process.stderr:
            line = line.rstrip()
            found = PROGRESS.match(line)
            if not found:
                if line:
                    self.last_lines.append(line)
                continue
            self.stage = found.group(1)
            fraction = int(found.group(3)) / max(1, int(found.group(4)))
            if self.stage.startswith("render") or self.stage.startswith("path"):
                self.progress = SHARE_BEFORE_PATHS + (1 - SHARE_BEFORE_PATHS) * fraction
            else:
                self.progress = max(self.progress, SHARE_BEFORE_PATHS * fraction)

    def running(self):
        return self._process.poll() is None

    def stop(self):
        """Asks it to stop; it is made to if it doesn't within two seconds."""
        if self.running():
            self._process.send_signal(signal.SIGINT)
            try:
                self._process.wait(2)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        self._reader.join(2)

    def finish(self):
        """After it ended: raises RuntimeError with what it said unless all went well."""
        code = self._process.wait()
        self._reader.join(5)
        if code != 0 or not os.path.isfile(self.picture):
            said = "\n".join(self.last_lines) or "it said nothing"
            raise RuntimeError("nacre render ended with code %d: %s" % (code, said))
        return list(self.last_lines)
