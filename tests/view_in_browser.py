"""Of view_test.py: the page of a view in Chromium."""
import os
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path

from colour_vision import closest
from view_requests import check, json_of, owned, served

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


class Browser:
    """Pages of a view in headless Chromium; what the console tells is collected."""

    def __init__(self, playwright, url=""):
        self.browser = playwright.chromium.launch(executable_path=CHROMIUM, args=SOFTWARE_WEBGL)
        self.url, self.told = url, []

    @contextmanager
    def page(self, width, scheme="light", images=True):
        height = 844 if width < 500 else 1000
        page = self.browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)
        page.on("console", lambda message: message.type == "error" and self.told.append(message.text))
        page.on("pageerror", lambda error: self.told.append(str(error)))
        page.on("response", lambda answer: answer.status >= 400 and self.told.append(f"{answer.status} {answer.url}"))
        page.on("request", lambda request: request.url.startswith((self.url, "data:", "blob:")) or self.told.append(f"asks {request.url}"))
        page.goto(self.url + "/")
        page.wait_for_function("() => window.spartan && spartan.state().total > 0")
        if images:
            page.wait_for_function("() => document.getElementById('image').naturalWidth > 0")
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
    check_keys(page, width)
    unnamed = page.evaluate("""() => [...document.querySelectorAll('button, input, select')].filter(e =>
      !(e.textContent.trim() || e.getAttribute('aria-label') || e.closest('label'))).length""")
    check(unnamed == 0, f"{width} px: {unnamed} controls without a name")


def check_keys(page, width):
    """Keys of the scene move, turn and zoom; the canvas in it is not another stop of the tabulator."""
    def view(key=None):
        if key:
            page.keyboard.press(key)
        state = page.evaluate("() => spartan.scene.state()")
        offset = [a - b for a, b in zip(state["camera"], state["target"])]
        return state["target"], offset, sum(v * v for v in offset) ** 0.5

    def near(a, b):
        return all(abs(x - y) < 1e-6 for x, y in zip(a, b))

    page.focus("#scene")
    target, offset, distance = view()
    moved = view("ArrowLeft")
    check(not near(moved[0], target) and near(moved[1], offset), f"{width} px: an arrow key moves")
    for key, axis in (("Shift+ArrowLeft", 0), ("Shift+ArrowUp", 2)):
        before, turned = view(), view(key)
        check(near(turned[0], before[0]) and abs(turned[2] - before[2]) < 1e-6, f"{width} px: {key} keeps target and distance")
        check(abs(turned[1][axis] - before[1][axis]) > 0.01 * distance, f"{width} px: {key} turns")
    for key, factor in (("+", 1 / 1.2), ("-", 1.2)):
        before, zoomed = view(), view(key)
        check(near(zoomed[0], before[0]) and abs(zoomed[2] / before[2] - factor) < 1e-6, f"{width} px: {key} zooms")
    page.focus("#time")
    before = view()
    check(near(view("ArrowRight")[0], before[0]), f"{width} px: arrow keys of the slider do not move the scene")
    focused = page.evaluate("() => [...document.querySelectorAll('#scene canvas')].filter(c => c.tabIndex >= 0).length")
    check(focused == 0 and "Shift" in page.get_attribute("#scene", "aria-label"), f"{width} px: focus and name of the scene")


def check_accessibility(page, name):
    if AXE is None:
        return
    page.evaluate(AXE.read_text(encoding="utf-8"))
    found = page.evaluate("() => axe.run(document, {resultTypes: ['violations']})")["violations"]
    serious = [f"{v['id']} ({v['nodes'][0]['html'][:80]})" for v in found if v["impact"] in ("serious", "critical")]
    check(not serious, f"{name}: axe-core finds {serious}")


def check_trajectory_colours(page, name):
    """Two of them on one terrain are told apart by colour alone: 10 is seen at a glance, of thin lines more is needed."""
    colours = page.evaluate("""() => Object.fromEntries([...document.querySelectorAll('#scene-legend .key')]
      .filter(key => key.querySelector('.swatch') && !key.textContent.startsWith('ellipses'))
      .map(key => [key.textContent, getComputedStyle(key.querySelector('.swatch')).backgroundColor]))""")
    check(set(colours) >= {"odometry", "slam", "localization"}, f"{name}: the legend names {list(colours)}")
    difference, one, other, vision = closest(colours)
    check(difference > 15, f"{name}: {one} and {other} differ by {difference:.0f} only ({vision})")


def check_state_heights(page):
    """States differ by the height of their bars, too."""
    heights = page.evaluate("""async () => {
      const frames = await (await fetch('/api/frames?from=0')).json(), states = ['tracking', 'degraded', 'lost', 'missing'];
      spartan.plots.setTime(0);
      spartan.plots.setFrames({...frames, status: frames.status.map((_, i) => states[Math.floor(4 * i / frames.total)])});
      const canvas = document.querySelector('.plot.strip canvas'), context = canvas.getContext('2d');
      return states.map((_, i) => {
        const x = Math.round((i + 0.5) / 4 * canvas.width), data = context.getImageData(x, 0, 1, canvas.height).data;
        return data.filter((v, k) => k % 4 === 3 && v > 200).length / canvas.height;
      });
    }""")
    check(all(a > b + 0.1 for a, b in zip(heights, heights[1:])), f"heights of the states: {heights}")


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


# The mean time of script for a step of the slider, of 20.
STEPS = """() => { const begin = performance.now(), n = spartan.state().total;
  for (let i = 0; i < 20; ++i) { const t = document.getElementById('time'); t.value = Math.floor(i * n / 20); t.dispatchEvent(new Event('input')); }
  return (performance.now() - begin) / 20; }"""

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
                    page.wait_for_function("() => spartan.scene.state().vertices > 0")
                    check_trajectory_colours(page, f"{width} px, {scheme}")
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
            show = page.evaluate(STEPS)
            clear = page.evaluate(CLEAR)
            check_state_heights(page)
            check_long_drive(page)
            state = page.evaluate("() => [spartan.state().total, spartan.scene.state().vertices]")
            print(f"{state[0]} frames, {state[1]} vertices: turning the scene {sum(times[-40:]) / 40:.1f} ms a frame (mean of the last "
                  f"40 of 80, of the first ten {sum(times[:10]) / 10:.1f}; {moving} of {every} triangles; clearing the "
                  f"canvas alone {clear:.1f} ms; without a graphics card), {show:.1f} ms of script for a step of the slider")


def check_many_frames(program, many):
    """A step of the slider asks for what belongs to its frame only, in a run without images."""
    with served(program, many) as url, sync_playwright() as playwright:
        browser = Browser(playwright, url)
        with browser.page(1600, images=False) as page:
            total = page.evaluate("() => spartan.state().total")
            page.wait_for_timeout(1500)  # of an ended run only whether it was resumed is asked
            asked = []
            page.on("request", lambda request: request.url.endswith("/api/run") or asked.append(request.url))
            step = page.evaluate(STEPS)
            page.focus("#time")
            for key in ("Home", "ArrowRight", "End", "ArrowLeft"):
                page.keyboard.press(key)
                page.wait_for_timeout(200)
            check(total >= 10_000 and page.evaluate("() => spartan.state().now") == total - 2, f"{total} frames, and steps to them")
            check(len(asked) <= 24 and all("/api/disparity" in url for url in asked), f"steps ask for {asked}")
        check(not browser.told, f"the console tells nothing: {browser.told}")
        print(f"{total} frames: {step:.1f} ms of script for a step of the slider")


@contextmanager
def follow(program, run, drive):
    """A view that waits for a run, and that run, which goes on until it is interrupted."""
    view = subprocess.Popen([program, "view", str(run), "--follow", "-q"], stdout=subprocess.PIPE, text=True)
    process = subprocess.Popen([program, "run", f"replay:{drive}", "-o", str(run), "--passes", "1000", "-q"], stdout=subprocess.DEVNULL)
    try:
        yield view.stdout.readline().strip().rstrip("/"), process
    finally:
        if process.poll() is None:
            process.send_signal(signal.SIGINT)
        check(process.wait(timeout=120) in (0, 6), "the run ends well beside its view")
        view.terminate()
        check(view.wait(timeout=20) == 0, "the view ends")


# The frame whose image was asked for, the width of the image that is shown, and the note below it.
IMAGE = """() => [spartan.state().imaged, document.getElementById('image').naturalWidth,
  document.getElementById('image-note').textContent]"""


def check_resumed(program, run, drive, page, ended):
    """The page of an ended run follows it when it is resumed."""
    process = subprocess.Popen([program, "run", f"replay:{drive}", "-o", str(run), "--passes", "1000", "-q", "--resume"],
                               stdout=subprocess.DEVNULL)
    try:
        page.wait_for_function(f"() => spartan.state().total > {ended} + 5 && spartan.state().imaged > {ended}", timeout=60000)
        check("goes on" in page.inner_text("#state"), "the page tells that the run goes on")
        check(page.evaluate(IMAGE)[1] > 0, f"its images are shown: {page.evaluate(IMAGE)}")
    finally:
        process.send_signal(signal.SIGINT)
        check(process.wait(timeout=120) in (0, 6), "the resumed run ends well")
    page.wait_for_function("() => !document.getElementById('state').textContent.includes('goes on')", timeout=20000)


def check_missing_image(program, run):
    """The last frame of a live run has no image: while the run goes on, that of the frame before is shown."""
    with served(program, run) as url:
        last = json_of(f"{url}/api/run")["frames"] - 1
        stamp = json_of(f"{url}/api/frames?from={last}")["stamp_ns"][0]
    for file in run.glob(f"live/*/images/*/{stamp}_*"):
        file.unlink()
    with served(program, run) as url, sync_playwright() as playwright:
        with owned(run), Browser(playwright, url).page(1600) as page:
            note = f"Image of frame {last}: later ones are not recorded yet. "
            page.wait_for_timeout(1000)
            check(page.inner_text("#image-note").startswith(note.strip()), page.inner_text("#image-note"))
        with Browser(playwright, url).page(1600) as page:
            page.focus("#time")
            page.keyboard.press("End")
            page.wait_for_timeout(1000)
            check("no image of this frame" in page.inner_text("#image-note"), page.inner_text("#image-note"))


def check_live(program, drive, folder):
    """A page that is open while a run begins, goes on and ends."""
    run = folder / "live_run"
    with sync_playwright() as playwright:
        browser = Browser(playwright)  # before the run begins
        with follow(program, run, drive) as (browser.url, process):
            with browser.page(1600) as page:
                seen, images = [], []
                until = time.monotonic() + 180
                while len(set(seen)) < 4 and time.monotonic() < until:
                    seen.append(page.evaluate("() => spartan.state().total"))
                    images.append(page.evaluate(IMAGE))
                    time.sleep(0.3)
                check(process.poll() is None and len(set(seen)) == 4, f"frames arrive while the run goes on: {seen}")
                check(all(width > 0 for _, width, _ in images), f"an image is shown while the run goes on: {images}")
                check(len({frame for frame, _, _ in images}) > 2, f"and it is the last one that is there: {images}")
                process.send_signal(signal.SIGINT)
                process.wait(timeout=120)
                page.wait_for_function("() => !document.getElementById('state').textContent.includes('goes on')", timeout=20000)
                seen.append(page.evaluate("() => spartan.state().total"))
                check("image to pose" in page.inner_text("#plots"), "latencies are plotted")
                latencies = json_of(f"{browser.url}/api/frames?from=0")["latency_ms"]
                check(len(latencies) == seen[-1] and all(0 < ms < 60000 for ms in latencies), f"latencies: {latencies}")
                check(seen == sorted(seen), f"no frame disappears: {seen}")
                total = len([line for line in (run / "trajectory_odometry.tum").read_text().splitlines() if line[0] != "#"])
                check(seen[-1] == total, f"{seen[-1]} frames at the end, of {total}")
                check_resumed(program, run, drive, page, seen[-1])
            check(not browser.told, f"the console tells nothing: {browser.told}")
    check_missing_image(program, run)
