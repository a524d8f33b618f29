// Objects of every kind that a batch steps (patches, groups, outlines, beds, joints) behind one small
// interface, for tests of what all kinds promise. Each object has three members, moved by a script.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bristle/bed.hpp"
#include "bristle/extended_patches.hpp"
#include "bristle/joint_friction.hpp"
#include "expect.hpp"
#include "infinite_brush.hpp"
#include "reseal.hpp"
#include "scenes.hpp"
#include "variants.hpp"

namespace bristle_test::contract {

constexpr std::size_t members = 3;

/// All outputs of one member for one step, as bits, and its status.
struct Answer {
  Status status = Status::ok;
  std::vector<std::uint64_t> bits;
  double excess = 0.0;  ///< elastic force over the highest that the member's load allows
  friend bool operator==(const Answer&, const Answer&) = default;
};
using Answers = std::vector<Answer>;  ///< one for each member

/// A way to spoil the motion of a member.
struct Spoilt {
  std::size_t member = 1;
  int number = 0;  ///< index of the input number that is replaced; -1: the member gets no motion at all
  double by = 0.0;
};

/// A batch of one kind, with three members at its end.
class Subject {
 public:
  virtual ~Subject() = default;
  virtual Answers step(int k, const Spoilt* spoilt = nullptr) = 0;  ///< does step k of the script
  virtual Answers find(int k) = 0;                                  ///< tries step k of the script
  virtual std::uint64_t hash() const = 0;
  virtual std::uint64_t hash(std::size_t member) const = 0;
  virtual std::vector<std::byte> save() const = 0;
  virtual std::size_t save(bristle::Span<std::byte> to) const = 0;
  virtual void restore(bristle::Span<const std::byte> from) = 0;
  /// Writes the checksums of a saved state whose other bytes were changed.
  virtual void seal(std::vector<std::byte>& state) const = 0;
  virtual void reset() = 0;
  virtual int numbers() const = 0;  ///< number of input numbers of a member

  void note(const bristle::StepReport& report) { most_tasks = std::max(most_tasks, report.tasks); }
  std::uint32_t most_tasks = 0;  ///< largest number of pieces into which a step was divided so far
};

struct Kind {
  std::string name;
  /// Makes an object of this kind. In front of its three members it gets `company` others, which must not
  /// change the results of the three.
  std::function<std::unique_ptr<Subject>(const BatchOptions&, std::size_t company)> make;
};

/// Returns the bits of numbers and of arrays of numbers.
template <class... T>
std::vector<std::uint64_t> bits_of(const T&... fields) {
  std::vector<std::uint64_t> bits;
  const auto put = [&](const auto& field, const auto& again) -> void {
    using Field = std::remove_cvref_t<decltype(field)>;
    if constexpr (std::is_array_v<Field>)
      for (const auto& element : field) again(element, again);
    else if constexpr (std::is_same_v<Field, double>)
      bits.push_back(std::bit_cast<std::uint64_t>(field));
    else
      bits.push_back(static_cast<std::uint64_t>(field));
  };
  (put(fields, put), ...);
  return bits;
}
/// Returns a force over its limit, 0 for no force under no load.
inline double excess_of(double x, double y, double limit) {
  const double force = std::hypot(x, y);
  return force == 0.0 ? 0.0 : force / limit;
}
inline Answer answer_of(const Response& r, double) {
  return {r.status,
          bits_of(r.end, r.elastic, r.damper, r.mean, r.stiffness, r.damping, r.force_limit, r.dissipated,
                  r.contact_loss, r.damper_work, r.snaps),
          excess_of(r.elastic[0], r.elastic[1], r.force_limit)};
}
inline Answer answer_of(const bristle::ExtendedResponse& r, double) {
  return {r.status,
          bits_of(r.end, r.elastic, r.damper, r.mean, r.stiffness, r.damping, r.force_limit, r.torque_limit,
                  r.dissipated, r.contact_loss, r.damper_work, r.snaps),
          excess_of(r.elastic[0], r.elastic[1], r.force_limit)};
}
inline Answer answer_of(const bristle::BedResponse& r, double normal_load) {
  constexpr double most_friction = 0.9;  // of the materials below
  return {
      r.status,
      bits_of(r.force, r.torque, r.mean, r.mean_torque, r.dissipated, r.stored, r.tangent, r.slipping_share),
      excess_of(r.force[0], r.force[1], most_friction * normal_load)};
}
/// @name The script: the motion of member `m` in step `k`, a function of these alone.
///@{
inline void write_script(Motion& to, std::size_t m, int k, int axes) {
  const PatchId id = to.id;
  to = scripted_motion(m, k, axes);
  to.id = id;
}
inline void write_script(bristle::ExtendedMotion& to, std::size_t m, int k, int) {
  const Motion flat = scripted_motion(m, k, 2);
  const double phase = k + 0.7 * static_cast<double>(m);
  to = {to.id, {flat.displacement[0], flat.displacement[1], 0.2 * std::sin(phase)}, flat.normal_load};
}
inline void write_script(bristle::BedMotion& to, std::size_t m, int k, int rolls) {
  const Motion flat = scripted_motion(m, k, 2);
  const double phase = k + 0.7 * static_cast<double>(m);
  to = {to.id,
        {30.0 * flat.displacement[0], 30.0 * flat.displacement[1]},
        k % 2 == 0 ? 0.1 * std::sin(phase) : 0.0,
        {rolls != 0 && k % 3 != 0 ? 1e-3 * std::cos(phase) : 0.0, 0.0},
        flat.normal_load};
}
///@}

/// @name Input numbers of a motion, in the order in which the structs have them.
///@{
inline std::vector<double*> numbers_of(Motion& m) {
  return {&m.displacement[0], &m.displacement[1], &m.normal_load};
}
inline std::vector<double*> numbers_of(bristle::ExtendedMotion& m) {
  return {&m.displacement[0], &m.displacement[1], &m.displacement[2], &m.normal_load};
}
inline std::vector<double*> numbers_of(bristle::BedMotion& m) {
  return {&m.displacement[0], &m.displacement[1], &m.spin, &m.rolled[0], &m.normal_load};
}
///@}

/// Common parts of patches, outlines and beds: members with ids, stepped by lists of motions.
template <class Batch, class Id, class MotionOf, class ResponseOf>
class Listed : public Subject {
 public:
  Answers step(int k, const Spoilt* spoilt) override {
    std::vector<MotionOf> in = script(k);
    if (spoilt != nullptr && spoilt->number < 0)
      in[spoilt->member].id = {};
    else if (spoilt != nullptr)
      *numbers_of(in[spoilt->member])[static_cast<std::size_t>(spoilt->number)] = spoilt->by;
    std::vector<ResponseOf> out(in.size());
    if constexpr (std::is_same_v<MotionOf, bristle::BedMotion>)
      note(batch().step(in, out));
    else
      note(batch().step(tick, in, out));
    return last(in, out);
  }
  Answers find(int k) override {
    const std::vector<MotionOf> in = script(k);
    std::vector<ResponseOf> out;
    for (const MotionOf& motion : in) {
      if constexpr (std::is_same_v<MotionOf, bristle::BedMotion>)
        out.push_back(batch().find_force(motion));
      else
        out.push_back(batch().find_force(tick, motion));
    }
    return last(in, out);
  }
  std::uint64_t hash() const override { return batch().state_hash(); }
  std::uint64_t hash(std::size_t member) const override { return batch().state_hash(ids_[first() + member]); }
  std::vector<std::byte> save() const override { return saved_state(batch()); }
  std::size_t save(bristle::Span<std::byte> to) const override { return batch().save_state(to); }
  void restore(bristle::Span<const std::byte> from) override { batch().restore_state(from); }
  void reset() override {
    for (const Id id : ids_) batch().reset(id);
  }
  int numbers() const override {
    MotionOf motion;
    return static_cast<int>(numbers_of(motion).size());
  }

 protected:
  virtual Batch& batch() const = 0;
  std::vector<Id> ids_;
  int way_ = 2;  ///< number of axes of a patch; whether a bed rolls

 private:
  std::size_t first() const { return ids_.size() - members; }
  /// Returns the motions of step k. Company moves as the members do, one step later.
  std::vector<MotionOf> script(int k) const {
    std::vector<MotionOf> in(ids_.size());
    for (std::size_t i = 0; i < ids_.size(); ++i) {
      in[i].id = ids_[i];
      write_script(in[i], i < first() ? i % members : i - first(), i < first() ? k + 1 : k, way_);
    }
    if (first() == 0) return in;
    std::swap(in.front(), in.back());  // another order of motions
    return in;
  }
  Answers last(const std::vector<MotionOf>& in, const std::vector<ResponseOf>& out) const {
    Answers answers;
    for (std::size_t m = first(); m < out.size(); ++m) {
      const std::size_t at = first() != 0 && m + 1 == out.size() ? 0 : m;  // where script() put its motion
      answers.push_back(answer_of(out[at], in[at].normal_load));
    }
    return answers;
  }
};

class Patches : public Listed<PatchBatch, PatchId, Motion, Response> {
 public:
  Patches(const BatchOptions& how, const Material& material, const PatchOptions& options, std::size_t company)
      : batch_(how) {
    way_ = options.axes;
    for (std::size_t i = 0; i < company + members; ++i)
      ids_.push_back(
          batch_.add(i % 2 == 0 || i >= company ? material : Material(material).with_viscous_friction(0.2),
                     PatchOptions(options).with_seed(7 + static_cast<std::uint32_t>((i - company) % 64))));
    batch_.warm_up();
  }

  void seal(std::vector<std::byte>& state) const override { reseal(state); }

 protected:
  PatchBatch& batch() const override { return batch_; }

 private:
  mutable PatchBatch batch_;
};

class Outlines
    : public Listed<bristle::ExtendedPatches, PatchId, bristle::ExtendedMotion, bristle::ExtendedResponse> {
 public:
  Outlines(const BatchOptions& how, const Material& material, const PatchOptions& options,
           const bristle::Outline& outline, std::size_t company)
      : patches_(how), batch_(patches_) {
    for (std::size_t i = 0; i < company + members; ++i)
      ids_.push_back(batch_.add(
          material, PatchOptions(options).with_seed(7 + static_cast<std::uint32_t>((i - company) % 64)),
          outline));
    patches_.warm_up();
  }

  void seal(std::vector<std::byte>& state) const override {
    const std::size_t own = state.size() - patches_.state_size();
    reseal({state.data(), own});
    reseal({state.data() + own, state.size() - own});
  }

 protected:
  bristle::ExtendedPatches& batch() const override { return batch_; }

 private:
  PatchBatch patches_;
  mutable bristle::ExtendedPatches batch_;
};

class Beds : public Listed<bristle::BedBatch, bristle::BedId, bristle::BedMotion, bristle::BedResponse> {
 public:
  Beds(const BatchOptions& how, const bristle::BedMaterial& material, const bristle::BedShape& shape,
       std::size_t company)
      : batch_(how) {
    way_ = shape.rolls ? 1 : 0;
    bristle::BedOptions options;
    options.max_normal_load = 2.0;
    for (std::size_t i = 0; i < company + members; ++i) ids_.push_back(batch_.add(material, shape, options));
  }

  void seal(std::vector<std::byte>& state) const override { reseal(state); }

 protected:
  bristle::BedBatch& batch() const override { return batch_; }

 private:
  mutable bristle::BedBatch batch_;
};

/// A group with every output; the members are its last three contacts. Their seeds are those that they would
/// have alone.
class Group : public Subject {
 public:
  Group(const BatchOptions& how, const Material& material, const PatchOptions& options, std::size_t company)
      : count_(company + members), axes_(options.axes), batch_(how) {
    const auto before = static_cast<std::uint32_t>(company);
    group_ = batch_.add_group(
        material, PatchOptions(options).with_seed(7u - before).with_key(0 - std::uint64_t{company}), count_);
    batch_.warm_up();
  }
  Answers step(int k, const Spoilt* spoilt) override { return go(k, spoilt, true); }
  Answers find(int k) override { return go(k, nullptr, false); }
  std::uint64_t hash() const override { return batch_.state_hash(); }
  std::uint64_t hash(std::size_t member) const override {
    return batch_.state_hash(group_[count_ - members + member]);
  }
  std::vector<std::byte> save() const override { return saved_state(batch_); }
  std::size_t save(bristle::Span<std::byte> to) const override { return batch_.save_state(to); }
  void restore(bristle::Span<const std::byte> from) override { batch_.restore_state(from); }
  void seal(std::vector<std::byte>& state) const override { reseal(state); }
  void reset() override {
    for (std::size_t i = 0; i < count_; ++i) batch_.reset(group_[i]);
  }
  int numbers() const override { return 3; }

 private:
  Answers go(int k, const Spoilt* spoilt, bool keep) {
    std::vector<double> in[3], out[14];
    for (std::vector<double>& column : in) column.resize(count_);
    for (std::vector<double>& column : out) column.resize(count_);
    std::vector<std::uint64_t> snaps(count_);
    std::vector<Status> status(count_);
    std::vector<std::uint32_t> which;
    const std::size_t first = count_ - members;
    const bool some = spoilt != nullptr && spoilt->number < 0;
    for (std::size_t i = 0; i < count_; ++i) {
      Motion motion;
      write_script(motion, i < first ? i % members : i - first, i < first ? k + 1 : k, axes_);
      if (spoilt != nullptr && !some && i == first + spoilt->member)
        *numbers_of(motion)[static_cast<std::size_t>(spoilt->number)] = spoilt->by;
      for (std::size_t c = 0; c < 3; ++c) in[c][i] = *numbers_of(motion)[c];
      if (some && i != first + spoilt->member) which.push_back(static_cast<std::uint32_t>(i));
    }
    bristle::GroupStep step;
    step.group = group_;
    if (some) step.which = which;
    for (std::size_t axis = 0; axis < 2; ++axis) {
      step.displacement[axis] = in[axis];
      step.end[axis] = out[axis];
      step.elastic[axis] = out[2 + axis];
      step.damper[axis] = out[4 + axis];
      step.mean[axis] = out[6 + axis];
    }
    step.normal_load = in[2];
    step.stiffness = out[8];
    step.damping = out[9];
    step.force_limit = out[10];
    step.dissipated = out[11];
    step.contact_loss = out[12];
    step.damper_work = out[13];
    step.snaps = snaps;
    step.status = status;
    note(keep ? batch_.step(tick, step) : batch_.find_force(tick, step));
    Answers answers;
    for (std::size_t i = first; i < count_; ++i) {
      Answer answer{status[i], {snaps[i]}};
      for (const std::vector<double>& column : out)
        answer.bits.push_back(std::bit_cast<std::uint64_t>(column[i]));
      answers.push_back(answer);
    }
    return answers;
  }
  std::size_t count_;
  int axes_;
  mutable PatchBatch batch_;
  bristle::PatchGroup group_;
};

/// Joints with every output; the members are the last three.
class Joints : public Subject {
 public:
  Joints(const BatchOptions& how, const bristle::JointMaterial& material, bool gradients, std::size_t company)
      : count_(company + members),
        gradients_(gradients),
        batch_(count_, {&material, 1}, options(gradients), how) {}
  Answers step(int k, const Spoilt* spoilt) override { return go(k, spoilt, true); }
  Answers find(int k) override { return go(k, nullptr, false); }
  std::uint64_t hash() const override { return batch_.state_hash(); }
  std::uint64_t hash(std::size_t member) const override {
    return batch_.state_hash(count_ - members + member);
  }
  std::vector<std::byte> save() const override { return saved_state(batch_); }
  std::size_t save(bristle::Span<std::byte> to) const override { return batch_.save_state(to); }
  void restore(bristle::Span<const std::byte> from) override { batch_.restore_state(from); }
  void seal(std::vector<std::byte>& state) const override { reseal(state); }
  void reset() override { batch_.reset(); }
  int numbers() const override { return 4; }

 private:
  static bristle::JointOptions options(bool gradients) {
    bristle::JointOptions options;
    options.gradients = gradients;
    return options;
  }
  Answers go(int k, const Spoilt* spoilt, bool keep) {
    std::vector<double> in[4];
    for (std::vector<double>& column : in) column.resize(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      const std::size_t m = i + members - count_;  // wraps for company, whose motions are its own
      std::mt19937_64 random(977u * m + static_cast<unsigned>(k));
      const auto flat = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
      in[0][i] = 2e-3 * k * flat() - 1e-3 * k;
      in[1][i] = 2.0 * flat() - 1.0;
      in[2][i] = 4.0 * flat() - 2.0;
      in[3][i] = 4.0 * flat() - 2.0;
    }
    // Every joint has an angle in every step: one that is no number is none.
    if (spoilt != nullptr)
      in[std::max(spoilt->number, 0)][count_ - members + spoilt->member] =
          spoilt->number < 0 ? std::numeric_limits<double>::quiet_NaN() : spoilt->by;
    std::vector<double> out[6], gradient(gradients_ ? bristle::joint_parameters * count_ : 0);
    for (std::vector<double>& column : out) column.resize(count_);
    std::vector<Status> status(count_);
    const bristle::JointInput from{in[0], in[1], in[2], in[3]};
    const bristle::JointOutput to{out[0], out[1], out[2], out[3], out[4], out[5], status, gradient};
    note(keep ? batch_.step(from, to) : batch_.find_torque(from, to));
    Answers answers;
    for (std::size_t i = count_ - members; i < count_; ++i) {
      constexpr double most_torque = 4.0;  // of the material below, under this script
      Answer answer{status[i], {}, std::abs(out[0][i]) / most_torque};
      for (const std::vector<double>& column : out)
        answer.bits.push_back(std::bit_cast<std::uint64_t>(column[i]));
      for (std::size_t p = i; p < gradient.size(); p += count_)
        answer.bits.push_back(std::bit_cast<std::uint64_t>(gradient[p]));
      answers.push_back(answer);
    }
    return answers;
  }
  std::size_t count_;
  bool gradients_;
  bristle::JointFriction batch_;
};

/// Returns one kind for each way in which an object can be built that the library keeps apart.
inline std::vector<Kind> all_kinds() {
  using bristle::Ageing, bristle::Lay, bristle::Outline, bristle::Population, bristle::Pressure;
  using bristle::BedGrowth, bristle::BedMaterial, bristle::BedPressure, bristle::BedShape;
  std::vector<Kind> kinds;
  const SnapLength law = SnapLength::lognormal(dbar, 0.3);
  const auto material = [&](SnapRule rule) {
    return plain_material(law, rule)
        .with_bristle_stiffness(80.0)
        .with_bristle_damping(0.01)
        .with_viscous_friction(0.3);
  };
  const auto rubbed = [&](SnapRule rule) {
    return material(rule)
        .with_residual_length(0.3 * dbar)
        .with_shared_renewal(rule == SnapRule::redraw ? 1.0 : 0.0);
  };
  const Ageing ages = Ageing::logarithmic(0.1, 0.3 * tick);
  const PatchOptions some = plain_options(90).with_max_normal_load(2.0), infinite = infinite_options(8.0);
  const PatchOptions thirty_two = plain_options(32).with_max_normal_load(2.0);
  const PatchOptions exact = plain_options(90, 2, precisions().back()).with_max_normal_load(2.0);
  const Lay lay = Lay{}.with_angle(0.5).with_limit_ratio(1.8);
  const auto patches = [&](const char* name, const Material& m, const PatchOptions& options) {
    kinds.push_back({name, [=](const BatchOptions& how, std::size_t company) -> std::unique_ptr<Subject> {
                       return std::make_unique<Patches>(how, m, options, company);
                     }});
  };
  patches("representatives, keep", material(SnapRule::keep), some);
  patches("representatives, redraw, one axis", material(SnapRule::redraw), PatchOptions(some).with_axes(1));
  patches("representatives, redraw, double", material(SnapRule::redraw), exact);
  patches("representatives, rubbed", rubbed(SnapRule::redraw), some);
  patches("representatives, ageing and rubbed", rubbed(SnapRule::redraw).with_ageing(ages), some);
  patches("representatives with a lay", material(SnapRule::redraw), PatchOptions(some).with_lay(lay));
  patches("representatives, strengthening", material(SnapRule::redraw).with_speed_strengthening(0.02, 1e-4),
          some);
  patches("infinite", material(SnapRule::redraw), infinite);
  patches("infinite, end force only", material(SnapRule::redraw),
          PatchOptions(infinite).with_outputs(Outputs::end));
  patches("infinite, rubbed", rubbed(SnapRule::redraw), infinite);
  patches("infinite, ageing and rubbed", rubbed(SnapRule::redraw).with_ageing(ages), infinite);
  patches("infinite with a lay", material(SnapRule::redraw), PatchOptions(infinite).with_lay(lay));
  patches("slide", material(SnapRule::slide), thirty_two);
  patches("slide, one axis", material(SnapRule::slide), PatchOptions(thirty_two).with_axes(1));
  patches("slide, drop and ageing", material(SnapRule::slide).with_drop(0.2).with_ageing(ages), thirty_two);
  patches("slide with a lay", material(SnapRule::slide), PatchOptions(thirty_two).with_lay(lay));
  patches("slide with a lay to and fro", material(SnapRule::slide),
          PatchOptions(thirty_two).with_lay(Lay(lay).with_to_over_fro(2.0)));

  const auto groups = [&](const char* name, const Material& m, const PatchOptions& options) {
    kinds.push_back({name, [=](const BatchOptions& how, std::size_t company) -> std::unique_ptr<Subject> {
                       return std::make_unique<Group>(how, m, options, company);
                     }});
  };
  groups("group, slide", material(SnapRule::slide), thirty_two);
  groups("group, slide without dampers", plain_material(law, SnapRule::slide), thirty_two);
  groups("group, slide, one axis, end force only", plain_material(law, SnapRule::slide),
         PatchOptions(thirty_two).with_axes(1).with_outputs(Outputs::end));
  groups("group, slide, drop and ageing", material(SnapRule::slide).with_drop(0.2).with_ageing(ages),
         thirty_two);
  groups("group, slide with a lay", material(SnapRule::slide), PatchOptions(thirty_two).with_lay(lay));
  groups("group, representatives", material(SnapRule::redraw), some);
  groups("group, infinite and rubbed", rubbed(SnapRule::redraw), infinite);

  const auto outlines = [&](const char* name, const Material& m, const PatchOptions& options,
                            const Outline& outline) {
    kinds.push_back({name, [=](const BatchOptions& how, std::size_t company) -> std::unique_ptr<Subject> {
                       return std::make_unique<Outlines>(how, m, options, outline, company);
                     }});
  };
  const Outline disc = Outline::disc(2e-4, Pressure::hertz, 2);
  outlines("outline of representatives", material(SnapRule::redraw), some, disc);
  outlines("outline, infinite", rubbed(SnapRule::redraw), infinite,
           Outline::rectangle(2e-4, 1e-4, Pressure::uniform).grow_with_load(1.5));
  outlines("outline, slide", material(SnapRule::slide).with_drop(0.2), thirty_two, disc);
  outlines("outline of one cell", material(SnapRule::redraw), infinite,
           Outline::disc(0.0, Pressure::uniform, 1));

  const auto beds = [&](const char* name, const BedMaterial& m, const BedShape& shape) {
    kinds.push_back({name, [=](const BatchOptions& how, std::size_t company) -> std::unique_ptr<Subject> {
                       return std::make_unique<Beds>(how, m, shape, company);
                     }});
  };
  const BedMaterial plain = BedMaterial(0.6).with_presliding(1e-4);
  beds("bed, sphere", plain, BedShape::sphere_row(20, 1e-3));
  beds("bed, growing ellipse", plain,
       BedShape::ellipse(2e-3, 1e-3, BedPressure::hertz).grown(BedGrowth::cube_root));
  beds("bed, list", plain, BedShape::from_list({{{0, 0}, 1, 1}, {{1e-3, 0}, 2, 1}, {{0, -1e-3}, 1, 3}}));
  beds("bed, wheel with drop", BedMaterial(0.9, 0.6).with_presliding(1e-4), BedShape::wheel_row(1e-3));
  beds("bed, rolling ellipse", plain,
       BedShape::ellipse(2e-3, 1e-3, BedPressure::hertz).rolling(12, 7).grown(BedGrowth::cube_root));
  beds("bed, tyre", BedMaterial(0.9, 0.8).with_slip_stiffness(9e4, 5e4),
       BedShape::rectangle(0.1, 0.08, BedPressure::parabolic).rolling(12, 3).grown(BedGrowth::square_root));

  bristle::JointMaterial gear;
  gear.stiffness = 300.0;
  gear.viscous = 0.03;
  gear.kinetic = {0.4, {0.12, 0.3}, {0.05, 0.08}};
  gear.static_part = {0.15, {0.04, 0.07}, {0.02, 0.03}};
  gear.stribeck_speed = 0.5;
  for (const bool gradients : {false, true})
    kinds.push_back({gradients ? "joints with gradients" : "joints",
                     [=](const BatchOptions& how, std::size_t company) -> std::unique_ptr<Subject> {
                       return std::make_unique<Joints>(how, gear, gradients, company);
                     }});
  return kinds;
}

}  // namespace bristle_test::contract
