"""What several tests use."""

import json
import os
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest


class Program:
    """The program of the command line."""

    def __init__(self, path, folder):
        self.path, self.folder = path, folder

    def run(self, *arguments, fails=False):
        """Runs it in a folder, and returns what it prints."""
        done = subprocess.run(
            [self.path, *map(str, arguments)],
            cwd=self.folder,
            capture_output=True,
            text=True,
            timeout=300,
        )
        assert (done.returncode not in (0, 3)) == fails, done.stderr
        return done.stderr if fails else done.stdout

    def save(self, **arrays):
        """Writes arrays as files, and returns their paths."""
        for name, array in arrays.items():
            np.save(self.folder / f"{name}.npy", array)
        return [self.folder / f"{name}.npy" for name in arrays]

    def same(self, result, folder):
        """Checks that a result is that of a folder, to the last bit."""
        folder = self.folder / folder
        files = sorted(folder.glob("*.npy"))
        assert sorted(result.arrays) == [file.stem for file in files]
        for file in files:
            expected, found = np.load(file), result.arrays[file.stem]
            assert found.shape == expected.shape, file.stem
            assert found.tobytes() == expected.tobytes(), file.stem
        expected = json.loads((folder / "result.json").read_text())
        assert plain(result.record) == plain(expected)


# What depends on the run, and what on the names and the bytes of files, if it is a text or a list.
TIMES = {"peak_memory_bytes", "arrays", "record_sha256"}
NAMES = {"path", "sha256", "inputs", "start", "end", "average", "pca", "geodesic", "variation"}
NAMES |= {"average_sum", "name", "shapes", "valid"}
# Of parameters, which name folders and files; results have lists by these names.
SOURCES = {"result", "groups", "shape"}


def plain(value):
    """A record without what depends on times and on the names of files."""
    if isinstance(value, dict):
        return {
            k: plain(v)
            for k, v in value.items()
            if not (k in TIMES or k.endswith("seconds"))
            if not (k in NAMES and isinstance(v, (str, list)))
            if not (k in SOURCES and isinstance(v, str))
        }
    if isinstance(value, list):
        return [plain(entry) for entry in value]
    return value


@pytest.fixture
def program(tmp_path):
    """The program, which SHAPESPACE_PROGRAM names."""
    path = os.environ.get("SHAPESPACE_PROGRAM") or shutil.which("shapespace")
    if path is None or not Path(path).is_file():
        pytest.skip("SHAPESPACE_PROGRAM does not name the program to compare with")
    return Program(path, tmp_path)


@pytest.fixture(scope="session")
def average():
    """An average of ellipses with all that its modes need."""
    import shapespace
    from drawing import ellipses

    return shapespace.average(ellipses(), grid=33, align="none", length_weight=1e-5)


@pytest.fixture(scope="session")
def modes(average):
    import shapespace

    return shapespace.pca(average)


@pytest.fixture(scope="session")
def geodesic():
    import shapespace
    from drawing import ellipse

    return shapespace.geodesic(
        ellipse(), ellipse(axes=(0.24, 0.24)), grid=33, steps=2, align="none"
    )
