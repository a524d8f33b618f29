// Objects of every kind that a batch steps (patches, groups, outlines, beds, joints) behind one small
// interface, for tests of what all kinds promise. A script moves the members of an object.
#pragma once

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "bristle/bed.hpp"
#include "bristle/extended_patches.hpp"
#include "bristle/joint_friction.hpp"
#include "c_batch.hpp"
#include "expect.hpp"
#include "infinite_brush.hpp"
#include "reseal.hpp"
#include "scenes.hpp"
#include "variants.hpp"

namespace bristle_test::contract {

constexpr std::size_t few = 3;  ///< number of members of most kinds

/// All outputs of one member for one step, as bits, and its status.
struct Answer {
  Status status = Status::ok;
  std::vector<std::uint64_t> bits;
  double excess = 0.0;  ///< elastic force over the highest that the member's load allows
  friend bool operator==(const Answer&, const Answer&) = default;
};
using Answers = std::vector<Answer>;  ///< one for each member

/// A means to spoil the motion of a member.
struct Spoilt {
  std::size_t member = 1;
  int number = 0;  ///< index of the input number that is replaced; -1: the member gets no motion at all
  double by = 0.0;
};

/// How a batch is made, which must not change what its members answer.
struct How {
  BatchOptions options = {};
  /// Number of others in front of the members. Some of them rest in every other step, and motions then come
  /// in any order.
  std::size_t company = 0;
  bool eager = false;        ///< whether every step visits every bristle
  std::uint32_t reseed = 0;  ///< if not 0, the first member's seed and key; each next one's are one higher
};

/// A batch of one kind, with its members at the end.
class Subject {
 public:
  virtual ~Subject() = default;
  virtual Answers step(int k, const Spoilt* spoilt = nullptr) = 0;  ///< does step k of the script
  virtual Answers find(int k, const Spoilt* spoilt = nullptr) = 0;  ///< tries step k of the script
  /// Does step k among motions of ids that are none and a second motion of the last member. Returns answers
  /// in the order of their motions: of an unknown id, of the members, of a repeated id, of two unknown ids;
  /// no answer for objects whose members have no ids.
  virtual Answers step_crowd(int) { return {}; }
  /// Does step k with `count` answers, whatever the number of motions.
  virtual Answers step_into(int, std::size_t /*count*/) { return {}; }
  virtual bool has_time() const { return true; }  ///< whether a step takes `dt`
  virtual void change() {}  ///< gives every member another material, where that is possible
  virtual std::uint64_t hash() const = 0;
  virtual std::uint64_t hash(std::size_t member) const = 0;
  virtual std::vector<std::byte> save() const = 0;
  virtual std::size_t save(bristle::Span<std::byte> to) const = 0;
  virtual void restore(bristle::Span<const std::byte> from) = 0;
  /// Writes the checksums of a saved state whose other bytes were changed.
  virtual void seal(std::vector<std::byte>& state) const = 0;
  virtual void reset() = 0;
  /// Resets every member with the seeds and keys of How::reseed, unless it has none.
  virtual bool reset_as(std::uint32_t /*reseed*/) { return false; }
  virtual bool can_reset() const { return true; }
  virtual int numbers() const = 0;  ///< number of input numbers of a member, of which the first is the load
  /// Returns values that an input number cannot have.
  virtual std::vector<double> bad_values(int number) const {
    std::vector<double> bad = {std::numeric_limits<double>::quiet_NaN(),
                               std::numeric_limits<double>::infinity(),
                               -std::numeric_limits<double>::infinity()};
    if (number == 0) bad.insert(bad.end(), {-1e-301, 1.1e15, 1e306});
    return bad;
  }

  double dt = tick;              ///< time of a step
  bristle::StepReport report;    ///< of the last step
  std::uint32_t most_tasks = 0;  ///< largest number of pieces into which a step was divided so far

 protected:
  void note(const bristle::StepReport& last) {
    report = last;
    most_tasks = std::max(most_tasks, report.tasks);
  }
};

using Maker = std::function<std::unique_ptr<Subject>(const How&)>;
struct Kind {
  std::string name;
  Maker make;
  Maker one_by_one = {};  ///< makes patches that must answer as the members of a group
  Maker in_c = {};        ///< makes the same by the C interface
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
/// Returns a force over its limit, 0 for no force under no load. A denormal force is none, as in a step.
inline double excess_of(double x, double y, double limit) {
  const double force = std::hypot(x, y);
  return force < std::numeric_limits<double>::min() ? 0.0 : force / limit;
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

/// Whether a member is in the midst of a steady slide, which some carry without a visit of their bristles.
inline bool slides(std::size_t m, int k) { return m % 2 == 0 && k % 40 >= 8 && k % 40 < 20; }

inline void write_script(Motion& to, std::size_t m, int k, int axes) {
  const PatchId id = to.id;
  to = scripted_motion(m, k, axes);
  to.id = id;
  to.has_velocity = k % 5 == 0;
  const bool rests = m % 2 == 1 && k % 40 >= 24 && k % 40 < 28;
  if (!slides(m, k) && !rests) return;
  to.displacement[0] = rests ? 0.0 : 4.0 * dbar;
  to.displacement[1] = 0.0;
  to.normal_load = k % 40 == 19 ? 1.8 : 1.7;
}
inline void write_script(bristle::ExtendedMotion& to, std::size_t m, int k, int) {
  Motion flat;
  write_script(flat, m, k, 2);
  const double phase = k + 0.7 * static_cast<double>(m);
  to = {to.id,
        {flat.displacement[0], flat.displacement[1], slides(m, k) ? 0.0 : 0.2 * std::sin(phase)},
        flat.normal_load,
        flat.has_velocity,
        {flat.velocity[0], flat.velocity[1], 0.1}};
}
inline void write_script(bristle::BedMotion& to, std::size_t m, int k, int rolls) {
  Motion flat;
  write_script(flat, m, k, 2);
  const double phase = k + 0.7 * static_cast<double>(m);
  to = {to.id,
        {30.0 * flat.displacement[0], 30.0 * flat.displacement[1]},
        k % 2 == 0 ? 0.1 * std::sin(phase) : 0.0,
        {rolls != 0 && k % 3 != 0 ? 1e-3 * std::cos(phase) : 0.0, 0.0},
        flat.normal_load};
}
///@}

/// @name Input numbers of a motion, the load first.
///@{
inline std::vector<double*> numbers_of(Motion& m) {
  return {&m.normal_load, &m.displacement[0], &m.displacement[1], &m.velocity[0], &m.velocity[1]};
}
inline std::vector<double*> numbers_of(bristle::ExtendedMotion& m) {
  return {&m.normal_load, &m.displacement[0], &m.displacement[1], &m.displacement[2],
          &m.velocity[0], &m.velocity[1],     &m.velocity[2]};
}
inline std::vector<double*> numbers_of(bristle::BedMotion& m) {
  return {&m.normal_load, &m.displacement[0], &m.displacement[1], &m.spin, &m.rolled[0]};
}
///@}

/// @name Numbers of a motion (by their index) that are beyond their range or have no place in a form: number
/// of axes of a patch, whether a bed rolls.
///@{
using Beyond = std::vector<std::pair<int, double>>;
inline Beyond beyond(const Motion&, int axes) { return axes == 1 ? Beyond{{2, 1e-9}, {4, 1e-3}} : Beyond{}; }
inline Beyond beyond(const bristle::ExtendedMotion&, int) { return {{3, 3.2}, {3, -4.0}}; }
inline Beyond beyond(const bristle::BedMotion&, int rolls) {
  return rolls == 0 ? Beyond{{1, 2e5}, {3, 4.0}, {4, 1e-3}} : Beyond{{1, 2e5}, {3, 4.0}};
}
///@}

/// Returns the indices of those that are named in step k, in the order of their motions.
inline std::vector<std::size_t> named_in(int k, std::size_t company, std::size_t all) {
  std::vector<std::size_t> named;
  for (std::size_t i = 0; i < all; ++i)
    if (i >= company || k % 2 == 0 || i % 3 != 0) named.push_back(i);
  if (company != 0) std::shuffle(named.begin(), named.end(), std::mt19937(static_cast<unsigned>(k)));
  return named;
}

/// Common parts of patches, outlines and beds: members with ids, stepped by lists of motions.
template <class Batch, class Id, class MotionOf, class ResponseOf>
class Listed : public Subject {
 public:
  Answers step(int k, const Spoilt* spoilt) override {
    const std::vector<std::size_t> named = named_in(k, company_, ids_.size());
    const std::vector<MotionOf> in = script(named, k, spoilt);
    const Answers all = step_all(in, in.size());
    Answers answers(ids_.size() - company_);
    for (std::size_t at = 0; at < named.size(); ++at)
      if (named[at] >= company_) answers[named[at] - company_] = all[at];
    return answers;
  }
  Answers step_crowd(int k) override {
    std::vector<std::size_t> members(ids_.size() - company_), company(company_);
    std::iota(members.begin(), members.end(), company_);
    std::iota(company.begin(), company.end(), std::size_t{0});
    std::vector<MotionOf> in = script(members, k, nullptr);
    MotionOf other = script({ids_.size() - 1}, k + 1, nullptr)[0];
    in.push_back(other);
    for (const std::uint64_t none :
         {other.id.value + (std::uint64_t{1} << 32), ~std::uint64_t{1}, std::uint64_t{0}}) {
      other.id = Id{none};
      in.insert(none == 0 ? in.begin() : in.end(), other);
    }
    const std::size_t count = in.size();
    for (const MotionOf& motion : script(company, k, nullptr)) in.push_back(motion);
    Answers answers = step_all(in, in.size());
    answers.resize(count);
    return answers;
  }
  Answers step_into(int k, std::size_t count) override {
    return step_all(script(named_in(0, company_, ids_.size()), k, nullptr), count);
  }
  bool has_time() const override { return !std::is_same_v<MotionOf, bristle::BedMotion>; }
  Answers find(int k, const Spoilt* spoilt) override {
    Answers answers;
    for (std::size_t i = company_; i < ids_.size(); ++i) {
      const MotionOf motion = script({i}, k, spoilt)[0];
      if constexpr (std::is_same_v<MotionOf, bristle::BedMotion>)
        answers.push_back(answer_of(batch().find_force(motion), motion.normal_load));
      else
        answers.push_back(answer_of(batch().find_force(this->dt, motion), motion.normal_load));
    }
    return answers;
  }
  std::uint64_t hash() const override { return batch().state_hash(); }
  std::uint64_t hash(std::size_t member) const override {
    return batch().state_hash(ids_[company_ + member]);
  }
  std::vector<std::byte> save() const override { return saved_state(batch()); }
  std::size_t save(bristle::Span<std::byte> to) const override { return batch().save_state(to); }
  void restore(bristle::Span<const std::byte> from) override { batch().restore_state(from); }
  void reset() override {
    for (const Id id : ids_) batch().reset(id);
  }
  bool reset_as(std::uint32_t reseed) override {
    if constexpr (requires(Batch & its, Id id) { its.reset(id, reseed, reseed); }) {
      for (const Id id : ids_) batch().reset(id, reseed, reseed), ++reseed;
      return true;
    }
    return false;
  }
  int numbers() const override {
    MotionOf motion;
    return static_cast<int>(numbers_of(motion).size());
  }
  std::vector<double> bad_values(int number) const override {
    std::vector<double> bad = Subject::bad_values(number);
    for (const auto& [its_number, x] : beyond(MotionOf{}, forms_[company_ + 1]))
      if (its_number == number) bad.push_back(x);
    return bad;
  }

 protected:
  explicit Listed(std::size_t company) : company_(company) {}
  virtual Batch& batch() const = 0;
  /// Adds one to the end. `form`: number of axes of a patch; whether a bed rolls.
  void append(Id id, int form) {
    ids_.push_back(id);
    forms_.push_back(form);
  }
  const std::vector<Id>& ids() const { return ids_; }

 private:
  Answers step_all(const std::vector<MotionOf>& in, std::size_t count) {
    std::vector<ResponseOf> out(count);
    if constexpr (std::is_same_v<MotionOf, bristle::BedMotion>)
      this->note(batch().step(in, out));
    else
      this->note(batch().step(this->dt, in, out));
    Answers answers;
    for (std::size_t i = 0; i < count; ++i)
      answers.push_back(answer_of(out[i], i < in.size() ? in[i].normal_load : 0.0));
    return answers;
  }
  /// Returns motions of step k. Company moves as the members do, one step later.
  std::vector<MotionOf> script(const std::vector<std::size_t>& named, int k, const Spoilt* spoilt) const {
    std::vector<MotionOf> in;
    for (const std::size_t i : named) {
      MotionOf motion;
      motion.id = ids_[i];
      write_script(motion, i < company_ ? i : i - company_, i < company_ ? k + 1 : k, forms_[i]);
      if (spoilt != nullptr && i == company_ + spoilt->member) {
        if (spoilt->number < 0)
          motion.id = {};
        else
          *numbers_of(motion)[static_cast<std::size_t>(spoilt->number)] = spoilt->by;
      }
      in.push_back(motion);
    }
    return in;
  }
  std::size_t company_;
  std::vector<Id> ids_;
  std::vector<int> forms_;
};

/// Returns the material that a patch gets when it changes, if nothing else is said.
inline Material changed(const Material& material) {
  return Material(material).with_bristle_stiffness(0.8 * material.bristle_stiffness);
}
/// Returns patches that differ in seed and key alone, as do those of a group.
inline std::vector<PatchCase> few_of(const Material& material, const PatchOptions& options) {
  std::vector<PatchCase> cases;
  for (std::uint32_t m = 0; m < few; ++m)
    cases.push_back({"", material, changed(material), PatchOptions(options).with_seed(7 + m).with_key(m)});
  return cases;
}

/// Makes a PatchBatch, or a CBatch, which is never eager.
template <class Batch>
Batch make_batch(const How& how) {
  if constexpr (std::is_same_v<Batch, PatchBatch>)
    return stepped_eagerly(how.options, how.eager);
  else
    return Batch(how.options);
}

/// Patches of a PatchBatch or of a CBatch.
template <class Batch>
class PatchesOf : public Listed<Batch, PatchId, Motion, Response> {
 public:
  PatchesOf(const How& how, const std::vector<PatchCase>& cases)
      : Listed<Batch, PatchId, Motion, Response>(how.company), batch_(make_batch<Batch>(how)) {
    for (std::size_t i = 0; i < how.company; ++i) {
      PatchCase c = cases[i % cases.size()];
      if (i % 2 == 0) c.material.with_viscous_friction(0.2);
      add(c);
    }
    std::uint32_t reseed = how.reseed;
    for (PatchCase c : cases) {
      if (reseed != 0) c.options.with_seed(reseed).with_key(reseed), ++reseed;
      add(c);
    }
    batch_.warm_up();
  }

  void change() override {
    for (std::size_t i = 0; i < later_.size(); ++i) batch_.set_material(this->ids()[i], later_[i]);
  }
  void seal(std::vector<std::byte>& state) const override { reseal(state); }

 protected:
  Batch& batch() const override { return batch_; }

 private:
  void add(const PatchCase& c) {
    this->append(batch_.add(c.material, c.options), c.options.axes);
    later_.push_back(c.later);
  }
  mutable Batch batch_;
  std::vector<Material> later_;
};
using Patches = PatchesOf<PatchBatch>;

/// Outlines over a PatchBatch or a CBatch.
template <class Cells, class Batch>
class OutlinesOf : public Listed<Batch, PatchId, bristle::ExtendedMotion, bristle::ExtendedResponse> {
 public:
  OutlinesOf(const How& how, const Material& material, const PatchOptions& options,
             const bristle::Outline& outline)
      : Listed<Batch, PatchId, bristle::ExtendedMotion, bristle::ExtendedResponse>(how.company),
        later_(changed(material)),
        patches_(make_batch<Cells>(how)),
        batch_(patches_) {
    for (std::size_t i = 0; i < how.company + few; ++i) {
      const auto m = static_cast<std::uint32_t>((i - how.company) % 64);
      PatchOptions its = PatchOptions(options).with_seed(7 + m);
      if (how.reseed != 0) its.with_seed(how.reseed + m).with_key(how.reseed + m);
      this->append(batch_.add(material, its, outline), 2);
    }
    patches_.warm_up();
  }

  void change() override {
    for (const PatchId id : this->ids()) batch_.set_material(id, later_);
  }
  void seal(std::vector<std::byte>& state) const override {
    const std::size_t own = state.size() - patches_.state_size();
    reseal({state.data(), own});
    reseal({state.data() + own, state.size() - own});
  }
  bool can_reset() const override { return std::is_same_v<Batch, bristle::ExtendedPatches>; }

 protected:
  Batch& batch() const override { return batch_; }

 private:
  Material later_;
  Cells patches_;
  mutable Batch batch_;
};

/// Beds of a BedBatch or of CBeds.
template <class Batch>
class BedsOf : public Listed<Batch, bristle::BedId, bristle::BedMotion, bristle::BedResponse> {
 public:
  BedsOf(const How& how, const bristle::BedMaterial& material, const bristle::BedShape& shape,
         bool all_outputs)
      : Listed<Batch, bristle::BedId, bristle::BedMotion, bristle::BedResponse>(how.company),
        batch_(how.options) {
    bristle::BedOptions options;
    options.max_normal_load = 2.0;
    options.all_outputs = all_outputs;
    options.longest_piece = 0.05;
    for (std::size_t i = 0; i < how.company + few; ++i)
      this->append(batch_.add(material, shape, options), shape.rolls ? 1 : 0);
  }

  void seal(std::vector<std::byte>& state) const override { reseal(state); }

 protected:
  Batch& batch() const override { return batch_; }

 private:
  mutable Batch batch_;
};

/// A group with every output; the members are its last three contacts. Their seeds and keys are those of
/// few_of().
template <class Batch>
class GroupOf : public Subject {
 public:
  GroupOf(const How& how, const Material& material, const PatchOptions& options)
      : count_(how.company + few),
        axes_(options.axes),
        later_(changed(material)),
        batch_(make_batch<Batch>(how)) {
    const auto before = static_cast<std::uint32_t>(how.company);
    PatchOptions its = PatchOptions(options).with_seed(7u - before).with_key(0 - std::uint64_t{how.company});
    if (how.reseed != 0) its.with_seed(how.reseed).with_key(how.reseed);
    group_ = batch_.add_group(material, its, count_);
    batch_.warm_up();
  }
  Answers step(int k, const Spoilt* spoilt) override { return go(k, spoilt, true); }
  Answers find(int k, const Spoilt* spoilt) override { return go(k, spoilt, false); }
  void change() override { batch_.set_material(group_, later_); }
  std::uint64_t hash() const override { return batch_.state_hash(); }
  std::uint64_t hash(std::size_t member) const override {
    return batch_.state_hash(group_[count_ - few + member]);
  }
  std::vector<std::byte> save() const override { return saved_state(batch_); }
  std::size_t save(bristle::Span<std::byte> to) const override { return batch_.save_state(to); }
  void restore(bristle::Span<const std::byte> from) override { batch_.restore_state(from); }
  void seal(std::vector<std::byte>& state) const override { reseal(state); }
  void reset() override {
    for (std::size_t i = 0; i < count_; ++i) batch_.reset(group_[i]);
  }
  bool reset_as(std::uint32_t reseed) override {
    for (std::size_t i = 0; i < count_; ++i, ++reseed) batch_.reset(group_[i], reseed, reseed);
    return true;
  }
  int numbers() const override { return inputs; }

 private:
  static constexpr int inputs = 5;

  Answers go(int k, const Spoilt* spoilt, bool keep) {
    std::vector<double> in[inputs], out[14];
    for (std::vector<double>& column : in) column.resize(count_);
    for (std::vector<double>& column : out) column.resize(count_);
    std::vector<std::uint64_t> snaps(count_);
    std::vector<Status> status(count_);
    std::vector<std::uint32_t> which;
    const std::size_t first = count_ - few;
    for (const std::size_t i : named_in(k, first, count_)) {
      Motion motion;
      write_script(motion, i < first ? i : i - first, i < first ? k + 1 : k, axes_);
      if (spoilt != nullptr && i == first + spoilt->member) {
        if (spoilt->number < 0) continue;
        *numbers_of(motion)[static_cast<std::size_t>(spoilt->number)] = spoilt->by;
      }
      for (std::size_t c = 0; c < inputs; ++c) in[c][i] = *numbers_of(motion)[c];
      which.push_back(static_cast<std::uint32_t>(i));
    }
    bristle::GroupStep step;
    step.group = group_;
    if (which.size() < count_) step.which = which;
    step.normal_load = in[0];
    for (std::size_t axis = 0; axis < 2; ++axis) {
      step.displacement[axis] = in[1 + axis];
      if (k % 5 == 0) step.velocity[axis] = in[3 + axis];  // as the script says
      step.end[axis] = out[axis];
      step.elastic[axis] = out[2 + axis];
      step.damper[axis] = out[4 + axis];
      step.mean[axis] = out[6 + axis];
    }
    step.stiffness = out[8];
    step.damping = out[9];
    step.force_limit = out[10];
    step.dissipated = out[11];
    step.contact_loss = out[12];
    step.damper_work = out[13];
    step.snaps = snaps;
    step.status = status;
    note(keep ? batch_.step(dt, step) : batch_.find_force(dt, step));
    Answers answers;
    for (std::size_t i = first; i < count_; ++i) {
      Answer answer{status[i], {}, excess_of(out[2][i], out[3][i], out[10][i])};
      for (const std::vector<double>& column : out)
        answer.bits.push_back(std::bit_cast<std::uint64_t>(column[i]));
      answer.bits.push_back(snaps[i]);
      answers.push_back(answer);
    }
    return answers;
  }
  std::size_t count_;
  int axes_;
  Material later_;
  mutable Batch batch_;
  bristle::PatchGroup group_;
};

/// Joints with every output; the members are the last three.
template <class Batch>
class JointsOf : public Subject {
 public:
  JointsOf(const How& how, const bristle::JointMaterial& material, bool gradients)
      : count_(how.company + few),
        gradients_(gradients),
        batch_(count_, {&material, 1}, options(gradients), how.options) {}
  Answers step(int k, const Spoilt* spoilt) override { return go(k, spoilt, true); }
  Answers find(int k, const Spoilt* spoilt) override { return go(k, spoilt, false); }
  std::uint64_t hash() const override { return batch_.state_hash(); }
  std::uint64_t hash(std::size_t member) const override { return batch_.state_hash(count_ - few + member); }
  std::vector<std::byte> save() const override { return saved_state(batch_); }
  std::size_t save(bristle::Span<std::byte> to) const override { return batch_.save_state(to); }
  void restore(bristle::Span<const std::byte> from) override { batch_.restore_state(from); }
  void seal(std::vector<std::byte>& state) const override { reseal(state); }
  void reset() override { batch_.reset(); }
  int numbers() const override { return 4; }
  bool has_time() const override { return false; }
  std::vector<double> bad_values(int number) const override {
    std::vector<double> bad = Subject::bad_values(1);
    if (number == 1) bad.push_back(1.1e6);   // angle
    if (number == 2) bad.push_back(1.1e15);  // speed
    return bad;
  }

 private:
  static bristle::JointOptions options(bool gradients) {
    bristle::JointOptions options;
    options.gradients = gradients;
    return options;
  }
  Answers go(int k, const Spoilt* spoilt, bool keep) {
    std::vector<double> in[4];  // the outside torque, which is a joint's load, the angle, speed and motor
    for (std::vector<double>& column : in) column.resize(count_);
    for (std::size_t i = 0; i < count_; ++i) {
      const std::size_t m = i + few - count_;  // wraps for company, whose motions are its own
      std::mt19937_64 random(977u * m + static_cast<unsigned>(k));
      const auto flat = [&] { return static_cast<double>(random() >> 11) * 0x1p-53; };
      in[1][i] = 2e-3 * k * flat() - 1e-3 * k;
      in[2][i] = 2.0 * flat() - 1.0;
      in[3][i] = 4.0 * flat() - 2.0;
      in[0][i] = 4.0 * flat() - 2.0;
    }
    // Every joint has an angle in every step: one that is no number is none.
    if (spoilt != nullptr)
      in[spoilt->number < 0 ? 1 : spoilt->number][count_ - few + spoilt->member] =
          spoilt->number < 0 ? std::numeric_limits<double>::quiet_NaN() : spoilt->by;
    std::vector<double> out[6], gradient(gradients_ ? bristle::joint_parameters * count_ : 0);
    for (std::vector<double>& column : out) column.resize(count_);
    std::vector<Status> status(count_);
    const bristle::JointInput from{in[1], in[2], in[3], in[0]};
    const bristle::JointOutput to{out[0], out[1], out[2], out[3], out[4], out[5], status, gradient};
    note(keep ? batch_.step(from, to) : batch_.find_torque(from, to));
    Answers answers;
    for (std::size_t i = count_ - few; i < count_; ++i) {
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
  Batch batch_;
};

/// Returns one kind for each form of object that the library keeps apart.
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
  const auto add = [&](const char* name, Maker make) { kinds.push_back({name, std::move(make)}); };
  const auto patches = [&](const char* name, const Material& m, const PatchOptions& options) {
    add(name, [=](const How& how) { return std::make_unique<Patches>(how, few_of(m, options)); });
    kinds.back().in_c = [=](const How& how) {
      return std::make_unique<PatchesOf<CBatch>>(how, few_of(m, options));
    };
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
  patches("infinite, double", rubbed(SnapRule::redraw),
          PatchOptions(infinite).with_precision(precisions().back()));
  patches("infinite, end force only", material(SnapRule::redraw),
          PatchOptions(infinite).with_outputs(Outputs::end));
  patches("infinite, rubbed", rubbed(SnapRule::redraw), infinite);
  patches("infinite, ageing and rubbed", rubbed(SnapRule::redraw).with_ageing(ages), infinite);
  patches("infinite with a lay", material(SnapRule::redraw), PatchOptions(infinite).with_lay(lay));
  patches("slide", material(SnapRule::slide), thirty_two);
  patches("slide, one axis", material(SnapRule::slide), PatchOptions(thirty_two).with_axes(1));
  patches("slide, drop and ageing", material(SnapRule::slide).with_drop(0.2).with_ageing(ages), thirty_two);
  patches("slide with a lay", material(SnapRule::slide), PatchOptions(thirty_two).with_lay(lay));
  patches("slide with a lay of another stiffness", material(SnapRule::slide),
          PatchOptions(thirty_two).with_lay(Lay(lay).with_stiffness_ratio(1.2)));
  patches("slide with a lay to and fro", material(SnapRule::slide),
          PatchOptions(thirty_two).with_lay(Lay(lay).with_to_over_fro(2.0)));

  const auto groups = [&](const char* name, const Material& m, const PatchOptions& options) {
    add(name, [=](const How& how) { return std::make_unique<GroupOf<PatchBatch>>(how, m, options); });
    kinds.back().in_c = [=](const How& how) { return std::make_unique<GroupOf<CBatch>>(how, m, options); };
    kinds.back().one_by_one = [=](const How& how) {
      return std::make_unique<Patches>(how, few_of(m, options));
    };
  };
  groups("group, slide", material(SnapRule::slide), thirty_two);
  groups("group, slide without dampers", plain_material(law, SnapRule::slide), thirty_two);
  groups("group, slide, one axis, end force only", plain_material(law, SnapRule::slide),
         PatchOptions(thirty_two).with_axes(1).with_outputs(Outputs::end));
  groups("group, slide, drop and ageing", material(SnapRule::slide).with_drop(0.2).with_ageing(ages),
         thirty_two);
  groups("group, slide with a lay", material(SnapRule::slide), PatchOptions(thirty_two).with_lay(lay));
  groups("group, slide, strengthening", material(SnapRule::slide).with_speed_strengthening(0.02, 1e-4),
         thirty_two);
  groups("group, representatives", material(SnapRule::redraw), some);
  groups("group, infinite and rubbed", rubbed(SnapRule::redraw), infinite);

  const auto outlines = [&](const char* name, const Material& m, const PatchOptions& options,
                            const Outline& outline) {
    add(name, [=](const How& how) {
      return std::make_unique<OutlinesOf<PatchBatch, bristle::ExtendedPatches>>(how, m, options, outline);
    });
    kinds.back().in_c = [=](const How& how) {
      return std::make_unique<OutlinesOf<CBatch, COutlines>>(how, m, options, outline);
    };
  };
  const Outline disc = Outline::disc(2e-4, Pressure::hertz, 2);
  outlines("outline of representatives", material(SnapRule::redraw), some, disc);
  outlines("outline, infinite", rubbed(SnapRule::redraw), infinite,
           Outline::rectangle(2e-4, 1e-4, Pressure::uniform).grow_with_load(1.5));
  outlines("outline, infinite, end force only", plain_material(law, SnapRule::redraw),
           PatchOptions(infinite).with_outputs(Outputs::end), disc);
  outlines("outline, slide", material(SnapRule::slide).with_drop(0.2), thirty_two, disc);
  outlines("outline of one cell", material(SnapRule::redraw), infinite,
           Outline::disc(0.0, Pressure::uniform, 1));

  const auto beds = [&](const char* name, const BedMaterial& m, const BedShape& shape, bool all = true) {
    add(name,
        [=](const How& how) { return std::make_unique<BedsOf<bristle::BedBatch>>(how, m, shape, all); });
    kinds.back().in_c = [=](const How& how) { return std::make_unique<BedsOf<CBeds>>(how, m, shape, all); };
  };
  const BedMaterial plain = BedMaterial(0.6).with_presliding(1e-4);
  beds("bed, sphere", plain, BedShape::sphere_row(20, 1e-3));
  beds("bed, growing ellipse", plain,
       BedShape::ellipse(2e-3, 1e-3, BedPressure::hertz).grown(BedGrowth::cube_root));
  beds("bed of moduli and a radius", BedMaterial(0.5).with_elastic(1e6, 0.3, 5e-3), BedShape::sphere_row(8));
  beds("bed of three flexibilities", BedMaterial(0.9).with_flexibility(2e-9, 3e-9, 1e-9),
       BedShape::rectangle(2e-3, 1e-3, BedPressure::hertz, 6, 3).rolling(6, 3));
  beds("bed, list", plain, BedShape::from_list({{{0, 0}, 1, 1}, {{1e-3, 0}, 2, 1}, {{0, -1e-3}, 1, 3}}));
  beds("bed, wheel with drop", BedMaterial(0.9, 0.6).with_presliding(1e-4), BedShape::wheel_row(1e-3));
  beds("bed, wheel, end force only", plain, BedShape::wheel_row(1e-3), false);
  beds("bed, sphere, end force only", plain, BedShape::sphere_row(20, 1e-3), false);
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
  for (const bool gradients : {false, true}) {
    add(gradients ? "joints with gradients" : "joints", [=](const How& how) {
      return std::make_unique<JointsOf<bristle::JointFriction>>(how, gear, gradients);
    });
    kinds.back().in_c = [=](const How& how) {
      return std::make_unique<JointsOf<CJoints>>(how, gear, gradients);
    };
  }
  return kinds;
}

/// Returns one kind whose members are patches of every variant: all rules, laws, precisions, axes and
/// outputs, many with a lay. `large`: whether some have 40,000 bristles.
inline Kind variants(std::uint32_t bristles, bool large = false) {
  std::vector<PatchCase> cases;
  for (PatchCase& c : every_variant_and_few_infinite(bristles, 3)) {
    const bool is_large = c.options.bristles >= 10000;
    if (is_large && !large) continue;
    const bool also_laid = c.options.axes == 2 && (is_large || cases.size() % 7 == 0);
    cases.push_back(std::move(c));
    if (!also_laid) continue;
    PatchCase laid = cases.back();
    laid.name += ", with a lay";
    laid.options.with_lay(bristle::Lay{}.with_angle(0.5).with_limit_ratio(1.8));
    cases.push_back(std::move(laid));
  }
  return {"variants",
          [=](const How& how) { return std::make_unique<Patches>(how, cases); },
          {},
          [=](const How& how) { return std::make_unique<PatchesOf<CBatch>>(how, cases); }};
}

inline std::vector<Kind> all_kinds_and_variants(bool large = false) {
  std::vector<Kind> kinds = all_kinds();
  kinds.push_back(variants(test_size(300), large));
  return kinds;
}

}  // namespace bristle_test::contract
