// `bristle report`: reports of other commands and their pictures as one HTML page to open and to mail.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tools/reports/html_page.hpp"

namespace cli {

struct ReportOptions {
  std::vector<std::string> files;  ///< JSON reports; pictures, PNG or SVG
  std::string out = "report.html";
};

struct Picture {
  std::string file, media_type, bytes;
};

struct Measurement {
  std::string file;
  nlohmann::ordered_json json;
  std::vector<Picture> pictures;  ///< of the same name: capacity.json, capacity.png
};

struct ReportInput {
  std::vector<Measurement> capacity, accuracy, stability;
  std::vector<Picture> pictures;  ///< that belong to none
};

/// Throws UserError.
ReportInput read_report_input(const std::vector<std::string>& files);
/// The four questions that people bring, and what the reports say to them.
std::vector<Answer> report_answers(const ReportInput& input);
/// The page; `written` says when. Throws UserError where a report lacks what its schema promises.
std::string report_page(const ReportInput& input, const std::string& written);
void report_command(const ReportOptions& options);

/// Parts of the page, each from one JSON report; nlohmann::json::exception where it lacks something. `id`
/// begins the names of places in the page.
void add_capacity(HtmlPage& page, const std::string& id, const Measurement& capacity);
void add_accuracy(HtmlPage& page, const std::string& id, const Measurement& accuracy);
void add_stability(HtmlPage& page, const std::string& id, const Measurement& stability);
/// Summary in lines for a reader in a hurry.
std::vector<std::string> capacity_summary(const nlohmann::ordered_json& capacity);
std::vector<std::string> accuracy_summary(const nlohmann::ordered_json& accuracy);
std::vector<std::string> stability_summary(const nlohmann::ordered_json& stability);

}  // namespace cli
