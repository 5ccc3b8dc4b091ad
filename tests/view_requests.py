"""Of view_test.py: a view that is served, and requests to it."""
import fcntl
import json
import os
import subprocess
import sys
import urllib.error
import urllib.request
from contextlib import contextmanager


def check(holds, message):
    if not holds:
        sys.exit(f"failed: {message}")


@contextmanager
def served(program, *arguments):
    """The address of a view that runs meanwhile."""
    process = subprocess.Popen([program, "view", *map(str, arguments), "-q"], stdout=subprocess.PIPE, text=True)
    try:
        yield process.stdout.readline().strip().rstrip("/")
    finally:
        process.terminate()
        check(process.wait(timeout=20) == 0, f"view ends with exit code {process.returncode}")


@contextmanager
def owned(run):
    """A run that goes on, as far as its folder tells."""
    lock = run / "owner.lock"
    with lock.open("w", encoding="utf-8") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        print(os.getpid(), file=file, flush=True)
        yield
    lock.unlink()


def get(url, **headers):
    request = urllib.request.Request(url, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=60) as response:
            return response.status, response.headers, response.read()
    except urllib.error.HTTPError as error:
        return error.code, error.headers, error.read()


def json_of(url):
    status, _, content = get(url)
    check(status == 200, f"{url}: {status} {content[:200]}")
    return json.loads(content)
