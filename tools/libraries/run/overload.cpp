#include "tools/libraries/run/overload.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include <bristle/error.hpp>

#include "tools/libraries/files/csv_rows.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

enum Column : unsigned { column_step, column_patch, column_bristles, column_count };
constexpr ColumnKind kinds[column_count] = {{"step", {}}, {"patch", {}}, {"bristles", {}}};
constexpr const char* expected = "step,patch,bristles";

std::uint64_t parse_count(const char* cell, std::string_view column, double most, const std::string& where) {
  const double value = parse_number(cell, column, where);
  if (!(value >= 0.0 && value <= most) || value != std::floor(value))
    throw UserError(
        fmt::format("{}: {} = {}; allowed: a whole number, 0 to {:.0f}", where, column, cell, most));
  return static_cast<std::uint64_t>(value);
}

}  // namespace

Overload::Overload(const Scene& scene, const OverloadOptions& options, SceneStepper& stepper)
    : stepper_(stepper), record_path_(options.record) {
  // Refuses both options before the file to record is opened, which might be the file to replay.
  if (!options.replay.empty() && !options.record.empty())
    throw UserError(
        "--record-decisions and --replay-decisions: a replay makes no decisions; give one of them");
  for (std::size_t c = 0; c < stepper.copies().size(); ++c) copy_of_[stepper.motions()[c].id.value] = c;
  if (!options.replay.empty()) {
    if (options.budget_us)
      throw UserError("--budget and --replay-decisions: a replay does not read the clock; give one of them");
    result_.replayed = true;
    read_decisions(options.replay);
  } else if (options.budget_us || scene.budget) {
    result_.budget_s = options.budget_us ? *options.budget_us * 1e-6 : *scene.budget;
    try {
      shedder_.emplace(bristle::LoadShedderOptions{}
                           .with_budget(result_.budget_s)
                           .with_record(2 * stepper.copies().size() + 16));
      // Adds patches to the load shedder in ascending priority, so that it appends each and moves none.
      std::vector<std::size_t> order(stepper.copies().size());
      std::iota(order.begin(), order.end(), std::size_t{0});
      const auto patch_of = [&](std::size_t c) -> const ScenePatch& {
        return scene.patches[stepper.copies()[c].patch];
      };
      std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return patch_of(a).priority < patch_of(b).priority;
      });
      for (const std::size_t c : order)
        shedder_->add(stepper.motions()[c].id, patch_of(c).priority, patch_of(c).least_bristles);
    } catch (const bristle::Error& error) {
      throw UserError(error.what());
    }
  }
  if (record_path_.empty()) return;
  if (!is_on())
    throw UserError(
        "--record-decisions: there are no decisions without a budget; give --budget, or budget in [scene]");
  record_ = OutputFile(record_path_);
  record_.append(std::string(expected) + '\n');
}

void Overload::read_decisions(const std::string& path) {
  std::map<std::string, std::size_t, std::less<>> copy_of_name;
  for (std::size_t c = 0; c < stepper_.copies().size(); ++c) copy_of_name[stepper_.copies()[c].name] = c;
  const std::string text = read_text_file(path);
  std::size_t header_line = 1;
  const std::string_view table = skip_to_header(text, path, expected, header_line);
  const std::string place = fmt::format("{}:{}", path, header_line);
  const CsvHeader header = read_csv_header(table.substr(0, table.find('\n')), place, kinds);
  for (unsigned k = 0; k < column_count; ++k)
    if (!header.present[k])
      throw UserError(fmt::format("{}: no column {}; expected {}", place, kinds[k].name, expected));
  for_csv_rows(table, path, header_line, header, kinds, [&](const auto& cells, const auto& where) {
    bristle::DetailDecision decision;
    decision.step = parse_count(cells[column_step], "step", 1e15, where());
    const auto copy = copy_of_name.find(std::string_view(cells[column_patch]));
    if (copy == copy_of_name.end())
      throw UserError(fmt::format("{}: the scene has no patch '{}'", where(), cells[column_patch]));
    decision.patch = stepper_.motions()[copy->second].id;
    const std::uint32_t most = stepper_.batch().info(decision.patch).representatives;
    decision.bristles =
        static_cast<std::uint32_t>(parse_count(cells[column_bristles], "bristles", most, where()));
    if (decision.bristles == 0) throw UserError(fmt::format("{}: bristles = 0; at least one stays", where()));
    if (!replay_.empty() && decision.step < replay_.back().step)
      throw UserError(
          fmt::format("{}: step {} comes after step {}", where(), decision.step, replay_.back().step));
    replay_.push_back(decision);
  });
}

void Overload::write_decisions() {
  if (!shedder_ || shedder_->decisions().empty()) return;
  if (record_) {
    std::string text;
    for (const bristle::DetailDecision& d : shedder_->decisions())
      text += fmt::format("{},{},{}\n", d.step, stepper_.copies()[copy_of_[d.patch.value]].name, d.bristles);
    record_.append(text);
  }
  shedder_->clear_decisions();
}

void Overload::note_worst(int changed) {
  if (changed == 0) return;
  std::uint64_t left_out = 0;
  for (const bristle::Motion& motion : stepper_.motions()) {
    const bristle::PatchInfo info = stepper_.batch().info(motion.id);
    left_out += info.representatives - info.detail;
    double& least = info.weight == 0.0 ? result_.least_pieces : result_.least_share;
    least = std::min(least, static_cast<double>(info.detail) / info.representatives);
  }
  result_.most_bristles = std::max(result_.most_bristles, left_out);
  result_.decisions += static_cast<std::uint64_t>(changed);
}

void Overload::before_step() {
  if (shedder_) {
    note_worst(shedder_->before_step(stepper_.batch(), stepper_.motions()));
  } else if (next_ < replay_.size()) {
    const std::size_t applied =
        bristle::apply_decisions(stepper_.batch(), {replay_.data() + next_, replay_.size() - next_}, step_);
    next_ += applied;
    note_worst(static_cast<int>(applied));
  }
  ++step_;
}

void Overload::after_step(double time_s) {
  if (!shedder_) return;
  note_worst(shedder_->after_step(stepper_.batch(), stepper_.motions(), time_s, stepper_.report()));
}

OverloadResult Overload::finish() {
  if (record_) record_.finish();
  // Applies recorded changes made after the last step: they are part of the final state.
  if (result_.replayed) before_step();
  for (const bristle::Motion& motion : stepper_.motions()) {
    const bristle::PatchInfo info = stepper_.batch().info(motion.id);
    if (info.detail == info.representatives) continue;
    ++result_.patches;
    result_.bristles += info.representatives - info.detail;
  }
  if (shedder_) {
    const bristle::ShedReport report = shedder_->report(stepper_.batch());
    result_.late_steps = report.late_steps;
    result_.rate_s = report.rate_s;
  }
  return result_;
}

}  // namespace cli
