#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <unistd.h>

#include "check.hpp"
#include "input.hpp"
#include "targets.hpp"
#include "tests/made_up_reports.hpp"
#include "tools/files/user_error.hpp"
#include "tools/reports/report.hpp"

namespace fuzz {
namespace {

using namespace bristle_test;

/// A file without a name that `read_report_input` can open.
struct NamelessFile {
  explicit NamelessFile(const std::string& text) : file(std::tmpfile(), &std::fclose) {
    check(file != nullptr, "a temporary file can be made");
    std::fwrite(text.data(), 1, text.size(), file.get());
    std::fflush(file.get());
  }
  std::string path() const { return "/proc/self/fd/" + std::to_string(fileno(file.get())); }
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file;
};

/// A value that a report may hold, or one that it may not.
Json any_value(Input& input, const Json& report, const std::vector<Place>& places) {
  switch (input.choice(8)) {
    case 0:
      return nullptr;
    case 1:
      return input.flag();
    case 2:
      return input.bits(8);
    case 3:
      return input.number(1.0);
    case 4:
      return std::string(1 + input.byte(), static_cast<char>(32 + input.choice(95)));
    case 5:
      return input.flag() ? Json::array() : Json::object();
    case 6:
      return Json::array({input.number(1e-3), input.number(1e3)});
    default:  // what stands elsewhere
      return report.value(places[input.bits(2) % places.size()], Json());
  }
}

/// A made-up report with up to eight of its values changed or left out.
std::string changed_report(Input& input) {
  const unsigned kind = input.choice(3);
  Json report = Json::parse(kind == 0   ? capacity_report()
                            : kind == 1 ? accuracy_report("scene")
                                        : stability_report());
  for (int i = 0; i < 8 && !input.empty(); ++i) {
    std::vector<Place> places;
    collect_places(report, Place(), places);
    if (places.empty()) break;
    const Place place = places[input.bits(2) % places.size()];
    Json& parent = report[place.parent_pointer()];
    const unsigned change = input.choice(4);
    if (change == 0 && parent.is_object())
      parent.erase(place.back());
    else if (change == 1 && parent.is_array())
      parent.push_back(any_value(input, report, places));
    else
      report[place] = any_value(input, report, places);
  }
  return report.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace

void report(Bytes bytes) {
  Input input(bytes);
  const unsigned kind = input.choice(4);
  const std::string raw(reinterpret_cast<const char*>(bytes.data()) + (bytes.empty() ? 0 : 1),
                        bytes.empty() ? 0 : bytes.size() - 1);
  const NamelessFile first(kind == 0 ? raw : changed_report(input));
  const NamelessFile second(kind == 3 ? changed_report(input) : stability_report());
  std::vector<std::string> files{first.path()};
  if (kind >= 2) files.push_back(second.path());
  try {
    const std::string page = cli::report_page(cli::read_report_input(files), "2026-02-01T00:00:00Z");
    const std::string fault = fault_of(page);
    check(fault.empty(), fault.c_str());
  } catch (const cli::UserError& error) {
    check(std::string(error.what()).find("/proc/self/fd/") != std::string::npos, "a refusal names the file");
  }
}

}  // namespace fuzz
