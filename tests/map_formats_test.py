#!/usr/bin/env python3
"""Opens the files that the program exports with independent readers, and compares what they read.

    map_formats_test.py PROGRAM SMALL_RUNS   SMALL_RUNS: the folder that make_small_runs has filled

GeoTIFF, ASCII grid and PGM: rasterio and gdalinfo; PLY: plyfile; PCD: pypcd4; OctoMap: octomap-python; glTF: trimesh;
COLMAP: pycolmap (./setup test).
Open3D and PCL open the point clouds as well where they are installed (./setup viewers).
Exit code 77 (skipped) without the Python packages, or where the program was built without the simulator.
"""
import math
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

VENV_PYTHON = Path(__file__).resolve().parent.parent / ".venv/bin/python3"  # made by ./setup
try:
    import numpy as np
    import octomap
    import PIL.Image
    import plyfile
    import pycolmap
    import pypcd4
    import rasterio
    import trimesh
except ImportError as missing:
    if VENV_PYTHON.exists() and Path(sys.prefix) != VENV_PYTHON.parent.parent:
        os.execv(VENV_PYTHON, [str(VENV_PYTHON), *sys.argv])
    print(f"skipped: a Python package is missing (./setup test installs it): {missing}")
    sys.exit(77)

LAYERS = ("elevation_m", "elevation_min_m", "elevation_max_m", "variance_m2", "count", "slope_rad", "roughness_m",
          "step_m", "class", "occupancy_logodds", "cost")
CATEGORIES = ["unknown", "free", "obstacle", "cavity"]


def check(holds, message):
    if not holds:
        sys.exit(f"failed: {message}")


class Exports:
    """Exports of one run, made on demand in a folder of their own."""

    def __init__(self, program, run, folder):
        self.program, self.run, self.folder = program, run, folder

    def spartan(self, *arguments):
        subprocess.run([self.program, *map(str, arguments), "-q"], check=True, timeout=300)

    def map(self, name, *more):
        self.spartan("map", "export", self.run, "-o", self.folder / name, *more)
        return self.folder / name

    def of_run(self, name, form):
        self.spartan("export", self.run, "--format", form, "-o", self.folder / name)
        return self.folder / name


def gdalinfo(path):
    return subprocess.run(["gdalinfo", str(path)], check=True, capture_output=True, text=True, timeout=60).stdout


def check_statistics(dataset, bands):
    """Of each band, over its known cells."""
    for number, (name, values) in enumerate(bands.items(), 1):
        known = values[np.isfinite(values)].astype(float)
        tags = {key: float(value) for key, value in dataset.tags(number).items() if key.startswith("STATISTICS_")}
        expected = {"MINIMUM": known.min(), "MAXIMUM": known.max(), "MEAN": known.mean(), "STDDEV": known.std()}
        for key, value in expected.items():
            check(math.isclose(tags["STATISTICS_" + key], value, rel_tol=1e-6, abs_tol=1e-9), f"{key} of {name}: {tags}")
        share = 100 * len(known) / values.size
        check(math.isclose(tags["STATISTICS_VALID_PERCENT"], share, rel_tol=1e-3), f"share of known cells of {name}")


def check_mesh(exports, bands, transform):
    """The mesh in glTF's axes (x right, y up, z towards the viewer): the cells of the map, counter-clockwise from above."""
    scene = trimesh.load(exports.map("site.glb"))
    mesh = scene.to_mesh()
    rows, columns = np.nonzero(bands["count"] > 0)
    centres = np.stack([transform.c + transform.a * (columns + 0.5), bands["elevation_m"][rows, columns],
                        -(transform.f + transform.e * (rows + 0.5))], axis=-1)
    check(len(mesh.vertices) == len(rows), f"{len(mesh.vertices)} vertices of {len(rows)} cells")
    check(np.allclose(mesh.vertices, centres, atol=1e-5), "a vertex at the centre of each known cell")
    check((mesh.face_normals[:, 1] > 0).all(), "triangles face upwards")
    known = bands["count"] > 0
    corners = known[:-1, :-1].astype(int) + known[1:, :-1] + known[:-1, 1:] + known[1:, 1:]
    check(len(mesh.faces) == 2 * (corners == 4).sum() + (corners == 3).sum(), "triangles between neighbours")
    check(len(exports.of_run("run.glb", "gltf").read_bytes()) == len((exports.folder / "site.glb").read_bytes()), "export --format gltf")


def check_colours_of_mesh(exports):
    """Cells that hold points of a gray image have the mean of their levels, in linear light."""
    scene = trimesh.load(exports.of_run("coloured.glb", "gltf"))
    colours = next(iter(scene.geometry.values())).visual.vertex_attributes["color"].astype(float) / 65535
    check((colours[:, 3] == 1).all(), "colours are opaque")
    vertices = scene.to_mesh().vertices
    with rasterio.open(exports.map("place.tif")) as site:
        cell = site.transform.a
    terrain = plyfile.PlyData.read(exports.of_run("points.ply", "ply"))["vertex"]
    levels = {}
    for x, y, level in zip(terrain["x"], terrain["y"], terrain["red"]):
        levels.setdefault((math.floor(x / cell), math.floor(y / cell)), []).append(int(level))
    compared = 0
    for (x, _, z), colour in zip(vertices, colours):
        here = levels.get((math.floor(x / cell), math.floor(-z / cell)))
        if here is None:
            continue
        level = sum(here) // len(here) / 255
        linear = level / 12.92 if level <= 0.04045 else ((level + 0.055) / 1.055) ** 2.4
        compared += 1
        check(np.allclose(colour[:3], linear, atol=2e-4), f"colour of the cell at {x}, {-z}: {colour}, not {linear}")
    check(compared > 500, f"{compared} cells have points")


def check_colmap_of_named_images(exports, recording):
    """Images whose names and times were stated for the run are those of the layout that states them itself."""
    images = exports.folder / "images"
    images.mkdir()
    for side, name in (("image_0", "l"), ("image_1", "r")):
        for file in (recording / side).iterdir():
            (images / f"{name}{file.name}").symlink_to(file)
    reading = ("--left", "l*.png", "--right", "r*.png", "--fps", "2", "--rig", recording / "calib.txt")
    named = Exports(exports.program, exports.folder / "named_run", exports.folder)
    exports.spartan("run", images, "-o", named.run, *reading)
    exports.spartan("export", named.run, "--format", "colmap", "-o", exports.folder / "named")
    kinds = [sorted((exports.folder / name / "images/left").iterdir()) for name in ("colmap", "named")]
    check(len(kinds[0]) == len(kinds[1]) > 4, f"{len(kinds[1])} images, not {len(kinds[0])}")
    check(all(a.read_bytes() == b.read_bytes() for a, b in zip(*kinds)), "the same images")


def check_colmap(exports, recording):
    """pycolmap reads the model; its cameras see each terrain point where it was seen: in the gray level that it has."""
    exports.spartan("export", exports.run, "--format", "colmap", "-o", exports.folder / "colmap", "--recording", recording)
    model = pycolmap.Reconstruction(exports.folder / "colmap/sparse/0")
    check(len(model.cameras) == 2 and len(model.images) > 4, f"{len(model.cameras)} cameras, {len(model.images)} images")
    tried = 0
    for image in model.images.values():
        stamp = Path(image.name).stem
        cloud = exports.run / f"terrain/{stamp}.ply"
        if not cloud.exists() or not image.name.startswith("left/"):
            continue
        vertices = plyfile.PlyData.read(cloud)["vertex"]
        points = np.stack([vertices["x"], vertices["y"], vertices["z"]], axis=-1).astype(float)
        with PIL.Image.open(exports.folder / "colmap/images" / image.name) as file:
            pixels = np.array(file)
        in_camera = image.cam_from_world() * points
        seen = np.floor(model.cameras[image.camera_id].img_from_cam(in_camera)).astype(int)
        check((in_camera[:, 2] > 0).all() and (seen >= 0).all() and (seen < pixels.shape[::-1]).all(), "points are seen")
        # The point clouds are those of the odometry's or the localization's pose, which is that of the model.
        off = np.abs(pixels[seen[:, 1], seen[:, 0]].astype(int) - vertices["red"])
        check(np.median(off) <= 1, f"gray levels of the points in {image.name}: off by {np.median(off)}")
        tried += 1
    check(tried > 1, f"{tried} terrain views")
    check(len(model.points3D) > 1000, f"{len(model.points3D)} points")


def check_geotiff(exports):
    """Returns the bands by name and the transform."""
    path = exports.map("site.tif")
    with rasterio.open(path) as site:
        check(site.descriptions == LAYERS, f"bands {site.descriptions}")
        check(site.units == ("m", "m", "m", "m2", None, "rad", "m", "m", None, None, None), f"units {site.units}")
        check(all(math.isnan(value) for value in site.nodatavals), "nodata is NaN")
        check(site.crs is not None and "ENGCRS" in site.crs.to_wkt(version="WKT2_2019"), f"an engineering CRS: {site.crs}")
        tags = site.tags()
        check(tags["X_AXIS"] in ("east", "start_heading"), f"X_AXIS in {tags}")
        check(0 <= int(tags["FIRST_STAMP_NS"]) <= int(tags["LAST_STAMP_NS"]) and int(tags["STOPS"]) > 1, f"stops: {tags}")
        bands, transform = dict(zip(LAYERS, site.read())), site.transform
        check_statistics(site, bands)
    text = gdalinfo(path)
    check("LAYOUT=COG" in text, "a cloud-optimized GeoTIFF")
    check('LENGTHUNIT["metre",1' in text, "the CRS is in metres")
    check("Categories:" in text and all(f"{i}: {name}" in text for i, name in enumerate(CATEGORIES)), "names of classes")
    check("Overviews" not in text, "a small map has no overviews")
    with rasterio.open(exports.map("large.tif", "--window=-6,-6,6,6")) as large:
        check(large.overviews(1) == [2, 4], f"overviews {large.overviews(1)} of {large.width} cells")
        check(large.block_shapes[0] == (512, 512), f"tiles {large.block_shapes[0]}")
        check(large.tags(ns="IMAGE_STRUCTURE")["LAYOUT"] == "COG", "a large map is cloud-optimized")
        check_statistics(large, dict(zip(LAYERS, large.read())))
    local = sorted((exports.run / "maps").glob("local_*.tif"))[0]
    with rasterio.open(local) as stop:
        check(stop.tags()["FIRST_STAMP_NS"] == local.stem.removeprefix("local_"), "the stamp of a local map")
    return bands, transform


def check_class_layer(exports, bands):
    with rasterio.open(exports.map("class.tif", "--layer", "class")) as classes:
        check(classes.dtypes == ("uint8",) and classes.nodata == 0, f"bytes, nodata 0: {classes.dtypes}")
        check(np.array_equal(classes.read(1), bands["class"]), "the classes are those of the map")
        colours = classes.colormap(1)
        check(colours[2][:3] == (220, 50, 40) and colours[3][:3] == (40, 90, 230), f"colours: {colours}")
    check("2: obstacle" in gdalinfo(exports.folder / "class.tif"), "names of classes")
    exports.map("class.tif", "--layer", "elevation_m", "--force")
    check("obstacle" not in gdalinfo(exports.folder / "class.tif"), "no names of classes of the former file")


def check_grids(exports, bands, transform):
    with rasterio.open(exports.map("elevation.asc")) as grid:
        values = grid.read(1, masked=True).filled(np.nan)
        check(np.allclose(values, bands["elevation_m"], atol=1e-6, equal_nan=True), "elevations of the ASCII grid")
        check(np.allclose(list(grid.transform), list(transform), atol=1e-9), "place of the ASCII grid")
    text = exports.map("nav.yaml").read_text(encoding="utf-8")
    nav = dict(line.split(": ", 1) for line in text.splitlines())
    nav["image"] = nav["image"].strip('"')
    with rasterio.open(exports.folder / nav["image"]) as image:
        pixels = image.read(1)
    # As map_server computes it: occupied above occupied_thresh, free below free_thresh.
    occupancy = (255 - pixels.astype(float)) / 255
    state = np.where(occupancy > float(nav["occupied_thresh"]), 2, np.where(occupancy < float(nav["free_thresh"]), 1, 0))
    check(np.array_equal(state, np.minimum(bands["class"], 2)), "occupied, free and unknown cells for Nav2")
    origin = [float(value) for value in nav["origin"].strip("[]").split(",")]
    corner = (transform.c, transform.f + transform.e * pixels.shape[0], 0)
    check(np.allclose(origin, corner, atol=1e-9), f"origin {origin}: the south-west corner, not {corner}")
    check(float(nav["resolution"]) == transform.a, "resolution")


def check_clouds(exports, bands, transform):
    rows, columns = np.nonzero(bands["count"] > 0)
    cloud = plyfile.PlyData.read(exports.map("cells.ply"))["vertex"]
    check(len(cloud) == len(rows), f"{len(cloud)} points of {len(rows)} cells")
    check(np.allclose(cloud["x"], transform.c + transform.a * (columns + 0.5), atol=1e-4), "x of the PLY file")
    check(np.allclose(cloud["y"], transform.f + transform.e * (rows + 0.5), atol=1e-4), "y of the PLY file")
    check(np.allclose(cloud["z"], bands["elevation_m"][rows, columns], atol=1e-6), "z of the PLY file")
    check(np.allclose(cloud["sigma_m"] ** 2, bands["variance_m2"][rows, columns], rtol=1e-4), "sigma of the PLY file")
    pcd = pypcd4.PointCloud.from_path(exports.map("cells.pcd"))
    check(pcd.fields == ("x", "y", "z", "rgb", "sigma_m", "time_s"), f"fields {pcd.fields}")
    for name in ("x", "y", "z", "sigma_m", "time_s"):
        check(np.array_equal(pcd.pc_data[name], cloud[name]), f"{name} of the PCD file")
    packed = np.ascontiguousarray(pcd.pc_data["rgb"]).view(np.uint32)
    check(np.array_equal(packed >> 16, cloud["red"]) and np.array_equal(packed & 255, cloud["blue"]), "colours of PCD")

    terrain = plyfile.PlyData.read(exports.of_run("terrain.ply", "ply"))["vertex"]
    stamps = {int(path.stem) for path in (exports.run / "terrain").glob("*.ply")}
    check({round(1e9 * time) for time in set(terrain["time_s"])} == stamps, "the points have the times of their images")
    check(0 < terrain["sigma_m"].min() and terrain["sigma_m"].max() < 10, "sigma of the terrain")
    pcd = pypcd4.PointCloud.from_path(exports.of_run("terrain.pcd", "pcd"))
    check(np.array_equal(pcd.pc_data["sigma_m"], terrain["sigma_m"]), "PCD of the terrain")


def is_occupied(tree, *point):
    try:
        return tree.isNodeOccupied(tree.search(np.array(point)))
    except octomap.NullPointerException:  # no such node: unknown
        return False


def check_octomap(exports, bands, transform):
    tree = octomap.OcTree(str(exports.map("site.bt")).encode())
    check(abs(tree.getResolution() - transform.a) < 1e-12, f"resolution {tree.getResolution()}")
    rows, columns = np.nonzero(bands["count"] > 0)
    for r, c in zip(rows, columns):
        x, y = transform.c + transform.a * (c + 0.5), transform.f + transform.e * (r + 0.5)
        for layer in ("elevation_min_m", "elevation_max_m"):
            check(is_occupied(tree, x, y, float(bands[layer][r, c])), f"{layer} of cell {c}, {r} is occupied")
    highest = np.nanmax(bands["elevation_max_m"]) + 2 * transform.a
    for r, c in list(zip(rows, columns))[::50]:
        x, y = transform.c + transform.a * (c + 0.5), transform.f + transform.e * (r + 0.5)
        check(not is_occupied(tree, x, y, highest), "above the ground is not occupied")
    same = octomap.OcTree(str(exports.of_run("run.bt", "octomap")).encode())
    check(same.size() == tree.size(), "export --format octomap")


def check_viewers(exports):
    """Open3D and PCL, where they are installed."""
    try:
        import open3d
        for name in ("cells.ply", "cells.pcd"):
            cloud = open3d.io.read_point_cloud(str(exports.folder / name))
            check(len(cloud.points) > 100 and len(cloud.colors) == len(cloud.points), f"Open3D reads {name}")
        print("read by Open3D", open3d.__version__)
    except ImportError:
        print("not tried: Open3D is not installed (./setup viewers)")
    if shutil.which("pcl_pcd2ply") is None:
        print("not tried: PCL is not installed (./setup viewers)")
        return
    subprocess.run(["pcl_pcd2ply", str(exports.folder / "cells.pcd"), str(exports.folder / "pcl.ply")], check=True,
                   capture_output=True, timeout=60)
    ours, theirs = (plyfile.PlyData.read(exports.folder / name)["vertex"] for name in ("cells.ply", "pcl.ply"))
    check(np.array_equal(ours["z"], theirs["z"]), "PCL reads cells.pcd")
    print("read by PCL")


def main():
    program, small_runs = sys.argv[1], Path(sys.argv[2])
    if shutil.which("gdalinfo") is None:
        print("skipped: gdalinfo is missing (./setup test installs it)")
        return 77
    run = small_runs / "stops/whole"
    if not run.exists():
        print("skipped: built without the simulator")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        exports = Exports(program, run, Path(folder))
        bands, transform = check_geotiff(exports)
        check_class_layer(exports, bands)
        check_grids(exports, bands, transform)
        check_clouds(exports, bands, transform)
        check_octomap(exports, bands, transform)
        check_mesh(exports, bands, transform)
        drive = Exports(program, small_runs / "drive_run", Path(folder))
        check_colours_of_mesh(drive)
        check_colmap(drive, small_runs / "drive")
        check_colmap_of_named_images(drive, small_runs / "drive")
        check_viewers(exports)
    return 0


if __name__ == "__main__":
    sys.exit(main())
