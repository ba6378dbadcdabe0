"""Too little memory, a clock that jumps, two processes at one session, a moved session."""

import fcntl
import os
import resource
import shutil
import signal
import subprocess
import time

from line import content


def without_lock(files):
    return {name: data for name, data in files.items() if not name.endswith("/lock")}


def truth_of(line, folder, arguments, outputs):
    line.copy(folder)
    result = line.run(arguments, folder)
    if result.returncode != 0:
        raise SystemExit(f"{arguments}: {result.stderr}")
    return without_lock(content(folder, outputs))


def limited(limit):
    """For a child process: no more address space than that, no core files."""

    def set_limits():
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))

    return set_limits


def memory(line, folder, most, report, only):
    """Address space from too little to just enough: the command says which is which."""
    for verb, arguments, outputs in line.commands():
        if only and verb not in only:
            continue
        truth = truth_of(line, folder, arguments, outputs)
        for k in range(most):
            limit = int(450e6 + 2e9 * k / most)  # in less, libraries don't load
            line.copy(folder)
            result = line.run(arguments, folder, preexec=limited(limit))
            wrong = None
            if result.returncode not in (0, 1):
                wrong = f"exit code {result.returncode}: {result.stderr.strip()[-200:]}"
            elif result.returncode == 0 and without_lock(content(folder, outputs)) != truth:
                wrong = "another result"
            elif result.returncode != 0 and "nacre: " not in result.stderr:
                wrong = f"not a word: {result.stderr.strip()[-200:]}"
            report.add(verb, "addresses limited", wrong, f"ulimit -v {limit // 1024}; {' '.join(arguments)}")


def clock(line, library, folder, report, only):
    for verb, arguments, outputs in line.commands():
        if only and verb not in only:
            continue
        truth = truth_of(line, folder, arguments, outputs)
        line.copy(folder)
        environment = {"LD_PRELOAD": str(library), "NACRE_FAULT": "clock:0:jump"}
        result = line.run(arguments, folder, environment)
        wrong = None
        if result.returncode != 0:
            wrong = f"exit code {result.returncode}: {result.stderr.strip()[-200:]}"
        elif without_lock(content(folder, outputs)) != truth:
            wrong = "another result"
        report.add(verb, "clock jumps", wrong, f"NACRE_FAULT=clock:0:jump {' '.join(arguments)}")


def kills(line, folder, most, report, only):
    """SIGKILL and SIGTERM at instants that nobody chose."""
    for verb, arguments, outputs in line.commands():
        if only and verb not in only:
            continue
        begin = time.monotonic()
        truth = truth_of(line, folder, arguments, outputs)
        length = time.monotonic() - begin
        for k in range(most):
            number = (signal.SIGKILL, signal.SIGTERM)[k % 2]
            line.copy(folder)
            process = subprocess.Popen(
                [line.nacre, *arguments, "--threads", "2"],
                cwd=folder,
                env=dict(os.environ, OPENBLAS_NUM_THREADS="1"),
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            time.sleep(length * (k + 0.5) / most)
            process.send_signal(number)
            process.wait()
            again = list(arguments)
            if verb == "capture" and (folder / outputs[0] / "session.json").exists():
                again.append("--resume")
            result = line.run(again, folder)
            wrong = None
            if result.returncode != 0:
                wrong = f"the next run fails: {result.stderr.strip()[-200:]}"
            elif without_lock(content(folder, outputs)) != truth:
                wrong = "the next run's result is another"
            report.add(verb, f"{signal.Signals(number).name} at a random instant", wrong, " ".join(arguments))


def half_a_session(line, folder, arguments):
    """A capture that was killed with its journal begun."""
    line.copy(folder)
    process = subprocess.Popen(
        [line.nacre, *arguments, "--threads", "1"],
        cwd=folder,
        env=dict(os.environ, OPENBLAS_NUM_THREADS="1"),
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    begun = (folder / "o" / "session.json", folder / "o" / "journal")
    while not all(file.exists() for file in begun) and process.poll() is None:
        time.sleep(0.002)
    process.kill()
    process.wait()


def sessions(line, folder, report):
    """One session for two, and one that is carried elsewhere half done."""
    arguments = ["capture", "rig.toml", "--out", "o"]
    truth = truth_of(line, folder, arguments, ["o"])

    half_a_session(line, folder, arguments)
    with open(folder / "o" / "lock", "r+", encoding="ascii") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # as the process that captures holds it
        before = content(folder, ["o"])
        second = line.run([*arguments, "--resume"], folder)
        wrong = None
        if second.returncode != 1 or "is capturing into this session" not in second.stderr:
            wrong = f"the second isn't refused: {second.stderr.strip()[-200:]}"
        elif content(folder, ["o"]) != before:
            wrong = "the second changed the session"
    report.add("capture", "two processes, one session", wrong, " ".join(arguments))

    half_a_session(line, folder, arguments)
    shutil.move(folder / "o", folder / "elsewhere")
    result = line.run(["capture", "rig.toml", "--out", "elsewhere", "--resume"], folder)
    moved = {
        name.replace("elsewhere", "o", 1): data
        for name, data in without_lock(content(folder, ["elsewhere"])).items()
    }
    wrong = None if result.returncode == 0 and moved == truth else result.stderr.strip()[-200:]
    report.add("capture", "session moved half done", wrong, " ".join(arguments))


def run(line, library, folder, most, report, only=None):
    memory(line, folder, most, report, only)
    clock(line, library, folder, report, only)
    kills(line, folder, most, report, only)
    if not only or "capture" in only:
        sessions(line, folder, report)
