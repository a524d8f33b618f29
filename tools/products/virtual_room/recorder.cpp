#include "tools/products/virtual_room/recorder.hpp"

#include <filesystem>
#include <iterator>

#include <fmt/format.h>

#include "tools/libraries/files/user_error.hpp"

namespace room {

std::string patch_name(int key) {
  constexpr const char* names[surfaces] = {"floor", "end_wall", "left_wall", "right_wall", "roof"};
  if (key == surfaces * corners) return "tool";
  return fmt::format("{}_corner_{}", names[key / corners], key % corners);
}

void Recorder::start_forces(const std::string& path) {
  finish();
  RecordRow old;
  while (rows_.pop(old)) continue;
  forces_.emplace(path, false, false);
  written_ = 0;
  lost_before_ = rows_.dropped();
}

void Recorder::start_all(const std::string& base, const Settings& settings, std::uint64_t revision) {
  start_forces(base + ".csv");
  base_ = base;
  hand_.emplace(base + ".hand.csv");
  hand_text_ = "t,x,y,z,holds,fx,fy,fz,turns,angle\n";
  script_text_ = fmt::format("[settings]\n{}", settings_as_toml(settings));
  settings_.clear();
  revision_ = revision;
}

void Recorder::know(std::uint64_t revision, const Settings& settings) {
  if (hand_) settings_.emplace_back(revision, settings);
}

void Recorder::write(const RecordRow& row) {
  for (std::size_t i = 0; i < row.patches; ++i) {
    const World::PatchForce& p = row.patch[i];
    bristle::Response response;
    response.end[0] = p.force[0];
    response.end[1] = p.force[1];
    response.status = p.status;
    forces_->write(row.time + row.dt, patch_name(p.key), bristle::Outputs::end, response, p.load, p.bristles,
                   p.point[0], p.point[1]);
  }
  ++written_;
  if (!hand_) return;
  const Hand& h = row.hand;
  fmt::format_to(std::back_inserter(hand_text_),
                 "{:.17g},{:.17g},{:.17g},{:.17g},{},{:.17g},{:.17g},{:.17g},{},{:.17g}\n", row.time,
                 h.position[0], h.position[1], h.position[2], h.holds && row.device_there ? 1 : 0, h.force[0],
                 h.force[1], h.force[2], h.turns ? 1 : 0, h.angle);
  if (row.revision != revision_) {
    for (const auto& [revision, settings] : settings_) {
      if (revision != row.revision) continue;
      script_text_ += fmt::format("\n[[change]]\nt = {:.17e}\n{}", row.time, settings_as_toml(settings));
    }
    revision_ = row.revision;
  }
  end_ = row.time + row.dt;
}

void Recorder::drain() {
  RecordRow row;
  while (is_open() && rows_.pop(row)) write(row);
  if (hand_ && hand_text_.size() > (1u << 16)) {
    hand_->append(hand_text_);
    hand_text_.clear();
  }
}

void Recorder::abandon() noexcept {
  try {
    if (forces_) forces_->finish();
    if (hand_) hand_->finish();
  } catch (const cli::UserError&) {
    // Ignores the error of closing: that the recording failed has been reported already.
  }
  forces_.reset();
  hand_.reset();
}

void Recorder::finish() {
  if (!is_open()) return;
  drain();
  forces_->finish();
  forces_.reset();
  if (!hand_) return;
  hand_->write(hand_text_);
  hand_.reset();
  const std::string head = fmt::format(
      "# Recorded by bristle-room. To play it again: --script {0}.toml\n[room]\nseconds = {1:.17e}\n"
      "hand_file = \"{0}.hand.csv\"\n\n",
      std::filesystem::path(base_).filename().string(), end_);
  cli::OutputFile(base_ + ".toml").write(head + script_text_);
}

}  // namespace room
