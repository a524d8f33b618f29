// Writes reports of `bristle fit`: table, JSON, CSV, TOML, picture. Schema: tools/libraries/reports/JSON.md.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <sstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <bristle/fields.hpp>

#include "tools/libraries/files/gnuplot.hpp"
#include "tools/libraries/files/one_line.hpp"
#include "tools/libraries/files/output_file.hpp"
#include "tools/libraries/files/text_file.hpp"
#include "tools/libraries/files/user_error.hpp"
#include "tools/libraries/fitting/fit.hpp"
#include "tools/libraries/fitting/fit_plot_script.hpp"  // made by CMake from tools/plots/fit.gp
#include "tools/libraries/fitting/joint.hpp"
#include "tools/libraries/fitting/judge.hpp"
#include "tools/libraries/fitting/least_squares.hpp"
#include "tools/libraries/reports/conditions.hpp"
#include "tools/libraries/reports/html_page.hpp"
#include "tools/libraries/reports/numbers.hpp"
#include "tools/libraries/reports/table.hpp"
#include "tools/libraries/reports/text_layout.hpp"
#include "tools/libraries/scene/snap_law.hpp"

namespace cli {
namespace {

using Json = nlohmann::ordered_json;

struct Row {
  const char* name;
  const char* unit;
  double per_si;
  const char* key;  ///< name of the parameter in JSON and Python
};
/// Rows of the report: the parameters in the order of FitParameter, then peak and stiffness.
constexpr Row rows[fit_report_rows] = {{"kinetic", "", 1.0, "kinetic"},
                                       {"presliding_length", "um", 1e6, "presliding_length"},
                                       {"spread", "", 1.0, "spread"},
                                       {"residual_share", "", 1.0, "residual_share"},
                                       {"shared_renewal", "", 1.0, "shared_renewal"},
                                       {"stage softening", "um/N^2", 1e6, "stage_softening"},
                                       {"viscous_friction", "N s/m", 1.0, "viscous_friction"},
                                       {"damping_per_newton", "s/m", 1.0, "damping_per_newton"},
                                       {"stribeck_velocity", "mm/s", 1e3, "stribeck_velocity"},
                                       {"sensor delay", "ms", 1e3, "sensor_delay"},
                                       {"sensor offset", "N", 1.0, "sensor_offset"},
                                       {"sensor drift", "N/s", 1.0, "sensor_drift"},
                                       {"sensor offset y", "N", 1.0, "sensor_offset_y"},
                                       {"sensor drift y", "N/s", 1.0, "sensor_drift_y"},
                                       {"peak", "", 1.0, "peak"},
                                       {"stiffness / load", "1/mm", 1e-3, "stiffness_per_newton"}};

/// Longest plausible presliding length, m.
constexpr double longest_presliding = 5e-3;

const char* start_text(StartState start, unsigned axes) {
  if (start == StartState::straight) return "straight";
  const bool forward = start == StartState::forward;
  if (axes == 2) return forward ? "sliding along the first motion" : "sliding against the first motion";
  return forward ? "sliding towards +x" : "sliding towards -x";
}

const char* sign_text(ForceSign sign) { return sign == ForceSign::on_body ? "on" : "by"; }

/// Returns the time step with which a scene replays the record: the sampling interval or a whole fraction of
/// it, at most 1 ms.
std::string replay_dt(const FitData& data) {
  return fmt::format("{:.9g}", data.sample_time / std::ceil(data.sample_time / 1e-3 - 1e-9));
}

/// Draws measured and fitted force into a file, by gnuplot with a built-in script that contains the samples.
void draw(const FitData& data, const FitResult& result, const std::vector<ModelForce>& beside, bool vectors,
          const std::string& picture, const char* option) {
  const std::string names = [&] {
    std::string out;
    for (const ModelForce& rival : beside) out += rival.model + ' ';
    return out;
  }();
  const std::string script =
      fmt::format("$samples << END\n{}END\ncsv='$samples'\npng={}\nsvg={}\ntitle={}\nrivals={}\n{}",
                  fit_csv(data, result, beside), gnuplot_file(picture), vectors ? 1 : 0,
                  gnuplot_string(one_line(data.columns.name)), gnuplot_string(names), fit_plot_script);
  run_gnuplot(script, option);
}

/// Returns an HTML page with the reports and, for a record of one axis, the picture. `unfinished`: file name
/// that the picture may use meanwhile.
std::string page(const FitData& data, const FitResult& result, const std::vector<ModelForce>& beside,
                 const std::string& reports, const std::string& unfinished) {
  std::string picture;
  if (data.axes == 1) {
    draw(data, result, beside, true, unfinished, "--html");
    picture = read_text_file(unfinished);
    picture.erase(0, picture.find("<svg"));  // leaves out the declaration of XML, which HTML does not allow
  }
  return html_page(data.columns.name, reports, picture);
}

}  // namespace

bool concerns(const FitData& data, const FitResult& r, std::size_t row) {
  if (row == fit_offset_y || row == fit_drift_y) return data.axes == 2;
  if (row == fit_softening) return data.axes == 1;
  return row < fit_parameters || report_estimate(r, row).fitted;
}

const char* fit_name(std::size_t row) { return rows[row].key; }

const FitEstimate& report_estimate(const FitResult& r, std::size_t row) {
  if (row < fit_parameters) return r.estimates[row];
  const FitEstimate* const follow[] = {&r.peak, &r.stiffness};
  return *follow[row - fit_parameters];
}

/// Returns the sentence that says how well the brush fits, with the first two fitted parameters.
static std::string fit_answer(const FitData& data, const FitResult& r) {
  std::string found;
  std::size_t fitted = 0;
  for (std::size_t i = 0; i < fit_report_rows; ++i) {
    const FitEstimate& e = report_estimate(r, i);
    if (!e.fitted || !concerns(data, r, i) || ++fitted > 2) continue;
    const double k = rows[i].per_si;
    found +=
        fmt::format("{}{} {:.4g}{}{} ({:.4g} to {:.4g})", fitted > 1 ? ", " : "", rows[i].name, k * e.value,
                    rows[i].unit[0] != '\0' ? " " : "", rows[i].unit, k * e.low, k * e.high);
  }
  const double length = r.estimates[fit_length].value, kinetic = r.estimates[fit_kinetic].value;
  const bool odd_length = r.estimates[fit_length].fitted && !(length > 0.2e-6 && length < longest_presliding);
  // Takes a load given as 1 N as no load: the number `kinetic` is then a force (N) or a torque.
  const bool odd_kinetic = r.estimates[fit_kinetic].fitted && !(kinetic > 0.01 && kinetic < 1.5) &&
                           !(data.steady_load && data.mean_load == 1.0);
  // Takes a force that follows the position over more than the longest presliding length as no presliding.
  const bool springs = !r.estimates[fit_kinetic].fitted && data.range > longest_presliding;
  if (fitted > 2) found += fmt::format(", and {} more below", fitted - 2);
  return fmt::format(
      "{}{}{}{}The brush explains {:.2f} % of the force and is off by {:.3g} N rms where it was not "
      "fitted{}{}.\n\n",
      odd_length
          ? fmt::format(
                "A presliding length of {:.3g} um is implausible (solids: 1 to 100, skin and rubber up to "
                "1000): check the unit of x (--units x=mm). ",
                1e6 * length)
          : "",
      odd_kinetic
          ? fmt::format(
                "A kinetic coefficient of {:.3g} is unusual (most solids 0.05 to 0.8, rubber and skin "
                "up to 1.5): check the unit of the load, {:.4g} N on average (--units load=mN). ",
                kinetic, data.mean_load)
          : "",
      springs
          ? fmt::format("The force follows the position over {:.3g} mm, farther than presliding goes, and "
                        "not the direction of motion: a spring, or columns of different records. ",
                        1e3 * data.range)
          : "",
      r.explained < 0.5 ? "Not a fit to build on. " : "", 100.0 * r.explained, r.held_out_rms,
      found.empty() ? "" : ": ", found);
}

std::string fit_table(const FitData& data, const FitResult& r) {
  std::string text = fit_answer(data, r);
  text += fmt::format(
      "data        {} samples over {:.4g} s ({:.4g} Hz), {} reversals, {:.4g} mm travelled in a range of "
      "{:.4g} mm\n",
      count_text(data.samples()), data.length(), 1.0 / data.sample_time, data.reversals, 1e3 * data.travelled,
      1e3 * data.range);
  text +=
      fmt::format("            {:.3g} to {:.3g} mm/s, load {:.4g} N{}{}\n", 1e3 * data.slow, 1e3 * data.fast,
                  data.mean_load, data.steady_load ? " (taken as constant)" : " on average",
                  data.quantum > 0.0 ? fmt::format(", encoder of {:.3g} um", 1e6 * data.quantum) : "");
  for (std::size_t i = 0; i < data.columns.understood.size(); ++i)
    text += fmt::format("{:<12}{}\n", i == 0 ? "read" : "", data.columns.understood[i]);
  text +=
      fmt::format("force       {} the body ({}); bristles at the first sample: {}\n", sign_text(data.sign),
                  data.sign_found ? "found from the data" : "as given", start_text(r.past.start, data.axes));
  text += fmt::format("law         {}, rule {}\n\n", bristle::to_string(r.law), to_string(r.rule));
  Table table({"<parameter", "value", "95 % from", "to", "<unit"});
  for (std::size_t i = 0; i < fit_report_rows; ++i) {
    const FitEstimate& e = report_estimate(r, i);
    if (!e.fitted || !concerns(data, r, i)) continue;
    const double k = rows[i].per_si;
    table.add({rows[i].name, fmt::format("{:.4g}", k * e.value), fmt::format("{:.4g}", k * e.low),
               fmt::format("{:.4g}", k * e.high), rows[i].unit});
  }
  text += table.text();
  text += "\nnot determined by these data, held at what fits\n";
  Table left({"<", ">", "<", "<"});
  for (std::size_t i = 0; i < fit_report_rows; ++i) {
    const FitEstimate& e = report_estimate(r, i);
    if (e.fitted || !concerns(data, r, i)) continue;
    left.add({std::string("  ") + rows[i].name, fmt::format("{:.4g}", rows[i].per_si * e.value), rows[i].unit,
              e.why});
  }
  left.add({"  bristles_per_newton", "900", "1/N", "the mean force does not depend on it"});
  std::string lines = left.text();
  text += lines.substr(lines.find('\n') + 1);
  text += fmt::format(
      "\nresiduals   {:.3g} N rms, {:.3g} N where not fitted to (held out in fifths);\n"
      "            intervals count {:.1f} samples, whose errors are alike, as one\n"
      "            the brush explains {:.2f} % of the force\n",
      r.residual_rms, r.held_out_rms, r.correlated_samples, 100.0 * r.explained);
  for (std::size_t i = 0; i < r.notes.size(); ++i)
    text += fmt::format("{:<12}{}\n", i == 0 ? "notes" : "", r.notes[i]);
  return text;
}

namespace {

constexpr std::size_t most_shown = 1500;  // limit of samples that a report's curve has

/// Selects evenly spaced samples for a drawing, including the first and the last sample of each joined file.
std::vector<std::size_t> shown_samples(const FitColumns& c) {
  const std::size_t n = c.t.size(), every = (n + most_shown - 1) / most_shown;
  std::vector<std::size_t> samples;
  for (std::size_t i = 0; i < n; ++i)
    if (i % every == 0 || i + 1 == n || !c.follows(i) || !c.follows(i + 1)) samples.push_back(i);
  return samples;
}

Json taken(const std::vector<double>& values, const std::vector<std::size_t>& samples, std::size_t from = 0) {
  Json out = Json::array();
  for (const std::size_t i : samples) out.push_back(values[from + i]);
  return out;
}

/// Returns the prepared data and the fitted force as JSON arrays.
Json curves(const FitData& data, const FitResult& r) {
  const std::vector<std::size_t> samples = shown_samples(data.columns);
  const std::size_t n = data.samples();
  Json out = {{"t_s", taken(data.columns.t, samples)},
              {"x_m", taken(data.columns.x, samples)},
              {"load_n", taken(data.load, samples)},
              {"force_n", taken(data.force, samples)},
              {"fit_n", taken(r.curve, samples)}};
  if (data.axes == 2) {
    out["y_m"] = taken(data.columns.y, samples);
    out["force_y_n"] = taken(data.force, samples, n);
    out["fit_y_n"] = taken(r.curve, samples, n);
  }
  return out;
}

}  // namespace

std::string fit_json(const FitData& data, const FitResult& r) {
  Json report;
  report["schema"] = "bristle-fit-1";
  report["conditions"] = to_json(conditions());
  report["data"] = {{"file", data.columns.name},
                    {"samples", data.samples()},
                    {"axes", data.axes},
                    {"length_s", data.length()},
                    {"sample_time_s", data.sample_time},
                    {"reversals", data.reversals},
                    {"travelled_m", data.travelled},
                    {"range_m", data.range},
                    {"slow_m_per_s", data.slow},
                    {"fast_m_per_s", data.fast},
                    {"encoder_step_m", data.quantum},
                    {"mean_load_n", data.mean_load},
                    {"steady_load", data.steady_load},
                    {"sign", sign_text(data.sign)},
                    {"sign_found", data.sign_found},
                    {"ignored_columns", data.columns.ignored_columns},
                    {"understood", data.columns.understood},
                    {"files", data.columns.parts.size() + 1}};
  report["law"] = bristle::to_string(r.law);
  if (r.law == bristle::SnapLaw::table) {
    const auto quantiles = r.material.snap_length.table_values();
    report["lengths_m"] = std::vector<double>(quantiles.begin(), quantiles.end());
  }
  report["rule"] = to_string(r.rule);
  report["start"] = start_text(r.past.start, data.axes);
  for (std::size_t i = 0; i < fit_report_rows; ++i) {
    if (!concerns(data, r, i)) continue;
    const FitEstimate& e = report_estimate(r, i);
    Json entry = {{"value", e.value}, {"determined", e.fitted}};
    if (e.fitted) {
      entry["low"] = e.low;
      entry["high"] = e.high;
    } else if (!e.why.empty()) {
      entry["why"] = e.why;
    }
    report["parameters"][fit_name(i)] = entry;
  }
  report["notes"] = r.notes;
  report["residuals"] = {{"rms_n", r.residual_rms},
                         {"held_out_rms_n", r.held_out_rms},
                         {"explained", r.explained},
                         {"correlated_samples", r.correlated_samples}};
  report["curves"] = curves(data, r);
  return report.dump(2, ' ', false, Json::error_handler_t::replace) + '\n';
}

std::string fit_csv(const FitData& data, const FitResult& r, const std::vector<ModelForce>& beside) {
  fmt::memory_buffer out;
  const auto to = std::back_inserter(out);
  const std::size_t n = data.samples();
  const bool planar = data.axes == 2;
  out.append(std::string_view(planar ? "t,x,y,load,fx,fy,fit_x,fit_y,residual_x,residual_y"
                                     : "t,x,load,force,fit,residual"));
  for (const ModelForce& rival : beside) fmt::format_to(to, ",{}", rival.model);
  out.push_back('\n');
  for (std::size_t i = 0; i < n; ++i) {
    const FitColumns& c = data.columns;
    fmt::format_to(to, "{:.9g},{:.9g},", c.t[i], c.x[i]);
    if (planar) {
      fmt::format_to(to, "{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}", c.y[i], data.load[i],
                     data.force[i], data.force[i + n], r.curve[i], r.curve[i + n], data.force[i] - r.curve[i],
                     data.force[i + n] - r.curve[i + n]);
    } else {
      const double residual =
          !r.left_out.empty() && r.left_out[i] ? std::nan("") : data.force[i] - r.curve[i];
      fmt::format_to(to, "{:.9g},{:.9g},{:.9g},{:.9g}", data.load[i], data.force[i], r.curve[i], residual);
    }
    for (const ModelForce& rival : beside) fmt::format_to(to, ",{:.9g}", rival.force[i]);
    out.push_back('\n');
  }
  return fmt::to_string(out);
}

namespace {

/// Returns the name of the motion file that is written beside a scene. Empty if no scene is written to disk,
/// or if the data file is a motion file itself.
std::string motion_file(const FitOptions& options) {
  if (options.write.empty() || options.write == "-") return {};
  return std::filesystem::path(options.write).replace_extension().string() + "_motion.csv";
}

}  // namespace

std::string fit_motion(const FitData& data) {
  const FitColumns& c = data.columns;
  const bool planar = c.planar(), with_load = c.has_load;
  std::string text = fmt::format("t,x{}{}\n", planar ? ",y" : "", with_load ? ",load" : "");
  // Jump of the position, m, from one joined file to the next; it is no motion of the body, so it is removed.
  double jump_x = 0.0, jump_y = 0.0;
  for (std::size_t i = 0; i < c.t.size(); ++i) {
    if (i > 0 && !c.follows(i)) {
      jump_x += c.x[i] - c.x[i - 1];
      if (planar) jump_y += c.y[i] - c.y[i - 1];
    }
    text += fmt::format("{:.12g},{:.12g}", c.t[i], c.x[i] - jump_x);
    if (planar) text += fmt::format(",{:.12g}", c.y[i] - jump_y);
    if (with_load) text += fmt::format(",{:.12g}", c.load[i]);
    text += '\n';
  }
  return text;
}

namespace {

/// Writes the numbers and choices of a struct of parameters that differ from their defaults as TOML. Leaves
/// out the peak, which follows from the spread or the drop, so that each coefficient can be changed alone.
template <class Parameters>
std::string fields_text(const Parameters& p) {
  std::string text;
  bristle::for_each_field<Parameters>([&](const auto& field) {
    using Value = std::decay_t<decltype(p.*field.member)>;
    if constexpr (std::is_enum_v<Value> || std::is_same_v<Value, double>) {
      const std::string_view name = field.name;
      const Value value = p.*field.member;
      if (name == "peak" || value == Parameters{}.*field.member) return;
      text += fmt::format("{} = ", name == "snap_rule" ? "rule" : name);
      if constexpr (std::is_enum_v<Value>)
        text += fmt::format("\"{}\"\n", field.about.names[static_cast<std::size_t>(value)]);
      else
        text += fmt::format("{}{}{}\n", value, field.about.unit[0] != '\0' ? "  # " : "", field.about.unit);
    }
  });
  return text;
}

/// Writes a material as TOML: by its coefficients or, for a law of snap lengths that these cannot express, by
/// the parameters of its bristles.
std::string material_text(const bristle::Material& m) {
  if (m.snap_length.law() == bristle::SnapLaw::table) {
    const auto quantiles = m.snap_length.table_values();
    return fields_text(m) + fmt::format("snap_length = {{ law = \"table\", quantiles = [{}] }}  # m\n",
                                        fmt::join(quantiles.begin(), quantiles.end(), ", "));
  }
  const bristle::Coefficients c = m.coefficients();
  const bool needs_peak = c.rule != bristle::SnapRule::slide && c.spread == 0.0;
  return fields_text(c) +
         (needs_peak ? fmt::format("peak_over_kinetic = {}\n", std::max(c.peak / c.kinetic, 1.0)) : "");
}

}  // namespace

std::string fit_toml(const FitData& data, const FitOptions& options, const FitResult& r) {
  std::string text = fmt::format(
      "# A material fitted to {}: copy [[material]] into a scene, or replay the measurement with\n"
      "# `bristle run` on this file. The report of the fit:\n",
      std::filesystem::path(data.columns.name).filename().string());
  std::istringstream report(fit_table(data, r));
  for (std::string line; std::getline(report, line);) text += "# " + line + '\n';
  // Highest normal load of the replayed motion, N. It may exceed the load of the fit, which is the mean if
  // the fit took the load as constant.
  double most_load = data.mean_load;
  if (data.columns.has_load && !options.load)
    most_load = *std::max_element(data.columns.load.begin(), data.columns.load.end());
  text += "\n[[material]]\nname = \"fitted\"\n" + material_text(r.material);
  const bool own_file = !data.columns.replayable && motion_file(options) != "";
  const bool replays = data.columns.replayable || own_file;
  text += fmt::format(
      "\n[scene]\nname = \"fitted\"\ndt = {}  # s\n{}\n[[patch]]\nname = \"body\"\nmaterial = \"fitted\"\n"
      "max_normal_load = {}  # N\naxes = {}\n\n[[motion]]\npatch = \"body\"\n",
      replay_dt(data), replays ? "" : fmt::format("duration = {}  # s\n", data.length()), 1.001 * most_load,
      data.axes);
  if (replays) {
    namespace fs = std::filesystem;
    std::error_code error;
    const fs::path folder = options.write == "-" ? fs::path(".") : fs::path(options.write).parent_path();
    const std::string motion = own_file ? motion_file(options) : data.columns.name;
    const fs::path file = fs::proximate(fs::path(motion), folder.empty() ? fs::path(".") : folder, error);
    text += fmt::format("type = \"trace\"\nfile = '{}'\n", error ? motion : file.string());
  } else {
    text += fmt::format("type = \"ramp\"\nvelocity = {}  # m/s\n", data.fast);
  }
  if (!replays || !data.columns.has_load || options.load)
    text += fmt::format("load = {}  # N\n", data.mean_load);
  return text;
}

namespace {

std::vector<FileOption> inputs_of(const FitOptions& options) {
  std::vector<FileOption> inputs;
  for (const std::string& data : options.data) inputs.push_back({"DATA", data});
  return inputs;
}

/// Judges the brush beside its rivals.
Judgements judge_record(const FitOptions& options) {
  OutputFile json(options.json);
  const FitColumns columns = read_fit_columns(options.data, options.reading);
  if (columns.t.empty()) throw UserError(columns.name + ": no data rows");
  Judgements judgements = judge_rivals(columns, options);
  if (json) json.write(judgement_json(columns, judgements));
  return judgements;
}

/// Fits the record and writes the output files that the options ask for. `judged`: report on rival models,
/// which the page includes; `rivals`: the forces of these models.
void fit_record(const FitOptions& options, bool prints, const std::string& judged,
                const std::vector<ModelForce>& rivals) {
  const FitData data = prepare_fit_data(read_fit_columns(options.data, options.reading), options.sign,
                                        options.load, options.mass);
  if (!options.plot.empty() && data.axes == 2)
    throw UserError("--plot: draws records of one axis; take --csv for one in the plane");
  OutputFile scene(options.write), csv(options.csv), picture(options.plot), json(options.json),
      html(options.html), page_picture(options.html.empty() ? std::string() : options.html + ".svg"),
      motion(data.columns.replayable ? std::string() : motion_file(options));
  const FitResult result = fit_material(data, options);
  if (scene) scene.write(fit_toml(data, options, result));
  if (motion) motion.write(fit_motion(data));
  if (csv) csv.write(fit_csv(data, result, rivals));
  if (picture) {
    draw(data, result, rivals, is_vector_picture(options.plot), picture.written_path(), "--plot");
    picture.finish();
  }
  if (html) {
    const std::string reports = judged + (judged.empty() ? "" : "\n") + fit_table(data, result);
    html.write(page(data, result, rivals, filled(reports), page_picture.written_path()));
  }
  if (json) json.write(fit_json(data, result));
  if (prints) print_report(fit_table(data, result));
}

}  // namespace

void fit_command(const FitOptions& options) {
  if (options.joint) return fit_joint_command(options);
  if (options.torque_constant || options.pendulum)
    throw UserError("--torque-constant and --pendulum: only with --joint");
  if (options.fit_until && !options.rivals) throw UserError("--fit-until: only with --rivals");
  for (const std::string& data : options.data)
    if (data.ends_with(".toml"))
      throw UserError(fmt::format(
          "{}: is a scene; fit reads measured friction (CSV with t, x, load, force); bristle run {}", data,
          data));
  check_picture_name("--plot", options.plot);
  stop_fits_on_signals();
  const bool on_stdout = check_files(inputs_of(options), {{"--json", options.json},
                                                          {"--csv", options.csv},
                                                          {"--html", options.html},
                                                          {"--write", options.write},
                                                          {"--plot", options.plot},
                                                          {"the motion of --write", motion_file(options)}});
  if (!options.rivals) return fit_record(options, !on_stdout, "", {});
  const Judgements judged = judge_record(options);
  const std::string table = judgement_table(judged);
  if (!on_stdout) print_report(table);
  FitOptions whole = options;  // writes no JSON file of the fit: that file holds the judgements
  whole.json.clear();
  whole.fit_until.reset();  // fits the whole record
  if (!whole.csv.empty() || !whole.html.empty() || !whole.write.empty() || !whole.plot.empty())
    fit_record(whole, false, table, judged.rivals);
}

}  // namespace cli
