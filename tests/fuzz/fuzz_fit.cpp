#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "check.hpp"
#include "targets.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/data.hpp"

namespace fuzz {

void fit(Bytes bytes) {
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    cli::FitColumns columns = cli::parse_fit_columns(text, "data.csv");
    const std::size_t rows = columns.t.size();
    check(columns.x.size() == rows && columns.force.size() == rows, "columns are of one length");
    const std::optional<double> load = columns.has_load ? std::nullopt : std::optional<double>(1.0);
    const cli::FitData data = cli::prepare_fit_data(std::move(columns), cli::ForceSign::automatic, load);
    check(data.force.size() == data.load.size() && data.load.size() <= rows,
          "data is as long as the file, but for outliers");
    check(std::isfinite(data.mean_load) && std::isfinite(data.force_scale), "scales are finite");
  } catch (const cli::UserError& error) {
    check(*error.what() != 0, "a refusal says why");
  }
}

}  // namespace fuzz
