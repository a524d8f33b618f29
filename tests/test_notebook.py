#!/usr/bin/python3
"""Runs the cells of a notebook as plain Python: they must print what the notebook shows.

usage: test_notebook.py [--store] NOTEBOOK

--store runs them by Debian's python3-nbconvert and python3-ipykernel instead and stores what they show.

Needs the module and matplotlib. For example:
PYTHONPATH=build/release/python tests/test_notebook.py tools/products/python/first_steps.ipynb
"""
import contextlib
import io
import json
import os
import sys


def text_of(lines):
    return "".join(lines)


def store(path):
    import nbformat
    from nbconvert.preprocessors import ExecutePreprocessor

    notebook = nbformat.read(path, nbformat.NO_CONVERT)
    ExecutePreprocessor(kernel_name="python3", record_timing=False).preprocess(notebook, {})
    nbformat.write(notebook, path)


def run(path):
    os.environ["MPLBACKEND"] = "Agg"
    with open(path, encoding="utf-8") as file:
        cells = [cell for cell in json.load(file)["cells"] if cell["cell_type"] == "code"]
    names, pictures = {}, 0
    for number, cell in enumerate(cells, 1):
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(text_of(cell["source"]), f"{path}, code cell {number}", "exec"), names)
        shown = text_of(text_of(output["text"]) for output in cell["outputs"] if output.get("name") == "stdout")
        if printed.getvalue() != shown:
            sys.exit(f"{path}, code cell {number} prints\n{printed.getvalue()}and the notebook shows\n{shown}")
        pictures += sum("image/png" in output.get("data", {}) for output in cell["outputs"])
    if pictures < 2 or os.path.getsize(path) > 60000:
        sys.exit(f"{path} holds {pictures} pictures in {os.path.getsize(path)} bytes; wanted: two, within 60,000 bytes")
    print(f"{len(cells)} code cells print what the notebook shows; {pictures} pictures")


def main():
    if {"-h", "--help"} & set(sys.argv[1:]):
        sys.exit(print(__doc__.strip()))
    arguments = sys.argv[1:]
    if not arguments or len(arguments) > 2:
        sys.exit(__doc__.strip())
    store(arguments[1]) if arguments[0] == "--store" else run(arguments[0])


main()
