"""What a full scene of the studio costs: 500 measured points with arrows, and 5000 candidates as a coloured cloud.

``python benchmarks/studio_frames.py [--seconds S] [--out FILE]`` serves a project, counts what a window is sent for the
arrows and the cloud (messages, bytes, nodes of the scene), and lets headless Chromium turn the camera round the arm,
without and with them, counting the pictures that it draws. WebGL is that of SwiftShader, on the processor: a graphics
card draws the same in a fraction of the time, so the ratio says more than the rate. What a card would not take over is
measured by itself: the processor time of the window's own thread for a picture, and what each picture asks the card to
draw (calls, triangles, points).
"""

from __future__ import annotations

import argparse
import json
import math
import os
import shutil
import tempfile
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
from playwright.sync_api import CDPSession, Page, sync_playwright
from studio_line import Line

import truearm
from truearm.studio.arrows import coloured, error_arrows
from truearm.studio.pages.jog import JogPage
from truearm.studio.serving import Studio, serve

_COUNT = """(seconds) => new Promise((done) => {
  const began = performance.now();
  let pictures = 0, before = began, longest = 0;
  const next = (now) => {
    pictures += 1;
    longest = Math.max(longest, now - before);
    before = now;
    if (now - began < 1000 * seconds) requestAnimationFrame(next);
    else done([1000 * (pictures - 1) / (now - began), longest]);
  };
  requestAnimationFrame(next);
})"""

#: Counts what the window asks to be drawn, in both versions of WebGL.
_DRAWN = """(() => {
  window.drawn = {calls: 0, triangles: 0, points: 0};
  const count = (mode, n, instances) => {
    window.drawn.calls += 1;
    if (mode === 0) window.drawn.points += n * instances;
    if (mode === 4) window.drawn.triangles += n / 3 * instances;
  };
  for (const kind of [window.WebGLRenderingContext, window.WebGL2RenderingContext]) {
    if (!kind) continue;
    for (const [name, size, instances] of [["drawArrays", 2, -1], ["drawElements", 1, -1],
                                           ["drawArraysInstanced", 2, 3], ["drawElementsInstanced", 1, 4]]) {
      const original = kind.prototype[name];
      if (!original) continue;
      kind.prototype[name] = function (...given) {
        count(given[0], given[size], instances < 0 ? 1 : given[instances]);
        return original.apply(this, given);
      };
    }
  }
})()"""


def turned(studio: Studio, over: threading.Event) -> None:
    """Turn every window's camera round the arm until it is over."""
    angle = 0.0
    while not over.wait(1 / 60):
        angle += 0.02
        for client in studio.window.server.get_clients().values():
            with client.atomic():
                client.camera.position = (1.6 * math.cos(angle), 1.6 * math.sin(angle), 0.9)
                client.camera.look_at = (0.1, 0.0, 0.3)


def frames(studio: Studio, page: Page, seconds: float) -> dict[str, float]:
    over = threading.Event()
    turning = threading.Thread(target=turned, args=(studio, over))
    turning.start()
    page.wait_for_timeout(1000)
    session = page.context.new_cdp_session(page)
    session.send("Performance.enable", {"timeDomain": "threadTicks"})
    before, drawn = busy(session), page.evaluate("({...window.drawn})")
    rate, longest = page.evaluate(_COUNT, seconds)
    after, pictures = busy(session), rate * seconds
    asked = {name: round((n - drawn[name]) / pictures) for name, n in page.evaluate("window.drawn").items()}
    over.set()
    turning.join()
    session.detach()
    return {
        "pictures_per_s": round(rate, 1),
        "longest_ms": round(longest, 1),
        "own_thread_ms_per_picture": round(1e3 * (after - before) / pictures, 2),
        **{f"{name}_per_picture": n for name, n in asked.items()},
    }


def busy(session: CDPSession) -> float:
    """Return how long the window's own thread has worked so far [s of processor time]."""
    metrics = session.send("Performance.getMetrics")["metrics"]
    return float(next(m["value"] for m in metrics if m["name"] == "TaskDuration"))


def measure(seconds: float) -> dict[str, Any]:
    rng = np.random.default_rng(0)
    cloud = rng.normal(scale=0.3, size=(5000, 3)) + np.array([0.2, 0.0, 0.4])
    arrows = error_arrows(cloud[:500], 1e-4 * rng.normal(size=(500, 3)), 500.0)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as driver:
        studio = serve(Path(folder) / "project", port=0)
        scene = next(page for page in studio.window.pages if isinstance(page, JogPage)).scene
        place = os.environ.get("CHROME") or shutil.which("chromium")
        words = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
        browser = driver.chromium.launch(executable_path=place, args=words)
        try:
            page = browser.new_page(viewport={"width": 1366, "height": 768})
            page.add_init_script(_DRAWN)
            page.goto(studio.access.entrance)
            page.get_by_role("tab", name="Cell").wait_for()
            frames(studio, page, seconds)  # until everything is compiled
            empty = frames(studio, page, seconds)
            line = Line(studio.access.address)
            line.quiet(1.0)
            before, nodes = (line.bytes, line.messages), len(studio.window.server.scene._handle_from_node_name)
            began = time.perf_counter()
            scene.show_points("candidates", cloud, coloured(cloud[:, 2], 0.0, 1.0))
            scene.show_arrows("errors", arrows)
            line.read(5.0)
            came = time.perf_counter() - began
            line.quiet()
            sent = {
                "bytes": line.bytes - before[0],
                "messages": line.messages - before[1],
                "nodes": len(studio.window.server.scene._handle_from_node_name) - nodes,
                "first_after_ms": round(1e3 * came, 1),
            }
            line.close()
            full = frames(studio, page, seconds)
        finally:
            browser.close()
            studio.stop()
    return {"sent": sent, "arm_alone": empty, "with_cloud_and_arrows": full}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=8.0)
    parser.add_argument("--out", type=Path)
    given = parser.parse_args()
    found = {"truearm": truearm.__version__, "drawn_by": "SwiftShader", **measure(given.seconds)}
    print(json.dumps(found, indent=1))  # noqa: T201
    if given.out:
        given.out.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
