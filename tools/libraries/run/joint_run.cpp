// Runs scenes with joints, for `bristle run`.
#include <cstring>

#include <bristle/error.hpp>
#include <bristle/joint_friction.hpp>

#include "tools/libraries/files/force_file.hpp"
#include "tools/libraries/files/joint_fields.hpp"
#include "tools/libraries/reports/table.hpp"
#include "tools/libraries/reports/text_layout.hpp"
#include "tools/libraries/run/part_scene.hpp"

namespace cli {
namespace {

/// Numbers of a row of a joint's path: angle (rad), torque of the motor and from outside (N m).
enum JointNumber : std::size_t { at_angle, at_motor, at_outside, joint_numbers };

struct SceneJoint {
  std::string name, where;
  bristle::JointMaterial material;
  std::vector<PathRow<joint_numbers>> path;
};

struct JointResult {
  ForceStatistics torque;
  double work = 0.0;          ///< energy that the joint took, J
  std::uint64_t refused = 0;  ///< number of the joint's steps refused with Status::bad_input
};

void read_joint_row(const TomlTable& table, PathRow<joint_numbers>& row, bool) {
  table.allow({"t", "angle", "motor", "outside"});
  row.at[at_angle] = table.number("angle", {-1e6, 1e6, false, "rad"}, row.at[at_angle]);
  row.at[at_motor] = table.number("motor", {-1e12, 1e12, false, "N m"}, row.at[at_motor]);
  row.at[at_outside] = table.number("outside", {-1e12, 1e12, false, "N m"}, row.at[at_outside]);
}

void read_joint(const TomlTable& table, SceneJoint& joint) {
  std::vector<std::string> keys = {"name", "path"};
  double numbers[bristle::joint_parameters] = {};
  std::size_t i = 0;
  for_each_joint_field([&](const std::string& key, const bristle::AboutField& about, std::size_t count) {
    keys.push_back(key);
    const Range range{about.or_zero ? 0.0 : about.least, about.most, false, about.unit};
    if (count == 1) {
      numbers[i] = i == bristle::joint_stiffness ? table.number(key, range) : table.number(key, range, 0.0);
    } else if (table.has(key)) {
      const std::vector<double> given = table.numbers(key, range);
      if (given.size() != count) table.fail(key, "needs two numbers: while it drives, while it is driven");
      std::copy(given.begin(), given.end(), numbers + i);
    }
    i += count;
  });
  table.allow({keys.begin(), keys.end()});
  std::memcpy(&joint.material, numbers, sizeof joint.material);
  joint.path = read_path<joint_numbers>(table, read_joint_row);
}

Json report_json(const PartScene<SceneJoint>& given, const std::vector<JointResult>& results,
                 const bristle::JointFriction& joints, std::uint64_t steps) {
  Json report = begin_report("joints", given.scene, steps);
  for (std::size_t j = 0; j < results.size(); ++j)
    report["joints"].push_back({{"name", given.parts[j].name},
                                {"torque", results[j].torque},
                                {"work", results[j].work},
                                {"bad_input", results[j].refused}});
  end_report(report, joints);
  return report;
}

std::string report_text(const PartScene<SceneJoint>& given, const std::vector<JointResult>& results,
                        std::uint64_t steps, std::uint64_t hash) {
  Table table({"<friction on the joint", "mean N m", "min", "max", "work put in J", "steps refused"});
  const auto number = [](double value) { return fmt::format("{:.4g}", value); };
  for (std::size_t j = 0; j < results.size(); ++j) {
    const JointResult& r = results[j];
    table.add({given.parts[j].name, number(r.torque.mean()), number(r.torque.min), number(r.torque.max),
               number(r.work), std::to_string(r.refused)});
  }
  return fmt::format("{}: {} of {} steps of {:g} s\n\n{}\nstate hash  {:016x}\n", given.scene.name,
                     results.size() == 1 ? "a joint" : fmt::format("{} joints", results.size()), steps,
                     given.scene.dt, table.text(), hash);
}

}  // namespace

bool run_joint_scene(const RunOptions& options, const std::string& text) {
  const std::optional<PartScene<SceneJoint>> read =
      parse_part_scene<SceneJoint>(text, options.scene, "joint", read_joint);
  if (!read) return false;
  const PartScene<SceneJoint>& given = *read;
  check_part_options(options, "joint");
  const Scene& scene = given.scene;
  const bool on_stdout =
      check_files({{"SCENE", options.scene}}, {{"--json", options.json}, {"--csv", options.out}});
  OutputFile json(options.json), out_file(options.out);
  const std::size_t n = given.parts.size();
  std::vector<bristle::JointMaterial> materials;
  for (const SceneJoint& joint : given.parts) materials.push_back(joint.material);
  std::optional<bristle::JointFriction> made;
  try {
    made.emplace(n, bristle::Span<const bristle::JointMaterial>(materials), bristle::JointOptions{},
                 batch_options(scene, options));
  } catch (const bristle::Error& error) {
    throw UserError(fmt::format("{}: {}", options.scene, error.what()));
  }
  bristle::JointFriction& joints = *made;
  std::vector<double> angle(n), speed(n), motor(n), outside(n), torque(n), mean(n), before(n);
  std::vector<bristle::Status> status(n);
  std::vector<JointResult> results(n);
  if (out_file) out_file.append("t,joint,torque,mean,angle,motor,outside,status\n");
  const std::uint64_t steps = options.steps.value_or(step_count(scene));
  // Step 0 places the joints at their first angles, where their bristles are straight.
  for (std::uint64_t k = 0; k <= steps; ++k) {
    const double t = static_cast<double>(k) * scene.dt;
    for (std::size_t j = 0; j < n; ++j) {
      const PathRow<joint_numbers> row = row_at(given.parts[j].path, t);
      before[j] = k == 0 ? row.at[at_angle] : angle[j];
      angle[j] = row.at[at_angle];
      speed[j] = (angle[j] - before[j]) / scene.dt;
      motor[j] = row.at[at_motor];
      outside[j] = row.at[at_outside];
    }
    bristle::JointOutput out;
    out.torque = torque;
    out.mean = mean;
    out.status = status;
    joints.step({angle, speed, motor, outside}, out);
    for (std::size_t j = 0; j < n && k > 0; ++j) {
      JointResult& r = results[j];
      r.torque.add(torque[j]);
      r.work -= mean[j] * (angle[j] - before[j]);
      r.refused += has(status[j], bristle::Status::bad_input) ? 1 : 0;
      if (out_file)
        out_file.append(fmt::format("{:.9g},{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{}\n", t,
                                    given.parts[j].name, torque[j], mean[j], angle[j], motor[j], outside[j],
                                    status_text(status[j])));
    }
  }
  if (out_file) out_file.finish();
  if (!on_stdout) print_report(report_text(given, results, steps, joints.state_hash()));
  if (json) json.write(json_text(report_json(given, results, joints, steps)));
  return true;
}

}  // namespace cli
