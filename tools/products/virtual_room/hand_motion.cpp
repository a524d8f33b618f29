#include "tools/products/virtual_room/hand_motion.hpp"

#include <algorithm>

#include "tools/libraries/files/csv_rows.hpp"
#include "tools/libraries/files/motion_file.hpp"
#include "tools/libraries/files/text_file.hpp"

namespace room {
namespace {

enum Column : unsigned { c_t, c_x, c_y, c_z, c_holds, c_fx, c_fy, c_fz, c_turns, c_angle, c_count };

constexpr cli::Unit no_unit[] = {{"1", 1.0}};
constexpr cli::ColumnKind kinds[c_count] = {
    {"t", cli::time_units}, {"x", cli::length_units}, {"y", cli::length_units}, {"z", cli::length_units},
    {"holds", no_unit},     {"fx", cli::force_units}, {"fy", cli::force_units}, {"fz", cli::force_units},
    {"turns", no_unit},     {"angle", no_unit}};

HandMotion from_motion_file(const cli::MotionFile& file, const RoomMeasures& m) {
  HandMotion motion;
  for (const cli::MotionRow& row : file.rows) {
    HandRow to;
    to.t = row.t;
    to.hand.position[0] = row.x - file.rows.front().x;
    to.hand.position[1] = row.y - file.rows.front().y;
    to.hand.position[2] = m.block[2] + m.tool_radius;
    to.hand.force[2] = -row.load;
    motion.rows.push_back(to);
  }
  return motion;
}

}  // namespace

Hand HandMotion::at(double t) const noexcept {
  if (rows.empty()) {
    Hand nothing;
    nothing.holds = false;
    return nothing;
  }
  const auto after = std::upper_bound(rows.begin(), rows.end(), t,
                                      [](double time, const HandRow& row) { return time < row.t; });
  if (after == rows.begin()) return rows.front().hand;
  const HandRow& a = *(after - 1);
  if (after == rows.end() || after->hand.holds != a.hand.holds || a.t == t) return a.hand;
  const double share = (t - a.t) / (after->t - a.t);
  Hand hand = a.hand;
  for (int i = 0; i < 3; ++i) {
    hand.position[i] += share * (after->hand.position[i] - a.hand.position[i]);
    hand.force[i] += share * (after->hand.force[i] - a.hand.force[i]);
  }
  if (after->hand.turns) hand.angle += share * (after->hand.angle - a.hand.angle);
  return hand;
}

HandMotion read_hand_file(const std::string& path, const RoomMeasures& measures) {
  const std::string whole = cli::read_text_file(path);
  std::size_t header_line = 1;
  const std::string_view text = cli::skip_to_header(whole, path, "t,x,y,z,holds", header_line);
  const cli::CsvHeader header =
      cli::read_csv_header(text.substr(0, text.find('\n')), fmt::format("{}:{}", path, header_line), kinds);
  if (!header.present[c_z]) return from_motion_file(cli::parse_motion_file(whole, path), measures);
  for (const Column needed : {c_t, c_x, c_y}) {
    if (header.present[needed]) continue;
    throw cli::UserError(
        fmt::format("{}:{}: no column {}; expected t,x,y,z,holds", path, header_line, kinds[needed].name));
  }
  HandMotion motion;
  cli::for_csv_rows(text, path, header_line, header, kinds, [&](const auto& cells, const auto& where) {
    double value[c_count] = {};
    value[c_holds] = 1.0;
    for (unsigned c = 0; c < c_count; ++c) {
      if (!header.present[c]) continue;
      value[c] = cli::parse_number(cells[c], kinds[c].name, where()) / header.per_si[c];
    }
    if (!motion.rows.empty()) cli::require_later(value[c_t], motion.rows.back().t, where());
    motion.rows.push_back({value[c_t],
                           {value[c_holds] != 0.0,
                            {value[c_x], value[c_y], value[c_z]},
                            {value[c_fx], value[c_fy], value[c_fz]},
                            value[c_turns] != 0.0,
                            value[c_angle]}});
  });
  if (motion.rows.empty()) throw cli::UserError(fmt::format("{}: no rows under the header", path));
  return motion;
}

}  // namespace room
