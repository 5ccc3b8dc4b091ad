#!/usr/bin/env python3
"""`spartan view`: what it serves, and, where Chromium and Playwright are installed, the page in a browser.

    view_test.py PROGRAM SMALL_RUNS [--screenshots FOLDER] [--run RUN]

SMALL_RUNS: the folder that make_small_runs has filled. RUN: another run for the screenshots and the times of frames.
Exit code 77 (skipped): the program was built without the viewer.
"""
import argparse
import json
import os
import shutil
import sqlite3
import struct
import subprocess
import sys
import tempfile
import time
import urllib.error
import urllib.request
from contextlib import contextmanager
from pathlib import Path

VENV_PYTHON = Path(__file__).resolve().parent.parent / ".venv/bin/python3"  # made by ./setup
try:
    from playwright.sync_api import sync_playwright
except ImportError:
    if VENV_PYTHON.exists() and Path(sys.prefix) != VENV_PYTHON.parent.parent:
        os.execv(VENV_PYTHON, [str(VENV_PYTHON), *sys.argv])
    sync_playwright = None

AXE = next(VENV_PYTHON.parent.parent.glob("lib/*/site-packages/axe_playwright_python/axe.min.js"), None)
CHROMIUM = shutil.which("chromium")
SOFTWARE_WEBGL = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--ignore-gpu-blocklist",
                  "--enable-unsafe-swiftshader"]


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


def check_answers(program, run, recording):
    """Each answer against the files of the run."""
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
        check(get(url.replace("0.0.0.0", "127.0.0.1") + "/api/run", Host="evil.example")[0] == 403, "names are refused there, too")


def check_bad_input(program, folder):
    for arguments, code in ((["none"], 3), ([str(folder)], 3)):
        done = subprocess.run([program, "view", *arguments], capture_output=True, text=True, timeout=30)
        check(done.returncode in (code, 4) and "error" in done.stderr, f"{arguments}: {done.returncode} {done.stderr}")


class Browser:
    """Pages of a view in headless Chromium; what the console tells is collected."""

    def __init__(self, playwright, url):
        self.browser = playwright.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE_WEBGL)
        self.url, self.told = url, []

    @contextmanager
    def page(self, width, scheme="light"):
        height = 844 if width < 500 else 1000
        page = self.browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)
        page.on("console", lambda message: message.type == "error" and self.told.append(message.text))
        page.on("pageerror", lambda error: self.told.append(str(error)))
        page.on("response", lambda answer: answer.status >= 400 and self.told.append(f"{answer.status} {answer.url}"))
        page.on("request", lambda request: request.url.startswith((self.url, "data:", "blob:")) or self.told.append(f"asks {request.url}"))
        page.goto(self.url + "/")
        page.wait_for_function("() => window.spartan && spartan.state().total > 0 && document.getElementById('image').naturalWidth > 0")
        yield page
        page.close()


def pixels_of(page, selector):
    """Number of different colours on a canvas, on a grid of points."""
    return page.evaluate("""selector => {
      const canvas = document.querySelector(selector), copy = document.createElement('canvas');
      copy.width = canvas.width; copy.height = canvas.height;
      const context = copy.getContext('2d');
      context.drawImage(canvas, 0, 0);
      const data = context.getImageData(0, 0, copy.width, copy.height).data, seen = new Set();
      for (let i = 0; i < data.length; i += 4 * 97) seen.add(data[i] << 16 | data[i + 1] << 8 | data[i + 2]);
      return seen.size;
    }""", selector)


def check_page(page, width):
    """A list of what is asserted is in docs/benchmarks/python.md."""
    total = page.evaluate("() => spartan.state().total")
    page.wait_for_function("() => spartan.scene.state().vertices > 0")
    colours = 0
    for _ in range(300):  # it is drawn in the browser's next frame
        colours = pixels_of(page, "#scene canvas")
        if colours > 50:
            break
        page.wait_for_timeout(100)
    check(colours > 50, f"{width} px: the scene is blank, {colours} colours")
    check(page.evaluate("() => document.documentElement.scrollWidth <= window.innerWidth"), f"{width} px: nothing is wider")
    check(page.evaluate("() => spartan.plots.count()") > 5, f"{width} px: plots")
    blank = page.evaluate("""() => [...document.querySelectorAll('.plot')].filter(plot => {
      const c = plot.querySelector('canvas'), data = c.getContext('2d').getImageData(0, 0, c.width, c.height).data;
      for (let i = 0; i < data.length; i += 4) {  // frame and time are gray, series and states are not
        if (data[i + 3] > 200 && Math.max(data[i], data[i + 1], data[i + 2]) - Math.min(data[i], data[i + 1], data[i + 2]) > 60) return false;
      }
      return true;
    }).map(plot => plot.querySelector('b').textContent)""")
    missing = [name for name, states in page.evaluate("() => fetch('/api/frames?from=0').then(a => a.json())")["sensors"].items()
               if set(states) <= {"missing", None}]
    check(set(blank) <= set(missing), f"{width} px: the plots {blank} are blank, and only the sensors {missing} are missing")
    check("Innovation: " in page.inner_text("#plots"), f"{width} px: innovations are plotted")

    before = page.evaluate("() => spartan.scene.state().rover")
    page.focus("#time")
    page.keyboard.press("End")
    check(page.evaluate("() => spartan.state().now") == total - 1, f"{width} px: the slider moves by keyboard")
    check(page.evaluate("() => spartan.scene.state().rover") != before, f"{width} px: and the rover with it")
    check(f"{total} of {total}" in page.inner_text("#frame"), f"{width} px: the frame is named")
    page.wait_for_function("() => document.getElementById('image-note').textContent.includes('inliers')")
    check(pixels_of(page, "#landmarks") > 1, f"{width} px: landmarks are drawn")
    page.keyboard.press("Home")
    drawn = page.evaluate("() => spartan.scene.state().drawn")
    for layer in ("elevation_m", "class", "cost", "sigma_m", "colour"):
        page.select_option("#colour-by", layer)
    page.wait_for_function(f"() => spartan.scene.state().drawn > {drawn}")
    for button in ("#from-above", "#follow-rover", "#follow-rover", "#play"):
        page.click(button)
    page.wait_for_function("() => spartan.state().now > 1")
    page.click("#play")
    page.focus("#scene")
    page.keyboard.press("ArrowLeft")
    unnamed = page.evaluate("""() => [...document.querySelectorAll('button, input, select')].filter(e =>
      !(e.textContent.trim() || e.getAttribute('aria-label') || e.closest('label'))).length""")
    check(unnamed == 0, f"{width} px: {unnamed} controls without a name")


def check_accessibility(page, name):
    if AXE is None:
        return
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")["violations"]
    serious = [f"{v['id']} ({v['nodes'][0]['html'][:80]})" for v in found if v["impact"] in ("serious", "critical")]
    check(not serious, f"{name}: axe-core finds {serious}")


def take_screenshot(page, path, width):
    page.evaluate("() => { const t = document.getElementById('time'); t.value = Math.floor(0.6 * t.max); t.dispatchEvent(new Event('input')); }")
    page.evaluate("() => { document.querySelector('footer').style.position = 'static'; }")  # at the end of the whole page
    page.wait_for_timeout(2000)
    page.screenshot(path=path, full_page=True)


def check_long_drive(page):
    """Trajectories of kilometres are in view, too."""
    page.evaluate("""async () => {
      const frames = await (await fetch('/api/frames?from=0')).json();
      for (const kind of ['pose', 'odometry', 'slam', 'localization', 'smoothed'])
        frames[kind] = frames[kind].map(p => p && p.map((v, i) => i < 3 ? 2e4 * v : v));
      spartan.scene.setFrames(frames);
      spartan.scene.fromAbove(); }""")
    page.wait_for_timeout(1000)
    colours = pixels_of(page, "#scene canvas")
    check(colours > 2, f"a drive of 10 km is drawn: {colours} colours")


# The time of a frame in which nothing is drawn: that of the browser.
CLEAR = """async () => { const canvas = document.querySelector('canvas'), gl = canvas.getContext('webgl2') || canvas.getContext('webgl');
  const times = []; let last = performance.now();
  for (let i = 0; i < 60; ++i) {
    await new Promise(done => requestAnimationFrame(done));
    gl.clearColor(i / 60, 0, 0, 1); gl.clear(gl.COLOR_BUFFER_BIT); gl.finish();
    times.push(performance.now() - last); last = performance.now(); }
  return times.slice(-40).reduce((a, b) => a + b) / 40; }"""


def check_in_browser(program, run, recording, screenshots):
    with served(program, run, "--recording", recording) as url, sync_playwright() as playwright:
        browser = Browser(playwright, url)
        for width in (1600, 390):
            for scheme in ("light", "dark"):
                with browser.page(width, scheme) as page:
                    check_accessibility(page, f"{width} px, {scheme}")
                    if scheme == "light":
                        check_page(page, width)
                if screenshots:
                    with browser.page(width, scheme) as page:
                        take_screenshot(page, screenshots / f"view_{width}_{scheme}.png", width)
        check(not browser.told, f"the console tells nothing: {browser.told}")
        with browser.page(1600) as page:
            triangles = "() => spartan.scene.state().triangles"
            every = page.evaluate(triangles)
            times = page.evaluate("() => spartan.scene.measure(80)")
            moving = page.evaluate(triangles)
            page.wait_for_timeout(1500)
            check(moving <= every and page.evaluate(triangles) == every, f"at rest the terrain has its {every} triangles again")
            show = page.evaluate("""() => { const begin = performance.now(), n = spartan.state().total;
              for (let i = 0; i < 20; ++i) { const t = document.getElementById('time'); t.value = Math.floor(i * n / 20); t.dispatchEvent(new Event('input')); }
              return (performance.now() - begin) / 20; }""")
            clear = page.evaluate(CLEAR)
            check_long_drive(page)
            state = page.evaluate("() => [spartan.state().total, spartan.scene.state().vertices]")
            print(f"{state[0]} frames, {state[1]} vertices: turning the scene {sum(times[-40:]) / 40:.1f} ms a frame (mean of the last "
                  f"40 of 80, of the first ten {sum(times[:10]) / 10:.1f}; {moving} of {every} triangles; clearing the "
                  f"canvas alone {clear:.1f} ms; without a graphics card), {show:.1f} ms of script for a step of the slider")


def check_live(program, drive, folder):
    """A page that is open while a run begins, goes on and ends."""
    run = folder / "live_run"
    with follow(program, run, drive) as (url, process):
        with sync_playwright() as playwright:
            browser = Browser(playwright, url)
            with browser.page(1600) as page:
                seen = [page.evaluate("() => spartan.state().total")]
                while process.poll() is None:
                    seen.append(page.evaluate("() => spartan.state().total"))
                    time.sleep(0.3)
                page.wait_for_function("() => !document.getElementById('state').textContent.includes('goes on')", timeout=20000)
                seen.append(page.evaluate("() => spartan.state().total"))
                check("image to pose" in page.inner_text("#plots"), "latencies are plotted")
            latencies = json_of(f"{url}/api/frames?from=0")["latency_ms"]
            check(len(latencies) == seen[-1] and all(0 < ms < 60000 for ms in latencies), f"latencies: {latencies}")
            check(len(set(seen)) > 2 and seen == sorted(seen), f"frames arrive while the run goes on: {seen}")
            total = len([line for line in (run / "trajectory_odometry.tum").read_text().splitlines() if line[0] != "#"])
            check(seen[-1] == total, f"{seen[-1]} frames at the end, of {total}")
            check(not browser.told, f"the console tells nothing: {browser.told}")


@contextmanager
def follow(program, run, drive):
    """A view that waits for a run, and that run."""
    view = subprocess.Popen([program, "view", str(run), "--follow", "-q"], stdout=subprocess.PIPE, text=True)
    process = subprocess.Popen([program, "run", f"replay:{drive}", "-o", str(run), "--speed", "0.5", "-q"], stdout=subprocess.DEVNULL)
    try:
        yield view.stdout.readline().strip().rstrip("/"), process
    finally:
        check(process.wait(timeout=120) in (0, 6), "the run ends well beside its view")
        view.terminate()
        check(view.wait(timeout=20) == 0, "the view ends")


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
        check_bad_input(a.program, Path(folder))
        if sync_playwright is None or CHROMIUM is None:
            print("not tried: Chromium or Playwright is not installed (./setup docs)")
            return 0
        if AXE is None:
            print("not tried: accessibility, axe-core is not installed (./setup docs)")
        if a.screenshots:
            a.screenshots.mkdir(exist_ok=True)
        recording = a.run / "live/1" if a.run else drive
        check_in_browser(a.program, a.run or tested, recording, a.screenshots)
        check_live(a.program, drive, Path(folder))
    return 0


if __name__ == "__main__":
    sys.exit(main())
