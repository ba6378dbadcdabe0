"""Each verb, with one system call after another that fails, does half, or is the last."""

import re
import signal

from line import content

# (calls, kind, whether it goes on, what has to come of it)
KINDS = [
    ("write", "ENOSPC", True, "fails"),
    ("write", "EIO", False, "fails"),
    ("write", "EINTR", False, "succeeds"),
    ("write", "half", False, "succeeds"),
    ("sync", "EIO", False, "fails"),
    ("rename", "ENOSPC", False, "fails"),
    ("open", "EACCES", False, "fails"),
    ("open", "EROFS", True, "fails"),
    ("mkdir", "ENOSPC", False, "fails"),
    ("read", "EIO", False, "fails"),
    ("read", "EINTR", False, "succeeds"),
    ("read", "half", False, "succeeds"),
    ("map", "ENOMEM", False, "any"),
    ("memory", "ENOMEM", False, "any"),
    ("write", "kill", False, "dies"),
    ("sync", "kill", False, "dies"),
    ("rename", "kill", False, "dies"),
    ("read", "kill", False, "dies"),
    ("write", "term", False, "any"),
    ("read", "term", False, "any"),
]

# Where a run's state may stay behind, so that the next one goes on from it.
RESUMABLE = re.compile(r"(^|/)\.p\.run\.json$|\.work(/|$|\.)|^o(/|$)|\.checkpoint")
TEMPORARY = re.compile(r"(^|/)\.[^/]*-\d+\.\d+\.tmp[^/]*$")


class Trial:
    def __init__(self, line, library, folder):
        self.line, self.library, self.folder = line, str(library), folder

    def environment(self, fault, count=None):
        variables = {
            "LD_PRELOAD": self.library,
            "NACRE_FAULT": fault,
            "NACRE_FAULT_FOLDER": str(self.folder.resolve()),
        }
        if count is not None:
            variables["NACRE_FAULT_COUNT"] = str(count)
        return variables

    def calls(self, arguments, calls):
        """How many such calls the command makes when nothing fails."""
        self.line.copy(self.folder)
        count = self.folder.parent / "count"
        count.unlink(missing_ok=True)
        result = self.line.run(arguments, self.folder, self.environment(f"{calls}:0:EIO", count))
        if result.returncode != 0:
            raise SystemExit(f"{arguments} fails by itself: {result.stderr}")
        return int(count.read_text())

    def judge(self, command, fault, expected, truth):
        """None, or what was wrong with one run under that fault."""
        _, arguments, outputs = command
        self.line.copy(self.folder)
        before = content(self.folder, ["."])
        result = self.line.run(arguments, self.folder, self.environment(fault))
        code = result.returncode
        wrong = self.wrong_code(code, expected, result.stderr)
        if wrong:
            return wrong
        after = content(self.folder, ["."])
        for name in after:
            known = name in before or RESUMABLE.search(name)
            whole = name in truth and after[name] == truth[name]
            if not known and not whole and not (TEMPORARY.search(name) and code < 0):
                return f"left {name} behind, exit code {code}"
        if code == 0:
            return self.differs(after, truth)
        return self.wrong_again(arguments, outputs, truth)

    @staticmethod
    def wrong_code(code, expected, stderr):
        codes = {
            "fails": (0, 1, 3, 4),  # 0 if the library below tried again: then all has to be there
            "succeeds": (0,),
            "dies": (-signal.SIGKILL,),
            "any": (0, 1, 3, 75, -signal.SIGTERM),
        }
        if code not in codes[expected]:
            return f"exit code {code} where it {expected}: {stderr.strip()[-200:]}"
        if code > 0 and not re.search(r"^nacre: .", stderr, re.MULTILINE):
            return f"exit code {code} without a word: {stderr.strip()[-200:]}"
        return None

    def wrong_again(self, arguments, outputs, truth):
        """The same command once more, with nothing in its way."""
        again = list(arguments)
        if arguments[0] == "capture" and (self.folder / outputs[0] / "session.json").exists():
            again.append("--resume")
        result = self.line.run(again, self.folder)
        if result.returncode != 0:
            return f"the next run fails: {result.stderr.strip()[-200:]}"
        after = content(self.folder, ["."])
        left = [name for name in after if TEMPORARY.search(name)]
        if left:
            return f"the next run leaves {left[0]}"
        return self.differs(after, truth)

    @staticmethod
    def differs(after, truth):
        for name, data in truth.items():
            if after.get(name) != data:
                return f"{name} isn't what it is without the fault"
        return None


def spread(first, last, most):
    """At most so many of the numbers from first to last, with both; of one the last."""
    count = last - first + 1
    if count <= most:
        return list(range(first, last + 1))
    if most == 1:
        return [last]
    return sorted({first + round(k * (count - 1) / (most - 1)) for k in range(most)})


def run(line, library, folder, most, report, only=None):
    trial = Trial(line, library, folder)
    for command in line.commands():
        verb, arguments, outputs = command
        if only and verb not in only:
            continue
        line.copy(folder)
        result = line.run(arguments, folder)
        if result.returncode != 0:
            raise SystemExit(f"{arguments}: {result.stderr}")
        truth = {
            name: data
            for name, data in content(folder, outputs).items()
            if not name.endswith("/lock")  # holds the number of a process
        }
        counts = {}
        before_main = trial.calls(["--version"], "memory")  # by libraries, while they load
        for calls, kind, goes_on, expected in KINDS:
            if calls not in counts:
                counts[calls] = trial.calls(arguments, calls)
            first = before_main + 1 if calls == "memory" else 1
            for number in spread(first, counts[calls], most):
                fault = f"{calls}:{number}:{kind}" + (":on" if goes_on else "")
                wrong = trial.judge(command, fault, expected, truth)
                report.add(verb, f"{calls}: {kind}", wrong, f"NACRE_FAULT={fault} {' '.join(arguments)}")
