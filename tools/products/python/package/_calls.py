"""Names in one line the argument of a call that does not fit, in place of pybind11's list of all signatures."""

import ast
import collections.abc
import difflib
import functools
import inspect
import operator
import os
import re
import reprlib

import numpy

from . import _bristle


def _works(make, *value):
    try:
        make(*value)
    except (TypeError, ValueError, OverflowError):
        return False
    return True


def _is(*types):
    return lambda value: isinstance(value, types)


# For each type of an argument: its name in words, and a test whether a value is accepted for it.
_TYPES = {
    "float": ("a number", lambda value: not isinstance(value, (str, bytes)) and _works(float, value)),
    "int": ("a whole number", lambda value: not isinstance(value, (str, bytes, float)) and _works(int, value)),
    "bool": ("True or False", lambda value: hasattr(value, "__bool__")),
    "str": ("a str", _is(str, bytes)),
    "bytes": ("bytes", _is(bytes)),
    "os.PathLike": ("a path", _is(str, bytes, os.PathLike)),
    "Callable": ("a function", callable),
    "Dict": ("a dict", _is(dict)),
    "distributed.Client": ("a distributed.Client", lambda value: hasattr(value, "submit")),
    "numpy.ndarray": ("a numpy array", _is(numpy.ndarray)),
    "numpy.ndarray[numpy.float64]": ("an array of numbers", lambda value: _works(numpy.asarray, value, float)),
    "numpy.ndarray[numpy.uint64]": ("an array of ids", lambda value: _works(numpy.asarray, value, numpy.uint64)),
}


def _parts(kind):
    """Returns the name of a type, and the types in its brackets, from its text: "dict[str, int]"."""
    if not isinstance(kind, ast.Subscript) or ast.unparse(kind) in _TYPES:
        return ast.unparse(kind), []
    return ast.unparse(kind.value), kind.slice.elts if isinstance(kind.slice, ast.Tuple) else [kind.slice]


def _fits(value, kind):
    name, parts = _parts(kind)
    if name == "Optional":
        return value is None or _fits(value, parts[0])
    if name == "Union":
        return any(_fits(value, part) for part in parts)
    if name == "List":
        return (isinstance(value, (collections.abc.Sequence, numpy.ndarray)) and not isinstance(value, (str, bytes))
                and all(_fits(item, parts[0]) for item in value))
    if name == "Dict" and isinstance(value, dict):
        return all(_fits(item, part) for pair in value.items() for item, part in zip(pair, parts))
    if name.startswith("bristle."):
        return isinstance(value, getattr(_bristle, name[8:], object))
    return name not in _TYPES or _TYPES[name][1](value)


def _words(kind):
    name, parts = _parts(kind)
    if name == "Optional":
        return _words(parts[0]) + " or None"
    if name == "Union":
        return " or ".join(_words(part) for part in parts)
    if name == "List":
        return f"a list of {ast.unparse(parts[0])}"
    if name == "Dict" and parts:
        return f"a dict of {ast.unparse(parts[0])} to {ast.unparse(parts[1])}"
    return _TYPES[name][0] if name in _TYPES else f"a {name}"


def _wrong(signature, arguments, keywords):
    """Returns a text on the first argument that does not fit the signature, or None. Raises TypeError for an
    argument that is missing or has another name."""
    given = signature.bind(*arguments, **keywords).arguments
    kinds = {name: parameter.annotation for name, parameter in signature.parameters.items()
             if isinstance(parameter.annotation, str)}
    for name, value in given.items():
        if name in kinds:
            kind = ast.parse(kinds[name], mode="eval").body
            if not _fits(value, kind):
                text = " ".join(reprlib.repr(value).split())
                return f"{name} must be {_words(kind)}, not {text} ({type(value).__name__})"
    for name, value in given.items():
        if "int" in kinds.get(name, "") and _works(operator.index, value) and not 0 <= value < 2**31:
            return f"{name} is out of range: {value}"
    return None


def explain(function, text, arguments, keywords):
    """Returns the line of error for a call that pybind11 refused with `text`; `function` is the called C function."""
    name, text = text.partition("(")[0], text.partition("\nInvoked with: ")[0]
    if " constructor " in text.partition("\n")[0]:
        name, arguments = type(arguments[0]).__name__, arguments[1:]
    elif not name:  # an attribute is set
        name = type(arguments[0]).__name__
        attribute = next((attribute for attribute, member in vars(type(arguments[0])).items()
                          if isinstance(member, property) and getattr(member.fset, "__self__", None) is function), name)
        text = re.sub(r"(.*)\barg\d\b", rf"\1{attribute}", text)  # the last of a line
    refused = []
    for line in re.findall(r"^    \d+\. (.*)$", text, re.MULTILINE):
        scope = dict(vars(_bristle))
        exec(f"from __future__ import annotations\ndef call{line[line.index('('):]}: pass", scope)
        signature = inspect.signature(scope["call"])
        try:
            wrong = _wrong(signature, arguments, keywords)
            return f"{name}(): " + (wrong or f"the arguments do not fit {line}")
        except TypeError as error:
            near = [f"no argument '{unknown}' (did you mean '{word}'?)" for unknown in keywords
                    if unknown not in signature.parameters
                    for word in difflib.get_close_matches(unknown, signature.parameters, 1)]
            refused.append(near[0] if near else str(error))
    # Of several forms of a call, names the first that takes so many arguments.
    return f"{name}(): {min(refused, key=lambda why: 'too many' in why)}"


def checked(function):
    """Makes a function written in Python name the argument that does not fit its annotations, after it has failed."""

    @functools.wraps(function)
    def call(*arguments, **keywords):
        try:
            return function(*arguments, **keywords)
        except (TypeError, ValueError, AttributeError) as error:
            wrong = None if isinstance(error, _bristle.Error) else _wrong(inspect.signature(function), arguments, keywords)
            if wrong is None:
                raise
            raise TypeError(f"{function.__name__}(): {wrong}") from None

    return call
