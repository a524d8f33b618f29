// Binds JointMaterial and JointFriction, over numpy arrays in place.
#include <array>
#include <string>
#include <variant>
#include <vector>

#include "tools/products/python/owned.hpp"

namespace bristle_python {

using bristle::JointFriction;
using bristle::JointInput;
using bristle::JointMaterial;
using bristle::JointOptions;
using bristle::JointOutput;

namespace {

using Pair = std::array<double, 2>;
using Material = std::array<double, bristle::joint_parameters>;

using Joints = Owned<JointFriction>;
using Room = std::optional<py::array>;  // array of the caller that a step of the joints writes

/// Number of joints from which a step releases the interpreter's lock. With fewer, acquiring the lock again
/// takes longer than the step.
constexpr std::size_t lets_go_from = 64;

/// Returns the memory of the caller's array, to be written in place; an empty span for None.
template <class T>
bristle::Span<T> room_of(const Room& array, std::size_t size, const char* name) {
  if (!array) return {};
  if (!py::isinstance<py::array_t<std::conditional_t<std::is_same_v<T, double>, double, std::uint32_t>>>(
          *array))
    throw bristle::Error(std::string(name) + ": a numpy array of " +
                         (std::is_same_v<T, double> ? "float64" : "uint32") +
                         " is needed: it is written in place");
  if (static_cast<std::size_t>(array->size()) != size || (array->flags() & py::array::c_style) == 0 ||
      !array->writeable())
    throw bristle::Error(std::string(name) + ": a writeable array of " + std::to_string(size) +
                         " numbers, one after the other, is needed");
  return {static_cast<T*>(const_cast<void*>(array->data())), size};
}

bristle::Span<const double> numbers_in(const std::optional<Numbers>& array, std::size_t size,
                                       const char* name) {
  if (!array) return {};
  if (static_cast<std::size_t>(array->size()) != size)
    throw bristle::Error(std::string(name) + ": one number for each of " + std::to_string(size) +
                         " joints is needed");
  return {array->data(), size};
}

template <bristle::StepReport (JointFriction::*go)(const JointInput&, const JointOutput&) noexcept>
py::array step(Joints& self, const Numbers& angle, const std::optional<Numbers>& speed,
               const std::optional<Numbers>& motor, const std::optional<Numbers>& outside, Room torque,
               const Room& mean, const Room& by_angle, const Room& by_speed, const Room& by_motor,
               const Room& by_outside, const Room& gradient, const Room& status) {
  const std::size_t n = self.batch.joint_count();
  const JointInput in{numbers_in(angle, n, "angle"), numbers_in(speed, n, "speed"),
                      numbers_in(motor, n, "motor"), numbers_in(outside, n, "outside")};
  if (!torque) torque = Numbers(static_cast<py::ssize_t>(n));
  const JointOutput out{room_of<double>(torque, n, "torque"),
                        room_of<double>(mean, n, "mean"),
                        room_of<double>(by_angle, n, "by_angle"),
                        room_of<double>(by_speed, n, "by_speed"),
                        room_of<double>(by_motor, n, "by_motor"),
                        room_of<double>(by_outside, n, "by_outside"),
                        room_of<bristle::Status>(status, n, "status"),
                        room_of<double>(gradient, n * bristle::joint_parameters, "gradient")};
  const Joints::Turn turn(self);
  bristle::StepReport report;
  if (n < lets_go_from) {
    report = (self.batch.*go)(in, out);
  } else {
    const py::gil_scoped_release release;
    report = (self.batch.*go)(in, out);
  }
  if (report.tasks == 0) throw bristle::Error("gradient: JointFriction(gradients=True) is needed");
  return *torque;
}

Material& numbers_of(JointMaterial& material) { return reinterpret_cast<Material&>(material); }

}  // namespace

void define_joints(py::module_& module) {
  py::class_<JointMaterial> material(
      module, "JointMaterial",
      "Friction of a joint, N m and rad. Pairs: while it drives, while it is driven.");
  material.def(py::init([](double stiffness, double viscous, double base, const Pair& motor,
                           const Pair& outside, double static_base, const Pair& static_motor,
                           const Pair& static_outside, double stribeck_speed) {
                 JointMaterial m;
                 numbers_of(m) = {
                     stiffness,         viscous,           base,          motor[0],        motor[1],
                     outside[0],        outside[1],        static_base,   static_motor[0], static_motor[1],
                     static_outside[0], static_outside[1], stribeck_speed};
                 return m;
               }),
               py::kw_only(), py::arg("stiffness"), py::arg("viscous") = 0.0, py::arg("base") = 0.0,
               py::arg("motor") = Pair{}, py::arg("outside") = Pair{}, py::arg("static_base") = 0.0,
               py::arg("static_motor") = Pair{}, py::arg("static_outside") = Pair{},
               py::arg("stribeck_speed") = 0.0);
  const auto number = [&](const char* name, std::size_t i, const char* doc) {
    material.def_property(
        name, [i](JointMaterial& m) { return numbers_of(m)[i]; },
        [i](JointMaterial& m, double x) { numbers_of(m)[i] = x; }, doc);
  };
  const auto pair = [&](const char* name, std::size_t i) {
    material.def_property(
        name, [i](JointMaterial& m) { return py::make_tuple(numbers_of(m)[i], numbers_of(m)[i + 1]); },
        [i](JointMaterial& m, const Pair& x) {
          numbers_of(m)[i] = x[0];
          numbers_of(m)[i + 1] = x[1];
        },
        "while it drives, while it is driven");
  };
  number("stiffness", bristle::joint_stiffness, "N m/rad while it sticks");
  number("viscous", bristle::joint_viscous, "N m s/rad");
  number("base", bristle::joint_base, "N m");
  pair("motor", bristle::joint_motor_driving);
  pair("outside", bristle::joint_outside_driving);
  number("static_base", bristle::joint_static_base, "N m, in addition while it sticks");
  pair("static_motor", bristle::joint_static_motor_driving);
  pair("static_outside", bristle::joint_static_outside_driving);
  number("stribeck_speed", bristle::joint_stribeck_speed, "rad/s");
  material.def("__repr__", [](const JointMaterial& m) {
    const py::object self = py::cast(m, py::return_value_policy::reference);
    std::string text;
    for (const char* name : {"stiffness", "viscous", "base", "motor", "outside", "static_base",
                             "static_motor", "static_outside", "stribeck_speed"})
      text += (text.empty() ? "JointMaterial(" : ", ") + std::string(name) + "=" +
              py::cast<std::string>(py::repr(self.attr(name)));
    return text + ")";
  });
  material.def_property(
      "numbers", [](JointMaterial& m) { return numbers_of(m); },
      [](JointMaterial& m, const Material& x) { numbers_of(m) = x; },
      "All numbers, in the order of JointFriction.parameter_names.");

  py::class_<Joints> joints(
      module, "JointFriction",
      "Friction of robots' joints: arrays of one number a joint, read and written in place.");
  joints.def(
      py::init([](std::size_t count, const std::variant<JointMaterial, std::vector<JointMaterial>>& materials,
                  int bristles, double spread, bool gradients, int threads, const char* isa) {
        const auto* const one = std::get_if<JointMaterial>(&materials);
        const auto list =
            one != nullptr ? std::vector{*one} : std::get<std::vector<JointMaterial>>(materials);
        JointOptions options;
        options.bristles = bristles;
        options.spread = spread;
        options.gradients = gradients;
        return std::make_unique<Joints>(count, bristle::Span<const JointMaterial>(list.data(), list.size()),
                                        options, bristle::BatchOptions{}.with_threads(threads).with_isa(isa));
      }),
      py::arg("joints"), py::arg("materials"), py::kw_only(), py::arg("bristles") = JointOptions{}.bristles,
      py::arg("spread") = JointOptions{}.spread, py::arg("gradients") = false, py::arg("threads") = 1,
      py::arg("isa") = py::none(),
      "Joint i is of materials[i % len(materials)]. Raises bristle.Error for values out of range.");
  joints.def("__repr__", [](const Joints& self) {
    return "<bristle.JointFriction of " + std::to_string(self.batch.joint_count()) + " joints>";
  });
  const auto define_step = [&](const char* name, const auto& function, const char* doc) {
    joints.def(name, function, py::arg("angle"), py::arg("speed") = py::none(), py::arg("motor") = py::none(),
               py::arg("outside") = py::none(), py::kw_only(), py::arg("torque") = py::none(),
               py::arg("mean") = py::none(), py::arg("by_angle") = py::none(),
               py::arg("by_speed") = py::none(), py::arg("by_motor") = py::none(),
               py::arg("by_outside") = py::none(), py::arg("gradient") = py::none(),
               py::arg("status") = py::none(), doc);
  };
  define_step("step", &step<&JointFriction::step>,
              "Moves all joints to their angles (rad, not wrapped), with their speeds (rad/s) and torques (N "
              "m); None is zero. Returns the torque of friction on each joint (N m). The keyword arrays are "
              "written in place: torque, mean, derivatives of the torque, gradient (13, n), status (uint32, "
              "4: bad input, torque 0).");
  define_step("find_torque", &step<&JointFriction::find_torque>, "As step, without changing the state.");
  joints.def(
      "reset",
      [](Joints& self, const std::optional<std::size_t>& joint) {
        const Joints::Turn turn(self);
        if (!joint)
          self.batch.reset();
        else if (!self.batch.reset(*joint))
          throw bristle::Error("JointFriction.reset: there is no such joint");
      },
      py::arg("joint") = py::none(), "Straightens one joint, or all.");
  define_state(
      joints, "joint", [](std::uint64_t joint) { return static_cast<std::size_t>(joint); },
      [](const JointFriction& batch) { return batch.joint_count(); });
  joints.attr("parameter_names") =
      py::make_tuple("stiffness", "viscous", "base", "motor_driving", "motor_driven", "outside_driving",
                     "outside_driven", "static_base", "static_motor_driving", "static_motor_driven",
                     "static_outside_driving", "static_outside_driven", "stribeck_speed");
}

}  // namespace bristle_python
