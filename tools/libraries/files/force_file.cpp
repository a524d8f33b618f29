#include "tools/libraries/files/force_file.hpp"

#include <cmath>
#include <iterator>

namespace cli {

ForceFile::ForceFile(const std::string& path, bool with_mean, bool with_energy)
    : file_(path), with_mean_(with_mean), with_energy_(with_energy) {
  fmt::format_to(std::back_inserter(buffer_), "t,patch,fx,fy,load,bristles,status{}{},x,y\n",
                 with_mean ? ",mean_fx,mean_fy" : "",
                 with_energy ? ",snaps,dissipated,contact_loss,damper_work" : "");
}

void ForceFile::write(double t, const std::string& patch, bristle::Outputs outputs,
                      const bristle::Response& r, double load, double bristles, double x, double y) {
  const auto to = std::back_inserter(buffer_);
  fmt::format_to(to, "{:.9g},{},{:.9g},{:.9g},{:.9g},{},{}", t, patch, r.end[0], r.end[1], load,
                 std::isnan(bristles) ? std::string() : fmt::format("{:.9g}", bristles),
                 status_text(r.status));
  if (with_mean_) {
    if (has(outputs, bristle::Outputs::mean)) {
      fmt::format_to(to, ",{:.9g},{:.9g}", r.mean[0], r.mean[1]);
    } else {
      fmt::format_to(to, ",,");
    }
  }
  if (with_energy_) {
    if (has(outputs, bristle::Outputs::energy)) {
      fmt::format_to(to, ",{},{:.9g},{:.9g},{:.9g}", r.snaps, r.dissipated, r.contact_loss, r.damper_work);
    } else {
      fmt::format_to(to, ",,,,");
    }
  }
  fmt::format_to(to, ",{:.9g},{:.9g}\n", x, y);
  if (buffer_.size() > (1u << 20)) empty_buffer();
}

void ForceFile::empty_buffer() {
  file_.append(std::string(buffer_.data(), buffer_.size()));
  buffer_.clear();
}

void ForceFile::flush() {
  empty_buffer();
  file_.flush();
}

void ForceFile::finish() {
  empty_buffer();
  file_.finish();
}

std::string status_text(bristle::Status status) {
  constexpr struct {
    bristle::Status flag;
    const char* name;
  } flags[] = {{bristle::Status::unknown_id, "unknown_id"},
               {bristle::Status::repeated_id, "repeated_id"},
               {bristle::Status::bad_input, "bad_input"},
               {bristle::Status::overload, "overload"},
               {bristle::Status::no_capacity, "no_capacity"}};
  std::string text;
  for (const auto& f : flags) {
    if (has(status, f.flag)) text += (text.empty() ? "" : "+") + std::string(f.name);
  }
  return text.empty() ? "ok" : text;
}

}  // namespace cli
