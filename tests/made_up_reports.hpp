// Small reports of capacity, accuracy and stability with made-up numbers, places in them, and what is wrong
// with a page that was made of them.
#pragma once

#include <cctype>
#include <cstddef>
#include <set>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

namespace bristle_test {

inline const char* const conditions =
    R"("conditions": {"version": "0.1.0", "commit": "abc1234", "flags": "GNU 12 -O3",
  "cpu": "Test & CPU <7>", "cores": 2, "isa": "avx2", "time": "2026-01-31T12:00:00Z"}, "quick": false)";

inline std::string capacity_report() {
  return std::string("{\"schema\": \"bristle-capacity-1\", ") + conditions + R"(,
  "state_hash": "00c0ffee00c0ffee", "deadline_s": 1e-3, "dt_s": 1e-3, "mean_snap_length_m": 1e-5,
  "snap_length": "uniform", "note": "the note", "motions": [{"name": "all snap", "meaning": "a meaning"}],
  "paper": {"bristles": 900},
  "targets": [
    {"name": "first", "what": "w", "measured": 0.4321, "spread": [0.43, 0.44], "limit": 0.55, "at_least": false,
     "unit": "ns", "met": true},
    {"name": "second", "what": "w", "measured": 1.23, "spread": [1.1, 1.3], "limit": 1.8, "at_least": true,
     "unit": "times", "met": false}],
  "features": [],
  "comparisons": [
    {"bristles": 14400, "motion": "all snap", "loop": "bristle: 2 axes", "ns_per_bristle": 0.5,
     "time_over_bristle": 1.0, "quartiles": [1, 1]},
    {"bristles": 14400, "motion": "all snap", "loop": "plain arrays", "ns_per_bristle": 0.385,
     "time_over_bristle": 0.77, "quartiles": [0.761, 0.783]}],
  "capacities": [
    {"motion": "all snap", "kernel": "2 axes, keep, end + mean, single", "layout": "one patch", "threads": 1,
     "bristles": 1543000, "more_would_fit": false,
     "at_capacity": {"ns_per_bristle": 0.6417, "p50_s": 9.1e-4, "p99_s": 9.87e-4, "max_s": 2.5e-3},
     "in_cache": {"ns_per_bristle": null}}]})";
}

inline std::string accuracy_report(const std::string& scene) {
  const std::string setting =
      R"("as_scene": false, "bristles": 13000, "dt_s": 1e-3, "step_rule": "exact", "precision": "single",
         "sampling": "stratified", "force": "end")";
  return std::string("{\"schema\": \"bristle-accuracy-1\", ") + conditions + R"(,
  "scene": {"name": )" +
         nlohmann::json(scene).dump() + R"(, "file": "f.toml", "dt_s": 1e-3, "deadline_s": 1e-3},
  "reference": {"dt_s": 1e-4, "bristles": 31000, "runs": 6, "precision": "double",
    "patches": [{"name": "tip", "standard_error": 0.00263}]},
  "settings": [{)" +
         setting + R"(, "error": {"rms": 0.00831, "max": 0.0476, "energy": 0.00538},
     "scene_step_s": 5.31e-6, "ns_per_bristle": 0.408, "pareto": true}],
  "not_run": ["a", "b"],
  "slopes": [{"patch": "tip", "against": "bristles", "slope": -0.4678, "standard_error": null, "points": 2,
    "theory": "-1/2"}],
  "recommendation": {"wanted_error": 0.01, "found": true, "least_error": 0.0029, "setting": {)" +
         setting + R"(},
    "search": {"error": {"rms": 0.00831, "max": 0.0476, "energy": 0.00538}, "scene_step_s": 5.31e-6},
    "confirmed": {"error": {"rms": 0.00918, "max": 0.0436, "energy": 0.00532}, "scene_step_s": 5.44e-6},
    "as_scene": {"steps": 10000, "p99_s": 2.05e-5, "max_s": 0.02, "misses": 13, "misses_ours": 1},
    "share_of_deadline": 0.00544, "fragment": "bristles = 13000  # <pasted> & used\n"},
  "features": [{"feature": "redraw", "state": "used", "advice": "keep", "saves": 0.391, "quartiles": [0.384, 0.397],
    "error_with": 0.0213, "error_without": 0.0269}, {"feature": "second axis", "state": "needed", "advice": "bends"}]})";
}

inline std::string stability_report() {
  return std::string("{\"schema\": \"bristle-stability-1\", ") + conditions + R"(,
  "k": [0.001, 71], "c_or_beta": [0.001, 6.6],
  "maps": [{"scheme": "explicit Euler", "linear_condition": "k < c", "agreeing": 3, "fraction_agreeing": 0.75,
    "why_not": {"other": 1}, "cells": [{}, {}, {}, {}]}],
  "varied": [{"scheme": "explicit Euler", "turned": {"cells": 8, "agreeing": 7}, "swinging_load": {
    "stable_at_all_loads": {"cells": 5, "settle": 4}, "stable_at_some": {"cells": 0, "settle": 0},
    "stable_at_none": {"cells": 2, "settle": 0}}}],
  "stopping_distances": [
    {"k": 0.8, "way_over_mean_snap_length": 30, "scheme": "midpoint", "ratio": 0.9987},
    {"k": 0.8, "way_over_mean_snap_length": 30, "scheme": "explicit", "ratio": null}],
  "rests": [{"scheme": "midpoint", "seconds": 3600, "first_second_m": 1.3e-6, "creep_m": -2.5e-19}],
  "pulled": [{"contact": "creep", "scheme": "midpoint", "mass_kg": 52.5, "load_n": 11, "speed_m_per_s": 2.3e-5,
    "dt_s": 1e-3, "critical_stiffness_n_per_m": {"theory": 12600, "measured": 12900},
    "on_a_quarter": {"slowest_over_pull": -0.012, "fastest_over_pull": 6.78, "lowest_force_n": 3.21,
      "highest_force_n": 4.56}}],
  "cases": [{"name": "stiff", "scheme": "hold", "mass_kg": 0.1, "stiffness_n_per_m": 8e4, "damping_ns_per_m": 20,
    "dt_s": 1e-3, "mean_snap_length_m": 1e-5,
    "starts": [{"start_velocity_m_per_s": 0.01, "verdict": "rings", "peak_to_peak_m": 1.7e-5}]}],
  "late_force": [{"force": "end", "device_damping_over_kt": 0.501}]})";
}

/// Every tag closed in order, every '&' an entity, attributes quoted; ids unique and every "#place" there; no
/// address but places in the page and data. Returns what is wrong; empty: nothing.
inline std::string fault_of(const std::string& page) {
  const std::string doctype = "<!DOCTYPE html>";
  if (page.rfind(doctype, 0) != 0) return "no doctype";
  std::vector<std::string> open;
  std::set<std::string> ids, places;
  for (std::size_t i = doctype.size(); i < page.size(); ++i) {
    if (page[i] == '&') {
      const std::size_t end = page.find(';', i);
      if (end == std::string::npos || end - i > 6) return "bare & at " + page.substr(i, 20);
      for (std::size_t j = i + 1; j < end; ++j)
        if (!std::isalnum(static_cast<unsigned char>(page[j])) && page[j] != '#')
          return "bad entity at " + page.substr(i, 20);
    }
    if (page[i] == '>') return "bare > at " + page.substr(i, 20);
    if (page[i] != '<') continue;
    const std::size_t end = page.find('>', i);
    if (end == std::string::npos) return "tag without end";
    std::string tag = page.substr(i + 1, end - i - 1);
    i = end;
    if (tag[0] == '/') {
      if (open.empty() || open.back() != tag.substr(1)) return "</" + tag.substr(1) + "> closes another";
      open.pop_back();
      continue;
    }
    const bool closed = tag.back() == '/';
    if (closed) tag.pop_back();
    const std::string name = tag.substr(0, tag.find(' '));
    if (!closed) open.push_back(name);
    if (name == "script" || name == "link" || name == "iframe" || name == "base") return "tag " + name;
    for (std::size_t at = name.size(); at < tag.size();) {
      if (tag[at] != ' ') return "attributes of " + tag.substr(0, 60);
      const std::size_t equals = tag.find("=\"", at), quote = tag.find('"', equals + 2);
      if (equals == std::string::npos || quote == std::string::npos)
        return "attribute of " + tag.substr(0, 60);
      const std::string key = tag.substr(at + 1, equals - at - 1),
                        value = tag.substr(equals + 2, quote - equals - 2);
      if (key == "id" && !ids.insert(value).second) return "id " + value + " twice";
      if (key == "href" && value[0] == '#') places.insert(value.substr(1));
      if (key == "href" && value[0] != '#') return "link to " + value;
      if (key == "src" && value.rfind("data:image/", 0) != 0) return "picture from " + value.substr(0, 60);
      if (key == "style" || key == "srcset" || key.rfind("on", 0) == 0) return "attribute " + key;
      at = quote + 1;
    }
    if (name == "style") {  // no markup inside: on to its end
      const std::size_t style_end = page.find("</style>", i);
      const std::string sheet = page.substr(i, style_end - i);
      if (sheet.find("url(") != std::string::npos || sheet.find("@import") != std::string::npos)
        return "the style sheet loads something";
      i = style_end - 1;
    }
  }
  if (!open.empty()) return open.back() + " is not closed";
  for (const std::string& place : places)
    if (!ids.count(place)) return "no place " + place;
  return page.find("http:") != std::string::npos || page.find("https:") != std::string::npos ? "an address"
                                                                                             : "";
}

using Json = nlohmann::ordered_json;
using Place = Json::json_pointer;

inline void collect_places(const Json& json, const Place& here, std::vector<Place>& places) {
  if (!here.empty()) places.push_back(here);
  std::size_t row = 0;
  if (json.is_array())
    for (const Json& value : json) collect_places(value, here / row++, places);
  if (json.is_object())
    for (const auto& [key, value] : json.items()) collect_places(value, here / key, places);
}

}  // namespace bristle_test
