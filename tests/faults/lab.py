"""Where faults are injected: the program under test, short recordings with their undisturbed runs, and verdicts."""
import importlib.machinery
import importlib.util
import os
import random
import resource
import shutil
import signal
import struct
import subprocess
import time
from dataclasses import dataclass, field
from pathlib import Path

from commands import commands_of

# Nothing that the tests do needs more; an input that makes the program ask for more must end with an exit code.
MEMORY_LIMIT_BYTES = 3 << 30
TIME_LIMIT_S = 120
NOBODY = 65534
DOCUMENTED, DIFFERS, VOID, SKIPPED = "documented", "differs", "void", "skipped"


@dataclass
class Verdict:
    """Of one trial. VOID: the fault was not met, e.g. a kill after the end. SKIPPED: cannot be done here."""

    result: str
    what: str


def judge(problems, what):
    return Verdict(DIFFERS, f"{what}: {'; '.join(problems)}") if problems else Verdict(DOCUMENTED, what)


@dataclass
class Outcome:
    """How a process ended: exit code, or minus the number of the signal; None if it was killed at the time limit."""

    code: int | None
    out: str = ""
    err: str = ""
    pid: int = 0
    seconds: float = 0

    def problems(self, allowed):
        if self.code in allowed:
            return []
        end = "no end" if self.code is None else f"signal {-self.code}" if self.code < 0 else f"exit code {self.code}"
        said = self.err.strip().splitlines()
        return [f"{end} instead of {'/'.join(map(str, sorted(allowed)))} ({said[-1][:160] if said else 'no message'})"]


@dataclass
class Report:
    """What the shim counted."""

    calls: int = 0
    injected: int = 0
    delays: int = 0
    clock_readings: int = 0
    main_reached: int = 0
    inside_gdal: int = 0


@dataclass
class Recording:
    """A short recording, the options of its runs, and its undisturbed run."""

    name: str
    path: Path
    options: tuple = ()
    code: int = 0
    seconds: float = 0
    hashes: dict = field(default_factory=dict)
    run: Path | None = None  # its folder


def load_run_hashes(source):
    """scripts/run_hashes as a module: one definition of what is byte-stable."""
    loader = importlib.machinery.SourceFileLoader("run_hashes", str(source / "scripts/run_hashes"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("run_hashes", loader))
    loader.exec_module(module)
    return module


class Lab:
    """Runs the program, one process at a time, in `work`; every choice comes from `rng`."""

    def __init__(self, program, shim, small_runs, source, work):
        self.program, self.shim, self.source = Path(program).resolve(), Path(shim).resolve(), Path(source).resolve()
        self.work = Path(work).resolve() / "trials"
        self.rng = random.Random(1)  # the runner replaces it for each class
        self.run_hashes = load_run_hashes(self.source)
        self.count = 0
        shutil.rmtree(self.work, ignore_errors=True)
        self.work.mkdir(parents=True)
        self.small_runs = self.work / "small_runs"  # a copy: mutated trials must not reach the fixtures of other tests
        shutil.copytree(small_runs, self.small_runs)
        found = [Recording("drive", self.small_runs / "drive", ("--set", "terrain.every_m=0.15"))]
        if (self.small_runs / "stops/rec").exists():  # missing in a build without the simulator
            found.append(Recording("stops", self.small_runs / "stops/rec"))
        self.recordings = {recording.name: recording for recording in found}
        for recording in found:
            self._run_undisturbed(recording)

    def _run_undisturbed(self, recording):
        self.run(*self.run_command(recording, self.new_folder("first")))  # libraries and input come from the disk
        folder = self.new_folder("undisturbed")
        done = self.run(*self.run_command(recording, folder))
        if done.code not in (0, 6):
            raise RuntimeError(f"the undisturbed run of {recording.name} fails: {done.err}")
        recording.code, recording.seconds, recording.hashes = done.code, done.seconds, self.hashes(folder)
        recording.run = folder

    def new_folder(self, prefix="t"):
        """A path below `work` that does not exist yet."""
        self.count += 1
        return self.work / f"{prefix}_{self.count}"

    def commands(self):
        return commands_of(self)

    def any_recording(self):
        return self.rng.choice(list(self.recordings.values()))

    @staticmethod
    def run_command(recording, folder, *more, threads=1):
        return ("run", recording.path, "-o", folder, "--threads", str(threads), *recording.options, *more)

    def environment(self, faults=None, more=None):
        """The caller's environment, with the shim if `faults` (names without FAULT_) are given."""
        environment = {**os.environ, **(more or {})}
        if faults is not None:
            environment["LD_PRELOAD"] = str(self.shim)
            environment |= {f"FAULT_{name}": str(value) for name, value in faults.items()}
        return {name: value for name, value in environment.items() if value is not None}

    def start(self, *arguments, env=None, before=None, memory=MEMORY_LIMIT_BYTES, program=None, **streams):
        """Starts the program; `before` runs in the child. Standard output and error go to files of their own."""

        def prepare():
            resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
            resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
            for name in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT, signal.SIGPIPE, signal.SIGXFSZ):
                signal.signal(name, signal.SIG_DFL)
            if before is not None:
                before()

        # In a file, so that a reader that is slow or gone changes nothing; unless the trial is about the streams.
        out, err = self.new_folder("out"), self.new_folder("err")
        with open(out, "wb") as out_file, open(err, "wb") as err_file:
            options = {"stdin": subprocess.DEVNULL, "stdout": out_file, "stderr": err_file, **streams}
            process = subprocess.Popen([program or self.program, *arguments], preexec_fn=prepare,
                                       env=env if env is not None else self.environment(), **options)
        process.files, process.started = (out, err), time.monotonic()
        return process

    @staticmethod
    def end(process, timeout=TIME_LIMIT_S, interrupt=False):
        """Waits for a process that start() returned. At the time limit it is interrupted, if wanted, and killed."""
        try:
            code = process.wait(timeout)
        except subprocess.TimeoutExpired:
            code = None
            if interrupt:  # an input that asks for much work is no fault, if Ctrl-C stops it
                process.send_signal(signal.SIGINT)
                try:
                    code = process.wait(20)
                except subprocess.TimeoutExpired:
                    pass
            if code is None:
                process.kill()
                process.wait()
        texts = [file.read_bytes().decode("utf-8", "replace") for file in process.files]
        for file in process.files:
            file.unlink()
        return Outcome(code, *texts, process.pid, time.monotonic() - process.started)

    def run(self, *arguments, timeout=TIME_LIMIT_S, interrupt=False, **options):
        return self.end(self.start(*arguments, **options), timeout, interrupt)

    def run_with(self, faults, *arguments, more=None, **options):
        """Runs with the shim. Returns the outcome and the shim's report."""
        file = self.new_folder("report")
        done = self.run(*arguments, env=self.environment({**faults, "REPORT": file}, more), **options)
        return done, self.read_report(file)

    @staticmethod
    def read_report(file):
        data = file.read_bytes() if file.exists() else b""
        file.unlink(missing_ok=True)
        return Report(*struct.unpack("<6Q", data)) if len(data) == 48 else Report()

    def hashes(self, folder):
        stable = [file for file in sorted(folder.rglob("*"))
                  if file.is_file() and self.run_hashes.is_byte_stable(file.relative_to(folder))]
        found = {str(file.relative_to(folder)): hash(file.read_bytes()) for file in stable}
        if (folder / "run.sqlite").is_file():
            found |= dict(self.run_hashes.table_hashes(folder / "run.sqlite"))
        return found

    def differences(self, folder, recording):
        """Of a finished run from the undisturbed one."""
        try:
            found = self.hashes(folder)
        except Exception as error:  # pylint: disable=broad-except  # a damaged store is a finding, not an end
            return [f"run.sqlite cannot be read: {error}"]
        names = [name for name in {**found, **recording.hashes} if found.get(name) != recording.hashes.get(name)]
        parts = [str(part.relative_to(folder)) for part in folder.rglob("*.part")]
        return ([f"{', '.join(sorted(names)[:4])} differ"] if names else []) + [f"{part} is left" for part in parts[:3]]

    def resume(self, folder, recording):
        """Finishes a run undisturbed. Returns what differs from the run that was never disturbed."""
        done = self.run(*self.run_command(recording, folder, "--resume"))
        problems = done.problems({recording.code})
        return [f"resume: {problem}" for problem in problems] or [
            f"after resume: {problem}" for problem in self.differences(folder, recording)]

    def check_run(self, done, folder, recording, allowed):
        """Of a disturbed run: an allowed end; then the same files at once (if it says that it is done) or resumed."""
        problems = done.problems(set(allowed) | {recording.code})
        if done.code == recording.code:
            problems += [f"done, but {problem}" for problem in self.differences(folder, recording)]
        return problems + self.resume(folder, recording)

    def as_other_user(self):
        """Options of run() and start() for a user who may write below `work` only; None where that cannot be done.

        Root runs a copy of the program as `nobody`: what would overwrite a device or the root folder must fail.
        """
        if os.geteuid() != 0:
            return {}

        def become_nobody():
            os.setgroups([])
            os.setgid(NOBODY)
            os.setuid(NOBODY)

        copy = self.work / "program_of_nobody"
        if not copy.exists():
            shutil.copy2(self.program, copy)
            copy.chmod(0o755)
        options = {"program": copy, "before": become_nobody}
        try:
            return options if self.run("--version", **options).code == 0 else None
        except PermissionError:  # a folder on the way is closed to others
            return None

    @staticmethod
    def give_away(folder):
        """Makes a folder and its content that of the other user."""
        if os.geteuid() == 0:
            for file in [folder, *folder.rglob("*")]:
                os.chown(file, NOBODY, NOBODY, follow_symlinks=False)

    def remove(self):
        shutil.rmtree(self.work, ignore_errors=True)

    @staticmethod
    def clean(*folders):
        for folder in folders:
            shutil.rmtree(folder, ignore_errors=True)
