#!/usr/bin/python3
"""The Python module: arrays in place, the interpreter's lock, errors, and closed forms of the model.

Needs the built module and numpy. For example:
PYTHONPATH=build/release/python tests/test_python.py Sweeps
"""

import ast
import copy
import csv
import importlib.util
import inspect
import json
import math
import os
import pathlib
import pickle
import pydoc
import re
import signal
import subprocess
import sys
import tempfile
import textwrap
import threading
import time
import types
import unittest
import unittest.mock
import warnings

if "--help" in sys.argv[1:]:
    sys.exit(print(__doc__.strip()))

import numpy as np

import bristle

DBAR = 10e-6  # m, mean snap length
LOAD = 2.0  # N
REPOSITORY = pathlib.Path(__file__).parent.parent
SCENES = REPOSITORY / "tools" / "scenes"
STUB = pathlib.Path(bristle.__file__).with_name("__init__.pyi")
if not STUB.exists():  # a build with sanitizers, which cannot import its module
    subprocess.run([sys.executable, REPOSITORY / "tools/products/python/stubs.py", STUB.parents[1]], check=True)
COMMAND_LINE = pathlib.Path(bristle.__file__).parents[2] / "bristle"
TOOLS = {"Scene", "SceneRun", "run_scene", "FitEstimate", "FitResult", "fit", "experiment",
         "sweep", "SweepTable"}
HAS_TOOLS = hasattr(bristle, "fit")


def command_line(*arguments):
    """Returns what `bristle` prints. Unsets LD_PRELOAD, because the program has a sanitizer's runtime of its own."""
    environment = {name: value for name, value in os.environ.items() if name != "LD_PRELOAD"}
    return subprocess.run([COMMAND_LINE, *arguments], check=True, capture_output=True, text=True, env=environment).stdout


def material(law, rule="keep", **more):
    return bristle.Material(snap_length=law, snap_rule=rule, **more)


def slide(batch, ids, step, count, load=LOAD):
    motions, responses = bristle.motions(ids, load), bristle.responses(len(ids))
    motions.displacement[:, 0] = step
    forces = np.empty((count, len(ids)))
    for k in range(count):
        batch.step(1e-3, motions, responses)
        forces[k] = responses.end[:, 0]
    return forces


def step_once(batch, id_, dx, dy, load=LOAD):
    """Moves one patch over 1 ms and returns its response."""
    motions, responses = bristle.motions(id_, load), bristle.responses(1)
    motions.displacement[0] = dx, dy
    batch.step(1e-3, motions, responses)
    return responses[0]


class Arrays(unittest.TestCase):
    def setUp(self):
        self.batch = bristle.PatchBatch()
        self.ids = self.batch.add_many(3, bristle.Material(), bristle.PatchOptions(max_normal_load=LOAD, bristles=1800))
        self.motions, self.responses = bristle.motions(self.ids, LOAD), bristle.responses(3)

    def test_a_step_writes_into_the_arrays_it_is_given(self):
        address = self.responses.__array_interface__["data"]
        end = self.responses.end  # a view of the array, made before the step
        self.motions.displacement[:, 0] = [1e-6, 2e-6, -3e-6]
        report = self.batch.step(1e-3, self.motions, self.responses)
        self.assertEqual((report.patches_stepped, report.status), (3, bristle.Status.ok))
        self.assertEqual(self.responses.__array_interface__["data"], address)
        stiffness = 900 * LOAD * 82.05128205128205  # number of bristles in contact times the stiffness of one, N/m
        np.testing.assert_allclose(self.responses["stiffness"], stiffness, rtol=1e-12)
        # As no bristle snaps below 5 um, each patch is a linear spring whose force opposes the motion.
        np.testing.assert_allclose(end[:, 0], [-stiffness * d for d in (1e-6, 2e-6, -3e-6)], rtol=1e-5)
        np.testing.assert_array_equal(end[:, 1], 0.0)
        np.testing.assert_array_equal(self.responses.id, self.ids)

    def test_plain_structured_arrays_and_parts_of_arrays_serve_too(self):
        motions = np.zeros(5, bristle.motion_dtype)
        responses = np.zeros(5, bristle.response_dtype)
        motions["id"][1:4], motions["normal_load"] = self.ids, LOAD
        self.batch.step(1e-3, motions[1:4], responses[1:4])
        np.testing.assert_array_equal(responses["id"], [0, *self.ids, 0])

    def test_what_cannot_be_used_in_place_is_refused(self):
        step = self.batch.step
        read_only = bristle.responses(3)
        read_only.flags.writeable = False
        moved = np.zeros(bristle.motion_dtype.itemsize * 3 + 1, "u1")[1:].view(bristle.motion_dtype)
        refused = [
            (self.motions, bristle.responses(2), "as many as motions"),
            (np.zeros((3, 2)), self.responses, "motions: make it with bristle.motions"),
            (self.responses, self.responses, "bristle.motion_dtype"),
            (self.motions, self.motions, "bristle.response_dtype"),
            (bristle.motions(np.zeros(6, "u8"))[::2], self.responses, "without gaps"),
            (self.motions, read_only, "read-only"),
            (moved, self.responses, "aligned"),
        ]
        for motions, responses, message in refused:
            with self.assertRaisesRegex(bristle.Error, message):
                step(1e-3, motions, responses)
        with self.assertRaisesRegex(TypeError, r"step\(\): motions must be a numpy array, not \[1, 2, 3\] \(list\)"):
            step(1e-3, [1, 2, 3], self.responses)

    def test_bad_values_set_a_status_and_raise_nothing(self):
        self.motions.normal_load[0] = -1.0
        self.motions.id[1] = 12345
        report = self.batch.step(1e-3, self.motions, self.responses)
        status = [bristle.Status(int(s)) for s in self.responses.status]
        self.assertEqual(status, [bristle.Status.bad_input, bristle.Status.unknown_id, bristle.Status.ok])
        self.assertEqual(report.status, bristle.Status.bad_input | bristle.Status.unknown_id)

    def test_info_holds_every_field_of_the_structure(self):
        header = (pathlib.Path(__file__).parents[1] / "core/include/bristle/patch.hpp").read_text()
        body = re.search(r"struct PatchInfo \{(.*?)\n\};", header, re.S).group(1)
        fields = re.findall(r"^  [\w:]+(?: char\*)? (\w+) = ", body, re.M)
        self.assertEqual(len(fields), 9)
        info = self.batch.info(self.ids[0])
        self.assertEqual(list(info), fields)
        self.assertEqual(info["representatives"], 1800)
        self.assertAlmostEqual(info["max_normal_load"], LOAD, delta=1e-12 * LOAD)

    def test_patches_added_together_differ_in_their_seeds_and_loads(self):
        options = bristle.PatchOptions(max_normal_load=LOAD, bristles=100)
        ids = self.batch.add_many(2, bristle.Material(), options)
        options.seed += 1
        ids = [*ids, self.batch.add(bristle.Material(), options)]
        first, second, third = (self.batch.read_bristles(id_)[2] for id_ in ids)
        self.assertTrue((first != second).any())
        np.testing.assert_array_equal(second, third)
        np.testing.assert_array_equal(bristle.motions(ids, [0.5, 1.0, 1.5])["normal_load"], [0.5, 1.0, 1.5])

    def test_a_patch_that_is_removed_is_gone_after_the_next_step(self):
        self.batch.remove(self.ids[0])
        self.batch.step(1e-3, self.motions, self.responses)
        self.assertEqual(len(self.batch), 2)
        self.assertEqual(self.responses.status.tolist(), [bristle.Status.unknown_id, 0, 0])

    def test_arrays_that_share_memory_are_refused(self):
        size = bristle.response_dtype.itemsize
        memory = np.zeros(8 * size, "u1")
        motions = memory[:bristle.motion_dtype.itemsize].view(bristle.motion_dtype)
        motions["id"] = self.ids[0]
        for start in (0, 8):  # at the same place, and half over it
            responses = memory[start:start + size].view(bristle.response_dtype)
            for call in (self.batch.step, self.batch.find_force):
                with self.assertRaisesRegex(bristle.Error, "responses: the array shares memory with motions"):
                    call(1e-3, motions, responses)
        apart = memory[motions.nbytes:motions.nbytes + size].view(bristle.response_dtype)
        self.assertEqual(self.batch.step(1e-3, motions, apart).status, bristle.Status.ok)
        self.batch.step(1e-3, motions[:0], apart[:0])


class Model(unittest.TestCase):
    def test_an_infinite_patch_is_asked_for_by_keywords(self):
        surface, batch = material(bristle.SnapLength.exponential(DBAR), "redraw"), bristle.PatchBatch()
        options = bristle.PatchOptions(max_normal_load=LOAD, population="infinite", resolution=16)
        self.assertIn("population='infinite', resolution=16.0", repr(options))
        self.assertIn("infinite", batch.info(batch.add(surface, options))["kernel"])
        with self.assertRaisesRegex(bristle.Error, "resolution = 0.5; allowed is 1 to 128"):
            batch.add(surface, bristle.PatchOptions(population="infinite", resolution=0.5))
        with self.assertRaisesRegex(bristle.Error, '"representatives", "infinite"'):
            bristle.PatchOptions(population="finite")

    def test_a_lay_makes_friction_depend_on_the_direction(self):
        surface = material(bristle.SnapLength.uniform(0.5 * DBAR, 1.5 * DBAR), "slide")
        limit = surface.kinetic_coefficient() * LOAD
        batch = bristle.PatchBatch()
        # Expected forces over the limit, on a limit curve that is an ellipse about (0.5, 0).
        for x, y, fx, fy in ((1, 0, 1.5, 0), (-1, 0, -0.5, 0), (0, 1, 0.5, 0.4)):
            lay = bristle.Lay(limit_ratio=0.4, to_over_fro=3.0)
            id_ = batch.add(surface, bristle.PatchOptions(max_normal_load=LOAD, precision="double", lay=lay))
            response = step_once(batch, id_, 200 * DBAR * x, 200 * DBAR * y)
            np.testing.assert_allclose(response.end, [-fx * limit, -fy * limit], atol=1e-6 * limit)
        with self.assertRaisesRegex(bristle.Error, "lay.to_over_fro = 3; allowed is 1, or SnapRule::slide"):
            batch.add(bristle.Material(), bristle.PatchOptions(lay=lay))

    def test_first_loading_follows_the_law(self):
        law = bristle.SnapLength.exponential(DBAR)
        x = np.linspace(0.0, 4.0, 41)
        # Bristles that redraw exponential lengths have no memory: the mean deflection is 1 - exp(-x).
        np.testing.assert_allclose(bristle.virgin_deflection(law, "redraw", x), 1.0 - np.exp(-x), atol=2e-6)
        np.testing.assert_allclose(law.survival(x * DBAR), np.exp(-x), rtol=1e-12)
        np.testing.assert_allclose(law.survival([[DBAR], [2 * DBAR]]), np.exp([[-1.0], [-2.0]]), rtol=1e-12)
        np.testing.assert_allclose(law.quantile(1.0 - np.exp(-x[1:])), x[1:] * DBAR, rtol=1e-12)

    def test_bristles_can_be_read(self):
        batch = bristle.PatchBatch()
        id_ = batch.add(material(bristle.SnapLength.uniform(8e-6, 12e-6)),
                        bristle.PatchOptions(max_normal_load=LOAD, bristles=500, precision="double"))
        step_once(batch, id_, 3e-6, -4e-6)
        x, y, delta = batch.read_bristles(id_)
        self.assertEqual((x.shape, y.shape, delta.shape), ((500,),) * 3)
        np.testing.assert_allclose(x, 3e-6, rtol=1e-12)
        np.testing.assert_allclose(y, -4e-6, rtol=1e-12)
        self.assertTrue(8e-6 <= delta.min() and delta.max() <= 12e-6)
        np.testing.assert_allclose(delta.mean(), 10e-6, rtol=2e-3)
        energy = 0.5 * 900 * LOAD * 82.05128205128205 * (5e-6) ** 2
        self.assertAlmostEqual(batch.stored_energy(id_) / energy, 1.0, places=9)

    def test_reset_makes_patches_as_new(self):
        batch = bristle.PatchBatch()
        ids = batch.add_many(3, bristle.Material(), bristle.PatchOptions(max_normal_load=LOAD))
        new = [batch.state_hash(i) for i in ids]
        first = slide(batch, ids, 3e-6, 20)
        batch.reset(ids[:2])
        self.assertEqual([batch.state_hash(i) == h for i, h in zip(ids, new)], [True, True, False])
        batch.reset(int(ids[2]))
        np.testing.assert_array_equal(slide(batch, ids, 3e-6, 20), first)
        with self.assertRaisesRegex(bristle.Error, "no patch with id 12345"):
            batch.reset([ids[0], 12345])


class States(unittest.TestCase):
    """Tests of every kind of batch: a trial gives what a step gives, and a saved state goes on with the same bits."""

    def kinds(self):
        """Yields for every kind its name, a function that makes a batch, and the trial and the step of a batch."""
        options, motions = bristle.PatchOptions(max_normal_load=LOAD), bristle.motions(1, LOAD)
        motions.displacement[:] = [7e-6, -4e-6]
        spin, slip = [[2e-6, 0.0, 1e-3, 0.9 * LOAD]], [[5e-4, 0, 0, 0, 0, 5.0]]

        def one_in(batch, *what, **more):
            motions.id[0] = batch.add(*what, **more)
            return batch

        def step(batch):
            responses = bristle.responses(1)
            batch.step(1e-3, motions, responses)
            return responses.end

        yield ("patches", lambda: one_in(bristle.PatchBatch(), bristle.Material(), options),
               lambda b: b.find_force(1e-3, motions).end, step)
        disc = bristle.Outline.disc(1e-3)
        yield ("outlines", lambda: one_in(bristle.ExtendedPatches(), bristle.Material(), disc, options),
               lambda b: b.find_force(1e-3, motions.id, spin)["end"], lambda b: b.step(1e-3, motions.id, spin)["end"])
        if HAS_TOOLS:
            pad, shape = bristle.BedMaterial(0.8).with_presliding(1e-3), bristle.BedShape.disc(6e-3)
            yield ("beds", lambda: one_in(bristle.BedBatch(), pad, shape, max_normal_load=5.0),
                   lambda b: b.find_force(motions.id, slip)["force"], lambda b: b.step(motions.id, slip)["force"])
            gear = bristle.JointMaterial(stiffness=300.0, viscous=0.01, base=0.4, motor=(0.1, 0.3))
            yield ("joints", lambda: bristle.JointFriction(1, gear),
                   lambda b: b.find_torque([0.01], motor=[1.0]), lambda b: b.step([0.01], motor=[1.0]))

    def test_a_trial_leaves_no_trace_and_a_saved_state_goes_on(self):
        for name, make, find, step in self.kinds():
            with self.subTest(kind=name):
                first, second = make(), make()
                step(first)
                before, state = first.state_hash(), first.save_state()
                self.assertIsInstance(state, bytes)
                trial = find(first)
                self.assertEqual(first.state_hash(), before)
                np.testing.assert_array_equal(step(first), trial)
                second.restore_state(state)
                self.assertEqual(second.state_hash(), before)
                np.testing.assert_array_equal(step(second), trial)
                with self.assertRaises(bristle.Error):
                    second.restore_state(state[:-1])


class Copies(unittest.TestCase):
    """Tests of pickles and copies: of materials, options, arrays and responses; a batch by its saved state."""

    LAWS = [bristle.SnapLength.single(DBAR), bristle.SnapLength.uniform(0.5 * DBAR, 1.5 * DBAR),
            bristle.SnapLength.normal(DBAR, 0.3 * DBAR), bristle.SnapLength.lognormal(DBAR, 0.3),
            bristle.SnapLength.exponential(DBAR), bristle.SnapLength.table([4e-6, 9e-6, 10e-6, 17e-6])]

    def copies_of(self, thing):
        return [pickle.loads(pickle.dumps(thing, protocol)) for protocol in range(pickle.HIGHEST_PROTOCOL + 1)] + [
            copy.copy(thing), copy.deepcopy(thing)]

    def test_what_is_compared_is_equal_in_every_way_of_copying(self):
        things = self.LAWS + [
            material(law, "keep", residual_length=1e-6, ageing_strength=0.1, ageing_form="saturating")
            for law in self.LAWS] + [
            bristle.Coefficients(kinetic=0.5, peak=0.55, fall_per_decade=0.01, rule="keep"),
            bristle.PatchOptions(max_normal_load=3.0, outputs="all", population="infinite", resolution=4.0, key=2**60,
                                 lay=bristle.Lay(angle=0.3, limit_ratio=2.0)),
            bristle.BedShape.ellipse(0.1, 0.08, pressure="parabolic").rolling(16, 8).grown("cube_root"),
            bristle.BedShape.from_list([[0.0, 1e-3], [1e-3, 0.0]], [1.0, 2.0], [3.0, 4.0]),
            bristle.JointMaterial(stiffness=300.0, viscous=0.01, motor=(0.1, 0.3), stribeck_speed=0.5)]
        for thing in things:
            for other in self.copies_of(thing):
                self.assertEqual(other, thing)
                self.assertIsNot(other, thing)
                self.assertEqual(repr(other), repr(thing))
                self.assertEqual(eval(repr(bristle.JointMaterial(motor=(1, 2))), vars(bristle)).motor, (1.0, 2.0))

    def test_what_has_no_equality_is_copied_with_every_attribute(self):
        outline = bristle.Outline.rectangle(1e-3, 2e-3, nx=2, ny=3)
        outline.full_size_load = 7.0
        soft = bristle.BedMaterial(0.9, 0.8).with_flexibility(1e-9, 2e-9, 3e-9).with_slip_stiffness(4.0, 5.0)
        soft.normal_modulus, soft.shear_modulus, soft.radius, soft.presliding = 6.0, 7.0, 8.0, 9.0
        for thing in (outline, soft):
            names = [name for name, member in vars(type(thing)).items() if isinstance(member, property)]
            self.assertGreater(len(names), 2)
            for other in self.copies_of(thing):
                for name in names:
                    np.testing.assert_array_equal(getattr(other, name), getattr(thing, name), name)

    def test_arrays_of_responses_stay_what_they_are(self):
        responses = bristle.responses(4)
        responses.end[2] = [1.0, 2.0]
        for other in (*self.copies_of(responses), responses[1:3], responses[[0, 2]], responses.copy()):
            self.assertIs(type(other), bristle.Responses)
            self.assertIs(type(other[1]), bristle.Response)
            self.assertEqual(other.dtype, bristle.response_dtype)
        for other in self.copies_of(responses[2]):
            self.assertIs(type(other), bristle.Response)
            self.assertEqual(other.end.tolist(), [1.0, 2.0])

    def test_a_batch_is_copied_by_its_saved_state_and_says_so(self):
        joints = bristle.JointFriction(1, bristle.JointMaterial(stiffness=1.0))
        for batch in (bristle.PatchBatch(), bristle.BedBatch(), bristle.ExtendedPatches(), joints):
            for use in (copy.copy, copy.deepcopy, pickle.dumps, lambda b: pickle.dumps(b, 0), lambda b: b.__reduce__()):
                with self.assertRaisesRegex(TypeError, type(batch).__name__ + r" is not copied .*restore_state\(\)"):
                    use(batch)
            self.assertFalse(hasattr(batch, "__setstate__"))  # which did nothing on a batch that is made

    def test_no_class_ends_the_interpreter(self):
        """Runs in a process of its own, which pybind11's base class ended."""
        code = """
import bristle, copyreg, pickle
made = [bristle.Material(), bristle.PatchBatch(), bristle.DeadlineMonitor(), bristle.BedMaterial(0.3)]
for thing in made:
    base = type(thing).__base__
    class Heir(base): pass
    for use in (base, Heir, lambda: copyreg._reduce_ex(thing, 0), lambda: object.__reduce_ex__(thing, 1),
                lambda: pickle.dumps(thing, 0), lambda: thing.__reduce__()):
        try:
            use()
        except TypeError:
            pass
print("alive")
"""
        ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        self.assertEqual((ran.stdout, ran.stderr), ("alive\n", ""))

    def test_a_class_without_constructor_says_where_its_objects_come_from(self):
        for name in ("FitEstimate", "FitResult", "PatchGroup", "SceneRun", "SnapLength", "StepReport"):
            with self.assertRaisesRegex(TypeError, f"cannot make a '.*{name}': functions and methods return such objects"):
                getattr(bristle, name)()
        for name, kind in vars(bristle).items():
            if isinstance(kind, type):
                try:
                    kind()
                except Exception as error:
                    self.assertNotIn("No constructor", str(error), name)

    def test_an_object_that_is_made_is_not_made_again_in_silence(self):
        for thing in (bristle.PatchBatch(), bristle.Material(), bristle.BedMaterial(0.3), bristle.JointMaterial()):
            with self.assertRaisesRegex(TypeError, "__init__ was called on an object that is made already"):
                thing.__init__()

    def test_things_that_differ_in_one_number_are_not_equal(self):
        self.assertNotEqual(bristle.SnapLength.lognormal(DBAR, 0.3), bristle.SnapLength.lognormal(DBAR, 0.4))
        self.assertNotEqual(bristle.PatchOptions(axes=1), bristle.PatchOptions())
        self.assertNotEqual(bristle.Material(viscous_friction=1.0), bristle.Material())

    def test_an_object_without_init_is_refused(self):
        """Checks that members of every class refuse objects whose __init__ was not called, as self and as arguments."""
        classes = [kind for _, kind in inspect.getmembers(bristle._bristle, inspect.isclass)
                   if type(kind).__name__ == "pybind11_type"]
        self.assertGreater(len(classes), 10)
        used = 0
        for kind in classes:
            for name, member in inspect.getmembers(kind):
                own = vars(kind).get(name)
                if own is None or isinstance(own, staticmethod) or name in ("__init__", "__new__"):
                    continue
                if not (callable(member) or isinstance(member, property)):
                    continue
                raw = kind.__new__(kind)
                if isinstance(member, property):
                    with self.assertRaisesRegex(TypeError, kind.__name__ + ": __init__ was not called"):
                        getattr(raw, name)
                    used += 1
                    continue
                for count in range(5):
                    with self.assertRaises((TypeError, ValueError)):
                        getattr(raw, name)(*[kind.__new__(kind)] * count)
                    used += 1
            with self.assertRaises(TypeError):
                pickle.dumps(kind.__new__(kind))
        self.assertGreater(used, 500)
        raw = bristle.PatchBatch.__new__(bristle.PatchBatch)
        for use in (len, lambda b: b.threads, lambda b: b.warm_up(), lambda b: b.add(bristle.Material()),
                    lambda b: b.save_state(), lambda b: b.restore_state(b"")):
            with self.assertRaisesRegex(TypeError, "PatchBatch: __init__ was not called"):
                use(raw)
        batch = bristle.PatchBatch()
        with self.assertRaisesRegex(TypeError, "Material: __init__ was not called"):
            batch.add(bristle.Material.__new__(bristle.Material))
        with self.assertRaisesRegex(TypeError, "PatchOptions: __init__ was not called"):
            batch.add(bristle.Material(), bristle.PatchOptions.__new__(bristle.PatchOptions))


class Words(unittest.TestCase):
    def test_a_repr_has_what_differs_from_the_defaults_and_can_be_evaluated(self):
        self.assertEqual(repr(bristle.Coefficients()), "Coefficients()")
        self.assertEqual(repr(bristle.Coefficients(kinetic=0.3, rule="keep")), "Coefficients(kinetic=0.3, rule='keep')")
        made = bristle.Material.from_coefficients(kinetic=0.31, peak=0.4)
        again = eval(repr(made), vars(bristle))
        for field in ("bristle_stiffness", "residual_length", "shared_renewal"):
            self.assertAlmostEqual(getattr(again, field) / getattr(made, field), 1.0, delta=1e-15)
        self.assertAlmostEqual(again.snap_length.mean / made.snap_length.mean, 1.0, delta=1e-15)

    def test_surfaces_have_names(self):
        self.assertEqual(bristle.Coefficients.typical("wood on wood"),
                         bristle.Coefficients(kinetic=0.3, peak=0.5, presliding_length=100e-6, bristles_per_newton=300))
        for name, source in bristle.typical_materials().items():
            self.assertTrue(source)
            bristle.Material.typical(name).validate()
        with self.assertRaisesRegex(bristle.Error, '"oak".*"wood on wood"'):
            bristle.Material.typical("oak")


class Outputs(unittest.TestCase):
    """Tests of outputs that a patch computes only on request, and of the errors for the others."""

    def step(self, *outputs):
        batch = bristle.PatchBatch()
        ids = [batch.add(bristle.Material(), bristle.PatchOptions(max_normal_load=LOAD, outputs=o)) for o in outputs]
        motions, responses = bristle.motions(ids, LOAD), bristle.responses(len(ids))
        motions.displacement[:, 0] = 1e-6
        batch.step(1e-3, motions, responses)
        return batch, ids, responses

    def test_mean_is_the_force_and_no_function(self):
        _, _, responses = self.step("mean", "all")
        stiffness = 900 * LOAD * 82.05128205128205
        # As no bristle snaps below 5 um, the mean force is that of a spring stretched from 0 to 1 um.
        np.testing.assert_allclose(responses.mean, [[-0.5e-6 * stiffness, 0.0]] * 2, rtol=1e-5)
        self.assertEqual(responses[1].mean[0], responses["mean"][1, 0])
        responses.mean[0] = 7.0  # responses.mean is a view, so this writes into the array
        self.assertEqual(responses["mean"][0, 1], 7.0)

    def test_what_was_not_asked_for_raises(self):
        batch, ids, responses = self.step("mean", "end", "energy")
        with self.assertRaisesRegex(bristle.Error, r'responses.mean of row 1: .*PatchOptions\(outputs="mean"\)'):
            responses.mean
        for name in ("dissipated", "contact_loss", "damper_work", "snaps"):
            with self.assertRaisesRegex(bristle.Error, rf'responses.{name} of row 0: .*outputs="energy"'):
                getattr(responses, name)
            self.assertEqual(getattr(responses[2], name), 0)
        self.assertTrue(np.isnan(responses["mean"][1]).all())
        responses[:1].mean
        with self.assertRaisesRegex(bristle.Error, "responses.mean: no step"):
            responses[1].mean
        trial = batch.find_force(1e-3, bristle.motions(ids[1], LOAD))
        with self.assertRaisesRegex(bristle.Error, "responses.mean"):
            trial.mean
        for name in ("dissipated", "contact_loss", "damper_work"):
            self.assertTrue(np.isnan(trial[name]).all(), name)
        for name in ("mean", "dissipated", "contact_loss", "damper_work"):
            self.assertTrue(np.isnan(bristle.responses(2)[name]).all(), name)

    @unittest.skipUnless(HAS_TOOLS, "the module was built without the tools")
    def test_each_patch_of_a_scene_has_its_own_outputs(self):
        patch = ('[[patch]]\nname = "{0}"\nmaterial = "m"\nmax_normal_load = 1.0\nbristles = 10\noutputs = [{1}]\n'
                 '[[motion]]\npatch = "{0}"\ntype = "ramp"\nvelocity = 1e-3\nload = 1.0\n')
        with tempfile.TemporaryDirectory() as folder:
            scene = pathlib.Path(folder) / "two.toml"
            scene.write_text('[scene]\nname = "two"\ndt = 1e-3\nduration = 0.01\n[[material]]\nname = "m"\nkinetic = 0.4\n'
                             'peak = 0.46\npresliding_length = 1e-5\n' + patch.format("a", '"mean"') +
                             patch.format("b", '"energy"'))
            found = bristle.run_scene(scene).responses
        self.assertEqual([np.isnan(found[name]["mean"]).any() for name in "ab"], [False, True])
        self.assertEqual([np.isnan(found[name]["dissipated"]).any() for name in "ab"], [True, False])


class Extent(unittest.TestCase):
    """Tests of patches with an extent, which also transmit a torque."""

    def setUp(self):
        self.material = bristle.Material(
            bristle_stiffness=1.0, bristle_damping=0.0, viscous_friction=0.0, normal_stiffness=1e6,
            asperity_height_deviation=1e-6, snap_length=bristle.SnapLength.lognormal(1e-5, 0.3))
        self.options = bristle.PatchOptions(max_normal_load=1000.0, population="infinite", outputs="all",
                                           precision="double")
        self.radius = 1e-3

    def test_each_part_of_a_response_and_of_info_is_its_own(self):
        # Outline of two cells at distances a and -a from the middle. Each has half of 1000 bristles of 1 N/m and c N
        # s/m.
        a, c, spin = 1e-3, 0.25, 2e-6
        damped = copy.copy(self.material)
        damped.bristle_damping = c
        patches = bristle.ExtendedPatches()
        pad = patches.add(damped, bristle.Outline([[a, 0.0], [-a, 0.0]], [0.5, 0.5]), self.options)
        # Takes a step of 1e6 s, so slow that the damper force is 0.
        out = patches.step(1e6, [pad], [[0.0, 0.0, spin, 1000.0]])
        torque = 1000.0 * a * a * spin
        np.testing.assert_allclose(out["elastic"][0], [0.0, 0.0, -torque], rtol=1e-6, atol=1e-6 * torque)
        np.testing.assert_allclose(out["mean"][0], [0.0, 0.0, -0.5 * torque], rtol=1e-6, atol=1e-6 * torque)
        np.testing.assert_allclose(out["damping"][0].diagonal(), [1000.0 * c, 1000.0 * c, 1000.0 * c * a * a], rtol=1e-6)
        np.testing.assert_allclose(out["stiffness"][0].diagonal(), [1000.0, 1000.0, 1000.0 * a * a], rtol=1e-6)
        self.assertAlmostEqual(out["torque_limit"][0] / (a * out["force_limit"][0]), 1.0, places=12)
        patches.step(1e-3, [pad], [[0.0, 0.0, 0.0, 600.0]])
        info = patches.info(pad)
        self.assertEqual((info["cells"], info["normal_load"]), (2, 600.0))
        self.assertAlmostEqual(info["max_normal_load"], 1000.0, delta=1e-9)
        np.testing.assert_allclose(info["along"], [1.0, spin], rtol=1e-9)

    def test_outlines_lie_as_they_are_named_and_options_reach_the_batch(self):
        far = lambda outline: np.abs(outline.positions).max(axis=0)
        for outline in (bristle.Outline.ellipse(2e-3, 1e-3), bristle.Outline.rectangle(2e-3, 1e-3)):
            self.assertAlmostEqual(far(outline)[0] / far(outline)[1], 2.0, delta=0.1)
        grid = bristle.Outline.rectangle(1e-3, 1e-3, nx=4, ny=2).positions
        self.assertEqual([len(np.unique(grid[:, axis])) for axis in (0, 1)], [4, 2])
        for wrong in (dict(isa="none"), dict(threads=-1)):
            with self.assertRaises(bristle.Error):
                bristle.ExtendedPatches(**wrong)

    def test_a_scale_that_cannot_be_is_refused(self):
        patches = bristle.ExtendedPatches()
        pad = patches.add(self.material, bristle.Outline.disc(self.radius), self.options)
        patches.set_scale(pad, 2.0)
        for id_, scale in ((pad, -1.0), (pad + 1, 1.0)):
            with self.assertRaisesRegex(bristle.Error, "allowed is 0 to 1e6"):
                patches.set_scale(id_, scale)

    def test_cells_can_be_given_and_must_sum_to_one(self):
        outline = bristle.Outline([[1e-3, 0.0], [-1e-3, 0.0]], [0.5, 0.5])
        self.assertEqual(len(outline), 2)
        np.testing.assert_array_equal(outline.positions, [[1e-3, 0.0], [-1e-3, 0.0]])
        patches = bristle.ExtendedPatches()
        patches.add(self.material, outline, self.options)
        with self.assertRaisesRegex(bristle.Error, "sum of weights"):
            patches.add(self.material, bristle.Outline([[0.0, 0.0]], [0.5]), self.options)
        with self.assertRaisesRegex(bristle.Error, r"shape \(n, 2\)"):
            bristle.Outline([1.0, 2.0], [1.0])
        with self.assertRaisesRegex(bristle.Error, '"uniform", "hertz"'):
            bristle.Outline.disc(1e-3, pressure="round")
        with self.assertRaisesRegex(bristle.Error, r"\(n, 4\)"):
            patches.step(1e-3, [1], [[0.0, 0.0, 0.0]])
        self.assertEqual(len(patches), 1)


class Threads(unittest.TestCase):
    def test_a_program_may_end_while_a_daemon_thread_steps(self):
        code = f"""
import threading, time
import bristle
def forever(step):
    while True:
        step()
batch, beds = bristle.PatchBatch(), bristle.BedBatch()
ids = batch.add_many(4, bristle.Material(), bristle.PatchOptions(max_normal_load=1.0, bristles=200000))
motions, responses = bristle.motions(ids, 1.0), bristle.responses(4)
motions.displacement[:, 0] = 3e-4
pad = beds.add(bristle.BedMaterial(0.8).with_presliding(1e-3), bristle.BedShape.disc(6e-3, rings=60), max_normal_load=5.0)
outline = bristle.Outline.disc(1e-3, rings=40)
work = [lambda: batch.step(1e-3, motions, responses), lambda: beds.step([pad], [[5e-4, 0, 0, 0, 0, 5.0]]),
        lambda: outline.positions]
if {HAS_TOOLS}:
    work += [lambda: bristle.run_scene({str(SCENES / "stroke.toml")!r}, steps=400000, out_patches=0)] * 12
for one in work:
    threading.Thread(target=forever, args=(one,), daemon=True).start()
time.sleep(0.15)
"""
        for _ in range(8):
            ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
            self.assertEqual((ran.returncode, ran.stderr), (0, ""))

    def long_step(self):
        """Returns a batch, arrays for its step, and a duration, such that a call takes a tenth of a second or more."""
        batch = bristle.PatchBatch()
        law = bristle.SnapLength.lognormal(DBAR, 1.0)
        id_ = batch.add(material(law, "redraw"), bristle.PatchOptions(max_normal_load=LOAD, bristles=4_000_000))
        motions, responses = bristle.motions(id_, LOAD), bristle.responses(1)
        motions.displacement[:, 0] = 30 * DBAR
        batch.warm_up()
        batch.step(1e-3, motions, responses)  # touches the memory for the first time, which is slow
        return batch, motions, responses

    def during_a_long_step(self, body):
        """Runs body() repeatedly in a second thread. Returns the results of calls made during a long step."""
        batch, motions, responses = self.long_step()
        stop, ready, seen = threading.Event(), threading.Event(), []

        def work():
            while not stop.is_set():
                seen.append((time.perf_counter(), body(batch), time.perf_counter()))
                ready.set()

        thread = threading.Thread(target=work)
        thread.start()
        ready.wait()
        start = time.perf_counter()
        batch.step(1e-3, motions, responses)
        end = time.perf_counter()
        stop.set()
        thread.join()
        margin = 0.1 * (end - start)
        return [result for begun, result, done in seen if start + margin < begun and done < end - margin]

    def test_another_thread_goes_on_while_a_step_runs(self):
        self.assertGreater(len(self.during_a_long_step(lambda batch: None)), 10)

    def test_another_thread_may_add_but_not_step_while_a_step_runs(self):
        def attempt(batch):
            batch.add(bristle.Material(), bristle.PatchOptions(bristles=10))
            time.sleep(0.002)
            if repr(batch) != f"<bristle.PatchBatch: 1 thread, {batch.isa}>":
                return "counted"
            if "another thread is using this object" not in batch._repr_html_():
                return "shown"
            try:
                batch.state_hash()
                return "read"
            except bristle.Error as error:
                return str(error)

        results = self.during_a_long_step(attempt)
        self.assertTrue(results)
        for result in results:
            self.assertIn("another thread is using this object", result)


@unittest.skipUnless(HAS_TOOLS, "the module was built without the tools")
class Fit(unittest.TestCase):
    """Data and fit of one record: friction of a known material along a decaying oscillation, with a sensor's noise."""

    @classmethod
    def setUpClass(cls):
        cls.made_of = bristle.Material.from_coefficients(kinetic=0.5, peak=0.55, presliding_length=20e-6)
        batch = bristle.PatchBatch()
        id_ = batch.add(cls.made_of, bristle.PatchOptions(max_normal_load=LOAD, bristles=4000, axes=1))
        motions, responses = bristle.motions(id_, LOAD), bristle.responses(1)
        cls.t = 1e-3 * np.arange(1, 1501)
        cls.x = 200e-6 * np.sin(2 * np.pi * cls.t) * np.exp(-0.5 * cls.t)
        cls.force = np.random.default_rng(1).normal(0.0, 2e-3, cls.t.size)
        for k, dx in enumerate(np.diff(cls.x, prepend=0.0)):
            motions.displacement[:, 0] = dx
            batch.step(1e-3, motions, responses)
            cls.force[k] += responses.end[0, 0]
        cls.found = bristle.fit(cls.t, cls.x, cls.force, LOAD)

    def test_a_fit_finds_what_the_data_were_made_of(self):
        for name, truth, width in (("kinetic", 0.5, 0.02), ("sensor_offset", 0.0, 0.02),
                                   ("stiffness_per_newton", 900 * self.made_of.bristle_stiffness, 0.07)):
            estimate = self.found.parameters[name]
            self.assertTrue(estimate.determined, name)
            self.assertTrue(estimate.low <= truth <= estimate.high, (name, estimate))
            self.assertLess(estimate.high - estimate.low, width * max(truth, 1.0), name)
        self.assertAlmostEqual(self.found.material.kinetic_coefficient(), self.found.parameters["kinetic"].value)
        self.assertGreater(self.found.explained, 0.999)
        # As the file's forces were declared as those by the body, the fit reverses their sign.
        np.testing.assert_array_equal(self.found.force, -self.force)
        residuals = self.found.force - self.found.curve
        self.assertAlmostEqual(np.sqrt(np.mean(residuals**2)), self.found.residual_rms, places=12)
        with self.assertRaises(ValueError):
            self.found.curve[0] = 0.0

    def test_a_fit_says_what_the_data_do_not_determine(self):
        left = self.found.not_determined
        self.assertLessEqual({"damping_per_newton", "stribeck_velocity", "viscous_friction"}, set(left))
        self.assertTrue({"sensor_offset_y", "sensor_drift_y"}.isdisjoint(left))  # the record has one axis
        for estimate in left.values():
            self.assertEqual((estimate.determined, estimate.low, estimate.high), (False, None, None))
            self.assertTrue(estimate.why)
        for name in ("damping_per_newton", "stribeck_velocity", "viscous_friction"):
            self.assertIn("not seen between", left[name].why)
        self.assertEqual(self.found.report["parameters"]["kinetic"]["value"], self.found.parameters["kinetic"].value)
        self.assertIn("not determined by these data", str(self.found))

    def test_a_fit_goes_to_other_libraries(self):
        kinetic = self.found.parameters["kinetic"]
        if importlib.util.find_spec("pandas"):
            self.assertEqual(self.found.to_pandas().loc["kinetic", ["value", "low", "high"]].tolist(),
                             [kinetic.value, kinetic.low, kinetic.high])
        stand_in = types.SimpleNamespace(Dataset=lambda data, places: (data, places))
        with unittest.mock.patch.dict(sys.modules, xarray=stand_in):
            data, places = self.found.to_xarray()
        self.assertEqual((list(data), places), (["value", "low", "high", "determined", "why"],
                                                {"parameter": list(self.found.parameters)}))
        for k, estimate in enumerate(self.found.parameters.values()):
            for name, (over, values) in data.items():
                wanted = getattr(estimate, name)
                self.assertEqual(over, "parameter")
                self.assertTrue(np.isnan(values[k]) if wanted is None else values[k] == wanted, (name, estimate))
        self.assertTrue(np.isnan(data["low"][1]).any())

    def test_a_fit_holds_residual_and_renewal(self):
        held = bristle.fit(self.t, self.x, self.force, LOAD, residual=0.0, renewal=0.25)
        for name, value in (("residual_share", 0.0), ("shared_renewal", 0.25)):
            self.assertEqual(held.parameters[name].value, value)
            self.assertEqual(held.not_determined[name].why, "held")
        self.assertEqual((held.material.residual_length, held.material.shared_renewal), (0.0, 0.25))
        # Holding the residual or the renewal at 0 must fit worse, as the true values are 0.1 and 1.
        self.assertGreater(held.residual_rms, self.found.residual_rms)

    def test_a_file_and_arrays_of_the_same_numbers_give_the_same_fit(self):
        t, x, force = self.t[::4], self.x[::4], self.force[::4]
        held = dict(residual=0.1, renewal=1.0)  # held, so that the search is short
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "measured.csv"
            np.savetxt(file, np.column_stack([t, x, force]), "%.17g", ",", header="t,x,force", comments="")
            of_file = bristle.fit(file, load=LOAD, **held)
            with self.assertRaisesRegex(bristle.Error, "no column load"):
                bristle.fit(str(file))
        of_columns = bristle.fit(t, x, force, np.full(t.size, LOAD), **held)
        of_number = bristle.fit(t, x, force, LOAD, **held)
        self.assertFalse(of_number.curve.flags.writeable)
        for other in (of_file, of_columns):
            self.assertEqual(other.material, of_number.material)
            np.testing.assert_array_equal(other.curve, of_number.curve)

    def test_a_file_in_words_of_its_own_gives_the_same_fit(self):
        held = dict(residual=0.1, renewal=1.0)  # held, so that the search is short
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "measured.csv"
            t, x, force = self.t[::4], self.x[::4], self.force[::4]
            rows = np.column_stack([1e3 * t, 1e6 * x, force])
            np.savetxt(file, rows, "%.17g", ";", header="Zeit;Weg;Kraft", comments="")
            found = bristle.fit([file], load=LOAD, columns={"t": "Zeit", "x": "Weg", "force": "Kraft"},
                                units={"t": "ms", "x": "um"}, **held)
        of_arrays = bristle.fit(t, x, force, LOAD, **held)
        self.assertAlmostEqual(found.parameters["kinetic"].value, of_arrays.parameters["kinetic"].value, places=6)
        self.assertEqual(found.not_determined["residual_share"].why, "held")
        self.assertIn("x = 'Weg' in um", found.understood[0])
        self.assertIn("cells between semicolons", found.understood[0])

    def test_a_disc_has_less_torque_than_a_ring_of_its_radius(self):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "torque.csv"
            rows = np.column_stack([self.t, self.x / 0.02, 0.02 * self.force])[::4]
            np.savetxt(file, rows, "%.17g", ",", header="t,angle,torque", comments="")
            held = dict(load=LOAD, residual=0.1, renewal=1.0)
            ring, disc = bristle.fit(file, radius=0.02, **held), bristle.fit(file, disc=0.02, **held)
            with self.assertRaisesRegex(bristle.Error, "radius and disc together"):
                bristle.fit(file, radius=0.02, disc=0.02)
        ratio = disc.parameters["kinetic"].value / ring.parameters["kinetic"].value
        self.assertAlmostEqual(ratio, 1.5, delta=0.05)
        self.assertIn("full disc", " ".join(disc.understood))

    def test_what_is_told_of_sensors_reaches_the_fit(self):
        t, x = self.t[::3], self.x[::3]
        force = 3.0 * np.gradient(np.gradient(x, t), t) - self.force[::3]
        found = bristle.fit(t, x, force, LOAD, mass=3.0, residual=0.1, renewal=1.0,
                            damper_decay="gaussian", rule="redraw")
        self.assertAlmostEqual(found.parameters["kinetic"].value, 0.5, delta=0.02)
        self.assertIn("inertia of 3 kg taken off the force", " ".join(found.understood))
        self.assertEqual(found.material.damper_decay, "gaussian")
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "measured.csv"
            file.write_text("t,x,load,force\n0,0,1,1\n1,0,-0.5,1\n")
            with self.assertRaisesRegex(bristle.Error, "allowed: -0.25 N or more"):
                bristle.fit(file, clip_load=0.25)
            file.write_text("x,force\n0,1\n1,-1\n")
            with self.assertRaisesRegex(bristle.Error, "2 data rows; a fit needs"):
                bristle.fit(file, rate=100.0, load=LOAD)

    def test_data_that_cannot_be_fitted_are_refused_by_name(self):
        t, x, force = self.t, self.x, self.force
        nan = force.copy()
        nan[7] = np.nan
        refused = [
            (lambda: bristle.fit(t, x, force[:-1], LOAD), "column force has 1499 rows, column t 1500"),
            (lambda: bristle.fit(t, x, nan, LOAD), "row 7: column force is nan N; allowed: -1000000000"),
            (lambda: bristle.fit(t, x, force, np.full(t.size, -1.0)), "row 0: column load: -1 is negative"),
            (lambda: bristle.fit(t, x, force, 0.0), "load is 0.0; allowed: 1e-09 to 1000000000.0 N"),
            (lambda: bristle.fit(t, x, force, LOAD, residual=1.0), "residual is 1.0; allowed: 0.0 to 0.95 or None"),
            (lambda: bristle.fit(t, x, force, LOAD, renewal=-1.0), "renewal is -1.0; allowed: 0.0 to 8.0 or None"),
            (lambda: bristle.fit(t, x, force, LOAD, rule="keep", renewal=1.0), "rule is keep; allowed: redraw, slide"),
            (lambda: bristle.fit("/nowhere/data.csv"), "/nowhere/data.csv: cannot be read"),
            (lambda: bristle.fit([]), "file is an empty list"),
            (lambda: bristle.fit(t, x, force, LOAD, mass=-1.0), "mass is -1.0; allowed: 0.0 to 1000000.0 kg"),
        ]
        for call, message in refused:
            with self.assertRaisesRegex(bristle.Error, message):
                call()


@unittest.skipUnless(HAS_TOOLS, "the module was built without the tools")
class Scenes(unittest.TestCase):
    def test_a_scene_says_what_it_holds(self):
        scene = bristle.Scene(SCENES / "two_surfaces.toml")
        self.assertEqual((scene.name, scene.patches), ("two_surfaces", ["steel_pad", "rubber_pad"]))
        self.assertEqual(scene.dt * scene.steps, bristle.Scene(str(SCENES / "two_surfaces.toml")).run().t[-1])
        for material in scene.materials.values():
            material.validate()
        with self.assertRaisesRegex(bristle.Error, "/nowhere.toml: cannot be read"):
            bristle.Scene("/nowhere.toml")

    @unittest.skipUnless(COMMAND_LINE.exists(), "no command line beside the module")
    def test_a_run_has_the_hash_and_the_forces_of_the_command_line(self):
        for name, steps in (("stroke", 1500), ("block_on_floor", 700), ("two_surfaces", 300), ("fingertip", 300)):
            with tempfile.TemporaryDirectory() as folder:
                out = pathlib.Path(folder) / "forces.csv"
                printed = command_line("run", SCENES / f"{name}.toml", "--steps", str(steps), "--out", out)
                rows = list(csv.DictReader(out.read_text().splitlines()))
            run = bristle.run_scene(SCENES / f"{name}.toml", steps=steps)
            self.assertIn(f"state hash  {run.state_hash:016x}\n", printed)
            self.assertEqual(run.steps, steps)
            self.assertEqual(set(run.forces), {row["patch"] for row in rows})
            for patch, forces in run.forces.items():
                own = [row for row in rows if row["patch"] == patch]
                np.testing.assert_allclose(forces[:, 0], [float(row["fx"]) for row in own], rtol=1e-6, atol=1e-9)
                np.testing.assert_allclose(run.motions[patch].normal_load, [float(row["load"]) for row in own],
                                           rtol=1e-6)
                np.testing.assert_allclose(run.t, [float(row["t"]) for row in own], rtol=1e-6)

    def test_other_libraries_get_each_axis(self):
        """Tests conversions for libraries by stand-ins, since a machine may lack the libraries."""
        run = types.SimpleNamespace(
            forces={"p": np.array([[3.0, -4.0]])}, t=np.array([0.1]), steps=1, state_hash=0,
            motions={"p": {"displacement": np.array([[1.0, 2.0]]), "normal_load": np.array([5.0])}})
        stand_in = types.SimpleNamespace(DataFrame=dict, Dataset=lambda data, places: data)
        with unittest.mock.patch.dict(sys.modules, pandas=stand_in, xarray=stand_in):
            frame, data = bristle._words._run_to_pandas(run), bristle._words._run_to_xarray(run)
        self.assertEqual([frame[f"p.{name}"][0] for name in ("fx", "fy", "dx", "dy", "load")], [3.0, -4.0, 1.0, 2.0, 5.0])
        self.assertEqual(data["displacement"][1].tolist(), [[[1.0, 2.0]]])
        self.assertEqual((data["load"][1].tolist(), data["load"][2]), ([[5.0]], {"units": "N"}))

    def test_a_run_takes_the_options_of_the_command_line(self):
        scene = bristle.Scene(SCENES / "stroke.toml")
        whole = scene.run(steps=200)
        self.assertEqual(scene.run(steps=200, isa="scalar", threads=2).state_hash, whole.state_hash)
        self.assertEqual(whole.report["state_hash"], f"{whole.state_hash:016x}")
        self.assertEqual(scene.run(steps=2, threads=2).report["conditions"]["threads"], 2)
        with tempfile.TemporaryDirectory() as folder:
            trace = pathlib.Path(folder) / "trace.csv"
            trace.write_text("t,x,load\n0,0,1\n0.1,1e-5,-0.01\n")
            with self.assertRaisesRegex(bristle.Error, "load: -0.01 is negative"):
                scene.run(trace=trace)
            self.assertEqual(scene.run(trace=trace, clip_load=0.1).motions["fingertip"].normal_load[-1], 0.0)
        few = scene.run(steps=200, bristles=7, out_patches=0)
        self.assertEqual((few.report["bristles"], few.forces), (7, {}))
        for options, message in (({"steps": 0}, "steps is 0"), ({"bristles": 0}, "bristles is 0; allowed: 1 to"),
                                 ({"threads": -2}, "threads = -2"), ({"isa": "abacus"}, "isa = abacus"),
                                 ({"trace": "/nowhere.csv"}, "/nowhere.csv")):
            with self.assertRaisesRegex(bristle.Error, message):
                scene.run(**options)

    def test_another_thread_can_end_a_run_a_sweep_and_an_experiment(self):
        # A shell starts background processes with SIGINT ignored, so this sets the default handler.
        self.addCleanup(signal.signal, signal.SIGINT, signal.signal(signal.SIGINT, signal.default_int_handler))
        stroke = SCENES / "stroke.toml"
        for long_work in (  # each 15 s or more unless interrupted
                lambda: bristle.run_scene(stroke, steps=400_000, out_patches=0),
                lambda: bristle.sweep(stroke, {"scene.dt": [1e-3, 2e-3]}, steps=400_000, threads=1),
                lambda: bristle.experiment("rubbing", dt=1e-4)):
            # The timer's thread can run only if the work releases the interpreter's lock.
            timer = threading.Timer(0.2, os.kill, (os.getpid(), signal.SIGINT))
            start = time.perf_counter()
            timer.start()
            with self.assertRaises(KeyboardInterrupt):
                long_work()
            self.assertLess(time.perf_counter() - start, 3.0)


class Groups(unittest.TestCase):
    def setUp(self):
        self.material = bristle.Material(snap_rule="slide")
        self.options = bristle.PatchOptions(max_normal_load=2.0, bristles=8, outputs="all")
        self.n = 37

    def moves(self, k):
        random = np.random.default_rng(k)
        return random.normal(0.0, 1e-5, (2, self.n)), random.uniform(0.0, 2.5, self.n)

    def test_they_are_patches_behind_arrays(self):
        one, other = bristle.PatchBatch(), bristle.PatchBatch()
        group = one.add_group(self.n, self.material, self.options)
        ids = other.add_many(self.n, self.material, self.options)
        self.assertEqual(len(group), self.n)
        self.assertEqual(repr(group), "<bristle.PatchGroup of 37 contacts>")
        self.assertRaises(IndexError, lambda: group[self.n])
        end, mean, lost = np.empty((2, self.n)), np.empty((2, self.n)), np.empty(self.n)
        snaps, status = np.empty(self.n, dtype=np.uint64), np.empty(self.n, dtype=np.uint32)
        motions, responses = bristle.motions(ids), bristle.responses(self.n)
        for k in range(20):
            move, load = self.moves(k)
            motions.displacement, motions.normal_load = move.T, load
            other.step(1e-3, motions, responses)
            trial = one.find_group_force(1e-3, group, move, load)
            result = one.step_group(1e-3, group, move, load, end=end, mean=mean, dissipated=lost, snaps=snaps,
                                    status=status)
            self.assertIs(result, end)
            np.testing.assert_array_equal(end, trial)
            np.testing.assert_array_equal(end.T, responses.end)
            np.testing.assert_array_equal(mean.T, responses.mean)
            np.testing.assert_array_equal(lost, responses.dissipated)
            np.testing.assert_array_equal(snaps, responses.snaps)
            np.testing.assert_array_equal(status, responses.status)
        self.assertEqual(one.state_hash(group[5]), other.state_hash(int(ids[5])))

    def test_some_of_a_group_move(self):
        batch = bristle.PatchBatch()
        group = batch.add_group(self.n, self.material, self.options)
        end = np.full((2, self.n), 9.0)
        batch.step_group(1e-3, group, *self.moves(1), which=[4, 20], end=end)
        self.assertEqual(set(np.flatnonzero(end[0] != 9.0)), {4, 20})
        before = batch.state_hash()
        batch.step_group(1e-3, group, *self.moves(2), which=[])
        self.assertEqual(batch.state_hash(), before)
        with self.assertRaisesRegex(bristle.Error, "which: the group has no contact 37"):
            batch.step_group(1e-3, group, *self.moves(2), which=[37])
        with self.assertRaisesRegex(bristle.Error, "displacement: an array of 74 numbers is needed"):
            batch.step_group(1e-3, group, np.zeros(37), np.zeros(37))
        with self.assertRaisesRegex(bristle.Error, "snaps: a numpy array of uint64 is needed"):
            batch.step_group(1e-3, group, *self.moves(2), snaps=np.zeros(37))
        move, load = self.moves(3)
        with self.assertRaisesRegex(bristle.Error, "end: the array shares memory with displacement"):
            batch.step_group(1e-3, group, move, load, end=move)

    def test_they_are_changed_and_removed_together(self):
        batch = bristle.PatchBatch()
        group = batch.add_group(self.n, self.material, self.options)
        force = batch.step_group(1e-3, group, *self.moves(1))
        batch.set_group_material(group, bristle.Material(snap_rule="slide", bristle_stiffness=1e-9))
        self.assertGreater(abs(force).max(), 1e3 * abs(batch.step_group(1e-3, group, *self.moves(1))).max())
        self.assertRaises(bristle.Error, batch.remove, group[0])
        batch.remove_group(group)
        self.assertEqual(len(batch), 0)
        with self.assertRaisesRegex(bristle.Error, "group: it has been removed"):
            batch.step_group(1e-3, group, *self.moves(1))


@unittest.skipUnless(HAS_TOOLS, "the module was built without the tools")
class Joints(unittest.TestCase):
    def gear(self):
        return bristle.JointMaterial(stiffness=300.0, viscous=0.01, base=0.4, motor=(0.1, 0.3), outside=(0.05, 0.08),
                                     static_base=0.2, stribeck_speed=0.5)

    def test_they_are_stepped_in_place(self):
        n = 100
        joints = bristle.JointFriction(n, [self.gear()], gradients=True)
        self.assertEqual(len(joints), n)
        angle, torque, mean = np.zeros(n), np.full(n, 9.0), np.empty(n)
        by_angle, gradient, status = np.empty(n), np.empty((13, n)), np.full(n, 9, dtype=np.uint32)
        motor = np.linspace(-1.0, 1.0, n)
        joints.step(angle, motor=motor)
        angle += 1.0
        result = joints.step(angle, np.full(n, 1e3), motor, torque=torque, mean=mean, by_angle=by_angle,
                             gradient=gradient, status=status)
        self.assertIs(result, torque)
        np.testing.assert_allclose(torque, -(0.4 + np.where(motor > 0, 0.1, 0.3) * abs(motor)) - 10.0, rtol=1e-13)
        np.testing.assert_array_equal(by_angle, 0.0)
        np.testing.assert_array_equal(status, 0)
        row = joints.parameter_names.index("base")
        np.testing.assert_allclose(gradient[row], -1.0, rtol=1e-13)
        # Expected derivatives of the friction -(0.4 + share |motor|) - 0.01 speed, while all bristles slide.
        by_speed, by_motor = np.empty(n), np.empty(n)
        joints.step(angle + 1.0, np.full(n, 1e3), motor, by_speed=by_speed, by_motor=by_motor)
        np.testing.assert_allclose(by_speed, -0.01, rtol=1e-9)
        np.testing.assert_allclose(by_motor, np.where(motor > 0, -0.1, 0.3), rtol=1e-9)

    def test_the_spread_of_a_joint_rounds_its_break_away(self):
        half = [bristle.JointFriction(1, self.gear(), spread=spread) for spread in (0.1, 1.0)]
        for joint in half:
            joint.step([0.0])
        narrow, wide = (joint.step([1e-3])[0] for joint in half)
        self.assertLess(narrow, 1.05 * wide)  # bristles of a wide law slide before those of a narrow one

    def test_materials_and_resets(self):
        gear = self.gear()
        self.assertEqual(gear.motor, (0.1, 0.3))
        gear.motor = (0.2, 0.4)
        self.assertEqual(gear.numbers[3:5], [0.2, 0.4])
        self.assertEqual(len(gear.numbers), len(bristle.JointFriction.parameter_names))
        self.assertEqual(eval(repr(gear), vars(bristle)).numbers, gear.numbers)
        joints = bristle.JointFriction(2, [gear, self.gear()])
        self.assertEqual(repr(joints), "<bristle.JointFriction of 2 joints>")
        joints.step([0.0, 0.0])
        torque = joints.step([0.01, 0.01], motor=[1.0, 1.0])
        self.assertLess(torque[0], torque[1])
        joints.reset(0)
        self.assertNotEqual(joints.state_hash(0), joints.state_hash(1))

    def test_what_cannot_be_is_refused(self):
        with self.assertRaisesRegex(bristle.Error, "stiffness"):
            bristle.JointFriction(1, bristle.JointMaterial())
        joints = bristle.JointFriction(2, self.gear())
        with self.assertRaisesRegex(bristle.Error, "angle"):
            joints.step([1.0])
        with self.assertRaisesRegex(bristle.Error, "torque.*float64"):
            joints.step([1.0, 1.0], torque=np.zeros(2, dtype=np.float32))
        with self.assertRaisesRegex(bristle.Error, "torque.*one after the other"):
            joints.step([1.0, 1.0], torque=np.zeros(4)[::2])
        both = np.zeros(3)
        for shared in (dict(angle=both[:2], torque=both[1:]), dict(angle=[1.0, 1.0], torque=both[:2], mean=both[:2]),
                       dict(angle=[1.0, 1.0], outside=both[:2], by_motor=both[1:])):
            with self.assertRaisesRegex(bristle.Error, "the array shares memory with "):
                joints.step(**shared)
        with self.assertRaisesRegex(bristle.Error, "gradients=True"):
            joints.step([1.0, 1.0], gradient=np.zeros((13, 2)))
        read_only = np.zeros(2)
        read_only.flags.writeable = False
        with self.assertRaisesRegex(bristle.Error, "torque: a writeable array"):
            joints.step([1.0, 1.0], torque=read_only)
        with self.assertRaisesRegex(bristle.Error, "no such joint"):
            joints.reset(2)
        with self.assertRaises(TypeError):
            bristle.JointFriction.__new__(bristle.JointFriction).step([1.0])


@unittest.skipUnless(HAS_TOOLS, "the module was built without the tools")
class Beds(unittest.TestCase):
    def setUp(self):
        self.beds = bristle.BedBatch()
        self.pad = self.beds.add(bristle.BedMaterial(0.8).with_presliding(1e-3), bristle.BedShape.disc(6e-3),
                                 max_normal_load=5.0)

    def test_a_pad_slips_from_its_rim(self):
        out = self.beds.step([self.pad], [[5e-4, 0, 0, 0, 0, 5.0]])
        self.assertEqual(out["status"][0], 0)
        self.assertTrue(0.2 < out["slipping_share"][0] < 0.9)
        self.assertTrue(-4.0 < out["force"][0, 0] < -2.0)
        self.assertEqual(out["tangent"].shape, (1, 3, 3))
        bristles = self.beds.bristles(self.pad)
        self.assertAlmostEqual(-(bristles["stiffness"] * bristles["deflection"][:, 0]).sum(), out["force"][0, 0], 5)
        after = self.beds.step([self.pad], [[1e-3, 0, 0, 0, 0, 5.0]])
        self.assertAlmostEqual(after["force"][0, 0], -4.0, 4)
        self.assertEqual(self.beds.info(self.pad)["normal_load"], 5.0)
        self.assertEqual(self.beds.info(self.pad)["half"], (6e-3, 6e-3))
        self.beds.reset(self.pad)
        self.assertFalse(self.beds.bristles(self.pad)["deflection"].any())
        self.assertEqual(self.beds.info(self.pad)["normal_load"], 0.0)
        with self.assertRaisesRegex(bristle.Error, "no such bed"):
            self.beds.reset(77)

    def test_spin_and_options_of_a_bed_arrive(self):
        turned = self.beds.step([self.pad], [[0, 0, 1.0, 0, 0, 5.0]])
        # Expected torque of a disc under Hertz's pressure that slides everywhere: 3 pi / 16 of friction, load and
        # radius.
        self.assertAlmostEqual(turned["torque"][0] / (-3 * math.pi / 16 * 0.8 * 5.0 * 6e-3), 1.0, 1)
        np.testing.assert_allclose(turned["force"][0], 0.0, atol=1e-6)
        pad = bristle.BedMaterial(0.8).with_presliding(1e-3)
        few = self.beds.add(pad, bristle.BedShape.rectangle(0.1, 0.08, nx=6, ny=2), max_normal_load=10.0, all_outputs=False)
        out = self.beds.step([few], [[1e-5, 0, 0, 0, 0, 10.0]])
        self.assertEqual((out["stored"][0], out["mean"][0, 0]), (0.0, 0.0))
        places = self.beds.bristles(few)["position"]
        self.assertEqual([len(np.unique(places[:, axis])) for axis in (0, 1)], [6, 2])
        with self.assertRaisesRegex(bristle.Error, "longest_piece"):
            self.beds.add(pad, bristle.BedShape.disc(0.07), max_normal_load=1.0, longest_piece=100.0)

    def test_wheels_of_every_kind_roll(self):
        material = bristle.BedMaterial(0.9, 0.8).with_slip_stiffness(8e4, 5e4)
        shapes = [bristle.BedShape.wheel_row(0.07), bristle.BedShape.cylinder_row(0.07),
                  bristle.BedShape.ellipse(0.1, 0.08, pressure="parabolic").rolling(16, 8).grown("cube_root"),
                  bristle.BedShape.rectangle(0.1, 0.08).rolling(16, 3)]
        ids = [self.beds.add(material, shape, max_normal_load=4000.0) for shape in shapes]
        for _ in range(30):
            out = self.beds.step(ids, [[0, 1e-5, 0, 0.01, 0, 4000.0]] * len(ids))
        for force in out["force"][:, 1]:
            self.assertAlmostEqual(force / -50.0, 1.0, 1)

    def test_what_cannot_be_is_refused(self):
        with self.assertRaisesRegex(bristle.Error, "no elasticity"):
            self.beds.add(bristle.BedMaterial(0.8), bristle.BedShape.disc(1e-3), max_normal_load=1.0)
        with self.assertRaisesRegex(bristle.Error, "shape"):
            self.beds.step([self.pad], [[0, 0, 0, 1.0]])
        with self.assertRaisesRegex(bristle.Error, "pressure"):
            bristle.BedShape.disc(1e-3, pressure="round")
        with self.assertRaisesRegex(bristle.Error, "list"):
            self.beds.add(bristle.BedMaterial(0.8).with_presliding(1e-3),
                          bristle.BedShape.from_list(np.zeros((0, 2)), [], []), max_normal_load=1.0)
        for pressure, message in ((lambda x, y: "much", r"^from_pressure\(\): pressure\(x, y\) must return a number, not 'much'$"),
                                  (lambda x, y: None, "must return a number, not None"),
                                  (None, r"^from_pressure\(\): pressure must be a function, not None \(NoneType\)$")):
            with self.assertRaisesRegex(TypeError, message):
                bristle.BedShape.from_pressure(1e-3, 1e-3, 4, 4, pressure)
        with self.assertRaises(ZeroDivisionError):
            bristle.BedShape.from_pressure(1e-3, 1e-3, 4, 4, lambda x, y: 1 / 0)
        square = bristle.BedShape.from_pressure(1e-3, 1e-3, 4, 4, lambda x, y: 1.0)
        self.beds.add(bristle.BedMaterial(0.8).with_presliding(1e-3), square, max_normal_load=1.0)
        self.assertEqual(len(self.beds), 2)


class Experiment(unittest.TestCase):
    def test_an_experiment_gives_its_findings_and_curves(self):
        found = bristle.experiment("load-step", models=["coulomb", "brush_redraw"], velocity=2e-4, load=2)
        self.assertEqual((found["name"], found["parameters"]["velocity"], found["parameters"]["load"]),
                         ("load-step", 2e-4, 2.0))
        self.assertEqual({f["model"]: f["shown"] for f in found["findings"] if f["phenomenon"] == "load_up_sliding"},
                         {"coulomb": False, "brush_redraw": True})
        self.assertTrue({("up", "coulomb"), ("up", "brush_redraw")} <= set(found["series"]))
        for rows in found["series"].values():
            self.assertEqual(rows.shape[1], len(found["columns"]))

    def test_an_experiment_takes_lists(self):
        found = bristle.experiment("limit-surface", models=["coulomb"], ratios=(0, 1.0), cells_across=5)
        self.assertEqual(found["parameters"]["ratios"], [0.0, 1.0])
        self.assertEqual(set(found["series"]["limit", "coulomb"][:, 0]), {0.0, 1.0})

    def test_what_an_experiment_does_not_know_is_named(self):
        for options, message in (({"name": "fall"}, "'fall' is not an experiment; allowed: drift, .*joint$"),
                                 ({"name": "load-step", "models": ["x"]}, "models: 'x' is not a model; allowed: coulomb"),
                                 ({"name": "load-step", "lod": 2}, "experiment load-step: 'lod' is not a parameter"),
                                 ({"name": "load-step", "model": ["lugre"]}, "is not a parameter \\(did you mean 'models'"),
                                 ({"name": "load-step", "models": ["lugr"]}, "is not a model \\(did you mean 'lugre'"),
                                 ({"name": "load-step", "load": -1}, "experiment load-step load is -1; allowed: 1e-06")):
            with self.assertRaisesRegex(bristle.Error, message):
                bristle.experiment(**options)


@unittest.skipIf(HAS_TOOLS, "the module has the tools")
class WithoutTools(unittest.TestCase):
    def test_a_name_that_needs_the_tools_says_so(self):
        for name in TOOLS:
            with self.assertRaisesRegex(AttributeError, f"bristle.{name} is not in this build .*BRISTLE_BUILD_TOOLS"):
                getattr(bristle, name)
        with self.assertRaisesRegex(AttributeError, "has no attribute 'fits'"):
            bristle.fits


class Interface(unittest.TestCase):
    def test_parameters_are_keywords_and_wrong_ones_are_named(self):
        options = bristle.PatchOptions(max_normal_load=3.0, outputs="mean", axes=1)
        self.assertEqual((options.max_normal_load, options.outputs, options.axes), (3.0, "mean", 1))
        self.assertIn("outputs='mean'", repr(options))
        self.assertEqual(options, bristle.PatchOptions(max_normal_load=3.0, outputs="mean", axes=1))
        self.assertNotEqual(options, bristle.PatchOptions())
        with self.assertRaisesRegex(TypeError, "no parameter 'max_load'"):
            bristle.PatchOptions(max_load=3.0)
        with self.assertRaisesRegex(bristle.Error, 'snap_rule: "reuse" is not one of "redraw", "keep"'):
            bristle.Material(snap_rule="reuse")
        with self.assertRaisesRegex(bristle.Error, "bristle_stiffness"):
            bristle.PatchBatch().add(bristle.Material(bristle_stiffness=-1.0))
        with self.assertRaises(ValueError):  # bristle.Error is a ValueError
            bristle.SnapLength.uniform(3e-6, 1e-6)
        with self.assertRaises(bristle.Error):
            bristle.PatchBatch(isa="abacus")

    def test_what_was_read_from_a_material_stays_when_the_material_changes(self):
        surface = bristle.Material(snap_length=bristle.SnapLength.single(DBAR))
        saved = surface.snap_length
        surface.snap_length = bristle.SnapLength.single(2 * DBAR)
        self.assertEqual(saved, bristle.SnapLength.single(DBAR))
        surface.snap_length = saved
        self.assertEqual(surface.snap_length, bristle.SnapLength.single(DBAR))

    def test_coefficients_go_there_and_back(self):
        wanted = bristle.Coefficients(kinetic=0.5, peak=0.6, presliding_length=20e-6, rule="keep")
        surface = bristle.Material.from_coefficients(wanted)
        self.assertEqual(surface, bristle.Material.from_coefficients(
            kinetic=0.5, peak=0.6, presliding_length=20e-6, rule="keep"))
        found = surface.coefficients()
        self.assertAlmostEqual(found.peak, 0.6, places=6)
        self.assertEqual((found.rule, found.law), ("keep", "lognormal"))

    def test_a_deadline_monitor_counts(self):
        monitor = bristle.DeadlineMonitor(deadline=1e-3)
        for _ in range(99):
            monitor.record(1e-4, 1e-4)
        monitor.record(2e-3, 1e-4)
        self.assertEqual((monitor.count, monitor.misses, monitor.misses_machine), (100, 1, 1))
        self.assertEqual(monitor.max, 2e-3)
        self.assertAlmostEqual(monitor.p50, 1e-4, delta=2e-6)
        monitor.record(2e-3)  # without a processor time the miss is attributed to this program
        self.assertEqual((monitor.misses, monitor.misses_ours, monitor.misses_machine), (2, 1, 1))
        self.assertGreater(bristle.DeadlineMonitor.wall_now(), 0.0)

    def test_a_deadline_monitor_follows_a_loop_with_a_period(self):
        monitor = bristle.DeadlineMonitor(deadline=1e-3, period=1e-3)
        monitor.record_tick(due=10.0, start=10.0, end=10.0001)
        monitor.record_tick(due=10.001, start=10.0012, end=10.0013, cpu=1e-4)  # starts 0.2 ms late, but ends in time
        self.assertEqual((monitor.count, monitor.misses, monitor.period), (2, 0, 1e-3))
        self.assertAlmostEqual(monitor.jitter_max, 0.2e-3, delta=1e-9)
        self.assertAlmostEqual(monitor.jitter_p50, 0.2e-3, delta=0.016 * 0.2e-3 + 1e-9)
        self.assertEqual(monitor.jitter_p99, monitor.jitter_p50)  # there is only one interval between ticks
        before = monitor.snapshot()
        # Records a tick that ends 1.5 ms after it was due and started 0.5 ms late.
        monitor.record_tick(due=10.002, start=10.0025, end=10.0035, cpu=1e-3)
        monitor.record_skipped(2)
        self.assertEqual((monitor.misses, monitor.misses_machine, monitor.skipped, monitor.longest_run), (1, 1, 2, 3))
        self.assertEqual((before.count, before.misses, before.skipped), (2, 0, 0))
        worst = monitor.worst
        self.assertEqual((worst["number"], worst["late"], worst["cpu"]), (2, True, 1e-3))
        self.assertAlmostEqual(worst["end_after_due"], 1.5e-3, delta=1e-9)
        self.assertAlmostEqual(worst["started_late"], 0.5e-3, delta=1e-9)
        self.assertEqual(monitor.late_events, worst["events"])  # there is only one late tick
        self.assertEqual(set(monitor.late_events),
                         {"involuntary_switches", "other_switches", "minor_faults", "major_faults"})
        monitor.refresh_events()
        monitor.pause()
        monitor.record_tick(due=20.0, start=20.0, end=20.0001)
        # Checks that a pause does not count as an interval between ticks.
        self.assertAlmostEqual(monitor.jitter_max, 0.3e-3, delta=1e-9)
        monitor.reset()
        self.assertEqual((monitor.count, monitor.longest_run, monitor.deadline), (0, 0, 1e-3))

    def test_a_python_without_numpy_says_what_to_install(self):
        code = "import sys; sys.modules['numpy'] = None; import bristle"
        ran = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        self.assertEqual(ran.returncode, 1)
        last = ran.stderr.strip().splitlines()[-1]
        self.assertRegex(last, "^ImportError: bristle needs numpy, .*pip install numpy.*python3-numpy$")

    def test_versions_and_instruction_sets_are_told(self):
        self.assertRegex(bristle.__version__, r"^\d+\.\d+\.\d+$")
        self.assertTrue(bristle.instruction_sets()["scalar"])
        self.assertIn(bristle.PatchBatch().isa, bristle.instruction_sets())

    def test_everything_public_has_a_docstring_and_a_line_in_the_stubs(self):
        stubbed = {}
        for node in ast.parse(STUB.read_text()).body:
            if isinstance(node, ast.ClassDef):
                stubbed[node.name] = {
                    n.name if isinstance(n, ast.FunctionDef) else n.targets[0].id if isinstance(n, ast.Assign) else n.target.id
                    for n in node.body if isinstance(n, (ast.FunctionDef, ast.AnnAssign, ast.Assign))
                }
            elif isinstance(node, ast.FunctionDef):
                stubbed[node.name] = set()
            elif isinstance(node, ast.AnnAssign):
                stubbed[node.target.id] = set()
        public = {name for name in dir(bristle) if not name.startswith("_")} | {"__version__"}
        self.assertEqual(set(stubbed), public)
        for name in public - {"__version__", "Status", "Error", "motion_dtype", "response_dtype"}:
            thing = getattr(bristle, name)
            self.assertTrue(thing.__doc__, name)
            if isinstance(thing, type):
                members = {m for m in vars(thing) if not m.startswith("_")}
                if name in ("Response", "Responses"):  # numpy makes these attributes from the names of the dtype
                    members = set(bristle.response_dtype.names) | ({"check"} if name == "Responses" else set())
                self.assertEqual({m for m in stubbed[name] if not m.startswith("_")}, members, name)


def stubbed_calls():
    """Yields for every public function its class, its name and its parameters: name, type, whether it is needed."""
    for owner in ast.parse(STUB.read_text()).body:
        is_class = isinstance(owner, ast.ClassDef)
        if not is_class and not isinstance(owner, ast.FunctionDef):
            continue
        for node in owner.body if is_class else [owner]:
            if not isinstance(node, ast.FunctionDef) or (node.name[0] == "_" and node.name != "__init__"):
                continue
            arguments = node.args
            defaults = [None] * (len(arguments.args) - len(arguments.defaults)) + arguments.defaults + arguments.kw_defaults
            yield owner.name if is_class else None, node.name, [
                (a.arg, ast.unparse(a.annotation), default is None)
                for a, default in zip(arguments.args + arguments.kwonlyargs, defaults) if a.annotation]


class Keys(unittest.TestCase):
    def test_patches_by_key_step_as_those_that_were_added_with_seed_and_key(self):
        batch, plain = bristle.PatchBatch(), bristle.PatchBatch()
        options = bristle.PatchOptions(max_normal_load=1.0, bristles=200)
        pool = bristle.KeyedPatches(batch, bristle.Material(), options, capacity=3, seed_from_key=False)
        ids = pool.find_or_add(np.array([7, 2**63 + 5], np.uint64))
        others = [plain.add(bristle.Material(), bristle.PatchOptions(max_normal_load=1.0, bristles=200, key=key))
                  for key in (7, 2**63 + 5)]
        forces = []
        for of, names in ((batch, ids), (plain, others)):
            motions = bristle.motions(names)
            motions["displacement"][:, 0], motions["normal_load"] = 3e-6, [0.5, 1.0]
            responses = bristle.responses(2)
            for _ in range(20):
                of.step(1e-3, motions, responses)
            forces.append(responses["end"].copy())
        np.testing.assert_array_equal(forces[0], forces[1])
        self.assertTrue((forces[0][:, 0] < 0).all())
        saved, keys = batch.save_state(), pool.save_state()
        self.assertEqual((len(pool), pool.end_step(), pool.end_step()), (2, 0, 2))
        self.assertEqual(pool.find([7]).tolist(), [0])
        batch.restore_state(saved)
        pool.restore_state(keys)
        np.testing.assert_array_equal(pool.find([7, 2**63 + 5]), ids)
        self.assertTrue(pool.remove(7))
        self.assertFalse(pool.remove(7))

    def test_a_full_pool_has_an_id_that_steps_without_force(self):
        beds = bristle.BedBatch()
        pool = bristle.KeyedBeds(beds, bristle.BedMaterial(0.5).with_presliding(1e-4), bristle.BedShape.disc(1e-3),
                                 max_normal_load=1.0, capacity=1)
        ids = pool.find_or_add([1, 2])
        self.assertEqual((ids[1], pool.refused), (2**64 - 1, 1))
        out = beds.step(ids, [[2e-4, 0, 0, 0, 0, 1.0]] * 2)
        self.assertEqual(out["status"].tolist(), [0, int(bristle.Status.no_capacity)])
        self.assertAlmostEqual(out["force"][0, 0], -0.5, 5)
        self.assertEqual(out["force"][1, 0], 0.0)
        pool.reserve(2)
        self.assertNotEqual(pool.find_or_add([2])[0], 2**64 - 1)
        self.assertEqual(len(beds), 2)
        del pool
        self.assertEqual(len(beds), 0)


class EveryCall(unittest.TestCase):
    # Example values for the types of parameters that have no default.
    VALUES = {"float": 1.0, "int": 1, "str": "keep", "bytes": b"", "ArrayLike": [1.0], "Material": bristle.Material(),
              "Coefficients": bristle.Coefficients(), "SnapLength": bristle.SnapLength.single(1e-6),
              "np.ndarray[Any, Any]": bristle.motions([1]), "Outline": bristle.Outline.disc(1e-3),
              "BedMaterial": bristle.BedMaterial(0.3).with_presliding(1e-4), "BedShape": bristle.BedShape.disc(1e-3),
              "PatchBatch": bristle.PatchBatch(), "BedBatch": bristle.BedBatch(),
              "Callable[[float, float], float]": lambda x, y: 1.0,
              "PatchGroup": bristle.PatchBatch().add_group(1, bristle.Material(snap_rule="slide")),
              "JointMaterial | Sequence[JointMaterial]": bristle.JointMaterial(stiffness=1.0)}

    def calls(self):
        """Yields for every public function its name, itself, arguments that it takes, and its parameters. Arguments are
        those that it needs, and None for those of which the stubs say that they may be None."""
        objects = {"SnapLength": self.VALUES["SnapLength"], "Material": bristle.Material(), "Outline": self.VALUES["Outline"],
                   "BedMaterial": self.VALUES["BedMaterial"], "BedShape": self.VALUES["BedShape"],
                   "JointFriction": bristle.JointFriction(1, bristle.JointMaterial(stiffness=1.0)),
                   "KeyedPatches": bristle.KeyedPatches(self.VALUES["PatchBatch"], bristle.Material(), capacity=2),
                   "KeyedBeds": bristle.KeyedBeds(self.VALUES["BedBatch"], self.VALUES["BedMaterial"],
                                                  self.VALUES["BedShape"], max_normal_load=1.0, capacity=2)}
        if HAS_TOOLS:
            vary = {"material.skin.kinetic": [0.4]}
            objects["Scene"] = bristle.Scene(SCENES / "stroke.toml")
            objects["SweepTable"] = bristle.sweep(SCENES / "stroke.toml", vary, steps=1, report="kinetic")
        for owner, name, parameters in stubbed_calls():
            if name == "__init__":
                call = getattr(bristle, owner)
            elif owner is None:
                call = getattr(bristle, name)
            else:
                call = getattr(objects[owner] if owner in objects else getattr(bristle, owner)(), name) if parameters else None
            values = {p: None for p, kind, _ in parameters if "None" in kind}
            values |= {"vary": vary, "steps": 1} if name == "sweep" else {}
            values |= {p: SCENES / "stroke.toml" if "PathLike" in kind else self.VALUES[kind]
                       for p, kind, needed in parameters if needed and p not in values}
            yield f"{owner}.{name}", call, values, parameters

    def test_the_argument_of_a_wrong_type_is_named_in_one_line(self):
        class Alien:
            def __repr__(self):
                return "of two\nlines"

        tried = 0
        for name, call, values, parameters in self.calls():
            for wrong, _, _ in parameters:
                with self.subTest(call=name, argument=wrong):
                    with unittest.mock.patch.dict(sys.modules, distributed=None), \
                            self.assertRaises((TypeError, bristle.Error)) as raised:  # as without Dask
                        call(**(values | {wrong: Alien()}))
                    self.assertRegex(str(raised.exception), rf"^\S+\(\): {wrong} must be .*, not of two lines \(Alien\)$")
                    tried += 1
        self.assertGreater(tried, 250)

    def test_none_is_an_argument_that_was_left_out(self):
        def outcome(call, values):
            try:
                call(**values)
            except (TypeError, bristle.Error) as error:
                return type(error), str(error)

        tried = 0
        for name, call, values, parameters in self.calls():
            given = {p: value for p, value in values.items() if value is not None}
            if given != values:
                with self.subTest(call=name):
                    self.assertEqual(outcome(call, values), outcome(call, given))
                    tried += 1
        self.assertGreater(tried, 15 if HAS_TOOLS else 10)

    def test_help_shows_the_names_types_and_defaults_of_parameters(self):
        for owner, name, parameters in stubbed_calls():
            with self.subTest(call=f"{owner}.{name}"):
                text = pydoc.plain(pydoc.render_doc(getattr(getattr(bristle, owner) if owner else bristle, name)))
                self.assertNotRegex(text, r"\*args|: object")
                for parameter, _, needed in parameters:
                    self.assertRegex(text, rf"\b{parameter}: .+" + ("" if needed else " = "))

    def test_a_call_without_an_argument_or_out_of_range_says_which(self):
        batch = bristle.PatchBatch()
        for call, line in (
                (lambda: batch.step(1e-3, bristle.motions([1])), r"step\(\): missing a required argument: 'responses'"),
                (lambda: batch.remove(ID=1), r"remove\(\): missing a required argument: 'id'"),
                (lambda: batch.remove(-1), r"remove\(\): id is out of range: -1"),
                (lambda: bristle.JointMaterial(stiffness=1.0, motor=[1.0, "x"]), r"JointMaterial\(\): motor must be a list of "),
                (lambda: setattr(bristle.PatchOptions(), "axes", "two"), r"PatchOptions\(\): axes must be a whole number, not 'two'"),
                (lambda: bristle.PatchBatch(thread=2), r"PatchBatch\(\): no argument 'thread' \(did you mean 'threads'\?\)"),
                (lambda: bristle.fit([0.0], [0.0], [0.0], lod=2.0), r"fit\(\): no argument 'lod' \(did you mean 'load'\?\)"),
                (lambda: bristle.PatchBatch(2), r"PatchBatch\(\): too many positional arguments"),
                (lambda: bristle.PatchBatch(threads=2**31), r"PatchBatch\(\): threads is out of range: 2147483648"),
                (lambda: bristle.sweep("a.toml", ["scene.dt=1e-3"], steps="x"), r"sweep\(\): steps must be a whole number"),
                (lambda: bristle.fit("a.csv", units={"x": 3}), r"fit\(\): units must be a dict")):
            with self.assertRaisesRegex(TypeError, f"^{line}"):
                call()


class FirstMinutes(unittest.TestCase):
    def test_a_keyword_that_is_wrong_is_named(self):
        with self.assertRaisesRegex(TypeError, r"Coefficients\(\) has no parameter 'kinetik' \(did you mean 'kinetic'\?\)"):
            bristle.Material.from_coefficients(kinetik=0.4)
        with self.assertRaisesRegex(TypeError, r"Coefficients\(\): kinetic must be a number, not 'much' \(str\)"):
            bristle.Material.from_coefficients(kinetic="much")
        with self.assertRaisesRegex(bristle.Error, "did you mean 'double'"):
            bristle.PatchOptions(precision="duoble")
        with self.assertWarnsRegex(UserWarning, "presliding_length is in m"):
            bristle.Material.from_coefficients(presliding_length=20.0)

    def test_the_example_of_help_runs_and_responses_check_themselves(self):
        names = {}
        example = bristle.__doc__.split("\n\n", 2)[2].replace("print(", "last = (")
        exec(textwrap.dedent(example), names)
        self.assertTrue(np.allclose(names["last"], -0.4, atol=0.01))
        motions, responses = names["motions"], names["responses"]
        self.assertIs(responses.check(), responses)
        motions.normal_load[3] = np.nan
        names["batch"].step(1e-3, motions, responses)
        with self.assertRaisesRegex(bristle.Error, "1 of 10 patches .* row 3: <Status.bad_input"):
            responses.check()
        motions.normal_load[3], motions.id[2] = 1.0, 12345
        names["batch"].step(1e-3, motions, responses)
        with self.assertRaisesRegex(bristle.Error, "1 of 10 patches .* row 2: <Status.unknown_id"):
            responses.check()


@unittest.skipUnless(HAS_TOOLS, "this build has no tools")
class Sweeps(unittest.TestCase):
    VARY = {"material.rubber.kinetic": [0.6, 0.9], "patch.steel_pad.bristles": "100:400:2"}

    def test_a_sweep_is_that_of_the_command_line(self):
        table = bristle.sweep(SCENES / "two_surfaces.toml", self.VARY, report=["kinetic", "time.cpu"], steps=300, repeat=2)
        self.assertEqual(len(table), 8)
        self.assertEqual(table["patch.steel_pad.bristles"].tolist(), [100, 100, 400, 400] * 2)
        self.assertEqual(table.units["time.cpu"], "s")
        self.assertGreater(table["time.cpu"].min(), 0.0)
        if not COMMAND_LINE.exists():
            self.skipTest("no command line beside the module")
        with tempfile.TemporaryDirectory() as folder:
            report = pathlib.Path(folder) / "report.json"
            command_line("sweep", SCENES / "two_surfaces.toml", "--vary", "material.rubber.kinetic=0.6,0.9",
                         "--vary", "patch.steel_pad.bristles=100:400:2", "--report", "kinetic,time.cpu", "--steps", "300",
                         "--repeat", "2", "--json", report)
            said = json.loads(report.read_text())
        self.assertEqual((table.hash, table.study), (said["table_hash"], said["study"]))

    @unittest.skipUnless(COMMAND_LINE.exists(), "no command line beside the module")
    def test_a_sweep_takes_the_options_of_the_command_line(self):
        with tempfile.TemporaryDirectory() as folder:
            report = pathlib.Path(folder) / "report.json"
            command_line("sweep", SCENES / "two_surfaces.toml", "--vary", "material.rubber.kinetic=0.6:0.9:2",
                         "--vary", "patch.steel_pad.bristles=50,100", "--seed", "5",
                         "--set", "patch.rubber_pad.bristles=70", "--reference", "patch.rubber_pad.bristles=300",
                         "--window", "0.01:0.03", "--steps", "60", "--report", "error,window_mean", "--json", report)
            said = json.loads(report.read_text())
        table = bristle.sweep(SCENES / "two_surfaces.toml", ["material.rubber.kinetic=0.6:0.9:2",
                                                             "patch.steel_pad.bristles=50,100"], seed=5, set={"patch.rubber_pad.bristles": 70},
                              reference={"patch.rubber_pad.bristles": 300}, window=(0.01, 0.03), steps=60,
                              report=["error", "window_mean"])
        self.assertEqual((table.hash, table.study), (said["table_hash"], said["study"]))

    def test_an_unfinished_table_lies_beside_the_table_and_is_left_free(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "table.csv"
            arguments = dict(steps=5, report="fx_mean", out=out)
            try:  # an object that is no client ends the sweep before its first row
                bristle.sweep(SCENES / "two_surfaces.toml", self.VARY, client=object(), **arguments)
            except (TypeError, ImportError) as error:
                held = error  # its traceback keeps the sweep's variables alive
            self.assertEqual(os.listdir(folder), ["table.csv.part"])
            table = bristle.sweep(SCENES / "two_surfaces.toml", self.VARY, **arguments)
            self.assertEqual((len(table), os.listdir(folder)), (4, ["table.csv"]))
            del held

    def test_a_worker_keeps_one_study_and_gets_half_a_second_of_rows(self):
        code = bristle._sweep
        for steps in (5, 6):
            study = bristle._bristle._SweepStudy(SCENES / "two_surfaces.toml", ["scene.dt=1e-3"], repeat=1, seed=None, set=[], reference=[], report=[], window="", steps=steps)
            self.assertEqual(code._study_here(study.recipe()).hash, study.hash)
        self.assertEqual(len(code._studies), 1)
        sizes = code._Sizes(types.SimpleNamespace(nthreads=lambda: {"a": 2}), 1000)
        self.assertEqual(sizes.rows(), 1)
        sizes.done(10, 0.2)  # 20 ms a row
        self.assertEqual(sizes.rows(), 25)
        sizes.done(100, 3.0)  # 30 ms a row, which may be a disturbance
        self.assertTrue(0.5 / 0.03 < sizes.rows() < 0.5 / 0.02, sizes.rows())
        sizes.done(810, 16.2)  # leaves 80 rows: the task is a quarter of a thread's half
        self.assertEqual(sizes.rows(), 10)

    def test_a_table_goes_to_other_libraries(self):
        table = bristle.sweep(SCENES / "two_surfaces.toml", {"scene.dt": [1e-3, 2e-3]}, report="fx_mean", steps=5)
        stand_in = types.SimpleNamespace(DataFrame=lambda columns: types.SimpleNamespace(columns=columns, attrs={}),
                                         Dataset=dict)
        with unittest.mock.patch.dict(sys.modules, pandas=stand_in, xarray=stand_in):
            self.assertEqual(table.to_pandas().attrs["units"]["scene.dt"], "s")
            self.assertEqual(table.to_xarray()["scene.dt"][2], {"units": "s"})
        for name, convert in (("pandas", table.to_pandas), ("xarray", table.to_xarray)):
            if importlib.util.find_spec(name) is None:
                continue
            self.assertEqual(list(convert()["scene.dt"]), [1e-3, 2e-3])

    def test_columns_have_the_types_of_their_results_also_where_a_row_was_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "table.csv"
            table = bristle.sweep(SCENES / "two_surfaces.toml", {"material.rubber.kinetic": [0.6, -1.0]}, out=out, steps=60,
                                  report=["window_mean", "sliding_steps", "state_hash"], window=(0.01, 0.05))
            self.assertEqual(os.listdir(folder), ["table.csv"])
            with open(out, newline="") as file:
                rows = list(csv.DictReader(file))
        hashes = table["state_hash"]
        self.assertEqual((hashes.dtype, int(hashes[0]), int(hashes[1])), (np.uint64, int(rows[0]["state_hash"], 16), 0))
        pad = "steel_pad."
        self.assertTrue(np.isfinite(table[pad + "window_mean"][0]) and np.isnan(table[pad + "window_mean"][1]))
        self.assertEqual(table[pad + "sliding_steps"].dtype, np.int64)
        self.assertEqual(table[pad + "sliding_steps"][1], 0)

    def test_a_sweep_says_once_why_rows_were_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            scene = pathlib.Path(folder) / "scene.toml"
            text = (SCENES / "stroke.toml").read_text().replace("kinetic = 0.40", "kinetic = 0.40\nspread = 0.3")
            scene.write_text(text.replace('rule = "keep"', "").replace("peak = 0.46", "peak = 0.4552615953"))
            vary = {"material.skin.kinetic": [0.4, 0.5, 0.6]}
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                table = bristle.sweep(scene, vary, report="kinetic", steps=5)
            self.assertEqual(len(caught), 1)
            self.assertEqual(caught[0].filename, __file__)
            self.assertRegex(str(caught[0].message), r"^bristle.sweep: 2 of 3 rows were refused .*row 1: .*leave out peak")
            self.assertEqual([bool(reason) for reason in table["failure"]], [False, True, True])

    def test_values_are_written_as_toml_writes_them(self):
        for value, text in ((True, "true"), (np.bool_(False), "false"), (np.float64(0.5), "0.5"), ([1, 2.5], "[1,2.5]"),
                            ({"law": "uniform", "min": 1e-6}, '{law="uniform",min=1e-06}'), ("as it is", "as it is")):
            self.assertEqual(bristle._sweep._text(value), text)

    def test_a_sweep_writes_the_table_that_it_returns(self):
        with tempfile.TemporaryDirectory() as folder:
            out = pathlib.Path(folder) / "table.csv"
            table = bristle.sweep(SCENES / "two_surfaces.toml", self.VARY, report="fx_mean", steps=50, out=out, threads=2)
            with open(out, newline="") as file:
                rows = list(csv.DictReader(file))
            written = [float(row["steel_pad.fx_mean[N]"]) for row in rows]
            self.assertEqual(written, table["steel_pad.fx_mean"].tolist())
            with self.assertRaisesRegex(bristle.Error, "did you mean 'kinetic'"):
                bristle.sweep(SCENES / "two_surfaces.toml", {"material.rubber.kinetik": [1.0]})


if __name__ == "__main__":
    unittest.main()
