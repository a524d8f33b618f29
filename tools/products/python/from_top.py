"""Build backend for pip in the top folder (pyproject.toml there): setuptools, run in this folder."""

import os
import pathlib

os.chdir(pathlib.Path(__file__).resolve().parent)

from setuptools.build_meta import *  # noqa: E402, F401, F403  the hooks that pip calls
