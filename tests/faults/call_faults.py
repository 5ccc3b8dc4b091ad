"""Calls that fail: malloc, open, read, write, fsync and rename at call n; a limit of memory or of open files."""
import errno
import resource

from lab import VOID, Verdict, judge

# The frames of these runs: every call on a file is a trial of the long test.
SHORT = ("--max-frames", "3")


def _short(lab):
    """Short runs with their undisturbed ends, by recording."""
    found = []
    for recording in lab.recordings.values():
        short = type(recording)(recording.name, recording.path, (*recording.options, *SHORT))
        folder = lab.new_folder()
        short.code = lab.run(*lab.run_command(short, folder)).code
        short.hashes = lab.hashes(folder)
        found.append(short)
        lab.clean(folder)
    return found


def _spread(lab, count, trials):
    """`trials` of the numbers 1 … count, spread evenly with a random phase; all of them, if there are not more."""
    if count <= trials:
        return list(range(1, count + 1))
    phase = lab.rng.random()
    return [1 + int((i + phase) * count / trials) for i in range(trials)]


def _series(lab, trials, call, errors, allowed, faults_of, always=(0, 1)):
    """One call after the other fails: in each short run, each with the next of the errors, once or from then on."""
    shorts = _short(lab)
    for short in shorts:
        probe = lab.new_folder()
        _, report = lab.run_with({"CALL": call, **faults_of(short, probe)}, *lab.run_command(short, probe))
        lab.clean(probe)
        for i, at in enumerate(_spread(lab, report.calls, max(1, trials // len(shorts)))):
            folder, number = lab.new_folder(), errors[i % len(errors)]
            repeated = always[(i // len(errors)) % len(always)]
            faults = {"CALL": call, "AT": at, "ERRNO": int(number), "ALWAYS": repeated, **faults_of(short, folder)}
            done, report = lab.run_with(faults, *lab.run_command(short, folder))
            what = (f"{short.name}, {call} {at}{' and all later ones' if repeated else ''}: "
                    f"{errno.errorcode[number]}")
            if report.injected == 0:
                yield Verdict(VOID, what)
            else:
                what += " inside GDAL" if report.inside_gdal else ""
                yield judge(lab.check_run(done, folder, short, allowed), what)
            lab.clean(folder)


def _of_output(_, folder):
    return {"PATH": folder.name}


def _of_input(recording, _):
    return {"PATH": recording.path.relative_to(recording.path.parents[1])}


def malloc_once(lab, trials):
    """One allocation fails, of any size: out of memory is 5; the rest of the run is resumed."""
    yield from _series(lab, trials, "malloc", [errno.ENOMEM], {5}, lambda *_: {}, always=(0,))


def malloc_large(lab, trials):
    """Allocations of 4 KB and more fail, once or from then on."""
    yield from _series(lab, trials, "malloc", [errno.ENOMEM], {5}, lambda *_: {"MIN_BYTES": 4096})


def open_input(lab, trials):
    """A passing shortage of descriptors (5), or an input that cannot be read (3; 4 for a calibration)."""
    errors = [errno.EMFILE, errno.EACCES, errno.EIO, errno.ENFILE, errno.ENOMEM]
    yield from _series(lab, trials, "open", errors, {3, 4, 5}, _of_input)


def read_input(lab, trials):
    """A read of the input fails: nothing of it is taken for the end of the file, and a resume reads it again."""
    yield from _series(lab, trials, "read", [errno.EIO, errno.EIO, errno.ENOMEM], {3, 4, 5}, _of_input)


def open_output(lab, trials):
    errors = [errno.EMFILE, errno.EACCES, errno.ENOSPC, errno.EROFS, errno.EIO]
    yield from _series(lab, trials, "open", errors, {5}, _of_output)


def read_output(lab, trials):
    """A read of the store fails: 3 or 5, and nothing of it is lost."""
    yield from _series(lab, trials, "read", [errno.EIO], {3, 5}, _of_output)


def write_output(lab, trials):
    yield from _series(lab, trials, "write", [errno.ENOSPC, errno.EIO, errno.EDQUOT, errno.EFBIG], {5}, _of_output)


def fsync_output(lab, trials):
    yield from _series(lab, trials, "fsync", [errno.EIO, errno.ENOSPC], {5}, _of_output)


def rename_output(lab, trials):
    yield from _series(lab, trials, "rename", [errno.EACCES, errno.EIO, errno.ENOSPC], {5}, _of_output)


def memory_limit(lab, trials):
    """`ulimit -v` at ten limits and more: done, or 5. An end before main() is the loader's."""
    for attempt in range(trials):
        recording, folder = list(lab.recordings.values())[attempt % len(lab.recordings)], lab.new_folder()
        megabytes = 100 + (attempt * 1900) // max(1, trials - 1)
        done, report = lab.run_with({}, *lab.run_command(recording, folder), memory=megabytes << 20)
        what = f"{recording.name}, {megabytes} MB"
        if not report.main_reached:
            yield Verdict(VOID, what)
        else:
            yield judge(lab.check_run(done, folder, recording, {5}), what)
        lab.clean(folder)


def descriptor_limit(lab, trials):
    """`ulimit -n`: done, or 5 (3 or 4 where an input cannot be opened)."""
    for attempt in range(trials):
        recording, folder, limit = lab.any_recording(), lab.new_folder(), 6 + 2 * attempt
        done, report = lab.run_with({}, *lab.run_command(recording, folder), before=lambda: resource.setrlimit(
            resource.RLIMIT_NOFILE, (limit, limit)))  # pylint: disable=cell-var-from-loop
        what = f"{recording.name}, {limit} descriptors"
        if not report.main_reached:
            yield Verdict(VOID, what)
        else:
            yield judge(lab.check_run(done, folder, recording, {3, 4, 5}), what)
        lab.clean(folder)


# In CI 60 values of n in all; in the long test every call on a file of the short run, every allocation of
# 4 KB and more, and 1000 allocations of any size.
CLASSES = {
    "malloc_once": (malloc_once, 16, 1000),
    "malloc_large": (malloc_large, 8, 10000),
    "open_input": (open_input, 8, 10000),
    "read_input": (read_input, 8, 10000),
    "open_output": (open_output, 6, 10000),
    "read_output": (read_output, 4, 10000),
    "write_output": (write_output, 8, 10000),
    "fsync_output": (fsync_output, 6, 10000),
    "rename_output": (rename_output, 4, 10000),
    "memory_limit": (memory_limit, 10, 60),
    "descriptor_limit": (descriptor_limit, 1, 14),
}
