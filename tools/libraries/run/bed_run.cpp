// Runs scenes with beds, for `bristle run`.
#include <algorithm>
#include <optional>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <bristle/bed.hpp>
#include <bristle/error.hpp>

#include "tools/libraries/files/force_file.hpp"
#include "tools/libraries/files/toml_table.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/reports/table.hpp"
#include "tools/libraries/reports/text_layout.hpp"
#include "tools/libraries/run/part_scene.hpp"
#include "tools/libraries/scene/scene_stepper.hpp"

namespace cli {
namespace {

/// Numbers of a row of a bed's path: displacement x, y (m), turn (rad), rolled distance x, y (m), load (N).
enum BedNumber : std::size_t { at_x, at_y, at_spin, at_rolled, at_load = at_rolled + 2, bed_numbers };
using BedRow = PathRow<bed_numbers>;

struct SceneBed {
  std::string name, where;
  bristle::BedMaterial material;
  bristle::BedShape shape;
  bristle::BedOptions options;
  std::vector<BedRow> path;
};

constexpr Range metres{-1e5, 1e5, false, "m"}, half_width{0.0, 1e3, false, "m"};
constexpr Range positive{0.0, 1e15, true, ""};

bristle::BedMaterial read_material(const TomlTable& table) {
  double friction[2];
  table.pair("friction", {0.0, 100.0, false, ""}, friction);  // coefficients of static and kinetic friction
  if (friction[1] == 0.0) friction[1] = friction[0];
  bristle::BedMaterial material(friction[0], friction[1]);
  if (table.has("shear_modulus"))
    material.with_elastic(table.number("shear_modulus", positive), table.number("poisson", {0.0, 0.5}),
                          table.number("radius", {0.0, 1e6, false, "m"}, 0.0));
  if (table.has("slip_stiffness")) {
    table.pair("slip_stiffness", {0.0, 1e15, false, "N"}, material.slip_stiffness);
    if (material.slip_stiffness[1] == 0.0) material.slip_stiffness[1] = material.slip_stiffness[0];
  }
  if (table.has("flexibility")) {
    const std::vector<double> given = table.numbers("flexibility", {0.0, 1.0, true, "m^3/N"});
    if (given.size() != 3) table.fail("flexibility", "needs three numbers: x, y, spin");
    material.with_flexibility(given[0], given[1], given[2]);
  }
  material.presliding = table.number("presliding", {0.0, 1e3, false, "m"}, 0.0);
  return material;
}

bristle::BedShape read_shape(const TomlTable& table) {
  using bristle::BedShape;
  double half[2] = {0.0, 0.0}, cells[2] = {0.0, 0.0};
  if (table.has("half")) table.pair("half", half_width, half);
  if (table.has("cells")) table.pair("cells", {1.0, 65536.0}, cells);
  const bool rolls = table.has("rolling");
  const auto pressure =
      static_cast<bristle::BedPressure>(table.choice("pressure", {"uniform", "parabolic", "hertz"}, 1));
  const auto cell = [&](int axis, int otherwise) {
    return cells[axis] == 0.0 ? otherwise : static_cast<int>(cells[axis]);
  };
  BedShape shape;
  switch (table.choice("shape", {"sphere", "wheel", "cylinder", "disc", "ellipse", "rectangle"}, 6)) {
    case 0:
      shape = BedShape::sphere_row(cell(0, 32), half[0]);
      break;
    case 1:
      shape = BedShape::wheel_row(half[0], pressure, cell(0, 32));
      break;
    case 2:
      shape = BedShape::cylinder_row(half[0], cell(0, 32));
      break;
    case 3:
      shape = BedShape::disc(half[0], pressure, cell(0, 7), cell(1, 0));
      break;
    case 4:
      shape = BedShape::ellipse(half[0], half[1], pressure, cell(0, 7), cell(1, 0));
      break;
    case 5:
      shape = BedShape::rectangle(half[0], half[1], pressure, cell(0, 16), cell(1, 8));
      break;
    default:
      table.fail("key 'shape' is missing");
  }
  if (rolls) {
    double grid[2];
    table.pair("rolling", {1.0, 1024.0}, grid);
    shape.rolling(static_cast<int>(grid[0]), static_cast<int>(grid[1]));
  }
  if (table.has("growth"))
    shape.grown(
        static_cast<bristle::BedGrowth>(table.choice("growth", {"fixed", "cube_root", "square_root"}, 0)));
  return shape;
}

void read_bed_row(const TomlTable& table, BedRow& row, bool first) {
  table.allow({"t", "x", "y", "spin", "rolled", "load"});
  if (first && !table.has("load")) table.fail("key 'load' is missing in the first row");
  row.at[at_x] = table.number("x", metres, row.at[at_x]);
  row.at[at_y] = table.number("y", metres, row.at[at_y]);
  row.at[at_spin] = table.number("spin", {-1e6, 1e6, false, "rad"}, row.at[at_spin]);
  if (table.has("rolled")) {
    double rolled[2];
    table.pair("rolled", {-1e9, 1e9, false, "m"}, rolled);
    std::copy_n(rolled, 2, &row.at[at_rolled]);
  }
  row.at[at_load] = table.number("load", {0.0, 1e15, false, "N"}, row.at[at_load]);
}

struct BedResult {
  ForceStatistics force[2], torque, load;
  double work = 0.0, dissipated = 0.0, stored = 0.0, most_slipping = 0.0;
  std::uint64_t refused = 0;  ///< number of a bed's steps refused with Status::bad_input
};

void read_bed(const TomlTable& t, SceneBed& bed) {
  t.allow({"name", "shape", "half", "cells", "pressure", "growth", "rolling", "friction", "shear_modulus",
           "poisson", "radius", "slip_stiffness", "flexibility", "presliding", "max_normal_load",
           "longest_piece", "path"});
  bed.material = read_material(t);
  bed.shape = read_shape(t);
  bed.options.max_normal_load = t.number("max_normal_load", {0.0, 1e15, true, "N"});
  bed.options.longest_piece = t.number("longest_piece", {1e-3, 10.0}, bed.options.longest_piece);
  bed.path = read_path<bed_numbers>(t, read_bed_row);
}

/// Returns the motion that moves a bed from one row of its path to the other.
bristle::BedMotion motion_between(bristle::BedId id, const BedRow& from, const BedRow& to) {
  bristle::BedMotion m;
  m.id = id;
  const auto moved = [&](std::size_t i) { return to.at[i] - from.at[i]; };
  for (std::size_t axis = 0; axis < 2; ++axis) {
    m.displacement[axis] = moved(at_x + axis);
    m.rolled[axis] = moved(at_rolled + axis);
  }
  m.spin = moved(at_spin);
  m.normal_load = to.at[at_load];
  return m;
}

void gather(BedResult& result, const bristle::BedMotion& motion, const bristle::BedResponse& r) {
  for (int axis = 0; axis < 2; ++axis) {
    result.force[axis].add(r.force[axis]);
    result.work -= r.mean[axis] * motion.displacement[axis];
  }
  result.work -= r.mean_torque * motion.spin;
  result.torque.add(r.torque);
  result.load.add(motion.normal_load);
  result.dissipated += r.dissipated;
  result.stored = r.stored;
  result.most_slipping = std::max(result.most_slipping, r.slipping_share);
  result.refused += has(r.status, bristle::Status::bad_input) ? 1 : 0;
}

Json report_json(const PartScene<SceneBed>& given, const std::vector<BedResult>& results,
                 const bristle::BedBatch& beds, const std::vector<bristle::BedMotion>& motions,
                 std::uint64_t steps) {
  Json report = begin_report("beds", given.scene, steps);
  for (std::size_t b = 0; b < results.size(); ++b) {
    const BedResult& r = results[b];
    report["beds"].push_back(
        {{"name", given.parts[b].name},
         {"bristles", beds.info(motions[b].id).bristles},
         {"load", r.load},
         {"force", {{"x", r.force[0]}, {"y", r.force[1]}}},
         {"torque", r.torque},
         {"energy", {{"work", r.work}, {"dissipated", r.dissipated}, {"stored", r.stored}}},
         {"most_slipping", r.most_slipping},
         {"bad_input", r.refused}});
  }
  end_report(report, beds);
  return report;
}

std::string report_text(const PartScene<SceneBed>& given, const std::vector<BedResult>& results,
                        std::uint64_t steps, std::uint64_t hash) {
  Table forces({"<force on the body", "load N", "fx mean N", "min", "max", "fy mean N", "min", "max",
                "torque mean N m", "min", "max"});
  Table energies(
      {"<energy", "put in J", "lost J", "stored at the end J", "most of it that slipped %", "steps refused"});
  const auto number = [](double value) { return fmt::format("{:.4g}", value); };
  for (std::size_t b = 0; b < results.size(); ++b) {
    const BedResult& r = results[b];
    std::vector<Cell> row = {given.parts[b].name, number(r.load.mean())};
    for (const ForceStatistics* f : {&r.force[0], &r.force[1], &r.torque})
      for (const double value : {f->mean(), f->min, f->max}) row.push_back(number(value));
    forces.add(std::move(row));
    energies.add({given.parts[b].name, number(r.work), number(r.dissipated), number(r.stored),
                  fmt::format("{:.1f}", 100.0 * r.most_slipping), std::to_string(r.refused)});
  }
  return fmt::format("{}: {} of {} steps of {:g} s\n\n{}\n{}\nstate hash  {:016x}\n", given.scene.name,
                     results.size() == 1 ? "a bed" : fmt::format("{} beds", results.size()), steps,
                     given.scene.dt, forces.text(), energies.text(), hash);
}

}  // namespace

bool run_bed_scene(const RunOptions& options, const std::string& text) {
  const std::optional<PartScene<SceneBed>> read =
      parse_part_scene<SceneBed>(text, options.scene, "bed", read_bed);
  if (!read) return false;
  const PartScene<SceneBed>& given = *read;
  check_part_options(options, "bed");
  const Scene& scene = given.scene;
  const bool on_stdout =
      check_files({{"SCENE", options.scene}}, {{"--json", options.json}, {"--csv", options.out}});
  OutputFile json(options.json), out_file(options.out);
  bristle::BedBatch beds(batch_options(scene, options));
  std::vector<bristle::BedMotion> motions(given.parts.size());
  std::vector<bristle::BedResponse> responses(given.parts.size());
  std::vector<BedRow> last(given.parts.size());
  std::vector<BedResult> results(given.parts.size());
  for (std::size_t b = 0; b < given.parts.size(); ++b) {
    const SceneBed& bed = given.parts[b];
    try {
      motions[b].id = beds.add(bed.material, bed.shape, bed.options);
    } catch (const bristle::Error& error) {
      throw UserError(fmt::format("{}: {}", bed.where, error.what()));
    }
    last[b] = row_at(bed.path, 0.0);
  }
  if (out_file) out_file.append("t,bed,fx,fy,torque,load,status,dissipated,stored,slipping_share,x,y\n");
  const std::uint64_t steps = options.steps.value_or(step_count(scene));
  for (std::uint64_t k = 1; k <= steps; ++k) {
    const double t = static_cast<double>(k) * scene.dt;
    for (std::size_t b = 0; b < motions.size(); ++b) {
      const BedRow row = row_at(given.parts[b].path, t);
      motions[b] = motion_between(motions[b].id, last[b], row);
      last[b] = row;
    }
    beds.step({motions.data(), motions.size()}, {responses.data(), responses.size()});
    for (std::size_t b = 0; b < motions.size(); ++b) {
      const bristle::BedResponse& r = responses[b];
      gather(results[b], motions[b], r);
      if (out_file)
        out_file.append(
            fmt::format("{:.9g},{},{:.9g},{:.9g},{:.9g},{:.9g},{},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", t,
                        given.parts[b].name, r.force[0], r.force[1], r.torque, motions[b].normal_load,
                        status_text(r.status), r.dissipated, r.stored, r.slipping_share, last[b].at[at_x],
                        last[b].at[at_y]));
    }
  }
  if (out_file) out_file.finish();
  if (!on_stdout) print_report(report_text(given, results, steps, beds.state_hash()));
  if (json) json.write(json_text(report_json(given, results, beds, motions, steps)));
  return true;
}

}  // namespace cli
