// Measures one patch on one thread: what a step costs with each feature, law of the snap length and
// instruction set.
#include "measured_scene.hpp"
#include "suites.hpp"

namespace bristle_bench {

namespace {

constexpr Regime regimes[] = {stick, presliding, all_snap};

/// Registers a benchmark of each feature with 4096 bristles, which fit the first-level cache, so that memory
/// does not hide the cost.
void register_features() {
  for (SnapRule rule : rules()) {
    for (int axes : axes_counts()) {
      for (Outputs outputs : output_sets()) {
        for (Precision precision : bristle_test::precisions()) {
          for (const Regime& regime : regimes) {
            OnePatchCase what;
            what.regime = regime;
            what.rule = rule;
            what.axes = axes;
            what.outputs = outputs;
            what.precision = precision;
            add_one_patch_benchmark(std::string("feature/") + name_of(rule) + '/' + std::to_string(axes) +
                                        "axes/" + name_of(outputs) + '/' + name_of(precision) + '/' +
                                        regime.name,
                                    what);
          }
        }
      }
    }
  }
}

void register_laws() {
  const double quantiles[] = {0.5 * dbar, 0.8 * dbar, 1.0 * dbar, 1.2 * dbar, 1.5 * dbar};
  const std::pair<const char*, SnapLength> laws[] = {
      {"single", SnapLength::single(dbar)},
      {"uniform", usual_law()},
      {"normal_cv0.2", SnapLength::normal(dbar, 0.2 * dbar)},
      {"lognormal_cv0.1", SnapLength::lognormal(dbar, 0.1)},
      {"lognormal_cv0.3", SnapLength::lognormal(dbar, 0.3)},
      {"lognormal_cv1", SnapLength::lognormal(dbar, 1.0)},
      {"exponential", SnapLength::exponential(dbar)},
      {"table", SnapLength::table(quantiles)},
  };
  for (SnapRule rule : rules()) {
    for (const auto& [name, law] : laws) {
      for (const Regime& regime : {presliding, all_snap}) {
        OnePatchCase what;
        what.regime = regime;
        what.regime.motion = regime.step < 0.1 ? "0.01 dbar a step one way" : "1.5 dbar a step one way";
        what.rule = rule;
        what.law = law;
        add_one_patch_benchmark(std::string("law/") + name_of(rule) + '/' + name + '/' + regime.name, what);
      }
    }
  }
}

void register_instruction_sets() {
  for (const bristle::IsaInfo& isa : bristle::instruction_sets()) {
    if (!isa.usable) continue;
    for (SnapRule rule : rules()) {
      for (const Regime& regime : regimes) {
        OnePatchCase what;
        what.regime = regime;
        what.rule = rule;
        what.batch.isa = isa.name;
        add_one_patch_benchmark(std::string("isa/") + name_of(rule) + '/' + regime.name + '/' + isa.name,
                                what);
      }
    }
  }
}

}  // namespace

void register_kernels() {
  register_features();
  register_laws();
  register_instruction_sets();
}

}  // namespace bristle_bench
