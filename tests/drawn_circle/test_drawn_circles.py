"""Circles on pages, drawn here dot by dot, to distances and heights; what cannot be used is refused."""

from __future__ import annotations

import math
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy.ndimage import gaussian_filter
from tests.expecting import known, refused

from truearm.drawn_circle.pages import Page, read_drawn_circles
from truearm.drawn_circle.scan import ScannedCircle, drawn_circle, read_circle, read_page
from truearm.engine.data.readers.canonical import csv_text, read_csv
from truearm.engine.robot.chain import Array

WIDTH, HEIGHT = 0.056, 0.052
CENTRE = np.array([0.0271, 0.0262])
RADIUS = 0.02
INCH = 0.0254


def profile(angle: Array) -> Array:
    return np.asarray(RADIUS + 3e-4 * np.cos(3 * angle))


def even(angle: Array) -> Array:
    return np.full_like(angle, RADIUS)


def dots(dpi: tuple[float, float]) -> tuple[Array, Array]:
    """Return x and y of the middle of all dots [m], from the page's lower left corner, the uppermost row first."""
    rows, columns = round(HEIGHT / INCH * dpi[1]), round(WIDTH / INCH * dpi[0])
    x, y = (np.arange(columns) + 0.5) * INCH / dpi[0], (rows - np.arange(rows) - 0.5) * INCH / dpi[1]
    across, up = np.meshgrid(x, y)
    return np.asarray(across), np.asarray(up)


def covered(inside: Callable[[Array, Array], NDArray[np.bool_]], x: Array, y: Array, dpi: tuple[float, float]) -> Array:
    """Return the share of each dot that is inside, by 4 by 4 points."""
    parts = (np.arange(4) - 1.5) / 4
    points = [inside(x + a * INCH / dpi[0], y + b * INCH / dpi[1]) for a in parts for b in parts]
    return np.asarray(np.mean(points, axis=0), dtype=np.float64)


def line(
    dpi: tuple[float, float] = (300, 300),
    shape: Callable[[Array], Array] = profile,
    width: float = 0.5e-3,
    centre: Array = CENTRE,
    gaps: tuple[tuple[float, float], ...] = (),
) -> Array:
    """Return how much of each dot a line covers."""
    x, y = dots(dpi)

    def from_line(x: Array, y: Array) -> tuple[Array, Array]:
        angle = np.arctan2(y - centre[1], x - centre[0]) % (2 * math.pi)
        return np.abs(np.hypot(x - centre[0], y - centre[1]) - shape(angle)), angle

    def inside(x: Array, y: Array) -> NDArray[np.bool_]:
        off, angle = from_line(x, y)
        away = [(angle < start) | (angle > end) for start, end in gaps]
        return np.asarray(np.all([off < width / 2, *away], axis=0))

    near = from_line(x, y)[0] < width / 2 + 2 * INCH / min(dpi)
    share = np.zeros(x.shape)
    share[near] = covered(inside, x[near], y[near], dpi)
    return share


def grid(turn: float) -> Array:
    """Return how much of each dot lines of 0.2 mm cover, 5 mm apart, turned as a page on the scanner is."""
    cos, sin = math.cos(turn), math.sin(turn)

    def inside(x: Array, y: Array) -> NDArray[np.bool_]:
        return np.asarray(((cos * x + sin * y) % 5e-3 < 2e-4) | ((cos * y - sin * x) % 5e-3 < 2e-4))

    return covered(inside, *dots((300, 300)), (300, 300))


def scanned(ink: Array, noise: float = 3.0, seed: int = 0, specks: int = 0) -> NDArray[np.uint8]:
    """Return what a scanner sees: paper that is brighter on one side, ink, dust, noise."""
    rng = np.random.default_rng(seed)
    paper = np.linspace(225, 248, ink.shape[1])
    bright = paper * (1 - ink)
    for row, column in zip(
        rng.integers(ink.shape[0], size=specks), rng.integers(ink.shape[1], size=specks), strict=True
    ):
        size = int(rng.integers(1, 5))
        bright[row : row + size, column : column + size] *= rng.uniform(0.2, 0.8)
    return np.asarray(np.clip(np.round(bright + noise * rng.standard_normal(ink.shape)), 0, 255), dtype=np.uint8)


@cache
def usual() -> NDArray[np.uint8]:
    """Return a page with nothing but a circle."""
    return scanned(0.7 * line())


def saved(path: Path, brightness: NDArray[Any], dpi: tuple[float, float] | None = (300, 300)) -> Path:
    options: dict[str, Any] = {} if dpi is None else {"dpi": dpi}
    Image.fromarray(brightness).save(path, **options)
    return path


Read = Callable[..., ScannedCircle]


@pytest.fixture
def read(tmp_path: Path) -> Read:
    """What is read of a page on which ink covers so much of each dot, or of which the brightness is given."""

    def call(ink: NDArray[Any], **options: Any) -> ScannedCircle:
        page = ink if ink.dtype == np.uint8 else scanned(ink)
        return read_circle(saved(tmp_path / "page.png", page), **options)

    return call


def errors(scan: ScannedCircle, shape: Callable[[Array], Array] = profile, centre: Array = CENTRE) -> Array:
    """Return how far outside the true line each point that was read lies [m]."""
    seen = ~scan.missing
    x = scan.centre[0] + scan.profile[seen] * np.cos(scan.angle[seen]) - centre[0]
    y = scan.centre[1] + scan.profile[seen] * np.sin(scan.angle[seen]) - centre[1]
    return np.asarray(np.hypot(x, y) - shape(np.arctan2(y, x)))


def rms(values: Array) -> float:
    return math.sqrt(float(np.mean(values**2)))


# -- accuracy ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "dpi", "dark", "width", "specks"),
    [
        ("plain.png", (300, 300), 0.7, 0.5e-3, 0),
        ("pencil.png", (300, 300), 0.35, 0.3e-3, 0),
        ("marker.png", (300, 300), 0.7, 2e-3, 0),
        ("plain.jpg", (300, 300), 0.7, 0.5e-3, 0),
        ("plain.tif", (300, 300), 0.7, 0.5e-3, 0),
        ("low.png", (150, 150), 0.7, 0.5e-3, 0),
        ("stretched.png", (300, 600), 0.7, 0.5e-3, 0),
        ("specks.png", (300, 300), 0.7, 0.5e-3, 150),
    ],
)
def test_the_drawn_profile_is_read_to_a_tenth_of_a_dot(
    name: str, dpi: tuple[float, float], dark: float, width: float, specks: int, tmp_path: Path
) -> None:
    scan = read_circle(saved(tmp_path / name, scanned(dark * line(dpi, width=width), specks=specks), dpi))
    assert scan.missing.sum() <= specks / 30
    np.testing.assert_allclose(scan.centre, CENTRE, atol=5e-6)
    assert scan.radius == pytest.approx(RADIUS, abs=3e-6)
    dot = INCH / dpi[0]
    assert np.quantile(np.abs(errors(scan)), 0.95) < 0.12 * dot
    assert rms(errors(scan)) < (0.2 if specks else 0.06) * dot  # a speck on the line's edge moves it
    if not specks:
        assert scan.roundness == pytest.approx(0.6e-3, abs=30e-6)


def test_what_else_is_on_the_page_costs_little(read: Read) -> None:
    scan = read(np.maximum(0.7 * line(), 0.18 * grid(0.02)))  # a faint printed grid
    assert not scan.missing.any()
    assert rms(errors(scan)) < 10e-6
    # graphite lies on the paper's grain, here of 0.1 mm: a third of the ink's darkness, up and down
    grain = gaussian_filter(np.random.default_rng(3).standard_normal(line().shape), 0.6)
    scan = read(line() * (0.5 + 0.16 * grain / grain.std()).clip(0, 1))
    assert rms(errors(scan)) < 25e-6
    np.testing.assert_allclose(scan.centre, CENTRE, atol=5e-6)
    # a fainter printed circle to follow does not count
    scan = read(np.maximum(0.7 * line(), 0.15 * line(shape=even, centre=CENTRE + np.array([2e-4, 0]))))
    assert rms(errors(scan)) < 20e-6
    # straight lines across and writing inside are left aside
    image = Image.fromarray(usual())
    pen = ImageDraw.Draw(image)
    x, y = CENTRE[0] / INCH * 300, image.height - CENTRE[1] / INCH * 300
    pen.line([(x, 0), (x, image.height)], fill=60, width=4)
    pen.line([(0, y), (image.width, y)], fill=60, width=4)
    for row in range(4):
        pen.text((x - 100, y - 90 + 40 * row), "page 3, katana, 2.5 deg/s", fill=20)
    scan = read(np.asarray(image))
    assert scan.missing.sum() < 12
    assert rms(errors(scan)) < 10e-6


def test_gaps_are_missing_and_the_rest_stays_right(read: Read) -> None:
    gaps = ((0.5, 1.2), (4.0, 4.3))
    scan = read(0.7 * line(gaps=gaps))
    sure = math.radians(1.5)
    for start, end in gaps:
        assert scan.missing[(scan.angle > start + sure) & (scan.angle < end - sure)].all()
    outside = np.all([(scan.angle < start - sure) | (scan.angle > end + sure) for start, end in gaps], axis=0)
    assert not scan.missing[outside].any()
    assert rms(errors(scan)) < 10e-6


def test_angles_are_counted_from_the_pages_x_axis(read: Read) -> None:
    turn = math.radians(2.0)  # a page that lies turned shows the same circle turned
    scan = read(0.7 * line(shape=lambda angle: profile(angle - turn)))
    np.testing.assert_allclose(np.interp(turn, scan.angle, scan.profile), RADIUS + 3e-4, atol=20e-6)
    assert rms(scan.profile - profile(scan.angle - turn)) < 10e-6
    scan = read(usual(), sectors=90)
    np.testing.assert_allclose(scan.angle, np.radians(4.0 * np.arange(90)))
    np.testing.assert_allclose(scan.profile, profile(scan.angle), atol=15e-6)


# -- pages and their resolution ----------------------------------------------------------------------------


def test_a_given_resolution_beats_the_files(tmp_path: Path) -> None:
    path = saved(tmp_path / "page.png", usual(), (600, 600))
    assert read_circle(path).radius == pytest.approx(RADIUS / 2, rel=1e-3)
    assert read_circle(path, dpi=300).radius == pytest.approx(RADIUS, rel=1e-3)
    assert read_page(path, (300, 600)).size == pytest.approx((WIDTH, HEIGHT / 2), rel=1e-2)


def test_every_kind_of_scan_has_its_brightness(tmp_path: Path) -> None:
    grey, path = Image.fromarray(scanned(0.7 * line(), noise=0.0)), tmp_path / "page.tif"
    nothing = [Image.new("L", grey.size) for _ in range(3)]
    for image in (
        grey.point(lambda v: 255 * (v > 128)).convert("1"),
        *(grey.convert(mode) for mode in ("L", "RGB", "P", "CMYK")),
        Image.fromarray(np.asarray(grey).astype(np.uint16) * 257),
        Image.merge("RGBA", [*nothing, grey.point(lambda v: 255 - v)]),  # ink that covers by its opacity, on nothing
    ):
        image.save(path, dpi=(300, 300))
        if image.mode != "1":
            np.testing.assert_allclose(read_page(path).brightness, np.asarray(grey), atol=2, err_msg=image.mode)
        assert rms(errors(read_circle(path))) < 20e-6, image.mode


def test_a_page_is_turned_upright_as_its_file_says(tmp_path: Path) -> None:
    stored = np.rot90(scanned(0.7 * line((300, 600))))
    exif = Image.Exif()
    exif[0x0112] = 6  # the stored left edge is the page's top
    path = tmp_path / "page.jpg"
    Image.fromarray(stored).save(path, dpi=(600, 300), exif=exif, quality=95)
    scan = read_circle(path)
    np.testing.assert_allclose(scan.centre, CENTRE, atol=5e-6)


def told_of(path: Path, **options: Any) -> str:
    return refused(None, "", read_circle, path, **options)


def test_without_a_resolution_nothing_is_guessed(tmp_path: Path) -> None:
    path = saved(tmp_path / "page.png", usual(), None)
    assert "does not say its resolution" in told_of(path)
    assert read_circle(path, dpi=300).radius == pytest.approx(RADIUS, abs=3e-6)
    for dpi in (0.0, -300.0, 72.0, math.nan, math.inf, (300.0, 9600.0)):
        assert "dpi: this is no resolution of a scan" in told_of(path, dpi=dpi), dpi
    path = saved(tmp_path / "page.jpg", usual(), (72, 72))  # a photograph
    assert "page.jpg: this is no resolution of a scan; got '72 dpi x 72 dpi'" in told_of(path)


def test_files_that_are_no_image_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "page.png"
    path.write_text("configuration,joint_1 [deg]\n1,0.0\n")
    none = "no image that can be read, or it is damaged"
    assert f"{none}; allowed: PNG, JPEG, TIFF" in told_of(path)
    path.write_bytes(b"")
    assert none in told_of(path)
    assert "no such file" in told_of(tmp_path / "pag.png")
    assert "this is a folder" in told_of(tmp_path)
    for ending in ("png", "jpg", "tif"):
        path = saved(tmp_path / f"page.{ending}", usual())
        content = path.read_bytes()
        for length in (20, 200, len(content) // 2):
            path.write_bytes(content[:length])
            assert none in told_of(path), (ending, length)


def test_images_of_other_kinds_and_sizes_are_refused(tmp_path: Path) -> None:
    page, tif = Image.fromarray(usual()), tmp_path / "page.tif"
    page.save(tmp_path / "page.gif")
    assert "no image that can be read" in told_of(tmp_path / "page.gif")
    assert "no brightness that can be read; got 'mode F'" in told_of(saved(tif, usual().astype(np.float32)))
    page.save(tif, save_all=True, append_images=[page], dpi=(300, 300))
    assert "several pages; got 2" in told_of(tif)
    Image.new("1", (10000, 10000), 1).save(tmp_path / "large.png", dpi=(600, 600))
    assert "too many dots" in told_of(tmp_path / "large.png")
    Image.new("L", (150, 400), 255).save(tmp_path / "small.png", dpi=(300, 300))
    assert "the page is too small; got '12.7 mm x 33.9 mm'" in told_of(tmp_path / "small.png")
    for sectors in (0, 89, 3601):
        assert "the number of sectors is out of range" in told_of(tmp_path / "page.png", sectors=sectors)


# -- pages without one whole circle ------------------------------------------------------------------------


def page_with(draw: Callable[[ImageDraw.ImageDraw], object]) -> NDArray[np.uint8]:
    image = Image.fromarray(scanned(0 * line()))
    draw(ImageDraw.Draw(image))
    return np.asarray(image)


def two_lines(smaller: float, aside: float) -> NDArray[np.uint8]:
    other = line(shape=lambda angle: even(angle) - smaller, centre=CENTRE + np.array([aside, 0]))
    return scanned(0.7 * np.maximum(line(shape=even), other))


NO_CIRCLE: dict[str, Callable[[], NDArray[np.uint8]]] = {
    "a square": lambda: page_with(lambda pen: pen.rectangle((150, 150, 450, 450), outline=60, width=6)),
    "a line": lambda: page_with(lambda pen: pen.line((50, 80, 600, 500), fill=60, width=6)),
    "an ellipse": lambda: page_with(lambda pen: pen.ellipse((100, 200, 560, 400), outline=60, width=6)),
    "a disc": lambda: page_with(lambda pen: pen.ellipse((100, 100, 500, 500), fill=60)),
    "writing": lambda: page_with(lambda pen: pen.multiline_text((20, 30), "quick 0OQ8\n" * 6, 20, font_size=90)),
    "less than half a circle": lambda: scanned(0.7 * line(gaps=((1.0, 4.5),))),
}


def test_pages_without_one_whole_circle_are_refused(tmp_path: Path) -> None:
    def refusal_of(page: NDArray[np.uint8]) -> str:
        return told_of(saved(tmp_path / "page.png", page))

    for noise in (0.0, 3.0):
        empty = scanned(0 * line(), noise=noise, specks=100)
        assert "page.png: nothing is drawn on the page but specks or letters" in refusal_of(empty)
    assert "the page is dark" in refusal_of(255 - usual())
    for case, draw in NO_CIRCLE.items():
        words = "there is no circle on the page; allowed: a line over at least half a turn"
        assert words in refusal_of(draw()), case
    for centre in ((0.018, 0.026), (0.04, 0.026), (0.027, 0.015), (0.0201, 0.026)):
        cut = scanned(0.7 * line(shape=even, centre=np.array(centre)))
        assert "the circle is cut by the edge of the page; got 'radius 20.0 mm about x" in refusal_of(cut), centre
    for smaller, aside in ((8e-3, 0.0), (0.0, 6e-3)):
        assert "several circles are drawn on the page; got 'radius" in refusal_of(two_lines(smaller, aside))
    for smaller, aside in ((1e-3, 0.0), (0.0, 1e-3)):  # drawn twice
        assert "another line, or writing, runs along the circle" in refusal_of(two_lines(smaller, aside))


def test_the_image_libraries_are_loaded_when_a_page_is_read() -> None:
    script = (
        "import sys, truearm.drawn_circle.scan\n"
        "print([m for m in ('PIL', 'skimage', 'scipy.ndimage') if m in sys.modules])"
    )
    run = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert run.stdout.strip() == "[]"


# -- configurations ----------------------------------------------------------------------------------------


def a_scan(missing: tuple[int, ...] = ()) -> ScannedCircle:
    angle = np.radians(np.arange(360.0))
    values = profile(angle)
    values[list(missing)] = np.nan
    return ScannedCircle(source="page.png", centre=CENTRE, radius=RADIUS, angle=angle, profile=values)


def test_configurations_get_radius_height_and_distance() -> None:
    angle = np.radians([0.0, 30.0, 90.5, -60.0, 359.5, 360.0])
    height = np.array([0.0, 1e-3, -5e-4, 2e-3, 0.0, 0.0])
    joints = np.arange(30.0).reshape(6, 5)
    shape = drawn_circle(a_scan(), angle, joints, height)
    np.testing.assert_allclose(shape.radius, profile(angle), atol=2e-7)
    np.testing.assert_array_equal(shape.height, height)
    np.testing.assert_array_equal(shape.joints, joints)
    np.testing.assert_allclose(shape.distance**2, shape.radius**2 + height**2)
    assert shape.distance[1] > shape.radius[1]


def test_a_configuration_beside_a_gap_has_no_radius() -> None:
    angle = np.radians([9.0, 9.5, 10.0, 10.5, 11.0])
    shape = drawn_circle(a_scan(missing=(10,)), angle, np.zeros((5, 4)), np.zeros(5))
    np.testing.assert_array_equal(np.isnan(shape.radius), [False, True, True, True, False])
    np.testing.assert_array_equal(np.isnan(shape.distance), np.isnan(shape.radius))


def test_arrays_that_do_not_fit_are_refused() -> None:
    for angle, joints, height, words in (
        (np.zeros(3), np.zeros((3, 5)), np.zeros(2), "do not belong together"),
        (np.zeros(3), np.zeros(3), np.zeros(3), "do not belong together"),
        (np.zeros(0), np.zeros((0, 5)), np.zeros(0), "do not belong together"),
        (np.zeros(3), np.zeros((3, 0)), np.zeros(3), "do not belong together"),
        (np.zeros(3), np.zeros((2, 5)), np.zeros(3), "joints: there are not as many joint positions as angles; got 2"),
        (np.array([0, math.nan]), np.zeros((2, 5)), np.zeros(2), "angle, row 1: a number is missing"),
        (np.zeros(2), np.full((2, 5), math.inf), np.zeros(2), "joints, row 0: a number is missing"),
        (np.zeros(2), np.zeros((2, 5)), np.array([0, math.nan]), "height, row 1: a number is missing"),
        (np.array([0.0, 90.0]), np.zeros((2, 5)), np.zeros(2), "angle, row 1: the number is too large"),
        (np.zeros(2), np.zeros((2, 5)), np.array([0.0, -1.3]), "height, row 1: the number is too large; got -1.3"),
    ):
        assert words in refused(None, "", drawn_circle, a_scan(), angle, joints, height)
    arrays = (np.radians([10.0, 10.5]), np.zeros((2, 5)), np.zeros(2))
    words = r"page\.png: the line is missing at every angle"
    refused(None, words, drawn_circle, a_scan(missing=(9, 10, 11)), *arrays)


# -- pages and tables ----------------------------------------------------------------------------------------------


HEADER = "configuration,joint_1 [deg],joint_2 [deg],angle [deg],height [mm]"


def drawn(path: Path) -> Path:
    """Draw a circle of 25 mm with a gap at 90 deg, dot by dot, and return the file."""
    pitch = 25.4e-3 / 300
    x, y = np.meshgrid(pitch * np.arange(830), pitch * np.arange(800)[::-1])
    away, around = np.hypot(x - 0.035, y - 0.034), np.arctan2(y - 0.034, x - 0.035)
    ink = np.clip((0.25e-3 - np.abs(away - 0.025)) / pitch + 0.5, 0, 1) * (np.abs(around - np.pi / 2) > 0.1)
    Image.fromarray(np.uint8(245 - 180 * ink)).save(path, dpi=(300, 300))
    return path


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return drawn(tmp_path_factory.mktemp("scan") / "page.png")


def table(folder: Path, *rows: str, header: str = HEADER, name: str = "points.csv") -> Path:
    path = folder / name
    path.write_text("\n".join([header, *rows]) + "\n")
    return path


def test_distances_and_heights_of_two_pages(scan: Path, tmp_path: Path) -> None:
    first = table(tmp_path, "1,10,20,0,0.5", "2,11,21,90,0.1", "3,12,22,180,-0.2")
    second = table(tmp_path, "4,20,30,0,0", "5,21,31,200,0.3", name="more.csv")
    data = read_drawn_circles({"a": Page(scan, first), "b": Page(scan, second)}, sigma=2e-5)
    assert data.labels == ("1", "2", "3", "4", "5")
    assert data.fixtures == ("centre_a", "centre_b", "paper_a", "paper_b")
    far, high = known(data.distance)[0::2], known(data.height)[1::2]
    assert high == pytest.approx([5e-4, 1e-4, -2e-4, 0.0, 3e-4])
    assert np.isnan(far).tolist() == [False, True, False, False, False]
    assert far[[0, 2, 3, 4]] == pytest.approx(np.hypot(0.025, [5e-4, 2e-4, 0.0, 3e-4]), abs=5e-6)
    assert data.against.tolist() == [0, 2, 0, 2, 0, 2, 1, 3, 1, 3]
    assert data.joints[4] == pytest.approx(np.radians([21, 31]))
    setup = known(data.setup)
    assert (setup.targets, setup.against.tolist()) == (("centre_a", "centre_b"), [2, 3])
    text = csv_text(data)
    (tmp_path / "data.csv").write_text(text)
    assert csv_text(read_csv(tmp_path / "data.csv")) == text


def test_tables_and_pages_that_do_not_go_together_are_refused(scan: Path, tmp_path: Path) -> None:
    for header, rows, message in (
        (HEADER, ["1,10,20,0,0", "1,10,20,60,0"], r"points\.csv, column configuration.*twice|twice.*got '1'"),
        (HEADER.replace("angle [deg]", "angle"), ["1,10,20,0,0"], r"no unit is given"),
        (HEADER.replace("height [mm]", "depth [mm]"), ["1,10,20,0,0"], r"the column is not known.*depth \[mm\]"),
        (HEADER.replace("joint_2", "joint_3"), ["1,10,20,0,0"], r"the column joint_2 is missing"),
        (HEADER.replace("joint_2", "joint_1"), ["1,10,20,0,0"], r"joint_1 appears twice"),
        (HEADER.replace(",height [mm]", ""), ["1,10,20,0"], r"the column height is missing"),
        (HEADER, ["1,10,20,north,0"], r"line 2, column angle \[deg\].*north"),
        (HEADER.replace(",", ";"), ["1;10;20;0;0"], r"not separated by commas"),
    ):
        refused(None, message, read_drawn_circles, {"a": Page(scan, table(tmp_path, *rows, header=header))})
    first = Page(scan, table(tmp_path, "1,10,20,0,0"))
    refused(None, r"a configuration is on two pages.*'1'", read_drawn_circles, {"a": first, "b": first})
    pendant = table(tmp_path, "2,10,20,0,0", header=HEADER.replace("joint_", "axis_"), name="pendant.csv")
    assert read_drawn_circles({"b": Page(scan, pendant)}).joints_are == "controller"
    words = r"the pages have joint positions of two kinds.*Name the columns"
    refused(None, words, read_drawn_circles, {"a": first, "b": Page(scan, pendant)})
    longer = table(tmp_path, "2,1,2,3,0,0", header=HEADER.replace(",angle", ",joint_3 [deg],angle"), name="b.csv")
    words = r"different joints.*2 and 3 joints"
    refused(None, words, read_drawn_circles, {"a": first, "b": Page(scan, longer)})
