// A batch of the C interface behind the functions of PatchBatch, for tests that both give the same bits.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <utility>
#include <vector>

#include <bristle/bristle.h>
#include <bristle/fields.hpp>
#include <bristle/patch_batch.hpp>
#include <catch2/catch.hpp>

namespace bristle_test {

/// @name Copies a field of a C++ struct to that of the C struct.
///@{
inline void to_c(double& to, double from) { to = from; }
template <class Integer, class From>
void to_c(Integer& to, From from) {
  to = static_cast<Integer>(from);
}
inline void to_c(bristle_snap_length& to, const bristle::SnapLength& from) {
  const bristle::Span<const double> table = from.table_values();
  to = {static_cast<std::uint32_t>(from.law()), static_cast<std::uint32_t>(table.size()),
        from.first_parameter(), from.second_parameter(), table.data()};
}
inline void to_c(bristle_lay& to, const bristle::Lay& from) {
  to = {from.angle, from.limit_ratio, from.stiffness_ratio, from.to_over_fro};
}
///@}

class CBatch {
 public:
  explicit CBatch(const bristle::BatchOptions& options) {
    bristle_batch_options its;
    REQUIRE(bristle_init_batch_options(&its, sizeof its) == BRISTLE_OK);
    its.threads = options.threads;
    its.isa = options.isa;
    bristle_batch* made = nullptr;
    REQUIRE(bristle_create(&its, &made) == BRISTLE_OK);
    batch_.reset(made);
  }

  bristle::PatchId add(const bristle::Material& material, const bristle::PatchOptions& options) {
    bristle_patch_options its;
    REQUIRE(bristle_init_patch_options(&its, sizeof its) == BRISTLE_OK);
#define BRISTLE_COPY(name, about) to_c(its.name, options.name);
    BRISTLE_FIELDS_OF_PatchOptions(BRISTLE_COPY)
#undef BRISTLE_COPY
        const bristle_material made_of = material_of(material);
    bristle_id id = 0;
    REQUIRE(bristle_add(batch_.get(), &made_of, &its, &id) == BRISTLE_OK);
    seed_and_key_[id] = {options.seed, options.key};
    return {id};
  }
  void set_material(bristle::PatchId id, const bristle::Material& material) {
    const bristle_material its = material_of(material);
    REQUIRE(bristle_set_material(batch_.get(), id.value, &its) == BRISTLE_OK);
  }
  void warm_up() { REQUIRE(bristle_warm_up(batch_.get()) == BRISTLE_OK); }

  bristle::StepReport step(double dt, const std::vector<bristle::Motion>& in,
                           std::vector<bristle::Response>& out) {
    bristle_step_report report{};
    report.struct_size = sizeof report;
    REQUIRE(bristle_step(batch_.get(), dt, reinterpret_cast<const bristle_motion*>(in.data()),
                         sizeof(bristle_motion), reinterpret_cast<bristle_response*>(out.data()),
                         sizeof(bristle_response), in.size(), &report) == BRISTLE_OK);
    bristle::StepReport its;
    its.status = static_cast<bristle::Status>(report.status);
    its.patches_stepped = report.patches_stepped;
    its.tasks = report.tasks;
    its.threads = report.threads;
    its.bristles_visited = report.bristles_visited;
    return its;
  }
  bristle::Response find_force(double dt, const bristle::Motion& in) const {
    bristle::Response out;
    REQUIRE(bristle_find_force(batch_.get(), dt, reinterpret_cast<const bristle_motion*>(&in),
                               sizeof(bristle_motion), reinterpret_cast<bristle_response*>(&out),
                               sizeof(bristle_response), 1) == BRISTLE_OK);
    return out;
  }
  void reset(bristle::PatchId id) {
    const auto [seed, key] = seed_and_key_.at(id.value);
    REQUIRE(bristle_reset(batch_.get(), id.value, seed, key) == BRISTLE_OK);
  }
  std::uint64_t state_hash(bristle::PatchId id = {}) const {
    return bristle_state_hash(batch_.get(), id.value);
  }
  std::size_t state_size() const { return bristle_state_size(batch_.get()); }
  std::size_t save_state(bristle::Span<std::byte> to) const {
    return bristle_save_state(batch_.get(), to.data(), to.size());
  }
  void restore_state(bristle::Span<const std::byte> from) {
    REQUIRE(bristle_restore_state(batch_.get(), from.data(), from.size()) == BRISTLE_OK);
  }

 private:
  struct Destroy {
    void operator()(bristle_batch* batch) const { bristle_destroy(batch); }
  };
  static bristle_material material_of(const bristle::Material& material) {
    bristle_material its;
    REQUIRE(bristle_init_material(&its, sizeof its) == BRISTLE_OK);
#define BRISTLE_COPY(name, about) to_c(its.name, material.name);
    BRISTLE_FIELDS_OF_Material(BRISTLE_COPY)
#undef BRISTLE_COPY
        return its;
  }
  std::unique_ptr<bristle_batch, Destroy> batch_;
  std::map<bristle_id, std::pair<std::uint32_t, std::uint64_t>> seed_and_key_;  // which a reset keeps
};

}  // namespace bristle_test
