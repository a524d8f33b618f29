// The fields of a joint's material by the names that scenes and Python give them.
#pragma once

#include <cstddef>
#include <string>
#include <type_traits>

#include <bristle/fields.hpp>

namespace cli {

/// Calls visit(name, about, count) for each field of a joint's material; those of its losses stand one by
/// one, `base` and `static_base`. `count`: the field's numbers, which follow each other in JointParameter.
template <class Visit>
void for_each_joint_field(const Visit& visit) {
  using bristle::JointLosses, bristle::JointMaterial;
  bristle::for_each_field<JointMaterial>([&](const auto& field) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(field.member)>, double JointMaterial::*>) {
      visit(std::string(field.name), field.about, std::size_t{1});
    } else {
      const std::string prefix = field.name == std::string("kinetic") ? "" : "static_";
      bristle::for_each_field<JointLosses>([&](const auto& loss) {
        visit(prefix + loss.name, loss.about, sizeof(JointLosses{}.*loss.member) / sizeof(double));
      });
    }
  });
}

}  // namespace cli
