// Objects of the C interface behind the functions of PatchBatch, ExtendedPatches, BedBatch and JointFriction,
// for tests that both give the same bits.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <type_traits>
#include <utility>
#include <vector>

#include <bristle/bristle.h>
#include <bristle/bed.hpp>
#include <bristle/extended_patches.hpp>
#include <bristle/fields.hpp>
#include <bristle/joint_friction.hpp>
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
template <class To, class From, std::size_t n>
void to_c(To (&to)[n], const From (&from)[n]) {
  for (std::size_t i = 0; i < n; ++i) to_c(to[i], from[i]);
}
inline void to_c(bristle_snap_length& to, const bristle::SnapLength& from) {
  const bristle::Span<const double> table = from.table_values();
  to = {static_cast<std::uint32_t>(from.law()), static_cast<std::uint32_t>(table.size()),
        from.first_parameter(), from.second_parameter(), table.data()};
}
inline void to_c(bristle_lay& to, const bristle::Lay& from) {
  to = {from.angle, from.limit_ratio, from.stiffness_ratio, from.to_over_fro};
}
inline void to_c(const bristle_bed_cell*& to, const std::vector<bristle::BedCell>& from) {
  to = reinterpret_cast<const bristle_bed_cell*>(from.data());
}
///@}

/// @name Structs of C with the fields of those of C++.
///@{
#define BRISTLE_COPY(name, about) to_c(its.name, from.name);
inline bristle_batch_options c_struct(const bristle::BatchOptions& from) {
  bristle_batch_options its;
  REQUIRE(bristle_init_batch_options(&its, sizeof its) == BRISTLE_OK);
  its.threads = from.threads;
  its.isa = from.isa;
  return its;
}
inline bristle_patch_options c_struct(const bristle::PatchOptions& from) {
  bristle_patch_options its;
  REQUIRE(bristle_init_patch_options(&its, sizeof its) == BRISTLE_OK);
  BRISTLE_FIELDS_OF_PatchOptions(BRISTLE_COPY) return its;
}
inline bristle_material c_struct(const bristle::Material& from) {
  bristle_material its;
  REQUIRE(bristle_init_material(&its, sizeof its) == BRISTLE_OK);
  BRISTLE_FIELDS_OF_Material(BRISTLE_COPY) return its;
}
inline bristle_joint_options c_struct(const bristle::JointOptions& from) {
  bristle_joint_options its;
  REQUIRE(bristle_init_joint_options(&its, sizeof its) == BRISTLE_OK);
  BRISTLE_FIELDS_OF_JointOptions(BRISTLE_COPY) return its;
}
template <class Part>
void copy_to_bed(bristle_bed& its, const Part& from) {
  if constexpr (std::is_same_v<Part, bristle::BedMaterial>) {
    BRISTLE_FIELDS_OF_BedMaterial(BRISTLE_COPY)
  } else if constexpr (std::is_same_v<Part, bristle::BedShape>) {
    BRISTLE_FIELDS_OF_BedShape(BRISTLE_COPY) its.list_count = from.list.size();
  } else {
    BRISTLE_FIELDS_OF_BedOptions(BRISTLE_COPY)
  }
}
#undef BRISTLE_COPY
///@}

/// Makes a step that writes a report in C. Returns the report in C++.
template <class Step>
bristle::StepReport c_report(Step&& step) {
  bristle_step_report report{};
  report.struct_size = sizeof report;
  REQUIRE(step(&report) == BRISTLE_OK);
  bristle::StepReport its;
  its.status = static_cast<bristle::Status>(report.status);
  its.patches_stepped = report.patches_stepped;
  its.tasks = report.tasks;
  its.threads = report.threads;
  its.bristles_visited = report.bristles_visited;
  return its;
}

/// Owns an object of the C interface, whose functions for its state are given.
template <class Object, auto destroy, auto hash, auto size, auto save, auto restore>
class CObject {
 public:
  template <class Id = bristle::PatchId>
  std::uint64_t state_hash([[maybe_unused]] Id id = {}) const {
    if constexpr (std::is_invocable_v<decltype(hash), Object*>)
      return hash(get());
    else
      return hash(get(), id.value);
  }
  std::size_t state_size() const { return size(get()); }
  std::size_t save_state(bristle::Span<std::byte> to) const { return save(get(), to.data(), to.size()); }
  void restore_state(bristle::Span<const std::byte> from) {
    REQUIRE(restore(get(), from.data(), from.size()) == BRISTLE_OK);
  }
  Object* get() const { return object_.get(); }

 protected:
  template <class Create>
  explicit CObject(Create&& create) {
    Object* made = nullptr;
    REQUIRE(create(&made) == BRISTLE_OK);
    object_.reset(made);
  }

 private:
  struct Destroy {
    void operator()(Object* object) const { destroy(object); }
  };
  std::unique_ptr<Object, Destroy> object_;
};

class CBatch : public CObject<bristle_batch, bristle_destroy, bristle_state_hash, bristle_state_size,
                              bristle_save_state, bristle_restore_state> {
 public:
  explicit CBatch(const bristle::BatchOptions& options)
      : CObject([its = c_struct(options)](bristle_batch** made) { return bristle_create(&its, made); }) {}

  bristle::PatchId add(const bristle::Material& material, const bristle::PatchOptions& options) {
    const bristle_patch_options its = c_struct(options);
    const bristle_material made_of = c_struct(material);
    bristle_id id = 0;
    REQUIRE(bristle_add(get(), &made_of, &its, &id) == BRISTLE_OK);
    seed_and_key_[id] = {options.seed, options.key};
    return {id};
  }
  bristle::PatchGroup add_group(const bristle::Material& material, const bristle::PatchOptions& options,
                                std::size_t count) {
    const bristle_patch_options its = c_struct(options);
    const bristle_material made_of = c_struct(material);
    bristle_group group;
    REQUIRE(bristle_add_group(get(), &made_of, &its, count, &group) == BRISTLE_OK);
    for (std::uint32_t i = 0; i < group.count; ++i)
      seed_and_key_[group.first + i] = {options.seed + i, options.key + i};
    return {{group.first}, group.count};
  }
  void set_material(bristle::PatchId id, const bristle::Material& material) {
    const bristle_material its = c_struct(material);
    REQUIRE(bristle_set_material(get(), id.value, &its) == BRISTLE_OK);
  }
  void set_material(const bristle::PatchGroup& group, const bristle::Material& material) {
    const bristle_material its = c_struct(material);
    REQUIRE(bristle_set_group_material(get(), {group.first.value, group.count}, &its) == BRISTLE_OK);
  }
  void warm_up() { REQUIRE(bristle_warm_up(get()) == BRISTLE_OK); }

  bristle::StepReport step(double dt, const std::vector<bristle::Motion>& in,
                           std::vector<bristle::Response>& out) {
    return c_report([&](bristle_step_report* report) {
      return bristle_step(get(), dt, reinterpret_cast<const bristle_motion*>(in.data()),
                          sizeof(bristle_motion), reinterpret_cast<bristle_response*>(out.data()),
                          sizeof(bristle_response), in.size(), report);
    });
  }
  bristle::StepReport step(double dt, const bristle::GroupStep& group) {
    const bristle_group_step its = c_step(group);
    return c_report([&](bristle_step_report* report) {
      return bristle_step_groups(get(), dt, &its, 1, nullptr, sizeof(bristle_motion), nullptr,
                                 sizeof(bristle_response), 0, report);
    });
  }
  bristle::Response find_force(double dt, const bristle::Motion& in) const {
    bristle::Response out;
    REQUIRE(bristle_find_force(get(), dt, reinterpret_cast<const bristle_motion*>(&in),
                               sizeof(bristle_motion), reinterpret_cast<bristle_response*>(&out),
                               sizeof(bristle_response), 1) == BRISTLE_OK);
    return out;
  }
  bristle::StepReport find_force(double dt, const bristle::GroupStep& group) const {
    const bristle_group_step its = c_step(group);
    return c_report(
        [&](bristle_step_report* report) { return bristle_find_group_force(get(), dt, &its, report); });
  }
  void reset(bristle::PatchId id) {
    const auto [seed, key] = seed_and_key_.at(id.value);
    reset(id, seed, key);
  }
  void reset(bristle::PatchId id, std::uint32_t seed, std::uint64_t key) {
    REQUIRE(bristle_reset(get(), id.value, seed, key) == BRISTLE_OK);
  }

 private:
  static bristle_group_step c_step(const bristle::GroupStep& from) {
    bristle_group_step its;
    REQUIRE(bristle_init_group_step(&its, sizeof its) == BRISTLE_OK);
    its.group = {from.group.first.value, from.group.count};
    for (int axis = 0; axis < 2; ++axis) {
      its.displacement[axis] = from.displacement[axis].data();
      its.velocity[axis] = from.velocity[axis].data();
      its.end[axis] = from.end[axis].data();
      its.elastic[axis] = from.elastic[axis].data();
      its.damper[axis] = from.damper[axis].data();
      its.mean[axis] = from.mean[axis].data();
    }
    its.normal_load = from.normal_load.data();
    if (from.which) its.which = from.which->data(), its.which_count = from.which->size();
    its.stiffness = from.stiffness.data();
    its.damping = from.damping.data();
    its.force_limit = from.force_limit.data();
    its.dissipated = from.dissipated.data();
    its.contact_loss = from.contact_loss.data();
    its.damper_work = from.damper_work.data();
    its.snaps = from.snaps.data();
    its.status = reinterpret_cast<std::uint32_t*>(from.status.data());
    return its;
  }
  std::map<bristle_id, std::pair<std::uint32_t, std::uint64_t>> seed_and_key_;  // which a reset keeps
};

/// Outlines, which the C interface cannot reset.
class COutlines : public CObject<bristle_extended, bristle_extended_destroy, bristle_extended_state_hash,
                                 bristle_extended_state_size, bristle_extended_save_state,
                                 bristle_extended_restore_state> {
 public:
  explicit COutlines(const CBatch& batch)
      : CObject([&](bristle_extended** made) { return bristle_extended_create(batch.get(), made); }) {}

  bristle::PatchId add(const bristle::Material& material, const bristle::PatchOptions& options,
                       const bristle::Outline& outline) {
    const bristle_patch_options its = c_struct(options);
    const bristle_material made_of = c_struct(material);
    bristle_id id = 0;
    REQUIRE(bristle_extended_add(get(), &made_of, &its,
                                 reinterpret_cast<const bristle_cell*>(outline.cells.data()),
                                 outline.cells.size(), outline.full_size_load, &id) == BRISTLE_OK);
    return {id};
  }
  void set_material(bristle::PatchId id, const bristle::Material& material) {
    const bristle_material its = c_struct(material);
    REQUIRE(bristle_extended_set_material(get(), id.value, &its) == BRISTLE_OK);
  }
  bristle::StepReport step(double dt, const std::vector<bristle::ExtendedMotion>& in,
                           std::vector<bristle::ExtendedResponse>& out) {
    return c_report([&](bristle_step_report* report) {
      return bristle_extended_step(get(), dt, reinterpret_cast<const bristle_extended_motion*>(in.data()),
                                   reinterpret_cast<bristle_extended_response*>(out.data()), in.size(),
                                   report);
    });
  }
  bristle::ExtendedResponse find_force(double dt, const bristle::ExtendedMotion& in) const {
    bristle::ExtendedResponse out;
    REQUIRE(bristle_extended_find_force(get(), dt, reinterpret_cast<const bristle_extended_motion*>(&in),
                                        reinterpret_cast<bristle_extended_response*>(&out), 1) == BRISTLE_OK);
    return out;
  }
  void reset(bristle::PatchId) {}
};

class CBeds : public CObject<bristle_beds, bristle_beds_destroy, bristle_beds_state_hash,
                             bristle_beds_state_size, bristle_beds_save_state, bristle_beds_restore_state> {
 public:
  explicit CBeds(const bristle::BatchOptions& options)
      : CObject([its = c_struct(options)](bristle_beds** made) { return bristle_beds_create(&its, made); }) {}

  bristle::BedId add(const bristle::BedMaterial& material, const bristle::BedShape& shape,
                     const bristle::BedOptions& options) {
    bristle_bed its;
    REQUIRE(bristle_init_bed(&its, sizeof its) == BRISTLE_OK);
    copy_to_bed(its, material);
    copy_to_bed(its, shape);
    copy_to_bed(its, options);
    bristle::BedId id;
    REQUIRE(bristle_beds_add(get(), &its, &id.value) == BRISTLE_OK);
    return id;
  }
  bristle::StepReport step(const std::vector<bristle::BedMotion>& in,
                           std::vector<bristle::BedResponse>& out) {
    return c_report([&](bristle_step_report* report) {
      return bristle_beds_step(get(), reinterpret_cast<const bristle_bed_motion*>(in.data()),
                               reinterpret_cast<bristle_bed_response*>(out.data()), in.size(), report);
    });
  }
  bristle::BedResponse find_force(const bristle::BedMotion& in) const {
    bristle::BedResponse out;
    REQUIRE(bristle_beds_find_force(get(), reinterpret_cast<const bristle_bed_motion*>(&in),
                                    reinterpret_cast<bristle_bed_response*>(&out), 1) == BRISTLE_OK);
    return out;
  }
  void reset(bristle::BedId id) { REQUIRE(bristle_beds_reset(get(), id.value) == 1); }
};

class CJoints
    : public CObject<bristle_joints, bristle_joints_destroy, bristle_joints_state_hash,
                     bristle_joints_state_size, bristle_joints_save_state, bristle_joints_restore_state> {
 public:
  CJoints(std::size_t count, bristle::Span<const bristle::JointMaterial> materials,
          const bristle::JointOptions& options, const bristle::BatchOptions& batch)
      : CObject([&](bristle_joints** made) {
          const bristle_joint_options its = c_struct(options);
          const bristle_batch_options of_batch = c_struct(batch);
          return bristle_joints_create(count,
                                       reinterpret_cast<const bristle_joint_material*>(materials.data()),
                                       materials.size(), &its, &of_batch, made);
        }) {}

  bristle::StepReport step(const bristle::JointInput& in, const bristle::JointOutput& out) {
    const bristle_joint_step its = c_step(in, out);
    return c_report([&](bristle_step_report* report) { return bristle_joints_step(get(), &its, report); });
  }
  bristle::StepReport find_torque(const bristle::JointInput& in, const bristle::JointOutput& out) const {
    const bristle_joint_step its = c_step(in, out);
    return c_report(
        [&](bristle_step_report* report) { return bristle_joints_find_torque(get(), &its, report); });
  }
  void reset() { REQUIRE(bristle_joints_reset(get()) == BRISTLE_OK); }

 private:
  static bristle_joint_step c_step(const bristle::JointInput& in, const bristle::JointOutput& out) {
    const auto status = reinterpret_cast<std::uint32_t*>(out.status.data());
    return {sizeof(bristle_joint_step),
            in.angle.data(),
            in.speed.data(),
            in.motor.data(),
            in.outside.data(),
            out.torque.data(),
            out.mean.data(),
            out.by_angle.data(),
            out.by_speed.data(),
            out.by_motor.data(),
            out.by_outside.data(),
            out.gradient.data(),
            status};
  }
};

}  // namespace bristle_test
