#!/usr/bin/env python3
"""`spartan view`: what it serves, and, where Chromium and Playwright are installed, the page in a browser.

    view_test.py PROGRAM SMALL_RUNS [--screenshots FOLDER] [--run RUN]

SMALL_RUNS: the folder that make_small_runs has filled. RUN: another run for the screenshots and the times of frames.
Exit code 77 (skipped): the program was built without the viewer. With SPARTAN_BROWSER_TESTS=1 a browser that is missing
is a failure.
"""
import argparse
import csv
import json
import os
import shutil
import socket
import sqlite3
import struct
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

from view_in_browser import AXE, CHROMIUM, check_in_browser, check_live, check_many_frames, sync_playwright
from view_requests import check, get, json_of, owned, served


def check_answers(program, run, recording):
    """Each answer against the files of the run."""
    changed_ns = run.stat().st_mtime_ns
    with served(program, run, "--recording", recording) as url:
        about = json_of(f"{url}/api/run")
        poses = [line.split() for line in (run / "trajectory_localization.tum").read_text(encoding="utf-8").splitlines()
                 if not line.startswith("#")]
        check(about["frames"] == len(poses) and about["ended"] and about["has_images"], f"overview: {about}")
        frames = json_of(f"{url}/api/frames?from=0")
        for pose, found in zip(poses, frames["pose"]):
            off = max(abs(float(a) - b) for a, b in zip(pose[1:4], found[:3]))
            check(off < 1e-4, f"pose {found} of {pose}")
        check(all(len(value) == len(poses) for value in frames.values() if isinstance(value, list)), "columns of one length")
        check(all(len(v) == len(poses) for table in ("stages", "sensors") for v in frames[table].values()), "stages, sensors")
        later = json_of(f"{url}/api/frames?from=10")
        check(later["from"] == 10 and later["t_s"] == frames["t_s"][10:], "frames from a number on")

        _, _, content = get(f"{url}/api/map")
        (length,) = struct.unpack("<I", content[:4])
        header = json.loads(content[4 : 4 + length])
        cells = header["width"] * header["height"]
        sizes = {"float32": 4, "uint8": 1, "rgb8": 3}
        ends = [4 + length + layer["offset"] + sizes[layer["type"]] * cells for layer in header["layers"]]
        check(max(ends) == len(content) and length % 4 == 0, "layers of the map fill the answer")
        check(all(layer["offset"] % 4 == 0 for layer in header["layers"]), "layers are aligned")

        status, headers, image = get(f"{url}/api/image?frame=3")
        check(status == 200 and headers["Content-Type"] == "image/jpeg" and image[:2] == b"\xff\xd8", "an image")
        tracks = json_of(f"{url}/api/landmarks?frame=3")["tracks"]
        check(sum(track[4] for track in tracks) > 50, f"{len(tracks)} landmarks")
        check(json_of(f"{url}/api/landmarks?frame=0")["tracks"] == [], "no motion to the first frame")
        status, _, disparity = get(f"{url}/api/disparity?view=0")
        stamp = frames["stamp_ns"][about["terrain"][0]]
        check(disparity == (run / f"terrain/{stamp}.png").read_bytes(), "the disparity image is the file of the run")

        for path, expected in (("/api/image?frame=1000", 404), ("/api/disparity?view=99", 404), ("/api/image?frame=x", 400),
                               ("/api/image", 400), ("/api/frames?from=-1", 400), ("/none", 404), ("/../etc/passwd", 404)):
            check(get(url + path)[0] == expected, f"{path}: {get(url + path)[0]}, not {expected}")
        check(get(f"{url}/api/run", Host="evil.example")[0] == 403, "another name of this computer is refused")
        _, headers, page = get(url + "/")
        check(run.stat().st_mtime_ns == changed_ns, "the store is read only: there is no file beside it, not even for a moment")
        check(b"http://" not in page and b"https://" not in page, "the page names no other computer")
        check("default-src 'self'" in headers["Content-Security-Policy"], "and may not load from one")


def with_innovations(run, folder):
    """A copy of the run whose store has tests of the wheels at frames 2 (rejected) and 4."""
    copy = folder / "tested"
    shutil.copytree(run, copy)
    store = sqlite3.connect(copy / "run.sqlite")
    store.executemany("INSERT INTO innovations VALUES (?,'wheels',?,?,?)", [(3, 5, 21.0, 14.0), (5, 7, 3.5, 14.0)])
    store.commit()
    store.close()
    return copy


def run_into(program, recording, run, *options):
    done = subprocess.run([program, "run", recording, "-o", run, "-q", *options], capture_output=True, text=True, timeout=120)
    check(done.returncode in (0, 6), f"a run: {done.returncode} {done.stderr}")


def check_recordings_of_live_run(program, drive, folder):
    """Of cameras that are not triggered together; the second part was killed before it listed a frame."""
    run = folder / "resumed"
    run_into(program, f"replay:{drive}", run, "--speed", "20")
    table = run / "live/1/frames.csv"
    with table.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    shutil.copytree(run / "live/1", run / "live/2")
    for name, listed in (("1", rows), ("2", [])):
        with (run / f"live/{name}/frames.csv").open("w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, rows[0].keys(), lineterminator="\n")
            writer.writeheader()
            writer.writerows({**row, "right_stamp_ns": int(row["right_stamp_ns"]) + 8_000_000} for row in listed)
    with served(program, run) as url:
        for frame in (3, 3, 4):
            status, _, content = get(f"{url}/api/image?frame={frame}")
            check(status == 200, f"image {frame} of a live run: {status} {content[:200]}")


def check_images_before_they_are_listed(program, drive, folder):
    """Of a live run, while it goes on and when it has ended; the last frame is never recorded."""
    run = folder / "recorded"
    run_into(program, f"replay:{drive}", run, "--speed", "20")
    table = run / "live/1/frames.csv"
    table.write_text("".join(table.read_text(encoding="utf-8").splitlines(keepends=True)[:4]), encoding="utf-8")
    with served(program, run) as url:
        last = json_of(f"{url}/api/run")["frames"] - 1
        stamp = json_of(f"{url}/api/frames?from={last}")["stamp_ns"][0]
        check(json_of(f"{url}/api/run")["last_image"] == last, "all images are there")
        left, right = (next((run / "live/1/images").rglob(f"{stamp}_{side}.pnm")) for side in ("left", "right"))
        left.write_bytes(left.read_bytes()[:1000])
        right.unlink()
        with owned(run):
            check(get(f"{url}/api/image?frame={last - 1}")[0] == 200, "a frame that is not listed yet")
            status, _, content = get(f"{url}/api/image?frame={last}")
            check(status == 204, f"an image that is not complete yet: {status} {content[:200]}")
            check(not json_of(f"{url}/api/run")["ended"], "a run whose folder a process owns goes on")
        about = json_of(f"{url}/api/run")
        check(about["ended"], f"a run whose folder nobody owns has ended: {about}")
        status, _, content = get(f"{url}/api/image?frame={last}")
        check(status == 404 and b"no image" in content, f"an image that was never recorded: {status} {content[:200]}")
    with served(program, run) as url:
        check(json_of(f"{url}/api/run")["last_image"] == last - 1, "the last frame that has images")


def check_run_by_rig(program, drive, run, folder):
    """Of recordings without a calibration, or with another one, run from another folder."""
    rig = (run / "rig.yaml").read_text(encoding="utf-8")
    images = folder / "images"
    for side, name in (("image_0", "left"), ("image_1", "right")):
        shutil.copytree(drive / side, images / name)
    shutil.copytree(drive, folder / "calibrated")
    check('"stereo"' in rig, rig)
    (folder / "rig.yaml").write_text(rig.replace('"stereo"', '"front"'), encoding="utf-8")
    for name, options in (("images", ("--fps", "10")), ("calibrated", ())):
        subprocess.run([Path(program).resolve(), "run", name, "-o", f"{name}_run", "--rig", "rig.yaml", *options, "-q", "--max-frames", "8"],
                       cwd=folder, check=True, capture_output=True, timeout=120)
        of_rig = folder / f"{name}_run"
        (of_rig / "summary.json").unlink()  # as while it goes on
        with served(program, of_rig) as url:
            check(json_of(f"{url}/api/run")["has_images"], f"{name}: the run states its recording")
            status, _, content = get(f"{url}/api/image?frame=3")
            check(status == 200, f"{name}: {status} {content[:200]}")
            check(json_of(f"{url}/api/landmarks?frame=3")["tracks"], f"{name}: landmarks")
    images.rename(folder / "moved")
    with served(program, folder / "images_run") as url:
        check(not json_of(f"{url}/api/run")["has_images"], "the recording is not there any more")
    with served(program, folder / "images_run", "--recording", folder / "moved") as url:
        check(get(f"{url}/api/image?frame=3")[0] == 200, "it was moved")


def check_single_images(program, drive, folder):
    """Frame 5 has the left image alone, frame 9 none."""
    recording, run = folder / "single", folder / "single_run"
    shutil.copytree(drive, recording)
    for side, frame in (("image_1", 5), ("image_0", 9), ("image_1", 9)):
        sorted((recording / side).iterdir())[frame].write_bytes(b"")
    run_into(program, recording, run)
    with served(program, run, "--recording", recording) as url:
        for frame in (5, 6, 8, 10):
            status, _, content = get(f"{url}/api/image?frame={frame}")
            check(status == 200, f"image {frame}: {status} {content[:200]}")
            tracks = json_of(f"{url}/api/landmarks?frame={frame}")["tracks"]
            check(sum(track[4] for track in tracks) > 12, f"{len(tracks)} landmarks at frame {frame}")
        check(get(f"{url}/api/image?frame=9")[0] == 404, "a frame without images")
        check(json_of(f"{url}/api/landmarks?frame=9")["tracks"] == [], "no motion to it")


def repeated(run, copy, times):
    """A copy of a run, without images, whose store has its frames so many times, one after the other."""
    shutil.copytree(run, copy)
    (copy / "input.yaml").unlink()
    store = sqlite3.connect(copy / "run.sqlite")
    store.execute("PRAGMA synchronous=OFF")
    count, first, last = store.execute("SELECT count(*), min(stamp_ns), max(stamp_ns) FROM frames").fetchone()
    span = (last - first) * count // (count - 1)
    store.execute("CREATE TEMP TABLE copies AS WITH RECURSIVE c(k) AS (VALUES(1) UNION ALL SELECT k + 1 FROM c WHERE k < ?) "
                  "SELECT k FROM c", (times - 1,))
    moved = {"seq": f"seq + {count} * k", "frame_id": f"frame_id + {count} * k", "stamp_ns": f"stamp_ns + {span} * k",
             "motion_from_ns": f"motion_from_ns + {span} * k"}
    for table in ("frames", "stage_times", "localization", "slam", "smoothed", "health"):
        columns = [row[1] for row in store.execute(f"PRAGMA table_info({table})")]
        store.execute(f"INSERT INTO {table} SELECT {', '.join(moved.get(c, c) for c in columns)} FROM copies CROSS JOIN {table} "
                      f"WHERE seq <= {count} ORDER BY k, seq, {table}.rowid")
    store.commit()
    store.close()
    summary = json.loads((copy / "summary.json").read_text(encoding="utf-8"))
    (copy / "summary.json").write_text(json.dumps({**summary, "frames": count * times, "input": ""}), encoding="utf-8")
    return copy


def check_growing_store(program, run, folder):
    """Frames that are added, and frames that others replace: a run was resumed from a checkpoint."""
    copy = repeated(run, folder / "growing", 2)
    generations = []
    with served(program, copy) as url, sqlite3.connect(copy / "run.sqlite") as store:
        def check_frames(what):
            generations.append(json_of(f"{url}/api/run")["generation"])
            stamps = [str(row[0]) for row in store.execute("SELECT stamp_ns FROM frames ORDER BY seq")]
            check(json_of(f"{url}/api/run")["frames"] == len(stamps), f"{what}: number of frames")
            whole = json_of(f"{url}/api/frames?from=0")
            check(whole["stamp_ns"] == stamps and whole["total"] == len(stamps), f"{what}: frames")
            for start in (1, 20, len(stamps) - 1):
                part = json_of(f"{url}/api/frames?from={start}")
                check(part["total"] == len(stamps) and part["t_s"] == whole["t_s"][start:], f"{what}: from {start}")
                check(all(values == whole["sensors"][name][start:] for name, values in part["sensors"].items()), f"{what}: sensors")
                check(all(values == whole["stages"][name][start:] for name, values in part["stages"].items()), f"{what}: stages")

        tables = ("frames", "stage_times", "localization", "slam", "smoothed", "health")
        taken = {table: store.execute(f"SELECT * FROM {table} WHERE seq > 23 ORDER BY rowid").fetchall() for table in tables}
        check_frames("at the begin")
        for table in tables:
            store.execute(f"DELETE FROM {table} WHERE seq > 23")
        store.commit()
        check_frames("fewer")
        for table in tables:
            store.executemany(f"INSERT INTO {table} VALUES ({','.join('?' * len(taken[table][0]))})", taken[table])
        store.commit()
        check_frames("more")
        store.execute("DELETE FROM terrain WHERE stamp_ns = (SELECT max(stamp_ns) FROM terrain)")
        store.execute("UPDATE frames SET stamp_ns = stamp_ns + 1000 WHERE seq > 20")
        store.commit()
        check_frames("others")
        check(generations == [0, 1, 1, 2], f"the page is told that frames were replaced: {generations}")
        check(len(json_of(f"{url}/api/run")["terrain"]) == store.execute("SELECT count(*) FROM terrain").fetchone()[0], "terrain views")


def check_innovations(program, run):
    with served(program, run) as url:
        tested = json_of(f"{url}/api/frames?from=0")["innovations"]
        check(list(tested) == ["wheels"] and tested["wheels"][:6] == [None, None, 1.5, None, 0.25, None], f"tests: {tested}")
        check(json_of(f"{url}/api/frames?from=4")["innovations"]["wheels"][:2] == [0.25, None], "tests from a frame on")


def check_ports_and_ends(program, run):
    with served(program, run) as url:
        port = url.rsplit(":", 1)[1]
        other = subprocess.run([program, "view", str(run), "--port", port], capture_output=True, text=True, timeout=30)
        check(other.returncode == 5 and "--port" in other.stderr, f"a port in use: {other.returncode} {other.stderr}")
        body = urllib.request.Request(f"{url}/api/run", data=bytes(10**6), method="POST")
        try:
            urllib.request.urlopen(body, timeout=30)
            check(False, "a request with a body is refused")
        except (urllib.error.HTTPError, urllib.error.URLError, ConnectionError):
            pass
    for delay in (0, 0.02, 0.05, 0.1, 0.2, 0.4):
        view = subprocess.Popen([program, "view", str(run), "-q"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(delay)
        view.send_signal(2)
        check(view.wait(timeout=10) in (0, 130, -2), f"an interrupt after {delay} s ends it: {view.returncode}")
    with served(program, run, "--address", "0.0.0.0") as url:
        status = get(url.replace("0.0.0.0", "127.0.0.2") + "/api/run")[0]
        check(status == 200, f"another address of this computer: {status}")
        local, own = url.replace("0.0.0.0", "127.0.0.1") + "/api/run", socket.gethostname().split(".")[0]
        for host in (own, f"{own}.local", f"{own.upper()}.local:80"):
            check(get(local, Host=host)[0] == 200, f"the page opens by {host}")
        status, _, told = get(local, Host="evil.example")
        check(status == 403 and f"{own}.local" in told.decode(), f"other names are refused there, too: {status} {told}")
    with served(program, run) as url:
        check(get(f"{url}/api/run", Host=own)[0] == 403, "at the loopback address only its own names")
    try:
        named = socket.gethostbyname(own)
    except OSError:
        named = None
    if named:
        with served(program, run, "--address", own) as url:
            check(own in url and get(f"{url}/api/run")[0] == 200, f"the page opens by the address that is printed: {url}")
    other = subprocess.run([program, "view", str(run), "--address", "192.0.2.1"], capture_output=True, text=True, timeout=30)
    check(other.returncode == 2 and "--address" in other.stderr and "another program" not in other.stderr,
          f"not an address of this computer: {other.returncode} {other.stderr}")


def check_bad_input(program, folder):
    for arguments, code in ((["none"], 3), ([str(folder)], 3)):
        done = subprocess.run([program, "view", *arguments], capture_output=True, text=True, timeout=30)
        check(done.returncode in (code, 4) and "error" in done.stderr, f"{arguments}: {done.returncode} {done.stderr}")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("small_runs", type=Path)
    parser.add_argument("--screenshots", type=Path)
    parser.add_argument("--run", type=Path)
    a = parser.parse_args()
    if subprocess.run([a.program, "view", "--help"], capture_output=True).returncode != 0:
        print("skipped: built without the viewer")
        return 77
    drive, run = a.small_runs / "drive", a.small_runs / "drive_run"
    with tempfile.TemporaryDirectory() as folder:
        check_answers(a.program, run, drive)
        check_ports_and_ends(a.program, run)
        tested = with_innovations(run, Path(folder))
        check_innovations(a.program, tested)
        check_recordings_of_live_run(a.program, drive, Path(folder))
        check_images_before_they_are_listed(a.program, drive, Path(folder))
        check_run_by_rig(a.program, drive, run, Path(folder))
        check_single_images(a.program, drive, Path(folder))
        check_growing_store(a.program, run, Path(folder))
        check_bad_input(a.program, Path(folder))
        required = os.environ.get("SPARTAN_BROWSER_TESTS") == "1"
        if sync_playwright is None or CHROMIUM is None:
            check(not required, "Chromium or Playwright is not installed (./setup docs), but SPARTAN_BROWSER_TESTS=1")
            print("not tried: Chromium or Playwright is not installed (./setup docs)")
            return 0
        if AXE is None:
            check(not required, "axe-core is not installed (./setup docs), but SPARTAN_BROWSER_TESTS=1")
            print("not tried: accessibility, axe-core is not installed (./setup docs)")
        if a.screenshots:
            a.screenshots.mkdir(exist_ok=True)
        recording = a.run / "live/1" if a.run else drive
        check_in_browser(a.program, a.run or tested, recording, a.screenshots)
        frames = json.loads((run / "summary.json").read_text(encoding="utf-8"))["frames"]
        check_many_frames(a.program, repeated(run, Path(folder) / "many", 10_000 // frames + 1))
        check_live(a.program, drive, Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
