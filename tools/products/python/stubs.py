#!/usr/bin/python3
"""Writes the type stubs of the module from the module itself: stubs.py FOLDER, which holds the package `bristle`.

Signatures come from the docstrings that pybind11 writes, those of functions in Python from their annotations, and the
columns of responses from their dtype. Units and meaning are in the docstrings: help(bristle).

Needs the built module. For example: python3 tools/products/python/stubs.py build/release/python
"""

import ast
import enum
import inspect
import pathlib
import re
import sys

HEAD = """# Type stubs of the module, made by stubs.py. Units and meaning are in the docstrings: help(bristle).
import enum
import os
from collections.abc import Mapping, Sequence
from typing import Any, Callable, overload

import numpy as np
from numpy.typing import ArrayLike, NDArray
"""
# For each type of a docstring: the type of an argument, and that of a result.
TYPES = {
    "object": ("Any", "Any"),
    "distributed.Client": ("Any", "Any"),
    "os.PathLike": ("str | os.PathLike[str]", "str"),
    "tuple": ("Sequence[Any]", "tuple[Any, ...]"),
    "list": ("Sequence[Any]", "list[Any]"),
    "dict": ("Mapping[str, Any]", "dict[str, Any]"),
    "Dict": ("Mapping[str, Any]", "dict[str, Any]"),
    "numpy.recarray": ("np.recarray[Any, Any]",) * 2,
    "numpy.ndarray": ("np.ndarray[Any, Any]",) * 2,
    "numpy.ndarray[numpy.float64]": ("ArrayLike", "NDArray[np.float64]"),
    "numpy.ndarray[numpy.uint64]": ("ArrayLike", "NDArray[np.uint64]"),
    "numpy.ndarray[numpy.uint32]": ("ArrayLike", "NDArray[np.uint32]"),
}
SPECIAL = ("__init__", "__len__", "__getitem__")


def typed(kind, is_result):
    """Returns the type in a stub of a type in a docstring (an expression)."""
    text = ast.unparse(kind)
    if text in TYPES:
        return TYPES[text][is_result]
    if not isinstance(kind, ast.Subscript):
        return text.removeprefix("bristle.")
    name = ast.unparse(kind.value)
    parts = kind.slice.elts if isinstance(kind.slice, ast.Tuple) else [kind.slice]
    if name == "Callable":
        return text
    if name == "float":  # float[3]: of an array of three
        return name
    inner = [typed(part, is_result) for part in parts]
    if name in ("Optional", "Union"):
        return " | ".join(inner + ["None"] * (name == "Optional"))
    outer = {"List": ("Sequence", "list"), "Dict": ("Mapping", "dict")}.get(name, (name, name))[is_result]
    return f"{outer}[{', '.join(inner)}]"


def expression(annotation, is_result):
    """Returns the type in a stub of an annotation, which is a text in functions written in Python."""
    if isinstance(annotation, ast.Constant) and isinstance(annotation.value, str):
        annotation = ast.parse(annotation.value, mode="eval").body
    return "Any" if annotation is None else typed(annotation, is_result)


def stub_of(name, signature, decorators=()):
    """Yields the lines of a function from its signature: (arguments) -> result."""
    function = ast.parse(f"def {name}{signature}: ...").body[0]
    arguments = function.args
    pairs = list(zip(reversed(arguments.posonlyargs + arguments.args), reversed(arguments.defaults)))
    pairs += zip(arguments.kwonlyargs, arguments.kw_defaults)
    optional = {argument.arg for argument, default in pairs if ast.unparse(default or ast.Pass()) == "None"}
    for argument in ast.walk(arguments):
        if isinstance(argument, ast.arg):
            text = expression(argument.annotation, False)
            if argument.arg in optional and not text.endswith("None") and text != "Any":
                text += " | None"
            argument.annotation = None if argument.arg == "self" else ast.parse(text, mode="eval").body
    dots = ast.Constant(value=...)
    arguments.defaults = [dots for _ in arguments.defaults]
    arguments.kw_defaults = [default and dots for default in arguments.kw_defaults]
    yield from decorators
    yield f"def {name}({ast.unparse(arguments)}) -> {expression(function.returns, True)}: ..."


def function_lines(name, function, decorators=()):
    """Yields the lines of a function or method, of all its forms."""
    if inspect.isfunction(function):
        yield from stub_of(name, str(inspect.signature(function)), decorators)
        return
    forms = re.findall(rf"^(?:\d+\. )?{name}(\(.*\) -> .*)$", function.__doc__, re.MULTILINE)
    for form in forms:
        yield from stub_of(name, form, ["@overload"] * (len(forms) > 1) + list(decorators))


def result_of(function):
    """Returns the type that a property's function returns."""
    if inspect.isfunction(function):
        text = inspect.signature(function).return_annotation
    else:
        text = function.__doc__.partition("\n")[0].partition(" -> ")[2]
    return typed(ast.parse(text, mode="eval").body, True)


def column_lines(kind, dtype):
    """Yields the columns of responses, or the fields of one. numpy makes them attributes."""
    for name in dtype.names:
        column, _ = dtype.fields[name]
        number = f"np.{column.base.name}"
        is_array = column.shape or issubclass(kind, sys.modules["numpy"].ndarray)
        text = f"NDArray[{number}]" if is_array else "float" if column.kind == "f" else "int"
        if hasattr(kind.__mro__[2], name):  # a method of numpy's class
            yield from ("@property", f"def {name}(self) -> {text}: ...  # type: ignore[override]")
        else:
            yield f"{name}: {text}"


def class_lines(name, kind, bristle):
    bases = [base for base in kind.__bases__ if base.__module__ in ("builtins", "numpy", "enum")]
    base = {"object": "", "pybind11_object": "", "record": "(np.record)", "recarray": "(np.ndarray[Any, Any])",
            "IntFlag": "(enum.IntFlag)"}.get(bases[0].__name__ if bases else "object", f"({bases and bases[0].__name__})")
    yield f"class {name}{base}:"
    lines = []
    if issubclass(kind, enum.Enum):
        lines += [f"{member} = {kind[member].value}" for member in kind.__members__]
    elif base.startswith("(np."):
        lines += column_lines(kind, bristle.response_dtype)
    for member, value in vars(kind).items():
        if member.startswith("_") and member not in SPECIAL or issubclass(kind, enum.Enum):
            continue
        if member == "__init__" and inspect.isfunction(value):  # of a class that users do not make
            continue
        if isinstance(value, property):
            if value.fset is None:
                lines.append("@property")
                lines.append(f"def {member}(self) -> {result_of(value.fget)}: ...")
            else:
                lines.append(f"{member}: {result_of(value.fget)}")
        elif isinstance(value, tuple):
            lines.append(f"{member}: tuple[Any, ...]")
        elif isinstance(value, staticmethod):
            lines += function_lines(member, value.__func__, ["@staticmethod"])
        elif callable(value):
            lines += function_lines(member, value)
    yield from ["    " + line for line in lines or ["..."]]


def stubs(bristle):
    """Yields the lines of the stubs of the module."""
    yield HEAD
    yield "__version__: str"
    for name, thing in vars(bristle).items():
        if name.startswith("_") or inspect.ismodule(thing):
            continue
        if isinstance(thing, type):
            yield from ["", *class_lines(name, thing, bristle)]
        elif callable(thing):
            yield from function_lines(name, thing)
        else:
            yield f"{name}: np.dtype[Any]"


if __name__ == "__main__":
    if {"-h", "--help"} & set(sys.argv[1:]):
        sys.exit(print(__doc__.strip()))
    if len(sys.argv) != 2:
        sys.exit(__doc__.strip())
    sys.path.insert(0, sys.argv[1])
    import bristle as module

    pathlib.Path(sys.argv[1], "bristle/__init__.pyi").write_text("\n".join(stubs(module)) + "\n")
