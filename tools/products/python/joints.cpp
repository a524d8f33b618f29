// Binds JointMaterial and JointFriction. They read and write numpy arrays in place.
#include <array>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "tools/libraries/files/joint_fields.hpp"
#include "tools/products/python/keyword_class.hpp"
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

template <bristle::StepReport (JointFriction::*go)(const JointInput&, const JointOutput&) noexcept>
py::array step(Joints& self, const Numbers& angle, const std::optional<Numbers>& speed,
               const std::optional<Numbers>& motor, const std::optional<Numbers>& outside, Room torque,
               const Room& mean, const Room& by_angle, const Room& by_speed, const Room& by_motor,
               const Room& by_outside, const Room& gradient, const Room& status) {
  const std::size_t n = self.batch.joint_count();
  Arrays arrays;
  const JointInput in{numbers_in(arrays, &angle, n, "angle"), numbers_in(arrays, pointer(speed), n, "speed"),
                      numbers_in(arrays, pointer(motor), n, "motor"),
                      numbers_in(arrays, pointer(outside), n, "outside")};
  if (!torque) torque = Numbers(static_cast<py::ssize_t>(n));
  const JointOutput out{room_of<double>(arrays, torque, n, "torque"),
                        room_of<double>(arrays, mean, n, "mean"),
                        room_of<double>(arrays, by_angle, n, "by_angle"),
                        room_of<double>(arrays, by_speed, n, "by_speed"),
                        room_of<double>(arrays, by_motor, n, "by_motor"),
                        room_of<double>(arrays, by_outside, n, "by_outside"),
                        room_of<bristle::Status>(arrays, status, n, "status"),
                        room_of<double>(arrays, gradient, n * bristle::joint_parameters, "gradient")};
  const Joints::Turn turn(self);
  const bristle::StepReport report = step_columns(n, [&] { return (self.batch.*go)(in, out); });
  if (report.tasks == 0) throw bristle::Error("gradient: JointFriction(gradients=True) is needed");
  return *torque;
}

Material& numbers_of(JointMaterial& material) { return reinterpret_cast<Material&>(material); }

void define_material(py::module_& module) {
  KeywordClass<JointMaterial> material(module, "JointMaterial",
                                       "Friction of a joint, N m and rad. Pairs: while it drives, while it "
                                       "is driven. static_...: in addition, "
                                       "while it sticks.");
  std::size_t i = 0;
  cli::for_each_joint_field(
      [&](const std::string& name, const bristle::AboutField& about, std::size_t count) {
        const std::string doc = help_of(about);
        if (count == 1)
          material.property(
              name.c_str(), [i](JointMaterial& m) { return numbers_of(m)[i]; },
              [i](JointMaterial& m, double x) { numbers_of(m)[i] = x; }, doc.c_str());
        else
          material.property(
              name.c_str(),
              [i](JointMaterial& m) { return py::make_tuple(numbers_of(m)[i], numbers_of(m)[i + 1]); },
              [i](JointMaterial& m, const Pair& x) { std::copy_n(x.data(), 2, numbers_of(m).data() + i); },
              doc.c_str());
        i += count;
      });
  material.done();
  material.type.def_property(
      "numbers", [](JointMaterial& m) { return numbers_of(m); },
      [](JointMaterial& m, const Material& x) { numbers_of(m) = x; },
      "All numbers, in the order of JointFriction.parameter_names.");
}

}  // namespace

void define_joints(py::module_& module) {
  define_material(module);
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
      optional("isa"),
      "Joint i is of materials[i % len(materials)]. Raises bristle.Error for values out of range.");
  joints.def("__repr__", [](const Joints& self) {
    return "<bristle.JointFriction of " + std::to_string(self.batch.joint_count()) + " joints>";
  });
  const auto define_step = [&](const char* name, const auto& function, const char* doc) {
    joints.def(name, function, py::arg("angle"), optional("speed"), optional("motor"), optional("outside"),
               py::kw_only(), optional("torque"), optional("mean"), optional("by_angle"),
               optional("by_speed"), optional("by_motor"), optional("by_outside"), optional("gradient"),
               optional("status"), doc);
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
      optional("joint"), "Straightens one joint, or all.");
  define_state<std::size_t>(joints, "joint", &JointFriction::joint_count);
  py::list names;
  cli::for_each_joint_field([&](const std::string& name, const bristle::AboutField&, std::size_t count) {
    if (count == 1)
      names.append(name);
    else
      for (const char* direction : {"_driving", "_driven"}) names.append(name + direction);
  });
  joints.attr("parameter_names") = py::tuple(names);
}

}  // namespace bristle_python
