#include "tools/libraries/files/foreign_csv.hpp"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include "tools/libraries/files/number_text.hpp"
#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/files/user_error.hpp"

namespace cli {
namespace {

constexpr std::size_t most_preface = 100;  // number of first lines in which a CSV header is searched
constexpr std::size_t probed_rows = 50;    // number of rows in which decimal commas are searched

struct Line {
  std::string_view text;
  std::size_t number;  // number of the line in its file, from 1
};

std::string_view unquoted(std::string_view cell) {
  cell = trim(cell);
  if (cell.size() >= 2 && cell.front() == '"' && cell.back() == '"')
    cell = trim(cell.substr(1, cell.size() - 2));
  return cell;
}

/// Splits a line of CSV into cells. The separator ' ' stands for any number of blanks.
std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> cells;
  if (separator == ' ') line = trim(line);
  std::size_t begin = 0;
  bool quoted = false;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    const bool end = i == line.size();
    if (!end && line[i] == '"') quoted = !quoted;
    const bool between = !end && !quoted && (line[i] == separator || (separator == ' ' && line[i] == '\t'));
    if (!end && !between) continue;
    cells.push_back(unquoted(line.substr(begin, i - begin)));
    while (separator == ' ' && i + 1 < line.size() && (line[i + 1] == ' ' || line[i + 1] == '\t')) ++i;
    begin = i + 1;
  }
  return cells;
}

/// Returns the number in a CSV cell with its decimal comma replaced by a point.
std::string with_point(std::string_view cell) {
  std::string number(cell);
  std::replace(number.begin(), number.end(), ',', '.');
  return number;
}

bool is_number(std::string_view cell) { return number_in<double>(with_point(cell)).has_value(); }

/// Returns whether all cells of a row are numbers. A separator at the end of the row makes no cell.
bool all_numbers(std::vector<std::string_view> cells) {
  if (cells.size() > 1 && cells.back().empty()) cells.pop_back();
  return std::all_of(cells.begin(), cells.end(), is_number);
}

char separator_of(std::string_view header, std::string_view row) {
  for (const char c : {';', '\t', ','})
    if (header.find(c) != std::string_view::npos) return c;
  const std::vector<std::string_view> cells = split(row, ' ');
  return cells.size() > 1 && all_numbers(cells) ? ' ' : ',';
}

/// Splits a header cell such as "Position [mm]", "Position (mm)", "position_mm" or "Position / mm" into name
/// and unit. In the last two forms the ending counts only if it is a unit for this kind of column.
struct NameAndUnit {
  std::string_view name, unit;
};
NameAndUnit split_unit(std::string_view cell, std::span<const Unit> units) {
  for (const char* brackets : {"[]", "()"}) {
    const auto open = cell.find(brackets[0]);
    if (open != std::string_view::npos && cell.ends_with(brackets[1]))
      return {trim(cell.substr(0, open)), trim(cell.substr(open + 1, cell.size() - open - 2))};
  }
  for (const char c : {'_', '/'}) {
    const auto at = c == '/' ? cell.find(c) : cell.rfind(c);
    if (at == std::string_view::npos) continue;
    const std::string_view unit = trim(cell.substr(at + 1));
    if (find_unit(units, unit)) return {trim(cell.substr(0, at)), unit};
  }
  return {cell, {}};
}

/// Header of another program's CSV file, with which column of it holds which kind of number (time, position,
/// force ...).
class Header {
 public:
  Header(std::vector<std::string_view> cells, std::span<const ColumnKind> kinds,
         const std::vector<ColumnWish>& wishes)
      : cells_(std::move(cells)), kinds_(kinds), of_(kinds.size()) {
    for (std::size_t k = 0; k < kinds.size(); ++k)
      if (k < wishes.size() && !wishes[k].name.empty()) of_[k] = wished(k, wishes[k].name);
    for (std::size_t k = 0; k < kinds.size(); ++k)
      if (!of_[k] && (k >= wishes.size() || wishes[k].name.empty())) of_[k] = own(k);
  }

  std::vector<bool> present() const {
    std::vector<bool> there;
    for (const auto& column : of_) there.push_back(column.has_value());
    return there;
  }
  const std::vector<std::string_view>& cells() const { return cells_; }
  std::optional<std::size_t> column(std::size_t kind) const { return of_[kind]; }
  std::string_view unit(std::size_t kind) const {
    return split_unit(cells_[*of_[kind]], kinds_[kind].units).unit;
  }
  /// Returns whether the file calls a column otherwise than by its standard name (the unit in brackets
  /// aside).
  bool renamed(std::size_t kind) const {
    const std::string_view cell = cells_[*of_[kind]];
    return trim(cell.substr(0, cell.find('['))) != kinds_[kind].name;
  }

 private:
  bool taken(std::size_t column) const {
    return std::any_of(of_.begin(), of_.end(), [&](const auto& p) { return p && *p == column; });
  }
  std::optional<std::size_t> wished(std::size_t kind, const std::string& name) const {
    for (std::size_t i = 0; i < cells_.size(); ++i)
      if (cells_[i] == name || split_unit(cells_[i], kinds_[kind].units).name == name) return i;
    return std::nullopt;
  }
  std::optional<std::size_t> own(std::size_t kind) const {
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      // Accepts a header with an unclosed bracket, so that the reader of the converted text refuses it with
      // its own message.
      const std::string_view before = trim(cells_[i].substr(0, cells_[i].find('[')));
      const std::string_view name = split_unit(cells_[i], kinds_[kind].units).name;
      if ((name == kinds_[kind].name || before == kinds_[kind].name) && !taken(i)) return i;
    }
    return std::nullopt;
  }
  std::vector<std::string_view> cells_;
  std::span<const ColumnKind> kinds_;
  std::vector<std::optional<std::size_t>> of_;
};

std::vector<Line> lines_of(std::string_view text, std::size_t first_line) {
  std::vector<Line> lines;
  for (std::size_t begin = 0, number = first_line; begin < text.size(); ++number) {
    const std::size_t end = std::min(text.find('\n', begin), text.size());
    std::string_view line = text.substr(begin, end - begin);
    if (line.ends_with('\r')) line.remove_suffix(1);
    lines.push_back({line, number});
    begin = end + 1;
  }
  return lines;
}

bool is_text(const Line& line) { return !trim(line.text).empty() && !line.text.starts_with('#'); }

std::string listed(const std::vector<std::string_view>& cells) {
  std::string all;
  for (const std::string_view cell : cells) all += fmt::format("{}'{}'", all.empty() ? "" : ", ", cell);
  return all;
}

/// Returns whether a row is the one below a CSV header that holds the units of the columns: units and no
/// number.
bool is_unit_row(const std::vector<std::string_view>& cells, const Header& header,
                 std::span<const ColumnKind> kinds) {
  bool any = false;
  for (const std::string_view cell : cells)
    if (is_number(cell)) return false;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    const auto column = header.column(k);
    if (!column || *column >= cells.size()) continue;
    const NameAndUnit unit = split_unit(cells[*column], kinds[k].units);
    any = any || find_unit(kinds[k].units, unit.unit.empty() ? cells[*column] : unit.unit);
  }
  return any;
}

class Converter {
 public:
  Converter(std::string_view text, const std::string& name, std::size_t first_line,
            std::span<const ColumnKind> kinds, const std::vector<ColumnWish>& wishes,
            const std::function<bool(const std::vector<bool>&)>& enough)
      : name_(name), kinds_(kinds), wishes_(wishes), enough_(enough), lines_(lines_of(text, first_line)) {}

  PlainCsv convert() {
    find_header();
    const Header header(split(lines_[at_].text, separator_), kinds_, wishes_);
    settle_wishes(header);
    out_.header = std::string(trim(lines_[at_].text));
    std::size_t first = at_ + 1;
    while (first < lines_.size() && !is_text(lines_[first])) ++first;
    std::vector<std::string_view> units;
    if (first < lines_.size()) {
      units = split(lines_[first].text, separator_);
      if (is_unit_row(units, header, kinds_)) {
        out_.notes.push_back("units from the row below the header");
        at_ = first++;
      } else {
        units.clear();
      }
    }
    out_.header_line = lines_[at_].number;
    note_dialect(first);
    write_header(header, units);
    for (std::size_t i = at_ + 1; i < lines_.size(); ++i) write_row(lines_[i].text);
    return std::move(out_);
  }

 private:
  std::string_view row_after(std::size_t i) const {
    for (++i; i < lines_.size(); ++i)
      if (is_text(lines_[i])) return lines_[i].text;
    return {};
  }

  /// Finds the header of a CSV file: the first line that names enough known columns, else the first line,
  /// for the caller to refuse.
  void find_header() {
    std::optional<std::size_t> first;
    std::size_t seen = 0, passed = 0;
    for (std::size_t i = 0; i < lines_.size() && seen < most_preface; ++i) {
      if (!is_text(lines_[i])) continue;
      ++seen;
      if (!first) first = i;
      const char separator = separator_of(lines_[i].text, row_after(i));
      const std::vector<std::string_view> cells = split(lines_[i].text, separator);
      if (!enough_(Header(cells, kinds_, wishes_).present())) {
        ++passed;
        continue;
      }
      at_ = i;
      separator_ = separator;
      if (passed > 0) out_.notes.push_back(fmt::format("{} lines before the header skipped", passed));
      return;
    }
    at_ = first.value_or(0);
    separator_ = separator_of(lines_[at_].text, row_after(at_));
    const std::vector<std::string_view> cells =
        split(lines_[at_].text, separator_of(lines_[at_].text, lines_[at_].text));
    if (cells.size() > 1 && all_numbers(cells))
      throw UserError(fmt::format(
          "{}:{}: the line holds numbers where the names of the columns are expected: add a header", name_,
          lines_[at_].number));
  }

  void settle_wishes(const Header& header) const {
    for (std::size_t k = 0; k < kinds_.size() && k < wishes_.size(); ++k) {
      if (wishes_[k].name.empty() || header.column(k)) continue;
      throw UserError(fmt::format("{}:{}: no column '{}' for {}; the columns are {}", name_,
                                  lines_[at_].number, wishes_[k].name, kinds_[k].name,
                                  listed(header.cells())));
    }
  }

  void note_dialect(std::size_t first) {
    if (separator_ == ';') out_.notes.push_back("cells between semicolons");
    if (separator_ == '\t') out_.notes.push_back("cells between tabs");
    if (separator_ == ' ') out_.notes.push_back("cells between blanks");
    if (separator_ == ',') return;
    bool comma = false, point = false;
    for (std::size_t i = first, rows = 0; i < lines_.size() && rows < probed_rows; ++i, ++rows) {
      for (const std::string_view cell : split(lines_[i].text, separator_)) {
        if (!is_number(cell)) continue;
        comma = comma || cell.find(',') != std::string_view::npos;
        point = point || cell.find('.') != std::string_view::npos;
      }
    }
    decimal_comma_ = comma && !point;
    if (decimal_comma_) out_.notes.push_back("decimal commas");
  }

  void write_header(const Header& header, const std::vector<std::string_view>& units) {
    std::vector<std::string> names;
    for (const std::string_view cell : header.cells()) {
      std::string other(cell);
      for (char& c : other)
        if (c == ',') c = ' ';
      const bool ours = std::any_of(kinds_.begin(), kinds_.end(), [&](const ColumnKind& kind) {
        return trim(std::string_view(other).substr(0, other.find('['))) == kind.name;
      });
      if (other.empty()) out_.unnamed.push_back(names.size() + 1);
      names.push_back(ours ? "'" + other + "'" : other);
    }
    out_.headers.resize(kinds_.size());
    out_.units.resize(kinds_.size());
    bool renamed = false;
    for (std::size_t k = 0; k < kinds_.size(); ++k) {
      const auto column = header.column(k);
      if (!column) continue;
      std::string unit(header.unit(k));
      if (*column < units.size()) {
        const NameAndUnit below = split_unit(units[*column], kinds_[k].units);
        unit = below.unit.empty() ? below.name : below.unit;
      }
      if (k < wishes_.size() && wishes_[k].unit) unit = wishes_[k].unit->name;
      const std::string_view cell = header.cells()[*column];
      renamed = renamed || header.renamed(k);
      out_.headers[k] = one_line(cell);
      out_.units[k] = unit;
      // Leaves a header cell that has an unclosed bracket as it is, so that the reader of the converted text
      // refuses it.
      const bool broken = unit.empty() && cell.find('[') != std::string_view::npos;
      names[*column] = broken         ? std::string(cell)
                       : unit.empty() ? std::string(kinds_[k].name)
                                      : fmt::format("{} [{}]", kinds_[k].name, unit);
    }
    out_.ours = !renamed && out_.notes.empty() &&
                std::none_of(wishes_.begin(), wishes_.end(), [](const ColumnWish& w) { return w.unit; });
    for (std::size_t i = 0; i < names.size(); ++i) out_.text += (i ? "," : "") + names[i];
    out_.text += '\n';
  }

  void write_row(std::string_view line) {
    // Marks a file with empty lines or quotes as another program's. A motion file of these tools has neither.
    out_.ours = out_.ours && !trim(line).empty() && line.find('"') == std::string_view::npos;
    if (trim(line).empty()) {
      out_.text += '#';  // makes an empty line a comment, which the CSV reader skips
    } else if (line.starts_with('#') || (separator_ == ',' && line.find('"') == std::string_view::npos)) {
      out_.text += line;
    } else {
      bool first = true;
      for (const std::string_view cell : split(line, separator_)) {
        if (!first) out_.text += ',';
        first = false;
        std::string written = decimal_comma_ && is_number(cell) ? with_point(cell) : std::string(cell);
        std::replace(written.begin(), written.end(), ',', ' ');
        out_.text += written;
      }
    }
    out_.text += '\n';
  }

  const std::string& name_;
  std::span<const ColumnKind> kinds_;
  const std::vector<ColumnWish>& wishes_;
  const std::function<bool(const std::vector<bool>&)>& enough_;
  std::vector<Line> lines_;
  PlainCsv out_;
  std::size_t at_ = 0;
  char separator_ = ',';
  bool decimal_comma_ = false;
};

}  // namespace

PlainCsv plain_csv(std::string_view text, const std::string& name, std::size_t first_line,
                   std::span<const ColumnKind> kinds, const std::vector<ColumnWish>& wishes,
                   const std::function<bool(const std::vector<bool>&)>& enough) {
  return Converter(text, name, first_line, kinds, wishes, enough).convert();
}

std::vector<ColumnWish> column_wishes(std::span<const ColumnKind> kinds, const ColumnWords& columns,
                                      const ColumnWords& units) {
  const auto kind_of = [&](std::string_view word, const char* option) {
    std::string known;
    for (std::size_t k = 0; k < kinds.size(); ++k) {
      if (kinds[k].name == word) return k;
      known += fmt::format("{}{}", k > 0 ? ", " : "", kinds[k].name);
    }
    throw UserError(fmt::format("{}: '{}' is no column of a record; allowed: {}", option, word, known));
  };
  std::vector<ColumnWish> wishes(kinds.size());
  for (const auto& [ours, theirs] : columns) {
    if (theirs.empty()) throw UserError(fmt::format("--columns: {} has no name; give {}=NAME", ours, ours));
    wishes[kind_of(ours, "--columns")].name = theirs;
  }
  for (const auto& [ours, unit] : units) {
    const std::size_t k = kind_of(ours, "--units");
    wishes[k].unit = find_unit(kinds[k].units, unit);
    if (!wishes[k].unit)
      throw UserError(fmt::format("--units: unit of {} is '{}'; allowed: {}", kinds[k].name, unit,
                                  unit_names(kinds[k].units)));
  }
  return wishes;
}

std::string mapping_text(const PlainCsv& csv, std::span<const ColumnKind> kinds) {
  std::string text;
  bool bare = false;
  for (std::size_t k = 0; k < kinds.size(); ++k) {
    if (csv.headers[k].empty()) continue;
    const std::string_view name = trim(std::string_view(csv.headers[k]).substr(0, csv.headers[k].find('[')));
    text += fmt::format("{}{}{}{}", text.empty() ? "" : ", ", kinds[k].name,
                        name == kinds[k].name ? "" : fmt::format(" = '{}'", csv.headers[k]),
                        csv.units[k].empty() ? "" : " in " + csv.units[k]);
    bare = bare || csv.units[k].empty();
  }
  if (bare) text += "; SI where no unit is stated";
  for (const std::string& note : csv.notes) text += "; " + note;
  return text;
}

}  // namespace cli
