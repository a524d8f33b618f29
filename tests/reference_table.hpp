// Reads the tables of tests/data: comma-separated, with a header line; fields that contain commas are in
// double quotes. Lines that begin with # say how a table was made.
#pragma once

#include <cstdlib>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "test_paths.hpp"

namespace bristle_test {

using Row = std::map<std::string, std::string>;

/// Returns the fields of a line of CSV. A quoted field may contain commas; a doubled quote inside it stands
/// for one.
inline std::vector<std::string> split_csv_line(const std::string& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (quoted && c == '"' && i + 1 < line.size() && line[i + 1] == '"') {
      fields.back() += '"';
      ++i;
    } else if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      fields.emplace_back();
    } else if (c != '\r') {
      fields.back() += c;
    }
  }
  return fields;
}

/// Returns the folder of the tables: BRISTLE_TEST_DATA of the build, else the folder "data" beside this file.
inline std::string data_folder() {
#ifdef BRISTLE_TEST_DATA
  return BRISTLE_TEST_DATA;
#else
  const std::string here = __FILE__;
  const auto slash = here.find_last_of('/');
  return (slash == std::string::npos ? std::string(".") : here.substr(0, slash)) + "/data";
#endif
}

/// Reads all rows of tests/data/`file`, each as a map from column name to text.
inline std::vector<Row> read_table(const std::string& file) {
  const std::string path = data_folder() + "/" + file;
  std::ifstream in(path);
  if (!in) throw std::runtime_error("cannot open the reference table " + path);
  std::string line;
  while (std::getline(in, line) && line[0] == '#') {
  }
  const std::vector<std::string> names = split_csv_line(line);
  std::vector<Row> rows;
  while (std::getline(in, line)) {
    if (line.empty()) continue;
    const std::vector<std::string> fields = split_csv_line(line);
    if (fields.size() != names.size()) {
      throw std::runtime_error(path + " row " + std::to_string(rows.size() + 2) + " has " +
                               std::to_string(fields.size()) + " fields, expected " +
                               std::to_string(names.size()));
    }
    Row row;
    for (std::size_t k = 0; k < names.size(); ++k) row[names[k]] = fields[k];
    rows.push_back(row);
  }
  if (rows.empty()) throw std::runtime_error("no rows in " + path);
  return rows;
}

/// Returns the number in a row's column; throws if it is missing or not wholly a number.
inline double number(const Row& row, const std::string& column) {
  const auto found = row.find(column);
  if (found == row.end()) throw std::runtime_error("no column " + column);
  char* end = nullptr;
  const double value = std::strtod(found->second.c_str(), &end);
  if (found->second.empty() || *end != '\0') {
    throw std::runtime_error("column " + column + " holds '" + found->second + "', not a number");
  }
  return value;
}

/// Returns a table's first row in which every named column has the given text; throws if there is none.
inline const Row& find_row(const std::vector<Row>& rows, const Row& wanted) {
  for (const Row& row : rows) {
    bool fits = true;
    for (const auto& [column, text] : wanted) fits = fits && row.at(column) == text;
    if (fits) return row;
  }
  throw std::runtime_error("no such row in the reference table");
}

}  // namespace bristle_test
