// Finds the known name nearest to a misspelt one, for error messages. Uses only the standard library.
#pragma once

#include <algorithm>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

namespace cli {

using NameList = std::vector<std::string>;

/// Returns a name that begins with `name`, or the one nearest by edit distance; "" if none is near.
inline std::string nearest_name(std::string_view name, const NameList& names) {
  std::string best;
  std::size_t least = std::min(std::max<std::size_t>(2, name.size() / 2) + 1, name.size());
  for (const std::string& other : names) {
    // Computes Levenshtein's edit distance (insertions, deletions, replacements) row by row.
    std::vector<std::size_t> row(other.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < name.size(); ++i) {
      std::size_t diagonal = row[0];
      row[0] = i + 1;
      for (std::size_t j = 0; j < other.size(); ++j) {
        const std::size_t changed = diagonal + (name[i] != other[j]);
        diagonal = row[j + 1];
        row[j + 1] = std::min({row[j] + 1, row[j + 1] + 1, changed});
      }
    }
    const bool begun = name.size() >= 3 && std::string_view(other).substr(0, name.size()) == name;
    const std::size_t edits = begun ? 1 : row.back();
    if (edits >= least) continue;
    least = edits;
    best = other;
  }
  return best;
}

/// Returns a hint for an error message, " (did you mean 'x'?)", or "" if no name is near.
inline std::string meant(std::string_view name, const NameList& names) {
  const std::string nearest = nearest_name(name, names);
  return nearest.empty() ? nearest : " (did you mean '" + nearest + "'?)";
}

/// Returns the end of an error message on an unknown name: " (did you mean 'x'?); allowed: x, y".
inline std::string allowed_text(std::string_view name, const NameList& names) {
  std::string text = meant(name, names) + "; allowed:";
  for (const std::string& known : names) text += (&known == names.data() ? " " : ", ") + known;
  return names.empty() ? text + " none" : text;
}

}  // namespace cli
