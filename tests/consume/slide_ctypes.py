"""The program slide.c in Python, by ctypes. It reads no header: the layouts of the structs are declared here."""
import ctypes as c
import sys


class SnapLength(c.Structure):
    _fields_ = [("law", c.c_uint32), ("table_size", c.c_uint32), ("first", c.c_double), ("second", c.c_double),
                ("table", c.POINTER(c.c_double))]


class Material(c.Structure):
    _fields_ = [("struct_size", c.c_size_t), ("bristle_stiffness", c.c_double), ("bristle_damping", c.c_double),
                ("viscous_friction", c.c_double), ("stribeck_velocity", c.c_double),
                ("normal_stiffness", c.c_double), ("asperity_height_deviation", c.c_double),
                ("snap_length", SnapLength), ("snap_rule", c.c_uint32), ("damper_decay", c.c_uint32),
                ("residual_length", c.c_double), ("shared_renewal", c.c_double), ("ageing_form", c.c_uint32),
                ("reserved", c.c_uint32), ("ageing_strength", c.c_double), ("ageing_time", c.c_double),
                ("speed_strengthening", c.c_double), ("strengthening_speed", c.c_double), ("drop", c.c_double)]


class Coefficients(c.Structure):
    _fields_ = [("struct_size", c.c_size_t), ("kinetic", c.c_double), ("peak", c.c_double),
                ("presliding_length", c.c_double), ("bristles_per_newton", c.c_double),
                ("damping_per_newton", c.c_double), ("viscous_friction", c.c_double),
                ("stribeck_velocity", c.c_double), ("law", c.c_uint32), ("rule", c.c_uint32),
                ("damper_decay", c.c_uint32), ("reserved", c.c_uint32), ("residual_share", c.c_double),
                ("shared_renewal", c.c_double), ("kinetic_speed", c.c_double), ("fall_per_decade", c.c_double),
                ("growth_per_decade", c.c_double), ("ageing_time", c.c_double), ("ageing_form", c.c_uint32),
                ("reserved_too", c.c_uint32), ("speed_strengthening", c.c_double), ("strengthening_speed", c.c_double),
                ("spread", c.c_double), ("drop", c.c_double)]


class PatchOptions(c.Structure):
    _fields_ = [("struct_size", c.c_size_t), ("max_normal_load", c.c_double), ("key", c.c_uint64),
                ("bristles", c.c_uint32), ("seed", c.c_uint32), ("axes", c.c_int32), ("outputs", c.c_uint32),
                ("precision", c.c_uint32), ("population", c.c_uint32), ("resolution", c.c_double),
                 ("lay", c.c_double * 4)]


class Motion(c.Structure):
    _fields_ = [("id", c.c_uint64), ("displacement", c.c_double * 2), ("normal_load", c.c_double),
                ("has_velocity", c.c_uint8), ("reserved", c.c_uint8 * 7), ("velocity", c.c_double * 2)]


class Response(c.Structure):
    _fields_ = [("id", c.c_uint64), ("status", c.c_uint32), ("reserved", c.c_uint32), ("end", c.c_double * 2),
                ("elastic", c.c_double * 2), ("damper", c.c_double * 2), ("mean", c.c_double * 2),
                ("stiffness", c.c_double), ("damping", c.c_double), ("force_limit", c.c_double),
                ("dissipated", c.c_double), ("contact_loss", c.c_double), ("damper_work", c.c_double),
                ("snaps", c.c_uint64)]


library = c.CDLL(sys.argv[1])
for name in ("version", "last_error", "result_name"):
    getattr(library, "bristle_" + name).restype = c.c_char_p
library.bristle_state_hash.argtypes = [c.c_void_p, c.c_uint64]
library.bristle_state_hash.restype = c.c_uint64
library.bristle_destroy.argtypes = [c.c_void_p]
library.bristle_step.argtypes = [c.c_void_p, c.c_double, c.POINTER(Motion), c.c_size_t, c.POINTER(Response),
                                 c.c_size_t, c.c_size_t, c.c_void_p]


def call(name, *arguments):
    result = getattr(library, "bristle_" + name)(*arguments)
    if result != 0:
        raise RuntimeError(f"{library.bristle_result_name(result).decode()}: {library.bristle_last_error().decode()}")


def new(struct, kind):
    made = struct()
    call("init_" + kind, c.byref(made), c.c_size_t(c.sizeof(made)))
    return made


coefficients = new(Coefficients, "coefficients")
coefficients.kinetic, coefficients.peak, coefficients.rule = 0.40, 0.46, 1
# Coefficients::paper() in C++.
coefficients.residual_share = coefficients.shared_renewal = 0.0
material = new(Material, "material")
call("material_from_coefficients", c.byref(coefficients), c.byref(material))
options = new(PatchOptions, "patch_options")
options.max_normal_load, options.axes = 4.0, 1

batch = c.c_void_p()
call("create", None, c.byref(batch))
tip = c.c_uint64()
call("add", batch, c.byref(material), c.byref(options), c.byref(tip))
try:
    call("remove", batch, c.c_uint64(12345))
    sys.exit("a patch was removed that is not there")
except RuntimeError as error:
    assert "BRISTLE_REFUSED" in str(error) and "12345" in str(error), error
call("warm_up", batch)

peak, response = 0.0, Response()
for tick in range(100):
    motion = Motion(id=tip, displacement=(2e-6, 0.0), normal_load=1.0)
    call("step", batch, 1e-3, c.byref(motion), c.sizeof(Motion), c.byref(response), c.sizeof(Response), 1, None)
    assert response.status == 0
    peak = max(peak, -response.end[0])
print(f"bristle {library.bristle_version().decode()}: peak {peak:.9f} N, in the end {-response.end[0]:.9f} N, "
      f"state {library.bristle_state_hash(batch, 0):016x}")
library.bristle_destroy(batch)
