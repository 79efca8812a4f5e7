"""Figures, pages, films and files of the program from results."""

import json
import re
import shutil
import struct
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import matplotlib.pyplot
import numpy as np
import pytest

import snaprod


def test_figures_are_those_of_the_program(snap, scenes, tmp_path):
    """Catches a figure of another scene, a size that is not asked for, and pictures in another format."""
    run = snaprod.run(snap, run__duration=0.1)
    drawn = run.figure("energies", width="85mm", font="8pt")
    assert 'width="85.00mm"' in drawn.svg and "energies" in repr(drawn)
    assert ElementTree.fromstring(drawn.svg).tag.endswith("svg") and drawn._repr_svg_() == drawn.svg
    # The program itself draws the same.
    (tmp_path / "snap.toml").write_text((scenes / "snap.toml").read_text())
    words = ["run", str(tmp_path / "snap.toml"), "--set", "run.duration=0.1", "--quiet", "--out", str(tmp_path / "out")]
    assert subprocess.run([sys.executable, "-m", "snaprod", *words], check=False).returncode == 0
    assert snaprod.run(tmp_path / "snap.toml", run__duration=0.1).figure("energies").svg == (tmp_path / "out/energies.svg").read_text()
    for name, begin in [("a.png", b"\x89PNG"), ("a.pdf", b"%PDF"), ("a.svg", b"<svg")]:
        drawn.save(tmp_path / name)
        assert (tmp_path / name).read_bytes().startswith(begin)
    with pytest.raises(ValueError, match="ends in .svg, .png or .pdf"):
        drawn.save(tmp_path / "a.jpg")
    with pytest.raises(ValueError, match="'surf': the program draws energies, .*surface"):
        run.figure("surf")
    with pytest.raises(TypeError, match="plot"):
        snaprod.folds(1).figure()
    lateral = scenes / "lateral.toml"
    assert snaprod.branch(lateral).figure().name == "branch"
    assert snaprod.equilibrium(scenes / "cantilever.toml").figure().name == "equilibrium"
    assert "mode 1" in snaprod.modes(scenes / "platform.toml").figure().svg


def test_files_for_other_programs(snap, tmp_path):
    """Catches a page without its motion, files that are cut, and a film that stands still."""
    run = snaprod.run(snap, run__duration=0.1, run__samples=5)
    page = run.to_html(tmp_path / "run.html")
    assert (tmp_path / "run.html").read_text() == page and '"kind":"motion"' in page
    run.to_vtk(tmp_path / "run.vtkhdf")
    assert (tmp_path / "run.vtkhdf").read_bytes().startswith(b"\x89HDF")
    run.to_gltf(tmp_path / "run.glb")
    glb = (tmp_path / "run.glb").read_bytes()
    magic, version, size, text = struct.unpack("<4sIII", glb[:16])
    assert (magic, version, size) == (b"glTF", 2, len(glb))
    assert len(json.loads(glb[20 : 20 + text])["skins"]) == 1
    film = run.film()
    assert len(re.findall("<animate ", film.svg)) > 60
    run.film(tmp_path / "film.gif")
    assert (tmp_path / "film.gif").read_bytes().startswith(b"GIF89a")
    with pytest.raises(snaprod.SceneError, match="film.avi: give a file that ends in .svg, .gif or .mp4"):
        run.film(tmp_path / "film.avi")


def test_a_film_for_slides(snap, tmp_path):
    """Catches a film that ffmpeg does not read, or that has fewer pictures than frames."""
    if shutil.which("ffmpeg") is None or shutil.which("ffprobe") is None:
        pytest.skip("ffmpeg is not installed: no film is made as MP4")
    run = snaprod.run(snap, run__duration=0.03)
    run.film(tmp_path / "film.mp4")
    ask = ["ffprobe", "-v", "error", "-show_entries", "stream=codec_name,nb_frames", "-of", "csv=p=0"]
    told = subprocess.run([*ask, str(tmp_path / "film.mp4")], capture_output=True, text=True, check=True).stdout
    codec, count = told.strip().split(",")
    assert codec == "h264" and int(count) > 100


def test_vtk_is_hdf5_that_others_read(snap, tmp_path):
    """Catches a file that the HDF5 library does not read, and grids that are cut at wrong places."""
    h5py = pytest.importorskip("h5py")
    run = snaprod.run(snap, run__duration=0.1, run__samples=5)
    run.to_vtk(tmp_path / "run.vtkhdf")
    rods = run.shape(run.t[[0, -1]], 61)
    with h5py.File(tmp_path / "run.vtkhdf") as file:
        grid = file["VTKHDF"]
        assert grid.attrs["Type"] == b"UnstructuredGrid" and grid.attrs["Version"].tolist() == [2, 0]
        steps = grid["Steps"]
        np.testing.assert_allclose(steps["Values"], [0.0, 0.025, 0.05, 0.075, 0.1], rtol=1e-14)
        assert steps.attrs["NSteps"] == 5 and steps["PointOffsets"][:].tolist() == [0, 62, 124, 186, 248]
        for k, rod in ((0, rods[0]), (4, rods[1])):
            begin = steps["PointOffsets"][k]
            np.testing.assert_array_equal(grid["Points"][begin : begin + 61], rod)
        directors = [grid["PointData"][f"d{i}"][:] for i in (1, 2, 3)]
        np.testing.assert_allclose(np.cross(directors[0], directors[1]), directors[2], atol=1e-14)
        assert grid["Types"][:2].tolist() == [4, 1] and grid["Offsets"][:3].tolist() == [0, 61, 62]


def test_matplotlib_chooses_as_the_program(scenes):
    """Catches a diagram on which the branches of a pitchfork lie on each other, and rods in space drawn flat."""
    branch = snaprod.branch(scenes / "heavy_column.toml")
    assert branch.plot(matplotlib.pyplot.figure().add_subplot()).get_ylabel().startswith("x")
    assert "x of the end" in branch.figure().svg
    box = matplotlib.pyplot.figure().add_subplot(projection="3d")
    drawn = snaprod.equilibrium(scenes / "lateral.toml").plot(box)
    assert drawn is box and np.ptp(box.lines[0].get_data_3d()[2]) > 0.1
