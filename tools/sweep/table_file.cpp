#include "tools/sweep/table_file.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <vector>

#include <fmt/format.h>

#if BRISTLE_HAS_NETCDF
#include <netcdf.h>
#endif

#include "tools/files/output_file.hpp"
#include "tools/files/user_error.hpp"
#include "tools/sweep/netcdf_library.hpp"
#include "tools/sweep/results.hpp"

namespace cli {
namespace {

using Json = nlohmann::json;

std::string csv_cell(const Json& cell) {
  if (cell.is_null()) return {};
  if (!cell.is_string()) return cell.dump();
  const std::string text = cell.get<std::string>();
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + '"';
}

#if BRISTLE_HAS_NETCDF

class NetcdfFile {
 public:
  explicit NetcdfFile(const std::string& path) : path_(path) {
    check(BRISTLE_NETCDF(nc_create)(path.c_str(), NC_NETCDF4 | NC_CLOBBER, &file_));
  }
  ~NetcdfFile() {
    if (file_ >= 0) BRISTLE_NETCDF(nc_abort)(file_);
  }
  NetcdfFile(const NetcdfFile&) = delete;
  NetcdfFile& operator=(const NetcdfFile&) = delete;

  int dimension(const char* name, std::size_t size) {
    int id = 0;
    check(BRISTLE_NETCDF(nc_def_dim)(file_, name, size, &id));
    return id;
  }
  int variable(const SweepColumn& column, int dimension, nc_type type) {
    int id = 0;
    check(BRISTLE_NETCDF(nc_def_var)(file_, column.name.c_str(), type, 1, &dimension, &id));
    if (type != NC_STRING)
      check(BRISTLE_NETCDF(nc_put_att_text)(file_, id, "units", unit(column).size(), unit(column).data()));
    if (column.measured)
      attribute("comment", "measured: another in every run, and no part of table_hash", id);
    return id;
  }
  void attribute(const char* name, const std::string& text, int variable = NC_GLOBAL) {
    check(BRISTLE_NETCDF(nc_put_att_text)(file_, variable, name, text.size(), text.data()));
  }
  void fill(int variable, nc_type type, const void* value) {
    check(BRISTLE_NETCDF(nc_put_att)(file_, variable, "_FillValue", type, 1, value));
  }
  void end_definitions() { check(BRISTLE_NETCDF(nc_enddef)(file_)); }
  void put(int variable, const std::vector<double>& values) {
    check(BRISTLE_NETCDF(nc_put_var_double)(file_, variable, values.data()));
  }
  void put(int variable, const std::vector<long long>& values) {
    check(BRISTLE_NETCDF(nc_put_var_longlong)(file_, variable, values.data()));
  }
  void put(int variable, const std::vector<unsigned long long>& values) {
    check(BRISTLE_NETCDF(nc_put_var_ulonglong)(file_, variable, values.data()));
  }
  void put(int variable, const std::vector<std::string>& values) {
    std::vector<const char*> texts;
    for (const std::string& value : values) texts.push_back(value.c_str());
    check(BRISTLE_NETCDF(nc_put_var_string)(file_, variable, texts.data()));
  }
  void close() {
    const int file = std::exchange(file_, -1);
    check(BRISTLE_NETCDF(nc_close)(file));
  }

 private:
  static std::string unit(const SweepColumn& column) { return column.unit.empty() ? "1" : column.unit; }
  void check(int status) const {
    if (status != NC_NOERR)
      throw UserError(fmt::format("{}: NetCDF: {}", path_, BRISTLE_NETCDF(nc_strerror)(status)));
  }
  std::string path_;
  int file_ = -1;
};

constexpr long long no_whole = std::numeric_limits<long long>::min();

nc_type type_of(const SweepColumn& column) {
  switch (column.type) {
    case ColumnType::number:
      return NC_DOUBLE;
    case ColumnType::whole:
      return NC_INT64;
    case ColumnType::hash:
      return NC_UINT64;
    default:
      return NC_STRING;
  }
}

void put_column(NetcdfFile& file, int variable, const SweepColumn& column, const std::vector<Json>& table,
                std::size_t c) {
  std::vector<double> numbers;
  std::vector<long long> wholes;
  std::vector<unsigned long long> hashes;
  std::vector<std::string> texts;
  for (const Json& row : table) {
    const Json cell = row.is_array() && c < row.size() ? row[c] : Json();
    const bool none = cell.is_null();
    switch (column.type) {
      case ColumnType::number:
        numbers.push_back(none ? std::nan("") : cell.get<double>());
        break;
      case ColumnType::whole:
        wholes.push_back(none ? no_whole : cell.get<long long>());
        break;
      case ColumnType::hash:
        hashes.push_back(none ? 0 : std::strtoull(cell.get<std::string>().c_str(), nullptr, 16));
        break;
      case ColumnType::text:
        texts.push_back(none ? std::string() : cell.get<std::string>());
        break;
    }
  }
  switch (column.type) {
    case ColumnType::number:
      return file.put(variable, numbers);
    case ColumnType::whole:
      return file.put(variable, wholes);
    case ColumnType::hash:
      return file.put(variable, hashes);
    case ColumnType::text:
      return file.put(variable, texts);
  }
}

void write_netcdf(const SweepRows& rows, const std::string& path) {
  const std::vector<SweepColumn> columns = columns_of(rows.header);
  std::vector<Json> table;
  for (const std::string& row : rows.rows)
    if (!row.empty()) table.push_back(Json::parse(row));
  NetcdfFile file(path);
  const int dimension = file.dimension("row", table.size());
  std::vector<int> variables;
  for (const SweepColumn& column : columns) {
    variables.push_back(file.variable(column, dimension, type_of(column)));
    const double nan = std::nan("");
    if (column.type == ColumnType::number) file.fill(variables.back(), NC_DOUBLE, &nan);
    if (column.type == ColumnType::whole) file.fill(variables.back(), NC_INT64, &no_whole);
  }
  file.attribute("title", "bristle sweep of " + rows.header.value("scene", std::string("?")));
  file.attribute("study", rows.header["study"].get<std::string>());
  file.attribute("table_hash", rows.table_hash());
  file.attribute("vary", rows.header.value("vary", Json::array()).dump());
  file.attribute("sample", rows.header.value("sample", std::string()));
  file.attribute("source",
                 fmt::format("bristle {}, commit {}", rows.header.value("version", std::string("?")),
                             rows.header.value("commit", std::string("?"))));
  file.end_definitions();
  for (std::size_t c = 0; c < columns.size(); ++c) put_column(file, variables[c], columns[c], table, c);
  file.close();
}

#else

void write_netcdf(const SweepRows&, const std::string&) {}

#endif

}  // namespace

bool is_netcdf(const std::string& path) {
  const std::string ending = std::filesystem::path(path).extension().string();
  return ending == ".nc" || ending == ".nc4" || ending == ".h5" || ending == ".hdf5";
}

void check_table_file(const std::string& path) {
  if (path == "-") return;
  if (is_netcdf(path) && !BRISTLE_HAS_NETCDF)
    throw UserError(
        fmt::format("--out {}: needs NetCDF, which this build was made without: install libnetcdf-dev and "
                    "build again, or write .csv",
                    path));
#if BRISTLE_HAS_NETCDF
  if (is_netcdf(path)) NetcdfLibrary::get();  // rather now than after the study
#endif
  const std::filesystem::path folder = std::filesystem::absolute(path).parent_path();
  if (!std::filesystem::is_directory(folder))
    throw UserError(fmt::format("--out {}: there is no folder {}", path, folder.string()));
  if (std::filesystem::is_directory(path)) throw UserError(fmt::format("--out {}: is a folder", path));
  // The reader of a FIFO would take a trial for all that comes.
  if (!std::filesystem::exists(path) || std::filesystem::is_regular_file(path)) OutputFile trial(path);
}

std::string table_csv(const SweepRows& rows) {
  std::string text;
  const std::vector<SweepColumn> columns = columns_of(rows.header);
  for (std::size_t c = 0; c < columns.size(); ++c) text += (c ? "," : "") + csv_cell(columns[c].head());
  text += '\n';
  for (const std::string& row : rows.rows) {
    if (row.empty()) continue;
    const Json cells = Json::parse(row);
    for (std::size_t c = 0; c < cells.size(); ++c) text += (c ? "," : "") + csv_cell(cells[c]);
    text += '\n';
  }
  return text;
}

void write_table_file(const SweepRows& rows, const std::string& path) {
  OutputFile file(path);
  if (!is_netcdf(path)) return file.write(table_csv(rows));
  write_netcdf(rows, file.place());
  file.finish();
}

}  // namespace cli
